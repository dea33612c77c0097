"""Origins of echoes in fast reverberation, for labels: positions of samples, and occluded direct legs by occluder."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._origin_kernel import (
    fill_positions,
    grazing_angles,
    unlit_points,
    unoccluded_amplitudes,
)
from insonify.engines.fast_reverberation.flat_seabed_legs import relative_pressure
from insonify.engines.fast_reverberation.reverberation_plan import ReverberationPlan
from insonify.engines.fast_reverberation.shadow_radials import ShadedLegs
from insonify.engines.radial_tables import PairSamples, RadialLegs, RadialSet
from insonify.records.legs import SEABED_OCCLUDER, LegStatus
from insonify.records.reverberation_samples import Origins
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Rows = NDArray[np.int64]


class ShadedSamples(NamedTuple):
    """Samples on radials that may cross a target."""

    points: Rows
    """Indices of the samples in `RadialLegs`, (k,)."""
    legs: ShadedLegs
    """Their legs past targets, (f, k)."""


def unlit_rows(plan: ReverberationPlan, legs: RadialLegs, pairs: PairSamples) -> Rows:
    """Indices in the list of the pair D-D of samples that no direct leg reaches, targets disregarded, (m,)."""
    direct_pair, direct = plan.direct_rows
    if direct_pair < 0:
        return np.zeros(0, np.int64)
    points = pairs.rows[direct_pair, : pairs.sample_count[direct_pair]]
    unlit = np.empty(len(points), np.int64)
    return unlit[: unlit_points(legs.amplitude[direct], points, unlit)]


def sample_positions(ping_geometry: PingGeometry, radial_set: RadialSet, legs: RadialLegs) -> Floats:
    """North, east, depth of the samples of some radials [m], shape (3, n).

    Args:
        ping_geometry: The sonar at this ping.
        radial_set: The radials.
        legs: Legs to the samples of the radials.
    """
    (north, east, _), position = ping_geometry.transmit_position, np.empty((3, int(legs.radial_offsets[-1])))
    list_starts, bearing = radial_set.lists.list_offsets[radial_set.list_rows], radial_set.lists.beam_bearing
    fill_positions(north, east, legs.radial_offsets, list_starts, bearing, legs.range_depth, position)
    return position


def sample_origins(
    plan: ReverberationPlan, position: Callable[[], Floats], legs: RadialLegs, pairs: PairSamples, unlit: Rows,
    shaded: ShadedSamples | None,
) -> Origins:  # fmt: skip
    """Positions of the samples of some radials, evaluated when first requested, and their occluded direct legs.

    Args:
        plan: The reverberation plan.
        position: Function that returns the result of `sample_positions`.
        legs: Legs to the samples of the radials.
        pairs: Samples of each pair.
        unlit: Result of `unlit_rows`.
        shaded: Occlusion by targets; None where no target shades.
    """

    def positions() -> tuple[Floats, Singles]:
        count = int(legs.radial_offsets[-1])
        grazing = np.empty((len(plan.families), count), np.float32)
        grazing_angles(legs.arrival[:, :, :count], legs.normal[:, :count], grazing)
        return position(), grazing

    direct_pair, direct = plan.direct_rows
    occluded, lost_fraction, occluder = _occluded_points(legs, pairs, unlit, shaded, direct_pair, direct)
    unoccluded = np.zeros(0, np.complex64)
    if len(occluded):
        unoccluded, points = np.empty(len(occluded), np.complex64), pairs.rows[direct_pair, occluded]
        unoccluded_amplitudes(
            points, legs.range_depth, plan.table.image_depths[direct], legs.arrival[direct],
            legs.normal, plan.table.absorption_exponent, plan.table.direction_factor, unoccluded,
        )  # fmt: skip
        if plan.table.refraction.nodes.size:
            distance, depth = legs.range_depth[:, points]
            unoccluded *= relative_pressure(plan.table.refraction, direct, distance, depth)
        if not unoccluded.all():
            row = np.flatnonzero(unoccluded)
            occluded, unoccluded = occluded[row], unoccluded[row]
            lost_fraction, occluder = lost_fraction[row], occluder[row]
    return Origins(plan.families, positions, direct, direct_pair, occluded, unoccluded, lost_fraction, occluder)


def _occluded_points(
    legs: RadialLegs, pairs: PairSamples, unlit: Rows, shaded: ShadedSamples | None, direct_pair: int, direct: int
) -> tuple[Rows, Floats, NDArray[np.int16]]:
    """Occluded samples of the pair D-D, the fraction of two-way energy that each loses, and the occluders.

    A sample that terrain and a target occlude counts as occluded by the target, with all of its energy lost.

    Arguments are those of `sample_origins`, and the row of the pair D-D and that of the family D, -1 for none.

    Returns:
        Indices in the list of the pair D-D, fractions lost [1], and rows of the occluders, each of shape (k,).
    """
    lost_fraction, occluder_row = np.ones(len(unlit)), np.full(len(unlit), SEABED_OCCLUDER, np.int16)
    if shaded is None or direct_pair < 0:
        return unlit, lost_fraction, occluder_row
    count = int(pairs.sample_count[direct_pair])
    position = np.full(int(legs.radial_offsets[-1]), -1, np.int64)
    position[pairs.rows[direct_pair, :count]] = np.arange(count)
    columns = np.flatnonzero(shaded.legs.status[direct] == LegStatus.OCCLUDED)
    columns = columns[position[shaded.points[columns]] >= 0]
    rows, is_unlit = position[shaded.points[columns]], np.zeros(count, bool)
    is_unlit[unlit] = True
    remaining = np.abs(shaded.legs.visibility[direct, columns]) ** 4
    shaded_loss = np.where(is_unlit[rows], 1.0, np.maximum(1 - remaining, 0.0))
    is_unlit[rows] = False
    others = is_unlit[unlit]
    return (
        np.concatenate([unlit[others], rows]), np.concatenate([lost_fraction[others], shaded_loss]),
        np.concatenate([occluder_row[others], shaded.legs.occluder[direct, columns]]).astype(np.int16),
    )  # fmt: skip
