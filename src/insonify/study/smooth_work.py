"""Work on the smooth faces of targets in one ping: they are split as that ping would split them, and counted.

How many facets there are depends on the wave, the beams, the window and the distance; so the split itself is the only
count that is right. It is made once, at the ping that meets the most of the targets.
"""

import warnings

from insonify.engines.faces import smooth_facets
from insonify.engines.room import BYTES_AT_ONCE, bytes_per_point, legs_per_point
from insonify.engines.view import view
from insonify.scene.solid import world_triangles
from insonify.scene.target import PointTarget
from insonify.simulation import Listening
from insonify.sonar.stance import Stance
from insonify.study import prices

ENOUGH = 60_000
"""Facets after which further targets are judged by their area [1]."""


def smooth_work(listening: Listening, stance: Stance) -> tuple[float, float, float]:
    """Facets on the smooth targets that one side of the sonar meets at one ping, and what they take.

    Args:
        listening: A prepared scenario.
        stance: The side at that ping.

    Returns:
        Facets [1], processor time [s], memory [bytes].
    """
    scenario, scene = listening.scenario, listening.scenario.scene
    smooth = [one for one in scene.targets if not isinstance(one, PointTarget) and one.smooth is not None]
    if not smooth or "target" not in scenario.paths.causes:
        return 0.0, 0.0, 0.0
    seen = view(scene, scenario.paths, scenario.seed, stance, listening.engine.rays)
    areas = [float(world_triangles(one, scene.seabed).area.sum()) for one in smooth]
    facets, counted, most = 0.0, 0.0, 0.0
    for target, area in zip(smooth, areas, strict=True):
        if facets > ENOUGH:
            break
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the run itself says what is left coarser
            found = smooth_facets(scene, target, scenario.paths, stance, seen.resolution.slant, listening.engine.rays)
        facets, counted, most = facets + len(found), counted + area, max(most, float(len(found)))
    facets *= sum(areas) / counted
    legs = legs_per_point(scene, scenario.paths, "target", drawn=False)
    pairs = bytes_per_point(scene, scenario.paths, "target", drawn=False)
    seconds = prices.SECONDS_PER_FACET + legs**2 * prices.SECONDS_PER_SPECULAR_PAIR * scenario.sonar.beam_count
    return facets, facets * seconds, most * prices.BYTES_PER_FACET + min(facets * pairs, BYTES_AT_ONCE / 4)
