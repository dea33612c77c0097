"""Kernel that deposits the echoes of a block of scatterers in beams, from legs to grids, a part of the block at a time.

The work arrays of a part stay in the cache throughout: pressures of the transmit and receive legs,
the gain of the beams at reception, the strength of pairs. Legs without pressure are skipped.
Then pairs of legs are combined. Plain numbers and arrays.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.wavefront import MIN_RADIUS
from insonify.sonar.beam_kernels import BeamTables, array_cosines, beam_amplitude, element_amplitude
from insonify.synthesis._arrival_kernel import (
    ArrivalBuffer,
    BlockLegs,
    Flags,
    Integers,
    ReceiveBeams,
    ReceiveLegs,
    Reception,
    TransmitLegs,
    arrival_buffer,
    deposit_pair,
)
from insonify.synthesis._arrival_time_kernel import ElementMotion, direction_at_arrival, transmitter_motion_of_leg
from insonify.synthesis._direction_grid_kernel import (
    DirectionColumns,
    DirectionRows,
    deposit_pair_by_direction,
    row_sort_buffer,
)

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Complexes = NDArray[np.complex128]
_PART = 1024
"""Number of scatterers of a part."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class LegColumns(NamedTuple):
    """Columns of `Legs` between one end and n scatterers, (f, n)."""

    delay: Floats
    """One-way delay [s]."""
    length: Floats
    """Path length [m]."""
    spreading: Floats
    """Pressure ratio by spreading re 1 m [1]."""
    absorption: Floats
    """Pressure ratio by absorption at the carrier [1]."""
    reflection_coefficient: Complexes
    """Product of the reflection coefficients, with the phases of caustics and glints [1]."""
    visibility: Complexes
    """Pressure ratio by occlusion and diffraction [1]."""
    departure: Floats
    """Unit vector away from the sonar, in the world [1], (f, n, 3)."""
    grazing_sine: Floats
    """Sine of the grazing angle at the scatterer [1]."""


class Transmitter(NamedTuple):
    """Transmitter: source pressure, velocity and beam patterns of the transmitting end."""

    source_pressure: float
    """Pressure at 1 m [uPa]."""
    velocity: Floats
    """Velocity at the start of the ping [m/s], (3,)."""
    pulse_middle: float
    """Time from the pulse's start to its middle; 0 for a sonar at rest [s]."""
    slowness: float
    """Slowness of sound at the transmitter [s/m]."""
    beams: BeamTables
    """Transmit beams."""


class ReceivingArray(NamedTuple):
    """Receiving array."""

    pulse_middle: float
    """Time from the pulse's start to its middle; 0 for a sonar at rest [s]."""
    has_parallax: bool
    """True if directions are taken from the array's position at reception."""
    is_rotating: bool
    """True if the array rotates until reception."""
    rotation_rate: Floats
    """First-order rotation, from `PlatformMotion.rotation_rates` [1/s], (3, 3)."""
    rotation_acceleration: Floats
    """Second-order rotation, from `PlatformMotion.rotation_rates` [1/s^2], (3, 3)."""
    beams: BeamTables
    """Receive beams."""
    point: ReceiveBeams
    """One receive point, and its channels."""


class WavefrontColumns(NamedTuple):
    """Received wavefronts in layered water, as in `ReceiveLegs`; empty in water of one sound speed."""

    vertical_curvature: Floats
    """[1/m], (g, n)."""
    horizontal_distance: Floats
    """[m], (g, n)."""
    expansion: Floats
    """Shape (g, terms, n)."""


class ScatteringStrengths(NamedTuple):
    """Strengths of n scatterers for p pairs: as an array, or separable, see `records.pairs.SeparableStrengths`."""

    amplitude: NDArray[np.complex64]
    """Strengths [m], (p, n); or (0, 0): separable."""
    direction_factor: Floats
    """Factor of the cross section by the direction of one leg [1], at equal steps of the sine of its grazing angle from
    0 to 1, (2 or more,); empty: 1."""
    root_area: Floats
    """Root of the area of each scatterer [m], (n,)."""
    weight: Floats
    """Factor of the strength of each pair [1], (p,)."""
    priority: Singles
    """Priority of each scatterer, (n,)."""
    range_bin: NDArray[np.uint8]
    """Range bin of each scatterer, (n,)."""
    keep_probability: Singles
    """Keep probability of each pair in each range bin, (p, bins); or (0, 0): 1."""


class ScattererBlock(NamedTuple):
    """Block of n scatterers: legs of both ends, and strengths."""

    pair: Integers
    """Rows of the transmit and the receive leg of each pair, (p, 2)."""
    transmit_legs: LegColumns
    """Transmit legs."""
    receive_legs: LegColumns
    """Receive legs."""
    same_legs: bool
    """True if transmit and receive legs are the same."""
    phase: Complexes
    """Phasors of the scatterers [1], (n,)."""
    strengths: ScatteringStrengths
    """Strengths of the pairs."""
    wavefronts: WavefrontColumns
    """Wavefronts in layered water."""


class _Leg(NamedTuple):
    """Scatterers of a part that one leg reaches, as contiguous columns of up to `_PART`."""

    scatterer: NDArray[np.int32]
    """Their indices in the part."""
    column: Floats
    """Columns of `_PART` numbers, one after the other in one array: compilers see that they do not overlap, and
    vectorise.
    """


_REAL, _IMAGINARY = 0 * _PART, 1 * _PART
"""Pressure ratio of the leg [1]."""
_FACTOR, _LENGTH = 2 * _PART, 3 * _PART
"""Root of the direction factor of strengths [1]; length of the leg [m]."""
_NORTH, _EAST, _DOWN = 4 * _PART, 5 * _PART, 6 * _PART
"""Unit vector away from the sonar, in the world [1]."""
_TIME, _DOPPLER = 7 * _PART, 8 * _PART
"""Emission delay or time of arrival [s] and 1 / (1 - radial Mach number); then the scatterer's phasor, real and
imaginary part."""
_AHEAD, _RIGHT, _BELOW = 9 * _PART, 10 * _PART, 11 * _PART
"""Direction cosines along an array's axes [1]; the first also holds the curvature of wavefronts [1/m]."""
_WEIGHT = 12 * _PART
"""Source pressure and factors [uPa] of a transmit leg; amplitude of the element pattern [1] of a receive leg."""
_COLUMNS = 13


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _fill_leg(
    legs: LegColumns, f: int, part_start: int, end: int, extra_attenuation: float, strengths: ScatteringStrengths,
    leg: _Leg,
) -> int:  # fmt: skip
    """Select the scatterers of a part that a leg reaches, fill the leg's columns, and return their number."""
    count = 0
    visibility, boundary = legs.visibility[f, part_start:end], legs.reflection_coefficient[f, part_start:end]
    for k in range(end - part_start):
        leg.scatterer[np.uintp(count)] = k
        count += (visibility[k] != 0) & (boundary[k] != 0)
    spreading, absorption = legs.spreading[f, part_start:end], legs.absorption[f, part_start:end]
    length, grazing_sine = legs.length[f, part_start:end], legs.grazing_sine[f, part_start:end]
    departure = legs.departure[f, part_start:end]
    c = leg.column
    for k in range(count):
        n = np.uintp(leg.scatterer[k])
        loss, occlusion, reflection = spreading[n] * absorption[n], visibility[n], boundary[n]
        c[_REAL + k] = (occlusion.real * reflection.real - occlusion.imag * reflection.imag) * loss
        c[_IMAGINARY + k] = (occlusion.real * reflection.imag + occlusion.imag * reflection.real) * loss
        c[_LENGTH + k], c[_FACTOR + k] = length[n], grazing_sine[n]
        c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = departure[n, 0], departure[n, 1], departure[n, 2]
    if extra_attenuation != 0:
        for k in range(count):
            attenuation = math.exp(-extra_attenuation * c[_LENGTH + k])
            c[_REAL + k] *= attenuation
            c[_IMAGINARY + k] *= attenuation
    _direction_factor_roots(strengths.direction_factor, c[_FACTOR : _FACTOR + count])
    return count


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _direction_factor_roots(factor: Floats, sine_to_root: Floats) -> None:
    """Replace sines of grazing angles by the root of the cross section's direction factor; by 1 for no factors."""
    rows = factor.size - 1
    if rows < 1:
        for k in range(sine_to_root.size):
            sine_to_root[k] = 1.0
        return
    for k in range(sine_to_root.size):
        sine_to_root[k] = abs(sine_to_root[k]) * rows
    first, slope = factor[0], factor[1] - factor[0]
    for k in range(sine_to_root.size if rows == 1 else 0):
        sine_to_root[k] = math.sqrt(first + sine_to_root[k] * slope)
    for k in range(sine_to_root.size if rows > 1 else 0):
        row = min(int(sine_to_root[k]), rows - 1)
        sine_to_root[k] = math.sqrt(factor[row] + (sine_to_root[k] - row) * (factor[row + 1] - factor[row]))


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _transmit_leg(
    f: int, part_start: int, count: int, transmitter: Transmitter, block: ScattererBlock, leg: _Leg,
    transmit_legs: TransmitLegs, transmit_cosine: Floats,
) -> None:  # fmt: skip
    """Fill transmitted pressures at the scatterers that a leg reaches, and direction cosines to the array's right."""
    beams, c, scatterer = transmitter.beams, leg.column, leg.scatterer
    axes, velocity, middle, slowness = beams.axes, transmitter.velocity, transmitter.pulse_middle, transmitter.slowness
    for k in range(count):
        c[_TIME + k], mach, amplitude_factor = transmitter_motion_of_leg(
            c[_NORTH + k], c[_EAST + k], c[_DOWN + k], c[_LENGTH + k], velocity, middle, slowness
        )
        c[_DOPPLER + k], c[_WEIGHT + k] = (
            1 / (1 - mach), transmitter.source_pressure * amplitude_factor * c[_FACTOR + k],
        )  # fmt: skip
    _array_cosines(axes, count, c)
    _apply_element_pattern(beams, count, c)
    if transmit_cosine.shape[0]:
        for k in range(count):
            transmit_cosine[f, np.uintp(scatterer[k])] = c[_RIGHT + k]
    leg_delay, leg_doppler = transmit_legs.delay[f], transmit_legs.transmit_doppler[f]
    transmit_delay, phasor = block.transmit_legs.delay[f, part_start:], block.phase[part_start:]
    for k in range(count):
        n = np.uintp(scatterer[k])
        leg_delay[n], leg_doppler[n] = transmit_delay[n] + c[_TIME + k], c[_DOPPLER + k]
        c[_TIME + k], c[_DOPPLER + k] = phasor[n].real, phasor[n].imag
    for beam in range(beams.steer.shape[0]):
        weight = transmit_legs.weight[beam, f]
        for k in range(count):
            weight_factor = c[_WEIGHT + k] * beam_amplitude(beams, beam, c[_RIGHT + k], c[_BELOW + k])
            real = c[_REAL + k] * c[_TIME + k] - c[_IMAGINARY + k] * c[_DOPPLER + k]
            imaginary = c[_REAL + k] * c[_DOPPLER + k] + c[_IMAGINARY + k] * c[_TIME + k]
            weight[np.uintp(scatterer[k])] = complex(real * weight_factor, imaginary * weight_factor)


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _array_cosines(axes: Floats, count: int, c: Floats) -> None:
    """Fill direction cosines along an array's axes."""
    for k in range(count):
        c[_AHEAD + k], c[_RIGHT + k], c[_BELOW + k] = array_cosines(axes, c[_NORTH + k], c[_EAST + k], c[_DOWN + k])


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _apply_element_pattern(beams: BeamTables, count: int, c: Floats) -> None:
    """Multiply factors by the amplitude of an array's elements."""
    for k in range(count):
        c[_WEIGHT + k] *= element_amplitude(beams, c[_AHEAD + k], c[_RIGHT + k], c[_BELOW + k])


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _rotated_direction(
    x: float, y: float, z: float, arrival_time: float, r: Floats, b: Floats
) -> tuple[float, float, float]:
    """Direction that has, in the array of the start of the ping, the cosines of a direction in the rotated array.

    As `PlatformMotion.to_initial_attitude`, with rotation of first order `r` [1/s] and second order `b` [1/s^2].
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
    inverse = 1 / math.sqrt(north * north + east * east + down * down)
    return inverse * north, inverse * east, inverse * down


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _receive_gain(
    row: int, count: int, receiving_array: ReceivingArray, leg: _Leg, gain: Singles, right_cosine: Floats
) -> None:
    """Fill the amplitude of each pattern towards a leg's scatterers at the times of reception.

    Args:
        row: Row of `gain` to be filled.
        count: Number of scatterers that the leg reaches.
        receiving_array: Receiving array.
        leg: The leg; its columns hold the times of arrival, and factors that start at 1.
        gain: Result: amplitudes [1], (rows, patterns, part).
        right_cosine: Result: direction cosines to the array's right, (rows, part); or (0, 0): not needed.
    """
    beams, c, scatterer = receiving_array.beams, leg.column, leg.scatterer
    if receiving_array.has_parallax:
        point = receiving_array.point
        element = ElementMotion(point.position[0], point.velocity[0], point.acceleration[0])
        for k in range(count):
            c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = direction_at_arrival(
                c[_NORTH + k], c[_EAST + k], c[_DOWN + k], c[_LENGTH + k], c[_TIME + k], element
            )
    if receiving_array.is_rotating:
        for k in range(count):
            c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = _rotated_direction(
                c[_NORTH + k], c[_EAST + k], c[_DOWN + k], c[_TIME + k], receiving_array.rotation_rate,
                receiving_array.rotation_acceleration,
            )  # fmt: skip
    _array_cosines(beams.axes, count, c)
    _apply_element_pattern(beams, count, c)
    if right_cosine.shape[0]:
        right = right_cosine[row]
        for k in range(count):
            right[np.uintp(scatterer[k])] = c[_RIGHT + k]
    for pattern in range(beams.steer.shape[0]):
        pattern_gain = gain[row, pattern]
        for k in range(count):
            pattern_gain[np.uintp(scatterer[k])] = c[_WEIGHT + k] * beam_amplitude(
                beams, pattern, c[_RIGHT + k], c[_BELOW + k]
            )


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _receive_leg(
    j: int, part: tuple[int, int], count: int, block: ScattererBlock, receiving_array: ReceivingArray, leg: _Leg,
    receive_legs: ReceiveLegs, right_cosine: Floats,
) -> None:  # fmt: skip
    """Fill the received pressure ratio of the scatterers of a part that a receive leg reaches.

    Args:
        j: Row of the leg.
        part: Index of the part's first scatterer, and one past that of its last.
        count: Number of scatterers that the leg reaches.
        block: The block.
        receiving_array: Receiving array.
        leg: Columns of the leg.
        receive_legs: Result: pressure ratios and gains.
        right_cosine: Result: direction cosines to the array's right, as in `_receive_gain`.
    """
    part_start, end = part
    # delays of the first transmit leg: other legs give nearly the same direction of arrival
    c, delay = leg.column, block.receive_legs.delay[j, part_start:end]
    first_delay = block.transmit_legs.delay[0, part_start:end]
    middle, wavefronts, root_area = receiving_array.pulse_middle, block.wavefronts, block.strengths.root_area
    leg_delay, curvature, direction, weight = (
        receive_legs.delay[j], receive_legs.vertical_curvature[j], receive_legs.direction[j], receive_legs.weight[j],
    )  # fmt: skip
    if root_area.size:
        for k in range(count):
            c[_FACTOR + k] *= root_area[np.uintp(part_start + leg.scatterer[k])]
    for k in range(count):
        c[_AHEAD + k] = 1 / max(c[_LENGTH + k], MIN_RADIUS)
    for k in range(count):
        n, weight_factor = np.uintp(leg.scatterer[k]), c[_FACTOR + k]
        weight[n] = complex(c[_REAL + k] * weight_factor, c[_IMAGINARY + k] * weight_factor)
        leg_delay[n], curvature[n] = delay[n], c[_AHEAD + k]
        direction[n, 0], direction[n, 1], direction[n, 2] = c[_NORTH + k], c[_EAST + k], c[_DOWN + k]
        c[_TIME + k] = first_delay[n] + middle + delay[n]
    if wavefronts.vertical_curvature.size:
        part_count = end - part_start
        for k in range(part_count):
            receive_legs.vertical_curvature[j, k] = wavefronts.vertical_curvature[j, part_start + k]
            receive_legs.horizontal_distance[j, k] = wavefronts.horizontal_distance[j, part_start + k]
        for term in range(wavefronts.expansion.shape[1]):
            for k in range(part_count):
                receive_legs.expansion[j, term, k] = wavefronts.expansion[j, term, part_start + k]
    for k in range(count):
        c[_WEIGHT + k] = 1.0
    if not receiving_array.is_rotating:
        _receive_gain(j, count, receiving_array, leg, receive_legs.gain, right_cosine)


class _ReachedScatterers(NamedTuple):
    """Scatterers of a part that each leg reaches with pressure."""

    scatterer: NDArray[np.int32]
    """Their indices in the part, (legs, part)."""
    scatterer_count: NDArray[np.int64]
    """Their number, (legs,)."""
    is_reached: Flags
    """Mask of the reached scatterers, (legs, part)."""


@njit(cache=True, nogil=True, error_model="numpy")
def _reached_buffer(legs: int) -> _ReachedScatterers:
    """Empty work arrays for a number of legs."""
    return _ReachedScatterers(
        np.empty((legs, _PART), np.int32), np.zeros(legs, np.int64), np.zeros((legs, _PART), np.uint8)
    )


@njit(cache=True, nogil=True, reference_counts=False, error_model="numpy")
def _record_reached(reached: _ReachedScatterers, f: int, count: int, leg: _Leg) -> None:
    """Record the scatterers that a leg reaches with any pressure, by the factors in its columns."""
    flag, scatterer, column, reached_count = reached.is_reached[f], reached.scatterer[f], leg.column, 0
    for k in range(flag.size):
        flag[k] = 0
    for k in range(count):
        has_pressure = column[_WEIGHT + k] != 0
        flag[np.uintp(leg.scatterer[k])] = has_pressure
        scatterer[np.uintp(reached_count)] = leg.scatterer[k]
        reached_count += has_pressure
    reached.scatterer_count[f] = reached_count


@njit(cache=True, nogil=True, reference_counts=False, error_model="numpy")
def _echoes_of_pair(
    p: int, i: int, j: int, part_start: int, strengths: ScatteringStrengths, transmit: _ReachedScatterers,
    receive: _ReachedScatterers, buffer: ArrivalBuffer,
) -> int:  # fmt: skip
    """Select scatterers with an echo by one pair of legs, store their strengths in `buffer`, return their number."""
    shorter = transmit.scatterer_count[i] <= receive.scatterer_count[j]
    scatterer = (
        transmit.scatterer[i, : transmit.scatterer_count[i]]
        if shorter
        else receive.scatterer[j, : receive.scatterer_count[j]]
    )
    flag, count = receive.is_reached[j] if shorter else transmit.is_reached[i], 0
    if strengths.amplitude.shape[0]:
        given = strengths.amplitude[p, part_start:]
        for k in range(scatterer.size):
            n = np.uintp(scatterer[k])
            buffer.scatterer[np.uintp(count)], buffer.strength[np.uintp(count)] = scatterer[k], given[n]
            count += flag[n] & np.uint8(given[n] != 0)
    elif strengths.keep_probability.shape[0]:
        keep_probability, priority = strengths.keep_probability[p], strengths.priority[part_start:]
        range_bin = strengths.range_bin[part_start:]
        for k in range(scatterer.size):
            n = np.uintp(scatterer[k])
            buffer.scatterer[np.uintp(count)] = scatterer[k]
            count += flag[n] & np.uint8(priority[n] < keep_probability[np.uintp(range_bin[n])])
        weight = np.float32(strengths.weight[p])
        for k in range(count):
            kept = keep_probability[np.uintp(range_bin[np.uintp(buffer.scatterer[k])])]
            buffer.strength[k] = weight / np.sqrt(kept)
    else:
        for k in range(scatterer.size):
            buffer.scatterer[np.uintp(count)] = scatterer[k]
            count += flag[np.uintp(scatterer[k])]
        for k in range(count):
            buffer.strength[k] = strengths.weight[p]
    return count


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _receive_gain_by_pair(
    rows: tuple[int, int], count: int, buffer: ArrivalBuffer, legs: BlockLegs, length: Floats,
    receiving_array: ReceivingArray, leg: _Leg, right_cosine: Floats,
) -> None:  # fmt: skip
    """Fill gains of a rotating array for one pair of legs, whose echoes have their own times of arrival.

    Args:
        rows: Rows of the transmit and the receive leg.
        count: Number of echoes.
        buffer: Indices of their scatterers.
        legs: Legs of both ends; row 0 of the receive gains is filled.
        length: Length of the receive leg to each scatterer of the part [m], (part,).
        receiving_array: Receiving array.
        leg: Work arrays.
        right_cosine: Result: direction cosines to the array's right, as in `_receive_gain`.
    """
    i, j = rows
    c, direction = leg.column, legs.receive.direction[j]
    for k in range(count):
        leg.scatterer[k] = buffer.scatterer[k]
        n = np.uintp(buffer.scatterer[k])
        c[_TIME + k], c[_LENGTH + k] = legs.transmit.delay[i, n] + legs.receive.delay[j, n], length[n]
        c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = direction[n, 0], direction[n, 1], direction[n, 2]
    for k in range(count):
        c[_WEIGHT + k] = 1.0
    _receive_gain(0, count, receiving_array, leg, legs.receive.gain, right_cosine)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_block(
    cells: NDArray[np.complex64], block: ScattererBlock, extra_attenuation: float, transmitter: Transmitter,
    receiving_array: ReceivingArray, reception: Reception, grid: DirectionRows | None,
) -> None:  # fmt: skip
    """Deposit the echoes of one block by all pairs of legs on the cells of all beams.

    Args:
        cells: Grids of pressure, shape (channels, groups, cells, waveforms of a group): see `group_layout`.
        block: The block.
        extra_attenuation: Absorption at this frequency beyond that of the legs [Np/m].
        transmitter: Transmitter.
        receiving_array: Receiving array.
        reception: Time grid, carrier and water.
        grid: Direction grid, whose rows replace the channels; None: channels are beams, and its code is not compiled.
    """
    f, g = len(block.transmit_legs.delay), len(block.receive_legs.delay)
    scatterer_count, strengths = block.phase.size, block.strengths
    terms, patterns = block.wavefronts.expansion.shape[1], len(receiving_array.beams.steer)
    beams, gain_rows = len(transmitter.beams.steer), 1 if receiving_array.is_rotating else g
    transmit_legs = TransmitLegs(np.zeros((f, _PART)), np.ones((f, _PART)), np.zeros((beams, f, _PART), np.complex64))
    receive_legs = ReceiveLegs(
        np.zeros((g, _PART)), np.ones((g, _PART)), np.zeros((g, _PART)), np.zeros((g, terms, _PART)),
        np.zeros((g, _PART, 3)), np.zeros((g, _PART), np.complex64), np.zeros((gain_rows, patterns, _PART), np.float32),
    )  # fmt: skip
    legs, leg = BlockLegs(transmit_legs, receive_legs), _Leg(np.empty(_PART + 1, np.int32), np.empty(_COLUMNS * _PART))
    buffer = arrival_buffer(terms, cells.shape[1])
    reached_out, reached_back = _reached_buffer(f), _reached_buffer(g)
    transmit_cosine, right_cosine = np.zeros((0, _PART)), np.zeros((0, _PART))
    if grid is not None:
        transmit_cosine, right_cosine = np.zeros((f, _PART)), np.zeros((gain_rows, _PART))
        sort_buffer = row_sort_buffer(cells.shape[0])
    for begin in range(0, scatterer_count, _PART):
        end = min(begin + _PART, scatterer_count)
        for i in range(f):
            count = _fill_leg(block.transmit_legs, i, begin, end, extra_attenuation, strengths, leg)
            _transmit_leg(i, begin, count, transmitter, block, leg, transmit_legs, transmit_cosine)
            _record_reached(reached_out, i, count, leg)
            if block.same_legs:
                _receive_leg(i, (begin, end), count, block, receiving_array, leg, receive_legs, right_cosine)
                _record_reached(reached_back, i, count, leg)
        if not block.same_legs:
            for j in range(g):
                count = _fill_leg(block.receive_legs, j, begin, end, extra_attenuation, strengths, leg)
                _receive_leg(j, (begin, end), count, block, receiving_array, leg, receive_legs, right_cosine)
                _record_reached(reached_back, j, count, leg)
        for p in range(len(block.pair)):
            i, j = block.pair[p]
            count = _echoes_of_pair(p, i, j, begin, strengths, reached_out, reached_back, buffer)
            if count == 0:
                continue
            if receiving_array.is_rotating:
                length = block.receive_legs.length[j, begin:]
                _receive_gain_by_pair((i, j), count, buffer, legs, length, receiving_array, leg, right_cosine)
            row = 0 if receiving_array.is_rotating else j
            if grid is None:
                deposit_pair(cells, (i, j, row), count, buffer, legs, receiving_array.point, reception)
            else:
                directions = DirectionColumns(grid, transmit_cosine[i], right_cosine[row], sort_buffer)
                deposit_pair_by_direction(
                    cells, (i, j, row), count, buffer, legs, receiving_array.point, reception, directions
                )
