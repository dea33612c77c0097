"""Tables of delays: what a survey asks millions of times, solved exactly once at the nodes of a grid.

One table holds one family of paths over range and depth, for sources in a span of depths. Its cells are bounded by
lines of depth, among them every knot of the profile, for there the delay bends. A cell is used where its corners belong
to the same smooth sheets of rays and its inside agrees with the exact solver; wherever a shadow begins, a ray grazes
a knot or rays cross, the exact solver answers instead. So nothing is lost, and nothing is guessed.
"""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import COLUMNS, MOST, solve_points
from insonify.propagation._table_build import (
    Plane,
    Task,
    between,
    build_plane,
    compare,
    cut,
    grid,
    state_between,
)
from insonify.propagation._table_kernel import EXACT
from insonify.propagation.families import bounces
from insonify.propagation.layers import Column

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

LATEST = 1e-9
"""Error of a delay that no cell in use may exceed [s]."""
LOUDEST = 2.3e-3
"""Relative error of an amplitude or a path length that none may exceed: 0.02 dB [1]."""
FLATNESS = 0.4
"""Height of a cell over its width: delays bend more with depth than with range [1]."""
_WIDTHS = (0.25, 1.0)  # of a cell [m]: as fine as _ENOUGH nodes allow; wider only where _MOST_NODES would not do
_ENOUGH, _MOST_NODES = 10_000, 60_000
APART, APART_ON_A_LINE = 0.35, 0.2
"""Distance between depths of the source that are solved for, at most [m]; lines are quickly made."""
_SAMPLE = 256


class TableError(RuntimeError):
    """A table does not agree with the exact solver."""


class TableWarning(UserWarning):
    """A table failed its test, and the exact solver answers in its place."""


@dataclass(frozen=True, eq=False)
class LegTable:
    """All rays of one family, for sources and points in spans of depth and up to some range.

    Made by `leg_table`; frozen, and the same from any thread: what it keeps of recent sources is only a memory.
    """

    family: str
    task: Task = field(repr=False)
    planes: tuple[Plane, ...] = field(repr=False)
    """Tables for single depths of the source, increasing."""
    states: tuple[Bytes, ...] = field(repr=False)
    """Cells that may be used between each two planes."""
    _recent: dict[float, Plane] = field(default_factory=dict, repr=False, compare=False)

    def covers(self, source_depth: float) -> bool:
        """Whether the table was made for a source at this depth [m]."""
        return self.planes[0].source_depth - 1e-9 <= source_depth <= self.planes[-1].source_depth + 1e-9

    @property
    def exact_share(self) -> float:
        """Share of the cells that the exact solver answers for [1]."""
        return float(np.mean([plane.state == EXACT for plane in self.planes]))

    def at(self, source_depth: float) -> Plane:
        """The table for one depth of the source: read off, or blended from the two planes around it.

        Args:
            source_depth: Depth of the source [m], in the span of the table.

        Raises:
            ValueError: The table was not made for that depth.
        """
        if not self.covers(source_depth):
            low, high = self.planes[0].source_depth, self.planes[-1].source_depth
            raise ValueError(
                f"the table of {self.family} is for sources at {low:g} to {high:g} m; {source_depth:g} m is outside. "
                "Make it with source_depths that span the whole track."
            )
        depths = np.array([plane.source_depth for plane in self.planes])
        nearest = int(np.argmin(np.abs(depths - source_depth)))
        if abs(depths[nearest] - source_depth) < 1e-9:
            return self.planes[nearest]
        made = self._recent.get(source_depth)
        if made is None:
            k = int(np.searchsorted(depths, source_depth)) - 1
            made = between(self.planes[k], self.planes[k + 1], source_depth, self.states[k])
            if len(self._recent) >= _KEPT:
                self._recent.clear()
            self._recent[source_depth] = made
        return made

    def rays(self, source_depth: float, point_depth: Floats, ranges: Floats) -> tuple[Floats, NDArray[np.int64], Bytes]:
        """All rays of the family to points: read from the table, or solved for where it does not hold.

        Args:
            source_depth: Depth of the source [m]; the exact solver answers for all points where the table does not
                cover it.
            point_depth: Depths of the points [m], (n,).
            ranges: Their horizontal distances [m], (n,).

        Returns:
            What `solve_points` fills: rays of shape (n, most rays to one point, COLUMNS), by launch angle, of which the
            first `count` rows are filled; their count, (n,); why there is none, (n,).
        """
        if not self.covers(source_depth):
            rays, count, status = _exact(self.task, source_depth, point_depth, ranges)
            return rays, count, status
        plane = self.at(source_depth)
        rays, cell, paths = plane.read(point_depth, ranges)
        count = paths.astype(np.int64)
        status = np.where(paths == 0, plane.why[cell[0], cell[1]], np.uint8(0))
        left = np.flatnonzero(paths == EXACT)
        if left.size:
            order = left[np.lexsort((ranges[left], point_depth[left]))]
            solved, count[order], status[order] = _exact(self.task, source_depth, point_depth[order], ranges[order])
            most = max(1, int(count[order].max()))
            if most > rays.shape[1]:
                wider = np.zeros((rays.shape[0], most, COLUMNS))
                wider[:, : rays.shape[1]] = rays
                rays = wider
            rays[order, :most] = solved[:, :most]
        return rays, count, status


_KEPT = 8


def leg_table(
    water: Column, family: str, *, source_depths: tuple[float, float], point_depths: tuple[float, float],
    farthest: float,
) -> LegTable:  # fmt: skip
    """A table of one family of paths, tried against the exact solver.

    Args:
        water: Sound speed from surface to seabed.
        family: Name of the family.
        source_depths: Least and greatest depth of the source [m]; equal ones make one plane.
        point_depths: Least and greatest depth of the points [m]; equal ones make a table of one line, the fastest.
        farthest: Greatest horizontal distance of a point [m].

    Returns:
        The table: delays within 1e-9 s, amplitudes and lengths within 0.02 dB wherever it holds.

    Raises:
        TableError: At one of 256 places drawn over the whole table it is worse than that.
        ValueError: A span is upside down or leaves the water, or the range is not positive.
    """
    _check(water, source_depths, point_depths, farthest)
    letters = bounces(family)
    width = _width(point_depths[1] - point_depths[0], farthest)
    where = grid(water, point_depths, farthest, width, FLATNESS * width)
    task = Task(water, len(letters), letters.startswith("S"), where)
    apart = APART_ON_A_LINE if where.lines.size == 1 else APART
    planes = tuple(build_plane(task, float(depth)) for depth in cut(source_depths, water.depth, apart))
    states = tuple(state_between(above, below) for above, below in pairwise(planes))
    table = LegTable(family, task, planes, states)
    try_sample(table)
    return table


def _width(span: float, farthest: float) -> float:
    """Width of a cell [m] for points over a span of depths [m] and up to some range [m]."""

    def filling(nodes: int) -> float:
        # (farthest / width) * (span / (FLATNESS * width) + 1) = nodes
        return (farthest + np.sqrt(farthest**2 + 4 * nodes * farthest * span / FLATNESS)) / (2 * nodes)

    return float(max(np.clip(filling(_ENOUGH), *_WIDTHS), filling(_MOST_NODES)))


def try_sample(table: LegTable) -> None:
    """Compares places drawn over the whole table with the exact solver.

    Raises:
        TableError: One of them is wrong; names the worst.
    """
    draw, where = np.random.default_rng(0), table.task.where
    low, high = table.planes[0].source_depth, table.planes[-1].source_depth
    sources = [low] if len(table.planes) == 1 else list(draw.uniform(low, high, 4))
    for source_depth in sources:
        n = _SAMPLE // len(sources)
        depth = np.sort(draw.uniform(where.lines[0], where.lines[-1], n))
        ranges = draw.uniform(0, where.stations[-1], n)
        late, loud = compare(table.at(source_depth), depth, ranges)
        worst = int(np.argmax(np.maximum(late / LATEST, loud / LOUDEST)))
        if late[worst] > LATEST or loud[worst] > LOUDEST:
            place = f"from {source_depth:.3f} m to {depth[worst]:.3f} m at {ranges[worst]:.3f} m"
            error = f"{late[worst]:.1e} s and {20 * np.log10(1 + loud[worst]):.3f} dB"
            raise TableError(
                f"the table of {table.family} {place} is wrong by {error}; {LATEST:g} s and 0.02 dB are allowed. "
                "Use method='exact', or a profile with rounder kinks."
            )


def _exact(task: Task, source_depth: float, depth: Floats, ranges: Floats) -> tuple[Floats, NDArray[np.int64], Bytes]:
    """Rays of the exact solver."""
    water, rays = task.water, np.zeros((ranges.size, MOST, COLUMNS))
    count, status = np.zeros(ranges.size, np.int64), np.zeros(ranges.size, np.uint8)
    solve_points(
        water.depth,
        water.speed,
        water.plane,
        source_depth,
        task.bounces,
        task.first_up,
        depth,
        ranges,
        rays,
        count,
        status,
    )
    return rays, count, status


def _check(
    water: Column, source_depths: tuple[float, float], point_depths: tuple[float, float], farthest: float
) -> None:
    for name, (low, high) in (("source_depths", source_depths), ("point_depths", point_depths)):
        if not 0 <= low <= high <= water.water_depth:
            raise ValueError(
                f"{name} is {low:g} to {high:g} m; give the least and the greatest depth, between the surface and the "
                f"seabed at {water.water_depth:g} m."
            )
    if not (np.isfinite(farthest) and farthest > 0):
        raise ValueError(f"farthest is {farthest:g} m; give the greatest range of a point, such as 200.")
