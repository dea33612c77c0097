"""The wind, checked before it raises a sea."""

import math


def checked_wind(owner: str, wind_speed: float) -> None:
    """Refuse a wind that has no sea to it.

    Args:
        owner: Name of the thing that was given the wind.
        wind_speed: Wind 10 m above the sea [m/s].

    Raises:
        ValueError: The wind is not a finite number above 0.
    """
    if not (math.isfinite(wind_speed) and wind_speed > 0):
        raise ValueError(
            f"{owner}.wind_speed is {wind_speed} m/s; give a finite wind above 0, such as 7 (a flat sea needs no waves)"
        )
