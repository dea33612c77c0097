"""Levels by cause and by family pair: the sonar equation as curves over time.

The same incoherent reading, taken apart: for each cause (seabed, surface, target) and each unordered pair
of families, and once more for all pairs of a cause together, where pairs that overlap in time interfere.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import DIRECT
from insonify.records.pairs import Pairs
from insonify.synthesis.grid import TimeGrid
from insonify.synthesis.incoherent import Energies, Incoherent
from insonify.units import level_db

if TYPE_CHECKING:
    import xarray as xr

CAUSES = ("seabed", "surface", "target")
WATER = "water"
"""The cause that has curves only where the water answers."""
ALL = "all"


def pair_name(out: str, back: str) -> str:
    """Name of an unordered pair of families, such as D-S: the one with fewer bounces first."""
    return "-".join(sorted((out, back), key=lambda name: (name != DIRECT, len(name), not name.startswith("S"))))


class CurveSet(dict[tuple[str, str], Energies]):
    """Energies by (cause, pair)."""

    def __iadd__(self, other: CurveSet) -> CurveSet:
        """Add what another has heard, curve by curve."""
        for key, energies in other.items():
            if key in self:
                self[key] += energies
            else:
                self[key] = energies
        return self


@dataclass(frozen=True, slots=True)
class Levels:
    """Hears expected intensity apart, by cause and by pair [uPa^2]."""

    whole: Incoherent

    @property
    def even(self) -> bool:
        """Whether it wants evenly laid points, for an expectation."""
        return True

    def silence(self) -> CurveSet:
        """Nothing heard yet."""
        return CurveSet()

    def take_in(self, curves: CurveSet, pairs: Pairs) -> None:
        """Add the mean intensity of one block of scatterers to its curves."""
        cause = pairs.scatterers.boundary
        names = [pair_name(out, back) for out, back in pairs.names()]
        parts = {name: pairs.only(np.flatnonzero(np.array(names) == name)) for name in dict.fromkeys(names)}
        sent, heard = self.whole.weights(pairs)
        for name, part in (parts | {ALL: pairs}).items():
            if (cause, name) not in curves:
                curves[cause, name] = self.whole.silence()
            self.whole.add(curves[cause, name], part, sent, heard)

    def series(self, curves: CurveSet) -> dict[tuple[str, str], NDArray[np.float64]]:
        """Expected intensity of each curve [uPa^2], shape (channels, samples)."""
        return {key: self.whole.series(energies) for key, energies in curves.items()}


def level_curves(
    intensity: dict[tuple[str, str], NDArray[np.float64]], noise: float, grid: TimeGrid, channel: int
) -> xr.Dataset:
    """The curves of one channel as a labelled dataset.

    Args:
        intensity: Expected intensity by (cause, pair) [uPa^2], each of shape (channels, samples).
        noise: Mean-square noise pressure [uPa^2].
        grid: Times of the samples.
        channel: Channel wanted.

    Returns:
        `level_db` over (cause, pair, time) [dB re 1 uPa]: causes seabed, surface, target, water (if it
        answers), noise, total; pairs of families, and "all". Minus infinity where nothing is heard.
    """
    import xarray as xr

    names = sorted({pair for _, pair in intensity if pair != ALL}, key=lambda p: (len(p), p))
    pairs = [ALL, *names]
    water = [WATER] if any(cause == WATER for cause, _ in intensity) else []
    causes = [*CAUSES, *water, "noise", "total"]
    power = np.zeros((len(causes), len(pairs), grid.count))
    for (cause, pair), series in intensity.items():
        power[causes.index(cause), pairs.index(pair)] += series[channel]
    power[causes.index("noise"), 0] = noise
    power[-1] = power[:-1].sum(axis=0)
    return xr.Dataset(
        {
            "level_db": (
                ("cause", "pair", "time"),
                level_db(power),
                {"units": "dB re 1 uPa", "long_name": "level of the expected pressure"},
            )
        },
        coords={
            "cause": ("cause", causes, {"units": "1", "long_name": "what echoes"}),
            "pair": ("pair", pairs, {"units": "1", "long_name": "families out and back, in either order"}),
            "time": ("time", grid.time, {"units": "s", "long_name": "time after the start of transmission"}),
        },
    )
