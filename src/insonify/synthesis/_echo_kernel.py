"""Echoes of a block of scatterers, laid down by all pairs of legs, for all channels.

The innermost loops of element recordings, and of beams under way. Legs are known at the arrays' centres, one by one;
here they meet. For each pair of them, those scatterers that have an echo are gathered, so that what follows runs over
numbers side by side; then each ear, a place that hears, is asked when they come (`_element_kernel`), and each channel
that hears there lays them down with its own weights. Beams share one ear, the array's centre; elements have one each.
Plain numbers and arrays.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.synthesis._element_kernel import arrive_bent, arrive_moving, arrive_still
from insonify.synthesis._fastmath import sincos_cycles
from insonify.synthesis._lanes import add_shaped_spike
from insonify.synthesis._spread import _lay_down, _locate
from insonify.synthesis._taps import CELLS_PER_SPIKE

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
_BLOCK = 512
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class Sent(NamedTuple):
    """Legs from the transmitter's centre to n scatterers, f of them."""

    delay: Floats
    """Of the pulse's middle at the scatterer, for a transmitter under way; of its start for one at rest [s], (f, n)."""
    following: Floats
    """One over one less the part of the speed of sound at which the transmitter follows what it sends [1], (f, n)."""
    weight: NDArray[np.complex64]
    """Pressure at the scatterer by each transmit beam, without carrier [uPa], (beams, f, n)."""


class Heard(NamedTuple):
    """Legs from the receiver's centre to the same scatterers, g of them, travelled the other way."""

    delay: Floats
    """[s], (g, n)."""
    bend: Floats
    """Curvature of the wavefronts that come back, in the vertical plane [1/m], (g, n)."""
    away: Floats
    """Horizontal distance to where each comes from [m], (g, n)."""
    beside: Floats
    """What they have beyond spheres, see `propagation.beside`, (g, terms, n); or (g, 0, n)."""
    towards: Floats
    """Direction that each comes from, away from the sonar, (g, n, 3)."""
    weight: NDArray[np.complex64]
    """What is left of the pressure at 1 m from the scatterer, without carrier [1], (g, n)."""
    gain: NDArray[np.float32]
    """Of each ear's pattern, for each leg or each pair of legs [1], (legs or pairs, patterns, n)."""


class Ears(NamedTuple):
    """Places that hear, and the channels that hear there."""

    place: Floats
    """From the array's centre, in the world, at the start of the ping [m], (ears, 3)."""
    velocity: Floats
    """At the start of the ping [m/s], (ears, 3)."""
    acceleration: Floats
    """[m/s^2], (ears, 3)."""
    channels: Integers
    """First channel of each, and the one after its last, (ears, 2)."""
    beam: Integers
    """Transmit beam of each channel, (channels,)."""
    pattern: Integers
    """Pattern of each channel, -1 for one that is deaf, (channels,)."""


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


@njit(inline="always")
def _lay_down_shapes(
    cells: NDArray[np.float32], apart: int, at: NDArray[np.int32], place: NDArray[np.float32],
    weight: NDArray[np.float32], share: NDArray[np.float32], count: int,
) -> None:  # fmt: skip
    """The spikes of a block on the grids of all shapes, which lie side by side."""
    shares, shapes = share.ravel(), np.intp(share.shape[0])
    for i in range(count):
        if at[i] >= 0 and (weight[2 * i] != 0 or weight[2 * i + 1] != 0):
            add_shaped_spike(
                cells, np.intp(apart), np.intp(at[i]), place[i], weight, shares, np.intp(_BLOCK), shapes, i
            )


@njit(cache=True, nogil=True, error_model="numpy")
def _has_echo(sent: Sent, heard: Heard, strength: Any, gain_row: int, i: int, j: int, n: int) -> bool:
    """Whether anything of one scatterer is heard by one pair of legs in any channel."""
    if strength == 0 or heard.weight[j, n] == 0:
        return False
    for beam in range(sent.weight.shape[0]):
        if sent.weight[beam, i, n] != 0:
            for pattern in range(heard.gain.shape[1]):
                if heard.gain[gain_row, pattern, n] != 0:
                    return True
    return False


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def spread_echoes(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, pair: Integers, sent: Sent, heard: Heard,
    strength: NDArray[Any], ears: Ears, slowness: float, gradient: float, loss: float, bent: bool, middle: float,
    frequency: float, node: Floats, scale: Floats,
) -> None:  # fmt: skip
    """Echoes of one block by all pairs of legs, for all channels, added to their cells.

    Args:
        cells: Grids of pressure, shape (channels, shapes, cells): one for every shape that echoes come in.
        first_time: Time of the first cell [s].
        cell_rate: Cells per second [Hz].
        pair: Row of the leg out, of the leg back and of the gain of each pair, (p, 3).
        sent: The legs out.
        heard: The legs back.
        strength: What each scatterer makes of each pair, real or complex, (p, n).
        ears: Who hears.
        slowness: Of sound at the array [s/m].
        gradient: Growth of the speed of sound with depth at the array [1/s].
        loss: Part of the pressure that the water takes on a metre [1/m].
        bent: Whether rays bend.
        middle: Time from the pulse's start to its middle, for an array under way; 0 for one that stands [s].
        frequency: Of the carrier [Hz].
        node: Doppler factor less one of each shape [1], (shapes,).
        scale: One over the product of its distances from the others, (shapes,).
    """
    last = cells.shape[2] - CELLS_PER_SPIKE
    at, inside, which = np.empty(_BLOCK, np.int32), np.empty(_BLOCK, np.float32), np.empty(_BLOCK, np.int64)
    tau, curve, away, behind = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    u, v, w, r = np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK), np.empty(_BLOCK)
    source, tuned = np.empty(2 * _BLOCK, np.float32), np.empty(_BLOCK, np.float32)
    turned = np.empty(2 * _BLOCK, np.float32)
    when, doppler = np.empty(_BLOCK), np.empty(_BLOCK)
    fade, running = np.empty(_BLOCK, np.float32), np.empty(_BLOCK, np.float32)
    share = np.empty((node.size, _BLOCK), np.float32)
    terms, still = heard.beside.shape[1], middle == 0.0
    beside = np.empty((terms, _BLOCK))
    for begin in range(0, strength.shape[1], _BLOCK):
        for p in range(pair.shape[0]):
            i, j, gain_row = pair[p]
            count = 0
            for n in range(begin, min(begin + _BLOCK, strength.shape[1])):
                if _has_echo(sent, heard, strength[p, n], gain_row, i, j, n):
                    which[count] = n
                    tau[count] = sent.delay[i, n] + heard.delay[j, n]
                    curve[count], behind[count] = heard.bend[j, n], sent.following[i, n]
                    u[count], v[count], w[count] = heard.towards[j, n]
                    count += 1
            if count == 0:
                continue
            for k in range(count):
                r[k] = 1 / curve[k]
            if bent:
                for k in range(count):
                    away[k] = heard.away[j, which[k]]
                for t in range(terms):
                    for k in range(count):
                        beside[t, k] = heard.beside[j, t, which[k]]
            beam, pattern = -1, -1
            for e in range(ears.place.shape[0]):
                place, velocity, acceleration = ears.place[e], ears.velocity[e], ears.acceleration[e]
                if bent:
                    arrive_bent(tau[:count], curve, away, u, v, w, behind, beside, place, velocity, acceleration,
                                slowness, gradient, loss, middle, when, fade, doppler)  # fmt: skip
                elif still:
                    arrive_still(tau[:count], r, u, v, w, place, slowness, loss, when, fade)
                else:
                    arrive_moving(tau[:count], r, u, v, w, behind, place, velocity, acceleration, slowness, loss,
                                  middle, when, fade, doppler)  # fmt: skip
                _locate(when[:count], first_time, cell_rate, last, at, inside)
                if node.size > 1:
                    _shares(doppler[:count], node, scale, share, running)
                for c in range(ears.channels[e, 0], ears.channels[e, 1]):
                    if ears.pattern[c] < 0:
                        continue
                    if ears.beam[c] != beam:
                        beam = ears.beam[c]
                        for k in range(count):
                            n = which[k]
                            weight = sent.weight[beam, i, n] * heard.weight[j, n] * strength[p, n]
                            source[2 * k], source[2 * k + 1] = weight.real, weight.imag
                    if ears.pattern[c] != pattern:
                        pattern = ears.pattern[c]
                        for k in range(count):
                            tuned[k] = heard.gain[gain_row, pattern, which[k]]
                    _turn(when[:count], fade, source, tuned, frequency, turned)
                    if node.size == 1:
                        _lay_down(cells[c, 0].view(np.float32), at, inside, turned, count)
                        continue
                    grids = cells[c].view(np.float32)
                    _lay_down_shapes(grids.ravel(), grids.shape[1], at, inside, turned, share, count)
