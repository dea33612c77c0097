"""Scene in the form of the tracer's kernels: triangles, and terrain tiles loaded as rays reach them.

Coordinates are those of the scatterer grid, so that results do not change when the whole scene is moved. Upright boxes
are triangulated like all other bodies.
"""

from functools import lru_cache
from threading import Lock
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer._refracted_ray_kernel import (
    RefractingScene,
    clear_refracted_paths,
    refracted_hits,
)
from insonify.engines.tracer._terrain_hit_kernel import BLOCK, TerrainTiles
from insonify.engines.tracer._trace_kernel import FirstHits, clear_image_paths, first_hits
from insonify.propagation.families import bounce_sequence
from insonify.propagation.sound_speed_layers import SoundSpeedLayers, scene_layers
from insonify.propagation.triangle_tree import TriangleTree, triangle_tree
from insonify.scene.heightmap_synthesis import HeightmapSynthesizer
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.scene import Scene
from insonify.scene.seabed_terrain import TILE_CELLS, SeabedTerrain
from insonify.scene.solid import body_triangles, world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

MAX_TILES = 8192
"""Number of terrain tiles that are cached: about 140 MB [1]."""
CELL_DIVISIONS = 2
"""Parts into which the side of the map's cells is divided [1]. Undivided cells are an eighth of the shortest
wavelength; bilinear facets of them are less steep than the relief. At 5 cm rms it then scatters 0.1 dB too little at 4
degrees, with half cells 0.02 dB."""
MAX_FLAT_ANGLE, MIN_EDGE_ANGLE = 2e-3, 0.5
"""Angles between neighbouring triangles: those of one flat face are below the first, edges between faces above the
second [rad]."""
COPLANAR_LIMIT = 1e-4
"""Distance between planes [m], and angle [rad], below which they are one."""
MAX_PLANES = 64
"""Largest number of planes of faces by which receive legs are searched [1]."""


class TracingScene:
    """Scene in the tracer's representation; shared by all pings and threads."""

    def __init__(self, scene: Scene) -> None:
        """Build the tree of the bodies; terrain tiles are loaded when rays reach them."""
        self.scene, self.scatterer_grid, self.terrain = scene, scene.seabed.scatterer_grid, scene.seabed.terrain
        self.solids: tuple[Solid, ...] = scene.solids_of_one_law
        self.bodies = _scene_tree(scene)
        self.tile_cache = None if self.terrain is None else TerrainTileCache(self.terrain)
        self.water: SoundSpeedLayers | None = None
        if scene.water.layered:
            self.water = scene_layers(scene)

    def to_grid_axes(self, vector: Floats) -> Floats:
        """Vectors rotated from north, east, down to the scatterer grid's frame, shape (..., 3)."""
        return np.asarray(vector @ grid_rotation(self.scatterer_grid).T)

    def to_grid_frame(self, position: Floats) -> Floats:
        """Positions transformed from north, east, down to the scatterer grid's frame [m], shape (..., 3)."""
        return np.concatenate([self.scatterer_grid.from_world(position[..., :2]), position[..., 2:]], axis=-1)

    def intersector(self, origin: Floats, farthest: float) -> "RayIntersector":
        """Intersector of rays within a distance [m] of a position in the scatterer grid's frame [m]."""
        if self.terrain is not None and self.tile_cache is not None and len(self.tile_cache.rows) > MAX_TILES:
            self.tile_cache = TerrainTileCache(self.terrain)  # intersectors in use keep the old cache
        return RayIntersector(self, origin, farthest)


class TerrainTileCache:
    """Terrain tiles that have been loaded; rows are added and never replaced."""

    def __init__(self, terrain: SeabedTerrain) -> None:
        """Create an empty cache."""
        self.terrain, self.lock = terrain, Lock()
        self.synthesizer = HeightmapSynthesizer(terrain.relief.resolved, terrain.heightmap_cell_size / CELL_DIVISIONS)
        self.rows: dict[tuple[int, int], int] = {}
        blocks = TILE_CELLS // BLOCK
        self.tiles = np.empty((64, TILE_CELLS + 1, TILE_CELLS + 1), np.float32)
        self.block_maxima = np.empty((64, blocks, blocks), np.float32)
        self.tile_maxima = np.empty(64, np.float32)

    def fetch(self, along: int, across: int) -> int:
        """Row of a tile in `tiles`, by its numbers in the scatterer grid; a new tile is synthesised. Hold `lock`."""
        key = (along, across)
        if key not in self.rows:
            row = len(self.rows)
            if row == len(self.tiles):
                self.tiles, self.block_maxima, self.tile_maxima = (
                    np.concatenate([rows_so_far, np.empty_like(rows_so_far)])
                    for rows_so_far in (self.tiles, self.block_maxima, self.tile_maxima)
                )
            tile = self.synthesizer.heights(along, across)
            self.tiles[row] = tile
            heights = np.where(np.isnan(tile), -np.inf, tile)
            corners = (heights[:-1, :-1], heights[1:, :-1], heights[:-1, 1:], heights[1:, 1:])
            cells = np.maximum.reduce(corners)
            side = TILE_CELLS // BLOCK
            self.block_maxima[row] = cells.reshape(side, BLOCK, side, BLOCK).max(axis=(1, 3))
            self.tile_maxima[row] = self.block_maxima[row].max()
            self.rows[key] = row
        return self.rows[key]


class RayIntersector:
    """Intersection of rays with the seabed, the surface and bodies of one ping."""

    def __init__(self, tracing_scene: TracingScene, origin: Floats, farthest: float) -> None:
        """Set up the table of tiles about a position, with those that are loaded already.

        Args:
            tracing_scene: Bodies and terrain tiles of the scene.
            origin: Middle of the table, in the scatterer grid's frame [m], shape (>= 2,).
            farthest: Horizontal distance that the table covers [m].
        """
        tile_cache = tracing_scene.tile_cache
        self._scene_tree, self._tile_cache = tracing_scene.bodies, tile_cache
        self.water, self._speed = tracing_scene.water, tracing_scene.scene.water.sound_speed
        if tile_cache is None:
            self.terrain = _flat_tiles(tracing_scene.scene.seabed.depth)
            return
        terrain = tile_cache.terrain
        cell = tile_cache.synthesizer.cell
        side = cell * TILE_CELLS
        corner = np.floor((origin[:2] - farthest) / side).astype(int) - 1
        size = np.floor((origin[:2] + farthest) / side).astype(int) + 2 - corner
        low, high = terrain.relief.span
        row_of_tile = np.full(size, -1, np.int32)
        with tile_cache.lock:
            for (along, across), row in tile_cache.rows.items():
                p, q = along - corner[0], across - corner[1]
                if 0 <= p < size[0] and 0 <= q < size[1]:
                    row_of_tile[p, q] = row
        self.terrain = TerrainTiles(
            float(terrain.depth), cell, float(low), float(high), int(corner[0]), int(corner[1]),
            row_of_tile, tile_cache.tiles, tile_cache.block_maxima, tile_cache.tile_maxima,
        )  # fmt: skip

    def _fetch_missing(self, missing: Mask) -> bool:
        """Load the tiles that rays have marked as missing; return False if there are none."""
        tile_cache = self._tile_cache
        if tile_cache is None or not missing.any():
            return False
        with tile_cache.lock:
            row_of_tile = self.terrain.row_of_tile.copy()
            for p, q in np.argwhere(missing):
                row_of_tile[p, q] = tile_cache.fetch(int(p) + self.terrain.corner_a, int(q) + self.terrain.corner_b)
            self.terrain = self.terrain._replace(
                row_of_tile=row_of_tile, tiles=tile_cache.tiles, block_maxima=tile_cache.block_maxima,
                tile_maxima=tile_cache.tile_maxima,
            )  # fmt: skip
        return True

    def _refracting(self, water: SoundSpeedLayers) -> RefractingScene:
        """Water and obstacles, with the terrain tiles that are loaded."""
        return RefractingScene(self.terrain, self._scene_tree, water)

    def hits(self, origin: Floats, direction: Floats, farthest: Floats) -> FirstHits:
        """First hits of rays within a path length, see `first_hits` and `refracted_hits`."""
        water, hits = self.water, _no_hits(len(origin))
        while True:
            missing = np.zeros(self.terrain.row_of_tile.shape, bool)
            if water is None:
                first_hits(origin, direction, farthest, self.terrain, self._scene_tree, missing, hits)
            else:
                refracted_hits(origin, direction, farthest, self._refracting(water), missing, hits)
            if not self._fetch_missing(missing):
                break
        if water is not None:
            return hits
        position = origin + hits.distance[:, None] * direction
        return hits._replace(delay=hits.distance / self._speed, position=position, direction=direction)

    def is_clear_straight(self, end: Floats, position: Floats, family: str, wavelength: float, requested: Mask) -> Mask:
        """Return True for positions that a straight reflected path reaches, see `clear_image_paths`.

        Args:
            end: Position, or positions, from which the paths come, in the scatterer grid's frame [m], (3,) or (n, 3).
            position: The positions in the same frame [m], shape (n, 3).
            family: Letters of the reflections from the sonar outwards, D for none.
            wavelength: Acoustic wavelength [m].
            requested: Positions to test, shape (n,).
        """
        bottom = np.array([letter == "B" for letter in bounce_sequence(family)], bool)
        ends = np.ascontiguousarray(np.broadcast_to(end, position.shape))
        while True:
            is_clear, missing = requested.copy(), np.zeros(self.terrain.row_of_tile.shape, bool)
            clear_image_paths(ends, position, bottom, wavelength, self.terrain, self._scene_tree, missing, is_clear)
            if not self._fetch_missing(missing):
                return is_clear

    def is_clear_refracted(
        self, position: Floats, departure: Floats, length: Floats, family: str, wavelength: float, requested: Mask
    ) -> Mask:
        """Return True for positions that a refracted reflected path reaches, see `clear_refracted_paths`.

        Args:
            position: The positions, in the scatterer grid's frame [m], shape (n, 3).
            departure: Directions in which the paths leave them for the sonar [1], shape (n, 3).
            length: Path lengths [m], shape (n,).
            family: Letters of the reflections from the sonar outwards, D for none.
            wavelength: Acoustic wavelength [m].
            requested: Positions to test, shape (n,).
        """
        bottom, water = np.array([letter == "B" for letter in reversed(bounce_sequence(family))], bool), self.water
        assert water is not None  # straight rays have `is_clear_straight`
        while True:
            is_clear, missing = requested.copy(), np.zeros(self.terrain.row_of_tile.shape, bool)
            scene = self._refracting(water)
            clear_refracted_paths(position, departure, length, bottom, wavelength, scene, missing, is_clear)
            if not self._fetch_missing(missing):
                return is_clear


class FacePlane(NamedTuple):
    """Plane of a flat face in the scatterer grid's frame."""

    normal: Floats
    """Unit normal into the water [1], shape (3,)."""
    offset: float
    """Distance from the origin along the normal [m]."""

    def image(self, position: Floats) -> Floats | None:
        """Image of a position (3,) in the plane [m]; None for one behind it."""
        height = float(position @ self.normal) - self.offset
        return None if height <= COPLANAR_LIMIT else position - 2 * height * self.normal


@lru_cache(maxsize=8)
def face_planes(scene: Scene) -> tuple[FacePlane, ...]:
    """Planes of the flat faces of all occluders, those of the largest faces first, `MAX_PLANES` at most."""
    tree, solids = _scene_tree(scene), scene.solids_of_one_law
    flat = np.array([has_flat_faces(solids[row]) for row in tree.solid_row], bool)
    corner, normal = tree.corner_and_sides[flat], tree.normal[flat]
    area = np.linalg.norm(np.cross(corner[:, 3:6], corner[:, 6:]), axis=1)
    offset, remaining, planes = np.einsum("ij,ij->i", corner[:, :3], normal), area > 0, list[FacePlane]()
    for row in np.argsort(-area, kind="stable"):
        if remaining[row] and len(planes) < MAX_PLANES:
            is_parallel = normal @ normal[row] > 1 - COPLANAR_LIMIT**2 / 2
            is_same_plane = is_parallel & (np.abs(offset - offset[row]) < COPLANAR_LIMIT)
            remaining &= ~is_same_plane
            planes.append(FacePlane(normal[row], float(offset[row])))
    return tuple(planes)


def open_water_hits(
    origin: Floats, direction: Floats, farthest: float, water_depth: float, water: SoundSpeedLayers
) -> FirstHits:  # fmt: skip
    """First hits of refracted rays on the surface and on a flat seabed.

    Args:
        origin: Starting points [m], shape (n, 3).
        direction: Unit vectors [1], shape (n, 3).
        farthest: Path length beyond which no hit is searched [m].
        water_depth: Depth of the seabed [m].
        water: Sound speed, down to the seabed.
    """
    n = len(origin)
    hits = _no_hits(n)
    no_bodies = triangle_tree(np.zeros((0, 3, 3)), np.zeros(0, np.int64))
    scene = RefractingScene(_flat_tiles(water_depth), no_bodies, water)
    refracted_hits(origin, direction, np.full(n, farthest), scene, np.zeros((1, 1), bool), hits)
    return hits


def _no_hits(n: int) -> FirstHits:
    """Hits of n rays, not yet computed."""
    (distance, delay), (position, direction, normal) = np.empty((2, n)), np.empty((3, n, 3))
    return FirstHits(distance, delay, position, direction, np.empty(n, np.int8), np.empty(n, np.int64), normal)


@lru_cache(maxsize=256)
def has_flat_faces(solid: Solid) -> bool:
    """Return True if a body's faces meet at edges: no angle at an edge is small but not zero, as on a curved face."""
    surface = body_triangles(solid)
    a, b, c = np.moveaxis(surface.corners, 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    start, stop = surface.faces.reshape(-1), np.roll(surface.faces, -1, axis=1).reshape(-1)
    key = np.minimum(start, stop) * (int(surface.faces.max()) + 1) + np.maximum(start, stop)
    order = np.argsort(key, kind="stable")
    shared_edge = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, other = (order[shared_edge + step] // 3 for step in (0, 1))
    angle = np.arccos(np.clip(np.einsum("ij,ij->i", normal[one], normal[other]), -1, 1))
    return bool(not np.any((angle > MAX_FLAT_ANGLE) & (angle < MIN_EDGE_ANGLE)))


def grid_rotation(scatterer_grid: ScattererGrid) -> Floats:
    """The scatterer grid's axes in the world as rows: along, across, down [1], shape (3, 3)."""
    c, s = np.cos(scatterer_grid.heading), np.sin(scatterer_grid.heading)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _flat_tiles(depth: float) -> TerrainTiles:
    """Terrain without tiles, for a flat seabed at a depth [m]."""
    no_tiles, row_of_tile = np.zeros((0, 1, 1), np.float32), np.full((1, 1), -1, np.int32)
    return TerrainTiles(float(depth), 0.0, 0.0, 0.0, 0, 0, row_of_tile, no_tiles, no_tiles, no_tiles[:, 0, 0])


@lru_cache(maxsize=8)
def _scene_tree(scene: Scene) -> TriangleTree:
    """Triangles of all occluders, in the scatterer grid's frame."""
    corners, body_rows = [np.zeros((0, 3, 3))], [np.zeros(0, np.int64)]
    scatterer_grid = scene.seabed.scatterer_grid
    for row, solid in enumerate(scene.solids_of_one_law):
        solid_corners = world_triangles(solid, scene.seabed).corners
        horizontal = scatterer_grid.from_world(solid_corners[..., :2])
        corners.append(np.concatenate([horizontal, solid_corners[..., 2:]], axis=-1))
        body_rows.append(np.full(len(solid_corners), row))
    return triangle_tree(np.concatenate(corners), np.concatenate(body_rows))
