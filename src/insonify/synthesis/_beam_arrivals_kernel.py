"""Echoes of a block of scatterers for beams: a stretch of the block at a time, from its legs to the grids.

What a few hundred scatterers need stays near the processor from the first number to the last: what legs bring and take
back, the gain of the beams along them when echoes come, the strength of pairs. Legs that are not there are passed over.
Then they meet, pair by pair. Plain numbers and arrays.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.propagation.wavefront import CLOSEST_SOURCE
from insonify.sonar.beam_kernels import BeamTables, array_cosines, beam_amplitude, element_amplitude
from insonify.synthesis._arrival_kernel import (
    ArrivalBuffer,
    Flags,
    Integers,
    ReceiveBeams,
    ReceiveLegs,
    TransmitLegs,
    arrival_buffer,
    deposit_pair,
)
from insonify.synthesis._arrival_time_kernel import direction_at_arrival, transmitter_motion_of_leg
from insonify.synthesis._direction_grid_kernel import DirectionRows, deposit_pair_by_direction, row_sort_buffer

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Complexes = NDArray[np.complex128]
_PART = 1024
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class LegColumns(NamedTuple):
    """Columns of `Legs` between one end and n scatterers, (f, n)."""

    delay: Floats
    length: Floats
    spreading: Floats
    absorption: Floats
    reflection_coefficient: Complexes
    """With what caustics and glints turn."""
    visibility: Complexes
    departure: Floats
    """(f, n, 3)."""
    grazing: Floats


class Transmitter(NamedTuple):
    """What sends."""

    level: float
    """Pressure at 1 m [uPa]."""
    velocity: Floats
    """At the start of the ping [m/s], (3,)."""
    pulse_middle: float
    """Time from the pulse's start to its middle; 0 for one at rest [s]."""
    slowness: float
    """Of sound there [s/m]."""
    beams: BeamTables


class ReceivingArray(NamedTuple):
    """What hears, but for where it is: see `ReceiveBeams`."""

    pulse_middle: float
    """As of `Transmitter`."""
    has_parallax: bool
    """Whether directions are those from where the array is when echoes come."""
    is_rotating: bool
    """Whether the array is then turned otherwise."""
    rotation_rate: Floats
    """Of `Course.sweep` [1/s], (3, 3)."""
    rotation_acceleration: Floats
    """Likewise [1/s^2], (3, 3)."""
    beams: BeamTables


class WavefrontColumns(NamedTuple):
    """Wavefronts that come back where rays bend, see `ReceiveLegs`; empty in water of one sound speed."""

    vertical_curvature: Floats
    horizontal_distance: Floats
    expansion: Floats


class ScatteringStrengths(NamedTuple):
    """What n scatterers make of p pairs: given; or products, see `records.pairs.Product`."""

    amplitude: NDArray[np.complex64]
    """(p, n); or (0, 0): products."""
    direction_factor: Floats
    """Of one direction, at even sines, (2 or more,)."""
    root_area: Floats
    """Of each area [m], (n,)."""
    weight: Floats
    """Of each pair [1], (p,)."""
    scatterer_number: Singles
    """Of each place, (n,)."""
    stretch: NDArray[np.uint8]
    """That each lies in, (n,)."""
    keep_probability: Singles
    """Part of the scatterers at which pairs are met, (p, stretches); or (0, 0): everywhere."""


class _Leg(NamedTuple):
    """A leg's scatterers side by side, those of a part that it reaches, up to `_PART`."""

    scatterer: NDArray[np.int32]
    """Their numbers in the part."""
    column: Floats
    """Columns one after the other, of `_PART` each: compilers see that none lies on another, and work on many numbers
    at a time."""


_REAL, _IMAGINARY = 0 * _PART, 1 * _PART
"""What is left of the pressure."""
_SIDE, _LENGTH = 2 * _PART, 3 * _PART
"""What the leg's direction contributes to strengths; the leg's length."""
_NORTH, _EAST, _DOWN = 4 * _PART, 5 * _PART, 6 * _PART
"""Direction away from the sonar."""
_WHEN, _BEHIND = 7 * _PART, 8 * _PART
"""A time [s]; one over one less the part of the speed of sound at which the leg is followed."""
_AHEAD, _RIGHT, _UNDER = 9 * _PART, 10 * _PART, 11 * _PART
"""Cosines to an array's axes."""
_SIZE = 12 * _PART
"""A factor."""
_COLUMNS = 13


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _reached(
    legs: LegColumns,
    f: int,
    part_start: int,
    end: int,
    extra_attenuation: float,
    strengths: ScatteringStrengths,
    leg: _Leg,
) -> int:
    """How many scatterers of a part a leg reaches; which, and what it is like there, goes into `leg`."""
    count = 0
    visibility, boundary = legs.visibility[f, part_start:end], legs.reflection_coefficient[f, part_start:end]
    for k in range(end - part_start):
        leg.scatterer[np.uintp(count)] = k
        count += (visibility[k] != 0) & (boundary[k] != 0)
    spreading, absorption = legs.spreading[f, part_start:end], legs.absorption[f, part_start:end]
    length, grazing, departure = (
        legs.length[f, part_start:end],
        legs.grazing[f, part_start:end],
        legs.departure[f, part_start:end],
    )
    c = leg.column
    for k in range(count):
        n = np.uintp(leg.scatterer[k])
        size, left, mirrored = spreading[n] * absorption[n], visibility[n], boundary[n]
        c[_REAL + k] = (left.real * mirrored.real - left.imag * mirrored.imag) * size
        c[_IMAGINARY + k] = (left.real * mirrored.imag + left.imag * mirrored.real) * size
        c[_LENGTH + k], c[_SIDE + k] = length[n], grazing[n]
        c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = departure[n, 0], departure[n, 1], departure[n, 2]
    if extra_attenuation != 0:
        for k in range(count):
            kept = math.exp(-extra_attenuation * c[_LENGTH + k])
            c[_REAL + k] *= kept
            c[_IMAGINARY + k] *= kept
    _contribution_roots(strengths.direction_factor, c[_SIDE : _SIDE + count])
    return count


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _contribution_roots(factor: Floats, side: Floats) -> None:
    """Grazing angles become the root of what directions contribute to cross sections; 1 for no factors."""
    rows = factor.size - 1
    if rows < 1:
        side[:] = 1.0
        return
    for k in range(side.size):
        sine, _ = sincos_cycles(abs(side[k]) * (0.5 / math.pi))
        side[k] = min(np.float64(sine), 1.0) * rows
    first, growth = factor[0], factor[1] - factor[0]
    for k in range(side.size if rows == 1 else 0):
        side[k] = math.sqrt(first + side[k] * growth)
    for k in range(side.size if rows > 1 else 0):
        row = min(int(side[k]), rows - 1)
        side[k] = math.sqrt(factor[row] + (side[k] - row) * (factor[row + 1] - factor[row]))


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _transmit_leg(
    f: int, part_start: int, count: int, transmitter: Transmitter, phase: Complexes, delay: Floats, leg: _Leg,
    transmit_legs: TransmitLegs,
    transmit_cosine: Floats,
) -> None:  # fmt: skip
    """What a leg out brings to the scatterers of a part that it reaches; and direction cosines, as of `_receive_gain`."""
    beams, c, which = transmitter.beams, leg.column, leg.scatterer
    axes, velocity, middle, slowness = beams.axes, transmitter.velocity, transmitter.pulse_middle, transmitter.slowness
    for k in range(count):
        c[_WHEN + k], chasing, louder = transmitter_motion_of_leg(
            c[_NORTH + k], c[_EAST + k], c[_DOWN + k], c[_LENGTH + k], velocity, middle, slowness
        )
        c[_BEHIND + k], c[_SIZE + k] = 1 / (1 - chasing), transmitter.level * louder * c[_SIDE + k]
    _face(axes, count, c)
    _apply_element_pattern(beams, count, c)
    if transmit_cosine.shape[0]:
        for k in range(count):
            transmit_cosine[f, np.uintp(which[k])] = c[_RIGHT + k]
    late, following = transmit_legs.delay[f], transmit_legs.transmit_doppler[f]
    late_out, turn = delay[part_start:], phase[part_start:]
    for k in range(count):
        at = np.uintp(which[k])
        late[at], following[at] = late_out[at] + c[_WHEN + k], c[_BEHIND + k]
        c[_WHEN + k], c[_BEHIND + k] = turn[at].real, turn[at].imag
    for beam in range(beams.steer.shape[0]):
        weight = transmit_legs.weight[beam, f]
        for k in range(count):
            size = c[_SIZE + k] * beam_amplitude(beams, beam, c[_RIGHT + k], c[_UNDER + k])
            real = c[_REAL + k] * c[_WHEN + k] - c[_IMAGINARY + k] * c[_BEHIND + k]
            imaginary = c[_REAL + k] * c[_BEHIND + k] + c[_IMAGINARY + k] * c[_WHEN + k]
            weight[np.uintp(which[k])] = complex(real * size, imaginary * size)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _face(axes: Floats, count: int, c: Floats) -> None:
    """Cosines of directions to an array's axes."""
    for k in range(count):
        c[_AHEAD + k], c[_RIGHT + k], c[_UNDER + k] = array_cosines(axes, c[_NORTH + k], c[_EAST + k], c[_DOWN + k])


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _apply_element_pattern(beams: BeamTables, count: int, c: Floats) -> None:
    """Factors with the gain of an array's elements."""
    for k in range(count):
        c[_SIZE + k] *= element_amplitude(beams, c[_AHEAD + k], c[_RIGHT + k], c[_UNDER + k])


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _turned(x: float, y: float, z: float, arrival_time: float, r: Floats, b: Floats) -> tuple[float, float, float]:
    """A direction as it would have to be at the start to be heard by the array as it is turned later.

    As `Course.turned`, with the two parts of its `sweep`.
    """
    north = x + arrival_time * (
        x * r[0, 0] + y * r[0, 1] + z * r[0, 2] + arrival_time * (x * b[0, 0] + y * b[0, 1] + z * b[0, 2])
    )
    east = y + arrival_time * (
        x * r[1, 0] + y * r[1, 1] + z * r[1, 2] + arrival_time * (x * b[1, 0] + y * b[1, 1] + z * b[1, 2])
    )
    down = z + arrival_time * (
        x * r[2, 0] + y * r[2, 1] + z * r[2, 2] + arrival_time * (x * b[2, 0] + y * b[2, 1] + z * b[2, 2])
    )
    once = 1 / math.sqrt(north * north + east * east + down * down)
    return once * north, once * east, once * down


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _receive_gain(
    row: int, count: int, receiving_array: ReceivingArray, receive_beams: ReceiveBeams, leg: _Leg, gain: Singles,
    right_cosine: Floats
) -> None:  # fmt: skip
    """Gain of each pattern towards a leg's scatterers when their echoes come.

    Args:
        row: Of the gains.
        count: How many scatterers the leg reaches.
        receiving_array: What hears.
        receive_beams: Where it is.
        leg: The leg; its columns tell when, and begin with factors of 1.
        gain: Result, (rows, patterns, part).
        right_cosine: Result, direction cosines to the array's right, (rows, part); or (0, 0): not wanted.
    """
    beams, c, which = receiving_array.beams, leg.column, leg.scatterer
    if receiving_array.has_parallax:
        place, velocity, acceleration = (
            receive_beams.position[0],
            receive_beams.velocity[0],
            receive_beams.acceleration[0],
        )
        for k in range(count):
            c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = direction_at_arrival(
                c[_NORTH + k], c[_EAST + k], c[_DOWN + k], c[_LENGTH + k], c[_WHEN + k], place, velocity, acceleration
            )
    if receiving_array.is_rotating:
        for k in range(count):
            c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = _turned(
                c[_NORTH + k],
                c[_EAST + k],
                c[_DOWN + k],
                c[_WHEN + k],
                receiving_array.rotation_rate,
                receiving_array.rotation_acceleration,
            )
    _face(beams.axes, count, c)
    _apply_element_pattern(beams, count, c)
    if right_cosine.shape[0]:
        right = right_cosine[row]
        for k in range(count):
            right[np.uintp(which[k])] = c[_RIGHT + k]
    for pattern in range(beams.steer.shape[0]):
        heard = gain[row, pattern]
        for k in range(count):
            heard[np.uintp(which[k])] = c[_SIZE + k] * beam_amplitude(beams, pattern, c[_RIGHT + k], c[_UNDER + k])


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _receive_leg(
    j: int, part_start: int, end: int, count: int, legs: LegColumns, first: Floats, receiving_array: ReceivingArray,
    wavefronts: WavefrontColumns,
    receive_beams: ReceiveBeams, root_area: Floats, leg: _Leg, receive_legs: ReceiveLegs, right_cosine: Floats,
) -> None:  # fmt: skip
    """What a leg back takes from the scatterers of a part that it reaches.

    Args:
        j: Row of the leg.
        part_start: Number of the part's first scatterer.
        end: One more than that of its last.
        count: How many of these it reaches.
        legs: The legs.
        first: Delays of the first leg out [s], (n,): by another leg out an echo hardly comes from another place.
        receiving_array: What hears.
        wavefronts: Wavefronts where rays bend.
        receive_beams: Where it is.
        root_area: Of areas [m], (n,); or (0,).
        leg: The leg.
        receive_legs: Result.
        right_cosine: Result, as of `_receive_gain`.
    """
    c, delay, sooner, middle = (
        leg.column,
        legs.delay[j, part_start:end],
        first[part_start:end],
        receiving_array.pulse_middle,
    )
    late, bend, towards, weight = (
        receive_legs.delay[j],
        receive_legs.vertical_curvature[j],
        receive_legs.direction[j],
        receive_legs.weight[j],
    )
    if root_area.size:
        for k in range(count):
            c[_SIDE + k] *= root_area[np.uintp(part_start + leg.scatterer[k])]
    for k in range(count):
        c[_AHEAD + k] = 1 / max(c[_LENGTH + k], CLOSEST_SOURCE)
    for k in range(count):
        at, size = np.uintp(leg.scatterer[k]), c[_SIDE + k]
        weight[at] = complex(c[_REAL + k] * size, c[_IMAGINARY + k] * size)
        late[at], bend[at] = delay[at], c[_AHEAD + k]
        towards[at, 0], towards[at, 1], towards[at, 2] = c[_NORTH + k], c[_EAST + k], c[_DOWN + k]
        c[_WHEN + k] = sooner[at] + middle + delay[at]
    if wavefronts.vertical_curvature.size:
        part = end - part_start
        receive_legs.vertical_curvature[j, :part], receive_legs.horizontal_distance[j, :part] = (
            wavefronts.vertical_curvature[j, part_start:end],
            wavefronts.horizontal_distance[j, part_start:end],
        )
        receive_legs.expansion[j, :, :part] = wavefronts.expansion[j, :, part_start:end]
    c[_SIZE : _SIZE + count] = 1.0
    if not receiving_array.is_rotating:
        _receive_gain(j, count, receiving_array, receive_beams, leg, receive_legs.gain, right_cosine)


class _ReachedScatterers(NamedTuple):
    """Scatterers of a part that each leg reaches, not hidden and not behind the array."""

    scatterer: NDArray[np.int32]
    """Their numbers in the part, (legs, part)."""
    scatterer_count: NDArray[np.int64]
    """How many, (legs,)."""
    is_reached: Flags
    """Whether each is, (legs, part)."""


@njit(cache=True, nogil=True, error_model="numpy")
def _no_scatterers(legs: int) -> _ReachedScatterers:
    """Room for what so many legs reach."""
    return _ReachedScatterers(
        np.empty((legs, _PART), np.int32), np.zeros(legs, np.int64), np.zeros((legs, _PART), np.uint8)
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _note_reached(reached: _ReachedScatterers, f: int, count: int, leg: _Leg) -> None:
    """Keep which scatterers a leg reaches with any pressure, by the factors in its columns."""
    flag, which, column, kept = reached.is_reached[f], reached.scatterer[f], leg.column, 0
    flag[:] = 0
    for k in range(count):
        sounds = column[_SIZE + k] != 0
        flag[np.uintp(leg.scatterer[k])] = sounds
        which[np.uintp(kept)] = leg.scatterer[k]
        kept += sounds
    reached.scatterer_count[f] = kept


@njit(cache=True, nogil=True, error_model="numpy")
def _echoes_of_pair(
    p: int,
    i: int,
    j: int,
    part_start: int,
    strengths: ScatteringStrengths,
    legs_out: _ReachedScatterers,
    legs_back: _ReachedScatterers,
    buffer: ArrivalBuffer,
) -> int:
    """How many scatterers of a part have an echo by one pair of legs; which, and how they answer, goes into `buffer`."""
    shorter = legs_out.scatterer_count[i] <= legs_back.scatterer_count[j]
    which = (
        legs_out.scatterer[i, : legs_out.scatterer_count[i]]
        if shorter
        else legs_back.scatterer[j, : legs_back.scatterer_count[j]]
    )
    flag, count = legs_back.is_reached[j] if shorter else legs_out.is_reached[i], 0
    if strengths.amplitude.shape[0]:
        given = strengths.amplitude[p, part_start:]
        for k in range(which.size):
            n = np.uintp(which[k])
            buffer.scatterer[np.uintp(count)], buffer.strength[np.uintp(count)] = which[k], given[n]
            count += flag[n] & np.uint8(given[n] != 0)
    elif strengths.keep_probability.shape[0]:
        share, number, stretch = (
            strengths.keep_probability[p],
            strengths.scatterer_number[part_start:],
            strengths.stretch[part_start:],
        )
        for k in range(which.size):
            n = np.uintp(which[k])
            buffer.scatterer[np.uintp(count)] = which[k]
            count += flag[n] & np.uint8(number[n] < share[np.uintp(stretch[n])])
        once = np.float32(strengths.weight[p]) / np.sqrt(share)
        for k in range(count):
            buffer.strength[k] = once[np.uintp(stretch[np.uintp(buffer.scatterer[k])])]
    else:
        for k in range(which.size):
            buffer.scatterer[np.uintp(count)] = which[k]
            count += flag[np.uintp(which[k])]
        buffer.strength[:count] = strengths.weight[p]
    return count


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _receive_gain_by_pair(
    part_start: int, i: int, j: int, count: int, buffer: ArrivalBuffer, transmit_legs: TransmitLegs,
    receive_legs: ReceiveLegs, length: Floats, receiving_array: ReceivingArray,
    receive_beams: ReceiveBeams, leg: _Leg, right_cosine: Floats,
) -> None:  # fmt: skip
    """Gains for an array that turns, of one pair of legs: its echoes come at times of their own."""
    c, towards = leg.column, receive_legs.direction[j]
    leg.scatterer[:count] = buffer.scatterer[:count]
    for k in range(count):
        n = np.uintp(buffer.scatterer[k])
        c[_WHEN + k], c[_LENGTH + k] = transmit_legs.delay[i, n] + receive_legs.delay[j, n], length[j, part_start + n]
        c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = towards[n, 0], towards[n, 1], towards[n, 2]
    c[_SIZE : _SIZE + count] = 1.0
    _receive_gain(0, count, receiving_array, receive_beams, leg, receive_legs.gain, right_cosine)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_block(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, pair: Integers, legs_out: LegColumns,
    legs_back: LegColumns,
    same_legs: bool, extra_attenuation: float, phase: Complexes, strengths: ScatteringStrengths,
    transmitter: Transmitter, receiving_array: ReceivingArray, wavefronts: WavefrontColumns,
    receive_beams: ReceiveBeams, slowness: float, sound_speed_gradient: float, attenuation: float, is_refracted: bool,
    pulse_middle: float, frequency: float,
    doppler_node_count: Floats, grid: DirectionRows,
) -> None:  # fmt: skip
    """Echoes of one block by all pairs of legs, for all beams, added to their cells.

    Args:
        cells: As of `_echo_kernel.deposit_pair`.
        first_time: Likewise.
        cell_rate: Likewise.
        pair: Row of the leg out and of the leg back of each pair, (p, 2).
        legs_out: Legs out.
        legs_back: Legs back.
        same_legs: Whether these are the same.
        extra_attenuation: What the water takes beyond what legs know, at this frequency [1/m].
        phase: Phasors of the places [1], (n,).
        strengths: What scatterers make of pairs.
        transmitter: What sends.
        receiving_array: What hears.
        wavefronts: Wavefronts where rays bend.
        receive_beams: One place that hears, and its beams.
        slowness: As of `_echo_kernel.deposit_pair`.
        sound_speed_gradient: Likewise.
        attenuation: Likewise.
        is_refracted: Likewise.
        pulse_middle: Likewise.
        frequency: Likewise.
        doppler_node_count: Likewise.
        grid: Rows of a grid of directions, whose channels are rows then, not beams; of step 0: channels are beams.
    """
    f, g, patterns, many = len(legs_out.delay), len(legs_back.delay), len(receiving_array.beams.steer), phase.size
    beams, rows = len(transmitter.beams.steer), 1 if receiving_array.is_rotating else g
    sent = TransmitLegs(np.zeros((f, _PART)), np.ones((f, _PART)), np.zeros((beams, f, _PART), np.complex64))
    heard = ReceiveLegs(np.zeros((g, _PART)), np.ones((g, _PART)), np.zeros((g, _PART)),
                  np.zeros((g, wavefronts.expansion.shape[1], _PART)), np.zeros((g, _PART, 3)),
                  np.zeros((g, _PART), np.complex64), np.zeros((rows, patterns, _PART), np.float32))  # fmt: skip
    leg, room = (
        _Leg(np.empty(_PART + 1, np.int32), np.empty(_COLUMNS * _PART)),
        arrival_buffer(wavefronts.expansion.shape[1], cells.shape[1], doppler_node_count),
    )
    away, home, directed = _no_scatterers(f), _no_scatterers(g), grid.step > 0
    across, there = np.zeros((rows if directed else 0, _PART)), row_sort_buffer(cells.shape[0] if directed else 0)
    leaving = np.zeros((f if directed else 0, _PART))
    for begin in range(0, many, _PART):
        end = min(begin + _PART, many)
        for i in range(f):
            count = _reached(legs_out, i, begin, end, extra_attenuation, strengths, leg)
            _transmit_leg(i, begin, count, transmitter, phase, legs_out.delay[i], leg, sent, leaving)
            _note_reached(away, i, count, leg)
            if same_legs:
                _receive_leg(i, begin, end, count, legs_back, legs_out.delay[0], receiving_array, wavefronts,
                             receive_beams, strengths.root_area, leg,
                           heard, across)  # fmt: skip
                _note_reached(home, i, count, leg)
        if not same_legs:
            for j in range(g):
                count = _reached(legs_back, j, begin, end, extra_attenuation, strengths, leg)
                _receive_leg(j, begin, end, count, legs_back, legs_out.delay[0], receiving_array, wavefronts,
                             receive_beams, strengths.root_area, leg,
                           heard, across)  # fmt: skip
                _note_reached(home, j, count, leg)
        for p in range(len(pair)):
            i, j = pair[p]
            count = _echoes_of_pair(p, i, j, begin, strengths, away, home, room)
            if count == 0:
                continue
            if receiving_array.is_rotating:
                _receive_gain_by_pair(
                    begin, i, j, count, room, sent, heard, legs_back.length, receiving_array, receive_beams, leg, across
                )
            row = 0 if receiving_array.is_rotating else j
            if directed:
                deposit_pair_by_direction(cells, first_time, cell_rate, i, j, row, count, room, sent, heard,
                                          receive_beams,
                                      leaving[i], across[row], grid, there, slowness, sound_speed_gradient,
                                      attenuation, is_refracted, pulse_middle,
                                      frequency, doppler_node_count)  # fmt: skip
            else:
                deposit_pair(cells, first_time, cell_rate, i, j, row, count, room, sent, heard, receive_beams,
                             slowness, sound_speed_gradient,
                         attenuation, is_refracted, pulse_middle, frequency, doppler_node_count)  # fmt: skip
