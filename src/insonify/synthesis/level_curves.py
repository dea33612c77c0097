"""Levels by contribution and by pair of families: the sonar equation as curves over time.

The incoherent intensity, separated: for each contribution (seabed, surface, target) and each unordered pair
of families, and once more for all pairs of a contribution together, where pairs that overlap in time interfere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import DIRECT, first_boundary
from insonify.records.pairs import Pairs
from insonify.scene.scatterers import BOUNDARY_ECHO
from insonify.synthesis.accumulator import Mapper, Requirements
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer
from insonify.synthesis.time_grid import TimeGrid
from insonify.units import level_db

if TYPE_CHECKING:
    import xarray as xr

CONTRIBUTIONS = ("seabed", "surface", "target")
OCCASIONAL = ("water", BOUNDARY_ECHO)
"""Contributions that have curves only where there is sound of theirs."""
ALL = "all"


def pair_name(transmit_family: str, receive_family: str) -> str:
    """Name of an unordered pair of families, such as D-S: the one with fewer bounces first.

    A boundary echo is one leg: its name is that family's, such as B.
    """
    families = [name for name in (transmit_family, receive_family) if name]
    return "-".join(
        sorted(families, key=lambda name: (name != DIRECT, len(name), first_boundary(name) != "surface", name))
    )


class LevelBuffers(dict[tuple[str, str], IntensityBuffer]):
    """Energies by (contribution, pair)."""

    def __iadd__(self, other: LevelBuffers) -> LevelBuffers:
        """Add the curves of another buffer."""
        for key, energies in other.items():
            if key in self:
                self[key] += energies
            else:
                self[key] = energies
        return self


@dataclass(frozen=True, slots=True)
class LevelAccumulator:
    """Accumulator of expected intensity by contribution and by pair [uPa^2]."""

    accumulator: IncoherentAccumulator
    scatterers_per_cell: float = math.inf
    """Largest number of quadrature points in a resolution cell [1]."""

    @property
    def requirements(self) -> Requirements:
        """Properties of the path pairs that `add` expects."""
        return Requirements(max_scatterers_per_cell=self.scatterers_per_cell, approximate_edges=True)

    def empty(self) -> LevelBuffers:
        """Empty buffer."""
        return LevelBuffers()

    def add(self, curves: LevelBuffers, pairs: Pairs) -> None:
        """Add the mean intensity of one block of scatterers to its curves."""
        contribution = pairs.scatterers.boundary
        names = [pair_name(out, back) for out, back in pairs.names()]
        pairs_by_name = {name: pairs.select(np.flatnonzero(np.array(names) == name)) for name in dict.fromkeys(names)}
        transmit_weights, receive_weights = self.accumulator.weights(pairs)
        for name, named_pairs in (pairs_by_name | {ALL: pairs}).items():
            if (contribution, name) not in curves:
                curves[contribution, name] = self.accumulator.empty()
            self.accumulator.add_weighted(curves[contribution, name], named_pairs, transmit_weights, receive_weights)

    def time_series(self, curves: LevelBuffers, run: Mapper = map) -> dict[tuple[str, str], NDArray[np.float64]]:
        """Expected intensity of each curve [uPa^2], shape (channels, samples)."""
        return {key: self.accumulator.time_series(energies, run) for key, energies in curves.items()}


def level_curves(
    intensity: dict[tuple[str, str], NDArray[np.float64]], noise: float, grid: TimeGrid, channel: int
) -> xr.Dataset:
    """Level curves of one channel as a dataset.

    Args:
        intensity: Expected intensity by (contribution, pair) [uPa^2], each of shape (channels, samples).
        noise: Mean-square noise pressure [uPa^2].
        grid: Times of the samples.
        channel: Index of the channel.

    Returns:
        `level_db` over (contribution, pair, time) [dB re 1 uPa]: contributions seabed, surface, target, water and
        boundary echo (where there is such sound), noise, total; pairs of families, and "all". Minus infinity where
        nothing is received.
    """
    import xarray as xr

    names = sorted({pair for _, pair in intensity if pair != ALL}, key=lambda p: (len(p), p))
    pairs = [ALL, *names]
    present = {contribution for contribution, _ in intensity}
    contributions = [*CONTRIBUTIONS, *(name for name in OCCASIONAL if name in present), "noise", "total"]
    power = np.zeros((len(contributions), len(pairs), grid.sample_count))
    for (contribution, pair), series in intensity.items():
        power[contributions.index(contribution), pairs.index(pair)] += series[channel]
    power[contributions.index("noise"), 0] = noise
    power[-1] = power[:-1].sum(axis=0)
    return xr.Dataset(
        {
            "level_db": (
                ("contribution", "pair", "time"),
                level_db(power),
                {"units": "dB re 1 uPa", "long_name": "level of the expected pressure"},
            )
        },
        coords={
            "contribution": (
                "contribution",
                contributions,
                {"units": "1", "long_name": "scattering boundary or medium"},
            ),
            "pair": ("pair", pairs, {"units": "1", "long_name": "transmit and receive family, in either order"}),
            "time": ("time", grid.time, {"units": "s", "long_name": "time after the start of transmission"}),
        },
    )
