"""Pressure from depth, and depth from pressure.

Both directions use one formula, the second by Newton's method, so that a conversion
there and back returns the initial value.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.sea_water_checks import checked_depth, checked_pressure
from insonify.validity import require_numbers, warn_outside

Floats = NDArray[np.float64]

LAW = "Leroy & Parthiot (1998) pressure"
AT_45_DEG = Polynomial([0.0, 1.00818e-2, 2.465e-8, -1.25e-13, 2.8e-19])
"""Pressure [MPa] at a depth [m] of the standard ocean at 45 degrees."""
DBAR_PER_MPA = 100.0
NEWTON_STEPS = 8


def pressure_dbar(depth: ArrayLike, latitude: ArrayLike = 45.0) -> Floats:
    """Pressure of the standard ocean at a depth [dbar].

    Args:
        depth: Depth below the surface [m], any shape.
        latitude: Latitude [degrees], broadcast against depth.

    Returns:
        Pressure above the atmosphere's [dbar], broadcast shape of the arguments.

    Source: Leroy & Parthiot (1998), J. Acoust. Soc. Am. 103(3), 1346-1352, the standard ocean
    (0 degC, 35), without the paper's corrections for single seas.
    Valid: 0..12000 m. In real seas within about 0.1 %: 0.02 m/s of sound speed at 1 km.

    Example:
        >>> f"{pressure_dbar(1000.0):.0f} dbar"
        '1011 dbar'
    """
    z, latitude_deg = checked_depth(depth), require_numbers("latitude", latitude, "degrees", -90.0, 90.0)
    warn_outside(LAW, "depth", z, 0.0, 12e3, "m")
    return _pressure(z, latitude_deg)


def depth_from_pressure(pressure_dbar: ArrayLike, latitude: ArrayLike = 45.0) -> Floats:
    """Depth at which the standard ocean has a pressure [m].

    Args:
        pressure_dbar: Pressure above the atmosphere's [dbar], any shape.
        latitude: Latitude [degrees], broadcast against pressure.

    Returns:
        Depth [m], broadcast shape of the arguments; the inverse of `pressure_dbar` to 1e-6 m.

    Source and validity: as `pressure_dbar`, inverted.

    Example:
        >>> f"{depth_from_pressure(10e3, latitude=30.0):.0f} m"
        '9713 m'
    """
    pressure, latitude_deg = np.broadcast_arrays(
        checked_pressure(pressure_dbar), require_numbers("latitude", latitude, "degrees", -90.0, 90.0)
    )
    z = pressure * 0.99
    for _ in range(NEWTON_STEPS):
        # The growth of gravity with depth changes the slope by less than 1/400: each step still gains two digits.
        slope = AT_45_DEG.deriv()(z) * _gravity_ratio(z, latitude_deg) * DBAR_PER_MPA
        z = z - (_pressure(z, latitude_deg) - pressure) / slope
    warn_outside(LAW, "depth", z, 0.0, 12e3, "m")
    return np.asarray(z)


def _pressure(z: Floats, latitude: Floats) -> Floats:
    return np.asarray(AT_45_DEG(z) * _gravity_ratio(z, latitude) * DBAR_PER_MPA)


def _gravity_ratio(z: Floats, latitude: Floats) -> Floats:
    """Gravity at a latitude over gravity at 45 degrees, both at the same depth [1]."""
    surface = 9.7803 * (1 + 5.3e-3 * np.sin(np.radians(latitude)) ** 2)
    return np.asarray((surface - 2e-5 * z) / (9.80612 - 2e-5 * z))
