"""Kernel that forms beams from rows of direction cosines, with the exact phase of each frequency.

Each phasor follows from that of the preceding frequency by one multiplication. An aperture's points lie in pairs
at +p and -p about its centre, whose phasors add to 2 cos(2 pi p (u_row - u_beam)): a product of cosines and a product
of sines, of which the factors of the row are summed first. Plain numbers and arrays.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
_FAST = {"contract", "reassoc", "nsz", "arcp"}
_BINS = 64
"""Frequencies that are processed together: their sums fit in the cache."""


class AperturePoints(NamedTuple):
    """Points along an aperture that represent its pattern, each with its mirror image."""

    position: Floats
    """Distances from the centre [wavelengths at the carrier], shape (n,)."""
    weight: Floats
    """Sum of the weights of both points of a pair [1], shape (n,)."""
    inverse_response: Floats
    """Coefficients of a polynomial, constant first, that is one over the transform of the gridding kernel, in the
    square of the cycles per row."""


@njit(cache=True, nogil=True, error_model="numpy")
def _phasors(turns: Floats) -> Floats:
    """Cosines and sines of angles [cycles], shape (n, m) to (n, 2, m)."""
    phasor = np.empty((turns.shape[0], 2, turns.shape[1]))
    for i in range(turns.shape[0]):
        for j in range(turns.shape[1]):
            angle = 2 * np.pi * turns[i, j]
            phasor[i, 0, j], phasor[i, 1, j] = np.cos(angle), np.sin(angle)
    return phasor


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _add_row(x: float, y: float, phasor: Floats, phase_step: Floats, sums: Floats) -> None:
    """Add a row at one frequency to the sums of all points, and advance the phasors to the next frequency.

    Args:
        x: Real part of the row's spectrum.
        y: Imaginary part.
        phasor: Cosines and sines at this frequency; changed to those at the next, (2, points).
        phase_step: Cosines and sines of the increment, (2, points).
        sums: Real and imaginary part times cosine, then both times sine; added to, (4, points).
    """
    for j in range(phasor.shape[1]):
        c, s = phasor[0, j], phasor[1, j]
        sums[0, j] += x * c
        sums[1, j] += y * c
        sums[2, j] += x * s
        sums[3, j] += y * s
        phasor[0, j] = c * phase_step[0, j] - s * phase_step[1, j]
        phasor[1, j] = s * phase_step[0, j] + c * phase_step[1, j]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _add_point(a: float, b: float, c: float, d: float, phasor: Floats, phase_step: Floats, sums: Floats) -> None:
    """Add a point at one frequency to all beams, and advance the phasors to the next frequency.

    Args:
        a: Weighted sum of real parts times cosines at the point, see `_add_row`.
        b: Weighted sum of imaginary parts times cosines.
        c: Weighted sum of real parts times sines.
        d: Weighted sum of imaginary parts times sines.
        phasor: Cosines and sines at this frequency; changed to those at the next, (2, beams).
        phase_step: Cosines and sines of the increment, (2, beams).
        sums: Real and imaginary part of each beam; added to, (2, beams).
    """
    for k in range(phasor.shape[1]):
        cosine, sine = phasor[0, k], phasor[1, k]
        sums[0, k] += a * cosine + c * sine
        sums[1, k] += b * cosine + d * sine
        phasor[0, k] = cosine * phase_step[0, k] - sine * phase_step[1, k]
        phasor[1, k] = sine * phase_step[0, k] + cosine * phase_step[1, k]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def form_beams(
    rows: NDArray[np.complex128], row_cosine: Floats, row_step: float, steer: Floats, points: AperturePoints,
    ratio: float, increment: float, beams: NDArray[np.complex128],
) -> None:  # fmt: skip
    """Form beams from the rows of a direction grid at evenly spaced frequencies.

    Args:
        rows: Spectra of the rows, (rows, frequencies).
        row_cosine: Direction cosine of each row [1], (rows,).
        row_step: Spacing of the rows [1].
        steer: Direction cosines of the beams' axes [1], (beams,).
        points: Points of the aperture.
        ratio: The first frequency re the carrier [1].
        increment: Increment of that ratio per frequency [1].
        beams: Result: spectra of the beams before multiplication by `DirectionGrid.scale`, (beams, frequencies).
    """
    position, count = points.position, points.position.size
    row_turns, beam_turns = np.outer(row_cosine, position), np.outer(position, steer)
    row_phasor, row_phase_step = _phasors(ratio * row_turns), _phasors(increment * row_turns)
    beam_phasor, beam_phase_step = _phasors(ratio * beam_turns), _phasors(increment * beam_turns)
    point_sums, beam_sums = np.empty((_BINS, 4, count)), np.empty((_BINS, 2, steer.size))
    for begin in range(0, rows.shape[1], _BINS):
        bins = min(_BINS, rows.shape[1] - begin)
        point_sums[:] = 0.0
        beam_sums[:] = 0.0
        for r in range(row_cosine.size):
            for f in range(bins):
                value = rows[r, begin + f]
                _add_row(value.real, value.imag, row_phasor[r], row_phase_step[r], point_sums[f])
        for j in range(count):
            for f in range(bins):
                cycles = position[j] * row_step * (ratio + increment * (begin + f))
                weight = 0.0
                for n in range(points.inverse_response.size - 1, -1, -1):
                    weight = weight * cycles * cycles + points.inverse_response[n]
                weight *= points.weight[j]
                a, b = weight * point_sums[f, 0, j], weight * point_sums[f, 1, j]
                c, d = weight * point_sums[f, 2, j], weight * point_sums[f, 3, j]
                _add_point(a, b, c, d, beam_phasor[j], beam_phase_step[j], beam_sums[f])
        for f in range(bins):
            for k in range(steer.size):
                beams[k, begin + f] = complex(beam_sums[f, 0, k], beam_sums[f, 1, k])
