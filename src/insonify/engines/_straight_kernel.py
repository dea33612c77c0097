"""Straight legs to the points of one line: delay, directions, pressure, facets. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

GOLDEN = 0.6180339887498949
_FAST = {"contract", "reassoc", "nsz", "arcp"}
_E = tuple(np.float32(c) for c in (1.0, 0.69314718, 0.24022651, 0.05550411, 0.00961813, 0.00133336, 0.00015404))


@njit(inline="always")
def exp2_of(x: Any) -> Any:
    """2^x for x up to 0, within 1e-6 of itself; nothing below 2^-100."""
    y: Any = max(x, np.float32(-100.0))
    whole = np.int32(y - np.float32(0.5))  # towards 0: nearest, for all that is not above 0
    part = y - np.float32(whole)
    scale = np.int32((whole + np.int32(127)) << 23).view(np.float32)
    e0, e1, e2, e3, e4, e5, e6 = _E
    return scale * (e0 + part * (e1 + part * (e2 + part * (e3 + part * (e4 + part * (e5 + part * e6))))))


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def tilted(
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
def straight(
    reach: Floats, depth: Floats, image: float, slowness: float, loss: float, cosine: float, sine: float,
    turned: float, bit: int, bits: Integers, normal_n: Singles, normal_e: Singles, normal_d: Singles, delay: Floats,
    into_n: Singles, into_e: Singles, into_d: Singles, out_d: Singles, size: Singles,
    slant: Singles,
) -> None:  # fmt: skip
    """Straight legs of one family to points of one line: delay, directions, spreading with absorption.

    Args:
        reach: Horizontal distance [m], (n,).
        depth: Of the points [m], (n,).
        image: Depth of the image source [m].
        slowness: One over the speed of sound [s/m].
        loss: Absorption [octaves of pressure/m].
        cosine: Of the line's bearing.
        sine: Likewise.
        turned: -1 for an odd number of bounces, else 1.
        bit: Of the family in `bits`.
        bits: Families that reach each point, (n,); cleared where its facet looks away.
        normal_n: Of the facets, (n,).
        normal_e: Likewise.
        normal_d: Likewise.
        delay: Result [s], (n,).
        into_n: Result, direction of travel at the point, (n,).
        into_e: Likewise.
        into_d: Likewise.
        out_d: Result, vertical part of the direction at the sonar, (n,).
        size: Result, pressure re 1 m but for bounces, 0 where the leg is not there [1], (n,).
        slant: Result, root of one less the sine of the facet's grazing angle [1], (n,).
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
        into_n[i], into_e[i], into_d[i], out_d[i] = x, y, fall, fall * t
        off = x * normal_n[i] + y * normal_e[i] + fall * normal_d[i]
        there = ((bits[i] & mask) != 0) & (off < np.float32(0))
        slant[i] = math.sqrt(max(np.float32(1) + off, np.float32(0)))
        value = inverse * exp2_of(-least * np.float32(length))
        size[i] = value if there else np.float32(0)
        bits[i] &= np.int32(-1) if there else ~mask


@njit(cache=True, nogil=True, error_model="numpy")
def shared_out(factor: Singles, slant: Singles, size: Singles) -> None:
    """Multiply pressures by the root of what their directions contribute to a law that is a product.

    Args:
        factor: As of `walk`.
        slant: As of `straight`, (n,).
        size: Result, likewise, (n,).
    """
    rate, last = np.float32(factor.size - 1), np.uint32(factor.size - 2)
    for i in range(size.size):
        place = min(slant[i], np.float32(1)) * rate
        cell = min(np.uint32(place), last)
        part = place - np.float32(cell)
        size[i] *= math.sqrt(factor[cell] + part * (factor[cell + np.uint32(1)] - factor[cell]))


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def aside(which: Integers, shift: float, width: float, cosine: float, sine: float, out_n: Singles, out_e: Singles,
          into_n: Singles, into_e: Singles) -> None:  # fmt: skip
    """Directions at the sonar, turned within the width of the line's cell, another part of it for each sample.

    Args:
        which: Number of each sample, (n,).
        shift: Place within the width of sample 0 [1].
        width: Of the cell, 0 for its middle alone [rad].
        cosine: Of the line's bearing.
        sine: Likewise.
        out_n: Result, (n,).
        out_e: Result, (n,).
        into_n: Direction at the point, (n,).
        into_e: Likewise.
    """
    for i in range(which.size):
        place = shift + (which[i] + 0.5) * GOLDEN
        turn = np.float32((place - math.floor(place) - 0.5) * width)
        middle = np.float32(1) - np.float32(0.5) * turn * turn
        out_n[i] = into_n[i] * middle - into_e[i] * turn
        out_e[i] = into_e[i] * middle + into_n[i] * turn


@njit(cache=True, nogil=True, error_model="numpy")
def legs_along(
    line: Floats, heading: float, step: float, m: int, speed: float, loss: float, images: Floats, letters: Integers,
    mirrors: NDArray[np.complex64], factor: Singles, wanted: Integers, kept: Floats, facet: Singles, bits: Integers,
    n: int, delay: Floats, amplitude: NDArray[np.complex64], departure: Singles, arrival: Singles, normal: Singles,
) -> None:  # fmt: skip
    """Legs to the m points of one line, as rows from n on; other arguments as of `walk` and `points_of`."""
    stop = n + m
    cos_h, sin_h = math.cos(heading), math.sin(heading)
    cosine, sine = cos_h * line[0] - sin_h * line[1], sin_h * line[0] + cos_h * line[1]
    reach, depth, size, area, slant = kept[0, :m], kept[1, :m], facet[2, :m], facet[3, :m], facet[4, :m]
    north, east, down = normal[0, n:stop], normal[1, n:stop], normal[2, n:stop]
    tilted(reach, facet[0, :m], facet[1, :m], cos_h, sin_h, step * line[2], north, east, down, area)
    nodes = mirrors.shape[1] - 1
    for f in range(images.size):
        if wanted[f].max() == 0:
            amplitude[f, n:stop] = 0
            continue
        odd, bounces = 1.0, 0
        for q in range(letters.shape[1]):
            if letters[f, q] > 0:
                odd, bounces = -odd, bounces + 1
        straight(reach, depth, images[f], 1 / speed, loss, cosine, sine, odd, f, bits[0, :m], north, east, down,
                 delay[f, n:stop], arrival[f, 0, n:stop], arrival[f, 1, n:stop], arrival[f, 2, n:stop],
                 departure[f, 2, n:stop], size, slant)  # fmt: skip
        if factor.size > 0:
            shared_out(factor, slant, size)
        aside(bits[1, :m], line[7] * GOLDEN, line[3], cosine, sine, departure[f, 0, n:stop], departure[f, 1, n:stop],
              arrival[f, 0, n:stop], arrival[f, 1, n:stop])  # fmt: skip
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
