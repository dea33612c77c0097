"""Products of amplitudes and one beam pattern at many direction cosines, four at once, from `beam_kernels` tables."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar._simd_cubics import LANES, multiply_by_cubics

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def multiply_by_pattern(
    table: Floats, per_unit: float, axis: float, cosine: Floats, gain: Floats, first: NDArray[np.uint32],
    fraction: Floats,
) -> None:  # fmt: skip
    """Multiply gains by a pattern at some direction cosines, as `beam_kernels.interpolate_pattern`.

    Args:
        table: Cubics of the pattern, constant first, (rows, 4); no rows: 1 everywhere.
        per_unit: Rows per unit of the cosine [1].
        axis: Cosine about which the pattern is symmetric [1].
        cosine: Direction cosines [1], (m,).
        gain: Amplitudes [1], multiplied in place, (at least m,).
        first: Work array, (at least m,).
        fraction: Work array, (at least m,).
    """
    if table.shape[0] == 0:
        return
    cubics, last, quads = table.reshape(table.size), np.uint32(table.shape[0] - 1), cosine.size // LANES * LANES
    one, two, three = np.uint64(1), np.uint64(2), np.uint64(3)
    for k in range(cosine.size):
        position = abs(cosine[k] - axis) * per_unit
        row = min(np.uint32(position), last)
        first[k], fraction[k] = np.uint32(4) * row, position - np.float64(row)
    for k in range(np.uint64(0), np.uint64(quads), np.uint64(LANES)):
        multiply_by_cubics(cubics, first, fraction, gain, k)
    for k in range(np.uint64(quads), np.uint64(cosine.size)):
        start, t = np.uint64(first[k]), fraction[k]
        gain[k] *= cubics[start] + t * (cubics[start + one] + t * (cubics[start + two] + t * cubics[start + three]))
