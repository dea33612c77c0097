"""Section of a solid by a vertical plane: points on the outline of the cut, each representing a strip across the plane.

The width of the strips is the area of the solid's surface over the length of the outline, so that all strips together
have that area; at most the extent of the solid across the plane, and of that the part within the beam.
"""

import zlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.scene.scatterers import Scatterers, target_scatterer_id
from insonify.scene.seabed import Seabed
from insonify.scene.solid import PER_ROW, SOLID_FACE, STANDING, seabed_depth_at, world_triangles
from insonify.scene.target import Solid, key_label
from insonify.scene.triangle_surfaces import Triangles

Floats = NDArray[np.float64]

MIN_SINE = 0.05
"""Smallest sine of the angle between a face and the plane in the area of its strip [1]."""


def solid_section(
    solid: Solid, seabed: Seabed, seed: int, pitch: float, occluder: int, sonar_position: Floats, bearing: float,
    width_in_beam: Callable[[float], float], *, quadrature: bool = False,
) -> Scatterers:  # fmt: skip
    """Points on the outline of the cut of a vertical plane through a solid, above the seabed.

    Args:
        solid: The solid.
        seabed: Seabed that it lies on; the buried part is left out.
        seed: Seed of the scenario.
        pitch: Largest distance of points along the outline [m].
        occluder: Row of this solid among the scene's occluders.
        sonar_position: A point of the plane: north, east, ... [m].
        bearing: Bearing of the plane [rad].
        width_in_beam: Width within the two-way beam [m] as a function of a width across the plane, centred on it [m].
        quadrature: True: evenly spaced points, for an expectation; False: random points.

    Returns:
        The points; none if the plane misses the solid.
    """
    across = np.array([-np.sin(bearing), np.cos(bearing), 0.0])
    surface = world_triangles(solid, seabed)
    distance = np.asarray(surface.corners, float) @ across - float(np.asarray(sonar_position, float)[:2] @ across[:2])
    starts, ends, normal = cut_segments(surface, distance)
    length = np.linalg.norm(ends - starts, axis=1)
    count = np.maximum(np.ceil(length / pitch), 1).astype(int)
    row = np.repeat(np.arange(len(length)), count)
    n = np.arange(len(row))
    u = random_keys.uniforms(
        seed, random_keys.TARGET, n // PER_ROW, n % PER_ROW, SOLID_FACE, zlib.crc32(key_label(solid).encode())
    )
    segment_fraction = n - np.repeat(np.cumsum(count) - count, count) + (0.5 if quadrature else u[:, 0])
    position = starts[row] + (segment_fraction / count[row])[:, None] * (ends - starts)[row]
    # a face that is not perpendicular to the plane has more area in a strip of the same width
    strip_length = (length / count)[row] / np.sqrt(np.maximum(1 - (normal[row] @ across) ** 2, MIN_SINE**2))
    width = min(float(np.ptp(distance)), float(surface.area.sum()) / max(float(strip_length.sum()), 1e-12))
    points = Scatterers(
        object=solid.label, boundary="target", law=solid.scattering, position=position, normal=normal[row],
        area=strip_length * width_in_beam(width), phase=np.exp(2j * np.pi * u[:, 1]),
        scatterer_id=target_scatterer_id(key_label(solid), SOLID_FACE, n // PER_ROW, n % PER_ROW),
        has_random_phase=True, occluder=occluder,
    )  # fmt: skip
    return points.take(position[:, 2] < seabed_depth_at(seabed, position[:, :2]) - STANDING)


def cut_segments(surface: Triangles, distance: Floats) -> tuple[Floats, Floats, Floats]:
    """Both ends of the segments in which a plane cuts triangles [m], and the triangles' unit normals, each (s, 3).

    Args:
        surface: The triangles.
        distance: Signed distance of their corners from the plane [m], shape (t, 3).
    """
    above = distance >= 0  # a corner on the plane counts as above it: no segment is cut twice
    crossed = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    corners, distance, above = np.asarray(surface.corners, float)[crossed], distance[crossed], above[crossed]
    apex = np.argmax(above != (above.sum(axis=1, keepdims=True) == 2), axis=1)  # the only corner on its side
    k = np.arange(len(crossed))
    apex_position, apex_distance = corners[k, apex], distance[k, apex]
    ends = []
    for step in (1, 2):
        other = (apex + step) % 3
        part = apex_distance / (apex_distance - distance[k, other])
        ends.append(apex_position + part[:, None] * (corners[k, other] - apex_position))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return ends[0], ends[1], normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
