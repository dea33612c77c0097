"""Narrow radials in the shadows of targets, so that an expectation converges at shadow edges.

Behind a target that occludes most of the beam, the remaining energy is from a few bearings, at the shadow's edges and
in side lobes. Radials as wide as a cell of the beam are too few there, since each has one terrain profile. Where a
shadow removes part of the energy at some distance, every radial is divided into as many narrower ones as its fraction
of the remaining energy requires. The remaining energy is that over a flat seabed, radial by radial, times the
visibility at a few probes.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines.fast_reverberation._radial_samples_kernel import FULL_PROBABILITY
from insonify.engines.fast_reverberation.level_legs import level_legs
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
"""Smallest fraction of the energy at one distance, occluded by targets, for which radials are divided there [1]."""
NARROW_RADIALS_PER_POINT = 10.0
"""Number of narrow radials with equal parts of the remaining energy, for each point in a resolution cell [1]."""
MIN_SPLIT_FRACTION = 0.05
"""Fraction of the energy of a narrow radial below which a radial that passes no target is not divided [1]."""
MAX_NARROW_RADIALS = 32
"""Largest number of narrow radials that a strip is divided into [1]."""
PROBES, MAX_PROBES = 3, 36
"""Numbers of distances at which visibility is probed: in a range bin, and about in all of a shadow [1]."""
STRIPS = 8
"""Strips across a radial, with a probe on either side of each: a shadow's edge may lie anywhere across it [1]."""


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
    """Pressure re that without targets [1], 0 where the facet of the seabed faces away, shape (f, n)."""
    status: NDArray[np.uint8]
    """`LegStatus` with hard edges, shape (f, n)."""
    occluder: NDArray[np.int16]
    """Row of the target that occludes each leg, -1 for none, shape (f, n)."""


def shaded_legs(
    rays: PropagationModel, ping_geometry: PingGeometry, plan: ReverberationPlan, edges: str, points: Floats,
    normal: Floats,
) -> ShadedLegs:  # fmt: skip
    """One-way legs past targets, without occlusion by relief.

    Args:
        rays: Propagation model of the scene, with one ray of each family.
        ping_geometry: The sonar, both ends at one position.
        plan: The plan of its radials, with f families.
        edges: Edge diffraction of targets: "none" or "knife-edge".
        points: North, east, depth of points of the seabed [m], (n, 3).
        normal: Unit normals of the seabed at the points [1], (n, 3).
    """
    count = len(points)
    scatterers = Scatterers(
        "seabed", "seabed", plan.law, points, normal, np.ones(count), np.ones(count, complex),
        np.zeros(count, np.uint64),
    )  # fmt: skip
    position = ping_geometry.transmit_position
    if edges == "none" and isinstance(rays, StraightRays):
        status, occluder = leg_occlusion(rays.scene, position, scatterers, plan.families)
        return ShadedLegs((status == LegStatus.CLEAR).astype(float), status, occluder)
    legs = rays.legs(position, scatterers, plan.families, ping_geometry.frequency)
    if edges == "none":
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
    """Narrow radials in the shadows of one ping, and the remainder of the radials that they replace.

    None where no radial is replaced.

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
        replaced[run.parts.any(axis=1)] = True
    narrow: list[tuple[NDArray[np.int64], Floats]] = []
    number = len(plan.radials)
    undivided = [(np.flatnonzero(replaced), plan.radials[replaced])]
    for run in runs:
        outside: list[tuple[NDArray[np.int64], Floats]] = []
        for row, radials in undivided:
            narrow.append(_split_radials(*_clip_radials(row, radials, run.near, run.far), run.parts, number))
            number += len(narrow[-1][0])
            outside += [_clip_radials(row, radials, 0.0, run.near), _clip_radials(row, radials, run.far, np.inf)]
        undivided = outside
    row, radials = (np.concatenate(column) for column in zip(*undivided, *narrow, strict=True))
    keep_probability, remainder = plan.allocation.keep_probability[row], sum(len(rows) for rows, _ in undivided)
    # in a shadow only weak pairs remain: all samples are evaluated
    keep_probability[remainder:][keep_probability[remainder:] > 0] = FULL_PROBABILITY
    if rays.scene.seabed.terrain is not None:
        # also of terrain before and behind the shadow whose echoes arrive at the same time
        keep_probability[:remainder][
            (keep_probability[:remainder] > 0) & _arrives_with_shadow(plan, rays, ping_geometry, runs)
        ] = FULL_PROBABILITY
    return ShadowRadials(replaced, radials, keep_probability, any_target[row])


class ShadowRun(NamedTuple):
    """Interval of distances in which radials are divided alike."""

    near: float
    """Nearest distance [m]."""
    far: float
    """Farthest distance [m]."""
    parts: NDArray[np.int64]
    """Number of narrow radials in each strip of a radial; a radial with all zeros is not divided, (s, STRIPS).

    A radial with fewer than `STRIPS` strips, all of one width, has them in the first columns.
    """


def _arrives_with_shadow(
    plan: ReverberationPlan, rays: PropagationModel, ping_geometry: PingGeometry, runs: list[ShadowRun]
) -> NDArray[np.bool_]:
    """True for pairs that arrive from a range bin while the first pair arrives from a shadow, (b, p).

    Delays are those of the mean plane of the seabed.
    """

    def pair_delay(distance: Floats) -> Floats:
        legs = level_legs(
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
    """Parts of radials between two distances [m], each with the row of its radial in the plan; empty ones left out."""
    clipped = radials.copy()
    clipped[:, column.START] = np.maximum(radials[:, column.START], near)
    clipped[:, column.STOP] = np.minimum(radials[:, column.STOP], far)
    nonempty = clipped[:, column.STOP] > clipped[:, column.START]
    return row[nonempty], clipped[nonempty]


def _split_radials(
    row: NDArray[np.int64], radials: Floats, parts: NDArray[np.int64], first: int
) -> tuple[NDArray[np.int64], Floats]:
    """Divide radials into narrower ones of the shortest step, with beams evaluated across the whole of their width.

    Args:
        row: Row in the plan of the radial that each is a part of, (n,).
        radials: Columns of `radial_columns`, (n, 9).
        parts: Number of narrow radials in each strip of the plan's radials, see `ShadowRun`, (s, STRIPS).
        first: Number of the first new radial, from which random numbers follow.

    Returns:
        Row in the plan of the radial that each new one is a part of, (m,), and their columns, (m, 9).
    """
    count = parts[row]
    count[:, 0] = np.maximum(count[:, 0], 1)
    parent, strip = np.nonzero(count)
    counts = count[parent, strip]
    width = np.repeat(1 / ((count > 0).sum(axis=1)[parent] * counts), counts)
    index = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    narrow, middle = radials[np.repeat(parent, counts)], (np.repeat(strip * counts, counts) + index + 0.5) * width - 0.5
    cosine, sine = np.cos(narrow[:, column.CELL_WIDTH] * middle), np.sin(narrow[:, column.CELL_WIDTH] * middle)
    narrow[:, column.COSINE], narrow[:, column.SINE] = (
        narrow[:, column.COSINE] * cosine - narrow[:, column.SINE] * sine,
        narrow[:, column.SINE] * cosine + narrow[:, column.COSINE] * sine,
    )
    narrow[:, column.CELL_WIDTH] *= width
    narrow[:, column.BEAM_SPREAD], narrow[:, column.STRIDE] = narrow[:, column.CELL_WIDTH], 1
    narrow[:, column.NUMBER] = first + np.arange(len(narrow))
    narrow[:, column.FIRST_SAMPLE] = 1 - np.mod((narrow[:, column.NUMBER] + 0.5) * GOLDEN, 1.0)
    return row[np.repeat(parent, counts)], narrow


def _shadow_runs(
    plan: ReverberationPlan, rays: PropagationModel, ping_geometry: PingGeometry, path_settings: PathSettings,
    heading: float, passing: NDArray[np.bool_],
) -> list[ShadowRun]:  # fmt: skip
    """Intervals of distances at which radials are divided, each with the numbers of their parts.

    Arguments see `shadow_radials`.
    """
    edges = plan.allocation.edges
    range_bin, distance, zone = _probe_distances(plan, rays, ping_geometry, path_settings, passing)
    if not len(range_bin):
        return []
    row = np.flatnonzero(passing.any(axis=0))
    unshaded = plan.energy[:, range_bin].sum(axis=2).astype(float)
    remaining = np.repeat(unshaded[:, None] / STRIPS, STRIPS + 1, axis=1)
    energy = _remaining_energy(plan, rays, ping_geometry, path_settings, heading, row, range_bin, distance)
    remaining[row] = energy / STRIPS
    total = ((remaining[:, 1:] + remaining[:, :-1]) / 2).sum(axis=(0, 1))
    in_shadow = total < (1 - MIN_HIDDEN_FRACTION) * unshaded.sum(axis=0)
    energy_per_radial = np.maximum(total, 1e-6 * unshaded.sum(axis=0))
    density = NARROW_RADIALS_PER_POINT * path_settings.scatterers_per_cell / energy_per_radial
    runs, shadow_bins = [], np.unique(range_bin[in_shadow])
    for run in np.split(shadow_bins, np.flatnonzero(np.diff(shadow_bins) > 1) + 1) if len(shadow_bins) else []:
        inside = in_shadow & (range_bin >= run[0]) & (range_bin <= run[-1])
        near, far = zone[inside, 0].min(), zone[inside, 1].max()
        strips = np.maximum(remaining[:, 1:, inside], remaining[:, :-1, inside])
        parts = _parts_of_strips(
            (unshaded[:, inside] * density[inside]).max(axis=1), (strips * density[inside]).max(axis=2)
        )
        runs.append(ShadowRun(max(near, float(edges[run[0]])), min(far, float(edges[run[-1] + 1])), parts))
    return runs


def _parts_of_strips(unshaded: Floats, remaining: Floats) -> NDArray[np.int64]:
    """Number of narrow radials in each strip, see `ShadowRun.parts`, (s, STRIPS).

    Args:
        unshaded: Energy of each radial without targets, over that of one narrow radial [1], (s,).
        remaining: Largest energy of each strip with targets, over that of one narrow radial [1], (s, STRIPS).
    """
    strips = np.minimum(2 ** np.ceil(np.log2(np.maximum(unshaded, 1.0))).astype(np.int64), STRIPS)
    parts = np.zeros(remaining.shape, np.int64)
    for number in np.unique(strips[unshaded > MIN_SPLIT_FRACTION]):
        rows = np.flatnonzero((strips == number) & (unshaded > MIN_SPLIT_FRACTION))
        sums = remaining[rows].reshape(len(rows), number, -1).sum(axis=2)
        parts[rows, :number] = np.clip(np.ceil(sums), 1, MAX_NARROW_RADIALS * STRIPS // number)
    return parts


def _probe_distances(
    plan: ReverberationPlan, rays: PropagationModel, ping_geometry: PingGeometry, path_settings: PathSettings,
    passing: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], Floats, Floats]:  # fmt: skip
    """Probes of visibility: range bins (j,), distances [m] (j,), and near and far end of their shadow [m] (j, 2)."""
    energy, edges = plan.energy.sum(axis=2), plan.allocation.edges
    unshaded, diffracts = energy.sum(axis=0), path_settings.edge_diffraction == "knife-edge"
    zones: dict[int, tuple[float, float]] = {}
    for row in np.flatnonzero(passing.any(axis=1)):
        is_hidden = energy[passing[row]].sum(axis=0) >= MIN_HIDDEN_FRACTION * np.maximum(unshaded, 1e-300)
        if not is_hidden.any():
            continue
        zone = shadow_sector(rays.scene, rays, ping_geometry, plan.families, int(row), float(edges[-1]), soft=diffracts)
        for b in np.flatnonzero(is_hidden & (edges[1:] > zone.near) & (edges[:-1] < zone.far)).tolist():
            near, far = zones.get(b, (zone.near, zone.far))
            zones[b] = min(near, zone.near), max(far, zone.far)
    # where shadows of several targets overlap, one probe at a distance gives the visibility past all of them
    probes, table = max(1, min(PROBES, MAX_PROBES // max(len(zones), 1))), []
    for b, (near, far) in sorted(zones.items()):
        first, last = max(edges[b], near), min(edges[b + 1], far)
        table += [(b, first + (last - first) * (k + 0.5) / probes, near, far) for k in range(probes)]
    rows = np.array(table, float).reshape(-1, 4)
    return rows[:, 0].astype(np.int64), rows[:, 1], rows[:, 2:]


def _remaining_energy(
    plan: ReverberationPlan, rays: PropagationModel, ping_geometry: PingGeometry, path_settings: PathSettings,
    heading: float, row: NDArray[np.int64],
    range_bin: NDArray[np.int64], distance: Floats,
) -> Floats:  # fmt: skip
    """Energy of some radials over the mean plane with the visibility at the borders of their strips [m^-2].

    Args:
        plan: The plan of the ping's radials.
        rays: Propagation model of the scene.
        ping_geometry: The sonar at this ping.
        path_settings: Path settings.
        heading: Heading of the radials' frame [rad].
        row: Rows of the radials in the plan, (rows,).
        range_bin: Range bin of each distance, (j,).
        distance: Horizontal distances [m], (j,).

    Returns:
        Energy that the whole radial would have if all of it had the visibility of one border, (rows, STRIPS + 1, j).
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
    edges, rows = path_settings.edge_diffraction, points.reshape(-1, 3)
    power = np.abs(shaded_legs(rays, ping_geometry, plan, edges, rows, up).visibility) ** 2
    power = power.reshape(-1, *shape)
    energy = plan.energy[row][:, range_bin]
    remaining = np.zeros(shape)
    for p, (i, j) in enumerate(plan.allocation.pair):
        remaining += energy[:, None, :, p] * power[i] * power[j]
    return remaining
