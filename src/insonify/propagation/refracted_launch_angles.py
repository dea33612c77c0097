"""Launch angles of refracted rays over relief, for the occlusion by terrain.

Exact rays to a grid of positions between the highest and the deepest, once for each depth of the sonar; between its
nodes the distance times the launch slope is interpolated linearly. That product is a length, nearly the vertical
travel of a straight ray: it changes by metres over kilometres, and its error equals an error of the terrain's height.
"""

from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import CAUSTICS, MAX_RAYS, SIN_LAUNCH, SLOWNESS, TURNS
from insonify.propagation._launch_angle_kernel import interpolate_launch_slope, unturned_distances
from insonify.propagation._refracted_box_shadow import ray_depths_along_range
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.families import bounce_sequence, family_bounces
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.floating[Any]]

WIDTH = 0.25
"""Spacing of the grid's depths [m]."""
HEIGHTS, FEW_LINES = (0.25, 1.0), 8
"""Least and greatest spacing of its distances [m], and the number at which it grows."""
MOST_STATIONS = 4000
AT_ZERO = 1e-3
"""Distance of the rays to the first column: a vertical one has no launch slope [m]."""
STRAY = 0.02
"""Largest height by which a ray may differ from that of the grid, at its end [m]."""


class RefractedLaunchAngles:
    """Rays from one depth of the sonar in layered water; see `insonify.propagation.launch_angles.LaunchAngles`."""

    def __init__(
        self, column: SoundSpeedLayers, source_depth: float, max_range: float, depth_limits: tuple[float, float]
    ) -> None:
        """Prepare the grids, which are solved on first use.

        Args:
            column: The water, down to the deepest terrain.
            source_depth: Depth of the sonar [m].
            max_range: Largest horizontal distance [m].
            depth_limits: Depth of the highest position, and of the deepest terrain [m].
        """
        self._column, self._source, self._depth_limits = column, source_depth, depth_limits
        self._speed = float(np.interp(source_depth, column.depth, column.speed))
        bed_speed = float(np.interp(column.bottom_reflection_depth, column.depth, column.speed))
        self._bed_speed_ratio = bed_speed / self._speed
        stations = min(int(np.ceil(max_range / WIDTH)) + 2, MOST_STATIONS)
        self._width = max(WIDTH, max_range / (stations - 2))
        self._stations = self._width * np.arange(stations)
        self._made: dict[str, tuple[float, float, NDArray[np.float64]]] = {}
        self._lock = Lock()

    def __getstate__(self) -> dict[str, Any]:
        """State without the lock, which each process has of its own."""
        return {name: value for name, value in self.__dict__.items() if name != "_lock"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the state."""
        self.__dict__.update(state, _lock=Lock())

    def launch_slope(self, family: str, distance: Floats, depth: Floats) -> Floats:
        """Launch slope interpolated on the grid, see `LaunchAngles`."""
        top, height, climb = self._grid(family)
        shape = np.broadcast_shapes(np.shape(distance), np.shape(depth))
        ranges = np.ascontiguousarray(np.broadcast_to(distance, shape[-1:]), float)
        depth_limits = np.ascontiguousarray(np.broadcast_to(depth, shape), float).reshape(-1, shape[-1])
        slope = np.empty(depth_limits.shape)
        interpolate_launch_slope(climb, top, height, self._width, ranges, depth_limits, slope)
        return slope.reshape(shape)

    def bounce_ranges(self, family: str, launch_slope: Floats) -> list[Floats]:
        """Distances by sums over the layers, see `LaunchAngles`."""
        string = bounce_sequence(family)
        if not string:
            return []
        up, down = self._spans(np.asarray(launch_slope, float))
        ranges: list[Floats] = [down if string.startswith("B") else up]
        while len(ranges) < len(string):
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

    def off_table_rays(
        self, family: str, launch_slope: Floats, distance: Floats, depth: Floats
    ) -> NDArray[np.bool_] | None:
        """Mask of rays that differ from those of the grid, see `LaunchAngles`."""
        return ~(np.abs(launch_slope - self.launch_slope(family, distance, depth)) * distance <= STRAY)  # so is NaN

    def ray_depths(self, family: str, launch_slope: Floats, step: float, count: int) -> Floats:
        """Depths traced from layer to layer, see `LaunchAngles`."""
        bounces = family_bounces(family)
        steep = np.asarray(launch_slope, float)
        slant = np.sqrt(1 + steep**2)
        sines = (-steep if bounces.first_up else steep) / slant
        ray_depths, ends = np.empty((len(steep), count)), np.full(len(steep), count * step)
        ray_depths_along_range(
            self._column, self._source, 1 / (slant * self._speed), sines, bounces, np.full(len(steep), step), ends,
            ray_depths,
        )  # fmt: skip
        return ray_depths

    def _spans(self, launch_slope: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Horizontal distance of rays from the sonar up to the surface, and down to the mean plane [m]."""
        water = self._column
        knots = np.unique(np.concatenate([water.depth[water.depth <= water.bottom_reflection_depth], [self._source]]))
        ratio = np.interp(knots, water.depth, water.speed) / self._speed
        up, down = np.empty(launch_slope.shape), np.empty(launch_slope.shape)
        source_row = int(np.searchsorted(knots, self._source))
        unturned_distances(knots, ratio, source_row, launch_slope.ravel(), up.reshape(-1), down.reshape(-1))
        return up, down

    def _grid(self, family: str) -> tuple[float, float, NDArray[np.float64]]:
        """First depth and distance of a family's grid [m], and its node values."""
        with self._lock:
            if family not in self._made:
                self._made[family] = self._solve(family)
            return self._made[family]

    def _solve(self, family: str) -> tuple[float, float, NDArray[np.float64]]:
        string, water = bounce_sequence(family), self._column
        low, high = self._depth_limits
        if string.endswith("B"):  # rays that rise from the plane meet nothing below it
            high = min(high, water.bottom_reflection_depth)
        low = min(low, high - HEIGHTS[0])
        height = np.clip((high - low) / FEW_LINES, *HEIGHTS)
        lines = np.linspace(low, high, int(np.ceil((high - low) / height)) + 1)
        depth, ranges = np.repeat(lines, len(self._stations)), np.tile(np.maximum(self._stations, AT_ZERO), len(lines))
        rays, count, _ = exact_solutions(water, family, self._source, np.maximum(depth, 0.0), ranges)
        turns = np.where(rays[:, :, CAUSTICS] == 0, rays[:, :, TURNS], np.inf)
        turns[np.arange(MAX_RAYS) >= count[:, None]] = np.inf
        if string:
            turns[turns > 0] = np.inf  # rays that turn about a bounce have another order
        row, first = np.arange(ranges.size), np.argmin(turns, axis=1)
        ray = rays[row, first]
        exists = np.isfinite(turns[row, first])
        cosine = np.where(exists, ray[:, SLOWNESS] * self._speed, 1.0)
        tangent = np.where(exists, ray[:, SIN_LAUNCH] / cosine, np.nan)
        climb = tangent * ranges * (-1 if string.startswith("S") else 1)
        return low, float(lines[1] - lines[0]), climb.reshape(len(lines), -1)
