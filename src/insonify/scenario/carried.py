"""The platforms of a scenario: their true poses at every ping, and how they go on while the sonar listens."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from insonify.sonar.platforms import Platforms
from insonify.sonar.track import Poses, poses

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario
    from insonify.sonar.track import Track

Later = tuple[Poses, Poses] | None


def platforms(scenario: Scenario) -> Platforms:
    """What carries the sonar of a scenario; a receiver that keeps to the transmitter's poses rides the same platform.

    Args:
        scenario: The scenario.
    """
    moves = not scenario.track.stop_and_hop
    sending, later = _carried(scenario.track, scenario.seed, moves)
    if scenario.receiver_track is None or scenario.receiver_track == scenario.track:
        return Platforms(sending, sending_later=later)
    receiving, other = _carried(scenario.receiver_track, receiver_seed(scenario), moves)
    if all(_alike(a, b) for a, b in zip((sending, *(later or ())), (receiving, *(other or ())), strict=True)):
        return Platforms(sending, sending_later=later)
    return Platforms(sending, receiving, later, other)


def receiver_seed(scenario: Scenario) -> int:
    """The seed of what is random about a receiver's own platform: no scenario has it for its first.

    Args:
        scenario: The scenario.
    """
    return scenario.seed | 1 << 63


def _carried(track: Track, seed: int, moves: bool) -> tuple[Poses, Later]:
    """Poses at the start of each ping; and at the middle and the end of the window of one that moves."""
    now = poses(track, seed=seed)
    if not moves:
        return now, None
    stop = track.window[1]
    return now, (poses(track, seed=seed, after=stop / 2), poses(track, seed=seed, after=stop))


def _alike(one: Poses, other: Poses) -> bool:
    return np.array_equal(one.position, other.position) and np.array_equal(one.attitude, other.attitude)
