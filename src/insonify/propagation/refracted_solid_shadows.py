"""Shadows of solids in layered water: only rays that pass over a body are traced, and only over the body.

Seen from above a ray of any family is a straight line, so the bodies that it crosses there are found first. Over a
body an arc is replaced by chords, to fractions of a millimetre.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._light_buffer_kernel import LEG_END_OFFSET
from insonify.propagation._refracted_box_shadow import ray_depths_along_range
from insonify.propagation._refracted_legs_kernel import HorizontalGeometry, RefractedLegs, bodies_passed_over
from insonify.propagation.families import (
    bottom_bounces,
    bounce_sequence,
    family_bounces,
    first_boundary,
    last_boundary,
)
from insonify.propagation.solid_shadows import occluders_of_paths
from insonify.propagation.sound_speed_layers import SoundSpeedLayers
from insonify.records.legs import LegStatus
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles

Floats = NDArray[np.float64]

CHORD = 1.5
"""Longest chord in place of an arc [m]: its error is less than half a millimetre."""
STEEP = 10.0
"""Tangent of the launch angle above which a ray counts as straight [1]."""


def solid_bounds(scene: Scene) -> Floats:
    """Least, then greatest north, east and depth of each of the scene's solids [m], shape (solids, 6)."""
    surfaces = [world_triangles(solid, scene.seabed) for solid in scene.solids]
    return np.array([np.concatenate([surface.low, surface.high]) for surface in surfaces]).reshape(-1, 6)


def leg_ends(scatterers: Scatterers) -> Floats:
    """Ends of legs to scatterers, a little in front of the face on which each lies [m], shape (n, 3)."""
    return scatterers.position + LEG_END_OFFSET * scatterers.normal


def occlude_refracted_row(
    scene: Scene, water: SoundSpeedLayers, bounds: Floats, geometry: HorizontalGeometry, ends: Floats, family: str,
    legs: RefractedLegs, row: int,
) -> None:  # fmt: skip
    """Mark the clear legs of one row that solids cut.

    Args:
        scene: The scene.
        water: Layers of the water.
        bounds: Bounds from `solid_bounds`.
        geometry: The legs seen from above.
        ends: Ends of the legs, from `leg_ends` [m], (n, 3).
        family: Family of the row.
        legs: The legs; clear ones of the row may become occluded, with `occluder` set.
        row: The row.
    """
    position, distance = geometry.source, geometry.distance
    slowness, departure = legs.slowness[row], legs.departure[row]
    status, occluder = legs.status[row], legs.occluder[row]
    points, bodies, enter, leave = bodies_passed_over(position, ends, bounds, status)
    for body in np.unique(bodies):
        passes_body = bodies == body
        rows, begin, end = points[passes_body], enter[passes_body], leave[passes_body]
        longest = float(((end - begin) * distance[rows]).max())
        count = max(3, int(np.ceil(longest / CHORD)) + 1) * (3 if bottom_bounces(family) else 1)
        fraction = begin[:, None] + (end - begin)[:, None] * np.linspace(0, 1, count)
        depths = _depths(water, position, ends[rows], distance[rows], family, slowness[rows], departure[rows], fraction)
        low, high = np.fmin.reduce(depths, axis=1), np.fmax.reduce(depths, axis=1)
        overlaps = (high >= bounds[body, 2]) & (low <= bounds[body, 5])
        rows, fraction, depths = rows[overlaps], fraction[overlaps], depths[overlaps]
        paths = np.empty((len(rows), count, 3))
        paths[..., :2] = position[:2] + fraction[..., None] * (ends[rows, None, :2] - position[:2])
        paths[..., 2] = depths
        occluders = occluders_of_paths(scene, paths)
        cut = occluders >= 0
        first = np.where(status[rows] == LegStatus.OCCLUDED, np.minimum(occluder[rows], occluders), occluders)
        status[rows[cut]], occluder[rows[cut]] = LegStatus.OCCLUDED, first[cut]


def _depths(
    water: SoundSpeedLayers, position: Floats, leg_ends: Floats, ranges: Floats, family: str, slowness: Floats,
    departure: Floats, fraction: Floats,
) -> Floats:  # fmt: skip
    """Depths of rays at fractions of their horizontal distance [m], shape of `fraction`; 1 is exactly their end."""
    sequence = bounce_sequence(family)
    depths = np.empty(fraction.shape)
    ray_depths_along_range(
        water, float(position[2]), slowness, np.ascontiguousarray(departure[:, 2]), family_bounces(family),
        fraction[:, 0] * ranges, fraction[:, -1] * ranges, depths,
    )  # fmt: skip
    horizontal = np.hypot(departure[:, 0], departure[:, 1])
    steep = (np.abs(departure[:, 2]) > STEEP * horizontal) | (ranges < 1e-3)
    if steep.any():
        depths[steep] = _straight(
            water.bottom_reflection_depth, float(position[2]), leg_ends[steep, 2], sequence, fraction[steep]
        )
    depths = np.where(np.isnan(depths), leg_ends[:, 2:], depths)
    return np.where(fraction == 1, leg_ends[:, 2:], depths)


def _straight(plane: float, source_depth: float, end_depth: Floats, sequence: str, fraction: Floats) -> Floats:
    """Depths of straight rays at fractions of their distance, folded at the surface and a bottom plane [m]."""
    if not sequence:
        return source_depth + fraction * (end_depth[:, None] - source_depth)
    start, bounces = (-source_depth if first_boundary(sequence) == "surface" else source_depth), len(sequence)
    arrives_down = last_boundary(sequence) == "surface"
    # unfolded depth of the end: rays that start upwards count from the image of the sonar in the surface
    crossings = bounces - (1 if first_boundary(sequence) == "surface" else 0)
    target = crossings * plane + (end_depth if arrives_down else plane - end_depth)
    unfolded = start + fraction * (target - start)[:, None]
    return np.asarray(plane - np.abs(np.mod(unfolded, 2 * plane) - plane))
