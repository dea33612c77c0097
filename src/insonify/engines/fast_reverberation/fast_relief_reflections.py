"""Bottom bounces over relief in fast reverberation: legs reflected by planes fitted to the terrain at their bounces.

Legs are evaluated along radials with every bounce at the mean plane first, as in the keep probabilities of pairs. Over
relief, those with bottom bounces are then replaced by those of `local_plane_paths`, at the samples where any pair needs
them. Bounces of successive samples lie much closer together than their Fresnel zones are wide, so planes are fitted for
some samples only, the nodes. Between two nodes of a radial the position of the image source is interpolated linearly.
Occlusion by terrain and targets is that of the legs by the mean plane.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._fast_relief_reflections_kernel import (
    SamplesOnSegments,
    displace_refracted_legs,
    reached_samples,
    write_image_paths,
)
from insonify.engines.fast_reverberation.level_legs import bounce_ranges
from insonify.engines.fast_reverberation.reverberation_plan import ReverberationPlan
from insonify.engines.radial_tables import RadialLegs, RadialSet
from insonify.engines.relief_reflections import reflection_product
from insonify.propagation.families import bottom_bounces, bounce_sequence
from insonify.propagation.image_path_kernel import ImagePaths
from insonify.propagation.local_planes import flat_image_paths, local_plane_paths
from insonify.propagation.propagation_model import PropagationModel
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

ZONE_PART = 0.125
"""Longest distance between the bounces of successive nodes, re half the width of the first Fresnel zone [1]."""


def reflect_at_fitted_planes(
    rays: PropagationModel, terrain: SeabedTerrain, ping_geometry: PingGeometry, plan: ReverberationPlan,
    part: RadialSet, legs: RadialLegs,
) -> None:  # fmt: skip
    """Evaluate all legs with bottom bounces again, each reflected at planes fitted to the seabed at its bounces.

    Refracted legs get the differences of delay and directions between straight legs by these planes and by the mean
    seabed, and keep their reflection coefficients.

    Args:
        rays: Propagation model of the scene.
        terrain: Terrain of the seabed, which has relief.
        ping_geometry: The sonar at this ping.
        plan: The reverberation plan.
        part: The radials, s of them.
        legs: Legs to the samples of the radials, changed in place.
    """
    list_starts, beam_bearing = part.lists.list_offsets[part.list_rows], part.lists.beam_bearing
    size, position, wavelength = int(legs.radial_offsets[-1]), ping_geometry.transmit_position, ping_geometry.wavelength
    numbers = np.empty((3, size), np.int64)
    columns = SamplesOnSegments(numbers[0], numbers[1], np.empty(size), numbers[2], np.empty((size, 3)))
    for f, family in enumerate(plan.families):
        if not bottom_bounces(family):
            continue
        height = abs(terrain.depth - float(plan.table.image_depths[f]))
        spacing = _node_spacing_factor(family, float(position[2]), height, terrain.depth, wavelength), height
        count, nodes = reached_samples(position, legs.amplitude[f], legs, list_starts, beam_bearing, spacing, columns)
        if count:
            point = columns.point[:nodes]
            row, segment, fraction, listed = (column[:count] for column in columns[:4])
            samples = SamplesOnSegments(row, segment, fraction, listed, point)
            if plan.table.refraction.nodes.size:
                paths = _displaced_paths(plan, f, position, point, terrain, wavelength)
                displace_refracted_legs(position, samples, beam_bearing, paths, f, plan.table, legs)
                continue
            paths = local_plane_paths(family, position, point, terrain, wavelength)
            product = reflection_product(family, paths, terrain, wavelength, rays.scene).astype(np.complex64)
            write_image_paths(
                position, samples, beam_bearing, paths, product, 1 / rays.scene.water.sound_speed, f, plan.table, legs
            )  # fmt: skip


def _displaced_paths(
    plan: ReverberationPlan, f: int, position: Floats, point: Floats, terrain: SeabedTerrain, wavelength: float
) -> ImagePaths:
    """Straight legs of one family to points, by planes fitted where refracted rays bounce.

    Where there is no such leg, that by the mean seabed.

    Args:
        plan: The reverberation plan.
        f: Row of the family.
        position: North, east, depth of the sonar [m], (3,).
        point: North, east, depth of the points [m], (n, 3).
        terrain: Terrain of the seabed.
        wavelength: Wavelength of the sound [m].
    """
    family, distance = plan.families[f], np.hypot(*(point[:, :2] - position[:2]).T)
    ranges = bounce_ranges(plan.table.refraction, f, len(bounce_sequence(family)), distance, point[:, 2])
    paths = local_plane_paths(family, position, point, terrain, wavelength, terrain_bounce_ranges=ranges)
    missing = np.flatnonzero(~paths.is_valid)
    if len(missing):
        flat = flat_image_paths(family, position, point[missing], terrain.depth)
        for name in ("length", "departure", "arrival", "is_valid"):
            getattr(paths, name)[missing] = getattr(flat, name)
    return paths


def _node_spacing_factor(family: str, source: float, height: float, depth: float, wavelength: float) -> float:
    """Largest distance of successive nodes along a radial over the square root of the leg's length [m^0.5].

    From node to node no bounce moves by more than `ZONE_PART` of half the width of its first Fresnel zone; the last
    bottom bounce moves farthest.

    Args:
        family: Name of a family with bottom bounces.
        source: Depth of the sonar [m].
        height: Height of the sonar's image above or below the mean seabed [m].
        depth: Depth of the mean seabed [m].
        wavelength: Wavelength of the sound [m].
    """
    string = bounce_sequence(family)
    last = string.rindex("B")
    fraction = ((source if string[0] == "S" else depth - source) + last * depth) / height
    return ZONE_PART * float(np.sqrt(wavelength * (1 - fraction) / fraction))
