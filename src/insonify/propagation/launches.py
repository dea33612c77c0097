"""How launch angles belong to places: what a skyline of the ground needs to know of the rays from one place.

Steepness is the tangent of the launch angle, positive towards the first boundary that the family meets: down for the
direct one. Rays of a family with more of it come down nearer, so that nearer and farther ground are told apart by it.
"""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import bounces, image_depth

Floats = NDArray[np.floating[Any]]


class Launches(Protocol):
    """Rays from one depth of the sonar."""

    def steepness(self, family: str, distance: Floats, depth: Floats) -> Floats:
        """Steepness at which rays of a family leave to meet places at a distance and a depth [m], broadcast [1].

        NaN where none does.
        """
        ...

    def bounces(self, family: str, steepness: Floats) -> list[Floats]:
        """Horizontal distance of every bounce [m], in order, each of the shape of `steepness`; infinite for none."""
        ...

    def at_bed(self, steepness: Floats) -> Floats:
        """Tangent of the grazing angle of rays at the mean plane of the bed [1], shape of `steepness`."""
        ...

    def strays(self, family: str, steepness: Floats, distance: Floats, depth: Floats) -> NDArray[np.bool_] | None:
        """Which rays to places are not those of `steepness`, but turn or cross others on their way; None for none.

        Args:
            family: Name of the family.
            steepness: Of the rays [1], shape (n,).
            distance: Horizontal distance of the places [m], shape (n,).
            depth: Their depth [m], shape (n,).
        """
        ...

    def ways(self, family: str, steepness: Floats, step: float, count: int) -> Floats:
        """Depths of rays at even distances, step, 2 step, ... [m], shape (n, count); NaN beyond their end.

        Args:
            family: Name of the family.
            steepness: Of the rays [1], shape (n,).
            step: Horizontal distance from one depth to the next [m].
            count: How many.
        """
        ...


@dataclass(frozen=True, slots=True)
class StraightLaunches:
    """Rays in water of one sound speed, between two level mirrors."""

    source_depth: float
    """Depth of the sonar [m]."""
    water_depth: float
    """Depth of the mean plane [m]."""

    def steepness(self, family: str, distance: Floats, depth: Floats) -> Floats:
        """From the image source, see `Launches`."""
        image = image_depth(family, self.source_depth, self.water_depth)
        return np.asarray((image - depth if family.endswith("B") else depth - image) / distance)

    def bounces(self, family: str, steepness: Floats) -> list[Floats]:
        """Where the unfolded ray passes the mirrors, see `Launches`."""
        string, climb = bounces(family), self.source_depth
        if string.startswith("B"):
            climb = self.water_depth - self.source_depth
        with np.errstate(divide="ignore"):
            return [np.asarray((climb + row * self.water_depth) / steepness) for row in range(len(string))]

    def at_bed(self, steepness: Floats) -> Floats:
        """As at the sonar, see `Launches`."""
        return np.abs(steepness)

    def strays(self, family: str, steepness: Floats, distance: Floats, depth: Floats) -> NDArray[np.bool_] | None:
        """None, see `Launches`."""
        return None

    def ways(self, family: str, steepness: Floats, step: float, count: int) -> Floats:
        """Folded lines, see `Launches`."""
        start = -self.source_depth if family.startswith("S") else self.source_depth
        run = start + np.asarray(steepness)[:, None] * (np.arange(count) + 1) * step
        if family == "D":
            return run
        return np.asarray(self.water_depth - np.abs(np.mod(run, 2 * self.water_depth) - self.water_depth))
