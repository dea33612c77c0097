"""How sound travels in one scene: the question that the engine asks, whatever the water is like.

In water of one sound speed the rays are straight, and images of the sonar give every leg (`propagation.images`). In
layered water they bend, turn and leave shadows (`propagation.curved`). The engine never asks which of the two it has.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.launch_angles import LaunchAngles
from insonify.records.legs import Legs
from insonify.scene.scatterers import Scatterers

Floats = NDArray[np.float64]


FEW_DEPTHS = 4
"""Depths of the sonar that are worth a table each; where there are more, tables span them."""


@dataclass(frozen=True, slots=True)
class RayDomain:
    """Where rays are asked for in one survey: what tables must cover."""

    source_depths: tuple[float, ...]
    """Depths of the ends of the sonar [m]: all of them if they are few (`FEW_DEPTHS`), else the least and the greatest
    of a span; increasing."""
    is_span: bool
    """Whether the ends can be anywhere between those depths."""
    point_depths: tuple[float, float]
    """Least and greatest depth of the points of bodies in the water [m]; surface and seabed are always reached."""
    max_range: float
    """Greatest horizontal distance that can be heard in the window [m]."""


@dataclass(frozen=True, slots=True)
class ReachableRange:
    """Horizontal distances from which one boundary can be heard in the window."""

    vertical_distance: float
    """Vertical distance from the sonar to the boundary [m]."""
    nearest: float
    farthest: float


@dataclass(frozen=True, slots=True)
class DepartureCones:
    """Directions in which rays of one family leave the sonar for the neighbourhoods of n places."""

    axis: Floats
    """Unit vector of the middle of each cone, (n, 3)."""
    half_angle: Floats
    """How far from it a ray can leave [rad], (n,)."""
    exists: NDArray[np.bool_]
    """False where no ray of the family gets to any place of the neighbourhood, (n,)."""


class PropagationModel(Protocol):
    """Answers what the engine asks of the water between two boundaries."""

    def legs(self, position: Floats, scatterers: Scatterers, families: tuple[str, ...], frequency: float) -> Legs:
        """The legs between one end of the sonar and some scatterers.

        Args:
            position: North, east, depth of that end [m], shape (3,).
            scatterers: The points to reach, n of them.
            families: Families to follow; those that would count a scatterer twice are left out.
            frequency: Frequency of absorption and of the limit at caustics [Hz].

        Returns:
            Legs of shape (rows, n), a row for every family kept and every branch of it.
        """

    def with_aperture_expansion(
        self, legs: Legs, position: Floats, scatterers: Scatterers, aperture_extent: tuple[float, float]
    ) -> Legs:
        """The same legs, with what they say about places beside that end.

        Args:
            legs: Of `legs`, from the same place to the same scatterers.
            position: North, east, depth of that end [m], shape (3,).
            scatterers: The points to reach, n of them.
            aperture_extent: How far such places are over ground, and in depth [m].
        """

    def reachable_range(
        self, depths: tuple[float, float], boundary_depth: float, families: tuple[str, ...],
        delays: tuple[float, float], end_distance: float, *, relief_height: float = 0.0,
    ) -> ReachableRange:  # fmt: skip
        """Distances on a boundary whose earliest or latest pair of legs can be heard.

        Args:
            depths: Depths of transmitter and receiver [m].
            boundary_depth: Depth of the boundary [m].
            families: Families that reach the boundary.
            delays: Half of the earliest and of the latest two-way delay heard [s].
            end_distance: Distance between transmitter and receiver [m].
            relief_height: How far the boundary may stand above or lie below its depth [m].

        Returns:
            Horizontal distances; farthest is negative where nothing is heard.
        """

    def departure_cones(
        self,
        family: str,
        position: Floats,
        centre: Floats,
        radius: Floats,
        boundary_depth: float,
        *,
        relief_height: float = 0.0,
    ) -> DepartureCones:
        """Bounds of the directions in which one family leaves for neighbourhoods on a boundary.

        Args:
            family: Name of the family.
            position: North, east, depth of that end of the sonar [m], shape (3,).
            centre: North and east of the neighbourhoods [m], shape (n, 2).
            radius: How far they extend [m], shape (n,).
            boundary_depth: Depth of the boundary [m].
            relief_height: How far the boundary may stand above or lie below its depth [m].
        """

    def launch_angles(self, source_depth: float) -> LaunchAngles:
        """How rays leave one depth of the sonar [m], for the terrain_occlusion of uneven ground."""
