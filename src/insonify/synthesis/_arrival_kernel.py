"""Kernels that deposit the echoes of a block of scatterers by all pairs of legs, for all channels.

The innermost loops of element recordings, and of moving beams. Legs are given at the arrays' centres, one by one;
here they are combined. For each pair of legs, the scatterers with an echo are gathered into contiguous arrays; then
their times of arrival are evaluated at each receive point (`_arrival_time_kernel`), and each channel
at that point deposits them with its own weights. Beams share one point, the array's centre; elements have one each.
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
    """Delay to the scatterer, of the pulse's middle for a moving transmitter, of its start otherwise [s], (f, n)."""
    transmit_doppler: Floats
    """1 / (1 - radial Mach number of the transmitter towards the departing sound) [1], (f, n)."""
    weight: NDArray[np.complex64]
    """Pressure at the scatterer by each transmit beam, without carrier [uPa], (beams, f, n)."""


class ReceiveLegs(NamedTuple):
    """Legs from the receiver's centre to the same scatterers, g of them, described away from the sonar."""

    delay: Floats
    """One-way delay [s], (g, n)."""
    vertical_curvature: Floats
    """Curvature of the received wavefronts in the vertical plane [1/m], (g, n)."""
    horizontal_distance: Floats
    """Horizontal distance of the scatterers [m], (g, n)."""
    expansion: Floats
    """Deviation from spherical wavefronts, see `propagation.aperture_expansion`, (g, terms, n); or (g, 0, n)."""
    direction: Floats
    """Direction of arrival, away from the sonar, (g, n, 3)."""
    weight: NDArray[np.complex64]
    """Pressure re that at 1 m from the scatterer, without carrier [1], (g, n)."""
    gain: NDArray[np.float32]
    """Gain of each receive pattern, for each leg or each pair of legs [1], (legs or pairs, patterns, n)."""


class ReceiveBeams(NamedTuple):
    """Receive points, and the channels of each."""

    position: Floats
    """Position from the array's centre, in the world, at the start of the ping [m], (points, 3)."""
    velocity: Floats
    """Velocity at the start of the ping [m/s], (points, 3)."""
    acceleration: Floats
    """Acceleration [m/s^2], (points, 3)."""
    channels: Integers
    """First channel of each point, and one past its last, (points, 2)."""
    beam: Integers
    """Transmit beam of each channel, (channels,)."""
    pattern: Integers
    """Pattern of each channel, -1 for a dead one, (channels,)."""


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _apply_carrier(arrival_time: Floats, spreading_ratio: NDArray[Any], weight: NDArray[Any], gain: NDArray[Any],
          frequency: float,
          turned: NDArray[Any]) -> None:  # fmt: skip
    """Apply the element's gain and the carrier's phase to weights, real and imaginary parts alternating."""
    for i in range(arrival_time.size):
        sine, cosine = sincos_cycles(frequency * arrival_time[i])
        size = spreading_ratio[i] * gain[i]
        turned[2 * i] = size * (weight[2 * i] * cosine + weight[2 * i + 1] * sine)
        turned[2 * i + 1] = size * (weight[2 * i + 1] * cosine - weight[2 * i] * sine)


@njit(cache=True, nogil=True, error_model="numpy")
def nonzero_legs(transmit_legs: TransmitLegs, receive_legs: ReceiveLegs) -> tuple[Flags, Flags, Flags]:
    """Masks of transmit legs with pressure, (f, n), of receive legs, (g, n), and of gains, (rows, n)."""
    beams, legs, n = transmit_legs.weight.shape
    transmit_flags, has_gain = np.zeros((legs, n), np.uint8), np.zeros((receive_legs.gain.shape[0], n), np.uint8)
    receive_flags = np.zeros(receive_legs.weight.shape, np.uint8)
    for beam in range(beams):
        for i in range(legs):
            for k in range(n):
                transmit_flags[i, k] |= transmit_legs.weight[beam, i, k] != 0
    for j in range(receive_legs.weight.shape[0]):
        for k in range(n):
            receive_flags[j, k] = receive_legs.weight[j, k] != 0
    for row in range(receive_legs.gain.shape[0]):
        for pattern in range(receive_legs.gain.shape[1]):
            for k in range(n):
                has_gain[row, k] |= receive_legs.gain[row, pattern, k] != 0
    return transmit_flags, receive_flags, has_gain


@njit(cache=True, nogil=True, error_model="numpy")
def scatterers_with_echo(
    part_start: int, strength: NDArray[Any], legs_out: Flags, legs_back: Flags, has_gain: Flags,
    indices: NDArray[np.int32],
) -> int:  # fmt: skip
    """Select the scatterers of a part that have an echo by one pair of legs; return their number.

    Args:
        part_start: Index of the first scatterer of the part.
        strength: Strength of each for the pair, (part,).
        legs_out: Mask of the transmit leg from `nonzero_legs`, (part,).
        legs_back: Mask of the receive leg from `nonzero_legs`, (part,).
        has_gain: Mask of the gain from `nonzero_legs`, (part,).
        indices: Result: indices of the selected scatterers; one longer than the part.
    """
    count = 0
    for k in range(strength.size):  # branch-free: the branch would be mispredicted too often
        indices[np.uintp(count)] = part_start + k
        count += legs_out[k] & legs_back[k] & has_gain[k] & np.uint8(strength[k] != 0)
    return count


class ArrivalBuffer(NamedTuple):
    """Work arrays for the echoes of up to `BLOCK` scatterers by one pair of legs."""

    scatterer: NDArray[np.int32]
    """Indices of the scatterers with an echo; one longer."""
    strength: NDArray[np.complex64]
    """Their strengths for the pair."""
    column: tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]
    """Columns of the arrival times: delay, curvature, distance, emission rate, direction, radius;
    results: time, Doppler factor.
    """
    expansion: Floats
    first_cell: NDArray[np.int32]
    """First grid cell of each echo."""
    single: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
    """Position between cells, gain, spreading ratio, coordinate in the waveform basis."""
    source_weight: NDArray[np.float32]
    """Weights without carrier, real and imaginary parts alternating."""
    carrier_weight: NDArray[np.float32]
    basis: BasisWeights
    basis_weights: NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def arrival_buffer(terms: int, groups: int, doppler_nodes: Floats) -> ArrivalBuffer:
    """Work arrays for echoes with `terms` expansion terms, on the grids of `groups` groups of waveforms."""
    column = np.empty((10, BLOCK))
    single = np.zeros((4, BLOCK), np.float32)
    return ArrivalBuffer(
        np.empty(BLOCK + 1, np.int32), np.empty(BLOCK, np.complex64),
        (column[0], column[1], column[2], column[3], column[4], column[5], column[6], column[7], column[8], column[9]),
        np.empty((terms, BLOCK)), np.empty(BLOCK, np.int32), (single[0], single[1], single[2], single[3]),
        np.empty(2 * BLOCK, np.float32), np.empty(2 * BLOCK, np.float32), basis_weight_table(doppler_nodes),
        np.zeros((4 * groups, BLOCK if groups > 1 else 1), np.float32),
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def deposit_pair(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, i: int, j: int, gain_row: int, count: int,
    buffer: ArrivalBuffer, transmit_legs: TransmitLegs, receive_legs: ReceiveLegs, receive_beams: ReceiveBeams,
    slowness: float, sound_speed_gradient: float, attenuation: float, is_refracted: bool,
    pulse_middle: float, frequency: float, doppler_nodes: Floats,
) -> None:  # fmt: skip
    """Deposit the echoes of some scatterers by one pair of legs on the cells of all channels.

    Args:
        cells: Grids of pressure, shape (channels, groups, cells, waveforms of a group): see `group_layout`.
        first_time: Time of the first cell [s].
        cell_rate: Cells per second [Hz].
        i: Row of the transmit leg.
        j: Row of the receive leg.
        gain_row: Row of the gain.
        count: Number of scatterers with an echo.
        buffer: Their indices and strengths, and work arrays.
        transmit_legs: Transmit legs.
        receive_legs: Receive legs.
        receive_beams: Receive points and their channels.
        slowness: Slowness of sound at the array [s/m].
        sound_speed_gradient: Growth of the speed of sound with depth at the array [1/s].
        attenuation: Absorption [Np/m].
        is_refracted: True in layered water.
        pulse_middle: Time from the pulse's start to its middle; 0 for an array at rest [s].
        frequency: Carrier frequency [Hz].
        doppler_nodes: Doppler factor less one of each waveform [1], (waveforms,).
    """
    last, is_stationary, scatterer, basis = (
        cells.shape[2] - CELLS_PER_SPIKE,
        pulse_middle == 0.0,
        buffer.scatterer,
        buffer.basis,
    )
    tau, curvature, distance, doppler_out, u, v, w, r, arrival_time, doppler = buffer.column
    fraction, pattern_gain, spreading_ratio, x = buffer.single
    expansion, first_cell, source_weight, turned, node_weights = (
        buffer.expansion,
        buffer.first_cell,
        buffer.source_weight,
        buffer.carrier_weight,
        buffer.basis_weights,
    )
    transmit_delay, receive_delay, vertical_curvature, transmit_doppler = (
        transmit_legs.delay[i],
        receive_legs.delay[j],
        receive_legs.vertical_curvature[j],
        transmit_legs.transmit_doppler[i],
    )
    direction = receive_legs.direction[j]
    for k in range(count):
        n = np.uintp(scatterer[k])
        tau[k] = transmit_delay[n] + receive_delay[n]
        curvature[k], doppler_out[k] = vertical_curvature[n], transmit_doppler[n]
        u[k], v[k], w[k] = direction[n, 0], direction[n, 1], direction[n, 2]
    for k in range(count):
        r[k] = 1 / curvature[k]
    if is_refracted:
        for k in range(count):
            distance[k] = receive_legs.horizontal_distance[j, np.uintp(scatterer[k])]
        for t in range(expansion.shape[0]):
            for k in range(count):
                expansion[t, k] = receive_legs.expansion[j, t, np.uintp(scatterer[k])]
    beam, pattern = -1, -1
    for e in range(receive_beams.position.shape[0]):
        position, velocity, acceleration = (
            receive_beams.position[e],
            receive_beams.velocity[e],
            receive_beams.acceleration[e],
        )
        if is_refracted:
            arrival_refracted(tau[:count], curvature, distance, u, v, w, doppler_out, expansion, position, velocity,
                        acceleration, slowness, sound_speed_gradient, attenuation, pulse_middle, arrival_time,
                        spreading_ratio, doppler)  # fmt: skip
        elif is_stationary:
            arrival_stationary(tau[:count], r, u, v, w, position, slowness, attenuation, arrival_time, spreading_ratio)
        else:
            arrival_moving(tau[:count], r, u, v, w, doppler_out, position, velocity, acceleration, slowness,
                          attenuation, pulse_middle, arrival_time, spreading_ratio, doppler)  # fmt: skip
        _locate(arrival_time[:count], first_time, cell_rate, last, first_cell, fraction)
        if doppler_nodes.size > 1:
            basis_coordinate(doppler[:count], basis, x)
        if cells.shape[1] > 1:
            basis_weights(x[:count], basis.node_coordinate, basis.node_scale, node_weights)
        for c in range(receive_beams.channels[e, 0], receive_beams.channels[e, 1]):
            if receive_beams.pattern[c] < 0:
                continue
            if receive_beams.beam[c] != beam:
                beam = receive_beams.beam[c]
                _fill_weights(
                    transmit_legs.weight[beam, i], receive_legs.weight[j], buffer.strength, scatterer, count,
                    source_weight,
                )  # fmt: skip
            if receive_beams.pattern[c] != pattern:
                pattern = receive_beams.pattern[c]
                gain = receive_legs.gain[gain_row, pattern]
                for k in range(count):
                    pattern_gain[k] = gain[np.uintp(scatterer[k])]
            _apply_carrier(arrival_time[:count], spreading_ratio, source_weight, pattern_gain, frequency, turned)
            deposit_waveforms(cells, c, 1, 1, first_cell, fraction, turned, x, basis, node_weights, count)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _fill_weights(
    transmit_legs: NDArray[np.complex64], receive_legs: NDArray[np.complex64], strength: NDArray[np.complex64],
    indices: NDArray[np.int32],
    count: int, source_weight: NDArray[np.float32],
) -> None:  # fmt: skip
    """Products of transmit pressure, strength and receive pressure ratio, real and imaginary parts alternating."""
    for k in range(count):
        n = np.uintp(indices[k])
        transmit_weight, receive_weight = transmit_legs[n], receive_legs[n]
        real, imaginary = (
            transmit_weight.real * receive_weight.real - transmit_weight.imag * receive_weight.imag,
            transmit_weight.real * receive_weight.imag + transmit_weight.imag * receive_weight.real,
        )
        source_weight[2 * k] = real * strength[k].real - imaginary * strength[k].imag
        source_weight[2 * k + 1] = real * strength[k].imag + imaginary * strength[k].real
