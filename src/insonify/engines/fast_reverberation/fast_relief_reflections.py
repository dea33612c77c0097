"""Bottom bounces over relief in fast reverberation: legs reflected by planes fitted to the terrain at their bounces.

Along radials, every bounce is a reflection at the mean plane, as in the keep probabilities of pairs. Over relief, legs
with bottom bounces are replaced by those of `local_plane_paths` at the samples where any pair requests them. Occlusion
by terrain and targets remains that over the mean plane.
"""

import numpy as np

from insonify.engines.fast_reverberation._fast_relief_reflections_kernel import reached_samples, write_image_paths
from insonify.engines.fast_reverberation.reverberation_plan import ReverberationPlan
from insonify.engines.radial_tables import RadialLegs, RadialSet
from insonify.engines.relief_reflections import reflection_product
from insonify.propagation.local_planes import local_plane_paths
from insonify.scene.scene import Scene
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.sonar.ping_geometry import PingGeometry


def bounce_off_relief(
    scene: Scene, terrain: SeabedTerrain, ping_geometry: PingGeometry, plan: ReverberationPlan, part: RadialSet,
    legs: RadialLegs,
) -> None:  # fmt: skip
    """Replace the legs with bottom bounces of some radials by legs off planes fitted to the seabed at each bounce.

    Args:
        scene: The scene.
        terrain: Terrain of the seabed, which has relief.
        ping_geometry: The sonar at this ping.
        plan: The reverberation plan.
        part: The radials, s of them.
        legs: Legs to the samples of the radials, changed in place.
    """
    list_starts, size = part.lists.list_offsets[part.list_rows], int(legs.radial_offsets[-1])
    all_rows, all_points = np.empty(size, np.int64), np.empty((size, 3))
    position, wavelength = ping_geometry.transmit_position, ping_geometry.wavelength
    for f, family in enumerate(plan.families):
        count = 0
        if "B" in family:
            count = reached_samples(
                position, legs.amplitude[f], legs, list_starts, part.lists.beam_bearing, all_rows, all_points
            )
        if count:
            rows, points = all_rows[:count], all_points[:count]
            paths = local_plane_paths(family, position, points, terrain, wavelength)
            product = reflection_product(family, paths, terrain, wavelength, scene).astype(np.complex64)
            write_image_paths(rows, paths, product, 1 / scene.water.sound_speed, f, plan.table, legs)
