"""Number of patches or facets into which one ping splits a smooth target, estimated from a sample.

Pieces are split as `insonify.engines.faces` splits them, level by level; of the pieces of one level no more than a
sample goes on, each for several.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.engines import faces, patches
from insonify.engines.patches import Sight
from insonify.propagation.choice import PathChoice
from insonify.propagation.rays import Rays
from insonify.scene.panels import Panel, panels
from insonify.scene.scene import Scene
from insonify.scene.smooth_faces import above_ground, in_the_water
from insonify.scene.target import Solid
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]

SAMPLE = 500
"""Pieces of one level that are split further [1]."""


def facet_count(
    scene: Scene, solid: Solid, choice: PathChoice, stance: Stance, slant: float, rays: Rays | None = None
) -> float:
    """Number of smooth pieces of a target that one ping meets [1]: arguments as of `faces.smooth_facets`."""
    sight = faces.sight_of(scene, solid, choice, stance, slant, rays)
    closed = panels(solid, scene.seabed, stance.transmit_place)
    if closed:
        return sum(_patch_count(scene, panel, sight) for panel in closed)
    return _triangle_count(scene, faces.towards(scene, solid, sight), sight)


def _patch_count(scene: Scene, panel: Panel, sight: Sight) -> float:
    """Number of patches of a panel [1]."""
    count, split, weight, open_ones = 0.0, 0.0, 1.0, patches.whole(panel)
    clear, finest = in_the_water(scene.seabed), faces.CUT * 2 * np.pi / sight.wavenumber
    while len(open_ones.s):
        small, large, longer = patches.by_size(panel, open_ones, sight)
        rows = _sample(len(small.s))
        if len(rows):
            left = patches.trimmed(panel, small.take(rows), clear, finest)
            count += weight * len(small.s) / len(rows) * len(left.s)
        split += weight * len(small.s)
        if split + 2 * weight * len(large.s) > patches.MOST:
            return min(count + weight * len(large.s), float(patches.MOST))
        open_ones = large.halved(longer)
        rows = _sample(len(open_ones.s))
        weight *= len(open_ones.s) / max(len(rows), 1)
        open_ones = open_ones.take(rows)
    return min(count, float(patches.MOST))


def _triangle_count(scene: Scene, corners: Floats, sight: Sight) -> float:
    """Number of facets of a mesh [1]."""
    count, split, weight = 0.0, 0.0, 1.0
    while len(corners):
        small, corners, side = faces.by_size(corners, sight)
        some = small[_sample(len(small))]
        if len(some):
            count += weight * len(small) / len(some) * len(above_ground(some, scene.seabed))
        split += weight * len(small)
        if split + 2 * weight * len(corners) > faces.MOST_FACETS:
            return min(count + weight * len(corners), float(faces.MOST_FACETS))
        corners = faces.halved(corners, side)
        rows = _sample(len(corners))
        weight *= len(corners) / max(len(rows), 1)
        corners = corners[rows]
    return min(count, float(faces.MOST_FACETS))


def _sample(count: int) -> NDArray[np.int64]:
    """Rows of an even sample of so many pieces."""
    some = min(count, SAMPLE)
    return ((np.arange(some) + 0.5) * (count / max(some, 1))).astype(np.int64)
