"""Energy scattered back by the seabed along each radial, by pair of families: sonar equation over a flat seabed."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.jit import njit
from insonify.sonar.beam_kernels import BeamTables, array_cosines, element_gain, interpolate_pattern

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]

POINTS_NARROW, POINTS_WIDE = 2, 5
"""Positions in a range bin of a radial at which the beams are evaluated, for radials of one cell and for wide ones."""
GOLDEN = 0.6180339887498949


@njit(cache=True, nogil=True, error_model="numpy")
def gain_towards(x: float, y: float, z: float, beams: BeamTables) -> float:
    """Amplitude of the first beam in the direction of a unit vector in the world [1], as `beam_kernels.beam_gains`."""
    w, u, v = array_cosines(beams.axes, x, y, z)
    # no local names for the fields of `beams`: numba would count references to these arrays
    gain = beams.scale[0] * element_gain(beams.element, w)
    gain *= interpolate_pattern(beams.tables[0], beams.per_unit[0], u - beams.steer[0, 0]) * interpolate_pattern(
        beams.tables[1], beams.per_unit[1], v - beams.steer[0, 1]
    )
    gain = gain * interpolate_pattern(beams.tables[2], beams.per_unit[2], u)
    return gain * interpolate_pattern(beams.tables[3], beams.per_unit[3], v)


@njit(cache=True, nogil=True, error_model="numpy")
def pair_energies(
    radials: Floats, heading: float, edges: Floats, verticals: Floats, is_odd: NDArray[np.bool_],
    pair: NDArray[np.int64], strength: Floats, transmit_beam: BeamTables, receive_beam: BeamTables, same_beams: bool,
    energy: Singles,
) -> None:  # fmt: skip
    """Fill the energy of every pair from each range bin of each radial [m^-2], both orders of a pair together.

    Args:
        radials: See `radial_columns`.
        heading: Heading of their frame in the world [rad].
        edges: Edges of the range bins, horizontal distances [m], increasing, (b + 1,).
        verticals: Distance times tangent of the launch angle of each family in each range bin, for straight rays the
            height of the image source above the seabed [m], (f, b).
        is_odd: True if the family has an odd number of bounces, (f,).
        pair: Rows of two legs, (p, 2).
        strength: Cross section of each pair times the squares of both legs' pressures, in each range bin [m^-4], (p,
            b).
        transmit_beam: Beam pattern of the transmitter.
        receive_beam: Beam pattern of the receiver.
        same_beams: True if both are the same.
        energy: Result, (s, b, p).
    """
    transmit, receive = np.empty(verticals.shape[0]), np.empty(verticals.shape[0])
    c0, s0 = math.cos(heading), math.sin(heading)
    energy[:] = 0
    for s in range(radials.shape[0]):
        cosine_in_frame, sine_in_frame = radials[s, column.COSINE], radials[s, column.SINE]
        c, d = c0 * cosine_in_frame - s0 * sine_in_frame, s0 * cosine_in_frame + c0 * sine_in_frame
        samples = POINTS_WIDE if radials[s, column.BEAM_SPREAD] > 0 else POINTS_NARROW
        for b in range(edges.size - 1):
            bin_near, bin_far = max(edges[b], radials[s, column.START]), min(edges[b + 1], radials[s, column.STOP])
            if bin_far <= bin_near:
                continue
            area = 0.5 * (bin_far * bin_far - bin_near * bin_near) * radials[s, column.CELL_WIDTH] / samples
            for k in range(samples):
                angle = radials[s, column.BEAM_SPREAD] * ((k + 0.5) / samples - 0.5)
                x, y = c - d * angle, d + c * angle
                distance = (
                    bin_near + (bin_far - bin_near) * (((2 * k + 1) * samples // 2 + k) % samples + 0.5) / samples
                )
                for f in range(verticals.shape[0]):
                    inverse = 1 / math.sqrt(distance * distance + verticals[f, b] * verticals[f, b])
                    cosine, down = distance * inverse, verticals[f, b] * inverse
                    down = -down if is_odd[f] else down
                    transmit[f] = gain_towards(x * cosine, y * cosine, down, transmit_beam)
                    receive[f] = transmit[f] if same_beams else gain_towards(x * cosine, y * cosine, down, receive_beam)
                for p in range(pair.shape[0]):
                    i, j = pair[p, 0], pair[p, 1]
                    product = transmit[i] * receive[j] + (transmit[j] * receive[i] if i != j else 0.0)
                    energy[s, b, p] += np.float32(area * strength[p, b] * product * product)


@njit(cache=True, nogil=True, error_model="numpy")
def add_radials(energy: Singles, total: Floats) -> None:
    """Fill the energy of all radials together, radial by radial, (b * p,), from (s, b * p) [m^-2]."""
    total[:] = 0
    for s in range(energy.shape[0]):
        one = energy[s]
        for k in range(total.size):
            total[k] += one[k]


@njit(cache=True, nogil=True, error_model="numpy")
def pair_keep_probabilities(
    radials: Floats, edges: Floats, step: float, energy: Singles, row: NDArray[np.int64], full_energy: Floats,
    received: Any, pair_group: NDArray[np.int64], keep_probability: NDArray[np.uint8], full: int, minimum: int,
) -> None:  # fmt: skip
    """Fill the keep probability of every pair in each range bin of each radial.

    Args:
        radials: See `radial_columns`, (s, 9).
        edges: Edges of the range bins [m], (b + 1,).
        step: Distance of samples along radials without longer steps [m].
        energy: Energy of pairs from `pair_energies` [m^-2], (any, b, p).
        row: Row of each radial in `energy`, (s,).
        full_energy: Energy of one sample for which the keep probability is 1 [m^-2], (b, p).
        received: True if the pair is not negligible in the range bin, (b, p).
        pair_group: First of the pairs that may arrive at the same time in the range bin, (b, p).
        keep_probability: Result, in units of 1 / `full`, (s, b, p).
        full: Number that represents a probability of 1.
        minimum: Smallest value for a pair that is received.
    """
    count, separate = energy.shape[2], np.ones(edges.size - 1, np.bool_)
    for b in range(separate.size):
        for p in range(count):
            separate[b] &= pair_group[b, p] == p
    keep_probability[:] = 0
    for s in range(radials.shape[0]):
        start, stop, step_length = radials[s, column.START], radials[s, column.STOP], step * radials[s, column.STRIDE]
        for b in range(separate.size):
            length = min(edges[b + 1], stop) - max(edges[b], start)
            if length <= 0:
                continue
            keep, group = keep_probability[s, b], pair_group[b]
            scale = np.float32(full / max(length / step_length, 1.0))
            for p in range(count):
                ratio = energy[row[s], b, p] * scale / np.float32(full_energy[b, p])
                steps = np.uint8(min(max(math.ceil(min(ratio, np.float32(255))), minimum), full))
                keep[p] = steps if received[b, p] and ratio > 0 else 0
            if separate[b]:
                continue
            # pairs that interfere are evaluated at the same samples: all have the largest keep probability
            for p in range(count):
                keep[group[p]] = max(keep[group[p]], keep[p])
            for p in range(count):
                keep[p] = keep[group[p]] if received[b, p] else 0


@njit(cache=True, nogil=True, error_model="numpy")
def lengthen_steps(
    radials: Floats, edges: Floats, keep_probability: NDArray[np.uint8], full: int, longest: int, result: Floats,
    row: NDArray[np.int64],
) -> int:  # fmt: skip
    """Split radials where keep probabilities beyond are low, with longer steps in the farther part.

    In longer steps at most half of the samples are evaluated.

    Args:
        radials: See `radial_columns`, (s, 9).
        edges: Edges of the range bins [m], (b + 1,).
        keep_probability: Keep probability by radial, range bin and pair, (s, b, p).
        full: Number that represents a probability of 1.
        longest: Longest step [steps], a power of 2.
        result: Result, new radials, (2 s, 9).
        row: Result, row in `radials` of which each new one is a part, (2 s,).

    Returns:
        Number of new radials.
    """
    n, largest = 0, np.zeros(edges.size - 1, np.int64)
    for s in range(radials.shape[0]):
        start, stop = radials[s, column.START], radials[s, column.STOP]
        best, saving, split = 0, 0.1, start
        for b in range(edges.size - 1):
            largest[b] = keep_probability[s, b].max() if edges[b] < stop and edges[b + 1] > start else 0
        stride = longest
        while stride > max(radials[s, column.STRIDE], 1):
            last_needed = 0.0
            for b in range(edges.size - 1):
                if 2 * stride * largest[b] > full:
                    last_needed = edges[b + 1]
            last_needed = max(last_needed, start)
            gain = (stop - last_needed) / stop * (1 - radials[s, column.STRIDE] / stride)
            if gain > saving:
                best, saving, split = stride, gain, last_needed
            stride //= 2
        if best == 0 or split > start:
            result[n], row[n] = radials[s], s
            result[n, column.STOP] = split if best > 0 else stop
            n += 1
        if best > 0:
            result[n], row[n] = radials[s], s
            result[n, column.START], result[n, column.STRIDE] = split, best
            n += 1
    return n
