"""Legs in water of one sound speed: straight lines from image sources.

Between two flat boundaries the path of every family unfolds to a straight line from an image of
the sonar (Allen & Berkley 1979, J. Acoust. Soc. Am. 65, 943, for the idea; figure 10 of the paper
that insonify reproduces for the geometry), so delay, directions and spreading are exact.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import absorption_np_per_m
from insonify.propagation._absorption_kernel import absorb
from insonify.propagation._image_source_kernel import FoldedLegs, StraightLegs, mark_legs, straight_legs, write_factors
from insonify.propagation.departure_cone_kernel import DepartureAngles, departure_cones
from insonify.propagation.families import (
    bottom_bounces,
    bounce_sequence,
    families_reaching,
    family_bounces,
    image_depth,
    surface_bounces,
)
from insonify.propagation.launch_angles import StraightLaunchAngles
from insonify.propagation.propagation_model import ReachableRange
from insonify.propagation.solid_shadows import occlude_by_solids
from insonify.records.legs import Legs
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene, open_scene

Floats = NDArray[np.float64]


def image_legs(
    scene: Scene, position: NDArray[np.float64], scatterers: Scatterers, families: tuple[str, ...], frequency: float, *,
    flat_bottom: bool = True, needed: NDArray[np.bool_] | None = None,
) -> Legs:  # fmt: skip
    """Legs between one end of the sonar and some scatterers, from image sources.

    Args:
        scene: Water, boundaries and occluders.
        position: North, east, depth of that end [m], shape (3,).
        scatterers: Ends of the legs, n of them.
        families: Families to follow; those that would count a scatterer twice are left out.
        frequency: Frequency of the absorption [Hz].
        flat_bottom: True to reflect off the bottom's mean plane; otherwise bottom bounces have coefficient 1, for a
            later treatment of relief.
        needed: True for the legs to evaluate, by family, shape (all families, n); others have no amplitude. None: all.

    Returns:
        Legs of shape (selected families, n).
    """
    reaching = families_reaching(scatterers.boundary, families)
    f, n = len(reaching), len(scatterers)
    delay, length, spreading, absorption, visibility, grazing_sine = np.empty((6, f, n))
    departure, arrival = np.empty((2, f, n, 3))
    status, occluder = np.empty((f, n), np.uint8), np.empty((f, n), np.int16)
    folded = _folded_legs(scene, position, reaching)
    straight_legs(
        folded, scene.water.sound_speed, np.ascontiguousarray(scatterers.position),
        np.ascontiguousarray(scatterers.normal), scene.bodies, scatterers.occluder,
        StraightLegs(delay, length, spreading, departure, arrival, grazing_sine, status, occluder),
    )  # fmt: skip
    occlude_by_solids(scene, folded, scatterers, status, occluder)
    absorb(length, absorption_np_per_m(scene.water, frequency), absorption)
    rows = np.empty((f, 0), bool) if needed is None else needed[[families.index(name) for name in reaching]]
    product = np.empty((f, n), complex)
    write_factors(status, rows, _surface_products(scene, reaching), product, visibility)
    if flat_bottom:
        _reflect_off_bottom(scene, reaching, departure[..., 2], product)
    return Legs(
        families=reaching, branch=(0,) * f, delay=delay, length=length, spreading=spreading, absorption=absorption,
        reflection_coefficient=product, caustics=np.zeros((f, n), np.uint8), visibility=visibility,
        departure=departure, arrival=arrival, grazing_sine=grazing_sine, status=status, occluder=occluder,
    )  # fmt: skip


def leg_occlusion(
    scene: Scene, position: Floats, scatterers: Scatterers, families: tuple[str, ...]
) -> tuple[NDArray[np.uint8], NDArray[np.int16]]:
    """Status and occluder of legs alone, those of `image_legs`, in half the time of all their columns.

    Args:
        scene: Water, boundaries and occluders.
        position: North, east, depth of the sonar [m], shape (3,).
        scatterers: Ends of the legs, n of them.
        families: Families to follow; those that would count a scatterer twice are left out.

    Returns:
        `LegStatus` and row of the occluder, -1 for none, shape (selected families, n) each.
    """
    reaching = families_reaching(scatterers.boundary, families)
    folded, shape = _folded_legs(scene, position, reaching), (len(reaching), len(scatterers))
    status, occluder = np.empty(shape, np.uint8), np.empty(shape, np.int16)
    mark_legs(
        folded, np.ascontiguousarray(scatterers.position), np.ascontiguousarray(scatterers.normal), scene.bodies,
        scatterers.occluder, status, occluder,
    )  # fmt: skip
    occlude_by_solids(scene, folded, scatterers, status, occluder)
    return status, occluder


def _folded_legs(scene: Scene, position: Floats, families: tuple[str, ...]) -> FoldedLegs:
    """Position of the sonar, depths of its images and bounces of some families."""
    depth = scene.seabed.depth
    return FoldedLegs(
        position, np.array([image_depth(name, position[2], depth) for name in families]), *_bounces(families), depth
    )


@lru_cache(maxsize=64)
def _bounces(families: tuple[str, ...]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Number of bounces of each family, and True where the first is off the surface."""
    bounces = [family_bounces(name) for name in families]
    return np.array([b.number for b in bounces], np.int64), np.array([b.first_up for b in bounces], bool)


def _surface_products(scene: Scene, families: tuple[str, ...]) -> NDArray[np.complex128]:
    """Product of the surface's reflection coefficients of each family [1], shape (f,)."""
    coefficient = complex(scene.surface.reflection_coefficient(np.zeros(1))[0])  # alike at any angle
    return np.array([math.prod([coefficient] * surface_bounces(name), start=1 + 0j) for name in families])


def _reflect_off_bottom(scene: Scene, families: tuple[str, ...], sine: Floats, product: NDArray[np.complex128]) -> None:
    """Multiply the flat bottom's reflection coefficient into the products of legs, once for each bottom bounce.

    Args:
        scene: The scene with its seabed.
        families: Families of the legs, f of them.
        sine: Sine of their grazing angle, of either sign [1], shape (f, n).
        product: Changed: product of the reflection coefficients [1], shape (f, n).
    """
    for row, family in enumerate(families):
        if bottom_bounces(family):
            coefficient = scene.seabed.reflection_coefficient(np.arcsin(np.minimum(np.abs(sine[row]), 1.0)))
            for _ in range(bottom_bounces(family)):
                product[row] *= coefficient


@departure_cones.stand_in
def _cones(
    angles: DepartureAngles, family: int, position: Floats, centre: Floats, radius: Floats, axis: Floats,
    half_angle: Floats, exists: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Departure cones of straight rays to neighbourhoods, as from the kernel `departure_cones` without numba."""
    axis[:, :2], axis[:, 2] = centre - position[:2], angles.vertical_travel[family]
    length, sphere_radius = np.sqrt(np.sum(axis**2, axis=1)), radius + angles.relief_height
    axis /= length[:, None]
    half_angle[:] = np.where(sphere_radius < length, np.arcsin(np.minimum(1.0, sphere_radius / length)), np.pi)
    exists[:] = True


@lru_cache(maxsize=64)
def _departure_angles(
    families: tuple[str, ...], source_depth: float, boundary_depth: float, water_depth: float, relief_height: float
) -> DepartureAngles:
    """Vertical travel of straight rays to a boundary, unfolded, positive if they start downwards [m]; cached.

    Args:
        families: Names of the families.
        source_depth: Depth of the sonar [m].
        boundary_depth: Depth of the boundary [m].
        water_depth: Depth of the seabed [m].
        relief_height: Largest deviation of the boundary from its depth [m].
    """
    climbs = [boundary_depth - image_depth(family, source_depth, water_depth) for family in families]
    travel = [
        -climb if len(bounce_sequence(family)) % 2 else climb for family, climb in zip(families, climbs, strict=True)
    ]
    return DepartureAngles(np.array(travel), relief_height, 1.0, *np.empty((2, len(families), 0, 0)))


@dataclass(frozen=True)
class StraightRays:
    """Rays in water of one sound speed."""

    scene: Scene

    def legs(
        self, position: Floats, scatterers: Scatterers, families: tuple[str, ...], frequency: float, *,
        needed: NDArray[np.bool_] | None = None,
    ) -> Legs:  # fmt: skip
        """All legs from image sources, see `PropagationModel.legs`; over relief without the bottom's coefficient."""
        bed = self.scene.seabed.terrain
        is_flat = bed is None or bed.span[0] == bed.span[1]
        return image_legs(self.scene, position, scatterers, families, frequency, flat_bottom=is_flat, needed=needed)

    def open_water(self) -> "StraightRays":
        """Rays of the same water without targets, over a flat seabed; see `PropagationModel.open_water`."""
        return StraightRays(open_scene(self.scene))

    def with_aperture_expansion(
        self, legs: Legs, position: Floats, scatterers: Scatterers, aperture_extent: tuple[float, float]
    ) -> Legs:
        """Unchanged legs: spherical waves need no expansion; see `PropagationModel.with_aperture_expansion`."""
        return legs

    def reachable_range(
        self, depths: tuple[float, float], boundary_depth: float, families: tuple[str, ...],
        delays: tuple[float, float], end_distance: float, *, relief_height: float = 0.0,
    ) -> ReachableRange:  # fmt: skip
        """Reachable distances by Pythagoras from the nearest and the farthest image."""
        middle, bottom = sum(depths) / 2, self.scene.seabed.depth
        climbs = [abs(boundary_depth - image_depth(name, middle, bottom)) for name in families]
        shortest, longest = (self.scene.water.sound_speed * delay for delay in delays)
        # a reflection by terrain that is higher or lower displaces the image by twice as much
        displacements = [relief_height * (1 + 2 * bottom_bounces(name)) for name in families]
        min_vertical, max_vertical = (
            choose(climb + side * displacement for climb, displacement in zip(climbs, displacements, strict=True))
            for side, choose in ((-1, min), (1, max))
        )
        nearest = np.sqrt(max(0.0, max(0.0, shortest - end_distance) ** 2 - max_vertical**2))
        farthest_square = (longest + end_distance) ** 2 - max(0.0, min_vertical) ** 2
        farthest = float(np.sqrt(farthest_square)) if farthest_square > 0 else -1.0
        return ReachableRange(min(climbs), float(nearest), farthest)

    def launch_angles(self, source_depth: float) -> StraightLaunchAngles:
        """Straight rays; see `PropagationModel.launch_angles`."""
        return StraightLaunchAngles(source_depth, self.scene.seabed.depth)

    def departure_angles(
        self, families: tuple[str, ...], source_depth: float, boundary_depth: float, *, relief_height: float = 0.0
    ) -> DepartureAngles:
        """Vertical travel of the straight rays; see `PropagationModel.departure_angles`."""
        return _departure_angles(families, source_depth, boundary_depth, self.scene.seabed.depth, relief_height)
