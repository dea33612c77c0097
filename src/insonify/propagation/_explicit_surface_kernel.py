"""Kernels of a path by one point of an uneven surface: its length and derivatives as the point moves.

The surface is a sum of waves. North and east are counted from the sea's own origin, heights upwards; both ends of the
path lie below the mean surface, by a height each.
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
TURN = 2 * math.pi
LEAST_HEIGHT = 1e-3
"""Least height of the surface above an end of a path [m]."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def surface_derivatives(
    north: float, east: float, time: float, delay_per_north: float, delay_per_east: float, waves: Floats
) -> SurfaceDerivatives:
    """Height, slopes and curvatures of the surface at the times at which sound arrives.

    Args:
        north: North coordinate [m].
        east: East coordinate [m].
        time: Time [s].
        delay_per_north: Growth of the arrival time to the north [s/m].
        delay_per_east: Growth of the arrival time to the east [s/m].
        waves: Cycles per metre north and east, per second (negative), at the origin, and amplitude [m], shape (5, m).

    Returns:
        Height [m]; its derivatives by north, by east [1]; second ones by north twice, both, and east twice [1/m].
    """
    height = north1 = east1 = north2 = both = east2 = 0.0
    for m in range(waves.shape[1]):
        f, a = waves[2, m], waves[4, m]
        cycles = waves[0, m] * north + waves[1, m] * east + f * time + waves[3, m]
        p, q = waves[0, m] + f * delay_per_north, waves[1, m] + f * delay_per_east
        c, s = a * cosine_of_cycles(cycles), a * cosine_of_cycles(cycles - 0.25)
        height += c
        north1 -= p * s
        east1 -= q * s
        north2 -= p * p * c
        both -= p * q * c
        east2 -= q * q * c
    square = TURN * TURN
    return height, TURN * north1, TURN * east1, square * north2, square * both, square * east2


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def surface_derivatives_along(
    north: float, east: float, time: float, unit_north: float, unit_east: float, waves: Floats
) -> tuple[float, float, float]:
    """Third and fourth derivatives of the surface along one direction.

    Args:
        north: North coordinate [m].
        east: East coordinate [m].
        time: Time [s].
        unit_north: North component of a unit vector.
        unit_east: East component of the unit vector.
        waves: Waves, as for `surface_derivatives`.

    Returns:
        Third derivative of the height along the vector [1/m^2]; fourth ones along it, and to the right of it [1/m^3].
    """
    third = fourth = aside = 0.0
    for m in range(waves.shape[1]):
        p, q, a = waves[0, m], waves[1, m], waves[4, m]
        cycles = p * north + q * east + waves[2, m] * time + waves[3, m]
        c, s = a * cosine_of_cycles(cycles), a * cosine_of_cycles(cycles - 0.25)
        u, v = p * unit_north + q * unit_east, q * unit_north - p * unit_east
        third += u * u * u * s
        fourth += u * u * u * u * c
        aside += v * v * v * v * c
    cube = TURN * TURN * TURN
    return cube * third, cube * TURN * fourth, cube * TURN * aside


@njit(cache=True, nogil=True, error_model="numpy")
def end_to_surface_path(
    offset_north: float, offset_east: float, end_depth: float, sea: SurfaceDerivatives
) -> PathDerivatives:
    """Length of the path between one end and a point of the surface, with derivatives as the point moves.

    Args:
        offset_north: Point less end, north [m].
        offset_east: Point less end, east [m].
        end_depth: Depth of the end below the mean surface [m].
        sea: The surface at the point, from `surface_derivatives`.

    Returns:
        Length [m]; its derivatives by north and east; second ones by north twice, both, and east twice; height over
        length; cosine between the path and the surface's normal, times the length of the normal that has 1 upwards; and
        height [m].
    """
    height, north1, east1, north2, both, east2 = sea
    up = max(end_depth + height, LEAST_HEIGHT)
    r = math.sqrt(offset_north * offset_north + offset_east * offset_east + up * up)
    gn, ge = (offset_north + up * north1) / r, (offset_east + up * east1) / r
    hnn = (1 + north1 * north1 + up * north2 - gn * gn) / r
    hne = (north1 * east1 + up * both - gn * ge) / r
    hee = (1 + east1 * east1 + up * east2 - ge * ge) / r
    return r, gn, ge, hnn, hne, hee, up / r, (up - offset_north * north1 - offset_east * east1) / r, up


@njit(cache=True, nogil=True, error_model="numpy")
def path_third_derivative(
    unit_north: float, unit_east: float, path: PathDerivatives, sea: SurfaceDerivatives, third: float
) -> float:
    """Third derivative of `end_to_surface_path` as its point moves along a unit vector, given the sea's [1/m^2]."""
    first = unit_north * sea[1] + unit_east * sea[2]
    second = unit_north * unit_north * sea[3] + 2 * unit_north * unit_east * sea[4] + unit_east * unit_east * sea[5]
    r, up = path[0], path[8]
    r1 = unit_north * path[1] + unit_east * path[2]
    r2 = unit_north * unit_north * path[3] + 2 * unit_north * unit_east * path[4] + unit_east * unit_east * path[5]
    return (3 * first * second + up * third - 3 * r1 * r2) / r  # from r^2, derived three times


@njit(cache=True, nogil=True, error_model="numpy")
def principal_curvatures(hnn: float, hne: float, hee: float) -> tuple[float, float, float, float]:
    """Principal curvatures of a symmetric form, and the unit vector of the first, the smaller in magnitude."""
    mean, half = (hnn + hee) / 2, (hnn - hee) / 2
    root = math.hypot(half, hne)
    angle = math.atan2(hne, half) / 2  # of the greater one
    greater, smaller = mean + root, mean - root
    if abs(greater) <= abs(smaller):
        return greater, smaller, math.cos(angle), math.sin(angle)
    return smaller, greater, -math.sin(angle), math.cos(angle)
