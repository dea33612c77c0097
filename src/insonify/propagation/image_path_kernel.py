"""Kernels of image paths, reflected at a few planes in sequence: given planes, or planes fitted about each bounce.

Plain numbers and arrays only. Loops have unsigned indices: a signed one is tested for being negative at each access.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.scene.heightmap_cache import HeightmapTiles
from insonify.scene.plane_fit_kernel import EllipsePatches, fit_planes

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

_TINY = 1e-9
"""Least denominator: a distance [m], or the sine of a grazing angle [1]."""
_CHUNK = 128
"""Points that are processed together: the length of a row of the work array."""
_C, _C2, _C3, _C4, _C5 = (np.uint64(_CHUNK * row) for row in (1, 2, 3, 4, 5))
"""Offsets from the row of a vector's north component: its east and down components; from that of a plane's point, also
the three components of its normal."""
_END, _TRAVEL, _ARRIVAL, _REMAINING, _VALID, _LENGTH = (np.uint64(_CHUNK * row) for row in (0, 3, 6, 9, 10, 11))
"""Position to which a path has been traced back from its point; direction of travel there, and at the point; fraction
of the path between the sonar and that position, validity, length.
"""
_TOWARDS_NORTH, _TOWARDS_EAST = (np.uint64(_CHUNK * row) for row in (12, 13))
"""Horizontal unit vector from the sonar towards each point [1]."""
_X, _Y, _HALF_LENGTH, _HALF_WIDTH = (np.uint64(_CHUNK * row) for row in (14, 15, 16, 17))
"""Centre of a Fresnel zone on the grid, and its half axes [m]."""
_HEIGHT, _ALONG, _ACROSS, _RESIDUAL = (np.uint64(_CHUNK * row) for row in (18, 19, 20, 21))
"""Fitted planes: height above the mean seabed [m], slopes along the path and to its right, positive upwards [1], and
mean square of the residual [m^2]."""
_COSINE_ON_GRID, _SINE_ON_GRID = (np.uint64(_CHUNK * row) for row in (22, 23))
"""The unit vector towards each point on the axes of the grid: cosine and sine of its bearing there [1]."""
_FIRST = 24
"""Number of rows before those of the planes."""
_ANCHOR, _IMAGE, _BOUNCE, _FRACTION, _SINE, _PLANE_RESIDUAL, _ROWS_PER_PLANE = 0, 6, 9, 12, 13, 14, 15
"""Rows of each plane: a point of it, its normal, the image before it, the bounce, the fraction of the path before that,
the sine of the grazing angle, and the mean square residual of the fit; after the last plane comes the last
image.
"""
_FAST = {"contract", "reassoc", "nsz", "arcp"}
"""Fast-math flags; not nnan, since unknown terrain is NaN."""


class ImagePaths(NamedTuple):
    """Paths of one family from one position to n points, reflected at m planes each."""

    length: Floats
    """Length of the path [m], shape (n,)."""
    departure: Floats
    """Unit vector of travel at the sonar, shape (n, 3)."""
    arrival: Floats
    """Unit vector of travel at the point, opposite to `Arrivals.arrival`, shape (n, 3)."""
    bounce_position: Floats
    """North, east, depth of each bounce [m], shape (m, n, 3)."""
    fraction: Floats
    """Fraction of the path before each bounce [1], shape (m, n)."""
    grazing_sine: Floats
    """Sine of the grazing angle at each plane [1], shape (m, n)."""
    residual_variance: Floats
    """Mean square of the terrain's residual about each plane [m^2], shape (m, n)."""
    is_valid: NDArray[np.bool_]
    """True where, at every plane, the next bounce (or the point, after the last one) and the image before the
    reflection both lie on the water side of the plane, shape (n,)."""


class TerrainFrame(NamedTuple):
    """Frame of the scatterer grid in the world, and what else decides where terrain is sampled."""

    north: float
    """North coordinate of its origin [m]."""
    east: float
    """East coordinate of its origin [m]."""
    cosine: float
    """Cosine of its heading [1]."""
    sine: float
    """Sine of its heading [1]."""
    depth: float
    """Depth of the seabed's mean plane [m]."""
    wavelength: float
    """Wavelength of the sound [m]."""
    shortest_half_axis: float
    """Least half axis of an ellipse; smaller ones are enlarged to it [m]."""


@njit(cache=True, nogil=True, error_model="numpy")
def _workspace(plane_count: int) -> Floats:
    """Work array for paths with a number of planes, a row for each quantity; one array, to vectorise loops."""
    return np.empty(_CHUNK * (_FIRST + _ROWS_PER_PLANE * (plane_count + 1)))


@njit(cache=True, nogil=True, error_model="numpy")
def _row(plane: int, row: int) -> np.uint64:
    """Index of the first number of one row of a plane."""
    return np.uint64(_CHUNK * (_FIRST + _ROWS_PER_PLANE * plane + row))


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _reflect_in_plane(workspace: Floats, count: int, image: np.uint64, plane: np.uint64, reflected: np.uint64) -> None:
    """Images of positions in planes, into the rows from `reflected` on."""
    for n in range(np.uint64(count)):
        x, y, z = workspace[image + n], workspace[image + _C + n], workspace[image + _C2 + n]
        f, g, h = workspace[plane + _C3 + n], workspace[plane + _C4 + n], workspace[plane + _C5 + n]
        a, b, c = x - workspace[plane + n], y - workspace[plane + _C + n], z - workspace[plane + _C2 + n]
        twice_height = 2 * (a * f + b * g + c * h)
        workspace[reflected + n] = x - twice_height * f
        workspace[reflected + _C + n] = y - twice_height * g
        workspace[reflected + _C2 + n] = z - twice_height * h


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _image_lines(workspace: Floats, count: int, image: np.uint64) -> None:
    """Direction and length, at least 1e-6 m, of the line from an image to the position that is traced back."""
    for n in range(np.uint64(count)):
        u, v = workspace[_END + n] - workspace[image + n], workspace[_END + _C + n] - workspace[image + _C + n]
        w = workspace[_END + _C2 + n] - workspace[image + _C2 + n]
        length = max(math.sqrt(u * u + v * v + w * w), 1e-6)
        inverse_length = 1 / length
        workspace[_LENGTH + n] = length
        workspace[_TRAVEL + n] = workspace[_ARRIVAL + n] = u * inverse_length
        workspace[_TRAVEL + _C + n] = workspace[_ARRIVAL + _C + n] = v * inverse_length
        workspace[_TRAVEL + _C2 + n] = workspace[_ARRIVAL + _C2 + n] = w * inverse_length


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _intersect_plane(
    workspace: Floats, count: int, image: np.uint64, plane: np.uint64, bounce: np.uint64, fraction: np.uint64
) -> None:
    """Trace back to the intersection of the line from the image with the plane; fraction of the path before it.

    Validity: the traced position lies on the water side of the plane, and the reflected image on the other.
    """
    for n in range(np.uint64(count)):
        ex, ey, ez = workspace[_END + n], workspace[_END + _C + n], workspace[_END + _C2 + n]
        x, y, z = workspace[image + n], workspace[image + _C + n], workspace[image + _C2 + n]
        a, b, c = workspace[plane + n], workspace[plane + _C + n], workspace[plane + _C2 + n]
        f, g, h = workspace[plane + _C3 + n], workspace[plane + _C4 + n], workspace[plane + _C5 + n]
        end_distance = (ex - a) * f + (ey - b) * g + (ez - c) * h
        image_distance = -((x - a) * f + (y - b) * g + (z - c) * h)
        is_valid = workspace[_VALID + n]
        workspace[_VALID + n] = is_valid if min(end_distance, image_distance) > 0 else 0.0
        fraction_to_plane = min(max(end_distance / max(end_distance + image_distance, _TINY), 0.0), 1.0)
        workspace[_END + n] = workspace[bounce + n] = ex + fraction_to_plane * (x - ex)
        workspace[_END + _C + n] = workspace[bounce + _C + n] = ey + fraction_to_plane * (y - ey)
        workspace[_END + _C2 + n] = workspace[bounce + _C2 + n] = ez + fraction_to_plane * (z - ez)
        remaining = workspace[_REMAINING + n] * (1 - fraction_to_plane)
        workspace[_REMAINING + n] = workspace[fraction + n] = remaining


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _reflect_direction(workspace: Floats, count: int, plane: np.uint64, sine: np.uint64) -> None:
    """Direction before a plane from that after it, and the sine of the grazing angle."""
    for n in range(np.uint64(count)):
        u, v, w = workspace[_TRAVEL + n], workspace[_TRAVEL + _C + n], workspace[_TRAVEL + _C2 + n]
        f, g, h = workspace[plane + _C3 + n], workspace[plane + _C4 + n], workspace[plane + _C5 + n]
        normal_component = u * f + v * g + w * h
        workspace[_TRAVEL + n] = u - 2 * normal_component * f
        workspace[_TRAVEL + _C + n] = v - 2 * normal_component * g
        workspace[_TRAVEL + _C2 + n] = w - 2 * normal_component * h
        workspace[sine + n] = min(abs(normal_component), 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def _unfold(position: Floats, points: Floats, indices: NDArray[np.int64], plane_count: int, workspace: Floats) -> None:
    """Paths from the sonar to some points by reflection at the planes in the work array, one after the other.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        points: North, east, depth of the points [m], (n, 3).
        indices: Indices of the points to process, at most `_CHUNK`.
        plane_count: Number of planes.
        workspace: Planes, and the result.
    """
    count, first = indices.size, _row(0, _IMAGE)
    for q in range(np.uint64(count)):
        for i in range(np.uint64(3)):
            workspace[_END + i * _C + q] = points[indices[q], i]
            workspace[first + i * _C + q] = position[i]
        workspace[_REMAINING + q] = workspace[_VALID + q] = 1.0
    for k in range(plane_count):
        _reflect_in_plane(workspace, count, _row(k, _IMAGE), _row(k, _ANCHOR), _row(k + 1, _IMAGE))
    _image_lines(workspace, count, _row(plane_count, _IMAGE))
    for k in range(plane_count - 1, -1, -1):
        _intersect_plane(workspace, count, _row(k + 1, _IMAGE), _row(k, _ANCHOR), _row(k, _BOUNCE), _row(k, _FRACTION))
        _reflect_direction(workspace, count, _row(k, _ANCHOR), _row(k, _SINE))


@njit(cache=True, nogil=True, error_model="numpy")
def _write_columns(workspace: Floats, indices: NDArray[np.int64], plane_count: int, paths: ImagePaths) -> None:
    """Write the paths in the work array to their columns."""
    for q in range(np.uint64(indices.size)):
        n = indices[q]
        paths.length[n], paths.is_valid[n] = workspace[_LENGTH + q], workspace[_VALID + q] > 0
        for i in range(np.uint64(3)):
            paths.departure[n, i], paths.arrival[n, i] = (
                workspace[_TRAVEL + i * _C + q],
                workspace[_ARRIVAL + i * _C + q],
            )
    for k in range(plane_count):
        bounce, fraction, sine = _row(k, _BOUNCE), _row(k, _FRACTION), _row(k, _SINE)
        for q in range(np.uint64(indices.size)):
            n = indices[q]
            paths.fraction[k, n], paths.grazing_sine[k, n] = workspace[fraction + q], workspace[sine + q]
            for i in range(np.uint64(3)):
                paths.bounce_position[k, n, i] = workspace[bounce + i * _C + q]


@njit(cache=True, nogil=True, error_model="numpy")
def image_paths(position: Floats, points: Floats, plane_point: Floats, plane_normal: Floats, paths: ImagePaths) -> None:
    """Images of a position in planes, and the paths that they unfold.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        points: North, east, depth of the points [m], (n, 3).
        plane_point: A point of each plane [m], (m, n, 3).
        plane_normal: Unit normal of each plane, into the water, (m, n, 3).
        paths: Result, changed in place; `residual_variance` is not written.
    """
    plane_count = plane_point.shape[0]
    workspace, all_indices = _workspace(plane_count), np.arange(points.shape[0])
    for begin in range(0, points.shape[0], _CHUNK):
        indices = all_indices[begin : begin + _CHUNK]
        for k in range(plane_count):
            plane = _row(k, _ANCHOR)
            for q in range(np.uint64(indices.size)):
                for i in range(np.uint64(3)):
                    workspace[plane + i * _C + q] = plane_point[k, indices[q], i]
                    workspace[plane + (i + np.uint64(3)) * _C + q] = plane_normal[k, indices[q], i]
        _unfold(position, points, indices, plane_count, workspace)
        _write_columns(workspace, indices, plane_count, paths)


@njit(cache=True, nogil=True, error_model="numpy")
def bounce_fresnel_zone(length: float, fraction: float, sine: float, wavelength: float) -> tuple[float, float]:
    """Half length and half width of the first Fresnel zone of one bounce, see `local_planes.fresnel_zone` [m].

    Args:
        length: Length of the whole path [m].
        fraction: Fraction of it before the bounce [1].
        sine: Sine of the grazing angle [1].
        wavelength: Wavelength of the sound [m].
    """
    half_width = math.sqrt(max(wavelength * length * fraction * (1 - fraction), 0.0))
    max_half_length = length * min(fraction, 1 - fraction)
    return max(min(half_width / max(sine, _TINY), max_half_length), half_width), half_width


@njit(cache=True, nogil=True, error_model="numpy")
def bounce_fresnel_zones(length: Floats, fraction: Floats, sine: Floats, wavelength: float, half_axes: Floats) -> None:
    """Half lengths and half widths of some zones [m], (2, n); arguments as of `bounce_fresnel_zone`, of shape (n,)."""
    for n in range(length.size):
        half_axes[0, n], half_axes[1, n] = bounce_fresnel_zone(length[n], fraction[n], sine[n], wavelength)


@njit(cache=True, nogil=True, error_model="numpy")
def extent_on_grid(position: Floats, points: Floats, frame: TerrainFrame, span: Floats) -> None:
    """Least and greatest grid coordinates of a position and some points, into the rows of `span` [m], (2, 2)."""
    span[0], span[1] = np.inf, -np.inf
    for n in range(points.shape[0] + 1):
        x, y = (points[n, 0], points[n, 1]) if n < points.shape[0] else (position[0], position[1])
        x, y = x - frame.north, y - frame.east
        a, b = frame.cosine * x + frame.sine * y, frame.cosine * y - frame.sine * x
        span[0, 0], span[0, 1] = min(span[0, 0], a), min(span[0, 1], b)
        span[1, 0], span[1, 1] = max(span[1, 0], a), max(span[1, 1], b)


@njit(cache=True, nogil=True, error_model="numpy")
def paths_off_local_planes(
    position: Floats, points: Floats, is_seabed_bounce: NDArray[np.bool_], bounce_shift: Floats, frame: TerrainFrame,
    disc_samples: tuple[Singles, ...], heightmap: HeightmapTiles, missing: NDArray[np.bool_],
    is_done: NDArray[np.bool_], paths: ImagePaths,
) -> bool:  # fmt: skip
    """Paths reflected at planes fitted to the seabed about each bounce, of those points that are not done yet.

    Args:
        position: As of `image_paths`.
        points: As of `image_paths`.
        is_seabed_bounce: True for planes of the seabed, False for the surface, (m,).
        bounce_shift: Offset, north and east, from each bounce of the straight path to that of the refracted one, where
            the terrain is sampled [m], (m, n, 2); or (m, 0, 2) for straight paths.
        frame: Frame of the terrain.
        disc_samples: Samples of the unit disc, one set for each round of fits, from coarse to fine, see `fit_planes`.
        heightmap: Tiles of terrain heights.
        missing: Result: missing tiles, see `fit_planes`.
        is_done: True for points whose path is computed, whether valid or not, (n,); input and result.
        paths: Result.

    Returns:
        True if all points are computed; False while tiles are missing.
    """
    plane_count, remaining_points = is_seabed_bounce.size, np.flatnonzero(~is_done)
    workspace, is_known = _workspace(plane_count), np.empty(_CHUNK, np.bool_)
    zone_rows = _zone_rows(workspace)
    for begin in range(0, remaining_points.size, _CHUNK):
        indices = remaining_points[begin : begin + _CHUNK]
        _set_flat_planes(position, points, indices, is_seabed_bounce, frame.depth, workspace)
        _unfold(position, points, indices, plane_count, workspace)
        is_known[:] = True
        for pattern in disc_samples:
            for k in range(plane_count):
                if is_seabed_bounce[k]:
                    _zone_ellipses(indices.size, k, frame, workspace)
                    if bounce_shift.shape[1] > 0:
                        _shift_zones(indices, bounce_shift[k], frame, workspace)
                    fit_planes(zone_rows, indices.size, pattern, heightmap, missing, is_known)
                    _set_planes(indices.size, k, frame.depth, workspace)
            _unfold(position, points, indices, plane_count, workspace)
        _write_columns(workspace, indices, plane_count, paths)
        for q in range(indices.size):
            for k in range(plane_count):
                paths.residual_variance[k, indices[q]] = (
                    workspace[_row(k, _PLANE_RESIDUAL) + np.uint64(q)] if is_seabed_bounce[k] else 0.0
                )
            is_done[indices[q]] = is_known[q]
    return bool(np.all(is_done))


@njit(cache=True, nogil=True)
def _zone_rows(workspace: Floats) -> EllipsePatches:
    """Rows of the work array with the sampled zones and the fitted planes."""
    return EllipsePatches(
        workspace[_X : _X + _C], workspace[_Y : _Y + _C], workspace[_COSINE_ON_GRID : _COSINE_ON_GRID + _C],
        workspace[_SINE_ON_GRID : _SINE_ON_GRID + _C],
        workspace[_HALF_LENGTH : _HALF_LENGTH + _C], workspace[_HALF_WIDTH : _HALF_WIDTH + _C],
        workspace[_HEIGHT : _HEIGHT + _C], workspace[_ALONG : _ALONG + _C],
        workspace[_ACROSS : _ACROSS + _C], workspace[_RESIDUAL : _RESIDUAL + _C],
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _set_flat_planes(
    position: Floats, points: Floats, indices: NDArray[np.int64], is_seabed_bounce: NDArray[np.bool_], depth: float,
    workspace: Floats,
) -> None:  # fmt: skip
    """Set flat planes in the work array, and the horizontal unit vectors towards the points.

    Arguments are those of `paths_off_local_planes` and `_unfold`; `depth` is that of the seabed's mean plane [m].
    """
    for k in range(is_seabed_bounce.size):
        plane = _row(k, _ANCHOR)
        for q in range(np.uint64(indices.size)):
            for i in range(np.uint64(6)):
                workspace[plane + i * _C + q] = 0.0
            workspace[plane + _C2 + q] = depth if is_seabed_bounce[k] else 0.0
            workspace[plane + _C5 + q] = -1.0 if is_seabed_bounce[k] else 1.0
    for q in range(np.uint64(indices.size)):
        north, east = points[indices[q], 0] - position[0], points[indices[q], 1] - position[1]
        horizontal = math.sqrt(north * north + east * east)
        workspace[_TOWARDS_NORTH + q], workspace[_TOWARDS_EAST + q] = (
            (north / horizontal, east / horizontal) if horizontal > 0 else (1.0, 0.0)
        )


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _zone_ellipses(count: int, k: int, frame: TerrainFrame, workspace: Floats) -> None:
    """Centres, half axes and directions of the Fresnel zones of the reflections at one plane, on the grid.

    The zones are those of `bounce_fresnel_zone`.
    """
    bounce, fraction, sine = _row(k, _BOUNCE), _row(k, _FRACTION), _row(k, _SINE)
    for q in range(np.uint64(count)):
        fraction_before, length = workspace[fraction + q], workspace[_LENGTH + q]
        half_width = math.sqrt(max(frame.wavelength * length * fraction_before * (1 - fraction_before), 0.0))
        max_half_length = length * min(fraction_before, 1 - fraction_before)
        half_length = max(min(half_width / max(workspace[sine + q], _TINY), max_half_length), half_width)
        x, y = workspace[bounce + q] - frame.north, workspace[bounce + _C + q] - frame.east
        workspace[_X + q], workspace[_Y + q] = frame.cosine * x + frame.sine * y, frame.cosine * y - frame.sine * x
        workspace[_HALF_LENGTH + q], workspace[_HALF_WIDTH + q] = (
            max(half_length, frame.shortest_half_axis),
            max(half_width, frame.shortest_half_axis),
        )
        north, east = workspace[_TOWARDS_NORTH + q], workspace[_TOWARDS_EAST + q]
        workspace[_COSINE_ON_GRID + q] = frame.cosine * north + frame.sine * east
        workspace[_SINE_ON_GRID + q] = frame.cosine * east - frame.sine * north


@njit(cache=True, nogil=True, error_model="numpy")
def _shift_zones(indices: NDArray[np.int64], bounce_shift: Floats, frame: TerrainFrame, workspace: Floats) -> None:
    """Move the centres of zones from the bounces of straight paths to those of refracted ones, by (n, 2)."""
    for q in range(np.uint64(indices.size)):
        x, y = bounce_shift[indices[q], 0], bounce_shift[indices[q], 1]
        workspace[_X + q] += frame.cosine * x + frame.sine * y
        workspace[_Y + q] += frame.cosine * y - frame.sine * x


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _set_planes(count: int, k: int, depth: float, workspace: Floats) -> None:
    """Set one plane of every path from its fit: at the bounce's north and east, at the fitted height, normal upwards.

    After `_shift_zones` that is the height fitted about the bounce of the refracted path.
    """
    plane, bounce, residual = _row(k, _ANCHOR), _row(k, _BOUNCE), _row(k, _PLANE_RESIDUAL)
    for q in range(np.uint64(count)):
        ray_north, ray_east, along, across = (
            workspace[_TOWARDS_NORTH + q], workspace[_TOWARDS_EAST + q], workspace[_ALONG + q], workspace[_ACROSS + q],
        )  # fmt: skip
        slope_north, slope_east = ray_north * along - ray_east * across, ray_east * along + ray_north * across
        workspace[residual + q] = workspace[_RESIDUAL + q]
        vertical_component = 1 / math.sqrt(slope_north * slope_north + slope_east * slope_east + 1)
        workspace[plane + q], workspace[plane + _C + q] = workspace[bounce + q], workspace[bounce + _C + q]
        workspace[plane + _C2 + q] = depth - workspace[_HEIGHT + q]
        workspace[plane + _C3 + q] = -slope_north * vertical_component
        workspace[plane + _C4 + q] = -slope_east * vertical_component
        workspace[plane + _C5 + q] = -vertical_component
