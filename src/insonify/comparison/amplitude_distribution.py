"""Amplitude distribution: moments of the intensity re its local mean, and laws fitted to it.

Rayleigh amplitudes have intensities of unit scintillation index and levels of 5.57 dB standard deviation and skewness
-1.14. The K distribution (Jakeman & Pusey 1976) is fitted by its scintillation index, 2 + 2 / shape; gamma and
lognormal intensities by the mean of their logarithm, which is sufficient for both together with the mean: Abraham &
Lyons (2002), IEEE J. Oceanic Eng. 27(4), 800, not verified. The distance of Kolmogorov and Smirnov is that of binned
levels.
"""

import numpy as np
from scipy.ndimage import uniform_filter
from scipy.special import gammainc, gammaln, kve, ndtr, polygamma, psi

from insonify.comparison.frame import Side
from insonify.comparison.measure import Curve, Measure, Quantity, decibels, ratio
from insonify.comparison.samples import Floats

LOOKS = 24
"""Least number of independent samples in a local mean."""
EDGES = np.arange(-40.0, 15.01, 1.0)
"""Edges of the bins of level re the local mean [dB]."""
LAWS = ("Rayleigh", "K", "lognormal", "gamma")
_MOMENTS = 6


class AmplitudeDistribution(Measure):
    """Moments and fitted laws of the intensity re its local mean."""

    name = "amplitude distribution"
    least_samples = LOOKS

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Moments of intensity, amplitude and level; shapes of laws and their distances."""
        return (
            Quantity("scintillation index"), Quantity("amplitude CV"), Quantity("std of level", "dB"),
            Quantity("skewness of level"), Quantity("gamma shape"), Quantity("1 / K shape"),
            *(Quantity(f"KS distance to {law}", "1", False) for law in LAWS),
        )  # fmt: skip

    @property
    def distances(self) -> tuple[Quantity, ...]:
        """Distance between the two distributions."""
        return (Quantity("KS distance"),)

    def sums(self, side: Side) -> Floats:
        """Sums of powers of the relative intensity and of its level, and the histogram of levels."""
        relative = relative_intensity(side, self.frame.cell)
        positive = relative > 0
        level = decibels(relative)
        powers = (relative**0, relative**2, np.sqrt(relative), level, level**2, level**3)
        moments = [side.sums(np.where(positive, power, np.nan)) for power in powers]
        mean = side.sums(np.where(positive, relative, np.nan))
        bins = np.where(positive, np.clip(np.digitize(np.nan_to_num(level), EDGES) - 1, 0, EDGES.size - 2), -1)
        return np.hstack([*moments, mean, side.sums(np.ones(level.shape), bins, EDGES.size - 1)])

    def estimate(self, sums: Floats) -> Floats:
        """Moments, shapes of the laws, and distances of each law to the histogram."""
        count = sums[..., :1]
        squared, root, level, level2, level3 = np.moveaxis(ratio(sums[..., 1:_MOMENTS], count), -1, 0)
        mean = ratio(sums[..., _MOMENTS], sums[..., 0])
        variance = np.maximum(level2 - level**2, 1e-12)
        skewness = (level3 - 3 * level * level2 + 2 * level**3) / variance**1.5
        index = ratio(squared, mean**2) - 1
        coefficient = np.sqrt(np.maximum(ratio(mean, root**2) - 1, 0))
        shape = gamma_shape(np.log(np.maximum(mean, 1e-300)) - level * np.log(10) / 10)
        k = (index - 1) / 2
        fits = self._fits(sums[..., _MOMENTS + 1 :], level, np.sqrt(variance), shape, k)
        columns = [index, coefficient, np.sqrt(variance), skewness, shape, k, *np.moveaxis(fits, -1, 0)]
        return np.stack(columns, axis=-1)

    def _fits(self, histogram: Floats, level: Floats, spread: Floats, shape: Floats, k: Floats) -> Floats:
        """Distance of the histogram to each law; only of single recordings, where the bootstrap needs none."""
        if histogram.ndim > 1:
            return np.full((*histogram.shape[:-1], len(LAWS)), np.nan)
        cumulative = np.cumsum(histogram)[:-1] / max(histogram.sum(), 1.0)
        u = 10 ** (EDGES[1:-1] / 10)
        laws = (1 - np.exp(-u), k_distribution(u, float(k)), ndtr((EDGES[1:-1] - level) / spread),
                gammainc(shape, shape * u))  # fmt: skip
        return np.array([np.max(np.abs(law - cumulative)) for law in laws])

    def distance(self, first: Floats, second: Floats) -> Floats:
        """Largest difference of the cumulative distributions of levels."""
        cumulative = [np.cumsum(sums[..., _MOMENTS + 1 :], axis=-1) for sums in (first, second)]
        one, two = (ratio(rows, rows[..., -1:]) for rows in cumulative)
        return np.max(np.abs(one - two), axis=-1, keepdims=True)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Histograms of level re the local mean."""
        real, simulated = (sums[_MOMENTS + 1 :] / max(sums[_MOMENTS + 1 :].sum(), 1.0) for sums in (first, second))
        middle = (EDGES[1:] + EDGES[:-1]) / 2
        return (Curve(middle, real, simulated, "level re local mean [dB]", "share of samples per dB [1]"),)

    def remark(self, first: Floats, second: Floats) -> str:
        """Law of the least distance to each recording."""
        fits = [self.estimate(sums)[-len(LAWS) :] for sums in (first, second)]
        names = [LAWS[int(np.nanargmin(fit))] if np.isfinite(fit).any() else "none" for fit in fits]
        return f"nearest law: {names[0]} (real), {names[1]} (simulated)"


def relative_intensity(side: Side, cell: int) -> Floats:
    """Intensity re its mean over neighbouring pings and samples, NaN where nothing was recorded.

    Args:
        side: The recording.
        cell: Samples of range after which echoes are no longer alike.

    Returns:
        Shape (ping, beam, sample).
    """
    pings, _, samples = side.intensity.shape
    along = min(pings, 9 * side.ping_block)
    looks = max(along // side.ping_block, 1)
    across = min(max(-(-LOOKS // looks), 3) * cell | 1, samples)
    known = np.isfinite(side.intensity)
    size = (along, 1, across)
    mean = uniform_filter(np.where(known, side.intensity, 0.0), size)
    share = uniform_filter(known.astype(float), size)
    usable = known & (mean > 0) & (share > 0.5)
    return np.where(usable, side.intensity * share / np.where(usable, mean, 1.0), np.nan)


def gamma_shape(excess: Floats) -> Floats:
    """Shape of a gamma distribution by maximum likelihood, from log of the mean less mean of the log.

    Args:
        excess: Logarithm of the mean less the mean of the logarithm, positive, any shape.

    Returns:
        Shape [1]: the root of log k - psi(k) = excess by Newton's method, Minka's start.
    """
    s = np.maximum(excess, 1e-9)
    k = (3 - s + np.sqrt((s - 3) ** 2 + 24 * s)) / (12 * s)
    for _ in range(5):
        k = np.maximum(k - (np.log(k) - psi(k) - s) / (1 / k - polygamma(1, k)), 1e-3)
    return np.asarray(k)


def k_distribution(intensity: Floats, inverse_shape: float) -> Floats:
    """Cumulative K distribution of intensities with mean 1; exponential where the shape is infinite.

    Args:
        intensity: Intensity re its mean, any shape.
        inverse_shape: Inverse of the shape of the texture; not positive: infinite shape.
    """
    if not 1 / 150 < inverse_shape < 50:
        return np.asarray(1 - np.exp(-intensity))
    nu = 1 / inverse_shape
    x = np.sqrt(nu * intensity)
    bessel = kve(nu, 2 * x)
    overflows = np.isinf(bessel)  # at intensities far below the mean
    factor = np.log(2.0) - gammaln(nu) + nu * np.log(np.where(overflows, 1.0, x)) - 2 * x
    exceeded = np.exp(factor + np.log(np.where(overflows, 1.0, bessel)))
    first, second, third = (x**2 / (k * max(nu - k, 1.0)) for k in (1, 2, 3))
    series = 1 - first * (1 - second * (1 - third))
    return np.asarray(1 - np.where(overflows, series, exceeded))
