"""Tile of a seabed's map, node by node."""

import numpy as np

from insonify.scene.seabed_terrain import TILE_CELLS


def heightmap_tile(bed, along, across):
    """Heights on the nodes of one tile of a terrain [m], shape (65, 65); numbers count along the lattice's axes."""
    cells = np.arange(TILE_CELLS + 1)
    a, b = ((number * TILE_CELLS + cells) * bed.heightmap_cell_size for number in (along, across))
    return bed.relief.resolved.sample_in_grid_axes(a[:, None], b[None, :]).height
