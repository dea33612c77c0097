"""Section of a solid by a vertical plane: the outline of the cut as points, each standing for a strip across the plane.

Strips are as wide as the solid is on the average, its surface over its outline, so that all of them together have its
area; and no wider than it extends across the plane, or than the beam covers of that.
"""

import zlib
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.scene.scatterers import Scatterers, target_scatterer_id
from insonify.scene.seabed import Seabed
from insonify.scene.solid import ROW, SOLID_FACE, STANDING, seabed_depth_at, world_triangles
from insonify.scene.target import Solid, key_label
from insonify.scene.triangle_surfaces import Triangles

Floats = NDArray[np.float64]

FLATTEST = 0.05
"""Sine of the angle between a face and the plane below which its strip grows no wider [1]."""


def solid_section(
    solid: Solid, seabed: Seabed, seed: int, pitch: float, occluder: int, sonar_position: Floats, bearing: float,
    covered: Callable[[float], float], *, quadrature: bool = False,
) -> Scatterers:  # fmt: skip
    """Points on the outline that a vertical plane cuts out of a solid, where water can reach it.

    Args:
        solid: The solid.
        seabed: Seabed that it lies on; what has sunk in is left out.
        seed: Seed of the scenario.
        pitch: Largest distance of points along the outline [m].
        occluder: Row of this solid among the scene's occluders.
        sonar_position: A point of the plane: north, east, ... [m].
        bearing: Bearing of the plane [rad].
        covered: Width within the two-way beam [m] as a function of a width across the plane, centred on it [m].
        quadrature: Evenly spaced points, for an expectation, instead of random ones.

    Returns:
        The points; none where the plane misses the solid.
    """
    aside = np.array([-np.sin(bearing), np.cos(bearing), 0.0])
    surface = world_triangles(solid, seabed)
    off = np.asarray(surface.corners, float) @ aside - float(np.asarray(sonar_position, float)[:2] @ aside[:2])
    starts, ends, normal = _cut(surface, off)
    length = np.linalg.norm(ends - starts, axis=1)
    count = np.maximum(np.ceil(length / pitch), 1).astype(int)
    row = np.repeat(np.arange(len(length)), count)
    n = np.arange(len(row))
    u = random_keys.uniforms(
        seed, random_keys.TARGET, n // ROW, n % ROW, SOLID_FACE, zlib.crc32(key_label(solid).encode())
    )
    within = n - np.repeat(np.cumsum(count) - count, count) + (0.5 if quadrature else u[:, 0])
    position = starts[row] + (within / count[row])[:, None] * (ends - starts)[row]
    # a face that leans against the plane has more area in a strip of the same width
    long = (length / count)[row] / np.sqrt(np.maximum(1 - (normal[row] @ aside) ** 2, FLATTEST**2))
    width = min(float(np.ptp(off)), float(surface.area.sum()) / max(float(long.sum()), 1e-12))
    points = Scatterers(
        object=solid.label, boundary="target", law=solid.scattering, position=position, normal=normal[row],
        area=long * covered(width), phase=np.exp(2j * np.pi * u[:, 1]),
        scatterer_id=target_scatterer_id(key_label(solid), SOLID_FACE, n // ROW, n % ROW), has_random_phase=True,
        occluder=occluder,
    )  # fmt: skip
    return points.take(position[:, 2] < seabed_depth_at(seabed, position[:, :2]) - STANDING)


def _cut(surface: Triangles, off: Floats) -> tuple[Floats, Floats, Floats]:
    """Segments that a plane cuts out of triangles, and their unit normals, each of shape (s, 3).

    Args:
        surface: The triangles.
        off: Distance of their corners from the plane, with its sign [m], shape (t, 3).
    """
    above = off >= 0  # a corner on the plane counts as above it: no segment is cut twice
    crossed = np.flatnonzero(above.any(axis=1) & ~above.all(axis=1))
    corners, off, above = np.asarray(surface.corners, float)[crossed], off[crossed], above[crossed]
    alone = np.argmax(above != (above.sum(axis=1, keepdims=True) == 2), axis=1)  # the corner by itself on its side
    k = np.arange(len(crossed))
    tip, high = corners[k, alone], off[k, alone]
    ends = []
    for step in (1, 2):
        other = (alone + step) % 3
        part = high / (high - off[k, other])
        ends.append(tip + part[:, None] * (corners[k, other] - tip))
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return ends[0], ends[1], normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
