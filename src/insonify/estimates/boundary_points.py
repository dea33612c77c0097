"""Scatterers of a boundary in one ping, counted on rings about the sonar without drawing any."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import polar_grid
from insonify.engines.beam_importance import BeamImportance
from insonify.engines.face_images import FaceImage
from insonify.engines.glint_spread import glint_spread
from insonify.engines.resolution import Resolution, max_path_length, receivable_range, tiles_in_view, two_way_gain_bound
from insonify.propagation.propagation_model import PropagationModel
from insonify.scenario.scenario import Scenario
from insonify.scene.scatterer_grid import BASE_PITCH, FINEST_SCALE, TILE, ScattererGrid, Tiles
from insonify.sonar.ping_geometry import PingGeometry
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

MIN_CELL_SIZE = (BASE_PITCH * 2.0**FINEST_SCALE) ** 2
"""Area of the smallest cells of the scatterers' grid [m^2]."""
RINGS, SECTORS = 48, 360
"""Number of rings and sectors in which the seabed is counted [1]."""
TILE_PARTS = 6
"""Parts of the side of a tile of scatterers, by which tiles between two platforms are sorted into sectors [1]."""
BEAMS_PER_RING, MOST_APART = 256, 12
"""Beams times families from which on keep probabilities are evaluated at every second ring, and so on; rings that are
apart at most [1]."""


NOTHING, NOWHERE = np.zeros(0), np.zeros((0, SECTORS), bool)


class BoundaryPoints(NamedTuple):
    """Scatterers of a boundary in one ping."""

    number: Floats
    """Their number on each ring about the sonar, or in each tile between two platforms [1], shape (n,)."""
    distance: Floats
    """Distance of each ring, zero for tiles [m], shape (n,)."""
    tiles: float
    """Tiles of the scatterer grid [1]."""
    cell: Floats = NOTHING
    """Area for each scatterer [m^2], shape (n,)."""
    on_ring: Floats = NOTHING
    """Number of scatterers on each ring about the sonar, or about the transmitter of two platforms [1], shape (r,)."""
    radius: Floats = NOTHING
    """Radius of these rings [m], shape (r,)."""
    in_beam: NDArray[np.bool_] = NOWHERE
    """True for sectors of rings that the beams reach, shape (r, sectors)."""


def points_on_boundary(
    ping_geometry: PingGeometry, boundary_depth: float, rays: PropagationModel, families: tuple[str, ...],
    resolution: Resolution, scenario: Scenario, rise: float, images: tuple[FaceImage, ...],
) -> BoundaryPoints:  # fmt: skip
    """Scatterers in reach of window and beams of a boundary with a rise [m]."""
    floor = float(amplitude_ratio(scenario.paths.beam_cutoff_db))
    glints = glint_spread(scenario.scene, ping_geometry.frequency)
    if ping_geometry.receive_track_extent is not None:  # no rings about two positions: its tiles are counted
        widest = max_path_length(ping_geometry, scenario.water.max_sound_speed)
        view_tiles, density = tiles_in_view(
            ping_geometry, scenario.seabed.scatterer_grid, boundary_depth, rays, families, resolution, floor, rise=rise,
            widest=widest, glints=glints, images=images,
        )  # fmt: skip
        count = density * TILE**2
        cell = np.asarray((BASE_PITCH * 2.0**view_tiles.scale) ** 2, float)
        return BoundaryPoints(
            count, np.zeros(len(count)), float(len(count)), cell / np.maximum(density, 1e-300),
            *_rings_of_tiles(ping_geometry, scenario.seabed.scatterer_grid, view_tiles, count),
        )  # fmt: skip
    reach = receivable_range(ping_geometry, boundary_depth, rays, families, rise=rise)
    if reach.farthest <= reach.nearest:
        return BoundaryPoints(np.zeros(1), np.zeros(1), 0.0, np.ones(1))
    distance = np.array([reach.farthest])
    margin = _tile(resolution, distance, reach.vertical_distance, scenario)[0] / 2  # ground comes in whole tiles
    outer = reach.farthest + margin
    edges = np.geomspace(max(reach.nearest - margin, outer * 1e-3), outer, RINGS + 1)
    middle = np.sqrt(edges[:-1] * edges[1:])
    tile = _tile(resolution, middle, reach.vertical_distance, scenario)
    azimuth = (np.arange(SECTORS) + 0.5) * 2 * np.pi / SECTORS
    position = np.stack(np.broadcast_arrays(middle[:, None] * np.cos(azimuth), middle[:, None] * np.sin(azimuth)), -1)
    half = np.hypot(np.diff(edges), middle * 2 * np.pi / SECTORS) / 2 + tile / 2
    bound = two_way_gain_bound(
        position.reshape(-1, 2) + ping_geometry.transmit_position[:2], np.repeat(half, SECTORS), ping_geometry,
        boundary_depth, rays, families,
        rise=rise, glints=glints, images=images,
    )  # fmt: skip
    in_beam = (bound >= floor).reshape(RINGS, SECTORS)
    area = np.pi * np.diff(edges**2)
    tiles = area * in_beam.mean(axis=1) / tile**2
    importance = BeamImportance(
        ping_geometry, boundary_depth, rays, families, scenario.seabed.scatterer_grid, outer,
        scenario.paths.importance_sampling, glints, images,
    )  # fmt: skip
    node = middle[:: min(1 + scenario.sonar.beam_count * len(families) // BEAMS_PER_RING, MOST_APART)]
    kept = np.interp(middle, node, importance.mean_keep_probability(node))
    if scenario.field == "incoherent":
        wide = min(resolution.beam_width, polar_grid.MAX_CELL_WIDTH) * np.hypot(middle, reach.vertical_distance)
        cell = resolution.slant_resolution * wide / resolution.scatterers_per_cell
        tiles = area * in_beam.mean(axis=1) / (cell * polar_grid.RINGS_PER_TILE * polar_grid.SECTORS_PER_TILE)
    else:
        cell = np.maximum(resolution.cell_area(middle, reach.vertical_distance), MIN_CELL_SIZE)
    count = area * np.minimum(kept, in_beam.mean(axis=1)) / cell
    return BoundaryPoints(count, middle, float(tiles.sum()), cell, count, middle, in_beam)


def _rings_of_tiles(
    ping_geometry: PingGeometry, grid: ScattererGrid, tiles: Tiles, count: Floats
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Scatterers of tiles sorted into rings about the transmitter: columns of `BoundaryPoints`."""
    side, part = TILE * BASE_PITCH * 2.0**tiles.scale, (np.arange(TILE_PARTS) + 0.5) / TILE_PARTS
    along, across = ((number[:, None] + part) * side[:, None] for number in (tiles.along, tiles.across))
    position = grid.to_world(*np.broadcast_arrays(along[:, :, None], across[:, None, :])).reshape(-1, 2)
    north, east = (position - ping_geometry.transmit_position[:2]).T
    distance, share = np.hypot(north, east), np.repeat(count, TILE_PARTS**2) / TILE_PARTS**2
    edges = np.linspace(0.0, 1.001 * float(distance.max(initial=1e-3)), RINGS + 1)
    sectors = SECTORS // TILE_PARTS  # so wide that the parts of a tile leave none between them
    ring, sector = np.searchsorted(edges, distance) - 1, np.arctan2(east, north) / (2 * np.pi) % 1 * sectors
    in_beam = np.zeros((RINGS, sectors), bool)
    in_beam[ring, np.minimum(sector.astype(int), sectors - 1)] = True
    return np.bincount(ring, share, minlength=RINGS).astype(float), (edges[:-1] + edges[1:]) / 2, in_beam


def _tile(resolution: Resolution, distance: Floats, height: float, scenario: Scenario) -> Floats:
    """Side of the tiles of scatterers at some distances [m], shape (n,)."""
    pitch = np.sqrt(resolution.cell_area(distance, height))
    if scenario.field == "coherent":  # the scatterer grid's cells come in powers of two
        pitch = BASE_PITCH * 2.0 ** np.maximum(np.floor(np.log2(pitch / BASE_PITCH)), FINEST_SCALE)
    return np.asarray(TILE * pitch)
