"""Range of a number in words, for messages and for the reference of scenario keys."""

from __future__ import annotations

LOWER = {"ge": False, "gt": True}
UPPER = {"le": False, "lt": True}
"""Names of a limit, as pydantic has them, and whether the limit itself is excluded."""


def value_range(limits: dict[str, float], unit: str = "") -> str:
    """Range in words, such as "above 0, to 100 m", "0 m or more" or "0 to below 1"; empty without limits.

    Args:
        limits: Limits by name: ge or gt, and le or lt.
        unit: Unit of the limits; empty for a ratio.
    """
    tail = f" {unit}" if unit else ""
    low = next(((limits[name], excluded) for name, excluded in LOWER.items() if name in limits), None)
    high = next(((limits[name], excluded) for name, excluded in UPPER.items() if name in limits), None)
    if low is None and high is None:
        return ""
    if high is None:
        number, excluded = low
        return f"above {_plain(number)}{tail}" if excluded else f"{_plain(number)}{tail} or more"
    number, excluded = high
    if low is None:
        return f"below {_plain(number)}{tail}" if excluded else f"{_plain(number)}{tail} or less"
    if low[1]:
        return f"above {_plain(low[0])}, {'below' if excluded else 'to'} {_plain(number)}{tail}"
    return f"{_plain(low[0])} to {'below ' if excluded else ''}{_plain(number)}{tail}"


def _plain(limit: float) -> str:
    """A limit without an exponent, if it is a whole number that a person would write out."""
    return f"{limit:.0f}" if limit == round(limit) and abs(limit) < 1e9 else f"{limit:.6g}"
