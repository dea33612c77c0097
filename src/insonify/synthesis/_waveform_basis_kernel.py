"""Deposit of echoes on the interleaved grids of all waveforms of a basis: a cell holds up to four waveforms.

So one echo occupies one contiguous range of memory. More than four waveforms are in groups of four, each with a grid of
its own. Plain numbers and arrays.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._simd_gridding import add_complex_spike, add_shaped_spike, add_spike_of_2, add_spike_of_4

Floats = NDArray[np.float64]
WAVEFORMS_PER_CELL = 4
"""Largest number of waveforms in one cell."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


def group_layout(waveforms: int) -> tuple[int, int]:
    """Number of groups, and number of waveforms in each cell of a group, for a basis of a number of waveforms."""
    if waveforms <= 2:
        return 1, waveforms
    return -(-waveforms // WAVEFORMS_PER_CELL), WAVEFORMS_PER_CELL


class BasisWeights(NamedTuple):
    """Weights of waveforms in echoes: Lagrange polynomials of the nodes; constant beyond the Doppler limits."""

    centre_doppler: float
    """Middle between the Doppler limits: Doppler factor less one [1]."""
    half_range: float
    """Half of the difference between them [1]; 0 for one waveform."""
    node_coordinate: NDArray[np.float32]
    """Doppler factors of the waveforms re the middle, in units of half the range [1], (waveforms,)."""
    node_scale: NDArray[np.float32]
    """One over the product of each node's distances from the others, in the same units, (waveforms,)."""
    coefficients: NDArray[np.float32]
    """Up to 4 waveforms: coefficients of the polynomials by power, constant first, (4, 8). Along the second axis each
    waveform has two equal entries, for real and imaginary part; two waveforms are repeated to fill it."""


@njit(cache=True, nogil=True, error_model="numpy")
def basis_weight_table(doppler: Floats, low: float, high: float) -> BasisWeights:
    """Table of the weights of waveforms in echoes.

    Args:
        doppler: Doppler factors of the waveforms less one [1], (waveforms,).
        low: Doppler factor less one below which weights are constant [1].
        high: Doppler factor less one above which weights are constant [1].
    """
    waveforms = doppler.size
    middle, half = 0.5 * (low + high), 0.5 * (high - low) if waveforms > 1 else 0.0
    node, scale, coefficients = np.zeros(waveforms), np.ones(waveforms), np.zeros((WAVEFORMS_PER_CELL, 8), np.float32)
    single_node, single_scale = np.zeros(waveforms, np.float32), np.ones(waveforms, np.float32)
    row = np.empty(WAVEFORMS_PER_CELL)
    for s in range(waveforms if waveforms > 1 else 0):
        node[s] = (doppler[s] - middle) / half
        single_node[s] = node[s]
    for s in range(waveforms):
        row[0], row[1:] = 1.0, 0.0
        for other_node in range(waveforms):
            if other_node != s:
                scale[s] /= node[s] - node[other_node]
                for power in range(WAVEFORMS_PER_CELL - 1, -1, -1):  # times (x - node)
                    row[power] = (row[power - 1] if power > 0 else 0.0) - row[power] * node[other_node]
        single_scale[s] = scale[s]
        if waveforms <= WAVEFORMS_PER_CELL:
            for lane in range(2 * s, 8, 4 if waveforms == 2 else 8):
                for power in range(WAVEFORMS_PER_CELL):
                    coefficients[power, lane] = coefficients[power, lane + 1] = scale[s] * row[power]
    return BasisWeights(middle, half, single_node, single_scale, coefficients)


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def basis_coordinate(doppler: Floats, basis: BasisWeights, x: NDArray[np.float32]) -> None:
    """Fill the coordinate of echoes in the waveform basis, -1..1 between the Doppler limits, constant beyond [1].

    Args:
        doppler: Doppler factors less one [1], (n,).
        basis: Weights of the waveforms.
        x: Result: coordinate of each echo [1], (n,).
    """
    inverse = 1 / basis.half_range
    for i in range(doppler.size):
        x[i] = np.float32(min(max((doppler[i] - basis.centre_doppler) * inverse, -1.0), 1.0))


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def basis_weights(x: NDArray[np.float32], node: NDArray[Any], scale: NDArray[Any], node_weights: NDArray[Any]) -> None:
    """Fill weights of more than four waveforms in n echoes: products of distances from the nodes before and after each.

    Args:
        x: Coordinate of each echo in the basis [1], (n,).
        node: `BasisWeights.node_coordinate`, (waveforms,).
        scale: `BasisWeights.node_scale`, (waveforms,).
        node_weights: Result: weights [1], (waveforms or more, at least n).
    """
    running = np.empty(x.size, np.float32)
    waveforms = node.size
    for s in range(waveforms):
        node_factor, neighbour = scale[s], node[max(s - 1, 0)]
        for i in range(x.size):
            running[i] = running[i] * (x[i] - neighbour) if s > 0 else np.float32(1)
            node_weights[s, i] = node_factor * running[i]
    for s in range(waveforms - 1, -1, -1):
        neighbour = node[min(s + 1, waveforms - 1)]
        for i in range(x.size):
            running[i] = running[i] * (x[i] - neighbour) if s < waveforms - 1 else np.float32(1)
            node_weights[s, i] *= running[i]


@njit(cache=True, nogil=True, reference_counts=False, error_model="numpy")
def deposit_waveforms(
    cells: NDArray[np.complex64], channel: int, channel_count: int, channel_stride: int, first_cell: NDArray[np.int32],
    fraction: NDArray[np.float32], weight: NDArray[np.float32], x: NDArray[np.float32], basis: BasisWeights,
    node_weights: NDArray[np.float32], count: int,
) -> None:  # fmt: skip
    """Deposit the spikes of some echoes, each in some channels, on the grids of all waveforms.

    Spikes off the grid are skipped.

    Args:
        cells: Grids of pressure [uPa], (channels, groups, cells, waveforms of a group).
        channel: First channel that receives the echoes.
        channel_count: Number of channels from `channel` on that receive each echo.
        channel_stride: Number of spikes from one channel to the next, `count` or more.
        first_cell: First cell of each spike, -1 where it is off the grid, (spikes,).
        fraction: Position of each spike between cells [1], (spikes,).
        weight: Weight of each spike [uPa], real and imaginary parts alternating, (2 spikes,).
        x: Coordinate of each spike in the basis [1], (spikes,).
        basis: Weights of the waveforms.
        node_weights: For more than four waveforms: weight of each waveform [1], (waveforms or more, spikes).
        count: Number of echoes.
    """
    flat = cells.reshape(-1).view(np.float32)
    groups, lanes = cells.shape[1], cells.shape[3]
    row = groups * cells.shape[2]
    flat_weights, stride = node_weights.reshape(-1), node_weights.shape[1]
    for i in range(count):
        for e in range(channel_count):
            k = np.uintp(e * channel_stride + i)  # unsigned: avoids the negative-index check in each column
            if first_cell[k] < 0:
                continue
            first = np.intp((channel + e) * row + first_cell[k])
            if groups > 1:
                add_shaped_spike(flat, np.intp(8 * cells.shape[2]), first, fraction[k], weight, flat_weights,
                                 np.intp(stride), np.intp(groups), np.intp(k))  # fmt: skip
            elif lanes == 4:
                add_spike_of_4(flat, first, fraction[k], weight, x[k], basis.coefficients, np.intp(k))
            elif lanes == 2:
                add_spike_of_2(flat, first, fraction[k], weight, x[k], basis.coefficients, np.intp(k))
            else:
                add_complex_spike(flat, first, fraction[k], weight, np.intp(k))
