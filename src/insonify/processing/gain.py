"""Gain: what is added to a sonar's levels so that a uniform bed looks uniform.

Time-varied gain undoes what range alone does, by a law; a empirical gain asks the recording itself what its
usual level at each range is.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.time_varied_gain import NEAREST, tvg_db
from insonify.units import intensity_ratio, level_db

Floats = NDArray[np.float64]

LAWS = {"tvg20": 20.0, "tvg30": 30.0, "tvg40": 40.0}
"""Decibels for each tenfold range: for a one-way beam, for an extended bed, for a point."""
LOOKS = 64
"""Least number of samples whose median is one point of a empirical curve."""
SILENT = 30.0
"""How far below its usual level a range may be, after time-varied gain, and still be lifted to it [dB]."""


def lambert_gain_db(slant_range: Floats, altitude: Floats, *, absorption_db_per_m: float = 0.0) -> Floats:
    """The gain under which a level bed that scatters by Lambert's law is uniform [dB].

    On a level bed the insonified part is slant range over the cosine of the grazing angle, and Lambert's law
    squares its sine: altitude over slant range. Beams are taken as open in elevation.

    Args:
        slant_range: Slant range [m], shape (samples,).
        altitude: Height above the bed [m], shape (...).
        absorption_db_per_m: Of the water, one way [dB/m].

    Returns:
        Gain [dB], shape (..., samples); in the water column, before the bed is reached, as for its first echo.

    Source: Lambert's law as in Urick (1983), ch. 8, and the area of a range cell on a plane.
    """
    height = np.maximum(np.asarray(altitude, float)[..., None], NEAREST / 10)
    # The very first echo comes from a disc, not from a strip: no steeper than 60 degrees is followed.
    far = np.maximum(slant_range, height / np.sin(np.radians(60)))
    sine = height / far
    bed = -level_db(sine**2) + level_db(np.sqrt(1 - sine**2))
    return np.asarray(tvg_db(far, 30.0, absorption_db_per_m=absorption_db_per_m) + bed)


def empirical_gain_db(level: Floats, slant_range: Floats, *, absorption_db_per_m: float = 0.0) -> Floats:
    """The gain that a recording asks for itself: less its median over all pings at each range, smoothed [dB].

    Args:
        level: Levels [dB], shape (pings, samples); NaN and -inf are passed over.
        slant_range: Slant range of each sample [m], shape (samples,).
        absorption_db_per_m: Of the water, one way [dB/m].

    Returns:
        Gain [dB], shape (samples,), under which the median of an image is about 0 dB at every range where the bed
        is heard. A silent water column is lifted no further than time-varied gain would have it less 30 dB.
    """
    law = tvg_db(slant_range, LAWS["tvg40"], absorption_db_per_m=absorption_db_per_m)
    middle = _medians(level) + law
    heard = np.isfinite(middle)
    if not heard.any():
        return law
    width = max(1, -(-LOOKS // max(1, level.shape[0]))) | 1
    usual = float(np.quantile(middle[heard], 0.75))
    return np.asarray(law - np.where(heard, np.maximum(_smoothed(middle, width), usual - SILENT), usual))


def _medians(level: Floats) -> Floats:
    """Median of each column of levels that are there [dB]; NaN where none is."""
    there = np.where(np.isfinite(level), level, np.nan)
    heard = np.isfinite(there).any(axis=0)
    middle = np.full(level.shape[1], np.nan)
    if heard.any():
        middle[heard] = np.nanmedian(there[:, heard], axis=0)
    return middle


def along_track_gain_db(level: Floats, pings: int = 25) -> Floats:
    """The gain that evens out pings that are louder or fainter as a whole than those about them [dB].

    Args:
        level: Levels [dB], shape (pings, samples).
        pings: How many pings about each one are its neighbours.

    Returns:
        Gain [dB], shape (pings,).
    """
    middle = _medians(level.T)
    return np.where(np.isfinite(middle), _smoothed(middle, pings) - middle, 0.0)


def _smoothed(curve: Floats, width: int) -> Floats:
    """Running mean of a curve of levels [dB] over the neighbours that are there, as power."""
    from scipy.ndimage import uniform_filter1d

    there = np.isfinite(curve)
    # re its own mean, so that no power underflows
    middle = float(np.mean(curve[there])) if there.any() else 0.0
    power = np.where(there, intensity_ratio(np.where(there, curve, middle) - middle), 0.0)
    mean = uniform_filter1d(power, width, mode="nearest")
    share = uniform_filter1d(there.astype(float), width, mode="nearest")
    return np.asarray(middle + level_db(np.maximum(mean, 1e-30) / np.maximum(share, 1e-12)))
