"""Straight legs to the points of one line: delay, directions, pressure, facets. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

_FAST = {"contract", "reassoc", "nsz", "arcp"}
_E = tuple(np.float32(c) for c in (1.0, 0.69314718, 0.24022651, 0.05550411, 0.00961813, 0.00133336, 0.00015404))


@njit(inline="always")
def exp2_of(x: Any) -> Any:
    """2^x for x up to 0, within 1e-6 of itself; 0 below 2^-100."""
    y: Any = max(x, np.float32(-100.0))
    whole = np.int32(y - np.float32(0.5))  # towards 0: nearest, for all that is not above 0
    part = y - np.float32(whole)
    scale = np.int32((whole + np.int32(127)) << 23).view(np.float32)
    e0, e1, e2, e3, e4, e5, e6 = _E
    return scale * (e0 + part * (e1 + part * (e2 + part * (e3 + part * (e4 + part * (e5 + part * e6))))))


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def facet_normals(
    reach: Floats, along: Singles, across: Singles, cos_h: float, sin_h: float, share: float, north: Singles,
    east: Singles, down: Singles, area: Singles,
) -> None:  # fmt: skip
    """Unit normals into the water, and areas, of facets.

    Args:
        reach: Horizontal distance [m], (n,).
        along: Slope along the frame's first axis [1], (n,).
        across: Along its second [1], (n,).
        cos_h: Cosine of the frame's heading.
        sin_h: Its sine.
        share: Step times width of the line's cell [m].
        north: Result, (n,).
        east: Result, (n,).
        down: Result, (n,).
        area: Result [m^2], (n,).
    """
    c, s = np.float32(cos_h), np.float32(sin_h)
    for i in range(reach.size):
        a, b = c * along[i] - s * across[i], s * along[i] + c * across[i]
        stretch = math.sqrt(np.float32(1) + a * a + b * b)
        up = np.float32(1) / stretch
        north[i], east[i], down[i] = -a * up, -b * up, -up
        area[i] = np.float32(reach[i] * share) * stretch


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def straight_legs(
    reach: Floats, depth: Floats, image: float, slowness: float, loss: float, cosine: float, sine: float,
    turned: float, bit: int, bits: Integers, normal_n: Singles, normal_e: Singles, normal_d: Singles,
    ahead_n: Singles, ahead_e: Singles, delay: Floats, into_n: Singles, into_e: Singles, into_d: Singles,
    out_n: Singles, out_e: Singles, out_d: Singles, size: Singles, root_slant: Singles,
) -> None:  # fmt: skip
    """Straight legs of one family to points of one line: delay, directions, spreading with absorption.

    Args:
        reach: Horizontal distance [m], (n,).
        depth: Depths of the points [m], (n,).
        image: Depth of the image source [m].
        slowness: One over the speed of sound [s/m].
        loss: Absorption [octaves of pressure/m].
        cosine: Cosine of the line's bearing.
        sine: Sine of that bearing.
        turned: -1 for an odd number of bounces, else 1.
        bit: Bit of the family in `bits`.
        bits: Families that reach each point, (n,); cleared where its facet faces away.
        normal_n: North component of the facets' unit normals, (n,).
        normal_e: East component, (n,).
        normal_d: Down component, (n,).
        ahead_n: North of the bearing at which the beams are evaluated there [1], (n,).
        ahead_e: East of it, (n,).
        delay: Result [s], (n,).
        into_n: Result, direction of travel at the point, (n,).
        into_e: Result, direction of travel at the point, (n,).
        into_d: Result, direction of travel at the point, (n,).
        out_n: Result, direction at the sonar, (n,).
        out_e: Result, direction at the sonar, (n,).
        out_d: Result, direction at the sonar, (n,).
        size: Result, pressure re 1 m but for bounces, 0 where the leg is not there [1], (n,).
        root_slant: Result, root of one less the sine of the facet's grazing angle [1], (n,).
    """
    c, s, t = np.float32(cosine), np.float32(sine), np.float32(turned)
    mask, least = np.int32(1 << bit), np.float32(loss)
    for i in range(reach.size):
        dz = depth[i] - image
        length = math.sqrt(reach[i] * reach[i] + dz * dz)
        inverse = np.float32(1) / np.float32(length)
        delay[i] = length * slowness
        level, fall = np.float32(reach[i]) * inverse, np.float32(dz) * inverse
        x, y = level * c, level * s
        out_n[i], out_e[i] = level * ahead_n[i], level * ahead_e[i]
        into_n[i], into_e[i], into_d[i], out_d[i] = x, y, fall, fall * t
        off = x * normal_n[i] + y * normal_e[i] + fall * normal_d[i]
        there = ((bits[i] & mask) != 0) & (off < np.float32(0))
        root_slant[i] = math.sqrt(max(np.float32(1) + off, np.float32(0)))
        value = inverse * exp2_of(-least * np.float32(length))
        size[i] = value if there else np.float32(0)
        bits[i] &= np.int32(-1) if there else ~mask


@njit(cache=True, nogil=True, error_model="numpy")
def apply_direction_factor(factor: Singles, root_slant: Singles, size: Singles) -> None:
    """Multiply pressures by the root of what their directions contribute to a law that is a product.

    Args:
        factor: See `walk`.
        root_slant: See `straight_legs`, (n,).
        size: Result, see `amplitude`, (n,).
    """
    rate, last = np.float32(factor.size - 1), np.uint32(factor.size - 2)
    for i in range(size.size):
        place = min(root_slant[i], np.float32(1)) * rate
        cell = min(np.uint32(place), last)
        part = place - np.float32(cell)
        size[i] *= math.sqrt(factor[cell] + part * (factor[cell + np.uint32(1)] - factor[cell]))


@njit(cache=True, nogil=True, error_model="numpy")
def legs_along_radial(
    line: Floats, heading: float, step: float, m: int, speed: float, loss: float, images: Floats,
    bounce_codes: Integers,
    mirrors: NDArray[np.complex64], factor: Singles, families: int, ahead_n: Singles, ahead_e: Singles,
    facet: Singles, bits: Integers, n: int, place: Floats, delay: Floats, amplitude: NDArray[np.complex64],
    departure: Singles, arrival: Singles, normal: Singles,
) -> None:  # fmt: skip
    """Legs to the m points of one line, as rows from n on; other arguments see `walk` and of `points_of`.

    Args:
        line: One row of `lines`, (9,).
        heading: See `walk`.
        step: Distance of the line's own samples [m].
        m: Points.
        speed: See `walk`, like those that follow up to `factor`.
        loss: See `walk`, like those that follow up to `factor`.
        images: See `walk`, like those that follow up to `factor`.
        bounce_codes: See `walk`, like those that follow up to `factor`.
        mirrors: See `walk`, like those that follow up to `factor`.
        factor: See `walk`, like those that follow up to `factor`.
        families: Those that any of the points is wanted by, a bit for each.
        ahead_n: See `straight_legs`, (m,).
        ahead_e: See `straight_legs`, (m,).
        facet: See `points_of`; areas into the fourth row.
        bits: Families that reach each point, (at least m,).
        n: Number of the first point.
        place: See `walk`, like those that follow.
        delay: See `walk`, like those that follow.
        amplitude: See `walk`, like those that follow.
        departure: See `walk`, like those that follow.
        arrival: See `walk`, like those that follow.
        normal: See `walk`, like those that follow.
    """
    stop = n + m
    cos_h, sin_h = math.cos(heading), math.sin(heading)
    cosine, sine = cos_h * line[0] - sin_h * line[1], sin_h * line[0] + cos_h * line[1]
    # rows of whole arrays: the compiler must see that they lie concurrently
    reach, depth, size, area, root_slant = place[0, n:stop], place[1, n:stop], facet[2, :m], facet[3, :m], facet[4, :m]
    north, east, down = normal[0, n:stop], normal[1, n:stop], normal[2, n:stop]
    facet_normals(reach, facet[0, :m], facet[1, :m], cos_h, sin_h, step * line[2], north, east, down, area)
    nodes = mirrors.shape[1] - 1
    for f in range(images.size):
        if families & (1 << f) == 0:
            amplitude[f, n:stop] = 0
            continue
        odd, bounces = 1.0, 0
        for q in range(bounce_codes.shape[1]):
            if bounce_codes[f, q] > 0:
                odd, bounces = -odd, bounces + 1
        straight_legs(reach, depth, images[f], 1 / speed, loss, cosine, sine, odd, f, bits[:m], north, east, down,
                 ahead_n, ahead_e, delay[f, n:stop], arrival[f, 0, n:stop], arrival[f, 1, n:stop],
                 arrival[f, 2, n:stop], departure[f, 0, n:stop], departure[f, 1, n:stop], departure[f, 2, n:stop],
                 size, root_slant)  # fmt: skip
        if factor.size > 0:
            apply_direction_factor(factor, root_slant, size)
        if bounces == 0:
            for i in range(m):
                amplitude[f, n + i] = np.complex64(size[i])
            continue
        for i in range(m):
            at = min(abs(arrival[f, 2, n + i]), np.float32(1)) * np.float32(nodes)
            cell = np.uint64(min(int(at), nodes - 1))  # unsigned, for no index is then looked at twice
            part = np.float32(at - cell)
            low, high = mirrors[f, cell], mirrors[f, cell + np.uint64(1)]
            amplitude[f, n + i] = size[i] * (low + part * (high - low))
