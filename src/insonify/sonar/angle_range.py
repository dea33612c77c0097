"""Evenly spaced angles, written as first angle, last angle and step.

``{from: -6 deg, to: 6 deg, step: 0.25 deg}`` is 49 angles, each equal to the decimal number in that unit: they are
computed as decimal fractions, without binary rounding of sums.
"""

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Annotated

from pydantic import AfterValidator, Field
from pydantic_core import PydanticCustomError

from insonify.model import Model, Radians, field_error, raise_errors
from insonify.units import UNITS, si

KEYS = ("from", "to", "step")
MAX_ANGLES = 1024
"""Largest number of angles [1]."""
STEP_TOLERANCE = Fraction(1, 1000)
"""Largest distance of the last step from the end, for steps that are written with few digits [steps]."""

RIGHT_ANGLE = math.pi / 2


def _ahead(angle: float) -> float:
    """An angle from boresight, unchanged if less than a right angle."""
    if abs(angle) < RIGHT_ANGLE:
        return angle
    advice = "Turn the array with mounting.bearing instead."
    if abs(angle) < 90 and round(angle, 1) == angle:
        advice = f"A number without a unit is in radians: write {angle:g} deg."
    raise ValueError(
        f"steer is {angle * 90 / RIGHT_ANGLE:g} deg; beams are steered by less than 90 deg from boresight. {advice}"
    )


SteerAngle = Annotated[Radians, AfterValidator(_ahead), Field(gt=-RIGHT_ANGLE, lt=RIGHT_ANGLE)]
"""Angle of a beam from boresight [rad]."""


class AngleRange(Model):
    """Evenly spaced angles: the form in which a file may give them, which `angle_range` reads."""

    first: Annotated[SteerAngle, Field(alias="from")]
    """First angle [rad]."""
    last: Annotated[SteerAngle, Field(alias="to")]
    """Last angle [rad]."""
    step: Annotated[Radians, Field(ge=-math.pi, le=math.pi)]
    """Angle from each to the next [rad]: it divides the whole evenly, and is negative where the angles decrease."""


def angle_range(mapping: Mapping[str, object]) -> tuple[float, ...]:
    """Angles from first to last, both included [rad].

    Args:
        mapping: `from`, `to` and `step`, each a number [rad] or text with a unit.

    Returns:
        Angles in order; each equals what its own decimal number and unit would be read as.

    Raises:
        ValueError: A key is missing or unknown.
        PydanticCustomError: A value is no angle, or the step does not divide the interval.
    """
    if set(mapping) != set(KEYS):
        raise ValueError(
            f"keys are {', '.join(map(str, mapping)) or 'missing'}; a row of angles has {', '.join(KEYS)}, "
            "such as {from: -6 deg, to: 6 deg, step: 0.25 deg}"
        )
    raise_errors(_angle_errors(mapping))
    numbers = [_decimal_and_unit(mapping[key]) for key in KEYS]
    units = {unit for number, unit in numbers if number}  # 0 is the same in every unit
    unit = units.pop() if len(units) == 1 else "rad"
    if units:  # mixed units have no common decimal fraction, so radians are used
        numbers = [_decimal_and_unit(_radians(mapping[key])) for key in KEYS]
    first, last, step = (number for number, _ in numbers)
    count = _count(first, last, step, unit)
    radians_per_unit = UNITS["angle"][unit]
    return tuple(float(first + (last - first) * k / max(count, 1)) * radians_per_unit for k in range(count + 1))


def _angle_errors(mapping: Mapping[str, object]) -> Iterator[PydanticCustomError]:
    for key in KEYS:
        value = mapping[key]
        if not math.isfinite(_radians(value)):
            shown = "nothing" if value is None else value
            yield field_error(key, shown, f"is not an angle; use {', '.join(UNITS['angle'])}.")


def _radians(value: object) -> float:
    """An angle [rad], NaN for a value that is no angle."""
    try:
        angle = si(value, "angle")
    except ValueError:
        return math.nan
    return float(angle) if isinstance(angle, int | float) and not isinstance(angle, bool) else math.nan


def _decimal_and_unit(value: object) -> tuple[Fraction, str]:
    """Number of an angle as a decimal fraction, and its unit, as written."""
    text = str(value).strip()
    number = text.rstrip("abcdefghijklmnopqrstuvwxyz ")
    # through a float: a fraction of 1e-999999999 would fill the memory
    return Fraction(repr(float(number))), text[len(number) :].strip() or "rad"


def _count(first: Fraction, last: Fraction, step: Fraction, unit: str) -> int:
    """Number of steps from the first angle to the last."""
    span = last - first
    if span == 0:
        return 0
    if step * span <= 0:
        better = "write, for instance," if step == 0 else "write"
        suggested_step = float(abs(step) if step else abs(span) / 4) * (1 if span > 0 else -1)
        raise _step_error(step, unit, f"does not lead from {float(first):g} to {float(last):g} {unit}; {better} "
                          f"{suggested_step:g} {unit}.")  # fmt: skip
    step_count = span / step
    count = max(round(step_count), 1)
    if count >= MAX_ANGLES:
        raise _step_error(step, unit, f"makes {count + 1} angles, and {MAX_ANGLES} is the most. Write a larger step.")
    if abs(step_count - count) > STEP_TOLERANCE:
        raise _step_error(step, unit, f"does not come out even from {float(first):g} to {float(last):g} {unit}. "
                          f"Write {float(span / count):.9g} {unit}, for {count + 1} angles.")  # fmt: skip
    return count


def _step_error(step: Fraction, unit: str, advice: str) -> PydanticCustomError:
    return field_error("step", f"{float(step):g} {unit}", advice)
