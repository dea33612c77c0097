"""Which pairs of legs one ping hears of uneven ground: what others drown at the same time is asked at few scatterers.

Roughness takes much of a leg that bounces steeply or often, and such legs cost most. How much a pair counts is reckoned
by the sonar equation over the mean plane, its energy against everything that arrives with it, distance by distance and
channel by channel. A family of which all pairs are negligible is not followed. A pair that is faint is met at some
of the scatterers, which stand for the others: a scatterer has a number that belongs to its place, and answers the pair
where that lies below the pair's share, as much louder as its share is smaller. So nothing is lost in the mean, every
ping, channel and thread asks the same places, and each echo of a faint pair is no louder than those of a loud one.

The bed's own reflection coefficient does not enter, so that one that reflects more or less has every echo at the same
scatterers: each pair has the larger one of its parts over a bed that reflects nothing and one with `REFLECTED`.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify import streams
from insonify.engines._audible_kernel import answers, numbered
from insonify.engines.bounced import left_in_step
from insonify.engines.glint_spread import GlintSpread, glint_spread
from insonify.engines.thinning import NEGLIGIBLE, heard_until
from insonify.propagation.families import bounces
from insonify.propagation.local_planes import level_course
from insonify.records.pairs import Thinned
from insonify.scattering.fast import FastLaw
from insonify.scene.bed import Bed
from insonify.scene.scatterers import Law
from insonify.scene.scene import Scene
from insonify.sonar.beam import Beams
from insonify.sonar.stance import Stance

Floats = NDArray[np.floating[Any]]

STRETCHES = 64
"""Stretches of distance in which the same families are heard."""
BEARINGS = 16
"""Bearings at which beams are asked, besides those that they point to."""
BEYOND = 1.25
"""How much farther than what is heard last the ground goes on [1]."""
CHANNELS = 8
"""Channels that are asked, of more some of all directions."""
LOUD = 0.25
"""Part of what is heard at a time from which on a pair is met at every scatterer; below, its share is its part re this,
so that no echo is louder than there [1]."""
REFLECTED = 0.5
"""Modulus of the reflection coefficient of the bed that pairs with bottom bounces are reckoned with [1]."""
RISES = (-1.84, -1.12, -0.68, -0.33, 0.33, 0.68, 1.12, 1.84)
"""Deviations of a leg's elevation off a moving surface, besides none, over their standard one: equally likely [1]."""
LEAST = 1 / 32
"""Smallest share of a pair that is heard at all."""


@dataclass(frozen=True, slots=True)
class Audible:
    """What one ping hears of some places of the ground: n of them."""

    families: tuple[str, ...]
    """Families that are followed, f of them; the first always."""
    wanted: NDArray[np.bool_] | None
    """Whether any pair of each family is met at a place, shape (f, n); None: all are everywhere."""
    thinned: Thinned | None
    """Where each pair of families is met, in the order of the families, f * f of them; None: all are everywhere."""

    def met(self, out: tuple[str, ...], back: tuple[str, ...]) -> Thinned | None:
        """Where some pairs are met, p of them; None: everywhere.

        Args:
            out: Family of the leg out of each pair.
            back: The same of the leg back.
        """
        if self.thinned is None:
            return None
        number = {name: k for k, name in enumerate(self.families)}
        row = [number[one] * len(number) + number[other] for one, other in zip(out, back, strict=True)]
        share = self.thinned.share
        every = row == list(range(len(share)))
        return self.thinned if every else replace(self.thinned, share=share[np.array(row, int)])


def audible(
    families: tuple[str, ...], part: Floats, stance: Stance, position: NDArray[np.float64], place: NDArray[np.uint64],
    seed: int,
) -> Audible:  # fmt: skip
    """What is heard of some places of the ground, by which pairs of families.

    Args:
        families: Families that reach the bed.
        part: Of `largest_parts`, shape (f, f, STRETCHES).
        stance: The sonar at this ping.
        position: North, east, depth of the places [m], shape (n, 3).
        place: Their keys, shape (n,).
        seed: Of the scatterers.
    """
    low, high = streams.key(seed, streams.FAINT)
    stretch, number = np.empty(len(place), np.uint8), np.empty(len(place), np.float32)
    least, most = numbered(
        position, float(stance.middle[0]), float(stance.middle[1]), _edges(stance), _first_of_parts(), place,
        np.uint64(high << 32 | low), stretch, number,
    )  # fmt: skip
    span = slice(least, most + 1) if len(place) else slice(0, 0)
    kept = families_heard(families, part, stance, span)
    rows = [families.index(name) for name in kept]
    share = _shares(part[np.ix_(rows, rows)] * _told_apart(stance)).astype(np.float32)
    if (share[..., span] >= 1).all():
        return Audible(kept, None, None)
    wanted = np.empty((len(kept), len(place)), bool)
    answers(number, stretch, share.max(axis=1), wanted)
    return Audible(kept, wanted, Thinned(number, stretch, share.reshape(len(kept) ** 2, -1)))


@lru_cache(maxsize=1)
def _first_of_parts() -> NDArray[np.uint8]:
    """Stretch that each even part of the distance begins in; parts half as long as the shortest stretch."""
    edges = np.linspace(0, 1, STRETCHES + 1) ** 1.5
    parts = int(2 / edges[1])
    # a hair inwards: a part that begins on an edge may be rounded to before it
    return (np.searchsorted(edges, np.arange(parts) / parts - 1e-9, side="right") - 1).clip(0).astype(np.uint8)


def shares_met(families: tuple[str, ...], part: Floats, stance: Stance, distance: Floats) -> Floats:
    """At what share of the scatterers each pair is met, 0 where a leg of it is not followed [1], shape (f, f, n).

    Args:
        families: Families that reach the bed.
        part: Of `largest_parts`, shape (f, f, STRETCHES).
        stance: The sonar at this ping.
        distance: Of the scatterers over ground [m], shape (n,).
    """
    share = _shares(part * _told_apart(stance))
    for stretch in range(STRETCHES):
        kept = families_heard(families, part, stance, slice(stretch, stretch + 1))
        lost = [row for row, name in enumerate(families) if name not in kept]
        share[lost, :, stretch] = share[:, lost, stretch] = 0.0
    there = np.searchsorted(_edges(stance), distance, side="right") - 1
    return np.asarray(share[..., np.clip(there, 0, STRETCHES - 1)])


def _shares(part: Floats) -> Floats:
    """Part of the scatterers at which each pair is met, the same for both orders, shape of `part`.

    A stretch has the largest share of its neighbours, for the ground is not level.
    """
    share = np.clip((part + part.swapaxes(0, 1)) / LOUD, LEAST, 1.0)
    share[0, 0] = 1.0
    wide = np.pad(share, ((0, 0), (0, 0), (1, 1)), mode="edge")
    return np.asarray(np.maximum.reduce([wide[..., k : k + STRETCHES] for k in range(3)]))


def _told_apart(stance: Stance) -> float:
    """How many times fainter than all that arrives with it a pair may be and still be found by steering in height.

    Beams are what they are. Elements tell as many heights apart as there are beams between up and down.
    """
    if stance.elements is None:
        return 1.0
    ahead = np.array([np.cos(stance.bearing), np.sin(stance.bearing), 0.0])
    place = stance.elements.place @ stance.receive_beams.axes
    reach = np.hypot(np.ptp(place @ ahead), np.ptp(place[:, 2]))
    return float(min(1 + 2 * reach / stance.wavelength, len(place)))


def families_heard(families: tuple[str, ...], part: Floats, stance: Stance, span: slice) -> tuple[str, ...]:
    """Families that some places of the ground are heard by; the first always.

    A stretch hears what its neighbours hear, for the ground is not level. Recorded elements may be steered to what is
    faint among them all: they drown as much less as there are elements.

    Args:
        families: Families that reach the bed.
        part: Of `largest_parts`, shape (f, f, STRETCHES).
        stance: The sonar at this ping.
        span: Stretches that the places lie in.
    """
    elements = 1 if stance.elements is None else len(stance.elements.place)
    own = (part.sum(axis=0) + part.sum(axis=1))[:, max(span.start - 1, 0) : span.stop + 1]
    whole = _bottom_bounces(families)  # a bed may reflect all
    heard = own.max(axis=1, initial=0.0) >= NEGLIGIBLE / elements * REFLECTED ** (2 * whole)
    return families[:1] + tuple(name for name, kept in zip(families[1:], heard[1:], strict=True) if kept)


def largest_parts(scene: Scene, bed: Bed, stance: Stance, families: tuple[str, ...], law: Law) -> Floats:
    """What each pair has of all that arrives with it, at most in any channel [1], (f, f, STRETCHES).

    Args:
        scene: The scene; its water has one sound speed.
        bed: Its ground.
        stance: The sonar, both ends on one platform.
        families: Families that reach the bed.
        law: How the bed answers.
    """
    edges = _edges(stance)
    middle = (edges[1:] + edges[:-1]) / 2
    pair = np.array([(i, j) for i in range(len(families)) for j in range(len(families))])
    depths = float(stance.transmit_place[2]), float(stance.receive_place[2])
    (_, there, sent), (_, here, heard) = (_legs(scene, bed, stance, families, middle, depth) for depth in depths)
    sea = glint_spread(scene, stance.frequency)
    spread = [_rises(sea, families, depth, middle, bed.depth) for depth in depths]
    gains = _gains(stance, there, here, np.array([name.startswith("S") for name in families]), spread)
    section = np.array([_section(law, there[i], here[j]) for i, j in pair])
    ground = middle * np.diff(edges)
    own = (section * sent[pair[:, 0]] * heard[pair[:, 1]] * ground) * gains[:, pair[:, 0], pair[:, 1]]
    out, back = (_legs(scene, bed, stance, families, edges, depth)[0] / stance.sound_speed for depth in depths)
    late = out[pair[:, 0]] + back[pair[:, 1]]
    own *= late[:, :-1] < stance.heard_delays[1]
    bounced = _bottom_bounces(families)[pair].sum(axis=1)
    part = np.zeros((len(pair), STRETCHES))
    for left in (0.0, REFLECTED**2) if bounced.any() else (1.0,):
        for energy in own * left ** bounced[:, None]:
            whole = np.diff(heard_until(late, energy), axis=1)
            part = np.maximum(part, energy / np.maximum(whole, 1e-300))
    return part.reshape(len(families), len(families), STRETCHES)


def _bottom_bounces(families: tuple[str, ...]) -> NDArray[np.int64]:
    """Bottom bounces of each family, (f,)."""
    return np.array([bounces(name).count("B") for name in families])


def _edges(stance: Stance) -> Floats:
    """Of the stretches, distances from the transmitter over ground [m], (STRETCHES + 1,)."""
    farthest = BEYOND * stance.sound_speed * stance.heard_delays[1] / 2
    return np.asarray(farthest * np.linspace(0, 1, STRETCHES + 1) ** 1.5)


def _legs(
    scene: Scene, bed: Bed, stance: Stance, families: tuple[str, ...], distance: Floats, depth: float
) -> tuple[Floats, Floats, Floats]:
    """Lengths [m], directions of arrival to the north, powers re 1 m [m^-2] of level legs from a depth, (f, n), 3.

    Powers are those over a bed that reflects all, but for what its roughness takes.
    """
    place = np.array([0.0, 0.0, depth])
    points = np.stack([distance, 0 * distance, np.full_like(distance, bed.depth)], axis=-1)
    ways = [level_course(name, place, points, bed.depth) for name in families]
    length = np.array([way.length for way in ways])
    left = [left_in_step(name, way, bed, stance.wavelength) for name, way in zip(families, ways, strict=True)]
    surface = abs(complex(scene.surface.mirror(np.zeros(1))[0]))
    left = [one * surface ** bounces(name).count("S") for name, one in zip(families, left, strict=True)]
    taken = float(scene.water.absorption(stance.frequency))
    power = np.array(left) ** 2 * 10 ** (-taken * length / 10) / length**2
    return length, np.array([way.arrival for way in ways]), power


def _rises(
    sea: GlintSpread | None, families: tuple[str, ...], source_depth: float, distance: Floats, depth: float
) -> Floats:
    """Standard deviation of the elevation at which legs leave, by what glints of them there are [rad], (f, n).

    Spreads in bearing are left out: what one bearing loses by them, others get.

    Args:
        sea: The moving surface; None: it is still.
        families: Families of the legs.
        source_depth: Depth of this end of the sonar [m].
        distance: Over ground [m], (n,).
        depth: Of the bed [m].
    """
    found = np.zeros((len(families), len(distance)))
    for row, name in enumerate(families):
        legs = None if sea is None else sea.legs(name, source_depth, np.asarray(distance, float), depth)
        if sea is not None and legs is not None:
            found[row] = legs.tilt * legs.glints * np.sqrt((sea.slopes[0] + sea.slopes[2]) / 2)
    return found


def _gains(stance: Stance, there: Floats, here: Floats, up: NDArray[np.bool_], rises: list[Floats]) -> Floats:
    """Two-way gain of each channel, the legs out and back of each two families, over all bearings, (c, f, f, n).

    Args:
        stance: The sonar.
        there: Directions of arrival to the north of the legs out, (f, n, 3).
        here: The same of the legs from the receiver, (f, n, 3).
        up: Families that leave upwards, (f,).
        rises: Of `_rises`, for the way out and for that from the receiver.
    """
    channels = np.unique(np.linspace(0, stance.channel_count - 1, CHANNELS).astype(int))
    if stance.elements is not None:
        channels = channels[:1]
    sent, heard = stance.transmit_beams, stance.ears
    outwards = channels % sent.channel_count, channels % heard.channel_count
    axes = np.concatenate([_axis(sent, outwards[0]), _axis(heard, outwards[1])])
    around = np.linspace(0, 2 * np.pi, BEARINGS, endpoint=False)
    bearing = np.unique(np.append(around, np.arctan2(axes[:, 1], axes[:, 0])))[:, None, None]

    def leaving(into: Floats) -> Floats:
        level = np.hypot(into[..., 0], into[..., 1])
        down = np.where(up[:, None], -1, 1) * np.abs(into[..., 2]) + 0 * bearing
        return np.stack([level * np.cos(bearing), level * np.sin(bearing), down], axis=-1)

    def energy(beams: Beams, into: Floats, rows: NDArray[np.intp], rise: Floats) -> Floats:
        way = leaving(into)
        mean = beams.gain(way)[rows] ** 2
        if rise.any():
            level, down = np.hypot(way[..., 0], way[..., 1]), np.arcsin(np.clip(way[..., 2], -1, 1))
            for off in RISES:
                turned = down + off * rise
                ahead = way[..., :2] * (np.cos(turned) / np.maximum(level, 1e-12))[..., None]
                mean += beams.gain(np.concatenate([ahead, np.sin(turned)[..., None]], axis=-1))[rows] ** 2
            mean /= 1 + len(RISES)
        return np.asarray(mean)

    out = energy(sent, there, outwards[0], rises[0])
    back = energy(heard, here, outwards[1], rises[1])
    return np.asarray(np.einsum("cbin,cbjn->cijn", out, back))


def _axis(beams: Beams, rows: NDArray[np.intp]) -> Floats:
    """Where some beams point, in the world, (n, 3)."""
    aside = beams.steer[np.minimum(rows, len(beams.steer) - 1)]
    ahead = np.sqrt(np.maximum(1 - np.sum(aside**2, axis=1, keepdims=True), 0))
    return np.asarray(np.concatenate([ahead, aside], axis=1) @ beams.axes)


def _section(law: Law, arriving: Floats, leaving: Floats) -> Floats:
    """Cross section of level ground for a leg out and a leg back by their directions of arrival, (n,)."""
    if isinstance(law, FastLaw):
        normal = np.zeros((3, len(arriving)))
        normal[2] = -1.0
        return np.asarray(law.cross_section(arriving.T, -leaving.T, normal), float)
    into, off = (np.arcsin(np.clip(way[:, 2], 0, 1)) for way in (arriving, leaving))
    return np.asarray(law.cross_section(into, off, np.array(np.pi)))
