"""All rays between two points of a layered column, by shooting, in 50-digit arithmetic.

Nothing is solved in closed form and no code is shared with the project. Launch angles are cut where a ray
grazes a knot, so that all rays in between meet the same layers in the same order; along each such window
the horizontal distance is sampled densely, towards both ends ever more densely; every change of sign, and
every dip that reaches the range, is a ray. Each ray is then walked again in 50 digits (`oracles.walk`).
"""

from dataclasses import dataclass
from itertools import pairwise

import mpmath as mp
import numpy as np

from oracles.walk import DIGITS, Column, Step, run_of, walk, walked

FAMILIES = ("D", "S", "B", "SB", "BS", "SBS", "BSB")
MOST_STEPS = 400
SAMPLES = np.unique(
    np.concatenate([np.geomspace(1e-11, 0.5, 150), 1 - np.geomspace(1e-11, 0.5, 150), np.linspace(0, 1, 162)[1:-1]])
)
"""Where a window is sampled, as a part of it."""


@dataclass(frozen=True)
class Ray:
    """One ray from the source to the point; angles positive downward [rad]."""

    delay: float
    launch: float
    arrival: float
    slowness: float
    amplitude: float
    length: float
    caustics: int
    turns: int
    fold: float
    """How far the point is from the end of these rays: the nearest fold or edge of the branch [m]."""
    exact_delay: mp.mpf
    """The delay with all its digits [s]."""


@dataclass(frozen=True)
class Shot:
    """A ray that was shot, where it reaches the point's depth."""

    launch: float
    distance: float
    turns: int
    edge: float
    """How far it is from where the rays of its window end [m]."""


def rays(depth, speed, source_depth, family, point_depth, distance, *, most=12):
    """All rays of a family from a source to a point, by launch angle, upward first.

    A point on a boundary is reached just before the bounce.

    Args:
        depth: Knots from the surface to the seabed [m].
        speed: Sound speed there [m/s].
        source_depth: Depth of the source [m].
        family: D, or letters S and B in turn, from the source on.
        point_depth: Depth of the point [m].
        distance: Horizontal distance [m], above 0.
        most: Rays that are walked; of more, those that turn least.
    """
    column = Column.around(depth, speed, source_depth, point_depth)
    bounces = "" if family == "D" else family
    found = []
    for low, high in _windows(column):
        theta = low + (high - low) * SAMPLES
        for route, ranges in _arrivals(column, bounces, theta, low + (high - low) / 2, distance):
            brackets = _brackets(column, route, theta, ranges, distance)
            found += [(route, bracket) for bracket in brackets]
    found = sorted(found, key=lambda one: _turns(one[0]))[:most]
    found = [_ray(column, route, *bracket, distance) for route, bracket in found]
    if not bounces and column.source == column.point:
        found += _level(column, distance)
    return sorted(filter(None, found), key=lambda ray: ray.launch)


def shots(depth, speed, source_depth, family, point_depth, farthest, rng, *, most_turns=8):
    """Rays shot at random and close to every grazing one, wherever they meet the depth of a point.

    Args:
        depth: Knots from the surface to the seabed [m].
        speed: Sound speed there [m/s].
        source_depth: Depth of the source [m].
        family: As in `rays`.
        point_depth: Depth at which they are reached [m].
        farthest: Horizontal distance beyond which they are let go [m].
        rng: Random numbers.
        most_turns: Turns after which they are let go.
    """
    column = Column.around(depth, speed, source_depth, point_depth)
    bounces = "" if family == "D" else family
    found = []
    for low, high in _windows(column):
        part = 10 ** rng.uniform(-9, -0.3, 2)
        launches = np.array([low + (high - low) * part[0], high - (high - low) * part[1]])
        ends = low + (high - low) * SAMPLES[[0, -1]]
        for route, reaches in _arrivals(column, bounces, ends, (low + high) / 2, farthest):
            if _turns(route) > most_turns:
                break
            for launch in launches:
                with mp.workdps(DIGITS):
                    reach = walked(column, route, mp.mpf(float(launch)), only_range=True).run
                if reach < farthest:
                    edge = float(np.abs(reaches - float(reach)).min())
                    found.append(Shot(float(launch), float(reach), _turns(route), edge))
    return found


def _level(column, distance):
    """The ray that runs level through still water; with still water on one side only it is the edge of a branch."""
    here = column.exact[column.source]
    beside = [column.exact[k] for k in (column.source - 1, column.source + 1) if 0 <= k < len(column.exact)]
    still = sum(c == here for c in beside)
    if not still:
        return []
    delay = mp.mpf(distance) / here
    alone = len(beside) == still
    return [Ray(float(delay), 0.0, 0.0, float(1 / here), 1 / distance, distance, 0, 0, np.inf if alone else 0.0, delay)]


def _windows(column):
    """Launch angles between which no ray grazes a knot."""
    here = column.exact[column.source]
    with mp.workdps(DIGITS):
        level = {float(mp.acos(here / c)) for c in column.exact if c >= here}
    ends = sorted({-a for a in level} | level | {-np.pi / 2, np.pi / 2})
    return [(a, b) for a, b in pairwise(ends) if b - a > 1e-15]


def _arrivals(column, bounces, theta, middle, distance):
    """Each way of all rays of a window to the point's depth: the steps, and the distances (samples,)."""
    p = np.cos(theta) / column.speed[column.source]
    run = np.zeros(theta.size)
    route: list[Step] = []
    for step in walk(column, bounces, middle):
        run = run + run_of(column, step, p)
        route.append(step)
        if step.end == column.point and not _waits(route, bounces):
            yield list(route), run
        if run.min() > distance or len(route) > MOST_STEPS:
            return


def _waits(route, bounces):
    """Whether bounces are still to come when the last step has ended, just before what it reaches there."""
    return sum(step.bounced for step in route[:-1]) < len(bounces)


def _turns(route):
    return sum(step.begin == step.end for step in route)


def _brackets(column, route, theta, ranges, distance):
    """Pairs of launch angles with one ray between them, and how near the rays come to leaving the point out."""
    miss = ranges - distance
    folds = list(_folds(column, route, theta, miss, distance))
    theta, miss = _merged(theta, miss, folds)
    ends = [abs(miss[0]), abs(miss[-1])] if np.isfinite(miss[[0, -1]]).all() else []
    edge = min([abs(m) for _, m in folds] + ends, default=np.inf)
    for i in np.flatnonzero(np.sign(miss[:-1]) * np.sign(miss[1:]) < 0):
        yield theta[i], theta[i + 1], edge
    for i in np.flatnonzero(miss == 0):
        width = 1e-9 * max(theta[-1] - theta[0], 1e-12)
        yield theta[i] - width, theta[i] + width, edge


def _merged(theta, miss, folds):
    if not folds:
        return theta, miss
    theta, miss = np.concatenate([theta, [t for t, _ in folds]]), np.concatenate([miss, [m for _, m in folds]])
    order = np.argsort(theta, kind="stable")
    return theta[order], miss[order]


def _folds(column, route, theta, miss, distance):
    """Launch angles at which the distance is extreme, and what it misses the point by."""
    for i in range(1, theta.size - 1):
        rise = np.sign(miss[i] - miss[i - 1])
        if rise != 0 and rise == np.sign(miss[i] - miss[i + 1]):
            yield _extreme(lambda t: _distance(column, route, t) - distance, theta[i - 1], theta[i + 1], rise)


def _distance(column, route, theta):
    p = np.cos(theta) / column.speed[column.source]
    return float(sum(run_of(column, step, p) for step in route))


def _extreme(function, low, high, sign):
    """Golden section search of a maximum (sign 1) or a minimum (-1)."""
    part = (np.sqrt(5) - 1) / 2
    a, b = high - part * (high - low), low + part * (high - low)
    fa, fb = sign * function(a), sign * function(b)
    for _ in range(60):
        if fa > fb:
            high, b, fb = b, a, fa
            a = high - part * (high - low)
            fa = sign * function(a)
        else:
            low, a, fa = a, b, fb
            b = low + part * (high - low)
            fb = sign * function(b)
    return (a, sign * fa) if fa > fb else (b, sign * fb)


def _ray(column, route, low, high, edge, distance):
    """The one ray between two launch angles, walked in 50 digits."""
    with mp.workdps(DIGITS):
        launch = _root(column, route, mp.mpf(float(low)), mp.mpf(float(high)), mp.mpf(float(distance)))
        if launch is None:
            return None
        way = walked(column, route, launch)
        here, there = column.exact[column.source], column.exact[column.point]
        p = mp.cos(launch) / here
        arrival = mp.acos(p * there) * (1 if _heads_down(column, route) else -1)
        spread = there * mp.cos(launch) / (here * mp.mpf(float(distance)) * abs(way.tube))
        return Ray(
            delay=float(way.time), launch=float(launch), arrival=float(arrival), slowness=float(p),
            amplitude=float(mp.sqrt(spread)), length=float(way.length), caustics=way.caustics,
            turns=_turns(route), fold=float(edge), exact_delay=way.time,
        )  # fmt: skip


def _heads_down(column, route):
    last = route[-1]
    if last.begin != last.end:
        return last.end > last.begin
    return last.layer < last.begin  # turned above, hence downward


def _root(column, route, low, high, distance):
    """Where the distance is reached, by Newton's rule inside a bracket that shrinks; None if it is not."""
    begin, end = (walked(column, route, side, only_range=True).run - distance for side in (low, high))
    if (begin > 0) == (end > 0):
        return None  # plain numbers saw a change of sign within their rounding
    launch = (low + high) / 2
    for _ in range(400):
        way = walked(column, route, launch, only_range=True)
        miss = way.run - distance
        if abs(miss) < mp.mpf(10) ** -35:
            return launch
        if (miss > 0) == (begin > 0):
            low = launch
        else:
            high = launch
        step = launch - miss / way.slope if way.slope != 0 else low
        launch = step if min(low, high) < step < max(low, high) else (low + high) / 2
        if abs(high - low) < mp.mpf(10) ** -46:
            return launch
    raise ArithmeticError("no ray between two launch angles that enclose one")
