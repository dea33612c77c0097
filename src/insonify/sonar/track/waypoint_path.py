"""A path through waypoints: straight runs, joined by arcs that touch both, run at constant speed.

Depth changes evenly along each run and along each arc, so arcs are helices. With a turning radius of
zero the path has corners, and the platform turns on the spot: no ship does, but a towed carriage or a
rail may. A platform faces where it goes.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class WaypointPath:
    """Pieces of a path in the order in which they are run, one row each; a straight piece does not turn."""

    start: Floats
    """North, east, depth where each piece begins [m], shape (pieces, 3)."""
    heading: Floats
    """Compass direction in which it begins [rad], shape (pieces,)."""
    turn: Floats
    """Angle by which it turns, clockwise positive [rad], shape (pieces,)."""
    horizontal_length: Floats
    """Length over ground [m], shape (pieces,)."""
    climb: Floats
    """Growth of depth along it [m], shape (pieces,)."""

    @property
    def length(self) -> Floats:
        """Length of each piece in space [m], shape (pieces,)."""
        return np.hypot(self.horizontal_length, self.climb)

    def at(self, run: Floats) -> tuple[Floats, Floats]:
        """Position and heading after some distances.

        Args:
            run: Distances run from the start [m], shape (n,).

        Returns:
            North, east, depth [m], shape (n, 3); compass heading [rad], shape (n,). At a corner: of the next run.
        """
        length = self.length
        before = np.concatenate([[0.0], np.cumsum(length)])
        piece = np.clip(np.searchsorted(before, run, side="right") - 1, 0, len(length) - 1)
        share = np.clip((run - before[piece]) / length[piece], 0, 1)
        beyond = np.maximum(run - before[-1], 0.0)[:, None]  # straight on from the end
        turned = share * self.turn[piece]
        course = self.heading[piece]
        # The chord of an arc leans half the angle turned so far, and is shorter than the arc by a sinc.
        chord = share * self.horizontal_length[piece] * np.sinc(turned / 2 / np.pi)
        step = np.stack([np.cos(course + turned / 2), np.sin(course + turned / 2)], axis=-1)
        position = self.start[piece].copy()
        position[:, :2] += chord[:, None] * step
        position[:, 2] += share * self.climb[piece]
        ahead = np.stack([np.cos(course + turned), np.sin(course + turned)], axis=-1)
        position[:, :2] += beyond * (self.horizontal_length / length)[piece, None] * ahead
        position[:, 2:] += beyond * (self.climb / length)[piece, None]
        return position, course + turned


class TurnRadiusError(ValueError):
    """A turn that does not fit between its neighbours."""

    def __init__(self, waypoint: int, angle: float, required: float, length: float) -> None:
        """Errors of a path that does not fit its waypoints.

        Args:
            waypoint: Number of the waypoint at which the path turns, from 0.
            angle: Angle of the turn [rad].
            required: Length that the turns take up on the shorter straight run beside it [m].
            length: Length of that run [m].
        """
        super().__init__(f"a turn of {np.degrees(angle):.4g} deg takes {required:.4g} m of a run of {length:.4g} m")
        self.waypoint, self.angle, self.required, self.length = waypoint, angle, required, length


def rounded_path(corners: Floats, radius: float) -> WaypointPath:
    """The path through some waypoints, its corners cut by arcs.

    Args:
        corners: North, east, depth of the waypoints [m], shape (n, 3); no two in a row above one another.
        radius: Radius of the turns over ground [m]; 0: sharp corners.

    Raises:
        TurnRadiusError: An arc would begin before the run that leads to it, or before the arc before it has ended.
    """
    step = np.diff(corners, axis=0)
    horizontal = np.hypot(step[:, 0], step[:, 1])
    course = np.unwrap(np.arctan2(step[:, 1], step[:, 0]))
    turn = np.diff(course)
    # An arc touches both runs this far from their common waypoint.
    cut = np.concatenate([[0.0], radius * np.tan(np.abs(turn) / 2), [0.0]])
    _require_turn_room(cut, horizontal, turn)
    slope = step / horizontal[:, None]
    begin = corners[:-1] + cut[:-1, None] * slope
    end = corners[1:] - cut[1:, None] * slope
    straight = np.maximum(horizontal - cut[:-1] - cut[1:], 0.0)
    arc_climb = begin[1:, 2] - end[:-1, 2]
    path = WaypointPath(
        start=_between(begin, end[:-1]),
        heading=_between(course, course[:-1]),
        turn=_between(np.zeros(len(horizontal)), turn),
        horizontal_length=_between(straight, radius * np.abs(turn)),
        climb=_between(straight * slope[:, 2], arc_climb),
    )
    has_length = path.length > 1e-9  # nothing is run where two arcs meet, or at a sharp corner
    return WaypointPath(
        path.start[has_length],
        path.heading[has_length],
        path.turn[has_length],
        path.horizontal_length[has_length],
        path.climb[has_length],
    )


def _require_turn_room(cut: Floats, horizontal: Floats, turn: Floats) -> None:
    tight = np.flatnonzero(cut[:-1] + cut[1:] > horizontal * (1 + 1e-9))
    if tight.size:
        run = int(tight[0])
        waypoint = run if cut[run] > cut[run + 1] else run + 1
        required = float(cut[run] + cut[run + 1])
        raise TurnRadiusError(waypoint, float(turn[waypoint - 1]), required, float(horizontal[run]))


def _between(runs: Floats, arcs: Floats) -> Floats:
    """Rows of runs and of the arcs between them, in turn."""
    rows = np.empty((len(runs) + len(arcs), *runs.shape[1:]))
    rows[0::2], rows[1::2] = runs, arcs
    return rows
