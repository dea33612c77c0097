"""The wave equation above a point source in layered water, without rays: a Hankel integral over exact depth functions.

For each horizontal wavenumber the depth function is integrated by Numerov's rule from both sides, with half-spaces
that radiate above the first and below the last knot; there are no boundaries, only the direct field. The integral
runs a little beside the real axis, where it is smooth (Jensen, Kuperman, Porter & Schmidt (2011), Computational Ocean
Acoustics, sections 4.3 and 4.5.3, not verified).
"""

import numpy as np
from scipy.special import hankel2

STEEPEST = np.radians(40.0)
"""Steepest elevation that is followed at the source [rad]; it fades over the last third."""
LEVEL = np.radians(12.0)
"""How far beyond the horizontal the integral runs into waves that do not travel [rad, as if imaginary]."""


def direct_field(depth, speed, source_depth, point_depth, distance, frequency):
    """Pressure re 1 m of a point source of unit pressure there, for a time factor exp(+j omega t).

    Args:
        depth: Knots [m]; sound speed is linear in between and constant beyond.
        speed: Sound speed there [m/s].
        source_depth: Depth of the source [m].
        point_depth: Depth of the points [m].
        distance: Horizontal distances of the points [m], shape (n,), several wavelengths at least.
        frequency: Frequency [Hz], low enough for 0.2 wavelengths' worth of steps over the column.

    Returns:
        Complex pressure, shape (n,); in still water exp(-j k r) / r.
    """
    omega = 2 * np.pi * frequency
    distance = np.asarray(distance, float)
    here = omega / np.interp(source_depth, depth, speed)
    beside = 2 / distance.max()  # 1/m: how far beside the axis; features of the integrand are as wide
    spacing = beside / 3
    low, high = here * np.cos(STEEPEST), max(here, omega / np.min(speed)) * np.cosh(LEVEL)
    wavenumber = np.arange(low, high, spacing)
    faded = _fade((wavenumber - low) / (here * (np.cos(STEEPEST * 2 / 3) - np.cos(STEEPEST))))
    faded *= _fade((high - wavenumber) / (here * (np.cosh(LEVEL) - 1) / 2))
    k = wavenumber + 1j * beside
    shape = _depth_function(depth, speed, source_depth, point_depth, omega, k)
    weight = 0.5 * spacing * faded * shape * k
    return np.array([np.sum(weight * hankel2(0, k * r)) for r in distance])


def _fade(part):
    """From 0 to 1 with all its slopes small."""
    return np.sin(np.pi / 2 * np.clip(part, 0, 1)) ** 4


def _depth_function(depth, speed, source_depth, point_depth, omega, k):
    """G with G'' + (omega^2 / c^2 - k^2) G = -2 delta(z - source), outgoing at both ends."""
    top, bottom = min(depth[0], source_depth) - 1.0, max(depth[-1], source_depth, point_depth) + 1.0
    # both depths on the grid: the step divides what lies between them
    between = abs(point_depth - source_depth)
    step = 0.25 * min(speed) / omega / np.sin(STEEPEST)
    step = between / np.ceil(between / step)
    above, below = (int(np.ceil(abs(end - source_depth) / step)) for end in (top, bottom))
    z = source_depth + step * np.arange(-above, below + 1)
    square = (omega / np.interp(z, depth, speed)) ** 2
    source, point = above, above + round((point_depth - source_depth) / step)
    # from each end inward, as far as the other of the two depths
    first, last = min(source, point), max(source, point)
    down = _outgoing(square[: last + 2], k, step, {first, source, source + 1})
    up = _outgoing(square[first:][::-1], k, step, {z.size - 1 - source, z.size - 2 - source, z.size - 1 - last})
    mass = 1 + step**2 / 12 * (square[[source, source + 1], None] - k**2)
    u1 = mass * np.array([down[source], down[source + 1]])
    u2 = mass * np.array([up[z.size - 1 - source], up[z.size - 2 - source]])
    wronskian = (u1[0] * u2[1] - u1[1] * u2[0]) / step
    return -2 * down[first] * up[z.size - 1 - last] / wronskian


def _outgoing(square, k, step, expected):
    """The solution that leaves through the first point, by Numerov's rule, at the requested points."""
    leaving = np.sqrt(square[0] - k**2)  # its imaginary part is negative: it fades where it does not travel
    leaving = np.where(leaving.imag > 0, -leaving, leaving)
    old = np.ones(k.size, complex)
    new = np.exp(1j * leaving * step) * old  # towards the inside, against the outward path: phase advances
    kept = {0: old, 1: new}
    mass = [1 + step**2 / 12 * (square[i] - k**2) for i in (0, 1)]
    for i in range(2, square.size):
        ahead = 1 + step**2 / 12 * (square[i] - k**2)
        # (1 + h^2 q / 12) u is stepped; 12 - 10 m = 2 (1 - 5 h^2 q / 12)
        old, new = new, ((12 - 10 * mass[1]) * new - mass[0] * old) / ahead
        mass = [mass[1], ahead]
        if i in expected:
            kept[i] = new
        if i % 64 == 0 and np.abs(new).max() > 1e100:  # what does not travel grows; the scale cancels in the end
            size = np.abs(new) + 1e-300
            old, new = old / size, new / size
            kept = {j: u / size for j, u in kept.items()}
    return kept
