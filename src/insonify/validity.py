"""Ranges of validity of published laws, with a warning outside; and errors of arguments outside any law.

A law outside the conditions it was measured in still gives a number. It is given, with
one warning that names the law, the quantity and the range. A quantity that means nothing
(a negative frequency, a word, an infinite depth) is refused where it enters.
"""

from __future__ import annotations

import math
import sys
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.caller_warning import warn_caller
from insonify.value_range import value_range


class PhysicsWarning(UserWarning):
    """A law was used outside the conditions it was made for."""


def warn_outside(law: str, quantity: str, value: ArrayLike, low: float, high: float, unit: str) -> bool:
    """Warns once if any value lies outside the range in which a law holds.

    Args:
        law: Name of the law, with author and year.
        quantity: Quantity that the value measures.
        value: The value or values used, any shape, in `unit`.
        low: Smallest trustworthy value, in `unit`.
        high: Largest trustworthy value, in `unit`.
        unit: Unit of the three numbers, "" for a ratio.

    Returns:
        Whether something was outside.
    """
    values = np.asarray(value, dtype=float)
    outside = values[(values < low) | (values > high)]
    if outside.size == 0:
        return False
    excess = np.maximum(low - outside, outside - high)
    worst, blank = outside[np.argmax(excess)], " " if unit else ""
    warn_caller(
        f"{law} is trusted for {quantity} {low:g} to {high:g}{blank}{unit}; "
        f"{worst:g}{blank}{unit} is outside, and the result an extrapolation",
        PhysicsWarning,
    )
    return True


def require_numbers(
    name: str, value: ArrayLike, unit: str, low: float = -math.inf, high: float = math.inf, *,
    exclude_low: bool = False, allow_nan: bool = True, example: str = "",
) -> NDArray[np.float64]:  # fmt: skip
    """A quantity as numbers, refused where it means nothing.

    Args:
        name: Name of the quantity in the message: "frequency", "Sediment.loss".
        value: Value that was given.
        unit: Unit of the numbers, "" for a ratio.
        low: Smallest number that means something, in `unit`.
        high: Largest, in `unit`.
        exclude_low: True if `low` itself means nothing.
        allow_nan: True if NaN and masked values may pass: gaps in a measurement, which stay gaps (NaN), as does
            what is computed of them.
        example: Example, for the advice.

    Returns:
        The numbers, in the shape in which they were given.

    Raises:
        ValueError: Something is no number, infinite, or beyond the limits; with what to give instead.
    """
    given = as_floats(value)
    if given is None:
        raise _range_error(name, _shortened_repr(value), unit, low, high, exclude_low, example)
    meant = np.isfinite(given) & (given <= high) & (given > low if exclude_low else given >= low)
    strange = given[~(meant | np.isnan(given))] if allow_nan else given[~meant]
    if strange.size:
        raise _range_error(name, f"{strange[0]:g} {unit}".rstrip(), unit, low, high, exclude_low, example)
    return given


def require_number(
    name: str, value: object, unit: str, low: float = -math.inf, high: float = math.inf, *, exclude_low: bool = False,
    example: str = "",
) -> float:  # fmt: skip
    """One number, refused where it means nothing; arguments and errors as `require_numbers`, and a gap is refused too.

    Args:
        name: Name of the quantity in the message.
        value: Value that was given.
        unit: Unit of the number, "" for a ratio.
        low: Smallest number that means something, in `unit`.
        high: Largest, in `unit`.
        exclude_low: True: `low` itself is refused.
        example: Example, for the advice.
    """
    given = as_floats(value)
    if given is None or given.ndim:
        raise _range_error(name, _shortened_repr(value), unit, low, high, exclude_low, example)
    return float(
        require_numbers(name, given, unit, low, high, exclude_low=exclude_low, allow_nan=False, example=example)
    )


def require_grazing_angle(name: str, value: ArrayLike, *, gaps: bool = True) -> NDArray[np.float64]:
    """A grazing angle in front of an interface, 0 to pi/2 [rad], any shape; others are refused as by `require_numbers`.

    Args:
        name: Name of the angle in messages.
        value: Value that was given.
        gaps: True if NaN may pass.
    """
    given = require_numbers(
        name, value, "rad", -_ROUNDING, math.pi / 2 + _ROUNDING, allow_nan=gaps, example="np.radians(20)"
    )
    return np.clip(given, 0, math.pi / 2)


def require_sound_speed(name: str, value: ArrayLike, *, gaps: bool = True) -> NDArray[np.float64]:
    """A sound speed that some liquid has [m/s], any shape; others are refused as by `require_numbers`.

    Args:
        name: Name of the speed in messages.
        value: Value that was given.
        gaps: True if NaN may pass.
    """
    return require_numbers(name, value, "m/s", 300.0, 5000.0, allow_nan=gaps, example="1500")


_ROUNDING = 1e-9  # rad: angles come out of arcsines


def as_floats(value: Any) -> NDArray[np.float64] | None:
    """Convert numbers of any kind to floats; None for others: words, truth values and nothing.

    Args:
        value: Whatever was given; masked values become NaN.
    """
    # where nothing has loaded numpy.ma, nothing is masked: it takes a while to load
    if "numpy.ma" in sys.modules and isinstance(value, np.ma.MaskedArray):
        return np.asarray(np.ma.filled(value.astype(float), np.nan)) if value.dtype.kind in "fiu" else None
    try:
        given = np.asarray(value)
    except ValueError:  # rows of unequal length
        return None
    if given.dtype.kind == "O" and all(isinstance(x, Real) and not isinstance(x, bool) for x in given.flat):
        try:
            return given.astype(float)  # fractions and the like
        except OverflowError:  # a whole number beyond all that a float can hold
            return None
    return given.astype(float, copy=False) if given.dtype.kind in "fiu" else None


def _shortened_repr(value: object) -> str:
    words = " ".join(repr(value).split())
    return words if len(words) <= 60 else f"{words[:57]}..."


def _range_error(name: str, shown: str, unit: str, low: float, high: float, above: bool, example: str) -> ValueError:
    """Error with the value and the numbers to give instead."""
    limits = {"gt" if above else "ge": 0.0 if low == -_ROUNDING else low, "le": high}
    known = value_range({name: limit for name, limit in limits.items() if math.isfinite(limit)})
    limit = f", {known}" if known else ""
    of_unit, example = f" ({unit})" if unit else "", f", such as {example}" if example else ""
    return ValueError(f"{name} is {shown}; give a finite number{of_unit}{limit}{example}")
