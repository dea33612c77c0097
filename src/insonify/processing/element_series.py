"""Checks of the series of an array's elements before processing."""

from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.sonar.aperture import shading_weight
from insonify.sonar.array import Shading
from insonify.validity import require_number, require_numbers, require_sound_speed

Floats = NDArray[np.float64]
Series = NDArray[np.complex64]

UNEVEN = 1e-3
"""Largest deviation of a sample from an even clock, in samples."""


def uniform_clock(time: ArrayLike) -> tuple[float, float]:
    """First time [s] and sample rate [Hz] of samples at even steps.

    Args:
        time: Time of each sample after the start of transmission [s], shape (time,).

    Raises:
        ValueError: Fewer than two samples, or uneven steps.
    """
    times = require_numbers("time", time, "s", allow_nan=False)
    if times.ndim != 1 or times.size < 2:
        raise ValueError(f"time has shape {times.shape}; give one row of two samples or more")
    step = (times[-1] - times[0]) / (times.size - 1)
    deviation = np.max(np.abs(times - times[0] - step * np.arange(times.size)))
    if not step > 0 or deviation > UNEVEN * step:
        raise ValueError(
            f"time is uneven by {deviation:.3g} s at a mean step of {step:.3g} s; give even, increasing times: "
            "resample the series first"
        )
    return float(times[0]), float(1 / step)


def element_series(pressure: ArrayLike, samples: int, channels: int | None = None) -> Series:
    """Checked series of complex baseband.

    Args:
        pressure: Complex baseband, shape (..., channel, time).
        samples: Number of sample times.
        channels: Number of elements; None: any number.

    Returns:
        The series as complex64, shape (..., channel, time), contiguous in memory.

    Raises:
        ValueError: Real numbers, non-finite numbers, or another shape.
    """
    series = np.asarray(pressure)
    if series.dtype.kind != "c":
        raise ValueError(f"pressure is of type {series.dtype}; give complex baseband: this stage needs phases")
    required = f"(..., {'channel' if channels is None else channels}, {samples})"
    if series.ndim < 2 or series.shape[-1] != samples or channels not in (None, series.shape[-2]):
        raise ValueError(f"pressure has shape {series.shape}; the elements and times require {required}")
    if not np.isfinite(series.view(series.real.dtype) if series.flags.c_contiguous else np.abs(series)).all():
        raise ValueError("pressure holds numbers that are not finite; set missing samples to zero")
    return np.ascontiguousarray(series, np.complex64)


def checked_positions(name: str, value: ArrayLike, shape: tuple[int | None, ...]) -> Floats:
    """Checked positions or velocities in three axes, of a shape in which None is any number.

    Args:
        name: Name of the argument, for the message.
        value: The numbers [m] or [m/s].
        shape: Required shape, the last axis being 3.

    Raises:
        ValueError: Another shape, or non-finite numbers.
    """
    given = require_numbers(name, value, "m", allow_nan=False)
    fits = given.ndim == len(shape) and all(w in (None, n) for w, n in zip(shape, given.shape, strict=True))
    if not fits:
        required = ", ".join("any" if n is None else str(n) for n in shape)
        raise ValueError(f"{name} has shape {given.shape}; give ({required})")
    # a copy in C order: compiled code treats read-only arrays, and other orders, as types of their own
    return np.array(given, float, order="C")


def checked_carrier(centre_frequency: float, sound_speed: float) -> tuple[float, float]:
    """Centre frequency [Hz] and sound speed [m/s], each refused where it is invalid.

    Args:
        centre_frequency: Centre frequency of the complex baseband [Hz].
        sound_speed: Sound speed of the water [m/s].
    """
    frequency = require_number("centre_frequency", centre_frequency, "Hz", 0.0, exclude_low=True, example="100e3")
    return frequency, float(
        require_sound_speed("sound_speed", require_number("sound_speed", sound_speed, "m/s"), gaps=False)
    )


def taper(name: str, shading: str, relative_position: Floats) -> Floats:
    """Weight of a named shading [1]: uniform, cosine, hann, hamming or taylor.

    Args:
        name: Name of the argument, for the message.
        shading: Name of the shading.
        relative_position: Distance from the middle over the length of the array, -1/2..1/2, any shape.

    Raises:
        ValueError: Another name.
    """
    names = get_args(Shading)
    if shading not in names:
        raise ValueError(f"{name} is {shading!r}; choose one of {', '.join(names)}")
    return shading_weight(shading, relative_position)


def element_weights(shading: str | ArrayLike, element_positions: Floats) -> Floats:
    """Weight of each element, with sum 1, so that an echo from the beam's direction keeps its level [1].

    Args:
        shading: Name of a shading along a line array (uniform, cosine, hann, hamming, taylor), or a weight for each
            element, shape (channel,).
        element_positions: Positions of the elements [m], shape (channel, 3).

    Raises:
        ValueError: A name for elements that do not lie on a line, or weights of a wrong number or zero sum.
    """
    count = len(element_positions)
    if isinstance(shading, str):
        along = np.zeros(count) if shading == "uniform" else _along_line(element_positions)
        weights = taper("shading", shading, along)
    else:
        weights = require_numbers("shading", shading, "", allow_nan=False)
        if weights.shape != (count,):
            raise ValueError(f"shading has shape {weights.shape}; give one weight for each of {count} elements")
    total = float(np.sum(weights))
    if not abs(total) > 1e-9 * np.sum(np.abs(weights)):
        raise ValueError("shading sums to zero; give weights with a mean above zero")
    return np.array(weights / total, float)


def _along_line(element_positions: Floats) -> Floats:
    """Position of each element along their common line, over the length of the array, -1/2..1/2."""
    centred = element_positions - element_positions.mean(axis=0)
    _, sizes, axes = np.linalg.svd(centred, full_matrices=False)
    if len(sizes) > 1 and sizes[1] > 1e-2 * sizes[0]:
        raise ValueError("shading by name is for elements on a line; give a weight for each element instead")
    along = centred @ axes[0]
    span = along.max() - along.min()
    # each element stands for its part of the aperture, which reaches half a spacing beyond the last one
    return np.asarray(along / (span * len(along) / (len(along) - 1))) if span > 0 else np.zeros(len(along))
