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

from insonify.fast_sincos import sincos_of_few
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
from insonify.synthesis._arrival_time_kernel import ArrivalColumns
from insonify.synthesis._echo_series_kernel import (
    ROW,
    TILE,
    ApertureNodes,
    EchoSeries,
    few_terms,
    fill_series,
    series_along,
    values_at_node,
    whole_vectors,
)
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE, WIDTH
from insonify.synthesis._polynomial_moments import MARGIN, WINDOW, deposit_moments, empty_window, gather_moments
from insonify.synthesis._simd_gridding import mix_series
from insonify.synthesis._waveform_basis_kernel import (
    BasisWeights,
    basis_weights,
    deposit_waveforms,
)

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
_PART = 32768
"""Number of scatterers whose echoes are sorted together."""
_TILE_CELLS = WINDOW - 2 * MARGIN - 1
"""Largest difference of the cells, at the array's centre, of echoes that are gathered as moments together."""
_DENSE = 320
"""Least number of echoes within `_TILE_CELLS` cells for which they are gathered as moments."""
_ELEMENTS_AT_ONCE = 4
"""Number of elements at which the echoes of a tile are deposited together."""
_SPIKES = _ELEMENTS_AT_ONCE * ROW
_SHIFT = WIDTH / 2 - 1
_FAR = 1e9
"""Magnitude of a position in cells beyond which an echo is off the grid; within it, positions fit an int32."""
_FAST = {"contract", "nsz", "arcp"}  # no reassociation: the order of sums would follow from the cache


class SectorLimits(NamedTuple):
    """Limits of a sector so narrow that a few interpolation points along an array determine all its elements."""

    max_delay_slope: float
    """Largest change of an echo's delay along half the array [s]."""
    curvature_phase: float
    """Curvature phase: the curved phase at the array's ends is this over the delay [rad s]."""
    max_residual_phase: float
    """Largest deviation of the curved phase at the array's ends from that [rad]."""
    half_pulse: float
    """Half the duration of the received pulse [s]."""
    min_delay: float
    """Least delay of an echo of the sector, longer than `half_pulse` [s]."""


class ArraySector(NamedTuple):
    """Sector of an array, whose echoes are deposited at interpolation points."""

    limits: SectorLimits
    basis: BasisWeights
    """Weights of its echoes in its own waveforms."""


class PairedLegs(NamedTuple):
    """Legs of both ends to n scatterers, and the strengths of their p pairs."""

    pair: Integers
    """Rows of the transmit leg, the receive leg and the gain of each pair, (p, 3)."""
    transmit: TransmitLegs
    """Transmit legs, one beam."""
    receive: ReceiveLegs
    """Receive legs."""
    strength: NDArray[Any]
    """Strength of each scatterer for each pair, real or complex [m], (p, n)."""


class _EchoOrder(NamedTuple):
    """Work arrays for the echoes of a part of the scatterers, in order of arrival."""

    echo: NDArray[np.int32]
    """Code of each echo, in order of arrival: row of the pair of legs times `_PART`, plus the scatterer's index in the
    part, (pairs times `_PART`,)."""
    unsorted_echo: NDArray[np.int32]
    """Codes of the echoes pair by pair, (pairs times `_PART` + 1,)."""
    cell: NDArray[np.int32]
    """Cell in which each unsorted echo arrives at the array's centre."""
    starts: NDArray[np.int32]
    """Number of echoes before each cell while they are sorted; afterwards, of those before the next cell."""


@njit(cache=True, nogil=True, error_model="numpy")
def _sort_echoes(
    part_start: int, reception: Reception, last: int, legs: PairedLegs, flags: tuple[Flags, Flags, Flags],
    order: _EchoOrder,
) -> tuple[int, int, int]:  # fmt: skip
    """Sort the echoes of a part of the scatterers by counting the echoes of each cell.

    Returns:
        Number of echoes, first cell with echoes, last cell with echoes.
    """
    total, low, high, pair, strength = 0, last, 0, legs.pair, legs.strength
    first_time, cell_rate = reception.first_time, reception.cell_rate
    end = min(part_start + _PART, strength.shape[1])
    transmit_flags, receive_flags, gain_flags = flags
    for p in range(pair.shape[0]):
        i, j, row = pair[p]
        echo, key = order.unsorted_echo[total:], order.cell[total:]
        count = scatterers_with_echo(
            0, strength[p, part_start:end], transmit_flags[i, part_start:end], receive_flags[j, part_start:end],
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
        return 0, 0, 0
    order.starts[low : high + 2] = 0
    for k in range(total):
        order.starts[np.uintp(order.cell[k] + 1)] += 1
    for cell in range(low + 1, high + 2):
        order.starts[cell] += order.starts[cell - 1]
    for k in range(total):
        cell_of_echo = np.uintp(order.cell[k])
        order.echo[np.uintp(order.starts[cell_of_echo])] = order.unsorted_echo[k]
        order.starts[cell_of_echo] += 1
    return total, low, high


class _Echoes(NamedTuple):
    """Echoes of a tile as series of Chebyshev polynomials along the array, those of the sector first."""

    turns: Floats
    """Cycles of the carrier by each of the first three terms of the delay, the first less whole cycles, (3, tile)."""
    cell: NDArray[np.int32]
    """Cell of the first term of the delay."""
    centre: Singles
    """Position in that cell [1], real and imaginary part of the weight without carrier [uPa], (3, tile)."""
    series: Singles
    """Terms of three series: cycles of the carrier after the third term, spreading ratio [1], coordinate in the
    waveform basis [1], (3, terms, tile)."""


class _Spikes(NamedTuple):
    """Spikes of the echoes of a tile at some elements, one element after the other."""

    mixed: Singles
    """Cycles of the carrier by the terms after the third, spreading ratio [1], coordinate in the waveform basis [1],
    (3, spikes)."""
    turns: Singles
    """Cycles of the carrier by the second and third term; by the first three, less whole cycles, (2, tile)."""
    first_cell: NDArray[np.int32]
    """First cell; -1: off the grid, (spikes,)."""
    fraction: Singles
    """Position between cells [1], (spikes,)."""
    weight: Singles
    """Weight with carrier [uPa], real and imaginary parts alternating, (2 spikes,)."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _locate_centres(time: Floats, count: int, reception: Reception, echoes: _Echoes) -> None:
    """Fill cells of times of arrival, positions in them, and cycles of the carrier less whole ones."""
    first_time, cell_rate, frequency = reception.first_time, reception.cell_rate, reception.frequency
    cell, fraction, turns = echoes.cell, echoes.centre[0], echoes.turns[0]
    for m in range(count):
        position = (time[m] - first_time) * cell_rate - _SHIFT
        position = position if (position > -_FAR) & (position < _FAR) else -_FAR  # so is NaN
        whole = np.floor(position)
        cell[m], fraction[m] = np.int32(whole), np.float32(position - whole)
        cycles = frequency * time[m]
        turns[m] = cycles - np.rint(cycles)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _fill_spikes(
    polynomials: tuple[float, float], pattern_gain: Singles, last: int, cells_per_cycle: float,
    coordinate: tuple[float, float], echoes: _Echoes, spikes: _Spikes, rows: tuple[int, int, int],
) -> None:  # fmt: skip
    """Cells and weights of some echoes at one element, from their series.

    Args:
        polynomials: Second and third polynomial at the element.
        pattern_gain: Amplitude of the element towards each echo [1]; or empty: 1.
        last: One past the last cell in which a spike may start.
        cells_per_cycle: Cells per cycle of the carrier [1].
        coordinate: Factor and shift from coordinates of echoes to those in the channel's waveform basis.
        echoes: Echoes.
        spikes: Spikes, whose columns from the series are filled already.
        rows: First echo of the tile, one past the last, and index of the element's spike for echo 0 of the tile.
    """
    first, number, begin = np.uintp(rows[0]), rows[1] - rows[0], np.uintp(rows[2] + rows[0])
    second, third = polynomials
    count, phase, cell, centre = whole_vectors(number), echoes.turns, echoes.cell, echoes.centre
    mixed, turns, first_cell, fraction, weight = spikes
    ratio, end, half, one = np.float32(cells_per_cycle), np.int32(last), np.float32(0.5), np.float32(1)
    for m in range(count):  # several loops: compilers vectorise those of few arrays
        i = first + np.uintp(m)
        beyond = second * phase[1, i] + third * phase[2, i]
        cycles = phase[0, i] + beyond
        turns[0, m], turns[1, m] = np.float32(beyond), np.float32(cycles - np.rint(cycles))
    for m in range(pattern_gain.size):
        mixed[1, begin + np.uintp(m)] *= pattern_gain[m]
    for m in range(count):
        i, k = first + np.uintp(m), begin + np.uintp(m)
        fraction[k] = centre[0, i] + ratio * (turns[0, m] + mixed[0, k])
    for m in range(count):
        k = begin + np.uintp(m)
        whole = np.floor(fraction[k])
        at = np.int32(cell[first + np.uintp(m)] + np.int32(whole))
        first_cell[k] = at if (at >= 0) & (at < end) else np.int32(-1)
        fraction[k] = fraction[k] - whole - half
    factor, shift = np.float32(coordinate[0]), np.float32(coordinate[1])
    for m in range(count):
        k = begin + np.uintp(m)
        mixed[2, k] = min(max(factor * mixed[2, k] + shift, -one), one)
    for m in range(count):
        i, k = first + np.uintp(m), begin + np.uintp(m)
        sine, cosine = sincos_of_few(turns[1, m] + mixed[0, k])
        real, imaginary = mixed[1, k] * centre[1, i], mixed[1, k] * centre[2, i]
        weight[np.uintp(2) * k] = real * cosine + imaginary * sine
        weight[np.uintp(2) * k + np.uintp(1)] = imaginary * cosine - real * sine


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _partition_by_sector(
    series: EchoSeries, count: int, frequency: float, centre_delay: Floats, limits: SectorLimits,
    change_of_coordinate: tuple[float, float], new_index: NDArray[np.int32],
) -> int:  # fmt: skip
    """Number the echoes anew, those of the sector before the others; return the number of those of the sector.

    Args:
        series: Series of the echoes.
        count: Number of echoes.
        frequency: Carrier frequency [Hz].
        centre_delay: Delays of the echoes at the array's centre [s], (count or more,).
        limits: Limits of the sector.
        change_of_coordinate: Factor and shift from coordinates in the waveform basis to those in that of the sector.
        new_index: Result: new index of each echo, (count or more,).
    """
    half_curvature = 2 * math.pi * series.half_curvature * frequency  # phase at the array's ends [rad/s]
    slope, curvature, coordinate, coordinate_slope = (
        series.time[1], series.time[2], series.single[1, 0], series.single[1, 1],
    )  # fmt: skip
    in_sector, (factor, shift) = 0, change_of_coordinate
    for m in range(count):
        delay = max(centre_delay[m], limits.min_delay)
        phase = limits.curvature_phase / delay
        # samples of the pulse have the curvature of their own times
        residual = abs(half_curvature * curvature[m] - phase) + phase * limits.half_pulse / (delay - limits.half_pulse)
        within = (
            abs(slope[m]) <= limits.max_delay_slope
            and residual <= limits.max_residual_phase
            and centre_delay[m] >= limits.min_delay
            and abs(factor * coordinate[m] + shift) + abs(factor * coordinate_slope[m]) <= 1
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
        echo: Codes of the echoes, see `_EchoOrder.echo`, (count,).
        part_start: First scatterer of the part.
        legs: Legs of both ends, and strengths.
        single_pattern: True if all elements have the first pattern.
        columns: Result: delay, curvature, its inverse, distance, three of direction, transmit Doppler factor, in the
            order and units of `ArrivalColumns`, (8, count or more).
        source_weight: Result: weights without carrier [uPa], real and imaginary parts alternating, (2 count or more,).
    """
    pair, strength = legs.pair, legs.strength
    transmit_delay, transmit_doppler, transmit_weight = legs.transmit
    receive_delay, curvature, distance, _, direction, receive_weight, gain = legs.receive
    for k in range(echo.size):
        p, n = np.uintp(echo[k] // _PART), np.uintp(part_start + echo[k] % _PART)
        i, j = np.uintp(pair[p, 0]), np.uintp(pair[p, 1])
        columns[0, k], columns[1, k] = transmit_delay[i, n] + receive_delay[j, n], curvature[j, n]
        columns[3, k], columns[7, k] = distance[j, n], transmit_doppler[i, n]
        for axis in range(3):
            columns[4 + axis, k] = direction[j, n, axis]
        weight = transmit_weight[0, i, n] * receive_weight[j, n] * np.complex64(strength[p, n])
        if single_pattern:
            weight *= gain[np.uintp(pair[p, 2]), 0, n]
        source_weight[2 * k], source_weight[2 * k + 1] = weight.real, weight.imag
    for k in range(echo.size):
        columns[2, k] = 1 / columns[1, k]


@njit(error_model="numpy")
def _gather_gains(
    echo: NDArray[np.int32], part_start: int, pair: Integers, receive_legs: ReceiveLegs, pattern: int, gain: Singles
) -> None:
    """Fill the amplitude of one receive pattern (-1: a dead element) towards some echoes [1]."""
    for k in range(echo.size):
        p, n = echo[k] // _PART, part_start + echo[k] % _PART
        gain[k] = receive_legs.gain[pair[p, 2], pattern, n] if pattern >= 0 else np.float32(0)


@njit(error_model="numpy")
def _gather_expansion(
    echo: NDArray[np.int32], part_start: int, pair: Integers, receive_legs: ReceiveLegs, expansion: Floats
) -> None:
    """Fill deviations of some echoes from spherical wavefronts, (terms, count or more); without terms, none."""
    for k in range(echo.size if expansion.shape[0] > 0 else 0):
        p, n = echo[k] // _PART, part_start + echo[k] % _PART
        for t in range(expansion.shape[0]):
            expansion[t, k] = receive_legs.expansion[pair[p, 1], t, n]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _partition_series(
    series: EchoSeries, source_weight: Singles, count: int, reception: Reception,
    sector: tuple[SectorLimits, tuple[float, float]], centre_delay: Floats, work: tuple[_Echoes, NDArray[np.int32]],
    echoes: _Echoes,
) -> int:  # fmt: skip
    """Move the series of the echoes of the sector before those of others; return the number of echoes of the sector.

    Args:
        series: Series of the echoes in order of arrival.
        source_weight: Weights without carrier [uPa], real and imaginary parts alternating.
        count: Number of echoes.
        reception: Time grid, carrier and water.
        sector: Limits of the sector, and factor and shift from coordinates in the waveform basis to those in its own.
        centre_delay: Delays at the array's centre [s].
        work: Work arrays.
        echoes: Result: the echoes.
    """
    terms, frequency, in_sector, (unsorted, new_index) = echoes.series.shape[1], reception.frequency, 0, work
    kept, limits = few_terms(terms), sector[0]
    _locate_centres(series.time[0], whole_vectors(count), reception, unsorted)
    if limits.max_delay_slope > 0:
        in_sector = _partition_by_sector(series, count, frequency, centre_delay, limits, sector[1], new_index)
    else:
        for m in range(count):
            new_index[m] = m
    for m in range(count):
        k = np.uintp(new_index[m])
        echoes.turns[0, k], echoes.cell[k], echoes.centre[0, k] = (
            unsorted.turns[0, m], unsorted.cell[m], unsorted.centre[0, m],
        )  # fmt: skip
        echoes.turns[1, k], echoes.turns[2, k] = frequency * series.time[1, m], frequency * series.time[2, m]
        echoes.centre[1, k], echoes.centre[2, k] = source_weight[2 * m], source_weight[2 * m + 1]
    for j in range(3, terms):
        for m in range(count):
            echoes.series[0, j, np.uintp(new_index[m])] = np.float32(frequency * series.time[j, m])
    for j in range(kept):
        for m in range(count):
            k = np.uintp(new_index[m])
            echoes.series[1, j, k], echoes.series[2, j, k] = series.single[0, j, m], series.single[1, j, m]
    return in_sector


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _fill_at_element(
    series: EchoSeries, source_weight: Singles, count: int, reception: Reception, echoes: _Echoes, mixed: Singles
) -> None:
    """Fill echoes at one element that is a node of its own; its values are in the first row of the node values."""
    _locate_centres(series.node_time[0], count, reception, echoes)
    mixed[0] = 0
    for m in range(count):
        echoes.centre[1, m], echoes.centre[2, m] = source_weight[2 * m], source_weight[2 * m + 1]
        mixed[1, m], mixed[2, m] = series.node_spreading[0, m], series.node_x[0, m]


@njit(cache=True, nogil=True, error_model="numpy")
def _echo_buffer(terms: int) -> _Echoes:
    """Work arrays for series of a number of terms."""
    return _Echoes(
        np.zeros((3, ROW)), np.zeros(ROW, np.int32), np.zeros((3, ROW), np.float32),
        np.zeros((3, terms, ROW), np.float32),
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _spike_buffer() -> _Spikes:
    """Work arrays for spikes."""
    return _Spikes(
        np.zeros((3, _SPIKES), np.float32), np.empty((2, TILE), np.float32), np.empty(_SPIKES, np.int32),
        np.empty(_SPIKES, np.float32), np.empty(2 * _SPIKES, np.float32),
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _deposit_spikes(
    cells: NDArray[np.complex64], moments: Singles, window: int, basis: BasisWeights, share: Singles, spikes: _Spikes,
    channels: tuple[int, int], echoes: tuple[int, int],
) -> None:  # fmt: skip
    """Deposit spikes of some echoes at some channels, or gather them as moments.

    Args:
        cells: Grids of pressure.
        moments: Moments in a window.
        window: First cell of the window; -1: nothing is gathered.
        basis: Weights of echoes in the waveforms.
        share: Work array for more than four waveforms.
        spikes: The spikes.
        channels: First channel, and number of channels.
        echoes: First echo of the tile, and number of echoes.
    """
    first, count = echoes
    batch = slice(first, _SPIKES)
    first_cell, fraction, coordinate, weight = (
        spikes.first_cell[batch], spikes.fraction[batch], spikes.mixed[2, batch], spikes.weight[2 * first :],
    )  # fmt: skip
    if window >= 0:
        gather_moments(cells, moments, window, channels[0], channels[1], ROW, first_cell, fraction, weight, coordinate,
                       basis, count)  # fmt: skip
        return
    if cells.shape[1] > 1:
        basis_weights(coordinate, basis.node_coordinate, basis.node_scale, share)
    deposit_waveforms(cells, channels[0], channels[1], ROW, first_cell, fraction, weight, coordinate, basis, share,
                      count)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _change_of_coordinate(basis: BasisWeights, other: BasisWeights) -> tuple[float, float]:
    """Factor and shift from coordinates in one waveform basis to those in another; 0 for one waveform."""
    if other.half_range == 0:
        return 0.0, 0.0
    inverse = 1 / other.half_range
    return basis.half_range * inverse, (basis.centre_doppler - other.centre_doppler) * inverse


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_on_elements(
    cells: NDArray[np.complex64], point_cells: NDArray[np.complex64], legs: PairedLegs, receive_beams: ReceiveBeams,
    nodes: ApertureNodes, sector: ArraySector, reception: Reception,
) -> None:  # fmt: skip
    """Deposit the echoes of one block by all pairs of legs on the cells of all elements of an array.

    Args:
        cells: Grids of pressure of the elements [uPa], (elements, groups, cells, waveforms of a group).
        point_cells: Grids of the sector's interpolation points [uPa], (points, groups, cells, waveforms of a group).
        legs: Legs of both ends, and strengths.
        receive_beams: The elements, each with its own channel.
        nodes: Nodes at which echoes are evaluated.
        sector: Sector whose echoes go to interpolation points.
        reception: Time grid, carrier and water.
    """
    pair, transmit_legs, receive_legs, strength = legs
    basis, water, is_straight = reception.basis, reception.water, nodes.series.shape[0] > 0
    series_columns = 3 if basis.node_coordinate.size > 1 else 2
    last, elements = cells.shape[2] - CELLS_PER_SPIKE, receive_beams.position.shape[0]
    series, polynomials = series_along(nodes, water, basis)
    terms, singles = polynomials.shape[1], polynomials.astype(np.float32)
    capacity = pair.shape[0] * min(_PART, strength.shape[1])
    order = _EchoOrder(np.empty(capacity, np.int32), np.empty(capacity + 1, np.int32), np.empty(capacity, np.int32),
                       np.empty(cells.shape[2] + 2, np.int32))  # fmt: skip
    flags, columns = nonzero_legs(transmit_legs, receive_legs), np.ones((8, TILE))
    expansion, source_weight = np.empty((receive_legs.expansion.shape[1], TILE)), np.empty(2 * TILE, np.float32)
    echoes_at_nodes = ArrivalColumns(
        columns[0], columns[1], columns[2], columns[3], columns[4], columns[5], columns[6], columns[7], expansion
    )
    echoes, spikes, work = _echo_buffer(terms), _spike_buffer(), (_echo_buffer(0), np.empty(TILE, np.int32))
    share = np.zeros((4 * max(cells.shape[1], point_cells.shape[1]), _SPIKES), np.float32)
    gain, no_gain = np.empty(TILE, np.float32), np.empty(0, np.float32)
    uniform, window, cells_per_cycle = True, 0, reception.cell_rate / reception.frequency
    for e in range(elements):
        uniform = uniform and receive_beams.pattern[e] == 0
    grids, bases = (cells, point_cells), (basis, sector.basis)
    coordinates = (1.0, 0.0), _change_of_coordinate(basis, sector.basis)
    moments = empty_window(len(cells), cells.shape[3]), empty_window(len(point_cells), point_cells.shape[3])
    channels, limits = (elements, len(point_cells) if uniform else 0), sector.limits
    if not uniform:
        limits = SectorLimits(0.0, 0.0, 0.0, 0.0, 1.0)
    gathered = cells.shape[1] == 1, channels[1] > 0 and point_cells.shape[1] == 1
    for begin in range(0, strength.shape[1], _PART):
        total, tile_cell, last_cell = _sort_echoes(begin, reception, last, legs, flags, order)
        count, tile = 0, 0
        while tile + count < total:
            tile += count
            while order.starts[tile_cell] <= tile:
                tile_cell += 1
            near = order.starts[min(tile_cell + _TILE_CELLS, last_cell)] - tile
            gathers = (gathered[0] or gathered[1]) and near >= _DENSE
            count = min(TILE, near if gathers else total - tile)
            echo, wide = order.echo[tile : tile + count], whole_vectors(count)
            _gather_echoes(echo, begin, legs, uniform, columns, source_weight)
            _gather_expansion(echo, begin, pair, receive_legs, expansion)
            in_sector = 0
            if is_straight:
                fill_series(columns, echoes_at_nodes, wide, nodes, water, basis, series)
                in_sector = _partition_series(
                    series, source_weight, count, reception, (limits, coordinates[1]), columns[0], work, echoes
                )
            if gathers:
                centre = (columns[0, 0] - water.pulse_middle - reception.first_time) * reception.cell_rate
                start = max(int(min(max(centre, 0.0), float(last))) - MARGIN, 0)
                if start != window:
                    stop = window + WINDOW if start < window else min(start, window + WINDOW)
                    for g in range(2):
                        deposit_moments(grids[g], moments[g], window, stop, channels[g] if gathered[g] else 0)
                    window = start  # an echo off the grid has -1, which must not lie in the window
            for g in range(2):  # points take the sector's echoes, elements the others
                grid, (first, stop) = grids[g], (in_sector, count) if g == 0 else (0, in_sector)
                for e in range(0, channels[g] if first < stop else 0, _ELEMENTS_AT_ONCE):
                    at_once = min(_ELEMENTS_AT_ONCE, channels[g] - e)
                    for s in range(at_once):
                        row, n, second, third = s * ROW, g * elements + e + s, 0.0, 0.0
                        if is_straight:
                            second, third = polynomials[n, 1], polynomials[n, 2]
                            shape = terms, few_terms(terms), ROW, first, stop, _SPIKES, series_columns
                            mix_series(singles, echoes.series, shape, np.intp(n), np.intp(row), spikes.mixed)
                        else:
                            values_at_node(n, 0, echoes_at_nodes, count, nodes, water, basis, series)
                            _fill_at_element(
                                series, source_weight, count, reception, echoes, spikes.mixed[:, row : row + count]
                            )
                        if not uniform:
                            _gather_gains(echo, begin, pair, receive_legs, receive_beams.pattern[n], gain)
                        used_gain = no_gain if uniform else gain[:count]
                        _fill_spikes((second, third), used_gain, last, cells_per_cycle, coordinates[g], echoes, spikes,
                                     (first, stop, row))  # fmt: skip
                    _deposit_spikes(
                        grid, moments[g], window if gathers and gathered[g] else -1, bases[g], share, spikes,
                        (e, at_once), (first, stop - first),
                    )  # fmt: skip
        for g in range(2):
            deposit_moments(grids[g], moments[g], window, window + WINDOW, channels[g] if gathered[g] else 0)
