"""Contrast of highlights and shadows: percentiles of the local level re its median."""

import numpy as np
from scipy.ndimage import uniform_filter1d

from insonify.comparison.frame import Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, decibels, ratio
from insonify.comparison.samples import Floats

PERCENTILES = (1.0, 5.0, 25.0, 75.0, 95.0, 99.0)
"""Percentiles of the local level."""
STEP_DB = 0.5
"""Width of the bins of level [dB]."""
REACH_DB = 100.0
"""Levels re the common median that have bins of their own [dB]."""


class Contrast(Measure):
    """Percentiles of the level of means over three resolution cells, re the median of each recording."""

    name = "highlights and shadows"
    least_samples = 64

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame)
        self._edges = np.arange(-REACH_DB, REACH_DB + STEP_DB / 2, STEP_DB)
        self._local = {id(side): _local_level(side, frame.cell) for side in frame.sides}
        medians = [float(np.nanmedian(level)) for level in self._local.values()]
        self._reference = float(np.mean(medians)) if np.isfinite(medians).all() else 0.0

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Levels of the percentiles re the median."""
        return tuple(Quantity(f"{percentile:g} % re median", "dB") for percentile in PERCENTILES)

    def sums(self, side: Side) -> Floats:
        """Histogram of local levels."""
        level = self._local[id(side)] - self._reference
        known = np.isfinite(level)
        bins = np.digitize(np.where(known, level, 0.0), self._edges) - 1
        count = self._edges.size - 1
        bins = np.where(known, np.clip(bins, 0, count - 1), -1)
        means = slice(0, None, _width(side, self.frame.cell))  # those that share no sample
        independent_bins = np.full(level.shape, -1, np.int64)
        independent_bins[..., means] = bins[..., means]
        return side.sums(np.ones(level.shape), independent_bins, count)

    def estimate(self, sums: Floats) -> Floats:
        """Levels of the percentiles re the median."""
        flat = sums.reshape(-1, sums.shape[-1])
        cumulative = np.cumsum(flat, axis=1)
        share = ratio(cumulative, cumulative[:, -1:])
        rows = np.arange(len(flat))
        levels = []
        for percentile in (50.0, *PERCENTILES):
            fraction = percentile / 100
            at = np.argmax(share >= fraction, axis=1)
            below = np.where(at > 0, share[rows, at - 1], 0.0)
            part = ratio(fraction - below, share[rows, at] - below)
            levels.append(self._edges[at] + STEP_DB * part)
        contrasts = np.stack([level - levels[0] for level in levels[1:]], axis=-1)
        return contrasts.reshape(*sums.shape[:-1], -1)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Percentiles re the median."""
        percentiles = np.array(PERCENTILES)
        return (
            Curve(percentiles, self.estimate(first), self.estimate(second), "percentile [%]", "level re median [dB]"),
        )


def _local_level(side: Side, cell: int) -> Floats:
    """Level of the mean intensity over three resolution cells [dB], NaN where nothing was recorded."""
    known = np.isfinite(side.intensity)
    size = _width(side, cell)
    mean = uniform_filter1d(np.where(known, side.intensity, 0.0), size)
    share = uniform_filter1d(known.astype(float), size)
    return np.where(known, decibels(ratio(mean, share)), np.nan)


def _width(side: Side, cell: int) -> int:
    """Samples of a local mean."""
    return int(min(3 * cell, side.intensity.shape[2]))
