"""Energies of the fast reverberation: every pair of legs of every sample point, and the interference of close pairs."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.sonar.beam_kernels import BeamTables, element_gain
from insonify.sonar.pattern_products import multiply_by_pattern
from insonify.synthesis._gridding import deposit_energy

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

BLOCK = 512
"""Energies that are computed before they are deposited: few enough for the first-level cache."""


class MovingArray(NamedTuple):
    """Orientation and displacement of an array by delay."""

    axes: Floats
    """Axes of `Beams` [1]; where the array rotates, also their coefficients of first [1/s] and second order [1/s^2] in
    the one-way delay, (1 or 3, 3, 3)."""
    displacement: Floats
    """Displacement of the array until reception re the one-way path length [1], and its growth per second of one-way
    delay [1/s]: north, east, down, (2, 3)."""
    is_moving: bool
    """True if the array moves or rotates."""
    is_rotating: bool
    """True if it rotates."""


class WeightedSamples(NamedTuple):
    """Reverberation samples, n of them, with the beams of one channel."""

    delay: Floats
    """One-way delay of each leg [s], (f, n)."""
    transmit_weights: NDArray[np.float32]
    """Amplitude of each leg times that of the transmit beam towards it [1], (f, n)."""
    receive_weights: NDArray[np.float32]
    """Amplitude of each leg times that of the receive beam towards it [1], (f, n)."""
    pair: NDArray[np.int64]
    """Rows of two legs, the first not above the second, (p, 2)."""
    point_count: NDArray[np.int64]
    """Number of points of each pair, (p,)."""
    rows: NDArray[np.int32]
    """Indices of these points, (p, any)."""
    cross_section: NDArray[Any]
    """Cross section times area [m^2], (p, any)."""
    source_pressure: float
    """Pressure of the source at 1 m [uPa]."""
    interference_factor: float
    """Mean product of two replicas re that without jitter [1]."""
    independent_energy: float
    """Part of the energy of each replica that does not interfere, re that without jitter [1]."""


class DelayCells(NamedTuple):
    """Cells by delay, to which kernels add in place."""

    cells: NDArray[Any]
    """Energies [uPa^2], float64, (cells,); or moments of positions, float32, (any, MOMENTS) or (p, any, MOMENTS)."""
    first_time: float
    """Two-way delay of the first cell [s]."""
    rate: float
    """Cells per second [Hz]."""


@njit(cache=True, nogil=True, inline="always", error_model="numpy", fastmath={"contract"})
def _rotated_component(axes: Floats, row: int, t: float, x: float, y: float, z: float) -> float:
    """Component of a direction (x, y, z) along row `row` of the rotating axes at one-way delay t [s] [1]."""
    north = axes[0, row, 0] + t * (axes[1, row, 0] + t * axes[2, row, 0])
    east = axes[0, row, 1] + t * (axes[1, row, 1] + t * axes[2, row, 1])
    down = axes[0, row, 2] + t * (axes[1, row, 2] + t * axes[2, row, 2])
    return x * north + y * east + z * down


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def leg_amplitudes(
    departure: NDArray[np.float32], amplitude: NDArray[np.complex64], delay: Floats, beams: BeamTables,
    array: MovingArray, out: NDArray[np.float32],
) -> None:  # fmt: skip
    """Magnitude of all legs times the amplitude of one beam, as in `insonify.sonar.beam_kernels.beam_gains`.

    Args:
        departure: Unit vectors in the world [1], (f, 3, n).
        amplitude: Amplitude of the legs, 0 for no path [1], (f, n).
        delay: One-way delay of the legs [s], (f, n).
        beams: One beam.
        array: Orientation and displacement of the array; its axes are used instead of the beam's own.
        out: Result: signed amplitude [1], (f, n).
    """
    _, steer, scale, tables, per_unit, element = beams
    across, down, piston_across, piston_down = tables
    work, first = np.empty((5, BLOCK)), np.empty(BLOCK, np.uint32)
    forward, right, below, gain, fraction = work[0], work[1], work[2], work[3], work[4]  # contiguous, unlike unpacked
    for f in range(departure.shape[0]):
        for begin in range(0, departure.shape[2], BLOCK):
            m = min(BLOCK, departure.shape[2] - begin)
            leg, leg_gain = amplitude[f, begin : begin + m], out[f, begin : begin + m]
            north, east = departure[f, 0, begin : begin + m], departure[f, 1, begin : begin + m]
            depth = departure[f, 2, begin : begin + m]
            _turn_to_array(array, delay[f, begin : begin + m], north, east, depth, forward, right, below)
            for k in range(m):
                magnitude = math.sqrt(leg[k].real * leg[k].real + leg[k].imag * leg[k].imag)
                gain[k] = magnitude * scale[0] * element_gain(element, forward[k])
            multiply_by_pattern(across, per_unit[0], steer[0, 0], right[:m], gain, first, fraction)
            multiply_by_pattern(down, per_unit[1], steer[0, 1], below[:m], gain, first, fraction)
            multiply_by_pattern(piston_across, per_unit[2], 0.0, right[:m], gain, first, fraction)
            multiply_by_pattern(piston_down, per_unit[3], 0.0, below[:m], gain, first, fraction)
            for k in range(m):
                leg_gain[k] = gain[k]


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract"})
def _turn_to_array(
    array: MovingArray, delay: Floats, north: Singles, east: Singles, down: Singles, forward: Floats, right: Floats,
    below: Floats,
) -> None:  # fmt: skip
    """Components of directions along the axes of an array.

    Args:
        array: The array.
        delay: One-way delay at which it receives [s], (m,).
        north: North component of each direction [1], (m,).
        east: East component [1], (m,).
        down: Down component [1], (m,).
        forward: Result: component along the first axis, the boresight [1], (at least m,).
        right: Result: component along the second axis, to the right [1], (at least m,).
        below: Result: component along the third axis, downwards [1], (at least m,).
    """
    axes, displacement, is_moving, is_rotating = array
    for k in range(0 if is_moving else delay.size):
        x, y, z = np.float64(north[k]), np.float64(east[k]), np.float64(down[k])
        forward[k] = x * axes[0, 0, 0] + y * axes[0, 0, 1] + z * axes[0, 0, 2]
        right[k] = x * axes[0, 1, 0] + y * axes[0, 1, 1] + z * axes[0, 1, 2]
        below[k] = x * axes[0, 2, 0] + y * axes[0, 2, 1] + z * axes[0, 2, 2]
    for k in range(delay.size if is_moving and not is_rotating else 0):
        t = delay[k]
        x = np.float64(north[k]) - displacement[0, 0] - t * displacement[1, 0]
        y = np.float64(east[k]) - displacement[0, 1] - t * displacement[1, 1]
        z = np.float64(down[k]) - displacement[0, 2] - t * displacement[1, 2]
        a = x * axes[0, 0, 0] + y * axes[0, 0, 1] + z * axes[0, 0, 2]
        r = x * axes[0, 1, 0] + y * axes[0, 1, 1] + z * axes[0, 1, 2]
        b = x * axes[0, 2, 0] + y * axes[0, 2, 1] + z * axes[0, 2, 2]
        inverse_norm = 1 / math.sqrt(a * a + r * r + b * b)
        forward[k], right[k], below[k] = a * inverse_norm, r * inverse_norm, b * inverse_norm
    for k in range(delay.size if is_rotating else 0):
        t = delay[k]
        x = np.float64(north[k]) - displacement[0, 0] - t * displacement[1, 0]
        y = np.float64(east[k]) - displacement[0, 1] - t * displacement[1, 1]
        z = np.float64(down[k]) - displacement[0, 2] - t * displacement[1, 2]
        a, r = _rotated_component(axes, 0, t, x, y, z), _rotated_component(axes, 1, t, x, y, z)
        b = _rotated_component(axes, 2, t, x, y, z)
        inverse_norm = 1 / math.sqrt(a * a + r * r + b * b)
        forward[k], right[k], below[k] = a * inverse_norm, r * inverse_norm, b * inverse_norm


@njit(cache=True, nogil=True, error_model="numpy")
def fill_pair_energies(
    samples: WeightedSamples, p: int, points: NDArray[np.int32], begin: int, delay: Floats, energy: Floats
) -> None:
    """Fill two-way delays [s] and energies [uPa^2] of some samples of one pair and of its reverse.

    Args:
        samples: The samples.
        p: Row of the pair.
        points: Indices of the points, (m,).
        begin: Position of the first of them among those of the pair.
        delay: Result, (at least m,).
        energy: Result, (at least m,).
    """
    i, j = samples.pair[p, 0], samples.pair[p, 1]
    transmit, receive, leg_delay = samples.transmit_weights, samples.receive_weights, samples.delay
    interfering_factor, independent_energy = samples.interference_factor, samples.independent_energy
    square = samples.source_pressure * samples.source_pressure
    section = samples.cross_section[p, begin : begin + points.size]
    delay_i, delay_j, transmit_i, receive_i = leg_delay[i], leg_delay[j], transmit[i], receive[i]
    transmit_j, receive_j = transmit[j], receive[j]
    for k in range(points.size if i == j else 0):  # half of the reads
        n = np.uint32(points[k])
        forward = np.float64(transmit_i[n]) * receive_i[n]
        delay[k] = delay_i[n] + delay_i[n]
        energy[k] = interfering_factor * forward * forward + independent_energy * (forward * forward)
        energy[k] *= square * section[k]
    for k in range(0 if i == j else points.size):
        n = np.uint32(points[k])
        forward = np.float64(transmit_i[n]) * receive_j[n]
        backward = np.float64(transmit_j[n]) * receive_i[n]
        delay[k] = delay_i[n] + delay_j[n]
        energy[k] = interfering_factor * (forward + backward) * (forward + backward) + independent_energy * (
            forward * forward + backward * backward
        )
        energy[k] *= square * section[k]


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_pair_energies(samples: WeightedSamples, energies: DelayCells) -> None:
    """Deposit the energies of all pairs of legs on one channel; a pair and its reverse arrive together, as one."""
    pair_delay, energy = np.empty(BLOCK), np.empty(BLOCK)
    for p in range(samples.pair.shape[0]):
        for begin in range(0, samples.point_count[p], BLOCK):
            m = min(BLOCK, samples.point_count[p] - begin)
            fill_pair_energies(samples, p, samples.rows[p, begin : begin + m], begin, pair_delay, energy)
            deposit_energy(energies.cells, energies.first_time, energies.rate, pair_delay[:m], energy[:m])


@njit(cache=True, nogil=True, error_model="numpy")
def deposit_interference(
    samples: WeightedSamples, amplitude: NDArray[np.complex64], interfering_ranges: NDArray[np.int64],
    frequency: float, autocorrelation: NDArray[np.complex64], lag_rate: float, energies: DelayCells,
) -> None:  # fmt: skip
    """Deposit the interference of pairs of legs that arrive within one pulse duration; it may be negative.

    Two arrivals closer than the pulse add twice the real part of their product, deposited half way between them with
    the energy of their overlap.

    Args:
        samples: The samples; their indices increase.
        amplitude: Complex amplitude of each leg, for its phase [1], (f, n).
        interfering_ranges: First and one past last point of ranges where pairs may interfere, increasing, (any, 2).
        frequency: Carrier frequency [Hz].
        autocorrelation: Autocorrelation of the pulse at lags from 0 on, 1 at 0 [1], (lags,).
        lag_rate: Lags per second [Hz].
        energies: Energy grid of one channel [uPa^2], added to in place.
    """
    delay, transmit_weights, receive_weights, pair = samples[:4]
    count, rows, cross_section, source_pressure = samples[4:8]
    cells, first_time, rate = energies
    pairs = pair.shape[0]
    tau, real, imag = np.empty((3, pairs))
    pair_delay, energy = np.empty(BLOCK + pairs * pairs), np.empty(BLOCK + pairs * pairs)
    next_row = np.zeros(pairs, np.int64)
    max_lag, count_in_buffer = (autocorrelation.size - 1) / lag_rate, 0
    for r in range(interfering_ranges.shape[0]):
        for p in range(pairs):
            next_row[p] += np.searchsorted(rows[p, next_row[p] : count[p]], interfering_ranges[r, 0])
        for n in range(interfering_ranges[r, 0], interfering_ranges[r, 1]):
            m = 0
            for p in range(pairs):
                if next_row[p] == count[p] or rows[p, next_row[p]] != n:
                    continue
                i, j = pair[p, 0], pair[p, 1]
                two_way = np.float64(transmit_weights[i, n]) * receive_weights[j, n] + (
                    np.float64(transmit_weights[j, n]) * receive_weights[i, n] if i != j else 0.0
                )
                product = amplitude[i, n] * amplitude[j, n]
                scale = source_pressure * math.sqrt(cross_section[p, next_row[p]]) * two_way / max(abs(product), 1e-30)
                tau[m], real[m], imag[m] = delay[i, n] + delay[j, n], scale * product.real, scale * product.imag
                next_row[p] += 1
                m += 1
            for p in range(m):
                for q in range(p):
                    lag = tau[q] - tau[p]
                    if abs(lag) < max_lag:
                        pair_delay[count_in_buffer] = 0.5 * (tau[p] + tau[q])
                        energy[count_in_buffer] = (
                            2
                            * samples.interference_factor
                            * _overlap(real, imag, p, q, lag, autocorrelation, lag_rate, frequency)
                        )
                        count_in_buffer += 1
            if count_in_buffer >= BLOCK:
                deposit_energy(cells, first_time, rate, pair_delay[:count_in_buffer], energy[:count_in_buffer])
                count_in_buffer = 0
    deposit_energy(cells, first_time, rate, pair_delay[:count_in_buffer], energy[:count_in_buffer])


@njit(cache=True, nogil=True, error_model="numpy")
def _overlap(
    real: Floats, imag: Floats, p: int, q: int, lag: float, autocorrelation: NDArray[np.complex64], rate: float,
    frequency: float,
) -> float:  # fmt: skip
    """Real part of the overlap of arrivals p and q, q later by `lag` [s], with the phase of the carrier [uPa^2].

    Other arguments are those of `deposit_interference`; `real` and `imag` are pressures of arrivals [uPa].
    """
    if lag < 0:
        p, q, lag = q, p, -lag
    position = lag * rate
    cell = min(int(position), autocorrelation.size - 2)
    fraction = position - cell
    low, high = autocorrelation[cell], autocorrelation[cell + 1]
    a, b = low.real + fraction * (high.real - low.real), low.imag + fraction * (high.imag - low.imag)
    sine, cosine = sincos_cycles(frequency * lag)
    rotated_real, rotated_imag = a * cosine - b * sine, a * sine + b * cosine
    c, d = real[p] * real[q] + imag[p] * imag[q], imag[p] * real[q] - real[p] * imag[q]
    return c * rotated_real - d * rotated_imag
