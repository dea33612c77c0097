"""Terrain occlusion: visibility of the seabed, and of objects above it, from each end of the sonar.

Rays of one family in one vertical plane do not cross: terrain that is reached at a steeper launch angle than nearer
terrain is hidden. So one pass outwards along a profile, with the launch horizon (the shallowest launch angle that
has reached the terrain so far), determines the visible samples in O(samples). A ray with bounces is tested segment by
segment: the last one to the seabed, and those that descend from the surface, by the launch horizon of their own
family; one that rises from a bounce by the same pass in the opposite direction.

Terrain is sampled along azimuth slices, see `terrain_profiles`. A point of the seabed is visible where the middle
profile of its slice is.

With soft edges, sound is diffracted over crests, behind which terrain lies in shadow: on every segment of a leg by that
of the nearest few crests with the largest loss, see `_terrain_diffraction_kernel`. The launch horizon still determines
occlusion.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _terrain_diffraction_kernel as crests
from insonify.engines import _terrain_occlusion_kernel as kernel
from insonify.engines.ray_marching import PENETRATION, RayModel, march_over_terrain
from insonify.engines.terrain_profiles import AzimuthProfiles, GainBound, ProfileGroup
from insonify.propagation.families import DIRECT, bottom_bounces, bounce_sequence, first_boundary, last_boundary
from insonify.propagation.knife_edge import edge_diffraction_table
from insonify.propagation.launch_angles import LaunchAngles, StraightLaunchAngles
from insonify.records.legs import Legs, LegStatus
from insonify.scene.scatterers import Scatterers
from insonify.scene.seabed_terrain import SeabedTerrain

__all__ = [
    "SEABED",
    "LaunchAngles",
    "StraightLaunchAngles",
    "TerrainOcclusion",
    "fresnel_half_length",
    "occlude_by_terrain",
]

Floats = NDArray[np.floating[Any]]

SEABED = -2
"""Value of `Legs.occluder` for the seabed."""


class TerrainOcclusion:
    """Occlusion by the seabed for one end of the sonar at one ping; profiles are sampled when they are needed.

    Example:
        >>> from insonify.scene.seabed import Seabed
        >>> relief = {"kind": "ripples", "wavelength": 10, "height": 1}
        >>> bed = Seabed(depth=20, relief=relief).completed(1, 100e3, 1500.0)
        >>> sonar, launches = np.array([0.0, 0.0, 15.0]), StraightLaunchAngles(source_depth=15.0, water_depth=20.0)
        >>> occlusion = TerrainOcclusion(
        ...     bed.terrain, sonar, launches, farthest=100.0, wavelength=0.015, min_profile_width=1e-3
        ... )
        >>> distance = np.array([44.0, 49.0])  # in a trough, and on the face of a crest
        >>> slope, groups = launches.launch_slope("D", distance, 20.0), occlusion.profile_groups(np.zeros(2), distance)
        >>> sine = (slope / np.hypot(1, slope))[None]
        >>> occlusion.visible(("D",), distance, sine, np.full(2, 20.0), groups, on_terrain=True).tolist()
        [[False, True]]
    """

    def __init__(
        self, terrain: SeabedTerrain, position: Floats, launches: LaunchAngles, *, farthest: float, wavelength: float,
        min_profile_width: float,
        gain_bound: GainBound | None = None,
    ) -> None:  # fmt: skip
        """Prepare without sampling any profile.

        Args:
            terrain: The seabed.
            position: North, east, depth of transmitter or receiver [m], shape (3,).
            launches: Launch angles as a function of position.
            farthest: Horizontal distance of the last samples [m]; points beyond it are occluded like points there.
            wavelength: Acoustic wavelength, for the Fresnel zone of a bounce [m].
            min_profile_width: Slices need not be narrower than this [rad].
            gain_bound: Upper bound of the two-way gain by bearing, to merge slices of low gain; None: none is merged.
        """
        self.bed, self.launches, self.wavelength = terrain, launches, wavelength
        self._all_below = terrain.span[0] > position[2]
        self.profiles = AzimuthProfiles(
            terrain, position, launches, farthest=farthest, wavelength=wavelength, min_profile_width=min_profile_width,
            gain_bound=gain_bound,
        )  # fmt: skip
        self.step = self.profiles.step

    def visible(
        self, families: tuple[str, ...], distance: Floats, sine: Floats, depth: Floats, groups: list[ProfileGroup], *,
        on_terrain: bool = False, diffraction_factor: NDArray[np.complex128] | None = None,
        status: NDArray[np.uint8] | None = None,
    ) -> NDArray[np.bool_]:  # fmt: skip
        """Return True if rays of some families reach positions without reaching the seabed before them.

        Args:
            families: Names of the families, f of them.
            distance: Horizontal distance of each position [m], shape (n,).
            sine: Sine of the launch angle, positive down [1], shape (f, n).
            depth: Depth of each position [m], shape (n,).
            groups: Groups of these positions by `profile_groups`.
            on_terrain: True if the positions lie on the seabed: then their depth is that of their slice's line.
            diffraction_factor: Result where it is given: factor of crests of the seabed on the pressure [1], shape
                (f, n).
            status: `LegStatus` of the rays: those that do not exist need not be tested, shape (f, n); None: all exist.

        Returns:
            True where a ray is clear, shape (f, n).
        """
        result = np.empty((len(families), len(distance)), bool)
        for row, name in enumerate(families):
            factor = None if diffraction_factor is None else diffraction_factor[row]
            if factor is not None:
                factor[:] = 1.0
            if on_terrain and (name == DIRECT or (name == "S" and self._all_below)):  # cut on their last segment only
                result[row] = True
                self._occlude_terrain_points(groups, name, distance, result[row], factor)
            else:
                result[row] = self._clear(name, groups, distance, sine[row], on_terrain, factor)
            if families.count(name) == 1 and self.launches.has_single_rays(name, distance, depth):
                continue
            slope = launch_slope(name, sine[row])
            off_table = self.launches.off_table_rays(name, slope, distance, depth)
            if status is not None:
                off_table &= (status[row] == LegStatus.CLEAR) | (status[row] == LegStatus.OCCLUDED)
            if off_table.any():
                rays = RayModel(self.launches, self.bed.depth, self.wavelength, self.step)
                marched = march_over_terrain(
                    rays, name, groups, distance, slope, depth, off_table, on_terrain=on_terrain
                )
                result[row, off_table] = marched[off_table]
                if factor is not None:
                    factor[off_table] = marched[off_table]
        return result

    def _occlude_terrain_points(
        self, groups: list[ProfileGroup], family: str, distance: Floats, is_clear: NDArray[np.bool_],
        factor: NDArray[np.complex128] | None,
    ) -> None:  # fmt: skip
        """Mark terrain that nearer terrain hides; multiply `factor` (pressure) by that of crests before it."""
        soft, crest_factor = factor is not None, np.empty(0, complex) if factor is None else factor
        for lines, points, rows in groups:
            if not lines.unobstructed(family):
                rays = crests.LineRays(rows, points, distance, distance, is_clear, crest_factor)
                crests.occlude_terrain_points(
                    lines.horizon(family), self.step, rays, distance, self.wavelength, edge_diffraction_table(), soft
                )

    def _clear(
        self, family: str, groups: list[ProfileGroup], distance: Floats, sine: Floats, on_terrain: bool,
        factor: NDArray[np.complex128] | None,
    ) -> NDArray[np.bool_]:  # fmt: skip
        """Return True if rays of one family are clear, segment by segment; `factor` gets the factor of their crests."""
        letters = bounce_sequence(family)
        slope = launch_slope(family, sine)
        if letters == "S" and self._all_below:  # its bounce does not matter
            stops = [distance, distance]
        else:
            stops = [*self.launches.bounce_ranges(family, slope), distance]
        zone_lengths = {
            k: fresnel_half_length(stops[k], distance, self.launches.bottom_grazing_tangent(slope), self.wavelength)
            for k, letter in enumerate(letters)
            if letter == "B"
        }
        is_clear = np.ones(len(distance), bool)
        for k, stop in enumerate(stops):
            if k == 0 and first_boundary(letters) == "surface" and self._all_below:
                continue
            passed, ends_on_terrain = letters[:k] or "D", on_terrain and k == len(letters)
            before = stop - zone_lengths.get(k, 0.0)
            if last_boundary(passed) == "bottom" and not ends_on_terrain:
                span = self._steps(stops[k - 1] + zone_lengths[k - 1]), self._steps(before)
                segment_clear = np.ones(len(is_clear), bool)
                for lines, points, rows in groups:
                    kernel.rising_rays_clear(*lines.horizon(passed)[:2], slope, rows, *span, points, segment_clear)
                is_clear &= segment_clear
                if factor is not None:
                    self._under_crests(groups, passed, span, slope, distance, segment_clear, factor)
                continue
            downward_slope = -slope if k == 0 and first_boundary(letters) == "surface" else slope
            if ends_on_terrain:
                segment_clear = np.ones(len(is_clear), bool)
                self._occlude_terrain_points(groups, passed, distance, segment_clear, factor)
                is_clear &= segment_clear
                continue
            is_clear &= downward_slope <= self._horizon(groups, passed, before)
            if factor is not None:
                self._over_crests(groups, passed, before, downward_slope, distance, factor)
        return is_clear

    def _over_crests(
        self, groups: list[ProfileGroup], family: str, reach: Floats, slope: Floats, distance: Floats,
        factor: NDArray[np.complex128],
    ) -> None:  # fmt: skip
        """Multiply `factor` by that of crests that descending rays pass up to a horizontal distance `reach` [m]."""
        is_clear = np.empty(0, bool)
        for lines, points, rows in groups:
            rays = crests.LineRays(rows, points, slope, distance, is_clear, factor)
            crests.diffract_over_crests(
                lines.horizon(family), self.step, rays, reach, self.wavelength, edge_diffraction_table()
            )

    def _under_crests(
        self, groups: list[ProfileGroup], family: str, span: tuple[Floats, Floats], slope: Floats, distance: Floats,
        is_clear: NDArray[np.bool_], factor: NDArray[np.complex128],
    ) -> None:  # fmt: skip
        """Multiply `factor` by that of crests that rising rays pass between two distances [steps]."""
        for lines, points, rows in groups:
            rays = crests.LineRays(rows, points, slope, distance, is_clear, factor)
            crests.diffract_rising_rays(
                lines.horizon(family), self.step, rays, *span, self.wavelength, edge_diffraction_table()
            )

    def image_paths_clear(
        self, groups: list[ProfileGroup], nodes: Floats, bounce_margin: Floats, *, on_terrain: bool
    ) -> NDArray[np.bool_]:
        """Return True for paths of straight segments that the seabed does not cut, tested sample by sample.

        Args:
            groups: Groups of the positions by `profile_groups`.
            nodes: Horizontal distance and depth of the sonar, of each bounce and of the position [m], shape (k, n, 2).
            bounce_margin: Horizontal distance about each of these where the seabed reflects and is not tested [m],
                shape (k, n).
            on_terrain: True if the positions lie on the seabed: then paths end on that of their slice's line.

        Returns:
            True where all segments of a path are clear, shape (n,).
        """
        is_clear = np.ones(nodes.shape[1], bool)
        for lines, points, rows in groups:
            depths = kernel.LineDepths(lines.depth, lines.shallowest, self.step)
            kernel.segments_clear(depths, rows, points, nodes, bounce_margin, on_terrain, PENETRATION, is_clear)
        return is_clear

    def _horizon(self, groups: list[ProfileGroup], family: str, distance: Floats) -> Floats:
        """Launch horizon of a family at horizontal distances [m] of the points [1], shape (n,)."""
        horizon, reach = np.full(len(distance), np.inf), self._steps(distance)
        for lines, points, rows in groups:
            kernel.horizon_at(lines.horizon(family).horizon, rows, reach, points, horizon)
        return horizon

    def _steps(self, distance: Floats) -> Floats:
        """Distances [m] in samples along a line; bounces that do not exist become very large."""
        return np.asarray(np.minimum(distance, 1e12) / self.step)

    def profile_groups(self, azimuth: Floats, distance: Floats) -> list[ProfileGroup]:
        """Points by the lines that pass them.

        Args:
            azimuth: Bearing of each from the sonar [rad], shape (n,).
            distance: Horizontal distance [m], shape (n,).
        """
        span = np.stack([distance * np.cos(azimuth), distance * np.sin(azimuth)], axis=-1)
        return self.profiles.group_points(np.zeros(2), span)[1]


def launch_slope(family: str, sine: Floats) -> Floats:
    """Launch slope of rays of a family, see `insonify.propagation.launch_angles`, from the sine of their angle [1].

    Args:
        family: Name of the family.
        sine: Sine of the launch angle, positive down [1], any shape.
    """
    tangent = np.asarray(sine / np.sqrt(np.maximum(1 - np.asarray(sine, float) ** 2, 1e-24)))
    return -tangent if first_boundary(family) == "surface" else tangent


def fresnel_half_length(bounce: Floats, distance: Floats, tangent: Floats, wavelength: float) -> Floats:
    """Half length of the first Fresnel zone of a bounce on a horizontal seabed [m], shape (n,).

    Args:
        bounce: Horizontal distance of the bounce [m], shape (n,).
        distance: Horizontal length of the leg [m], shape (n,).
        tangent: Tangent of the grazing angle [1], shape (n,).
        wavelength: Acoustic wavelength [m].

    Source: sqrt(wavelength r1 r2 / (r1 + r2)) / sin(grazing), r1 and r2 the paths before and after the bounce.

    Example:
        >>> bounce, distance, tangent = np.array([50.0]), np.array([100.0]), np.array([0.4])  # half way, at 22 deg
        >>> fresnel_half_length(bounce, distance, tangent, wavelength=0.015).round(2).tolist()
        [1.71]
    """
    steep = np.maximum(np.abs(tangent), 1e-9)
    stretch = np.sqrt(1 + steep**2)
    fraction = np.clip(bounce / np.maximum(distance, 1e-9), 0, 1)
    return np.asarray(np.sqrt(wavelength * distance * stretch * fraction * (1 - fraction)) * stretch / steep)


class ProfiledPoints(NamedTuple):
    """Points by their position about one end of the sonar, n of them."""

    distance: Floats
    """Horizontal distance [m], shape (n,)."""
    groups: list[ProfileGroup]
    """The points, grouped by the batch that holds the profile of their slice."""


def locate_points(terrain_occlusion: TerrainOcclusion, sonar: Floats, position: Floats) -> ProfiledPoints:
    """Azimuth slices and samples of some points about one end of the sonar.

    Args:
        terrain_occlusion: Occlusion by the seabed for that end.
        sonar: North, east, depth of that end [m], shape (3,).
        position: North, east, depth of the points [m], shape (n, 3).
    """
    return ProfiledPoints(*terrain_occlusion.profiles.group_points(sonar, position))


def occlude_by_terrain(
    legs: Legs, scatterers: Scatterers, position: Floats, terrain_occlusion: TerrainOcclusion, *, soft: bool = False
) -> Legs:
    """Legs over relief: occluded by the seabed, and reduced by its roughness at every bottom bounce.

    Args:
        legs: Legs over the mean seabed.
        scatterers: The points that they reach.
        position: North, east, depth of transmitter or receiver [m], shape (3,).
        terrain_occlusion: Occlusion by the seabed for that end.
        soft: True if sound is diffracted over crests. Visibility is complex then; on legs that targets cut it is the
            factor of the seabed alone, to which `knife_edge.diffract_at_edges` adds that of the targets.

    Example:
        >>> from insonify.propagation.image_sources import image_legs
        >>> from insonify.scene.scene import Scene, point_scatterer
        >>> from insonify.scene.seabed import Seabed
        >>> from insonify.scene.target import PointTarget
        >>> from insonify.records.legs import LegStatus
        >>> relief = {"kind": "ripples", "wavelength": 10, "height": 1}
        >>> bed = Seabed(depth=20, relief=relief).completed(1, 100e3, 1500.0)
        >>> sonar, launches = np.array([0.0, 0.0, 15.0]), StraightLaunchAngles(source_depth=15.0, water_depth=20.0)
        >>> occlusion = TerrainOcclusion(
        ...     bed.terrain, sonar, launches, farthest=100.0, wavelength=0.015, min_profile_width=1e-3
        ... )
        >>> point = point_scatterer(PointTarget(position=(45, 0, 20.2)))  # in a trough
        >>> legs = image_legs(Scene(seabed=bed), sonar, point, ("D", "S"), 100e3)
        >>> [LegStatus(status).name for status in occlude_by_terrain(legs, point, sonar, occlusion).status[:, 0]]
        ['OCCLUDED', 'CLEAR']
    """
    boundary, sine = legs.reflection_coefficient, legs.departure[..., 2]
    visibility = np.empty(legs.delay.shape, complex) if soft else legs.visibility.copy()
    columns = LegOcclusion(legs.status.copy(), legs.occluder.copy(), visibility)
    distance = write_terrain_occlusion(legs, columns, scatterers, position, terrain_occlusion, soft=soft)
    if any(bottom_bounces(family) for family in legs.families):
        boundary = boundary.copy()
    for row, family in enumerate(legs.families):
        if bottom_bounces(family):
            boundary[row] *= _roughness_factor(terrain_occlusion, family, distance, launch_slope(family, sine[row]))
    return replace(legs, reflection_coefficient=boundary, **columns._asdict())


class LegOcclusion(NamedTuple):
    """Columns of legs that occlusion changes, shape (f, n)."""

    status: NDArray[np.uint8]
    """See `Legs`."""
    occluder: NDArray[np.int16]
    """See `Legs`."""
    visibility: NDArray[np.float64] | NDArray[np.complex128]
    """See `Legs`."""


def write_terrain_occlusion(
    legs: Legs, columns: LegOcclusion, scatterers: Scatterers, position: Floats, terrain_occlusion: TerrainOcclusion, *,
    soft: bool,
) -> Floats:  # fmt: skip
    """Occlude legs by the seabed alone; return the horizontal distance of their points [m], shape (n,).

    Args:
        legs: See `occlude_by_terrain`.
        columns: Changed: status and occluder of the legs. Result: their visibility.
        scatterers: See `occlude_by_terrain`.
        position: See `occlude_by_terrain`.
        terrain_occlusion: See `occlude_by_terrain`.
        soft: See `occlude_by_terrain`.
    """
    distance, groups = locate_points(terrain_occlusion, position, scatterers.position)
    clear = terrain_occlusion.visible(
        legs.families, distance, legs.departure[..., 2], scatterers.position[:, 2], groups,
        on_terrain=scatterers.boundary == "seabed",
        diffraction_factor=np.asarray(columns.visibility, complex) if soft else None,
        status=columns.status,
    )  # fmt: skip
    kernel.mark_terrain_occlusion(clear, legs.visibility, soft, *columns)
    return distance


def _roughness_factor(terrain_occlusion: TerrainOcclusion, family: str, distance: Floats, slope: Floats) -> Floats:
    """Coherent reflection factor of all bottom bounces of a family, for pressure [1], shape (n,)."""
    factor, launches = np.ones(len(distance)), terrain_occlusion.launches
    tangent = launches.bottom_grazing_tangent(slope)
    sine = np.asarray(tangent / np.hypot(1, tangent), float)
    for letter, bounce in zip(bounce_sequence(family), launches.bounce_ranges(family, slope), strict=True):
        if letter == "B":
            bounce_range = np.where(
                bounce < distance, bounce, distance / 2
            )  # a ray that turns before it contributes nothing
            half = fresnel_half_length(bounce_range, distance, tangent, terrain_occlusion.wavelength)
            # geometric mean of the zone's length and width [m]
            zone = np.asarray(np.maximum(2 * half * np.sqrt(sine), 1e-6), float)
            factor *= terrain_occlusion.bed.roughness_reflection_factor(sine, terrain_occlusion.wavelength, zone)
    return factor
