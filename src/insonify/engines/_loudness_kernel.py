"""How loud an end of the sonar hears a level boundary, place by place: the arithmetic of `engines.loudness`."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.scene.lattice import SIDE, TILE
from insonify.sonar._beam_kernels import cone, element_gain, nearest

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Beam = tuple[Floats, Floats, Floats, tuple[Floats, Floats, Floats, Floats], Floats, int]
"""Axes, steer, scale, majorants, rows per unit and element of `Beams`."""
End = tuple[Floats, Floats, float, float, Beam]
"""The first arguments of `envelopes`."""


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
def _node(distance: float, last: float, count: int) -> tuple[int, float]:
    """Node before a distance and the part of the way to the next: nodes lie at last * (n / (count - 1))**2 [m]."""
    place = math.sqrt(min(max(distance, 0.0) / last, 1.0)) * (count - 1)
    row = min(int(place), count - 2)
    return row, place - row


@njit(cache=True, nogil=True, error_model="numpy")
def envelopes(
    place: Floats, sines: Floats, last: float, height: float, beam: Beam, there: Floats, around: Floats,
    enough: Floats, found: Floats,
) -> None:  # fmt: skip
    """Envelope of one end's beams near some places of a boundary, by the loudest family, into found (n,) [1].

    Args:
        place: Of that end [m], shape (3,).
        sines: Of the rays' departure at the nodes, positive down, NaN for none, shape (families, nodes).
        last: Distance of the last node [m].
        height: Of the end above the boundary, or its depth below it [m].
        beam: Its beams.
        there: North and east of the places [m], shape (n, 2).
        around: How far around each place it is the largest that is told [m], shape (n,).
        enough: Envelope at which no louder family need be looked for, shape (n,).
        found: To be filled.
    """
    axes, steer, scale, (across, deep, long, tall), per_unit, element = beam
    for n in range(found.size):
        ahead, aside = there[n, 0] - place[0], there[n, 1] - place[1]
        distance = math.sqrt(ahead * ahead + aside * aside)
        row, part = _node(distance, last, sines.shape[1])
        sin_margin, cos_margin = 0.0, 1.0
        if around[n] > 0.0:
            sin_margin = min(around[n] / max(math.sqrt(distance * distance + height * height), 1e-9), 1.0)
            cos_margin = math.sqrt(1.0 - sin_margin * sin_margin) if sin_margin < 1.0 else -1.0
        ahead, aside = ahead / max(distance, 1e-9), aside / max(distance, 1e-9)
        largest = 0.0
        for family in range(sines.shape[0]):
            down = sines[family, row] + part * (sines[family, row + 1] - sines[family, row])
            if largest >= enough[n] or math.isnan(down):
                continue
            level = math.sqrt(max(1.0 - down * down, 0.0))
            w = level * (ahead * axes[0, 0] + aside * axes[0, 1]) + down * axes[0, 2]
            u = level * (ahead * axes[1, 0] + aside * axes[1, 1]) + down * axes[1, 2]
            v = level * (ahead * axes[2, 0] + aside * axes[2, 1]) + down * axes[2, 2]
            u_most, v_most = u, v
            if sin_margin > 0.0:
                w = cone(w, cos_margin, sin_margin)[1]
                u, u_most = cone(u, cos_margin, sin_margin)
                v, v_most = cone(v, cos_margin, sin_margin)
            one = element_gain(element, w + 1e-12)
            if one == 0.0:
                continue
            one *= _envelope(long, per_unit[2], nearest(u, u_most, 0.0))
            one *= _envelope(tall, per_unit[3], nearest(v, v_most, 0.0))
            for channel in range(steer.shape[0]):
                off = nearest(u, u_most, steer[channel, 0])
                gain = one * scale[channel] * _envelope(across, per_unit[0], off)
                if gain > largest:
                    gain *= _envelope(deep, per_unit[1], nearest(v, v_most, steer[channel, 1]))
                    largest = max(largest, gain)
        found[n] = largest


@njit(cache=True, nogil=True, error_model="numpy")
def two_way(out: End, back: End, alike: bool, there: Floats, around: Floats, enough: Floats, found: Floats) -> None:
    """Envelope of the two-way gain no farther than so far from some places, or a part that is enough, into found [1].

    Args:
        out: First arguments of `envelopes` for the end that sends.
        back: For the end that hears.
        alike: Whether these are the same.
        there: North and east of the places [m], shape (n, 2).
        around: How far around each place it is the largest that is told [m], shape (n,).
        enough: Gain at which no louder family need be looked for where both ends are alike, shape (n,).
        found: To be filled.
    """
    place, sines, last, height, beam = out
    if alike:
        envelopes(place, sines, last, height, beam, there, around, np.sqrt(enough), found)
        for n in range(found.size):
            found[n] *= found[n]
        return
    endless, heard = np.full(found.size, np.inf), np.empty(found.size)  # or it would matter which end was asked first
    envelopes(place, sines, last, height, beam, there, around, endless, found)
    place, sines, last, height, beam = back
    envelopes(place, sines, last, height, beam, there, around, endless, heard)
    for n in range(found.size):
        found[n] *= heard[n]


@njit(cache=True, nogil=True, error_model="numpy")
def re_edge(
    out: End, back: End, alike: bool, edge: Floats, last: float, middle: Floats, faintest: float, there: Floats,
    around: Floats, found: Floats,
) -> None:  # fmt: skip
    """Envelope of the two-way gain re that above which all scatterers are kept, into found (n,) [1].

    Args:
        out: As of `two_way`.
        back: Likewise.
        alike: Likewise.
        edge: Gain above which all are kept, at the nodes of distance, shape (nodes,).
        last: Distance of the last node [m].
        middle: North and east of where distances are counted from [m], shape (2,).
        faintest: Least gain that others are compared with.
        there: As of `two_way`.
        around: Likewise.
        found: To be filled.
    """
    least = np.empty(found.size)
    for n in range(found.size):
        distance = math.hypot(there[n, 0] - middle[0], there[n, 1] - middle[1])
        least[n] = _at_nodes(edge, last, distance - around[n])
        if around[n] > 0.0:
            least[n] = min(least[n], _at_nodes(edge, last, distance + around[n]))
    two_way(out, back, alike, there, around, least, found)
    for n in range(found.size):
        found[n] /= max(least[n], faintest)


@njit(cache=True, nogil=True, error_model="numpy")
def _at_nodes(value: Floats, last: float, distance: float) -> float:
    """Value at the nodes read at a distance [m]."""
    row, part = _node(distance, last, value.size)
    return value[row] + part * (value[row + 1] - value[row])


@njit(cache=True, nogil=True, error_model="numpy")
def _share(gain: float, fewer: float, least: float) -> float:
    """Part of the scatterers that is kept, by the gain re that above which all are [1]."""
    gain = min(gain, 1.0)  # what is loud where nothing else is heard is any number of times louder
    return min(max(gain * gain, fewer * gain, least), 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def shares(gain: Floats, fewer: float, least: float, found: Floats) -> None:
    """Parts of the scatterers that are kept where gains are so large, re that above which all are, into found (n,)."""
    for n in range(gain.size):
        found[n] = _share(gain[n], fewer, least)


@njit(cache=True, nogil=True, error_model="numpy")
def peaks(corner: Floats, loudest: Floats, whole: NDArray[np.bool_], peak: float, peaked: NDArray[np.bool_]) -> None:
    """Parts of tiles that hold a place much louder than their corners, into peaked (tiles, PARTS, PARTS).

    Args:
        corner: Gains re that above which all scatterers are kept, shape (tiles, PARTS + 1, PARTS + 1).
        loudest: Loudest gain in each part, or in the tile, shape (tiles, PARTS, PARTS).
        whole: Tiles of which the corners and the loudest place of all are told, shape (tiles,).
        peak: Loudest corner re the loudest place below which it is [1].
        peaked: To be filled.
    """
    end = corner.shape[1] - 1
    for t in range(corner.shape[0]):
        for i in range(end):
            for j in range(end):
                a, b, step = (0, 0, end) if whole[t] else (i, j, 1)
                near = max(corner[t, a, b], corner[t, a, b + step])
                near = max(near, corner[t, a + step, b], corner[t, a + step, b + step])
                peaked[t, i, j] = near < peak * min(loudest[t, i, j], 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def shares_between(
    corner: Floats, peaked: NDArray[np.bool_], density: Floats, most: Floats, fewer: float, least: float,
    tile: Integers, row: Integers, column: Integers, along: Floats, across: Floats, pitch: Floats, found: Floats,
) -> None:  # fmt: skip
    """Shares by the gains at the corners of the parts that scatterers lie in, into found (n,); NaN where peaked.

    Args:
        corner: Gains re that above which all are kept, shape (tiles, PARTS + 1, PARTS + 1).
        peaked: Parts for which their corners do not speak, shape (tiles, PARTS, PARTS).
        density: Share that fills the sonar's cells, shape (tiles,).
        most: No scatterer has a larger one, shape (tiles, PARTS, PARTS).
        fewer: Gain below which shares fall no longer with its square, but with it [1].
        least: Smallest share.
        tile: Row of the tile of each scatterer, shape (n,).
        row: Number of its cell, likewise.
        column: Likewise.
        along: Lattice coordinate [m], likewise.
        across: Likewise.
        pitch: Side of the cells of each tile [m], shape (tiles,).
        found: To be filled.
    """
    for n in range(tile.size):
        t = tile[n]
        a, b = row[n] % TILE, column[n] % TILE
        x, y = (a + along[n] / pitch[t] - row[n]) / SIDE, (b + across[n] / pitch[t] - column[n]) / SIDE
        i, j = a // SIDE, b // SIDE
        if peaked[t, i, j]:
            found[n] = math.nan
            continue
        x, y = x - i, y - j
        low = corner[t, i, j] + y * (corner[t, i, j + 1] - corner[t, i, j])
        high = corner[t, i + 1, j] + y * (corner[t, i + 1, j + 1] - corner[t, i + 1, j])
        found[n] = min(density[t] * _share(low + x * (high - low), fewer, least), most[t, i, j])
