"""Noise floor: level, distribution and whiteness of the quietest part of the common range."""

import numpy as np

from insonify.comparison.frame import Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, counted, decibels, ratio, total_level
from insonify.comparison.samples import Floats

PARTS = 16
"""Number of parts of the range of which the quietest is taken."""
LAGS = 4
"""Lags at which the noise is correlated [samples]."""


class NoiseFloor(Measure):
    """Level and autocorrelation of the samples in the part of the range that is quietest in both recordings."""

    name = "noise floor"
    least_samples = 4 * PARTS

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame)
        self._rows = _quietest(frame)
        self._complex = all(np.iscomplexobj(side.field) for side in frame.sides)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Level, scintillation index and correlation between samples."""
        r = self.frame.slant_range[self._rows]
        lags = tuple(Quantity(f"correlation at {lag * self.frame.step:.3g} m") for lag in range(1, LAGS + 1))
        return (Quantity(f"level from {r[0]:.2f} to {r[-1]:.2f} m", "dB"), Quantity("scintillation index"), *lags)

    def sums(self, side: Side) -> Floats:
        """Sums of powers of the intensity, and of products of neighbouring samples."""
        inside = np.zeros(self.frame.slant_range.size, bool)
        inside[self._rows] = True
        power = np.where(inside, side.intensity, np.nan)
        field = side.field if self._complex else np.abs(side.field)
        parts = [counted(power), power, power**2]
        amplitude = np.where(inside, np.abs(side.field).astype(float), np.nan)
        parts.append(amplitude)
        for lag in range(1, LAGS + 1):
            product = np.full(power.shape, np.nan, complex)
            product[..., :-lag] = field[..., lag:] * np.conj(field[..., :-lag])
            keep = inside.copy()
            keep[:-lag] &= inside[lag:]
            keep[-lag:] = False
            product[..., ~keep] = np.nan
            parts += [counted(product.real), product.real, product.imag]
        parts += [side.intensity, counted(side.intensity)]
        return np.hstack([side.sums(np.asarray(part, float)) for part in parts])

    def estimate(self, sums: Floats) -> Floats:
        """Level, scintillation index, and modulus of the correlation coefficients."""
        count, power, squared, amplitude = np.moveaxis(sums[..., :4], -1, 0)
        mean = ratio(power, count)
        index = ratio(ratio(squared, count), mean**2) - 1
        offset = 0.0 if self._complex else ratio(amplitude, count) ** 2
        total = total_level(self.frame, sums[..., -2:-1], sums[..., -1:])[..., 0]
        columns = [decibels(mean) - total, index]
        for row in range(4, 4 + 3 * LAGS, 3):
            real, imaginary = (ratio(sums[..., row + part], sums[..., row]) for part in (1, 2))
            columns.append(ratio(np.hypot(real - offset, imaginary), mean - offset))
        return np.stack(columns, axis=-1)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Correlation of the noise over lag."""
        lags = np.asarray(self.frame.step * np.arange(1, LAGS + 1))
        return (
            Curve(lags, self.estimate(first)[2:], self.estimate(second)[2:], "lag of range [m]", "correlation [1]"),
        )


def _quietest(frame: Frame) -> slice:
    """Samples of the part of the range with the least level, summed over both recordings."""
    edges = np.linspace(0, frame.slant_range.size, PARTS + 1).astype(int)
    levels = np.full(PARTS, np.inf)
    for part in range(PARTS):
        both = [side.intensity[..., edges[part] : edges[part + 1]] for side in frame.sides]
        if all(np.isfinite(rows).mean() > 0.5 for rows in both):
            levels[part] = sum(10 * np.log10(max(float(np.nanmean(rows)), 1e-300)) for rows in both)
    part = int(np.argmin(levels))
    return slice(int(edges[part]), int(edges[part + 1]))
