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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._relief_specular_points_kernel import (
    COLUMNS,
    CURVATURE,
    DEPTH,
    GRAZING_SINE,
    LENGTH,
    PLANE_CURVATURE,
    SECANT,
    PathEnds,
    TerrainSpline,
    bottom_paths,
    changes_sign,
    gradients_at_nodes,
    keep_distinct,
    stationary_points,
)
from insonify.engines.relief_reflections import NEGLIGIBLE_PRESSURE
from insonify.propagation.glints import leg_rows
from insonify.propagation.surface_water import SurfaceWater, mirrored_in_surface, rays_to, surface_water
from insonify.recent_results import RecentResults
from insonify.records.legs import Legs
from insonify.scene.scene import Scene
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain_lattice import NODES_PER_WAVE

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


def with_specular_points(
    legs: Legs, position: Floats, end: Floats, scene: Scene, wavelength: float,
    cache: RecentResults[SpecularPoints | None],
) -> Legs:  # fmt: skip
    """Legs to one point with a row for each specular point of the families that reflect once off the seabed.

    Args:
        legs: Legs over relief to one point, a row for each family.
        position: North, east, depth at which they begin [m], shape (3,).
        end: North, east, depth of the point [m], shape (3,).
        scene: The scene.
        wavelength: Acoustic wavelength [m].
        cache: Specular points that have been found, by the ends of their path and the wavelength.
    """
    terrain, at_start = scene.seabed.terrain, float(scene.water.sound_speed_at(position[2]))
    rows: list[int] = []
    row_points: list[SpecularPoints | None] = []
    for row, family in enumerate(legs.families):
        points = None
        if terrain is not None and family.count("B") == 1 and (
            not scene.water.layered or legs.families.count(family) == 1):  # fmt: skip
            water = _water(scene, family, at_start)
            unit = wavelength * float(water.speed[0]) * water.slowness if water.depth.size else wavelength
            # by reciprocity either direction has the same points
            begin, stop = sorted(_images(family, position, end), key=tuple)
            key = begin.tobytes(), stop.tobytes(), unit
            points = cache.get(key, partial(specular_points, terrain, begin, stop, unit, water))
        rows += [row] * (1 if points is None else len(points.length))
        row_points.append(points)
    result = leg_rows(legs, rows)
    branches: list[int] = []
    for row, points in enumerate(row_points):
        if points is None:
            branches.append(legs.branch[row])
            continue
        at = slice(len(branches), len(branches) + len(points.length))
        _write(result, at, points, legs, row, (position, end), scene, wavelength)
        branches += range(len(points.length))
    return replace(result, branch=tuple(branches))


def _water(scene: Scene, family: str, speed: float) -> SurfaceWater:
    """Water of the paths of a family; mirrored in the surface if they are reflected there."""
    water = surface_water(scene, speed, False, False)
    return mirrored_in_surface(water) if "S" in family else water


def _images(family: str, begin: Floats, stop: Floats) -> tuple[Floats, Floats]:
    """Ends of a family with one bottom reflection, or their images in the surface where it begins or ends with one."""
    upside_down = np.array([1.0, 1.0, -1.0])
    return begin * upside_down if family[0] == "S" else begin, stop * upside_down if family[-1] == "S" else stop


def _write(
    result: Legs, rows: slice, points: SpecularPoints, legs: Legs, row: int, ends: tuple[Floats, Floats], scene: Scene,
    wavelength: float,
) -> None:  # fmt: skip
    """Write the rows of one family between two ends."""
    family, mirrored, terrain = legs.families[row], np.array([1.0, 1.0, -1.0]), scene.seabed.terrain
    assert terrain is not None
    begin, stop = _images(family, *ends)
    away, towards = points.position - begin, stop - points.position
    away /= np.linalg.norm(away, axis=1, keepdims=True)
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    rough = terrain.roughness_reflection_factor(
        points.grazing_sine, wavelength, np.full_like(points.length, points.scale),
        residual_variance=points.residual_variance,
    )  # fmt: skip
    coefficient = scene.seabed.reflection_coefficient_at_sine(points.grazing_sine) * rough
    for _ in range(family.count("S")):
        coefficient = coefficient * scene.surface.reflection_coefficient(points.grazing_sine)
    per_metre = np.log(legs.absorption[row, 0]) / legs.length[row, 0]
    columns = {
        "delay": points.length / scene.water.sound_speed, "length": points.length,
        "spreading": points.focusing / points.length, "absorption": np.exp(per_metre * points.length),
        "reflection_coefficient": coefficient * 1j**points.caustics, "caustics": points.caustics,
        "departure": away * mirrored if family[0] == "S" else away,
        "arrival": towards * mirrored if family[-1] == "S" else towards,
    }  # fmt: skip
    for name, column in columns.items():
        getattr(result, name)[rows, 0] = column
    if scene.water.layered:
        water = _water(scene, family, scene.water.sound_speed)
        _write_refracted(result, rows, points, (begin, stop), per_metre, water)
        for name, letter in (("departure", family[0]), ("arrival", family[-1])):
            if letter == "S":
                getattr(result, name)[rows, 0] *= mirrored


def _write_refracted(
    result: Legs,
    rows: slice,
    points: SpecularPoints,
    ends: tuple[Floats, Floats],
    per_metre: float,
    water: SurfaceWater,
) -> None:
    """Write travel times, lengths, and directions at the ends or their images, of paths in layered water."""
    lengths = np.zeros(len(points.length))
    for name, end, sense in (("departure", ends[0], 1.0), ("arrival", ends[1], -1.0)):
        across = sense * (points.position - end)[:, :2]
        rays = rays_to(points.position, end, water)
        cosine = np.minimum(rays[:, 0] * np.interp(end[2], water.depth, water.speed) / water.speed[0], 1.0)
        horizontal = across / np.maximum(np.linalg.norm(across, axis=1), 1e-12)[:, None]
        getattr(result, name)[rows, 0] = np.column_stack([horizontal * cosine[:, None], sense * np.sqrt(1 - cosine**2)])
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
    first = np.floor((middle - half) / step).astype(int) - MARGIN
    size = np.ceil((middle + half) / step).astype(int) + MARGIN + 1 - first
    nodes = wave, tuple(first.tolist()), tuple(size.tolist())
    smooth, residual = lattice.long_waves(*nodes), 0.0
    if not terrain.relief.is_waves:  # which are known everywhere, and whose roughness follows from their spectrum
        depth = lattice.depth(*nodes)
        if not np.all(np.isfinite(depth)):
            return None
        residual = 0.0 if keeps_all else float(np.var((depth - smooth.depth)[MARGIN:-MARGIN, MARGIN:-MARGIN]))
    spline = TerrainSpline(smooth.coefficients, float(first[0] * step), float(first[1] * step), float(step))
    ends = PathEnds(begin, stop, water)
    positions = _stationary(_starts(smooth.depth, spline, ends), spline, ends)
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


def _paths(terrain: TerrainSpline, positions: Floats, ends: PathEnds) -> Floats:
    """Columns of `bottom_paths` of paths by positions (n, 2), shape (n, COLUMNS)."""
    rows = np.empty((len(positions), COLUMNS))
    bottom_paths(np.ascontiguousarray(positions), terrain, ends, rows)
    return rows


def _matrices(rows: Floats, first: int) -> Floats:
    """Symmetric matrices from columns of their elements north-north, north-east, east-east, shape (n, 2, 2)."""
    return rows[:, [first, first + 1, first + 1, first + 2]].reshape(-1, 2, 2)


def _starts(depth: Floats, terrain: TerrainSpline, ends: PathEnds) -> Floats:
    """Nodes about which both components of the gradient of the path length pass through zero, shape (n, 2).

    A stationary point that is resolved has such nodes on all sides.
    """
    size = depth.shape[0] - 2 * MARGIN, depth.shape[1] - 2 * MARGIN
    gradient, is_start = np.empty((2, *size)), np.empty(size, bool)
    gradients_at_nodes(depth, MARGIN, terrain, ends, gradient)
    changes_sign(gradient, SIGN_NODES, is_start)
    return np.array([terrain.north, terrain.east]) + (np.argwhere(is_start) + MARGIN) * terrain.step


def _stationary(starts: Floats, terrain: TerrainSpline, ends: PathEnds) -> Floats:
    """Stationary points of the path length, each once, from starts a step apart, shape (n, 2)."""
    positions, converged = starts.copy(), np.empty(len(starts), bool)
    stationary_points(positions, terrain, ends, converged)
    return positions[: keep_distinct(positions, converged, terrain.step / 20)]


def _at(
    terrain: TerrainSpline, positions: Floats, ends: PathEnds, wavelength: float, scale: float, residual: float
) -> SpecularPoints:
    """Pressure of the path by each stationary point, the strongest first."""
    rows, water = _paths(terrain, positions, ends), ends.water
    length, sine, depth, plane = *rows.T[[LENGTH, GRAZING_SINE, DEPTH]], _matrices(rows, PLANE_CURVATURE)
    value, vector = np.linalg.eigh(_matrices(rows, CURVATURE))
    wavenumber, step = 2 * np.pi / wavelength, scale / 8
    for axis in range(2):
        along = vector[:, :, axis]
        moved = (_paths(terrain, positions + side * step * along, ends) for side in (-1, 1))
        bends = [np.einsum("na,nab,nb->n", along, _matrices(path_columns, CURVATURE), along) for path_columns in moved]
        third = np.abs(bends[1] - bends[0]) / (2 * step)
        min_curvature = AIRY * third ** (2 / 3) * wavenumber ** (-1 / 3)
        value[:, axis] = np.where(value[:, axis] < 0, -1, 1) * np.maximum(np.abs(value[:, axis]), min_curvature)
    focusing = np.sqrt(np.linalg.det(plane) / np.maximum(np.abs(value.prod(axis=1)), 1e-12))
    points = np.column_stack([positions, depth])
    if water.depth.size:  # Kirchhoff's integral: cosine / (d1 d2 sqrt |det H|), with d spreading distances
        spreading_distance = [rays_to(points, end, water)[:, 5] for end in (ends.begin, ends.stop)]
        spreading = spreading_distance[0] * spreading_distance[1] * np.sqrt(np.linalg.det(plane))
        focusing *= length * sine * rows[:, SECANT] / spreading
        sine = sine * np.interp(depth, water.depth, water.speed) / water.speed[0]
    order = np.argsort(-focusing / length, kind="stable")[:MAX_SPECULAR_POINTS]
    return SpecularPoints(
        points[order], length[order], focusing[order], np.sum(value[order] < 0, axis=1).astype(np.uint8), sine[order],
        scale, residual,
    )  # fmt: skip
