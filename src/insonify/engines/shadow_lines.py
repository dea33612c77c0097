"""Lines of the seabed in the shadows of targets: narrower ones, so that an expectation converges at shadow edges.

A target that hides most of the beam leaves a few bearings at the shadow's edges and side lobes. Lines as wide as a cell
of the beam, and the wider ones of its side lobes, are too few there: each is one profile of uneven ground, and an edge
falls on either side of it. Where a shadow takes a part of the energy of some distance, every line is cut into as many
narrower ones as its part of the remaining energy asks for. The remaining energy is the flat bed's, line by line, times
the visibility of a few probes.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._points_kernel import WHOLE
from insonify.engines.rings import GOLDEN
from insonify.engines.shadow_zones import shadow_zone
from insonify.engines.swath_plan import Plan
from insonify.propagation.choice import PathChoice
from insonify.propagation.images import StraightRays
from insonify.propagation.knife_edge import soft_edges
from insonify.records.legs import Legs, Status
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]

LEAST_CUT = 0.05
"""Part of the energy of one distance that targets must hide for lines to be cut there [1]."""
PARTS = 10.0
"""Narrow lines that share the remaining energy evenly, for each point in a resolution cell [1]."""
FAINT = 0.05
"""Part of such a line's share below which a line that passes no target stays as it is [1]."""
MOST_PARTS = 32
"""Most narrow lines that a strip is cut into."""
PROBES, MOST_PROBES = 3, 36
"""Distances within a stretch at which visibility is probed, and about so many in the whole of a shadow."""
STRIPS = 8
"""Strips of a line, with a probe on either side, where a shadow's edge may lie anywhere across it."""


@dataclass(frozen=True, slots=True)
class ShadowLines:
    """Lines of one ping that stand in for some of a plan's lines."""

    replaced: NDArray[np.bool_]
    """Plan lines that these replace, (s,)."""
    lines: Floats
    """As of `_swath_kernel.walk`, (m, 9)."""
    share: NDArray[np.uint8]
    """Part of the points of each line and stretch that every pair takes, in parts of `WHOLE`, (m, b, p)."""
    passing: NDArray[np.bool_]
    """Lines that may pass a target, (m,)."""


def visibility(
    scene: Scene, stance: Stance, plan: Plan, edges: str, points: Floats, normal: Floats
) -> NDArray[np.complex128] | Floats:
    """Pressure that targets leave of straight legs re that without targets; arguments as of `shaded_legs`."""
    return shaded_legs(scene, stance, plan, edges, points, normal)[0]


def shaded_legs(
    scene: Scene, stance: Stance, plan: Plan, edges: str, points: Floats, normal: Floats
) -> tuple[NDArray[np.complex128] | Floats, Legs]:
    """Pressure that targets leave of straight legs re that without targets; edges of the ground are hard [1].

    Args:
        scene: The scene.
        stance: The sonar, both ends at one place.
        plan: The plan of its lines.
        edges: Hard or soft edges.
        points: North, east, depth of points of the seabed [m], (n, 3).
        normal: Unit normals there, (n, 3).

    Returns:
        Shape (f, n), 0 for legs that a facet faces away from; and the legs past targets with hard edges.
    """
    count = len(points)
    hidden = Scatterers(
        "seabed",
        "seabed",
        plan.law,
        points,
        normal,
        np.ones(count),
        np.ones(count, complex),
        np.zeros(count, np.uint64),
    )
    legs = StraightRays(scene).legs(stance.transmit_place, hidden, plan.families, stance.frequency)
    if edges == "hard":
        return legs.visibility, legs
    there = legs.status != Status.FACING_AWAY
    whole = replace(legs, visibility=there.astype(float))
    soft = soft_edges(whole, hidden, stance.transmit_place, scene, stance.wavelength, roughly=True)
    return np.asarray(there * soft.visibility), legs


def shadow_lines(
    plan: Plan, scene: Scene, stance: Stance, choice: PathChoice, heading: float, passing: NDArray[np.bool_]
) -> ShadowLines:
    """Narrower lines where shadows of targets matter to one ping, and the rest of the lines that these replace.

    Args:
        plan: The plan of the ping's lines.
        scene: The scene.
        stance: The sonar at this ping.
        choice: The paths that are followed.
        heading: Heading of the lines' frame [rad].
        passing: Lines that pass each target, or come near its soft edge, (t, s).
    """
    any_target = np.asarray(passing.any(axis=0), bool)
    runs = _runs(plan, scene, stance, choice, heading, passing)
    replaced = np.zeros(len(plan.lines), bool)
    for run in runs:
        replaced[run.parts.any(axis=1)] = True
    made: list[tuple[NDArray[np.int64], Floats]] = []
    number = len(plan.lines)
    rest = [(np.flatnonzero(replaced), plan.lines[replaced])]
    for run in runs:
        outside: list[tuple[NDArray[np.int64], Floats]] = []
        for row, lines in rest:
            made.append(_narrow(*_within(row, lines, run.near, run.far), run.parts, number))
            number += len(made[-1][0])
            outside += [_within(row, lines, 0.0, run.near), _within(row, lines, run.far, np.inf)]
        rest = outside
    row, lines = (np.concatenate(column) for column in zip(*rest, *made, strict=True))
    share, whole = plan.thinning.share[row], sum(len(own) for own, _ in rest)
    # in a shadow the faint is all there is: nothing that is wanted is left out
    share[whole:][share[whole:] > 0] = WHOLE
    if scene.seabed.bed is not None:
        # nor of what other uneven ground, before and behind it, sends back at the same time
        share[:whole][(share[:whole] > 0) & _meanwhile(plan, scene, stance, runs)] = WHOLE
    return ShadowLines(replaced, lines, share, any_target[row])


class Run(NamedTuple):
    """Distances at which shadows of targets matter."""

    near: float
    """Nearest distance [m]."""
    far: float
    """Farthest distance [m]."""
    parts: NDArray[np.int64]
    """Narrow lines that each strip of a line is cut into; lines of all zeros stay as they are, (s, STRIPS).

    Lines that need fewer strips have them in the first columns, in evenly wide ones.
    """


def _meanwhile(plan: Plan, scene: Scene, stance: Stance, runs: list[Run]) -> NDArray[np.bool_]:
    """True where pairs arrive from a stretch with the first pair from some shadow, over the mean plane, (b, p)."""
    climbs = (scene.seabed.depth - plan.images)[:, None]

    def late(distance: Floats) -> Floats:
        return np.asarray(np.hypot(distance, climbs)[plan.thinning.pair].sum(axis=1) / stance.sound_speed)

    begin, stop = (late(edge).T for edge in (plan.thinning.edges[:-1], plan.thinning.edges[1:]))
    met = np.zeros(begin.shape, bool)
    for run in runs:
        first, last = late(np.array([run.near, run.far]))[0]
        met |= (stop >= first) & (begin <= last)
    return met


def _within(row: NDArray[np.int64], lines: Floats, near: float, far: float) -> tuple[NDArray[np.int64], Floats]:
    """The parts of lines between two distances [m], with the number of the plan line that each belongs to."""
    clipped = lines.copy()
    clipped[:, 4], clipped[:, 5] = np.maximum(lines[:, 4], near), np.minimum(lines[:, 5], far)
    kept = clipped[:, 5] > clipped[:, 4]
    return row[kept], clipped[kept]


def _narrow(
    row: NDArray[np.int64], lines: Floats, parts: NDArray[np.int64], first: int
) -> tuple[NDArray[np.int64], Floats]:
    """Cut lines into narrower ones of the shortest step, beams asked across the whole of their width.

    Args:
        row: Number of the plan line that each is a part of, (n,).
        lines: The lines, (n, 9).
        parts: Parts of each strip of the plan lines, (s, STRIPS).
        first: Number of the first new line.
    """
    count = parts[row]
    count[:, 0] = np.maximum(count[:, 0], 1)
    line, strip = np.nonzero(count)
    many = count[line, strip]
    width = np.repeat(1 / ((count > 0).sum(axis=1)[line] * many), many)
    piece = np.arange(many.sum()) - np.repeat(np.cumsum(many) - many, many)
    made, middle = lines[np.repeat(line, many)], (np.repeat(strip * many, many) + piece + 0.5) * width - 0.5
    cosine, sine = np.cos(made[:, 2] * middle), np.sin(made[:, 2] * middle)
    made[:, 0], made[:, 1] = made[:, 0] * cosine - made[:, 1] * sine, made[:, 1] * cosine + made[:, 0] * sine
    made[:, 2] *= width
    made[:, 3], made[:, 7], made[:, 8] = made[:, 2], first + np.arange(len(made)), 1
    made[:, 6] = 1 - np.mod((made[:, 7] + 0.5) * GOLDEN, 1.0)
    return row[np.repeat(line, many)], made


def _runs(
    plan: Plan, scene: Scene, stance: Stance, choice: PathChoice, heading: float, passing: NDArray[np.bool_]
) -> list[Run]:
    """The distances at which lines are cut, and how finely."""
    edges = plan.thinning.edges
    stretch, distance, zone = _probed(plan, scene, stance, choice, passing)
    if not len(stretch):
        return []
    row = np.flatnonzero(passing.any(axis=0))
    free = plan.energy[:, stretch].sum(axis=2).astype(float)
    left = np.repeat(free[:, None] / STRIPS, STRIPS + 1, axis=1)
    left[row] = _left(plan, scene, stance, choice, heading, row, stretch, distance) / STRIPS
    total = ((left[:, 1:] + left[:, :-1]) / 2).sum(axis=(0, 1))
    hot = total < (1 - LEAST_CUT) * free.sum(axis=0)
    wanted = PARTS * choice.scatterers_per_cell / np.maximum(total, 1e-6 * free.sum(axis=0))
    runs, marked = [], np.unique(stretch[hot])
    for run in np.split(marked, np.flatnonzero(np.diff(marked) > 1) + 1) if len(marked) else []:
        inside = hot & (stretch >= run[0]) & (stretch <= run[-1])
        near, far = zone[inside, 0].min(), zone[inside, 1].max()
        strips = np.maximum(left[:, 1:, inside], left[:, :-1, inside])
        parts = _parts((free[:, inside] * wanted[inside]).max(axis=1), (strips * wanted[inside]).max(axis=2))
        runs.append(Run(max(near, float(edges[run[0]])), min(far, float(edges[run[-1] + 1])), parts))
    return runs


def _parts(free: Floats, left: Floats) -> NDArray[np.int64]:
    """Parts of each strip, as of `Run`.

    Args:
        free: Energy of each line without targets, in units of a narrow line's, (s,).
        left: Most that targets leave of each strip, in the same units, (s, STRIPS).
    """
    strips = np.minimum(2 ** np.ceil(np.log2(np.maximum(free, 1.0))).astype(np.int64), STRIPS)
    parts = np.zeros(left.shape, np.int64)
    for many in np.unique(strips[free > FAINT]):
        rows = np.flatnonzero((strips == many) & (free > FAINT))
        sums = left[rows].reshape(len(rows), many, -1).sum(axis=2)
        parts[rows, :many] = np.clip(np.ceil(sums), 1, MOST_PARTS * STRIPS // many)
    return parts


def _probed(
    plan: Plan, scene: Scene, stance: Stance, choice: PathChoice, passing: NDArray[np.bool_]
) -> tuple[NDArray[np.int64], Floats, Floats]:
    """Stretches and distances [m] at which visibility is probed, (j,), and the shadow they lie in, near and far [m]."""
    energy, edges = plan.energy.sum(axis=2), plan.thinning.edges
    free, rays, soft = energy.sum(axis=0), StraightRays(scene), choice.edges == "fresnel"
    zones: dict[int, tuple[float, float]] = {}
    for row in np.flatnonzero(passing.any(axis=1)):
        hidden = energy[passing[row]].sum(axis=0) >= LEAST_CUT * np.maximum(free, 1e-300)
        if not hidden.any():
            continue
        zone = shadow_zone(scene, rays, stance, plan.families, int(row), float(edges[-1]), soft=soft)
        for b in np.flatnonzero(hidden & (edges[1:] > zone.near) & (edges[:-1] < zone.far)).tolist():
            near, far = zones.get(b, (zone.near, zone.far))
            zones[b] = min(near, zone.near), max(far, zone.far)
    # where shadows of several targets overlap, one look at a distance tells what all of them leave
    probes, found = max(1, min(PROBES, MOST_PROBES // max(len(zones), 1))), []
    for b, (near, far) in sorted(zones.items()):
        first, last = max(edges[b], near), min(edges[b + 1], far)
        found += [(b, first + (last - first) * (k + 0.5) / probes, near, far) for k in range(probes)]
    rows = np.array(found, float).reshape(-1, 4)
    return rows[:, 0].astype(np.int64), rows[:, 1], rows[:, 2:]


def _left(
    plan: Plan, scene: Scene, stance: Stance, choice: PathChoice, heading: float, row: NDArray[np.int64],
    stretch: NDArray[np.int64], distance: Floats,
) -> Floats:  # fmt: skip
    """Energy of some lines over the mean plane by what targets leave on either side of its strips [m^-2].

    Args:
        plan: The plan of the ping's lines.
        scene: The scene.
        stance: The sonar at this ping.
        choice: The paths that are followed.
        heading: Heading of the lines' frame [rad].
        row: Numbers of the lines, (rows,).
        stretch: Stretch of each distance, (j,).
        distance: Horizontal distances [m], (j,).

    Returns:
        Energy of the whole line as it would be if all of it were lit like that, (rows, STRIPS + 1, j).
    """
    lines, across = plan.lines[row], np.arange(STRIPS + 1) / STRIPS - 0.5
    bearing = np.arctan2(lines[:, 1], lines[:, 0])[:, None] + heading + lines[:, 2:3] * across
    shape = len(row), len(across), len(distance)
    points = np.empty((*shape, 3))
    points[..., 0] = stance.transmit_place[0] + distance * np.cos(bearing)[:, :, None]
    points[..., 1] = stance.transmit_place[1] + distance * np.sin(bearing)[:, :, None]
    points[..., 2] = scene.seabed.depth
    up = np.zeros((points.size // 3, 3))
    up[:, 2] = -1.0
    power = np.abs(visibility(scene, stance, plan, choice.edges, points.reshape(-1, 3), up)) ** 2
    power = power.reshape(-1, *shape)
    energy = plan.energy[row][:, stretch]
    left = np.zeros(shape)
    for p, (i, j) in enumerate(plan.thinning.pair):
        left += energy[:, None, :, p] * power[i] * power[j]
    return left
