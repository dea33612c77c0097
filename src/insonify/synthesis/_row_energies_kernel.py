"""Kernel that deposits the energies of path pairs on rows of directions, once for all beams."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._gridding import _SHIFT
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE
from insonify.synthesis._simd_gridding import add_real_spike

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
SAME_DELAY = 1e-10
"""Delays closer than this share one pulse: phases are in the weights, and no envelope changes so fast [s]."""

COMPACT, APART = 2.0, 24.0
"""Rows within which replicas count as from one direction, an eighth of a lobe; and from which on their interference is
left out, as the mean product of a beam's gains is below a tenth, and of either sign."""


class RowLegs(NamedTuple):
    """Legs to n points, f of transmission and g of reception, with the patterns that all beams have in common."""

    transmit_delay: Floats
    """One-way delay [s], (f, n)."""
    receive_delay: Floats
    """One-way delay [s], (g, n)."""
    transmit_weight: Complexes
    """Weight of each transmit leg, its beam included [uPa], (f, n)."""
    receive_weight: Complexes
    """Weight of each receive leg, without the horizontal pattern of its beams [1], (g, n)."""
    receive_row: Floats
    """Row of each receive leg's direction, with fraction, (g, n)."""


class PairEnergies(NamedTuple):
    """Energies of p pairs of legs at n points."""

    pair: NDArray[np.int64]
    """Rows of the transmit and the receive leg of each pair, (p, 2)."""
    strength: NDArray[np.float64] | Complexes
    """Pressure scattered re incident [m], (p, n)."""
    support: float
    """Largest time between replicas that interfere [s]."""
    interference_factor: float
    """Mean product of two replicas re that without jitter [1]."""
    mean_energy: float
    """Mean energy of each replica re that without jitter [1]."""


class RowGrid(NamedTuple):
    """Times and directions of the cells of rows."""

    first_time: float
    """Delay of the first cell [s]."""
    rate: float
    """Cells per second [Hz]."""
    row_phase: float
    """Pi wavelengths of the receive aperture per row: its sinc is the mean product of gains one row apart [rad]."""


@njit(cache=True, nogil=True, error_model="numpy")
def mean_gain_product(row_phase: float, rows: float) -> float:
    """Mean product over the beams of the gains towards two directions so many rows apart, re one direction [1]."""
    phase = row_phase * rows
    return math.sin(phase) / phase if abs(phase) > 1e-6 else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _add_energy(
    cells: NDArray[np.float32], row: float, first_cell: int, fraction: float, energy: float
) -> None:  # fmt: skip
    """Share an energy among the two rows adjacent to its direction."""
    first = min(max(int(row), 0), cells.shape[0] - 2)
    part = row - first
    add_real_spike(cells[first], first_cell, fraction, energy * (1 - part))
    add_real_spike(cells[first + 1], first_cell, fraction, energy * part)


@njit(cache=True, nogil=True, error_model="numpy")
def _add_arrival(
    cells: NDArray[np.float32], grid: RowGrid, row: Floats, weight: Complexes, delay: float, shares: tuple[float, float]
) -> None:  # fmt: skip
    """Add replicas that arrive together: the energy of each, and their interference half way between their rows.

    Args:
        cells: Energy grids of the rows, added to in place, (rows, cells).
        grid: Times and directions of the cells.
        row: Row of each replica, (m,).
        weight: Weight of each replica, (m,).
        delay: Their delay [s].
        shares: Weight of the interference, and of the energies [1].
    """
    position = (delay - grid.first_time) * grid.rate - _SHIFT
    if not (position >= 0.0 and position < cells.shape[1] - CELLS_PER_SPIKE):
        return
    cell = np.intp(math.floor(position))
    fraction = np.float64(np.float32(position - cell - 0.5))
    for k in range(row.size):
        w = weight[k]
        _add_energy(cells, row[k], cell, fraction, shares[1] * (w.real * w.real + w.imag * w.imag))
        for other in range(k):
            excess = 2.0 * shares[0] * (w * np.conj(weight[other])).real
            if excess != 0.0 and abs(row[k] - row[other]) < APART:
                excess *= mean_gain_product(grid.row_phase, row[k] - row[other])
                _add_energy(cells, 0.5 * (row[k] + row[other]), cell, fraction, excess)


@njit(cache=True, nogil=True, error_model="numpy")
def _sort_by_direction(row: Floats, number: NDArray[np.intp]) -> int:
    """Number each replica by its direction from 0 on.

    Returns:
        Number of directions; 0 where some are neither one direction nor apart.
    """
    count = 0
    for k in range(row.size):
        number[k] = count
        for other in range(k):
            distance = abs(row[k] - row[other])
            if distance <= COMPACT:
                number[k] = number[other]
            elif distance < APART:
                return 0
        if number[k] == count:
            count += 1
    return count


class RowGroups(NamedTuple):
    """Replicas of single points that overlap without arriving together, in groups from one direction."""

    first: NDArray[np.int64]
    """First replica of each group, and the end, (groups + 1,)."""
    delay: Floats
    """Delay of each replica [s], (m,)."""
    weight: Complexes
    """Weight of each replica, without the horizontal pattern of the beams, (m,)."""
    row: Floats
    """Mean row of each group, (groups,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_pairs_on_rows(
    cells: NDArray[np.float32], grid: RowGrid, legs: RowLegs, pairs: PairEnergies
) -> tuple[RowGroups, NDArray[np.intp]]:
    """Energies of all pairs of some points, and the interference of pairs that arrive together, on rows of directions.

    A pair and its reverse arrive together from two directions, each with its own energy. Their interference is
    deposited half way between the directions with the mean product of a beam's two gains: exact in the sum over beams.
    From directions at least `APART`, interference is left out: it has either sign, and less than a tenth of the
    energies. A frame of 256 beams with one bounce is 0.03 dB rms from that of beams one by one, a beam 0.1 dB at most.

    Args:
        cells: Energy grids of the rows, added to in place, (rows, cells).
        grid: Times and directions of the cells.
        legs: Legs to the points.
        pairs: Pairs of legs.

    Returns:
        Replicas that overlap and do not arrive together; and the numbers of points left out, of whose overlapping
        replicas some come neither from one direction nor from directions apart.
    """
    count, point_count, together = pairs.pair.shape[0], legs.transmit_delay.shape[1], pairs.interference_factor
    delay, row, weight = np.empty(count), np.empty(count), np.empty(count, np.complex128)
    first, group_row = np.zeros(count * point_count + 1, np.int64), np.empty(count * point_count)
    delays, weights = np.empty(count * point_count), np.empty(count * point_count, np.complex128)
    number = np.empty(count, np.intp)
    left_out, omitted, groups, filled = np.empty(point_count, np.intp), 0, 0, 0
    for n in range(point_count):
        m = 0
        for p in range(count):
            i, j = pairs.pair[p]
            value = legs.transmit_weight[i, n] * legs.receive_weight[j, n] * pairs.strength[p, n]
            if value == 0:
                continue
            tau, k = legs.transmit_delay[i, n] + legs.receive_delay[j, n], m
            while k > 0 and delay[k - 1] > tau:
                delay[k], row[k], weight[k] = delay[k - 1], row[k - 1], weight[k - 1]
                k -= 1
            delay[k], row[k], weight[k] = tau, legs.receive_row[j, n], value
            m += 1
        is_sorted, a = True, 0
        for b in range(1, m + 1):
            if b == m or delay[b] - delay[b - 1] > pairs.support:
                if delay[b - 1] - delay[a] > SAME_DELAY:
                    is_sorted &= _sort_by_direction(row[a:b], number[a:b]) > 0
                else:
                    number[a:b] = -1
                a = b
        if not is_sorted:
            left_out[omitted] = n
            omitted += 1
            continue
        a = 0
        for b in range(1, m + 1):
            if b < m and delay[b] - delay[b - 1] <= pairs.support:
                continue
            if number[a] < 0:
                _add_arrival(cells, grid, row[a:b], weight[a:b], delay[a], (together, pairs.mean_energy))
            for direction in range(number[a:b].max() + 1):
                energy_sum, row_sum = 0.0, 0.0
                for k in range(a, b):
                    if number[k] == direction:
                        energy = weight[k].real ** 2 + weight[k].imag ** 2
                        energy_sum, row_sum = energy_sum + energy, row_sum + energy * row[k]
                        delays[filled], weights[filled] = delay[k], weight[k]
                        filled += 1
                group_row[groups] = row_sum / energy_sum
                groups += 1
                first[groups] = filled
            a = b
    found = RowGroups(first[: groups + 1], delays[:filled], weights[:filled], group_row[:groups])
    return found, left_out[:omitted]
