"""Launch angles of rays to given positions, as used for the occlusion by terrain.

The launch slope is the tangent of the launch angle, positive towards the first boundary of the family: down for the
direct one. Rays of a family with a larger slope reach the terrain at a shorter distance.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import DIRECT, bounce_sequence, first_boundary, image_depth, last_boundary

Floats = NDArray[np.floating[Any]]


class LaunchAngles(Protocol):
    """Rays from one depth of the sonar.

    Example:
        >>> angles: LaunchAngles = StraightLaunchAngles(source_depth=10.0, water_depth=35.0)
        >>> slope = angles.launch_slope("S", np.array([40.0]), np.array([20.0]))  # by the image at -10 m
        >>> slope.round(2).tolist(), angles.bounce_ranges("S", slope)[0].round(1).tolist()
        ([0.75], [13.3])
    """

    def launch_slope(self, family: str, distance: Floats, depth: Floats) -> Floats:
        """Launch slope of a family's rays to positions at a horizontal distance and a depth [m], broadcast [1].

        NaN where there is no ray.
        """
        ...

    def bounce_ranges(self, family: str, launch_slope: Floats) -> list[Floats]:
        """Horizontal distance of every bounce [m], in order, each of the shape of `launch_slope`; infinite for none."""
        ...

    def bottom_grazing_tangent(self, launch_slope: Floats) -> Floats:
        """Tangent of the grazing angle of rays at the mean plane of the seabed [1], shape of `launch_slope`."""
        ...

    def launch_slope_to_bottom(self, grazing_tangent: Floats) -> Floats:
        """Launch slope of rays with given tangents of the grazing angle at the mean plane [1]; 0 without ray."""
        ...

    def largest_unobstructed_fall(self, family: str, step: float, count: int) -> NDArray[np.float32] | None:
        """Fall of the seabed from one sample of a line to the next up to which the former does not hide the latter.

        For families that arrive from above: their launch slope at the latter sample is then at most that at the former.

        Args:
            family: Name of the family.
            step: Distance of the first sample, and between samples [m].
            count: Number of samples.

        Returns:
            Largest fall after each sample [m], (count - 1,); None where it is not known.
        """
        ...

    def has_single_rays(self, family: str, distance: Floats, depth: Floats) -> bool:
        """Return True if exactly one ray reaches each of some positions, and `launch_slope` is defined at all of them.

        Args:
            family: Name of the family.
            distance: Horizontal distance of the positions [m], shape (n,).
            depth: Depth of the positions [m], shape (n,).
        """
        ...

    def off_table_rays(self, family: str, launch_slope: Floats, distance: Floats, depth: Floats) -> NDArray[np.bool_]:
        """Mask of those given rays that are not the rays of `launch_slope` to their end points, as they turn or cross.

        Args:
            family: Name of the family.
            launch_slope: Launch slope of the given rays [1], shape (n,).
            distance: Horizontal distance of the positions [m], shape (n,).
            depth: Depth of the positions [m], shape (n,).
        """
        ...

    def ray_depths(self, family: str, launch_slope: Floats, step: float, count: int) -> Floats:
        """Depths of rays at evenly spaced distances, step, 2 step, ... [m], shape (n, count); NaN beyond their end.

        Args:
            family: Name of the family.
            launch_slope: Launch slope of the rays [1], shape (n,).
            step: Spacing of the distances [m].
            count: Number of distances.
        """
        ...


@dataclass(frozen=True, slots=True)
class StraightLaunchAngles:
    """Rays in water of one sound speed, between two flat boundaries.

    Example:
        >>> angles = StraightLaunchAngles(source_depth=10.0, water_depth=35.0)
        >>> angles.launch_slope("D", np.array([40.0]), np.array([20.0])).round(2).tolist()
        [0.25]
        >>> angles.ray_depths("B", np.array([1.0]), step=10.0, count=4).tolist()  # down to the seabed at 25 m, and up
        [[20.0, 30.0, 30.0, 20.0]]
    """

    source_depth: float
    """Depth of the sonar [m]."""
    water_depth: float
    """Depth of the seabed's mean plane [m]."""

    def launch_slope(self, family: str, distance: Floats, depth: Floats) -> Floats:
        """Launch slope from the image source, see `LaunchAngles`."""
        image = image_depth(family, self.source_depth, self.water_depth)
        return np.asarray((image - depth if last_boundary(family) == "bottom" else depth - image) / distance)

    def bounce_ranges(self, family: str, launch_slope: Floats) -> list[Floats]:
        """Distances at which the unfolded ray passes the boundaries, see `LaunchAngles`."""
        sequence, to_first = bounce_sequence(family), self.source_depth
        if first_boundary(sequence) == "bottom":
            to_first = self.water_depth - self.source_depth
        with np.errstate(divide="ignore"):
            return [np.asarray((to_first + row * self.water_depth) / launch_slope) for row in range(len(sequence))]

    def bottom_grazing_tangent(self, launch_slope: Floats) -> Floats:
        """Equal to the launch slope, see `LaunchAngles`."""
        return np.abs(launch_slope)

    def launch_slope_to_bottom(self, grazing_tangent: Floats) -> Floats:
        """Equal to the tangent, see `LaunchAngles`."""
        return np.abs(grazing_tangent)

    def largest_unobstructed_fall(self, family: str, step: float, count: int) -> NDArray[np.float32] | None:
        """None, see `LaunchAngles`: comparing the launch slopes themselves costs no more."""
        return None

    def has_single_rays(self, family: str, distance: Floats, depth: Floats) -> bool:
        """Return True, see `LaunchAngles`."""
        return True

    def off_table_rays(self, family: str, launch_slope: Floats, distance: Floats, depth: Floats) -> NDArray[np.bool_]:
        """Mask of no ray, see `LaunchAngles`."""
        return np.zeros(np.shape(distance), bool)

    def ray_depths(self, family: str, launch_slope: Floats, step: float, count: int) -> Floats:
        """Depths along folded lines, see `LaunchAngles`."""
        start = -self.source_depth if first_boundary(family) == "surface" else self.source_depth
        run = start + np.asarray(launch_slope)[:, None] * (np.arange(count) + 1) * step
        if family == DIRECT:
            return run
        return np.asarray(self.water_depth - np.abs(np.mod(run, 2 * self.water_depth) - self.water_depth))
