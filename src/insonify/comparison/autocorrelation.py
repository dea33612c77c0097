"""Autocorrelation of the amplitude re its local mean, over range and along the track."""

import numpy as np

from insonify.comparison.amplitude_distribution import relative_intensity
from insonify.comparison.frame import Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, counted, ratio
from insonify.comparison.samples import Floats

LAGS = 6
"""Number of lags over range, up to three resolution cells."""
PING_LAGS = 3
"""Largest lag along the track [pings]."""


class Autocorrelation(Measure):
    """Correlation coefficients of the amplitude over range and along the track; the lag of half correlation."""

    name = "autocorrelation"
    least_samples = 64

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame)
        self._lags = np.unique(np.round(np.linspace(1, max(3 * frame.cell, LAGS), LAGS)).astype(int))
        pings = min(side.field.shape[0] for side in frame.sides)
        self._ping_lags = np.arange(1, min(PING_LAGS, pings - 1) + 1)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Correlation at each lag, and the lag of half correlation."""
        step = self.frame.step
        return (
            *(Quantity(f"over range, lag {lag * step:.3g} m") for lag in self._lags),
            *(Quantity(f"along track, lag {lag}") for lag in self._ping_lags),
            Quantity("lag of half correlation over range", "m", False),
        )

    def sums(self, side: Side) -> Floats:
        """Sums of amplitudes, of their squares and of their products at each lag, with the numbers of each."""
        a = np.sqrt(relative_intensity(side, self.frame.cell))
        a -= np.nanmean(a)  # so that products of neighbouring pings are not correlated themselves
        parts = [side.sums(counted(a)), side.sums(a), side.sums(a**2)]
        for lag in self._lags:
            product = a[..., lag:] * a[..., :-lag]
            parts += [side.sums(counted(product)), side.sums(product)]
        for lag in self._ping_lags:
            product = np.full(a.shape, np.nan)
            product[:-lag] = a[lag:] * a[:-lag]
            parts += [side.sums(counted(product)), side.sums(product)]
        return np.hstack(parts)

    def estimate(self, sums: Floats) -> Floats:
        """Correlation coefficients, and the lag at which that over range falls to one half."""
        mean = ratio(sums[..., 1], sums[..., 0])[..., None]
        variance = ratio(sums[..., 2], sums[..., 0])[..., None] - mean**2
        products = ratio(sums[..., 4::2], sums[..., 3::2])
        correlation = ratio(products - mean**2, variance)
        over_range = correlation[..., : self._lags.size]
        half = np.full(over_range.shape[:-1], np.nan)
        lags, before = np.concatenate([[0], self._lags]), np.ones(half.shape)
        for row in range(self._lags.size):
            now = over_range[..., row]
            crossed = np.isnan(half) & (now < 0.5)
            share = ratio(before - 0.5, before - now)
            half = np.where(crossed, (lags[row] + share * (lags[row + 1] - lags[row])) * self.frame.step, half)
            before = now
        return np.concatenate([correlation, half[..., None]], axis=-1)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Correlation over range and along the track."""
        real, simulated = self.estimate(first), self.estimate(second)
        n, lags = self._lags.size, self._lags * self.frame.step
        curves = [Curve(lags, real[:n], simulated[:n], "lag of range [m]", "correlation [1]")]
        if self._ping_lags.size > 1:
            ping_lags = self._ping_lags.astype(float)
            curves.append(Curve(ping_lags, real[n:-1], simulated[n:-1], "lag along track [pings]", "correlation [1]"))
        return tuple(curves)
