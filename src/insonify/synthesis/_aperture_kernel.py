"""Echoes of a block of scatterers at each element of an array: worked out at a few places along it, laid down at all.

Along a straight array the delay of an echo is as smooth as the array is short against its distance: a few Chebyshev
nodes tell it at every element (`apertures`). Echoes are taken in the order in which they come, whatever legs they came
by, and each is laid down at all elements before the next: so what the processor holds of the grids is what it needs,
and no two spikes in a row touch the same cells. Plain numbers and arrays.
"""

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.cycles import sincos_cycles
from insonify.synthesis._echo_kernel import Ears, Flags, Heard, Integers, Sent, audible, that_echo
from insonify.synthesis._element_kernel import arrive_bent, arrive_moving, arrive_still
from insonify.synthesis._lanes import mix_nodes
from insonify.synthesis._shape_kernel import lay_down_all, shaping, share_out
from insonify.synthesis._spread import _locate
from insonify.synthesis._taps import CELLS_PER_SPIKE

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
_PART = 2048
_TILE = 32
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class Nodes(NamedTuple):
    """Places along an array at which echoes are worked out, k of them."""

    place: Floats
    """From the array's centre, in the world, at the start of the ping [m], (k, 3)."""
    velocity: Floats
    """At the start of the ping [m/s], (k, 3)."""
    acceleration: Floats
    """[m/s^2], (k, 3)."""
    mix: Floats
    """What each counts for at each element [1], (k, elements and up to a multiple of 16)."""


class _Order(NamedTuple):
    """Room for the echoes of a part of the scatterers, in the order in which they come."""

    echo: NDArray[np.int32]
    """Pair of legs times `_PART`, and the scatterer's place in the part, (pairs times `_PART`,)."""
    found: NDArray[np.int32]
    """The same, pair by pair, and one more."""
    key: NDArray[np.int32]
    """Cell in which each would come to the array's centre."""
    starts: NDArray[np.int32]
    """How many come before each cell."""


@njit(cache=True, nogil=True, error_model="numpy")
def _in_order(
    begin: int, first_time: float, cell_rate: float, last: int, pair: Integers, sent: Sent, heard: Heard,
    strength: NDArray[Any], flags: tuple[Flags, Flags, Flags], order: _Order,
) -> int:  # fmt: skip
    """How many echoes a part of the scatterers has; they are put into order, by counting how many come to each cell."""
    total, low, high = 0, last, 0
    end = min(begin + _PART, strength.shape[1])
    outs, backs, hears = flags
    for p in range(pair.shape[0]):
        i, j, row = pair[p]
        found, key = order.found[total:], order.key[total:]
        count = that_echo(
            0, strength[p, begin:end], outs[i, begin:end], backs[j, begin:end], hears[row, begin:end], found
        )
        out, back = sent.delay[i, begin:end], heard.delay[j, begin:end]
        for k in range(count):
            n = np.uintp(found[k])
            position = (out[n] + back[n] - first_time) * cell_rate
            key[k] = int(min(position, float(last))) if position > 0 else 0
            found[k] += p * _PART
            low, high = min(low, int(key[k])), max(high, int(key[k]))
        total += count
    if total == 0:
        return 0
    order.starts[low : high + 2] = 0
    for k in range(total):
        order.starts[np.uintp(order.key[k] + 1)] += 1
    for cell in range(low + 1, high + 2):
        order.starts[cell] += order.starts[cell - 1]
    for k in range(total):
        place = np.uintp(order.key[k])
        order.echo[np.uintp(order.starts[place])] = order.found[k]
        order.starts[place] += 1
    return total


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _weigh(when: Floats, real: Singles, imaginary: Singles, frequency: float, weight: Singles) -> None:
    """Weights with the phase of the carrier, real and imaginary in turn."""
    for k in range(when.size):
        sine, cosine = sincos_cycles(frequency * when[k])
        weight[2 * k] = real[k] * cosine + imaginary[k] * sine
        weight[2 * k + 1] = imaginary[k] * cosine - real[k] * sine


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def spread_to_elements(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, pair: Integers, sent: Sent, heard: Heard,
    strength: NDArray[Any], ears: Ears, nodes: Nodes, slowness: float, gradient: float, loss: float, bent: bool,
    middle: float, frequency: float, node: Floats,
) -> None:  # fmt: skip
    """Echoes of one block by all pairs of legs, for all elements of an array, added to their cells.

    Args:
        cells: As of `spread_echoes`; element e is channel e.
        first_time: Likewise.
        cell_rate: Likewise.
        pair: Likewise.
        sent: Likewise; one beam.
        heard: Likewise.
        strength: Likewise.
        ears: The elements, each with its own channel.
        nodes: Where echoes are worked out.
        slowness: As of `spread_echoes`.
        gradient: Likewise.
        loss: Likewise.
        bent: Likewise.
        middle: Likewise.
        frequency: Likewise.
        node: Likewise.
    """
    last, elements = cells.shape[2] - CELLS_PER_SPIKE, ears.place.shape[0]
    count_of_nodes, wide = nodes.mix.shape
    room, terms, still = pair.shape[0] * _PART, heard.beside.shape[1], middle == 0.0
    order = _Order(np.empty(room, np.int32), np.empty(room + 1, np.int32), np.empty(room, np.int32),
                   np.empty(cells.shape[2] + 2, np.int32))  # fmt: skip
    flags = audible(sent, heard)
    tau, bend, away, behind = np.empty(_TILE), np.empty(_TILE), np.empty(_TILE), np.empty(_TILE)
    u, v, w, r = np.empty(_TILE), np.empty(_TILE), np.empty(_TILE), np.empty(_TILE)
    beside, source = np.empty((terms, _TILE)), np.empty(2 * _TILE, np.float32)
    when_at, doppler = np.empty((count_of_nodes, _TILE)), np.empty(_TILE)
    others = np.zeros((3, count_of_nodes, _TILE), np.float32)
    real_at, imaginary_at, x_at = others[0], others[1], others[2]
    fade, size = np.empty(_TILE, np.float32), _TILE * wide
    when, mixed = np.empty(size), np.empty((3, size), np.float32)
    real, imaginary, x = mixed[0], mixed[1], mixed[2]
    at, place, weight = np.empty(size, np.int32), np.empty(size, np.float32), np.empty(2 * size, np.float32)
    shaped, single = shaping(node), nodes.mix.astype(np.float32)
    share = np.zeros((4 * cells.shape[1], size if cells.shape[1] > 1 else 1), np.float32)
    once = 1 / shaped.half if node.size > 1 else 0.0
    alike = True
    for e in range(elements):
        alike = alike and ears.pattern[e] == 0
    for begin in range(0, strength.shape[1], _PART):
        total = _in_order(begin, first_time, cell_rate, last, pair, sent, heard, strength, flags, order)
        for tile in range(0, total, _TILE):
            count = min(_TILE, total - tile)
            echo = order.echo[tile : tile + count]
            for k in range(count):
                p, n = np.uintp(echo[k] // _PART), np.uintp(begin + echo[k] % _PART)
                i, j, row = np.uintp(pair[p, 0]), np.uintp(pair[p, 1]), np.uintp(pair[p, 2])
                tau[k] = sent.delay[i, n] + heard.delay[j, n]
                bend[k], behind[k] = heard.bend[j, n], sent.following[i, n]
                u[k], v[k], w[k] = heard.towards[j, n, 0], heard.towards[j, n, 1], heard.towards[j, n, 2]
                whole = sent.weight[0, i, n] * heard.weight[j, n] * np.complex64(strength[p, n])
                if alike:
                    whole *= heard.gain[row, 0, n]
                source[2 * k], source[2 * k + 1] = whole.real, whole.imag
                if bent:
                    away[k] = heard.away[j, n]
                    for t in range(terms):
                        beside[t, k] = heard.beside[j, t, n]
            for k in range(count):
                r[k] = 1 / bend[k]
            for k in range(count_of_nodes):
                here, velocity, acceleration = nodes.place[k], nodes.velocity[k], nodes.acceleration[k]
                if bent:
                    arrive_bent(tau[:count], bend, away, u, v, w, behind, beside, here, velocity, acceleration,
                                slowness, gradient, loss, middle, when_at[k], fade, doppler)  # fmt: skip
                elif still:
                    arrive_still(tau[:count], r, u, v, w, here, slowness, loss, when_at[k], fade)
                else:
                    arrive_moving(tau[:count], r, u, v, w, behind, here, velocity, acceleration, slowness, loss,
                                  middle, when_at[k], fade, doppler)  # fmt: skip
                for m in range(count):
                    real_at[k, m], imaginary_at[k, m] = fade[m] * source[2 * m], fade[m] * source[2 * m + 1]
                if node.size > 1:
                    for m in range(count):
                        x_at[k, m] = np.float32((doppler[m] - shaped.middle) * once)
            for k in range(count):
                mix_nodes(nodes.mix, single, when_at, others, (count_of_nodes, wide, _TILE), np.intp(k), when, mixed)
            if node.size > 1:
                for k in range(count * wide):
                    x[k] = min(max(x[k], np.float32(-1)), np.float32(1))
            if cells.shape[1] > 1:
                share_out(x[: count * wide], shaped.node, shaped.scale, share)
            if not alike:
                for k in range(count):
                    p, n = echo[k] // _PART, begin + echo[k] % _PART
                    for e in range(elements):
                        gain = heard.gain[pair[p, 2], ears.pattern[e], n] if ears.pattern[e] >= 0 else np.float32(0)
                        real[k * wide + e] *= gain
                        imaginary[k * wide + e] *= gain
            _locate(when[: count * wide], first_time, cell_rate, last, at, place)
            _weigh(when[: count * wide], real, imaginary, frequency, weight)
            lay_down_all(cells, 0, elements, wide, at, place, weight, x, shaped, share, count)
