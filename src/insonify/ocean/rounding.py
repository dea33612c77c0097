"""Corners of a profile rounded off, as real water has none.

Where two straight lines meet, the gradient jumps, and rays that just graze the corner are spread or
gathered without limit: a caustic that the water itself does not have. Here each corner becomes a
short parabola, along which the gradient changes steadily, and the parabola a few thin layers.

What is left is smaller and narrower, not nothing: a ray that turns just at a knot between two thin layers still has
no amplitude. Where 5 1/s changes by a twentieth, rays 200 m away lose 3 dB over 0.2 m and 1 dB over 1 m of range.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.validity import number

Floats = NDArray[np.float64]

LEAST_PIECES, MOST_PIECES = 4, 32
"""Thin layers that stand for one rounded corner."""
STEP = 0.25
"""Largest jump of the gradient that is left between thin layers, where their number allows [1/s]."""
LONGEST = 1000.0
"""Longest rounding that any water layer asks for [m]."""
_STRAIGHT = 1e-12  # 1/s: lines that were one line before they were cut


def rounded(depth: Floats, speed: Floats, length: float) -> tuple[Floats, Floats]:
    """Knots of a profile whose corners are rounded.

    Each inner corner gives way to the parabola that touches both of its lines, `length / 2` above and
    below it, or half way to the next knot where that is nearer. It stays between the two lines and the
    chord, so no speed beyond the profile's own appears, layers that grew stay growing, and the ends keep
    theirs. It lies length / 8 times the jump of the gradient from the corner at most; the integral of
    speed over depth changes by length^2 / 24 times the jump.

    Args:
        depth: Depths of the knots, increasing [m], shape (n,).
        speed: Sound speed at the knots [m/s], shape (n,).
        length: Depth within which a corner is rounded [m], above 0.

    Returns:
        Depths [m] and speeds [m/s] of the new knots, shape (m,) each; two ends and no corner return as they are.

    Raises:
        ValueError: The length is no length that a corner can be rounded over.
    """
    reach = number("smoothing", length, "m", 0.0, LONGEST, above=True, such_as="1") / 2
    slope = np.diff(speed) / np.diff(depth)
    gap = np.diff(depth)
    pieces = [np.array([[depth[0], speed[0]]])]
    for i in range(1, depth.size - 1):
        half = min(reach, gap[i - 1] / 2, gap[i] / 2)
        pieces.append(_corner(depth[i], speed[i], slope[i - 1], slope[i], half))
    pieces.append(np.array([[depth[-1], speed[-1]]]))
    knots = np.concatenate(pieces)
    new = np.concatenate([[True], np.diff(knots[:, 0]) > 0])  # two roundings may touch
    return knots[new, 0], knots[new, 1]


def _corner(depth: float, speed: float, above: float, below: float, half: float) -> Floats:
    """Depths and speeds along the parabola that rounds one corner, shape (pieces + 1, 2)."""
    jump = below - above
    if abs(jump) <= _STRAIGHT:
        return np.array([[depth, speed]])
    pieces = min(max(math.ceil(abs(jump) / STEP), LEAST_PIECES), MOST_PIECES)
    z = np.linspace(-half, half, pieces + 1)
    return np.column_stack([depth + z, speed + above * z + jump * (z + half) ** 2 / (4 * half)])
