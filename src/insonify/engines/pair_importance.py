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

from insonify import random_keys
from insonify.engines._pair_importance_kernel import assign_priorities, mark_sampled_families
from insonify.engines.glint_spread import GlintSpread, glint_spread
from insonify.engines.relief_reflections import coherent_bounce_factor
from insonify.engines.sample_allocation import NEGLIGIBLE, arrived_energy
from insonify.propagation.families import bounce_sequence
from insonify.propagation.local_planes import flat_image_paths
from insonify.records.pairs import PairSampling
from insonify.scattering.compiled_law import CompiledLaw
from insonify.scene.scatterers import Law
from insonify.scene.scene import Scene
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.floating[Any]]

RANGE_BINS = 64
"""Stretches of distance in which the same families are heard."""
BEARINGS = 16
"""Bearings at which beams are asked, besides those that they point to."""
RANGE_MARGIN = 1.25
"""How much farther than what is heard last the ground goes on [1]."""
MAX_CHANNELS = 8
"""Channels that are asked, of more some of all directions."""
FULL_SAMPLING_FRACTION = 0.25
"""Part of what is heard at a time from which on a pair is met at every scatterer; below, its share is its part re this,
so that no echo is louder than there [1]."""
REFLECTED = 0.5
"""Modulus of the reflection coefficient of the bed that pairs with bottom bounces are reckoned with [1]."""
ELEVATION_DEVIATIONS = (-1.84, -1.12, -0.68, -0.33, 0.33, 0.68, 1.12, 1.84)
"""Deviations of a leg's elevation off a moving surface, besides none, over their standard one: equally likely [1]."""
MIN_KEEP_PROBABILITY = 1 / 32
"""Smallest share of a pair that is heard at all."""


@dataclass(frozen=True, slots=True)
class PairSelection:
    """What one ping hears of some places of the ground: n of them."""

    families: tuple[str, ...]
    """Families that are followed, f of them; the first always."""
    wanted: NDArray[np.bool_] | None
    """Whether any pair of each family is met at a place, shape (f, n); None: all are everywhere."""
    sampling: PairSampling | None
    """Where each pair of families is met, in the order of the families, f * f of them; None: all are everywhere."""

    def sampling_of(self, out: tuple[str, ...], back: tuple[str, ...]) -> PairSampling | None:
        """Where some pairs are met, p of them; None: everywhere.

        Args:
            out: Family of the leg out of each pair.
            back: The same of the leg back.
        """
        if self.sampling is None:
            return None
        number = {name: k for k, name in enumerate(self.families)}
        row = [number[one] * len(number) + number[other] for one, other in zip(out, back, strict=True)]
        keep_probability = self.sampling.keep_probability
        every = row == list(range(len(keep_probability)))
        return self.sampling if every else replace(self.sampling, keep_probability=keep_probability[np.array(row, int)])


def select_pairs(
    families: tuple[str, ...], energy_fraction: Floats, ping_geometry: PingGeometry, position: NDArray[np.float64], place: NDArray[np.uint64],
    seed: int,
) -> PairSelection:  # fmt: skip
    """What is heard of some places of the ground, by which pairs of families.

    Args:
        families: Families that reach the bed.
        energy_fraction: Of `pair_energy_fractions`, shape (f, f, STRETCHES).
        ping_geometry: The sonar at this ping.
        position: North, east, depth of the places [m], shape (n, 3).
        place: Their keys, shape (n,).
        seed: Of the scatterers.
    """
    low, high = random_keys.stream_key(seed, random_keys.PAIR_SAMPLING)
    range_bin, number = np.empty(len(place), np.uint8), np.empty(len(place), np.float32)
    least, most = assign_priorities(
        position, float(ping_geometry.midpoint[0]), float(ping_geometry.midpoint[1]), _edges(ping_geometry), _bin_lookup(), place,
        np.uint64(high << 32 | low), range_bin, number,
    )  # fmt: skip
    span = slice(least, most + 1) if len(place) else slice(0, 0)
    kept = significant_families(families, energy_fraction, ping_geometry, span)
    rows = [families.index(name) for name in kept]
    keep_probability = _keep_probabilities(
        energy_fraction[np.ix_(rows, rows)] * _elevation_cells(ping_geometry)
    ).astype(np.float32)
    if (keep_probability[..., span] >= 1).all():
        return PairSelection(kept, None, None)
    wanted = np.empty((len(kept), len(place)), bool)
    mark_sampled_families(number, range_bin, keep_probability.max(axis=1), wanted)
    return PairSelection(kept, wanted, PairSampling(number, range_bin, keep_probability.reshape(len(kept) ** 2, -1)))


@lru_cache(maxsize=1)
def _bin_lookup() -> NDArray[np.uint8]:
    """Stretch that each even part of the distance begins in; parts half as long as the shortest stretch."""
    edges = np.linspace(0, 1, RANGE_BINS + 1) ** 1.5
    parts = int(2 / edges[1])
    # a hair inwards: a part that begins on an edge may be rounded to before it
    return (np.searchsorted(edges, np.arange(parts) / parts - 1e-9, side="right") - 1).clip(0).astype(np.uint8)


def keep_probabilities_at(
    families: tuple[str, ...], energy_fraction: Floats, ping_geometry: PingGeometry, distance: Floats
) -> Floats:
    """At what share of the scatterers each pair is met, 0 where a leg of it is not followed [1], shape (f, f, n).

    Args:
        families: Families that reach the bed.
        energy_fraction: Of `pair_energy_fractions`, shape (f, f, STRETCHES).
        ping_geometry: The sonar at this ping.
        distance: Of the scatterers over ground [m], shape (n,).
    """
    keep_probability = _keep_probabilities(energy_fraction * _elevation_cells(ping_geometry))
    for range_bin in range(RANGE_BINS):
        kept = significant_families(families, energy_fraction, ping_geometry, slice(range_bin, range_bin + 1))
        lost = [row for row, name in enumerate(families) if name not in kept]
        keep_probability[lost, :, range_bin] = keep_probability[:, lost, range_bin] = 0.0
    there = np.searchsorted(_edges(ping_geometry), distance, side="right") - 1
    return np.asarray(keep_probability[..., np.clip(there, 0, RANGE_BINS - 1)])


def _keep_probabilities(energy_fraction: Floats) -> Floats:
    """Part of the scatterers at which each pair is met, the same for both orders, shape of `energy_fraction`.

    A stretch has the largest share of its neighbours, for the ground is not level.
    """
    keep_probability = np.clip(
        (energy_fraction + energy_fraction.swapaxes(0, 1)) / FULL_SAMPLING_FRACTION, MIN_KEEP_PROBABILITY, 1.0
    )
    keep_probability[0, 0] = 1.0
    wide = np.pad(keep_probability, ((0, 0), (0, 0), (1, 1)), mode="edge")
    return np.asarray(np.maximum.reduce([wide[..., k : k + RANGE_BINS] for k in range(3)]))


def _elevation_cells(ping_geometry: PingGeometry) -> float:
    """How many times fainter than all that arrives with it a pair may be and still be found by steering in height.

    Beams are what they are. Elements tell as many heights apart as there are beams between up and down.
    """
    if ping_geometry.elements is None:
        return 1.0
    ahead = np.array([np.cos(ping_geometry.first_beam_bearing), np.sin(ping_geometry.first_beam_bearing), 0.0])
    place = ping_geometry.elements.positions @ ping_geometry.receive_beams.axes
    reach = np.hypot(np.ptp(place @ ahead), np.ptp(place[:, 2]))
    return float(min(1 + 2 * reach / ping_geometry.wavelength, len(place)))


def significant_families(
    families: tuple[str, ...], energy_fraction: Floats, ping_geometry: PingGeometry, span: slice
) -> tuple[str, ...]:
    """Families that some places of the ground are heard by; the first always.

    A stretch hears what its neighbours hear, for the ground is not level. Recorded elements may be steered to what is
    faint among them all: they drown as much less as there are elements.

    Args:
        families: Families that reach the bed.
        energy_fraction: Of `pair_energy_fractions`, shape (f, f, STRETCHES).
        ping_geometry: The sonar at this ping.
        span: Stretches that the places lie in.
    """
    elements = 1 if ping_geometry.elements is None else len(ping_geometry.elements.positions)
    own = (energy_fraction.sum(axis=0) + energy_fraction.sum(axis=1))[:, max(span.start - 1, 0) : span.stop + 1]
    whole = _bottom_bounces(families)  # a bed may reflect all
    heard = own.max(axis=1, initial=0.0) >= NEGLIGIBLE / elements * REFLECTED ** (2 * whole)
    return families[:1] + tuple(name for name, kept in zip(families[1:], heard[1:], strict=True) if kept)


def pair_energy_fractions(
    scene: Scene, bed: SeabedTerrain, ping_geometry: PingGeometry, families: tuple[str, ...], law: Law
) -> Floats:
    """What each pair has of all that arrives with it, at most in any channel [1], (f, f, STRETCHES).

    Args:
        scene: The scene; its water has one sound speed.
        bed: Its ground.
        ping_geometry: The sonar, both ends on one platform.
        families: Families that reach the bed.
        law: How the bed answers.
    """
    edges = _edges(ping_geometry)
    middle = (edges[1:] + edges[:-1]) / 2
    pair = np.array([(i, j) for i in range(len(families)) for j in range(len(families))])
    depths = float(ping_geometry.transmit_position[2]), float(ping_geometry.receive_position[2])
    (_, there, sent), (_, here, heard) = (_legs(scene, bed, ping_geometry, families, middle, depth) for depth in depths)
    sea = glint_spread(scene, ping_geometry.frequency)
    spread = [_elevation_spreads(sea, families, depth, middle, bed.depth) for depth in depths]
    gains = _gains(ping_geometry, there, here, np.array([name.startswith("S") for name in families]), spread)
    section = np.array([_cross_section(law, there[i], here[j]) for i, j in pair])
    ground = middle * np.diff(edges)
    own = (section * sent[pair[:, 0]] * heard[pair[:, 1]] * ground) * gains[:, pair[:, 0], pair[:, 1]]
    out, back = (
        _legs(scene, bed, ping_geometry, families, edges, depth)[0] / ping_geometry.sound_speed for depth in depths
    )
    late = out[pair[:, 0]] + back[pair[:, 1]]
    own *= late[:, :-1] < ping_geometry.recorded_delays[1]
    bounced = _bottom_bounces(families)[pair].sum(axis=1)
    energy_fraction = np.zeros((len(pair), RANGE_BINS))
    for left in (0.0, REFLECTED**2) if bounced.any() else (1.0,):
        for energy in own * left ** bounced[:, None]:
            whole = np.diff(arrived_energy(late, energy), axis=1)
            energy_fraction = np.maximum(energy_fraction, energy / np.maximum(whole, 1e-300))
    return energy_fraction.reshape(len(families), len(families), RANGE_BINS)


def _bottom_bounces(families: tuple[str, ...]) -> NDArray[np.int64]:
    """Bottom bounces of each family, (f,)."""
    return np.array([bounce_sequence(name).count("B") for name in families])


def _edges(ping_geometry: PingGeometry) -> Floats:
    """Of the stretches, distances from the transmitter over ground [m], (STRETCHES + 1,)."""
    farthest = RANGE_MARGIN * ping_geometry.sound_speed * ping_geometry.recorded_delays[1] / 2
    return np.asarray(farthest * np.linspace(0, 1, RANGE_BINS + 1) ** 1.5)


def _legs(
    scene: Scene,
    bed: SeabedTerrain,
    ping_geometry: PingGeometry,
    families: tuple[str, ...],
    distance: Floats,
    depth: float,
) -> tuple[Floats, Floats, Floats]:
    """Lengths [m], directions of arrival to the north, powers re 1 m [m^-2] of level legs from a depth, (f, n), 3.

    Powers are those over a bed that reflects all, but for what its roughness takes.
    """
    place = np.array([0.0, 0.0, depth])
    points = np.stack([distance, 0 * distance, np.full_like(distance, bed.depth)], axis=-1)
    ways = [flat_image_paths(name, place, points, bed.depth) for name in families]
    length = np.array([way.length for way in ways])
    left = [
        coherent_bounce_factor(name, way, bed, ping_geometry.wavelength)
        for name, way in zip(families, ways, strict=True)
    ]
    surface = abs(complex(scene.surface.reflection_coefficient(np.zeros(1))[0]))
    left = [one * surface ** bounce_sequence(name).count("S") for name, one in zip(families, left, strict=True)]
    taken = float(scene.water.absorption(ping_geometry.frequency))
    power = np.array(left) ** 2 * 10 ** (-taken * length / 10) / length**2
    return length, np.array([way.arrival for way in ways]), power


def _elevation_spreads(
    sea: GlintSpread | None, families: tuple[str, ...], source_depth: float, distance: Floats, depth: float
) -> Floats:
    """Standard deviation of the elevation at which legs leave, by what glints of them there are [rad], (f, n).

    RaySpreads in bearing are left out: what one bearing loses by them, others get.

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
            found[row] = legs.elevation_change * legs.glints * np.sqrt((sea.slopes[0] + sea.slopes[2]) / 2)
    return found


def _gains(
    ping_geometry: PingGeometry, there: Floats, here: Floats, up: NDArray[np.bool_], rises: list[Floats]
) -> Floats:
    """Two-way gain of each channel, the legs out and back of each two families, over all bearings, (c, f, f, n).

    Args:
        ping_geometry: The sonar.
        there: Directions of arrival to the north of the legs out, (f, n, 3).
        here: The same of the legs from the receiver, (f, n, 3).
        up: Families that leave upwards, (f,).
        rises: Of `_elevation_spreads`, for the way out and for that from the receiver.
    """
    channels = np.unique(np.linspace(0, ping_geometry.channel_count - 1, MAX_CHANNELS).astype(int))
    if ping_geometry.elements is not None:
        channels = channels[:1]
    sent, heard = ping_geometry.transmit_beams, ping_geometry.bounding_receive_beams
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
            for off in ELEVATION_DEVIATIONS:
                turned = down + off * rise
                ahead = way[..., :2] * (np.cos(turned) / np.maximum(level, 1e-12))[..., None]
                mean += beams.gain(np.concatenate([ahead, np.sin(turned)[..., None]], axis=-1))[rows] ** 2
            mean /= 1 + len(ELEVATION_DEVIATIONS)
        return np.asarray(mean)

    out = energy(sent, there, outwards[0], rises[0])
    back = energy(heard, here, outwards[1], rises[1])
    return np.asarray(np.einsum("cbin,cbjn->cijn", out, back))


def _axis(beams: Beams, rows: NDArray[np.intp]) -> Floats:
    """Where some beams point, in the world, (n, 3)."""
    aside = beams.steer[np.minimum(rows, len(beams.steer) - 1)]
    ahead = np.sqrt(np.maximum(1 - np.sum(aside**2, axis=1, keepdims=True), 0))
    return np.asarray(np.concatenate([ahead, aside], axis=1) @ beams.axes)


def _cross_section(law: Law, arriving: Floats, leaving: Floats) -> Floats:
    """Cross section of level ground for a leg out and a leg back by their directions of arrival, (n,)."""
    if isinstance(law, CompiledLaw):
        normal = np.zeros((3, len(arriving)))
        normal[2] = -1.0
        return np.asarray(law.cross_section(arriving.T, -leaving.T, normal), float)
    into, off = (np.arcsin(np.clip(way[:, 2], 0, 1)) for way in (arriving, leaving))
    return np.asarray(law.cross_section(into, off, np.array(np.pi)))
