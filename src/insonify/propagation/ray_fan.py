"""Ray fan: rays that leave the source at given angles, traced to a range.

Rays follow exact arcs between the knots of the water column, turn, are reflected specularly at surface and bottom, and
end at a range or after a number of bounces. For plots, and for quantities along a ray; the paths to a given point come
from `eigenrays`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.propagation._ray_trace_kernel import RayVertices, trace_rays
from insonify.propagation.families import DIRECT
from insonify.propagation.sound_speed_layers import SoundSpeedLayers
from insonify.validity import require_number, require_numbers

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MAX_BOUNCES = 1000
"""Largest number of bounces that a call may request [1]."""


@dataclass(frozen=True, slots=True, eq=False)
class RayFan:
    """Rays of one source as polylines, one after the other; every vertex lies exactly on its arc."""

    launch_elevation: Floats
    """Launch elevation, + down [rad], shape (rays,)."""
    first_vertex: Integers
    """Row of the first vertex of each ray, and at the end the number of all vertices, shape (rays + 1,)."""
    range: Floats
    """Horizontal distance from the source [m], shape (vertices,)."""
    depth: Floats
    """Depth [m], shape (vertices,)."""
    time: Floats
    """Travel time from the source [s], shape (vertices,)."""
    sine: Floats
    """Sine of the elevation, + down; at a bounce that of the reflected ray [1], shape (vertices,)."""
    bounces: Integers
    """Bounces up to and at each vertex, shape (vertices,)."""
    turns: Integers
    """Turning points up to and at each vertex, shape (vertices,)."""
    boundaries: tuple[str, ...]
    """Boundaries that reflected each ray, in order: S surface, B bottom."""

    def __len__(self) -> int:
        """Number of rays."""
        return int(self.launch_elevation.size)

    def rows(self, ray: int) -> slice:
        """Rows of the vertices of one ray."""
        return slice(int(self.first_vertex[ray]), int(self.first_vertex[ray + 1]))

    def segments(self) -> Iterator[tuple[str, Floats, Floats]]:
        """Segments of all rays between their bounces: family up to there, ranges and depths of the vertices [m]."""
        for ray, sequence in enumerate(self.boundaries):
            rows = self.rows(ray)
            bounces, x, z = self.bounces[rows], self.range[rows], self.depth[rows]
            ends = [0, *(np.flatnonzero(np.diff(bounces)) + 1), x.size - 1]
            for start, stop in pairwise(ends):
                if stop > start:
                    yield sequence[: bounces[start]] or DIRECT, x[start : stop + 1], z[start : stop + 1]

    def __repr__(self) -> str:
        """Number of rays, their angles and range."""
        if not len(self):
            return "Fan: no rays"
        low, high = np.degrees(self.launch_elevation.min()), np.degrees(self.launch_elevation.max())
        kinds = sorted(set(self.boundaries), key=lambda name: (len(name), name[::-1]))
        paths = ", ".join(name or DIRECT for name in kinds[:8]) + (", ..." if len(kinds) > 8 else "")
        return f"Fan: {len(self)} rays from {low:.1f} to {high:.1f} deg, to {self.range.max():.1f} m; paths {paths}"


def trace_fan(
    column: SoundSpeedLayers, source_depth: float, launch_elevation: ArrayLike, *, max_range: float,
    max_bounces: int = 2, step: float = 1.0,
) -> RayFan:  # fmt: skip
    """Trace rays through a column of layers.

    Args:
        column: Sound speed from the surface to the bottom.
        source_depth: Depth of the source [m].
        launch_elevation: Launch elevations, + down, between -pi/2 and pi/2 [rad], shape (rays,) or one.
        max_range: Horizontal distance at which rays end [m].
        max_bounces: Largest number of reflections by surface and bottom; at the next one the ray ends.
        step: Longest range between vertices of a refracted ray [m]; infinite: vertices at knots, turning points and
            bounces alone.

    Returns:
        The rays, in the order of the given launch elevations.

    Raises:
        ValueError: The source lies outside the water, or a value is invalid.
    """
    angles = np.atleast_1d(
        require_numbers("launch_elevation", launch_elevation, "rad", -np.pi / 2, np.pi / 2, allow_nan=False)
    ).ravel()
    bottom = float(column.depth[-1])
    source = require_number("source_depth", source_depth, "m", 0.0, bottom)
    end = require_number("max_range", max_range, "m", 0.0, exclude_low=True, example="200")
    if not 0 <= max_bounces <= MAX_BOUNCES:
        raise ValueError(f"max_bounces is {max_bounces}; give 0 to {MAX_BOUNCES}.")
    if not step > 0:
        raise ValueError(f"step is {step:g} m; give a length above 0, such as 1.")
    first, vertices = _trace_vertices(column, source, np.sin(angles), end, max_bounces)
    slowness = np.cos(angles) / np.interp(source, column.depth, column.speed)
    names = _boundaries(first, vertices, bottom)
    return _refined_rays(angles, slowness, first, vertices, names, step, column)


def bounce_ranges(
    column: SoundSpeedLayers, source_depth: float, sines: Floats, max_bounces: int, *, max_range: float
) -> Floats:
    """Horizontal distances at which rays bounce.

    Args:
        column: Sound speed from the surface to the bottom.
        source_depth: Depth of the source [m].
        sines: Sine of the launch elevation, + down, NaN for no ray, shape (rays,).
        max_bounces: Number of bounces of each ray to return.
        max_range: Range at which rays end [m].

    Returns:
        Horizontal distances of the first bounces [m], shape (max_bounces, rays); NaN where a ray has fewer.
    """
    ranges = np.full((max_bounces, sines.size), np.nan)
    existing_rays = np.flatnonzero(np.isfinite(sines))
    first, vertices = _trace_vertices(column, source_depth, sines[existing_rays], max_range, max_bounces)
    ray = np.repeat(existing_rays, np.diff(first))
    row = np.flatnonzero((np.diff(vertices.bounces) > 0) & (np.diff(ray) == 0)) + 1
    ranges[vertices.bounces[row] - 1, ray[row]] = vertices.distance[row]
    return ranges


def _trace_vertices(
    column: SoundSpeedLayers, source: float, sines: Floats, max_range: float, bounces: int
) -> tuple[Integers, RayVertices]:
    """First rows and vertices of all rays; the kernel runs again if rays turn so often that the buffer is too small."""
    first = np.zeros(sines.size + 1, np.int64)
    size = sines.size * (column.depth.size * (bounces + 1) + 1)
    while True:
        vertices = RayVertices(*np.empty((5, size)), *np.empty((2, size), np.int64))
        trace_rays(column, source, sines, max_range, bounces, first, vertices)
        count, size = int(first[-1]), max(size, int(first[-1]))
        if count <= vertices.sine.size:
            return first, RayVertices(*(values[:count] for values in vertices))


def _boundaries(first: Integers, vertices: RayVertices, bottom: float) -> tuple[str, ...]:
    """Letters of the boundaries at which each ray bounced, in order; the bottom's depth is in metres."""
    sequences = []
    for start, stop in pairwise(first):
        bounce_rows = np.flatnonzero(np.diff(vertices.bounces[start:stop])) + start + 1
        sequences.append("".join("B" if z > bottom / 2 else "S" for z in vertices.depth[bounce_rows]))
    return tuple(sequences)


def _refined_rays(
    angles: Floats, slowness: Floats, first: Integers, vertices: RayVertices, names: tuple[str, ...], step: float,
    column: SoundSpeedLayers,
) -> RayFan:  # fmt: skip
    """The same rays with more vertices along their arcs, at most a step apart."""
    ray = np.repeat(np.arange(angles.size), np.diff(first))
    length = np.append(np.diff(vertices.distance), 0.0)
    length[first[1:] - 1] = 0.0  # a ray's last vertex begins no arc
    is_subdivided = (vertices.gradient != 0) & (length > step)
    count = np.where(is_subdivided, np.ceil(length / step), 1).astype(np.int64)
    row = np.repeat(np.arange(vertices.depth.size), count)
    number_in_arc = np.arange(row.size) - np.repeat(np.cumsum(count) - count, count)
    dx = length[row] * number_in_arc / count[row]
    x, z, t, sine, gradient = (values[row] for values in vertices[:5])
    p = slowness[ray[row]]
    sine_inside = np.clip(sine - p * gradient * dx, -1.0, 1.0)
    depth_change = dx * (sine + sine_inside) / np.maximum(_cosine(sine) + _cosine(sine_inside), 1e-300)
    depth = np.where(number_in_arc > 0, z + depth_change, z)
    speed = np.interp(z, column.depth, column.speed)
    mean_speed = np.sqrt(speed * (speed + gradient * depth_change))  # geometric, of both ends of the arc
    chord = np.hypot(dx, depth_change)
    u = np.abs(gradient) * chord / (2 * mean_speed)
    time = chord / mean_speed * np.where(u > 1e-8, np.arcsinh(u) / np.maximum(u, 1e-8), 1.0)
    return RayFan(
        angles, np.concatenate([[0], np.cumsum(count)])[first], x + dx, depth, t + time,
        np.where(number_in_arc > 0, sine_inside, sine), vertices.bounces[row], vertices.turns[row], names,
    )  # fmt: skip


def _cosine(sine: Floats) -> Floats:
    """Cosine of an elevation, exact near the horizontal."""
    return np.asarray(np.sqrt((1 - sine) * (1 + sine)))
