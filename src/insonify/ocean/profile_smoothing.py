"""Corners of a profile rounded off, as real water has none.

Where two straight lines meet, the gradient jumps, and rays that just graze the corner are spread or
gathered without limit: a caustic that the water itself does not have. Here each corner becomes a
short parabola, along which the gradient changes steadily, and the parabola a few thin layers. It is the
mean of the profile over a window that slides past the corner; where corners stand closer than the window,
as in the rows of a measured cast, that mean is taken, and what differs from row to row goes with them.

What is left is smaller and narrower, not nothing: a ray that turns just at a knot between two thin layers still has
no amplitude. Where 5 1/s changes by a twentieth, rays 200 m away lose 3 dB over 0.2 m and 1 dB over 1 m of range.
"""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.validity import require_number

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MIN_PIECES, MAX_PIECES = 4, 32
"""Thin layers that stand for one rounded corner, or for one length of crowded ones."""
STEP = 0.25
"""Largest jump of the gradient that is left between thin layers, where their number allows [1/s]."""
LONGEST = 1000.0
"""Longest rounding that any water layer asks for [m]."""
_STRAIGHT = 1e-12  # 1/s: lines that were one line before they were cut


def round_corners(depth: Floats, speed: Floats, length: float) -> tuple[Floats, Floats]:
    """Knots of a profile whose corners are rounded.

    Each inner corner gives way to the parabola that touches both of its lines, `length / 2` above and
    below it, or half way to the end of the profile where that is nearer. Where corners are closer to each other than
    `length`, the mean speed from `length / 2` above to as much below each depth is taken, of less near an end. No
    speed beyond the profile's own appears, layers that grew stay growing, and the ends keep theirs. A lone corner is
    cut by length / 8 times the jump of the gradient; the integral of speed over depth changes by length^2 / 24 times
    the jump.

    Args:
        depth: Depths of the knots, increasing [m], shape (n,).
        speed: Sound speed at the knots [m/s], shape (n,).
        length: Depth within which a corner is rounded [m], above 0.

    Returns:
        Depths [m] and speeds [m/s] of the new knots, shape (m,) each; two ends and no corner return as they are.

    Raises:
        ValueError: The length is no length that a corner can be rounded over.
    """
    reach = require_number("smoothing", length, "m", 0.0, LONGEST, above=True, example="1") / 2
    gap = np.diff(depth)
    slope = np.diff(speed) / gap
    pieces = [np.array([[depth[0], speed[0]]])]
    inner = np.arange(1, depth.size - 1)
    for group in np.split(inner, 1 + np.flatnonzero(gap[1:-1] >= 2 * reach)) if inner.size else []:
        i = int(group[0])
        if group.size == 1:
            half = min(reach, gap[i - 1] / 2, gap[i] / 2)
            pieces.append(_corner(depth[i], speed[i], slope[i - 1], slope[i], half))
        else:
            pieces.append(_round_close_corners(depth, speed, slope, group, reach))
    pieces.append(np.array([[depth[-1], speed[-1]]]))
    knots = np.concatenate(pieces)
    last_bits = 8 * np.spacing(np.abs(depth).max())  # two roundings may touch, and differ in these
    kept = np.append(np.diff(knots[:, 0]) > last_bits, True)
    kept[0] = True
    return knots[kept, 0], knots[kept, 1]


def _corner(depth: float, speed: float, above: float, below: float, half: float) -> Floats:
    """Depths and speeds along the parabola that rounds one corner, shape (pieces + 1, 2)."""
    jump = below - above
    if abs(jump) <= _STRAIGHT:
        return np.array([[depth, speed]])
    z = np.linspace(-half, half, _pieces(abs(jump)) + 1)
    return np.column_stack([depth + z, speed + above * z + jump * (z + half) ** 2 / (4 * half)])


def _round_close_corners(depth: Floats, speed: Floats, slope: Floats, corners: Integers, reach: float) -> Floats:
    """Depths and mean speeds about corners that stand close, shape (m, 2), m >= 1; the profile's ends are left out.

    A corner adds jump (h - |z - corner|)^2 / 4 h to the mean over h above and below z, where h reaches it.
    """
    first, last = int(corners[0]), int(corners[-1])
    low, high = max(depth[0], depth[first] - reach), min(depth[-1], depth[last] + reach)
    within = np.searchsorted(depth[first : last + 1], depth[corners] + 2 * reach) + first - 1
    bend = float(np.abs(slope[within] - slope[corners - 1]).max())
    z = np.linspace(low, high, max(math.ceil((high - low) / (2 * reach) * _pieces(bend)), 2) + 1)
    z = z[(z > depth[0]) & (z < depth[-1])]
    half = np.minimum(reach, np.minimum(z - depth[0], depth[-1] - z))
    mean = np.interp(z, depth, speed)
    for i in corners:
        near = slice(*np.searchsorted(z, (depth[i] - reach, depth[i] + reach)))
        room = np.maximum(half[near] - np.abs(z[near] - depth[i]), 0.0)
        mean[near] += (slope[i] - slope[i - 1]) * room**2 / (4 * half[near])
    return np.column_stack([z, mean])


def _pieces(jump: float) -> int:
    """How many thin layers take a jump of the gradient [1/s] in small steps."""
    return min(max(math.ceil(jump / STEP), MIN_PIECES), MAX_PIECES)
