"""Sound speed of the upper ocean in few terms: Medwin's law of 1975."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import warn_outside

LAW = "Medwin (1975) sound speed"


def medwin_speed(temperature: ArrayLike, salinity: ArrayLike, depth: ArrayLike) -> NDArray[np.float64]:
    """Speed of sound in the upper ocean, to 0.3 m/s in shelf seas [m/s].

    Args:
        temperature: Temperature in situ [degC], any shape.
        salinity: Salinity [g/kg]; all arguments broadcast.
        depth: Depth [m].

    Returns:
        Sound speed [m/s], broadcast shape of the arguments.

    Source: Medwin (1975), J. Acoust. Soc. Am. 58(6), 1318-1319.
    Valid: 0..35 degC, 0..45 g/kg, 0..1000 m (as quoted in secondary summaries).
    """
    warn_outside(LAW, "temperature", temperature, 0.0, 35.0, "degC")
    warn_outside(LAW, "salinity", salinity, 0.0, 45.0, "g/kg")
    warn_outside(LAW, "depth", depth, 0.0, 1000.0, "m")
    t, s, z = (np.asarray(a, dtype=float) for a in (temperature, salinity, depth))
    temperature_terms = 4.6 * t - 0.055 * t**2 + 2.9e-4 * t**3
    return np.asarray(1449.2 + temperature_terms + (1.34 - 0.010 * t) * (s - 35) + 0.016 * z)
