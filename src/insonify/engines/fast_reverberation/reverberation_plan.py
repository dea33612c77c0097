"""Reverberation plan: tables for all pings from one depth in one attitude.

It has the radials about the sonar, the keep probability of each pair of families along them, and tables of bounces. A
sonar at constant depth and attitude uses the same plan at every ping.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines.fast_reverberation._radial_samples_kernel import RangeBins, count_samples, list_samples
from insonify.engines.fast_reverberation.sample_allocation import SampleAllocation, allocate_samples
from insonify.engines.radial_tables import FamilyTable, RefractionTable, SampleLists
from insonify.engines.terrain_occlusion import fresnel_half_length
from insonify.ocean.water import Water
from insonify.propagation.bounding_cylinders import bounding_cylinders
from insonify.propagation.families import DIRECT, bounce_sequence, first_boundary, image_depth, last_boundary
from insonify.propagation.launch_angles import LaunchAngles
from insonify.propagation.propagation_model import PropagationModel
from insonify.recent_results import Identity, RecentResults
from insonify.scattering.compiled_law import CompiledLaw
from insonify.scene.scene import Scene
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

REFLECTION_NODES = 2049
"""Number of sines of the grazing angle in the table of reflection products."""
ASSUMED_SLOPE = 0.05
"""Slope of terrain with relief that is assumed in the sample allocation [1]."""


@dataclass(frozen=True, eq=False)
class ReverberationPlan:
    """Radials, sample lists and reflection tables of all pings from one depth in one attitude."""

    families: tuple[str, ...]
    law: CompiledLaw
    radials: Floats
    """See `radial_columns`, (s, 9)."""
    step: float
    """Spacing of samples along the radials [m]."""
    allocation: SampleAllocation
    table: FamilyTable
    """Tables of the families."""
    bounding_cylinders: Floats
    """North and east of the axis, radius, depths of top and base of an upright cylinder about each target that casts a
    shadow [m], (t, 5)."""
    lists: SampleLists
    """Samples of each radial, shadows of targets disregarded."""

    @property
    def sample_count(self) -> int:
        """Number of samples of the seabed of a ping, shadows of targets disregarded."""
        return int(self.lists.sample_counts.sum())

    @cached_property
    def sample_sizes(self) -> tuple[int, int, int]:
        """Sizes of the lists of all radials together, see `sizes_of_lists`."""
        return sizes_of_lists(self.lists, np.arange(len(self.radials)))

    @cached_property
    def energy(self) -> NDArray[np.float32]:
        """Energy of every pair, both orders, from each range bin of each radial, re the pulse's energy at 1 m [m^-2].

        Shape (s, b, p), over the mean seabed without targets. Beams are evaluated across the width of each
        radial: near a null the gain on its centre line is less than the mean over its width.
        """
        across = self.radials.copy()
        across[:, column.BEAM_SPREAD] = across[:, column.CELL_WIDTH]
        return self.allocation.energies(across)

    @cached_property
    def direct_rows(self) -> tuple[int, int]:
        """Row of the pair D-D in `SampleAllocation.pair`, and row of the family D; -1 for none."""
        if DIRECT not in self.families:
            return -1, -1
        direct = self.families.index(DIRECT)
        matches = np.flatnonzero((self.allocation.pair == direct).all(axis=1))
        return (int(matches[0]) if len(matches) else -1), direct

    @cached_property
    def bearings(self) -> Floats:
        """Bearing of each radial in the frame of the map [rad], (s,)."""
        return np.arctan2(self.radials[:, 1], self.radials[:, 0])

    def sample_lists(self, radials: Floats, heading: float, keep_probability: NDArray[np.uint8]) -> SampleLists:
        """Samples of radials other than those of the plan.

        Args:
            radials: See `radial_columns`, (m, 9).
            heading: Heading of their frame [rad].
            keep_probability: Keep probability of samples by radial, range bin and pair, in units of
                1 / `sample_allocation.FULL_PROBABILITY`, (m, b, p).
        """
        return _sample_lists(radials, heading, self.step, self.allocation, keep_probability, self.table)


def sizes_of_lists(lists: SampleLists, list_rows: NDArray[np.int64]) -> tuple[int, int, int]:
    """Numbers of points, of rows of the pair with the most, and of interference ranges in some lists together.

    Args:
        lists: Lists of samples.
        list_rows: Rows of these lists.
    """
    rows = np.diff(lists.pair_offsets, axis=1).take(list_rows, axis=0).sum(axis=0).max()
    points, ranges = (
        np.diff(offsets).take(list_rows).sum() for offsets in (lists.list_offsets, lists.interference_offsets)
    )
    return int(points), int(rows), int(ranges)


class RadialLines(NamedTuple):
    """Radials in the frame of the seabed's map."""

    radials: Floats
    """Result of `radials_in_view`, (s, 9)."""
    step: float
    """Spacing of samples along them [m]."""
    heading: float
    """Heading of their frame [rad]."""


def plan_reverberation(
    rays: PropagationModel, ping_geometry: PingGeometry, families: tuple[str, ...], law: CompiledLaw,
    lines: RadialLines, rise: float, refraction: RefractionTable,
) -> ReverberationPlan:  # fmt: skip
    """Reverberation plan of a ping, cached for all pings with the same radials of `radials_in_view`.

    Args:
        rays: Propagation model of the scene.
        ping_geometry: The sonar.
        families: Families that reach the seabed.
        law: Scattering law of the seabed.
        lines: The radials.
        rise: Largest deviation of the seabed from its mean depth [m].
        refraction: Refraction table of the families.
    """
    objects = map(Identity, (lines.radials, rays, law, refraction.nodes))
    key = (*objects, lines.step, ping_geometry.pulse.pulse, ping_geometry.pulse.receiver)
    return _PLANS.get(key, lambda: _plan(rays, ping_geometry, families, law, lines, rise, refraction))


_PLANS: RecentResults[ReverberationPlan] = RecentResults(8)


def _plan(
    rays: PropagationModel, ping_geometry: PingGeometry, families: tuple[str, ...], law: CompiledLaw,
    lines: RadialLines, rise: float, refraction: RefractionTable,
) -> ReverberationPlan:  # fmt: skip
    """Build the plan without the cache."""
    scene, (radials, step, heading) = rays.scene, lines
    source, depth = float(ping_geometry.transmit_position[2]), scene.seabed.depth
    is_rough = scene.seabed.terrain is not None
    launches = rays.launch_angles(source if scene.water.layered else round(source, 2))
    reflection_products = _REFLECTION_TABLES.get(
        (
            *map(Identity, (scene, launches) if scene.water.layered else (scene,)),
            families,
            round(source, 2),
            ping_geometry.wavelength,
        ),
        lambda: _reflection_table(scene, families, launches, ping_geometry.wavelength, is_rough),
    )
    loss_db = absorption_db(scene.water, ping_geometry.frequency)
    sampling = allocate_samples(
        ping_geometry, depth, rise, families, radials, step, heading, law, reflection_products, loss_db,
        ASSUMED_SLOPE if is_rough else 0.0, refraction,
    )  # fmt: skip
    bounce_codes, horizon_row, horizon_names = bounce_tables(families)
    table = FamilyTable(
        np.array([image_depth(name, source, depth) for name in families]), bounce_codes, horizon_row,
        horizon_image_depths=np.array([image_depth(name, source, depth) for name in horizon_names]),
        horizon_rising=np.array([last_boundary(name) == "bottom" for name in horizon_names]),
        reflection_products=reflection_products,
        direction_factor=np.zeros(0, np.float32) if law.direction_factors is None else law.direction_factors,
        absorption_exponent=absorption_exponent(loss_db), refraction=refraction,
    )  # fmt: skip
    lists = _sample_lists(sampling.radials, heading, step, sampling, sampling.keep_probability, table)
    return ReverberationPlan(families, law, sampling.radials, step, sampling, table, bounding_cylinders(scene), lists)


def absorption_exponent(loss_db: float) -> float:
    """Absorption as the base-2 exponent of pressure [1/m] from that in decibels [dB/m]."""
    return loss_db / 20 * float(np.log2(10))


def _sample_lists(
    radials: Floats, heading: float, step: float, sampling: SampleAllocation, keep_probability: NDArray[np.uint8],
    families: FamilyTable,
) -> SampleLists:  # fmt: skip
    """Lists of samples of radials with given keep probabilities, which are counted first and then filled."""
    bins, count = RangeBins(sampling.edges, sampling.pair, sampling.interferes), len(radials)
    no_points, no_rows = (np.empty(0, np.int32), np.empty(0)), np.empty(0, np.float32)
    lists = SampleLists(
        np.zeros(count + 1, np.int64), np.zeros(count, np.int64), np.zeros(count, np.int64),
        np.zeros((count, families.horizon_rising.size), bool), no_points[0], no_points[0], no_points[1],
        np.empty((2, 0), np.float32), np.zeros((count, len(sampling.pair) + 1), np.int64), no_points[0], no_rows,
        np.zeros(count + 1, np.int64), np.empty((0, 2), np.int64),
    )  # fmt: skip
    longest = count_samples(radials, step, bins, keep_probability, lists)
    points, ranges = int(lists.list_offsets[-1]), int(lists.interference_offsets[-1])
    rows = int(lists.pair_offsets[-1, -1]) if count else 0
    filled = lists._replace(
        sample_number=np.empty(points + 1, np.int32), requested_families=np.empty(points, np.int32),
        distance=np.empty(points), beam_bearing=np.empty((2, points), np.float32),
        pair_points=np.empty(rows + 1, np.int32), inverse_probability=np.empty(rows + 1, np.float32),
        interference_ranges=np.empty((ranges, 2), np.int64),
    )  # fmt: skip
    list_samples(radials, heading, step, bins, keep_probability, families, longest, filled)
    return filled._replace(
        sample_number=filled.sample_number[:points], pair_points=filled.pair_points[:rows],
        inverse_probability=filled.inverse_probability[:rows],
    )  # fmt: skip


@lru_cache(maxsize=16)
def absorption_db(water: Water, frequency: float) -> float:
    """Absorption of the water [dB/m]."""
    return float(water.absorption(frequency))


@lru_cache(maxsize=32)
def bounce_tables(families: tuple[str, ...]) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[str, ...]]:
    """Bounces and launch horizons of f families, see `FamilyTable`.

    Returns:
        Codes of the bounces of each family, (f, most); row of the launch horizon of each of its segments,
        (f, most + 1); names of the launch horizons: the families of the bounces before these segments.
    """
    sequences = [bounce_sequence(name) for name in families]
    longest = max(1, *(len(letters) for letters in sequences))
    bounce_codes = np.zeros((len(families), longest), np.int64)
    horizon_row = np.zeros((len(families), longest + 1), np.int64)
    horizon_names: list[str] = []
    for f, letters in enumerate(sequences):
        bounce_codes[f, : len(letters)] = [1 + (letter == "B") for letter in letters]
        for k in range(len(letters) + 1):
            if k == 0 and first_boundary(letters) == "surface":
                continue  # a rising ray clears the seabed
            name = letters[:k] or "D"
            if name not in horizon_names:
                horizon_names.append(name)
            horizon_row[f, k] = horizon_names.index(name)
    return bounce_codes, horizon_row, tuple(horizon_names)


_REFLECTION_TABLES: RecentResults[NDArray[np.complex64]] = RecentResults(32)


def _reflection_table(
    scene: Scene, families: tuple[str, ...], launches: LaunchAngles, wavelength: float, is_rough: bool
) -> NDArray[np.complex64]:
    """Reflection products of f families over evenly spaced sines of the grazing angle at the mean seabed.

    Returns:
        Product of the reflection coefficients of each family [1], (f, nodes).
    """
    sine = np.linspace(0, 1, REFLECTION_NODES)
    depth, terrain = scene.seabed.depth, scene.seabed.terrain
    grazing = at_surface = np.arcsin(sine)
    if scene.water.layered:  # Snell's law; no ray that turns below the surface is reflected there
        surface_speed, bed_speed = scene.water.sound_speed_at(np.array([0.0, depth]))
        at_surface = np.arccos(np.minimum(np.sqrt(1 - sine**2) * (surface_speed / bed_speed), 1.0))
    tangent = np.maximum(sine, 1e-6) / np.sqrt(np.maximum(1 - sine**2, 1e-12))
    slope = launches.launch_slope_to_bottom(tangent)
    table = np.ones((len(families), REFLECTION_NODES), np.complex128)
    for row, letters in enumerate(map(bounce_sequence, families)):
        *bounces, distance = launches.bounce_ranges(letters + "B", slope)  # the last one is at the scatterer
        for letter, bounce in zip(letters, bounces, strict=True):
            if letter == "S":
                table[row] *= scene.surface.reflection_coefficient(at_surface)
                continue
            table[row] *= scene.seabed.reflection_coefficient(grazing)
            if is_rough and terrain is not None:
                exists = np.isfinite(distance)
                half_length = fresnel_half_length(
                    np.where(exists, bounce, 1.0), np.where(exists, distance, 2.0), tangent, wavelength
                )
                # geometric mean of the Fresnel zone's length and width [m]
                zone_size = np.maximum(2 * half_length * np.sqrt(np.maximum(sine, 1e-6)), 1e-6)
                table[row] *= terrain.roughness_reflection_factor(sine, wavelength, np.asarray(zone_size, float))
    return table.astype(np.complex64)
