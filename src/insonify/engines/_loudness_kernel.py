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
    place: Floats, sines: Floats, last: float, height: float, beam: Beam, north: Floats, east: Floats, around: Floats,
    enough: Floats, found: Floats,
) -> None:  # fmt: skip
    """Envelope of one end's beams near some places of a boundary, by the loudest family, into found (n,) [1].

    Args:
        place: Of that end [m], shape (3,).
        sines: Of the rays' departure at the nodes, positive down, NaN for none, shape (families, nodes).
        last: Distance of the last node [m].
        height: Of the end above the boundary, or its depth below it [m].
        beam: Its beams.
        north: Of the places [m], shape (n,).
        east: Likewise.
        around: How far around each place it is the largest that is told [m], shape (n,).
        enough: Envelope at which no louder family need be looked for, shape (n,).
        found: To be filled.
    """
    axes, steer, scale, (across, deep, long, tall), per_unit, element = beam
    for n in range(north.size):
        ahead, aside = north[n] - place[0], east[n] - place[1]
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
def at_nodes(value: Floats, last: float, distance: Floats, found: Floats) -> None:
    """Values at the nodes read at some distances [m], into found (n,)."""
    for n in range(distance.size):
        row, part = _node(distance[n], last, value.size)
        found[n] = value[row] + part * (value[row + 1] - value[row])


@njit(cache=True, nogil=True, error_model="numpy")
def between_corners(
    corner: Floats, peaked: NDArray[np.bool_], tile: Integers, row: Integers, column: Integers, along: Floats,
    across: Floats, pitch: Floats, found: Floats,
) -> None:  # fmt: skip
    """Values at the corners of the parts of tiles read at scatterers between them, into found (n,); NaN where peaked.

    Args:
        corner: Shape (tiles, PARTS + 1, PARTS + 1).
        peaked: Parts for which their corners do not speak, shape (tiles, PARTS, PARTS).
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
        found[n] = low + x * (high - low)
