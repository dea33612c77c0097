"""Bottom bounces over relief in fast reverberation: legs reflected by planes fitted to the terrain at their bounces.

Along radials, every bounce is a reflection at the mean plane, as in the keep probabilities of pairs. Over relief, legs
with bottom bounces are replaced by those of `local_plane_paths` at the samples where any pair requests them. Bounces of
successive samples lie much closer together than their Fresnel zones are wide, so planes are fitted for some samples
only, the nodes. Between two nodes of a radial the image of the sonar in the planes is linear. Occlusion by terrain and
targets remains that over the mean plane.
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
from insonify.propagation.families import bounce_sequence
from insonify.propagation.image_path_kernel import ImagePaths
from insonify.propagation.local_planes import flat_image_paths, local_plane_paths
from insonify.propagation.propagation_model import PropagationModel
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

ZONE_PART = 0.125
"""Longest distance between the bounces of successive nodes, re the half width of the Fresnel zone [1]."""


def bounce_off_relief(
    rays: PropagationModel, terrain: SeabedTerrain, ping_geometry: PingGeometry, plan: ReverberationPlan,
    part: RadialSet, legs: RadialLegs,
) -> None:  # fmt: skip
    """Replace the legs with bottom bounces of some radials by legs off planes fitted to the seabed at each bounce.

    Refracted legs are moved by what these planes change in straight ones.

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
        if "B" not in family:
            continue
        height = abs(terrain.depth - float(plan.table.image_depths[f]))
        spacing = _node_spacing(family, float(position[2]), height, terrain.depth, wavelength), height
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
    """Straight paths of one family to points, off planes fitted where refracted rays bounce.

    Where there is no such path, that off the mean seabed.

    Args:
        plan: The reverberation plan.
        f: Row of the family.
        position: North, east, depth of the sonar [m], (3,).
        point: The same of the points [m], (n, 3).
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


def _node_spacing(family: str, source: float, height: float, depth: float, wavelength: float) -> float:
    """Longest segment along a radial over the root of the leg's length [m^0.5].

    Within a segment no bounce moves by more than `ZONE_PART` of the half width of its first Fresnel zone.

    Args:
        family: Name of a family with bottom bounces.
        source: Depth of the sonar [m].
        height: Height of its image above or below the mean seabed [m].
        depth: Depth of the mean seabed [m].
        wavelength: Wavelength of the sound [m].
    """
    string = bounce_sequence(family)
    last = string.rindex("B")
    fraction = ((source if string[0] == "S" else depth - source) + last * depth) / height
    return ZONE_PART * float(np.sqrt(wavelength * (1 - fraction) / fraction))
