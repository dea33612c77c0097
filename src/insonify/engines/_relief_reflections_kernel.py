"""Straight legs off local planes: their nodes over the seabed, and their columns. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.image_path_kernel import ImagePaths, bounce_fresnel_zone

Floats = NDArray[Any]
Integers = NDArray[np.int64]

CLEAR, FACING_AWAY, OCCLUDED, GROUND = 0, 1, 2, -2  # the values of records.legs.LegStatus and SEABED


@njit(cache=True, nogil=True, error_model="numpy")
def set_path_nodes(
    way: ImagePaths, place: Floats, points: Floats, distance: Floats, wavelength: float, nodes: Floats, spared: Floats
) -> None:
    """Ends of all segments of some paths, as arguments of `TerrainOcclusion.image_paths_clear`.

    Args:
        way: The paths, n of them, each reflected at m planes.
        place: North, east, depth of the sonar's end [m], (3,).
        points: The same of the points [m], (n, 3).
        distance: Horizontal distance of the points [m], (n,).
        wavelength: Acoustic wavelength [m].
        nodes: Result, horizontal distance and depth [m], (m + 2, n, 2).
        spared: Result, half the length of the zone about each [m], (m + 2, n).
    """
    count = way.fraction.shape[0]
    for n in range(distance.size):
        once = 1 / max(distance[n], 1e-9)
        north, east = (points[n, 0] - place[0]) * once, (points[n, 1] - place[1]) * once
        nodes[0, n, 0], nodes[0, n, 1], spared[0, n] = 0.0, place[2], 0.0
        nodes[count + 1, n, 0], nodes[count + 1, n, 1], spared[count + 1, n] = distance[n], points[n, 2], 0.0
        for k in range(count):
            along = (way.bounce_position[k, n, 0] - place[0]) * north + (way.bounce_position[k, n, 1] - place[1]) * east
            nodes[k + 1, n, 0] = min(max(along, 0.0), distance[n])
            nodes[k + 1, n, 1] = way.bounce_position[k, n, 2]
            spared[k + 1, n] = bounce_fresnel_zone(
                way.length[n], way.fraction[k, n], way.grazing_sine[k, n], wavelength
            )[0]


@njit(cache=True, nogil=True, error_model="numpy")
def write_bounced_legs(
    some: Integers, way: ImagePaths, reflection: Floats, attenuation: Floats, clear: NDArray[np.bool_], normals: Floats,
    slowness: float, soft: bool, delay: Floats, length: Floats, spreading: Floats, absorption: Floats, boundary: Floats,
    departure: Floats, arrival: Floats, grazing: Floats, status: Floats, occluder: Floats, visibility: Floats,
) -> None:  # fmt: skip
    """Overwrite some legs of one family; columns are those of `Legs`, one row of each.

    Args:
        some: Numbers of the points that the legs reach, (n,).
        way: The paths off local planes, n of them.
        reflection: Product of the reflection coefficients [1], (n,).
        attenuation: Factor of absorption on the pressure [1], (n,).
        clear: True if the paths exist and are not occluded by the seabed, (n,).
        normals: Unit normals of all points, (all, 3).
        slowness: One over the speed of sound [s/m].
        soft: True if `visibility` is the factor of terrain alone on legs that targets cut.
        delay: Result, (all,), as are those that follow; directions are of shape (all, 3).
        length: Result.
        spreading: Result.
        absorption: Result.
        boundary: Result.
        departure: Result.
        arrival: Result.
        grazing: Result.
        status: Changed; in: that of the leg over the mean plane, cut by targets or clear.
        occluder: Changed where the seabed occludes.
        visibility: Result, factor on the pressure of each leg [1], (all,).
    """
    for m in range(some.size):
        n = some[m]
        delay[n], length[n], spreading[n] = way.length[m] * slowness, way.length[m], 1 / way.length[m]
        absorption[n], boundary[n] = attenuation[m], reflection[m]
        sine = 0.0
        for i in range(3):
            departure[n, i], arrival[n, i] = way.departure[m, i], way.arrival[m, i]
            sine -= way.arrival[m, i] * normals[n, i]
        grazing[n] = math.asin(min(max(sine, -1.0), 1.0))
        free = normals[n, 0] == 0 and normals[n, 1] == 0 and normals[n, 2] == 0
        behind = sine <= 0 and not free
        # a face turned away from the ray off the mean plane may face this one
        now, left = (CLEAR, visibility[n] * 0 + 1) if status[n] == FACING_AWAY else (status[n], visibility[n])
        if now == CLEAR and behind:
            now = FACING_AWAY
        if behind:
            left = left * 0
        if now == CLEAR and not clear[m]:
            now, occluder[n], left = OCCLUDED, GROUND, left * 0
        if soft and now == OCCLUDED:
            left = left * 0 + clear[m]
        status[n], visibility[n] = now, left
