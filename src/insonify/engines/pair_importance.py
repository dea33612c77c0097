"""Selection of path pairs: pairs weak against simultaneous arrivals are evaluated at few scatterers.

Roughness reduces a leg that bounces steeply or often, and such legs cost most; in many channels each echo costs as
much, over a flat seabed too. The importance of a pair is estimated by
the sonar equation over the mean plane: its energy re all energy that arrives at the same time, by distance and channel.
A family of which all pairs are negligible is not followed. A weak pair is evaluated at some of the scatterers: each
scatterer has a priority that belongs to its position, and the pair is kept where the priority lies below the pair's
keep probability, with its energy divided by that probability. So the mean is unbiased, every ping, channel and thread
selects the same scatterers, and no echo of a weak pair is stronger than those of a strong one.

The reflection coefficient of the seabed does not enter, so that seabeds of any reflection have echoes at the same
scatterers: each pair has the larger of its fractions over a seabed that reflects nothing and one with `REFLECTED`.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.engines._pair_importance_kernel import assign_priorities, mark_sampled_families
from insonify.engines.arrived_energy import NEGLIGIBLE, arrived_energy
from insonify.engines.glint_spread import GlintSpread, glint_spread
from insonify.engines.relief_reflections import coherent_bounce_factor
from insonify.propagation.families import bottom_bounces, first_boundary, surface_bounces
from insonify.propagation.local_planes import flat_image_paths
from insonify.propagation.propagation_model import PropagationModel
from insonify.recent_results import Identity, RecentResults
from insonify.records.legs import LegStatus
from insonify.records.pairs import PairSampling
from insonify.scattering.compiled_law import CompiledLaw
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Law, Scatterers
from insonify.scene.scene import Scene
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.floating[Any]]

RANGE_BINS = 64
"""Number of range bins of horizontal distance, in each of which the same families are received."""
BEARINGS = 16
"""Number of bearings at which beams are evaluated, besides those of their axes."""
RANGE_MARGIN = 1.25
"""Largest distance of the seabed re that of the last arrival in the window [1]."""
MAX_CHANNELS = 8
"""Largest number of channels that are evaluated; of more, an even selection."""
FULL_SAMPLING_FRACTION = 0.25
"""Fraction of the simultaneous energy above which a pair is evaluated at every scatterer; below, its keep probability
is its fraction re this, so that no echo is stronger than there [1]."""
REFLECTED = 0.5
"""Modulus of the reflection coefficient of the seabed assumed for pairs with bottom bounces [1]."""
ELEVATION_DEVIATIONS = (-1.84, -1.12, -0.68, -0.33, 0.33, 0.68, 1.12, 1.84)
"""Deviations of the elevation of a leg that a moving surface reflects, besides 0, re the standard deviation [1].

These nine are equally likely.
"""
MIN_KEEP_PROBABILITY = 1 / 32
"""Smallest keep probability of a pair that is not dropped [1]."""

_UNIT_EDGES = np.linspace(0, 1, RANGE_BINS + 1) ** 1.5
"""Edges of the range bins re the largest distance [1], (RANGE_BINS + 1,)."""
_SAMPLED: RecentResults[tuple[NDArray[np.float32], NDArray[np.float32]]] = RecentResults(8)
"""Keep probabilities of pairs, by their energy fractions: those of pings alike in depth and attitude."""


@dataclass(frozen=True, slots=True)
class PairSelection:
    """Families and pairs of one ping at n scatterers of the seabed."""

    families: tuple[str, ...]
    """Families that are followed, f of them; always with the first one."""
    needed: NDArray[np.bool_] | None
    """True: any pair of each family is evaluated at a scatterer, shape (f, n); None: all are everywhere."""
    sampling: PairSampling | None
    """Sampling of each ordered pair of families, f * f of them; None: all are evaluated everywhere."""

    def sampling_of(self, transmit_families: tuple[str, ...], receive_families: tuple[str, ...]) -> PairSampling | None:
        """Sampling of p pairs; None: all are evaluated everywhere.

        Args:
            transmit_families: Family of the transmit leg of each pair.
            receive_families: Family of the receive leg of each pair.
        """
        if self.sampling is None:
            return None
        number = {name: k for k, name in enumerate(self.families)}
        row = [
            number[sent] * len(number) + number[received]
            for sent, received in zip(transmit_families, receive_families, strict=True)
        ]
        keep_probability = self.sampling.keep_probability
        every = row == list(range(len(keep_probability)))
        return self.sampling if every else replace(self.sampling, keep_probability=keep_probability[np.array(row, int)])


def select_pairs(
    families: tuple[str, ...], energy_fraction: Floats, ping_geometry: PingGeometry, position: NDArray[np.float64],
    scatterer_id: NDArray[np.uint64], seed: int,
) -> PairSelection:  # fmt: skip
    """Select the families and pairs that are evaluated at scatterers of the seabed.

    Args:
        families: Families that reach the seabed.
        energy_fraction: Result of `pair_energy_fractions`, shape (f, f, RANGE_BINS).
        ping_geometry: The sonar at this ping.
        position: North, east, depth of the positions [m], shape (n, 3).
        scatterer_id: Their scatterer ids, shape (n,).
        seed: Seed of the scatterers.
    """
    low, high = random_keys.stream_key(seed, random_keys.PAIR_SAMPLING)
    range_bin, number = np.empty(len(scatterer_id), np.uint8), np.empty(len(scatterer_id), np.float32)
    nearest_bin, farthest_bin = assign_priorities(
        position, float(ping_geometry.midpoint[0]), float(ping_geometry.midpoint[1]), _edges(ping_geometry),
        _bin_lookup(), scatterer_id, np.uint64(high << 32 | low), range_bin, number,
    )  # fmt: skip
    span = slice(nearest_bin, farthest_bin + 1) if len(scatterer_id) else slice(0, 0)
    names = significant_families(families, energy_fraction, ping_geometry, span)
    rows = [families.index(name) for name in names]
    cells = _elevation_cells(ping_geometry)
    keep_probability, largest = _SAMPLED.get(
        (Identity(energy_fraction), names, cells), lambda: _sampled(energy_fraction[np.ix_(rows, rows)] * cells)
    )
    if (keep_probability[..., span] >= 1).all():
        return PairSelection(names, None, None)
    is_evaluated = np.empty((len(names), len(scatterer_id)), bool)
    mark_sampled_families(number, range_bin, largest, is_evaluated)
    return PairSelection(
        names, is_evaluated, PairSampling(number, range_bin, keep_probability.reshape(len(names) ** 2, -1))
    )


@lru_cache(maxsize=1)
def _bin_lookup() -> NDArray[np.uint8]:
    """Range bin that each even part of the distance begins in; parts half as long as the shortest range bin."""
    parts = int(2 / _UNIT_EDGES[1])
    # 1e-9 inwards: a part that begins on an edge may be rounded to before it
    return (np.searchsorted(_UNIT_EDGES, np.arange(parts) / parts - 1e-9, side="right") - 1).clip(0).astype(np.uint8)


def keep_probabilities_at(
    families: tuple[str, ...], energy_fraction: Floats, ping_geometry: PingGeometry, distance: Floats
) -> Floats:
    """Keep probability of each pair, 0 where a leg of it is not followed [1], shape (f, f, n).

    Args:
        families: Families that reach the seabed.
        energy_fraction: Result of `pair_energy_fractions`, shape (f, f, RANGE_BINS).
        ping_geometry: The sonar at this ping.
        distance: Distances of the scatterers along the seabed [m], shape (n,).
    """
    keep_probability = _keep_probabilities(energy_fraction * _elevation_cells(ping_geometry))
    for range_bin in range(RANGE_BINS):
        significant = significant_families(families, energy_fraction, ping_geometry, slice(range_bin, range_bin + 1))
        dropped = [row for row, name in enumerate(families) if name not in significant]
        keep_probability[dropped, :, range_bin] = keep_probability[:, dropped, range_bin] = 0.0
    bins = np.searchsorted(_edges(ping_geometry), distance, side="right") - 1
    return np.asarray(keep_probability[..., np.clip(bins, 0, RANGE_BINS - 1)])


def _sampled(energy_fraction: Floats) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Keep probability of each pair, shape of `energy_fraction`, and the largest of each family, (f, RANGE_BINS)."""
    keep_probability = _keep_probabilities(energy_fraction).astype(np.float32)
    return keep_probability, keep_probability.max(axis=1)


def _keep_probabilities(energy_fraction: Floats) -> Floats:
    """Keep probability of each pair, the same for both orders [1], shape of `energy_fraction`.

    A range bin has the largest keep probability of its neighbours, because the seabed is not flat.
    """
    keep_probability = np.clip(
        (energy_fraction + energy_fraction.swapaxes(0, 1)) / FULL_SAMPLING_FRACTION, MIN_KEEP_PROBABILITY, 1.0
    )
    keep_probability[0, 0] = 1.0
    padded = np.pad(keep_probability, ((0, 0), (0, 0), (1, 1)), mode="edge")
    return np.asarray(np.maximum.reduce([padded[..., k : k + RANGE_BINS] for k in range(3)]))


def _elevation_cells(ping_geometry: PingGeometry) -> float:
    """Number of elevations that the receiver resolves: a weak pair may be separated from the others by steering [1].

    Recorded beams are fixed: 1. Elements resolve as many elevations as there are beams between up and down.
    """
    if ping_geometry.elements is None:
        return 1.0
    forward = np.array([np.cos(ping_geometry.first_beam_bearing), np.sin(ping_geometry.first_beam_bearing), 0.0])
    position = ping_geometry.elements.positions @ ping_geometry.receive_beams.axes
    reach = np.hypot(np.ptp(position @ forward), np.ptp(position[:, 2]))
    return float(min(1 + 2 * reach / ping_geometry.wavelength, len(position)))


def significant_families(
    families: tuple[str, ...], energy_fraction: Floats, ping_geometry: PingGeometry, span: slice
) -> tuple[str, ...]:
    """Families that are not negligible in some range bins, always with the first one.

    A range bin has the families of its neighbours too, because of the relief. Recorded elements may be steered to
    weak pairs, so the threshold is divided by the number of elements.

    Args:
        families: Families that reach the seabed.
        energy_fraction: Result of `pair_energy_fractions`, shape (f, f, RANGE_BINS).
        ping_geometry: The sonar at this ping.
        span: Range bins in which the positions lie.
    """
    elements = 1 if ping_geometry.elements is None else len(ping_geometry.elements.positions)
    own = (energy_fraction.sum(axis=0) + energy_fraction.sum(axis=1))[:, max(span.start - 1, 0) : span.stop + 1]
    bounces = _bottom_bounces(families)  # a seabed may reflect all
    significant = own.max(axis=1, initial=0.0) >= NEGLIGIBLE / elements * REFLECTED ** (2 * bounces)
    return families[:1] + tuple(name for name, keep in zip(families[1:], significant[1:], strict=True) if keep)


def pair_energy_fractions(
    scene: Scene, terrain: SeabedTerrain | None, ping_geometry: PingGeometry, families: tuple[str, ...], law: Law,
    rays: PropagationModel | None = None,
) -> Floats:  # fmt: skip
    """Energy of each pair re all that arrives at the same time, the largest of any channel [1], (f, f, RANGE_BINS).

    Args:
        scene: The scene.
        terrain: Its terrain; None: the bed is flat.
        ping_geometry: The sonar, both ends on one platform.
        families: Families that reach the seabed.
        law: Scattering law of the seabed.
        rays: Rays of layered water; None: the water has one sound speed.
    """
    edges = _edges(ping_geometry)
    middle = (edges[1:] + edges[:-1]) / 2
    pair = np.array([(i, j) for i in range(len(families)) for j in range(len(families))])
    depths = float(ping_geometry.transmit_position[2]), float(ping_geometry.receive_position[2])
    transmit, receive = (_legs(scene, terrain, ping_geometry, families, middle, depth, rays) for depth in depths)
    sea = glint_spread(scene, ping_geometry.frequency)
    spread = [_elevation_spreads(sea, families, depth, middle, scene.seabed.depth) for depth in depths]
    gains = _gains(ping_geometry, transmit.departure, receive.departure, spread)
    section = np.array([_cross_section(law, transmit.arrival[i], receive.arrival[j]) for i, j in pair])
    area = middle * np.diff(edges)
    own = (section * transmit.power[pair[:, 0]] * receive.power[pair[:, 1]] * area) * gains[:, pair[:, 0], pair[:, 1]]
    transmit_delay, receive_delay = (
        _legs(scene, terrain, ping_geometry, families, edges, depth, rays).delay for depth in depths
    )
    pair_delay = transmit_delay[pair[:, 0]] + receive_delay[pair[:, 1]]
    own *= pair_delay[:, :-1] < ping_geometry.recorded_delays[1]
    bounced = _bottom_bounces(families)[pair].sum(axis=1)
    energy_fraction = np.zeros((len(pair), RANGE_BINS))
    for left in (0.0, REFLECTED**2) if bounced.any() else (1.0,):
        for energy in own * left ** bounced[:, None]:
            total_energy = np.diff(arrived_energy(pair_delay, energy), axis=1)
            energy_fraction = np.maximum(energy_fraction, energy / np.maximum(total_energy, 1e-300))
    return energy_fraction.reshape(len(families), len(families), RANGE_BINS)


def _bottom_bounces(families: tuple[str, ...]) -> NDArray[np.int64]:
    """Bottom bounces of each family, (f,)."""
    return np.array([bottom_bounces(name) for name in families])


def _edges(ping_geometry: PingGeometry) -> Floats:
    """Edges of the range bins, distances from the transmitter along the seabed [m], (RANGE_BINS + 1,)."""
    farthest = RANGE_MARGIN * ping_geometry.sound_speed * ping_geometry.recorded_delays[1] / 2
    return np.asarray(farthest * _UNIT_EDGES)


class _MeanLegs(NamedTuple):
    """Legs of f families to n points of the mean plane, northwards from one end of the sonar."""

    delay: Floats
    """One-way travel times [s], (f, n)."""
    departure: Floats
    """Directions of travel at the sonar [1], (f, n, 3)."""
    arrival: Floats
    """Directions of travel at the points [1], (f, n, 3)."""
    power: Floats
    """Intensities re that at 1 m, with roughness, over a seabed of reflection coefficient 1 [m^-2], (f, n)."""


def _legs(
    scene: Scene, terrain: SeabedTerrain | None, ping_geometry: PingGeometry, families: tuple[str, ...],
    distance: Floats, depth: float, rays: PropagationModel | None,
) -> _MeanLegs:  # fmt: skip
    """Legs of each family from a depth [m] to horizontal distances [m]; of several rays the directions of one."""
    position = np.array([0.0, 0.0, depth])
    points = np.stack([distance, 0 * distance, np.full_like(distance, scene.seabed.depth)], axis=-1)
    paths = [flat_image_paths(name, position, points, scene.seabed.depth) for name in families]
    length = np.array([path.length for path in paths])
    factors = [np.ones_like(distance)] * len(families)
    if terrain is not None and scene.seabed.reflecting_interface == "smooth":
        factors = [
            coherent_bounce_factor(name, path, terrain, ping_geometry.wavelength)
            for name, path in zip(families, paths, strict=True)
        ]
    surface = abs(complex(scene.surface.reflection_coefficient(np.zeros(1))[0]))
    factors = [factor * surface ** surface_bounces(name) for name, factor in zip(families, factors, strict=True)]
    absorption, arrival = float(scene.water.absorption(ping_geometry.frequency)), np.array([p.arrival for p in paths])
    power = 10 ** (-absorption * length / 10) / length**2
    up = np.array([first_boundary(name) == "surface" for name in families])
    departure = arrival.copy()
    departure[..., 2] = np.where(up[:, None], -1, 1) * np.abs(arrival[..., 2])
    legs = _MeanLegs(length / ping_geometry.sound_speed, departure, arrival, power)
    if rays is not None:
        legs = _refracted(legs, rays, position, points, families, ping_geometry.frequency)
    return legs._replace(power=np.array(factors) ** 2 * legs.power)


def _refracted(
    straight: _MeanLegs, rays: PropagationModel, position: NDArray[np.float64], points: NDArray[np.float64],
    families: tuple[str, ...], frequency: float,
) -> _MeanLegs:  # fmt: skip
    """Legs by refracted rays: intensity of all rays of a family, times and directions of the strongest.

    A family without a ray has no power, and the time and directions of its straight leg.
    """
    n, up = len(points), np.array([0.0, 0.0, -1.0])
    ends = Scatterers(
        "seabed", "seabed", PointTargetLaw(0.0), points, np.tile(up, (n, 1)), np.ones(n), np.ones(n, complex),
        np.zeros(n, np.uint64),
    )  # fmt: skip
    legs, result = rays.open_water().legs(position, ends, families, frequency), _MeanLegs(*map(np.copy, straight))
    power = np.where(legs.status == LegStatus.CLEAR, (legs.spreading * legs.absorption) ** 2, 0.0)
    for row, name in enumerate(families):
        of_family = np.flatnonzero([family == name for family in legs.families])
        result.power[row] = power[of_family].sum(axis=0)
        strongest = of_family[np.argmax(power[of_family], axis=0)]
        reached = np.flatnonzero(result.power[row] > 0)
        for column, values in (
            (result.delay, legs.delay), (result.departure, legs.departure), (result.arrival, legs.arrival),
        ):  # fmt: skip
            column[row, reached] = values[strongest[reached], reached]
    return result


def _elevation_spreads(
    sea: GlintSpread | None, families: tuple[str, ...], source_depth: float, distance: Floats, depth: float
) -> Floats:
    """Standard deviation of the elevation at which legs with their glints leave the sonar [rad], (f, n).

    Spreads in bearing are left out: gains are means over all bearings.

    Args:
        sea: The moving surface; None: it is still.
        families: Families of the legs.
        source_depth: Depth of this end of the sonar [m].
        distance: Ground range [m], (n,).
        depth: Depth of the seabed [m].
    """
    deviation = np.zeros((len(families), len(distance)))
    for row, name in enumerate(families):
        legs = None if sea is None else sea.legs(name, source_depth, np.asarray(distance, float), depth)
        if sea is not None and legs is not None:
            deviation[row] = legs.elevation_change * legs.glints * np.sqrt((sea.slopes[0] + sea.slopes[2]) / 2)
    return deviation


def _gains(
    ping_geometry: PingGeometry, transmit_departure: Floats, receive_departure: Floats, elevation_spreads: list[Floats]
) -> Floats:
    """Two-way beam gain (intensity) of c channels for each pair of families, mean over all bearings [1], (c, f, f, n).

    Args:
        ping_geometry: The sonar.
        transmit_departure: Directions of travel at the transmitter of legs to the north [1], (f, n, 3).
        receive_departure: Directions at the receiver of legs to the north, followed from it [1], (f, n, 3).
        elevation_spreads: Result of `_elevation_spreads` for the transmit leg and for the receive leg.
    """
    channels = np.unique(np.linspace(0, ping_geometry.channel_count - 1, MAX_CHANNELS).astype(int))
    if ping_geometry.elements is not None:
        channels = channels[:1]
    transmit_beams, receive_beams = ping_geometry.transmit_beams, ping_geometry.bounding_receive_beams
    outwards = channels % transmit_beams.channel_count, channels % receive_beams.channel_count
    axes = np.concatenate([_axis(transmit_beams, outwards[0]), _axis(receive_beams, outwards[1])])
    around = np.linspace(0, 2 * np.pi, BEARINGS, endpoint=False)
    bearing = np.unique(np.append(around, np.arctan2(axes[:, 1], axes[:, 0])))[:, None, None]

    def leaving(into: Floats) -> Floats:
        horizontal = np.hypot(into[..., 0], into[..., 1])
        down = into[..., 2] + 0 * bearing
        return np.stack([horizontal * np.cos(bearing), horizontal * np.sin(bearing), down], axis=-1)

    def energy(beams: Beams, into: Floats, rows: NDArray[np.intp], deviation: Floats) -> Floats:
        path, chosen = leaving(into), beams.subset(rows)
        mean = chosen.gain(path) ** 2
        if deviation.any():
            horizontal, down = np.hypot(path[..., 0], path[..., 1]), np.arcsin(np.clip(path[..., 2], -1, 1))
            for multiple in ELEVATION_DEVIATIONS:
                turned = down + multiple * deviation
                flat = path[..., :2] * (np.cos(turned) / np.maximum(horizontal, 1e-12))[..., None]
                mean += chosen.gain(np.concatenate([flat, np.sin(turned)[..., None]], axis=-1)) ** 2
            mean /= 1 + len(ELEVATION_DEVIATIONS)
        return np.asarray(mean)

    transmit_energy = energy(transmit_beams, transmit_departure, outwards[0], elevation_spreads[0])
    receive_energy = energy(receive_beams, receive_departure, outwards[1], elevation_spreads[1])
    return np.asarray(np.einsum("cbin,cbjn->cijn", transmit_energy, receive_energy))


def _axis(beams: Beams, rows: NDArray[np.intp]) -> Floats:
    """Axes of some beams in the world [1], (n, 3)."""
    aside = beams.steer[np.minimum(rows, len(beams.steer) - 1)]
    forward = np.sqrt(np.maximum(1 - np.sum(aside**2, axis=1, keepdims=True), 0))
    return np.asarray(np.concatenate([forward, aside], axis=1) @ beams.axes)


def _cross_section(law: Law, transmit_arrival: Floats, receive_arrival: Floats) -> Floats:
    """Cross section per area of a flat seabed for n pairs of legs, by directions of travel at it [1], (n,)."""
    if isinstance(law, CompiledLaw):
        normal = np.zeros((3, len(transmit_arrival)))
        normal[2] = -1.0
        return np.asarray(law.cross_section(transmit_arrival.T, -receive_arrival.T, normal), float)
    incident, scattered = (np.arcsin(np.clip(path[:, 2], 0, 1)) for path in (transmit_arrival, receive_arrival))
    return np.asarray(law.cross_section(incident, scattered, np.array(np.pi)))
