"""Sound speed from the thermodynamics of sea water: TEOS-10, through the gsw toolbox.

Sound speed is not fitted by itself: it follows from the compressibility of sea water
in the equation of state that is the oceanographic standard since 2010.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import warn_outside

LAW = "TEOS-10 sound speed"


def teos10_speed(temperature: ArrayLike, salinity: ArrayLike, pressure_dbar: ArrayLike) -> NDArray[np.float64]:
    """Speed of sound from the equation of state of sea water [m/s].

    Args:
        temperature: Temperature in situ, ITS-90 [degC], any shape.
        salinity: Absolute salinity [g/kg]; all arguments broadcast.
        pressure_dbar: Pressure above the atmosphere's [dbar].

    Returns:
        Sound speed [m/s], broadcast shape of the arguments.

    Source: IOC, SCOR & IAPSO (2010), "The international thermodynamic equation of seawater - 2010",
    UNESCO Manuals and Guides 56, eq. 2.17.1, evaluated with the 75-term volume of Roquet, Madec,
    McDougall & Barker (2015), Ocean Modelling 90, 29-43 (gsw.sound_speed). The polynomial is within
    0.14 m/s of the Gibbs function over 0..30 degC, 0..40 g/kg, 0..1000 dbar, and 0.03 m/s in cool sea water.
    Valid: -6..40 degC, 0..42 g/kg, 0..10000 dbar.
    """
    import gsw

    warn_outside(LAW, "temperature", temperature, -6.0, 40.0, "degC")
    warn_outside(LAW, "salinity", salinity, 0.0, 42.0, "g/kg")
    warn_outside(LAW, "pressure", pressure_dbar, 0.0, 10e3, "dbar")
    t, s, p = (np.asarray(a, dtype=float) for a in (temperature, salinity, pressure_dbar))
    return np.asarray(gsw.sound_speed(s, gsw.CT_from_t(s, t, p), p))
