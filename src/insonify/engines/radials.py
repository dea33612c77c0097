"""Radials of one ping: evenly spaced lines of seabed samples for an expectation; compare `engines.polar_grid`.

Every radial has one azimuth. Neighbours are as far apart as cells of the two-way beam. Near the sonar, where a cell is
small, and at low gain, a radial represents several cells; there the beam is evaluated at another azimuth within its
width at each sample. Samples of neighbouring radials are staggered by the golden ratio, so that every ring has evenly
spaced points.

Low gains need few points: there radials are wider, and their samples farther apart.
"""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.engines._radial_gain_kernel import EndBeams, RadialCells, RadialZones, lay_radials, patch_gain_bounds
from insonify.engines.polar_grid import GOLDEN, MAX_CELL_WIDTH
from insonify.engines.resolution import Resolution
from insonify.engines.terrain_profiles import GainBound
from insonify.propagation.families import bounce_sequence, image_depth
from insonify.propagation.propagation_model import ReachableRange
from insonify.propagation.refracted_rays import RefractedRays
from insonify.recent_results import Identity, RecentResults
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]

ZoneClimbs = Callable[[tuple[float, float]], Floats]
"""Function of a zone, nearest and farthest distance [m], that returns distances times tangents of the launch angles of
each family for some distances of the zone [m], (f, k)."""

CELLS_PER_SECTOR = 128
"""Number of cells whose gain is bounded together, before that of each."""
LOW_GAIN = 10 ** (-25 / 20)
"""Two-way pressure gain below which a radial represents several cells [1]: -25 dB."""
SIDE_LOBE = 10 ** (-20 / 20)
"""Largest two-way pressure gain at a distance below which `LOW_GAIN` is lowered in proportion [1]: -20 dB."""
CELLS_PER_LOW_GAIN_RADIAL = (16, 4)
"""Numbers of cells of a radial of low gain: the largest, and that of its parts where the gain is higher."""
MAX_PATCH_WIDTH = 0.5
"""Width of a patch of the seabed above which the gain towards it is not bounded [rad]."""
LOW_GAIN_STRIDE = 2
"""Steps of the frame between the samples of the widest radials."""


class ViewedBoundary(NamedTuple):
    """Boundary that a sonar insonifies, and the rays to it."""

    depth: float
    """Depth of the boundary [m]."""
    families: tuple[str, ...]
    """Families that reach it."""
    rise: float = 0.0
    """Largest deviation of the boundary from its depth [m], less than the sonar's height above it."""
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
        floor: Two-way pressure gain below which the boundary is left out [1].
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
    boresight = float(np.arctan2(ping_geometry.boresight[1], ping_geometry.boresight[0]))
    zones = _zones(window_range, height, source, boundary)
    most = int((cell_count // zones.merged).sum())
    middle, radials = np.empty(most), np.empty((most, 9))
    n = lay_radials(
        zones,
        RadialCells(
            boresight, cell_count, CELLS_PER_SECTOR, *CELLS_PER_LOW_GAIN_RADIAL, LOW_GAIN_STRIDE, float(floor),
            LOW_GAIN, SIDE_LOBE,
        ),
        EndBeams(
            ping_geometry.transmit_beams.kernel_majorants, ping_geometry.bounding_receive_beams.kernel_majorants,
            bool(ping_geometry.same_beams),
        ),
        middle, radials,
    )  # fmt: skip
    bearing, number, radials = middle[:n] - heading, np.arange(n), radials[:n].copy()
    radials[:, column.COSINE], radials[:, column.SINE] = np.cos(bearing), np.sin(bearing)
    np.maximum(radials[:, column.START], window_range.nearest, out=radials[:, column.START])
    radials[:, column.FIRST_SAMPLE], radials[:, column.NUMBER] = 1 - np.mod((number + 0.5) * GOLDEN, 1.0), number
    return radials


@lru_cache(maxsize=8)  # both sides of a sonar have the same
def _zones(
    window_range: ReachableRange, height: float, source: float, boundary: ViewedBoundary,
) -> RadialZones:  # fmt: skip
    """Zones of the received distances, halved from the farthest inwards, with the verticals of each image source."""
    image_verticals = _image_verticals(boundary.families, source, boundary.depth)
    inner, outer, merged = [], [], []
    distance = window_range.farthest
    while distance > window_range.nearest and distance > 0:
        merged.append(1 << int(min(max(math.log2(math.hypot(distance, height) / distance), 0), 4)))
        outer.append(distance)
        distance = distance / 2 if merged[-1] < 16 else 0.0
        inner.append(distance)
    distances = np.array([inner, outer], float).T
    verticals, is_odd = np.repeat(image_verticals[0][None], len(merged), axis=0), image_verticals[1]
    if boundary.climbs is not None and merged:
        climbs = np.stack([boundary.climbs(zone) for zone in zip(inner, outer, strict=True)])
        verticals, is_odd = climbs.reshape(len(climbs), -1), np.repeat(is_odd, climbs.shape[2])
    # a zone of a flat boundary to which rays have all elevations of rays to relief within the zone itself
    rise, least_height = boundary.rise, np.maximum(np.abs(verticals).min(axis=1), 1e-6)
    over_relief = np.empty((len(merged), 2))
    over_relief[:, 0] = distances[:, 0] * least_height / (least_height + rise)
    over_relief[:, 1] = distances[:, 1] * least_height / np.maximum(least_height - rise, 1e-9 * least_height)
    return RadialZones(np.ascontiguousarray(distances), over_relief, np.array(merged, np.int64), verticals, is_odd)


def radial_gain_bound(
    ping_geometry: PingGeometry, bearing: Floats, width: float, zone: tuple[float, float], vertical_distances: Floats,
    is_odd: NDArray[np.bool_],
) -> Floats:  # fmt: skip
    """Upper bound of the two-way pressure gain towards patches of a boundary about some bearings [1], shape (n,).

    Args:
        ping_geometry: The sonar, both ends at one position.
        bearing: Middle of each patch [rad], shape (n,).
        width: Width of the patches [rad].
        zone: Nearest and farthest horizontal distance of the patches [m].
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


def bearing_gain_bound(
    ping_geometry: PingGeometry, depth: float, families: tuple[str, ...], rays: RefractedRays | None = None
) -> GainBound | None:
    """Bound of the two-way pressure gain over intervals of bearing at one ping; None if bistatic.

    Pings with the same beams and depths have the same function.

    Args:
        ping_geometry: The sonar.
        depth: Depth of the seabed [m].
        families: Families that reach it.
        rays: Rays of layered water; None: rays are straight.
    """
    if ping_geometry.receive_track_extent is not None or not families:
        return None
    positions = ping_geometry.transmit_position, ping_geometry.receive_position
    ends = tuple(sorted({float(position[2]) for position in positions}))
    end_distance = float(np.linalg.norm(positions[0] - positions[1]))
    objects = map(Identity, (ping_geometry.transmit_beams, ping_geometry.receive_beams, ping_geometry.elements, rays))
    key = (*objects, ends, end_distance, depth, families)
    return _GAIN_BOUNDS.get(key, lambda: _bearing_gain_bound(ping_geometry, depth, families, ends, end_distance, rays))


_GAIN_BOUNDS: RecentResults[GainBound] = RecentResults(8)


def _bearing_gain_bound(
    ping_geometry: PingGeometry, depth: float, families: tuple[str, ...], ends: tuple[float, ...], end_distance: float,
    rays: RefractedRays | None,
) -> GainBound:  # fmt: skip
    """Bound of the two-way pressure gain without the cache, for ends at given depths and distance of each other [m]."""
    vertical_distances, is_odd = (
        np.concatenate(columns)
        for columns in zip(*(_image_verticals(families, end, depth) for end in ends), strict=True)
    )

    def gain_bound(bearing: Floats, width: float, zone: tuple[float, float]) -> Floats:
        parallax = 2 * float(np.arctan2(end_distance, zone[0])) if end_distance > 0 else 0.0  # of the other end
        if width + parallax > MAX_PATCH_WIDTH:
            return np.full(len(bearing), np.inf)
        verticals, odd = vertical_distances, is_odd
        if rays is not None:
            climbs = np.concatenate([rays.zone_climbs(families, end, depth, zone) for end in ends])
            verticals, odd = climbs.ravel(), np.repeat(is_odd, climbs.shape[1])
        return radial_gain_bound(ping_geometry, np.asarray(bearing, float), width + parallax, zone, verticals, odd)

    return gain_bound


def _patch_gain_bounds(
    beams: Beams, bearing: Floats, width: float, zone: tuple[float, float], vertical_distances: Floats,
    is_odd: NDArray[np.bool_]
) -> Floats:  # fmt: skip
    """Upper bound of one end's pressure pattern [1], shape (n,); arguments are those of `radial_gain_bound`."""
    gain = np.empty(len(bearing))
    patch_gain_bounds(bearing, width, zone, vertical_distances, is_odd, beams.kernel_majorants, gain)
    return gain
