"""Echo trains: multiples of the first bottom echo below a reflecting hull and below the sea surface.

A sonar at height z above the bottom and depth d receives echoes that went down and up n times at ranges n z, where its
own hull reflects them back, and at n z + m d where m of the upper reflections are those of the sea surface. Range is
that of the leading edge, where the level is 6 dB below the peak of the echo.
"""

import numpy as np

from insonify.comparison.frame import Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, counted, decibels, ratio
from insonify.comparison.samples import Floats

MULTIPLES = 4
"""Echoes of the train that are looked for."""
GATE = 0.08
"""Length of the gate behind the expected range of a multiple re the first range [1]."""
EARLY = 3
"""Part of the gate in front of the expected range: rough boundaries delay echoes."""
EDGE = 0.25
"""Intensity of the leading edge re the peak: half the amplitude."""
ABOVE = 4.0
"""Least peak of an echo re the mean in front of its expected range, for its range to count [1]."""


class EchoTrains(Measure):
    """Ranges and levels of multiples re the first echo, along the beam nearest to the vertical."""

    name = "echo trains"
    least_samples = 64

    def __init__(self, frame: Frame) -> None:
        super().__init__(frame)
        r = frame.slant_range
        depths = [side.samples.depth for side in frame.sides if np.isfinite(side.samples.depth)]
        self._surface_depth = float(np.mean(depths)) if depths else np.nan
        self._first, height = float(r[0]), float(np.mean([_first_range(side, r) for side in frame.sides]))
        gate = GATE * height
        self._half = max(int(gate / frame.step), 2)
        surface = [(2, 1), (3, 1)] if self._surface_depth > 2 * gate else []
        hull = height * np.arange(1, MULTIPLES + 2)
        surface = [(n, m) for n, m in surface if np.abs(self._nominal(height, n, m) - hull).min() > 2 * gate]
        orders = [(n, 0) for n in range(2, MULTIPLES + 1)] + surface
        self._orders = [(n, m) for n, m in orders if self._nominal(height, n, m) + gate < r[-1]]
        self._centre = (height - self._first) / frame.step
        self._span = max(int(0.5 * height / frame.step), 2)

    @classmethod
    def unsuited(cls, frame: Frame) -> str:
        """Echo trains are those of sonars that look down."""
        if reason := super().unsuited(frame):
            return reason
        for side in frame.sides:
            beams = side.field.shape[1]
            if beams > 1 and side.samples.angle.size != beams:
                return "the sonar does not look down"
        heights = [_first_range(side, frame.slant_range) for side in frame.sides]
        if 2.2 * max(heights) > frame.slant_range[-1]:
            return "the window ends before the second echo"
        return ""

    def _nominal(self, height: float, n: int, m: int) -> float:
        return n * height + (m * self._surface_depth if m else 0.0)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Range of the first echo; excess range and level of each multiple."""
        quantities = [Quantity("range of the first echo", "m")]
        for n, m in self._orders:
            name = f"{n}z + d (surface)" if m else f"{n}z (hull)"
            quantities += [
                Quantity(f"range of {name} less that", "m", False),
                Quantity(f"level of {name} re first", "dB"),
            ]
        return tuple(quantities)

    def sums(self, side: Side) -> Floats:
        """Sum of intensities and number of pings at each range."""
        vertical = np.arange(side.field.shape[1])[:, None] == side.vertical_beam
        rows = np.where(vertical, side.intensity, np.nan)
        counts = counted(rows)
        return np.hstack([_by_sample(side, rows), _by_sample(side, counts)])

    def estimate(self, sums: Floats) -> Floats:
        """Leading edge of the first echo; excess range and level of each multiple."""
        flat = sums.reshape(-1, sums.shape[-1])
        count = flat.shape[1] // 2
        profile = np.nan_to_num(ratio(flat[:, :count], flat[:, count:]))
        first, peak = self._echo(profile, np.full(len(profile), self._centre), self._span, self._span)[:2]
        columns = [first]
        for n, m in self._orders:
            expected = self._nominal(1.0, n, 0) * first + (m * self._surface_depth if m else 0.0)
            centre = (expected - self._first) / self.frame.step
            edge, level, clear = self._echo(profile, centre, self._half, self._half // EARLY)
            columns += [np.where(clear, edge - expected, np.nan), decibels(ratio(level, peak))]
        return np.stack(columns, axis=-1).reshape(*sums.shape[:-1], -1)

    def _echo(self, profile: Floats, centre: Floats, half: int, early: int) -> tuple[Floats, Floats, Floats]:
        """Leading edge [m], mean intensity about the peak, and whether it stands out, in a gate of each profile."""
        rows = np.arange(len(profile))
        at = np.clip(np.round(centre).astype(int)[:, None] + np.arange(-early, half + 1), 0, profile.shape[1] - 1)
        gate = np.take_along_axis(profile, at, 1)
        top = np.argmax(gate, axis=1)
        peak = gate[rows, top]
        below = (gate < EDGE * peak[:, None]) & (np.arange(gate.shape[1]) < top[:, None])
        last = np.where(below.any(axis=1), gate.shape[1] - 1 - np.argmax(below[:, ::-1], axis=1), 0)
        low, high = gate[rows, last], gate[rows, np.minimum(last + 1, gate.shape[1] - 1)]
        share = np.where(high > low, (np.sqrt(EDGE * peak) - np.sqrt(low)) / np.maximum(np.sqrt(high) - np.sqrt(low),
                                                                                     1e-300), 0.0)  # fmt: skip
        edge = self._first + self.frame.step * (at[rows, last] + np.clip(share, 0, 1))
        near = np.abs(np.arange(gate.shape[1]) - top[:, None]) <= max(self._half // 2, 1)
        mean = np.sum(gate * near, axis=1) / near.sum(axis=1)
        return edge, mean, peak > ABOVE * gate[:, : max(early // 2, 1)].mean(axis=1)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Level of the mean intensity over range."""
        count = self.frame.slant_range.size
        real, simulated = (decibels(ratio(sums[:count], sums[count:])) for sums in (first, second))
        return (Curve(self.frame.slant_range, real, simulated, "slant range [m]", "level [dB]"),)


def _first_range(side: Side, slant_range: Floats) -> float:
    """Range of the strongest sample of the vertical beam [m]."""
    rows = side.intensity[:, side.vertical_beam]
    known = np.isfinite(rows).any(axis=0)
    mean = np.where(known, np.nansum(rows, axis=0), 0.0)
    return float(slant_range[int(np.argmax(mean))])


def _by_sample(side: Side, rows: Floats) -> Floats:
    """Sums over the pings of each unit at each sample, shape (unit, sample)."""
    index = np.arange(rows.shape[2], dtype=np.int64)[None, None, :]
    return side.sums(rows, index, index.size)
