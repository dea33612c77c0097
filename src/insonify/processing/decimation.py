"""What an instrument keeps of what it heard: looks averaged, samples thinned out by their mean or their peak."""

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.processing.bin_overlap import sums_between_edges
from insonify.validity import require_numbers

Floats = NDArray[np.float64]
Keep = Literal["mean", "peak"]


def multilook(intensity: ArrayLike, looks: tuple[int, int]) -> Floats:
    """Mean over blocks of the last two axes that do not overlap: less speckle for less resolution.

    Args:
        intensity: Mean square of what was heard, not in dB, shape (..., ping, time), or another picture.
        looks: Pings and samples of each block.

    Returns:
        Intensity, shape (..., ping // looks[0], time // looks[1]); what fills no block at the end is left out. Of
        independent speckle the standard deviation falls with the root of the looks.

    Raises:
        ValueError: Blocks larger than the picture.
    """
    power = require_numbers("intensity", intensity, "")
    if power.ndim < 2 or any(not 1 <= n <= size for n, size in zip(looks, power.shape[-2:], strict=True)):
        raise ValueError(f"looks is {looks} for intensity of shape {power.shape}; give 1 up to the last two sizes")
    rows, columns = power.shape[-2] // looks[0], power.shape[-1] // looks[1]
    whole = power[..., : rows * looks[0], : columns * looks[1]]
    return np.asarray(whole.reshape(*power.shape[:-2], rows, looks[0], columns, looks[1]).mean(axis=(-3, -1)))


def decimate(intensity: ArrayLike, samples: int, *, keep: Keep = "mean") -> Floats:
    """Series brought to the number of samples that an instrument writes.

    Each sample kept stands for its equal share of the record. The mean counts samples that lie across a border by
    their parts, so energy is kept; the peak takes every sample that the share touches, so no echo is lost.

    Args:
        intensity: Mean square of what was heard, not in dB, shape (..., time); a peak of amplitudes is as good. NaN is
            kept where it is: in the shares that touch it.
        samples: How many are kept, at most as many as there are.
        keep: "mean" or "peak".

    Returns:
        Series, shape (..., samples).

    Raises:
        ValueError: More samples wanted than there are, or another way of keeping them.
    """
    power = require_numbers("intensity", intensity, "")
    if keep not in get_args(Keep):
        raise ValueError(f"keep is {keep!r}; choose one of {', '.join(get_args(Keep))}")
    if power.ndim < 1 or not 1 <= samples <= power.shape[-1]:
        raise ValueError(f"samples is {samples} for series of shape {power.shape}; give 1 up to the length of time")
    # whole numbers over `samples`: no border is misplaced by rounding
    border = np.arange(samples + 1) * power.shape[-1]
    if keep == "peak":
        return _peaks(power, border[:-1] // samples, -(-border[1:] // samples))
    return np.asarray(sums_between_edges(power, border / samples) * (samples / power.shape[-1]))


def _peaks(power: Floats, first: NDArray[np.int64], stop: NDArray[np.int64]) -> Floats:
    """Largest of the samples from first to before stop, which overlap by one sample at most."""
    peaks = np.maximum.reduceat(power, first, axis=-1)
    return np.maximum(peaks, power[..., stop - 1])


def decimated_time(time: ArrayLike, samples: int) -> Floats:
    """Middle of the share of time that each sample kept by `decimate` stands for [s], shape (samples,).

    Args:
        time: Of the samples, evenly spaced [s], shape (time,).
        samples: How many are kept.
    """
    times = require_numbers("time", time, "s", allow_nan=False)
    step = (times[-1] - times[0]) / max(times.size - 1, 1)
    return np.asarray(times[0] - step / 2 + (np.arange(samples) + 0.5) * (times.size * step / samples))
