"""What somebody measured in the water, checked before a law is asked.

The limits are those of any liquid water, far outside those of the laws: beyond them a
value is a slip, such as a unit or two columns exchanged.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import require_numbers

COLDEST, WARMEST = -50.0, 150.0
"""Temperatures that some liquid water has [degC]."""
SALTIEST = 400.0
"""Salinity that no brine exceeds [g/kg]."""
HIGHEST, DEEPEST = -100.0, 20e3
"""Depths [m], and pressures [dbar], at which somebody may think of water; the first are above the surface."""


Floats = NDArray[np.float64]


def checked_temperature_and_salinity(temperature: ArrayLike, salinity: ArrayLike) -> tuple[Floats, Floats]:
    """What a probe measured, as numbers.

    Args:
        temperature: Temperature [degC], any shape; NaN and masked values are gaps, and stay gaps.
        salinity: Salinity [g/kg], likewise.

    Returns:
        Both, each in its own shape.

    Raises:
        ValueError: Something is no number, or no water has it.
    """
    return (
        require_numbers("temperature", temperature, "degC", COLDEST, WARMEST),
        require_numbers("salinity", salinity, "g/kg", 0.0, SALTIEST),
    )


def checked_depth(depth: ArrayLike) -> Floats:
    """Depth [m] as numbers, any shape, likewise."""
    return require_numbers("depth", depth, "m", HIGHEST, DEEPEST)


def checked_pressure(pressure_dbar: ArrayLike) -> Floats:
    """Pressure above the atmosphere's [dbar] as numbers, any shape, likewise."""
    return require_numbers("pressure_dbar", pressure_dbar, "dbar", HIGHEST, DEEPEST)
