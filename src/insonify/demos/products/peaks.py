"""Position of a peak between samples, and its width."""

import numpy as np
from numpy.typing import NDArray

from insonify.processing.coherence import parabolic_peak

Floats = NDArray[np.float64]


def parabolic_peak_position(position: Floats, level: Floats, top: int) -> float:
    """Position of a peak, by a parabola through its highest sample and its neighbours.

    Args:
        position: Positions of the samples, uniformly spaced, shape (n,).
        level: Levels of the samples [dB], shape (n,).
        top: Index of the highest sample; at either end its position is returned.
    """
    first = max(top - 1, 0)
    return float(parabolic_peak(level[first : top + 2], position[1] - position[0], position[first])[0])


def width(position: Floats, level: Floats, top: int, below: float = 3.0103) -> float:
    """Width of a peak by linear interpolation [unit of position]; NaN where the level does not fall so far.

    Args:
        position: Positions of the samples, increasing, shape (n,).
        level: Levels of the samples [dB], shape (n,).
        top: Index of the highest sample.
        below: Level below the peak at which the width is measured [dB].
    """
    limit = level[top] - below
    under = np.flatnonzero(level < limit)
    before, after = under[under < top], under[under > top]
    if not before.size or not after.size:
        return float("nan")
    a, b = int(before[-1]), int(after[0])
    ends = [
        position[i] + (position[j] - position[i]) * (limit - level[i]) / (level[j] - level[i])
        for i, j in ((a, a + 1), (b - 1, b))
    ]
    return float(ends[1] - ends[0])
