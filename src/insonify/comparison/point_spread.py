"""Point spread: mean shape of the strongest isolated echoes over range, along the track and across beams."""

import numpy as np
from scipy.ndimage import maximum_filter

from insonify.comparison.amplitude_distribution import relative_intensity
from insonify.comparison.frame import Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, ratio
from insonify.comparison.samples import Floats

STRONG = 6.0
"""Least intensity of an isolated echo re its local mean [1]."""
REACH = 4
"""Pings and beams on either side of an echo; two resolution cells over range."""
LEAST_ECHOES = 8
"""Fewest echoes whose mean shape has a width."""


class PointSpread(Measure):
    """Half-power widths of the mean shape of strong isolated echoes."""

    name = "point spread"
    least_samples = 64

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame)
        shapes = [side.field.shape for side in frame.sides]
        pings, beams = (min(shape[axis] for shape in shapes) for axis in (0, 1))
        reach = {2: max(2 * frame.cell, 3), 0: REACH if pings > 4 * REACH else 0, 1: REACH if beams > 4 * REACH else 0}
        self._reach = {axis: count for axis, count in reach.items() if count}

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Half-power width over range, along the track and across beams."""
        named = {2: Quantity("width over range", "m"), 0: Quantity("width along track", "pings"),
                 1: Quantity("width across beams", "beams")}  # fmt: skip
        return tuple(named[axis] for axis in self._reach)

    def sums(self, side: Side) -> Floats:
        """Sums of the shapes re their peaks at each offset, and numbers of echoes."""
        relative = np.nan_to_num(relative_intensity(side, self.frame.cell))
        size = [2 * self._reach.get(axis, 0) + 1 for axis in range(3)]
        peak = (relative == maximum_filter(relative, size)) & (relative > STRONG)
        for axis, reach in self._reach.items():
            peak &= _inside(peak.shape, axis, reach)
        at = np.argwhere(peak)
        unit = np.broadcast_to(side.unit, relative.shape)[peak]
        total = np.zeros((side.units, 1 + sum(2 * reach + 1 for reach in self._reach.values())))
        intensity = np.nan_to_num(side.intensity)  # a local mean of each beam would level the shape across beams
        columns = [np.ones((len(at), 1))]
        for axis, reach in self._reach.items():
            rows = np.repeat(at[:, None, :], 2 * reach + 1, axis=1)
            rows[:, :, axis] += np.arange(-reach, reach + 1)
            columns.append(intensity[tuple(np.moveaxis(rows, -1, 0))] / intensity[peak][:, None])
        np.add.at(total, unit, np.hstack(columns))
        return total

    def estimate(self, sums: Floats) -> Floats:
        """Half-power widths of the mean shapes."""
        columns, start = [], 1
        for axis, reach in self._reach.items():
            shape = ratio(sums[..., start : start + 2 * reach + 1], sums[..., :1])
            shape = np.where(sums[..., :1] >= LEAST_ECHOES, shape, np.nan)
            half = _half_width(shape[..., reach:]) + _half_width(shape[..., reach::-1])
            columns.append(half * (self.frame.step if axis == 2 else 1.0))
            start += 2 * reach + 1
        return np.stack(columns, axis=-1)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Mean shape over range."""
        reach = self._reach[2]
        real, simulated = (ratio(sums[1 : 2 * reach + 2], sums[:1]) for sums in (first, second))
        offset = np.asarray(self.frame.step * np.arange(-reach, reach + 1))
        return (Curve(offset, real, simulated, "range from the peak [m]", "intensity re peak [1]"),)


def _inside(shape: tuple[int, ...], axis: int, reach: int) -> "np.ndarray[tuple[int, ...], np.dtype[np.bool_]]":
    """True where an echo lies at least `reach` from both ends of an axis."""
    row = np.arange(shape[axis])
    keep = (row >= reach) & (row < shape[axis] - reach)
    return keep.reshape([-1 if dimension == axis else 1 for dimension in range(3)])


def _half_width(shape: Floats) -> Floats:
    """Offset at which a shape that starts at its peak falls to one half [samples]; its length where it never does."""
    below = shape < 0.5
    crossed = below.any(axis=-1)
    at = np.where(crossed, np.argmax(below, axis=-1), shape.shape[-1] - 1)
    high = np.take_along_axis(shape, np.maximum(at - 1, 0)[..., None], -1)[..., 0]
    low = np.take_along_axis(shape, at[..., None], -1)[..., 0]
    width = np.where(crossed, at - 1 + ratio(high - 0.5, high - low), at)
    return np.where(np.isfinite(shape).all(axis=-1), width, np.nan)
