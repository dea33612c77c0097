"""Propagation model of one scene: the interface of straight and refracted rays for the engines.

In water of one sound speed the rays are straight, and images of the sonar give every leg (`image_sources`). In
layered water they refract, turn and leave shadows (`refracted_rays`). The engines do not depend on the difference.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.departure_cone_kernel import DepartureAngles
from insonify.propagation.departure_cone_kernel import departure_cones as fill_departure_cones
from insonify.propagation.launch_angles import LaunchAngles
from insonify.records.legs import Legs
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]


RANGE_MARGIN = 1.01
"""Greatest range of tables over that of the window: random scatterers of a cell may lie a little beyond it [1]."""
MAX_SEPARATE_DEPTHS = 4
"""Largest number of sonar depths with a table each; beyond, one table spans them all [1]."""


@dataclass(frozen=True, slots=True)
class RayDomain:
    """Domain of the rays of one survey, which tables must cover."""

    source_depths: tuple[float, ...]
    """Depths of the ends of the sonar [m], increasing: the least and the greatest beyond `MAX_SEPARATE_DEPTHS`."""
    is_span: bool
    """True if the ends can be anywhere between those depths."""
    point_depths: tuple[float, float]
    """Least and greatest depth of points of bodies in the water [m]; surface and seabed are always included."""
    max_range: float
    """Greatest horizontal distance from which echoes arrive in the window [m]."""


@dataclass(frozen=True, slots=True)
class ReachableRange:
    """Horizontal distances from which echoes of one boundary arrive in the window."""

    vertical_distance: float
    """Vertical distance from the sonar to the boundary [m]."""
    nearest: float
    """Least horizontal distance [m]."""
    farthest: float
    """Greatest horizontal distance [m]; negative where nothing arrives in the window."""


@dataclass(frozen=True, slots=True)
class DepartureCones:
    """Directions in which rays of one family leave the sonar for the neighbourhoods of n positions."""

    axis: Floats
    """Unit vector of the axis of each cone, (n, 3)."""
    half_angle: Floats
    """Half angle of each cone [rad], (n,)."""
    exists: NDArray[np.bool_]
    """False where no ray of the family reaches the neighbourhood, (n,)."""


class PropagationModel(Protocol):
    """Interface to the rays in the water between two boundaries."""

    @property
    def scene(self) -> Scene:
        """Water, boundaries and occluders."""
        ...

    def legs(
        self, position: Floats, scatterers: Scatterers, families: tuple[str, ...], frequency: float, *,
        needed: NDArray[np.bool_] | None = None,
    ) -> Legs:  # fmt: skip
        """Legs between one end of the sonar and some scatterers.

        Args:
            position: North, east, depth of that end [m], shape (3,).
            scatterers: Ends of the legs, n of them.
            families: Families to follow; those that would count a scatterer twice are left out.
            frequency: Frequency of absorption and of the limit at caustics [Hz].
            needed: True for the legs to evaluate, by family, (f, n): others may be left without amplitude. None: all.

        Returns:
            Legs of shape (rows, n), one row for every selected family and every branch of it.
        """

    def open_water(self) -> "PropagationModel":
        """Propagation model of the same water without targets and relief, over the mean plane of the seabed."""
        ...

    def with_aperture_expansion(
        self, legs: Legs, position: Floats, scatterers: Scatterers, aperture_extent: tuple[float, float]
    ) -> Legs:
        """Legs with the expansion of their field about one end of the sonar, see `aperture_expansion`.

        Args:
            legs: Legs from `legs`, for the same end and scatterers.
            position: North, east, depth of that end [m], shape (3,).
            scatterers: Far ends of the legs, n of them.
            aperture_extent: Largest offsets of elements from that end, horizontal and vertical [m].
        """

    def reachable_range(
        self, depths: tuple[float, float], boundary_depth: float, families: tuple[str, ...],
        delays: tuple[float, float], end_distance: float, *, relief_height: float = 0.0,
    ) -> ReachableRange:  # fmt: skip
        """Distances on a boundary from which any pair of legs may arrive in the window, a little more at most.

        Args:
            depths: Depths of transmitter and receiver [m].
            boundary_depth: Depth of the boundary [m].
            families: Families that reach the boundary.
            delays: Half of the earliest and half of the latest two-way delay in the window [s].
            end_distance: Distance between transmitter and receiver [m].
            relief_height: Largest deviation of the boundary from its depth [m].

        Returns:
            Horizontal distances; the farthest is negative where nothing arrives in the window.
        """

    def departure_angles(
        self, families: tuple[str, ...], source_depth: float, boundary_depth: float, *, relief_height: float = 0.0
    ) -> DepartureAngles:
        """Directions of departure of some families to all points of a boundary, from which `departure_cones` follow.

        Args:
            families: Names of the families.
            source_depth: Depth of one end of the sonar [m].
            boundary_depth: Depth of the boundary [m].
            relief_height: Largest deviation of the boundary from its depth [m].
        """

    def launch_angles(self, source_depth: float) -> LaunchAngles:
        """Launch angles of rays from one depth of the sonar [m], for the occlusion by relief."""


def departure_cones(
    rays: PropagationModel, family: str, position: Floats, centre: Floats, radius: Floats, boundary_depth: float, *,
    relief_height: float = 0.0,
) -> DepartureCones:  # fmt: skip
    """Cones that bound the directions in which one family leaves for neighbourhoods on a boundary.

    Args:
        rays: Propagation model.
        family: Name of the family.
        position: North, east, depth of one end of the sonar [m], shape (3,).
        centre: North and east of the neighbourhoods [m], shape (n, 2).
        radius: Radii of the neighbourhoods [m], shape (n,).
        boundary_depth: Depth of the boundary [m].
        relief_height: Largest deviation of the boundary from its depth [m].
    """
    cones = DepartureCones(np.empty((len(centre), 3)), np.empty(len(centre)), np.empty(len(centre), bool))
    angles = rays.departure_angles((family,), float(position[2]), boundary_depth, relief_height=relief_height)
    fill_departure_cones(angles, 0, position, centre, radius, cones.axis, cones.half_angle, cones.exists)
    return cones
