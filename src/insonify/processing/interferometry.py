"""Interferometry: depth of the seabed from the phase between two receivers, one above the other."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.processing.coherence import complex_coherence
from insonify.processing.element_series import checked_carrier
from insonify.validity import require_number, require_numbers

Floats = NDArray[np.float64]


def phase_to_elevation(
    phase: ArrayLike, *, baseline: float, tilt: ArrayLike, centre_frequency: float, sound_speed: float = 1500.0
) -> Floats:
    """Elevation of an echo from the phase between two receivers [rad], down from the horizontal.

    Args:
        phase: Unwrapped phase of the upper receiver re the lower one [rad], any shape.
        baseline: Distance between the receivers [m].
        tilt: Direction of broadside, perpendicular to the baseline, down from the horizontal [rad], broadcast.
        centre_frequency: Centre frequency of the baseband [Hz].
        sound_speed: Sound speed of the water [m/s].

    Returns:
        Elevation [rad], shape of phase; NaN where the phase exceeds what the baseline allows.

    Source: Lurton (2010), An Introduction to Underwater Acoustics, 2nd ed., sec. 8.4 (interferometric sonar): the
    phase is k a sin(angle off broadside); not verified. Plane waves: for a point at range R from the middle of a
    baseline a the angle off broadside is underestimated by (a / 4 R)^2 times the sine of twice the angle.

    Example:
        >>> array = {"baseline": 0.04, "tilt": np.radians(30), "centre_frequency": 150e3}  # four wavelengths
        >>> np.degrees(phase_to_elevation([0.0, 2.19], **array)).round(1).tolist()
        [30.0, 25.0]
    """
    frequency, speed = checked_carrier(centre_frequency, sound_speed)
    length = require_number("baseline", baseline, "m", 0.0, exclude_low=True, example="0.05")
    sine = -require_numbers("phase", phase, "rad") * speed / (2 * np.pi * frequency * length)
    inside = np.abs(sine) <= 1
    return np.where(inside, np.asarray(tilt) + np.arcsin(np.where(inside, sine, 0.0)), np.nan)


def elevation_to_phase(
    elevation: ArrayLike, *, baseline: float, tilt: ArrayLike, centre_frequency: float, sound_speed: float = 1500.0
) -> Floats:
    """Phase of the upper receiver re the lower one at some elevation [rad]; inverse of `phase_to_elevation`.

    Args:
        elevation: Elevation, down from the horizontal [rad], any shape.
        baseline: Distance between the receivers [m].
        tilt: Direction of broadside, down from the horizontal [rad], broadcast.
        centre_frequency: Centre frequency of the baseband [Hz].
        sound_speed: Sound speed of the water [m/s].

    Example:
        >>> array = {"baseline": 0.04, "tilt": np.radians(30), "centre_frequency": 150e3}  # four wavelengths
        >>> elevation_to_phase(np.radians([25, 35]), **array).round(2).tolist()
        [2.19, -2.19]
    """
    frequency, speed = checked_carrier(centre_frequency, sound_speed)
    wave = 2 * np.pi * frequency * require_number("baseline", baseline, "m", 0.0, exclude_low=True) / speed
    return np.asarray(-wave * np.sin(np.asarray(elevation, float) - np.asarray(tilt)))


def flat_bed_elevation(slant_range: ArrayLike, altitude: ArrayLike) -> Floats:
    """Elevation of a flat seabed, down from the horizontal [rad]; pi/2 for ranges below the altitude.

    Args:
        slant_range: Slant range [m], any shape.
        altitude: Height above the seabed [m], broadcast against `slant_range`.

    Example:
        >>> np.degrees(flat_bed_elevation([5.0, 10.0, 20.0], altitude=10.0)).round(1).tolist()
        [90.0, 90.0, 30.0]
    """
    distance = np.maximum(require_numbers("slant_range", slant_range, "m"), 1e-9)
    return np.asarray(np.arcsin(np.clip(require_numbers("altitude", altitude, "m", 0.0) / distance, 0, 1)))


def unwrap_to_reference(phase: ArrayLike, expected: ArrayLike) -> Floats:
    """Phase plus the whole cycles that bring it within half a cycle of the expected one [rad].

    Args:
        phase: Phase modulo 2 pi [rad], any shape.
        expected: Expected phase, such as that of a flat seabed [rad], broadcast against `phase`.

    Example:
        >>> unwrap_to_reference([0.5, -3.0], expected=[12.0, 4.0]).round(2).tolist()  # two cycles more, and one
        [13.07, 3.28]
    """
    given = np.asarray(phase, float)
    return np.asarray(given + 2 * np.pi * np.round((np.asarray(expected, float) - given) / (2 * np.pi)))


def phase_deviation(coherence: ArrayLike, looks: ArrayLike) -> Floats:
    """Standard deviation of an interferometric phase, sqrt((1 - g^2) / (2 N g^2)) [rad].

    Args:
        coherence: Modulus g of the coherence, 0..1, any shape; infinite where it is zero.
        looks: Number of independent looks N, broadcast against `coherence`.

    Source: Rodriguez & Martin (1992), IEE Proc. F 139(2), 147-159 (the Cramer-Rao bound); holds where it is well
    below a cycle; not verified.

    Example:
        >>> np.degrees(phase_deviation(0.9, looks=[1, 15])).round(1).tolist()
        [19.6, 5.1]
    """
    g = require_numbers("coherence", coherence, "", 0.0, 1 + 1e-9)
    with np.errstate(divide="ignore"):
        return np.asarray(
            np.sqrt(np.maximum(1 - g**2, 0) / (2 * require_numbers("looks", looks, "", 0.0, exclude_low=True) * g**2))
        )


def interferometric_depth(
    upper: ArrayLike, lower: ArrayLike, slant_range: ArrayLike, *, altitude: ArrayLike, baseline: float,
    tilt: ArrayLike, centre_frequency: float, sound_speed: float = 1500.0, looks: int | tuple[int, int] = (1, 15),
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Position of the seabed from the phase between two receivers, one above the other.

    Args:
        upper: Complex baseband of the upper receiver, shape (ping, time).
        lower: Complex baseband of the lower receiver, shape (ping, time).
        slant_range: Slant range of each sample from the middle of the two [m], shape (time,).
        altitude: Expected height above the seabed, which resolves whole cycles [m]: one number, or (ping,).
        baseline: Distance between the receivers [m].
        tilt: Direction of broadside, perpendicular to the baseline, down from the horizontal [rad]: one number, or
                (ping,), where roll changes it.
        centre_frequency: Centre frequency of the baseband [Hz].
        sound_speed: Sound speed of the water [m/s].
        looks: Pings and samples to average each phase over; odd.

    Returns:
        Across-track distance [m], depth below the receivers [m], modulus of the coherence [1]; each (ping, time).
        NaN where the phase allows no angle.

    Raises:
        ValueError: Shapes that do not fit.

    Phase is averaged after the flat seabed's phase has been removed, so that its slope does not reduce coherence. With
    a baseline of a wavelengths, cycles are resolved correctly within slant_range / (2 a cos) of the expected seabed.

    Example:
        >>> array = {"baseline": 0.04, "tilt": np.radians(30), "centre_frequency": 150e3}
        >>> slant_range = np.array([15.0, 20.0, 40.0])
        >>> upper = np.exp(1j * elevation_to_phase(flat_bed_elevation(slant_range, 10.0), **array))[None]
        >>> lower = np.ones((1, 3), complex)
        >>> across, depth, _ = interferometric_depth(upper, lower, slant_range, altitude=9.0, looks=1, **array)
        >>> across.round(1).tolist(), depth.round(1).tolist()  # 10 m deep, where 9 m were expected
        ([[11.2, 17.3, 38.7]], [[10.0, 10.0, 10.0]])
    """
    a, b = np.asarray(upper), np.asarray(lower)
    distance = require_numbers("slant_range", slant_range, "m", allow_nan=False)
    if a.ndim != 2 or a.shape != b.shape or distance.shape != a.shape[1:]:
        raise ValueError(
            f"upper has shape {a.shape}, lower {b.shape}, slant_range {distance.shape}; "
            "give (ping, time), the same, (time,)"
        )
    height = np.broadcast_to(require_numbers("altitude", altitude, "m", 0.0, allow_nan=False), (len(a),))
    ping_tilt = np.broadcast_to(require_numbers("tilt", tilt, "rad", allow_nan=False), (len(a),))[:, None]
    flat = flat_bed_elevation(distance, height[:, None])
    expected = elevation_to_phase(flat, baseline=baseline, tilt=ping_tilt, centre_frequency=centre_frequency,
                                  sound_speed=sound_speed)  # fmt: skip
    flattened = complex_coherence(a * np.exp(-1j * expected), b.astype(complex), looks)
    elevation = phase_to_elevation(expected + np.angle(flattened), baseline=baseline, tilt=ping_tilt,
                                   centre_frequency=centre_frequency, sound_speed=sound_speed)  # fmt: skip
    return distance * np.cos(elevation), distance * np.sin(elevation), np.abs(flattened)
