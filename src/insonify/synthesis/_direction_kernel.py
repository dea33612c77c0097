"""Echoes laid on a grid of time and direction, from which all beams of an array follow.

Along the direction cosine to an array's right a spike is spread over a few rows, by the kernel that spreads it over a
few cells in time. So an echo costs the same for any number of beams. Plain numbers and arrays.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar._beam_kernels import look_up
from insonify.synthesis._echo_kernel import BLOCK, Ears, Heard, Room, Sent, _turn, _weigh
from insonify.synthesis._element_kernel import arrive_bent, arrive_moving, arrive_still
from insonify.synthesis._shape_kernel import lay_down_all, place_among, share_out
from insonify.synthesis._spread import _locate
from insonify.synthesis._taps import CELLS_PER_SPIKE, DEGREE, WIDTH, tap_coefficients

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
_TAPS = tap_coefficients()
_FAST = {"contract", "reassoc", "nsz", "arcp"}
_CELLS = 256
"""Numbers of a row that are worked on together: what all rows hold there stays in the cache."""


class Rows(NamedTuple):
    """Rows of the grid: even direction cosines to an array's right."""

    first: float
    """Of the first row [1]."""
    step: float
    """From row to row [1]; 0: no grid, channels are beams."""
    sent: Floats
    """Pattern of transmit beams that are steered as the receive beams are, cubics of shape (rows, 4); empty: not."""
    sent_per_unit: float
    """Its rows per unit of direction cosine [1]."""


class Sorted(NamedTuple):
    """Room for the echoes of one pair of legs in the order of their rows, up to `BLOCK`."""

    row: NDArray[np.int32]
    """First row of each echo, before they are put in order."""
    starts: NDArray[np.int64]
    """Echoes before each row, (rows + 1,)."""
    order: NDArray[np.int32]
    tap: Singles
    """Weight of each echo in its rows, (WIDTH, BLOCK)."""
    at: NDArray[np.int32]
    single: Singles
    """Place between cells and place among shapes, (2, BLOCK)."""
    weight: Singles
    """Real and imaginary in turn."""
    part: Singles
    """The same, of one row."""
    gone: Singles
    """Place between rows, before they are put in order."""


@njit(cache=True, nogil=True, error_model="numpy")
def sorted_room(rows: int) -> Sorted:
    """Room for echoes on a grid of so many rows."""
    return Sorted(
        np.empty(BLOCK, np.int32), np.empty(rows + 2, np.int64), np.empty(BLOCK, np.int32),
        np.empty((WIDTH, BLOCK), np.float32), np.empty(BLOCK, np.int32), np.zeros((2, BLOCK), np.float32),
        np.empty(2 * BLOCK, np.float32), np.empty(2 * BLOCK, np.float32), np.empty(BLOCK, np.float32),
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _by_row(across: Floats, which: NDArray[np.int32], count: int, rows: Rows, number: int, there: Sorted) -> None:
    """First rows of some echoes, what they count for in these and the next, and their order by row.

    Args:
        across: Direction cosine to the array's right of the scatterers of a part, (part,).
        which: Numbers of those that have an echo, (count or more,).
        count: How many.
        rows: The grid.
        number: How many rows it has.
        there: Result.
    """
    last = number - CELLS_PER_SPIKE
    once, shift = 1 / rows.step, 0.5 * WIDTH - 1
    for k in range(count):
        position = (across[np.uintp(which[k])] - rows.first) * once - shift
        position = min(max(position, 0.0), float(last))
        cell = np.floor(position)
        there.row[k], there.gone[k] = np.int32(cell), np.float32(position - cell - 0.5)
    there.starts[:] = 0
    for k in range(count):
        there.starts[there.row[k] + 1] += 1
    for r in range(1, there.starts.size):
        there.starts[r] += there.starts[r - 1]
    for k in range(count):
        row = there.row[k]
        there.order[there.starts[row]] = k
        there.starts[row] += 1
    for r in range(there.starts.size - 1, 0, -1):  # each start has moved to that of the next row
        there.starts[r] = there.starts[r - 1]
    there.starts[0] = 0
    for t in range(WIDTH):
        for m in range(count):
            y = there.gone[there.order[m]]
            value = _TAPS[DEGREE, t]
            for d in range(DEGREE - 1, -1, -1):
                value = value * y + _TAPS[d, t]
            there.tap[t, m] = value


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def lay_pair_by_direction(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, i: int, j: int, gain_row: int, count: int,
    room: Room, sent: Sent, heard: Heard, ears: Ears, leaving: Floats, across: Floats, rows: Rows, there: Sorted,
    slowness: float, gradient: float, loss: float, bent: bool, middle: float, frequency: float, node: Floats,
) -> None:  # fmt: skip
    """Echoes of some scatterers by one pair of legs, added to the cells of the rows about their directions.

    Args:
        cells: Grids of pressure, shape (rows, groups, cells, shapes of a group): see `laid_out`.
        first_time: As of `_echo_kernel.lay_pair`.
        cell_rate: As of `_echo_kernel.lay_pair`.
        i: Row of the leg out.
        j: Row of the leg back.
        gain_row: Row of the gain.
        count: How many scatterers have an echo.
        room: Which these are, and what they make of the pair.
        sent: The legs out.
        heard: The legs back; the gain is that which all beams have in common.
        ears: The one place that hears.
        leaving: Direction cosines to the array's right in which sound leaves, (part,); wanted if transmit beams are
            steered.
        across: Direction cosines to the array's right from which echoes come, (part,).
        rows: The grid of directions.
        there: Room for the echoes in order.
        slowness: As of `_echo_kernel.lay_pair`.
        gradient: As of `_echo_kernel.lay_pair`.
        loss: As of `_echo_kernel.lay_pair`.
        bent: As of `_echo_kernel.lay_pair`.
        middle: As of `_echo_kernel.lay_pair`.
        frequency: As of `_echo_kernel.lay_pair`.
        node: As of `_echo_kernel.lay_pair`.
    """
    last, which, shaped = cells.shape[2] - CELLS_PER_SPIKE, room.which, room.shaped
    tau, curve, away, behind, u, v, w, r, when, doppler = room.column
    inside, tuned, fade, x = room.single
    late, later, bend, following, towards = (
        sent.delay[i], heard.delay[j], heard.bend[j], sent.following[i], heard.towards[j]
    )  # fmt: skip
    gain = heard.gain[gain_row, 0]
    for k in range(count):
        n = np.uintp(which[k])
        tau[k], curve[k], behind[k], tuned[k] = late[n] + later[n], bend[n], following[n], gain[n]
        u[k], v[k], w[k], r[k] = towards[n, 0], towards[n, 1], towards[n, 2], 1 / bend[n]
    place, velocity, acceleration = ears.place[0], ears.velocity[0], ears.acceleration[0]
    if bent:
        for k in range(count):
            away[k] = heard.away[j, np.uintp(which[k])]
        for t in range(room.beside.shape[0]):
            for k in range(count):
                room.beside[t, k] = heard.beside[j, t, np.uintp(which[k])]
        arrive_bent(tau[:count], curve, away, u, v, w, behind, room.beside, place, velocity, acceleration, slowness,
                    gradient, loss, middle, when, fade, doppler)  # fmt: skip
    elif middle == 0.0:
        arrive_still(tau[:count], r, u, v, w, place, slowness, loss, when, fade)
    else:
        arrive_moving(tau[:count], r, u, v, w, behind, place, velocity, acceleration, slowness, loss, middle, when,
                      fade, doppler)  # fmt: skip
    _locate(when[:count], first_time, cell_rate, last, room.at, inside)
    if node.size > 1:
        place_among(doppler[:count], shaped, x)
    if rows.sent.shape[0]:
        # a wide pattern out, read at the direction of the way back: exact on the axis of each beam, and for equal legs
        for k in range(count):
            n = np.uintp(which[k])
            tuned[k] *= np.float32(look_up(rows.sent, rows.sent_per_unit, leaving[n] - across[n]))
    _weigh(sent.weight[0, i], heard.weight[j], room.answer, which, count, room.source)
    _turn(when[:count], fade, room.source, tuned, frequency, room.turned)
    _by_row(across, which, count, rows, cells.shape[0], there)
    for m in range(count):
        k = int(there.order[m])
        there.at[m], there.single[0, m], there.single[1, m] = room.at[k], inside[k], x[k]
        there.weight[2 * m], there.weight[2 * m + 1] = room.turned[2 * k], room.turned[2 * k + 1]
    _lay_down_rows(cells, there, room)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _lay_down_rows(cells: NDArray[np.complex64], there: Sorted, room: Room) -> None:
    """Lay echoes in order down on the rows that each counts for, row by row."""
    starts, shaped = there.starts, room.shaped
    for row in range(cells.shape[0]):
        begin, end = starts[max(row - WIDTH + 1, 0)], starts[row + 1]
        if begin == end:
            continue
        for first in range(max(row - WIDTH + 1, 0), row + 1):  # echoes whose first row this is
            tap = there.tap[row - first]
            for m in range(starts[first], starts[first + 1]):
                there.part[2 * (m - begin)] = there.weight[2 * m] * tap[m]
                there.part[2 * (m - begin) + 1] = there.weight[2 * m + 1] * tap[m]
        x = there.single[1, begin:end]
        if cells.shape[1] > 1:
            share_out(x, shaped.node, shaped.scale, room.share)
        lay_down_all(cells, row, 1, 1, there.at[begin:end], there.single[0, begin:end], there.part, x, shaped,
                     room.share, end - begin)  # fmt: skip


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def mix_rows(held: Singles, mix: Singles, made: Singles) -> None:
    """Sums of rows, each row weighted: a product of matrices.

    Args:
        held: Rows of the grid, (rows, n); rows are a multiple of 4.
        mix: What each row counts for in each beam, (beams, rows).
        made: Result, (beams, n).
    """
    for begin in range(0, held.shape[1], _CELLS):
        end = min(begin + _CELLS, held.shape[1])
        for beam in range(mix.shape[0]):
            told = made[beam, begin:end]
            told[:] = 0
            for r in range(0, mix.shape[1], 4):
                a, b, c, d = mix[beam, r], mix[beam, r + 1], mix[beam, r + 2], mix[beam, r + 3]
                of_a, of_b = held[r, begin:end], held[r + 1, begin:end]
                of_c, of_d = held[r + 2, begin:end], held[r + 3, begin:end]
                for k in range(end - begin):
                    told[k] += a * of_a[k] + b * of_b[k] + c * of_c[k] + d * of_d[k]
