"""Specular points of relief: all points of a seabed at which sound is reflected from transmitter to receiver.

A path over relief is reflected where its length is stationary: at one point of a flat seabed, at several where waves of
the seabed focus. Each point has the pressure of the stationary phase, that of its tangent plane times sqrt(det H0 /
|det H|), with H the second derivatives of the path length over the relief, H0 those over the plane, and the phase +90
degrees for each negative curvature (a caustic touched). Source: stationary phase of Kirchhoff's integral, as in
Brekhovskikh & Lysanov (2003), Fundamentals of Ocean Acoustics, chapter 9 (chapter not verified; tested against the
integral). Near a caustic the curvature is held above that at which Airy's function has its value at the caustic.

In layered water the length is the travel time times the speed of the uppermost knot; a path by way of the surface goes
to the image of its end, in water with its image above the surface.
"""

from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._relief_specular_points_kernel import (
    PathEnds,
    TerrainSpline,
    nodes_of_sign_changes,
    stationary_points,
)
from insonify.engines._specular_legs_kernel import (
    FamilyRows,
    SpecularColumns,
    SpecularPoints,
    write_specular_legs,
    write_specular_points,
)
from insonify.engines.relief_reflections import NEGLIGIBLE_PRESSURE
from insonify.propagation.families import bottom_bounces, surface_bounces
from insonify.propagation.glints import leg_rows
from insonify.propagation.surface_water import SurfaceWater, image_in_surface, rays_to, surface_water
from insonify.recent_results import RecentResults
from insonify.records.legs import Legs
from insonify.scene.scene import Scene
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain_lattice import NODES_PER_WAVE, window

Floats = NDArray[np.float64]

NODES = 160
"""Largest number of nodes of the terrain along each side of the square that is searched [1]."""
SLOPES = 4.0
"""Largest slope that is searched, re the rms slope of the terrain [1]."""
MARGIN = 12
"""Number of nodes around that square, beyond which the ends of spline and low-pass filter have no effect [1]."""
SIGN_NODES = 2
"""Number of nodes to either side among which the gradient changes sign about a stationary point [1]."""
MAX_SPECULAR_POINTS = 64
"""Largest number of specular points of one path that are kept, the strongest ones [1]."""


def family_specular_points(
    legs: Legs, position: Floats, end: Floats, scene: Scene, wavelength: float,
    cache: RecentResults[SpecularPoints | None],
) -> list[SpecularPoints | None]:  # fmt: skip
    """Specular points of each row of legs to one point; None for families without just one bottom reflection.

    Args:
        legs: Legs over the mean seabed to one point, a row for each path.
        position: North, east, depth at which they begin [m], shape (3,).
        end: North, east, depth of the point [m], shape (3,).
        scene: The scene.
        wavelength: Acoustic wavelength [m].
        cache: Specular points by the ends of their path and the wavelength.
    """
    terrain, at_start = scene.seabed.terrain, float(scene.water.sound_speed_at(position[2]))
    if terrain is None or terrain.span[0] == terrain.span[1]:
        return [None] * len(legs.families)
    found: list[SpecularPoints | None] = []
    for family in legs.families:
        points = None
        if bottom_bounces(family) == 1 and (not scene.water.layered or legs.families.count(family) == 1):
            water = _water(scene, family, at_start)
            unit = wavelength * float(water.speed[0]) * water.slowness if water.depth.size else wavelength
            # by reciprocity either direction has the same points
            begin, stop = sorted(_images(family, position, end), key=tuple)
            key = begin.tobytes(), stop.tobytes(), unit
            points = cache.get(key, partial(specular_points, terrain, begin, stop, unit, water))
        found.append(points)
    return found


def with_specular_points(
    legs: Legs, points: list[SpecularPoints | None], position: Floats, end: Floats, scene: Scene, wavelength: float
) -> Legs:
    """Legs to one point with a row for each specular point of their families.

    Args:
        legs: Legs to one point, a row for each path.
        points: Specular points of each row, from `family_specular_points`; None: the row stays.
        position: North, east, depth at which they begin [m], shape (3,).
        end: North, east, depth of the point [m], shape (3,).
        scene: The scene.
        wavelength: Acoustic wavelength [m].
    """
    terrain = scene.seabed.terrain
    rows: list[int] = []
    branches: list[int] = []
    found: list[_FamilyPoints] = []
    for row, family_points in enumerate(points):
        count = 1 if family_points is None else len(family_points.length)
        if family_points is not None:
            found.append(_FamilyPoints(row, slice(len(rows), len(rows) + count), family_points))
        branches += [legs.branch[row]] if family_points is None else range(count)
        rows += [row] * count
    if terrain is None or not found:
        return legs
    result = replace(leg_rows(legs, rows), branch=tuple(branches))
    _write(result, found, legs, (position, end), scene, terrain, wavelength)
    return result


class _FamilyPoints(NamedTuple):
    """Specular points of one family of legs."""

    row: int
    """Row of the family."""
    rows: slice
    """Rows of the points."""
    points: SpecularPoints


def _water(scene: Scene, family: str, speed: float) -> SurfaceWater:
    """Water of the paths of a family; with its image above the surface if they are reflected there."""
    water = surface_water(scene, speed, False, False)
    return image_in_surface(water) if surface_bounces(family) else water


def _images(family: str, begin: Floats, stop: Floats) -> tuple[Floats, Floats]:
    """Ends of a family with one bottom reflection, or their images in the surface where it begins or ends with one."""
    upside_down = np.array([1.0, 1.0, -1.0])
    return begin * upside_down if family[0] == "S" else begin, stop * upside_down if family[-1] == "S" else stop


def _write(
    result: Legs, found: list[_FamilyPoints], legs: Legs, ends: tuple[Floats, Floats], scene: Scene,
    terrain: SeabedTerrain, wavelength: float,
) -> None:  # fmt: skip
    """Write the rows of some families between two ends."""
    families = [legs.families[one.row] for one in found]
    points = SpecularPoints(*map(np.concatenate, zip(*(one.points for one in found), strict=True)))
    sine = points.grazing_sine
    bottom = scene.seabed.reflection_coefficient_at_sine(sine) * terrain.roughness_reflection_factor(
        sine, wavelength, points.scale, residual_variance=points.residual_variance
    )
    rows = FamilyRows(
        np.array([one.rows.start for one in found]), np.array([len(one.points.length) for one in found]),
        np.array([[-1.0 if name[k] == "S" else 1.0 for k in (0, -1)] for name in families]),
        np.array([surface_bounces(name) for name in families]),
    )  # fmt: skip
    surface = complex(scene.surface.reflection_coefficient(np.zeros(1))[0])  # the same at any angle
    columns = SpecularColumns(*(getattr(result, name) for name in SpecularColumns._fields))
    write_specular_legs(points, rows, np.array(ends), bottom, surface, scene.water.sound_speed, columns)
    if scene.water.layered:
        for family, one in zip(families, found, strict=True):
            per_metre = float(np.log(legs.absorption[one.row, 0]) / legs.length[one.row, 0])
            _write_refracted(result, one, family, ends, per_metre, scene)


def _write_refracted(
    result: Legs, found: _FamilyPoints, family: str, ends: tuple[Floats, Floats], per_metre: float, scene: Scene
) -> None:
    """Write travel times, lengths, and directions at the ends, of the paths of one family in layered water."""
    _, rows, points = found
    lengths, water = np.zeros(len(points.length)), _water(scene, family, scene.water.sound_speed)
    for name, letter, end, sense in zip(
        ("departure", "arrival"), (family[0], family[-1]), _images(family, *ends), (1.0, -1.0), strict=True
    ):
        across = sense * (points.position - end)[:, :2]
        rays = rays_to(points.position, end, water)
        cosine = np.minimum(rays[:, 0] * np.interp(end[2], water.depth, water.speed) / water.speed[0], 1.0)
        horizontal = across / np.maximum(np.linalg.norm(across, axis=1), 1e-12)[:, None]
        down = sense * np.sqrt(1 - cosine**2)
        direction = np.column_stack([horizontal * cosine[:, None], -down if letter == "S" else down])
        getattr(result, name)[rows, 0] = direction
        lengths += rays[:, 4]
    result.delay[rows, 0], result.length[rows, 0] = points.length / water.speed[0], lengths
    result.absorption[rows, 0] = np.exp(per_metre * lengths)


def specular_points(
    terrain: SeabedTerrain, begin: Floats, stop: Floats, wavelength: float, water: SurfaceWater
) -> SpecularPoints | None:
    """Points of relief at which the length of the path from one position to another by the seabed is stationary.

    Args:
        terrain: The seabed.
        begin: North, east, depth at which the path begins, or its image [m], shape (3,).
        stop: North, east, depth at which it ends, or the image of that point [m], shape (3,).
        wavelength: Acoustic wavelength, in layered water at the surface [m].
        water: The water; without knots, of one sound speed.

    Returns:
        The points; None where roughness leaves a negligible coherent pressure, the terrain is unknown, or no point has
        a slope among those searched. Just beyond a caustic, on its dark side, nothing is kept.
    """
    before, after = terrain.depth - begin[2], terrain.depth - stop[2]
    middle = begin[:2] + before / (before + after) * (stop[:2] - begin[:2])
    reach = np.array([before, after])
    zone, shortest, lattice = (
        2 * np.sqrt(wavelength * reach.prod() / reach.sum()), terrain.relief.shortest_wavelength, terrain.lattice
    )  # fmt: skip
    low = np.array([max(float(zone), shortest)])
    if float(terrain.roughness_reflection_factor(np.ones(1), wavelength, low)[0]) < NEGLIGIBLE_PRESSURE:
        return None
    half = float(zone + SLOPES * lattice.rms_slope(middle, float(reach.max())) * reach.max())
    if not np.isfinite(half):
        return None
    wave = lattice.resolved_wavelength(max(float(zone), 2 * half / NODES * NODES_PER_WAVE))
    keeps_all, step = wave <= shortest, wave / NODES_PER_WAVE
    first, last = (np.floor((middle - half) / step) - MARGIN, np.ceil((middle + half) / step) + MARGIN)
    shape = (int(last[0] - first[0]) + 1, int(last[1] - first[1]) + 1)
    nodes = wave, (int(first[0]), int(first[1])), shape
    smooth, residual = lattice.long_waves(*nodes), 0.0
    if not terrain.relief.is_waves:  # which are known everywhere, and whose roughness follows from their spectrum
        depth = lattice.depth(*nodes)
        if not np.all(np.isfinite(depth)):
            return None
        if not keeps_all:
            short = depth - smooth.depth[window(smooth.first, shape)]
            residual = float(np.var(short[MARGIN:-MARGIN, MARGIN:-MARGIN]))
    spline = TerrainSpline(smooth.coefficients, float(first[0] * step), float(first[1] * step), step, *smooth.first)
    ends = PathEnds(begin, stop, water)
    positions = stationary_points(_starts(smooth.depth, shape, spline, ends), spline, ends)
    if not len(positions):
        return None
    exact_depth = terrain.depth_at(*positions.T) if keeps_all else np.empty(0)
    return _with_pressures(positions, exact_depth, spline, ends, wavelength, wave, residual)


def _starts(depth: Floats, shape: tuple[int, int], terrain: TerrainSpline, ends: PathEnds) -> Floats:
    """Nodes about which both components of the gradient of the path length pass through zero, shape (n, 2).

    A stationary point that is resolved has such nodes on all sides.
    """
    return np.asarray(nodes_of_sign_changes(depth, shape, MARGIN, terrain, ends, SIGN_NODES))


def _with_pressures(
    positions: Floats, exact_depth: Floats, terrain: TerrainSpline, ends: PathEnds, wavelength: float, scale: float,
    residual_variance: float,
) -> SpecularPoints:  # fmt: skip
    """Specular points at stationary points, the strongest first; see `write_specular_points`."""
    count = min(len(positions), MAX_SPECULAR_POINTS)
    length, focusing, sine, scales, residuals = np.empty((5, count))
    scales[:], residuals[:] = scale, residual_variance
    result = SpecularPoints(np.empty((count, 3)), length, focusing, np.empty(count, np.uint8), sine, scales, residuals)
    write_specular_points(positions, exact_depth, terrain, ends, wavelength, scale / 8, result)
    return result
