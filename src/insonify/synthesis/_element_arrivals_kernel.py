"""Kernels that evaluate the echoes of a block at a few nodes along an array, and deposit them at each element.

Along a straight array the delay of an echo is smooth where the array is short re its distance: a few Chebyshev
nodes determine it at every element (`chebyshev_nodes`). Echoes are processed in order of arrival, for all pairs of
legs together, some hundreds at a time, for a few elements at once: so the active part of the grids stays in the cache,
consecutive spikes do not touch the same cells, and tens of spikes share a cell of a window (`_polynomial_moments`).
Plain numbers and arrays.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.synthesis._arrival_kernel import (
    Flags,
    Integers,
    ReceiveBeams,
    ReceiveLegs,
    Reception,
    TransmitLegs,
    nonzero_legs,
    scatterers_with_echo,
)
from insonify.synthesis._arrival_time_kernel import ArrivalColumns, ElementMotion, arrival_times
from insonify.synthesis._gridding import _locate
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE
from insonify.synthesis._polynomial_moments import MARGIN, WINDOW, deposit_moments, empty_window, gather_moments
from insonify.synthesis._simd_gridding import mix_nodes
from insonify.synthesis._waveform_basis_kernel import basis_weight_table, basis_weights, deposit_waveforms

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
_PART = 32768
_TILE = 256
"""Echoes that are evaluated together."""
_ROW = _TILE + 16
_ELEMENTS_AT_ONCE = 8
"""Elements at which they are deposited together."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class ApertureNodes(NamedTuple):
    """Nodes along an array at which echoes are evaluated, k of them."""

    position: Floats
    """Position from the array's centre, in the world, at the start of the ping [m], (k, 3)."""
    velocity: Floats
    """Velocity at the start of the ping [m/s], (k, 3)."""
    acceleration: Floats
    """Acceleration [m/s^2], (k, 3)."""
    weights: Floats
    """Weight of each node at each element, then at each interpolation point of the sector [1], (k, elements + p)."""


class ArraySector(NamedTuple):
    """Sector so narrow that p interpolation points along an array determine the echoes at all its elements."""

    point_count: int
    """Number of interpolation points, p; 0: no interpolation."""
    max_delay_slope: float
    """Largest change of an echo's delay along half the array [s]."""
    curvature_phase: float
    """Curvature phase: the phase at the array's ends is this over the delay [rad s]."""
    max_residual_phase: float
    """Largest deviation of the phase at its ends from that [rad]."""


class PairedLegs(NamedTuple):
    """Legs of both ends to n scatterers, and the strengths of their p pairs."""

    pair: Integers
    """Rows of the transmit leg, the receive leg and the gain of each pair, (p, 3)."""
    transmit: TransmitLegs
    """Transmit legs, one beam."""
    receive: ReceiveLegs
    """Receive legs."""
    strength: NDArray[Any]
    """Strength of each scatterer for each pair, real or complex, (p, n)."""


class _EchoOrder(NamedTuple):
    """Work arrays for the echoes of a part of the scatterers, in order of arrival."""

    echo: NDArray[np.int32]
    """Pair of legs times `_PART`, plus the scatterer's index in the part, (pairs times `_PART`,)."""
    unsorted_echo: NDArray[np.int32]
    """The same, pair by pair, and one more."""
    cell: NDArray[np.int32]
    """Cell in which each arrives at the array's centre."""
    starts: NDArray[np.int32]
    """Number of echoes before each cell."""


@njit(cache=True, nogil=True, error_model="numpy")
def _sort_echoes(
    part_start: int, reception: Reception, last: int, legs: PairedLegs, flags: tuple[Flags, Flags, Flags],
    order: _EchoOrder,
) -> int:  # fmt: skip
    """Sort the echoes of a part of the scatterers by counting the echoes of each cell; return their number."""
    total, low, high, pair, strength = 0, last, 0, legs.pair, legs.strength
    first_time, cell_rate = reception.first_time, reception.cell_rate
    end = min(part_start + _PART, strength.shape[1])
    outs, backs, gain_flags = flags
    for p in range(pair.shape[0]):
        i, j, row = pair[p]
        echo, key = order.unsorted_echo[total:], order.cell[total:]
        count = scatterers_with_echo(
            0, strength[p, part_start:end], outs[i, part_start:end], backs[j, part_start:end],
            gain_flags[row, part_start:end], echo,
        )  # fmt: skip
        transmit_delay, receive_delay = legs.transmit.delay[i, part_start:end], legs.receive.delay[j, part_start:end]
        for k in range(count):
            n = np.uintp(echo[k])
            position = (transmit_delay[n] + receive_delay[n] - first_time) * cell_rate
            key[k] = int(min(position, float(last))) if position > 0 else 0
            echo[k] += p * _PART
            low, high = min(low, int(key[k])), max(high, int(key[k]))
        total += count
    if total == 0:
        return 0
    order.starts[low : high + 2] = 0
    for k in range(total):
        order.starts[np.uintp(order.cell[k] + 1)] += 1
    for cell in range(low + 1, high + 2):
        order.starts[cell] += order.starts[cell - 1]
    for k in range(total):
        cell_of_echo = np.uintp(order.cell[k])
        order.echo[np.uintp(order.starts[cell_of_echo])] = order.unsorted_echo[k]
        order.starts[cell_of_echo] += 1
    return total


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _fill_weights(arrival_time: Floats, real: Singles, imaginary: Singles, frequency: float, weight: Singles) -> None:
    """Weights with the phase of the carrier, real and imaginary parts alternating."""
    for k in range(arrival_time.size):
        sine, cosine = sincos_cycles(frequency * arrival_time[k])
        weight[2 * k] = real[k] * cosine + imaginary[k] * sine
        weight[2 * k + 1] = imaginary[k] * cosine - real[k] * sine


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _partition_by_sector(
    arrival_time: Floats, count: int, centre_delay: Floats, frequency: float, sector: ArraySector,
    new_index: NDArray[np.int32]
) -> int:  # fmt: skip
    """Move the echoes of the sector before the others; return their number.

    The first two terms of the delay along the array, in Chebyshev polynomials, follow from its values at the nodes.

    Args:
        arrival_time: Times of arrival at each node [s], (k, count or more).
        count: Number of echoes.
        centre_delay: Their delays at the array's centre [s], (count or more,).
        frequency: Carrier frequency [Hz].
        sector: The sector.
        new_index: Result: new index of each echo, (count or more,).
    """
    nodes, in_sector = arrival_time.shape[0], 0
    slope, curvature = np.zeros(_TILE), np.zeros(_TILE)
    for k in range(nodes):
        x = math.cos((k + 0.5) * math.pi / nodes)
        linear, quadratic = 2 / nodes * x, 2 / nodes * (2 * x * x - 1) * 4 * math.pi * frequency
        for m in range(count):
            slope[m] += linear * arrival_time[k, m]
            curvature[m] += quadratic * arrival_time[k, m]
    for m in range(count):
        within = (
            abs(slope[m]) <= sector.max_delay_slope
            and abs(curvature[m] - sector.curvature_phase / centre_delay[m]) <= sector.max_residual_phase
        )
        new_index[m] = in_sector if within else -1
        in_sector += within
    next_index = in_sector
    for m in range(count):
        if new_index[m] < 0:
            new_index[m] = next_index
            next_index += 1
    return in_sector


@njit(cache=True, nogil=True, error_model="numpy")  # no contraction: which products fuse would follow from the cache
def _gather_echoes(
    echo: NDArray[np.int32], part_start: int, legs: PairedLegs, single_pattern: bool, columns: Floats,
    source_weight: Singles,
) -> None:  # fmt: skip
    """Gather the columns of some echoes at the array's centre.

    Args:
        echo: Echoes as in `_EchoOrder`.
        part_start: First scatterer of the part.
        legs: Legs of both ends, and strengths.
        single_pattern: True if all elements have the first pattern.
        columns: Result: delay, curvature, its inverse, distance, direction, emission rate; (8, count or more).
        source_weight: Result: weights, real and imaginary parts alternating, (2 count or more,).
    """
    pair, strength = legs.pair, legs.strength
    delay_out, transmit_doppler, weight_out = legs.transmit
    delay_back, curvature, distance, _, direction, weight_back, gain = legs.receive
    for k in range(echo.size):
        p, n = np.uintp(echo[k] // _PART), np.uintp(part_start + echo[k] % _PART)
        i, j = np.uintp(pair[p, 0]), np.uintp(pair[p, 1])
        columns[0, k], columns[1, k] = delay_out[i, n] + delay_back[j, n], curvature[j, n]
        columns[3, k], columns[7, k] = distance[j, n], transmit_doppler[i, n]
        for axis in range(3):
            columns[4 + axis, k] = direction[j, n, axis]
        weight = weight_out[0, i, n] * weight_back[j, n] * np.complex64(strength[p, n])
        if single_pattern:
            weight *= gain[np.uintp(pair[p, 2]), 0, n]
        source_weight[2 * k], source_weight[2 * k + 1] = weight.real, weight.imag
    for k in range(echo.size):
        columns[2, k] = 1 / columns[1, k]


@njit(error_model="numpy")
def _apply_pattern(
    echo: NDArray[np.int32], part_start: int, pair: Integers, receive_legs: ReceiveLegs, pattern: int, real: Singles,
    imaginary: Singles,
) -> None:  # fmt: skip
    """Multiply the weights of some echoes by the gain of one receive pattern; -1 is a dead element."""
    for k in range(real.size):
        p, n = echo[k] // _PART, part_start + echo[k] % _PART
        gain = receive_legs.gain[pair[p, 2], pattern, n] if pattern >= 0 else np.float32(0)
        real[k] *= gain
        imaginary[k] *= gain


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_on_elements(
    cells: NDArray[np.complex64], legs: PairedLegs, receive_beams: ReceiveBeams, nodes: ApertureNodes,
    sector: ArraySector, reception: Reception,
) -> None:  # fmt: skip
    """Deposit the echoes of one block by all pairs of legs on the cells of all elements of an array.

    Args:
        cells: Grids of pressure of elements and interpolation points, (channels, groups, cells, waveforms of a group).
        legs: Legs of both ends, and strengths.
        receive_beams: The elements, each with its own channel.
        nodes: Nodes at which echoes are evaluated.
        sector: Sector whose echoes go to interpolation points, which are channels after the elements.
        reception: Time grid, carrier and water.
    """
    pair, transmit_legs, receive_legs, strength = legs
    first_time, cell_rate, frequency, doppler_nodes, water = reception
    last, elements = cells.shape[2] - CELLS_PER_SPIKE, receive_beams.position.shape[0]
    node_count, terms = nodes.weights.shape[0], receive_legs.expansion.shape[1]
    capacity = pair.shape[0] * min(_PART, strength.shape[1])
    order = _EchoOrder(np.empty(capacity, np.int32), np.empty(capacity + 1, np.int32), np.empty(capacity, np.int32),
                       np.empty(cells.shape[2] + 2, np.int32))  # fmt: skip
    flags, columns = nonzero_legs(transmit_legs, receive_legs), np.empty((8, _TILE))
    expansion, source_weight, tau = np.empty((terms, _TILE)), np.empty(2 * _TILE, np.float32), columns[0]
    echoes = ArrivalColumns(
        columns[0], columns[1], columns[2], columns[3], columns[4], columns[5], columns[6], columns[7], expansion
    )
    arrival, doppler = np.empty((node_count, _TILE)), np.zeros((node_count, _TILE))
    spreading, new_index = np.empty((node_count, _TILE), np.float32), np.arange(_TILE).astype(np.int32)
    sorted_time, sorted_columns = np.zeros((node_count, _ROW)), np.zeros((3, node_count, _ROW), np.float32)
    sorted_real, sorted_imaginary, sorted_x = sorted_columns[0], sorted_columns[1], sorted_columns[2]
    size = _ELEMENTS_AT_ONCE * _ROW
    arrival_time, mixed = np.empty(size), np.zeros((3, size), np.float32)
    real, imaginary, x = mixed[0], mixed[1], mixed[2]
    first_cell, fraction, weight = np.empty(size, np.int32), np.empty(size, np.float32), np.empty(2 * size, np.float32)
    node_weights, basis = np.ascontiguousarray(nodes.weights.T), basis_weight_table(doppler_nodes)
    basis_share = np.zeros((4 * cells.shape[1], size if cells.shape[1] > 1 else 1), np.float32)
    inverse_range = 1 / basis.half_range if doppler_nodes.size > 1 else 0.0
    doppler[:], single_weights = basis.centre_doppler, node_weights.astype(np.float32)
    uniform, moments, window = True, empty_window(cells.shape[0], cells.shape[3]), 0
    for e in range(elements):
        uniform = uniform and receive_beams.pattern[e] == 0
    points = sector.point_count if uniform else 0
    for begin in range(0, strength.shape[1], _PART):
        total = _sort_echoes(begin, reception, last, legs, flags, order)
        for tile in range(0, total, _TILE):
            count = min(_TILE, total - tile)
            echo = order.echo[tile : tile + count]
            _gather_echoes(echo, begin, legs, uniform, columns, source_weight)
            if water.is_layered:
                for k in range(count):
                    p, n = echo[k] // _PART, begin + echo[k] % _PART
                    for t in range(terms):
                        expansion[t, k] = receive_legs.expansion[pair[p, 1], t, n]
            for k in range(node_count):
                node = ElementMotion(nodes.position[k], nodes.velocity[k], nodes.acceleration[k])
                arrival_times(echoes, count, node, water, arrival[k], spreading[k], doppler[k])
            in_sector = _partition_by_sector(arrival, count, tau, frequency, sector, new_index) if points > 0 else 0
            for k in range(node_count):
                for m in range(count):
                    k_new = np.uintp(new_index[m])
                    sorted_time[k, k_new] = arrival[k, m]
                    sorted_real[k, k_new] = spreading[k, m] * source_weight[2 * m]
                    sorted_imaginary[k, k_new] = spreading[k, m] * source_weight[2 * m + 1]
                    sorted_x[k, k_new] = np.float32((doppler[k, m] - basis.centre_doppler) * inverse_range)
            if cells.shape[1] == 1:
                cell = int(min(max((tau[0] - water.pulse_middle - first_time) * cell_rate, 0.0), float(last)))
                if cell >= window + WINDOW - 2 * MARGIN or cell < window:
                    deposit_moments(cells, moments, window, elements + points)
                    window = max(cell - MARGIN, 0)  # an echo off the grid has -1, which must not lie in the window
            e, at_once = 0, 0
            while e + at_once < elements + points:
                e += at_once
                at_once = min(_ELEMENTS_AT_ONCE, (elements if e < elements else elements + points) - e)
                first, stop = (in_sector, count) if e < elements else (0, in_sector)  # points take the sector's echoes
                if first == stop:
                    continue
                for s in range(at_once):
                    block = slice(s * _ROW + first, s * _ROW + stop)
                    shape = node_count, _ROW, first, stop, size
                    mix_nodes(node_weights, single_weights, sorted_time, sorted_columns, shape, np.intp(e + s),
                              np.intp(s * _ROW), arrival_time, mixed)  # fmt: skip
                    if doppler_nodes.size > 1:
                        for k in range(s * _ROW + first, s * _ROW + stop):
                            x[k] = min(max(x[k], np.float32(-1)), np.float32(1))
                    if not uniform:
                        pattern, row = receive_beams.pattern[e + s], slice(s * _ROW, s * _ROW + count)
                        _apply_pattern(echo, begin, pair, receive_legs, pattern, real[row], imaginary[row])
                    _locate(arrival_time[block], first_time, cell_rate, last, first_cell[block], fraction[block])
                    _fill_weights(arrival_time[block], real[block], imaginary[block], frequency,
                                  weight[2 * (s * _ROW + first) :])  # fmt: skip
                batch, number = slice(first, size), stop - first
                if cells.shape[1] > 1:
                    basis_weights(x[batch], basis.node_coordinate, basis.node_scale, basis_share)
                    deposit_waveforms(cells, e, at_once, _ROW, first_cell[batch], fraction[batch], weight[2 * first :],
                                      x[batch], basis, basis_share, number)  # fmt: skip
                else:
                    gather_moments(cells, moments, window, e, at_once, _ROW, first_cell[batch], fraction[batch],
                                   weight[2 * first :], x[batch], basis, number)  # fmt: skip
        if cells.shape[1] == 1:
            deposit_moments(cells, moments, window, elements + points)
