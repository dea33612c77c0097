"""Gain that makes the image of a uniform seabed uniform.

Time-varied gain compensates range by a law; an empirical gain compensates the recording's own median
level at each range.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.time_varied_gain import MIN_RANGE, tvg_db
from insonify.units import intensity_ratio, level_db

Floats = NDArray[np.float64]

LAWS = {"tvg20": 20.0, "tvg30": 30.0, "tvg40": 40.0}
"""Decibels per decade of range: for a one-way beam, for an extended seabed, for a point."""
LOOKS = 64
"""Least number of samples whose median is one point of an empirical curve."""
SILENT = 30.0
"""Level below the overall median, after time-varied gain, beyond which a range is not lifted further [dB]."""


def lambert_gain_db(slant_range: Floats, altitude: Floats, *, absorption_db_per_m: float = 0.0) -> Floats:
    """Gain under which a flat seabed that scatters by Lambert's law is uniform [dB].

    On a flat seabed the insonified area is proportional to slant range over the cosine of the grazing angle, and
    Lambert's law squares its sine, altitude over slant range. Beams are taken as wide in elevation.

    Args:
        slant_range: Slant range [m], shape (samples,).
        altitude: Height above the seabed [m], shape (...).
        absorption_db_per_m: One-way absorption of the water [dB/m].

    Returns:
        Gain [dB], shape (..., samples); in the water column, before the first bottom return, that of the first return.
        With it, a level [dB re 1 uPa] is that of source level, strength of the bed and its area per metre of range.

    Source: Lambert's law as in Urick (1983), ch. 8, and the area of a range cell on a plane.

    Example:
        >>> lambert_gain_db(np.array([50.0, 500.0]), np.array(10.0)).round(1).tolist()  # 50 dB for ten times the range
        [64.9, 114.9]
    """
    height = np.maximum(np.asarray(altitude, float)[..., None], MIN_RANGE / 10)
    # The first return comes from a disc, not from a strip: grazing angles are limited to 60 degrees.
    limited_range = np.maximum(slant_range, height / np.sin(np.radians(60)))
    sine = height / limited_range
    seabed_db = -level_db(sine**2) + level_db(np.sqrt(1 - sine**2))
    return np.asarray(tvg_db(limited_range, 30.0, absorption_db_per_m=absorption_db_per_m) + seabed_db)


def empirical_gain_db(level: Floats, slant_range: Floats, *, absorption_db_per_m: float = 0.0) -> Floats:
    """Empirical gain: less the recording's median over all pings at each range, smoothed [dB].

    Args:
        level: Levels [dB], shape (pings, samples); NaN and -inf are ignored.
        slant_range: Slant range of each sample [m], shape (samples,).
        absorption_db_per_m: One-way absorption of the water [dB/m].

    Returns:
        Gain [dB], shape (samples,), under which the median of an image is about 0 dB at every range with bottom
        echoes. A silent water column is lifted at most to 30 dB below time-varied gain.

    Example:
        >>> slant_range = np.array([20.0, 40.0, 80.0])
        >>> level = np.tile(110 - 40 * np.log10(slant_range), (64, 1))  # 64 pings of a uniform bed
        >>> empirical_gain_db(level, slant_range).round(1).tolist()
        [-58.0, -45.9, -33.9]
    """
    law = tvg_db(slant_range, LAWS["tvg40"], absorption_db_per_m=absorption_db_per_m)
    median = _medians(level) + law
    has_level = np.isfinite(median)
    if not has_level.any():
        return law
    width = max(1, -(-LOOKS // max(1, level.shape[0]))) | 1
    typical = float(np.quantile(median[has_level], 0.75))
    return np.asarray(law - np.where(has_level, np.maximum(_smoothed(median, width), typical - SILENT), typical))


def _medians(level: Floats) -> Floats:
    """Median of each column over its finite levels [dB]; NaN where none is."""
    finite = np.where(np.isfinite(level), level, np.nan)
    has_level = np.isfinite(finite).any(axis=0)
    median = np.full(level.shape[1], np.nan)
    if has_level.any():
        median[has_level] = np.nanmedian(finite[:, has_level], axis=0)
    return median


def along_track_gain_db(level: Floats, pings: int = 25) -> Floats:
    """Gain that evens out pings that are stronger or weaker as a whole than their neighbours [dB].

    Args:
        level: Levels [dB], shape (pings, samples).
        pings: Number of pings about each one that are its neighbours.

    Returns:
        Gain [dB], shape (pings,).

    Example:
        >>> level = np.full((25, 100), 60.0)
        >>> level[12] -= 6  # one ping with half the pressure
        >>> along_track_gain_db(level)[11:14].round(1).tolist()
        [-0.1, 5.9, -0.1]
    """
    median = _medians(level.T)
    return np.where(np.isfinite(median), _smoothed(median, pings) - median, 0.0)


def _smoothed(curve: Floats, width: int) -> Floats:
    """Running mean of a curve of levels [dB] over its finite neighbours, as power."""
    from scipy.ndimage import uniform_filter1d

    is_finite = np.isfinite(curve)
    # re its own mean, so that no power underflows
    offset = float(np.mean(curve[is_finite])) if is_finite.any() else 0.0
    power = np.where(is_finite, intensity_ratio(np.where(is_finite, curve, offset) - offset), 0.0)
    mean = uniform_filter1d(power, width, mode="nearest")
    valid_fraction = uniform_filter1d(is_finite.astype(float), width, mode="nearest")
    return np.asarray(offset + level_db(np.maximum(mean, 1e-30) / np.maximum(valid_fraction, 1e-12)))
