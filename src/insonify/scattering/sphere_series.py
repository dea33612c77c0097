"""Exact bistatic scattering by a rigid or soft sphere of any size.

The incident plane wave is a sum of spherical waves, each of which the sphere scatters independently.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.polynomial.legendre import legval
from numpy.typing import ArrayLike, NDArray

from insonify.validity import require_numbers, require_sound_speed, warn_outside

Floats = NDArray[np.float64]
Boundary = Literal["rigid", "soft"]
LARGEST_KA = 5000.0
"""Wavenumber times radius up to which the series is summed [1]."""


def sphere_series_strength_db(
    radius: ArrayLike, frequency: ArrayLike, *, boundary: Boundary = "rigid", angle: ArrayLike = np.pi,
    sound_speed: ArrayLike = 1500.0,
) -> Floats:  # fmt: skip
    """Target strength of a sphere by its partial waves [dB re 1 m^2].

    Args:
        radius: Radius [m], any shape.
        frequency: Frequency [Hz], broadcast.
        boundary: "rigid" (no normal velocity) or "soft" (no pressure, such as a large bubble).
        angle: Angle between the directions of incidence and scattering, 0 forward, pi back [rad], broadcast.
        sound_speed: Sound speed in the water [m/s], broadcast.

    Returns:
        20 log10 |F|, broadcast shape; F as in `sphere_amplitude`.

    Example:
        >>> sphere_series_strength_db(radius=0.5, frequency=[1e3, 100e3]).round(1).tolist()
        [-13.4, -12.0]
    """
    tone = require_numbers("frequency", frequency, "Hz", 0.0, exclude_low=True, allow_nan=False)
    k = 2 * np.pi * tone / require_sound_speed("sound_speed", sound_speed, gaps=False)
    a, k, angles = np.broadcast_arrays(
        require_numbers("radius", radius, "m", 0.0, exclude_low=True, allow_nan=False),
        k,
        require_numbers("angle", angle, "rad", allow_nan=False),
    )
    pairs = zip((k * a).flat, angles.flat, strict=True)
    amplitude = np.array([sphere_amplitude(ka, at, boundary=boundary) for ka, at in pairs], complex)
    return np.asarray(20 * np.log10(np.abs(amplitude.reshape(a.shape)) * a))


def sphere_amplitude(ka: float, angle: ArrayLike = np.pi, *, boundary: Boundary = "rigid") -> NDArray[np.complex128]:
    """Far-field amplitude of a sphere over its radius, F / a [1].

    Args:
        ka: Wavenumber times radius [1].
        angle: Angle between incidence and scattering, 0 forward, pi back [rad], any shape.
        boundary: "rigid" or "soft".

    Returns:
        Complex amplitude for exp(+j 2 pi f t), shape of the angle: the scattered pressure is F exp(-j k r) / r.

    Source: the classical partial-wave series (Anderson 1950, J. Acoust. Soc. Am. 22, 426, for fluid spheres; its
    rigid and soft limits), F = (i/k) sum (2n + 1) eta_n P_n(cos angle), eta_n = j_n'/h_n' rigid, j_n/h_n soft, with
    h_n = j_n + i y_n, in exp(-i omega t), and conjugated. Checked against the benchmark of Jech et al. (2015).
    Valid: 0 < ka <= 5000.
    """
    if boundary not in get_args(Boundary):
        raise ValueError(f"boundary is {boundary!r}; give 'rigid' or 'soft'")
    if not 0 < ka <= LARGEST_KA:
        raise ValueError(f"ka is {ka:g}; the series is summed for 0 < ka <= {LARGEST_KA:g}. "
                         "For a larger sphere use sphere_strength_db.")  # fmt: skip
    eta = partial_waves(ka, boundary)
    n = np.arange(eta.size)
    # eta is written for exp(-i omega t), where F = (i/k) sum: conjugated here.
    series = legval(np.cos(require_numbers("angle", angle, "rad")), (2 * n + 1) * eta)
    return np.asarray(np.conj(1j * series / ka))


def partial_waves(ka: float, boundary: Boundary = "rigid") -> NDArray[np.complex128]:
    """Coefficients eta_n of outgoing waves for exp(-i omega t) [1], from ka [1], shape (orders,), until they vanish."""
    from scipy.special import spherical_jn, spherical_yn

    warn_outside("Partial waves of a sphere", "ka", ka, 1e-3, LARGEST_KA, "")
    # Beyond n = ka the terms fall faster than exponentially; a count of this form is Wiscombe's (1980) in optics.
    n = np.arange(int(ka + 6 * ka ** (1 / 3) + 8))
    is_derivative = boundary == "rigid"
    j, y = spherical_jn(n, ka, is_derivative), spherical_yn(n, ka, is_derivative)
    is_finite = np.isfinite(y)
    return np.where(is_finite, j / (j + 1j * np.where(is_finite, y, 1.0)), 0.0)
