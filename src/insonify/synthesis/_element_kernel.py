"""Echoes laid down for every element of an array that may be under way: the innermost loops of element recordings.

A leg is known at the array's centre, at the start of the ping. Over the array, and over the way that it goes until the
echo comes, the wavefront is a sphere about the leg's image source: the distance to an element at d from the centre is
|r u - d|, with u the leg's direction away from the sonar and r its radius, so that

    r' - r = (|d|^2 - 2 r u . d) / (|r u - d| + r)

without a difference of two nearly equal numbers. It is exact in water of one sound speed. Where rays bend, the
wavefront has a curvature of its own in the vertical plane, and the gradient at the array adds a term (`arrive_bent`).
Plain numbers and arrays.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.synthesis._fastmath import sincos_cycles
from insonify.synthesis._spread import _lay_down, _locate
from insonify.synthesis._taps import CELLS_PER_SPIKE

Floats = NDArray[np.float64]
CLOSEST = 0.01
"""Distance below which the sphere about a scatterer grows no louder [m]."""
_BLOCK = 512
_FAST = {"contract", "reassoc", "nsz", "arcp"}


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def arrive_still(
    delay: Floats, radius: Floats, north: Floats, east: Floats, down: Floats, place: Floats, slowness: float,
    when: Floats, fade: NDArray[Any],
) -> None:  # fmt: skip
    """When echoes reach an element that stands still, and by what its distance changes their pressure.

    Args:
        delay: At the centre [s], (n,).
        radius: Of the wavefronts [m], (n,).
        north: Direction to where each comes from, away from the sonar, (n,).
        east: Likewise.
        down: Likewise.
        place: Of the element from the centre, in the world [m], (3,).
        slowness: Of sound at the array [s/m].
        when: Result [s], (n,).
        fade: Result, spreading at the element over that at the centre [1], (n,).
    """
    x, y, z = place[0], place[1], place[2]
    square = x * x + y * y + z * z
    for i in range(delay.size):
        r = radius[i]
        part = square - 2 * r * (north[i] * x + east[i] * y + down[i] * z)
        there = max(math.sqrt(max(r * r + part, 0.0)), CLOSEST)
        both = there + r
        once = 1 / (both * there)  # one division for two: they are what takes the time
        when[i] = delay[i] + part * there * once * slowness
        fade[i] = np.float32(r * both * once)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def arrive_moving(
    delay: Floats, radius: Floats, north: Floats, east: Floats, down: Floats, following: Floats, place: Floats,
    velocity: Floats, acceleration: Floats, slowness: float, middle: float, when: Floats, fade: NDArray[Any],
    doppler: Floats,
) -> None:  # fmt: skip
    """The same for an element under way: its place is that of the moment when the pulse's middle comes.

    Two Newton steps find that moment. Shapes are stretched about their middle, so an echo is where its middle is, less
    half of the pulse as it was sent.

    Args:
        delay: Of the pulse's middle at the centre, had it stayed, its sending included [s], (n,).
        radius: Likewise.
        north: Likewise.
        east: Likewise.
        down: Likewise.
        following: One over one less the part of the speed of sound at which the transmitter follows what it sends
            [1], (n,).
        place: Of the element from the centre, at the start of the ping [m], (3,).
        velocity: Of the element at the start of the ping [m/s], (3,).
        acceleration: Of the element [m/s^2], (3,).
        slowness: As of `arrive_still`.
        middle: Time from the pulse's start to its middle [s].
        when: As of `arrive_still`.
        fade: Likewise.
        doppler: Result, d(emission) / d(arrival) - 1 [1], (n,).
    """
    for i in range(delay.size):
        r, u, v, w = radius[i], north[i], east[i], down[i]
        rate = 1 - (u * velocity[0] + v * velocity[1] + w * velocity[2]) * slowness  # a step's length may be inexact
        tau = delay[i]
        half = 0.5 * tau
        x = place[0] + tau * (velocity[0] + half * acceleration[0])
        y = place[1] + tau * (velocity[1] + half * acceleration[1])
        z = place[2] + tau * (velocity[2] + half * acceleration[2])
        part = x * x + y * y + z * z - 2 * r * (u * x + v * y + w * z)
        tau += part / (math.sqrt(max(r * r + part, 0.0)) + r) * slowness * rate
        half = 0.5 * tau
        x = place[0] + tau * (velocity[0] + half * acceleration[0])
        y = place[1] + tau * (velocity[1] + half * acceleration[1])
        z = place[2] + tau * (velocity[2] + half * acceleration[2])
        part = x * x + y * y + z * z - 2 * r * (u * x + v * y + w * z)
        there = max(math.sqrt(max(r * r + part, 0.0)), CLOSEST)
        both = there + r
        once = 1 / (both * there)
        closing = (
            (r * u - x) * (velocity[0] + tau * acceleration[0])
            + (r * v - y) * (velocity[1] + tau * acceleration[1])
            + (r * w - z) * (velocity[2] + tau * acceleration[2])
        ) * (both * once * slowness)
        tau += (delay[i] + part * there * once * slowness - tau) * rate
        fade[i] = np.float32(r * both * once)
        doppler[i] = (1 + closing) * following[i] - 1
        when[i] = tau - middle


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def arrive_bent(
    delay: Floats, bend: Floats, away: Floats, north: Floats, east: Floats, down: Floats, following: Floats,
    place: Floats, velocity: Floats, acceleration: Floats, slowness: float, gradient: float, middle: float,
    when: Floats, fade: NDArray[Any], doppler: Floats,
) -> None:  # fmt: skip
    """The same where rays bend, for an element that may be under way; the expansion of `propagation.elements`.

    Args:
        delay: As of `arrive_moving`.
        bend: Curvature of the wavefronts in the vertical plane [1/m], (n,).
        away: Horizontal distance to where each comes from [m], (n,).
        north: As of `arrive_still`.
        east: Likewise.
        down: Likewise.
        following: As of `arrive_moving`.
        place: Likewise.
        velocity: Likewise.
        acceleration: Likewise.
        slowness: Likewise.
        gradient: Growth of the speed of sound with depth at the array [1/s].
        middle: As of `arrive_moving`.
        when: Likewise.
        fade: Likewise.
        doppler: Likewise.
    """
    half_gradient = 0.5 * gradient * slowness * slowness
    for i in range(delay.size):
        u, v, w, b, far = north[i], east[i], down[i], bend[i], away[i]
        cosine = math.sqrt(max(u * u + v * v, 1e-30))
        level = 1 / cosine
        rate = 1 - (u * velocity[0] + v * velocity[1] + w * velocity[2]) * slowness
        tau, over, closing = delay[i], 1.0, 0.0
        for _ in range(2):
            half = 0.5 * tau
            x = place[0] + tau * (velocity[0] + half * acceleration[0])
            y = place[1] + tau * (velocity[1] + half * acceleration[1])
            z = place[2] + tau * (velocity[2] + half * acceleration[2])
            ahead, square = (x * u + y * v) * level, x * x + y * y
            # How much closer the element is over ground, without a difference of nearly equal numbers.
            closer = 2 * far * ahead - square
            closer /= far + math.sqrt(max(far * far - closer, 0.0))
            along, aside = closer * cosine + z * w, z * cosine - closer * w
            square = closer * closer + z * z
            root = max(math.sqrt(max(1 - 2 * b * along + b * b * square, 0.0)), 1e-3)
            once = 1 / ((1 + root) * root)
            over = (1 + root) * once
            later = (b * square - 2 * along) * root * once * slowness
            later += half_gradient * (w * along * along + 2 * cosine * along * aside)
            closing = (
                (u - b * x) * (velocity[0] + tau * acceleration[0])
                + (v - b * y) * (velocity[1] + tau * acceleration[1])
                + (w - b * z) * (velocity[2] + tau * acceleration[2])
            ) * over
            tau += (delay[i] + later - tau) * rate
        fade[i] = np.float32(over)
        doppler[i] = (1 + closing * slowness) * following[i] - 1
        when[i] = tau - middle


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _shares(doppler: Floats, node: Floats, scale: Floats, share: NDArray[Any], running: NDArray[Any]) -> None:
    """What each shape contributes to echoes: Lagrange's polynomials over Chebyshev's nodes; flat beyond their range.

    Products of the distances from the nodes before each, then from those after it, in units of half the range.
    """
    middle, shapes = 0.5 * (node[0] + node[-1]), node.size
    half = 0.5 * (node[-1] - node[0]) / math.cos(0.5 * math.pi / shapes)
    count = doppler.size
    for s in range(shapes):
        size, at = np.float32(scale[s] * half ** (shapes - 1)), np.float32((node[max(s - 1, 0)] - middle) / half)
        for i in range(count):
            x = np.float32(min(max((doppler[i] - middle) / half, -1.0), 1.0))
            running[i] = running[i] * (x - at) if s > 0 else np.float32(1)
            share[s, i] = size * running[i]
    for s in range(shapes - 1, -1, -1):
        at = np.float32((node[min(s + 1, shapes - 1)] - middle) / half)
        for i in range(count):
            x = np.float32(min(max((doppler[i] - middle) / half, -1.0), 1.0))
            running[i] = running[i] * (x - at) if s < shapes - 1 else np.float32(1)
            share[s, i] *= running[i]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _turn(when: Floats, fade: NDArray[Any], weight: NDArray[Any], gain: NDArray[Any], frequency: float,
          turned: NDArray[Any]) -> None:  # fmt: skip
    """Weights with the element's gain and the phase of the carrier, real and imaginary in turn."""
    for i in range(when.size):
        sine, cosine = sincos_cycles(frequency * when[i])
        size = fade[i] * gain[i]
        turned[2 * i] = size * (weight[2 * i] * cosine + weight[2 * i + 1] * sine)
        turned[2 * i + 1] = size * (weight[2 * i + 1] * cosine - weight[2 * i] * sine)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _scaled(turned: NDArray[Any], share: NDArray[Any], count: int, part: NDArray[Any]) -> None:
    """Weights times the share of one shape."""
    for i in range(count):
        part[2 * i] = turned[2 * i] * share[i]
        part[2 * i + 1] = turned[2 * i + 1] * share[i]


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def spread_elements(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, delay: Floats, bend: Floats, away: Floats,
    towards: Floats, leaving: Floats, weight: NDArray[np.complex64], gain: NDArray[np.float32],
    facing: NDArray[np.int64], place: Floats, velocity: Floats, acceleration: Floats, slowness: float,
    gradient: float, bent: bool, middle: float, frequency: float, node: Floats, scale: Floats,
) -> None:  # fmt: skip
    """Echoes of one pair of legs, for all elements of an array, added to their cells.

    Args:
        cells: Grids of pressure, shape (elements, shapes, cells): one for every shape that echoes come in.
        first_time: Time of the first cell [s].
        cell_rate: Cells per second [Hz].
        delay: Out and back, at the centre at the start of the ping [s], (n,).
        bend: Curvature of the wavefronts that come back, in the vertical plane [1/m], (n,).
        away: Horizontal distance to where each comes from [m], (n,).
        towards: Direction that each comes from, away from the sonar, (3, n).
        leaving: Part of the speed of sound at which the transmitter follows the sound it sends [1], (n,).
        weight: Of each echo, without carrier, (n,).
        gain: Of an element that faces each way [1], (facings, n).
        facing: Row of `gain` of each element, -1 for one that is dead, (elements,).
        place: Of the elements from the centre, in the world, at the start of the ping [m], (elements, 3).
        velocity: Of each element at the start of the ping [m/s], (elements, 3).
        acceleration: Of each element [m/s^2], (elements, 3).
        slowness: Of sound at the array [s/m].
        gradient: Growth of the speed of sound with depth at the array [1/s].
        bent: Whether rays bend.
        middle: Time from the pulse's start to its middle, for an array under way; 0 for one that stands [s].
        frequency: Of the carrier [Hz].
        node: Doppler factor less one of each shape [1], (shapes,).
        scale: One over the product of its distances from the others, (shapes,).
    """
    last = cells.shape[2] - CELLS_PER_SPIKE
    at, inside = np.empty(_BLOCK, np.int32), np.empty(_BLOCK, np.float32)
    turned, part = np.empty(2 * _BLOCK, np.float32), np.empty(2 * _BLOCK, np.float32)
    when, doppler = np.empty(_BLOCK), np.empty(_BLOCK)
    fade, running = np.empty(_BLOCK, np.float32), np.empty(_BLOCK, np.float32)
    share, following = np.empty((node.size, _BLOCK), np.float32), 1 / (1 - leaving)
    still = middle == 0.0
    for begin in range(0, delay.size, _BLOCK):
        stop = min(begin + _BLOCK, delay.size)
        count = stop - begin
        tau, curve, behind = delay[begin:stop], bend[begin:stop], following[begin:stop]
        u, v, w = towards[0][begin:stop], towards[1][begin:stop], towards[2][begin:stop]
        r = 1 / curve
        source = weight[begin:stop].view(np.float32)
        for e in range(cells.shape[0]):
            if facing[e] < 0:
                continue
            if bent:
                arrive_bent(tau, curve, away[begin:stop], u, v, w, behind, place[e], velocity[e], acceleration[e],
                            slowness, gradient, middle, when[:count], fade, doppler[:count])  # fmt: skip
            elif still:
                arrive_still(tau, r, u, v, w, place[e], slowness, when[:count], fade)
            else:
                arrive_moving(tau, r, u, v, w, behind, place[e], velocity[e], acceleration[e], slowness, middle,
                              when[:count], fade, doppler[:count])  # fmt: skip
            _locate(when[:count], first_time, cell_rate, last, at, inside)
            _turn(when[:count], fade, source, gain[facing[e]][begin:stop], frequency, turned)
            if node.size == 1:
                _lay_down(cells[e, 0].view(np.float32), at, inside, turned, count)
                continue
            _shares(doppler[:count], node, scale, share, running)
            for s in range(node.size):
                _scaled(turned, share[s], count, part)
                _lay_down(cells[e, s].view(np.float32), at, inside, part, count)
