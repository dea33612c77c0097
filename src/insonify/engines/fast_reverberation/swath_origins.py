"""Origins of fast reverberation for labels: positions of its points, and direct legs that are occluded, by object."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._origin_kernel import (
    grazing_angles,
    positions,
    unlit_points,
    unoccluded_amplitudes,
)
from insonify.engines.fast_reverberation.reverberation_plan import ReverberationPlan
from insonify.engines.radial_tables import PairSamples, RadialLegs, RadialSet
from insonify.propagation.families import DIRECT
from insonify.records.legs import SEABED_OCCLUDER, Legs, LegStatus
from insonify.records.reverberation_samples import Origins
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Rows = NDArray[np.int64]


class Shaded(NamedTuple):
    """Legs to points in reach of targets, and what targets leave of them."""

    points: Rows
    """Rows of the points, (k,)."""
    visibility: NDArray[Any]
    """Pressure ratio [1], (f, k)."""
    legs: Legs
    """The same legs with their status and the row of the target that occludes them."""


def unlit(plan: ReverberationPlan, legs: RadialLegs, pairs: PairSamples) -> Rows:
    """Positions in the row of the direct pair of points that no direct leg reaches, before targets are evaluated."""
    straight, direct = straight_rows(plan)
    if straight < 0:
        return np.zeros(0, np.int64)
    points = pairs.rows[straight, : pairs.sample_count[straight]]
    dark = np.empty(len(points), np.int64)
    return dark[: unlit_points(legs.amplitude[direct], points, dark)]


def straight_rows(plan: ReverberationPlan) -> tuple[int, int]:
    """Row of the pair of two direct legs, and of the direct leg; -1 for none."""
    if DIRECT not in plan.families:
        return -1, -1
    direct = plan.families.index(DIRECT)
    pair = np.flatnonzero((plan.allocation.pair == direct).all(axis=1))
    return (int(pair[0]) if len(pair) else -1), direct


def origins(
    plan: ReverberationPlan, ping_geometry: PingGeometry, part: RadialSet, legs: RadialLegs, pairs: PairSamples,
    dark: Rows, shaded: Shaded | None,
) -> Origins:  # fmt: skip
    """Positions of the points of some lines, and their cut direct legs.

    Args:
        plan: Tables that all such pings share.
        ping_geometry: The sonar at this ping.
        part: The lines.
        legs: Their points.
        pairs: Points of each pair.
        dark: As from `unlit`.
        shaded: Occlusion by targets; None: none.
    """
    count, sonar_position = int(legs.first[-1]), ping_geometry.transmit_position
    position = np.empty((3, count))
    positions(
        sonar_position[0],
        sonar_position[1],
        legs.first,
        part.lists.first[part.taken],
        part.lists.ahead,
        legs.point,
        position,
    )
    grazing = np.empty((len(plan.families), count), np.float32)
    grazing_angles(legs.arrival[:, :, :count], legs.normal[:, :count], grazing)
    straight, direct = straight_rows(plan)
    cut, lost, occluder_row = _cut(legs, pairs, dark, shaded, straight, direct)
    free = np.zeros(0, np.complex64)
    if len(cut):
        free = np.empty(len(cut), np.complex64)
        unoccluded_amplitudes(
            pairs.rows[straight, cut], legs.point, plan.table.images[direct], legs.arrival[direct], legs.normal,
            plan.table.loss, plan.table.factor, free,
        )  # fmt: skip
        nonzero = np.flatnonzero(free)
        cut, free, lost, occluder_row = cut[nonzero], free[nonzero], lost[nonzero], occluder_row[nonzero]
    return Origins(plan.families, position, grazing, direct, straight, cut, free, lost, occluder_row)


def _cut(
    legs: RadialLegs, pairs: PairSamples, dark: Rows, shaded: Shaded | None, straight: int, direct: int
) -> tuple[Rows, Floats, NDArray[np.int16]]:
    """Points of the direct pair whose leg the seabed or a target cuts, the part that is lost, and what cuts."""
    lost, occluder_row = np.ones(len(dark)), np.full(len(dark), SEABED_OCCLUDER, np.int16)
    if shaded is None or straight < 0:
        return dark, lost, occluder_row
    count = int(pairs.sample_count[straight])
    position = np.full(int(legs.first[-1]), -1, np.int64)
    position[pairs.rows[straight, :count]] = np.arange(count)
    mine = np.flatnonzero(shaded.legs.status[direct] == LegStatus.OCCLUDED)
    mine = mine[position[shaded.points[mine]] >= 0]
    behind, unlit_too = position[shaded.points[mine]], np.zeros(count, bool)
    unlit_too[dark] = True
    left = np.abs(shaded.visibility[direct, mine]) ** 4
    taken = np.where(unlit_too[behind], 1.0, np.maximum(1 - left, 0.0))
    unlit_too[behind] = False
    rest = unlit_too[dark]
    return (
        np.concatenate([dark[rest], behind]), np.concatenate([lost[rest], taken]),
        np.concatenate([occluder_row[rest], shaded.legs.occluder[direct, mine]]).astype(np.int16),
    )  # fmt: skip
