"""Detections of the seabed: their range and scatter in bins of beam angle, and their level."""

import numpy as np

from insonify.comparison.frame import Frame, Side
from insonify.comparison.measure import Curve, Measure, Quantity, counted, decibels, ratio, total_level
from insonify.comparison.samples import Floats

BIN_DEG = 10.0
"""Width of a bin of beam angle [deg]."""
BINS = int(180 / BIN_DEG)


class DetectedDepths(Measure):
    """Depth below the sonar, its scatter between neighbouring beams, and level, in bins of beam angle."""

    name = "detections"

    @classmethod
    def unsuited(cls, frame: Frame) -> str:
        """Both recordings need detections with beam angles."""
        for side in frame.sides:
            samples = side.samples
            if samples.detected_range.shape != samples.values.shape[:2] or not samples.angle.size:
                return f"{samples.name} holds no detections"
        return ""

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Depth, scatter and level in each bin."""
        edges = BIN_DEG * np.arange(BINS) - 90
        named = (("depth", "m"), ("scatter of depth", "m"), ("level", "dB"))
        return tuple(
            Quantity(f"{name} at {low:.0f} to {low + BIN_DEG:.0f} deg", unit) for name, unit in named for low in edges
        )

    def sums(self, side: Side) -> Floats:
        """Sums of depths, of squared steps between beams, and of intensities."""
        angle = side.samples.angle
        depth = (side.samples.detected_range * np.cos(angle))[..., None]
        step = np.full(depth.shape, np.nan)
        step[:, 1:] = np.diff(depth, axis=1) ** 2 / 2
        bins = np.clip((np.degrees(angle) + 90) // BIN_DEG, 0, BINS - 1).astype(np.int64)[None, :, None]
        parts = (depth, step, side.intensity)
        return np.hstack([side.sums(values, bins, BINS) for part in parts for values in (part, counted(part))])

    def estimate(self, sums: Floats) -> Floats:
        """Mean depth, rms scatter and level in each bin."""
        rows = [sums[..., k * BINS : (k + 1) * BINS] for k in range(6)]
        depth, scatter, power = (ratio(rows[k], rows[k + 1]) for k in (0, 2, 4))
        level = decibels(power) - total_level(self.frame, rows[4], rows[5])
        return np.concatenate([depth, np.sqrt(np.maximum(scatter, 0)), level], axis=-1)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Depth and scatter over beam angle."""
        middle = np.asarray(BIN_DEG * (np.arange(BINS) + 0.5) - 90)
        real, simulated = self.estimate(first), self.estimate(second)
        parts = ((0, "depth below the sonar [m]"), (1, "scatter of depth [m]"))
        return tuple(
            Curve(middle, real[k * BINS : (k + 1) * BINS], simulated[k * BINS : (k + 1) * BINS], "beam angle [deg]", y)
            for k, y in parts
        )
