"""How loud both ends of the sonar hear places of a level boundary: the arithmetic of `engines.loudness`.

Places are gone through in stretches that stay in the nearest cache; what they need of one another lies in rows of one
piece of memory, which is how compilers can tell that loops over them may run in vectors.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._spread_kernel import at_spread, cosine_spreads
from insonify.jit import njit
from insonify.sonar._beam_kernels import cone, element_gain, nearest

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Beam = tuple[Floats, Floats, Floats, tuple[Floats, Floats, Floats, Floats], Floats, int]
"""Axes, steer, scale, majorants, rows per unit and element of `Beams`."""


class Spreads(NamedTuple):
    """Levels and spreads of the rows of one end's rays off a moving surface; off one that is still, no columns."""

    level: Floats
    """Pressure of a row re a calm surface, at the nodes [1], shape (rows, nodes); (rows, 0) where all are 1."""
    tilt: Floats
    """As of `glint_spread.LegSpread`, likewise; read for glints only."""
    turn: Floats
    """Likewise."""
    glints: NDArray[np.bool_]
    """Rows whose directions are spread, shape (rows,)."""
    slopes: Floats
    """As of `glint_spread.GlintSpread`, shape (3,)."""
    patterns: tuple[Floats, Floats, Floats, Floats]
    """As of `glint_spread.spread_patterns`."""


End = tuple[Floats, Floats, float, float, Beam, Spreads]
"""Place of one end [m], shape (3,); sines of the rays' departure at nodes of distance, positive down, NaN for none,
shape (rows, nodes): one row a family, and one more for its glints; distance of the last node [m]; height of the end
above the boundary, or depth below it [m]; its beams; and what a moving surface does to the rows."""
Gains = tuple[End, End, bool, Floats, float, Floats, float]
"""The first argument of `re_edge`."""

STRETCH = 128
"""Places that are worked out together."""
_ROWS = 20
_NORTH, _EAST, _AROUND, _ENOUGH, _FOUND, _SPARE = range(6)  # rows that callers fill and read; the others are passing
_LEVEL = 18


@njit(cache=True, nogil=True, error_model="numpy")
def _envelope(bound: Floats, per_unit: float, x: float) -> float:
    """Largest magnitude of a pattern at distance x from its axis or beyond, drawn through the table's rows."""
    if bound.shape[0] == 0:
        return 1.0
    place = x * per_unit
    row = min(int(place), bound.shape[0] - 1)
    after = bound[min(row + 1, bound.shape[0] - 1)]
    return bound[row] + min(place - row, 1.0) * (after - bound[row])


@njit(cache=True, nogil=True, error_model="numpy")
def _node(distance: float, last: float, count: int) -> float:
    """Place among nodes that lie at last * (n / (count - 1))**2 [m]."""
    return math.sqrt(min(max(distance, 0.0) / last, 1.0)) * (count - 1)


@njit(cache=True, nogil=True, error_model="numpy")
def _row(room: Floats, number: int) -> Floats:
    """One row of the memory of a stretch."""
    return room[number * STRETCH : (number + 1) * STRETCH]


@njit(cache=True, nogil=True, error_model="numpy")
def _taken(end: End, room: Floats, wide: bool, size: int) -> None:
    """Which way the places of a stretch lie, between which nodes, and how far around them a ray can leave."""
    place, sines, last, height, _, _ = end
    north, east, around = _row(room, _NORTH), _row(room, _EAST), _row(room, _AROUND)
    node, part, ahead, aside = _row(room, 6), _row(room, 7), _row(room, 8), _row(room, 9)
    sine, cosine = _row(room, 10), _row(room, 11)
    here_north, here_east, count = place[0], place[1], sines.shape[1]
    for n in range(size):
        x, y = north[n] - here_north, east[n] - here_east
        distance = math.sqrt(x * x + y * y)
        among = _node(distance, last, count)
        node[n] = min(np.floor(among), count - 2.0)
        part[n] = among - node[n]
        ahead[n], aside[n] = x / max(distance, 1e-9), y / max(distance, 1e-9)
        if wide:
            margin = min(around[n] / max(math.sqrt(distance * distance + height * height), 1e-9), 1.0)
            sine[n], cosine[n] = margin, math.sqrt(1.0 - margin * margin) if margin < 1.0 else -1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _faced(axes: Floats, room: Floats, wide: bool, size: int) -> None:
    """Cosines to the axes of a beam of the rays of one family to the places of a stretch, or their spans."""
    ahead, aside, sine, cosine = _row(room, 8), _row(room, 9), _row(room, 10), _row(room, 11)
    down, w, u, v = _row(room, 12), _row(room, 13), _row(room, 14), _row(room, 15)
    u_most, v_most = _row(room, 16), _row(room, _SPARE)
    w0, w1, w2, u0, u1, u2 = axes[0, 0], axes[0, 1], axes[0, 2], axes[1, 0], axes[1, 1], axes[1, 2]
    v0, v1, v2 = axes[2, 0], axes[2, 1], axes[2, 2]
    for n in range(size):
        level = math.sqrt(max(1.0 - down[n] * down[n], 0.0))
        w[n] = level * (ahead[n] * w0 + aside[n] * w1) + down[n] * w2
        u[n] = level * (ahead[n] * u0 + aside[n] * u1) + down[n] * u2
        v[n] = level * (ahead[n] * v0 + aside[n] * v1) + down[n] * v2
        u_most[n], v_most[n] = u[n], v[n]
    if wide:
        for n in range(size):
            w[n] = cone(w[n], cosine[n], sine[n])[1]
            u[n], u_most[n] = cone(u[n], cosine[n], sine[n])
            v[n], v_most[n] = cone(v[n], cosine[n], sine[n])


@njit(cache=True, nogil=True, error_model="numpy")
def _loudest(beam: Beam, room: Floats, size: int) -> None:
    """Make what was found in a stretch at least the envelope of the beams there, unless it is enough."""
    _, steer, scale, (across, deep, long, tall), per_unit, element = beam
    enough, found, down, level = _row(room, _ENOUGH), _row(room, _FOUND), _row(room, 12), _row(room, _LEVEL)
    w, u, v, u_most, v_most = _row(room, 13), _row(room, 14), _row(room, 15), _row(room, 16), _row(room, _SPARE)
    for n in range(size):
        largest = found[n]
        if largest >= enough[n] or math.isnan(down[n]):
            continue
        one = element_gain(element, w[n] + 1e-12) * level[n]
        if one == 0.0:
            continue
        one *= _envelope(long, per_unit[2], nearest(u[n], u_most[n], 0.0))
        one *= _envelope(tall, per_unit[3], nearest(v[n], v_most[n], 0.0))
        for channel in range(steer.shape[0]):
            off = nearest(u[n], u_most[n], steer[channel, 0])
            gain = one * scale[channel] * _envelope(across, per_unit[0], off)
            if gain > largest:
                gain *= _envelope(deep, per_unit[1], nearest(v[n], v_most[n], steer[channel, 1]))
                largest = max(largest, gain)
        found[n] = largest


@njit(cache=True, nogil=True, error_model="numpy")
def _loudest_glint(end: End, row: int, room: Floats, size: int) -> None:
    """The same as `_loudest` by the glints of one row, in the fourth mean over their directions."""
    (axes, steer, scale, (across, deep, long, tall), per_unit, element), spreads = end[4], end[5]
    enough, found, down, level = _row(room, _ENOUGH), _row(room, _FOUND), _row(room, 12), _row(room, _LEVEL)
    w, u, v, u_most, v_most = _row(room, 13), _row(room, 14), _row(room, 15), _row(room, 16), _row(room, _SPARE)
    node, part, ahead, aside = _row(room, 6), _row(room, 7), _row(room, 8), _row(room, 9)
    for n in range(size):
        largest = found[n]
        if largest >= enough[n] or math.isnan(down[n]) or level[n] <= largest:
            continue
        k = int(node[n])
        tilt = spreads.tilt[row, k] + part[n] * (spreads.tilt[row, k + 1] - spreads.tilt[row, k])
        turn = spreads.turn[row, k] + part[n] * (spreads.turn[row, k + 1] - spreads.turn[row, k])
        su, sv = cosine_spreads(ahead[n], aside[n], down[n], tilt, turn, spreads.slopes, axes)
        one = element_gain(element, min(w[n] + 2 * max(su, sv), 1.0) + 1e-12) * level[n]
        x, y = nearest(u[n], u_most[n], 0.0), nearest(v[n], v_most[n], 0.0)
        one *= at_spread(spreads.patterns[2], _envelope(long, per_unit[2], x), per_unit[2], x, su)
        one *= at_spread(spreads.patterns[3], _envelope(tall, per_unit[3], y), per_unit[3], y, sv)
        if one <= largest:
            continue
        for channel in range(steer.shape[0]):
            x = nearest(u[n], u_most[n], steer[channel, 0])
            gain = at_spread(spreads.patterns[0], _envelope(across, per_unit[0], x), per_unit[0], x, su)
            gain *= one * scale[channel]
            if gain > largest:
                y = nearest(v[n], v_most[n], steer[channel, 1])
                gain *= at_spread(spreads.patterns[1], _envelope(deep, per_unit[1], y), per_unit[1], y, sv)
                largest = max(largest, gain)
        found[n] = largest


@njit(cache=True, nogil=True, error_model="numpy")
def _envelopes(end: End, room: Floats, wide: bool, size: int) -> None:
    """Envelope of one end's beams near the places of a stretch, by the loudest row of rays, into the row `_FOUND`.

    Args:
        end: That end.
        room: Memory of the stretch: north and east of the places, how far around each it is the largest that is told
            [m], and the envelope at which no louder family need be looked for.
        wide: Whether anything around them is asked for.
        size: Places of the stretch.
    """
    _, sines, _, _, beam, spreads = end
    _taken(end, room, wide, size)
    node, part, down, found = _row(room, 6), _row(room, 7), _row(room, 12), _row(room, _FOUND)
    level, still = _row(room, _LEVEL), spreads.level.shape[1] == 0
    found[:size], level[:size] = 0.0, 1.0
    for family in range(sines.shape[0]):
        for n in range(size):
            row = int(node[n])
            down[n] = sines[family, row] + part[n] * (sines[family, row + 1] - sines[family, row])
            if not still:
                here, beyond = spreads.level[family, row], spreads.level[family, row + 1]
                level[n] = here + part[n] * (beyond - here)
        _faced(beam[0], room, wide, size)
        if spreads.glints[family]:
            _loudest_glint(end, family, room, size)
        else:
            _loudest(beam, room, size)


@njit(cache=True, nogil=True, error_model="numpy")
def _two_way(out: End, back: End, alike: bool, room: Floats, wide: bool, size: int) -> None:
    """Envelope of the two-way gain near the places of a stretch, as `_envelopes` has that of one way."""
    enough, found, once = _row(room, _ENOUGH), _row(room, _FOUND), _row(room, _ROWS)
    if alike:
        for n in range(size):
            enough[n] = math.sqrt(enough[n])
        _envelopes(out, room, wide, size)
        for n in range(size):
            found[n] *= found[n]
        return
    enough[:size] = np.inf  # or it would matter which end was asked first
    _envelopes(out, room, wide, size)
    once[:size] = found[:size]
    _envelopes(back, room, wide, size)
    for n in range(size):
        found[n] *= once[n]


@njit(cache=True, nogil=True, error_model="numpy")
def _filled(there: Floats, around: Floats, first: int, room: Floats) -> tuple[bool, int]:
    """Put the next places where a stretch has them; returns whether anything around them is asked for, and how many."""
    size, wide = min(STRETCH, around.size - first), False
    for n in range(size):
        room[_NORTH * STRETCH + n], room[_EAST * STRETCH + n] = there[first + n, 0], there[first + n, 1]
        room[_AROUND * STRETCH + n] = around[first + n]
        wide |= around[first + n] > 0.0
    return wide, size


@njit(cache=True, nogil=True, error_model="numpy")
def two_way(out: End, back: End, alike: bool, there: Floats, around: Floats, found: Floats) -> None:
    """Envelope of the two-way gain no farther than so far from some places, into found (n,) [1].

    Args:
        out: The end that sends.
        back: The end that hears.
        alike: Whether these are the same.
        there: North and east of the places [m], shape (n, 2).
        around: How far around each place it is the largest that is told [m], shape (n,).
        found: To be filled.
    """
    room = np.empty((_ROWS + 1) * STRETCH)
    for first in range(0, found.size, STRETCH):
        wide, size = _filled(there, around, first, room)
        _row(room, _ENOUGH)[:] = np.inf
        _two_way(out, back, alike, room, wide, size)
        found[first : first + size] = _row(room, _FOUND)[:size]


@njit(cache=True, nogil=True, error_model="numpy")
def re_edge(gains: Gains, there: Floats, around: Floats, found: Floats) -> None:
    """Envelope of the two-way gain re that above which all scatterers are kept, into found (n,) [1].

    Args:
        gains: Both ends, whether they are the same, the gain above which all are kept at the nodes of distance, the
            distance of the last node [m], north and east of where distances are counted from [m], and the least gain
            that others are compared with. Where it is reached no louder family is looked for.
        there: As of `two_way`.
        around: Likewise.
        found: To be filled.
    """
    out, back, alike, edge, last, middle, faintest = gains
    room, least = np.empty((_ROWS + 1) * STRETCH), np.empty(STRETCH)
    for first in range(0, found.size, STRETCH):
        wide, size = _filled(there, around, first, room)
        for n in range(size):
            x, y = there[first + n, 0] - middle[0], there[first + n, 1] - middle[1]
            distance = math.sqrt(x * x + y * y)
            least[n] = _at_nodes(edge, last, distance - around[first + n])
            if wide:
                least[n] = min(least[n], _at_nodes(edge, last, distance + around[first + n]))
            room[_ENOUGH * STRETCH + n] = least[n]
        _two_way(out, back, alike, room, wide, size)
        for n in range(size):
            found[first + n] = room[_FOUND * STRETCH + n] / max(least[n], faintest)


@njit(cache=True, nogil=True, error_model="numpy")
def _at_nodes(value: Floats, last: float, distance: float) -> float:
    """Value at the nodes read at a distance [m]."""
    among = _node(distance, last, value.size)
    row = min(int(among), value.size - 2)
    return value[row] + (among - row) * (value[row + 1] - value[row])


@njit(cache=True, nogil=True, error_model="numpy")
def loudest_at(
    out: End, back: End, alike: bool, far: Floats, middle: Floats, axes: Floats, sectors: Floats, halvings: int,
    close: float, best: Floats,
) -> None:  # fmt: skip
    """Envelope of the loudest two-way gain at some distances, over all bearings, into best (n,) [1].

    Sectors that may hold a louder place than was found are halved.

    Args:
        out: As of `two_way`.
        back: Likewise.
        alike: Likewise.
        far: Distances [m], shape (n,).
        middle: North and east of where they are counted from [m], shape (2,).
        axes: Bearings where the loudest places are likely to lie [rad].
        sectors: Bearings of the middles of equal sectors all round [rad].
        halvings: Of a sector, at most.
        close: Ratio to which the loudest gain is found [1].
        best: To be filled.
    """
    node, bearing = np.arange(far.size).repeat(axes.size), np.empty(far.size * axes.size)
    for n in range(bearing.size):
        bearing[n] = axes[n % axes.size]
    best[:] = 0.0
    _raised(out, back, alike, far, middle, node, bearing, best)
    wide = math.pi / sectors.size
    node, bearing = np.arange(far.size).repeat(sectors.size), np.empty(far.size * sectors.size)
    for n in range(bearing.size):
        bearing[n] = sectors[n % sectors.size]
    for _ in range(halvings):
        there = _raised(out, back, alike, far, middle, node, bearing, best)
        found = np.empty(node.size)
        two_way(out, back, alike, there, wide * far[node], found)
        wide /= 2
        hopeful = np.flatnonzero(found > best[node] * close)
        if hopeful.size == 0:
            return
        next_node, next_bearing = node[hopeful].repeat(2), np.empty(2 * hopeful.size)
        for n in range(hopeful.size):
            next_bearing[2 * n], next_bearing[2 * n + 1] = bearing[hopeful[n]] - wide, bearing[hopeful[n]] + wide
        node, bearing = next_node, next_bearing


@njit(cache=True, nogil=True, error_model="numpy")
def _raised(
    out: End, back: End, alike: bool, far: Floats, middle: Floats, node: Integers, bearing: Floats, best: Floats
) -> Floats:
    """Make the best at some nodes at least what is heard in some bearings there; returns these places."""
    there, found = np.empty((node.size, 2)), np.empty(node.size)
    for n in range(node.size):
        there[n, 0] = middle[0] + far[node[n]] * math.cos(bearing[n])
        there[n, 1] = middle[1] + far[node[n]] * math.sin(bearing[n])
    two_way(out, back, alike, there, np.zeros(node.size), found)
    for n in range(node.size):
        best[node[n]] = max(best[node[n]], found[n])
    return there
