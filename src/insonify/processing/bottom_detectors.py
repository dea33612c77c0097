"""Bottom detection of multibeam sonars: travel time of each beam by amplitude or by phase.

Steep beams receive a short, strong echo: its middle is the bottom. Oblique beams receive a long one, during which the
footprint sweeps through the beam: it is on the beam's axis when both halves of the array are in phase.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import require_number, require_numbers

Floats = NDArray[np.float64]

LINEAR_PHASE = 1.0
"""Phase up to which the phase ramp of a beam counts as a straight line [rad]."""
REFITS = 4
"""Number of times that the line is refitted to the samples near its zero."""


@dataclass(frozen=True, slots=True)
class Detections:
    """Bottom detection of each beam, columns of equal length.

    Example:
        >>> nadir = Detections(np.array([0.04]), np.array([20e-6]), np.array([False]))
        >>> (750 * nadir.time).round(2).tolist(), (750 * nadir.standard_deviation).round(3).tolist()  # range [m]
        ([30.0], [0.015])
    """

    time: Floats
    """Two-way travel time to the bottom on the beam's axis [s], shape (beam,); NaN where not detected."""
    standard_deviation: Floats
    """Standard deviation of the time, estimated from the echo itself [s], shape (beam,)."""
    is_by_phase: NDArray[np.bool_]
    """True for detection by phase, shape (beam,)."""


def amplitude_detection(
    intensity: ArrayLike, time: ArrayLike, *, looks: int = 5, threshold_db: float = 10.0
) -> tuple[Detections, NDArray[np.int64]]:
    """Amplitude detection: mean time of each beam's echo, weighted with intensity.

    The echo extends about its strongest sample down to `threshold_db` below it, with power smoothed over as much as a
    quarter of the echo: the speckle of a long echo does not break it up, and a short one is not widened.

    Args:
        intensity: Mean-square pressure of each beam, shape (beam, time).
        time: Sample times, evenly spaced [s], shape (time,).
        looks: Least number of samples to smooth over; odd.
        threshold_db: Level at which the echo ends, below its peak [dB].

    Returns:
        Detections, and first and one past last sample of each echo, shape (beam, 2).

    Source: amplitude detection as in Lurton (2010), An Introduction to Underwater Acoustics, 2nd ed., sec. 8.3; not
    verified. The deviation is the echo's width over the root of the number of samples in it.

    Example:
        >>> time = np.arange(0.03, 0.05, 1e-4)
        >>> detections, echo = amplitude_detection(np.exp(-(((time - 0.04) / 1e-3) ** 2))[None], time)
        >>> (1e3 * detections.time).round(2).tolist(), (1e3 * time[echo]).round(1).tolist()  # down to -10 dB [ms]
        ([40.0], [[38.5, 41.6]])
    """
    complexes, times = _beams("intensity", require_numbers("intensity", intensity, "", 0.0, allow_nan=False), time)
    power = complexes.real
    depth = require_number("threshold_db", threshold_db, "dB", 0, exclude_low=True)
    first, stop = _echoes(power, odd_looks(looks), 10 ** (-depth / 10))
    at = np.arange(times.size)
    inside = np.where((at >= first[:, None]) & (at < stop[:, None]), power, 0.0)
    total = inside.sum(axis=1)
    has_energy = total > 0
    power_sum = np.where(has_energy, total, 1.0)
    mean = inside @ (times - times[0]) / power_sum
    duration = np.sqrt((inside * (times - times[0] - mean[:, None]) ** 2).sum(axis=1) / power_sum)
    effective_samples = np.maximum(power_sum**2 / np.maximum((inside**2).sum(axis=1), 1e-300), 1.0)
    detections = Detections(np.where(has_energy, times[0] + mean, np.nan),
                            np.where(has_energy, duration / np.sqrt(effective_samples), np.nan),
                       np.zeros(len(power), bool))  # fmt: skip
    return detections, np.stack([first, stop], axis=1)


def phase_detection(
    fore: ArrayLike, aft: ArrayLike, time: ArrayLike, echo: NDArray[np.int64], *, looks: int = 5
) -> Detections:
    """Phase detection: time at which two halves of an array, steered alike, are in phase.

    A straight line, weighted with power, is fitted to the phase of their product, smoothed over `looks`, and refitted
    to the samples near its zero, where the bottom crosses the beam's axis.

    Args:
        fore: Beams of one half, complex, shape (beam, time). Both halves are formed about one centre.
        aft: Beams of the other half, shape (beam, time).
        time: Sample times, evenly spaced [s], shape (time,).
        echo: First and one past last sample of each beam's echo, shape (beam, 2).
        looks: Number of samples to smooth over; odd.

    Returns:
        Detections; NaN where the echo has fewer than four samples or the line does not cross zero within it.

    Source: phase detection as in Lurton (2010), sec. 8.3, and de Moustier (1988), OCEANS 88; not verified.

    Example:
        >>> time = np.arange(0.03, 0.05, 1e-4)
        >>> half = np.exp(1j * 100 * (time - 0.0412))[None]  # its phase re the other half grows by 0.2 rad/ms
        >>> (1e3 * phase_detection(half, half.conj(), time, np.array([[0, 200]])).time).round(2).tolist()
        [41.2]
    """
    from scipy.ndimage import uniform_filter1d

    first, times = _beams("fore", fore, time)
    second, _ = _beams("aft", aft, time)
    smooth = uniform_filter1d(first * np.conj(second), odd_looks(looks), axis=1, mode="constant")
    rows = [_crossing(smooth[i, a:b], times[a:b], looks) for i, (a, b) in enumerate(echo)]
    crossing, deviation = np.array(rows, float).reshape(-1, 2).T
    return Detections(crossing, deviation, np.isfinite(crossing))


def bottom_detection(
    full: ArrayLike, fore: ArrayLike, aft: ArrayLike, time: ArrayLike, *, looks: int = 5, threshold_db: float = 10.0
) -> Detections:
    """Bottom detection of each beam, by amplitude or phase, whichever has the smaller deviation.

    Args:
        full: Beams of the whole array, complex, shape (beam, time).
        fore: Beams of one half, steered alike and formed about the same centre, shape (beam, time).
        aft: Beams of the other half, shape (beam, time).
        time: Sample times, evenly spaced [s], shape (time,).
        looks: Number of samples to smooth over; odd.
        threshold_db: Level at which the echo ends, below its peak [dB].

    Returns:
        Detections, one per beam.

    Example:
        >>> time = np.arange(0.03, 0.05, 1e-4)
        >>> echo = np.exp(-(((time - 0.04) / 4e-3) ** 2))[None]  # long, as in an oblique beam
        >>> half = echo * np.exp(1j * 100 * (time - 0.0412))
        >>> detections = bottom_detection(half + half.conj(), half, half.conj(), time)
        >>> (1e3 * detections.time).round(1).tolist(), detections.is_by_phase.tolist()
        ([41.2], [True])
    """
    beams, times = _beams("full", full, time)
    by_amplitude, echo = amplitude_detection(np.abs(beams) ** 2, times, looks=looks, threshold_db=threshold_db)
    by_phase = phase_detection(fore, aft, times, echo, looks=looks)
    use_phase = (
        np.where(np.isfinite(by_phase.time), by_phase.standard_deviation, np.inf) < by_amplitude.standard_deviation
    )
    return Detections(
        np.where(use_phase, by_phase.time, by_amplitude.time),
        np.where(use_phase, by_phase.standard_deviation, by_amplitude.standard_deviation),
        use_phase,
    )


def odd_looks(looks: int) -> int:
    """Number of looks, refused unless odd: an even number would shift the samples.

    Args:
        looks: Number of samples to smooth over.
    """
    if looks < 1 or looks % 2 == 0:
        raise ValueError(f"looks is {looks}; give an odd number, 1 or more")
    return looks


def _echoes(power: Floats, looks: int, fraction: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and one past last sample of each beam's echo, shape (beam,) each."""
    from scipy.ndimage import uniform_filter1d

    samples = power.shape[1]
    index = np.arange(samples)
    first, stop = np.zeros(len(power), np.int64), np.zeros(len(power), np.int64)
    sizes = [looks]
    while 2 * sizes[-1] < samples // 4:
        sizes.append(2 * sizes[-1] + 1)
    for size in reversed(sizes):
        smooth = uniform_filter1d(power, size, axis=1, mode="constant")
        peak = np.argmax(smooth, axis=1)[:, None]
        is_below = smooth < fraction * np.take_along_axis(smooth, peak, axis=1)
        begin = np.max(np.where(is_below & (index < peak), index + 1, 0), axis=1)
        end = np.min(np.where(is_below & (index > peak), index, samples), axis=1)
        is_final = (stop == 0) & ((end - begin >= 4 * size) | (size == looks))
        first, stop = np.where(is_final, begin, first), np.where(is_final, end, stop)
    return first, stop


def _crossing(product: NDArray[np.complex128], times: Floats, looks: int) -> tuple[float, float]:
    """Zero of the weighted line through the phase, and its standard deviation [s]; NaN if none."""
    if times.size < 4 or not np.any(product):
        return np.nan, np.nan
    middle = int(np.argmax(np.abs(product)))
    phase = np.unwrap(np.angle(product))
    phase -= 2 * np.pi * np.round(phase[middle] / (2 * np.pi))
    line = _PhaseLine.through(times, phase, np.abs(product))
    for _ in range(REFITS):
        line_phase = line.at(times)
        is_linear = np.abs(line_phase) < LINEAR_PHASE
        if line.slope == 0 or is_linear.sum() < 4:
            return np.nan, np.nan
        # cycles are resolved again by the fitted line
        phase = line_phase + np.angle(product * np.exp(-1j * line_phase))
        line = _PhaseLine.through(times[is_linear], phase[is_linear], np.abs(product[is_linear]))
    if line.slope == 0 or not times[0] <= line.zero <= times[-1]:
        return np.nan, np.nan
    return line.zero, line.deviation(looks)


@dataclass(frozen=True, slots=True)
class _PhaseLine:
    """Weighted least-squares line through a phase over time."""

    mean_time: float
    mean_phase: float
    slope: float
    residual: float
    width: float
    effective: float

    @classmethod
    def through(cls, times: Floats, phase: Floats, weights: Floats) -> Self:
        """Fit the line; slope 0 where it is undetermined."""
        weight = weights / weights.sum()
        mean_time, mean_phase = float(weight @ times), float(weight @ phase)
        t = times - mean_time
        width = float(weight @ t**2)
        slope = float(weight @ (t * phase)) / width if width > 0 else 0.0
        residual = float(weight @ (phase - mean_phase - slope * t) ** 2)
        return cls(mean_time, mean_phase, slope, residual, width, 1 / float(weight @ weight))

    @property
    def zero(self) -> float:
        """Time of its zero crossing [s]."""
        return self.mean_time - self.mean_phase / self.slope

    def at(self, times: Floats) -> Floats:
        """Phase of the line [rad]."""
        return np.asarray(self.mean_phase + self.slope * (times - self.mean_time))

    def deviation(self, looks: int) -> float:
        """Standard deviation of the zero crossing [s]; samples are correlated over `looks`."""
        leverage = (self.zero - self.mean_time) ** 2 / self.width
        return float(np.sqrt(self.residual / max(self.effective / looks, 1.0) * (1 + leverage)) / abs(self.slope))


def _beams(name: str, beams: ArrayLike, time: ArrayLike) -> tuple[NDArray[np.complex128], Floats]:
    times, values = require_numbers("time", time, "s", allow_nan=False), np.asarray(beams)
    if values.ndim != 2 or values.shape[1] != times.size:
        raise ValueError(f"{name} has shape {values.shape}; give (beam, time), with {times.size} times")
    return values.astype(complex), times
