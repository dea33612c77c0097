"""The wind, checked before it raises a sea."""

from insonify.validity import require_number

STRONGEST = 120.0
"""Wind that no storm exceeds [m/s]."""


def checked_wind(owner: str, wind_speed: float) -> float:
    """Refuse a wind that has no sea to it.

    Args:
        owner: Name of the thing that was given the wind.
        wind_speed: Wind 10 m above the sea [m/s].

    Returns:
        The same wind, as a number [m/s].

    Raises:
        ValueError: The wind is not a finite number above 0.
    """
    example = "7 (a flat sea needs no waves)"
    return require_number(f"{owner}.wind_speed", wind_speed, "m/s", 0.0, STRONGEST, above=True, example=example)
