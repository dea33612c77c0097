"""Random positions and phases of scatterers in the water, one in each cell."""

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@njit(cache=True, nogil=True)
def draw_water_blocks(
    scale: Integers, along: Integers, across: Integers, down: Integers, cells: int, base: float, k0: int, k1: int,
    position: Floats, phase: NDArray[np.complex128], key: NDArray[np.uint64],
) -> None:  # fmt: skip
    """Fill the columns of the scatterers of some blocks, block by block, cell by cell.

    Args:
        scale: Scale of each block, (n,): each scale doubles one side of its cells, along, across and down in turn.
        along: Number of each block along the lattice's first axis, (n,).
        across: Number of each block along the lattice's second axis, (n,).
        down: Number of each block in depth, (n,).
        cells: Cells along the side of a block.
        base: Side of a cell at scale 0 [m].
        k0: First word of the key.
        k1: Second word of the key.
        position: Result, lattice coordinates and depth [m], (n cells^3, 3).
        phase: Result, unit phasors [1].
        key: Result, scale in 6 bits, then 18, 17 and 17 bits of the cell's numbers.
    """
    n, mask_a, mask_b = 0, (1 << 18) - 1, (1 << 17) - 1
    for t in range(scale.size):
        length = base * 2.0 ** ((scale[t] + 2) // 3)
        width = base * 2.0 ** ((scale[t] + 1) // 3)
        height = base * 2.0 ** (scale[t] // 3)
        for a in range(along[t] * cells, (along[t] + 1) * cells):
            for b in range(across[t] * cells, (across[t] + 1) * cells):
                for c in range(down[t] * cells, (down[t] + 1) * cells):
                    w0, w1, w2, w3 = random_keys.philox(a, b, c, scale[t], k0, k1)
                    position[n, 0] = (a + random_keys.uniform_from_word(w0)) * length
                    position[n, 1] = (b + random_keys.uniform_from_word(w1)) * width
                    position[n, 2] = (c + random_keys.uniform_from_word(w2)) * height
                    angle = 2 * np.pi * random_keys.uniform_from_word(w3)
                    phase[n] = complex(np.cos(angle), np.sin(angle))
                    key[n] = np.uint64((scale[t] & 63) << 52 | (a & mask_a) << 34 | (b & mask_b) << 17 | (c & mask_b))
                    n += 1
