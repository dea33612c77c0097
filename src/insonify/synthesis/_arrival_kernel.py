"""Echoes of a block of scatterers, laid down by all pairs of legs, for all channels.

The innermost loops of element recordings, and of beams under way. Legs are known at the arrays' centres, one by one;
here they meet. For each pair of them, those scatterers that have an echo are gathered, so that what follows runs over
numbers side by side; then each ear, a place that hears, is asked when they come (`_element_kernel`), and each channel
that hears there lays them down with its own weights. Beams share one ear, the array's centre; elements have one each.
Plain numbers and arrays.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.synthesis._arrival_time_kernel import arrival_moving, arrival_refracted, arrival_stationary
from insonify.synthesis._gridding import _locate
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE
from insonify.synthesis._waveform_basis_kernel import (
    BasisWeights,
    basis_coordinate,
    basis_weight_table,
    basis_weights,
    deposit_waveforms,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.uint8]
BLOCK = 1024
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class TransmitLegs(NamedTuple):
    """Legs from the transmitter's centre to n scatterers, f of them."""

    delay: Floats
    """Of the pulse's middle at the scatterer, for a transmitter under way; of its start for one at rest [s], (f, n)."""
    transmit_doppler: Floats
    """One over one less the part of the speed of sound at which the transmitter follows what it sends [1], (f, n)."""
    weight: NDArray[np.complex64]
    """Pressure at the scatterer by each transmit beam, without carrier [uPa], (beams, f, n)."""


class ReceiveLegs(NamedTuple):
    """Legs from the receiver's centre to the same scatterers, g of them, travelled the other way."""

    delay: Floats
    """[s], (g, n)."""
    vertical_curvature: Floats
    """Curvature of the wavefronts that come back, in the vertical plane [1/m], (g, n)."""
    horizontal_distance: Floats
    """Horizontal distance to where each comes from [m], (g, n)."""
    expansion: Floats
    """What they have beyond spheres, see `propagation.beside`, (g, terms, n); or (g, 0, n)."""
    direction: Floats
    """Direction that each comes from, away from the sonar, (g, n, 3)."""
    weight: NDArray[np.complex64]
    """What is left of the pressure at 1 m from the scatterer, without carrier [1], (g, n)."""
    gain: NDArray[np.float32]
    """Of each ear's pattern, for each leg or each pair of legs [1], (legs or pairs, patterns, n)."""


class ReceiveBeams(NamedTuple):
    """Places that hear, and the channels that hear there."""

    position: Floats
    """From the array's centre, in the world, at the start of the ping [m], (ears, 3)."""
    velocity: Floats
    """At the start of the ping [m/s], (ears, 3)."""
    acceleration: Floats
    """[m/s^2], (ears, 3)."""
    channels: Integers
    """First channel of each, and the one after its last, (ears, 2)."""
    beam: Integers
    """Transmit beam of each channel, (channels,)."""
    pattern: Integers
    """Pattern of each channel, -1 for one that is deaf, (channels,)."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _turn(arrival_time: Floats, spreading_ratio: NDArray[Any], weight: NDArray[Any], gain: NDArray[Any],
          frequency: float,
          turned: NDArray[Any]) -> None:  # fmt: skip
    """Weights with the element's gain and the phase of the carrier, real and imaginary in turn."""
    for i in range(arrival_time.size):
        sine, cosine = sincos_cycles(frequency * arrival_time[i])
        size = spreading_ratio[i] * gain[i]
        turned[2 * i] = size * (weight[2 * i] * cosine + weight[2 * i + 1] * sine)
        turned[2 * i + 1] = size * (weight[2 * i + 1] * cosine - weight[2 * i] * sine)


@njit(cache=True, nogil=True, error_model="numpy")
def nonzero_legs(transmit_legs: TransmitLegs, receive_legs: ReceiveLegs) -> tuple[Flags, Flags, Flags]:
    """Whether legs out bring anything in any beam, (f, n), legs back, (g, n); whether a pattern hears, (rows, n)."""
    beams, legs, n = transmit_legs.weight.shape
    out, ear = np.zeros((legs, n), np.uint8), np.zeros((receive_legs.gain.shape[0], n), np.uint8)
    back = np.zeros(receive_legs.weight.shape, np.uint8)
    for beam in range(beams):
        for i in range(legs):
            for k in range(n):
                out[i, k] |= transmit_legs.weight[beam, i, k] != 0
    for j in range(receive_legs.weight.shape[0]):
        for k in range(n):
            back[j, k] = receive_legs.weight[j, k] != 0
    for row in range(receive_legs.gain.shape[0]):
        for pattern in range(receive_legs.gain.shape[1]):
            for k in range(n):
                ear[row, k] |= receive_legs.gain[row, pattern, k] != 0
    return out, back, ear


@njit(cache=True, nogil=True, error_model="numpy")
def scatterers_with_echo(
    part_start: int, strength: NDArray[Any], legs_out: Flags, legs_back: Flags, ear: Flags, indices: NDArray[np.int32]
) -> int:
    """How many scatterers of a part have an echo by one pair of legs, and which.

    Args:
        part_start: Number of the first of the part.
        strength: What each makes of the pair, (part,).
        legs_out: Of `nonzero_legs`, of the leg out, (part,).
        legs_back: Likewise, of the leg back.
        ear: Likewise, of those that hear.
        indices: Result; one longer than the part.
    """
    count = 0
    for k in range(strength.size):  # without a branch, which would be foreseen too seldom
        indices[np.uintp(count)] = part_start + k
        count += legs_out[k] & legs_back[k] & ear[k] & np.uint8(strength[k] != 0)
    return count


class ArrivalBuffer(NamedTuple):
    """Room for the echoes of some scatterers, up to `BLOCK`, by one pair of legs."""

    scatterer: NDArray[np.int32]
    """Which scatterers have one; one more."""
    strength: NDArray[np.complex64]
    """What these make of the pair."""
    column: tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]
    """What `arrival_moving` and `arrival_refracted` ask for: delay, bend, distance, following, direction, radius; what they
    tell: time, Doppler factor."""
    expansion: Floats
    first_cell: NDArray[np.int32]
    """First cells."""
    single: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
    """Place between cells, gain, spreading, place among shapes."""
    source_weight: NDArray[np.float32]
    """Weights before they are turned, real and imaginary in turn."""
    carrier_weight: NDArray[np.float32]
    basis: BasisWeights
    basis_weights: NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def arrival_buffer(terms: int, groups: int, doppler_node_count: Floats) -> ArrivalBuffer:
    """Room for echoes with some terms beyond spheres, on the grids of some groups of shapes."""
    column = np.empty((10, BLOCK))
    single = np.zeros((4, BLOCK), np.float32)
    return ArrivalBuffer(
        np.empty(BLOCK + 1, np.int32), np.empty(BLOCK, np.complex64),
        (column[0], column[1], column[2], column[3], column[4], column[5], column[6], column[7], column[8], column[9]),
        np.empty((terms, BLOCK)), np.empty(BLOCK, np.int32), (single[0], single[1], single[2], single[3]),
        np.empty(2 * BLOCK, np.float32), np.empty(2 * BLOCK, np.float32), basis_weight_table(doppler_node_count),
        np.zeros((4 * groups, BLOCK if groups > 1 else 1), np.float32),
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_pair(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, i: int, j: int, gain_row: int, count: int,
    buffer: ArrivalBuffer, transmit_legs: TransmitLegs, receive_legs: ReceiveLegs, receive_beams: ReceiveBeams,
    slowness: float, sound_speed_gradient: float, attenuation: float, is_refracted: bool,
    pulse_middle: float, frequency: float, doppler_node_count: Floats,
) -> None:  # fmt: skip
    """Echoes of some scatterers by one pair of legs, for all channels, added to their cells.

    Args:
        cells: Grids of pressure, shape (channels, groups, cells, shapes of a group): see `group_layout`.
        first_time: Time of the first cell [s].
        cell_rate: Cells per second [Hz].
        i: Row of the leg out.
        j: Row of the leg back.
        gain_row: Row of the gain.
        count: How many scatterers have an echo.
        buffer: Which these are, and what they make of the pair.
        transmit_legs: The legs out.
        receive_legs: The legs back.
        receive_beams: Who hears.
        slowness: Of sound at the array [s/m].
        sound_speed_gradient: Growth of the speed of sound with depth at the array [1/s].
        attenuation: Part of the pressure that the water takes on a metre [1/m].
        is_refracted: Whether rays bend.
        pulse_middle: Time from the pulse's start to its middle; 0 for an array that stands [s].
        frequency: Of the carrier [Hz].
        doppler_node_count: Doppler factor less one of each shape [1], (shapes,).
    """
    last, still, which, shaped = cells.shape[2] - CELLS_PER_SPIKE, pulse_middle == 0.0, buffer.scatterer, buffer.basis
    tau, curve, away, behind, u, v, w, r, when, doppler = buffer.column
    inside, tuned, fade, x = buffer.single
    beside, at, source, turned, share = (
        buffer.expansion,
        buffer.first_cell,
        buffer.source_weight,
        buffer.carrier_weight,
        buffer.basis_weights,
    )
    late, later, bend, following = (
        transmit_legs.delay[i],
        receive_legs.delay[j],
        receive_legs.vertical_curvature[j],
        transmit_legs.transmit_doppler[i],
    )
    towards = receive_legs.direction[j]
    for k in range(count):
        n = np.uintp(which[k])
        tau[k] = late[n] + later[n]
        curve[k], behind[k] = bend[n], following[n]
        u[k], v[k], w[k] = towards[n, 0], towards[n, 1], towards[n, 2]
    for k in range(count):
        r[k] = 1 / curve[k]
    if is_refracted:
        for k in range(count):
            away[k] = receive_legs.horizontal_distance[j, np.uintp(which[k])]
        for t in range(beside.shape[0]):
            for k in range(count):
                beside[t, k] = receive_legs.expansion[j, t, np.uintp(which[k])]
    beam, pattern = -1, -1
    for e in range(receive_beams.position.shape[0]):
        place, velocity, acceleration = (
            receive_beams.position[e],
            receive_beams.velocity[e],
            receive_beams.acceleration[e],
        )
        if is_refracted:
            arrival_refracted(tau[:count], curve, away, u, v, w, behind, beside, place, velocity, acceleration,
                        slowness, sound_speed_gradient, attenuation, pulse_middle, when, fade, doppler)  # fmt: skip
        elif still:
            arrival_stationary(tau[:count], r, u, v, w, place, slowness, attenuation, when, fade)
        else:
            arrival_moving(tau[:count], r, u, v, w, behind, place, velocity, acceleration, slowness, attenuation,
                          pulse_middle, when, fade, doppler)  # fmt: skip
        _locate(when[:count], first_time, cell_rate, last, at, inside)
        if doppler_node_count.size > 1:
            basis_coordinate(doppler[:count], shaped, x)
        if cells.shape[1] > 1:
            basis_weights(x[:count], shaped.node_coordinate, shaped.node_scale, share)
        for c in range(receive_beams.channels[e, 0], receive_beams.channels[e, 1]):
            if receive_beams.pattern[c] < 0:
                continue
            if receive_beams.beam[c] != beam:
                beam = receive_beams.beam[c]
                _fill_weights(
                    transmit_legs.weight[beam, i], receive_legs.weight[j], buffer.strength, which, count, source
                )
            if receive_beams.pattern[c] != pattern:
                pattern = receive_beams.pattern[c]
                gain = receive_legs.gain[gain_row, pattern]
                for k in range(count):
                    tuned[k] = gain[np.uintp(which[k])]
            _turn(when[:count], fade, source, tuned, frequency, turned)
            deposit_waveforms(cells, c, 1, 1, at, inside, turned, x, shaped, share, count)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _fill_weights(
    transmit_legs: NDArray[np.complex64], receive_legs: NDArray[np.complex64], answer: NDArray[np.complex64],
    indices: NDArray[np.int32],
    count: int, source_weight: NDArray[np.float32],
) -> None:  # fmt: skip
    """Products of what legs bring, what scatterers make of it and what legs leave of that, as two numbers in turn."""
    for k in range(count):
        n = np.uintp(indices[k])
        one, other = transmit_legs[n], receive_legs[n]
        real, imaginary = one.real * other.real - one.imag * other.imag, one.real * other.imag + one.imag * other.real
        source_weight[2 * k] = real * answer[k].real - imaginary * answer[k].imag
        source_weight[2 * k + 1] = real * answer[k].imag + imaginary * answer[k].real
