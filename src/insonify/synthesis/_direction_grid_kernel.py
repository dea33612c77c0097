"""Kernels that deposit echoes on a grid of time and direction, from which all beams of an array follow.

Along the direction cosine to an array's right an echo is spread over a few rows, by the kernel that spreads it over a
few cells in time. So an echo costs the same for any number of beams. Plain numbers and arrays.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar.beam_kernels import interpolate_pattern
from insonify.synthesis._arrival_kernel import (
    BLOCK,
    ArrivalBuffer,
    BlockLegs,
    ReceiveBeams,
    Reception,
    _apply_carrier,
    _fill_weights,
    _gather_echoes,
    locate_arrivals,
)
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE, DEGREE, WIDTH, tap_coefficients
from insonify.synthesis._waveform_basis_kernel import basis_weights, deposit_waveforms

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Reals = NDArray[np.floating[Any]]
_TAPS = tap_coefficients()
_FAST = {"contract", "reassoc", "nsz", "arcp"}
_CELLS = 256
"""Numbers of a row that are processed together: those of all rows fit in the cache."""


class DirectionRows(NamedTuple):
    """Rows of the grid: evenly spaced direction cosines to an array's right."""

    first: float
    """Direction cosine of the first row [1]."""
    step: float
    """Spacing of the rows [1]; 0: no grid, channels are beams."""
    transmit_pattern: Floats
    """Pattern of transmit beams steered with the receive beams, cubics of shape (rows, 4); empty: none."""
    transmit_rows_per_unit: float
    """Rows of that pattern per unit of direction cosine [1]."""


class RowSortBuffer(NamedTuple):
    """Work arrays for the echoes of one pair of legs, sorted by row, up to `BLOCK`."""

    row: NDArray[np.int32]
    """First row of each echo, unsorted."""
    starts: NDArray[np.int64]
    """Number of echoes before each row, (rows + 1,)."""
    order: NDArray[np.int32]
    row_weights: Singles
    """Weight of each echo in its rows, (WIDTH, BLOCK)."""
    first_cell: NDArray[np.int32]
    single: Singles
    """Position between cells and coordinate in the waveform basis, (2, BLOCK)."""
    weight: Singles
    """Weights, real and imaginary parts alternating."""
    row_part: Singles
    """Weights of one row, real and imaginary parts alternating."""
    row_fraction: Singles
    """Position between rows, unsorted."""


@njit(cache=True, nogil=True, error_model="numpy")
def row_sort_buffer(rows: int) -> RowSortBuffer:
    """Work arrays for echoes on a grid of `rows` rows."""
    return RowSortBuffer(
        np.empty(BLOCK, np.int32), np.empty(rows + 2, np.int64), np.empty(BLOCK, np.int32),
        np.empty((WIDTH, BLOCK), np.float32), np.empty(BLOCK, np.int32), np.zeros((2, BLOCK), np.float32),
        np.empty(2 * BLOCK, np.float32), np.empty(2 * BLOCK, np.float32), np.empty(BLOCK, np.float32),
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _sort_by_row(
    right_cosine: Floats, column_number: NDArray[np.int32], count: int, rows: DirectionRows, row_count: int,
    sort_buffer: RowSortBuffer,
) -> None:  # fmt: skip
    """First rows of some echoes, their weights in these and the following rows, and their order by row.

    Args:
        right_cosine: Direction cosine to the array's right of the scatterers of a part, (part,).
        column_number: Indices of those with an echo, (count or more,).
        count: Number of echoes.
        rows: Rows of the grid.
        row_count: Number of rows.
        sort_buffer: Result: work arrays.
    """
    last = row_count - CELLS_PER_SPIKE
    inverse_step, shift = 1 / rows.step, 0.5 * WIDTH - 1
    for k in range(count):
        position = (right_cosine[np.uintp(column_number[k])] - rows.first) * inverse_step - shift
        position = min(max(position, 0.0), float(last))
        cell = np.floor(position)
        sort_buffer.row[k], sort_buffer.row_fraction[k] = np.int32(cell), np.float32(position - cell - 0.5)
    sort_buffer.starts[:] = 0
    for k in range(count):
        sort_buffer.starts[sort_buffer.row[k] + 1] += 1
    for r in range(1, sort_buffer.starts.size):
        sort_buffer.starts[r] += sort_buffer.starts[r - 1]
    for k in range(count):
        row = sort_buffer.row[k]
        sort_buffer.order[sort_buffer.starts[row]] = k
        sort_buffer.starts[row] += 1
    for r in range(sort_buffer.starts.size - 1, 0, -1):  # each start has advanced to that of the next row
        sort_buffer.starts[r] = sort_buffer.starts[r - 1]
    sort_buffer.starts[0] = 0
    for t in range(WIDTH):
        for m in range(count):
            y = sort_buffer.row_fraction[sort_buffer.order[m]]
            value = _TAPS[DEGREE, t]
            for d in range(DEGREE - 1, -1, -1):
                value = value * y + _TAPS[d, t]
            sort_buffer.row_weights[t, m] = value


class DirectionColumns(NamedTuple):
    """Grid of directions, and the direction cosines of one pair of legs to an array's right."""

    rows: DirectionRows
    """The grid."""
    transmit_cosine: Floats
    """Direction cosines of departure, (part,); needed for steered transmit beams."""
    right_cosine: Floats
    """Direction cosines of arrival, (part,)."""
    sort_buffer: RowSortBuffer
    """Work arrays for sorting."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_pair_by_direction(
    cells: NDArray[np.complex64], leg_rows: tuple[int, int, int], count: int, buffer: ArrivalBuffer, legs: BlockLegs,
    receive_beams: ReceiveBeams, reception: Reception, directions: DirectionColumns,
) -> None:  # fmt: skip
    """Deposit the echoes of some scatterers by one pair of legs on the rows about their directions.

    Args:
        cells: Grids of pressure, shape (rows, groups, cells, waveforms of a group): see `group_layout`.
        leg_rows: Rows of the transmit leg, the receive leg and the gain, which is common to all beams.
        count: Number of scatterers with an echo.
        buffer: Their indices and strengths, and work arrays.
        legs: BlockLegs of both ends.
        receive_beams: The one receive point.
        reception: Time grid, carrier and water.
        directions: The grid, and the directions of the legs.
    """
    i, j, gain_row = leg_rows
    last, scatterer, rows = cells.shape[2] - CELLS_PER_SPIKE, buffer.scatterer, directions.rows
    sort_buffer, right_cosine = directions.sort_buffer, directions.right_cosine
    fraction, pattern_gain, _, x = buffer.single
    gain = legs.receive.gain[gain_row, 0]
    for k in range(count):
        pattern_gain[k] = gain[np.uintp(scatterer[k])]
    _gather_echoes(i, j, count, buffer, legs, reception.water.is_layered)
    locate_arrivals(0, count, last, buffer, receive_beams, reception)
    if rows.transmit_pattern.shape[0]:
        # a wide transmit pattern, taken at the direction of the receive leg: exact on each beam's axis, and for equal
        # legs
        for k in range(count):
            n = np.uintp(scatterer[k])
            pattern_gain[k] *= np.float32(
                interpolate_pattern(
                    rows.transmit_pattern, rows.transmit_rows_per_unit, directions.transmit_cosine[n] - right_cosine[n]
                )
            )
    _fill_weights(legs.transmit.weight[0, i], legs.receive.weight[j], count, buffer)
    _apply_carrier(count, reception.frequency, buffer)
    _sort_by_row(right_cosine, scatterer, count, rows, cells.shape[0], sort_buffer)
    for m in range(count):
        k = int(sort_buffer.order[m])
        sort_buffer.first_cell[m], sort_buffer.single[0, m], sort_buffer.single[1, m] = (
            buffer.first_cell[k],
            fraction[k],
            x[k],
        )
        sort_buffer.weight[2 * m], sort_buffer.weight[2 * m + 1] = (
            buffer.carrier_weight[2 * k],
            buffer.carrier_weight[2 * k + 1],
        )
    _deposit_rows(cells, sort_buffer, buffer)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _deposit_rows(cells: NDArray[np.complex64], sort_buffer: RowSortBuffer, buffer: ArrivalBuffer) -> None:
    """Deposit sorted echoes on the rows of their kernels, row by row."""
    starts, basis = sort_buffer.starts, buffer.basis
    for row in range(cells.shape[0]):
        begin, end = starts[max(row - WIDTH + 1, 0)], starts[row + 1]
        if begin == end:
            continue
        for first in range(max(row - WIDTH + 1, 0), row + 1):  # echoes with this first row
            tap = sort_buffer.row_weights[row - first]
            for m in range(starts[first], starts[first + 1]):
                sort_buffer.row_part[2 * (m - begin)] = sort_buffer.weight[2 * m] * tap[m]
                sort_buffer.row_part[2 * (m - begin) + 1] = sort_buffer.weight[2 * m + 1] * tap[m]
        x = sort_buffer.single[1, begin:end]
        if cells.shape[1] > 1:
            basis_weights(x, basis.node_coordinate, basis.node_scale, buffer.basis_weights)
        deposit_waveforms(cells, row, 1, 1, sort_buffer.first_cell[begin:end], sort_buffer.single[0, begin:end],
                          sort_buffer.row_part, x, basis,
                     buffer.basis_weights, end - begin)  # fmt: skip


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def combine_rows(rows_in: Reals, weights: Singles, beams: Singles) -> None:
    """Weighted sums of rows: a matrix product, without the blocks that hold nothing or have no weight.

    Rows outside the received sector, and times before the first echo and after the last, are empty. The filled rows of
    a block of times are copied next to each other: at the stride of a whole row most of the cache would stay unused.

    Args:
        rows_in: Rows of the grid, (rows, n); rows are a multiple of 4.
        weights: Weight of each row in each beam, (beams, rows).
        beams: Result, (beams, n).
    """
    filled, block = np.empty(rows_in.shape[0] // 4, np.int64), np.empty((rows_in.shape[0], _CELLS), np.float32)
    has_weight = np.empty(((weights.shape[0] + 3) // 4, rows_in.shape[0] // 4), np.bool_)
    for group in range(has_weight.shape[0]):
        for r in range(has_weight.shape[1]):
            has_weight[group, r] = weights[4 * group : 4 * group + 4, 4 * r : 4 * r + 4].any()
    grouped_beams = weights.shape[0] // 4 * 4
    for begin in range(0, rows_in.shape[1], _CELLS):
        end = min(begin + _CELLS, rows_in.shape[1])
        count = 0
        for r in range(0, weights.shape[1], 4):
            block[4 * count : 4 * count + 4, : end - begin] = rows_in[r : r + 4, begin:end]
            if block[4 * count : 4 * count + 4, : end - begin].any():
                filled[count] = r
                count += 1
        beams[:, begin:end] = 0
        for beam in range(0, grouped_beams, 4):
            for k in range(count):
                if has_weight[beam // 4, filled[k] // 4]:
                    _add_to_four_beams(block[4 * k : 4 * k + 4], filled[k], weights, beam, beams, begin, end)
        for beam in range(grouped_beams, weights.shape[0]):
            for k in range(count):
                if has_weight[beam // 4, filled[k] // 4]:
                    _add_to_beam(block[4 * k : 4 * k + 4], filled[k], weights, beam, beams, begin, end)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _add_to_four_beams(
    four_rows: Singles, r: int, weights: Singles, beam: int, beams: Singles, begin: int, end: int
) -> None:
    """Add four rows from row r on to four beams: each is read a quarter as often as for one beam after the other."""
    count = end - begin
    row_a, row_b = four_rows[0, :count], four_rows[1, :count]
    row_c, row_d = four_rows[2, :count], four_rows[3, :count]
    w0, w1 = weights[beam, r : r + 4], weights[beam + 1, r : r + 4]
    w2, w3 = weights[beam + 2, r : r + 4], weights[beam + 3, r : r + 4]
    a0, b0, c0, d0 = w0[0], w0[1], w0[2], w0[3]
    a1, b1, c1, d1 = w1[0], w1[1], w1[2], w1[3]
    a2, b2, c2, d2 = w2[0], w2[1], w2[2], w2[3]
    a3, b3, c3, d3 = w3[0], w3[1], w3[2], w3[3]
    beam_0, beam_1 = beams[beam, begin:end], beams[beam + 1, begin:end]
    beam_2, beam_3 = beams[beam + 2, begin:end], beams[beam + 3, begin:end]
    for k in range(count):
        a, b, c, d = row_a[k], row_b[k], row_c[k], row_d[k]
        beam_0[k] += a0 * a + b0 * b + c0 * c + d0 * d
        beam_1[k] += a1 * a + b1 * b + c1 * c + d1 * d
        beam_2[k] += a2 * a + b2 * b + c2 * c + d2 * d
        beam_3[k] += a3 * a + b3 * b + c3 * c + d3 * d


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _add_to_beam(four_rows: Singles, r: int, weights: Singles, beam: int, beams: Singles, begin: int, end: int) -> None:
    """Add four rows from row r on to one beam."""
    count = end - begin
    a, b, c, d = weights[beam, r], weights[beam, r + 1], weights[beam, r + 2], weights[beam, r + 3]
    row_a, row_b = four_rows[0, :count], four_rows[1, :count]
    row_c, row_d = four_rows[2, :count], four_rows[3, :count]
    one_beam = beams[beam, begin:end]
    for k in range(count):
        one_beam[k] += a * row_a[k] + b * row_b[k] + c * row_c[k] + d * row_d[k]
