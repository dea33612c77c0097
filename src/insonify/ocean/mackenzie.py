"""Sound speed of the open ocean in nine terms: Mackenzie's law of 1981."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import warn_outside

LAW = "Mackenzie (1981) sound speed"


def mackenzie_speed(temperature: ArrayLike, salinity: ArrayLike, depth: ArrayLike) -> NDArray[np.float64]:
    """Speed of sound at a depth of the open ocean [m/s].

    Args:
        temperature: Temperature in situ [degC], any shape.
        salinity: Salinity [g/kg]; all arguments broadcast.
        depth: Depth [m].

    Returns:
        Sound speed [m/s], broadcast shape of the arguments.

    Source: Mackenzie (1981), J. Acoust. Soc. Am. 70(3), 807-812; check value 1550.744 m/s at 25 degC, 35 g/kg, 1000 m.
    Valid: 2..30 degC, 25..40 g/kg, 0..8000 m. About 1 m/s off in nearly fresh water: not for estuaries.
    """
    warn_outside(LAW, "temperature", temperature, 2.0, 30.0, "degC")
    warn_outside(LAW, "salinity", salinity, 25.0, 40.0, "g/kg")
    warn_outside(LAW, "depth", depth, 0.0, 8000.0, "m")
    t, s, z = (np.asarray(a, dtype=float) for a in (temperature, salinity, depth))
    temperature_terms = 4.591 * t - 5.304e-2 * t**2 + 2.374e-4 * t**3
    salinity_terms = 1.340 * (s - 35) - 1.025e-2 * t * (s - 35)
    depth_terms = 1.630e-2 * z + 1.675e-7 * z**2 - 7.139e-13 * t * z**3
    return np.asarray(1448.96 + temperature_terms + salinity_terms + depth_terms)
