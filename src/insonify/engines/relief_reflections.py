"""Bottom bounces over relief: legs reflected by planes fitted to the terrain at their bounces.

Straight rays are reflected exactly by the fitted planes, and tested for occlusion segment by segment, each from its
own image source. Refracted rays keep their occlusion and refraction; they are displaced by the change that the same
planes, fitted at the refracted ray's bounces, cause in straight rays.
"""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines._relief_reflections_kernel import (
    BouncedLegs,
    ReflectedPaths,
    set_path_nodes,
    write_bounced_legs,
)
from insonify.engines.terrain_occlusion import (
    LegOcclusion,
    TerrainOcclusion,
    launch_slope,
    locate_points,
    occlude_by_terrain,
    write_terrain_occlusion,
)
from insonify.propagation.families import bottom_bounces, bounce_sequence
from insonify.propagation.glints import leg_rows, update_grazing
from insonify.propagation.image_path_kernel import ImagePaths
from insonify.propagation.launch_angles import StraightLaunchAngles
from insonify.propagation.local_planes import (
    BounceGeometry,
    flat_bounces,
    flat_image_paths,
    fresnel_zone,
    local_plane_paths,
)
from insonify.records.legs import Legs, LegStatus
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.seabed_terrain import SeabedTerrain

Floats = NDArray[np.floating[Any]]

NEGLIGIBLE_PRESSURE = 3e-4
"""Coherent reflection factor of all bounces, for pressure, below which a leg is not followed [1]: -70 dB."""
_LENGTH_PARTS = np.linspace(0.0, 1.0, 17) ** 2
"""Edges of the intervals of length, 0 at the shortest and 1 at the longest leg of a family [1], see `_may_be_weak`."""


def reflect_off_relief(
    legs: Legs, scatterers: Scatterers, position: NDArray[np.float64], terrain_occlusion: TerrainOcclusion,
    scene: Scene, *, soft: bool = False, needed: NDArray[np.bool_] | None = None,
) -> Legs:  # fmt: skip
    """Legs over relief: reflected by fitted planes, reduced by roughness, and occluded by the seabed.

    Args:
        legs: Legs over the mean seabed; their columns are overwritten.
        scatterers: The points that they reach.
        position: North, east, depth of transmitter or receiver [m], shape (3,).
        terrain_occlusion: Occlusion by the seabed for that end.
        scene: The scene; its bed has relief.
        soft: See `occlude_by_terrain`; legs reflected at local planes have hard shadows.
        needed: True for the legs with bottom bounces to evaluate, shape (f, n); others get reflection coefficient 0.
            None: all.

    Returns:
        The same rows. Over a relief of height 0 they are bit-identical.
    """
    low, high = terrain_occlusion.bed.span
    bounced = [row for row, family in enumerate(legs.families) if bottom_bounces(family)] if high > low else []
    if not bounced:
        return occlude_by_terrain(legs, scatterers, position, terrain_occlusion, soft=soft)
    if not isinstance(terrain_occlusion.launches, StraightLaunchAngles):
        if needed is not None:
            return _reflect_needed(legs, bounced, needed, scatterers, position, terrain_occlusion, scene, soft=soft)
        shaded = occlude_by_terrain(legs, scatterers, position, terrain_occlusion, soft=soft)
        return _displace_refracted(shaded, bounced, legs, scatterers, position, terrain_occlusion, scene)
    reflected = _without_bottom_bounces(legs, bounced, scatterers, position, terrain_occlusion, soft=soft)
    for row in bounced:
        points = np.flatnonzero(needed[row]) if needed is not None else np.arange(len(scatterers))
        followed = points
        if scene.seabed.reflecting_interface == "smooth":
            followed = points[~_negligible(reflected, row, points, position, terrain_occlusion)]
        reflected.reflection_coefficient[row] = 0.0
        if len(followed):
            _write_bounced(reflected, row, followed, scatterers, position, terrain_occlusion, scene, soft=soft)
    return reflected


def _without_bottom_bounces(
    legs: Legs, bounced: list[int], scatterers: Scatterers, position: NDArray[np.float64],
    terrain_occlusion: TerrainOcclusion, *, soft: bool,
) -> Legs:  # fmt: skip
    """Legs of which those without bottom bounces are occluded by the seabed; rows `bounced` are unchanged."""
    result = replace(legs, visibility=np.empty(legs.delay.shape, complex)) if soft else legs
    for row in bounced:
        result.visibility[row] = legs.visibility[row]
    unbounced = [row for row in range(len(legs.families)) if row not in bounced]
    if not unbounced:
        return result
    if unbounced == list(range(len(unbounced))):
        views = LegOcclusion(*(getattr(result, name)[: len(unbounced)] for name in LegOcclusion._fields))
        write_terrain_occlusion(
            legs.first_rows(len(unbounced)), views, scatterers, position, terrain_occlusion, soft=soft
        )
    else:
        occluded = occlude_by_terrain(leg_rows(legs, unbounced), scatterers, position, terrain_occlusion, soft=soft)
        for name in LegOcclusion._fields:
            getattr(result, name)[unbounced] = getattr(occluded, name)
    return result


def _negligible(
    legs: Legs, row: int, points: NDArray[np.int64], position: NDArray[np.float64], terrain_occlusion: TerrainOcclusion
) -> NDArray[np.bool_]:
    """True for legs of one family that are too weak to be followed, by the mean seabed, shape of `points`."""
    family, terrain, wavelength = legs.families[row], terrain_occlusion.bed, terrain_occlusion.wavelength
    length, sine = legs.length[row, points], np.abs(legs.departure[row, points, 2])
    if not _may_be_weak(family, length, sine, terrain_occlusion):
        return np.zeros(len(points), bool)
    paths = flat_bounces(family, float(position[2]), length, sine, terrain.depth)
    return coherent_bounce_factor(family, paths, terrain, wavelength) < NEGLIGIBLE_PRESSURE


def _write_bounced(
    legs: Legs, row: int, rows: NDArray[np.int64], scatterers: Scatterers, position: NDArray[np.float64],
    terrain_occlusion: TerrainOcclusion, scene: Scene, *, soft: bool,
) -> None:  # fmt: skip
    """Replace some straight legs of one family by legs reflected at local planes."""
    family, points = legs.families[row], scatterers.position[rows]
    paths = local_plane_paths(family, position, points, terrain_occlusion.bed, terrain_occlusion.wavelength)
    reflection = reflection_product(family, paths, terrain_occlusion.bed, terrain_occlusion.wavelength, scene)
    per_metre = np.log(legs.absorption[row, rows[0]]) / legs.length[row, rows[0]]
    path_loss = np.exp(per_metre * paths.length)
    clear = clear_of_terrain(paths, position, points, terrain_occlusion, on_terrain=scatterers.boundary == "seabed")
    written = BouncedLegs(*(getattr(legs, name)[row] for name in BouncedLegs._fields))
    reflected = ReflectedPaths(paths, reflection, path_loss, clear)
    write_bounced_legs(written, rows, reflected, scatterers.normal, 1 / scene.water.sound_speed, soft)


def _may_be_weak(
    family: str, length: NDArray[np.float64], sine: NDArray[np.float64], terrain_occlusion: TerrainOcclusion
) -> bool:
    """Return True if roughness may leave a negligible part of any leg.

    Legs are divided by length; of each interval the widest zone and the steepest bounce are evaluated together.

    Args:
        family: Name of the family.
        length: Path lengths [m], shape (n,).
        sine: Sines of the grazing angles at the mean seabed [1], shape (n,).
        terrain_occlusion: Holds the terrain and the wavelength.
    """
    if not len(length):
        return False
    climb, shortest, longest = length * sine, float(length.min()), float(length.max())
    edges = shortest + (1 + 1e-12) * (longest - shortest) * _LENGTH_PARTS
    steepest = np.minimum(float(climb.max()) / edges[:-1], float(sine.max()))
    # the square root of the wavelength times the length, over that of the sine
    widest = edges[1:] * math.sqrt(terrain_occlusion.wavelength / max(float(climb.min()), 1e-9))
    once = terrain_occlusion.bed.roughness_reflection_factor(steepest, terrain_occlusion.wavelength, widest)
    return bool(once.min() ** bottom_bounces(family) < NEGLIGIBLE_PRESSURE)


def reflection_product(
    family: str, paths: ImagePaths, terrain: SeabedTerrain, wavelength: float, scene: Scene
) -> NDArray[np.complex128]:
    """Product of the complex coherent reflection factors of a family [1], shape (n,).

    Each bottom bounce has the seabed's coefficient at its grazing angle with the fitted plane, times
    exp(-2 k^2 h^2 sin^2), h the rms height of the roughness between the lengths of the Fresnel zone and of the acoustic
    wave, see `SeabedTerrain.roughness_reflection_factor`. The energy lost is not reflected coherently. Where the
    reflecting interface of the seabed is rough, glints have that factor and the energy lost.

    Args:
        family: Name of the family.
        paths: Its paths.
        terrain: The seabed.
        wavelength: Acoustic wavelength [m].
        scene: The scene.
    """
    coherent: NDArray[np.float64] | float = 1.0
    if scene.seabed.reflecting_interface == "smooth" or not terrain.relief.is_waves:
        coherent = coherent_bounce_factor(family, paths, terrain, wavelength)
    coefficient = 1 + 0j
    product: NDArray[np.complex128] | complex = 1.0
    for k, letter in enumerate(bounce_sequence(family)):
        if letter == "B":
            product = product * scene.seabed.reflection_coefficient_at_sine(paths.grazing_sine[k])
        else:
            coefficient *= complex(scene.surface.reflection_coefficient(np.zeros(1))[0])  # the same at any angle
    return np.asarray(coherent * coefficient * product)


def coherent_bounce_factor(
    family: str, paths: ImagePaths | BounceGeometry, terrain: SeabedTerrain, wavelength: float
) -> NDArray[np.float64]:
    """Coherent reflection factor of all bottom bounces of a family [1], shape (n,).

    Args:
        family: Name of the family.
        paths: Its paths.
        terrain: The seabed.
        wavelength: Acoustic wavelength [m].
    """
    product = np.ones(len(paths.length))
    for k, letter in enumerate(bounce_sequence(family)):
        if letter == "B":
            half_length, half_width = fresnel_zone(paths, k, wavelength)
            zone_size = np.maximum(2 * np.sqrt(half_length * half_width), 1e-6)
            product *= terrain.roughness_reflection_factor(
                paths.grazing_sine[k], wavelength, zone_size, residual_variance=paths.residual_variance[k]
            )
    return product


def relief_roughness_factor(
    legs: Legs, position: NDArray[np.float64], terrain: SeabedTerrain, wavelength: float, bed_depth: float
) -> NDArray[np.float64]:
    """Factor of relief's roughness on the coherent pressure of all bottom bounces at its mean plane [1], shape (f, n).

    Args:
        legs: Legs between the position and n points.
        position: North, east, depth of that end [m], shape (3,).
        terrain: The seabed.
        wavelength: Acoustic wavelength [m].
        bed_depth: Depth of the mean seabed below the boundary from which the position's depth counts [m].
    """
    factor = np.ones_like(legs.delay)
    for row, family in enumerate(legs.families):
        if bottom_bounces(family):
            sine = np.abs(legs.departure[row, :, 2])
            paths = flat_bounces(family, float(position[2]), legs.length[row], sine, bed_depth)
            factor[row] = coherent_bounce_factor(family, paths, terrain, wavelength)
    return factor


def clear_of_terrain(
    paths: ImagePaths, position: NDArray[np.float64], points: NDArray[np.float64], terrain_occlusion: TerrainOcclusion,
    *, on_terrain: bool,
) -> NDArray[np.bool_]:  # fmt: skip
    """Return True for paths reflected at local planes that exist and no other part of the seabed cuts, shape (n,).

    They are tested in the vertical plane through sonar and point: planes tilted across it displace the path by less
    than a cell of the terrain map.

    Args:
        paths: The paths.
        position: North, east, depth of transmitter or receiver [m], shape (3,).
        points: North, east, depth of the points [m], shape (n, 3).
        terrain_occlusion: The seabed about that end.
        on_terrain: True if the points lie on it.
    """
    profiled = locate_points(terrain_occlusion, position, points)
    count, n = paths.fraction.shape
    nodes, bounce_margin = np.empty((count + 2, n, 2)), np.empty((count + 2, n))
    set_path_nodes(paths, position, points, profiled.distance, terrain_occlusion.wavelength, nodes, bounce_margin)
    return paths.is_valid & terrain_occlusion.image_paths_clear(
        profiled.groups, nodes, bounce_margin, on_terrain=on_terrain
    )


def _reflect_needed(
    legs: Legs, bounced: list[int], needed: NDArray[np.bool_], scatterers: Scatterers, position: NDArray[np.float64],
    terrain_occlusion: TerrainOcclusion, scene: Scene, *, soft: bool,
) -> Legs:  # fmt: skip
    """Refracted legs, of which those with bottom bounces are evaluated at some points each, family by family."""
    result = _without_bottom_bounces(legs, bounced, scatterers, position, terrain_occlusion, soft=soft)
    for family in dict.fromkeys(legs.families[row] for row in bounced):
        rows = [row for row in bounced if legs.families[row] == family]
        points = np.flatnonzero(needed[rows[0]])
        selected = leg_rows(legs, rows, points)  # before the rows, which both sets share, are cleared
        result.reflection_coefficient[rows] = 0.0
        if len(points):
            ends = scatterers.take(points)
            shaded = occlude_by_terrain(selected, ends, position, terrain_occlusion, soft=soft)
            every = list(range(len(rows)))
            moved = _displace_refracted(shaded, every, selected, ends, position, terrain_occlusion, scene)
            for name in (*_COPIED_COLUMNS, "reflection_coefficient", "occluder"):
                getattr(result, name)[np.array(rows)[:, None], points] = getattr(moved, name)
    return result


def _displace_refracted(
    legs: Legs, bounced: list[int], unbounced: Legs, scatterers: Scatterers, position: NDArray[np.float64],
    terrain_occlusion: TerrainOcclusion, scene: Scene,
) -> Legs:  # fmt: skip
    """Refracted legs over the mean seabed, changed as local planes change straight ones.

    To first order a plane that is h higher at a bounce shortens a leg by 2 h sin(grazing) in any water: the straight
    path's change is multiplied by the ratio of the sines.
    """
    displaced = replace(legs, **{name: getattr(legs, name).copy() for name in _COPIED_COLUMNS})
    north, east = (scatterers.position[:, :2] - position[:2]).T
    distance, speed = np.hypot(north, east), float(scene.water.sound_speed_at(terrain_occlusion.bed.depth))
    for row in bounced:
        family = displaced.families[row]
        slope = launch_slope(family, unbounced.departure[row, :, 2])
        ranges = np.array(
            [np.clip(at, 0.0, distance) for at in terrain_occlusion.launches.bounce_ranges(family, slope)]
        )
        flat = flat_image_paths(family, position, scatterers.position, terrain_occlusion.bed.depth)
        local = local_plane_paths(
            family, position, scatterers.position, terrain_occlusion.bed, terrain_occlusion.wavelength,
            terrain_bounce_ranges=ranges,
        )  # fmt: skip
        tangent = terrain_occlusion.launches.bottom_grazing_tangent(slope)
        sine = tangent / np.hypot(1, tangent)
        flat_sine = flat.grazing_sine[bounce_sequence(family).index("B")]
        with np.errstate(invalid="ignore"):
            excess = (local.length - flat.length) * sine / np.maximum(flat_sine, 1e-9)
        is_displaced = (displaced.status[row] <= LegStatus.OCCLUDED) & local.is_valid & np.isfinite(excess)
        excess = np.where(is_displaced, excess, 0.0)
        displaced.delay[row] += excess / speed
        displaced.absorption[row] **= 1 + excess / displaced.length[row]
        displaced.spreading[row] *= displaced.length[row] / (displaced.length[row] + excess)
        displaced.length[row] += excess
        for column, local_direction, flat_direction in ((displaced.departure, local.departure, flat.departure),
                                 (displaced.arrival, local.arrival, flat.arrival)):  # fmt: skip
            turned = column[row] + np.where(is_displaced[:, None], local_direction - flat_direction, 0.0)
            column[row] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
        update_grazing(displaced, row, scatterers.normal)
    return displaced


_COPIED_COLUMNS = (
    "delay", "length", "spreading", "absorption", "departure", "arrival", "grazing_sine", "status", "visibility",
)  # fmt: skip
