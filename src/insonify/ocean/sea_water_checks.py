"""Checks of temperature, salinity, depth and pressure before a law of sea water is evaluated.

The limits are those of any liquid water, far outside those of the laws: a value beyond them
is a mistake, such as a wrong unit or two exchanged columns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import require_numbers

COLDEST, WARMEST = -50.0, 150.0
"""Smallest and largest temperature of liquid water [degC]."""
SALTIEST = 400.0
"""Largest salinity of any brine [g/kg]."""
HIGHEST, DEEPEST = -100.0, 20e3
"""Smallest and largest depth [m], and pressure [dbar]; negative values are above the surface."""


Floats = NDArray[np.float64]


def checked_temperature_and_salinity(temperature: ArrayLike, salinity: ArrayLike) -> tuple[Floats, Floats]:
    """Temperature [degC] and salinity [g/kg] as checked numbers.

    Args:
        temperature: Temperature [degC], any shape; NaN and masked values are gaps, and stay gaps.
        salinity: Salinity [g/kg], any shape; NaN and masked values are gaps, and stay gaps.

    Returns:
        Both, each in its own shape.

    Raises:
        ValueError: A value is not a number, or not possible in water.
    """
    return (
        require_numbers("temperature", temperature, "degC", COLDEST, WARMEST),
        require_numbers("salinity", salinity, "g/kg", 0.0, SALTIEST),
    )


def checked_depth(depth: ArrayLike) -> Floats:
    """Depth as checked numbers [m], any shape; NaN and masked values stay gaps."""
    return require_numbers("depth", depth, "m", HIGHEST, DEEPEST)


def checked_pressure(pressure_dbar: ArrayLike) -> Floats:
    """Pressure above the atmosphere's as checked numbers [dbar], any shape; NaN and masked values stay gaps."""
    return require_numbers("pressure_dbar", pressure_dbar, "dbar", HIGHEST, DEEPEST)
