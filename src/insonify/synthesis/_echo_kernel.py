"""Echoes of a block of scatterers, laid down by all pairs of legs, for all channels.

The innermost loops of element recordings, and of beams under way. Legs are known at the arrays' centres, one by one;
here they meet. For each pair of them, those scatterers that have an echo are gathered, so that what follows runs over
numbers side by side; then each ear, a place that hears, is asked when they come (`_element_kernel`), and each channel
that hears there lays them down with its own weights. Beams share one ear, the array's centre; elements have one each.
Plain numbers and arrays.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.cycles import sincos_cycles
from insonify.jit import njit
from insonify.synthesis._element_kernel import arrive_bent, arrive_moving, arrive_still
from insonify.synthesis._shape_kernel import Shaping, lay_down_all, place_among, shaping, share_out
from insonify.synthesis._spread import _locate
from insonify.synthesis._taps import CELLS_PER_SPIKE

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Flags = NDArray[np.uint8]
BLOCK = 1024
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
def _turn(when: Floats, fade: NDArray[Any], weight: NDArray[Any], gain: NDArray[Any], frequency: float,
          turned: NDArray[Any]) -> None:  # fmt: skip
    """Weights with the element's gain and the phase of the carrier, real and imaginary in turn."""
    for i in range(when.size):
        sine, cosine = sincos_cycles(frequency * when[i])
        size = fade[i] * gain[i]
        turned[2 * i] = size * (weight[2 * i] * cosine + weight[2 * i + 1] * sine)
        turned[2 * i + 1] = size * (weight[2 * i + 1] * cosine - weight[2 * i] * sine)


@njit(cache=True, nogil=True, error_model="numpy")
def audible(sent: Sent, heard: Heard) -> tuple[Flags, Flags, Flags]:
    """Whether legs out bring anything in any beam, (f, n), legs back, (g, n); whether a pattern hears, (rows, n)."""
    beams, legs, n = sent.weight.shape
    out, ear = np.zeros((legs, n), np.uint8), np.zeros((heard.gain.shape[0], n), np.uint8)
    back = np.zeros(heard.weight.shape, np.uint8)
    for beam in range(beams):
        for i in range(legs):
            for k in range(n):
                out[i, k] |= sent.weight[beam, i, k] != 0
    for j in range(heard.weight.shape[0]):
        for k in range(n):
            back[j, k] = heard.weight[j, k] != 0
    for row in range(heard.gain.shape[0]):
        for pattern in range(heard.gain.shape[1]):
            for k in range(n):
                ear[row, k] |= heard.gain[row, pattern, k] != 0
    return out, back, ear


@njit(cache=True, nogil=True, error_model="numpy")
def that_echo(begin: int, strength: NDArray[Any], out: Flags, back: Flags, ear: Flags, which: NDArray[np.int32]) -> int:
    """How many scatterers of a part have an echo by one pair of legs, and which.

    Args:
        begin: Number of the first of the part.
        strength: What each makes of the pair, (part,).
        out: Of `audible`, of the leg out, (part,).
        back: Likewise, of the leg back.
        ear: Likewise, of those that hear.
        which: Result; one longer than the part.
    """
    count = 0
    for k in range(strength.size):  # without a branch, which would be foreseen too seldom
        which[np.uintp(count)] = begin + k
        count += out[k] & back[k] & ear[k] & np.uint8(strength[k] != 0)
    return count


class Room(NamedTuple):
    """Room for the echoes of some scatterers, up to `BLOCK`, by one pair of legs."""

    which: NDArray[np.int32]
    """Which scatterers have one; one more."""
    answer: NDArray[np.complex64]
    """What these make of the pair."""
    column: tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]
    """What `arrive_moving` and `arrive_bent` ask for: delay, bend, distance, following, direction, radius; what they
    tell: time, Doppler factor."""
    beside: Floats
    at: NDArray[np.int32]
    """First cells."""
    single: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
    """Place between cells, gain, spreading, place among shapes."""
    source: NDArray[np.float32]
    """Weights before they are turned, real and imaginary in turn."""
    turned: NDArray[np.float32]
    shaped: Shaping
    share: NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def room_for(terms: int, groups: int, node: Floats) -> Room:
    """Room for echoes with some terms beyond spheres, on the grids of some groups of shapes."""
    column = np.empty((10, BLOCK))
    single = np.zeros((4, BLOCK), np.float32)
    return Room(
        np.empty(BLOCK + 1, np.int32), np.empty(BLOCK, np.complex64),
        (column[0], column[1], column[2], column[3], column[4], column[5], column[6], column[7], column[8], column[9]),
        np.empty((terms, BLOCK)), np.empty(BLOCK, np.int32), (single[0], single[1], single[2], single[3]),
        np.empty(2 * BLOCK, np.float32), np.empty(2 * BLOCK, np.float32), shaping(node),
        np.zeros((4 * groups, BLOCK if groups > 1 else 1), np.float32),
    )  # fmt: skip


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def lay_pair(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, i: int, j: int, gain_row: int, count: int,
    room: Room, sent: Sent, heard: Heard, ears: Ears, slowness: float, gradient: float, loss: float, bent: bool,
    middle: float, frequency: float, node: Floats,
) -> None:  # fmt: skip
    """Echoes of some scatterers by one pair of legs, for all channels, added to their cells.

    Args:
        cells: Grids of pressure, shape (channels, groups, cells, shapes of a group): see `laid_out`.
        first_time: Time of the first cell [s].
        cell_rate: Cells per second [Hz].
        i: Row of the leg out.
        j: Row of the leg back.
        gain_row: Row of the gain.
        count: How many scatterers have an echo.
        room: Which these are, and what they make of the pair.
        sent: The legs out.
        heard: The legs back.
        ears: Who hears.
        slowness: Of sound at the array [s/m].
        gradient: Growth of the speed of sound with depth at the array [1/s].
        loss: Part of the pressure that the water takes on a metre [1/m].
        bent: Whether rays bend.
        middle: Time from the pulse's start to its middle; 0 for an array that stands [s].
        frequency: Of the carrier [Hz].
        node: Doppler factor less one of each shape [1], (shapes,).
    """
    last, still, which, shaped = cells.shape[2] - CELLS_PER_SPIKE, middle == 0.0, room.which, room.shaped
    tau, curve, away, behind, u, v, w, r, when, doppler = room.column
    inside, tuned, fade, x = room.single
    beside, at, source, turned, share = room.beside, room.at, room.source, room.turned, room.share
    late, later, bend, following = sent.delay[i], heard.delay[j], heard.bend[j], sent.following[i]
    towards = heard.towards[j]
    for k in range(count):
        n = np.uintp(which[k])
        tau[k] = late[n] + later[n]
        curve[k], behind[k] = bend[n], following[n]
        u[k], v[k], w[k] = towards[n, 0], towards[n, 1], towards[n, 2]
    for k in range(count):
        r[k] = 1 / curve[k]
    if bent:
        for k in range(count):
            away[k] = heard.away[j, np.uintp(which[k])]
        for t in range(beside.shape[0]):
            for k in range(count):
                beside[t, k] = heard.beside[j, t, np.uintp(which[k])]
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
            place_among(doppler[:count], shaped, x)
        if cells.shape[1] > 1:
            share_out(x[:count], shaped.node, shaped.scale, share)
        for c in range(ears.channels[e, 0], ears.channels[e, 1]):
            if ears.pattern[c] < 0:
                continue
            if ears.beam[c] != beam:
                beam = ears.beam[c]
                _weigh(sent.weight[beam, i], heard.weight[j], room.answer, which, count, source)
            if ears.pattern[c] != pattern:
                pattern = ears.pattern[c]
                gain = heard.gain[gain_row, pattern]
                for k in range(count):
                    tuned[k] = gain[np.uintp(which[k])]
            _turn(when[:count], fade, source, tuned, frequency, turned)
            lay_down_all(cells, c, 1, 1, at, inside, turned, x, shaped, share, count)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _weigh(
    sent: NDArray[np.complex64], heard: NDArray[np.complex64], answer: NDArray[np.complex64], which: NDArray[np.int32],
    count: int, source: NDArray[np.float32],
) -> None:  # fmt: skip
    """Products of what legs bring, what scatterers make of it and what legs leave of that, as two numbers in turn."""
    for k in range(count):
        n = np.uintp(which[k])
        one, other = sent[n], heard[n]
        real, imaginary = one.real * other.real - one.imag * other.imag, one.real * other.imag + one.imag * other.real
        source[2 * k] = real * answer[k].real - imaginary * answer[k].imag
        source[2 * k + 1] = real * answer[k].imag + imaginary * answer[k].real
