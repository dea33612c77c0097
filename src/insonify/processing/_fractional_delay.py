"""Interpolation of a recorded series between its samples: the innermost loop of beamforming and back-projection.

A band-limited series is determined between its samples. `oversampled_cells` transforms it, divides by the
transform of a short kernel, pads the spectrum to four times the rate and transforms back; an interpolated value is
then the kernel's sum over four cells. The error is the kernel's leakage beyond the bandwidth: 2e-4 (-74 dB) at the
edge of the band, less within.

Source of the method: non-uniform FFT of type 2, Barnett, Magland & af Klinteberg (2019), SIAM J. Sci. Comput. 41(5).
"""

from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.processing._four_tap_sum import four_tap_sum

FINER = 4
"""Cells per sample."""
REACH = 8
"""Samples before the first and after the last at which a series may be evaluated: its ringing."""
BLOCK = 256
"""Values that are processed together: they fit in the first-level cache."""
FAST = {"contract", "reassoc", "nsz", "arcp"}  # not "nnan": NaN delays must be detected
_WIDTH = 4
_SHAPE = 10.4  # least leakage for four cells and a band of a quarter of them

Singles = NDArray[np.float32]
Doubles = NDArray[np.float64]


class CellClock(NamedTuple):
    """Times of fine cells, and the wave."""

    first_time: float
    """Time of the first cell [s]."""
    cell_rate: float
    """Cells per second [Hz]."""
    frequency: float
    """Carrier [Hz]."""
    sound_speed: float
    """Sound speed of the water [m/s]."""


class TapBlock(NamedTuple):
    """Block of interpolated values: work arrays of `prepare_taps`."""

    first_cell: NDArray[np.int32]
    """First cell of each value, shape (BLOCK,)."""
    tap_columns: Singles
    """Weights of the four cells, shape (4, BLOCK)."""
    taps: Singles
    """The same, contiguous for each value, shape (4 BLOCK,)."""
    phasors: Singles
    """Cosine, then sine, times weight, shape (2, BLOCK)."""


def _tap_coefficients() -> NDArray[np.float32]:
    """Cubics of the kernel's first two cells in the position y between cells, -1/2..1/2; the others are those at -y.

    Cell j lies j - 3/2 - y cells after the interpolated value. Shape (2, 4), constant term first.
    """
    nodes = np.cos(np.pi * (np.arange(24) + 0.5) / 24) / 2
    rows = []
    for j in range(2):
        distance = j - 1.5 - nodes
        kernel = np.exp(_SHAPE * (np.sqrt(np.maximum(0, 1 - (2 * distance / _WIDTH) ** 2)) - 1))
        rows.append(np.polynomial.polynomial.polyfit(nodes, kernel, 3))
    return np.array(rows, np.float32)


_TAPS = _tap_coefficients()
_A0, _A1, _A2, _A3 = _TAPS[0]
_B0, _B1, _B2, _B3 = _TAPS[1]


def _kernel_transform(frequency: Doubles) -> Doubles:
    """Fourier transform of the kernel at a frequency in cycles per cell, at most 1/2 [1] (the kernel is even)."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    transform = np.zeros(np.shape(frequency))
    for node, weight in zip(nodes / 2, weights / 2, strict=True):
        for j, row in enumerate(_TAPS.astype(float)):
            height = np.polynomial.polynomial.polyval(node, row)
            transform += 2 * weight * height * np.cos(2 * np.pi * frequency * (j - 1.5 - node))
    return transform


def oversampled_cells(series: NDArray[np.complex64], *, workers: int = 1) -> NDArray[np.complex64]:
    """Oversampled series for interpolation.

    Args:
        series: Complex baseband, shape (..., time).
        workers: Number of threads of the transform.

    Returns:
        Cells, shape (..., cells), of which the first lies `REACH` samples before the first sample, `FINER` a sample.
    """
    count = series.shape[-1]
    size = scipy.fft.next_fast_len(count + 2 * REACH)
    padded = np.zeros((*series.shape[:-1], size), np.complex64)
    padded[..., REACH : REACH + count] = series
    bins = scipy.fft.fft(padded, axis=-1, workers=workers)
    gain = FINER / _kernel_transform(scipy.fft.fftfreq(size) / FINER)
    bins *= gain.astype(np.float32)
    padded_spectrum = np.zeros((*series.shape[:-1], FINER * size), np.complex64)
    above = (size + 1) // 2
    padded_spectrum[..., :above] = bins[..., :above]
    padded_spectrum[..., above - size :] = bins[..., above:]
    return np.ascontiguousarray(
        scipy.fft.ifft(padded_spectrum, axis=-1, workers=workers)[..., : FINER * (count + 2 * REACH)]
    )


@njit(inline="always")
def prepare_taps(
    count: int, position: Doubles, cycles: Doubles, real_weight: Singles, last: int, block: TapBlock
) -> None:
    """Cells, kernel weights and carrier phases of a block of interpolated values.

    Args:
        count: Number of values.
        position: Position of each value, in cells after the first, shape (count,).
        cycles: Phase of each value [cycles], shape (count,).
        real_weight: Real weight of each value, shape (count,); zero is used outside the series.
        last: Number of cells less the kernel's width.
        block: Result.
    """
    at, tap_columns, taps, phasors = block
    real, imaginary = phasors[0], phasors[1]
    first, second, third, fourth = tap_columns[0], tap_columns[1], tap_columns[2], tap_columns[3]
    for i in range(count):
        p = position[i] - 1.0
        inside = (p >= 0.0) & (p < last)
        p = p if inside else 0.0
        cell = np.floor(p)
        at[i] = np.int32(cell)
        y = np.float32(p - cell - 0.5)
        t = y * y
        outer, outer_odd = _A0 + t * _A2, y * (_A1 + t * _A3)
        inner, inner_odd = _B0 + t * _B2, y * (_B1 + t * _B3)
        first[i], fourth[i] = outer + outer_odd, outer - outer_odd
        second[i], third[i] = inner + inner_odd, inner - inner_odd
        sine, cosine = sincos_cycles(cycles[i] if inside else 0.0)
        weight = real_weight[i] if inside else np.float32(0)
        real[i], imaginary[i] = weight * cosine, weight * sine
    for i in range(count):  # separate from the loop above, which would not be vectorised otherwise
        taps[4 * i], taps[4 * i + 1], taps[4 * i + 2], taps[4 * i + 3] = first[i], second[i], third[i], fourth[i]


@njit(inline="always")
def add_interpolated(count: int, cells: Singles, block: TapBlock, out: Singles) -> None:
    """Add a block of values prepared by `prepare_taps` to `out`: real and imaginary alternating, shape (2 count,)."""
    at, _, taps, phasors = block
    real, imaginary = phasors[0], phasors[1]
    for i in range(count):
        x, y = four_tap_sum(cells, np.intp(2) * np.intp(at[i]), taps, 4 * i)
        cosine, sine = real[i], imaginary[i]
        out[2 * i] += cosine * x - sine * y
        out[2 * i + 1] += cosine * y + sine * x
