"""Legs in layered water: every ray of every family, refracted, turned, and limited at caustics.

Rays come from the exact solver, or from its tables where millions are needed. Both are turned into legs alike:
directions and grazing angles at both boundaries follow from the horizontal slowness, which is constant along a ray;
absorption from the path length, with one coefficient of the water at all depths.
"""

import math
from copy import copy
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import absorption_np_per_m
from insonify.propagation._absorption_kernel import absorb
from insonify.propagation._eigenray_kernel import AMPLITUDE, FOLD, FOLD_CURVATURE, FOLD_SIDE, RaySolutions
from insonify.propagation._eigenray_table_nodes import LOWEST_FREQUENCY
from insonify.propagation._refracted_legs_kernel import (
    HorizontalGeometry,
    RefractedLegs,
    occlude_row_by_boxes,
    refracted_leg_row,
    set_horizontal_geometry,
)
from insonify.propagation.aperture_expansion import aperture_expansion
from insonify.propagation.caustic import fold_factor
from insonify.propagation.departure_cone_kernel import DepartureAngles, launch_angle_bounds
from insonify.propagation.eigenray_record import no_rays
from insonify.propagation.eigenray_tables import EigenrayTables, FamilyRays, exact_rays
from insonify.propagation.expansion_table import ExpansionTable, expansion_table
from insonify.propagation.families import (
    bottom_bounces,
    bounce_sequence,
    families_reaching,
    family_bounces,
    first_boundary,
    image_depth,
    surface_bounces,
)
from insonify.propagation.propagation_model import RANGE_MARGIN, RayDomain, ReachableRange
from insonify.propagation.refracted_launch_angles import RefractedLaunchAngles
from insonify.propagation.refracted_solid_shadows import leg_ends, occlude_refracted_row, solid_bounds
from insonify.propagation.sound_speed_layers import SoundSpeedLayers, scene_layers
from insonify.propagation.travel_time_curves import (
    TravelTimeCurve,
    departure_angles,
    enclosing_curve,
    ranges_within_delays,
    travel_time_curve,
)
from insonify.recent_results import RecentResults
from insonify.records.legs import Legs, LegStatus, legs_to_points
from insonify.scene.scatterers import Boundary, Scatterers
from insonify.scene.scene import Scene, open_scene

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RefractedRays:
    """Rays in water whose sound speed changes with depth."""

    scene: Scene
    domain: RayDomain
    layers: SoundSpeedLayers
    travel_time_curves: RecentResults[TravelTimeCurve] = field(default_factory=lambda: RecentResults(512), repr=False)
    angles_of_departure: RecentResults[DepartureAngles] = field(default_factory=lambda: RecentResults(32), repr=False)
    expansion_tables: RecentResults[ExpansionTable | None] = field(default_factory=lambda: RecentResults(8), repr=False)
    launch_angle_tables: RecentResults[RefractedLaunchAngles] = field(
        default_factory=lambda: RecentResults(64), repr=False
    )
    tables: EigenrayTables = field(init=False, repr=False)
    boxes: Floats = field(init=False, repr=False)
    """Occluding boxes, shape (boxes, 8), see `insonify.scene.box.box_body`."""
    body_bounds: Floats = field(init=False, repr=False)
    """Bounds of all other occluding bodies [m], shape (solids, 6), see `solid_bounds`."""

    def __post_init__(self) -> None:
        """Set the bodies of the scene, and its eigenray tables, which are built on first use."""
        object.__setattr__(self, "boxes", self.scene.bodies)
        object.__setattr__(self, "body_bounds", solid_bounds(self.scene))
        terrain = self.scene.seabed.terrain
        span = (
            (self.layers.bottom_reflection_depth,) * 2
            if terrain is None
            else (max(terrain.span[0], 0.0), terrain.span[1])
        )
        bodies = len(self.boxes) + len(self.body_bounds) > 0
        object.__setattr__(self, "tables", EigenrayTables(self.layers, self.domain, bodies, span))

    def legs(
        self, position: Floats, scatterers: Scatterers, families: tuple[str, ...], frequency: float, *,
        needed: NDArray[np.bool_] | None = None,
    ) -> Legs:  # fmt: skip
        """Legs of every ray; see `PropagationModel.legs`."""
        names = families_reaching(scatterers.boundary, families)
        geometry = HorizontalGeometry(position, scatterers.position, *np.empty((5, len(scatterers))))
        set_horizontal_geometry(self.layers, geometry)
        followed = [
            np.arange(len(scatterers)) if needed is None else np.flatnonzero(needed[families.index(name)])
            for name in names
        ]
        ends = [(float(position[2]), geometry.depth[points], geometry.distance[points]) for points in followed]
        if self.uses_tables(frequency):
            family_rays = [self.tables.rays(f, scatterers.boundary, *e) for f, e in zip(names, ends, strict=True)]
        else:
            family_rays = [exact_rays(self.layers, f, *e) for f, e in zip(names, ends, strict=True)]
        return self._assemble(geometry, scatterers, family_rays, followed, frequency)

    def uses_tables(self, frequency: float) -> bool:
        """Return True if tables represent the rays at a frequency [Hz]; at lower ones a fold affects more rays."""
        return frequency >= LOWEST_FREQUENCY

    def open_water(self) -> "RefractedRays":
        """Rays of the same water and tables without targets; see `PropagationModel.open_water`."""
        model = copy(self)
        for name, value in (("scene", open_scene(self.scene)), ("boxes", self.boxes[:0]),
                            ("body_bounds", self.body_bounds[:0])):  # fmt: skip
            object.__setattr__(model, name, value)
        return model

    def with_aperture_expansion(
        self, legs: Legs, position: Floats, scatterers: Scatterers, aperture_extent: tuple[float, float]
    ) -> Legs:
        """Legs with the expansion by rays from four positions about that end; see `PropagationModel`."""
        points, table = scatterers.position, None
        if scatterers.boundary in ("seabed", "surface") and len(set(legs.families)) == len(legs.families):
            table = self._expansion_table(legs.families, scatterers, float(position[2]), aperture_extent)
        if table is None:
            terms = self._expansion(legs, position, points, scatterers.boundary, aperture_extent)
            return replace(legs, aperture_expansion=np.nan_to_num(terms))
        distance = np.hypot(points[:, 0] - position[0], points[:, 1] - position[1])
        terms, is_outside = table.read(distance, points[:, 2], legs.spreading > 0)
        outside = np.flatnonzero(is_outside)
        if len(outside):
            outside_legs, _ = legs_to_points((legs, legs), outside)
            exact = self._expansion(outside_legs, position, points[outside], scatterers.boundary, aperture_extent)
            terms[:, :, outside] = np.nan_to_num(exact)
        return replace(legs, aperture_expansion=terms)

    def _expansion(
        self, legs: Legs, position: Floats, points: Floats, boundary: Boundary, aperture_extent: tuple[float, float]
    ) -> Floats:
        """Expansion of each leg by rays from four positions about the end of the sonar, see `aperture_expansion`."""

        def rays_to(family: str, depth: float, ranges: Floats) -> FamilyRays:
            if not self.tables.covers_depth(family, boundary, depth):
                return FamilyRays(family, *no_rays(len(ranges), 1))
            return self.tables.rays(family, boundary, depth, points[:, 2], ranges)

        return aperture_expansion(
            legs, position, points, self.scene.water, aperture_extent, self.layers.water_depth, rays_to
        )

    def _expansion_table(
        self, families: tuple[str, ...], scatterers: Scatterers, source_depth: float,
        aperture_extent: tuple[float, float],
    ) -> ExpansionTable | None:  # fmt: skip
        """Expansions of some families to the boundary of scatterers, cached for pings from the same sonar depth."""
        water, source = self.open_water(), np.array([0.0, 0.0, source_depth])

        def evaluate(distance: Floats, depth: Floats) -> Floats | None:
            n = len(distance)
            nodes = replace(
                scatterers, position=np.column_stack([distance, np.zeros(n), depth]), normal=np.zeros((n, 3)),
                area=np.ones(n), phase=np.ones(n, complex), scatterer_id=np.arange(n, dtype=np.uint64),
            )  # fmt: skip
            legs = water.legs(source, nodes, families, LOWEST_FREQUENCY)
            if legs.families != families:
                return None
            return self._expansion(legs, source, nodes.position, scatterers.boundary, aperture_extent)

        limits = self.tables.terrain_depths if scatterers.boundary == "seabed" else (0.0, 0.0)
        farthest = max(self.domain.max_range, 1.0) * RANGE_MARGIN
        return self.expansion_tables.get(
            (families, scatterers.boundary, source_depth, aperture_extent),
            lambda: expansion_table(evaluate, limits, farthest, aperture_extent),
        )

    def reachable_range(
        self, depths: tuple[float, float], boundary_depth: float, families: tuple[str, ...],
        delays: tuple[float, float], end_distance: float, *, relief_height: float = 0.0,
    ) -> ReachableRange:  # fmt: skip
        """Reachable distances from rays to all distances, see `PropagationModel.reachable_range`."""
        boundary_depths = self._boundary_depths(boundary_depth, relief_height)
        end_depths = dict.fromkeys(depths)
        curves = [self._curve(name, depth, boundary_depths) for name in families for depth in end_depths]
        nearest, farthest = ranges_within_delays(curves, delays, end_distance / self.scene.water.min_sound_speed)
        # The vertical distance is that of straight rays: terrain is sampled at the same positions in all water.
        images = [image_depth(name, sum(depths) / 2, self.layers.bottom_reflection_depth) for name in families]
        return ReachableRange(min(abs(boundary_depth - image) for image in images), nearest, farthest)

    def departure_angles(
        self, families: tuple[str, ...], source_depth: float, boundary_depth: float, *, relief_height: float = 0.0
    ) -> DepartureAngles:
        """Extremes of the launch angles of all rays over distance, see `PropagationModel.departure_angles`."""
        boundary_depths = self._boundary_depths(boundary_depth, relief_height)
        return self.angles_of_departure.get(
            (families, self._tabulated_depths(source_depth), boundary_depths),
            lambda: departure_angles([self._curve(family, source_depth, boundary_depths) for family in families]),
        )

    def zone_climbs(
        self, families: tuple[str, ...], source_depth: float, boundary_depth: float, zone: tuple[float, float]
    ) -> Floats:
        """Distance times tangent of the launch angle, positive towards the first boundary, at both limits of a zone.

        Args:
            families: Names of the families, f of them.
            source_depth: Depth of the sonar [m].
            boundary_depth: Depth of the boundary [m].
            zone: Nearest and farthest distance on it [m].

        Returns:
            Product of the greatest angle in the zone and the nearest distance, and of the least angle and the farthest
            distance [m], 0 for no ray, shape (f, 2).
        """
        climbs, angles = np.zeros((len(families), 2)), self.departure_angles(families, source_depth, boundary_depth)
        for row, family in enumerate(families):
            low, high = launch_angle_bounds(angles, row, *zone)
            if low <= high:
                extremes = np.array([-low, -high] if first_boundary(family) == "surface" else [high, low])
                climbs[row] = np.tan(np.clip(extremes, -STEEPEST, STEEPEST)) * np.maximum(zone, NEAREST)
        return climbs

    def launch_angles(self, source_depth: float) -> RefractedLaunchAngles:
        """Launch angles of refracted rays, cached for pings from the same sonar depth."""
        depths = self._tabulated_depths(source_depth)

        def make() -> RefractedLaunchAngles:
            if len(depths) < 2:
                return self._launch_angles(source_depth, None)
            above, below = (
                self.launch_angle_tables.get((depth,), partial(self._launch_angles, depth, None)) for depth in depths
            )
            return self._launch_angles(source_depth, (above, below))

        return self.launch_angle_tables.get(source_depth, make)

    def _launch_angles(
        self, source_depth: float, neighbours: tuple[RefractedLaunchAngles, RefractedLaunchAngles] | None
    ) -> RefractedLaunchAngles:
        highest = min(self.tables.terrain_depths[0], *self.domain.point_depths)
        farthest = max(self.domain.max_range, 1.0) * RANGE_MARGIN
        limits = highest, self.tables.terrain_depths[1]
        return RefractedLaunchAngles(self.layers, source_depth, farthest, limits, neighbours)

    def _tabulated_depths(self, source_depth: float) -> tuple[float, ...]:
        """Sonar depths whose rays stand for those from one depth [m]: itself, or two about it if the depth varies."""
        upper = math.floor(source_depth / DEPTH_SPACING) * DEPTH_SPACING
        lower = upper + DEPTH_SPACING
        if not self.domain.is_span or upper <= 0 or lower >= self.layers.water_depth:
            return (source_depth,)
        return upper, lower

    def _boundary_depths(self, boundary_depth: float, relief_height: float) -> tuple[float, ...]:
        """Depths that represent a boundary: its own, and four more over relief, all within the profile [m]."""
        if relief_height == 0:
            return (boundary_depth,)
        depths = {boundary_depth + side * relief_height for side in (-1, -0.5, 0, 0.5, 1)}
        return tuple(sorted({min(max(depth, 0.0), self.layers.water_depth) for depth in depths}))

    def _curve(self, family: str, depth: float, boundary_depths: tuple[float, ...]) -> TravelTimeCurve:
        """Bounds over distance of a family's rays from one depth, or two about it, to all depths of a boundary."""
        source_depths, farthest = self._tabulated_depths(depth), max(self.domain.max_range, 1.0)

        def curve(source_depth: float, boundary_depth: float) -> TravelTimeCurve:
            key = (family, source_depth, boundary_depth)
            return self.travel_time_curves.get(key, lambda: travel_time_curve(self.layers, *key, farthest))

        return self.travel_time_curves.get(
            (family, source_depths, boundary_depths),
            lambda: enclosing_curve([curve(source, bed) for source in source_depths for bed in boundary_depths]),
        )

    def _assemble(
        self, geometry: HorizontalGeometry, scatterers: Scatterers, family_rays: list[FamilyRays],
        followed: list[NDArray[np.int64]], frequency: float,
    ) -> Legs:  # fmt: skip
        """Assemble legs from the rays of each family to the points, given by their rows, to which it is followed."""
        rows = [
            (rays, points, branch)
            for rays, points in zip(family_rays, followed, strict=True)
            for branch in range(rays.branch_count)
        ]
        shape = len(rows), len(scatterers)
        delay, length, spreading, slowness, grazing_sine = np.empty((5, *shape))
        departure, arrival = np.empty((2, *shape, 3))
        caustics, status = np.empty((2, *shape), np.uint8)
        occluder = np.full(shape, -1, np.int16)
        legs = RefractedLegs(
            delay, length, spreading, caustics, slowness, departure, arrival, grazing_sine, status, occluder
        )  # fmt: skip
        water, source_speed = self.layers, float(np.interp(geometry.source[2], self.layers.depth, self.layers.speed))
        normals, near_folds = np.ascontiguousarray(scatterers.normal), []
        ends = leg_ends(scatterers) if len(self.body_bounds) else None
        for row, (rays, points, branch) in enumerate(rows):
            solutions = RaySolutions(rays.rays, rays.count, rays.missing_status)
            if refracted_leg_row(geometry, normals, source_speed, points, solutions, branch, legs, row):
                near_folds.append(row)
            if len(self.boxes):
                bounces = family_bounces(rays.family)
                occlude_row_by_boxes(water, geometry, bounces, self.boxes, scatterers.occluder, legs, row)
            if ends is not None:
                occlude_refracted_row(self.scene, water, self.body_bounds, geometry, ends, rays.family, legs, row)
        phase = _QUARTER_TURNS[caustics % 4] if caustics.any() else None
        for row in near_folds:
            phase = np.ones(shape, complex) if phase is None else phase
            _limit_at_folds(*rows[row], spreading[row], phase[row], frequency)
        absorption = np.empty(shape)
        absorb(length, absorption_np_per_m(self.scene.water, frequency), absorption)
        families, to_points = tuple(rays.family for rays, _, _ in rows), [points for _, points, _ in rows]
        return Legs(
            families=families, branch=tuple(branch for _, _, branch in rows), delay=delay, length=length,
            spreading=spreading, absorption=absorption,
            reflection_coefficient=self._reflection_coefficients(families, to_points, slowness), caustics=caustics,
            visibility=(status == LegStatus.CLEAR).astype(float), departure=departure, arrival=arrival,
            grazing_sine=grazing_sine, status=status, occluder=occluder, caustic=phase,
        )  # fmt: skip

    def _reflection_coefficients(
        self, families: tuple[str, ...], followed: list[NDArray[np.int64]], slowness: Floats
    ) -> NDArray[np.complex128]:
        """Product of the reflection coefficients of each row [1], at the grazing angles by its slowness [s/m]."""
        product = np.empty(slowness.shape, complex)
        surface = complex(self.scene.surface.reflection_coefficient(np.zeros(1))[0])  # alike at any angle
        bottom_speed = float(np.interp(self.layers.bottom_reflection_depth, self.layers.depth, self.layers.speed))
        for row, (family, points) in enumerate(zip(families, followed, strict=True)):
            sequence = bounce_sequence(family)
            product[row] = surface ** surface_bounces(sequence)
            if bottom_bounces(sequence):
                sine = _grazing_sine(slowness[row, points], bottom_speed)
                bottom = self.scene.seabed.reflection_coefficient_at_sine(sine)
                product[row, points] *= bottom ** bottom_bounces(sequence)
        return product


STEEPEST, NEAREST = float(np.radians(89.5)), 0.1
"""Largest angle [rad] and least distance [m] that `RefractedRays.zone_climbs` applies."""
DEPTH_SPACING = 0.125
"""Spacing of the tabulated sonar depths [m]: launch angles between them err by some 1e-5 of the vertical travel."""


def refracted_rays(scene: Scene, domain: RayDomain) -> RefractedRays:
    """Propagation model of layered water.

    Args:
        scene: Water with a profile, boundaries and occluders.
        domain: Domain of the rays of a survey.

    Raises:
        ValueError: The profile does not cover the depths from the surface to the seabed.
    """
    return RefractedRays(scene, domain, scene_layers(scene))


def _grazing_sine(slowness: Floats, speed: float) -> Floats:
    """Sine of the grazing angle of rays at a boundary, from their horizontal slowness [s/m] and its speed [m/s] [1]."""
    cosine = slowness * speed  # 1 - cosine^2 would have no digits left at low angles
    return np.sqrt(np.clip((1 - cosine) * (1 + cosine), 0.0, 1.0))


def _limit_at_folds(
    rays: FamilyRays, points: NDArray[np.int64], branch: int, spreading: Floats, phase: NDArray[np.complex128],
    frequency: float,
) -> None:  # fmt: skip
    """Limit the spreading of the rays of one row that end near a fold, and turn their phasors, in place."""
    near_fold = np.flatnonzero((rays.count > branch) & (rays.rays[:, branch, FOLD_SIDE] != 0))
    ray = rays.rays[near_fold, branch]
    factor = fold_factor(np.abs(ray[:, FOLD]), ray[:, FOLD_CURVATURE], ray[:, FOLD_SIDE], frequency)
    limited = np.where(np.isfinite(ray[:, AMPLITUDE]), ray[:, AMPLITUDE], 0.0) * factor
    spreading[points[near_fold]] = np.abs(limited)
    phase[points[near_fold]] *= np.exp(1j * np.angle(factor))


_QUARTER_TURNS = np.array([1, 1j, -1, -1j])
