"""Reduction of intensities: multilook averages, and decimation of time by mean or peak."""

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.processing.bin_overlap import sums_between_edges
from insonify.validity import require_numbers

Floats = NDArray[np.float64]
Keep = Literal["mean", "peak"]


def multilook(intensity: ArrayLike, looks: tuple[int, int]) -> Floats:
    """Mean over non-overlapping blocks of the last two axes: less speckle for less resolution.

    Args:
        intensity: Mean-square pressure, not in dB, shape (..., ping, time), or another image.
        looks: Pings and samples of each block.

    Returns:
        Intensity, shape (..., ping // looks[0], time // looks[1]); an incomplete block at the end is left out. For
        independent speckle the standard deviation falls with the root of the number of looks.

    Raises:
        ValueError: Blocks larger than the image.

    Example:
        >>> multilook([[1.0, 3.0, 2.0, 6.0], [1.0, 3.0, 2.0, 6.0]], (2, 2)).tolist()
        [[2.0, 4.0]]
    """
    power = require_numbers("intensity", intensity, "")
    if power.ndim < 2 or any(not 1 <= n <= size for n, size in zip(looks, power.shape[-2:], strict=True)):
        raise ValueError(f"looks is {looks} for intensity of shape {power.shape}; give 1 up to the last two sizes")
    rows, columns = power.shape[-2] // looks[0], power.shape[-1] // looks[1]
    complete = power[..., : rows * looks[0], : columns * looks[1]]
    return np.asarray(complete.reshape(*power.shape[:-2], rows, looks[0], columns, looks[1]).mean(axis=(-3, -1)))


def decimate(intensity: ArrayLike, samples: int, *, keep: Keep = "mean") -> Floats:
    """Series reduced to the number of samples of an instrument's record.

    Each output sample stands for an equal interval of the record. The mean counts samples that an interval cuts in
    proportion, so energy is conserved; the peak includes every sample that the interval touches, so no echo is lost.

    Args:
        intensity: Mean-square pressure, not in dB, shape (..., time); a peak of amplitudes works as well. NaN stays
                NaN in the intervals that touch it.
        samples: Number of output samples, at most that of the series.
        keep: "mean" or "peak".

    Returns:
        Series, shape (..., samples).

    Raises:
        ValueError: More samples than the series has, or an unknown value of `keep`.

    Example:
        >>> echo = [1.0, 1.0, 4.0, 0.0]
        >>> decimate(echo, 2).tolist(), decimate(echo, 2, keep="peak").tolist()
        ([1.0, 2.0], [1.0, 4.0])
    """
    power = require_numbers("intensity", intensity, "")
    if keep not in get_args(Keep):
        raise ValueError(f"keep is {keep!r}; choose one of {', '.join(get_args(Keep))}")
    if power.ndim < 1 or not 1 <= samples <= power.shape[-1]:
        raise ValueError(f"samples is {samples} for series of shape {power.shape}; give 1 up to the length of time")
    # integers over `samples`: no border is misplaced by rounding
    border = np.arange(samples + 1) * power.shape[-1]
    if keep == "peak":
        return _peaks(power, border[:-1] // samples, -(-border[1:] // samples))
    return np.asarray(sums_between_edges(power, border / samples) * (samples / power.shape[-1]))


def _peaks(power: Floats, first: NDArray[np.int64], stop: NDArray[np.int64]) -> Floats:
    """Largest sample of intervals from first to before stop, which overlap by one sample at most."""
    peaks = np.maximum.reduceat(power, first, axis=-1)
    return np.maximum(peaks, power[..., stop - 1])


def decimated_time(time: ArrayLike, samples: int) -> Floats:
    """Middle of the time interval of each sample of `decimate` [s], shape (samples,).

    Args:
        time: Sample times, evenly spaced [s], shape (time,).
        samples: Number of output samples.

    Example:
        >>> (1e3 * decimated_time([0.0, 0.001, 0.002, 0.003], 2)).round(2).tolist()  # [ms]
        [0.5, 2.5]
    """
    times = require_numbers("time", time, "s", allow_nan=False)
    step = (times[-1] - times[0]) / max(times.size - 1, 1)
    return np.asarray(times[0] - step / 2 + (np.arange(samples) + 0.5) * (times.size * step / samples))
