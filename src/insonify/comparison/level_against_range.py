"""Level against range: mean intensity in bins of range, stated gains undone."""

import numpy as np

from insonify.comparison.frame import TILE_CELLS, Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, counted, decibels, ratio, total_level
from insonify.comparison.samples import Floats

BINS = 16
"""Most bins of range."""
TILES = 8
"""Least number of tiles of range in a bin where chance is judged by them."""


class LevelAgainstRange(Measure):
    """Level of the mean intensity in each bin of range [dB]."""

    name = "level against range"
    least_samples = BINS

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame)
        count = frame.slant_range.size
        tiles = count // (TILE_CELLS * frame.cell)
        self._bins = BINS if frame.strata == 1 else min(max(tiles // TILES, 4), BINS)
        self._bin = np.arange(count) * self._bins // count
        self._middle = np.array([frame.slant_range[self._bin == row].mean() for row in range(self._bins)])

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Level in each bin of range."""
        return tuple(Quantity(f"level at {middle:.2f} m", "dB") for middle in self._middle)

    def sums(self, side: Side) -> Floats:
        """Sum of intensities and number of samples in each bin."""
        counts = counted(side.intensity)
        return np.hstack([side.sums(values, self._bin, self._bins) for values in (side.intensity, counts)])

    def estimate(self, sums: Floats) -> Floats:
        """Level of the mean intensity in each bin, re the mean of all where units differ."""
        power, counts = sums[..., : self._bins], sums[..., self._bins :]
        return decibels(ratio(power, counts)) - total_level(self.frame, power, counts)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Levels over range."""
        real, simulated = self.estimate(first), self.estimate(second)
        return (Curve(self._middle, real, simulated, "slant range [m]", "mean level [dB]"),)
