"""A map of heights in memory, as kernels read it, and a plain reading of it in double precision."""

from dataclasses import dataclass

import numpy as np

from insonify.scene.heightmap_cache import CELLS, NODES, HeightmapTiles


@dataclass(frozen=True)
class Map:
    """Some tiles of a map of a height that is reported by a function of two coordinates."""

    height: object
    pages: HeightmapTiles
    shape: tuple[int, int]
    """Rows and columns of tiles, the border among them."""

    def no_tiles(self):
        """Where a kernel states which tiles are missing."""
        return np.zeros(self.shape, bool)

    def named(self, expected):
        """Numbers of the tiles that a kernel needs."""
        return (np.argwhere(expected) + np.array([self.pages.corner_a, self.pages.corner_b])).tolist()

    def read(self, a, b):
        """Height linear between the nodes, which are rounded to single precision."""
        x, y = np.asarray(a, float) / self.pages.cell, np.asarray(b, float) / self.pages.cell
        i, j = np.floor(x), np.floor(y)
        f, g = x - i, y - j
        low, high = ((1 - g) * self._node(k, j) + g * self._node(k, j + 1) for k in (i, i + 1))
        return (1 - f) * low + f * high

    def _node(self, i, j):
        return self.height(i * self.pages.cell, j * self.pages.cell).astype(np.float32).astype(float)


def map_of(height, cell, *, first=(-2, -2), tiles=(4, 4), missing=()):
    """So many tiles from the first on, all but those missing, which are numbered as the tiles are."""
    row_of = np.full((tiles[0] + 2, tiles[1] + 2), -1, np.int32)
    kept = [np.zeros((NODES, NODES), np.float32)]
    nodes = np.arange(NODES)
    for i in range(first[0], first[0] + tiles[0]):
        for j in range(first[1], first[1] + tiles[1]):
            if (i, j) not in missing:
                row_of[i - first[0] + 1, j - first[1] + 1] = len(kept)
                a, b = (i * CELLS + nodes) * cell, (j * CELLS + nodes) * cell
                kept.append((height(a[:, None], b[None, :]) + np.zeros((NODES, NODES))).astype(np.float32))
    pages = HeightmapTiles(first[0] - 1, first[1] - 1, cell, row_of.ravel(), np.array(kept).ravel())
    return Map(height, pages, row_of.shape)


def swell(seed, *, rms=0.3, shortest_wavelength=3.0, longest=30.0, waves=12):
    """Heights of some waves of random lengths, directions and phases [m]."""
    rng = np.random.default_rng(seed)
    number = 2 * np.pi / rng.uniform(shortest_wavelength, longest, waves)
    bearing, phase = rng.uniform(0, 2 * np.pi, (2, waves))
    size = rms * np.sqrt(2 / waves)

    def height(a, b):
        a, b = np.broadcast_arrays(np.asarray(a, float), b)
        turns = number * (a[..., None] * np.cos(bearing) + b[..., None] * np.sin(bearing)) + phase
        return size * np.sin(turns).sum(axis=-1)

    return height
