"""Path through waypoints: straight segments joined by arcs that are tangent to both.

Depth changes linearly along each straight segment and along each arc, so arcs are helices. With a turning radius of
zero the path has corners, at which the platform turns on the spot, as on a rail. The platform's heading is the
direction of the path.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WaypointPath:
    """Segments of a path in order, straight ones and arcs, one row each."""

    start: Floats
    """North, east, depth of the start of each segment [m], shape (segments, 3)."""
    heading: Floats
    """Compass heading at the start of each segment [rad], shape (segments,)."""
    turn: Floats
    """Change of heading along each segment, clockwise positive, 0 if straight [rad], shape (segments,)."""
    horizontal_length: Floats
    """Horizontal length of each segment [m], shape (segments,)."""
    depth_change: Floats
    """Change of depth along each segment, positive down [m], shape (segments,)."""

    @property
    def length(self) -> Floats:
        """Length of each segment in three dimensions [m], shape (segments,)."""
        return np.hypot(self.horizontal_length, self.depth_change)

    def at(self, distance: Floats) -> tuple[Floats, Floats]:
        """Position and heading at distances along the path.

        Args:
            distance: Distances from the start along the path [m], shape (n,).

        Returns:
            North, east, depth [m], shape (n, 3); compass heading [rad], shape (n,), at a corner that of the next
            segment.
        """
        length = self.length
        before = np.concatenate([[0.0], np.cumsum(length)])
        segment = np.clip(np.searchsorted(before, distance, side="right") - 1, 0, len(length) - 1)
        fraction = np.clip((distance - before[segment]) / length[segment], 0, 1)
        overrun = np.maximum(distance - before[-1], 0.0)[:, None]  # straight on from the end
        turn_so_far = fraction * self.turn[segment]
        initial_heading = self.heading[segment]
        # The chord of an arc leans half the angle turned so far, and is shorter than the arc by a sinc.
        chord = fraction * self.horizontal_length[segment] * np.sinc(turn_so_far / 2 / np.pi)
        step = np.stack([np.cos(initial_heading + turn_so_far / 2), np.sin(initial_heading + turn_so_far / 2)], axis=-1)
        position = self.start[segment].copy()
        position[:, :2] += chord[:, None] * step
        position[:, 2] += fraction * self.depth_change[segment]
        direction = np.stack([np.cos(initial_heading + turn_so_far), np.sin(initial_heading + turn_so_far)], axis=-1)
        position[:, :2] += overrun * (self.horizontal_length / length)[segment, None] * direction
        position[:, 2:] += overrun * (self.depth_change / length)[segment, None]
        return position, initial_heading + turn_so_far


class TurnRadiusError(ValueError):
    """A turn that does not fit between its neighbours."""

    def __init__(self, waypoint: int, angle: float, required: float, length: float) -> None:
        """Store the turn and the lengths.

        Args:
            waypoint: Number of the waypoint at which the path turns, from 0.
            angle: Angle of the turn [rad].
            required: Length that the turns need on the line between two waypoints [m].
            length: Distance between these waypoints [m].
        """
        super().__init__(f"a turn of {np.degrees(angle):.4g} deg takes {required:.4g} m of a run of {length:.4g} m")
        self.waypoint, self.angle, self.required, self.length = waypoint, angle, required, length


def rounded_path(corners: Floats, radius: float) -> WaypointPath:
    """Path through some waypoints, with arcs in place of their corners.

    Args:
        corners: North, east, depth of the waypoints [m], shape (n, 3); no two consecutive ones above one another.
        radius: Horizontal radius of the turns [m]; 0: sharp corners.

    Raises:
        TurnRadiusError: The arcs at two consecutive waypoints need more than the distance between them.
    """
    step = np.diff(corners, axis=0)
    horizontal = np.hypot(step[:, 0], step[:, 1])
    course = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    turn = np.diff(course)
    # distance from a waypoint to the points at which its arc is tangent to both lines
    tangent_length = np.concatenate([[0.0], radius * np.tan(np.abs(turn) / 2), [0.0]])
    _require_space_for_turns(tangent_length, horizontal, turn)
    slope = step / horizontal[:, None]
    begin = corners[:-1] + tangent_length[:-1, None] * slope
    end = corners[1:] - tangent_length[1:, None] * slope
    straight = np.maximum(horizontal - tangent_length[:-1] - tangent_length[1:], 0.0)
    arc_climb = begin[1:, 2] - end[:-1, 2]
    path = WaypointPath(
        start=_interleave(begin, end[:-1]),
        heading=_interleave(course, course[:-1]),
        turn=_interleave(np.zeros(len(horizontal)), turn),
        horizontal_length=_interleave(straight, radius * np.abs(turn)),
        depth_change=_interleave(straight * slope[:, 2], arc_climb),
    )
    has_length = path.length > 1e-9  # 0 between two arcs that adjoin, and at a sharp corner
    return WaypointPath(
        path.start[has_length],
        path.heading[has_length],
        path.turn[has_length],
        path.horizontal_length[has_length],
        path.depth_change[has_length],
    )


def _require_space_for_turns(tangent_length: Floats, horizontal: Floats, turn: Floats) -> None:
    too_short = np.flatnonzero(tangent_length[:-1] + tangent_length[1:] > horizontal * (1 + 1e-9))
    if too_short.size:
        run = int(too_short[0])
        waypoint = run if tangent_length[run] > tangent_length[run + 1] else run + 1
        required = float(tangent_length[run] + tangent_length[run + 1])
        raise TurnRadiusError(waypoint, float(turn[waypoint - 1]), required, float(horizontal[run]))


def _interleave(runs: Floats, arcs: Floats) -> Floats:
    """Rows of straight segments and of the arcs between them, alternating."""
    rows = np.empty((len(runs) + len(arcs), *runs.shape[1:]))
    rows[0::2], rows[1::2] = runs, arcs
    return rows
