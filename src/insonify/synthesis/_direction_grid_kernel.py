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
from insonify.synthesis._simd_product import TILE, multiply_tile
from insonify.synthesis._waveform_basis_kernel import BasisWeights, basis_weights, deposit_waveforms

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Reals = NDArray[np.floating[Any]]
_TAPS = tap_coefficients()
_FAST = {"contract", "reassoc", "nsz", "arcp"}
_CELLS = 256
"""Numbers of a row that are processed together: so many of all rows fit in the cache."""


class DirectionRows(NamedTuple):
    """Rows of the grid: evenly spaced direction cosines to an array's right."""

    first: float
    """Direction cosine of the first row [1]."""
    step: float
    """Spacing of the rows [1]; 0: no grid, channels are beams."""
    transmit_pattern: Floats
    """Amplitude of transmit beams steered with the receive beams, as cubics in the difference of direction cosines, see
    `interpolate_pattern`, (rows, 4); empty: none."""
    transmit_rows_per_unit: float
    """Rows of that pattern per unit of direction cosine [1]."""


class RowSortBuffer(NamedTuple):
    """Work arrays for the echoes of one pair of legs, sorted by row, up to `BLOCK`."""

    row: NDArray[np.int32]
    """First row of each echo, unsorted."""
    starts: NDArray[np.int64]
    """Number of echoes before each row, (rows + 1,)."""
    order: NDArray[np.int32]
    """Index of each echo in order of rows."""
    row_weights: Singles
    """Gridding kernel of each sorted echo in its rows [1], (WIDTH, BLOCK)."""
    first_cell: NDArray[np.int32]
    """First cell of each sorted echo; -1: off the grid."""
    single: Singles
    """Position between cells and coordinate in the waveform basis of each sorted echo [1], (2, BLOCK)."""
    weight: Singles
    """Weight of each sorted echo [uPa], real and imaginary parts alternating."""
    row_part: Singles
    """Weights of echoes in one row [uPa], real and imaginary parts alternating."""
    row_fraction: Singles
    """Position of each echo between rows, unsorted [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def row_sort_buffer(rows: int) -> RowSortBuffer:
    """Work arrays for echoes on a grid of `rows` rows."""
    return RowSortBuffer(
        np.empty(BLOCK, np.int32), np.empty(rows + 2, np.int64), np.empty(BLOCK, np.int32),
        np.empty((WIDTH, BLOCK), np.float32), np.empty(BLOCK, np.int32), np.zeros((2, BLOCK), np.float32),
        np.empty(2 * BLOCK, np.float32), np.empty(2 * BLOCK, np.float32), np.empty(BLOCK, np.float32),
    )  # fmt: skip


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _sort_by_row(
    right_cosine: Floats, scatterer: NDArray[np.int32], count: int, rows: DirectionRows, row_count: int,
    sort_buffer: RowSortBuffer,
) -> None:  # fmt: skip
    """Fill first rows of some echoes, their weights in these and the following rows, and their order by row.

    Args:
        right_cosine: Direction cosine to the array's right of the scatterers of a part, (part,).
        scatterer: Indices of the scatterers with an echo in the part, (count or more,).
        count: Number of echoes.
        rows: Rows of the grid.
        row_count: Number of rows.
        sort_buffer: Result: work arrays.
    """
    last = row_count - CELLS_PER_SPIKE
    inverse_step, shift = 1 / rows.step, 0.5 * WIDTH - 1
    for k in range(count):
        position = (right_cosine[np.uintp(scatterer[k])] - rows.first) * inverse_step - shift
        position = min(max(position, 0.0), float(last))
        cell = np.floor(position)
        sort_buffer.row[k], sort_buffer.row_fraction[k] = np.int32(cell), np.float32(position - cell - 0.5)
    for r in range(sort_buffer.starts.size):
        sort_buffer.starts[r] = 0
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


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def deposit_pair_by_direction(
    cells: NDArray[np.complex64], leg_rows: tuple[int, int, int], count: int, buffer: ArrivalBuffer, legs: BlockLegs,
    receive_beams: ReceiveBeams, reception: Reception, directions: DirectionColumns,
) -> None:  # fmt: skip
    """Deposit the echoes of some scatterers by one pair of legs on the rows about their directions.

    Args:
        cells: Grids of pressure, shape (rows, groups, cells, waveforms of a group): see `group_layout`.
        leg_rows: Rows of the transmit leg, the receive leg and the gain, of which the first pattern is used: that
            common to all beams.
        count: Number of scatterers with an echo.
        buffer: Their indices and strengths, and work arrays.
        legs: Legs of both ends.
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
    _deposit_rows(cells, sort_buffer, buffer, reception.basis)


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _deposit_rows(
    cells: NDArray[np.complex64], sort_buffer: RowSortBuffer, buffer: ArrivalBuffer, basis: BasisWeights
) -> None:
    """Deposit sorted echoes on the rows of their kernels, row by row."""
    starts = sort_buffer.starts
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


@njit(cache=True, nogil=True, error_model="numpy")
def _gather_filled_rows(rows_in: Reals, begin: int, end: int, tiles: Singles, filled: NDArray[np.int64]) -> int:
    """Copy some columns of the rows that are not zero there, row after row; return the number of these rows.

    Args:
        rows_in: Rows of the grid, (rows, n).
        begin: First column.
        end: One past the last column.
        tiles: Result: copies, (tiles, rows, columns of a tile).
        filled: Result: index of each copied row, (rows,).
    """
    count = 0
    for r in range(rows_in.shape[0]):
        row, is_filled = rows_in[r, begin:end], False
        for column in range(row.size):
            is_filled |= row[column] != 0  # without a jump: several at once
        if is_filled:
            for column in range(row.size):
                tiles[column // TILE[1], count, column % TILE[1]] = row[column]
            filled[count] = r
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def combine_rows(rows_in: Reals, weights: Singles, beams: Singles) -> None:
    """Weighted sums of rows: a matrix product without the parts of rows that are zero.

    Rows outside the received sector, and times before the first echo and after the last, are empty.

    Args:
        rows_in: Rows of the grid, (rows, n).
        weights: Weight of each row in each beam, (beams, rows).
        beams: Result, (beams, n).
    """
    row_count, count = rows_in.shape[0], len(beams)
    filled, tiles = np.empty(row_count, np.int64), np.zeros((_CELLS // TILE[1], row_count, TILE[1]), np.float32)
    products = np.empty(TILE, np.float32)
    padded = np.zeros((-(-count // TILE[0]) * TILE[0], row_count), np.float32)
    padded[:count] = weights
    for begin in range(0, rows_in.shape[1], _CELLS):
        end = min(begin + _CELLS, rows_in.shape[1])
        filled_count = _gather_filled_rows(rows_in, begin, end, tiles, filled)
        for tile in range(-(-(end - begin) // TILE[1])):
            start = begin + tile * TILE[1]
            stop = min(start + TILE[1], end)
            for first in range(0, count, TILE[0]):
                multiply_tile(products, padded, tiles[tile], filled, (filled_count, row_count), first)
                beams[first : first + TILE[0], start:stop] = products[: count - first, : stop - start]
