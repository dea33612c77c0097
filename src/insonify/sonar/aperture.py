"""Far-field pattern of a shaded aperture: the sum of the fields of its elements, as a function of direction.

Every shading is a short cosine series along the aperture. A continuous aperture's pattern is therefore a short sum of
shifted sinc functions; a row of elements samples the same shading. The variable is
x = aperture / wavelength times the sine of the angle off the steered axis.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

TAYLOR_SIDELOBE_DB = 30.0
"""Depth of the first side lobes of taylor shading [dB]."""
TAYLOR_EQUAL_LOBES = 4
"""Number of nearly equal side lobes of taylor shading, counting the main lobe (n-bar)."""

EXTRA_NODES = 12
"""Nodes added to those of a quadrature, so that its error is a rounding for a short aperture too [1]."""
FIT_NODES_PER_RADIAN = 1.2
"""Nodes per radian of phase at an aperture's end, for a least-squares fit with small weights [1]."""
_SAMPLES_PER_NODE = 5


class ApertureSide(NamedTuple):
    """One side of an aperture, across or down."""

    extent: float
    """Length [wavelengths]; 0: none."""
    elements: int | None
    """Number of point elements; None: continuous."""
    shading: str
    """Shading: uniform, cosine, hann, hamming or taylor."""


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
        elements: Number of point elements; None: a continuous aperture.

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
    """Pattern of an aperture without shading, and its derivative by x: a sinc, or a periodic sinc of n elements.

    The sum over n elements is sin(pi x) / (n sin(pi x / n)), a ratio of two sincs. Its period is n, with a change of
    sign for an even n.

    Source: van Trees (2002), Optimum Array Processing, ch. 2 (not verified).
    """
    if elements is None:
        return np.sinc(x), _sinc_slope(x)
    replica = np.round(x / elements)
    offset, sign = x - replica * elements, 1 - 2 * (replica * (elements - 1) % 2)
    element = np.sinc(offset / elements)  # 2 / pi or more
    value = np.sinc(offset) / element
    return sign * value, sign * (_sinc_slope(offset) - value * _sinc_slope(offset / elements) / elements) / element


def _sinc_slope(x: Floats) -> Floats:
    """Derivative of sin(pi x) / (pi x)."""
    is_small = np.abs(x) < 1e-3
    safe = np.where(is_small, 1.0, x)
    series = -(np.pi**2) * x / 3 + np.pi**4 * x**3 / 30
    return np.where(is_small, series, (np.cos(np.pi * safe) - np.sinc(safe)) / safe)


@lru_cache(maxsize=16)
def cosine_series(sides: tuple[ApertureSide, ...], reach: float) -> tuple[Floats, Floats]:
    """Pattern of an aperture, or a product of patterns, as a sum of weight cos(2 pi position s).

    The pattern of a row of elements is such a sum. A continuous aperture is replaced by points at the nodes of a
    quadrature. The product of two patterns is that of an aperture as long as both together; its weights are a
    least-squares fit.

    Args:
        sides: Sides whose patterns are multiplied, none of extent 0.
        reach: Greatest s [1], the difference of two direction cosines.

    Returns:
        Positions, 0 or more [wavelengths], and weights [1], each of the two points at plus and minus that position
        together, each of shape (n,).

    Source: Gauss-Legendre quadrature of n nodes has no error for polynomials up to degree 2 n - 1; Trefethen (2013),
    Approximation Theory and Approximation Practice, ch. 19 (not verified).
    """
    extent, first = sum(side.extent for side in sides), sides[0]
    if len(sides) == 1 and first.elements is not None:
        position, quadrature = element_positions(first.elements), np.full(first.elements, 1 / first.elements)
    else:
        phase = np.pi * extent * reach  # at either end: about the degree of a polynomial that is as good
        count = phase / 2 + 3 * np.cbrt(phase) if len(sides) == 1 else FIT_NODES_PER_RADIAN * phase
        position, quadrature = _quadrature(int(count) + EXTRA_NODES)
    upper_half = position >= 0
    weight = np.where(position > 0, 2.0, 1.0) * quadrature * shading_weight(first.shading, position)
    position = position[upper_half] * extent
    if len(sides) == 1:
        return read_only(position), read_only(weight[upper_half] / weight[upper_half].sum())
    count = _SAMPLES_PER_NODE * len(position)
    direction_sine = (1 - np.cos((np.arange(count) + 0.5) * np.pi / count)) * reach / 2
    value = np.prod([pattern(side.extent * direction_sine, side.shading, side.elements)[0] for side in sides], axis=0)
    weight = np.linalg.lstsq(np.cos(2 * np.pi * direction_sine[:, None] * position), value, rcond=1e-12)[0]
    return read_only(position), read_only(weight)


@lru_cache(maxsize=8)
def _quadrature(count: int) -> tuple[Floats, Floats]:
    """Gauss-Legendre nodes and weights over an aperture of unit length, cached: many nodes take half a second."""
    node, weight = np.polynomial.legendre.leggauss(count)
    return node / 2, weight / 2


def read_only(numbers: Floats) -> Floats:
    """Read-only contiguous array of some numbers, for a cache that shares it; kernels compile it as one type."""
    array = np.ascontiguousarray(numbers)
    array.setflags(write=False)
    return array


def _taylor_series() -> tuple[tuple[float, float], ...]:
    """Cosine series of Taylor's shading, from a sampled window: a cosine series is exact on its own samples."""
    from scipy.signal.windows import taylor

    count = 64
    window = taylor(count, nbar=TAYLOR_EQUAL_LOBES, sll=TAYLOR_SIDELOBE_DB, norm=False, sym=True)
    position = element_positions(count)
    orders = range(TAYLOR_EQUAL_LOBES)
    return tuple(
        (float(m), float((1 if m == 0 else 2) * np.mean(window * np.cos(2 * np.pi * m * position)))) for m in orders
    )
