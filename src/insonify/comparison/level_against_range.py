"""Level against range: mean intensity in bins of range, stated gains undone."""

import numpy as np

from insonify.comparison.frame import Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, counted, decibels, ratio
from insonify.comparison.samples import Floats

BINS = 16
"""Number of bins of range."""


class LevelAgainstRange(Measure):
    """Level of the mean intensity in each bin of range [dB]."""

    name = "level against range"

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame)
        count = frame.slant_range.size
        self._bin = np.arange(count) * BINS // count
        self._middle = np.array([frame.slant_range[self._bin == row].mean() for row in range(BINS)])

    @staticmethod
    def unsuited(frame: Frame) -> str:
        """Detections have no bins of range."""
        return "" if frame.slant_range.size >= BINS else "too few samples of range"

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Level in each bin of range."""
        return tuple(Quantity(f"level at {middle:.2f} m", "dB") for middle in self._middle)

    def sums(self, side: Side) -> Floats:
        """Sum of intensities and number of samples in each bin."""
        counts = counted(side.intensity)
        return np.hstack([side.sums(side.intensity, self._bin, BINS), side.sums(counts, self._bin, BINS)])

    def estimate(self, sums: Floats) -> Floats:
        """Level of the mean intensity in each bin."""
        return decibels(ratio(sums[..., :BINS], sums[..., BINS:]))

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Levels over range."""
        real, simulated = self.estimate(first), self.estimate(second)
        return (Curve(self._middle, real, simulated, "slant range [m]", "mean level [dB]"),)
