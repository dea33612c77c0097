"""The scene as the tracer's kernels read it: triangles, and pieces of ground fetched as rays come to them.

Everything stands in the frame of the scene's lattice, so that a world moved as a whole is traced by the same numbers.
Upright boxes are triangles here like all other bodies.
"""

from functools import lru_cache
from threading import Lock

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer._bodies_kernel import Bodies, sorted_bodies
from insonify.engines.tracer._ground_kernel import BLOCK, Ground
from insonify.engines.tracer._trace_kernel import clear_ways, first_hits
from insonify.scene.bed import MAP_CELLS, Bed
from insonify.scene.lattice import Lattice
from insonify.scene.scene import Scene
from insonify.scene.solid import body_triangles, world_triangles
from insonify.scene.target import Solid

Floats = NDArray[np.float64]
Marks = NDArray[np.bool_]

MOST_PIECES = 8192
"""Pieces of ground that are kept, some 140 MB [1]."""
LEVEL, EDGE = 2e-3, 0.5
"""Angles between neighbouring triangles: of one face below the first, of two faces above the second [rad]."""


class World:
    """A scene for rays; shared by all pings and threads."""

    def __init__(self, scene: Scene) -> None:
        """Sort the bodies; the ground is fetched when rays come to it.

        Args:
            scene: What is traced.
        """
        self.scene, self.lattice, self.bed = scene, scene.seabed.lattice, scene.seabed.bed
        self.solids: tuple[Solid, ...] = scene.occluders
        self.bodies = _bodies(scene)
        self.store = None if self.bed is None else Store(self.bed)

    def turned(self, vector: Floats) -> Floats:
        """Vectors of the world in the lattice's frame, shape (..., 3)."""
        return np.asarray(vector @ frame(self.lattice).T)

    def placed(self, place: Floats) -> Floats:
        """Places of the world in the lattice's frame [m], shape (..., 3)."""
        return np.concatenate([self.lattice.from_world(place[..., :2]), place[..., 2:]], axis=-1)

    def sheet(self, here: Floats, farthest: float) -> "Sheet":
        """The ground about a place in the lattice's frame [m], as far as anything is heard [m]."""
        if self.bed is not None and self.store is not None and len(self.store.rows) > MOST_PIECES:
            self.store = Store(self.bed)  # sheets under way keep the old one
        return Sheet(self, here, farthest)


class Store:
    """Pieces of ground that have been fetched; rows are only ever added."""

    def __init__(self, bed: Bed) -> None:
        """Nothing fetched yet."""
        self.bed, self.lock = bed, Lock()
        self.rows: dict[tuple[int, int], int] = {}
        blocks = MAP_CELLS // BLOCK
        self.pieces = np.empty((64, MAP_CELLS + 1, MAP_CELLS + 1), np.float32)
        self.tops = np.empty((64, blocks, blocks), np.float32)
        self.roofs = np.empty(64, np.float32)

    def fetch(self, along: int, across: int) -> int:
        """Row of a piece, fetched where it is not there yet; hold the lock."""
        key = (along, across)
        if key not in self.rows:
            row = len(self.rows)
            if row == len(self.pieces):
                self.pieces, self.tops, self.roofs = (
                    np.concatenate([kept, np.empty_like(kept)]) for kept in (self.pieces, self.tops, self.roofs)
                )
            piece = np.asarray(self.bed.map_piece(along, across))
            self.pieces[row] = piece
            known = np.where(np.isnan(piece), -np.inf, piece)
            corners = (known[:-1, :-1], known[1:, :-1], known[:-1, 1:], known[1:, 1:])
            cells = np.maximum.reduce(corners)
            side = MAP_CELLS // BLOCK
            self.tops[row] = cells.reshape(side, BLOCK, side, BLOCK).max(axis=(1, 3))
            self.roofs[row] = self.tops[row].max()
            self.rows[key] = row
        return self.rows[key]


class Sheet:
    """The ground of one ping, and what rays meet on it and above it."""

    def __init__(self, world: World, here: Floats, farthest: float) -> None:
        """No piece is looked up yet.

        Args:
            world: Bodies and store of ground.
            here: Middle of the sheet, in the lattice's frame [m], shape (>= 2,).
            farthest: How far it reaches [m].
        """
        self._bodies, self._store = world.bodies, world.store
        if world.store is None:
            self.ground = _flat(world.scene.seabed.depth)
            return
        bed = world.store.bed
        side = bed.map_cell * MAP_CELLS
        corner = np.floor((here[:2] - farthest) / side).astype(int) - 1
        size = np.floor((here[:2] + farthest) / side).astype(int) + 2 - corner
        low, high = bed.ground.span
        row_of = np.full(size, -1, np.int32)
        with world.store.lock:
            for (along, across), row in world.store.rows.items():
                p, q = along - corner[0], across - corner[1]
                if 0 <= p < size[0] and 0 <= q < size[1]:
                    row_of[p, q] = row
        self.ground = Ground(
            float(bed.depth), float(bed.map_cell), float(low), float(high), int(corner[0]), int(corner[1]),
            row_of, world.store.pieces, world.store.tops, world.store.roofs,
        )  # fmt: skip

    def _fetched(self, wanted: Marks) -> bool:
        """Fetch the pieces that are wanted; False where none is."""
        store = self._store
        if store is None or not wanted.any():
            return False
        with store.lock:
            row_of = self.ground.row_of.copy()
            for p, q in np.argwhere(wanted):
                row_of[p, q] = store.fetch(int(p) + self.ground.corner_a, int(q) + self.ground.corner_b)
            self.ground = self.ground._replace(row_of=row_of, pieces=store.pieces, tops=store.tops, roofs=store.roofs)
        return True

    def hits(
        self, origin: Floats, way: Floats, farthest: Floats
    ) -> tuple[Floats, NDArray[np.int8], NDArray[np.int64], Floats]:
        """What rays meet first, see `first_hits`.

        Returns:
            Distance [m] (n,), what is met (n,), owner of the body met (n,), unit normal (n, 3).
        """
        n = len(origin)
        distance, met, owner, normal = np.empty(n), np.empty(n, np.int8), np.empty(n, np.int64), np.empty((n, 3))
        while True:
            wanted = np.zeros(self.ground.row_of.shape, bool)
            first_hits(origin, way, farthest, self.ground, self._bodies, wanted, distance, met, owner, normal)
            if not self._fetched(wanted):
                return distance, met, owner, normal

    def clear(self, end: Floats, place: Floats, family: str, wavelength: float, asked: Marks) -> Marks:
        """Which places a mirrored way from one end of the sonar gets to, see `clear_ways`.

        Args:
            end: The sonar's end, in the lattice's frame [m], shape (3,).
            place: The places, likewise [m], shape (n, 3).
            family: Letters of the mirrors from the sonar outwards, D for none.
            wavelength: Of the sound [m].
            asked: Which are asked for, shape (n,).
        """
        bottom = np.array([letter == "B" for letter in family if letter != "D"], bool)
        while True:
            found, wanted = asked.copy(), np.zeros(self.ground.row_of.shape, bool)
            clear_ways(end, place, bottom, wavelength, self.ground, self._bodies, wanted, found)
            if not self._fetched(wanted):
                return found


@lru_cache(maxsize=256)
def has_flat_faces(solid: Solid) -> bool:
    """Whether a body's faces meet at edges, and do not bend round: no angle at an edge is small but not nothing."""
    surface = body_triangles(solid)
    a, b, c = np.moveaxis(surface.corners, 1, 0)
    normal = np.cross(b - a, c - a)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    start, stop = surface.faces.reshape(-1), np.roll(surface.faces, -1, axis=1).reshape(-1)
    key = np.minimum(start, stop) * (int(surface.faces.max()) + 1) + np.maximum(start, stop)
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, other = (order[same + step] // 3 for step in (0, 1))
    angle = np.arccos(np.clip(np.einsum("ij,ij->i", normal[one], normal[other]), -1, 1))
    return bool(not np.any((angle > LEVEL) & (angle < EDGE)))


def frame(lattice: Lattice) -> Floats:
    """The lattice's axes in the world as rows: along, across, down [1], shape (3, 3)."""
    c, s = np.cos(lattice.heading), np.sin(lattice.heading)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


def _flat(depth: float) -> Ground:
    """A level bed."""
    none, map_of = np.zeros((0, 1, 1), np.float32), np.full((1, 1), -1, np.int32)
    return Ground(float(depth), 0.0, 0.0, 0.0, 0, 0, map_of, none, none, none[:, 0, 0])


@lru_cache(maxsize=8)
def _bodies(scene: Scene) -> Bodies:
    """Triangles of all occluders, in the lattice's frame."""
    corners, owner = [np.zeros((0, 3, 3))], [np.zeros(0, np.int64)]
    lattice = scene.seabed.lattice
    for row, solid in enumerate(scene.occluders):
        found = world_triangles(solid, scene.seabed).corners
        corners.append(np.concatenate([lattice.from_world(found[..., :2]), found[..., 2:]], axis=-1))
        owner.append(np.full(len(found), row))
    return sorted_bodies(np.concatenate(corners), np.concatenate(owner))
