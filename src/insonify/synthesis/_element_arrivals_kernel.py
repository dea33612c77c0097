"""Echoes of a block of scatterers at each element of an array: worked out at a few places along it, laid down at all.

Along a straight array the delay of an echo is as smooth as the array is short against its distance: a few Chebyshev
nodes tell it at every element (`apertures`). Echoes are taken in the order in which they come, whatever legs they came
by, some hundreds at a time, at a few elements side by side: so what the processor holds of the grids is what it needs,
no two spikes in a row touch the same cells, and tens of spikes share a cell of a window (`_moment_kernel`). Plain
numbers and arrays.
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
    TransmitLegs,
    nonzero_legs,
    scatterers_with_echo,
)
from insonify.synthesis._arrival_time_kernel import arrival_moving, arrival_refracted, arrival_stationary
from insonify.synthesis._gridding import _locate
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE
from insonify.synthesis._polynomial_moments import MARGIN, WINDOW, deposit_moments, empty_window, gather_moments
from insonify.synthesis._simd_gridding import mix_nodes
from insonify.synthesis._waveform_basis_kernel import basis_weight_table, basis_weights, deposit_waveforms

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
_PART = 32768
_TILE = 256
"""Echoes that are worked out together."""
_ROW = _TILE + 16
_SIDE = 8
"""Elements at which they are laid down together."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class ApertureNodes(NamedTuple):
    """Places along an array at which echoes are worked out, k of them."""

    position: Floats
    """From the array's centre, in the world, at the start of the ping [m], (k, 3)."""
    velocity: Floats
    """At the start of the ping [m/s], (k, 3)."""
    acceleration: Floats
    """[m/s^2], (k, 3)."""
    weights: Floats
    """What each counts for at each element, then at each place of the sector [1], (k, elements + p)."""


class ArraySector(NamedTuple):
    """Directions so narrow that a few places along an array, p of them, tell what all its elements hear from there."""

    point_count: int
    """How many places there are, p; 0: no echo is laid down at places."""
    max_delay_slope: float
    """By how much the delay of an echo may grow along half the array [s]."""
    curvature_phase: float
    """Curvature of wavefronts along it: the phase at the array's ends is this over the delay [rad s]."""
    max_residual_phase: float
    """By how much the phase at its ends may differ from that [rad]."""


class _EchoOrder(NamedTuple):
    """Room for the echoes of a part of the scatterers, in the order in which they come."""

    echo: NDArray[np.int32]
    """Pair of legs times `_PART`, and the scatterer's place in the part, (pairs times `_PART`,)."""
    unsorted_echo: NDArray[np.int32]
    """The same, pair by pair, and one more."""
    cell: NDArray[np.int32]
    """Cell in which each would come to the array's centre."""
    starts: NDArray[np.int32]
    """How many come before each cell."""


@njit(cache=True, nogil=True, error_model="numpy")
def _in_order(
    part_start: int, first_time: float, cell_rate: float, last: int, pair: Integers, transmit_legs: TransmitLegs,
    receive_legs: ReceiveLegs,
    strength: NDArray[Any], flags: tuple[Flags, Flags, Flags], order: _EchoOrder,
) -> int:  # fmt: skip
    """How many echoes a part of the scatterers has; they are put into order, by counting how many come to each cell."""
    total, low, high = 0, last, 0
    end = min(part_start + _PART, strength.shape[1])
    outs, backs, hears = flags
    for p in range(pair.shape[0]):
        i, j, row = pair[p]
        found, key = order.unsorted_echo[total:], order.cell[total:]
        count = scatterers_with_echo(
            0,
            strength[p, part_start:end],
            outs[i, part_start:end],
            backs[j, part_start:end],
            hears[row, part_start:end],
            found,
        )
        out, back = transmit_legs.delay[i, part_start:end], receive_legs.delay[j, part_start:end]
        for k in range(count):
            n = np.uintp(found[k])
            position = (out[n] + back[n] - first_time) * cell_rate
            key[k] = int(min(position, float(last))) if position > 0 else 0
            found[k] += p * _PART
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
        place = np.uintp(order.cell[k])
        order.echo[np.uintp(order.starts[place])] = order.unsorted_echo[k]
        order.starts[place] += 1
    return total


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _fill_weights(arrival_time: Floats, real: Singles, imaginary: Singles, frequency: float, weight: Singles) -> None:
    """Weights with the phase of the carrier, real and imaginary in turn."""
    for k in range(arrival_time.size):
        sine, cosine = sincos_cycles(frequency * arrival_time[k])
        weight[2 * k] = real[k] * cosine + imaginary[k] * sine
        weight[2 * k + 1] = imaginary[k] * cosine - real[k] * sine


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _partition_by_sector(
    arrival_time: Floats, count: int, centre_delay: Floats, frequency: float, sector: ArraySector,
    fractions: NDArray[np.int32]
) -> int:  # fmt: skip
    """How many echoes come from the sector; these are put first, the others after them.

    The first two terms of the delay along the array, in Chebyshev's polynomials, follow from its values at their nodes.

    Args:
        arrival_time: When echoes come to each node [s], (k, count or more).
        count: How many echoes.
        centre_delay: Their delays at the array's centre [s], (count or more,).
        frequency: Of the carrier [Hz].
        sector: Which sector.
        fractions: Result, the place of each, (count or more,).
    """
    nodes, inside = arrival_time.shape[0], 0
    slope, bend = np.zeros(_TILE), np.zeros(_TILE)
    for k in range(nodes):
        x = math.cos((k + 0.5) * math.pi / nodes)
        one, two = 2 / nodes * x, 2 / nodes * (2 * x * x - 1) * 4 * math.pi * frequency
        for m in range(count):
            slope[m] += one * arrival_time[k, m]
            bend[m] += two * arrival_time[k, m]
    for m in range(count):
        within = (
            abs(slope[m]) <= sector.max_delay_slope
            and abs(bend[m] - sector.curvature_phase / centre_delay[m]) <= sector.max_residual_phase
        )
        fractions[m] = inside if within else -1
        inside += within
    after = inside
    for m in range(count):
        if fractions[m] < 0:
            fractions[m] = after
            after += 1
    return inside


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _gather_echoes(
    echo: NDArray[np.int32], part_start: int, pair: Integers, transmit_legs: TransmitLegs, receive_legs: ReceiveLegs,
    strength: NDArray[Any],
    single_pattern: bool, columns: Floats, source_weight: Singles,
) -> None:  # fmt: skip
    """What is known of some echoes at the array's centre.

    Args:
        echo: Of `_EchoOrder`.
        part_start: First scatterer of the part.
        pair: Row of the leg out, of the leg back and of the gain of each pair, (p, 3).
        transmit_legs: The legs out.
        receive_legs: The legs back.
        strength: What each scatterer makes of each pair, real or complex, (p, n).
        single_pattern: Whether all elements have the first pattern.
        columns: Result: delay, curvature, its inverse, distance, direction, following; (8, count or more).
        source_weight: Result: weights, real and imaginary in turn, (2 count or more,).
    """
    for k in range(echo.size):
        p, n = np.uintp(echo[k] // _PART), np.uintp(part_start + echo[k] % _PART)
        i, j = np.uintp(pair[p, 0]), np.uintp(pair[p, 1])
        columns[0, k], columns[1, k] = (
            transmit_legs.delay[i, n] + receive_legs.delay[j, n],
            receive_legs.vertical_curvature[j, n],
        )
        columns[3, k], columns[7, k] = receive_legs.horizontal_distance[j, n], transmit_legs.transmit_doppler[i, n]
        for axis in range(3):
            columns[4 + axis, k] = receive_legs.direction[j, n, axis]
        whole = transmit_legs.weight[0, i, n] * receive_legs.weight[j, n] * np.complex64(strength[p, n])
        if single_pattern:
            whole *= receive_legs.gain[np.uintp(pair[p, 2]), 0, n]
        source_weight[2 * k], source_weight[2 * k + 1] = whole.real, whole.imag
    for k in range(echo.size):
        columns[2, k] = 1 / columns[1, k]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_on_elements(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, pair: Integers, transmit_legs: TransmitLegs,
    receive_legs: ReceiveLegs,
    strength: NDArray[Any], receive_beams: ReceiveBeams, nodes: ApertureNodes, sector: ArraySector, slowness: float,
    sound_speed_gradient: float, attenuation: float,
    is_refracted: bool, pulse_middle: float, frequency: float, doppler_node_count: Floats,
) -> None:  # fmt: skip
    """Echoes of one block by all pairs of legs, for all elements of an array, added to their cells.

    Args:
        cells: As of `_echo_kernel.deposit_pair`; element e is channel e, the places of a sector come after all
            elements.
        first_time: Likewise.
        cell_rate: Likewise.
        pair: Row of the leg out, of the leg back and of the gain of each pair, (p, 3).
        transmit_legs: The legs out; one beam.
        receive_legs: The legs back.
        strength: What each scatterer makes of each pair, real or complex, (p, n).
        receive_beams: The elements, each with its own channel.
        nodes: Where echoes are worked out.
        sector: Echoes from there are laid down at places, which are channels after the elements.
        slowness: As of `_echo_kernel.deposit_pair`.
        sound_speed_gradient: Likewise.
        attenuation: Likewise.
        is_refracted: Likewise.
        pulse_middle: Likewise.
        frequency: Likewise.
        doppler_node_count: Likewise.
    """
    last, elements = cells.shape[2] - CELLS_PER_SPIKE, receive_beams.position.shape[0]
    count_of_nodes = nodes.weights.shape[0]
    room, terms, still = (
        pair.shape[0] * min(_PART, strength.shape[1]),
        receive_legs.expansion.shape[1],
        pulse_middle == 0.0,
    )
    order = _EchoOrder(np.empty(room, np.int32), np.empty(room + 1, np.int32), np.empty(room, np.int32),
                   np.empty(cells.shape[2] + 2, np.int32))  # fmt: skip
    flags = nonzero_legs(transmit_legs, receive_legs)
    columns = np.empty((8, _TILE))
    tau, bend, r, away = columns[0], columns[1], columns[2], columns[3]
    u, v, w, behind = columns[4], columns[5], columns[6], columns[7]
    beside, source = np.empty((terms, _TILE)), np.empty(2 * _TILE, np.float32)
    came, doppler = np.empty((count_of_nodes, _TILE)), np.zeros((count_of_nodes, _TILE))
    fade, where = np.empty((count_of_nodes, _TILE), np.float32), np.arange(_TILE).astype(np.int32)
    when_at, others = np.zeros((count_of_nodes, _ROW)), np.zeros((3, count_of_nodes, _ROW), np.float32)
    real_at, imaginary_at, x_at, size = others[0], others[1], others[2], _SIDE * _ROW
    when, mixed = np.empty(size), np.zeros((3, size), np.float32)
    real, imaginary, x = mixed[0], mixed[1], mixed[2]
    at, place, weight = np.empty(size, np.int32), np.empty(size, np.float32), np.empty(2 * size, np.float32)
    mix, shaped = np.ascontiguousarray(nodes.weights.T), basis_weight_table(doppler_node_count)
    single = mix.astype(np.float32)
    share = np.zeros((4 * cells.shape[1], size if cells.shape[1] > 1 else 1), np.float32)
    once = 1 / shaped.half_range if doppler_node_count.size > 1 else 0.0
    doppler[:] = shaped.centre_doppler
    alike, moments, window = True, empty_window(cells.shape[0], cells.shape[3]), 0
    for e in range(elements):
        alike = alike and receive_beams.pattern[e] == 0
    places = sector.point_count if alike else 0
    for begin in range(0, strength.shape[1], _PART):
        total = _in_order(begin, first_time, cell_rate, last, pair, transmit_legs, receive_legs, strength, flags, order)
        for tile in range(0, total, _TILE):
            count = min(_TILE, total - tile)
            echo = order.echo[tile : tile + count]
            _gather_echoes(echo, begin, pair, transmit_legs, receive_legs, strength, alike, columns, source)
            if is_refracted:
                for k in range(count):
                    p, n = echo[k] // _PART, begin + echo[k] % _PART
                    for t in range(terms):
                        beside[t, k] = receive_legs.expansion[pair[p, 1], t, n]
            for k in range(count_of_nodes):
                here, velocity, acceleration = nodes.position[k], nodes.velocity[k], nodes.acceleration[k]
                if is_refracted:
                    arrival_refracted(tau[:count], bend, away, u, v, w, behind, beside, here, velocity, acceleration,
                                slowness, sound_speed_gradient, attenuation, pulse_middle, came[k], fade[k],
                                doppler[k])  # fmt: skip
                elif still:
                    arrival_stationary(tau[:count], r, u, v, w, here, slowness, attenuation, came[k], fade[k])
                else:
                    arrival_moving(tau[:count], r, u, v, w, behind, here, velocity, acceleration, slowness, attenuation,
                                  pulse_middle, came[k], fade[k], doppler[k])  # fmt: skip
            inside = _partition_by_sector(came, count, tau, frequency, sector, where) if places > 0 else 0
            for k in range(count_of_nodes):
                for m in range(count):
                    to = np.uintp(where[m])
                    when_at[k, to] = came[k, m]
                    real_at[k, to], imaginary_at[k, to] = fade[k, m] * source[2 * m], fade[k, m] * source[2 * m + 1]
                    x_at[k, to] = np.float32((doppler[k, m] - shaped.centre_doppler) * once)
            if cells.shape[1] == 1:
                cell = int(min(max((tau[0] - pulse_middle - first_time) * cell_rate, 0.0), float(last)))
                if cell >= window + WINDOW - 2 * MARGIN or cell < window:
                    deposit_moments(cells, moments, window, elements + places)
                    window = max(cell - MARGIN, 0)  # an echo off the grid, at -1, must not look as if it lay in it
            e, side = 0, 0
            while e + side < elements + places:
                e += side
                side = min(_SIDE, (elements if e < elements else elements + places) - e)
                first, stop = (inside, count) if e < elements else (0, inside)  # places hear what is from the sector
                if first == stop:
                    continue
                for s in range(side):
                    here = slice(s * _ROW + first, s * _ROW + stop)
                    shape = count_of_nodes, _ROW, first, stop, size
                    mix_nodes(mix, single, when_at, others, shape, np.intp(e + s), np.intp(s * _ROW), when, mixed)
                    if doppler_node_count.size > 1:
                        for k in range(s * _ROW + first, s * _ROW + stop):
                            x[k] = min(max(x[k], np.float32(-1)), np.float32(1))
                    if not alike:
                        for k in range(count):
                            p, n = echo[k] // _PART, begin + echo[k] % _PART
                            arrivals_at_channel = receive_beams.pattern[e + s]
                            gain = (
                                receive_legs.gain[pair[p, 2], arrivals_at_channel, n]
                                if arrivals_at_channel >= 0
                                else np.float32(0)
                            )
                            real[s * _ROW + k] *= gain
                            imaginary[s * _ROW + k] *= gain
                    _locate(when[here], first_time, cell_rate, last, at[here], place[here])
                    _fill_weights(when[here], real[here], imaginary[here], frequency, weight[2 * (s * _ROW + first) :])
                rest, found = slice(first, size), stop - first
                if cells.shape[1] > 1:
                    basis_weights(x[rest], shaped.node_coordinate, shaped.node_scale, share)
                    deposit_waveforms(cells, e, side, _ROW, at[rest], place[rest], weight[2 * first :], x[rest], shaped,
                                 share, found)  # fmt: skip
                else:
                    gather_moments(cells, moments, window, e, side, _ROW, at[rest], place[rest], weight[2 * first :],
                                   x[rest],
                           shaped, found)  # fmt: skip
        if cells.shape[1] == 1:
            deposit_moments(cells, moments, window, elements + places)
