"""Kernels of legs by specular points of terrain: the pressure by each point, and the columns of its leg."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._relief_specular_points_kernel import (
    GRAZING_SINE,
    LENGTH,
    PLANE_HESSIAN,
    SECANT,
    PathEnds,
    TerrainSpline,
    paths_with_curvature,
)
from insonify.jit import njit
from insonify.propagation.layered_surface_path_kernel import SurfaceWater, rays_down, speed_at

Floats = NDArray[np.float64]

AIRY = 0.795
"""Curvature at a caustic whose stationary phase equals Airy's Ai(0), over k^(-1/3) c^(2/3), c the third derivative of
the path length: 2 pi / (2 pi Ai(0))^2 / 2^(2/3) [1]."""
TIME, SPREADING_DISTANCE = 3, 5
"""Columns of `rays_down`: travel time as a length [m], and spreading distance [m]."""


class SpecularPoints(NamedTuple):
    """Specular points of one family, n of them, the strongest first; or those of several families, one by one."""

    position: Floats
    """North, east, depth [m], shape (n, 3)."""
    length: Floats
    """Path length, in layered water the travel time times the speed of its uppermost knot [m], shape (n,)."""
    focusing: Floats
    """Pressure re 1 m times `length` [1], shape (n,): with one sound speed, pressure re that of the tangent plane."""
    caustics: NDArray[np.uint8]
    """Caustics touched [1], shape (n,)."""
    grazing_sine: Floats
    """Sine of the grazing angle at the seabed [1], shape (n,)."""
    scale: Floats
    """Cutoff wavelength: shorter waves of the seabed count as roughness in the coherent reflection [m], shape (n,)."""
    residual_variance: Floats
    """Variance of the heights that the search leaves out [m^2], shape (n,); 0 for waves, whose spectrum is known."""


class FamilyRows(NamedTuple):
    """Families with specular points, f of them, and their rows among the legs."""

    first: NDArray[np.int64]
    """First row of each family, (f,)."""
    points: NDArray[np.int64]
    """Number of its points, each with a row, (f,)."""
    image: Floats
    """-1 where the first end, and where the last, is an image in the surface, otherwise 1, (f, 2)."""
    surface_bounces: NDArray[np.int64]
    """Number of surface reflections, (f,)."""


class SpecularColumns(NamedTuple):
    """Columns of legs to one point that follow from the specular points, see `insonify.records.legs.Legs`."""

    delay: Floats
    length: Floats
    spreading: Floats
    absorption: Floats
    reflection_coefficient: NDArray[np.complex128]
    caustics: NDArray[np.uint8]
    departure: Floats
    arrival: Floats


@njit(cache=True, nogil=True, error_model="numpy")
def write_specular_points(
    positions: Floats, exact_depth: Floats, terrain: TerrainSpline, ends: PathEnds, wavelength: float, reach: float,
    result: SpecularPoints,
) -> None:  # fmt: skip
    """Write the strongest of some stationary points, the strongest first.

    Args:
        positions: North, east of the stationary points [m], (m, 2).
        exact_depth: Depth of the seabed at each [m], (m,); or (0,): that of `terrain`.
        terrain: Depth of the terrain.
        ends: Ends of the paths.
        wavelength: Acoustic wavelength, in layered water at the surface [m].
        reach: Step to either side of a point by which the second derivative is differenced [m].
        result: Result, n at most m points; `scale` and `residual_variance` are not written.
    """
    points, paths, curvature, change = paths_with_curvature(positions, terrain, ends, reach)
    focusing, strength = np.empty(len(points)), np.empty(len(points))
    caustics, airy = np.zeros(len(points), np.uint8), AIRY * (2 * math.pi / wavelength) ** (-1 / 3)
    for n in range(len(points)):
        nn, ne, ee = paths[n, PLANE_HESSIAN], paths[n, PLANE_HESSIAN + 1], paths[n, PLANE_HESSIAN + 2]
        plane, product = nn * ee - ne * ne, 1.0
        for axis in range(2):
            product *= max(abs(curvature[n, axis]), airy * (abs(change[n, axis]) / (2 * reach)) ** (2 / 3))
            caustics[n] += curvature[n, axis] < 0
        focusing[n] = math.sqrt(plane / max(product, 1e-12))
        if ends.water.depth.size:  # Kirchhoff's integral: cosine / (d1 d2 sqrt |det H|), with d spreading distances
            first, last = _ray(points[n], ends.begin, ends.water), _ray(points[n], ends.stop, ends.water)
            spreading = first[SPREADING_DISTANCE] * last[SPREADING_DISTANCE] * math.sqrt(plane)
            focusing[n] *= paths[n, LENGTH] * paths[n, GRAZING_SINE] * paths[n, SECANT] / spreading
            paths[n, GRAZING_SINE] *= speed_at(points[n, 2], ends.water) / ends.water.speed[0]
        strength[n] = focusing[n] / paths[n, LENGTH]
    for rank in range(result.length.size):
        n = _first_of_largest(strength)
        strength[n] = -1.0
        result.position[rank], result.length[rank] = points[n], paths[n, LENGTH]
        result.focusing[rank], result.caustics[rank] = focusing[n], caustics[n]
        result.grazing_sine[rank] = paths[n, GRAZING_SINE]
        if exact_depth.size:  # stationary: to second order
            result.position[rank, 2] = exact_depth[n]
            result.length[rank] = _path_length(result.position[rank], ends)


@njit(cache=True, nogil=True, error_model="numpy")
def _first_of_largest(values: Floats) -> int:
    """First index of the largest of some values, of which NaN counts as 0."""
    largest, index = -1.0, 0
    for n in range(values.size):
        value = 0.0 if math.isnan(values[n]) else values[n]
        if value > largest:
            largest, index = value, n
    return index


@njit(cache=True, nogil=True, error_model="numpy")
def _ray(point: Floats, end: Floats, water: SurfaceWater) -> Floats:
    """Ray from one end down to a point, with the columns of `rays_down`, (6,)."""
    distance, ray = np.full(1, math.sqrt((point[0] - end[0]) ** 2 + (point[1] - end[1]) ** 2)), np.empty((1, 6))
    rays_down(distance, point[2:], end[2], water, ray)
    return ray[0]


@njit(cache=True, nogil=True, error_model="numpy")
def _path_length(point: Floats, ends: PathEnds) -> float:
    """Length of the path by one point [m]."""
    if ends.water.depth.size:
        return float(_ray(point, ends.begin, ends.water)[TIME] + _ray(point, ends.stop, ends.water)[TIME])
    return _distance(point, ends.begin) + _distance(point, ends.stop)


@njit(cache=True, nogil=True, error_model="numpy")
def _distance(point: Floats, other: Floats) -> float:
    """Distance of two points [m]."""
    return math.sqrt((point[0] - other[0]) ** 2 + (point[1] - other[1]) ** 2 + (point[2] - other[2]) ** 2)


@njit(cache=True, nogil=True, error_model="numpy")
def write_specular_legs(
    points: SpecularPoints, families: FamilyRows, ends: Floats, bottom: NDArray[np.complex128], surface: complex,
    sound_speed: float, columns: SpecularColumns,
) -> None:  # fmt: skip
    """Write the legs by specular points of some families, by the formulas for water of one sound speed.

    Args:
        points: Points of all families.
        families: The families.
        ends: North, east, depth of the first and the last end of the legs [m], (2, 3).
        bottom: Coherent reflection coefficient of the seabed at each point [1], (n,).
        surface: Reflection coefficient of the surface [1].
        sound_speed: Sound speed [m/s].
        columns: Written; the first row of each family has a length and its absorption.
    """
    n, phase = 0, (1 + 0j, 1j, -1 + 0j)  # by the number of caustics
    for f in range(families.first.size):
        row = families.first[f]
        per_metre = math.log(columns.absorption[row, 0]) / columns.length[row, 0]
        for row in range(families.first[f], families.first[f] + families.points[f]):
            length, coefficient = points.length[n], bottom[n]
            for _ in range(families.surface_bounces[f]):
                coefficient *= surface
            columns.delay[row, 0], columns.length[row, 0] = length / sound_speed, length
            columns.spreading[row, 0] = points.focusing[n] / length
            columns.absorption[row, 0] = math.exp(per_metre * length)
            columns.reflection_coefficient[row, 0] = coefficient * phase[points.caustics[n]]
            columns.caustics[row, 0] = points.caustics[n]
            _write_direction(ends[0], families.image[f, 0], points.position[n], 1.0, columns.departure[row, 0])
            _write_direction(ends[1], families.image[f, 1], points.position[n], -1.0, columns.arrival[row, 0])
            n += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _write_direction(end: Floats, image: float, point: Floats, sense: float, direction: Floats) -> None:
    """Write the direction of travel at an end of the legs.

    Args:
        end: North, east, depth of the end [m], (3,).
        image: -1 where the path begins at the image of that end in the surface, otherwise 1.
        point: North, east, depth of a point of the seabed [m], (3,).
        sense: 1 for travel from the end to the point, -1 for the opposite.
        direction: Result [1], (3,).
    """
    x, y, z = point[0] - end[0], point[1] - end[1], point[2] - image * end[2]
    length = sense * math.sqrt(x * x + y * y + z * z)
    direction[0], direction[1], direction[2] = x / length, y / length, z / length * image
