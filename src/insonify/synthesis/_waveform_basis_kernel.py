"""Echoes on the grids of all shapes that they come in, which lie side by side: a cell holds up to four shapes.

So one echo is one stretch of memory, in vectors that start where cells do. Of more than four shapes there are groups of
four, each with a grid of its own. Plain numbers and arrays.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._simd_gridding import add_complex_spike, add_shaped_spike, add_spike_of_2, add_spike_of_4

Floats = NDArray[np.float64]
TOGETHER = 4
"""Shapes of one cell at most."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


def group_layout(shapes: int) -> tuple[int, int]:
    """Groups of grids and shapes of each cell, for so many shapes: no more than four share one."""
    if shapes <= 2:
        return 1, shapes
    return -(-shapes // TOGETHER), TOGETHER


class BasisWeights(NamedTuple):
    """How echoes are shared among shapes: Lagrange's polynomials over the nodes; flat beyond their range."""

    centre_doppler: float
    """Of the range of Doppler factors [1]."""
    half_range: float
    """Half of that range [1]; 0 where there is one shape."""
    node_coordinate: NDArray[np.float32]
    """Doppler factors of the shapes, from the middle, in units of half the range [1], (shapes,)."""
    node_scale: NDArray[np.float32]
    """One over the product of each node's distances from the others, in the same units, (shapes,)."""
    coefficients: NDArray[np.float32]
    """Up to 4 shapes: coefficients of the polynomials, constant first, each twice; of two, all over again, (4, 8)."""


@njit(cache=True, nogil=True, error_model="numpy")
def basis_weight_table(doppler: Floats) -> BasisWeights:
    """How echoes are shared among shapes of some Doppler factors less one, (shapes,)."""
    shapes = doppler.size
    middle = 0.5 * (doppler[0] + doppler[-1])
    half = 0.5 * (doppler[-1] - doppler[0]) / math.cos(0.5 * math.pi / shapes) if shapes > 1 else 0.0
    node, scale, curve = np.zeros(shapes), np.ones(shapes), np.zeros((TOGETHER, 8), np.float32)
    if shapes > 1:
        node[:] = (doppler - middle) / half
    for s in range(shapes):
        row = np.array([1.0, 0.0, 0.0, 0.0])
        for other in range(shapes):
            if other != s:
                scale[s] /= node[s] - node[other]
                for power in range(TOGETHER - 1, -1, -1):  # times x less that node
                    row[power] = (row[power - 1] if power > 0 else 0.0) - row[power] * node[other]
        if shapes <= TOGETHER:
            for lane in range(2 * s, 8, 4 if shapes == 2 else 8):
                curve[:, lane : lane + 2] = (scale[s] * row).reshape(-1, 1)
    return BasisWeights(middle, half, node.astype(np.float32), scale.astype(np.float32), curve)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def basis_coordinate(doppler: Floats, basis: BasisWeights, x: NDArray[np.float32]) -> None:
    """Where echoes of some Doppler factors less one lie among the shapes, -1..1 where these meet them, into x."""
    once = 1 / basis.half_range
    for i in range(doppler.size):
        x[i] = np.float32(min(max((doppler[i] - basis.centre_doppler) * once, -1.0), 1.0))


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def basis_weights(x: NDArray[np.float32], node: NDArray[Any], scale: NDArray[Any], node_weights: NDArray[Any]) -> None:
    """What each of many shapes contributes to echoes: products of the distances from nodes before it and after it.

    Args:
        x: Where echoes lie among the shapes [1], (n,).
        node: Of `BasisWeights`.
        scale: Likewise.
        node_weights: Result, (shapes or more, at least n).
    """
    running = np.empty(x.size, np.float32)
    shapes = node.size
    for s in range(shapes):
        size, at = scale[s], node[max(s - 1, 0)]
        for i in range(x.size):
            running[i] = running[i] * (x[i] - at) if s > 0 else np.float32(1)
            node_weights[s, i] = size * running[i]
    for s in range(shapes - 1, -1, -1):
        at = node[min(s + 1, shapes - 1)]
        for i in range(x.size):
            running[i] = running[i] * (x[i] - at) if s < shapes - 1 else np.float32(1)
            node_weights[s, i] *= running[i]


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_waveforms(
    cells: NDArray[np.complex64], channel: int, used: int, channel_stride: int, first_cell: NDArray[np.int32],
    fraction: NDArray[np.float32], weight: NDArray[np.float32], x: NDArray[np.float32], basis: BasisWeights,
    node_weights: NDArray[np.float32], count: int,
) -> None:  # fmt: skip
    """Spikes of some echoes, each in some channels, laid on the grids of all shapes.

    Those off the grid are passed over.

    Args:
        cells: Grids of pressure, (channels, groups, cells, shapes of a group).
        channel: The first that hears them.
        used: How many channels from there on hear each echo.
        channel_stride: Spikes from one channel to the next, `count` or more.
        first_cell: First cell of each spike, -1 where it has no room, (count wide,).
        fraction: Of each between cells, (count wide,).
        weight: Of each, real and imaginary in turn, (2 count wide,).
        x: Where each lies among the shapes, (count wide,).
        basis: How they are shared.
        node_weights: For more than four shapes: what each shape takes, (shapes or more, spikes).
        count: How many echoes.
    """
    flat = cells.reshape(-1).view(np.float32)
    groups, lanes = cells.shape[1], cells.shape[3]
    row = groups * cells.shape[2]
    shares, stride = node_weights.reshape(-1), node_weights.shape[1]
    for i in range(count):
        for e in range(used):
            k = np.uintp(e * channel_stride + i)  # unsigned: a sign would be looked at, in each column
            if first_cell[k] < 0:
                continue
            first = np.intp((channel + e) * row + first_cell[k])
            if groups > 1:
                add_shaped_spike(flat, np.intp(8 * cells.shape[2]), first, fraction[k], weight, shares, np.intp(stride),
                                 np.intp(groups), np.intp(k))  # fmt: skip
            elif lanes == 4:
                add_spike_of_4(flat, first, fraction[k], weight, x[k], basis.coefficients, np.intp(k))
            elif lanes == 2:
                add_spike_of_2(flat, first, fraction[k], weight, x[k], basis.coefficients, np.intp(k))
            else:
                add_complex_spike(flat, first, fraction[k], weight, np.intp(k))
