"""Where rays of a family meet a flat boundary: delays and launch angles over all distances.

Before a ping is drawn, the engine asks how far its window reaches and in which directions the sound must leave. In
layered water no formula tells; so all rays to a row of distances are found once, and bounds are read off them.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import COLUMNS, DELAY, MOST, SIN_LAUNCH, solve_points
from insonify.propagation.families import bounces
from insonify.propagation.layers import Column
from insonify.propagation.rays import Cones

Floats = NDArray[np.float64]

STEP = 0.25
"""Distance between the rays of a sweep [m]; coarser where there would be too many."""
MOST_STEPS = 4000


@dataclass(frozen=True)
class Sweep:
    """Delays and launch angles of one family over distance; no ray: infinite bounds the wrong way round."""

    step: float
    """Distance from one column to the next [m]."""
    earliest: Floats
    """Least delay of the family's rays [s], (m,)."""
    latest: Floats
    """Greatest delay [s], (m,)."""
    steepest_up: list[Floats]
    """Least launch angle [rad, + down] of the columns from each one on: of 1, 2, 4, ... columns."""
    steepest_down: list[Floats]
    """Greatest launch angle, likewise."""

    def launches(self, away: Floats, radius: Floats) -> tuple[Floats, Floats]:
        """Least and greatest launch angle to stretches of the boundary [rad]; infinite, the wrong way round, for none.

        Args:
            away: Distances of their middles [m], (n,).
            radius: How far they extend [m], (n,).
        """
        last = len(self.earliest) - 1
        # A column more on each side: rays between two columns are bounded by both.
        first = np.clip(np.floor((away - radius) / self.step) - 1, 0, last).astype(int)
        stop = np.clip(np.ceil((away + radius) / self.step) + 1, 0, last).astype(int)
        level = np.floor(np.log2(stop - first + 1)).astype(int)
        low, high = np.full(len(away), np.inf), np.full(len(away), -np.inf)
        for k in np.unique(level):
            rows = level == k
            one, other = first[rows], stop[rows] - 2**k + 1
            low[rows] = np.minimum(self.steepest_up[k][one], self.steepest_up[k][other])
            high[rows] = np.maximum(self.steepest_down[k][one], self.steepest_down[k][other])
        return low, high


def cones(sweeps: list[Sweep], offset: Floats, radius: Floats) -> Cones:
    """Bounds of the directions in which rays leave for neighbourhoods.

    Args:
        sweeps: The family's rays to the depths between which the neighbourhoods lie.
        offset: North and east of their middles from the sonar [m], (n, 2).
        radius: How far they extend [m], (n,).
    """
    away = np.hypot(offset[:, 0], offset[:, 1])
    spans = [one.launches(away, radius) for one in sweeps]
    low = np.min([span[0] for span in spans], axis=0)
    high = np.max([span[1] for span in spans], axis=0)
    there = low <= high
    low, high = np.where(there, low, 0.0), np.where(there, high, 0.0)
    middle = (low + high) / 2
    ahead = offset / np.maximum(away, 1e-300)[:, None]
    ahead[away == 0] = [1.0, 0.0]
    way = np.column_stack([np.cos(middle)[:, None] * ahead, np.sin(middle)])
    aside = np.where(radius < away, np.arcsin(np.minimum(1, radius / np.maximum(away, radius))), np.pi)
    level_part = np.cos(np.where(low * high <= 0, 0.0, np.minimum(np.abs(low), np.abs(high))))
    margin = np.minimum(np.hypot((high - low) / 2, aside * level_part), np.pi)
    return Cones(way, margin, there)


def sweep(water: Column, family: str, depth: float, boundary_depth: float, farthest: float) -> Sweep:
    """All rays of a family from the sonar to a row of distances on a boundary.

    Args:
        water: Sound speed between surface and bottom.
        family: Name of the family.
        depth: Depth of the sonar [m].
        boundary_depth: Depth of the boundary [m].
        farthest: Distance to which they are followed [m].
    """
    steps = min(MOST_STEPS, math.ceil(farthest / STEP)) + 2
    step = max(farthest / MOST_STEPS, STEP)
    ranges = step * np.arange(steps)
    rays, count, missing = np.zeros((steps, MOST, COLUMNS)), np.zeros(steps, np.int64), np.zeros(steps, np.uint8)
    string = bounces(family)
    solve_points(
        water.depth, water.speed, water.plane, depth, len(string), string.startswith("S"),
        np.full(steps, boundary_depth), ranges, rays, count, missing,
    )  # fmt: skip
    there = np.arange(MOST) < count[:, None]
    angle = np.arcsin(np.clip(rays[:, :, SIN_LAUNCH], -1, 1))
    return Sweep(
        step,
        np.where(there, rays[:, :, DELAY], np.inf).min(axis=1),
        np.where(there, rays[:, :, DELAY], -np.inf).max(axis=1),
        _doubled(np.where(there, angle, np.inf).min(axis=1), np.minimum),
        _doubled(np.where(there, angle, -np.inf).max(axis=1), np.maximum),
    )


def heard(sweeps: list[Sweep], delays: tuple[float, float], slack: float) -> tuple[float, float]:
    """Nearest and farthest distance at which the delays of some families meet a span of delays [m].

    Args:
        sweeps: One of each family and each end of the sonar.
        delays: Half of the earliest and of the latest two-way delay heard [s].
        slack: How much earlier or later the other end of the sonar may hear [s].

    Returns:
        Distances, a column of the sweep beyond the last that meets it; 0 and -1 where none does.
    """
    earliest = np.min([one.earliest for one in sweeps], axis=0)
    latest = np.max([one.latest for one in sweeps], axis=0)
    columns = np.flatnonzero((earliest <= delays[1] + slack) & (latest >= delays[0] - slack))
    if not columns.size:
        return 0.0, -1.0
    step = sweeps[0].step
    return step * max(int(columns[0]) - 1, 0), step * float(columns[-1] + 1)


def _doubled(column: Floats, least: np.ufunc) -> list[Floats]:
    """Extremes of 1, 2, 4, ... columns from each one on, so that any stretch is covered by two of them."""
    levels = [column]
    while 2 ** len(levels) <= len(column):
        half = 2 ** (len(levels) - 1)
        levels.append(np.asarray(least(levels[-1][:-half], levels[-1][half:])))
    return levels
