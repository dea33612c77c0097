"""Coherence of two recordings of one seabed: over looks, over delays, over channels."""

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from insonify.validity import require_number

Complexes = NDArray[np.complex128]
Floats = NDArray[np.float64]


def complex_coherence(first: ArrayLike, second: ArrayLike, looks: int | tuple[int, int] | None = None) -> Complexes:
    """Normalised complex coherence of two complex series, sum of a b* over root of sum |a|^2 sum |b|^2 [1].

    Its phase is that of the first re the second: positive where the echo reaches the first earlier. For N independent
    looks at uncorrelated series the mean modulus is 0.89 / sqrt(N), not zero.

    Args:
        first: Complex baseband, shape (..., time) or (ping, time).
        second: Complex baseband of the same shape.
        looks: Samples to sum over about each one: along time, or (pings, samples) over the last two axes;
            None: all samples of the last axis, one value for each series.

    Returns:
        Coherence, shape of the series, or without its last axis if `looks` is None; 0 where a series is zero.

    Raises:
        ValueError: Shapes that differ, or looks that do not fit.

    Source: van Trees (2002), ch. 2 (coherence); Touzi et al. (1999), IEEE Trans. Geosci. 37(1) (bias); not verified.

    Example:
        >>> echo = np.exp(1j * np.arange(64.0) ** 2)
        >>> coherence = complex_coherence(1j * echo, echo)  # the first receiver leads by a quarter of a cycle
        >>> print(abs(coherence).round(3), np.degrees(np.angle(coherence)).round(1))
        1.0 90.0
    """
    from scipy.ndimage import uniform_filter

    a, b = _pair(first, second)
    products = (a * np.conj(b), np.abs(a) ** 2, np.abs(b) ** 2)
    if looks is None:
        sums = [np.sum(x, axis=-1) for x in products]
    else:
        size = _window(looks, a.ndim)
        sums = [uniform_filter(x, size, mode="constant") for x in products]
    power = np.sqrt(np.maximum(sums[1], 0) * np.maximum(sums[2], 0))
    has_power = power > 1e-12 * np.max(power, initial=0.0)
    return np.asarray(np.where(has_power, sums[0] / np.where(has_power, power, 1.0), 0), complex)


def coherence_by_delay(
    first: ArrayLike, second: ArrayLike, sample_rate: float, *, max_delay: float
) -> tuple[Complexes, Floats]:
    """Coherence of whole series over a range of delays of the second.

    Args:
        first: Complex baseband, shape (..., time).
        second: Complex baseband of the same shape.
        sample_rate: Sample rate of both [Hz].
        max_delay: Longest delay of either sign [s].

    Returns:
        Normalised cross-correlation [1], shape (..., delay), and the delays, of whole samples [s], shape (delay,).
        An echo that is later by d in the second series has its peak at d.

    Example:
        >>> echo = np.exp(1j * np.arange(64.0) ** 2)
        >>> coherence, delay = coherence_by_delay(echo, np.roll(echo, 3), 50e3, max_delay=100e-6)
        >>> print(f"{1e6 * delay[np.argmax(abs(coherence))]:.0f} us")  # three samples
        60 us
    """
    a, b = _pair(first, second)
    rate = require_number("sample_rate", sample_rate, "Hz", 0.0, exclude_low=True)
    max_lag = int(require_number("max_delay", max_delay, "s", 0.0) * rate)
    if max_lag >= a.shape[-1]:
        raise ValueError(f"max_delay is {max_delay:g} s; give less than the series' {a.shape[-1] / rate:g} s")
    size = scipy.fft.next_fast_len(a.shape[-1] + max_lag)
    cross = scipy.fft.ifft(np.conj(scipy.fft.fft(a, size)) * scipy.fft.fft(b, size))
    lag = np.arange(-max_lag, max_lag + 1)
    power = np.sqrt((np.abs(a) ** 2).sum(-1) * (np.abs(b) ** 2).sum(-1))[..., None]
    return np.asarray(np.conj(cross[..., lag]) / np.where(power > 0, power, 1.0)), lag / rate


def parabolic_peak(samples: ArrayLike, spacing: float, start: float = 0.0) -> tuple[Floats, Floats]:
    """Position and height of the maximum of a curve: the parabola through its highest sample and both neighbours.

    Args:
        samples: Samples of the curve, real, shape (..., n).
        spacing: Distance between samples.
        start: Position of the first sample.

    Returns:
        Position, in the unit of `spacing`, and height, each of shape (...); the end sample itself where that is
        highest.

    Example:
        >>> position, height = parabolic_peak(1 - (np.arange(5) - 2.3) ** 2, spacing=1.0)
        >>> print(position.round(3), height.round(3))
        2.3 1.0
    """
    curve = np.asarray(samples, float)
    index = np.argmax(curve, axis=-1)
    inner = np.clip(index, 1, max(curve.shape[-1] - 2, 1))
    if curve.shape[-1] < 3:
        return start + spacing * index, curve.max(axis=-1)
    low, mid, high = (np.take_along_axis(curve, (inner + k)[..., None], -1)[..., 0] for k in (-1, 0, 1))
    curvature = low - 2 * mid + high
    at_end = (index != inner) | (curvature >= 0)
    shift = np.where(at_end, 0.0, 0.5 * (low - high) / np.where(at_end, 1.0, curvature))
    return start + spacing * (np.where(at_end, index, inner) + shift), np.where(
        at_end, curve.max(axis=-1), mid - 0.25 * (low - high) * shift
    )


def displaced_phase_centres(first: ArrayLike, second: ArrayLike) -> Floats:
    """Coherence of every channel of one ping with every channel of the next [1]: the redundant phase centres.

    Where channel m of the first ping and channel n of the second have the same phase centre (half way between
    transmitter and receiver), they receive the same speckle. With spacing d, a ridge at m - n = k means
    that the sonar moved by k d / 2.

    Args:
        first: Series of one ping, shape (channel, time), aligned in time.
        second: Series of the next ping, shape (channel, time).

    Returns:
        Modulus of the complex coherence, shape (channel of the first, channel of the second).

    Source: Bellettini & Pinto (2002), IEEE J. Oceanic Eng. 27(4), 780-789; not verified.

    Example:
        >>> field = np.exp(2j * np.pi * np.outer(np.arange(5), np.arange(64)) / 64)  # five unlike series
        >>> displaced_phase_centres(field[:4], field[1:]).round(1).tolist()  # the sonar moved by half a spacing
        [[0.0, 0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]
    """
    a, b = _pair(first, second)
    if a.ndim != 2:
        raise ValueError(f"first has shape {a.shape}; give (channel, time)")
    size = [np.sqrt((np.abs(x) ** 2).sum(axis=1)) for x in (a, b)]
    power = np.outer(*size)
    return np.asarray(np.abs(a @ np.conj(b).T) / np.where(power > 0, power, 1.0))


def dpca_displacement(coherence: ArrayLike, spacing: float) -> tuple[float, float]:
    """Displacement of a sonar along its array between two pings, from `displaced_phase_centres` [m].

    Args:
        coherence: Modulus, shape (channel, channel).
        spacing: Spacing of the channels along the track, in their order [m]: positive if the last is ahead.

    Returns:
        Displacement [m], and the coherence there [1]: both from a parabola through the means of |coherence| along
        the diagonals.

    Example:
        >>> coherence = np.eye(8, k=-1)  # every channel has the phase centre of the one behind it, one ping later
        >>> displacement, height = dpca_displacement(coherence, spacing=0.05)
        >>> round(displacement, 4), round(height, 2)
        (0.025, 1.0)
    """
    matrix = np.asarray(coherence, float)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1]:
        raise ValueError(f"coherence has shape {matrix.shape}; give (channel, channel)")
    # the outermost diagonals have too few channels for a reliable mean
    diagonal_count = max(1, matrix.shape[0] - max(1, matrix.shape[0] // 8))
    shifts = np.arange(1 - diagonal_count, diagonal_count)
    means = [float(np.mean(np.diagonal(matrix, -int(k)))) for k in shifts]
    position, height = parabolic_peak(
        means, require_number("spacing", spacing, "m") / 2, float(shifts[0]) * spacing / 2
    )
    return float(position), float(height)


def _pair(first: ArrayLike, second: ArrayLike) -> tuple[Complexes, Complexes]:
    a, b = np.asarray(first), np.asarray(second)
    if a.shape != b.shape or a.ndim < 1:
        raise ValueError(f"first has shape {a.shape} and second {b.shape}; give two of one shape, time last")
    if "c" not in (a.dtype.kind, b.dtype.kind):
        raise ValueError("first and second are real; give complex baseband: coherence needs their phase")
    return a.astype(complex), b.astype(complex)


def _window(looks: int | tuple[int, int], axes: int) -> tuple[int, ...]:
    last = (looks,) if isinstance(looks, int | np.integer) else tuple(looks)
    if len(last) > axes or min(last) < 1 or any(n % 2 == 0 for n in last):
        raise ValueError(f"looks is {looks}; give odd numbers, one for each of the last axes")
    return (1,) * (axes - len(last)) + last
