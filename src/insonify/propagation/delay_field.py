"""Smooth random field of delays in inhomogeneous water, added to the travel time of every leg.

The delay of a leg is a sum of waves, each at its own fraction s of the path from the sonar to the point. With s uniform
and the waves drawn from the spectrum of the inhomogeneity, the correlation of two legs is the mean along them of
exp(-d(s)^2 / l^2), with d(s) the distance between the legs at s. So neighbouring paths
(scatterers, families, pings, ends of the sonar) share their delay, and paths more than l apart do not.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.ocean.inhomogeneity import Inhomogeneity, delay_variance
from insonify.propagation._delay_field_kernel import add_delay_waves
from insonify.propagation.families import bounce_count, image_depth
from insonify.records.legs import Legs
from insonify.scene.scatterer_grid import ScattererGrid

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
WAVES = 64
"""Number of waves of a field: its fourth moment is 3 (1 - 1 / 128) times the square of its second."""
PARTS = 24
"""Number of fractions of the path at which the distance of two legs is evaluated."""


@dataclass(frozen=True, slots=True)
class DelayField:
    """Random delays in the inhomogeneous water of one scene."""

    inhomogeneity: Inhomogeneity
    seed: int
    """Seed of the scenario."""
    water_depth: float
    """Depth of the bottom's mean plane [m]."""
    scatterer_grid: ScattererGrid
    """Frame of the field: moving it with the scene changes no delay."""

    def with_delays(self, legs: Legs, position: Floats, points: Floats, time: float) -> Legs:
        """Legs with random delays added to theirs.

        Args:
            legs: Legs from one end of the sonar to n points.
            position: North, east, depth of that end [m], shape (3,).
            points: The points [m], shape (n, 3).
            time: Time of the ping [s].
        """
        fraction, cycles, phase, frequency = _waves(self.seed, self.inhomogeneity)
        start = np.array([*self.scatterer_grid.from_world(position[:2]), position[2]])
        along, across = np.ascontiguousarray(self.scatterer_grid.from_world(points[:, :2]).T)
        total, phase_now = np.zeros(legs.delay.shape), phase + frequency * time
        for row, family in enumerate(legs.families):
            if legs.branch[row]:
                total[row] = total[row - legs.branch[row]]  # rays of one family follow nearly the same path
                continue
            down = self._unfolded_depth(family, points[:, 2])
            add_delay_waves(start, along, across, down, self.water_depth, fraction, cycles, phase_now, total[row])
        return replace(legs, delay=legs.delay + self.delay_deviation(legs) * np.sqrt(2 / WAVES) * total)

    def delay_deviation(self, legs: Legs) -> Floats:
        """Root mean square of each leg's random delay [s], shape (f, n); 0 for no leg."""
        return self._deviation(legs.visibility, legs.delay, legs.length)

    def _deviation(self, visibility: NDArray[Any], delay: Floats, length: Floats) -> Floats:
        exists = (visibility != 0) & (delay > 0)
        speed = np.where(exists, length / np.where(exists, delay, 1.0), 1.0)
        return np.sqrt(np.maximum(delay_variance(np.where(exists, length, 0.0), speed, self.inhomogeneity), 0.0))

    def covariance(self, leg_ends: list[tuple[Legs, Floats, Integers]], points: Floats, point_rows: Integers) -> Floats:
        """Covariance of the random delays of some legs to the same points [s^2], shape (m, legs, legs).

        Args:
            leg_ends: For each end of the sonar: legs to n points, position of that end [m], shape (3,), and the rows to
                include. Each row has the largest variance of all rays of its family.
            points: Common ends of the legs [m], shape (n, 3).
            point_rows: Rows of the m points to evaluate, shape (m,).
        """
        deviation = []
        for legs, _, rows in leg_ends:
            for row in rows:
                selected = np.ix_([legs.families[row] == name for name in legs.families], point_rows)
                of_family = self._deviation(legs.visibility[selected], legs.delay[selected], legs.length[selected])
                deviation.append(of_family.max(axis=0))
        points = points[point_rows]
        paths = [self._path_points(legs.families[row], end, points) for legs, end, rows in leg_ends for row in rows]
        covariance = np.empty((len(points), len(paths), len(paths)))
        for a, first in enumerate(paths):
            for b, second in enumerate(paths[: a + 1]):
                square = np.sum((first - second) ** 2, axis=-1)
                correlation = np.exp(-square / self.inhomogeneity.correlation_length**2).mean(axis=0)
                covariance[:, a, b] = covariance[:, b, a] = deviation[a] * deviation[b] * correlation
        return covariance

    def _path_points(self, family: str, position: Floats, points: Floats) -> Floats:
        """Points at even fractions of a leg's path [m], shape (PARTS, n, 3)."""
        fraction = ((np.arange(PARTS) + 0.5) / PARTS)[:, None, None]
        ends = np.column_stack([points[:, :2], self._unfolded_depth(family, points[:, 2])])
        path = position + fraction * (ends - position)
        depth = np.mod(path[..., 2], 2 * self.water_depth)
        path[..., 2] = np.minimum(depth, 2 * self.water_depth - depth)
        return path

    def _unfolded_depth(self, family: str, depth: Floats) -> Floats:
        """Depth at which a family's unfolded ray arrives, straight through surface and bottom [m]."""
        from_point = family[::-1]
        image_of_surface, sign = image_depth(from_point, 0.0, self.water_depth), (-1) ** bounce_count(family)
        return np.asarray(image_of_surface + sign * depth, float)


@lru_cache(maxsize=8)
def _waves(seed: int, inhomogeneity: Inhomogeneity) -> tuple[Floats, Floats, Floats, Floats]:
    """Waves: fraction of the path [1], (m,); cycles per metre, (m, 3); phase [cycles], (m,); frequency [Hz], (m,).

    exp(-r^2 / l^2) is the mean of cos(K r) over K normal with variance 2 / l^2 in each direction; the same in time.
    """
    from scipy.special import ndtri

    number = np.arange(WAVES)
    first = random_keys.uniforms(seed, random_keys.WATER_DELAYS, number, 0)
    second = random_keys.uniforms(seed, random_keys.WATER_DELAYS, number, 1)
    cycles = ndtri(first[:, :3]) * np.sqrt(2) / inhomogeneity.correlation_length / (2 * np.pi)
    frequency = np.zeros(WAVES)
    if inhomogeneity.correlation_time is not None:
        frequency = ndtri(second[:, 0]) * np.sqrt(2) / inhomogeneity.correlation_time / (2 * np.pi)
    return (number + second[:, 1]) / WAVES, cycles, first[:, 3], frequency
