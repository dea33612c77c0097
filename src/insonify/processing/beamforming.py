"""Beams from an array's elements: delay and sum in time, or all beams of a line at once in frequency.

A beam has the signal that one element at the array's centre would receive from the beam's direction alone: an echo
from there keeps its level, its delay and its phase.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from typing import Self

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from insonify.processing._delay_and_sum_kernel import WeightedElements, delay_and_sum
from insonify.processing._fractional_delay import FINER, REACH, CellClock, oversampled_cells
from insonify.processing.element_series import (
    checked_carrier,
    checked_positions,
    element_series,
    element_weights,
    uniform_clock,
)
from insonify.thread_count import thread_count
from insonify.validity import require_number, require_numbers

Complexes = NDArray[np.complex64]
Floats = NDArray[np.float64]

BEAMS_AT_ONCE = 8
"""Beams of one ping that a thread processes together."""
MAX_FOCUS_ERROR = 0.05
"""Largest phase error at the ends of a line for beams that share a focus [rad]."""
FOCUS_AT_INFINITY = 1e12


def beamform_delay_sum(
    pressure: ArrayLike, element_positions: ArrayLike, time: ArrayLike, directions: ArrayLike, *,
    centre_frequency: float, sound_speed: float = 1500.0, shading: str | ArrayLike = "uniform",
    focus: str | float = "dynamic", transmitter: ArrayLike | None = None, centre: ArrayLike | None = None,
    threads: int | None = None,
) -> Complexes:  # fmt: skip
    """Beams by delay and sum, with dynamic or fixed focus.

    Each element is interpolated to the time at which an echo from the focus reaches it (error below -70 dB in
    the band, see `_fractional_delay`), and multiplied by the carrier's phase over the difference. No narrow-band,
    plane-wave or Fresnel approximation; sonar and water are at rest during a ping.

    Args:
        pressure: Complex baseband, shape (..., channel, time).
        element_positions: Positions of the receiving elements in any frame [m], shape (channel, 3).
        time: Sample times after the start of transmission, evenly spaced [s], shape (time,).
        directions: Unit vectors of the beams in that frame, shape (beam, 3).
        centre_frequency: Centre frequency of the baseband [Hz].
        sound_speed: Sound speed of the water [m/s].
        shading: Shading of the elements: a name for elements on a line (uniform, cosine, hann, hamming, taylor), or
            weights of shape (channel,).
        focus: "dynamic": at the position of the current echo; "far": at infinity; or a fixed range [m].
        transmitter: Position of the transmitter [m], shape (3,); None: the centre.
        centre: Position from which beams start [m], shape (3,); None: the mean of the elements.
        threads: Number of cores; default: all. Results are bit-identical for any number.

    Returns:
        Complex baseband, shape (..., beam, time), complex64, as received at the centre. Echoes whose delays at some
        elements lie beyond the series are weaker.

    Raises:
        ValueError: Shapes that do not fit, directions that are no unit vectors, an unknown focus.

    Source: van Trees (2002), Optimum Array Processing, ch. 2 (delay-and-sum, array manifold); the focus for a
    transmitter away from the centre is the ellipsoid |r u - d| + r = c t.

    Example:
        >>> starboard, time = 0.0075 * (np.arange(16) - 7.5), np.arange(0, 0.03, 1 / 50e3)  # half a wavelength apart
        >>> lead = starboard[:, None] * np.sin(np.radians(30)) / 1500  # of an echo from 30 deg to starboard, at 20 ms
        >>> pressure = np.sinc(10e3 * (time - 0.02 + lead)) * np.exp(2j * np.pi * 100e3 * lead)
        >>> elements = np.stack([0 * starboard, starboard, 0 * starboard], axis=-1)
        >>> beams = beamform_delay_sum(
        ...     pressure, elements, time, [[1, 0, 0], [np.sqrt(0.75), 0.5, 0]], centre_frequency=100e3, focus="far"
        ... )
        >>> abs(beams[:, 1000]).round(1).tolist()
        [0.0, 1.0]
    """
    first, rate = uniform_clock(time)
    element = checked_positions("element_positions", element_positions, (None, 3))
    series = element_series(pressure, np.size(time), len(element))
    frequency, speed = checked_carrier(centre_frequency, sound_speed)
    axes = _directions(directions)
    origin = element.mean(axis=0) if centre is None else checked_positions("centre", centre, (3,))
    transmitter_offset = (
        np.zeros(3) if transmitter is None else checked_positions("transmitter", transmitter, (3,)) - origin
    )
    weight, sample_times, focus_range = element_weights(shading, element), np.array(time, float), _focus(focus)
    pings = series.reshape(-1, *series.shape[-2:])
    out = np.zeros((len(pings), len(axes), series.shape[-1]), np.complex64)

    def form(job: tuple[int, int, Complexes]) -> None:
        ping, begin, cells = job
        beams = slice(begin, begin + BEAMS_AT_ONCE)
        clock = CellClock(first - REACH / rate, rate * FINER, frequency, speed)
        array = WeightedElements(element - origin, weight, transmitter_offset)
        delay_and_sum(cells, clock, sample_times, array, axes[beams], focus_range, out[ping, beams].view(np.float32))

    with ThreadPoolExecutor(thread_count(threads)) as pool:
        for ping, row in enumerate(pings):
            cells = oversampled_cells(row)
            list(pool.map(form, [(ping, begin, cells) for begin in range(0, len(axes), BEAMS_AT_ONCE)]))
    return out.reshape(*series.shape[:-2], len(axes), series.shape[-1])


def beamform_fft(
    pressure: ArrayLike, time: ArrayLike, sines: ArrayLike, *, spacing: float, centre_frequency: float,
    sound_speed: float = 1500.0, shading: str | ArrayLike = "uniform", focus: str = "far",
) -> Complexes:  # fmt: skip
    """All beams of an evenly spaced line array at once, focused at infinity or dynamically.

    In each frequency of the band the beams are a chirp-z transform along the array at that frequency's own wavenumber:
    the delays are exact over the whole band. The cost for each frequency grows as n log n of elements and beams.
    A dynamic focus is shared by a few neighbouring beams each: the remaining phase at the outermost elements, their
    distance from the middle squared over twice the range, times the difference of the sines' squares, is at most
    `MAX_FOCUS_ERROR` where the series begins, and smaller later.

    Args:
        pressure: Complex baseband, shape (..., channel, time), the elements in order along the line.
        time: Sample times after the start of transmission, evenly spaced [s], shape (time,).
        sines: Sines of the beams' angles from broadside, towards the last element, evenly spaced [1], shape (beam,).
        spacing: Spacing of the elements [m].
        centre_frequency: Centre frequency of the baseband [Hz].
        sound_speed: Sound speed of the water [m/s].
        shading: Shading of the elements: uniform, cosine, hann, hamming, taylor, or weights of shape (channel,).
        focus: "far": at infinity; or "dynamic": at the position of the current echo, for a transmitter at the
            array's middle.

    Returns:
        Complex baseband, shape (..., beam, time), complex64, as received at the array's middle.

    Raises:
        ValueError: Shapes that do not fit, an unknown focus, or beams unevenly spaced in sine: use
            `beamform_delay_sum` for those.

    Source: van Trees (2002), ch. 3.3 and 6 (frequency-domain beamforming); Rabiner, Schafer & Rader (1969), Bell Syst.
    Tech. J. 48, 1249-1292 (chirp-z transform); not verified.

    Example:
        >>> time = np.arange(0, 0.03, 1 / 50e3)
        >>> broadside = np.tile(np.sinc(10e3 * (time - 0.02)) + 0j, (16, 1))  # an echo at 20 ms in 16 elements
        >>> sines = [0, 0.443 / 8]  # the axis, and half the beamwidth of an array of eight wavelengths
        >>> print(abs(beamform_fft(broadside, time, sines, spacing=0.0075, centre_frequency=100e3)[:, 1000]).round(2))
        [1. 0.71]
    """
    first, rate = uniform_clock(time)
    series = element_series(pressure, np.size(time))
    frequency, speed = checked_carrier(centre_frequency, sound_speed)
    element_spacing = require_number("spacing", spacing, "m", 0.0, exclude_low=True, example="0.0075")
    start, step, beams = _uniform_sines(sines)
    if focus not in ("far", "dynamic"):
        raise ValueError(f"focus is {focus!r}; choose far or dynamic, or use beamform_delay_sum for a range in metres")
    channels, samples = series.shape[-2:]
    line = np.zeros((channels, 3))
    line[:, 1] = (np.arange(channels) - (channels - 1) / 2) * element_spacing
    weight = element_weights(shading, line)[:, None].astype(np.float32)
    groups = [(slice(0, beams), 0.0)]
    if focus == "dynamic":
        groups = _beams_sharing_focus(
            np.asarray(start + step * np.arange(beams), float), line[-1, 1], first * speed / 2, speed / frequency
        )
    pings = series.reshape(-1, channels, samples)
    out = np.empty((len(pings), beams, samples), np.complex64)
    times = np.array(time, float)
    for row, ping in zip(out, pings, strict=True):
        cells = oversampled_cells(ping) if focus == "dynamic" else ping
        for beam_slice, sine in groups:
            focused = (
                ping if focus == "far" else _focused_elements(sine, cells, line, times, (first, rate, frequency, speed))
            )
            first_sine, count = start + step * beam_slice.start - sine, beam_slice.stop - beam_slice.start
            row[beam_slice] = _line_array_beams(
                focused * weight, element_spacing, frequency, speed, rate, (first_sine, step, count)
            )
    return out.reshape(*series.shape[:-2], beams, samples)


def _line_array_beams(
    series: Complexes, spacing: float, frequency: float, speed: float, rate: float, sines: tuple[float, float, int]
) -> Complexes:
    """Beams of one ping's weighted elements, (beams, samples), at evenly spaced sines (first, step, count)."""
    channels, samples = series.shape
    start, step, beams = sines
    max_delay = (channels - 1) / 2 * spacing * max(abs(start), abs(start + step * (beams - 1))) / speed
    size = scipy.fft.next_fast_len(samples + int(np.ceil(2 * max_delay * rate)) + 16)
    # cycles per element and per unit of sine, in each bin
    wave = spacing / speed * (frequency + scipy.fft.fftfreq(size, 1 / rate))
    transform = _ChirpZTransform.along(wave, channels, start, step, beams)
    bins = scipy.fft.fft(series, size, axis=-1)
    return np.asarray(scipy.fft.ifft(transform(bins), axis=-1)[:, :samples], np.complex64)


def _beams_sharing_focus(sines: Floats, half: float, nearest: float, wavelength: float) -> list[tuple[slice, float]]:
    """Groups of beams that share a focus, whose squared sines are nearly equal, with the sine of that focus.

    Args:
        sines: Sines of the beams, evenly spaced [1].
        half: Half the length of the array [m].
        nearest: Range of the first sample [m]; at least half the array's length is used.
        wavelength: Wavelength of the carrier [m].
    """
    width = 2 * MAX_FOCUS_ERROR * wavelength * max(nearest, half, 1e-9) / (np.pi * max(half, 1e-9) ** 2)
    sector = np.sign(sines) * np.round(sines**2 / width)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(sector)) + 1, [len(sines)]]).tolist()
    focus_sine = np.sign(sector) * np.sqrt(np.minimum(np.abs(sector) * width, 1.0))
    return [(slice(a, b), float(focus_sine[a])) for a, b in pairwise(edges)]


def _focused_elements(
    sine: float, cells: Complexes, line: Floats, time: Floats, clock: tuple[float, float, float, float]
) -> Complexes:
    """Elements interpolated to the times at which echoes from one direction reach them, focused dynamically.

    Args:
        sine: Sine of the direction [1].
        cells: Fine cells of one ping, shape (channels, cells).
        line: Elements [m], shape (channels, 3).
        time: Sample times [s], shape (samples,).
        clock: Time of the first sample [s], sample rate [Hz], carrier [Hz], and sound speed [m/s].
    """
    first, rate, frequency, speed = clock
    cells_clock = CellClock(first - REACH / rate, rate * FINER, frequency, speed)
    look, alone = np.array([[np.sqrt(max(1 - sine**2, 0.0)), sine, 0.0]]), np.ones(1)
    out = np.zeros((len(line), len(time)), np.complex64)
    for m in range(len(line)):
        array = WeightedElements(line[m : m + 1], alone, np.zeros(3))
        delay_and_sum(cells[m : m + 1], cells_clock, time, array, look, -1.0, out[m : m + 1].view(np.float32))
    return out


@dataclass(frozen=True, slots=True)
class _ChirpZTransform:
    """Sum over elements m of bins exp(-j 2 pi wave m (start + b step)), m counted from the middle of the line.

    With m b = (m^2 + b^2 - (m - b)^2) / 2 the sum is a convolution with a chirp, done by FFT along the elements.
    """

    before: Complexes
    chirp: Complexes
    after: Complexes

    @classmethod
    def along(cls, wave: Floats, channels: int, start: float, step: float, beams: int) -> Self:
        """Prepare the factors, each of shape (elements or beams, bins)."""
        m = np.arange(channels)[:, None] - (channels - 1) / 2
        b = np.arange(beams)[:, None] - (beams - 1) / 2
        lag = np.arange(1 - channels, beams)[:, None] - (beams - channels) / 2
        chirp = scipy.fft.fft(_phasor(wave * step * lag**2 / 2), scipy.fft.next_fast_len(len(lag)), axis=0)
        middle = start + step * (beams - 1) / 2
        before, after = -wave * (m * middle + step * m**2 / 2), -wave * step * b**2 / 2
        return cls(_phasor(before), chirp, _phasor(after))

    def __call__(self, bins: Complexes) -> Complexes:
        """Transform elements, shape (elements, bins), to beams, shape (beams, bins)."""
        channels, size = len(self.before), len(self.chirp)
        convolved = scipy.fft.fft(bins * self.before, size, axis=0) * self.chirp
        beams = scipy.fft.ifft(convolved, axis=0)[channels - 1 : channels - 1 + len(self.after)]
        return np.asarray(beams * self.after, np.complex64)


def _phasor(cycles: Floats) -> Complexes:
    # float64: hundreds of cycles are reduced before rounding
    return np.exp(2j * np.pi * (cycles - np.round(cycles))).astype(np.complex64)


def _uniform_sines(sines: ArrayLike) -> tuple[float, float, int]:
    given = require_numbers("sines", sines, "", -1.0, 1.0, allow_nan=False)
    if given.ndim != 1 or given.size < 1:
        raise ValueError(f"sines has shape {given.shape}; give one row of beams")
    step = float((given[-1] - given[0]) / max(given.size - 1, 1))
    off = float(np.max(np.abs(given - given[0] - step * np.arange(given.size))))
    if off > 1e-6:
        raise ValueError(
            f"sines are uneven by {off:.2g}; give evenly spaced sines, such as np.linspace(-0.5, 0.5, 128), "
            "or use beamform_delay_sum"
        )
    return float(given[0]), step, given.size


def _directions(directions: ArrayLike) -> Floats:
    given = checked_positions("directions", directions, (None, 3))
    length = np.linalg.norm(given, axis=1)
    if np.any(np.abs(length - 1) > 1e-6):
        raise ValueError(f"directions has a vector of length {length[np.argmax(np.abs(length - 1))]:g}; give length 1")
    return given


def _focus(focus: str | float) -> float:
    if focus == "dynamic":
        return -1.0
    if focus == "far":
        return FOCUS_AT_INFINITY
    if isinstance(focus, str):
        raise ValueError(f"focus is {focus!r}; choose dynamic, far, or a range in metres")
    return require_number("focus", focus, "m", 0.0, exclude_low=True, example="10.0")
