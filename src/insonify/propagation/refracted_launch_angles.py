"""Launch angles of refracted rays over relief, for the occlusion by terrain.

Exact rays to a grid of positions between the highest and the deepest, once for each depth of the sonar; between its
nodes the distance times the launch slope (the climb) is interpolated linearly. It is a length, nearly the vertical
travel of a straight ray: it changes by metres over kilometres, and its error equals an error of the terrain's height.
"""

from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import CAUSTICS, MAX_RAYS, SIN_LAUNCH, SLOWNESS, TURNS
from insonify.propagation._launch_angle_kernel import interpolate_launch_slope, unturned_distances
from insonify.propagation._refracted_box_shadow import ray_depths_along_range
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.families import bounce_sequence, family_bounces, first_boundary, last_boundary
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.floating[Any]]

DISTANCE_SPACING = 0.25
"""Spacing of the grid's distances [m]; larger where there would be more than `MAX_DISTANCES`."""
DEPTH_SPACINGS, DEPTH_INTERVALS = (0.25, 1.0), 8
"""Least and greatest spacing of its depths [m], and the number of intervals between these limits."""
MAX_DISTANCES = 4000
AT_ZERO = 1e-3
"""Distance at which rays to distance 0 are evaluated: a vertical ray has no launch slope [m]."""
FALL_MARGIN = 1e-3
"""Fraction of the largest fall of the seabed by which it is reduced for rounding [1]."""
OFF_TABLE_HEIGHT = 0.02
"""Largest difference in height between a ray and that of the grid, at its end, for which they are the same [m]."""


class RefractedLaunchAngles:
    """Rays from one depth of the sonar in layered water; see `insonify.propagation.launch_angles.LaunchAngles`."""

    def __init__(
        self, column: SoundSpeedLayers, source_depth: float, max_range: float, depth_limits: tuple[float, float],
        neighbours: "tuple[RefractedLaunchAngles, RefractedLaunchAngles] | None" = None,
    ) -> None:  # fmt: skip
        """Prepare the grids, which are solved on first use, or interpolated between those of neighbouring depths.

        Args:
            column: The water, down to the deepest terrain.
            source_depth: Depth of the sonar [m].
            max_range: Largest horizontal distance [m].
            depth_limits: Depth of the highest position, and of the deepest terrain [m].
            neighbours: Rays from a depth above and from one below, with the same limits; None: the grids are solved.
        """
        self._neighbours = neighbours
        self._column, self._source, self._depth_limits = column, source_depth, depth_limits
        self._speed = float(np.interp(source_depth, column.depth, column.speed))
        bed_speed = float(np.interp(column.bottom_reflection_depth, column.depth, column.speed))
        self._bed_speed_ratio = bed_speed / self._speed
        knots = np.unique(np.append(column.depth[column.depth <= column.bottom_reflection_depth], source_depth))
        speed_ratio = np.interp(knots, column.depth, column.speed) / self._speed
        self._layer_ends = knots, speed_ratio, int(np.searchsorted(knots, source_depth))
        count = min(int(np.ceil(max_range / DISTANCE_SPACING)) + 2, MAX_DISTANCES)
        self._distance_spacing = max(DISTANCE_SPACING, max_range / (count - 2))
        self._distances = self._distance_spacing * np.arange(count)
        self._grids: dict[str, _ClimbGrid] = {}
        self._falls: dict[tuple[str, float], NDArray[np.float32]] = {}
        self._lock = Lock()

    def __getstate__(self) -> dict[str, Any]:
        """State without the lock, which each process has of its own."""
        return {name: value for name, value in self.__dict__.items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the state."""
        self.__dict__.update(state, _lock=Lock())

    def launch_slope(self, family: str, distance: Floats, depth: Floats) -> Floats:
        """Launch slope interpolated on the grid, see `LaunchAngles`; single precision for depths in it."""
        grid = self._grid(family)
        shape = np.broadcast_shapes(np.shape(distance), np.shape(depth))
        ranges = np.ascontiguousarray(np.broadcast_to(distance, shape[-1:]), float)
        precision = np.float32 if getattr(depth, "dtype", None) == np.float32 else np.float64
        depths = np.ascontiguousarray(np.broadcast_to(depth, shape), precision).reshape(-1, shape[-1])
        slope = np.empty_like(depths)
        interpolate_launch_slope(
            grid.climb, grid.first_depth, grid.depth_spacing, self._distance_spacing, ranges, depths, slope
        )
        return slope.reshape(shape)

    def bounce_ranges(self, family: str, launch_slope: Floats) -> list[Floats]:
        """Distances by sums over the layers, see `LaunchAngles`."""
        sequence = bounce_sequence(family)
        if not sequence:
            return []
        up, down = self._spans(np.asarray(launch_slope, float))
        ranges: list[Floats] = [down if first_boundary(sequence) == "bottom" else up]
        while len(ranges) < len(sequence):
            ranges.append(ranges[-1] + up + down)
        return ranges

    def bottom_grazing_tangent(self, launch_slope: Floats) -> Floats:
        """Tangent by Snell's law, see `LaunchAngles`."""
        square = (1 + np.asarray(launch_slope, float) ** 2) / self._bed_speed_ratio**2
        return np.sqrt(np.maximum(square - 1, 0.0))

    def launch_slope_to_bottom(self, grazing_tangent: Floats) -> Floats:
        """Inverse of `bottom_grazing_tangent`, see `LaunchAngles`."""
        square = (1 + np.asarray(grazing_tangent, float) ** 2) * self._bed_speed_ratio**2
        return np.sqrt(np.maximum(square - 1, 0.0))

    def largest_unobstructed_fall(self, family: str, step: float, count: int) -> NDArray[np.float32] | None:
        """Largest fall from the derivatives of the grid, see `LaunchAngles`.

        Within a cell the product c of launch slope and distance x is a + b x at constant depth z. From x to x + h the
        slope c / x falls by a h / (x (x + h)), and a fall of the seabed by dz raises it by (dc/dz) dz / (x + h).
        """
        if last_boundary(family) == "bottom" or not self._grid(family).is_single:
            return None
        with self._lock:
            known = self._falls.get((family, step))
            if known is None or len(known) < count - 1:
                known = self._falls[family, step] = self._largest_falls(self._grids[family], step, count)
        return known[: count - 1]

    def _largest_falls(self, grid: "_ClimbGrid", step: float, count: int) -> NDArray[np.float32]:
        """Largest fall after each sample of a line [m], the least of those of all cells up to the next sample."""
        climb, nearer, farther = grid.climb, self._distances[:-1], self._distances[1:]
        intercept = ((climb[:, :-1] * farther - climb[:, 1:] * nearer) / self._distance_spacing).min(
            axis=0
        )  # a, at any depth
        depth_derivative = np.diff(climb, axis=0) / grid.depth_spacing
        largest_derivative = np.maximum(depth_derivative[:, :-1], depth_derivative[:, 1:]).max(axis=0)
        is_falling = (intercept > 0) & (depth_derivative.min() > 0)
        steepest = np.where(is_falling, intercept / (farther * largest_derivative), -np.inf)
        steepest = np.append(steepest, -np.inf)  # beyond the grid
        cell = np.minimum(step * np.arange(1, count + 1) / self._distance_spacing, len(steepest) - 1).astype(int)
        cells_crossed = int((cell[1:] - cell[:-1]).max(initial=0))
        least = np.min([steepest[np.minimum(cell[:-1] + k, cell[1:])] for k in range(cells_crossed + 1)], axis=0)
        return np.asarray((1 - FALL_MARGIN) * step * least, np.float32)

    def has_single_rays(self, family: str, distance: Floats, depth: Floats) -> bool:
        """Return True if the grid has one ray everywhere and the positions lie in it, see `LaunchAngles`."""
        grid = self._grid(family)
        if not (grid.is_single and len(distance)):
            return grid.is_single
        rows, columns = grid.climb.shape[0] - 1, grid.climb.shape[1] - 1
        return bool(
            distance.min() > 0 and distance.max() <= columns * self._distance_spacing
            and depth.min() >= grid.first_depth and depth.max() <= grid.first_depth + rows * grid.depth_spacing
        )  # fmt: skip

    def off_table_rays(self, family: str, launch_slope: Floats, distance: Floats, depth: Floats) -> NDArray[np.bool_]:
        """Mask of rays that differ from those of the grid, see `LaunchAngles`."""
        difference = np.abs(launch_slope - self.launch_slope(family, distance, depth)) * distance
        return ~(difference <= OFF_TABLE_HEIGHT)  # also True for NaN

    def ray_depths(self, family: str, launch_slope: Floats, step: float, count: int) -> Floats:
        """Depths traced from layer to layer, see `LaunchAngles`."""
        bounces = family_bounces(family)
        slope = np.asarray(launch_slope, float)
        secant = np.sqrt(1 + slope**2)
        sines = (-slope if bounces.first_up else slope) / secant
        ray_depths, ends = np.empty((len(slope), count)), np.full(len(slope), count * step)
        ray_depths_along_range(
            self._column, self._source, 1 / (secant * self._speed), sines, bounces, np.full(len(slope), step), ends,
            ray_depths,
        )  # fmt: skip
        return ray_depths

    def _spans(self, launch_slope: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Horizontal distance of rays from the sonar up to the surface, and down to the seabed's mean plane [m]."""
        up, down = np.empty(launch_slope.shape), np.empty(launch_slope.shape)
        unturned_distances(*self._layer_ends, launch_slope.ravel(), up.reshape(-1), down.reshape(-1))
        return up, down

    def _grid(self, family: str) -> "_ClimbGrid":
        """Grid of a family, solved on first use."""
        with self._lock:
            if family not in self._grids:
                self._grids[family] = self._solve(family)
            return self._grids[family]

    def _solve(self, family: str) -> "_ClimbGrid":
        if self._neighbours is not None:
            (above, upper), (below, lower) = ((near._grid(family), near._source) for near in self._neighbours)
            fraction = (self._source - upper) / (lower - upper)
            climb = above.climb + fraction * (below.climb - above.climb)
            return above._replace(climb=climb, is_single=above.is_single and below.is_single)
        sequence, water = bounce_sequence(family), self._column
        low, high = self._depth_limits
        if last_boundary(sequence) == "bottom":  # rays that rise from the plane reach nothing below it
            high = min(high, water.bottom_reflection_depth)
        low = min(low, high - DEPTH_SPACINGS[0])
        spacing = np.clip((high - low) / DEPTH_INTERVALS, *DEPTH_SPACINGS)
        depths = np.linspace(low, high, int(np.ceil((high - low) / spacing)) + 1)
        depth = np.repeat(depths, len(self._distances))
        ranges = np.tile(np.maximum(self._distances, AT_ZERO), len(depths))
        rays, count, _ = exact_solutions(water, family, self._source, np.maximum(depth, 0.0), ranges)
        turns = np.where(rays[:, :, CAUSTICS] == 0, rays[:, :, TURNS], np.inf)
        turns[np.arange(MAX_RAYS) >= count[:, None]] = np.inf
        if sequence:
            turns[turns > 0] = np.inf  # rays that turn before or after a bounce have another order
        row, fewest_turns = np.arange(ranges.size), np.argmin(turns, axis=1)
        ray = rays[row, fewest_turns]
        exists = np.isfinite(turns[row, fewest_turns])
        cosine = np.where(exists, ray[:, SLOWNESS] * self._speed, 1.0)
        tangent = np.where(exists, ray[:, SIN_LAUNCH] / cosine, np.nan)
        climb = (tangent * ranges * (-1 if first_boundary(sequence) == "surface" else 1)).reshape(len(depths), -1)
        is_single = bool((count == 1).all() and exists.all()) and _largest_bilinear_error(climb) <= OFF_TABLE_HEIGHT / 2
        return _ClimbGrid(low, float(depths[1] - depths[0]), climb, is_single)


class _ClimbGrid(NamedTuple):
    """Launch angles of one family on a grid of positions."""

    first_depth: float
    """First depth [m]."""
    depth_spacing: float
    """Spacing of the depths [m]."""
    climb: NDArray[np.float64]
    """Distance times launch slope of the ray with the fewest turns [m], NaN without a ray, (depths, distances)."""
    is_single: bool
    """True if one ray reaches every node and interpolation errs by `OFF_TABLE_HEIGHT` / 2 at most."""


def _largest_bilinear_error(values: NDArray[np.float64]) -> float:
    """Largest error of bilinear interpolation between nodes: an eighth of the second differences of both axes."""
    second = [np.abs(np.diff(values, 2, axis=axis)).max(initial=0.0) for axis in range(2)]
    return float(sum(second)) / 8
