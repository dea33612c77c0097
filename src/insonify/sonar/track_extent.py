"""Extent of a sonar's whole track, from which sampling densities follow.

A position keeps its scatterers in every ping only where the fineness of their grid follows from the whole
track. What matters is how near and how far the sonar ever gets, and how high above a boundary it ever is.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from insonify.sonar._track_extent_kernel import nearest_segment_distance
from insonify.sonar.sonar import Sonar
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]

STRAIGHT = 1e-6
"""Deviation from a straight line up to which a track is treated as straight [m]."""
ROUGHLY = 1.0
"""Distance by which a bending track may differ from the polyline that stands for it [m]."""


@dataclass(frozen=True, slots=True)
class TrackExtent:
    """Extent of the whole track of a sonar."""

    corners: Floats
    """North and east of the corners of a polyline that follows the track [m], shape (corners, 2), two at least."""
    hull_corners: Floats
    """Corners that may be the farthest from some position [m], shape (m, 2)."""
    polyline_error: float
    """Largest distance between the track and its polyline [m]; 0 for a straight one."""
    depths: tuple[float, float]
    """Least and greatest depth of the ends on the platform [m]."""

    def nearest_segments(self, position: Floats, max_distance: float) -> Floats:
        """The runs of the polyline that may be the nearest to points about a position.

        Args:
            position: North and east of the position, such as that of the sonar at one ping [m], shape (2,).
            max_distance: Distance of the farthest point from it [m].

        Returns:
            Both ends of every run that may be the nearest to such a point [m], shape (runs, 2, 2).
        """
        runs = np.stack([self.corners[:-1], self.corners[1:]], axis=1)
        if len(runs) == 1:
            return runs
        # A point is no farther from the nearest run than by way of the position and the run that is nearest to that.
        away = distance_to_segments(position[None], runs, each=True)[0]
        return runs[away <= 2 * max_distance + away.min()]


Ends = tuple[Literal["transmit", "receive"], ...]


def track_extent(sonar: Sonar, poses: Poses, *, ends: Ends = ("transmit", "receive")) -> TrackExtent:
    """Compute the extent of the whole track of a sonar.

    Args:
        sonar: The sonar, of one side or both.
        poses: True poses of its platform.
        ends: Ends on the platform; their order does not matter.
    """
    depth = np.concatenate(
        [poses.offset_positions(getattr(side, end).offset)[:, 2] for side in sonar.side_sonars for end in ends]
    )
    corners, wander = simplified_polyline(poses.position[:, :2])
    return TrackExtent(corners, _hull(corners), wander, (float(depth.min()), float(depth.max())))


def simplified_polyline(positions: Floats) -> tuple[Floats, float]:
    """A polyline of few corners that follows a row of positions.

    Args:
        positions: North and east [m], shape (n, 2).

    Returns:
        Corners, some of the positions with the first and the last among them [m], shape (m, 2), m at least 2; and the
        largest distance of any position from them [m], 0 where the row is straight.

    Source: Douglas & Peucker (1973), Cartographica 10(2), 112-122.
    """
    ends = positions[[0, -1]]
    away, _ = _farthest(positions, 0, len(positions) - 1)
    if away <= STRAIGHT:
        return ends, 0.0
    kept, largest = {0, len(positions) - 1}, 0.0
    open_runs = [(0, len(positions) - 1)]
    while open_runs:
        first, last = open_runs.pop()
        away, row = _farthest(positions, first, last)
        if away > ROUGHLY:
            kept.add(row)
            open_runs += [(first, row), (row, last)]
        else:
            largest = max(largest, away)
    return positions[sorted(kept)], largest


def _hull(corners: Floats) -> Floats:
    """The corners of the convex hull of some positions; of two positions both.

    Source: monotone chain, Andrew (1979), Information Processing Letters 9(5), 216-219.
    """
    if len(corners) <= 2:
        return corners
    order = np.unique(corners, axis=0)
    chain: list[Floats] = []
    for row in (order, order[::-1]):
        side: list[Floats] = []
        for position in row:
            while len(side) > 1 and _turn(side[-2], side[-1], position) <= 0:
                side.pop()
            side.append(position)
        chain += side[:-1]
    return np.array(chain) if chain else order


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    """Twice the area of a triangle, negative where its corners turn clockwise [m^2]."""
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


def _farthest(positions: Floats, first: int, last: int) -> tuple[float, int]:
    """Distance and row of the position farthest from the run between two others; 0 where there is none between."""
    if last - first < 2:
        return 0.0, first
    away = distance_to_segments(positions[first + 1 : last], positions[None, [first, last]])
    row = int(np.argmax(away))
    return float(away[row]), first + 1 + row


def distance_to_segments(position: Floats, segments: Floats, *, each: bool = False) -> Floats:
    """Distance of positions from the nearest of some straight runs.

    Args:
        position: Coordinates in a plane [m], shape (n, 2).
        segments: Both ends of each run [m], shape (runs, 2, 2).
        each: True to return the distance from each run.

    Returns:
        Distances [m], shape (n,), or (n, runs) of each.
    """
    if each:
        return np.stack([_distance_to_segment(position, *ends) for ends in segments], axis=-1)
    distance = np.empty(len(position))
    nearest_segment_distance(np.ascontiguousarray(position), np.ascontiguousarray(segments), distance)
    return distance


def _distance_to_segment(position: Floats, start: Floats, stop: Floats) -> Floats:
    along = stop - start
    square = float(along @ along)
    part = np.clip((position - start) @ along / square, 0, 1) if square > 0 else np.zeros(len(position))
    return np.asarray(np.linalg.norm(position - start - part[:, None] * along, axis=-1))
