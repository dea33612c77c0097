"""Pings of a track and channels of a sonar, by number."""

from collections.abc import Iterable
from typing import Any

import numpy as np

from insonify.scenario.scenario import Scenario


def selected_pings(scenario: Scenario, pings: int | Iterable[int] | None) -> list[int]:
    """Return the selected pings, all by default.

    Raises:
        TypeError: A number of a ping is not a whole number.
        ValueError: The track has no such ping.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(f"expected a Scenario, not a {type(scenario).__name__}; load one with insonify.load_scenario")
    count = scenario.track.ping_count
    if pings is None:
        return list(range(count))
    several: Iterable[Any] = pings if isinstance(pings, Iterable) and not isinstance(pings, str | bytes) else [pings]
    return [require_index("ping", ping, count, "track") for ping in several]


def require_index(name: str, value: Any, count: int, container: str) -> int:
    """Check the number of a ping or channel.

    Args:
        name: Name of what is counted, such as "ping".
        value: Its number.
        count: Number of them.
        container: Name of what contains them, such as "track".

    Raises:
        TypeError: It is not a whole number.
        ValueError: There is none of that number.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{name} is {value!r}; give a whole number, 0 to {count - 1}")
    if not 0 <= value < count:
        raise ValueError(f"{name} is {value}; the {container} has {name}s 0 to {count - 1}")
    return int(value)
