"""Amplitude distribution against grazing angle: speckle that turns spikier where less of the seabed is in a cell.

The shape of the K distribution falls with the grazing angle: Le Chenadec, Boucher & Lurton (2007), IEEE Trans. Geosci.
45(5), from its abstract.
"""

import numpy as np

from insonify.comparison.amplitude_distribution import relative_intensity
from insonify.comparison.frame import Side
from insonify.comparison.level_against_angle import LevelAgainstAngle, angle_bins
from insonify.comparison.measure import Curve, Quantity, decibels, ratio
from insonify.comparison.samples import Floats

BIN_DEG = 15.0
"""Width of a bin of grazing angle [deg]."""
BINS = int(90 / BIN_DEG)
LEAST_SHARE = 0.02
"""Least share of the samples of a recording in a bin, for it to count."""


class DistributionAgainstAngle(LevelAgainstAngle):
    """Spread and skewness of the level and scintillation index in bins of grazing angle."""

    name = "distribution against angle"

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Three moments in each bin."""
        edges = BIN_DEG * np.arange(BINS)
        named = (("std of level", "dB"), ("skewness of level", "1"), ("scintillation index", "1"))
        return tuple(
            Quantity(f"{name} at {low:.0f} to {low + BIN_DEG:.0f} deg", unit) for name, unit in named for low in edges
        )

    def sums(self, side: Side) -> Floats:
        """Sums of powers of the level and of the relative intensity in each bin."""
        relative = relative_intensity(side, self.frame.cell)
        relative = np.where(relative > 0, relative, np.nan)
        level = decibels(relative)
        bins = angle_bins(self.frame, side, BIN_DEG)
        powers = (np.where(np.isfinite(level), 1.0, np.nan), level, level**2, level**3, relative, relative**2)
        return np.hstack([side.sums(power, bins, BINS) for power in powers])

    def estimate(self, sums: Floats) -> Floats:
        """Moments in each bin with enough samples."""
        count, *rows = (sums[..., row * BINS : (row + 1) * BINS] for row in range(6))
        count = np.where(count > LEAST_SHARE * count.sum(axis=-1, keepdims=True), count, 0.0)
        level, level2, level3, mean, squared = (ratio(row, count) for row in rows)
        variance = np.maximum(level2 - level**2, 1e-12)
        skewness = (level3 - 3 * level * level2 + 2 * level**3) / variance**1.5
        return np.concatenate([np.sqrt(variance), skewness, ratio(squared, mean**2) - 1], axis=-1)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Spread of the level over grazing angle."""
        middle = np.asarray(BIN_DEG * (np.arange(BINS) + 0.5))
        real, simulated = (self.estimate(sums)[:BINS] for sums in (first, second))
        return (Curve(middle, real, simulated, "grazing angle [deg]", "std of level [dB]"),)
