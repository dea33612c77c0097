"""Kernels of a path from one end of a leg to a point of an uneven surface: its length as the point moves over it.

The surface is a sum of waves. North and east are those from the origin of the waves, heights are upwards; both ends of
a leg lie below the mean surface.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.ocean.wave_kernels import cosine_of_cycles

Floats = NDArray[np.float64]
SurfaceDerivatives = tuple[float, float, float, float, float, float]
PathDerivatives = tuple[float, float, float, float, float, float, float, float, float]

_FAST = {"contract", "reassoc", "nsz", "arcp"}  # sums over waves may be reordered
TWO_PI = 2 * math.pi
LEAST_HEIGHT = 1e-3
"""Least height of the surface above an end of a leg [m]."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def surface_derivatives(
    north: float, east: float, time: float, delay_per_north: float, delay_per_east: float, waves: Floats
) -> SurfaceDerivatives:
    """Height of the surface at points when sound arrives there, and its derivatives by the position of the point.

    Args:
        north: North coordinate [m].
        east: East coordinate [m].
        time: Time of arrival [s].
        delay_per_north: Derivative of the time of arrival by north [s/m].
        delay_per_east: Derivative of the time of arrival by east [s/m].
        waves: Rows: cycles per metre north, east; per second, negative; phase at the origin at time 0 [cycles];
            amplitude [m]; shape (5, m).

    Returns:
        Height [m]; its derivatives by north, by east [1]; second ones by north twice, both, and east twice [1/m].
    """
    height = north1 = east1 = north2 = north_east = east2 = 0.0
    for m in range(waves.shape[1]):
        f, a = waves[2, m], waves[4, m]
        cycles = waves[0, m] * north + waves[1, m] * east + f * time + waves[3, m]
        p, q = waves[0, m] + f * delay_per_north, waves[1, m] + f * delay_per_east
        c, s = a * cosine_of_cycles(cycles), a * cosine_of_cycles(cycles - 0.25)
        height += c
        north1 -= p * s
        east1 -= q * s
        north2 -= p * p * c
        north_east -= p * q * c
        east2 -= q * q * c
    square = TWO_PI * TWO_PI
    return height, TWO_PI * north1, TWO_PI * east1, square * north2, square * north_east, square * east2


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def surface_derivatives_along(
    north: float, east: float, time: float, unit_north: float, unit_east: float, waves: Floats
) -> tuple[float, float, float]:
    """Third and fourth derivatives of the surface at one time along one direction.

    Args:
        north: North coordinate [m].
        east: East coordinate [m].
        time: Time [s].
        unit_north: North component of a unit vector.
        unit_east: East component of the unit vector.
        waves: Waves, as for `surface_derivatives`, shape (5, m).

    Returns:
        Third derivative of the height along the vector [1/m^2]; fourth ones along it, and to the right of it [1/m^3].
    """
    third = fourth = fourth_across = 0.0
    for m in range(waves.shape[1]):
        p, q, a = waves[0, m], waves[1, m], waves[4, m]
        cycles = p * north + q * east + waves[2, m] * time + waves[3, m]
        c, s = a * cosine_of_cycles(cycles), a * cosine_of_cycles(cycles - 0.25)
        u, v = p * unit_north + q * unit_east, q * unit_north - p * unit_east
        third += u * u * u * s
        fourth += u * u * u * u * c
        fourth_across += v * v * v * v * c
    cube = TWO_PI * TWO_PI * TWO_PI
    return cube * third, cube * TWO_PI * fourth, cube * TWO_PI * fourth_across


@njit(cache=True, nogil=True, error_model="numpy")
def end_to_surface_path(
    offset_north: float, offset_east: float, end_depth: float, sea: SurfaceDerivatives
) -> PathDerivatives:
    """Length of the straight path from one end to a point of the surface, with derivatives as the point moves over it.

    Args:
        offset_north: Point less end, north [m].
        offset_east: Point less end, east [m].
        end_depth: Unfolded depth of the end below the mean surface [m].
        sea: The surface at the point, from `surface_derivatives`.

    Returns:
        Length [m]; its derivatives by north and east [1]; second ones by north twice, both, and east twice [1/m];
        height of the point above the end over length [1]; cosine between the path and the surface's normal, times the
        length of the normal that has 1 upwards [1]; that height [m].
    """
    height, north1, east1, north2, north_east, east2 = sea
    up = max(end_depth + height, LEAST_HEIGHT)
    r = math.sqrt(offset_north * offset_north + offset_east * offset_east + up * up)
    gn, ge = (offset_north + up * north1) / r, (offset_east + up * east1) / r
    hnn = (1 + north1 * north1 + up * north2 - gn * gn) / r
    hne = (north1 * east1 + up * north_east - gn * ge) / r
    hee = (1 + east1 * east1 + up * east2 - ge * ge) / r
    return r, gn, ge, hnn, hne, hee, up / r, (up - offset_north * north1 - offset_east * east1) / r, up


@njit(cache=True, nogil=True, error_model="numpy")
def path_third_derivative(
    unit_north: float, unit_east: float, path: PathDerivatives, sea: SurfaceDerivatives, third: float
) -> float:
    """Third derivative of a path's length as its point moves along a unit vector, given that of the height [1/m^2]."""
    first = unit_north * sea[1] + unit_east * sea[2]
    second = unit_north * unit_north * sea[3] + 2 * unit_north * unit_east * sea[4] + unit_east * unit_east * sea[5]
    r, up = path[0], path[8]
    r1 = unit_north * path[1] + unit_east * path[2]
    r2 = unit_north * unit_north * path[3] + 2 * unit_north * unit_east * path[4] + unit_east * unit_east * path[5]
    return (3 * first * second + up * third - 3 * r1 * r2) / r  # from three derivatives of r^2


@njit(cache=True, nogil=True, error_model="numpy")
def principal_curvatures(hnn: float, hne: float, hee: float) -> tuple[float, float, float, float]:
    """Eigenvalues of a symmetric matrix, the smaller in magnitude first, and north and east of its unit eigenvector."""
    mean, half = (hnn + hee) / 2, (hnn - hee) / 2
    root = math.hypot(half, hne)
    angle = math.atan2(hne, half) / 2  # of the axis of the greater one
    greater, smaller = mean + root, mean - root
    if abs(greater) <= abs(smaller):
        return greater, smaller, math.cos(angle), math.sin(angle)
    return smaller, greater, -math.sin(angle), math.cos(angle)
