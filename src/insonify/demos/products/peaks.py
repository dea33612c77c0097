"""Position of a peak between its samples, and its width."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def parabolic_peak_position(position: Floats, level: Floats, top: int) -> float:
    """Place of a peak, by a parabola through its highest sample and its neighbours.

    Args:
        position: Of the samples, evenly spaced, shape (n,).
        level: Of the samples [dB], shape (n,).
        top: Which is the highest; at either end it is the peak itself.
    """
    if not 0 < top < len(level) - 1:
        return float(position[top])
    left, middle, right = level[top - 1 : top + 2]
    bend = left - 2 * middle + right
    return float(position[top] + (position[1] - position[0]) * ((left - right) / bend / 2 if bend < 0 else 0.0))


def width(position: Floats, level: Floats, top: int, below: float = 3.0103) -> float:
    """Width of a peak, between straight lines through its samples [unit of place]; NaN where it does not fall so far.

    Args:
        position: Of the samples, growing, shape (n,).
        level: Of the samples [dB], shape (n,).
        top: Which is the highest.
        below: How far under it the width is taken [dB].
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
