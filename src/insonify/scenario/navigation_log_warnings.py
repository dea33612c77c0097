"""Warnings on navigation logs with motions that no platform makes: jumps from row to row, and pauses."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.track import NavigationTrack

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

FASTEST = 15.0
"""Speed from one row to the next beyond which a log has jumped, more than any survey vessel makes [m/s]."""


def jump_warning(scenario: ScenarioParts) -> str:
    """Warning on rows that the platform could only reach by a jump; empty without any under the track's pings."""
    track = scenario.track
    if not isinstance(track, NavigationTrack):
        return ""
    log = track.log()
    step = np.linalg.norm(np.diff(log.position, axis=0), axis=1)
    speed = step / np.diff(log.time)
    rows = np.flatnonzero((speed > FASTEST) & _used(track))
    if not rows.size:
        return ""
    row = int(rows[0])
    others = "" if rows.size == 1 else f", and so in {rows.size - 1} more row{'s' * (rows.size > 2)}"
    return (
        f"track.file: {track.file}, line {log.line[row + 1]}: {step[row]:.4g} m from the row before it in "
        f"{log.time[row + 1] - log.time[row]:.4g} s is {speed[row]:.4g} m/s{others}; no platform makes more than "
        f"{FASTEST:g} m/s. Delete such rows, or smooth the log."
    )


def gap_warning(scenario: ScenarioParts) -> str:
    """Warning on pauses of a log over which poses are made up; empty where there is none under the track's pings."""
    track = scenario.track
    if not isinstance(track, NavigationTrack):
        return ""
    log = track.log()
    pause = np.diff(log.time)
    rows = np.flatnonzero((pause > track.default_longest_gap()) & _used(track))
    if not rows.size:
        return ""
    row = int(rows[0])
    others = "" if rows.size == 1 else f", the first of {rows.size} such gaps"
    return (
        f"track.file: {track.file}, line {log.line[row + 1]}: the log has a gap of {pause[row]:.4g} s before this line"
        f"{others}, over which the platform is taken to go straight. End the track before it with `pings`, or start "
        "after it with `start`."
    )


def _used(track: NavigationTrack) -> NDArray[np.bool_]:
    """Mask of the log's steps from row to row between the track's first ping and its last, shape (rows - 1,)."""
    time = track.log().time
    ends = track.start, track.start + float(track.planned_poses().time[-1])
    return np.asarray((time[1:] >= ends[0]) & (time[:-1] <= ends[1]))
