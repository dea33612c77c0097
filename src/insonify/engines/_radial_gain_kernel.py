"""Bounds of the two-way pressure gain towards patches of a boundary, and the radials that follow from them.

Plain numbers and arrays only.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import radial_columns as column
from insonify.jit import njit
from insonify.sonar.beam_kernels import BeamMajorants, array_cosines, largest_beam

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

BEARINGS_PER_PATCH = 5
"""Number of bearings at which a patch of the boundary is evaluated, from edge to edge."""
DISTANCES_PER_PATCH = 3
"""Number of distances at which it is evaluated, from edge to edge."""


class PatchRays(NamedTuple):
    """Straight rays to patches of one zone of distances, by f families."""

    reach: Floats
    """Horizontal distances [m], (`DISTANCES_PER_PATCH`,)."""
    inverse: Floats
    """One over the length of each ray [1/m], (f, `DISTANCES_PER_PATCH`)."""
    down: Floats
    """Cosine of each ray to the vertical at the sonar, positive down [1], (f, `DISTANCES_PER_PATCH`)."""


class RadialZones(NamedTuple):
    """Zones of horizontal distance, from the outermost inwards, and straight rays to them by f families."""

    distances: Floats
    """Inner and outer edge of each zone [m], (z, 2)."""
    over_relief: Floats
    """Edges of the zone of the flat boundary to which rays have all elevations of rays to relief in the zone [m],
    (z, 2)."""
    merged: Integers
    """Least number of cells of a radial, a power of 2, (z,)."""
    verticals: Floats
    """Vertical distance from each image source down to the boundary [m], (z, f)."""
    is_odd: NDArray[np.bool_]
    """True for families with an odd number of bounces, (f,)."""


class RadialCells(NamedTuple):
    """Cells of bearing, numbered from boresight, and how many of them one radial represents."""

    boresight: float
    """Bearing of the beam's axis [rad]."""
    whole_circle: int
    """Number of cells of the whole circle, a multiple of `per_sector`."""
    per_sector: int
    """Number of cells whose gain is bounded together first."""
    widest: int
    """Number of cells of a radial of low gain, a power of 2."""
    divided: int
    """Number of cells of the radials into which that is divided where the gain is higher, a power of 2."""
    stride: int
    """Steps of the frame between the samples of the widest radials."""
    floor: float
    """Two-way pressure gain below which the boundary is left out [1]."""
    low_gain: float
    """Two-way pressure gain below which a radial represents several cells [1]."""
    side_lobe: float
    """Two-way pressure gain; where the largest at a distance is below it, `low_gain` is lowered in proportion [1]."""


class EndBeams(NamedTuple):
    """Beams of both ends."""

    transmit: BeamMajorants
    receive: BeamMajorants
    same: bool
    """True if both are the same."""


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def aim_rays(zone: Floats, verticals: Floats, is_odd: NDArray[np.bool_], rays: PatchRays) -> None:
    """Fill straight rays to a zone.

    Args:
        zone: Horizontal distances of its inner and outer edge [m], (2,).
        verticals: Vertical distance from each image source down to it [m], (f,).
        is_odd: True for families with an odd number of bounces, (f,).
        rays: Result.
    """
    nearest, farthest = zone[0], zone[1]
    for j in range(DISTANCES_PER_PATCH):
        reach = nearest + (farthest - nearest) * 0.5 * j
        rays.reach[j] = reach
        for f in range(verticals.size):
            inverse = 1 / math.sqrt(reach * reach + verticals[f] * verticals[f])
            down = verticals[f] * inverse
            rays.inverse[f, j], rays.down[f, j] = inverse, -down if is_odd[f] else down


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def aim_bearings(bearing: float, width: float, bearings: Floats) -> None:
    """Fill cosine and sine of the bearings at which a patch is evaluated, (2, `BEARINGS_PER_PATCH`).

    Args:
        bearing: Middle of the patch in the world [rad].
        width: Its width [rad].
        bearings: Result [1].
    """
    for i in range(BEARINGS_PER_PATCH):
        azimuth = bearing + width * (i / (BEARINGS_PER_PATCH - 1) - 0.5)
        bearings[0, i], bearings[1, i] = math.cos(azimuth), math.sin(azimuth)


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def patch_gain_bound(bearings: Floats, rays: PatchRays, family: int, beams: BeamMajorants) -> float:
    """Upper bound of a beam's pressure pattern towards a patch by one family, from spans of direction cosines [1].

    Args:
        bearings: See `aim_bearings`.
        rays: Rays to the zone of the patch.
        family: Row of the family.
        beams: The beams.
    """
    u_min = v_min = np.inf
    w_max = u_max = v_max = -np.inf
    for i in range(BEARINGS_PER_PATCH):
        c, s = bearings[0, i], bearings[1, i]
        for j in range(DISTANCES_PER_PATCH):
            reach, inverse = rays.reach[j], rays.inverse[family, j]
            w, u, v = array_cosines(beams.axes, c * reach * inverse, s * reach * inverse, rays.down[family, j])
            w_max = max(w_max, w)
            u_min, u_max = min(u_min, u), max(u_max, u)
            v_min, v_max = min(v_min, v), max(v_max, v)
    return largest_beam(beams, w_max, (u_min, u_max), (v_min, v_max))


@njit(cache=True, nogil=True, error_model="numpy")
def patch_gain_bounds(
    bearing: Floats, width: float, zone: tuple[float, float], verticals: Floats, odd: NDArray[np.bool_],
    beams: BeamMajorants, out: Floats,
) -> None:  # fmt: skip
    """Fill bounds of the pressure pattern of one end over all families towards some patches.

    Args:
        bearing: Middle of each patch in the world [rad], (n,).
        width: Their width [rad].
        zone: Horizontal distances of their inner and outer edge [m].
        verticals: Vertical distance from each image source down to them [m], (f,).
        odd: True for families with an odd number of bounces, (f,).
        beams: The beams.
        out: Result [1], (n,).
    """
    rays, bearings = empty_rays(verticals.size), np.empty((2, BEARINGS_PER_PATCH))
    aim_rays(np.array(zone), verticals, odd, rays)
    for n in range(bearing.size):
        aim_bearings(bearing[n], width, bearings)
        out[n] = 0.0
        for f in range(verticals.size):
            out[n] = max(out[n], patch_gain_bound(bearings, rays, f, beams))


@njit(cache=True, nogil=True, error_model="numpy")
def empty_rays(families: int) -> PatchRays:
    """Rays with undefined contents."""
    return PatchRays(
        np.empty(DISTANCES_PER_PATCH), np.empty((families, DISTANCES_PER_PATCH)),
        np.empty((families, DISTANCES_PER_PATCH)),
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def two_way_bounds(
    bearings: Floats, patches: Integers, rays: PatchRays, ends: EndBeams, sufficient: float, gain: Floats
) -> None:
    """Fill upper bounds of the two-way pressure gain towards some patches by all families.

    Args:
        bearings: See `aim_bearings`, (any, 2, `BEARINGS_PER_PATCH`).
        patches: Rows of the patches in `bearings`, (n,).
        rays: Rays to the zone of the patches.
        ends: Beams of both ends.
        sufficient: Gain from which on no further family is evaluated: the bound is at least as large [1].
        gain: Result [1], (n,).
    """
    for n in range(patches.size):
        transmit = receive = 0.0
        for f in range(rays.inverse.shape[0]):
            transmit = max(transmit, patch_gain_bound(bearings[patches[n]], rays, f, ends.transmit))
            if not ends.same:
                receive = max(receive, patch_gain_bound(bearings[patches[n]], rays, f, ends.receive))
            gain[n] = transmit * (transmit if ends.same else receive)
            if gain[n] >= sufficient:
                break


@njit(cache=True, nogil=True, error_model="numpy")
def lay_radials(zones: RadialZones, cells: RadialCells, ends: EndBeams, middle: Floats, radials: Floats) -> int:
    """Lay out the radials of a ping.

    In each zone, sectors whose gain may exceed the floor are divided into radials of ever fewer cells while their gain
    is not low. A radial of the zone outside that has the same cells continues inwards.

    Args:
        zones: The zones.
        cells: The cells.
        ends: Beams of both ends.
        middle: Result, bearing of the middle of each radial [rad], longer than the number of radials.
        radials: Result, see `radial_columns`, without bearing, first sample and number, as long.

    Returns:
        Number of radials.
    """
    circle, families, n = cells.whole_circle, zones.verticals.shape[1], 0
    rays, relief_rays = empty_rays(families), empty_rays(families)
    every, gain = np.arange(circle), np.empty(circle)
    sectors, bearings = np.empty((2, circle, 2, BEARINGS_PER_PATCH))
    for k in range(circle // cells.per_sector):
        aim_cells(cells, k * cells.per_sector - circle // 2, cells.per_sector, sectors[k])
    last_radial = np.full(2 * circle, -1)  # of those of some number of cells from each cell on
    whole, parts, rows = np.empty(circle, np.int64), np.empty(circle, np.int64), np.empty(circle, np.int64)
    for z in range(zones.merged.size):
        inner, outer, merged = zones.distances[z, 0], zones.distances[z, 1], zones.merged[z]
        aim_rays(zones.distances[z], zones.verticals[z], zones.is_odd, rays)
        aim_rays(zones.over_relief[z], zones.verticals[z], zones.is_odd, relief_rays)
        sector = every[: circle // cells.per_sector]
        largest = largest_gain(sectors, sector[sector.size // 2 - 1 :][:2], rays, ends, cells.side_lobe, gain)
        if largest < cells.side_lobe:  # no larger gain than that matters, and most zones have it near the axis
            largest = largest_gain(sectors, sector, rays, ends, cells.side_lobe, gain)
        # near the sonar even the largest gain may be a side lobe of the vertical beam
        low_gain = cells.low_gain * min(largest / cells.side_lobe, 1.0)
        two_way_bounds(sectors, sector, relief_rays, ends, cells.floor, gain)
        m = 0
        for k in sector:
            if gain[k] >= cells.floor:
                whole[m], m = k * cells.per_sector - circle // 2, m + 1
        coarser, width = cells.per_sector, max(cells.widest, merged)
        while True:
            many, unsplit, m = m * (coarser // width), 0, 0
            for k in range(many):
                parts[k] = whole[k // (coarser // width)] + k % (coarser // width) * width
            if width >= cells.divided:
                for k in range(many):
                    aim_cells(cells, parts[k], width, bearings[k])
            if width > merged:
                two_way_bounds(bearings, every[:many], rays, ends, low_gain, gain)
            for k in range(many):
                if width > merged and gain[k] >= low_gain:
                    whole[m], m = parts[k], m + 1
                else:
                    rows[unsplit], unsplit = k, unsplit + 1
            if width >= cells.divided:
                two_way_bounds(bearings, rows[:unsplit], relief_rays, ends, cells.floor, gain)
            for k in range(unsplit):
                if width >= cells.divided and gain[k] < cells.floor:
                    continue
                node = (parts[rows[k]] + circle // 2 + circle) // width
                row = last_radial[node]
                if row < 0 or radials[row, column.START] != outer:  # after a zone of finer radials a new one begins
                    row, n = n, n + 1
                    last_radial[node], radials[row, column.STOP] = row, outer
                    middle[row] = fill_width(cells, parts[rows[k]], width, radials[row])
                radials[row, column.START] = inner
            if width == merged:
                break
            coarser, width = width, max(cells.divided, merged) if width > max(cells.divided, merged) else merged
    return n


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def fill_width(cells: RadialCells, first: int, width: int, radial: Floats) -> float:
    """Fill cell width, beam spread, stride of a radial of `width` cells from `first` on; return its bearing [rad]."""
    angle = 2 * math.pi / cells.whole_circle
    radial[column.CELL_WIDTH] = width * angle
    radial[column.BEAM_SPREAD] = width * angle if width >= cells.divided else 0.0
    radial[column.STRIDE] = cells.stride if width >= cells.widest else 1
    return cells.boresight + (first + width / 2) * angle


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def aim_cells(cells: RadialCells, first: int, width: int, bearings: Floats) -> None:
    """`aim_bearings` for a patch of `width` cells from cell `first` on."""
    angle = 2 * math.pi / cells.whole_circle
    aim_bearings(cells.boresight + (first + width / 2) * angle, width * angle, bearings)


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def largest_gain(
    bearings: Floats, patches: Integers, rays: PatchRays, ends: EndBeams, sufficient: float, gain: Floats
) -> float:
    """Largest of the `two_way_bounds` [1]; arguments are those of that function, `gain` a working array."""
    two_way_bounds(bearings, patches, rays, ends, sufficient, gain)
    largest = 0.0
    for n in range(patches.size):
        largest = max(largest, gain[n])
    return largest
