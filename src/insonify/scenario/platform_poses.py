"""The platforms of a scenario: their true poses at every ping, and their motion during the recording window."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from insonify.recent_results import Identity, RecentResults
from insonify.sonar.platforms import Platforms
from insonify.sonar.track import Poses, true_poses

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts
    from insonify.sonar.track import Track

Later = tuple[Poses, Poses] | None


def platforms(scenario: ScenarioParts) -> Platforms:
    """Platforms of a scenario; a receiver that keeps to the transmitter's poses rides the same platform.

    Args:
        scenario: The scenario.
    """
    # tracks are frozen: the same object has the same poses
    key = Identity(scenario.track), Identity(scenario.receiver_track), scenario.seed
    return _LATEST.get(key, lambda: _platforms(scenario))


_LATEST: RecentResults[Platforms] = RecentResults(1)
"""Platforms of the latest scenario: its checks and its preparation need them ten times."""


def _platforms(scenario: ScenarioParts) -> Platforms:
    """Work out the poses of `platforms`."""
    moves = not scenario.track.stop_and_hop
    sending, later = _track_poses(scenario.track, scenario.seed, moves)
    if scenario.receiver_track is None or scenario.receiver_track == scenario.track:
        return Platforms(sending, transmitter_window_poses=later)
    receiving, other = _track_poses(scenario.receiver_track, receiver_seed(scenario), moves)
    if all(_alike(a, b) for a, b in zip((sending, *(later or ())), (receiving, *(other or ())), strict=True)):
        return Platforms(sending, transmitter_window_poses=later)
    return Platforms(sending, receiving, later, other)


def receiver_seed(scenario: ScenarioParts) -> int:
    """The seed of what is random about a receiver's own platform: no scenario has it for its first."""
    return scenario.seed | 1 << 63


def _track_poses(track: Track, seed: int, moves: bool) -> tuple[Poses, Later]:
    """Poses at the start of each ping; and at the middle and the end of the window of one that moves."""
    now = true_poses(track, seed=seed)
    if not moves:
        return now, None
    stop = track.window[1]
    return now, (true_poses(track, seed=seed, after=stop / 2), true_poses(track, seed=seed, after=stop))


def _alike(one: Poses, other: Poses) -> bool:
    return np.array_equal(one.position, other.position) and np.array_equal(one.attitude, other.attitude)
