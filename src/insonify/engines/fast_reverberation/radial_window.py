"""Window of the seabed's map that the radials of one ping cross, and radials that cross targets."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._radial_terrain_kernel import (
    CELLS,
    mark_passing,
    mark_tiles,
    numbers_of_marked,
)
from insonify.engines.fast_reverberation.reverberation_plan import ReverberationPlan
from insonify.engines.radial_tables import RadialFrame, RadialSet
from insonify.propagation.knife_edge import ROUGH_RIPPLES
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain_map import MAX_TILES
from insonify.sonar.ping_geometry import PingGeometry


@dataclass(frozen=True, slots=True)
class TerrainWindow:
    """Window of the seabed's map that the radials of one ping may cross."""

    start: tuple[float, float] = (0.0, 0.0)
    """Position of the sonar, along the map's axes from the first node of the window [m]."""
    side: int = 1
    """Number of tiles of the map along each side of the window."""
    corner: NDArray[np.int64] = field(default_factory=lambda: np.zeros(2, np.int64))
    """Row and column of its first tile in the map."""
    crossed: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    """Row and column in the window of the tiles that the radials cross, (n, 2)."""


def terrain_window(
    terrain: SeabedTerrain | None,
    ping_geometry: PingGeometry,
    step: float,
    radial_sets: list[RadialSet],
    farthest: float,
) -> TerrainWindow | None:
    """The window of one ping, without tiles for a flat seabed; None if radials cross more than the map can cache.

    Args:
        terrain: Terrain of the seabed; None for a flat seabed.
        ping_geometry: The sonar at this ping.
        step: Spacing of samples along the radials [m].
        radial_sets: All radials of the ping with their samples.
        farthest: Largest horizontal distance from which echoes are received [m].
    """
    if terrain is None:
        return TerrainWindow()
    scatterer_grid, tile = terrain.relief.resolved.scatterer_grid, terrain.heightmap_cell_size * CELLS
    grid_position = [float(x) for x in scatterer_grid.axes_from_world(*ping_geometry.transmit_position[:2].tolist())]
    tile_reach = math.ceil(farthest / tile) + 1
    first = [math.floor(position / tile) - tile_reach for position in grid_position]
    start = grid_position[0] - first[0] * tile, grid_position[1] - first[1] * tile
    frame, side = RadialFrame(*start, scatterer_grid.heading, step), 2 * tile_reach + 1
    crossed = np.zeros((side, side), np.bool_)
    for radial_set in radial_sets:
        mark_tiles(
            frame, radial_set.radials, radial_set.lists.sample_counts, radial_set.list_rows,
            terrain.heightmap_cell_size, crossed,
        )  # fmt: skip
    tiles = numbers_of_marked(crossed)
    return None if len(tiles) > MAX_TILES else TerrainWindow(start, side, np.array(first), tiles)


def radials_crossing_targets(
    plan: ReverberationPlan, ping_geometry: PingGeometry, heading: float, edge_diffraction: str
) -> NDArray[np.bool_]:
    """Mask of radials that cross each target's bounding cylinder, widened by its zone of edge diffraction, (t, s).

    A radial is as wide as its cells; a target over or under the sonar is crossed by all radials.

    Args:
        plan: The plan of the radials.
        ping_geometry: The sonar at this ping.
        heading: Heading of the frame of the radials [rad].
        edge_diffraction: Edge diffraction of targets: "none" or "knife-edge".
    """
    passing = np.empty((len(plan.bounding_cylinders), len(plan.radials)), np.bool_)
    mark_passing(
        plan.radials, plan.bearings, heading, ping_geometry.transmit_position, plan.bounding_cylinders,
        ping_geometry.wavelength, 0.0 if edge_diffraction == "none" else ROUGH_RIPPLES, passing,
    )  # fmt: skip
    return passing
