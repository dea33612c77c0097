"""Pings of a track, by number."""

from collections.abc import Iterable

import numpy as np

from insonify.scenario.scenario import Scenario


def selected_pings(scenario: Scenario, pings: int | Iterable[int] | None) -> list[int]:
    """Return the selected pings, all by default.

    Raises:
        ValueError: The track has no such ping.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(f"a Scenario is wanted, not a {type(scenario).__name__}; load one with insonify.load_scenario")
    count = scenario.track.ping_count
    chosen = list(range(count)) if pings is None else [int(ping) for ping in _ping_numbers(pings)]
    for ping in chosen:
        if not 0 <= ping < count:
            raise ValueError(f"ping is {ping}; the track has pings 0 to {count - 1}")
    return chosen


def _ping_numbers(pings: int | Iterable[int]) -> Iterable[int]:
    """Numbers of pings, where one alone may be given."""
    if isinstance(pings, Iterable):
        return pings
    if isinstance(pings, bool) or not isinstance(pings, int | np.integer):
        raise TypeError(f"pings is {pings!r}; give the number of a ping, or several, such as range(10)")
    return [int(pings)]
