"""Travel-time curves of a family on a flat boundary: delays and launch angles over all distances.

They bound the range of a ping's window and the directions of departure. In
layered water there is no formula; so the rays to a row of distances are solved once, and bounds are read off.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import DELAY, SIN_LAUNCH
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.propagation_model import DepartureCones
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.float64]

STEP = 0.25
"""Spacing of the rays of a curve [m]; coarser where there would be too many."""
MOST_STEPS = 4000


@dataclass(frozen=True)
class TravelTimeCurve:
    """Delays and launch angles of one family over distance; without a ray: infinite bounds in reversed order."""

    range_step: float
    """Spacing of the columns [m]."""
    least_delay: Floats
    """Least delay of the family's rays [s], (m,)."""
    greatest_delay: Floats
    """Greatest delay [s], (m,)."""
    least_launch_angle: Floats
    """Least launch angle [rad, + down], (m,)."""
    greatest_launch_angle: Floats
    """Greatest launch angle [rad, + down], (m,)."""

    @cached_property
    def running_launch_angles(self) -> tuple[list[Floats], list[Floats]]:
        """Least and greatest launch angles [rad, + down] of 1, 2, 4, ... columns from each one on."""
        return (
            _running_extremes(self.least_launch_angle, np.minimum),
            _running_extremes(self.greatest_launch_angle, np.maximum),
        )

    def launch_angle_bounds(self, horizontal_distance: Floats, radius: Floats) -> tuple[Floats, Floats]:
        """Least and greatest launch angle to intervals of the boundary [rad]; infinite, in reversed order, for none.

        Args:
            horizontal_distance: Distances of their middles [m], (n,).
            radius: Half lengths of the intervals [m], (n,).
        """
        last = len(self.least_delay) - 1
        # One more column on each side: rays between two columns are bounded by both.
        first = np.clip(np.floor((horizontal_distance - radius) / self.range_step) - 1, 0, last).astype(int)
        stop = np.clip(np.ceil((horizontal_distance + radius) / self.range_step) + 1, 0, last).astype(int)
        power = np.floor(np.log2(stop - first + 1)).astype(int)
        low, high = np.full(len(horizontal_distance), np.inf), np.full(len(horizontal_distance), -np.inf)
        least, greatest = self.running_launch_angles
        for k in np.unique(power):
            rows = power == k
            left, right = first[rows], stop[rows] - 2**k + 1
            low[rows] = np.minimum(least[k][left], least[k][right])
            high[rows] = np.maximum(greatest[k][left], greatest[k][right])
        return low, high


def departure_cones(sweeps: list[TravelTimeCurve], offset: Floats, radius: Floats) -> DepartureCones:
    """Cones that bound the directions in which rays leave for neighbourhoods.

    Args:
        sweeps: The family's rays to the depths between which the neighbourhoods lie.
        offset: North and east of their middles from the sonar [m], (n, 2).
        radius: Radii of the neighbourhoods [m], (n,).
    """
    away = np.hypot(offset[:, 0], offset[:, 1])
    spans = [curve.launch_angle_bounds(away, radius) for curve in sweeps]
    low = np.min([span[0] for span in spans], axis=0)
    high = np.max([span[1] for span in spans], axis=0)
    exists = low <= high
    low, high = np.where(exists, low, 0.0), np.where(exists, high, 0.0)
    middle = (low + high) / 2
    horizontal = offset / np.maximum(away, 1e-300)[:, None]
    horizontal[away == 0] = [1.0, 0.0]
    direction = np.column_stack([np.cos(middle)[:, None] * horizontal, np.sin(middle)])
    aside = np.where(radius < away, np.arcsin(np.minimum(1, radius / np.maximum(away, radius))), np.pi)
    level_part = np.cos(np.where(low * high <= 0, 0.0, np.minimum(np.abs(low), np.abs(high))))
    margin = np.minimum(np.hypot((high - low) / 2, aside * level_part), np.pi)
    return DepartureCones(direction, margin, exists)


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
    sweeps: list[TravelTimeCurve], delays: tuple[float, float], delay_margin: float
) -> tuple[float, float]:
    """Nearest and farthest distance at which the delays of some families lie in a span [m].

    Args:
        sweeps: Curve of each family and each end of the sonar.
        delays: Half of the earliest and of the latest two-way delay of the window [s].
        delay_margin: Largest difference of delay at the other end of the sonar [s].

    Returns:
        Distances, one column beyond the last within the span; 0 and -1 for none.
    """
    earliest = np.min([curve.least_delay for curve in sweeps], axis=0)
    latest = np.max([curve.greatest_delay for curve in sweeps], axis=0)
    columns = np.flatnonzero((earliest <= delays[1] + delay_margin) & (latest >= delays[0] - delay_margin))
    if not columns.size:
        return 0.0, -1.0
    step = sweeps[0].range_step
    return step * max(int(columns[0]) - 1, 0), step * float(columns[-1] + 1)


def _running_extremes(column: Floats, extreme: np.ufunc) -> list[Floats]:
    """Extremes of 1, 2, 4, ... columns from each one on, so that any interval is covered by two of them."""
    tables = [column]
    while 2 ** len(tables) <= len(column):
        half = 2 ** (len(tables) - 1)
        tables.append(np.asarray(extreme(tables[-1][:-half], tables[-1][half:])))
    return tables
