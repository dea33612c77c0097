"""Which families of legs one ping hears of uneven ground: what others drown at the same time is not followed.

Roughness takes next to all of a leg that bounces steeply or often, and such legs cost most. Whether a family counts is
reckoned by the sonar equation over the mean plane, all its pairs with others against everything that arrives with
them, distance by distance and channel by channel.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines.bounced import mirrored
from insonify.engines.thinning import NEGLIGIBLE, heard_until
from insonify.propagation.local_planes import level_course
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


def families_heard(families: tuple[str, ...], part: Floats, stance: Stance, distance: Floats) -> tuple[str, ...]:
    """Families that some places of the ground are heard by; the first always.

    A stretch hears what its neighbours hear, for the ground is not level. Recorded elements may be steered to what is
    faint among them all: they drown as much less as there are elements.

    Args:
        families: Families that reach the bed.
        part: Of `largest_parts`, shape (f, STRETCHES).
        stance: The sonar at this ping.
        distance: Of the places, from the transmitter over ground [m], shape (n,).
    """
    if not distance.size:
        return families[:1]
    ends = np.searchsorted(_edges(stance), [distance.min(), distance.max()], side="right") - 1
    first, last = np.clip(ends, 1, STRETCHES) - [1, 0]
    elements = 1 if stance.elements is None else len(stance.elements.place)
    heard = part[:, first : last + 2].max(axis=1) >= NEGLIGIBLE / elements
    return families[:1] + tuple(name for name, kept in zip(families[1:], heard[1:], strict=True) if kept)


def largest_parts(scene: Scene, bed: Bed, stance: Stance, families: tuple[str, ...], law: Law) -> Floats:
    """What the pairs of each family have of all that arrives with them, at most in any channel [1], (f, STRETCHES).

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
    _, into, power = _legs(scene, bed, stance, families, middle)
    gains = _gains(stance, into, np.array([name.startswith("S") for name in families]))
    section = np.array([_section(law, into[i], into[j]) for i, j in pair])
    ground = middle * np.diff(edges)
    own = (section * power[pair[:, 0]] * power[pair[:, 1]] * ground) * gains[:, pair[:, 0], pair[:, 1]]
    late = (_legs(scene, bed, stance, families, edges)[0] / stance.sound_speed)[pair].sum(axis=1)
    own *= late[:, :-1] < stance.heard_delays[1]
    part = np.zeros((len(families), STRETCHES))
    for energy in own:
        whole = np.diff(heard_until(late, energy), axis=1)
        mine = np.zeros_like(part)
        for end in pair.T:
            np.add.at(mine, end, energy / np.maximum(whole, 1e-300))
        part = np.maximum(part, mine)
    return part


def _edges(stance: Stance) -> Floats:
    """Of the stretches, distances from the transmitter over ground [m], (STRETCHES + 1,)."""
    farthest = BEYOND * stance.sound_speed * stance.heard_delays[1] / 2
    return np.asarray(farthest * np.linspace(0, 1, STRETCHES + 1) ** 1.5)


def _legs(
    scene: Scene, bed: Bed, stance: Stance, families: tuple[str, ...], distance: Floats
) -> tuple[Floats, Floats, Floats]:
    """Lengths [m], directions of arrival to the north, and powers re 1 m [m^-2] of level legs, (f, n), (f, n, 3)."""
    place = np.array([0.0, 0.0, stance.transmit_place[2]])
    points = np.stack([distance, 0 * distance, np.full_like(distance, bed.depth)], axis=-1)
    ways = [level_course(name, place, points, bed.depth) for name in families]
    length = np.array([way.length for way in ways])
    left = [mirrored(name, way, bed, stance.wavelength, scene) for name, way in zip(families, ways, strict=True)]
    taken = float(scene.water.absorption(stance.frequency))
    power = np.abs(np.array(left)) ** 2 * 10 ** (-taken * length / 10) / length**2
    return length, np.array([way.arrival for way in ways]), power


def _gains(stance: Stance, into: Floats, up: NDArray[np.bool_]) -> Floats:
    """Two-way gain of each channel, the legs out and back of each two families, over all bearings, (c, f, f, n).

    Args:
        stance: The sonar.
        into: Directions of arrival to the north, (f, n, 3).
        up: Families that leave upwards, (f,).
    """
    channels = np.unique(np.linspace(0, stance.channel_count - 1, CHANNELS).astype(int))
    if stance.elements is not None:
        channels = channels[:1]
    sent, heard = stance.transmit_beams, stance.receive_beams
    outwards = channels % sent.channel_count, channels % heard.channel_count
    axes = np.concatenate([_axis(sent, outwards[0]), _axis(heard, outwards[1])])
    around = np.linspace(0, 2 * np.pi, BEARINGS, endpoint=False)
    bearing = np.unique(np.append(around, np.arctan2(axes[:, 1], axes[:, 0])))[:, None, None]
    level = np.hypot(into[..., 0], into[..., 1])
    down = np.where(up[:, None], -1, 1) * np.abs(into[..., 2]) + 0 * bearing
    there = np.stack([level * np.cos(bearing), level * np.sin(bearing), down], axis=-1)
    out, back = (beams.gain(there)[rows] ** 2 for beams, rows in zip((sent, heard), outwards, strict=True))
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
