"""Coherence between neighbouring parts of one aperture (transducer sectors, elements), in bins of range."""

import numpy as np

from insonify.comparison.frame import Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, ratio
from insonify.comparison.samples import Floats

BINS = 10
"""Number of bins of range."""


class SectorCoherence(Measure):
    """Modulus of the complex coherence of neighbouring parts in each bin of range."""

    name = "coherence between sectors"

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame)
        count = frame.slant_range.size
        self._bin = np.arange(count, dtype=np.int64) * BINS // count
        self._middle = np.array([frame.slant_range[self._bin == row].mean() for row in range(BINS)])

    @classmethod
    def unsuited(cls, frame: Frame) -> str:
        """Both recordings need complex samples of several parts."""
        for side in frame.sides:
            samples = side.samples
            if not samples.parts or samples.values.shape[1] < 2 or not samples.is_complex:
                return f"{samples.name} has no complex samples of sectors or elements"
        return ""

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Coherence in each bin of range."""
        return tuple(Quantity(f"coherence at {middle:.2f} m") for middle in self._middle)

    def sums(self, side: Side) -> Floats:
        """Sums of the products of neighbouring parts and of their powers."""
        x = side.samples.values
        product = x[:, 1:] * np.conj(x[:, :-1])
        known = np.isfinite(product)  # power of a pair that lacks one sample is no part of its coherence
        powers = [np.where(known, np.abs(part).astype(float) ** 2, np.nan) for part in (x[:, 1:], x[:, :-1])]
        values = (product.real.astype(float), product.imag.astype(float), *powers)
        return np.hstack([side.sums(part, self._bin, BINS) for part in values])

    def estimate(self, sums: Floats) -> Floats:
        """Modulus of the coherence in each bin."""
        real, imaginary, first, second = (sums[..., row * BINS : (row + 1) * BINS] for row in range(4))
        return ratio(np.hypot(real, imaginary), np.sqrt(np.maximum(first * second, 0)))

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Coherence over range."""
        return (Curve(self._middle, self.estimate(first), self.estimate(second), "slant range [m]", "coherence [1]"),)
