"""Fills a square piece of ground in between the nodes on which it was drawn. Plain numbers and arrays only."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.scene.terrain._kernels import add_band

Floats = NDArray[np.float64]

_OUTER, _INNER = -1 / 16, 9 / 16  # the cubic through four nodes, half way between the middle two


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def add_twice_as_fine(coarse: Floats, margin: int, fine: Floats) -> None:
    """Add what stands on every second node to all nodes, by cubics through four along both axes.

    Args:
        coarse: Values on every second node, from two of them before the first to two after the last, (m, 3 m).
        margin: Nodes before the first, and after the last, that are wanted: 0 or 2.
        fine: Result, added to, (n, 3 n): three columns for every node.
    """
    count, width = fine.shape[0], coarse.shape[1]
    line = np.empty(width)
    for i in range(count):
        node = i - margin
        q = (node >> 1) + 2
        if node & 1:
            a, b, c, d = coarse[q - 1], coarse[q], coarse[q + 1], coarse[q + 2]
            for k in range(width):
                line[k] = _OUTER * (a[k] + d[k]) + _INNER * (b[k] + c[k])
        else:
            a = coarse[q]
            for k in range(width):
                line[k] = a[k]
        row = fine[i]
        for j in range(count):
            node = j - margin
            at, to = 3 * ((node >> 1) + 2), 3 * j
            if node & 1:
                for c in range(3):
                    row[to + c] += _OUTER * (line[at - 3 + c] + line[at + 6 + c]) + _INNER * (
                        line[at + c] + line[at + 3 + c]
                    )
            else:
                for c in range(3):
                    row[to + c] += line[at + c]


@njit(cache=True, nogil=True, error_model="numpy")
def draw_octaves(
    along: int, across: int, cell: float, octaves: Floats, names: NDArray[np.int64], quantiles: Floats, into: Floats
) -> None:  # fmt: skip
    """Height and slopes of octaves of relief on the nodes of one piece.

    Args:
        along: Number of the piece along the frame's first axis.
        across: Along its second.
        cell: Side of a cell [m].
        octaves: Pitch [m], turn [rad], both shifts [pitches] and amplitude [m] of each, (o, 5).
        names: Step between the nodes on which it is drawn: 16, 8, 4, 2 or 1, coarsest first; then its level, layer and
            the key of its numbers, (o, 5).
        quantiles: Of a normal number, as of `add_band`.
        into: Result, height [m] and slopes along the axes [1], added to, (nodes * nodes, 3).
    """
    if octaves.shape[0] == 0:
        return
    nodes = int(math.sqrt(into.shape[0]) + 0.5)
    step, o = names[0, 0], 0
    coarser = np.zeros((0, 0))
    while step >= 1:
        margin = 2 if step > 1 else 0
        count = (nodes - 1) // step + 1 + 2 * margin
        x, y = np.empty(count * count), np.empty(count * count)
        for i in range(count):
            for j in range(count):
                x[i * count + j] = (along * (nodes - 1) + (i - margin) * step) * cell
                y[i * count + j] = (across * (nodes - 1) + (j - margin) * step) * cell
        drawn = into if step == 1 else np.zeros((count * count, 3))
        while o < octaves.shape[0] and names[o, 0] == step:
            add_band(x, y, octaves[o, 0], octaves[o, 1], octaves[o, 2], octaves[o, 3], octaves[o, 4], names[o, 1],
                     names[o, 2], names[o, 3], names[o, 4], quantiles, drawn)  # fmt: skip
            o += 1
        finer = drawn.reshape(count, 3 * count)
        if coarser.shape[0] > 0:
            add_twice_as_fine(coarser, margin, finer)
        coarser = finer
        step //= 2
