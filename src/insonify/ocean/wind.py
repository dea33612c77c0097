"""Check of a wind speed."""

from insonify.validity import require_number

MAX_WIND = 120.0
"""Largest wind speed of any storm [m/s]."""


def checked_wind(spectrum: str, wind_speed: float) -> float:
    """Refuse a wind that raises no waves.

    Args:
        spectrum: Name of the wave spectrum, for the message.
        wind_speed: Wind 10 m above the sea [m/s].

    Returns:
        The same wind, as a number [m/s].

    Raises:
        ValueError: The wind is not a finite number above 0.
    """
    field, example = f"{spectrum}.wind_speed", "7 (a flat sea needs no waves)"
    return require_number(field, wind_speed, "m/s", 0.0, MAX_WIND, exclude_low=True, example=example)
