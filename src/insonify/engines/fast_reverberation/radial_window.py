"""Window of the seabed's map that the radials of one ping cross, and the targets beside them."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._radial_terrain_kernel import CELLS, tiles_under_radials
from insonify.engines.fast_reverberation.reverberation_plan import ReverberationPlan
from insonify.engines.radial_tables import RadialFrame, RadialSet
from insonify.propagation.knife_edge import ROUGH_RIPPLES
from insonify.scene.seabed_terrain import SeabedTerrain
from insonify.scene.terrain_map import MAX_TILES
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TerrainWindow:
    """Window of the seabed's map that the radials of one ping may cross."""

    start: tuple[float, float] = (0.0, 0.0)
    """Start of the radials, along the map's axes from the first node of the window [m]."""
    side: int = 1
    """Tiles along each side of the window."""
    corner: NDArray[np.int64] = field(default_factory=lambda: np.zeros(2, np.int64))
    """Numbers of its first tile."""
    crossed: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    """Numbers in the window of the tiles that the lines cross, (n, 2)."""


def terrain_window(
    terrain: SeabedTerrain | None, ping_geometry: PingGeometry, step: float, parts: list[RadialSet], farthest: float
) -> TerrainWindow | None:
    """The window of one ping, or None where its lines cross more tiles than are kept.

    Args:
        terrain: The seabed; None for a flat bed.
        ping_geometry: The sonar at this ping.
        step: Distance of samples along the lines [m].
        parts: All its lines with their points.
        farthest: Distance that is received [m].
    """
    if terrain is None:
        return TerrainWindow()
    lattice, tile = terrain.relief.resolved.scatterer_grid, terrain.heightmap_cell_size * CELLS
    own = lattice.from_world(ping_geometry.transmit_position[:2]).tolist()
    reach = math.ceil(farthest / tile) + 1
    first = [math.floor(position / tile) - reach for position in own]
    start = own[0] - first[0] * tile, own[1] - first[1] * tile
    frame, side = RadialFrame(*start, lattice.heading, step), 2 * reach + 1
    mark, radial_tiles = np.zeros((side, side), np.int8), np.empty((MAX_TILES + 1, 2), np.int64)
    crossed = np.zeros((side, side), bool)
    for part in parts:
        count = tiles_under_radials(
            frame, part.radials, part.lists.samples, part.taken, terrain.heightmap_cell_size, mark, radial_tiles
        )
        crossed[tuple(radial_tiles[:count].T)] = True
    tiles = np.argwhere(crossed)
    return None if len(tiles) > MAX_TILES else TerrainWindow(start, side, np.array(first), tiles)


def radials_past_targets(
    plan: ReverberationPlan, ping_geometry: PingGeometry, heading: float, edges: str
) -> NDArray[np.bool_]:
    """Lines that reach each target and pass it, or come so near that its soft edge is looked at, (t, s).

    Args:
        plan: The plan of the lines.
        ping_geometry: The sonar at this ping.
        heading: Heading of the frame of the lines [rad].
        edges: Hard or soft edges.
    """
    passed = np.zeros((len(plan.bounding_cylinders), len(plan.radials)), bool)
    if not len(plan.bounding_cylinders):
        return passed
    bearing, position = np.arctan2(plan.radials[:, 1], plan.radials[:, 0]) + heading, ping_geometry.transmit_position
    for t, (north, east, radius) in enumerate(plan.bounding_cylinders[:, :3].tolist()):
        distance, towards = (
            math.hypot(north - position[0], east - position[1]),
            math.atan2(east - position[1], north - position[0]),
        )
        off = np.abs(np.mod(bearing - towards + np.pi, 2 * np.pi) - np.pi) - plan.radials[:, 2] / 2
        half = math.asin(min(1.0, radius / max(distance, 1e-9))) + _diffraction_margin(
            distance, ping_geometry.wavelength, edges
        )
        passed[t] = (distance <= radius) | (off <= half) & (plan.radials[:, 5] > distance - radius)
    return passed


def _diffraction_margin(distance: float, wavelength: float, edges: str) -> float:
    """Bearing beside a target's rim up to which its soft edge is looked at [rad]."""
    if edges == "none":
        return 0.0
    return ROUGH_RIPPLES * math.sqrt(wavelength / (2 * max(distance, wavelength)))
