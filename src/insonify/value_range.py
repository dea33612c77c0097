"""Range of a number in words, for messages and for the reference of scenario keys."""

from __future__ import annotations


def value_range(limits: dict[str, float], unit: str = "") -> str:
    """Range in words, such as "above 0, to 100 m", "0 m or more" or "0 to below 1"; empty without limits.

    Args:
        limits: Limits by name: ge or, if the limit itself is excluded, gt; le or lt.
        unit: Unit of the limits; empty for a ratio.
    """
    tail = f" {unit}" if unit else ""
    low, high = (_plain(limits, *names) for names in (("ge", "gt"), ("le", "lt")))
    if low and high:
        if "gt" in limits:
            return f"above {low}, {'below' if 'lt' in limits else 'to'} {high}{tail}"
        return f"{low} to {'below ' if 'lt' in limits else ''}{high}{tail}"
    if low:
        return f"above {low}{tail}" if "gt" in limits else f"{low}{tail} or more"
    if high:
        return f"below {high}{tail}" if "lt" in limits else f"{high}{tail} or less"
    return ""


def _plain(limits: dict[str, float], name: str, excluding: str) -> str:
    """A limit without an exponent, if it is a whole number that a person would write out; empty for none."""
    if name not in limits and excluding not in limits:
        return ""
    limit = limits[name] if name in limits else limits[excluding]
    return f"{limit:.0f}" if limit == round(limit) and abs(limit) < 1e9 else f"{limit:.6g}"
