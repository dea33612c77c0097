"""Extent of a sonar's whole track, from which sampling densities follow.

A position has the same scatterers in every ping only if the pitch of their grid follows from the whole track: from the
least and the greatest distance of the sonar, and from its least and greatest height above a boundary.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from insonify.sonar._track_extent_kernel import nearest_segment_distance
from insonify.sonar.sonar import Sonar
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]

STRAIGHTNESS_TOLERANCE = 1e-6
"""Largest deviation from a straight line of a track that is treated as straight [m]."""
POLYLINE_TOLERANCE = 1.0
"""Largest distance between a curved track and the polyline that represents it [m]."""


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
    """Least and greatest depth of the arrays on the platform [m]."""

    def nearest_segments(self, position: Floats, max_distance: float) -> Floats:
        """Segments of the polyline that may be the nearest to any point within a distance of a position.

        Args:
            position: North and east of the position, such as that of the sonar at one ping [m], shape (2,).
            max_distance: Distance of the farthest point from the position [m].

        Returns:
            Both ends of each of these segments [m], shape (segments, 2, 2).
        """
        segments = np.stack([self.corners[:-1], self.corners[1:]], axis=1)
        if len(segments) == 1:
            return segments
        # triangle inequality: from the position, a point's nearest segment is at most this far
        distance = distance_to_segments(position[None], segments, each=True)[0]
        return segments[distance <= 2 * max_distance + distance.min()]


Ends = tuple[Literal["transmit", "receive"], ...]


def track_extent(sonar: Sonar, poses: Poses, *, ends: Ends = ("transmit", "receive")) -> TrackExtent:
    """Compute the extent of the whole track of a sonar.

    Args:
        sonar: The sonar, of one side or both.
        poses: True poses of its platform.
        ends: Arrays on the platform, in any order.
    """
    depth = np.concatenate(
        [poses.offset_positions(getattr(side, end).offset)[:, 2] for side in sonar.side_sonars for end in ends]
    )
    corners, polyline_error = simplified_polyline(poses.position[:, :2])
    return TrackExtent(corners, _hull(corners), polyline_error, (float(depth.min()), float(depth.max())))


def simplified_polyline(positions: Floats) -> tuple[Floats, float]:
    """Polyline of few corners that follows a sequence of positions, by the algorithm of Douglas and Peucker.

    Args:
        positions: North and east [m], shape (n, 2).

    Returns:
        Corners, a subset of the positions that includes the first and the last [m], shape (m, 2), m at least 2; and
        the largest distance of any position from the polyline [m], 0 for a straight sequence.

    Source: Douglas & Peucker (1973), Cartographica 10(2), 112-122.
    """
    ends = positions[[0, -1]]
    distance, _ = _farthest_position(positions, 0, len(positions) - 1)
    if distance <= STRAIGHTNESS_TOLERANCE:
        return ends, 0.0
    corners, largest = {0, len(positions) - 1}, 0.0
    open_segments = [(0, len(positions) - 1)]
    while open_segments:
        first, last = open_segments.pop()
        distance, row = _farthest_position(positions, first, last)
        if distance > POLYLINE_TOLERANCE:
            corners.add(row)
            open_segments += [(first, row), (row, last)]
        else:
            largest = max(largest, distance)
    return positions[sorted(corners)], largest


def _hull(corners: Floats) -> Floats:
    """Corners of the convex hull of positions (n, 2) [m], shape (m, 2); two positions are their own hull.

    Source: monotone chain, Andrew (1979), Information Processing Letters 9(5), 216-219.
    """
    if len(corners) <= 2:
        return corners
    sorted_corners = np.unique(corners, axis=0)
    chain: list[Floats] = []
    for sequence in (sorted_corners, sorted_corners[::-1]):
        half_chain: list[Floats] = []
        for position in sequence:
            while len(half_chain) > 1 and _signed_area(half_chain[-2], half_chain[-1], position) <= 0:
                half_chain.pop()
            half_chain.append(position)
        chain += half_chain[:-1]
    return np.array(chain) if chain else sorted_corners


def _signed_area(a: Floats, b: Floats, c: Floats) -> float:
    """Twice the signed area of a triangle, negative for corners in clockwise order [m^2]."""
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


def _farthest_position(positions: Floats, first: int, last: int) -> tuple[float, int]:
    """Distance [m] and row of the farthest position between two rows from the segment that joins these; 0 for none."""
    if last - first < 2:
        return 0.0, first
    distance = distance_to_segments(positions[first + 1 : last], positions[None, [first, last]])
    row = int(np.argmax(distance))
    return float(distance[row]), first + 1 + row


def distance_to_segments(position: Floats, segments: Floats, *, each: bool = False) -> Floats:
    """Distance of positions from the nearest of some straight segments.

    Args:
        position: Coordinates in a plane [m], shape (n, 2).
        segments: Both ends of each segment [m], shape (segments, 2, 2).
        each: True to return the distance from each segment.

    Returns:
        Distances [m], shape (n,), or (n, segments) from each segment.
    """
    if each:
        return np.stack([_distance_to_segment(position, *ends) for ends in segments], axis=-1)
    distance = np.empty(len(position))
    nearest_segment_distance(np.ascontiguousarray(position), np.ascontiguousarray(segments), distance)
    return distance


def _distance_to_segment(position: Floats, start: Floats, stop: Floats) -> Floats:
    """Distance of positions (n, 2) from the segment between two points (2,) [m], shape (n,)."""
    along = stop - start
    length_squared = float(along @ along)
    fraction = (
        np.clip((position - start) @ along / length_squared, 0, 1) if length_squared > 0 else np.zeros(len(position))
    )
    return np.asarray(np.linalg.norm(position - start - fraction[:, None] * along, axis=-1))
