"""Work on the smooth faces of targets in one ping, from a count of the pieces into which it divides them.

Their number depends on wavelength, beams, window and distance, so a sample of them is divided. That is done once, at
the ping that reaches most of the targets.
"""

import numpy as np

from insonify.engines.facet_count import facet_count
from insonify.engines.memory_budget import BYTES_AT_ONCE, bytes_per_point, legs_per_point
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.estimates import unit_costs
from insonify.scene.solid import world_triangles
from insonify.simulator import Simulator
from insonify.sonar.ping_geometry import PingGeometry

MOST_COUNTED = 12
"""Targets whose pieces are counted; others are evaluated by their area [1]."""


def facet_work(simulator: Simulator, ping_geometry: PingGeometry) -> tuple[float, float, float, float]:
    """Number of facets on the smooth targets in reach of one side of the sonar at one ping, and their processor time.

    Args:
        simulator: A prepared scenario.
        ping_geometry: The side at that ping.

    Returns:
        Facets [1], processor time [s]; memory during the whole ping, and that while faces of the largest are split or
        legs and pairs of some facets are made [bytes].
    """
    scenario, scene = simulator.scenario, simulator.engine.scene
    smooth = [solid for solid in scene.solids_of_one_law if solid.face_reflection_coefficient is not None]
    if not smooth or "target" not in scenario.paths.contributions:
        return 0.0, 0.0, 0.0, 0.0
    seen = ping_scatterers(scene, scenario.paths, scenario.seed, ping_geometry, simulator.engine.rays)
    areas = [float(world_triangles(solid, scene.seabed).area.sum()) for solid in smooth]
    rows = np.unique(np.linspace(0, len(smooth) - 1, MOST_COUNTED).round().astype(int))
    pieces = [
        facet_count(
            scene, smooth[row], scenario.paths, ping_geometry, seen.resolution.slant_resolution, simulator.engine.rays
        )
        for row in rows
    ]
    facets, most = sum(pieces) * sum(areas) / sum(areas[row] for row in rows), max(pieces)
    legs = legs_per_point(scene, scenario.paths, "target", drawn=False)
    pairs = bytes_per_point(scene, scenario.paths, "target", drawn=False)
    seconds = unit_costs.SECONDS_PER_FACET + legs**2 * unit_costs.SECONDS_PER_SPECULAR_PAIR * scenario.sonar.beam_count
    working = max(most * unit_costs.BYTES_PER_FACET_IN_SPLIT, min(facets * pairs, BYTES_AT_ONCE / 4))
    return facets, facets * seconds, facets * unit_costs.BYTES_PER_FACET, working
