"""A row of evenly spaced angles, written as its ends and its step instead of angle by angle.

``{from: -6 deg, to: 6 deg, step: 0.25 deg}`` is 49 angles, each the number that a person would have
typed: they are counted as decimal fractions in the unit they are written in, not summed up in binary.
"""

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction

from pydantic_core import PydanticCustomError

from insonify.model import field_error, raise_errors
from insonify.units import UNITS, si

KEYS = ("from", "to", "step")
MAX_ANGLES = 1024
"""No sonar forms more beams [1]."""
UNEVEN = Fraction(1, 1000)
"""Part of a step by which the last one may miss the end: as much as a step written with few digits [1]."""


def angle_range(given: Mapping[str, object]) -> tuple[float, ...]:
    """The angles from one end to the other, both included [rad].

    Args:
        given: `from`, `to` and `step`, each a number [rad] or text with a unit.

    Returns:
        Angles in order; each equals what its own decimal number and unit would be read as.

    Raises:
        ValueError: A key is missing or unknown.
        PydanticCustomError: Located at what is no angle, or at a step that does not fit, with the fix.
    """
    if set(given) != set(KEYS):
        raise ValueError(
            f"keys are {', '.join(map(str, given)) or 'missing'}; a row of angles has {', '.join(KEYS)}, "
            "such as {from: -6 deg, to: 6 deg, step: 0.25 deg}"
        )
    raise_errors(_not_angles(given))
    written = [_written(given[key]) for key in KEYS]
    units = {unit for number, unit in written if number}  # nothing is nothing in every unit
    unit = units.pop() if len(units) == 1 else "rad"
    if units:  # of mixed units there is no common decimal: then count in radians
        written = [_written(_radians(given[key])) for key in KEYS]
    first, last, step = (number for number, _ in written)
    count = _count(first, last, step, unit)
    size = UNITS["angle"][unit]
    return tuple(float(first + (last - first) * k / max(count, 1)) * size for k in range(count + 1))


def _not_angles(given: Mapping[str, object]) -> Iterator[PydanticCustomError]:
    for key in KEYS:
        value = given[key]
        if not math.isfinite(_radians(value)):
            shown = "nothing" if value is None else value
            yield field_error(key, shown, f"is not an angle; use {', '.join(UNITS['angle'])}.")


def _radians(value: object) -> float:
    """An angle [rad], or NaN where there is none."""
    try:
        angle = si(value, "angle")
    except ValueError:
        return math.nan
    return float(angle) if isinstance(angle, int | float) and not isinstance(angle, bool) else math.nan


def _written(value: object) -> tuple[Fraction, str]:
    """An angle as the decimal fraction and the unit that were typed."""
    text = str(value).strip()
    number = text.rstrip("abcdefghijklmnopqrstuvwxyz ")
    # by way of the float: a fraction of 1e-999999999 would fill the memory
    return Fraction(repr(float(number))), text[len(number) :].strip() or "rad"


def _count(first: Fraction, last: Fraction, step: Fraction, unit: str) -> int:
    """Number of steps from the first angle to the last."""
    span = last - first
    if span == 0:
        return 0
    if step * span <= 0:
        better = "write, for instance," if step == 0 else "write"
        guess = float(abs(step) if step else abs(span) / 4) * (1 if span > 0 else -1)
        raise _wrong_step(step, unit, f"does not lead from {float(first):g} to {float(last):g} {unit}; {better} "
                          f"{guess:g} {unit}.")  # fmt: skip
    exact = span / step
    count = max(round(exact), 1)
    if count >= MAX_ANGLES:
        raise _wrong_step(step, unit, f"makes {count + 1} angles, and {MAX_ANGLES} is the most. Write a larger step.")
    if abs(exact - count) > UNEVEN:
        raise _wrong_step(step, unit, f"does not come out even from {float(first):g} to {float(last):g} {unit}. "
                          f"Write {float(span / count):.9g} {unit}, for {count + 1} angles.")  # fmt: skip
    return count


def _wrong_step(step: Fraction, unit: str, advice: str) -> PydanticCustomError:
    return field_error("step", f"{float(step):g} {unit}", advice)
