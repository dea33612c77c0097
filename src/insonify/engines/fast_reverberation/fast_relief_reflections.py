"""Bottom bounces over relief in fast reverberation: legs reflected by planes fitted to the terrain at their bounces.

Along radials, every bounce is a reflection at the mean plane, as in the keep probabilities of pairs. Over relief, legs
with bottom bounces are replaced by those of `local_plane_paths` at the samples where any pair requests them. Occlusion
by terrain and targets remains that over the mean plane.
"""

from typing import Any

import numpy as np

from insonify.engines.fast_reverberation._fast_relief_reflections_kernel import write_image_paths
from insonify.engines.fast_reverberation.reverberation_plan import ReverberationPlan
from insonify.engines.radial_tables import PairSamples, RadialLegs, RadialSet
from insonify.engines.relief_reflections import reflection_product
from insonify.propagation.local_planes import local_plane_paths
from insonify.scene.scene import Scene
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.sonar.ping_geometry import PingGeometry


def bounce_off_relief(
    scene: Scene, terrain: SeabedTerrain, ping_geometry: PingGeometry, plan: ReverberationPlan, part: RadialSet,
    legs: RadialLegs, pairs: PairSamples,
) -> None:  # fmt: skip
    """Replace the legs with bottom bounces of some radials by legs off planes fitted to the seabed at each bounce.

    Args:
        scene: The scene.
        terrain: Terrain of the seabed, which has relief.
        ping_geometry: The sonar at this ping.
        plan: The reverberation plan.
        part: The radials, s of them.
        legs: Legs to the samples of the radials, changed in place.
        pairs: Samples of each pair.
    """
    radial_offsets = legs.radial_offsets
    families = [f for f, name in enumerate(plan.families) if "B" in name]
    point: Any = None
    for f in families:
        requested = np.zeros(int(radial_offsets[-1]), bool)
        for k in np.flatnonzero((plan.allocation.pair == f).any(axis=1)):
            requested[pairs.rows[k, : pairs.sample_count[k]]] = True
        rows = np.flatnonzero(requested & (np.abs(legs.amplitude[f, : len(requested)]) > 0))
        if not len(rows):
            continue
        if point is None:
            counts = np.diff(radial_offsets)
            point = np.repeat(part.lists.list_offsets[part.list_rows] - radial_offsets[:-1], counts) + np.arange(
                radial_offsets[-1]
            )
        beam_bearing = part.lists.beam_bearing[:, point[rows]]
        position, (distance, depth) = ping_geometry.transmit_position, legs.range_depth[:, rows]
        points = np.stack(
            [position[0] + distance * beam_bearing[0], position[1] + distance * beam_bearing[1], depth], axis=-1
        )
        paths = local_plane_paths(plan.families[f], position, points, terrain, ping_geometry.wavelength)
        product = reflection_product(plan.families[f], paths, terrain, ping_geometry.wavelength, scene)
        write_image_paths(rows, paths, product.astype(np.complex64), 1 / scene.water.sound_speed, f, plan.table, legs)
