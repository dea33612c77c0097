"""Which scatterers answer which pairs of families, and how strongly. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.streams import mixed

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def stretches(position: Floats, north: float, east: float, edges: Floats, stretch: NDArray[np.int32]) -> None:
    """The stretch of distance that each place lies in, the first or the last for those beyond.

    Args:
        position: North, east and any further coordinates of the places [m], (n, 2 or more).
        north: Where distances are counted from [m].
        east: Likewise [m].
        edges: Of the stretches, growing [m], (stretches + 1,).
        stretch: Result, (n,).
    """
    last = edges.size - 2
    for n in range(position.shape[0]):
        distance = math.hypot(position[n, 0] - north, position[n, 1] - east)
        stretch[n] = min(max(int(np.searchsorted(edges, distance, side="right")) - 1, 0), last)


@njit(cache=True, nogil=True, error_model="numpy")
def answers(
    place: NDArray[np.uint64], stretch: NDArray[np.int32], share: NDArray[np.floating[Any]], key: np.uint64,
    wanted: NDArray[np.bool_], louder: NDArray[np.float32],
) -> None:  # fmt: skip
    """Where each pair of families is met, and by what the answer is louder there.

    Args:
        place: Keys of the places, (n,).
        stretch: Stretch of distance that each lies in, (n,).
        share: Part of the places at which each pair is met, (f, f, stretches).
        key: Of the draw, any word.
        wanted: Result, whether any pair of a family is met at a place, (f, n).
        louder: Result, one over the root of the share, 0 where the pair is not met, (f, f, n).
    """
    count, many = share.shape[0], place.size
    turn = np.empty(many, np.float32)
    for n in range(many):
        # 24 bits: a number below one in single precision
        turn[n] = np.float32(mixed(place[n] ^ key) >> np.uint64(40)) * np.float32(2.0**-24)
    wanted[:] = False
    for i in range(count):
        for j in range(count):
            least, root = share[i, j].astype(np.float32), (1 / np.sqrt(share[i, j])).astype(np.float32)
            for n in range(many):
                met = turn[n] < least[stretch[n]]
                louder[i, j, n] = root[stretch[n]] if met else np.float32(0)
                wanted[i, n] |= met
                wanted[j, n] |= met


@njit(cache=True, nogil=True, error_model="numpy")
def products(one: Floats, other: Floats, pair: NDArray[np.int64], louder: NDArray[np.float32], made: Floats) -> None:
    """Strengths that are products of what each leg contributes.

    Args:
        one: Of legs out, (f, n).
        other: Of legs back, (g, n).
        pair: Rows of each ordered pair, (p, 2).
        louder: What strengths are multiplied by, (p, n); or (0, n) for one.
        made: Result, (p, n).
    """
    for p in range(pair.shape[0]):
        i, j = pair[p]
        if louder.shape[0] == 0:
            for n in range(made.shape[1]):
                made[p, n] = one[i, n] * other[j, n]
        else:
            for n in range(made.shape[1]):
                made[p, n] = one[i, n] * other[j, n] * louder[p, n]
