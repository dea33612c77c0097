"""Tiles of the seabed's height map that one ping reads: they are synthesised once and shared by all pings.

The lines on which occlusion is tested run from the sonar to the outer edge of the zone of each scatterer. They cross
sectors that the beams reach, near or far, though scatterers may lie in a small part of them.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines.terrain_profiles import PROFILES_PER_WAVE, azimuth_zones
from insonify.engines.tracer.tracing_scene import CELL_DIVISIONS
from insonify.estimates import unit_costs
from insonify.scene.heightmap_cache import CELLS, HALF_BYTES, NODES
from insonify.scene.heightmap_synthesis import HeightmapSynthesizer
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.simulator import Simulator

Floats = NDArray[np.float64]

EDGES_CROSSED = 4 / np.pi
"""Edges of tiles that a line of random direction crosses, for each side of a tile that it is long [1]."""
TILE_BYTES = 4 * NODES**2
"""Memory of one tile [bytes]."""


def tiles_under_rings(
    terrain: SeabedTerrain, points: Floats, radius: Floats, in_beam: NDArray[np.bool_], farthest: float,
    profile_width: float,
) -> float:  # fmt: skip
    """Number of tiles that lines to scatterers on rings about the sonar cross [1].

    Args:
        terrain: The seabed.
        points: Scatterers on each ring [1], shape (n,).
        radius: Radius of each ring [m], shape (n,).
        in_beam: True for the sectors of each ring that the beams reach, shape (n, sectors).
        farthest: Distance that the window reaches [m].
        profile_width: Least width of a slice of azimuth, which has one line [rad].
    """
    across = max(terrain.relief.shortest_wavelength / PROFILES_PER_WAVE, terrain.heightmap_cell_size)
    edges, slices = azimuth_zones(across, farthest, profile_width, terrain.heightmap_cell_size)[:2]
    zone = np.minimum(np.searchsorted(edges, radius), len(edges) - 1)
    side, beyond, total = CELLS * terrain.heightmap_cell_size, 0.0, 0.0
    reached = np.zeros(in_beam.shape[1], bool)
    for row in range(len(edges) - 1, -1, -1):  # lines of a zone cross all that are nearer
        reached |= in_beam[zone == row].any(axis=0)
        beyond += float(points[zone == row].sum())
        inner, outer = float(edges[row - 1]) if row else 0.0, float(edges[row])
        covered = float(reached.mean())
        touched = _tiles_of(covered * np.pi * (outer**2 - inner**2), 2 * (outer - inner), side)
        lines = min(beyond, covered * float(slices[row]))
        total += distinct(lines * (outer - inner) * EDGES_CROSSED / side, touched)
    return total


def tiles_under_radials(terrain: SeabedTerrain, radials: Floats) -> float:
    """Number of tiles that the lines of the fast reverberation cross [1].

    Args:
        terrain: The seabed.
        radials: The lines, see `radial_columns`, shape (s, 9).
    """
    width, stop = radials[:, column.CELL_WIDTH], radials[:, column.STOP]
    perimeter = 2 * float(stop.max(initial=0.0)) + float(width @ stop)
    return _tiles_of(float(width @ stop**2) / 2, perimeter, CELLS * terrain.heightmap_cell_size) + 1.0


def tiles_in_reach(simulator: Simulator) -> float:
    """Number of tiles within the distance that the first ping reaches [1]."""
    synthesizer, side = map_synthesizer(simulator), simulator.ping_geometries(0)[0]
    if synthesizer is None:
        return 0.0
    farthest = simulator.scenario.water.max_sound_speed * side.recorded_delays[1] / 2
    height = simulator.scenario.seabed.depth - float(side.transmit_position[2])
    radius = float(np.sqrt(max(farthest**2 - height**2, 0.0)))
    radius += float(np.linalg.norm(side.transmit_position - side.receive_position))
    return _tiles_of(np.pi * radius**2, 2 * np.pi * radius, CELLS * synthesizer.cell) + 1.0


def map_synthesizer(simulator: Simulator) -> HeightmapSynthesizer | None:
    """Synthesiser of the height map that a run reads; None over flat ground."""
    terrain = simulator.engine.scene.seabed.terrain
    if terrain is None or simulator.tracer is None:
        return None if terrain is None else terrain.heightmap_synthesizer
    return HeightmapSynthesizer(terrain.relief.resolved, terrain.heightmap_cell_size / CELL_DIVISIONS)


def terrain_seconds(simulator: Simulator, tiles: float) -> float:
    """Processor time to synthesise the height map under all pings [s].

    Args:
        simulator: A prepared scenario.
        tiles: Tiles that one ping reads [1].
    """
    synthesizer = map_synthesizer(simulator)
    if synthesizer is None:
        return 0.0
    nodes = *synthesizer.octave_node_counts, synthesizer.other_part_count * NODES**2
    each, pings = float(np.dot(nodes, unit_costs.SECONDS_PER_HEIGHTMAP_NODE)), simulator.scenario.track.ping_count
    if tiles * TILE_BYTES > HALF_BYTES:  # no tile lasts from ping to ping
        return each * tiles * pings
    start, stop = simulator.platforms.transmitter_poses.position[[0, -1], :2]
    reach = simulator.scenario.water.max_sound_speed * simulator.ping_geometries(0)[0].recorded_delays[1] / 2
    entered = float(np.linalg.norm(stop - start)) * reach / (CELLS * synthesizer.cell) ** 2
    return each * min(tiles * pings, tiles + entered)


def terrain_bytes(tiles: float) -> float:
    """Memory of the height map [bytes], given the tiles that one ping reads."""
    return min(tiles * TILE_BYTES, 2.0 * HALF_BYTES)


def _tiles_of(area: float, perimeter: float, side: float) -> float:
    """Mean number of tiles that a convex part of the seabed touches, less the first [1]."""
    return area / side**2 + EDGES_CROSSED / 2 * perimeter / side


def distinct(draws: float, count: float) -> float:
    """Mean number of different ones in some random draws of a number of things [1]."""
    return -count * float(np.expm1(-draws / max(count, 1e-300)))
