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
from insonify.synthesis._arrival_time_kernel import ArrayWater, ArrivalColumns, ElementMotion, arrival_times
from insonify.synthesis._gridding import _locate
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE
from insonify.synthesis._waveform_basis_kernel import (
    BasisWeights,
    basis_coordinate,
    basis_weights,
    deposit_waveforms,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.uint8]
BLOCK = 1024
"""Largest number of scatterers whose echoes by one pair of legs are processed together."""
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class TransmitLegs(NamedTuple):
    """Legs from the transmitter's centre to n scatterers, f of them."""

    delay: Floats
    """Time at which the pulse's middle (transmitter at rest: its start) reaches the scatterer [s], (f, n)."""
    transmit_doppler: Floats
    """1 / (1 - radial Mach number of the transmitter towards the departing sound) [1], (f, n)."""
    weight: NDArray[np.complex64]
    """Pressure at the scatterer by each transmit beam, without carrier [uPa], (beams, f, n)."""


class ReceiveLegs(NamedTuple):
    """Legs from the receiver's centre to the same scatterers, g of them."""

    delay: Floats
    """One-way delay [s], (g, n)."""
    vertical_curvature: Floats
    """Curvature of the received wavefronts in the vertical plane [1/m], (g, n)."""
    horizontal_distance: Floats
    """Horizontal distance of the scatterers [m], (g, n)."""
    expansion: Floats
    """Deviation from spherical wavefronts, see `propagation.aperture_expansion`, (g, terms, n); or (g, 0, n)."""
    direction: Floats
    """Unit vector from the receiver towards the arriving sound, in the world [1], (g, n, 3)."""
    weight: NDArray[np.complex64]
    """Pressure re that at 1 m from the scatterer, without carrier [1], (g, n)."""
    gain: NDArray[np.float32]
    """Amplitude of each receive pattern, for each leg or each pair of legs [1], (legs or pairs, patterns, n)."""


class BlockLegs(NamedTuple):
    """Legs of both ends to the same scatterers."""

    transmit: TransmitLegs
    receive: ReceiveLegs


class Reception(NamedTuple):
    """Time grid, carrier and water with which echoes are deposited."""

    first_time: float
    """Time of the first cell [s]."""
    cell_rate: float
    """Cells per second [Hz]."""
    frequency: float
    """Carrier frequency [Hz]."""
    basis: BasisWeights
    """Weights of echoes in the waveforms."""
    water: ArrayWater
    """Water at the array."""


class ReceiveBeams(NamedTuple):
    """Receive points, and the channels received at each."""

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
    """Row of the receive pattern of each channel, -1 for a dead one, (channels,)."""


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _apply_carrier(count: int, frequency: float, buffer: "ArrivalBuffer") -> None:
    """Multiply weights by receive pattern, spreading ratio and exp(-j 2 pi frequency time), into `carrier_weight`."""
    arrival_time, weight, with_carrier = buffer.arrival_time, buffer.source_weight, buffer.carrier_weight
    _, gain, spreading_ratio, _ = buffer.single
    for i in range(count):
        sine, cosine = sincos_cycles(frequency * arrival_time[i])
        scale = spreading_ratio[i] * gain[i]
        with_carrier[2 * i] = scale * (weight[2 * i] * cosine + weight[2 * i + 1] * sine)
        with_carrier[2 * i + 1] = scale * (weight[2 * i + 1] * cosine - weight[2 * i] * sine)


@njit(cache=True, nogil=True, error_model="numpy")
def nonzero_legs(transmit_legs: TransmitLegs, receive_legs: ReceiveLegs) -> tuple[Flags, Flags, Flags]:
    """Masks, 0 or 1: of transmit legs with pressure, (f, n); of receive legs, (g, n); of rows of `gain`, (rows, n)."""
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
    part_start: int, strength: NDArray[Any], transmit_mask: Flags, receive_mask: Flags, gain_mask: Flags,
    indices: NDArray[np.int32],
) -> int:  # fmt: skip
    """Select the scatterers of a part that have an echo by one pair of legs; return their number.

    Args:
        part_start: Index of the first scatterer of the part.
        strength: Strength of each scatterer for the pair [m], (part,).
        transmit_mask: Mask of the transmit leg from `nonzero_legs`, (part,).
        receive_mask: Mask of the receive leg from `nonzero_legs`, (part,).
        gain_mask: Mask of the gain from `nonzero_legs`, (part,).
        indices: Result: indices of the selected scatterers, (part + 1,).
    """
    count = 0
    for k in range(strength.size):  # branch-free: the branch would be mispredicted too often
        indices[np.uintp(count)] = part_start + k
        count += transmit_mask[k] & receive_mask[k] & gain_mask[k] & np.uint8(strength[k] != 0)
    return count


class ArrivalBuffer(NamedTuple):
    """Work arrays for the echoes of up to `BLOCK` scatterers by one pair of legs."""

    scatterer: NDArray[np.int32]
    """Indices of the scatterers with an echo, (BLOCK + 1,)."""
    strength: NDArray[np.complex64]
    """Strengths of these scatterers for the pair [m]."""
    echoes: ArrivalColumns
    """The echoes at the array's centre."""
    arrival_time: Floats
    """Time of arrival at one receive point [s]."""
    doppler: Floats
    """Doppler factor less one there [1]."""
    first_cell: NDArray[np.int32]
    """First grid cell of each echo."""
    single: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
    """Position between cells, amplitude of receive pattern, spreading ratio, coordinate in the waveform basis [1]."""
    source_weight: NDArray[np.float32]
    """Weights without carrier [uPa], real and imaginary parts alternating."""
    carrier_weight: NDArray[np.float32]
    """Weights with carrier, receive pattern and spreading ratio [uPa], real and imaginary parts alternating."""
    basis_weights: NDArray[np.float32]
    """Weight of each waveform in each echo [1], (waveforms, BLOCK) where there are several groups of waveforms."""


@njit(cache=True, nogil=True, error_model="numpy")
def arrival_buffer(terms: int, groups: int) -> ArrivalBuffer:
    """Work arrays for echoes with `terms` expansion terms, on the grids of `groups` groups of waveforms."""
    column = np.empty((10, BLOCK))
    single = np.zeros((4, BLOCK), np.float32)
    echoes = ArrivalColumns(
        column[0], column[1], column[2], column[3], column[4], column[5], column[6], column[7], np.empty((terms, BLOCK))
    )
    return ArrivalBuffer(
        np.empty(BLOCK + 1, np.int32), np.empty(BLOCK, np.complex64), echoes, column[8], column[9],
        np.empty(BLOCK, np.int32), (single[0], single[1], single[2], single[3]),
        np.empty(2 * BLOCK, np.float32), np.empty(2 * BLOCK, np.float32),
        np.zeros((4 * groups, BLOCK if groups > 1 else 1), np.float32),
    )  # fmt: skip


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _gather_echoes(i: int, j: int, count: int, buffer: ArrivalBuffer, legs: BlockLegs, is_layered: bool) -> None:
    """Gather the columns of some echoes by one pair of legs at the array's centre into a buffer."""
    tau, curvature, r, distance, u, v, w, echo_doppler, expansion = buffer.echoes
    scatterer, transmit_legs, receive_legs = buffer.scatterer, legs.transmit, legs.receive
    transmit_delay, transmit_doppler = transmit_legs.delay[i], transmit_legs.transmit_doppler[i]
    receive_delay, vertical_curvature = receive_legs.delay[j], receive_legs.vertical_curvature[j]
    direction = receive_legs.direction[j]
    for k in range(count):
        n = np.uintp(scatterer[k])
        tau[k] = transmit_delay[n] + receive_delay[n]
        curvature[k], echo_doppler[k] = vertical_curvature[n], transmit_doppler[n]
        u[k], v[k], w[k] = direction[n, 0], direction[n, 1], direction[n, 2]
    for k in range(count):
        r[k] = 1 / curvature[k]
    if is_layered:
        for k in range(count):
            distance[k] = receive_legs.horizontal_distance[j, np.uintp(scatterer[k])]
        for t in range(expansion.shape[0]):
            for k in range(count):
                expansion[t, k] = receive_legs.expansion[j, t, np.uintp(scatterer[k])]


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def locate_arrivals(
    e: int, count: int, last: int, buffer: ArrivalBuffer, receive_beams: ReceiveBeams, reception: Reception
) -> None:
    """Fill times of arrival of gathered echoes at receive point e, their cells and coordinates in the basis."""
    element = ElementMotion(receive_beams.position[e], receive_beams.velocity[e], receive_beams.acceleration[e])
    fraction, _, spreading_ratio, x = buffer.single
    arrival_time, doppler = buffer.arrival_time, buffer.doppler
    arrival_times(buffer.echoes, count, element, reception.water, arrival_time, spreading_ratio, doppler)
    _locate(arrival_time[:count], reception.first_time, reception.cell_rate, last, buffer.first_cell, fraction)
    if reception.basis.node_coordinate.size > 1:
        basis_coordinate(doppler[:count], reception.basis, x)


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def deposit_pair(
    cells: NDArray[np.complex64], rows: tuple[int, int, int], count: int, buffer: ArrivalBuffer, legs: BlockLegs,
    receive_beams: ReceiveBeams, reception: Reception,
) -> None:  # fmt: skip
    """Deposit the echoes of some scatterers by one pair of legs on the cells of all channels.

    Args:
        cells: Grids of pressure, shape (channels, groups, cells, waveforms of a group): see `group_layout`.
        rows: Rows of the transmit leg, the receive leg and the gain.
        count: Number of scatterers with an echo.
        buffer: Their indices and strengths, and work arrays.
        legs: Legs of both ends.
        receive_beams: Receive points and their channels.
        reception: Time grid, carrier and water.
    """
    i, j, gain_row = rows
    last, scatterer, basis = cells.shape[2] - CELLS_PER_SPIKE, buffer.scatterer, reception.basis
    fraction, pattern_gain, _, x = buffer.single
    first_cell, with_carrier, node_weights = buffer.first_cell, buffer.carrier_weight, buffer.basis_weights
    _gather_echoes(i, j, count, buffer, legs, reception.water.is_layered)
    beam, pattern = -1, -1
    for e in range(receive_beams.position.shape[0]):
        locate_arrivals(e, count, last, buffer, receive_beams, reception)
        if cells.shape[1] > 1:
            basis_weights(x[:count], basis.node_coordinate, basis.node_scale, node_weights)
        for c in range(receive_beams.channels[e, 0], receive_beams.channels[e, 1]):
            if receive_beams.pattern[c] < 0:
                continue
            if receive_beams.beam[c] != beam:
                beam = receive_beams.beam[c]
                _fill_weights(legs.transmit.weight[beam, i], legs.receive.weight[j], count, buffer)
            if receive_beams.pattern[c] != pattern:
                pattern = receive_beams.pattern[c]
                gain = legs.receive.gain[gain_row, pattern]
                for k in range(count):
                    pattern_gain[k] = gain[np.uintp(scatterer[k])]
            _apply_carrier(count, reception.frequency, buffer)
            deposit_waveforms(cells, c, 1, 1, first_cell, fraction, with_carrier, x, basis, node_weights, count)


@njit(cache=True, nogil=True, reference_counts=False, fastmath=_FAST, error_model="numpy")
def _fill_weights(
    transmit_legs: NDArray[np.complex64], receive_legs: NDArray[np.complex64], count: int, buffer: ArrivalBuffer
) -> None:
    """Fill products of transmit pressure, strength and receive pressure ratio, real and imaginary parts alternating."""
    strength, indices, source_weight = buffer.strength, buffer.scatterer, buffer.source_weight
    for k in range(count):
        n = np.uintp(indices[k])
        transmit_weight, receive_weight = transmit_legs[n], receive_legs[n]
        real = transmit_weight.real * receive_weight.real - transmit_weight.imag * receive_weight.imag
        imaginary = transmit_weight.real * receive_weight.imag + transmit_weight.imag * receive_weight.real
        source_weight[2 * k] = real * strength[k].real - imaginary * strength[k].imag
        source_weight[2 * k + 1] = real * strength[k].imag + imaginary * strength[k].real
