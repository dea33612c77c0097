"""How things are timed: candidates take turns, and each keeps its best time."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Result:
    """One line of the table."""

    bench: str
    """What was measured."""
    value: float
    """How fast, in `unit`."""
    unit: str
    """Such as "M spike-elements/s"."""
    note: str = ""
    """Ratio to another line, or the goal."""


def best_seconds(candidates: Mapping[str, Callable[[], object]], repeats: int = 5) -> dict[str, float]:
    """Least seconds of each candidate over some rounds; all take part in each round, after one call to warm up.

    Args:
        candidates: What to time, by name.
        repeats: Rounds.

    Returns:
        Seconds by name. Other work on the machine then slows all candidates alike, and the minimum sees least of it.
    """
    for run in candidates.values():
        run()
    best = dict.fromkeys(candidates, float("inf"))
    for _ in range(repeats):
        for name, run in candidates.items():
            begin = time.perf_counter()
            run()
            best[name] = min(best[name], time.perf_counter() - begin)
    return best
