"""Echoes of a block of scatterers for beams: a stretch of the block at a time, from its legs to the grids.

What a few hundred scatterers need stays near the processor from the first number to the last: what legs bring and take
back, the gain of the beams along them when echoes come, the strength of pairs. Legs that are not there are passed over.
Then they meet, pair by pair. Plain numbers and arrays.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.cycles import sincos_cycles
from insonify.jit import njit
from insonify.propagation.wavefront import CLOSEST_SOURCE
from insonify.sonar._beam_kernels import Patterns, seen_by_array, steered, unsteered
from insonify.synthesis._direction_kernel import Rows, lay_pair_by_direction, sorted_room
from insonify.synthesis._echo_kernel import Ears, Flags, Heard, Integers, Room, Sent, lay_pair, room_for
from insonify.synthesis._element_kernel import left_behind, seen_when

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Complexes = NDArray[np.complex128]
_PART = 1024
_FAST = {"contract", "reassoc", "nsz", "arcp"}


class Ways(NamedTuple):
    """Columns of `Legs` between one end and n scatterers, (f, n)."""

    delay: Floats
    length: Floats
    spreading: Floats
    absorption: Floats
    boundary: Complexes
    """With what caustics and glints turn."""
    visibility: Complexes
    departure: Floats
    """(f, n, 3)."""
    grazing: Floats


class Mouth(NamedTuple):
    """What sends."""

    level: float
    """Pressure at 1 m [uPa]."""
    velocity: Floats
    """At the start of the ping [m/s], (3,)."""
    middle: float
    """Time from the pulse's start to its middle; 0 for one at rest [s]."""
    slowness: float
    """Of sound there [s/m]."""
    beams: Patterns


class Listener(NamedTuple):
    """What hears, but for where it is: see `Ears`."""

    middle: float
    """As of `Mouth`."""
    parted: bool
    """Whether directions are those from where the array is when echoes come."""
    turns: bool
    """Whether the array is then turned otherwise."""
    rate: Floats
    """Of `Course.sweep` [1/s], (3, 3)."""
    bend: Floats
    """Likewise [1/s^2], (3, 3)."""
    beams: Patterns


class Fronts(NamedTuple):
    """Wavefronts that come back where rays bend, see `Heard`; empty in water of one sound speed."""

    bend: Floats
    away: Floats
    beside: Floats


class Answers(NamedTuple):
    """What n scatterers make of p pairs: given; or products, see `records.pairs.Product`."""

    given: NDArray[np.complex64]
    """(p, n); or (0, 0): products."""
    factor: Floats
    """Of one direction, at even sines, (2 or more,)."""
    root: Floats
    """Of each area [m], (n,)."""
    weight: Floats
    """Of each pair [1], (p,)."""
    number: Singles
    """Of each place, (n,)."""
    stretch: NDArray[np.uint8]
    """That each lies in, (n,)."""
    share: Singles
    """Part of the scatterers at which pairs are met, (p, stretches); or (0, 0): everywhere."""


class _Leg(NamedTuple):
    """A leg's scatterers side by side, those of a part that it reaches, up to `_PART`."""

    which: NDArray[np.int32]
    """Their numbers in the part."""
    column: Floats
    """Columns one after the other, of `_PART` each: compilers see that none lies on another, and work on many numbers
    at a time."""


_REAL, _IMAGINARY = 0 * _PART, 1 * _PART
"""What is left of the pressure."""
_SIDE, _LENGTH = 2 * _PART, 3 * _PART
"""What the leg's direction contributes to strengths; the leg's length."""
_NORTH, _EAST, _DOWN = 4 * _PART, 5 * _PART, 6 * _PART
"""Direction away from the sonar."""
_WHEN, _BEHIND = 7 * _PART, 8 * _PART
"""A time [s]; one over one less the part of the speed of sound at which the leg is followed."""
_AHEAD, _RIGHT, _UNDER = 9 * _PART, 10 * _PART, 11 * _PART
"""Cosines to an array's axes."""
_SIZE = 12 * _PART
"""A factor."""
_COLUMNS = 13


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _reached(ways: Ways, f: int, begin: int, end: int, taken: float, answers: Answers, leg: _Leg) -> int:
    """How many scatterers of a part a leg reaches; which, and what it is like there, goes into `leg`."""
    count = 0
    visibility, boundary = ways.visibility[f, begin:end], ways.boundary[f, begin:end]
    for k in range(end - begin):
        leg.which[np.uintp(count)] = k
        count += (visibility[k] != 0) & (boundary[k] != 0)
    spreading, absorption = ways.spreading[f, begin:end], ways.absorption[f, begin:end]
    length, grazing, departure = ways.length[f, begin:end], ways.grazing[f, begin:end], ways.departure[f, begin:end]
    c = leg.column
    for k in range(count):
        n = np.uintp(leg.which[k])
        size, left, mirrored = spreading[n] * absorption[n], visibility[n], boundary[n]
        c[_REAL + k] = (left.real * mirrored.real - left.imag * mirrored.imag) * size
        c[_IMAGINARY + k] = (left.real * mirrored.imag + left.imag * mirrored.real) * size
        c[_LENGTH + k], c[_SIDE + k] = length[n], grazing[n]
        c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = departure[n, 0], departure[n, 1], departure[n, 2]
    if taken != 0:
        for k in range(count):
            kept = math.exp(-taken * c[_LENGTH + k])
            c[_REAL + k] *= kept
            c[_IMAGINARY + k] *= kept
    _contribute(answers.factor, c[_SIDE : _SIDE + count])
    return count


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _contribute(factor: Floats, side: Floats) -> None:
    """Grazing angles become the root of what directions contribute to cross sections; 1 for no factors."""
    rows = factor.size - 1
    if rows < 1:
        side[:] = 1.0
        return
    for k in range(side.size):
        sine, _ = sincos_cycles(abs(side[k]) * (0.5 / math.pi))
        side[k] = min(np.float64(sine), 1.0) * rows
    first, growth = factor[0], factor[1] - factor[0]
    for k in range(side.size if rows == 1 else 0):
        side[k] = math.sqrt(first + side[k] * growth)
    for k in range(side.size if rows > 1 else 0):
        row = min(int(side[k]), rows - 1)
        side[k] = math.sqrt(factor[row] + (side[k] - row) * (factor[row + 1] - factor[row]))


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _send(
    f: int, begin: int, count: int, mouth: Mouth, phase: Complexes, delay: Floats, leg: _Leg, sent: Sent,
    leaving: Floats,
) -> None:  # fmt: skip
    """What a leg out brings to the scatterers of a part that it reaches; and direction cosines, as of `_listen`."""
    beams, c, which = mouth.beams, leg.column, leg.which
    axes, velocity, middle, slowness = beams.axes, mouth.velocity, mouth.middle, mouth.slowness
    for k in range(count):
        c[_WHEN + k], chasing, louder = left_behind(
            c[_NORTH + k], c[_EAST + k], c[_DOWN + k], c[_LENGTH + k], velocity, middle, slowness
        )
        c[_BEHIND + k], c[_SIZE + k] = 1 / (1 - chasing), mouth.level * louder * c[_SIDE + k]
    _face(axes, count, c)
    _hear_unsteered(beams, count, c)
    if leaving.shape[0]:
        for k in range(count):
            leaving[f, np.uintp(which[k])] = c[_RIGHT + k]
    late, following = sent.delay[f], sent.following[f]
    late_out, turn = delay[begin:], phase[begin:]
    for k in range(count):
        at = np.uintp(which[k])
        late[at], following[at] = late_out[at] + c[_WHEN + k], c[_BEHIND + k]
        c[_WHEN + k], c[_BEHIND + k] = turn[at].real, turn[at].imag
    for beam in range(beams.steer.shape[0]):
        weight = sent.weight[beam, f]
        for k in range(count):
            size = c[_SIZE + k] * steered(beams, beam, c[_RIGHT + k], c[_UNDER + k])
            real = c[_REAL + k] * c[_WHEN + k] - c[_IMAGINARY + k] * c[_BEHIND + k]
            imaginary = c[_REAL + k] * c[_BEHIND + k] + c[_IMAGINARY + k] * c[_WHEN + k]
            weight[np.uintp(which[k])] = complex(real * size, imaginary * size)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _face(axes: Floats, count: int, c: Floats) -> None:
    """Cosines of directions to an array's axes."""
    for k in range(count):
        c[_AHEAD + k], c[_RIGHT + k], c[_UNDER + k] = seen_by_array(axes, c[_NORTH + k], c[_EAST + k], c[_DOWN + k])


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _hear_unsteered(beams: Patterns, count: int, c: Floats) -> None:
    """Factors with the gain of an array's elements."""
    for k in range(count):
        c[_SIZE + k] *= unsteered(beams, c[_AHEAD + k], c[_RIGHT + k], c[_UNDER + k])


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _turned(x: float, y: float, z: float, when: float, r: Floats, b: Floats) -> tuple[float, float, float]:
    """A direction as it would have to be at the start to be heard by the array as it is turned later.

    As `Course.turned`, with the two parts of its `sweep`.
    """
    north = x + when * (x * r[0, 0] + y * r[0, 1] + z * r[0, 2] + when * (x * b[0, 0] + y * b[0, 1] + z * b[0, 2]))
    east = y + when * (x * r[1, 0] + y * r[1, 1] + z * r[1, 2] + when * (x * b[1, 0] + y * b[1, 1] + z * b[1, 2]))
    down = z + when * (x * r[2, 0] + y * r[2, 1] + z * r[2, 2] + when * (x * b[2, 0] + y * b[2, 1] + z * b[2, 2]))
    once = 1 / math.sqrt(north * north + east * east + down * down)
    return once * north, once * east, once * down


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _listen(
    row: int, count: int, listener: Listener, ears: Ears, leg: _Leg, gain: Singles, across: Floats
) -> None:  # fmt: skip
    """Gain of each pattern towards a leg's scatterers when their echoes come.

    Args:
        row: Of the gains.
        count: How many scatterers the leg reaches.
        listener: What hears.
        ears: Where it is.
        leg: The leg; its columns tell when, and begin with factors of 1.
        gain: Result, (rows, patterns, part).
        across: Result, direction cosines to the array's right, (rows, part); or (0, 0): not wanted.
    """
    beams, c, which = listener.beams, leg.column, leg.which
    if listener.parted:
        place, velocity, acceleration = ears.place[0], ears.velocity[0], ears.acceleration[0]
        for k in range(count):
            c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = seen_when(
                c[_NORTH + k], c[_EAST + k], c[_DOWN + k], c[_LENGTH + k], c[_WHEN + k], place, velocity, acceleration
            )
    if listener.turns:
        for k in range(count):
            c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = _turned(
                c[_NORTH + k], c[_EAST + k], c[_DOWN + k], c[_WHEN + k], listener.rate, listener.bend
            )
    _face(beams.axes, count, c)
    _hear_unsteered(beams, count, c)
    if across.shape[0]:
        right = across[row]
        for k in range(count):
            right[np.uintp(which[k])] = c[_RIGHT + k]
    for pattern in range(beams.steer.shape[0]):
        heard = gain[row, pattern]
        for k in range(count):
            heard[np.uintp(which[k])] = c[_SIZE + k] * steered(beams, pattern, c[_RIGHT + k], c[_UNDER + k])


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _take_back(
    j: int, begin: int, end: int, count: int, ways: Ways, first: Floats, listener: Listener, fronts: Fronts,
    ears: Ears, root: Floats, leg: _Leg, heard: Heard, across: Floats,
) -> None:  # fmt: skip
    """What a leg back takes from the scatterers of a part that it reaches.

    Args:
        j: Row of the leg.
        begin: Number of the part's first scatterer.
        end: One more than that of its last.
        count: How many of these it reaches.
        ways: The legs.
        first: Delays of the first leg out [s], (n,): by another leg out an echo hardly comes from another place.
        listener: What hears.
        fronts: Wavefronts where rays bend.
        ears: Where it is.
        root: Of areas [m], (n,); or (0,).
        leg: The leg.
        heard: Result.
        across: Result, as of `_listen`.
    """
    c, delay, sooner, middle = leg.column, ways.delay[j, begin:end], first[begin:end], listener.middle
    late, bend, towards, weight = heard.delay[j], heard.bend[j], heard.towards[j], heard.weight[j]
    if root.size:
        for k in range(count):
            c[_SIDE + k] *= root[np.uintp(begin + leg.which[k])]
    for k in range(count):
        c[_AHEAD + k] = 1 / max(c[_LENGTH + k], CLOSEST_SOURCE)
    for k in range(count):
        at, size = np.uintp(leg.which[k]), c[_SIDE + k]
        weight[at] = complex(c[_REAL + k] * size, c[_IMAGINARY + k] * size)
        late[at], bend[at] = delay[at], c[_AHEAD + k]
        towards[at, 0], towards[at, 1], towards[at, 2] = c[_NORTH + k], c[_EAST + k], c[_DOWN + k]
        c[_WHEN + k] = sooner[at] + middle + delay[at]
    if fronts.bend.size:
        part = end - begin
        heard.bend[j, :part], heard.away[j, :part] = fronts.bend[j, begin:end], fronts.away[j, begin:end]
        heard.beside[j, :, :part] = fronts.beside[j, :, begin:end]
    c[_SIZE : _SIZE + count] = 1.0
    if not listener.turns:
        _listen(j, count, listener, ears, leg, heard.gain, across)


class _There(NamedTuple):
    """Scatterers of a part that each leg reaches, not hidden and not behind the array."""

    which: NDArray[np.int32]
    """Their numbers in the part, (legs, part)."""
    many: NDArray[np.int64]
    """How many, (legs,)."""
    flag: Flags
    """Whether each is, (legs, part)."""


@njit(cache=True, nogil=True, error_model="numpy")
def _none_there(legs: int) -> _There:
    """Room for what so many legs reach."""
    return _There(np.empty((legs, _PART), np.int32), np.zeros(legs, np.int64), np.zeros((legs, _PART), np.uint8))


@njit(cache=True, nogil=True, error_model="numpy")
def _note(there: _There, f: int, count: int, leg: _Leg) -> None:
    """Keep which scatterers a leg reaches with any pressure, by the factors in its columns."""
    flag, which, column, kept = there.flag[f], there.which[f], leg.column, 0
    flag[:] = 0
    for k in range(count):
        sounds = column[_SIZE + k] != 0
        flag[np.uintp(leg.which[k])] = sounds
        which[np.uintp(kept)] = leg.which[k]
        kept += sounds
    there.many[f] = kept


@njit(cache=True, nogil=True, error_model="numpy")
def _that_answer(p: int, i: int, j: int, begin: int, answers: Answers, out: _There, back: _There, room: Room) -> int:
    """How many scatterers of a part have an echo by one pair of legs; which, and how they answer, goes into `room`."""
    shorter = out.many[i] <= back.many[j]
    which = out.which[i, : out.many[i]] if shorter else back.which[j, : back.many[j]]
    flag, count = back.flag[j] if shorter else out.flag[i], 0
    if answers.given.shape[0]:
        given = answers.given[p, begin:]
        for k in range(which.size):
            n = np.uintp(which[k])
            room.which[np.uintp(count)], room.answer[np.uintp(count)] = which[k], given[n]
            count += flag[n] & np.uint8(given[n] != 0)
    elif answers.share.shape[0]:
        share, number, stretch = answers.share[p], answers.number[begin:], answers.stretch[begin:]
        for k in range(which.size):
            n = np.uintp(which[k])
            room.which[np.uintp(count)] = which[k]
            count += flag[n] & np.uint8(number[n] < share[np.uintp(stretch[n])])
        once = np.float32(answers.weight[p]) / np.sqrt(share)
        for k in range(count):
            room.answer[k] = once[np.uintp(stretch[np.uintp(room.which[k])])]
    else:
        for k in range(which.size):
            room.which[np.uintp(count)] = which[k]
            count += flag[np.uintp(which[k])]
        room.answer[:count] = answers.weight[p]
    return count


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def _listen_by_pair(
    begin: int, i: int, j: int, count: int, room: Room, sent: Sent, heard: Heard, length: Floats, listener: Listener,
    ears: Ears, leg: _Leg, across: Floats,
) -> None:  # fmt: skip
    """Gains for an array that turns, of one pair of legs: its echoes come at times of their own."""
    c, towards = leg.column, heard.towards[j]
    leg.which[:count] = room.which[:count]
    for k in range(count):
        n = np.uintp(room.which[k])
        c[_WHEN + k], c[_LENGTH + k] = sent.delay[i, n] + heard.delay[j, n], length[j, begin + n]
        c[_NORTH + k], c[_EAST + k], c[_DOWN + k] = towards[n, 0], towards[n, 1], towards[n, 2]
    c[_SIZE : _SIZE + count] = 1.0
    _listen(0, count, listener, ears, leg, heard.gain, across)


@njit(cache=True, nogil=True, fastmath=_FAST, error_model="numpy")
def spread_block(
    cells: NDArray[np.complex64], first_time: float, cell_rate: float, pair: Integers, out: Ways, back: Ways,
    both: bool, taken: float, phase: Complexes, answers: Answers, mouth: Mouth, listener: Listener, fronts: Fronts,
    ears: Ears, slowness: float, gradient: float, loss: float, bent: bool, middle: float, frequency: float,
    node: Floats, grid: Rows,
) -> None:  # fmt: skip
    """Echoes of one block by all pairs of legs, for all beams, added to their cells.

    Args:
        cells: As of `_echo_kernel.lay_pair`.
        first_time: Likewise.
        cell_rate: Likewise.
        pair: Row of the leg out and of the leg back of each pair, (p, 2).
        out: Legs out.
        back: Legs back.
        both: Whether these are the same.
        taken: What the water takes beyond what legs know, at this frequency [1/m].
        phase: Phasors of the places [1], (n,).
        answers: What scatterers make of pairs.
        mouth: What sends.
        listener: What hears.
        fronts: Wavefronts where rays bend.
        ears: One place that hears, and its beams.
        slowness: As of `_echo_kernel.lay_pair`.
        gradient: Likewise.
        loss: Likewise.
        bent: Likewise.
        middle: Likewise.
        frequency: Likewise.
        node: Likewise.
        grid: Rows of a grid of directions, whose channels are rows then, not beams; of step 0: channels are beams.
    """
    f, g, patterns, many = len(out.delay), len(back.delay), len(listener.beams.steer), phase.size
    beams, rows = len(mouth.beams.steer), 1 if listener.turns else g
    sent = Sent(np.zeros((f, _PART)), np.ones((f, _PART)), np.zeros((beams, f, _PART), np.complex64))
    heard = Heard(np.zeros((g, _PART)), np.ones((g, _PART)), np.zeros((g, _PART)),
                  np.zeros((g, fronts.beside.shape[1], _PART)), np.zeros((g, _PART, 3)),
                  np.zeros((g, _PART), np.complex64), np.zeros((rows, patterns, _PART), np.float32))  # fmt: skip
    leg, room = (
        _Leg(np.empty(_PART + 1, np.int32), np.empty(_COLUMNS * _PART)),
        room_for(fronts.beside.shape[1], cells.shape[1], node),
    )
    away, home, directed = _none_there(f), _none_there(g), grid.step > 0
    across, there = np.zeros((rows if directed else 0, _PART)), sorted_room(cells.shape[0] if directed else 0)
    leaving = np.zeros((f if directed else 0, _PART))
    for begin in range(0, many, _PART):
        end = min(begin + _PART, many)
        for i in range(f):
            count = _reached(out, i, begin, end, taken, answers, leg)
            _send(i, begin, count, mouth, phase, out.delay[i], leg, sent, leaving)
            _note(away, i, count, leg)
            if both:
                _take_back(i, begin, end, count, back, out.delay[0], listener, fronts, ears, answers.root, leg,
                           heard, across)  # fmt: skip
                _note(home, i, count, leg)
        if not both:
            for j in range(g):
                count = _reached(back, j, begin, end, taken, answers, leg)
                _take_back(j, begin, end, count, back, out.delay[0], listener, fronts, ears, answers.root, leg,
                           heard, across)  # fmt: skip
                _note(home, j, count, leg)
        for p in range(len(pair)):
            i, j = pair[p]
            count = _that_answer(p, i, j, begin, answers, away, home, room)
            if count == 0:
                continue
            if listener.turns:
                _listen_by_pair(begin, i, j, count, room, sent, heard, back.length, listener, ears, leg, across)
            row = 0 if listener.turns else j
            if directed:
                lay_pair_by_direction(cells, first_time, cell_rate, i, j, row, count, room, sent, heard, ears,
                                      leaving[i], across[row], grid, there, slowness, gradient, loss, bent, middle,
                                      frequency, node)  # fmt: skip
            else:
                lay_pair(cells, first_time, cell_rate, i, j, row, count, room, sent, heard, ears, slowness, gradient,
                         loss, bent, middle, frequency, node)  # fmt: skip
