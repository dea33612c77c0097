"""Sound speed of the UNESCO algorithm of 1983, on the temperature scale of its time.

The same law as `chen_millero`, before its coefficients were refitted: for comparison with
data and programs of that time. The two agree within 0.01 m/s.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from insonify.ocean.chen_millero import Floats, speed_from
from insonify.validity import warn_outside

LAW = "UNESCO (1983) sound speed"
T68_PER_T90 = 1.00024
"""A temperature on the scale of 1968 over the same temperature on that of 1990 [1]."""

# One row per power of temperature [degC, IPTS-68], one column per power of pressure [bar].
PURE_WATER = np.array(
    [
        [1402.388, 0.153563, 3.1260e-5, -9.7729e-9],
        [5.03711, 6.8982e-4, -1.7107e-6, 3.8504e-10],
        [-5.80852e-2, -8.1788e-6, 2.5974e-8, -2.3643e-12],
        [3.3420e-4, 1.3621e-7, -2.5335e-10, 0.0],
        [-1.47800e-6, -6.1185e-10, 1.0405e-12, 0.0],
        [3.1464e-9, 0.0, 0.0, 0.0],
    ]
)
SALT = np.array(
    [
        [1.389, 9.4742e-5, -3.9064e-7, 1.100e-10],
        [-1.262e-2, -1.2580e-5, 9.1041e-9, 6.649e-12],
        [7.164e-5, -6.4885e-8, -1.6002e-10, -3.389e-13],
        [2.006e-6, 1.0507e-8, 7.988e-12, 0.0],
        [-3.21e-8, -2.0122e-10, 0.0, 0.0],
    ]
)
SALT_TO_THREE_HALVES = np.array([[-1.922e-2, 7.3637e-5], [-4.42e-5, 1.7945e-7]])
SALT_SQUARED = np.array([[1.727e-3, -7.9836e-6]])


def unesco_speed(temperature: ArrayLike, salinity: ArrayLike, pressure_dbar: ArrayLike) -> Floats:
    """Speed of sound at a pressure, by the algorithm of 1983 [m/s].

    Args:
        temperature: Temperature in situ, ITS-90 [degC], any shape; converted to IPTS-68 here.
        salinity: Practical salinity [1]; all arguments broadcast.
        pressure_dbar: Pressure above the atmosphere's [dbar].

    Returns:
        Sound speed [m/s], broadcast shape of the arguments.

    Source: Chen & Millero (1977), J. Acoust. Soc. Am. 62(5), 1129-1135, as printed by Fofonoff &
    Millard (1983), UNESCO Technical Papers in Marine Science 44; check value 1731.995 m/s at 40,
    40 degC (IPTS-68), 10000 dbar, which these coefficients give.
    Valid: 0..40 degC, 0..40, 0..10000 dbar.
    """
    warn_outside(LAW, "temperature", temperature, 0.0, 40.0, "degC")
    warn_outside(LAW, "salinity", salinity, 0.0, 40.0, "")
    warn_outside(LAW, "pressure", pressure_dbar, 0.0, 10e3, "dbar")
    t68 = np.asarray(temperature, dtype=float) * T68_PER_T90
    return speed_from((PURE_WATER, SALT, SALT_TO_THREE_HALVES, SALT_SQUARED), t68, salinity, pressure_dbar)
