"""Sector images: beams over range on a Cartesian grid, for forward-looking and multibeam sonars."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.validity import require_numbers

Floats = NDArray[np.float64]


def sector_image(
    intensity: ArrayLike, bearings: ArrayLike, ranges: ArrayLike, first_axis: ArrayLike, second_axis: ArrayLike
) -> Floats:
    """Beams resampled to a grid of two axes.

    Intensity is interpolated bilinearly between beams and ranges, so a grid point on a beam and a
    sample has that sample's value. Where pixels are larger than samples, average the samples first (`decimate`).

    Args:
        intensity: Mean-square pressure [any unit], not in dB, shape (..., beam, range).
        bearings: Bearings of the beams, from the first axis towards the second, increasing [rad], shape (beam,).
        ranges: Ranges of the samples, increasing [m], shape (range,).
        first_axis: Grid along the first axis: ahead for a forward-looking sonar, down for a multibeam [m], shape (n,).
        second_axis: Grid along the second axis: to starboard [m], shape (m,).

    Returns:
        Intensity, shape (..., n, m); NaN outside the sector.

    Raises:
        ValueError: Shapes that do not fit; bearings or ranges that do not increase.

    Example:
        >>> intensity = [[1.0, 1.0, 1.0], [1.0, 1.0, 4.0]]  # beams ahead and abeam, with an echo abeam at 20 m
        >>> sector_image(intensity, np.radians([0, 90]), [0, 10, 20], [0, 10], [0, 20]).round(1).tolist()
        [[1.0, 4.0], [1.0, nan]]
    """
    power = require_numbers("intensity", intensity, "")
    angle, distance = _require_increasing("bearings", bearings, "rad"), _require_increasing("ranges", ranges, "m")
    if power.ndim < 2 or power.shape[-2:] != (angle.size, distance.size):
        raise ValueError(f"intensity has shape {power.shape}; bearings and ranges require (..., {angle.size}, "
                         f"{distance.size})")  # fmt: skip
    x, y = np.meshgrid(
        require_numbers("first_axis", first_axis, "m"), require_numbers("second_axis", second_axis, "m"), indexing="ij"
    )
    middle = (angle[0] + angle[-1]) / 2
    bearing = middle + (np.arctan2(y, x) - middle + np.pi) % (2 * np.pi) - np.pi
    beam, beam_fraction, in_sector = _between(bearing, angle)
    sample, sample_fraction, in_range = _between(np.hypot(x, y), distance)
    rows = [power[..., beam + i, sample + j] * _interpolation_weight(beam_fraction,
                                                                     i) * _interpolation_weight(sample_fraction, j)
            for i in (0, 1) for j in (0, 1)]  # fmt: skip
    return np.where(in_sector & in_range, sum(rows), np.nan)


def _require_increasing(name: str, value: ArrayLike, unit: str) -> Floats:
    given = require_numbers(name, value, unit, allow_nan=False)
    if given.ndim != 1 or given.size < 2 or np.any(np.diff(given) <= 0):
        raise ValueError(f"{name} is not an increasing row of two or more; sort it, and the intensity along its axis")
    return given


def _between(value: Floats, row: Floats) -> tuple[NDArray[np.int64], Floats, NDArray[np.bool_]]:
    """Index of the entry of an increasing row below each value, fraction of the step above it, mask inside."""
    slack = 1e-9 * (row[-1] - row[0])
    inside = (value >= row[0] - slack) & (value <= row[-1] + slack)
    index = np.clip(np.searchsorted(row, value, side="right") - 1, 0, row.size - 2)
    return index, np.clip((value - row[index]) / (row[index + 1] - row[index]), 0, 1), inside


def _interpolation_weight(fraction: Floats, upper: int) -> Floats:
    return fraction if upper else 1 - fraction
