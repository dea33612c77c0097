"""Fine time grid on which arrivals are deposited before convolution with the pulse.

An arrival is a spike in time whose delay falls between samples. So each is spread over a few cells of a grid
twice as fine as the recording, with a smooth gridding kernel; one Fourier transform then gives the sum of all
the arrivals' spectra, the kernel is divided out, the pulse multiplied in, and a second transform
returns to time. The cost does not depend on the pulse duration.

Method: Greengard & Lee (2004), SIAM Review 46(3), section 2 (non-uniform FFT of type 1).
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from insonify.fourier import fast_length
from insonify.jit import njit
from insonify.synthesis._gridding_kernel import CELLS_PER_SPIKE, kernel_transform

OVERSAMPLING = 2
"""Cells per output sample of the grid of pressures; the grid of energies has twice as many."""

ROUNDING = 1e-14
"""Intensity re the largest of its channel below which the transforms leave rounding errors, and it is set to 0 [1]."""
FEW = 16
"""Largest number of cells of a channel with energy for which their responses are summed, faster than transforms."""
_CHANNELS = 16
"""Number of channels that are transformed at once."""
WAVEFORM_CHANNELS = 4
"""Number of channels of which all waveforms are transformed at once."""
_LINE = 8
"""Numbers of complex64 in a cache line of 64 bytes."""


@dataclass(frozen=True, slots=True)
class TimeGrid:
    """Recorded window, and the longer periodic interval that contains it."""

    start: float
    """Time of the first output sample [s]."""
    sample_rate: float
    """Output samples per second of the complex envelope [Hz]."""
    sample_count: int
    """Output samples in the window."""
    lead_samples: int
    """Samples before the window, for arrivals that begin there and extend into it."""
    padded_samples: int
    """Samples of the periodic interval: late arrivals do not wrap into the window, and the FFT length is a fast one."""

    @property
    def first_time(self) -> float:
        """Time of the first cell [s]."""
        return self.start - self.lead_samples / self.sample_rate

    @property
    def cell_rate(self) -> float:
        """Cells of the pressure grid per second [Hz]."""
        return OVERSAMPLING * self.sample_rate

    @property
    def energy_rate(self) -> float:
        """Cells of the energy grid per second [Hz]: a squared envelope has twice the band."""
        return 2 * OVERSAMPLING * self.sample_rate

    @property
    def energy_padded(self) -> int:
        """Samples of the periodic interval of energies, slightly longer, for a fast real FFT."""
        return fast_length(self.padded_samples, real=True)

    @property
    def energy_cell_count(self) -> int:
        """Cells of the energy grid of one channel."""
        return 2 * OVERSAMPLING * self.energy_padded

    @property
    def time(self) -> NDArray[np.float64]:
        """Times of the output samples [s], shape (count,)."""
        return self.start + np.arange(self.sample_count) / self.sample_rate

    @property
    def frequencies(self) -> NDArray[np.float64]:
        """Offsets from the carrier at which the pulse spectrum is evaluated [Hz], shape (padded,), in DFT order."""
        return np.asarray(np.fft.fftfreq(self.padded_samples, 1 / self.sample_rate))

    def cells(self, channels: int = 1) -> NDArray[np.complex64]:
        """Empty grid of pressures, shape (channels, OVERSAMPLING * padded), aligned to cache lines."""
        shape = channels, OVERSAMPLING * self.padded_samples
        count = shape[0] * shape[1]
        buffer = np.zeros(count + _LINE, np.complex64)
        begin = -buffer.ctypes.data // buffer.itemsize % _LINE
        return buffer[begin : begin + count].reshape(shape)

    def energy_cells(self, channels: int = 1) -> NDArray[np.float64]:
        """Empty grid of energies, shape (channels, energy_cell_count)."""
        return np.zeros((channels, self.energy_cell_count))


def time_grid(start: float, stop: float, sample_rate: float, pulse_start: float, pulse_stop: float) -> TimeGrid:
    """Time grid of a window, wide enough for every arrival that contributes to it.

    An arrival at delay tau lasts from tau + pulse_start to tau + pulse_stop, so the delays that
    matter lie between start - pulse_stop and stop - pulse_start. Deposits outside the grid are dropped; the few cells
    of margin beyond those bounds do not contribute to the window.

    Args:
        start: First time of the window [s].
        stop: End of the window [s], after start.
        sample_rate: Output samples per second [Hz].
        pulse_start: First time at which the received pulse is not negligible [s]; negative after a matched filter.
        pulse_stop: Last time at which the received pulse is not negligible [s].

    Returns:
        A window of round((stop - start) * sample_rate) samples, at least one.
    """
    count = max(1, round((stop - start) * sample_rate))
    lead = max(0, math.ceil(pulse_stop * sample_rate)) + CELLS_PER_SPIKE
    tail = max(0, math.ceil(-pulse_start * sample_rate)) + CELLS_PER_SPIKE
    padded = 2 * fast_length(math.ceil((lead + count + tail) / 2))
    return TimeGrid(start=start, sample_rate=sample_rate, sample_count=count, lead_samples=lead, padded_samples=padded)


def convolve_pulse(
    cells: NDArray[np.complex64], grid: TimeGrid, spectrum: NDArray[np.complex128]
) -> NDArray[np.complex64]:
    """Convolve deposited arrivals with one pulse: the sum of weight times p(t - delay).

    Args:
        cells: Grid of pressures, shape (channels, OVERSAMPLING * padded).
        grid: The grid the cells belong to.
        spectrum: Continuous Fourier transform of the received pulse p at grid.frequencies [s], shape (padded,).

    Returns:
        Complex envelope at grid.time, in the units of the weights, shape (channels, count).
    """
    factors = grid_factors(grid, spectrum)
    window = slice(grid.lead_samples, grid.lead_samples + grid.sample_count)
    series = np.empty((len(cells), grid.sample_count), np.complex64)
    for channel, row in enumerate(cells):
        # float64: a float32 transform spreads 1e-7 of the strongest arrival over the whole record.
        transform = scipy.fft.fft(row.astype(np.complex128), overwrite_x=True)
        series[channel] = scipy.fft.ifft(_central(transform, grid.padded_samples) * factors, overwrite_x=True)[window]
    return series


def convolve_waveforms(
    cells: NDArray[np.complex64], grid: TimeGrid, factors: NDArray[np.complex128]
) -> NDArray[np.complex64]:
    """Convolve deposited arrivals that are weighted sums of several waveforms.

    Args:
        cells: Grids of pressure, shape (bands, channels, groups, OVERSAMPLING * padded, waveforms of a group).
        grid: The grid the cells belong to.
        factors: Factors of each waveform from `grid_factors`, shape (bands, dopplers, padded).

    Returns:
        Complex envelope at grid.time, in the units of the weights, shape (channels, count).
    """
    series = np.empty((cells.shape[1], grid.sample_count), np.complex64)
    window = slice(grid.lead_samples, grid.lead_samples + grid.sample_count)
    for first in range(0, len(series), WAVEFORM_CHANNELS):
        spectra = waveform_spectra(cells[:, first : first + WAVEFORM_CHANNELS], grid, factors)
        series[first : first + WAVEFORM_CHANNELS] = scipy.fft.ifft(spectra, axis=1, overwrite_x=True)[:, window]
    return series


def grid_factors(grid: TimeGrid, spectra: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Factors [1] from transforms of cells to the transform of a series: of the pulse over that of the gridding kernel.

    Args:
        grid: The grid.
        spectra: Spectra of waveforms at grid.frequencies [s], shape (..., padded).
    """
    half = grid.padded_samples // 2
    kernel = _kernel_of_bins(half, OVERSAMPLING * grid.padded_samples)
    return np.asarray(grid.sample_rate * spectra / np.concatenate([kernel[:half], kernel[:0:-1]]))


def waveform_spectra(
    cells: NDArray[np.complex64], grid: TimeGrid, factors: NDArray[np.complex128]
) -> NDArray[np.complex128]:
    """Spectra of some channels' deposited arrivals, which are weighted sums of several waveforms.

    Args:
        cells: Grids of pressure, shape (bands, channels, groups, OVERSAMPLING * padded, waveforms of a group).
        grid: The grid the cells belong to.
        factors: Factors of each waveform from `grid_factors`, shape (bands, dopplers, padded).

    Returns:
        Spectra in the units of the weights, shape (channels, padded).
    """
    bands, channels, groups, count, size = cells.shape
    spectra, half = np.zeros((channels, grid.padded_samples), complex), grid.padded_samples // 2
    for band, group in np.ndindex(bands, groups):
        group_factors = factors[band, group * size : (group + 1) * size]  # the last group may have room for more
        # float64: as in `convolve_pulse`; many transforms at once share the instructions of the processor
        waveforms = np.empty((channels, len(group_factors), count), complex)
        _separate_waveforms(cells[band], group, waveforms)
        transforms = scipy.fft.fft(waveforms, axis=2, overwrite_x=True)
        for waveform, factor in enumerate(group_factors):
            spectra[:, :half] += transforms[:, waveform, :half] * factor[:half]
            spectra[:, half:] += transforms[:, waveform, half - grid.padded_samples :] * factor[half:]
    return spectra


@njit(cache=True, nogil=True, error_model="numpy")
def _separate_waveforms(cells: NDArray[np.complex64], group: int, waveforms: NDArray[np.complex128]) -> None:
    """Copy the interleaved waveforms of a group to series of their own.

    Args:
        cells: Grids of pressure, (channels, groups, cells, waveforms of a group).
        group: Group of waveforms.
        waveforms: Result, (channels, waveforms, cells), at most as many waveforms.
    """
    for c in range(cells.shape[0]):
        for s in range(waveforms.shape[1]):
            for j in range(cells.shape[2]):
                waveforms[c, s, j] = cells[c, group, j, s]


class EnergyFilter(NamedTuple):
    """Filter from the energy grid to intensities."""

    factors: NDArray[np.complex128]
    """Factors [1] of the transforms of every fourth cell, starting at cell 0, 1, 2 and 3,
    shape (energy_padded // 2 + 1, 4)."""
    responses: NDArray[np.float64]
    """Intensity over time of unit energy in each of the first four cells [1], shape (4, energy_padded)."""


def convolve_energy(
    cells: NDArray[np.float64], grid: TimeGrid, spectrum: NDArray[np.complex128]
) -> NDArray[np.float64]:
    """Expected intensity: the sum over arrivals of energy times |p(t - delay)|^2.

    Args:
        cells: Grid of energies, shape (channels, 2 * OVERSAMPLING * energy_padded).
        grid: The grid the cells belong to.
        spectrum: Continuous Fourier transform of the received pulse p at grid.frequencies [s], shape (padded,).

    Returns:
        Intensity at grid.time, not negative, in the units of the energies, shape (channels, count).
    """
    return convolve_energy_spectrum(cells, grid, energy_filter(grid, spectrum))


def convolve_energy_spectrum(
    cells: NDArray[np.float64], grid: TimeGrid, filtering: EnergyFilter
) -> NDArray[np.float64]:
    """Expected intensity for many pings of one pulse: `convolve_energy` with a prepared filter.

    Args:
        cells: Grid of energies, shape (channels, 2 * OVERSAMPLING * energy_padded).
        grid: The grid the cells belong to.
        filtering: Filter from `energy_filter`.

    Returns:
        Intensity at grid.time, 0 where it is below the rounding of the transforms, shape (channels, count).
    """
    intensity = np.empty((len(cells), grid.sample_count))
    rows: list[int] = []
    for row, filled in enumerate(cells != 0):
        if np.count_nonzero(filled) > FEW:
            rows.append(row)
        else:
            intensity[row] = _series_of_few(cells[row], np.flatnonzero(filled), grid, filtering.responses)
    for first in range(0, len(rows), _CHANNELS):
        channels = rows[first : first + _CHANNELS] if len(rows) < len(cells) else slice(first, first + _CHANNELS)
        # Every fourth cell is a series at the output's own rate: four short transforms, each with its own filter.
        parts = scipy.fft.rfft(cells[channels].reshape(-1, grid.energy_padded, 2 * OVERSAMPLING), axis=1)
        spectra = np.empty(parts.shape[:2], complex)
        add_filtered(parts, filtering.factors, spectra)
        series = scipy.fft.irfft(spectra, grid.energy_padded, overwrite_x=True)
        floor = ROUNDING * series.max(axis=1, keepdims=True, initial=0.0)
        recorded = series[:, grid.lead_samples : grid.lead_samples + grid.sample_count]
        intensity[channels] = np.where(recorded < floor, 0.0, recorded)
    return intensity


@njit(cache=True, nogil=True, error_model="numpy")
def add_filtered(
    parts: NDArray[np.complex128], factors: NDArray[np.complex128], spectra: NDArray[np.complex128]
) -> None:
    """Fill the sums of transforms times their filters.

    Args:
        parts: Transforms of p series of each channel, (channels, frequencies, p).
        factors: Filter of each series [1], (frequencies, p).
        spectra: Result, (channels, frequencies).
    """
    for c in range(parts.shape[0]):
        for j in range(parts.shape[1]):
            total = 0j
            for r in range(parts.shape[2]):
                total += parts[c, j, r] * factors[j, r]
            spectra[c, j] = total


def _series_of_few(
    cells: NDArray[np.float64], filled: NDArray[np.intp], grid: TimeGrid, responses: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Intensity of one channel with few energies: a sum of shifted responses, as by transforms but for rounding."""
    series = np.zeros(grid.energy_padded)
    for cell in filled.tolist():
        first, phase = divmod(cell, 2 * OVERSAMPLING)
        response = responses[phase]
        series[first:] += cells[cell] * response[: len(series) - first]
        series[:first] += cells[cell] * response[len(series) - first :]
    series[series < ROUNDING * series.max(initial=0.0)] = 0.0
    return series[grid.lead_samples : grid.lead_samples + grid.sample_count]


def energy_filter(grid: TimeGrid, spectrum: NDArray[np.complex128]) -> EnergyFilter:
    """Filter from the energy grid to that of the intensity: |p|^2 over the gridding kernel.

    Args:
        grid: The grid.
        spectrum: Spectrum of the received pulse at grid.frequencies [s], shape (padded,).
    """
    # |p|^2 in samples at twice the output rate, over one period: exact, because p is limited to the output band.
    spectrum_twice = np.zeros(2 * grid.padded_samples, np.complex128)
    half, period = grid.padded_samples // 2, grid.energy_padded
    spectrum_twice[:half] = spectrum[:half]
    spectrum_twice[-half:] = spectrum[-half:]
    power = np.abs(scipy.fft.ifft(spectrum_twice) * 2 * grid.sample_rate) ** 2
    # The period of energies is longer: zeros between the ringing after the pulse and the ringing before it.
    zeros_at = 2 * grid.lead_samples + grid.sample_count
    power = np.insert(power, zeros_at, np.zeros(2 * (period - grid.padded_samples)))
    shape = scipy.fft.rfft(power) / _kernel_of_bins(period, 2 * OVERSAMPLING * period) / 2
    # Every second sample of it is needed: the upper half of the band is folded onto the lower.
    low, part = np.arange(period // 2 + 1)[:, None], np.arange(2 * OVERSAMPLING)
    phase_step = -2j * np.pi / (2 * OVERSAMPLING * period)
    high = period - low
    factors = shape[low] * np.exp(phase_step * low * part) + np.conj(shape[high] * np.exp(phase_step * high * part))
    responses = scipy.fft.irfft(np.ascontiguousarray(factors.T), period)
    for values in (factors, responses):
        values.flags.writeable = False  # shared by all pings
    return EnergyFilter(factors, responses)


def _central(transform: NDArray[np.complex128], count: int) -> NDArray[np.complex128]:
    """The `count` frequencies of a transform next to the carrier, in the order of the DFT."""
    half = count // 2
    return np.concatenate([transform[:half], transform[-half:]])


@lru_cache(maxsize=16)
def _kernel_of_bins(last: int, cells: int) -> NDArray[np.float64]:
    """Transform of the gridding kernel at bins 0..last of a grid of `cells` cells, shape (last + 1,)."""
    transform = kernel_transform(np.arange(last + 1) / cells)
    transform.flags.writeable = False  # shared by all pings
    return transform
