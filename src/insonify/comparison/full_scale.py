"""Share of samples at full scale: those within a tenth of a decibel of the largest."""

import numpy as np

from insonify.comparison.frame import Side
from insonify.comparison.measure import Measure, Quantity, ratio
from insonify.comparison.samples import Floats

WITHIN = 10 ** (-0.1 / 10)
"""Intensity re the largest from which a sample is at full scale."""


class FullScale(Measure):
    """Share of clipped samples of all parts of the aperture."""

    name = "clipped samples"

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Share of samples at full scale, as the root of the number for each thousand."""
        return (Quantity("samples at full scale", "1/1000"),)

    def sums(self, side: Side) -> Floats:
        """Number of samples at full scale and of all samples."""
        power = np.abs(side.samples.values).astype(float) ** 2
        known = np.isfinite(power)
        largest = float(np.nanmax(power)) if known.any() else 0.0
        at_scale = np.where(known, power >= WITHIN * largest, np.nan).astype(float)
        return np.hstack([side.sums(at_scale), side.sums(np.where(known, 1.0, np.nan))])

    def estimate(self, sums: Floats) -> Floats:
        """Share of samples at full scale for each thousand."""
        return 1000 * ratio(sums[..., :1], sums[..., 1:])
