"""A ray in layered water, walked layer by layer along arcs of circles: quickly in plain numbers, or in 50 digits.

Textbook forms (Jensen, Kuperman, Porter & Schmidt (2011), Computational Ocean Acoustics, section 3.3.3, not verified):
a layer of gradient g takes a ray of slowness p from elevation sine s1 to s2 over the distance (s1 - s2) / (p g), in the
time ln(c2 (1 + s1) / (c1 (1 + s2))) / g, along an arc of the length (th1 - th2) / (p g). Digits are lost.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import mpmath as mp
import numpy as np

DIGITS = 50


@dataclass(frozen=True)
class Step:
    """What every ray of a window does next: through one layer, or to the level of its turn and back."""

    z: float
    """Depth at its end [m]; at a turn, where it began."""
    begin: int
    end: int
    """Knots at both ends; the same one at a turn."""
    layer: int
    bounced: bool = False
    """Whether a boundary follows."""


@dataclass
class Column:
    """Straight lines between knots, with the source and the point as knots of their own."""

    depth: list[float]
    speed: list[float]
    source: int = 0
    point: int = 0
    exact: list[mp.mpf] = field(default_factory=list)
    """Speeds at the knots with all digits."""

    @classmethod
    def around(cls, depth, speed, source_depth, point_depth):
        """The column with two depths more."""
        levels = sorted({*map(float, depth), float(source_depth), float(point_depth)})
        with mp.workdps(DIGITS):
            exact = [_at(depth, speed, z) for z in levels]
        column = cls(levels, [float(c) for c in exact], exact=exact)
        column.source, column.point = levels.index(float(source_depth)), levels.index(float(point_depth))
        return column


def _at(depth, speed, z):
    """Speed at a depth with all digits."""
    for z1, z2, c1, c2 in zip(depth, depth[1:], speed, speed[1:], strict=False):
        if z1 <= z <= z2:
            part = (mp.mpf(float(z)) - mp.mpf(float(z1))) / (mp.mpf(float(z2)) - mp.mpf(float(z1)))
            return mp.mpf(float(c1)) + part * (mp.mpf(float(c2)) - mp.mpf(float(c1)))
    raise ValueError(f"{z} m is outside the column")


def walk(column, bounces, launch) -> Iterator[Step]:
    """The steps of a ray, until it reaches a boundary that is not in its family."""
    slowness = np.cos(launch) / column.speed[column.source]
    level, down, left = column.source, launch > 0, list(bounces)
    last = len(column.depth) - 1
    while True:
        if level == (last if down else 0):  # the source itself, or what follows a bounce, on a boundary
            if not left or left.pop(0) != ("B" if down else "S"):
                return
            down = not down
            continue
        ahead = level + (1 if down else -1)
        layer = min(level, ahead)
        if slowness * column.speed[ahead] >= 1:
            yield Step(column.depth[level], level, level, layer)
            down = not down
            continue
        at_boundary = ahead == (last if down else 0)
        fits = at_boundary and bool(left) and left[0] == ("B" if down else "S")
        yield Step(column.depth[ahead], level, ahead, layer, bounced=fits)
        level = ahead


def run_of(column, step, p):
    """Horizontal distance of a step for rays of slownesses p, in plain numbers."""
    c1, c2 = column.speed[step.begin], column.speed[step.end]
    below = step.layer + 1
    dz = column.depth[below] - column.depth[step.layer]
    g = (column.speed[below] - column.speed[step.layer]) / dz
    s1 = _sine(p * c1)
    if step.begin == step.end:
        return 2 * s1 / (p * abs(g)) if g else np.full_like(p, np.inf)
    return p * (c1 + c2) * dz / (s1 + _sine(p * c2))


def _sine(cosine):
    return np.sqrt(np.maximum((1 - cosine) * (1 + cosine), 1e-40))


@dataclass(frozen=True)
class Walked:
    """What a walk adds up to."""

    run: mp.mpf
    slope: mp.mpf
    """Change of the distance with the launch angle [m]."""
    time: mp.mpf | None = None
    length: mp.mpf | None = None
    tube: mp.mpf | None = None
    """Sine of arrival times `slope`: the width of the ray tube over the change of launch [m]."""
    caustics: int = 0


def walked(column, route, launch, *, only_range=False):
    """A ray in 50 digits. Its tube's width at a knot is sine x slope; it counts where that changes sign."""
    here = column.exact[column.source]
    p, sine0 = mp.cos(launch) / here, mp.sin(launch)
    sines = [mp.sqrt(max((1 - p * c) * (1 + p * c), mp.mpf(10) ** -60)) for c in column.exact]
    sines[column.source] = abs(sine0)
    run = time = length = straight = mp.mpf(0)
    inverse = dict.fromkeys(range(len(sines)), mp.mpf(0))  # dX/dp = sum of inverse[k] / sine[k], + straight
    tubes = []
    for step in route:
        g, thickness = _layer(column, step)
        run += _distance(column, step, p, sines, g, thickness)
        straight += _slope(column, step, p, sines, g, thickness, inverse)
        if only_range:
            continue
        if step.begin == step.end:
            # at the turn itself the sine is 0, and only the term that it divides is left
            tubes += [abs(sine0) / (p**2 * g), None]
        took, way = _time_and_length(column, step, p, sines, g, thickness)
        time, length = time + took, length + way
        tubes.append(_tube(column, sines, inverse, straight, sine0, step.end))
    slope = -sum((w * _over(column, sines, sine0, k) for k, w in inverse.items() if w != 0), straight * sine0) / here
    if only_range:
        return Walked(run, slope)
    return Walked(run, slope, time, length, tubes[-1] / here, _sign_changes(tubes))


def _layer(column, step):
    """Gradient of a step's layer along the way (at a turn its size) [1/s], and its thickness [m]."""
    thickness = mp.mpf(column.depth[step.layer + 1]) - mp.mpf(column.depth[step.layer])
    g = (column.exact[step.layer + 1] - column.exact[step.layer]) / thickness
    if step.begin == step.end:
        return abs(g), thickness
    return (g if step.end > step.begin else -g), thickness


def _distance(column, step, p, sines, g, thickness):
    """Horizontal distance of a step [m]."""
    s1, s2 = sines[step.begin], sines[step.end]
    if step.begin == step.end:
        return 2 * s1 / (p * g)
    return p * column.exact[step.begin] * thickness / s1 if g == 0 else (s1 - s2) / (p * g)


def _slope(column, step, p, sines, g, thickness, inverse):
    """What a step adds to dX/dp: what is divided by sines goes to `inverse`, the rest is returned."""
    if step.begin != step.end and g == 0:
        return column.exact[step.begin] * thickness / sines[step.begin] ** 3
    inverse[step.begin] -= (2 if step.begin == step.end else 1) / (p**2 * g)
    if step.begin != step.end:
        inverse[step.end] += 1 / (p**2 * g)
    return mp.mpf(0)


def _time_and_length(column, step, p, sines, g, thickness):
    """Travel time [s] and length [m] of a step."""
    s1, s2 = sines[step.begin], sines[step.end]
    c1, c2 = column.exact[step.begin], column.exact[step.end]
    if step.begin == step.end:
        return 2 * mp.atanh(s1) / g, 2 * mp.asin(s1) / (p * g)
    if g == 0:
        return thickness / (c1 * s1), thickness / s1
    return mp.log(c2 * (1 + s1) / (c1 * (1 + s2))) / g, (mp.asin(s1) - mp.asin(s2)) / (p * g)


def _over(column, sines, sine0, k):
    """Signed sine at the source over the sine at a knot."""
    return mp.sign(sine0) if k == column.source else sine0 / sines[k]


def _tube(column, sines, inverse, straight, sine0, k):
    """Sine at a knot x the source's sine x dX/dp, with 0 / 0 taken out; its sign is that of the tube's width."""
    at = abs(sine0)
    total = straight * at * sines[k]
    for j, w in inverse.items():
        if w == 0:
            continue
        if j == k:
            total += w * at
        elif j == column.source:
            total += w * sines[k]
        else:
            total += w * at * sines[k] / sines[j]
    return total


def _sign_changes(tubes):
    """How often the tube closes. At a turn the slope changes sign without the tube doing so."""
    count, sign, flip = 0, 0, 1
    for tube in tubes:
        if tube is None:
            flip = -flip
            continue
        now = flip * int(mp.sign(tube))
        count += sign != 0 and now != 0 and now != sign
        sign = now or sign
    return count
