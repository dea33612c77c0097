"""Bottom bounces over relief in fast reverberation: legs reflected by planes fitted to the terrain at their bounces.

Legs are evaluated along radials with every bounce at the mean seabed first, as in the keep probabilities of pairs.
Over relief, those with bottom bounces are then replaced by those of `local_plane_paths`, at the samples where any pair
needs them. Bounces of successive samples lie much closer together than their Fresnel zones are wide, so planes are
fitted for some samples only, the nodes. Between two nodes of a radial the position of the image source is interpolated
linearly. Occlusion by terrain and targets is taken from the legs that are reflected at the mean seabed.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._fast_relief_reflections_kernel import (
    SamplesOnSegments,
    displace_refracted_legs,
    reached_samples,
    write_image_paths,
)
from insonify.engines.fast_reverberation.flat_seabed_legs import bounce_ranges
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

MAX_BOUNCE_STEP = 0.125
"""Largest distance between the bounces of successive nodes, re the half width of the first Fresnel zone there [1].

Legs between nodes then differ from legs with planes of their own by less than 60 ns, 0.2 mrad and 0.004 dB rms
(`docs/decisions/0070-references-and-planes-at-nodes.md`).
"""


def reflect_at_fitted_planes(
    rays: PropagationModel, terrain: SeabedTerrain, ping_geometry: PingGeometry, plan: ReverberationPlan,
    radial_set: RadialSet, legs: RadialLegs,
) -> None:  # fmt: skip
    """Evaluate all legs with bottom bounces again, each reflected at planes fitted to the seabed at its bounces.

    Refracted legs get the differences of delay and directions between straight legs reflected at these planes and
    straight legs reflected at the mean seabed, and keep their reflection coefficients.

    Args:
        rays: Propagation model of the scene.
        terrain: Terrain of the seabed, which has relief.
        ping_geometry: The sonar at this ping.
        plan: The reverberation plan.
        radial_set: The radials, s of them.
        legs: Legs to the n samples of the radials, changed in place.
    """
    lists = radial_set.lists
    list_starts, beam_bearing = lists.list_offsets[radial_set.list_rows], lists.beam_bearing
    size, position, wavelength = int(legs.radial_offsets[-1]), ping_geometry.transmit_position, ping_geometry.wavelength
    rows, segments, listed = np.empty((3, size), np.int64)
    buffers = SamplesOnSegments(rows, segments, np.empty(size), listed, np.empty((size, 3)))
    for f, family in enumerate(plan.families):
        if not bottom_bounces(family):
            continue
        image_height = abs(terrain.depth - float(plan.table.image_depths[f]))
        factor = _node_spacing_factor(family, float(position[2]), image_height, terrain.depth, wavelength)
        count, node_count = reached_samples(
            position, legs.amplitude[f], legs, list_starts, beam_bearing, (factor, image_height), buffers
        )
        if count:
            point = buffers.point[:node_count]
            samples = SamplesOnSegments(
                buffers.row[:count], buffers.segment[:count], buffers.fraction[:count], buffers.listed[:count], point
            )
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
    plan: ReverberationPlan, family_row: int, position: Floats, point: Floats, terrain: SeabedTerrain, wavelength: float
) -> ImagePaths:
    """Straight legs of one family to n points, reflected at planes fitted where the refracted rays have their bounces.

    Where such a leg is invalid, length, departure, arrival and validity are those of the leg over the mean seabed; its
    columns per bounce are not replaced.

    Args:
        plan: The reverberation plan.
        family_row: Row of the family.
        position: North, east, depth of the sonar [m], (3,).
        point: North, east, depth of the points [m], (n, 3).
        terrain: Terrain of the seabed.
        wavelength: Wavelength of the sound [m].
    """
    family, distance = plan.families[family_row], np.hypot(*(point[:, :2] - position[:2]).T)
    bounce_count = len(bounce_sequence(family))
    ranges = bounce_ranges(plan.table.refraction, family_row, bounce_count, distance, point[:, 2])
    paths = local_plane_paths(family, position, point, terrain, wavelength, terrain_bounce_ranges=ranges)
    missing = np.flatnonzero(~paths.is_valid)
    if len(missing):
        flat = flat_image_paths(family, position, point[missing], terrain.depth)
        for name in ("length", "departure", "arrival", "is_valid"):
            getattr(paths, name)[missing] = getattr(flat, name)
    return paths


def _node_spacing_factor(
    family: str, sonar_depth: float, image_height: float, seabed_depth: float, wavelength: float
) -> float:
    """Largest distance d of successive nodes along a radial over the square root of the leg's length L [m^0.5].

    With q, the part of the leg before a bounce, the bounce moves by q d and the half width of its first Fresnel zone is
    sqrt(wavelength L q (1 - q)). So d / sqrt(L) = `MAX_BOUNCE_STEP` sqrt(wavelength (1 - q) / q), which is smallest at
    the last bottom bounce.

    Args:
        family: Name of a family with bottom bounces.
        sonar_depth: Depth of the sonar [m].
        image_height: Height of the sonar's image above or below the mean seabed [m].
        seabed_depth: Depth of the mean seabed [m].
        wavelength: Wavelength of the sound [m].
    """
    boundary_letters = bounce_sequence(family)
    last = boundary_letters.rindex("B")
    to_first_bounce = sonar_depth if boundary_letters[0] == "S" else seabed_depth - sonar_depth
    fraction = (to_first_bounce + last * seabed_depth) / image_height
    return MAX_BOUNCE_STEP * float(np.sqrt(wavelength * (1 - fraction) / fraction))
