"""Pairs: what a block of scatterers makes of every leg out and every leg back, before it is heard.

The fast path goes from here straight to the recording; `records.arrivals` writes the same
content out row by row, for people and for tests. Under most laws that are quick the strength of a pair is a product of
what its legs contribute; then it is written out only for those who ask for it.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.records._pair_strengths_kernel import amplitude_weights, separable_strengths
from insonify.records.legs import Legs
from insonify.scene.scatterers import Scatterers

Floats = NDArray[np.float64]
Strengths = NDArray[np.float64] | NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class PairSampling:
    """At which of n scatterers each of p pairs is met: those whose number lies below the pair's share of them."""

    priority: NDArray[np.float32]
    """Of each scatterer's place, 0 to 1, shape (n,)."""
    range_bin: NDArray[np.uint8]
    """Of distance that each lies in, shape (n,)."""
    keep_probability: NDArray[np.float32]
    """Part of the scatterers of each stretch at which each pair is met, shape (p, stretches)."""

    @property
    def amplitude_weight(self) -> NDArray[np.float32]:
        """By what answers are louder for standing for others, 0 where a pair is not met [1], shape (p, n)."""
        amplitude_weight = np.empty((len(self.keep_probability), len(self.priority)), np.float32)
        amplitude_weights(self.priority, self.range_bin, self.keep_probability, amplitude_weight)
        return amplitude_weight


@dataclass(frozen=True)
class SeparableStrengths:
    """Strengths of p pairs at n scatterers whose cross section is one factor for each of two directions."""

    out: Legs
    """As of `Pairs`."""
    back: Legs
    """As of `Pairs`."""
    pair: NDArray[np.int64]
    """As of `Pairs`, shape (p, 2)."""
    direction_factor: Floats
    """What one direction contributes to the cross section, at even sines of its grazing angle from 0 to 1 [1]; lines
    between. Shape (2 or more,)."""
    root_area: Floats
    """Of the area that each point stands for [m], shape (n,)."""
    weight: Floats
    """What each pair counts for besides [1], shape (p,)."""
    sampling: PairSampling | None
    """Where each pair is met; None: everywhere."""

    @cached_property
    def strengths(self) -> Floats:
        """The strengths, written out [m], shape (p, n)."""
        one = self._of(self.out)
        other = (one if self.back is self.out else self._of(self.back)) * self.root_area
        made = np.empty((len(self.pair), len(self.root_area)))
        amplitude_weight = (
            np.empty((0, len(self.root_area)), np.float32) if self.sampling is None else self.sampling.amplitude_weight
        )
        separable_strengths(one, other, self.pair, amplitude_weight, made)
        if (self.weight != 1).any():
            made *= self.weight[:, None]
        return made

    def select(self, rows: NDArray[np.int64]) -> "SeparableStrengths":
        """Those of some pairs, given by their rows."""
        sampling = self.sampling
        some = (
            None
            if sampling is None
            else replace(sampling, keep_probability=np.ascontiguousarray(sampling.keep_probability[rows]))
        )
        return replace(self, pair=self.pair[rows], weight=self.weight[rows], sampling=some)

    def _of(self, legs: Legs) -> Floats:
        """Root of what each leg contributes to the cross section [1], shape (f, n)."""
        sine = np.sin(np.abs(legs.grazing))
        if len(self.direction_factor) == 2:  # a line, several times as quick as a table
            return np.sqrt(self.direction_factor[0] + (self.direction_factor[1] - self.direction_factor[0]) * sine)
        return np.sqrt(np.interp(sine, np.linspace(0, 1, len(self.direction_factor)), self.direction_factor))


@dataclass(frozen=True, slots=True)
class Pairs:
    """Legs out and legs back of n scatterers, and how strongly each ordered pair of them scatters."""

    scatterers: Scatterers
    out: Legs
    """From the transmitter to the scatterers."""
    back: Legs
    """From the receiver to the scatterers, travelled the other way."""
    pair: NDArray[np.int64]
    """Row of the leg out and of the leg back of each ordered pair, shape (p, 2)."""
    stored_strengths: Strengths | SeparableStrengths
    """Their strengths, or how these are made."""

    @property
    def strength(self) -> Strengths:
        """Pressure scattered to 1 m re incident pressure [m], shape (p, n).

        The root of cross section times area, or what a smooth facet sends back, which turns the phase.
        """
        return (
            self.stored_strengths.strengths
            if isinstance(self.stored_strengths, SeparableStrengths)
            else self.stored_strengths
        )

    @property
    def interferes(self) -> bool:
        """Whether all arrivals of the block interfere, those of different points too: facets of one target do."""
        return not self.scatterers.has_random_phase and self.scatterers.corners is not None

    def names(self) -> list[tuple[str, str]]:
        """Families out and back of each ordered pair."""
        return [(self.out.families[i], self.back.families[j]) for i, j in self.pair]

    def rays(self) -> list[tuple[str, str]]:
        """Rays out and back of each ordered pair: their families, and numbers where a family has several."""
        out, back = self.out.ray_names, self.back.ray_names
        return [(out[i], back[j]) for i, j in self.pair]

    def select(self, pairs: NDArray[np.int64]) -> "Pairs":
        """The same block with some of its ordered pairs, given by their rows."""
        some = (
            self.stored_strengths.select(pairs)
            if isinstance(self.stored_strengths, SeparableStrengths)
            else self.stored_strengths[pairs]
        )
        return Pairs(self.scatterers, self.out, self.back, self.pair[pairs], some)
