"""Sample allocation: numbers of points at which each pair of legs is evaluated, few for weak pairs.

Energies that arrive at the same time add, so the error of a weak pair is masked by strong ones. Every point of a radial
has an evenly spread priority; a pair is evaluated at the points with a priority below its keep probability, with a
correspondingly larger weight, so the mean is unbiased. The keep probability follows the energy that one point adds to
that received at the same time, by the sonar equation over a flat seabed: the allocation of least variance for the work.

Source: Neyman (1934), J. R. Stat. Soc. 97(4), optimum allocation in stratified sampling; from memory.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.engines.arrived_energy import NEGLIGIBLE, arrived_energy
from insonify.engines.fast_reverberation._radial_samples_kernel import FULL_PROBABILITY
from insonify.engines.fast_reverberation._sample_allocation_kernel import (
    lengthen_steps,
    pair_energies,
    pair_keep_probabilities,
)
from insonify.propagation.families import bounce_sequence, image_depth
from insonify.scattering.compiled_law import CompiledLaw
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

MIN_PROBABILITY_STEPS = 1
"""Smallest keep probability of a pair that is received."""
RANGE_BINS = 48
"""Number of range bins with one keep probability each."""
FULL_SAMPLING_ENERGY = 0.01
"""Energy of a point, as part of what is received with it, from which on every point counts: about the variance of a
sample that importance sampling may cost, where all of the energy is sampled [1]."""
BOUNCE_COST_FACTOR = 2.0
"""Factor on it for pairs with bottom bounces over uneven ground, whose legs have planes of their own [1]."""
INTERFERENCE_PULSES = 4.0
"""Lag at which two arrivals no longer interfere, in durations of the pulse's energy [1]."""
MAX_STEP = 8
"""Longest step of a line where few of its points are evaluated [steps]."""


@dataclass(frozen=True, eq=False)
class SampleAllocation:
    """Points of each radial at which every pair is evaluated."""

    radials: Floats
    """See `RadialSet`: those that came in, some of them cut in two, the rest in longer steps, (s, 9)."""
    pair: NDArray[np.int64]
    """Rows of two families, the first never after the second, (p, 2)."""
    edges: Floats
    """Edges of the range bins, horizontal distances [m], (b + 1,)."""
    keep_probability: NDArray[np.uint8]
    """Part of the points of each line and range bin, in parts of `FULL_PROBABILITY`, (s, b, p)."""
    close: NDArray[np.bool_]
    """True: any pairs of a range bin may arrive within one pulse, (b,)."""
    energies: Callable[[Floats], NDArray[np.float32]]
    """Energy of every pair from each range bin of some lines over a flat bed without targets [m^-2], (s, b, p)."""


def allocate_samples(
    ping_geometry: PingGeometry, depth: float, rise: float, families: tuple[str, ...], radials: Floats, step: float,
    heading: float, law: CompiledLaw, reflection_products: NDArray[np.complex64], absorption_db: float,
    steepness: float,
) -> SampleAllocation:  # fmt: skip
    """Keep probabilities of all pairs along the lines of one ping.

    Args:
        ping_geometry: The sonar, both ends at one position.
        depth: Depth of the mean seabed [m].
        rise: Largest height of the seabed above or below it [m].
        families: Families that reach the seabed.
        radials: See `RadialSet`.
        step: Distance of samples along them [m].
        heading: Heading of their frame [rad].
        law: Scattering law of the seabed.
        reflection_products: Product of all bounces of a family over evenly spaced sines, (f, nodes).
        absorption_db: Absorption of the water [dB/m].
        steepness: Slope of the seabed that is reckoned with [1].
    """
    count = len(families)
    pair = np.array([(i, j) for i in range(count) for j in range(i, count)], np.int64)
    if not len(radials):
        return SampleAllocation(radials, pair, np.zeros(2), np.zeros((0, 1, len(pair)), np.uint8), np.zeros(1, bool),
                        lambda _: np.zeros((0, 1, len(pair)), np.float32))  # fmt: skip
    nearest, farthest = float(radials[:, 4].min()), float(radials[:, 5].max())
    edges = nearest + (farthest - nearest) * np.linspace(0, 1, RANGE_BINS + 1) ** 1.5
    source, speed = float(ping_geometry.transmit_position[2]), ping_geometry.sound_speed
    climbs = np.array([depth - image_depth(name, source, depth) for name in families])
    middle = (edges[1:] + edges[:-1]) / 2
    strength = _strengths(middle, climbs, pair, law, reflection_products, absorption_db, steepness)
    odd = np.array([len(bounce_sequence(name)) % 2 == 1 for name in families])
    sent, received, same_beams = (
        ping_geometry.transmit_beams.kernel_tables,
        ping_geometry.receive_beams.kernel_tables,
        ping_geometry.same_beams,
    )

    def energies(lines: Floats) -> NDArray[np.float32]:
        line_energy = np.empty((len(lines), RANGE_BINS, len(pair)), np.float32)
        pair_energies(lines, heading, edges, climbs, odd, pair, strength, sent, received, same_beams, line_energy)
        return line_energy

    energy = energies(radials)
    pulse, total = ping_geometry.pulse, energy.sum(axis=0, dtype=float).T
    pair_delay = (np.hypot(edges, climbs[:, None]) / speed)[pair].sum(axis=1)
    lasting = np.maximum(np.diff(pair_delay, axis=1), pulse.effective_duration) / pulse.effective_duration
    whole = np.diff(arrived_energy(pair_delay, total), axis=1) / lasting
    needed = np.ascontiguousarray((total / lasting >= NEGLIGIBLE * whole).T)
    pair_group = _interfering_pairs(
        edges, climbs, pair, speed, rise, INTERFERENCE_PULSES * pulse.effective_duration, needed
    )
    costly = np.array([any("B" in families[k] for k in rows_of_pair) for rows_of_pair in pair]) & (steepness > 0)
    least = np.ascontiguousarray(
        np.maximum(FULL_SAMPLING_ENERGY * np.where(costly, BOUNCE_COST_FACTOR, 1.0)[:, None] * whole, 1e-300).T
    )

    def keep_probabilities(lines: Floats, pair_energy: NDArray[np.float32]) -> NDArray[np.uint8]:
        length = np.clip(np.minimum(edges[1:], lines[:, 5:6]) - np.maximum(edges[:-1], lines[:, 4:5]), 0, None)
        keep_probability = np.empty(pair_energy.shape, np.uint8)
        pair_keep_probabilities(
            pair_energy, length / (step * lines[:, 8:9]), least, needed, pair_group, keep_probability, FULL_PROBABILITY,
            MIN_PROBABILITY_STEPS,
        )  # fmt: skip
        return keep_probability

    lengthened, row = np.empty((2 * len(radials), radials.shape[1])), np.empty(2 * len(radials), np.int64)
    count = lengthen_steps(
        radials, edges, keep_probabilities(radials, energy), FULL_PROBABILITY, MAX_STEP, lengthened, row
    )
    radials, row = lengthened[:count], row[:count]
    energy = energy[row]
    energy[(edges[1:] <= radials[:, 4:5]) | (edges[:-1] >= radials[:, 5:6])] = 0
    return SampleAllocation(
        radials, pair, edges, keep_probabilities(radials, energy), (pair_group != np.arange(len(pair))).any(axis=1),
        energies,
    )  # fmt: skip


def _strengths(
    distance: Floats, climbs: Floats, pair: NDArray[np.int64], law: CompiledLaw,
    reflection_products: NDArray[np.complex64], absorption_db: float, steepness: float,
) -> Floats:  # fmt: skip
    """Cross section of each pair times the squares of both legs' pressures at some distances [m^-4], (p, n)."""
    length = np.hypot(distance, climbs[:, None])
    sine = climbs[:, None] / length
    nodes = reflection_products.shape[1] - 1
    bounced = (
        np.abs(
            np.stack([row[np.rint(x * nodes).astype(int)] for row, x in zip(reflection_products, sine, strict=True)])
        )
        ** 2
    )
    power = bounced * 10 ** (-absorption_db * length / 10) / length**2
    into = np.stack([np.sqrt(1 - sine**2), 0 * sine, sine], axis=1).astype(np.float32)
    strength = np.zeros((len(pair), len(distance)))
    for tilt in (-steepness, 0.0, steepness):
        normal = np.empty((3, len(distance)), np.float32)
        normal[:] = np.array([[np.sin(tilt)], [0.0], [-np.cos(tilt)]])
        section = np.empty(len(distance), np.float32)
        for row, (i, j) in enumerate(pair):
            law.fill(into[i], -into[j], normal, section)
            strength[row] += section / 3 * power[i] * power[j]
    return strength


def _interfering_pairs(
    edges: Floats, climbs: Floats, pair: NDArray[np.int64], speed: float, rise: float, pulse: float,
    needed: NDArray[np.bool_],
) -> NDArray[np.int64]:  # fmt: skip
    """First of the pairs that may arrive within one pulse of each other, for each of them, itself for none, (b, p)."""
    ends = [(np.hypot(edges, climbs[:, None] + up) / speed)[pair].sum(axis=1).T for up in (-rise, rise)]
    pair_delay = np.stack([end[part] for end in ends for part in (slice(None, -1), slice(1, None))])
    lag = pair_delay[..., :, None] - pair_delay[..., None, :]
    overlap = (lag.min(axis=0) <= pulse) & (lag.max(axis=0) >= -pulse) & needed[:, :, None] & needed[:, None, :]
    overlap |= np.eye(len(pair), dtype=bool)
    for _ in range(int(np.ceil(np.log2(len(pair)))) if (overlap.sum(axis=(1, 2)) > len(pair)).any() else 0):
        overlap = np.matmul(overlap.astype(np.float32), overlap.astype(np.float32)) > 0
    return np.asarray(overlap.argmax(axis=2), np.int64)
