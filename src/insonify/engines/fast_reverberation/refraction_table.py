"""Refraction tables: differences between refracted rays and straight ones, for the fast reverberation in layered water.

A family qualifies where one of its rays reaches every point of the seabed, without caustics, and, if it bounces,
without turning points; or where none reaches any. Other water is left to the eigenray engine, also that with a shadow
zone: its edge lies between nodes, at another distance for each depth.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation import refraction_columns as column
from insonify.engines.fast_reverberation._line_of_sight_kernel import OCCLUDING_MARGIN
from insonify.engines.fast_reverberation._refraction_kernel import interpolate_refraction
from insonify.engines.radial_tables import RefractionTable
from insonify.engines.terrain_occlusion import fresnel_half_length, launch_slope
from insonify.propagation.families import DIRECT, bounce_sequence, first_boundary, image_depth, last_boundary
from insonify.propagation.refracted_rays import RefractedRays

Floats = NDArray[np.float64]

RANGE_SPACING = 0.25
"""Spacing of the distances of a table [m]."""
DEPTH_SPACINGS, FEW_DEPTHS = (0.25, 0.5), 16
"""Least and greatest spacing of the depths of a table [m], and the number of depths from which the spacing grows."""
REFINEMENTS = 1, 2, 4
"""Divisors of the spacing of the depths that are tried in turn."""
LEAST_DISTANCE = 1e-3
"""Horizontal distance of the rays of the first column [m]: a vertical ray has no launch slope."""
PROBES = 256
"""Number of random points at which a table is compared with its rays."""
MAX_PHASE_ERROR, MAX_PRESSURE_ERROR, MAX_SINE_ERROR = 0.1, 5e-3, 3e-3
"""Largest errors of phases [rad], pressures (relative) [1] and sines [1] at these points."""
MAX_LAUNCH_STEP = 0.01
"""Largest difference of the sine of the launch angle, re that of straight rays, between neighbouring nodes [1]."""


class RaysFromDepth(NamedTuple):
    """Rays from one depth of the sonar in layered water, for a table."""

    rays: RefractedRays
    """Propagation model."""
    source_depth: float
    """Depth of the sonar [m]."""
    sound_speed: float
    """Sound speed of the straight rays that the table compares with [m/s]."""
    absorption_exponent: float
    """Absorption as the base-2 exponent of pressure [1/m]."""


def refraction_table(
    source: RaysFromDepth, families: tuple[str, ...], horizon_names: tuple[str, ...], wavelength: float, farthest: float
) -> RefractionTable | None:
    """Refraction table of one depth of the sonar; None where a family does not qualify, or no seabed is in the window.

    Args:
        source: Rays from the depth of the sonar.
        families: Families that reach the seabed.
        horizon_names: Families of the launch horizons.
        wavelength: Acoustic wavelength [m].
        farthest: Largest horizontal distance [m]; below 0: no echo of the seabed arrives within the window.
    """
    if farthest < 0:
        return None
    top, bottom = source.rays.tables.terrain_depths
    ranges: Floats = RANGE_SPACING * np.arange(int(np.ceil(farthest / RANGE_SPACING)) + 2, dtype=float)
    if ranges[-2] > source.rays.domain.max_range + 2 * RANGE_SPACING:
        return None
    spacing = float(np.clip((bottom - top) / FEW_DEPTHS, *DEPTH_SPACINGS))
    for refinement in REFINEMENTS if bottom > top else REFINEMENTS[:1]:
        count = int(np.ceil(refinement * (bottom - top) / spacing)) + 1
        table = _table_on_grid(
            source, families, horizon_names, wavelength, np.linspace(top, bottom, max(count, 2)), ranges
        )
        if table is None:
            return None
        if _agrees(source, families, table, (top, bottom), farthest, MAX_PHASE_ERROR * wavelength / (2 * np.pi)):
            return table
    return None


def _table_on_grid(
    source: RaysFromDepth, families: tuple[str, ...], horizon_names: tuple[str, ...], wavelength: float,
    depths: NDArray[Any], ranges: Floats,
) -> RefractionTable | None:  # fmt: skip
    """Refraction table with nodes at given depths and distances [m]; None where a family does not qualify."""
    nodes = np.empty((len(families), len(depths), len(ranges), column.COUNT), np.float32)
    climbs = np.full((len(horizon_names), len(depths), len(ranges)), np.nan, np.float32)
    clear = np.ones(len(families), bool)
    grid = np.repeat(depths, len(ranges)), np.tile(np.maximum(ranges, LEAST_DISTANCE), len(depths))
    plane, is_flat = source.rays.layers.bottom_reflection_depth, depths[-1] == depths[0]
    rise = float(max(plane - depths[0], depths[-1] - plane))
    for f, family in enumerate(families):
        family_rays = _family_columns(source, family, *grid)
        if family_rays is None:
            return None
        nodes[f] = family_rays.columns.reshape(nodes.shape[1:])
        clear[f] = is_flat or _bounces_are_clear(family, family_rays, grid[1], wavelength, rise)
        climb = _climbs_of(family_rays, *grid, image_depth(family, source.source_depth, plane))
        climbs[horizon_names.index(family)] = climb.reshape(climbs.shape[1:])
    begun = {  # segments of rays that relief may occlude before their last bounce
        bounce_sequence(family)[:k] or DIRECT
        for f, family in enumerate(families) if not clear[f] for k in range(len(bounce_sequence(family)))
    }  # fmt: skip
    for name in begun.difference(families).intersection(horizon_names):
        climbs[horizon_names.index(name)] = _climbs_to_relief(source, name, depths, ranges)
    if not _is_one_sheet(nodes):
        return None
    spacing = 1.0 if is_flat else float(depths[1] - depths[0])  # one depth twice: any spacing
    return RefractionTable(
        float(depths[-1]) - spacing * (len(depths) - 1), spacing, RANGE_SPACING, nodes,
        climbs, clear, _speed_at(source, plane),
    )  # fmt: skip


def _speed_at(source: RaysFromDepth, depth: float) -> float:
    """Sound speed at a depth [m/s]."""
    return float(np.interp(depth, source.rays.layers.depth, source.rays.layers.speed))


def _is_one_sheet(nodes: NDArray[np.float32]) -> bool:
    """Return True if launch angles differ by at most `MAX_LAUNCH_STEP` between neighbouring nodes."""
    launch = nodes[..., column.DEPARTURE]
    return all(bool((np.abs(np.diff(launch, axis=axis)) <= MAX_LAUNCH_STEP).all()) for axis in (1, 2))


class FamilyColumns(NamedTuple):
    """Rays of one family to n points."""

    columns: Floats
    """See `refraction_columns`, (n, 8)."""
    grazing_sine: Floats
    """Sine of the grazing angle at the mean seabed [1], (n,)."""


def _family_columns(source: RaysFromDepth, family: str, depth: Floats, distance: Floats) -> FamilyColumns | None:
    """Rays of one family to n points at given depths and horizontal distances [m]; None where it does not qualify."""
    ray = source.rays.tables.rays(family, "seabed", source.source_depth, depth, distance).single_rays()
    if ray is None or (bounce_sequence(family) and ray.turns.any()) or ray.exists.any() != ray.exists.all():
        return None
    bed_depth = source.rays.layers.bottom_reflection_depth
    vertical = depth - image_depth(family, source.source_depth, bed_depth)
    length = np.hypot(distance, vertical)
    sine = vertical / length
    bed_cosine = ray.slowness * _speed_at(source, bed_depth)
    grazing = np.sqrt(np.clip((1 - bed_cosine) * (1 + bed_cosine), 0.0, 1.0))
    columns = np.zeros((len(depth), column.COUNT))
    columns[:, column.DELAY] = ray.delay - length / source.sound_speed
    columns[:, column.ARRIVAL] = ray.arrival_sine - sine
    columns[:, column.DEPARTURE] = ray.launch_sine * (-1 if first_boundary(family) == "surface" else 1) - sine
    columns[:, column.PRESSURE] = ray.amplitude * length * 2.0 ** (-source.absorption_exponent * (ray.length - length))
    columns[:, column.GRAZING] = grazing - sine
    launches = source.rays.launch_angles(source.source_depth)
    bounces = launches.bounce_ranges(family, launch_slope(family, ray.launch_sine))
    if bounces:
        columns[:, column.BOUNCE] = bounces[0] / distance
        columns[:, column.PERIOD] = (bounces[1] - bounces[0]) / distance if len(bounces) > 1 else 0.0
    columns[~ray.exists] = 0.0
    return FamilyColumns(columns, grazing)


def _bounces_are_clear(
    family: str, family_rays: FamilyColumns, distance: Floats, wavelength: float, rise: float
) -> bool:
    """Return True if relief of some height [m] occludes no ray of a family before its last bounce.

    See `mark_clear_bounces`: seabed that rises by r occludes a ray near a bottom bounce only within r / tan(grazing)
    of it, and reflects within half the length of the Fresnel zone.
    """
    exists = family_rays.columns[:, column.PRESSURE] > 0
    row, distance, sine = family_rays.columns[exists], distance[exists], family_rays.grazing_sine[exists]
    tangent = sine / np.sqrt(np.maximum(1 - sine**2, 1e-12))
    for k, letter in enumerate(bounce_sequence(family)):
        if letter == "B":
            bounce = (row[:, column.BOUNCE] + k * row[:, column.PERIOD]) * distance
            half = fresnel_half_length(bounce, distance, tangent, wavelength)
            if not (OCCLUDING_MARGIN * half * tangent > rise).all():
                return False
    return True


def _climbs_of(family_rays: FamilyColumns, depth: Floats, distance: Floats, image: float) -> Floats:
    """Horizontal distance times launch slope of rays to points [m], NaN without a ray, (n,)."""
    sine = (depth - image) / np.hypot(distance, depth - image) + family_rays.columns[:, column.DEPARTURE]
    climb = distance * sine / np.sqrt(np.maximum(1 - sine**2, 1e-12))
    return np.where(family_rays.columns[:, column.PRESSURE] > 0, climb, np.nan)


def _climbs_to_relief(source: RaysFromDepth, name: str, depths: NDArray[Any], ranges: Floats) -> Floats:
    """Horizontal distance times launch slope of rays of any family to nodes of a table [m], (depths, distances)."""
    launches, plane = source.rays.launch_angles(source.source_depth), source.rays.layers.bottom_reflection_depth
    distance = np.maximum(ranges, LEAST_DISTANCE)
    above = np.minimum(depths, plane) if last_boundary(name) == "bottom" else depths
    climbs = np.asarray(
        launches.launch_slope(name, distance, np.repeat(above[:, None], len(ranges), 1)) * distance, float
    )
    below = above < depths  # no ray that rises from the plane, but neighbours above it are interpolated
    if below.any():
        height = min(DEPTH_SPACINGS[0], plane - float(depths[0]))
        climb_above, climb_at_plane = (
            launches.launch_slope(name, distance, np.full((1, len(ranges)), depth)) * distance
            for depth in (plane - height, plane)
        )
        slope = (depths[below, None] - plane) / max(height, 1e-9)
        climbs[below] = climb_at_plane + slope * (climb_at_plane - climb_above)
    return climbs


def _agrees(
    source: RaysFromDepth, families: tuple[str, ...], table: RefractionTable, span: tuple[float, float],
    farthest: float, max_path_error: float,
) -> bool:  # fmt: skip
    """Return True if a table agrees with the rays to random points.

    Args:
        source: Rays from the depth of the sonar.
        families: Families of the table.
        table: The table.
        span: Least and greatest depth of the points [m].
        farthest: Largest horizontal distance of the points [m].
        max_path_error: Largest error of the delays, as path length at the sound speed of straight rays [m].
    """
    draw = np.random.default_rng(0)
    depth, distance = draw.uniform(*span, PROBES), draw.uniform(LEAST_DISTANCE, farthest, PROBES)
    columns = np.empty(PROBES * column.COUNT, np.float32)
    for f, family in enumerate(families):
        family_rays = _family_columns(source, family, depth, distance)
        if family_rays is None:
            return False
        interpolate_refraction(distance, depth, f, table, columns)
        error = np.abs(columns.reshape(PROBES, column.COUNT) - family_rays.columns)
        sines = [column.ARRIVAL, column.DEPARTURE] + [column.GRAZING] * len(bounce_sequence(family))
        if (
            (error[:, column.DELAY] * source.sound_speed > max_path_error).any()
            or (error[:, column.PRESSURE] > MAX_PRESSURE_ERROR * family_rays.columns[:, column.PRESSURE]).any()
            or (error[:, sines] > MAX_SINE_ERROR).any()
        ):
            return False
    return True
