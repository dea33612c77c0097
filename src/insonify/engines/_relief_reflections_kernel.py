"""Straight legs reflected at local planes: ends of their segments, and their columns. Plain numbers and arrays only."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.image_path_kernel import ImagePaths, bounce_fresnel_zone

Floats = NDArray[Any]
Integers = NDArray[np.int64]

CLEAR, FACING_AWAY, OCCLUDED, GROUND = 0, 1, 2, -2  # the values of records.legs.LegStatus and SEABED


@njit(cache=True, nogil=True, error_model="numpy")
def set_path_nodes(
    path: ImagePaths,
    end: Floats,
    points: Floats,
    distance: Floats,
    wavelength: float,
    nodes: Floats,
    bounce_margin: Floats,
) -> None:
    """Fill the ends of all segments of some paths, as arguments of `TerrainOcclusion.image_paths_clear`.

    Args:
        path: The paths, n of them, each reflected at m planes.
        end: North, east, depth of transmitter or receiver [m], (3,).
        points: North, east, depth of the points [m], (n, 3).
        distance: Horizontal distance of the points [m], (n,).
        wavelength: Acoustic wavelength [m].
        nodes: Result, horizontal distance and depth [m], (m + 2, n, 2).
        bounce_margin: Result, half length of the first Fresnel zone about each bounce [m], (m + 2, n).
    """
    count = path.fraction.shape[0]
    for n in range(distance.size):
        once = 1 / max(distance[n], 1e-9)
        north, east = (points[n, 0] - end[0]) * once, (points[n, 1] - end[1]) * once
        nodes[0, n, 0], nodes[0, n, 1], bounce_margin[0, n] = 0.0, end[2], 0.0
        nodes[count + 1, n, 0], nodes[count + 1, n, 1] = distance[n], points[n, 2]
        bounce_margin[count + 1, n] = 0.0
        for k in range(count):
            along = (path.bounce_position[k, n, 0] - end[0]) * north + (path.bounce_position[k, n, 1] - end[1]) * east
            nodes[k + 1, n, 0] = min(max(along, 0.0), distance[n])
            nodes[k + 1, n, 1] = path.bounce_position[k, n, 2]
            bounce_margin[k + 1, n] = bounce_fresnel_zone(
                path.length[n], path.fraction[k, n], path.grazing_sine[k, n], wavelength
            )[0]


class ReflectedPaths(NamedTuple):
    """Paths of one family to n points, reflected at local planes."""

    path: ImagePaths
    """Their geometry."""
    reflection: Floats
    """Product of the reflection coefficients [1], (n,)."""
    attenuation: Floats
    """Factor of absorption on the pressure [1], (n,)."""
    is_clear: NDArray[np.bool_]
    """True if the paths exist and are not occluded by the seabed, (n,)."""


class BouncedLegs(NamedTuple):
    """Legs of one family to all N points: one row of columns of `Legs`."""

    delay: Floats
    """One-way travel time [s], (N,)."""
    length: Floats
    """Path length [m], (N,)."""
    spreading: Floats
    """Spreading re 1 m [1], (N,)."""
    absorption: Floats
    """Factor of absorption on the pressure [1], (N,)."""
    reflection_coefficient: Floats
    """Product of the reflection coefficients [1], (N,)."""
    departure: Floats
    """Direction of travel at the sonar, (N, 3)."""
    arrival: Floats
    """Direction of travel at the point, (N, 3)."""
    grazing_sine: Floats
    """Sine of the angle between the ray and the point's interface [1], (N,)."""
    status: Floats
    """`LegStatus`, (N,)."""
    occluder: Floats
    """Row of the occluder, -1 for none, (N,)."""
    visibility: Floats
    """Factor of occlusion on the pressure [1], (N,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def write_bounced_legs(
    legs: BouncedLegs, reflected_rows: Integers, reflected: ReflectedPaths, normal: Floats, slowness: float, soft: bool
) -> None:
    """Overwrite some legs of one family.

    Args:
        legs: The legs over the mean seabed with their occlusion by targets; overwritten.
        reflected_rows: Indices of the points that the paths reach, (n,).
        reflected: The paths reflected at local planes, n of them.
        normal: Unit normals of all points, 0 for points without a facet [1], (N, 3).
        slowness: One over the speed of sound [s/m].
        soft: True if `visibility` is the factor of terrain alone on legs that targets cut.
    """
    path, reflection, attenuation, clear = reflected
    (
        delay, length, spreading, absorption, boundary, departure, arrival, grazing_sine, status, occluder, visibility,
    ) = legs  # fmt: skip
    for m in range(reflected_rows.size):
        n = reflected_rows[m]
        delay[n], length[n], spreading[n] = path.length[m] * slowness, path.length[m], 1 / path.length[m]
        absorption[n], boundary[n] = attenuation[m], reflection[m]
        sine = 0.0
        for i in range(3):
            departure[n, i], arrival[n, i] = path.departure[m, i], path.arrival[m, i]
            sine -= path.arrival[m, i] * normal[n, i]
        grazing_sine[n] = min(max(sine, -1.0), 1.0)
        has_no_facet = normal[n, 0] == 0 and normal[n, 1] == 0 and normal[n, 2] == 0
        behind = sine <= 0 and not has_no_facet
        # a facet that faces away from the leg over the mean seabed may face this one
        leg_status, leg_visibility = (
            (CLEAR, visibility[n] * 0 + 1) if status[n] == FACING_AWAY else (status[n], visibility[n])
        )
        if leg_status == CLEAR and behind:
            leg_status = FACING_AWAY
        if behind:
            leg_visibility = leg_visibility * 0
        if leg_status == CLEAR and not clear[m]:
            leg_status, occluder[n], leg_visibility = OCCLUDED, GROUND, leg_visibility * 0
        if soft and leg_status == OCCLUDED:
            leg_visibility = leg_visibility * 0 + clear[m]
        status[n], visibility[n] = leg_status, leg_visibility
