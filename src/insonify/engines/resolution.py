"""Resolution cells, and the density of a boundary's scatterers that follows from them over the whole track.

The scale of each tile follows from its nearest distance to the whole track, never from one ping, so a position has the
same scatterers in every ping. A ping uses the tiles in reach of its window and beams.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _resolution_kernel as kernel
from insonify.engines._gain_bound_kernel import BoundEnd, raise_gain_bounds
from insonify.engines.face_images import FaceImage
from insonify.engines.glint_spread import GlintSpread
from insonify.ocean.water import Water
from insonify.propagation.propagation_model import PropagationModel, ReachableRange, departure_cones
from insonify.scene.scatterer_grid import BASE_PITCH, FINEST_SCALE, TILE, ScattererGrid, Tiles
from insonify.scene.scene import Scene
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.track_extent import TrackExtent, distance_to_segments

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

FIRST_TILES = 8
"""Largest number of tiles along the farthest distance with which the search for tiles begins."""

SPARSE_LIMIT = 2.0
"""Number of quadrature points in a resolution cell below which they are sparse [1]."""


@dataclass(frozen=True, slots=True)
class Resolution:
    """Size of the sonar's resolution cell, and the number of scatterers in it."""

    slant_resolution: float
    """Resolution along slant range, limited to a fraction of the least distance from a boundary [m]."""
    beam_width: float
    """Width of the finest two-way beam [rad]."""
    scatterers_per_cell: float
    """Scatterers in each resolution cell [1]."""
    pulse_resolution: float = 0.0
    """Slant-range resolution where only the pulse limits it [m]; 0: `slant_resolution` holds everywhere."""
    elongation: float = kernel.MAX_ELONGATION
    """Largest side of the square that one scatterer represents, over the length of a cell on the seabed [1]."""

    @property
    def sparse(self) -> bool:
        """True: fewer than `SPARSE_LIMIT` points in a cell, for labels, whose accuracy does not improve with more."""
        return self.scatterers_per_cell < SPARSE_LIMIT

    @property
    def cell(self) -> kernel.ResolutionCell:
        """The resolution cell as a tuple for kernels."""
        return kernel.ResolutionCell(
            float(self.slant_resolution), float(self.beam_width), float(self.scatterers_per_cell),
            float(self.pulse_resolution), float(self.elongation),
        )  # fmt: skip

    def ground_length(self, distance: Floats, height: float) -> Floats:
        """Length of a resolution cell on the seabed [m], at a horizontal distance [m] and height [m]."""
        horizontal_distance = np.asarray(distance, float)
        length = np.empty(horizontal_distance.shape)
        kernel.ground(self.cell, horizontal_distance.ravel(), height, length.reshape(-1))
        return length

    def cell_area(self, distance: Floats, height: float) -> Floats:
        """Largest area that one scatterer may represent [m^2], at a horizontal distance [m] and height [m]."""
        horizontal_distance = np.asarray(distance, float)
        area = np.empty(horizontal_distance.shape)
        kernel.cell_areas(self.cell, horizontal_distance.ravel(), height, area.reshape(-1))
        return area

    def coarsest(self, reach: float, height: float) -> float:
        """Upper bound of `cell_area` at all distances up to `reach` [m], at a height [m]: [m^2].

        The area without its limit grows to where the disc below the sonar ends, and is convex beyond.
        """
        slant = max(self.slant_resolution, self.pulse_resolution)
        unlimited = Resolution(slant, self.beam_width, self.scatterers_per_cell)
        edge = (slant / 2 + np.hypot(slant / 2, 2 * height)) / 2
        distance = np.array([np.sqrt(slant * edge / 2), reach])
        return float(
            np.max(unlimited.ground_length(distance, height) * np.hypot(distance, height))
            * self.beam_width
            / self.scatterers_per_cell
        )

    def finest(self, nearest: Floats, farthest: Floats, height: float) -> Floats:
        """Least `cell_area` between two horizontal distances [m^2]: at either, or at a minimum between them.

        Outwards the seabed cell of one pulse gets shorter and the beam wider; their product is least at a grazing angle
        of 45 degrees, and of 55 degrees where the cell is limited to a fraction of the slant range.
        """
        area = np.empty(len(nearest))
        kernel.finest(self.cell, nearest, farthest, height, area)
        return area

    def finest_bistatic(self, ends: list[tuple[Floats, Floats, float]]) -> Floats:
        """Lower bound of the cell areas of a transmitter and a receiver at two positions [m^2], shape (n,).

        Between them the two-way path grows more slowly along the seabed than it does for the farther end alone,
        and no beam is narrower across than that of the nearer end.

        Args:
            ends: For each end its nearest and its farthest horizontal distance [m], shape (n,), and its height [m].
        """
        lengths = np.empty((len(ends), len(ends[0][0])))
        for row, (nearest, farthest, height) in zip(lengths, ends, strict=True):
            kernel.min_ground_lengths(self.cell, nearest, farthest, height, row)
        length = lengths.min(axis=0)
        width = np.minimum.reduce([np.hypot(nearest, height) * self.beam_width for nearest, _, height in ends])
        return np.minimum(length * width / self.scatterers_per_cell, (self.elongation * length) ** 2)


def track_sound_speed(scene: Scene, ping_geometry: PingGeometry) -> float:
    """Smaller one of the sound speeds at the least and the greatest depth of the sonar on its whole track [m/s].

    It is the same at every ping; with the speed at the sonar's own depth, cells would change with its heave.
    """
    return _smallest_speed(scene.water, ping_geometry.track_depths)


@lru_cache(maxsize=16)
def _smallest_speed(water: Water, depths: tuple[float, ...]) -> float:
    """Smallest sound speed at some depths [m/s]."""
    return float(np.min(water.sound_speed_at(np.array(depths))))


def min_track_height(track_extent: TrackExtent, boundary_depth: float) -> float:
    """Least height of an end of the sonar above a boundary, or depth below it, on its whole track [m].

    Args:
        track_extent: Extent of the track of that end.
        boundary_depth: Depth of the boundary [m].
    """
    return min(abs(boundary_depth - source) for source in track_extent.depths)


def max_path_length(ping_geometry: PingGeometry, fastest: float) -> float:
    """Longest two-way path that is still received, from one end to the other [m].

    Args:
        ping_geometry: The sonar at this ping.
        fastest: Greatest speed of sound in the water [m/s].
    """
    return fastest * ping_geometry.recorded_delays[1]


def receivable_range(
    ping_geometry: PingGeometry, boundary_depth: float, rays: PropagationModel, families: tuple[str, ...], *,
    rise: float = 0.0,
) -> ReachableRange:  # fmt: skip
    """Distances whose earliest or latest pair of legs falls into the window.

    Args:
        ping_geometry: The sonar at this ping.
        boundary_depth: Depth of the boundary [m].
        rays: Propagation model of the scene.
        families: Families that reach the boundary.
        rise: Largest height of the boundary above or below its depth [m].

    Returns:
        Horizontal distances [m]; farthest is negative where nothing is received.
    """
    first, last = ping_geometry.recorded_delays
    separation = float(np.linalg.norm(ping_geometry.transmit_position - ping_geometry.receive_position))
    depths = float(ping_geometry.transmit_position[2]), float(ping_geometry.receive_position[2])
    return rays.reachable_range(depths, boundary_depth, families, (first / 2, last / 2), separation, relief_height=rise)


def tiles_in_view(
    ping_geometry: PingGeometry, scatterer_grid: ScattererGrid, boundary_depth: float, rays: PropagationModel,
    families: tuple[str, ...], resolution: Resolution, beam_floor: float, *, rise: float = 0.0, widest: float = np.inf,
    glints: GlintSpread | None = None, images: tuple[FaceImage, ...] = (),
) -> tuple[Tiles, Floats]:  # fmt: skip
    """The tiles of a boundary that one ping can receive, each at the scale that the whole track requests.

    Args:
        ping_geometry: The sonar at this ping.
        scatterer_grid: Frame of the tiles.
        boundary_depth: Depth of the boundary [m].
        rays: Propagation model of the scene.
        families: Families that reach the boundary.
        resolution: Resolution cells of the sonar.
        beam_floor: Two-way pressure gain below which a tile is left out [1].
        rise: Largest height of the boundary above or below its depth [m].
        widest: Longest path from the transmitter by a position to the receiver that is received [m], see
            `max_path_length`.
        glints: Spread of the directions of legs by a moving surface; None: it does not move.
        images: Images of the sonar in faces.

    Returns:
        Tiles in a fixed order, and the fraction of their scatterers that fills the sonar's cells [1], shape (n,): cells
        of the scatterer grid come in powers of two.
    """
    window_range = receivable_range(ping_geometry, boundary_depth, rays, families, rise=rise)
    if window_range.farthest < 0:
        return Tiles(*np.empty((3, 0), np.int64)), np.zeros(0)
    transmitter = scatterer_grid.from_world(ping_geometry.transmit_position[:2])
    receiver = scatterer_grid.from_world(ping_geometry.receive_position[:2])
    scale = max(FINEST_SCALE, int(np.ceil(np.log2(window_range.farthest / (TILE * BASE_PITCH)))) + 1)
    side = TILE * BASE_PITCH * 2.0**scale
    track_cells = _TrackResolution(
        ping_geometry, scatterer_grid, boundary_depth, resolution, window_range.farthest + side
    )
    # begin with tiles that are all too coarse, or few
    while (
        scale > FINEST_SCALE
        and side * FIRST_TILES > window_range.farthest
        and (side / TILE / 2) ** 2 > track_cells.coarsest
    ):
        scale, side = scale - 1, side / 2
    low, high = (np.floor((transmitter + sense * window_range.farthest) / side).astype(np.int64) for sense in (-1, 1))
    along, across = np.empty((2, int(np.prod(high - low + 1))), np.int64)
    kernel.tiles_between(low, high, along, across)
    if ping_geometry.receive_track_extent is None:
        widest = np.inf
    area = kernel.ReceivableArea(transmitter, receiver, window_range.nearest, window_range.farthest, widest)
    tiles_by_scale: list[tuple[Integers, Integers, Integers, Floats]] = []
    while len(along):
        pitch, (centre, position) = float(np.ldexp(BASE_PITCH, scale)), np.empty((2, len(along), 2))
        half = TILE * pitch / np.sqrt(2)
        n = kernel.tiles_in_reach(pitch, along, across, area, scatterer_grid.frame, centre, position)
        bound = two_way_gain_bound(
            position[:n], np.full(n, half), ping_geometry, boundary_depth, rays, families, rise=rise,
            sufficient_gain=beam_floor, glints=glints, images=images,
        )  # fmt: skip
        n = kernel.tiles_above_floor(bound, beam_floor, along, across, centre)
        finest = track_cells.finest(centre[:n], np.full(n, half))
        *fine_tiles, density, along, across = kernel.subdivide_tiles(scale, along[:n], across[:n], finest)
        tiles_by_scale.append((np.full(len(density), scale), *fine_tiles, density))
        scale -= 1
    *columns, density = (np.concatenate(column) for column in zip(*tiles_by_scale, strict=True))
    return Tiles(*columns), density


def fill_fraction(
    ping_geometry: PingGeometry, scatterer_grid: ScattererGrid, boundary_depth: float, resolution: Resolution,
    tiles: Tiles, max_fraction: Floats
) -> Floats:  # fmt: skip
    """Fraction of the scatterers of some tiles that fills the resolution cells of one ping [1], shape (n,).

    A tile is as fine as the whole track needs it. A ping right above it, or at a large distance, has larger cells
    there.

    Args:
        ping_geometry: The sonar at this ping.
        scatterer_grid: Frame of the tiles.
        boundary_depth: Depth of the boundary [m].
        resolution: Resolution cells of the sonar.
        tiles: The tiles.
        max_fraction: Fraction that fills the cells of all pings, an upper limit of the result [1], shape (n,).
    """
    half, spans = TILE * tiles.pitch / np.sqrt(2), []
    for position in (ping_geometry.transmit_position, ping_geometry.receive_position)[
        : 1 if ping_geometry.is_monostatic else 2
    ]:
        distance = np.linalg.norm(tiles.centre - scatterer_grid.from_world(position[:2]), axis=-1)
        spans.append((np.maximum(distance - half, 0), distance + half, abs(boundary_depth - float(position[2]))))
    area = resolution.finest(*spans[0]) if ping_geometry.is_monostatic else resolution.finest_bistatic(spans)
    return np.minimum(tiles.pitch**2 / area, max_fraction)


@kernel.cell_areas.stand_in
def _cells(cell: kernel.ResolutionCell, distance: Floats, height: float, area: Floats) -> None:
    """Fill the largest areas that one scatterer may represent [m^2], (n,); see the kernel `cell_areas`."""
    slant_range = np.hypot(distance, height)
    slant = np.maximum(cell.slant, np.minimum(cell.pulse, kernel.MAX_CELL_LENGTH_RATIO * slant_range))
    length = np.minimum(slant * slant_range / np.maximum(distance, 1e-9), np.sqrt(2 * slant_range * slant))
    area[:] = np.minimum(length * (slant_range * cell.width) / cell.per_cell, (cell.elongation * length) ** 2)


class _TrackResolution:
    """Scatterer density of a boundary, from the whole track of each platform."""

    def __init__(
        self, ping_geometry: PingGeometry, scatterer_grid: ScattererGrid, boundary_depth: float, resolution: Resolution,
        reach: float,
    ) -> None:  # fmt: skip
        """Select the segments of each track that can be nearest to a tile in reach of one ping.

        Args:
            ping_geometry: The sonar at this ping.
            scatterer_grid: Frame of the tiles.
            boundary_depth: Depth of the boundary [m].
            resolution: Resolution cells of the sonar.
            reach: Distance of the farthest tile from the transmitter [m].
        """
        self.resolution = resolution
        self.coarsest = resolution.coarsest(reach, min_track_height(ping_geometry.track_extents[0], boundary_depth))
        """No cell within reach is larger [m^2]."""
        transmit_position = ping_geometry.transmit_position[:2]
        separation = float(np.linalg.norm(ping_geometry.transmit_position - ping_geometry.receive_position))
        self.ends = [
            (
                scatterer_grid.from_world(extent.nearest_segments(position, reach + margin)),
                scatterer_grid.from_world(extent.hull_corners),
                extent.polyline_error,
                min_track_height(extent, boundary_depth),
            )
            for extent, position, margin in zip(
                ping_geometry.track_extents, (transmit_position, ping_geometry.receive_position[:2]),
                (0.0, separation), strict=False,
            )
        ]  # fmt: skip

    def finest(self, centre: Floats, half_diagonal: Floats) -> Floats:
        """Smallest area that one scatterer may represent anywhere in some tiles [m^2], shape (n,)."""
        spans = []
        for segments, corners, error, height in self.ends:
            distance, nearest, farthest = distance_to_segments(centre, segments), *np.empty((2, len(centre)))
            kernel.tile_distance_bounds(centre, half_diagonal, distance, corners, error, nearest, farthest)
            spans.append((nearest, farthest, height))
        return self.resolution.finest(*spans[0]) if len(spans) == 1 else self.resolution.finest_bistatic(spans)


def two_way_gain_bound(
    centre: Floats, half_diagonal: Floats, ping_geometry: PingGeometry, boundary_depth: float, rays: PropagationModel,
    families: tuple[str, ...], *, rise: float = 0.0, sufficient_gain: float = np.inf, glints: GlintSpread | None = None,
    images: tuple[FaceImage, ...] = (),
) -> Floats:  # fmt: skip
    """Upper bound of the two-way pressure gain near some positions of a boundary, by any pair of families.

    Args:
        centre: Positions (north, east) [m], shape (n, 2).
        half_diagonal: Distance around them up to which the bound holds [m], shape (n,).
        ping_geometry: The sonar.
        boundary_depth: Depth of the boundary [m].
        rays: Propagation model of the scene.
        families: Families that reach the boundary.
        rise: Largest height of the boundary above or below its depth [m].
        sufficient_gain: Gain at which no further family is evaluated [1]: where it is reached, the result may be less
            than the bound.
        glints: Spread of the directions of legs by a moving surface; None: it does not move.
        images: Images of the sonar in faces.

    Returns:
        Two-way pressure gain [1], shape (n,).
    """
    transmit, receive = np.zeros(len(centre)), np.zeros(len(centre))
    if not len(centre) or not families:
        return transmit
    both = not (ping_geometry.is_monostatic and ping_geometry.same_beams)
    if not both:
        receive = transmit
    if not images and not (glints is not None and any(map(glints.spreads, families))):
        lit_by = [(ping_geometry.transmit_position, ping_geometry.transmit_beams)]
        if both:
            lit_by.append((ping_geometry.receive_position, ping_geometry.bounding_receive_beams))
        bound_ends = [
            BoundEnd(
                position, rays.departure_angles(families, float(position[2]), boundary_depth, relief_height=rise),
                beams.kernel_majorants,
            )
            for position, beams in lit_by
        ]  # fmt: skip
        raise_gain_bounds(
            bound_ends[0], bound_ends[-1], not both, centre, half_diagonal, sufficient_gain, transmit, receive
        )
        return transmit * receive
    sources = [(ping_geometry, families, np.arange(len(centre)))]
    sources += [(image.sonar, image.families, image.lights(centre, boundary_depth, half_diagonal)) for image in images]
    for sonar, names, rows in sources:
        ends = [(sonar.transmit_position, sonar.transmit_beams, transmit)]
        if both:
            ends.append((sonar.receive_position, sonar.bounding_receive_beams, receive))
        for name in names:
            rows = rows[transmit[rows] * receive[rows] < sufficient_gain]
            if not len(rows):
                break
            for position, beams, best in ends:
                cones = departure_cones(
                    rays, name, position, centre[rows], half_diagonal[rows], boundary_depth, relief_height=rise
                )
                gain = np.where(cones.exists, beams.bound(cones.axis, cones.half_angle), 0.0)
                if glints is not None and glints.spreads(name):
                    spread = glints.bound(beams, name, position, centre[rows], cones, boundary_depth)
                    gain = np.where(cones.exists, np.maximum(gain, spread), 0.0)
                best[rows] = np.maximum(best[rows], gain)
    return transmit * receive
