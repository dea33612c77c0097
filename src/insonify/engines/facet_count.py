"""Number of patches or facets into which one ping splits a smooth target, estimated from a sample.

Pieces are split as in `insonify.engines.facet_subdivision`, step by step; of the pieces of one step no more than a
sample is split further, and each represents several.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.engines import facet_subdivision, patch_subdivision
from insonify.engines.patch_subdivision import TargetInsonification
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model import PropagationModel
from insonify.scene.panels import Panel, panels
from insonify.scene.scene import Scene
from insonify.scene.smooth_faces import clip_at_seabed, water_clearance
from insonify.scene.target import Solid
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

SAMPLE = 500
"""Largest number of pieces of one subdivision step that are split further [1]."""


def facet_count(
    scene: Scene, solid: Solid, path_settings: PathSettings, ping_geometry: PingGeometry, slant: float,
    rays: PropagationModel | None = None,
) -> float:  # fmt: skip
    """Estimated number of patches or facets of a target at one ping [1]; arguments are those of `smooth_facets`."""
    insonification = facet_subdivision.solid_insonification(scene, solid, path_settings, ping_geometry, slant, rays)
    closed = panels(solid, scene.seabed, ping_geometry.transmit_position)
    if closed:
        return sum(_patch_count(scene, panel, insonification) for panel in closed)
    copies = 6 if facet_subdivision.are_deep(scene, solid, insonification) else 1
    return copies * _triangle_count(scene, facet_subdivision.towards(scene, solid, insonification), insonification)


def _patch_count(scene: Scene, panel: Panel, insonification: TargetInsonification) -> float:
    """Number of patches of a panel, each counted once for every side whose delay it has [1]."""
    count, split, weight, open_ones = 0.0, 0.0, 1.0, patch_subdivision.initial_patches(panel)
    clear = water_clearance(scene.seabed)
    finest = facet_subdivision.CUT_RESOLUTION * 2 * np.pi / insonification.wavenumber
    while len(open_ones.s):
        small, large, longer = patch_subdivision.by_size(panel, open_ones, insonification)
        rows = _sample(len(small.s))
        if len(rows):
            left = patch_subdivision.clip_to_water(panel, small.take(rows), clear, finest)
            sides, _ = patch_subdivision.pulse_sides(panel, left, insonification)
            count += weight * len(small.s) / len(rows) * len(sides)
        split += weight * len(small.s)
        if split + 2 * weight * len(large.s) > patch_subdivision.MAX_PATCHES:
            return count + weight * len(patch_subdivision.pulse_sides(panel, large, insonification)[0])
        open_ones = large.halved(longer)
        rows = _sample(len(open_ones.s))
        weight *= len(open_ones.s) / max(len(rows), 1)
        open_ones = open_ones.take(rows)
    return count


def _triangle_count(scene: Scene, corners: Floats, insonification: TargetInsonification) -> float:
    """Estimated number of facets of triangles, at most `MAX_FACETS` [1]; `corners` in world [m], shape (t, 3, 3)."""
    count, split, weight = 0.0, 0.0, 1.0
    while len(corners):
        small, corners, is_long = facet_subdivision.by_size(corners, insonification)
        sample = small[_sample(len(small))]
        if len(sample):
            count += weight * len(small) / len(sample) * len(clip_at_seabed(sample, scene.seabed))
        split += weight * len(small)
        if split + 2 * weight * len(corners) > facet_subdivision.MAX_FACETS:
            return min(count + weight * len(corners), float(facet_subdivision.MAX_FACETS))
        corners = facet_subdivision.halved(corners, is_long)
        rows = _sample(len(corners))
        weight *= len(corners) / max(len(rows), 1)
        corners = corners[rows]
    return min(count, float(facet_subdivision.MAX_FACETS))


def _sample(count: int) -> NDArray[np.int64]:
    """Rows of an evenly spaced sample of `count` pieces, at most `SAMPLE` of them."""
    size = min(count, SAMPLE)
    return ((np.arange(size) + 0.5) * (count / max(size, 1))).astype(np.int64)
