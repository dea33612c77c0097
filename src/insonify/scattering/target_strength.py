"""Target strength of simple bodies in closed form, used as references.

Target strength is 10 log10 of the backscattered intensity at 1 m, referred to as if in the far field,
over the incident intensity [dB re 1 m^2]. All bodies are rigid or soft (the magnitude is the same) and
large against the wavelength; the formulas are the Kirchhoff (physical optics) integral of each body.
For spheres of any size see `insonify.scattering.sphere_series`.

Far field begins at about (largest side)^2 / wavelength: 270 m for a plate of 2 m at 100 kHz.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import require_numbers, require_sound_speed, warn_outside

Floats = NDArray[np.float64]
_FLOOR = 1e-300  # a null of a pattern in decibels: -3000 dB, not minus infinity

SMALLEST_KA = 10.0
"""Wavenumber times radius below which the error of a closed form exceeds about 1 dB [1]."""


def sphere_strength_db(radius: ArrayLike) -> Floats:
    """Target strength of a large sphere, independent of frequency [dB re 1 m^2].

    Args:
        radius: Radius [m], any shape.

    Returns:
        20 log10(radius / 2).

    Source: geometrical optics (Urick 1983, Principles of Underwater Sound, table of simple forms).
    Valid: ka > 10 (within about 1 dB of the exact series of a rigid sphere).

    Example:
        >>> sphere_strength_db([0.5, 2.0]).round().tolist()
        [-12.0, 0.0]
    """
    return curved_strength_db(radius, radius)


def curved_strength_db(radius_one: ArrayLike, radius_two: ArrayLike) -> Floats:
    """Target strength of a convex surface at normal incidence [dB re 1 m^2].

    Args:
        radius_one: First principal radius of curvature [m], any shape.
        radius_two: Second principal radius of curvature [m], broadcast.

    Returns:
        20 log10(sqrt(R1 R2) / 2).

    Source: geometrical optics (Urick 1983, table of simple forms).
    Valid: both radii much larger than the wavelength, and the body larger than a Fresnel zone.

    Example:
        >>> f"{curved_strength_db(0.5, 2.0):.1f} dB re 1 m^2"
        '-6.0 dB re 1 m^2'
    """
    one, two = _positive("radius of curvature", radius_one), _positive("radius of curvature", radius_two)
    return np.asarray(10 * np.log10(one * two / 4))


def cylinder_strength_db(
    radius: ArrayLike, length: ArrayLike, frequency: ArrayLike, *, tilt: ArrayLike = 0.0,
    sound_speed: ArrayLike = 1500.0,
) -> Floats:  # fmt: skip
    """Target strength of the side of a cylinder [dB re 1 m^2].

    Args:
        radius: Radius [m], any shape.
        length: Length [m], broadcast.
        frequency: Frequency [Hz], broadcast.
        tilt: Angle of the line of sight from broadside, towards an end, -pi/2 to pi/2 [rad], broadcast.
        sound_speed: Sound speed in the water [m/s], broadcast.

    Returns:
        10 log10(a L^2 / (2 lambda) cos(tilt) [sin(x) / x]^2), x = k L sin(tilt); the ends are left out.

    Source: Kirchhoff's integral over the illuminated side by stationary phase. It differs from tables of simple forms
    that print cos^2 (Urick 1983) by 10 log10 cos(tilt).
    Valid: ka cos(tilt) > 10, in the far field of the length.

    Example:
        >>> cylinder_strength_db(radius=0.25, length=2.0, frequency=100e3, tilt=np.radians([0, 5])).round().tolist()
        [15.0, -25.0]
    """
    a, L = _positive("radius", radius), _positive("length", length)
    k = _wavenumber(frequency, sound_speed)
    beta = _within_a_right_angle(tilt)
    warn_outside("Kirchhoff cylinder", "ka", k * a, SMALLEST_KA, np.inf, "")
    broadside = a * L**2 * k / (4 * np.pi)
    return _db(broadside * np.cos(beta) * _sinc(k * L * np.sin(beta)) ** 2)


def plate_strength_db(
    side: ArrayLike, other_side: ArrayLike, frequency: ArrayLike, *, tilt: ArrayLike = 0.0,
    sound_speed: ArrayLike = 1500.0,
) -> Floats:  # fmt: skip
    """Target strength of a flat rectangular plate [dB re 1 m^2].

    Args:
        side: Side in the plane of the tilt [m], any shape.
        other_side: Side across the plane of the tilt [m], broadcast.
        frequency: Frequency [Hz], broadcast.
        tilt: Angle of the line of sight from the normal, -pi/2 to pi/2 [rad], broadcast.
        sound_speed: Sound speed in the water [m/s], broadcast.

    Returns:
        20 log10(A / lambda cos(tilt) |sin(x) / x|), x = k side sin(tilt).

    Source: Kirchhoff's integral over the plate (Urick 1983, table of simple forms).
    Valid: sides much larger than the wavelength, tilts up to about 45 deg, in the far field.

    Example:
        >>> f"{plate_strength_db(1.0, 1.0, frequency=100e3):.1f} dB re 1 m^2"
        '36.5 dB re 1 m^2'
    """
    b, width, k = _positive("side", side), _positive("other_side", other_side), _wavenumber(frequency, sound_speed)
    beta = _within_a_right_angle(tilt)
    warn_outside("Kirchhoff plate", "k times the smaller side", k * np.minimum(b, width), SMALLEST_KA, np.inf, "")
    return _db((b * width * k / (2 * np.pi) * np.cos(beta) * _sinc(k * b * np.sin(beta))) ** 2)


def disc_strength_db(
    radius: ArrayLike, frequency: ArrayLike, *, tilt: ArrayLike = 0.0, sound_speed: ArrayLike = 1500.0
) -> Floats:
    """Target strength of a flat circular disc [dB re 1 m^2].

    Args:
        radius: Radius [m], any shape.
        frequency: Frequency [Hz], broadcast.
        tilt: Angle of the line of sight from the normal, -pi/2 to pi/2 [rad], broadcast.
        sound_speed: Sound speed in the water [m/s], broadcast.

    Returns:
        20 log10(pi a^2 / lambda cos(tilt) |2 J1(x) / x|), x = 2 k a sin(tilt).

    Source: Kirchhoff's integral over the disc (Urick 1983, table of simple forms).
    Valid: ka > 10, tilts up to about 45 deg, in the far field.

    Example:
        >>> f"{disc_strength_db(radius=0.5, frequency=100e3):.1f} dB re 1 m^2"
        '34.4 dB re 1 m^2'
    """
    from scipy.special import j1

    a, k, beta = _positive("radius", radius), _wavenumber(frequency, sound_speed), _within_a_right_angle(tilt)
    warn_outside("Kirchhoff disc", "ka", k * a, SMALLEST_KA, np.inf, "")
    x = 2 * k * a * np.sin(beta)
    safe = np.where(np.abs(x) > 1e-8, x, 1.0)
    pattern = np.where(np.abs(x) > 1e-8, 2 * j1(safe) / safe, 1.0)
    return _db((0.5 * k * a**2 * np.cos(beta) * pattern) ** 2)


def _positive(name: str, value: ArrayLike) -> Floats:
    return require_numbers(name, value, "m", 0.0, exclude_low=True, allow_nan=False)


def _wavenumber(frequency: ArrayLike, sound_speed: ArrayLike) -> Floats:
    tone = require_numbers("frequency", frequency, "Hz", 0.0, exclude_low=True, allow_nan=False)
    return np.asarray(2 * np.pi * tone / require_sound_speed("sound_speed", sound_speed, gaps=False))


def _within_a_right_angle(tilt: ArrayLike) -> Floats:
    right = np.pi / 2 + 1e-12
    return require_numbers(
        "tilt", tilt, "rad", -right, right, allow_nan=False, example="0 where the body is seen face on"
    )


def _sinc(x: Floats) -> Floats:
    return np.asarray(np.sinc(x / np.pi))  # numpy's sinc is sin(pi x) / (pi x)


def _db(cross_section: Floats) -> Floats:
    """Level of a backscattering cross section [dB re 1 m^2]."""
    return np.asarray(10 * np.log10(np.maximum(cross_section, _FLOOR)))
