"""Level against grazing angle: mean intensity in bins of angle on a level seabed, stated gains undone."""

import numpy as np

from insonify.comparison.frame import Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, counted, decibels, ratio, total_level
from insonify.comparison.samples import Floats

BIN_DEG = 5.0
"""Width of a bin of grazing angle [deg]."""
BINS = int(90 / BIN_DEG)
LEAST_SHARE = 0.002
"""Least share of the samples of a recording in a bin, for it to count."""


class LevelAgainstAngle(Measure):
    """Level of the mean intensity in each bin of grazing angle [dB]."""

    name = "level against angle"

    @classmethod
    def unsuited(cls, frame: Frame) -> str:
        """Both recordings need grazing angles: angles of beams, or an altitude."""
        for side in frame.sides:
            if frame.grazing(side) is None:
                return f"{side.samples.name} states neither beam angles nor an altitude"
        return ""

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Level in each bin of grazing angle."""
        edges = BIN_DEG * np.arange(BINS)
        return tuple(Quantity(f"level at {low:.0f} to {low + BIN_DEG:.0f} deg", "dB") for low in edges)

    def sums(self, side: Side) -> Floats:
        """Sum of intensities and number of samples in each bin."""
        bins = angle_bins(self.frame, side, BIN_DEG)
        counts = counted(side.intensity)
        return np.hstack([side.sums(side.intensity, bins, BINS), side.sums(counts, bins, BINS)])

    def estimate(self, sums: Floats) -> Floats:
        """Level of the mean intensity in each bin with enough samples, re the mean of all where units differ."""
        counts = sums[..., BINS:]
        least = LEAST_SHARE * counts.sum(axis=-1, keepdims=True)
        level = decibels(ratio(sums[..., :BINS], counts)) - total_level(self.frame, sums[..., :BINS], counts)
        return np.where(counts > least, level, np.nan)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Levels over grazing angle."""
        middle = np.asarray(BIN_DEG * (np.arange(BINS) + 0.5))
        return (Curve(middle, self.estimate(first), self.estimate(second), "grazing angle [deg]", "mean level [dB]"),)


def angle_bins(frame: Frame, side: Side, width_deg: float) -> "np.ndarray[tuple[int, ...], np.dtype[np.int64]]":
    """Bin of grazing angle of each sample, -1 where it is not known; shape of the intensity.

    Args:
        frame: The two recordings.
        side: One of them.
        width_deg: Width of the bins [deg].
    """
    grazing = frame.grazing(side)
    degrees = np.degrees(np.full((1, 1, 1), np.nan) if grazing is None else grazing)
    known = np.isfinite(degrees)
    bins = np.where(known, np.minimum(np.where(known, degrees, 0.0) // width_deg, np.ceil(90 / width_deg) - 1), -1)
    return np.broadcast_to(bins.astype(np.int64), side.intensity.shape)
