"""How launch angles belong to places: what a skyline of the ground needs to know of the rays from one place.

Steepness is the tangent of the launch angle, positive towards the first boundary that the family meets: down for the
direct one. Rays of a family with more of it come down nearer, so that nearer and farther ground are told apart by it.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import bounce_sequence, image_depth

Floats = NDArray[np.floating[Any]]


class LaunchAngles(Protocol):
    """Rays from one depth of the sonar."""

    def launch_slope(self, family: str, distance: Floats, depth: Floats) -> Floats:
        """Steepness at which rays of a family leave to meet places at a distance and a depth [m], broadcast [1].

        NaN where none does.
        """
        ...

    def bounce_ranges(self, family: str, launch_slope: Floats) -> list[Floats]:
        """Horizontal distance of every bounce [m], in order, each of the shape of `launch_slope`; infinite for none."""
        ...

    def bottom_grazing_tangent(self, launch_slope: Floats) -> Floats:
        """Tangent of the grazing angle of rays at the mean plane of the bed [1], shape of `launch_slope`."""
        ...

    def off_table_rays(
        self, family: str, launch_slope: Floats, distance: Floats, depth: Floats
    ) -> NDArray[np.bool_] | None:
        """Which rays to places are not those of `launch_slope`, but turn or cross others on their way; None for none.

        Args:
            family: Name of the family.
            launch_slope: Of the rays [1], shape (n,).
            distance: Horizontal distance of the places [m], shape (n,).
            depth: Their depth [m], shape (n,).
        """
        ...

    def ray_depths(self, family: str, launch_slope: Floats, step: float, count: int) -> Floats:
        """Depths of rays at even distances, step, 2 step, ... [m], shape (n, count); NaN beyond their end.

        Args:
            family: Name of the family.
            launch_slope: Of the rays [1], shape (n,).
            step: Horizontal distance from one depth to the next [m].
            count: How many.
        """
        ...


@dataclass(frozen=True, slots=True)
class StraightLaunchAngles:
    """Rays in water of one sound speed, between two level mirrors."""

    source_depth: float
    """Depth of the sonar [m]."""
    water_depth: float
    """Depth of the mean plane [m]."""

    def launch_slope(self, family: str, distance: Floats, depth: Floats) -> Floats:
        """From the image source, see `LaunchAngles`."""
        image = image_depth(family, self.source_depth, self.water_depth)
        return np.asarray((image - depth if family.endswith("B") else depth - image) / distance)

    def bounce_ranges(self, family: str, launch_slope: Floats) -> list[Floats]:
        """Where the unfolded ray passes the mirrors, see `LaunchAngles`."""
        string, climb = bounce_sequence(family), self.source_depth
        if string.startswith("B"):
            climb = self.water_depth - self.source_depth
        with np.errstate(divide="ignore"):
            return [np.asarray((climb + row * self.water_depth) / launch_slope) for row in range(len(string))]

    def bottom_grazing_tangent(self, launch_slope: Floats) -> Floats:
        """As at the sonar, see `LaunchAngles`."""
        return np.abs(launch_slope)

    def off_table_rays(
        self, family: str, launch_slope: Floats, distance: Floats, depth: Floats
    ) -> NDArray[np.bool_] | None:
        """None, see `LaunchAngles`."""
        return None

    def ray_depths(self, family: str, launch_slope: Floats, step: float, count: int) -> Floats:
        """Folded lines, see `LaunchAngles`."""
        start = -self.source_depth if family.startswith("S") else self.source_depth
        run = start + np.asarray(launch_slope)[:, None] * (np.arange(count) + 1) * step
        if family == "D":
            return run
        return np.asarray(self.water_depth - np.abs(np.mod(run, 2 * self.water_depth) - self.water_depth))
