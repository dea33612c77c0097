"""Solids in the world frame: positions of their triangles, interior points, and random points on their faces.

Solids that emerge are cut at the mean surface, since their upper part has no effect on sound in the water. The cut is
left open, since no sound arrives there.
"""

import zlib
from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify import random_keys
from insonify.frames import pose_rotation
from insonify.model import field_error
from insonify.recent_results import RecentResults
from insonify.scene.clipping import TOUCHING, clip_triangles
from insonify.scene.scatterers import Scatterers, target_scatterer_id
from insonify.scene.seabed import Seabed
from insonify.scene.surface_cells import SurfaceCells, surface_cells
from insonify.scene.target import Box, Cylinder, Solid, key_label, whole_solid
from insonify.scene.triangle_surfaces import Triangles

Floats = NDArray[np.float64]

MAX_POINTS = 500_000
"""Largest number of random points of one solid [1]."""
MIN_POINTS = 400
"""Smallest number of points of one solid, so that the speckle of a small one is fully developed [1]."""
STANDING = 1e-6  # a face this close to the seabed lies on it [m]
UPRIGHT = 1e-9  # sine of the angle from upright below which a cylinder stands [1]
SOLID_FACE = 6  # number of the face in the keys of a solid
PER_ROW = 4096  # cells in each row of the keys of a solid


def seabed_depth_at(seabed: Seabed, position: Floats) -> Floats:
    """Depth of the seabed under some positions [m]; NaN where it is unknown.

    Args:
        seabed: The seabed.
        position: North and east [m], shape (..., 2).
    """
    return seabed.depth_at(position[..., 0], position[..., 1])


@lru_cache(maxsize=1024)
def body_triangles(solid: Solid) -> Triangles:
    """Surface of a solid in its own axes (forward, starboard, down), with its middle at the origin, cached."""
    return solid.triangles()


@lru_cache(maxsize=1024)
def height(solid: Solid) -> float:
    """Height of a solid as it leans, from its lowest point to its highest [m]."""
    leaning = _rotated_triangles(solid)
    return float(leaning.high[2] - leaning.low[2])


def footprint(solid: Solid) -> tuple[float, float, tuple[float, float]]:
    """Length of a solid's footprint along its heading, width across it [m], and north and east of its middle [m]."""
    rotated = body_triangles(solid).transformed(pose_rotation(0.0, solid.pitch, solid.roll), np.zeros(3))
    length, width = (float(side) for side in (rotated.high - rotated.low)[:2])
    forward, starboard = ((rotated.high + rotated.low) / 2)[:2]
    c, s = np.cos(solid.heading), np.sin(solid.heading)
    north, east = solid.position
    return length, width, (float(north + c * forward - s * starboard), float(east + s * forward + c * starboard))


def _rotated_triangles(solid: Solid) -> Triangles:
    """Surface of a solid in its attitude, with its middle at the origin."""
    return body_triangles(solid).transformed(pose_rotation(solid.heading, solid.pitch, solid.roll), np.zeros(3))


@lru_cache(maxsize=1024)
def resting_pose(solid: Solid, seabed: Seabed) -> tuple[Floats, Floats]:
    """Pose of a solid in the world: rotation from its own axes, (3, 3), and position of its middle [m], (3,).

    The lowest point is at the base depth, or below the seabed by the depth of burial.
    """
    leaning = _rotated_triangles(whole_solid(solid))
    base = solid.base_depth
    if base is None:
        sunk = solid.burial_depth + solid.burial * (leaning.high[2] - leaning.low[2])
        base = float(seabed_depth_at(seabed, np.array(solid.position)) + sunk)
    shift = np.array([*solid.position, base - leaning.high[2]])
    return pose_rotation(solid.heading, solid.pitch, solid.roll), shift


@lru_cache(maxsize=1024)
def complete_triangles(solid: Solid, seabed: Seabed) -> Triangles:
    """Surface of a solid in the world, including what is above the water: north, east, depth [m]."""
    return body_triangles(solid).transformed(*resting_pose(solid, seabed))


def emerges(solid: Solid, seabed: Seabed) -> bool:
    """Return True if the top of a solid is at the mean surface of the water or above it."""
    return bool(complete_triangles(solid, seabed).low[2] <= TOUCHING)


@lru_cache(maxsize=1024)
def submerged(solid: Solid, seabed: Seabed) -> Solid:
    """A solid whose emerging part is cut off if it is an upright box or cylinder; other solids unchanged."""
    base = float(complete_triangles(whole_solid(solid), seabed).high[2])
    changes: dict[str, object] = {"base_depth": base, "burial": 0.0, "burial_depth": 0.0}
    if emerges(solid, seabed):
        match solid:
            case Box(size=(length, width, _), pitch=0.0, roll=0.0):
                return solid.unchecked_copy(size=(length, width, base), **changes)
            case Cylinder() if abs(np.cos(solid.pitch)) < UPRIGHT:
                return solid.unchecked_copy(length=base, **changes)
    return solid


@lru_cache(maxsize=1024)
def world_triangles(solid: Solid, seabed: Seabed) -> Triangles:
    """Surface of the submerged part of a solid in the world: north, east, depth [m]; open at the mean surface."""
    surface = complete_triangles(submerged(solid, seabed), seabed)
    if not emerges(solid, seabed):
        return surface
    corners = clip_triangles(surface.corners, surface.corners[..., 2])
    return Triangles(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))


def solid_scatterers(
    solid: Solid, seabed: Seabed, seed: int, pitch: float, occluder: int, *, quadrature: bool = False
) -> Scatterers:
    """Points on the faces of a solid in the water, one for each cell of its surface.

    Cells have equal areas and are fixed to the body's own axes, so that points and phases on the body do not depend on
    its pose or on other targets.

    Args:
        solid: The solid.
        seabed: Seabed that it lies on; parts below the seabed and above the water are left out.
        seed: Seed of the scenario.
        pitch: Side of a cell [m].
        occluder: Row of this solid among the scene's occluders.
        quadrature: True: evenly spaced points, for an expectation.
    """
    rotation, shift = resting_pose(solid, seabed)
    body = body_triangles(solid)
    if emerges(solid, seabed):
        rotation, shift = resting_pose(submerged(solid, seabed), seabed)
        body = world_triangles(solid, seabed).transformed(rotation.T, -shift @ rotation)
    area = float(body.area.sum())
    cells = (_even_points if quadrature else _cells)(body, cell_side(area, pitch))
    n = np.arange(len(cells))
    u = random_keys.uniforms(
        seed, random_keys.TARGET, n // PER_ROW, n % PER_ROW, SOLID_FACE, zlib.crc32(key_label(solid).encode())
    )
    point, normal = cells.points(u[:, :3]) if isinstance(cells, SurfaceCells) else np.moveaxis(cells, 1, 0)
    position = point @ rotation.T + shift
    points = Scatterers(
        object=solid.label, boundary="target", law=solid.scattering, position=position, normal=normal @ rotation.T,
        area=np.full(len(n), area / len(n)), phase=np.exp(2j * np.pi * u[:, 3]),
        scatterer_id=target_scatterer_id(key_label(solid), SOLID_FACE, n // PER_ROW, n % PER_ROW),
        has_random_phase=True, occluder=occluder,
    )  # fmt: skip
    return points.take(position[:, 2] < seabed_depth_at(seabed, position[:, :2]) - STANDING)


def _cells(body: Triangles, side: float) -> SurfaceCells:
    """Cells of a surface in its own axes, the same for all seeds."""
    return _CELLS.get((body.corners.tobytes(), side), lambda: surface_cells(body, side))


def _even_points(body: Triangles, side: float) -> Floats:
    """Evenly spaced points on a surface in its own axes [m], and unit normals there, shape (n, 2, 3)."""

    def evaluate() -> Floats:
        cells = surface_cells(body, side)
        return np.stack(cells.points(np.empty((len(cells), 3)), quadrature=True), axis=1)

    return _EVEN_POINTS.get((body.corners.tobytes(), side), evaluate)


_CELLS: RecentResults[SurfaceCells] = RecentResults(4)
_EVEN_POINTS: RecentResults[Floats] = RecentResults(16)  # many scenes of a data set have the same shape


def surface_area(solid: Solid, seabed: Seabed) -> float:
    """Area of a solid's surface under water [m^2]; bit-identical for all poses of a submerged solid.

    Args:
        solid: The solid.
        seabed: Seabed on which it rests.
    """
    surface = world_triangles(solid, seabed) if emerges(solid, seabed) else body_triangles(solid)
    return float(surface.area.sum())


def cell_side(area: float, pitch: float) -> float:
    """Side of the cells of a solid [m]: the requested one within the limits of `MAX_POINTS` and `MIN_POINTS`.

    Args:
        area: Area of the surface [m^2].
        pitch: Requested side [m].
    """
    return float(np.clip(pitch, np.sqrt(area / MAX_POINTS), np.sqrt(area / MIN_POINTS)))


def inside_solid(surface: Triangles, position: Floats) -> NDArray[np.bool_]:
    """Mask of positions inside a surface, shape (n,): those at which its solid angle is more than 2 pi.

    Args:
        surface: A surface, open or closed.
        position: North, east, depth [m], shape (n, 3).

    Source: van Oosterom & Strackee (1983), IEEE Trans. Biomed. Eng. 30, 125, eq. 8: solid angle of a triangle.
    """
    within = np.all((position > surface.low) & (position < surface.high), axis=-1)
    for row in np.flatnonzero(within):
        a, b, c = np.moveaxis(surface.corners - position[row], 1, 0)
        la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
        triple = np.einsum("ij,ij->i", a, np.cross(b, c))
        ab, bc, ca = ((x * y).sum(axis=1) for x, y in ((a, b), (b, c), (c, a)))
        angle = 2 * np.arctan2(triple, la * lb * lc + ab * lc + bc * la + ca * lb)
        within[row] = abs(angle.sum()) > 2 * np.pi
    return within


def solid_errors(path: str, solid: Solid, seabed: Seabed) -> Iterator[PydanticCustomError]:
    """Errors in the position of a solid, which must be in the water.

    Args:
        path: Key of the solid in the scenario, such as "targets.0".
        solid: The solid.
        seabed: Seabed that it lies on.

    Yields:
        Errors of `field_error`.
    """
    bottom = float(seabed_depth_at(seabed, np.array(solid.position)))
    base, extent = solid.base_depth, height(solid)
    if base is not None and not 0 < base <= bottom + STANDING:
        where = f"below the seabed (depth {bottom:g} m)" if base > 0 else "at or above the sea surface (0 m)"
        sink = f" To sink it into the bed write burial_depth: {base - bottom:g} m instead." if base > bottom else ""
        yield field_error(f"{path}.base_depth", f"{base:g} m", f"is {where}. Depths are positive downwards; write a "
                      f"depth above 0 m and up to {bottom:g} m.{sink}")  # fmt: skip
        return
    if extent <= 0:
        yield field_error(path, f"{solid.label}", "has no height as it lies: it is flat. Give it some, or turn it.")
        return
    if solid.burial_depth >= extent:
        yield field_error(f"{path}.burial_depth", f"{solid.burial_depth:g} m", f"buries all of it: it is {extent:.3g} "
                      f"m high as it lies. Write less than {extent:.3g} m.")  # fmt: skip
        return
