"""Kernel that deposits the energies of path pairs on rows of directions, once for all beams."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.synthesis._gridding import _SHIFT, add_to_adjacent_rows
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
SAME_DELAY = 1e-10
"""Delays closer than this share one pulse: phases are in the weights, and no envelope changes so fast [s]."""

COMPACT, APART = 2.0, 24.0
"""Distance in rows up to which replicas count as from one direction, an eighth of the main lobe between its nulls; and
from which on their interference is left out: the mean product of a beam's gains is at most 0.11, of either sign."""


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
    """Pressure scattered to 1 m re incident [m], (p, n)."""
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
    """Phase x of which sin(x) / x is the mean product of gains one row apart: pi times the aperture [wavelengths] times
    the spacing of rows [rad]."""


@njit(cache=True, nogil=True, error_model="numpy")
def mean_gain_product(row_phase: float, rows: float) -> float:
    """Mean product over the beams of the gains towards two directions so many rows apart, re one direction [1]."""
    phase = row_phase * rows
    return math.sin(phase) / phase if abs(phase) > 1e-6 else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _add_arrival(
    cells: NDArray[np.float32], grid: RowGrid, row: Floats, weight: Complexes, delay: float, shares: tuple[float, float]
) -> None:  # fmt: skip
    """Add replicas that arrive together: the energy of each, and the interference of each two half way between rows.

    Args:
        cells: Energy grids of the rows, added to in place, (rows, cells).
        grid: Times and directions of the cells.
        row: Row of each replica, (m,).
        weight: Weight of each replica [uPa], (m,).
        delay: Their delay [s].
        shares: Factor of the interference, and of the energies [1].
    """
    position = (delay - grid.first_time) * grid.rate - _SHIFT
    if not (position >= 0.0 and position < cells.shape[1] - CELLS_PER_SPIKE):
        return
    cell = np.intp(math.floor(position))
    fraction = np.float64(np.float32(position - cell - 0.5))
    for k in range(row.size):
        w = weight[k]
        add_to_adjacent_rows(cells, row[k], cell, fraction, shares[1] * (w.real * w.real + w.imag * w.imag))
        for other in range(k):
            excess = 2.0 * shares[0] * (w * np.conj(weight[other])).real
            if excess != 0.0 and abs(row[k] - row[other]) < APART:
                excess *= mean_gain_product(grid.row_phase, row[k] - row[other])
                add_to_adjacent_rows(cells, 0.5 * (row[k] + row[other]), cell, fraction, excess)


@njit(cache=True, nogil=True, error_model="numpy")
def _number_directions(row: Floats, direction: NDArray[np.intp]) -> bool:
    """Number the directions of some replicas from 0 on, in `direction`.

    Returns:
        False where the rows of two replicas differ by more than `COMPACT` and less than `APART`.
    """
    count = 0
    for k in range(row.size):
        direction[k] = count
        for other in range(k):
            distance = abs(row[k] - row[other])
            if distance <= COMPACT:
                direction[k] = direction[other]
            elif distance < APART:
                return False
        count = max(count, direction[k] + 1)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _divide_directions(row: Floats, direction: NDArray[np.intp]) -> None:
    """Number directions of some replicas from 0 on: each lies within `COMPACT` of the first of its direction."""
    count, first_row = 0, np.empty(row.size)
    for k in range(row.size):
        number = 0
        while number < count and abs(row[k] - first_row[number]) > COMPACT:
            number += 1
        if number == count:
            first_row[count] = row[k]
            count += 1
        direction[k] = number


@njit(cache=True, nogil=True, error_model="numpy")
def _end_of_overlap(delay: Floats, begin: int, support: float) -> int:
    """Number of the first replica, of those sorted by delay, that does not overlap with the one before it."""
    end = begin + 1
    while end < delay.size and delay[end] - delay[end - 1] <= support:
        end += 1
    return end


class RowGroups(NamedTuple):
    """Replicas of single points that overlap without arriving together, in groups from one direction."""

    first: NDArray[np.int64]
    """First replica of each group, and the end, (groups + 1,)."""
    delay: Floats
    """Delay of each replica [s], (m,)."""
    weight: Complexes
    """Weight of each replica, without the horizontal pattern of the beams [uPa], (m,)."""
    row: Floats
    """Mean row of each group, weighted by energy, (groups,)."""


class GroupList(NamedTuple):
    """Groups of replicas in arrays that are longer than needed."""

    first: NDArray[np.int64]
    """First replica of each group, and the end."""
    delay: Floats
    """Delay of each replica [s]."""
    weight: Complexes
    """Weight of each replica."""
    row: Floats
    """Row of each group."""
    counts: NDArray[np.int64]
    """Number of groups, and of replicas, (2,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def _empty_list(groups: int, replicas: int) -> GroupList:
    """An empty list with capacity for numbers of groups and replicas."""
    return GroupList(np.zeros(groups + 1, np.int64), np.empty(replicas), np.empty(replicas, np.complex128),
                     np.empty(groups), np.zeros(2, np.int64))  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _with_capacity(some: GroupList, groups: int, replicas: int) -> GroupList:
    """The list, or a copy twice as long as needed, with capacity for further numbers of groups and replicas."""
    group_count, count = some.counts
    if group_count + groups <= some.row.size and count + replicas <= some.delay.size:
        return some
    longer = _empty_list(2 * (group_count + groups), 2 * (count + replicas))
    longer.first[: group_count + 1], longer.row[:group_count] = some.first[: group_count + 1], some.row[:group_count]
    longer.delay[:count], longer.weight[:count] = some.delay[:count], some.weight[:count]
    longer.counts[:] = some.counts
    return longer


@njit(cache=True, nogil=True, error_model="numpy")
def _append(some: GroupList, delay: float, weight: complex) -> None:
    """Append a replica to the last group."""
    some.delay[some.counts[1]], some.weight[some.counts[1]] = delay, weight
    some.counts[1] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def _end_group(some: GroupList, row: float) -> None:
    """End the last group, whose mean row is given."""
    some.row[some.counts[0]] = row
    some.counts[0] += 1
    some.first[some.counts[0]] = some.counts[1]


@njit(cache=True, nogil=True, error_model="numpy")
def _groups(some: GroupList) -> RowGroups:
    """The filled part of a list."""
    group_count, count = some.counts
    return RowGroups(
        some.first[: group_count + 1], some.delay[:count], some.weight[:count], some.row[:group_count]
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def _append_interference(
    added: GroupList, subtracted: GroupList, delay: Floats, weight: Complexes, direction: NDArray[np.intp], row: Floats,
    row_phase: float,
) -> None:  # fmt: skip
    """Append the interference of replicas from each two directions, half way between their rows.

    It is 2 Re(A B*) = |A + B|^2 - |A|^2 - |B|^2.

    Args:
        added: Groups whose intensity is added.
        subtracted: Groups whose intensity is subtracted.
        delay: Delay of each replica [s], (m,).
        weight: Weight of each replica [uPa], (m,).
        direction: Number of the direction of each replica, (m,).
        row: Mean row of each direction, (directions,).
        row_phase: See `RowGrid.row_phase` [rad].
    """
    for one in range(row.size):
        for other in range(one):
            if abs(row[one] - row[other]) >= APART:
                continue
            product, between = mean_gain_product(row_phase, row[one] - row[other]), 0.5 * (row[one] + row[other])
            together, separate = (added, subtracted) if product > 0 else (subtracted, added)
            for number in (one, other):
                for k in range(delay.size):
                    if direction[k] == number:
                        _append(separate, delay[k], math.sqrt(abs(product)) * weight[k])
                _end_group(separate, between)
            for k in range(delay.size):
                if direction[k] == one or direction[k] == other:
                    _append(together, delay[k], math.sqrt(abs(product)) * weight[k])
            _end_group(together, between)


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_pairs_on_rows(
    cells: NDArray[np.float32], grid: RowGrid, legs: RowLegs, pairs: PairEnergies, is_dense: bool
) -> tuple[RowGroups, RowGroups, RowGroups, NDArray[np.intp]]:
    """Deposit energies of all pairs of some points, and the interference of pairs that arrive together, on rows.

    A pair and its reverse arrive together from two directions, each with its own energy. Their interference is
    deposited half way between the directions with the mean product of a beam's two gains: exact in the sum over beams.
    From directions at least `APART`, interference is left out: it has either sign, and at most 0.11 of the
    energies. A frame of 256 beams with one bounce is 0.03 dB rms from that of beams one by one.

    Replicas that overlap without arriving together come from one direction (within `COMPACT`), from directions apart,
    or from others between. The interference between those is deposited half way, too, if the points are dense: it then
    averages over points of a beam. Of few points it is left to the beams.

    Args:
        cells: Energy grids of the rows, added to in place, (rows, cells).
        grid: Times and directions of the cells.
        legs: Legs to the points.
        pairs: Pairs of legs.
        is_dense: True: a beam has many of the points.

    Returns:
        Replicas that overlap and do not arrive together, in groups by direction.
        Groups whose intensities are added for the interference between directions.
        Groups whose intensities are subtracted for the interference between directions.
        Indices of the points left out.
    """
    count, point_count = pairs.pair.shape[0], legs.transmit_delay.shape[1]
    shares = pairs.interference_factor, pairs.mean_energy
    delay, row, weight = np.empty(count), np.empty(count), np.empty(count, np.complex128)
    by_direction, added, subtracted = _empty_list(point_count, 4 * point_count), _empty_list(1, 1), _empty_list(1, 1)
    direction, group_row = np.empty(count, np.intp), np.empty(count)  # direction -1: replicas that arrive together
    left_out, left_out_count = np.empty(point_count, np.intp), 0
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
        begin, has_directions = 0, True
        while begin < m:
            end = _end_of_overlap(delay[:m], begin, pairs.support)
            if delay[end - 1] - delay[begin] <= SAME_DELAY:
                direction[begin:end] = -1
            elif not _number_directions(row[begin:end], direction[begin:end]):
                has_directions = is_dense
                _divide_directions(row[begin:end], direction[begin:end])
            begin = end
            if not has_directions:
                break
        if not has_directions:
            left_out[left_out_count] = n
            left_out_count += 1
            continue
        begin = 0
        while begin < m:
            end = _end_of_overlap(delay[:m], begin, pairs.support)
            if direction[begin] < 0:
                _add_arrival(cells, grid, row[begin:end], weight[begin:end], delay[begin], shares)
                begin = end
                continue
            number_count = direction[begin:end].max() + 1
            by_direction = _with_capacity(by_direction, number_count, end - begin)
            for number in range(number_count):
                energy_sum, row_sum = 0.0, 0.0
                for k in range(begin, end):
                    if direction[k] == number:
                        energy = weight[k].real ** 2 + weight[k].imag ** 2
                        energy_sum, row_sum = energy_sum + energy, row_sum + energy * row[k]
                        _append(by_direction, delay[k], weight[k])
                group_row[number] = row_sum / energy_sum
                _end_group(by_direction, group_row[number])
            if number_count > 1:
                most = number_count * (number_count - 1), number_count * (end - begin)
                added, subtracted = _with_capacity(added, *most), _with_capacity(subtracted, *most)
                _append_interference(
                    added, subtracted, delay[begin:end], weight[begin:end], direction[begin:end],
                    group_row[:number_count], grid.row_phase,
                )  # fmt: skip
            begin = end
    return _groups(by_direction), _groups(added), _groups(subtracted), left_out[:left_out_count]
