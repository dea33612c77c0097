"""The survey: where the sonar goes on its whole track, as far as the sampling of the ground needs to know.

A place keeps its scatterers in every ping only where the fineness of their lattice follows from the whole
track. What matters is how near and how far the sonar ever gets, and how high above a boundary it ever is.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from insonify.sonar._survey_kernel import nearest_run
from insonify.sonar.sonar import Sonar
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]

STRAIGHT = 1e-6
"""A track that bends by less is straight [m]."""
ROUGHLY = 1.0
"""Distance by which a bending track may differ from the polyline that stands for it [m]."""


@dataclass(frozen=True, slots=True)
class Survey:
    """Where the sonar goes on its whole track."""

    corners: Floats
    """North and east of the corners of a polyline that follows the track [m], shape (corners, 2), two at least."""
    outermost: Floats
    """Those corners that some place may find the farthest [m], shape (m, 2)."""
    wander: float
    """Largest distance between the track and its polyline [m]; 0 for a straight one."""
    depths: tuple[float, float]
    """Least and greatest depth of the ends that the platform carries [m]."""

    def near(self, place: Floats, reach: float) -> Floats:
        """The runs of the polyline that may be the nearest to points about a place.

        Args:
            place: North and east of the place, such as that of the sonar at one ping [m], shape (2,).
            reach: Distance of the farthest point from it [m].

        Returns:
            Both ends of every run that may be the nearest to such a point [m], shape (runs, 2, 2).
        """
        runs = np.stack([self.corners[:-1], self.corners[1:]], axis=1)
        if len(runs) == 1:
            return runs
        # A point is no farther from the nearest run than by way of the place and the run that is nearest to that.
        away = distance_to_runs(place[None], runs, each=True)[0]
        return runs[away <= 2 * reach + away.min()]


Ends = tuple[Literal["transmit", "receive"], ...]


def survey(sonar: Sonar, poses: Poses, *, ends: Ends = ("transmit", "receive")) -> Survey:
    """Where the sonar goes on its whole track.

    Args:
        sonar: The sonar, of one side or both.
        poses: True poses of its platform.
        ends: What the platform carries: both ends change places without changing the survey.
    """
    depth = np.concatenate([poses.carried(getattr(side, end).offset)[:, 2] for side in sonar.one_sided for end in ends])
    corners, wander = polyline(poses.position[:, :2])
    return Survey(corners, _hull(corners), wander, (float(depth.min()), float(depth.max())))


def polyline(places: Floats) -> tuple[Floats, float]:
    """A polyline of few corners that follows a row of places.

    Args:
        places: North and east [m], shape (n, 2).

    Returns:
        Corners, some of the places with the first and the last among them [m], shape (m, 2), m at least 2; and the
        largest distance of any place from them [m], 0 where the row is straight.

    Source: Douglas & Peucker (1973), Cartographica 10(2), 112-122.
    """
    ends = places[[0, -1]]
    away, _ = _farthest(places, 0, len(places) - 1)
    if away <= STRAIGHT:
        return ends, 0.0
    kept, largest = {0, len(places) - 1}, 0.0
    open_runs = [(0, len(places) - 1)]
    while open_runs:
        first, last = open_runs.pop()
        away, row = _farthest(places, first, last)
        if away > ROUGHLY:
            kept.add(row)
            open_runs += [(first, row), (row, last)]
        else:
            largest = max(largest, away)
    return places[sorted(kept)], largest


def _hull(corners: Floats) -> Floats:
    """The corners of the convex hull of some places; of two places both.

    Source: monotone chain, Andrew (1979), Information Processing Letters 9(5), 216-219.
    """
    if len(corners) <= 2:
        return corners
    order = np.unique(corners, axis=0)
    chain: list[Floats] = []
    for row in (order, order[::-1]):
        side: list[Floats] = []
        for place in row:
            while len(side) > 1 and _turn(side[-2], side[-1], place) <= 0:
                side.pop()
            side.append(place)
        chain += side[:-1]
    return np.array(chain) if chain else order


def _turn(a: Floats, b: Floats, c: Floats) -> float:
    """Twice the area of a triangle, negative where it turns the other way [m^2]."""
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


def _farthest(places: Floats, first: int, last: int) -> tuple[float, int]:
    """Distance and row of the place that is farthest from the run between two others; 0 where there is none between."""
    if last - first < 2:
        return 0.0, first
    away = distance_to_runs(places[first + 1 : last], places[None, [first, last]])
    row = int(np.argmax(away))
    return float(away[row]), first + 1 + row


def distance_to_runs(place: Floats, runs: Floats, *, each: bool = False) -> Floats:
    """Distance of places from the nearest of some straight runs.

    Args:
        place: Coordinates in a plane [m], shape (n, 2).
        runs: Both ends of each run [m], shape (runs, 2, 2).
        each: Whether the distance from each run is wanted.

    Returns:
        Distances [m], shape (n,), or (n, runs) of each.
    """
    if each:
        return np.stack([_distance_to_run(place, *ends) for ends in runs], axis=-1)
    distance = np.empty(len(place))
    nearest_run(np.ascontiguousarray(place), np.ascontiguousarray(runs), distance)
    return distance


def _distance_to_run(place: Floats, start: Floats, stop: Floats) -> Floats:
    along = stop - start
    square = float(along @ along)
    part = np.clip((place - start) @ along / square, 0, 1) if square > 0 else np.zeros(len(place))
    return np.asarray(np.linalg.norm(place - start - part[:, None] * along, axis=-1))
