"""Specular points of relief: all points of a seabed at which sound is reflected from transmitter to receiver.

A path over relief is reflected where its length is stationary: at one point of a flat seabed, at several where waves of
the seabed focus. Each point has the pressure of the stationary phase, that of its tangent plane times sqrt(det H0 /
|det H|), with H the second derivatives of the path length over the relief, H0 those over the plane, and the phase +90
degrees for each negative curvature (a caustic touched). Source: stationary phase of Kirchhoff's integral, as in
Brekhovskikh & Lysanov (2003), Fundamentals of Ocean Acoustics, chapter 9 (chapter from memory; tested against the
integral). Near a caustic the curvature is held above that at which Airy's function has its value at the caustic.

In layered water the length is the travel time times the speed of the uppermost knot; a path by way of the surface goes
to the image of its end, in water that is mirrored in the surface.
"""

from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._relief_specular_points_kernel import (
    GRAZING_SINE,
    LENGTH,
    PLANE_HESSIAN,
    SECANT,
    PathEnds,
    TerrainSpline,
    nodes_of_sign_changes,
    paths_with_curvature,
    stationary_points,
)
from insonify.engines.relief_reflections import NEGLIGIBLE_PRESSURE
from insonify.propagation.glints import leg_rows
from insonify.propagation.surface_water import SurfaceWater, mirrored_in_surface, rays_to, surface_water
from insonify.recent_results import RecentResults
from insonify.records.legs import Legs
from insonify.scene.scene import Scene
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain_lattice import NODES_PER_WAVE, window

Floats = NDArray[np.float64]

NODES = 160
"""Nodes of the ground along each side of the square that is searched, at most [1]."""
SLOPES = 4.0
"""Slopes that are searched, in rms slopes of the ground [1]."""
MARGIN = 12
"""Nodes of the ground around that square, beyond which the ends of spline and low-pass have no effect [1]."""
SIGN_NODES = 2
"""Nodes to either side among which the gradient changes sign about a stationary point [1]."""
MAX_SPECULAR_POINTS = 64
"""Points of one path that are kept, the strongest [1]."""
AIRY = 0.795
"""Curvature at a caustic whose stationary phase equals Airy's Ai(0), over k^(-1/3) c^(2/3), c the third derivative of
the path length: 2 pi / (2 pi Ai(0))^2 / 2^(2/3) [1]."""


class SpecularPoints(NamedTuple):
    """Specular points of one family, n of them, the strongest first."""

    position: Floats
    """North, east, depth [m], shape (n, 3)."""
    length: Floats
    """Path length, in layered water the travel time times the speed of its uppermost knot [m], shape (n,)."""
    focusing: Floats
    """Pressure re 1 m times `length` [1], shape (n,): in water of one speed, pressure re that off the tangent plane."""
    caustics: NDArray[np.uint8]
    """Caustics touched [1], shape (n,)."""
    grazing_sine: Floats
    """Sine of the grazing angle at the ground [1], shape (n,)."""
    scale: float
    """Length of the waves of the seabed below which they are left to the coherent loss [m]."""
    residual_variance: float
    """Mean square of the ground that the search leaves out [m^2]; 0 of waves, whose spectrum is known."""


def family_specular_points(
    legs: Legs, position: Floats, end: Floats, scene: Scene, wavelength: float,
    cache: RecentResults[SpecularPoints | None],
) -> list[SpecularPoints | None]:  # fmt: skip
    """Specular points of each row of legs to one point; None for families that do not reflect once off relief.

    Args:
        legs: Legs over the mean plane to one point, a row for each path.
        position: North, east, depth at which they begin [m], shape (3,).
        end: North, east, depth of the point [m], shape (3,).
        scene: The scene.
        wavelength: Acoustic wavelength [m].
        cache: Specular points that have been found, by the ends of their path and the wavelength.
    """
    terrain, at_start = scene.seabed.terrain, float(scene.water.sound_speed_at(position[2]))
    if terrain is None or terrain.span[0] == terrain.span[1]:
        return [None] * len(legs.families)
    found: list[SpecularPoints | None] = []
    for family in legs.families:
        points = None
        if family.count("B") == 1 and (not scene.water.layered or legs.families.count(family) == 1):
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
    """Water of the paths of a family; mirrored in the surface if they are reflected there."""
    water = surface_water(scene, speed, False, False)
    return mirrored_in_surface(water) if "S" in family else water


def _images(family: str, begin: Floats, stop: Floats) -> tuple[Floats, Floats]:
    """Ends of a family with one bottom reflection, or their images in the surface where it begins or ends with one."""
    upside_down = np.array([1.0, 1.0, -1.0])
    return begin * upside_down if family[0] == "S" else begin, stop * upside_down if family[-1] == "S" else stop


def _write(
    result: Legs, found: list[_FamilyPoints], legs: Legs, ends: tuple[Floats, Floats], scene: Scene,
    terrain: SeabedTerrain, wavelength: float,
) -> None:  # fmt: skip
    """Write the rows of some families between two ends."""
    families, counts = [legs.families[one.row] for one in found], [len(one.points.length) for one in found]

    def joined(name: str) -> NDArray[Any]:
        return np.concatenate([getattr(one.points, name) for one in found])

    def repeated(values: list[Any]) -> NDArray[Any]:
        return np.repeat(np.array(values), counts, axis=0)

    at, length, sine, caustics = (joined(name) for name in ("position", "length", "grazing_sine", "caustics"))
    first, last = (repeated([[1, 1, -1 if family[k] == "S" else 1] for family in families]) for k in (0, -1))
    away, towards = at - ends[0] * first, ends[1] * last - at
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    coefficient = scene.seabed.reflection_coefficient_at_sine(sine) * terrain.roughness_reflection_factor(
        sine, wavelength, repeated([one.points.scale for one in found]),
        residual_variance=repeated([one.points.residual_variance for one in found]),
    )  # fmt: skip
    surface, reflections = scene.surface.reflection_coefficient(sine), repeated([name.count("S") for name in families])
    for number in range(reflections.max()):
        coefficient = np.where(reflections > number, coefficient * surface, coefficient)
    row = repeated([one.row for one in found])
    per_metre = np.log(legs.absorption[row, 0]) / legs.length[row, 0]
    columns = {
        "delay": length / scene.water.sound_speed, "length": length, "spreading": joined("focusing") / length,
        "absorption": np.exp(per_metre * length), "reflection_coefficient": coefficient * 1j**caustics,
        "caustics": caustics, "departure": away * first, "arrival": towards * last,
    }  # fmt: skip
    rows = np.concatenate([np.arange(one.rows.start, one.rows.stop) for one in found])
    for name, column in columns.items():
        getattr(result, name)[rows, 0] = column
    if scene.water.layered:
        for family, one in zip(families, found, strict=True):
            _write_refracted(result, one, family, ends, float(per_metre[row == one.row][0]), scene)


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
    """Points of relief at which the length of the path from one position to another by the ground is stationary.

    Args:
        terrain: The seabed.
        begin: North, east, depth at which the path begins, or its image [m], shape (3,).
        stop: The same of its end [m], shape (3,).
        wavelength: Acoustic wavelength, in layered water at the surface [m].
        water: The water; without knots, of one sound speed.

    Returns:
        The points; None where roughness leaves nothing coherent, the ground is unknown, or none is found within the
        slopes that are searched. Just beyond a caustic, on its dark side, nothing is kept.
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
    points = _at(spline, positions, ends, wavelength, wave, residual)
    if not keeps_all:
        return points
    exact = np.column_stack([points.position[:, :2], terrain.depth_at(*points.position[:, :2].T)])
    # stationary: to second order
    if water.depth.size:
        length = rays_to(exact, begin, water)[:, 3] + rays_to(exact, stop, water)[:, 3]
    else:
        length = np.linalg.norm(exact - begin, axis=1) + np.linalg.norm(exact - stop, axis=1)
    return points._replace(position=exact, length=length)


def _starts(depth: Floats, shape: tuple[int, int], terrain: TerrainSpline, ends: PathEnds) -> Floats:
    """Nodes about which both components of the gradient of the path length pass through zero, shape (n, 2).

    A stationary point that is resolved has such nodes on all sides.
    """
    return np.asarray(nodes_of_sign_changes(depth, shape, MARGIN, terrain, ends, SIGN_NODES))


def _at(
    terrain: TerrainSpline, positions: Floats, ends: PathEnds, wavelength: float, scale: float, residual: float
) -> SpecularPoints:
    """Pressure of the path by each stationary point, the strongest first."""
    wavenumber, reach, water = 2 * np.pi / wavelength, scale / 8, ends.water
    points, rows, curvature, change = paths_with_curvature(positions, terrain, ends, reach)
    length, sine = rows[:, LENGTH], rows[:, GRAZING_SINE]
    plane = np.linalg.det(rows[:, [PLANE_HESSIAN + k for k in (0, 1, 1, 2)]].reshape(-1, 2, 2))
    min_curvature = AIRY * (np.abs(change) / (2 * reach)) ** (2 / 3) * wavenumber ** (-1 / 3)
    value = np.where(curvature < 0, -1, 1) * np.maximum(np.abs(curvature), min_curvature)
    focusing = np.sqrt(plane / np.maximum(np.abs(value[:, 0] * value[:, 1]), 1e-12))
    if water.depth.size:  # Kirchhoff's integral: cosine / (d1 d2 sqrt |det H|), with d spreading distances
        spreading_distance = [rays_to(points, end, water)[:, 5] for end in (ends.begin, ends.stop)]
        spreading = spreading_distance[0] * spreading_distance[1] * np.sqrt(plane)
        focusing *= length * sine * rows[:, SECANT] / spreading
        sine = sine * np.interp(points[:, 2], water.depth, water.speed) / water.speed[0]
    order = np.argsort(-focusing / length, kind="stable")[:MAX_SPECULAR_POINTS]
    return SpecularPoints(
        points[order], length[order], focusing[order], np.sum(value[order] < 0, axis=1).astype(np.uint8), sine[order],
        scale, residual,
    )  # fmt: skip
