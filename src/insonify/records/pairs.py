"""Pairs: strengths of every transmit leg combined with every receive leg at a block of scatterers.

Accumulators turn pairs into a recording directly; `records.arrivals` writes the same content out row by row, for
inspection and for tests. Under most compiled laws the strength of a pair is a product of one factor for each leg; it is
then written out only on request.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.records._pair_strengths_kernel import amplitude_weights, separable_strengths
from insonify.records.legs import Legs, legs_to_points, ray_name
from insonify.scene.scatterers import BOUNDARY_ECHO, Scatterers

Floats = NDArray[np.float64]
Strengths = NDArray[np.float64] | NDArray[np.complex128]


@dataclass(frozen=True, slots=True)
class PairSampling:
    """Sampling of p pairs at n scatterers: a pair is kept where the priority lies below its keep probability."""

    priority: NDArray[np.float32]
    """Priority of each scatterer, 0 to 1, shape (n,)."""
    range_bin: NDArray[np.uint8]
    """Range bin of each scatterer, shape (n,)."""
    keep_probability: NDArray[np.float32]
    """Probability with which each pair is kept in each range bin, shape (p, bins)."""

    @property
    def amplitude_weight(self) -> NDArray[np.float32]:
        """Amplitude weight of the kept pairs, 0 where a pair is not kept [1], shape (p, n)."""
        weight = np.empty((len(self.keep_probability), len(self.priority)), np.float32)
        amplitude_weights(self.priority, self.range_bin, self.keep_probability, weight)
        return weight


@dataclass(frozen=True)
class SeparableStrengths:
    """Strengths of p pairs at n scatterers whose cross section is a product of one factor for each direction."""

    transmit_legs: Legs
    """Legs from the transmitter to the scatterers."""
    receive_legs: Legs
    """Legs from the receiver to the scatterers, travelled in the opposite direction."""
    pair: NDArray[np.int64]
    """Row of the transmit leg and of the receive leg of each ordered pair, shape (p, 2)."""
    direction_factor: Floats
    """Factor of one direction in the cross section, at evenly spaced sines of its grazing angle from 0 to 1 [1]; linear
    between them. Shape (2 or more,)."""
    root_area: Floats
    """Root of the area that each point stands for [m], shape (n,)."""
    weight: Floats
    """Further weight of each pair [1], shape (p,)."""
    sampling: PairSampling | None
    """Random subset of the scatterers for each pair; None: all scatterers."""

    @cached_property
    def strengths(self) -> Floats:
        """Strengths, written out [m], shape (p, n)."""
        transmit_factor = self._direction_factors(self.transmit_legs)
        receive_factor = (
            transmit_factor if self.receive_legs is self.transmit_legs else self._direction_factors(self.receive_legs)
        ) * self.root_area
        strengths = np.empty((len(self.pair), len(self.root_area)))
        amplitude_weight = (
            np.empty((0, len(self.root_area)), np.float32) if self.sampling is None else self.sampling.amplitude_weight
        )
        separable_strengths(transmit_factor, receive_factor, self.pair, amplitude_weight, strengths)
        if (self.weight != 1).any():
            strengths *= self.weight[:, None]
        return strengths

    def select(self, rows: NDArray[np.int64]) -> "SeparableStrengths":
        """Strengths of some pairs, given by their rows."""
        sampling = self.sampling
        if sampling is not None:
            sampling = replace(sampling, keep_probability=np.ascontiguousarray(sampling.keep_probability[rows]))
        return replace(self, pair=self.pair[rows], weight=self.weight[rows], sampling=sampling)

    def _direction_factors(self, legs: Legs) -> Floats:
        """Root of each leg's factor in the cross section [1], shape (f, n)."""
        sine = np.abs(legs.grazing_sine)
        if len(self.direction_factor) == 2:  # a line, several times faster than a table
            return np.sqrt(self.direction_factor[0] + (self.direction_factor[1] - self.direction_factor[0]) * sine)
        return np.sqrt(np.interp(sine, np.linspace(0, 1, len(self.direction_factor)), self.direction_factor))


@dataclass(frozen=True, slots=True)
class Pairs:
    """Transmit and receive legs of n scatterers, and the scattering strength of each ordered pair of them.

    Example:
        >>> from insonify.propagation.image_sources import image_legs
        >>> from insonify.scene.scene import Scene, point_scatterer
        >>> from insonify.scene.target import PointTarget
        >>> point = point_scatterer(PointTarget(position=(40, 0, 20)))
        >>> legs = image_legs(Scene(seabed={"depth": 35}), np.array([0.0, 0.0, 10.0]), point, ("D", "S"), 100e3)
        >>> ordered = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])
        >>> Pairs(point, legs, legs, ordered, np.full((4, 1), 0.1)).names()  # a point of -20 dB re 1 m^2
        [('D', 'D'), ('D', 'S'), ('S', 'D'), ('S', 'S')]
    """

    scatterers: Scatterers
    transmit_legs: Legs
    """Legs from the transmitter to the scatterers."""
    receive_legs: Legs
    """Legs from the receiver to the scatterers, travelled in the opposite direction."""
    pair: NDArray[np.int64]
    """Row of the transmit leg and of the receive leg of each ordered pair, shape (p, 2)."""
    stored_strengths: Strengths | SeparableStrengths
    """Strengths of the pairs, or the factors of which they are products."""

    @property
    def strength(self) -> Strengths:
        """Pressure scattered to 1 m re incident pressure [m], shape (p, n).

        The root of cross section times area, or the complex scattering amplitude of a specular facet.
        """
        stored = self.stored_strengths
        return stored.strengths if isinstance(stored, SeparableStrengths) else stored

    def at(self, points: NDArray[np.intp]) -> "Pairs":
        """Pairs at some of the points, given by their rows."""
        legs = legs_to_points((self.transmit_legs, self.receive_legs), points)
        return Pairs(self.scatterers.take(points), *legs, self.pair, self.strength[:, points])

    @property
    def interferes(self) -> bool:
        """True if all arrivals of the block interfere, between points too, as those of one target's facets do."""
        return not self.scatterers.has_random_phase and self.scatterers.corners is not None

    def names(self) -> list[tuple[str, str]]:
        """Transmit and receive family of each ordered pair."""
        return [(self.transmit_legs.families[i], self.receive_legs.families[j]) for i, j in self.pair]

    def rays(self) -> list[tuple[str, str]]:
        """Transmit and receive ray of each ordered pair: its family, with a number where a family has several rays."""
        transmit_legs, receive_legs = (
            {row: ray_name(legs.families[row], legs.branch[row]) for row in set(column.tolist())}
            for legs, column in zip((self.transmit_legs, self.receive_legs), self.pair.T, strict=True)
        )
        return [(transmit_legs[i], receive_legs[j]) for i, j in self.pair.tolist()]

    def positions(self, row: int) -> Floats:
        """Positions from which one ordered pair returns its echoes: those of the scatterers [m], shape (n, 3).

        A boundary echo has no scatterer: half its length away along its departure, where an image shows it.
        """
        points = self.scatterers
        if points.boundary != BOUNDARY_ECHO:
            return points.position
        i, j = self.pair[row]
        return np.asarray(points.position + self.transmit_legs.departure[i] * self.receive_legs.length[j, :, None] / 2)

    def select(self, pairs: NDArray[np.int64]) -> "Pairs":
        """The same block with strengths of its ordered pairs, given by their rows."""
        stored = self.stored_strengths
        strengths = stored.select(pairs) if isinstance(stored, SeparableStrengths) else stored[pairs]
        return Pairs(self.scatterers, self.transmit_legs, self.receive_legs, self.pair[pairs], strengths)
