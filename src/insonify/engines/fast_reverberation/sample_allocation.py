"""Sample allocation: numbers of samples at which each pair of families is evaluated, few for weak pairs.

Energies that arrive at the same time add, so the error of a weak pair is masked by strong ones. Priorities of samples
are evenly distributed; a pair is evaluated at the samples with a priority below its keep probability, with a
correspondingly larger weight, so the mean is unbiased. The keep probability follows from the energy of one sample re
that received at the same time, by the sonar equation over a flat seabed: the allocation of least variance for the work.

Source: Neyman (1934), J. R. Stat. Soc. 97(4), optimum allocation in stratified sampling; not verified.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines.arrived_energy import NEGLIGIBLE, arrived_energy
from insonify.engines.fast_reverberation._radial_samples_kernel import FULL_PROBABILITY
from insonify.engines.fast_reverberation._sample_allocation_kernel import (
    add_radials,
    lengthen_steps,
    pair_energies,
    pair_keep_probabilities,
)
from insonify.engines.fast_reverberation.flat_seabed_legs import FlatSeabedLegs, flat_seabed_legs
from insonify.engines.radial_tables import STRAIGHT, RefractionTable
from insonify.propagation.families import bottom_bounces, bounce_sequence, image_depth
from insonify.recent_results import Identity, RecentResults
from insonify.scattering.compiled_law import CompiledLaw
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

MIN_PROBABILITY_STEPS = 1
"""Smallest keep probability of a pair that is received, in units of 1 / `FULL_PROBABILITY`."""
RANGE_BINS = 48
"""Number of range bins of a radial; a pair has one keep probability in each."""
EDGE_FRACTIONS = np.linspace(0, 1, RANGE_BINS + 1) ** 1.5
"""Edges of the range bins, from 0 at the nearest to 1 at the farthest horizontal distance [1]."""
FULL_SAMPLING_ENERGY = 0.01
"""Energy of one sample re that received at the same time for which the keep probability is 1 [1]: about the variance
due to importance sampling."""
BOUNCE_COST_FACTOR = 2.0
"""Factor on `FULL_SAMPLING_ENERGY` for pairs with bottom bounces over relief, whose legs need local planes [1]."""
INTERFERENCE_PULSES = 4.0
"""Lag at which two arrivals no longer interfere, in durations of the pulse's energy [1]."""
MAX_STEP = 8
"""Longest step of a radial with low keep probabilities, in steps of the radials' frame [1]."""


@dataclass(frozen=True, eq=False)
class SampleAllocation:
    """Keep probabilities of the samples of each radial."""

    radials: Floats
    """See `radial_columns`: the given radials, some of them split, with longer steps in the farther part, (s, 9)."""
    pair: NDArray[np.int64]
    """Rows of the two families of each pair, the lower one first, (p, 2)."""
    edges: Floats
    """Edges of the range bins, horizontal distances [m], (b + 1,)."""
    keep_probability: NDArray[np.uint8]
    """Keep probability by radial, range bin and pair, in units of 1 / `FULL_PROBABILITY`, (s, b, p)."""
    interferes: NDArray[np.bool_]
    """True: several pairs of the range bin may arrive within one pulse, (b,)."""
    energies: Callable[[Floats], NDArray[np.float32]]
    """Function of radials (s, 9) that returns the energy of every pair from each range bin over a flat seabed without
    targets [m^-2], (s, b, p)."""


def allocate_samples(
    ping_geometry: PingGeometry, depth: float, rise: float, families: tuple[str, ...], radials: Floats, step: float,
    heading: float, law: CompiledLaw, reflection_products: NDArray[np.complex64], absorption_db: float,
    slope: float, refraction: RefractionTable = STRAIGHT,
) -> SampleAllocation:  # fmt: skip
    """Keep probabilities of all pairs along the radials of one ping.

    Args:
        ping_geometry: The sonar, both ends at one position.
        depth: Depth of the mean seabed [m].
        rise: Largest deviation of the seabed from that depth [m].
        families: Families that reach the seabed.
        radials: See `radial_columns`.
        step: Distance of samples along them [m].
        heading: Heading of their frame [rad].
        law: Scattering law of the seabed.
        reflection_products: Product of the reflection coefficients of each family over evenly spaced sines of the
            grazing angle, 0 to 1 [1], (f, nodes).
        absorption_db: Absorption of the water [dB/m].
        slope: Assumed slope of the seabed, 0 for a flat one [1].
        refraction: Refraction table of the families.
    """
    pair, odd, has_bottom_bounce = _pairs_of(families)
    if not len(radials):
        return SampleAllocation(radials, pair, np.zeros(2), np.zeros((0, 1, len(pair)), np.uint8), np.zeros(1, bool),
                        lambda _: np.zeros((0, 1, len(pair)), np.float32))  # fmt: skip
    nearest, farthest = float(radials[:, column.START].min()), float(radials[:, column.STOP].max())
    edges = nearest + (farthest - nearest) * EDGE_FRACTIONS
    water = _FlatSeabedWater(
        float(ping_geometry.transmit_position[2]), depth, rise, ping_geometry.sound_speed, absorption_db, slope,
        families, Identity(refraction),
    )  # fmt: skip
    flat_pairs = _FLAT_SEABED_PAIRS.get(
        (water, *map(Identity, (law, reflection_products)), edges.tobytes()),
        lambda: _flat_seabed_pairs(water, refraction, law, reflection_products, edges),
    )
    climb, strength = flat_pairs.climb, flat_pairs.strength
    transmit, receive = ping_geometry.transmit_beams.kernel_tables, ping_geometry.receive_beams.kernel_tables
    same_beams = ping_geometry.same_beams

    def energies(subset: Floats) -> NDArray[np.float32]:
        radial_energy = np.empty((len(subset), RANGE_BINS, len(pair)), np.float32)
        pair_energies(subset, heading, edges, climb, odd, pair, strength, transmit, receive, same_beams, radial_energy)
        return radial_energy

    energy = energies(radials)
    pulse, sums = ping_geometry.pulse, np.empty((RANGE_BINS, len(pair)))
    add_radials(energy.reshape(len(radials), -1), sums.reshape(-1))
    total = sums.T
    pair_delay, duration = flat_pairs.delay, pulse.effective_duration
    durations = np.maximum(np.diff(pair_delay, axis=1), duration) / duration
    energy_sum = np.diff(arrived_energy(pair_delay, total), axis=1) / durations
    received = np.ascontiguousarray((total / durations >= NEGLIGIBLE * energy_sum).T)
    pair_group = _interfering_pairs(flat_pairs.extreme_delays, pair, INTERFERENCE_PULSES * duration, received)
    costly = has_bottom_bounce & (slope > 0)
    full_energy = np.ascontiguousarray(
        np.maximum(FULL_SAMPLING_ENERGY * np.where(costly, BOUNCE_COST_FACTOR, 1.0)[:, None] * energy_sum, 1e-300).T
    )

    def keep_probabilities(subset: Floats, row: NDArray[np.int64]) -> NDArray[np.uint8]:
        keep_probability = np.empty((len(subset), RANGE_BINS, len(pair)), np.uint8)
        pair_keep_probabilities(
            subset, edges, step, energy, row, full_energy, received, pair_group, keep_probability, FULL_PROBABILITY,
            MIN_PROBABILITY_STEPS,
        )  # fmt: skip
        return keep_probability

    lengthened, row = np.empty((2 * len(radials), radials.shape[1])), np.empty(2 * len(radials), np.int64)
    count = lengthen_steps(
        radials, edges, keep_probabilities(radials, np.arange(len(radials))), FULL_PROBABILITY, MAX_STEP, lengthened,
        row,
    )  # fmt: skip
    radials, row = lengthened[:count], row[:count]
    return SampleAllocation(
        radials, pair, edges, keep_probabilities(radials, row), (pair_group != np.arange(len(pair))).any(axis=1),
        energies,
    )  # fmt: skip


class _FlatSeabedWater(NamedTuple):
    """Depth of a sonar, and water and seabed of its legs to a flat seabed, without the reflections."""

    source: float
    """Depth of the sonar [m]."""
    depth: float
    """Depth of the mean seabed [m]."""
    rise: float
    """Largest deviation of the seabed from that depth [m]."""
    speed: float
    """Sound speed of straight rays [m/s]."""
    absorption_db: float
    """Absorption of the water [dB/m]."""
    slope: float
    """Assumed slope of the seabed [1]."""
    families: tuple[str, ...]
    """Families that reach the seabed."""
    refraction: Identity
    """Refraction table of the families."""


class _FlatSeabedPairs(NamedTuple):
    """Pairs of legs to a flat seabed, the same in all attitudes of a sonar."""

    climb: Floats
    """`FlatSeabedLegs.climb` in the middle of each range bin [m], (f, b)."""
    strength: Floats
    """Cross section per area of each pair times the squares of both legs' pressures [m^-4], (p, b)."""
    delay: Floats
    """Two-way travel time of each pair to the edges of the range bins [s], (p, b + 1)."""
    extreme_delays: list[Floats]
    """One-way travel times of the families to these edges on a flat seabed at the least and the greatest depth [s],
    (f, b + 1) each; none where there is one pair."""


_FLAT_SEABED_PAIRS: RecentResults[_FlatSeabedPairs] = RecentResults(8)
"""Pairs for the sonar depths used last; both sides of a sonar share them."""


def _flat_seabed_pairs(
    water: _FlatSeabedWater, refraction: RefractionTable, law: CompiledLaw, reflection_products: NDArray[np.complex64],
    edges: Floats,
) -> _FlatSeabedPairs:  # fmt: skip
    """Pairs of legs to a flat seabed; arguments are those of `allocate_samples`, edges those of the range bins [m]."""
    pair, depth = _pairs_of(water.families)[0], water.depth
    image_depths = np.array([image_depth(name, water.source, depth) for name in water.families])
    legs = partial(flat_seabed_legs, refraction, image_depths, water.speed)
    in_bins = legs((edges[1:] + edges[:-1]) / 2, depth)
    return _FlatSeabedPairs(
        np.ascontiguousarray(in_bins.climb),
        _strengths(in_bins, pair, law, reflection_products, water.absorption_db, water.slope),
        legs(edges, depth).delay[pair].sum(axis=1),
        [legs(edges, depth + shift).delay for shift in (-water.rise, water.rise)] if len(pair) > 1 else [],
    )


@lru_cache(maxsize=32)
def _pairs_of(families: tuple[str, ...]) -> tuple[NDArray[np.int64], NDArray[np.bool_], NDArray[np.bool_]]:
    """Pairs of families.

    Returns:
        Rows of two families, (p, 2); True for families with an odd number of bounces, (f,); True for pairs with a
        bottom bounce, (p,).
    """
    count = len(families)
    pair = np.array([(i, j) for i in range(count) for j in range(i, count)], np.int64)
    odd = np.array([len(bounce_sequence(name)) % 2 == 1 for name in families])
    has_bottom_bounce = np.array([any(bottom_bounces(families[k]) for k in rows_of_pair) for rows_of_pair in pair])
    return pair, odd, has_bottom_bounce


def _strengths(
    legs: FlatSeabedLegs, pair: NDArray[np.int64], law: CompiledLaw, reflection_products: NDArray[np.complex64],
    absorption_db: float, slope: float,
) -> Floats:  # fmt: skip
    """Cross section per area of each pair times the squares of both legs' pressures at n distances [m^-4], (p, n).

    The cross section is the mean over a seabed that rises, is flat, and falls outwards by the slope [1].
    """
    length, sine = legs.length, legs.arrival_sine
    node = np.rint(legs.bounce_sine * (reflection_products.shape[1] - 1)).astype(int)
    reflected = np.abs(reflection_products[np.arange(len(node))[:, None], node]) ** 2
    power = reflected * 10 ** (-absorption_db * length / 10) / length**2 * legs.pressure**2
    direction = np.zeros((3, *sine.shape), np.float32)
    direction[0], direction[2] = np.sqrt(1 - sine**2), sine
    normal = _tilted_normals(slope, pair.shape[0] * length.shape[1])
    directions = np.empty((2, 3, 3, len(pair), length.shape[1]), np.float32)
    directions[0], directions[1] = direction[:, None, pair[:, 0]], -direction[:, None, pair[:, 1]]
    cross_section = np.empty(normal.shape[1], np.float32)
    incoming, outgoing = directions.reshape(2, 3, -1)
    law.fill(incoming, outgoing, normal, cross_section)
    strength, transmit, receive = np.zeros((len(pair), length.shape[1])), power[pair[:, 0]], power[pair[:, 1]]
    for section in cross_section.reshape(3, *strength.shape):
        strength += section / 3 * transmit * receive
    return strength


@lru_cache(maxsize=16)
def _tilted_normals(slope: float, count: int) -> NDArray[np.float32]:
    """Unit normals of seabed that rises, is flat, and falls outwards, each `count` times [1], (3, 3 * count)."""
    tilt = np.repeat([-slope, 0.0, slope], count)
    return np.stack([np.sin(tilt), 0 * tilt, -np.cos(tilt)]).astype(np.float32)


def _interfering_pairs(
    delays: list[Floats], pair: NDArray[np.int64], max_lag: float, needed: NDArray[np.bool_]
) -> NDArray[np.int64]:
    """First of the pairs that may arrive within a lag of each pair, possibly the pair itself, (b, p).

    Args:
        delays: One-way travel times of the families to the edges of the range bins [s], on a flat seabed at the least
            and the greatest depth, (f, b + 1) each.
        pair: Rows of two families, (p, 2).
        max_lag: Largest lag [s].
        needed: True for the pairs that are received, (b, p).
    """
    if len(pair) == 1:
        return np.zeros(needed.shape, np.int64)
    at_edges = [delay[pair].sum(axis=1).T for delay in delays]
    pair_delay = np.stack([delay[side] for delay in at_edges for side in (slice(None, -1), slice(1, None))])
    lag = pair_delay[..., :, None] - pair_delay[..., None, :]
    overlap = (lag.min(axis=0) <= max_lag) & (lag.max(axis=0) >= -max_lag) & needed[:, :, None] & needed[:, None, :]
    overlap |= np.eye(len(pair), dtype=bool)
    for _ in range(int(np.ceil(np.log2(len(pair)))) if (overlap.sum(axis=(1, 2)) > len(pair)).any() else 0):
        overlap = np.matmul(overlap.astype(np.float32), overlap.astype(np.float32)) > 0
    return np.asarray(overlap.argmax(axis=2), np.int64)
