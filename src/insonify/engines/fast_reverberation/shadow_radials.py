"""Narrow radials in the shadows of targets, so that an expectation converges at shadow edges.

Behind a target that occludes most of the beam, the remaining energy is from a few bearings, at the shadow's edges and
in side lobes. Radials as wide as a cell of the seabed (`radial_columns.CELL_WIDTH`) are too few there, since each has
one terrain profile. Where a shadow removes part of the energy at some distance, every radial is divided into as many
narrower ones as its fraction of the remaining energy requires. The remaining energy is that over a flat seabed, radial
by radial, times the two-way visibility at a few probes.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines.fast_reverberation._radial_samples_kernel import FULL_PROBABILITY
from insonify.engines.fast_reverberation.flat_seabed_legs import flat_seabed_legs
from insonify.engines.fast_reverberation.reverberation_plan import ReverberationPlan
from insonify.engines.polar_grid import GOLDEN
from insonify.engines.target_shadows import shadow_sector
from insonify.propagation.image_sources import StraightRays, leg_occlusion
from insonify.propagation.knife_edge import diffract_at_edges
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.records.legs import LegStatus
from insonify.scene.scatterers import Scatterers
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

MIN_HIDDEN_FRACTION = 0.05
"""Least fraction of the energy at one distance that must be occluded for radials to be divided there [1].

Also the least fraction of the energy of a range bin on the radials that pass one target for that bin to be probed.
"""
NARROW_RADIALS_PER_POINT = 10.0
"""Narrow radials into which the remaining energy at one distance is divided, re `paths.scatterers_per_cell` [1].

For the errors in shadows see `docs/decisions/0044-sampling-in-target-shadows.md`.
"""
MIN_SPLIT_FRACTION = 0.05
"""A radial whose energy without targets is below this fraction of that of one narrow radial is not divided [1]."""
MAX_NARROW_RADIALS = 32
"""Largest number of narrow radials per 1 / `STRIPS` of a radial's width; a wider strip may have more in proportion."""
PROBES, MAX_PROBES = 3, 36
"""Distances at which visibility is probed: at most in one range bin, and approximately in all bins of a ping.

At least one in each bin, so more than the second number where there are more shadowed bins than that.
"""
STRIPS = 8
"""Largest number of strips across a radial, with probes at their borders: a shadow's edge lies anywhere across it."""


@dataclass(frozen=True, slots=True)
class ShadowRadials:
    """Radials of one ping that replace some of a plan's s radials."""

    replaced: NDArray[np.bool_]
    """True for the radials of the plan that these replace, (s,)."""
    radials: Floats
    """Columns of `radial_columns`, (m, 9)."""
    keep_probability: NDArray[np.uint8]
    """Keep probability of each pair by radial and range bin, in units of 1 / `FULL_PROBABILITY`, (m, b, p)."""
    passes_target: NDArray[np.bool_]
    """True for radials that may pass a target, (m,)."""


class ShadedLegs(NamedTuple):
    """Legs of f families to n points of the seabed, past targets."""

    visibility: NDArray[np.complex128] | Floats
    """Ratio of one-way pressures with and without targets [1], complex with edge diffraction, 0 or 1 without.

    0 where the seabed faces away; shape (f, n). That of a pair is the product of those of its two legs.
    """
    status: NDArray[np.uint8]
    """`LegStatus` with hard edges, shape (f, n)."""
    occluder: NDArray[np.int16]
    """Row of the target that occludes each leg, -1 for none, shape (f, n)."""


def shaded_legs(
    rays: PropagationModel, ping_geometry: PingGeometry, plan: ReverberationPlan, edge_diffraction: str,
    points: Floats, normal: Floats,
) -> ShadedLegs:  # fmt: skip
    """One-way legs past targets, without occlusion by relief.

    Args:
        rays: Propagation model of the scene, with one ray of each family.
        ping_geometry: The sonar, both ends at one position.
        plan: The plan of its radials, with f families.
        edge_diffraction: Edge diffraction of targets: "none" or "knife-edge".
        points: North, east, depth of points of the seabed [m], (n, 3).
        normal: Unit normals of the seabed at the points [1], (n, 3).
    """
    count = len(points)
    scatterers = Scatterers(
        "seabed", "seabed", plan.law, points, normal, np.ones(count), np.ones(count, complex),
        np.zeros(count, np.uint64),
    )  # fmt: skip
    position = ping_geometry.transmit_position
    if edge_diffraction == "none" and isinstance(rays, StraightRays):
        status, occluder = leg_occlusion(rays.scene, position, scatterers, plan.families)
        return ShadedLegs((status == LegStatus.CLEAR).astype(float), status, occluder)
    legs = rays.legs(position, scatterers, plan.families, ping_geometry.frequency)
    if edge_diffraction == "none":
        return ShadedLegs((legs.status == LegStatus.CLEAR).astype(float), legs.status, legs.occluder)
    faces_sonar = legs.status != LegStatus.FACING_AWAY
    unshaded = replace(legs, visibility=faces_sonar.astype(float))
    diffracted = diffract_at_edges(
        unshaded, scatterers, position, rays.scene, ping_geometry.wavelength, approximate=True
    )
    return ShadedLegs(np.asarray(faces_sonar * diffracted.visibility), legs.status, legs.occluder)


def shadow_radials(
    plan: ReverberationPlan, rays: PropagationModel, ping_geometry: PingGeometry, path_settings: PathSettings,
    heading: float, passing: NDArray[np.bool_],
) -> ShadowRadials | None:  # fmt: skip
    """Radials of one ping in place of those that its shadows divide; None where no radial is replaced.

    First the parts of the replaced radials before and beyond the shadows, then the narrow ones in the shadows.

    Args:
        plan: The plan of the ping's s radials.
        rays: Propagation model of the scene.
        ping_geometry: The sonar at this ping.
        path_settings: Path settings.
        heading: Heading of the radials' frame [rad].
        passing: Mask of radials that pass each of t targets, see `radials_crossing_targets`, (t, s).
    """
    any_target = np.asarray(passing.any(axis=0), bool)
    runs = _shadow_runs(plan, rays, ping_geometry, path_settings, heading, passing)
    if not runs:
        return None
    replaced = np.zeros(len(plan.radials), bool)
    for run in runs:
        replaced[run.narrow_counts.any(axis=1)] = True
    narrow: list[tuple[NDArray[np.int64], Floats]] = []
    next_number = len(plan.radials)
    undivided = [(np.flatnonzero(replaced), plan.radials[replaced])]
    for run in runs:
        outside: list[tuple[NDArray[np.int64], Floats]] = []
        for row, radials in undivided:
            inside = _clip_radials(row, radials, run.near, run.far)
            narrow.append(_split_radials(*inside, run.narrow_counts, next_number))
            next_number += len(narrow[-1][0])
            outside += [_clip_radials(row, radials, 0.0, run.near), _clip_radials(row, radials, run.far, np.inf)]
        undivided = outside
    row, radials = (np.concatenate(arrays) for arrays in zip(*undivided, *narrow, strict=True))
    undivided_count = sum(len(rows) for rows, _ in undivided)
    keep_probability = plan.allocation.keep_probability[row]
    # in a shadow only weak pairs remain: all samples are evaluated
    keep_probability[undivided_count:][keep_probability[undivided_count:] > 0] = FULL_PROBABILITY
    if rays.scene.seabed.terrain is not None:
        # also of terrain before and behind the shadow whose echoes arrive at the same time
        keep_probability[:undivided_count][
            (keep_probability[:undivided_count] > 0) & _arrives_with_shadow(plan, rays, ping_geometry, runs)
        ] = FULL_PROBABILITY
    return ShadowRadials(replaced, radials, keep_probability, any_target[row])


class ShadowRun(NamedTuple):
    """Interval of distances in which each radial is divided into the same narrow ones."""

    near: float
    """Nearest horizontal distance [m]."""
    far: float
    """Farthest horizontal distance [m]."""
    narrow_counts: NDArray[np.int64]
    """Number of narrow radials in each strip of the plan's radials, strips in order of bearing, (s, STRIPS).

    A radial with fewer than `STRIPS` strips, all of one width, has them in the first columns; one with zeros only is
    not divided.
    """


def _arrives_with_shadow(
    plan: ReverberationPlan, rays: PropagationModel, ping_geometry: PingGeometry, runs: list[ShadowRun]
) -> NDArray[np.bool_]:
    """True for pairs that arrive from a range bin while the plan's first pair arrives from a shadow, (b, p).

    Delays are those over the mean seabed. The first pair is that of two direct legs where the direct family is
    followed.
    """

    def pair_delay(distance: Floats) -> Floats:
        """Two-way delay of each pair from n horizontal distances [s], (p, n)."""
        legs = flat_seabed_legs(
            plan.table.refraction, plan.table.image_depths, ping_geometry.sound_speed, distance, rays.scene.seabed.depth
        )
        return np.asarray(legs.delay[plan.allocation.pair].sum(axis=1))

    begin, stop = (pair_delay(edge).T for edge in (plan.allocation.edges[:-1], plan.allocation.edges[1:]))
    overlap = np.zeros(begin.shape, bool)
    for run in runs:
        first, last = pair_delay(np.array([run.near, run.far]))[0]
        overlap |= (stop >= first) & (begin <= last)
    return overlap


def _clip_radials(row: NDArray[np.int64], radials: Floats, near: float, far: float) -> tuple[NDArray[np.int64], Floats]:
    """Parts of n radials between two horizontal distances [m], without empty ones.

    Args:
        row: Row of each radial in the plan, (n,).
        radials: Columns of `radial_columns`, (n, 9).
        near: Nearest distance [m].
        far: Farthest distance [m].

    Returns:
        Rows in the plan, (m,), and columns of the parts, (m, 9).
    """
    clipped = radials.copy()
    clipped[:, column.START] = np.maximum(radials[:, column.START], near)
    clipped[:, column.STOP] = np.minimum(radials[:, column.STOP], far)
    nonempty = clipped[:, column.STOP] > clipped[:, column.START]
    return row[nonempty], clipped[nonempty]


def _split_radials(
    row: NDArray[np.int64], radials: Floats, narrow_counts: NDArray[np.int64], first_number: int
) -> tuple[NDArray[np.int64], Floats]:
    """Divide radials into narrower ones, sampled with the plan's own step (stride 1).

    Bearings of the beams are distributed over the whole of the narrow width. Positions of the first samples differ from
    radial to radial by the golden ratio, as in `radials_in_view`.

    Args:
        row: Row in the plan of the radial that each is a part of, (n,).
        radials: Columns of `radial_columns`, (n, 9).
        narrow_counts: Number of narrow radials in each strip of the plan's radials, see `ShadowRun`, (s, STRIPS).
        first_number: `radial_columns.NUMBER` of the first new radial, from which its quasirandom numbers follow.

    Returns:
        Row in the plan of the radial that each new one is a part of, (m,), and their columns, (m, 9).
    """
    counts_of_strips = narrow_counts[row]
    counts_of_strips[:, 0] = np.maximum(counts_of_strips[:, 0], 1)
    parent, strip = np.nonzero(counts_of_strips)
    counts = counts_of_strips[parent, strip]
    # width and middle of each narrow radial re the width of its parent
    width = np.repeat(1 / ((counts_of_strips > 0).sum(axis=1)[parent] * counts), counts)
    index = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    narrow, middle = radials[np.repeat(parent, counts)], (np.repeat(strip * counts, counts) + index + 0.5) * width - 0.5
    cosine, sine = np.cos(narrow[:, column.CELL_WIDTH] * middle), np.sin(narrow[:, column.CELL_WIDTH] * middle)
    narrow[:, column.COSINE], narrow[:, column.SINE] = (
        narrow[:, column.COSINE] * cosine - narrow[:, column.SINE] * sine,
        narrow[:, column.SINE] * cosine + narrow[:, column.COSINE] * sine,
    )
    narrow[:, column.CELL_WIDTH] *= width
    narrow[:, column.BEAM_SPREAD], narrow[:, column.STRIDE] = narrow[:, column.CELL_WIDTH], 1
    narrow[:, column.NUMBER] = first_number + np.arange(len(narrow))
    narrow[:, column.FIRST_SAMPLE] = 1 - np.mod((narrow[:, column.NUMBER] + 0.5) * GOLDEN, 1.0)
    return row[np.repeat(parent, counts)], narrow


def _shadow_runs(
    plan: ReverberationPlan, rays: PropagationModel, ping_geometry: PingGeometry, path_settings: PathSettings,
    heading: float, passing: NDArray[np.bool_],
) -> list[ShadowRun]:  # fmt: skip
    """Intervals of distances at which radials are divided, each with the numbers of narrow radials.

    Arguments are those of `shadow_radials`.
    """
    bin_edges = plan.allocation.edges
    range_bin, distance, shadow_span = _probe_distances(plan, rays, ping_geometry, path_settings, passing)
    if not len(range_bin):
        return []
    row = np.flatnonzero(passing.any(axis=0))
    # energies of radials, their strips and all of them at the j probes, from the whole range bin of each [m^-2]
    unshaded = plan.energy[:, range_bin].sum(axis=2).astype(float)
    remaining = np.repeat(unshaded[:, None] / STRIPS, STRIPS + 1, axis=1)
    energy = _remaining_energy(plan, rays, ping_geometry, path_settings, heading, row, range_bin, distance)
    remaining[row] = energy / STRIPS
    total = ((remaining[:, 1:] + remaining[:, :-1]) / 2).sum(axis=(0, 1))
    in_shadow = total < (1 - MIN_HIDDEN_FRACTION) * unshaded.sum(axis=0)
    # at least -60 dB of the unshaded energy: no division by zero
    remaining_total = np.maximum(total, 1e-6 * unshaded.sum(axis=0))
    # narrow radials per unit of energy [m^2], (j,)
    density = NARROW_RADIALS_PER_POINT * path_settings.scatterers_per_cell / remaining_total
    runs, shadow_bins = [], np.unique(range_bin[in_shadow])
    for run in np.split(shadow_bins, np.flatnonzero(np.diff(shadow_bins) > 1) + 1) if len(shadow_bins) else []:
        inside = in_shadow & (range_bin >= run[0]) & (range_bin <= run[-1])
        near, far = shadow_span[inside, 0].min(), shadow_span[inside, 1].max()
        strip_energy = np.maximum(remaining[:, 1:, inside], remaining[:, :-1, inside])
        narrow_counts = _parts_of_strips(
            (unshaded[:, inside] * density[inside]).max(axis=1), (strip_energy * density[inside]).max(axis=2)
        )
        near, far = max(near, float(bin_edges[run[0]])), min(far, float(bin_edges[run[-1] + 1]))
        runs.append(ShadowRun(near, far, narrow_counts))
    return runs


def _parts_of_strips(unshaded: Floats, remaining: Floats) -> NDArray[np.int64]:
    """Number of narrow radials in each strip, see `ShadowRun.narrow_counts`, (s, STRIPS).

    A radial has as many strips as narrow radials without targets, rounded up to a power of two, at most `STRIPS`.

    Args:
        unshaded: Energy of each radial without targets, re that of one narrow radial [1], (s,).
        remaining: Largest energy of each 1 / `STRIPS` of a radial with targets, re that of one narrow radial [1],
            (s, STRIPS).
    """
    strip_count = np.minimum(2 ** np.ceil(np.log2(np.maximum(unshaded, 1.0))).astype(np.int64), STRIPS)
    narrow_counts = np.zeros(remaining.shape, np.int64)
    for number in np.unique(strip_count[unshaded > MIN_SPLIT_FRACTION]):
        rows = np.flatnonzero((strip_count == number) & (unshaded > MIN_SPLIT_FRACTION))
        sums = remaining[rows].reshape(len(rows), number, -1).sum(axis=2)
        narrow_counts[rows, :number] = np.clip(np.ceil(sums), 1, MAX_NARROW_RADIALS * STRIPS // number)
    return narrow_counts


def _probe_distances(
    plan: ReverberationPlan, rays: PropagationModel, ping_geometry: PingGeometry, path_settings: PathSettings,
    passing: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], Floats, Floats]:  # fmt: skip
    """Probes of visibility at j horizontal distances, in order of distance.

    Arguments are those of `shadow_radials`.

    Returns:
        Range bin of each probe, (j,), its horizontal distance [m], (j,), and the nearest and farthest distance of the
        shadows that reach that bin [m], (j, 2).
    """
    energy, bin_edges = plan.energy.sum(axis=2), plan.allocation.edges
    unshaded, diffracts = energy.sum(axis=0), path_settings.edge_diffraction == "knife-edge"
    shadow_spans: dict[int, tuple[float, float]] = {}
    for row in np.flatnonzero(passing.any(axis=1)):
        is_hidden = energy[passing[row]].sum(axis=0) >= MIN_HIDDEN_FRACTION * np.maximum(unshaded, 1e-300)
        if not is_hidden.any():
            continue
        sector = shadow_sector(
            rays.scene, rays, ping_geometry, plan.families, int(row), float(bin_edges[-1]), soft=diffracts
        )
        for b in np.flatnonzero(is_hidden & (bin_edges[1:] > sector.near) & (bin_edges[:-1] < sector.far)).tolist():
            near, far = shadow_spans.get(b, (sector.near, sector.far))
            shadow_spans[b] = min(near, sector.near), max(far, sector.far)
    # where shadows of several targets overlap, one probe at a distance gives the visibility past all of them
    probes, table = max(1, min(PROBES, MAX_PROBES // max(len(shadow_spans), 1))), []
    for b, (near, far) in sorted(shadow_spans.items()):
        first, last = max(bin_edges[b], near), min(bin_edges[b + 1], far)
        table += [(b, first + (last - first) * (k + 0.5) / probes, near, far) for k in range(probes)]
    rows = np.array(table, float).reshape(-1, 4)
    return rows[:, 0].astype(np.int64), rows[:, 1], rows[:, 2:]


def _remaining_energy(
    plan: ReverberationPlan, rays: PropagationModel, ping_geometry: PingGeometry, path_settings: PathSettings,
    heading: float, row: NDArray[np.int64],
    range_bin: NDArray[np.int64], distance: Floats,
) -> Floats:  # fmt: skip
    """Energy of r radials over the mean seabed with the visibility at the borders of their strips.

    Args:
        plan: The plan of the ping's radials.
        rays: Propagation model of the scene.
        ping_geometry: The sonar at this ping.
        path_settings: Path settings.
        heading: Heading of the radials' frame [rad].
        row: Rows of the radials in the plan, (r,).
        range_bin: Range bin of each distance, (j,).
        distance: Horizontal distances [m], (j,).

    Returns:
        Energy of all pairs from the whole of each radial in the probe's range bin if all of it had the visibility of
        one border, re the pulse's energy at 1 m [m^-2], (r, STRIPS + 1, j).
    """
    radials, across = plan.radials[row], np.arange(STRIPS + 1) / STRIPS - 0.5
    bearing = np.arctan2(radials[:, column.SINE], radials[:, column.COSINE])[:, None] + heading
    bearing = bearing + radials[:, [column.CELL_WIDTH]] * across
    shape = len(row), len(across), len(distance)
    points = np.empty((*shape, 3))
    points[..., 0] = ping_geometry.transmit_position[0] + distance * np.cos(bearing)[:, :, None]
    points[..., 1] = ping_geometry.transmit_position[1] + distance * np.sin(bearing)[:, :, None]
    points[..., 2] = rays.scene.seabed.depth
    up = np.zeros((points.size // 3, 3))
    up[:, 2] = -1.0
    edge_diffraction, flat_points = path_settings.edge_diffraction, points.reshape(-1, 3)
    power = np.abs(shaded_legs(rays, ping_geometry, plan, edge_diffraction, flat_points, up).visibility) ** 2
    power = power.reshape(-1, *shape)
    energy = plan.energy[row][:, range_bin]
    remaining = np.zeros(shape)
    for p, (i, j) in enumerate(plan.allocation.pair):
        remaining += energy[:, None, :, p] * power[i] * power[j]
    return remaining
