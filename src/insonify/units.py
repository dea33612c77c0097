"""Numbers with units at the edge, SI inside.

A scenario may hold 100000 or "100 kHz", 0.61 or "35 deg"; inside there is only SI.
The one exception is recorded pressure, which the trade measures in micropascal.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike, NDArray

UNITS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "km": 1e3, "cm": 1e-2, "mm": 1e-3, "ft": 0.3048},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6},
    "angle": {"rad": 1.0, "deg": np.pi / 180, "mrad": 1e-3},
    "speed": {"m/s": 1.0, "km/h": 1 / 3.6, "kn": 1852 / 3600},
    "turn rate": {"rad/s": 1.0, "deg/s": np.pi / 180, "deg/h": np.pi / 180 / 3600},
    "temperature": {"degC": 1.0, "C": 1.0},
}
"""Accepted units of each dimension and their size in SI (temperature: degC)."""

_NUMBER_AND_UNIT = re.compile(r"^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S.*?)?\s*$")


def si(value: object, dimension: str) -> object:
    """The SI number behind a value such as 100000 or "100 kHz".

    Args:
        value: A number, already in SI, or a string: number, then unit.
        dimension: One of the keys of `UNITS`.

    Returns:
        The number in SI [float]; whatever is neither number nor string is returned as it is.

    Raises:
        ValueError: The string is not a number with a unit of that dimension.
    """
    if not isinstance(value, str):
        return value
    known = UNITS[dimension]
    number, unit = _split(value, f"{'an' if dimension[0] in 'aeiou' else 'a'} {dimension}", next(iter(known)))
    if not unit:
        return number
    if unit in known:
        return number * known[unit]
    spelt = {name.lower(): name for name in known}
    hint = f"did you mean {spelt[unit.lower()]}? " if unit.lower() in spelt else ""
    raise ValueError(f"{unit!r} is not a unit of {dimension}; {hint}use one of {', '.join(known)}")


_FEW_DIGITS = re.compile(r"[-+]?\d+\.?\d?")
MIN_DOUBTFUL_ANGLE = 1.0
"""From here on, a bare angle with few digits was probably meant in degrees [rad]."""
MAX_DOUBTFUL_FREQUENCY = 2000.0
"""Up to here, a bare frequency was probably meant in kilohertz [Hz]."""


def unit_warning(typed: str, dimension: str) -> str:
    """Warning about a number typed without a unit that was probably meant in another one than SI.

    Args:
        typed: The number as it was typed, such as "5".
        dimension: One of the keys of `UNITS`.

    Returns:
        What it is read as, and what to write instead; empty where the number is plausible in SI. An angle of 1 rad or
        more with at most one decimal is doubtful: 1.57 is typed in radians.
    """
    if not _NUMBER_AND_UNIT.match(typed):
        return ""
    number, unit = _split(typed, dimension, "")
    if unit or number == 0:
        return ""
    if dimension == "angle" and abs(number) >= MIN_DOUBTFUL_ANGLE and _FEW_DIGITS.fullmatch(typed.strip()):
        return (
            f"{typed} without a unit is read as {number:g} rad ({np.degrees(number):.4g} deg). "
            f"Write '{number:g} deg' for degrees, or '{number:g} rad' if radians are meant."
        )
    if dimension == "frequency" and 0 < number <= MAX_DOUBTFUL_FREQUENCY:
        return (
            f"{typed} without a unit is read as {number:g} Hz. "
            f"Write '{number:g} kHz' for kilohertz, or '{number:g} Hz' if hertz are meant."
        )
    return ""


def decibels(value: object) -> object:
    """The number of decibels behind a value such as -27 or "-27 dB".

    Args:
        value: A number, or a string: number, then "dB" (with or without its reference).

    Returns:
        Level [dB] as a float; whatever is neither number nor string is returned as it is.

    Raises:
        ValueError: The string is not a number of decibels.
    """
    if not isinstance(value, str):
        return value
    number, unit = _split(value, "a level", "dB")
    if unit and not re.match(r"^dB(\s|$|/)", unit):
        raise ValueError(f"{unit!r} is not a unit of level; use dB")
    return number


def _split(value: str, what: str, example_unit: str) -> tuple[float, str]:
    match = _NUMBER_AND_UNIT.match(value)
    if match is None:
        raise ValueError(f"{value!r} is not {what}; write a number with a unit, such as '1.5 {example_unit}'")
    return float(match.group(1)), match.group(2) or ""


def level_db(ratio: ArrayLike) -> NDArray[np.float64]:
    """Level of an intensity ratio, 10 log10 [dB]; zero gives -inf without a warning.

    Args:
        ratio: Intensity or power ratio, not negative, any shape.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(10 * np.log10(np.asarray(ratio, dtype=float)))


def intensity_ratio(level_db: ArrayLike) -> NDArray[np.float64]:
    """Intensity ratio of a level [dB], any shape."""
    return np.asarray(10.0 ** (np.asarray(level_db, dtype=float) / 10))


def amplitude_ratio(level_db: ArrayLike) -> NDArray[np.float64]:
    """Pressure ratio of a level [dB], any shape."""
    return np.asarray(10.0 ** (np.asarray(level_db, dtype=float) / 20))
