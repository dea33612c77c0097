"""Radials of one ping: evenly spaced lines of seabed samples for an expectation, as `engines.polar_grid` lays cells.

Every radial has one azimuth. Neighbours are as far apart as cells of the two-way beam. Near the sonar, where a cell is
small, and at low gain, a radial represents several cells; there the beam is evaluated at another azimuth within its
width at each sample. Samples of neighbouring radials are staggered by the golden ratio, so that every ring has evenly
spaced points.

Low gains need few points: there radials are wider, and their samples farther apart.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines._radial_gain_kernel import patch_gain_bounds
from insonify.engines.polar_grid import GOLDEN, MAX_CELL_WIDTH
from insonify.engines.resolution import Resolution
from insonify.engines.terrain_profiles import GainBound
from insonify.propagation.families import bounce_sequence, image_depth
from insonify.propagation.propagation_model import ReachableRange
from insonify.recent_results import Identity, RecentResults
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

ZoneClimbs = Callable[[tuple[float, float]], Floats]
"""Function of a zone, nearest and farthest distance [m], that returns distances times tangents of the launch angles of
each family for some distances of the zone [m], (f, k)."""

CELLS_PER_SECTOR = 128
"""Cells whose gain is bounded together, before that of each."""
LOW_GAIN = 10 ** (-25 / 20)
"""Two-way gain below which a radial represents several cells [1]."""
SIDE_LOBE = 10 ** (-20 / 20)
"""Largest two-way gain at a distance below which `LOW_GAIN` is lowered in proportion: all gains are low there [1]."""
CELLS_PER_LOW_GAIN_RADIAL = (16, 4)
"""Numbers of cells of a radial where all gains are low: the largest, and one to which it is divided."""
MAX_PATCH_WIDTH = 0.5
"""Width of a patch of the seabed above which the gain towards it is not bounded [rad]."""
LOW_GAIN_STRIDE = 2
"""Steps of the frame between the samples of the widest of these radials."""


class ViewedBoundary(NamedTuple):
    """Boundary that a sonar views, and the rays to it."""

    depth: float
    """Depth of the boundary [m]."""
    families: tuple[str, ...]
    """Families that reach it."""
    rise: float = 0.0
    """Largest height of the boundary above or below its depth [m], less than the sonar's height above it."""
    climbs: ZoneClimbs | None = None
    """Launch angles in layered water; None: rays are straight."""


def radials_in_view(
    ping_geometry: PingGeometry, boundary: ViewedBoundary, window_range: ReachableRange, resolution: Resolution,
    floor: float, heading: float,
) -> Floats:  # fmt: skip
    """Radials of a boundary that one ping can receive.

    Args:
        ping_geometry: The sonar, both ends at one position.
        boundary: The boundary.
        window_range: Distances received in the window.
        resolution: Resolution cells of the sonar.
        floor: Two-way gain below which the seabed is left out [1].
        heading: Heading of the frame of the radials [rad].

    Returns:
        Radials as rows of `radial_columns`, shape (n, 9).
    """
    key = (
        ping_geometry.transmit_beams.axes.tobytes(), ping_geometry.receive_beams.axes.tobytes(),
        ping_geometry.boresight.tobytes(),
        float(ping_geometry.transmit_position[2]), *boundary[:3], window_range, resolution, floor, heading,
        ping_geometry.transmit_beams.pattern_key, ping_geometry.receive_beams.pattern_key, Identity(boundary.climbs),
    )  # fmt: skip
    return _RADIALS.get(key, lambda: _radials(ping_geometry, boundary, window_range, resolution, floor, heading))


_RADIALS: RecentResults[Floats] = RecentResults(8)


def _radials(
    ping_geometry: PingGeometry, boundary: ViewedBoundary, window_range: ReachableRange, resolution: Resolution,
    floor: float, heading: float,
) -> Floats:  # fmt: skip
    """Lay out radials without the cache."""
    cell = min(resolution.beam_width, MAX_CELL_WIDTH) / np.sqrt(resolution.scatterers_per_cell)
    cell_count = int(np.ceil(2 * np.pi / cell / CELLS_PER_SECTOR)) * CELLS_PER_SECTOR
    source, height = float(ping_geometry.transmit_position[2]), window_range.vertical_distance
    image_verticals = _image_verticals(boundary.families, source, boundary.depth)
    is_odd = image_verticals[1]
    boresight = float(np.arctan2(ping_geometry.boresight[1], ping_geometry.boresight[0]))
    first_and_count: list[tuple[int, int]] = []
    zones: list[list[float]] = []
    last_zone: dict[tuple[int, int], list[float]] = {}
    outer = window_range.farthest
    while outer > window_range.nearest and outer > 0:
        merged = 1 << int(np.clip(np.log2(np.hypot(outer, height) / outer), 0, 4))
        inner = outer / 2 if merged < 16 else 0.0
        zone = inner, outer
        if boundary.climbs is not None:
            towards_zone = boundary.climbs(zone)
            image_verticals = towards_zone.ravel(), np.repeat(is_odd, towards_zone.shape[1])
        zone_over_relief = _zone_over_relief(zone, image_verticals[0], boundary.rise)
        for first, count in _cells(
            ping_geometry, boresight, cell_count, merged, zone, zone_over_relief, image_verticals, floor
        ):
            zone_distances = last_zone.get((first, count))
            if zone_distances is None or zone_distances[0] != outer:  # after a zone of finer radials a new one begins
                zone_distances = last_zone[first, count] = [inner, outer]
                first_and_count.append((first, count))
                zones.append(zone_distances)
            zone_distances[0] = inner
        outer = inner
    number = np.arange(len(first_and_count))
    radials = np.empty((len(first_and_count), 9))
    if not first_and_count:
        return radials
    first, count = np.array(first_and_count).T
    width = count * (2 * np.pi / cell_count)
    bearing = boresight + (first + count / 2) * (2 * np.pi / cell_count) - heading
    radials[:, column.COSINE], radials[:, column.SINE] = np.cos(bearing), np.sin(bearing)
    radials[:, column.CELL_WIDTH] = width
    is_merged = count >= CELLS_PER_LOW_GAIN_RADIAL[-1]
    radials[:, column.BEAM_SPREAD] = np.where(is_merged, width, 0.0)
    radials[:, [column.START, column.STOP]] = np.array(zones)
    radials[:, column.START] = np.maximum(radials[:, column.START], window_range.nearest)
    radials[:, column.FIRST_SAMPLE], radials[:, column.NUMBER] = 1 - np.mod((number + 0.5) * GOLDEN, 1.0), number
    radials[:, column.STRIDE] = np.where(count >= CELLS_PER_LOW_GAIN_RADIAL[0], LOW_GAIN_STRIDE, 1)
    return radials


def _zone_over_relief(zone: tuple[float, float], vertical_distances: Floats, rise: float) -> tuple[float, float]:
    """Zone of a level boundary whose elevations, from every image source, are those of relief over another zone [m]."""
    least_height = max(float(np.abs(vertical_distances).min()), 1e-6)
    return zone[0] * least_height / (least_height + rise), zone[1] * least_height / max(
        least_height - rise, 1e-9 * least_height
    )


def _cells(
    ping_geometry: PingGeometry, boresight: float, cell_count: int, merged: int, zone: tuple[float, float],
    zone_over_relief: tuple[float, float], image_verticals: tuple[Floats, NDArray[np.bool_]], floor: float,
) -> list[tuple[int, int]]:  # fmt: skip
    """First cell and number of cells of each radial of one zone; cells are numbered from boresight."""
    angle = 2 * np.pi / cell_count

    def gain_bound(first: NDArray[np.int64], count: int, zone: tuple[float, float]) -> Floats:
        bearing = np.asarray(boresight + (first + count / 2) * angle, float)
        return radial_gain_bound(ping_geometry, bearing, count * angle, zone, *image_verticals)

    first = np.arange(-cell_count // 2, cell_count // 2, CELLS_PER_SECTOR)
    gain = gain_bound(first, CELLS_PER_SECTOR, zone)
    # near the sonar even the largest gain may be a side lobe of the vertical beam
    low_gain = LOW_GAIN * min(float(gain.max(initial=0.0)) / SIDE_LOBE, 1.0)
    first, cells = first[gain_bound(first, CELLS_PER_SECTOR, zone_over_relief) >= floor], []
    coarser = CELLS_PER_SECTOR
    for width in sorted({*(max(count, merged) for count in CELLS_PER_LOW_GAIN_RADIAL), merged}, reverse=True):
        first = (first[:, None] + np.arange(0, coarser, width)).ravel()
        gain = gain_bound(first, width, zone)
        is_split = (gain >= low_gain) if width > merged else np.zeros(len(first), bool)
        if width >= CELLS_PER_LOW_GAIN_RADIAL[-1]:
            cells += [
                (int(cell), width) for cell in first[(gain_bound(first, width, zone_over_relief) >= floor) & ~is_split]
            ]
        else:
            cells += [(int(cell), width) for cell in first]
        first, coarser = first[is_split], width
    return cells


def radial_gain_bound(
    ping_geometry: PingGeometry, bearing: Floats, width: float, zone: tuple[float, float], vertical_distances: Floats,
    is_odd: NDArray[np.bool_],
) -> Floats:  # fmt: skip
    """Upper bound of the two-way gain towards patches of a boundary about some bearings [1], shape (n,).

    Args:
        ping_geometry: The sonar, both ends at one position.
        bearing: Middle of each patch [rad], shape (n,).
        width: Width of the patches [rad].
        zone: Nearest and farthest distance of them [m].
        vertical_distances: Vertical distance from the image source of each family down to the boundary [m], shape (f,).
        is_odd: True for families with an odd number of bounces, shape (f,).
    """
    ends = (
        (ping_geometry.transmit_beams,)
        if ping_geometry.same_beams
        else (ping_geometry.transmit_beams, ping_geometry.bounding_receive_beams)
    )
    gains = [_patch_gain_bounds(beams, bearing, width, zone, vertical_distances, is_odd) for beams in ends]
    return np.asarray(gains[0] * gains[-1])


def _image_verticals(families: tuple[str, ...], source: float, depth: float) -> tuple[Floats, NDArray[np.bool_]]:
    """Height of each family's image source above the seabed [m], and True if it has an odd number of bounces."""
    vertical_distances = np.array([depth - image_depth(name, source, depth) for name in families])
    return vertical_distances, np.array([len(bounce_sequence(name)) % 2 == 1 for name in families])


def straight_gain_bound(ping_geometry: PingGeometry, depth: float, families: tuple[str, ...]) -> GainBound | None:
    """Bound of the two-way gain by straight rays over intervals of bearing at one ping; None if bistatic.

    Pings with the same beams and depths have the same function.

    Args:
        ping_geometry: The sonar.
        depth: Depth of the seabed [m].
        families: Families that reach it.
    """
    if ping_geometry.receive_track_extent is not None or not families:
        return None
    positions = ping_geometry.transmit_position, ping_geometry.receive_position
    ends = tuple(sorted({float(position[2]) for position in positions}))
    end_distance = float(np.linalg.norm(positions[0] - positions[1]))
    objects = map(Identity, (ping_geometry.transmit_beams, ping_geometry.receive_beams, ping_geometry.elements))
    key = (*objects, ends, end_distance, depth, families)
    return _GAIN_BOUNDS.get(key, lambda: _straight_gain_bound(ping_geometry, depth, families, ends, end_distance))


_GAIN_BOUNDS: RecentResults[GainBound] = RecentResults(8)


def _straight_gain_bound(
    ping_geometry: PingGeometry, depth: float, families: tuple[str, ...], ends: tuple[float, ...], end_distance: float
) -> GainBound:
    """Bound of the two-way gain, without the cache, for ends at some depths and a distance from each other [m]."""
    vertical_distances, is_odd = (
        np.concatenate(part) for part in zip(*(_image_verticals(families, end, depth) for end in ends), strict=True)
    )

    def gain_bound(bearing: Floats, width: float, zone: tuple[float, float]) -> Floats:
        parallax = 2 * float(np.arctan2(end_distance, zone[0])) if end_distance > 0 else 0.0  # of the other end
        if width + parallax > MAX_PATCH_WIDTH:
            return np.full(len(bearing), np.inf)
        return radial_gain_bound(
            ping_geometry, np.asarray(bearing, float), width + parallax, zone, vertical_distances, is_odd
        )

    return gain_bound


def _patch_gain_bounds(
    beams: Beams, bearing: Floats, width: float, zone: tuple[float, float], vertical_distances: Floats,
    is_odd: NDArray[np.bool_]
) -> Floats:  # fmt: skip
    """Upper bound of the gain of one end's beams, arguments as of `radial_gain_bound` [1], shape (n,)."""
    gain = np.empty(len(bearing))
    patch_gain_bounds(bearing, width, zone, vertical_distances, is_odd, beams.kernel_majorants, gain)
    return gain
