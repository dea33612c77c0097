"""The lattice of drawn scatterers: one point per cell, jittered in it, the same in every ping.

Cells are squares of BASE_PITCH * 2**level in the lattice's own frame, grouped in tiles of
TILE x TILE cells. Position and phase come from the key (seed, stream, level, cell) alone, so any
cell can be drawn at any time by any worker, and a world moved as a whole keeps its scatterers.
"""

from typing import Annotated, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pydantic import Field

from insonify import streams
from insonify.noun import Metres, Noun, Radians
from insonify.scene.scatterers import lattice_place

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

BASE_PITCH = 0.01
"""Side of a cell at level 0 [m]."""
TILE = 32
"""Cells along the side of a tile."""


Coordinate = Annotated[Metres, Field(ge=-1e7, le=1e7)]


class Lattice(Noun):
    """Frame in which scatterers are drawn: moving it with the world changes no echo."""

    origin: tuple[Coordinate, Coordinate] = (0.0, 0.0)
    """North and east of the lattice's origin [m]."""
    heading: Radians = 0.0
    """Compass heading of the lattice's first axis [rad]."""

    def to_world(self, along: NDArray[np.float64], across: NDArray[np.float64]) -> NDArray[np.float64]:
        """North and east [m], shape (n, 2), of lattice coordinates [m], shape (n,)."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        north, east = self.origin
        return np.stack([north + c * along - s * across, east + s * along + c * across], axis=-1)

    def from_world(self, place: NDArray[np.float64]) -> NDArray[np.float64]:
        """Lattice coordinates [m] of north and east [m], shape (..., 2) both."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        north, east = place[..., 0] - self.origin[0], place[..., 1] - self.origin[1]
        return np.stack([c * north + s * east, c * east - s * north], axis=-1)


class Tiles(NamedTuple):
    """Tiles of the lattice, columns of shape (n,)."""

    level: NDArray[np.int64]
    """Level of the tile's cells."""
    along: NDArray[np.int64]
    """Number of the tile along the lattice's first axis."""
    across: NDArray[np.int64]
    """Number of the tile along its second axis."""

    @property
    def pitch(self) -> NDArray[np.float64]:
        """Side of a cell [m], shape (n,)."""
        return np.asarray(BASE_PITCH * 2.0**self.level)

    @property
    def centre(self) -> NDArray[np.float64]:
        """Centre of each tile in lattice coordinates [m], shape (n, 2)."""
        side = TILE * self.pitch
        return np.stack([(self.along + 0.5) * side, (self.across + 0.5) * side], axis=-1)

    def take(self, rows: NDArray[np.bool_] | slice) -> "Tiles":
        """The tiles of some rows."""
        return Tiles(self.level[rows], self.along[rows], self.across[rows])

    def split(self) -> "Tiles":
        """Four tiles of the next finer level for each."""
        along = (2 * self.along[:, None] + np.array([0, 0, 1, 1])).ravel()
        across = (2 * self.across[:, None] + np.array([0, 1, 0, 1])).ravel()
        return Tiles(np.repeat(self.level - 1, 4), along, across)


class Draw(NamedTuple):
    """What was drawn in the cells of some tiles, columns of shape (n,)."""

    along: NDArray[np.float64]
    across: NDArray[np.float64]
    area: NDArray[np.float64]
    phase: NDArray[np.complex128]
    place: NDArray[np.uint64]


def draw(tiles: Tiles, seed: int, stream: int) -> Draw:
    """The scatterers of some tiles, one for each cell.

    Args:
        tiles: Which tiles.
        seed: Seed of the scenario.
        stream: Stream of the interface, one of `insonify.streams`.

    Returns:
        Lattice coordinates [m], cell area [m^2], unit phasor and key of the place.
    """
    n = len(tiles.level) * TILE * TILE
    along, across, area, phase = np.empty(n), np.empty(n), np.empty(n), np.empty(n, complex)
    _draw(tiles.level, tiles.along, tiles.across, *streams.key(seed, stream), along, across, area, phase)
    cell = np.arange(TILE)
    row, column = (
        (number[:, None, None] * TILE + cells).repeat(times, axis=axis).ravel()
        for number, cells, times, axis in (
            (tiles.along, cell[:, None], TILE, 2),
            (tiles.across, cell[None, :], TILE, 1),
        )
    )
    place = lattice_place(stream, tiles.level.repeat(TILE * TILE), row, column)
    return Draw(along, across, area, phase, place)


@njit(cache=True, nogil=True)
def _draw(
    level: Integers, tile_along: Integers, tile_across: Integers, k0: int, k1: int, along: Floats, across: Floats,
    area: Floats, phase: NDArray[np.complex128],
) -> None:  # fmt: skip
    """Fill the columns of `Draw`, tile by tile, cell by cell."""
    n = 0
    for t in range(level.size):
        pitch = BASE_PITCH * 2.0 ** level[t]
        for a in range(tile_along[t] * TILE, (tile_along[t] + 1) * TILE):
            for b in range(tile_across[t] * TILE, (tile_across[t] + 1) * TILE):
                w0, w1, w2, _ = streams.philox(a & 0xFFFFFFFF, b & 0xFFFFFFFF, level[t], 0, k0, k1)
                along[n] = (a + streams.unit(w0)) * pitch
                across[n] = (b + streams.unit(w1)) * pitch
                area[n] = pitch * pitch
                angle = 2 * np.pi * streams.unit(w2)
                phase[n] = complex(np.cos(angle), np.sin(angle))
                n += 1
