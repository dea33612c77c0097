"""Far-field pattern of an aperture: how a row of sound, weighted, adds up off its axis.

Every shading here is a short cosine series along the aperture, so a continuous aperture's
pattern is a short sum of shifted sinc functions; a row of elements samples the same shading.
The one variable is x = aperture / wavelength times the sine of the angle off the steered axis.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

TAYLOR_SIDELOBE_DB = 30.0
"""Depth of the first side lobes of taylor shading [dB]."""
TAYLOR_EQUAL_LOBES = 4
"""Number of nearly equal side lobes of taylor shading, counting the main lobe (n-bar)."""


@lru_cache(maxsize=8)
def shading_series(shading: str) -> tuple[tuple[float, float], ...]:
    """Cosine series of a shading along an aperture of unit length.

    Args:
        shading: uniform, cosine, hann, hamming or taylor.

    Returns:
        Pairs (order m, coefficient a): weight(s) = sum of a cos(2 pi m s), s in -1/2..1/2.

    Source: F. J. Harris (1978), Proc. IEEE 66(1), 51-83 (cosine, Hann, Hamming);
    T. T. Taylor (1955), IRE Trans. Antennas Propag. 3(1), 16-28 (n-bar 4, -30 dB).
    """
    series = {
        "uniform": ((0.0, 1.0),),
        "cosine": ((0.5, 1.0),),
        "hann": ((0.0, 0.5), (1.0, 0.5)),
        "hamming": ((0.0, 0.54), (1.0, 0.46)),
    }
    return series[shading] if shading in series else _taylor_series()


def shading_weight(shading: str, position: ArrayLike) -> Floats:
    """Weight of a shading along an aperture of unit length [1].

    Args:
        shading: uniform, cosine, hann, hamming or taylor.
        position: Distance from the middle in lengths of the aperture, -1/2..1/2, any shape.
    """
    s = np.asarray(position, dtype=float)
    return np.asarray(sum(a * np.cos(2 * np.pi * m * s) for m, a in shading_series(shading)) + 0 * s)


def element_positions(elements: int) -> Floats:
    """Centres of elements that fill an aperture of unit length, shape (elements,)."""
    return (np.arange(elements) - (elements - 1) / 2) / elements


def pattern(x: ArrayLike, shading: str, elements: int | None = None) -> tuple[Floats, Floats]:
    """Amplitude pattern of an aperture and its slope.

    Args:
        x: Aperture over wavelength, times the sine off the steered axis [1], any shape.
        shading: uniform, cosine, hann, hamming or taylor.
        elements: Number of point elements; none for a continuous aperture.

    Returns:
        Pattern, one on axis, and its derivative by x; shape of x. Both are real, by symmetry.

    Source: Fourier transform of the shading; van Trees (2002), Optimum Array Processing, ch. 2-3.
    """
    x = np.asarray(x, dtype=float)
    value, slope, on_axis = np.zeros_like(x), np.zeros_like(x), 0.0
    for order, coefficient in shading_series(shading):
        for shift in (-order, order):
            shifted, change = _unshaded(x + shift, elements)
            value += coefficient / 2 * shifted
            slope += coefficient / 2 * change
        on_axis += coefficient * float(_unshaded(np.array(order), elements)[0])
    return value / on_axis, slope / on_axis


def _unshaded(x: Floats, elements: int | None) -> tuple[Floats, Floats]:
    """Pattern without shading, and its slope: of a continuous aperture a sinc, of elements a periodic one.

    The sum over n elements is sin(pi x) / (n sin(pi x / n)), a ratio of two sincs; it repeats after n, for an even n
    with the other sign.

    Source: van Trees (2002), Optimum Array Processing, ch. 2 (from memory).
    """
    if elements is None:
        return np.sinc(x), _sinc_slope(x)
    replica = np.round(x / elements)
    near, sign = x - replica * elements, 1 - 2 * (replica * (elements - 1) % 2)
    element = np.sinc(near / elements)  # 2 / pi or more
    value = np.sinc(near) / element
    return sign * value, sign * (_sinc_slope(near) - value * _sinc_slope(near / elements) / elements) / element


def _sinc_slope(x: Floats) -> Floats:
    """Derivative of sin(pi x) / (pi x)."""
    near = np.abs(x) < 1e-3
    safe = np.where(near, 1.0, x)
    series = -(np.pi**2) * x / 3 + np.pi**4 * x**3 / 30
    return np.where(near, series, (np.cos(np.pi * safe) - np.sinc(safe)) / safe)


def _taylor_series() -> tuple[tuple[float, float], ...]:
    """Taylor's coefficients, read back from a sampled window: a cosine series is exact on its own samples."""
    from scipy.signal.windows import taylor

    count = 64
    window = taylor(count, nbar=TAYLOR_EQUAL_LOBES, sll=TAYLOR_SIDELOBE_DB, norm=False, sym=True)
    position = element_positions(count)
    orders = range(TAYLOR_EQUAL_LOBES)
    return tuple(
        (float(m), float((1 if m == 0 else 2) * np.mean(window * np.cos(2 * np.pi * m * position)))) for m in orders
    )
