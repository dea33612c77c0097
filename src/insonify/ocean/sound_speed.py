"""Sound speed of water from temperature, salinity and depth or pressure.

Sound speed grows by about 4 m/s per degree (in cool water), 1.3 m/s per gram of salt
and 1.6 m/s per hundred metres. Each published law has a file of its own;
this one selects the law by name, and converts depth into pressure where the law needs it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.chen_millero import chen_millero_speed
from insonify.ocean.mackenzie import mackenzie_speed
from insonify.ocean.medwin import medwin_speed
from insonify.ocean.pressure import pressure_dbar as pressure_at
from insonify.ocean.sea_water_checks import checked_depth, checked_pressure, checked_temperature_and_salinity
from insonify.ocean.teos10 import teos10_speed
from insonify.ocean.unesco import unesco_speed

Law = Callable[[ArrayLike, ArrayLike, ArrayLike], NDArray[np.float64]]

PRESSURE_MODELS: dict[str, Law] = {"teos10": teos10_speed, "chen-millero": chen_millero_speed, "unesco": unesco_speed}
"""Laws of (temperature, salinity, pressure [dbar]) by name."""
DEPTH_MODELS: dict[str, Law] = {"mackenzie": mackenzie_speed, "medwin": medwin_speed}
"""Laws of (temperature, salinity, depth [m]) by name."""


def sound_speed(
    temperature: ArrayLike, salinity: ArrayLike, depth: ArrayLike, *, model: str = "teos10"
) -> NDArray[np.float64]:
    """Speed of sound at a depth [m/s].

    Args:
        temperature: Temperature in situ, ITS-90 [degC], any shape.
        salinity: Salinity [g/kg]: absolute for "teos10", taken as practical by the others (in
            the open sea 35 practical is 35.165 absolute: 0.2 m/s). All arguments broadcast.
        depth: Depth [m].
        model: "teos10", "mackenzie", "chen-millero", "medwin" or "unesco"; its file states source and validity.

    Returns:
        Sound speed [m/s], broadcast shape of the arguments. Laws of pressure are given the pressure of the standard
        ocean at 45 degrees latitude, which differs by up to 0.3 % elsewhere: 0.05 m/s at 1 km.

    Raises:
        ValueError: The model is unknown, or an argument is not a number or not possible in water.

    Example:
        >>> f"{sound_speed(10.0, 35.0, 50.0):.1f} m/s"
        '1490.4 m/s'
        >>> f"{sound_speed(25.0, 35.0, 1000.0, model='mackenzie'):.1f} m/s"
        '1550.7 m/s'
    """
    (t, s), z = checked_temperature_and_salinity(temperature, salinity), checked_depth(depth)
    if model in DEPTH_MODELS:
        return DEPTH_MODELS[model](t, s, z)
    if model in PRESSURE_MODELS:
        return PRESSURE_MODELS[model](t, s, pressure_at(z))
    known = ", ".join([*PRESSURE_MODELS, *DEPTH_MODELS])
    raise ValueError(f"model is {model!r}; the sound-speed laws available are: {known}")


def sound_speed_at_pressure(
    temperature: ArrayLike, salinity: ArrayLike, pressure_dbar: ArrayLike, *, model: str = "teos10"
) -> NDArray[np.float64]:
    """Speed of sound at a measured pressure, as from a lowered probe [m/s].

    Args:
        temperature: Temperature in situ, ITS-90 [degC], any shape.
        salinity: Salinity [g/kg]: absolute for "teos10", practical for the others.
            All arguments broadcast.
        pressure_dbar: Pressure above the atmosphere's [dbar].
        model: "teos10", "chen-millero" or "unesco"; its file states source and validity.

    Returns:
        Sound speed [m/s], broadcast shape of the arguments.

    Raises:
        ValueError: The model is no law of pressure, or an argument is not a number or not possible in water.

    Example:
        >>> f"{sound_speed_at_pressure(10.0, 35.0, pressure_dbar=100.0):.1f} m/s"
        '1491.2 m/s'
    """
    (t, s), p = checked_temperature_and_salinity(temperature, salinity), checked_pressure(pressure_dbar)
    if model in PRESSURE_MODELS:
        return PRESSURE_MODELS[model](t, s, p)
    known = ", ".join(PRESSURE_MODELS)
    from_depth = f"; {model} works from depth: sound_speed(..., depth_from_pressure(pressure_dbar))"
    hint = from_depth if model in DEPTH_MODELS else ""
    raise ValueError(f"model is {model!r}; the sound-speed laws that work from pressure are: {known}{hint}")
