"""Travel-time curves of a family on a flat boundary: delays and launch angles over all distances.

They bound the range of a ping's window and the directions of departure. In layered water there is no formula: the rays
to a row of distances are solved once, and their extremes are kept.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import DELAY, SIN_LAUNCH
from insonify.propagation.departure_cone_kernel import DepartureAngles
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.float64]

STEP = 0.25
"""Spacing of the rays of a curve [m]; coarser where there would be too many."""
MOST_STEPS = 4000
"""Largest number of steps to the largest distance [1]."""


@dataclass(frozen=True)
class TravelTimeCurve:
    """Extremes of one family's rays over distance, (m,); without a ray the least is +inf and the greatest -inf."""

    range_step: float
    """Spacing of the horizontal distances, which begin at 0 [m]."""
    least_delay: Floats
    """Least one-way delay of the family's rays [s], (m,)."""
    greatest_delay: Floats
    """Greatest one-way delay [s], (m,)."""
    least_launch_angle: Floats
    """Least launch angle, + down [rad], (m,)."""
    greatest_launch_angle: Floats
    """Greatest launch angle, + down [rad], (m,)."""


def enclosing_curve(curves: list[TravelTimeCurve]) -> TravelTimeCurve:
    """Curve whose bounds enclose those of some curves of one family over the same distances."""
    return TravelTimeCurve(
        curves[0].range_step,
        np.min([curve.least_delay for curve in curves], axis=0),
        np.max([curve.greatest_delay for curve in curves], axis=0),
        np.min([curve.least_launch_angle for curve in curves], axis=0),
        np.max([curve.greatest_launch_angle for curve in curves], axis=0),
    )


def departure_angles(curves: list[TravelTimeCurve]) -> DepartureAngles:
    """Extremes of the launch angles of some families, each with its curve over the same distances."""
    return DepartureAngles(
        np.zeros(len(curves)), 0.0, curves[0].range_step,
        np.array([_running_extremes(curve.least_launch_angle, np.minimum) for curve in curves]),
        np.array([_running_extremes(curve.greatest_launch_angle, np.maximum) for curve in curves]),
    )  # fmt: skip


def travel_time_curve(
    water: SoundSpeedLayers, family: str, depth: float, boundary_depth: float, max_range: float
) -> TravelTimeCurve:
    """Travel-time curve of a family from the sonar to a row of distances on a boundary.

    Args:
        water: Sound speed between surface and bottom.
        family: Name of the family.
        depth: Depth of the sonar [m].
        boundary_depth: Depth of the boundary [m].
        max_range: Largest distance [m].
    """
    steps = min(MOST_STEPS, math.ceil(max_range / STEP)) + 2
    step = max(max_range / MOST_STEPS, STEP)
    ranges = np.asarray(step * np.arange(steps), np.float64)
    rays, count, _ = exact_solutions(water, family, depth, np.full(steps, boundary_depth), ranges)
    rays = rays[:, : max(1, int(count.max()))]
    exists = np.arange(rays.shape[1]) < count[:, None]
    angle = np.arcsin(np.clip(rays[:, :, SIN_LAUNCH], -1, 1))
    return TravelTimeCurve(
        step,
        np.where(exists, rays[:, :, DELAY], np.inf).min(axis=1),
        np.where(exists, rays[:, :, DELAY], -np.inf).max(axis=1),
        np.where(exists, angle, np.inf).min(axis=1),
        np.where(exists, angle, -np.inf).max(axis=1),
    )


def ranges_within_delays(
    curves: list[TravelTimeCurve], delays: tuple[float, float], delay_margin: float
) -> tuple[float, float]:
    """Nearest and farthest distance at which the one-way delay of any of some families lies in a span [m].

    Args:
        curves: Curve of each family and each end of the sonar.
        delays: Half of the earliest and of the latest two-way delay of the window [s].
        delay_margin: Largest difference of delay at the other end of the sonar [s].

    Returns:
        Distances of the span and one step more on both sides; 0 and -1 where none lies in it.
    """
    earliest = np.min([curve.least_delay for curve in curves], axis=0)
    latest = np.max([curve.greatest_delay for curve in curves], axis=0)
    columns = np.flatnonzero((earliest <= delays[1] + delay_margin) & (latest >= delays[0] - delay_margin))
    if not columns.size:
        return 0.0, -1.0
    step = curves[0].range_step
    return step * max(int(columns[0]) - 1, 0), step * float(columns[-1] + 1)


def _running_extremes(column: Floats, extreme: np.ufunc) -> Floats:
    """Extremes of 1, 2, 4, ... entries from each one on, shape (k, m): any interval is covered by two of them."""
    tables = [column]
    while 2 ** len(tables) <= len(column):
        half = 2 ** (len(tables) - 1)
        tables.append(np.append(extreme(tables[-1][:-half], tables[-1][half:]), tables[-1][-half:]))
    return np.asarray(tables)
