"""Eigenray tables: rays of one path family over range and depth, solved exactly at the nodes of a grid.

One table holds one family over range and depth, for sources in a span of depths: a plane of nodes for each of a few
source depths. Its cells are bounded by lines of constant depth, one through every knot of the profile, where the delay
has a kink. A cell is valid where its corners belong to the same smooth sheets of rays and its interior agrees with the
exact solver; where a shadow begins, a ray grazes a knot or rays cross, the exact solver is used instead.
"""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import COLUMNS, RaySolutions
from insonify.propagation._eigenray_table_build import (
    TablePlane,
    TableSpecification,
    build_plane,
    compare_and_exclude,
    interpolated_plane,
    state_between_planes,
    subdivide,
    table_grid,
)
from insonify.propagation._eigenray_table_kernel import EXACT
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.families import family_bounces
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]

MAX_DELAY_ERROR = 1e-9
"""Largest error of a delay in a valid cell [s]."""
MAX_AMPLITUDE_ERROR = 2.3e-3
"""Largest relative error of an amplitude or a path length in a valid cell: 0.02 dB [1]."""
HEIGHT_OVER_WIDTH = 0.4
"""Height of a cell over its width: delays curve more with depth than with range [1]."""
_WIDTHS = (0.25, 1.0)  # limits of the width of a cell [m], see `_width`
_ENOUGH, _MOST_NODES = 10_000, 60_000
MAX_SOURCE_SPACING, MAX_SOURCE_SPACING_ON_LINE = 0.35, 0.2
"""Largest spacing of the source depths of a table [m], and of a table of points at one depth [m]."""
_SAMPLE = 256  # positions that `check_sample` compares


class TableError(RuntimeError):
    """A table disagrees with the exact solver."""


class TableWarning(UserWarning):
    """A table failed its check, and the exact solver is used in its place."""


@dataclass(frozen=True, eq=False)
class EigenrayTable:
    """All rays of one family, for sources and points in spans of depth up to some range.

    Made by `eigenray_table`; immutable and thread-safe: planes of recent sources are only cached.
    """

    family: str
    specification: TableSpecification = field(repr=False)
    planes: tuple[TablePlane, ...] = field(repr=False)
    """Tables for single source depths, increasing."""
    cell_states: tuple[Bytes, ...] = field(repr=False)
    """Number of paths in each cell for sources between each two planes, or `EXACT`, shape (rows, cells) each."""
    _recent: dict[float, TablePlane] = field(default_factory=dict, repr=False, compare=False)

    def covers(self, source_depth: float) -> bool:
        """Return True if the table spans this source depth [m]."""
        return self.planes[0].source_depth - 1e-9 <= source_depth <= self.planes[-1].source_depth + 1e-9

    def plane_at(self, source_depth: float) -> TablePlane:
        """Table for one source depth: stored, or interpolated between the two planes around it.

        Args:
            source_depth: Depth of the source [m], in the span of the table.

        Raises:
            ValueError: The depth lies outside the table.
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
        recent = self._recent.get(source_depth)
        if recent is None:
            k = int(np.searchsorted(depths, source_depth)) - 1
            recent = interpolated_plane(self.planes[k], self.planes[k + 1], source_depth, self.cell_states[k])
            if len(self._recent) >= _KEPT:
                self._recent.clear()
            self._recent[source_depth] = recent
        return recent

    def rays(self, source_depth: float, point_depth: Floats, ranges: Floats) -> RaySolutions:
        """All rays of the family to points: from the table where it is valid, otherwise from the exact solver.

        Args:
            source_depth: Depth of the source [m]; outside the table's span the exact solver is used for all points.
            point_depth: Depths of the points [m], (n,).
            ranges: Their horizontal distances [m], (n,).

        Returns:
            Results of `solve_eigenrays`: rays of shape (n, most rays to one point, COLUMNS), by launch angle, of which
            the first `count` rows are filled; their count, (n,); `LegStatus` where there is none, (n,).
        """
        if not self.covers(source_depth):
            return self._exact(source_depth, point_depth, ranges)
        plane = self.plane_at(source_depth)
        rays, points = plane.read(point_depth, ranges)
        cell, paths = points.cell, points.paths
        count = paths.astype(np.int64)
        status, missing = np.zeros(len(paths), np.uint8), np.flatnonzero(paths == 0)
        status[missing] = plane.missing_status[cell[0, missing], cell[1, missing]]
        outside = np.flatnonzero(paths == EXACT)
        if outside.size:
            order = outside[np.lexsort((ranges[outside], point_depth[outside]))]
            solved, count[order], status[order] = self._exact(source_depth, point_depth[order], ranges[order])
            max_count = max(1, int(count[order].max()))
            if max_count > rays.shape[1]:
                wider = np.zeros((rays.shape[0], max_count, COLUMNS))
                wider[:, : rays.shape[1]] = rays
                rays = wider
            rays[order, :max_count] = solved[:, :max_count]
        return RaySolutions(rays, count, status)

    def _exact(self, source_depth: float, point_depth: Floats, ranges: Floats) -> RaySolutions:
        """Rays of the exact solver."""
        return exact_solutions(self.specification.layers, self.family, source_depth, point_depth, ranges)


_KEPT = 8  # interpolated planes of recent source depths


def eigenray_table(
    water: SoundSpeedLayers, family: str, *, source_depths: tuple[float, float], point_depths: tuple[float, float],
    max_range: float,
) -> EigenrayTable:  # fmt: skip
    """Table of one path family, checked against the exact solver.

    Args:
        water: Sound speed from surface to seabed.
        family: Name of the family.
        source_depths: Least and greatest source depth [m]; equal ones make one plane.
        point_depths: Least and greatest point depth [m]; equal ones make a table of one line, the fastest.
        max_range: Greatest horizontal distance of a point [m].

    Returns:
        The table: delays within 1e-9 s, amplitudes and lengths within 0.02 dB wherever it is valid.

    Raises:
        TableError: At one of 256 random positions in the table the error is larger.
        ValueError: A span is reversed or leaves the water, or the range is not positive.
    """
    _require_valid_spans(water, source_depths, point_depths, max_range)
    width = _width(point_depths[1] - point_depths[0], max_range)
    grid = table_grid(water, point_depths, max_range, width, HEIGHT_OVER_WIDTH * width)
    specification = TableSpecification(water, family_bounces(family), grid)
    spacing = MAX_SOURCE_SPACING_ON_LINE if grid.node_depths.size == 1 else MAX_SOURCE_SPACING
    depths = subdivide(source_depths, water.depth, spacing)
    planes = tuple(build_plane(specification, float(depth)) for depth in depths)
    states = tuple(state_between_planes(above, below) for above, below in pairwise(planes))
    table = EigenrayTable(family, specification, planes, states)
    check_sample(table)
    return table


def _width(span: float, max_range: float) -> float:
    """Width of a cell [m] for points over a span of depths [m] up to some range [m].

    As fine as `_ENOUGH` nodes allow, 0.25 m to 1 m; wider only where `_MOST_NODES` would be exceeded.
    """

    def width_for(nodes: int) -> float:
        # (max_range / width) * (span / (HEIGHT_OVER_WIDTH * width) + 1) = nodes
        return (max_range + np.sqrt(max_range**2 + 4 * nodes * max_range * span / HEIGHT_OVER_WIDTH)) / (2 * nodes)

    return float(max(np.clip(width_for(_ENOUGH), *_WIDTHS), width_for(_MOST_NODES)))


def check_sample(table: EigenrayTable) -> None:
    """Compare 256 positions, from up to four source depths, with the exact solver; cells that fail are left to it.

    The positions are the same at every call.

    Raises:
        TableError: One of them is wrong; the message gives the worst.
    """
    random, grid = np.random.default_rng(0), table.specification.grid
    low, high = table.planes[0].source_depth, table.planes[-1].source_depth
    sources = [low] if len(table.planes) == 1 else list(random.uniform(low, high, 4))
    for source_depth in sources:
        n = _SAMPLE // len(sources)
        depth = np.sort(random.uniform(grid.node_depths[0], grid.node_depths[-1], n))
        ranges = random.uniform(0, grid.node_ranges[-1], n)
        delay_error, amplitude_error = compare_and_exclude(table.plane_at(source_depth), depth, ranges)
        worst = int(np.argmax(np.maximum(delay_error / MAX_DELAY_ERROR, amplitude_error / MAX_AMPLITUDE_ERROR)))
        if delay_error[worst] > MAX_DELAY_ERROR or amplitude_error[worst] > MAX_AMPLITUDE_ERROR:
            location = f"from {source_depth:.3f} m to {depth[worst]:.3f} m at {ranges[worst]:.3f} m"
            error = f"{delay_error[worst]:.1e} s and {20 * np.log10(1 + amplitude_error[worst]):.3f} dB"
            raise TableError(
                f"the table of {table.family} {location} is wrong by {error}; {MAX_DELAY_ERROR:g} s and 0.02 dB are "
                "allowed. Use method='exact', or a profile with rounder kinks."
            )


def _require_valid_spans(
    water: SoundSpeedLayers, source_depths: tuple[float, float], point_depths: tuple[float, float], max_range: float
) -> None:
    for name, (low, high) in (("source_depths", source_depths), ("point_depths", point_depths)):
        if not 0 <= low <= high <= water.water_depth:
            raise ValueError(
                f"{name} is {low:g} to {high:g} m; give the least and the greatest depth, between the surface and the "
                f"seabed at {water.water_depth:g} m."
            )
    if not (np.isfinite(max_range) and max_range > 0):
        raise ValueError(f"max_range is {max_range:g} m; give the greatest range of a point, such as 200.")
