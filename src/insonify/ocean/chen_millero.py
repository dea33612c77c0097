"""Sound speed of the UNESCO algorithm: Chen and Millero's law of 1977, on today's temperature scale.

A polynomial in temperature and pressure for pure water, and three more for the powers of salinity.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial.polynomial import polyval2d
from numpy.typing import ArrayLike, NDArray

from insonify.validity import warn_outside

Floats = NDArray[np.float64]

LAW = "Chen & Millero (1977), refit by Wong & Zhu (1995), sound speed"

# One row per power of temperature [degC], one column per power of pressure [bar]: Table III of the refit.
PURE_WATER = np.array(
    [
        [1402.388, 0.153563, 3.1260e-5, -9.7729e-9],
        [5.03830, 6.8999e-4, -1.7111e-6, 3.8513e-10],
        [-5.81090e-2, -8.1829e-6, 2.5986e-8, -2.3654e-12],
        [3.3432e-4, 1.3632e-7, -2.5353e-10, 0.0],
        [-1.47797e-6, -6.1260e-10, 1.0415e-12, 0.0],
        [3.1419e-9, 0.0, 0.0, 0.0],
    ]
)
SALT = np.array(
    [
        [1.389, 9.4742e-5, -3.9064e-7, 1.100e-10],
        [-1.262e-2, -1.2583e-5, 9.1061e-9, 6.651e-12],
        [7.166e-5, -6.4928e-8, -1.6009e-10, -3.391e-13],
        [2.008e-6, 1.0515e-8, 7.994e-12, 0.0],
        [-3.21e-8, -2.0142e-10, 0.0, 0.0],
    ]
)
SALT_TO_THREE_HALVES = np.array([[-1.922e-2, 7.3637e-5], [-4.42e-5, 1.7950e-7]])
SALT_SQUARED = np.array([[1.727e-3, -7.9836e-6]])


def chen_millero_speed(temperature: ArrayLike, salinity: ArrayLike, pressure_dbar: ArrayLike) -> Floats:
    """Speed of sound at a pressure, by the international algorithm [m/s].

    Args:
        temperature: Temperature in situ, ITS-90 [degC], any shape.
        salinity: Practical salinity [1]; all arguments broadcast.
        pressure_dbar: Pressure above the atmosphere's [dbar].

    Returns:
        Sound speed [m/s], broadcast shape of the arguments.

    Source: Chen & Millero (1977), J. Acoust. Soc. Am. 62(5), 1129-1135, the UNESCO algorithm (Fofonoff & Millard 1983),
    in the ITS-90 coefficients of Wong & Zhu (1995), J. Acoust. Soc. Am. 97(3), 1732-1736, Table III. Checked against
    printed grid points to 1e-3 m/s. The refit moves the UNESCO check point (40, 40 degC on the scale of 1968, 10000
    dbar) by +0.009 m/s; "unesco" gives it as printed.
    Valid: 0..40 degC, 0..40, 0..10000 dbar.
    """
    warn_outside(LAW, "temperature", temperature, 0.0, 40.0, "degC")
    warn_outside(LAW, "salinity", salinity, 0.0, 40.0, "")
    warn_outside(LAW, "pressure", pressure_dbar, 0.0, 10e3, "dbar")
    return speed_from((PURE_WATER, SALT, SALT_TO_THREE_HALVES, SALT_SQUARED), temperature, salinity, pressure_dbar)


def speed_from(
    coefficients: tuple[Floats, Floats, Floats, Floats],
    temperature: ArrayLike,
    salinity: ArrayLike,
    pressure_dbar: ArrayLike,
) -> Floats:
    """Sound speed from one set of Chen and Millero's coefficients [m/s].

    Args:
        coefficients: Tables for salinity to the power 0, 1, 3/2 and 2, rows and columns as above.
        temperature: Temperature on the scale of the coefficients [degC], any shape.
        salinity: Practical salinity [1]; all arguments broadcast.
        pressure_dbar: Pressure above the atmosphere's [dbar].

    Returns:
        Sound speed [m/s], broadcast shape of the three.
    """
    t, s, bar = np.broadcast_arrays(
        np.asarray(temperature, dtype=float),
        np.asarray(salinity, dtype=float),
        np.asarray(pressure_dbar, dtype=float) / 10,  # the paper's bar
    )
    terms = zip(coefficients, (0.0, 1.0, 1.5, 2.0), strict=True)
    return np.asarray(sum(polyval2d(t, bar, table) * s**power for table, power in terms))
