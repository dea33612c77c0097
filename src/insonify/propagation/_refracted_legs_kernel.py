"""Kernels from rays in layered water to legs: directions, grazing angles, boxes. Plain numbers and arrays only."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._eigenray_kernel import (
    AMPLITUDE,
    CAUSTICS,
    DELAY,
    FOLD_SIDE,
    LENGTH,
    SIN_ARRIVAL,
    SIN_LAUNCH,
    SLOWNESS,
    RaySolutions,
)
from insonify.propagation._image_source_kernel import CLEAR, FACING_AWAY, OCCLUDED, BoxCrossing, footprint_crossing
from insonify.propagation._refracted_box_shadow import LaunchedRay, ray_hits_box
from insonify.propagation.families import Bounces
from insonify.propagation.sound_speed_layers import SoundSpeedLayers

Floats = NDArray[np.float64]
Integers = NDArray[Any]

SHADOW = 3  # the value of records.legs.LegStatus


class HorizontalGeometry(NamedTuple):
    """Legs of one sonar to n points seen from above, common to all rays to a point."""

    source: Floats
    """North, east, depth of the sonar [m], (3,)."""
    points: Floats
    """North, east, depth of the scatterers [m], (n, 3)."""
    distance: Floats
    """Horizontal distance of the points [m], (n,)."""
    depth: Floats
    """Depth of the points [m], clamped between surface and bottom, (n,)."""
    north: Floats
    """North component of the horizontal unit vector to the points [1], (n,)."""
    east: Floats
    """East component of that vector [1], (n,)."""
    speed: Floats
    """Sound speed at the points [m/s], (n,)."""


class RefractedLegs(NamedTuple):
    """Columns of refracted legs: one row for each branch of each family, to n points."""

    delay: Floats
    """One-way travel time [s], (rows, n)."""
    length: Floats
    """Path length [m], (rows, n)."""
    spreading: Floats
    """Pressure re that at 1 m by ray-tube spreading [1], (rows, n)."""
    caustics: Integers
    """Number of caustics touched, (rows, n)."""
    slowness: Floats
    """Horizontal slowness [s/m], (rows, n)."""
    departure: Floats
    """Unit vector of travel at the sonar, (rows, n, 3)."""
    arrival: Floats
    """Unit vector of travel at the point, (rows, n, 3)."""
    grazing_sine: Floats
    """Sine of the grazing angle at the point's interface, negative from behind; 0 for no leg [1], (rows, n)."""
    status: Integers
    """`LegStatus`, (rows, n)."""
    occluder: Integers
    """Row of the first occluder that cuts the leg, -1 for none, (rows, n)."""


@njit(cache=True, nogil=True, error_model="numpy")
def set_horizontal_geometry(water: SoundSpeedLayers, legs: HorizontalGeometry) -> None:
    """Write distance, depth, bearing and sound speed of the points of legs from the other two fields."""
    knots, speeds, (position, points, distance, depths, north, east, speed) = water.depth, water.speed, legs
    layer = 0
    for n in range(points.shape[0]):
        dx, dy = points[n, 0] - position[0], points[n, 1] - position[1]
        horizontal = math.sqrt(dx * dx + dy * dy)
        depth = min(max(points[n, 2], 0.0), knots[-1])
        while layer > 0 and depth < knots[layer]:
            layer -= 1
        while layer < knots.size - 2 and depth > knots[layer + 1]:
            layer += 1
        fraction = (depth - knots[layer]) / (knots[layer + 1] - knots[layer])
        distance[n], depths[n] = horizontal, depth
        north[n], east[n] = (dx / horizontal, dy / horizontal) if horizontal > 1e-12 else (1.0, 0.0)
        speed[n] = speeds[layer] + fraction * (speeds[layer + 1] - speeds[layer])


@njit(cache=True, nogil=True, error_model="numpy")
def refracted_leg_row(
    geometry: HorizontalGeometry, normals: Floats, source_speed: float, followed: Integers, solutions: RaySolutions,
    branch: int, legs: RefractedLegs, row: int,
) -> bool:  # fmt: skip
    """Write the legs of one branch of one family.

    Args:
        geometry: The legs seen from above.
        normals: Unit normals of the points, (n, 3).
        source_speed: Sound speed at the sonar [m/s].
        followed: Rows of the m points to which the family is evaluated, increasing; others get no leg.
        solutions: Rays of the family to these m points.
        branch: Index of the ray among those of each point.
        legs: Result.
        row: Row of the result.

    Returns:
        True if any of the rays lies on a segment that ends at a fold.
    """
    rays, count, missing = solutions
    has_folds, m = False, 0
    source, _, distance, depth, norths, easts, speed = geometry
    source_depth = source[2]
    delay, length, slowness, status = legs.delay[row], legs.length[row], legs.slowness[row], legs.status[row]
    spreading, caustics, grazing_sine = legs.spreading[row], legs.caustics[row], legs.grazing_sine[row]
    departure, arrival = legs.departure[row], legs.arrival[row]
    for n in range(delay.size):
        north, east = norths[n], easts[n]
        k = -1
        if m < followed.size and followed[m] == n:
            k, m = m, m + 1
        if k < 0 or branch >= count[k]:
            # No leg: values of a straight line, which keep later arithmetic finite.
            dz = depth[n] - source_depth
            straight_length = max(math.sqrt(distance[n] ** 2 + dz * dz), 1e-6)
            cosine, down = distance[n] / straight_length, dz / straight_length
            delay[n], length[n], slowness[n] = straight_length / source_speed, straight_length, cosine / source_speed
            spreading[n], caustics[n] = 0.0, 0
            launch_cosine, arrival_cosine, arrival_down = cosine, cosine, down
            status[n] = missing[k] if k >= 0 and count[k] == 0 else SHADOW
        else:
            p = rays[k, branch, SLOWNESS]
            delay[n], length[n], slowness[n] = rays[k, branch, DELAY], rays[k, branch, LENGTH], p
            spreading[n], caustics[n] = rays[k, branch, AMPLITUDE], int(rays[k, branch, CAUSTICS])
            launch_cosine, arrival_cosine = p * source_speed, p * speed[n]
            down, arrival_down = rays[k, branch, SIN_LAUNCH], rays[k, branch, SIN_ARRIVAL]
            has_folds |= rays[k, branch, FOLD_SIDE] != 0
            status[n] = CLEAR
        departure[n, 0], departure[n, 1], departure[n, 2] = launch_cosine * north, launch_cosine * east, down
        arrival[n, 0], arrival[n, 1], arrival[n, 2] = arrival_cosine * north, arrival_cosine * east, arrival_down
        if status[n] != CLEAR:
            grazing_sine[n] = 0.0
            continue
        sine = -(arrival_cosine * (north * normals[n, 0] + east * normals[n, 1]) + arrival_down * normals[n, 2])
        grazing_sine[n] = min(1.0, max(-1.0, sine))
        # A point without a normal scatters in all directions.
        has_no_normal = normals[n, 0] == 0 and normals[n, 1] == 0 and normals[n, 2] == 0
        if not (sine > 0 or has_no_normal):
            status[n] = FACING_AWAY
    return has_folds


@njit(cache=True, nogil=True, error_model="numpy")
def occlude_row_by_boxes(
    water: SoundSpeedLayers, geometry: HorizontalGeometry, bounces: Bounces, boxes: Floats, own_box: int,
    legs: RefractedLegs, row: int,
) -> None:  # fmt: skip
    """Mark the clear legs of one row that a box cuts. Seen from above a leg is straight, also a refracted one.

    Args:
        water: The water column.
        geometry: The legs seen from above.
        bounces: Bounces of the family.
        boxes: Occluding bodies, (b, 8), see `insonify.scene.box.box_body`.
        own_box: Row of the box that the points lie on, or -1.
        legs: Changed: `status` and `occluder` of the row.
        row: The row.
    """
    source, points, distance, depth = geometry.source, geometry.points, geometry.distance, geometry.depth
    slowness, departure, status = legs.slowness[row], legs.departure[row], legs.status[row]
    occluder = legs.occluder[row]
    for n in range(status.size):
        if status[n] != CLEAR:
            continue
        dx, dy = points[n, 0] - source[0], points[n, 1] - source[1]
        ray = LaunchedRay(source[2], slowness[n], departure[n, 2], distance[n], depth[n])
        for b in range(boxes.shape[0]):
            enter, leave = footprint_crossing(source, dx, dy, boxes, b)
            box = BoxCrossing(enter, leave, boxes[b, 6], boxes[b, 7], b == own_box)
            if enter <= leave and ray_hits_box(water, bounces, ray, box):
                status[n], occluder[n] = OCCLUDED, b
                break


@njit(cache=True, nogil=True, error_model="numpy")
def bodies_passed_over(
    position: Floats, leg_ends: Floats, bounds: Floats, status: Integers
) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats, Floats]:
    """Pairs of clear legs and bodies that the leg passes over, seen from above.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        leg_ends: North, east, depth of the ends of the legs [m], (n, 3).
        bounds: Least north, east, depth and greatest ones of the bodies [m], (b, 6).
        status: `LegStatus` of the legs, (n,).

    Returns:
        Rows of legs and of bodies, and the fractions of the leg at which it enters and leaves the body, all (m,).
    """
    count, capacity = 0, 256
    legs, bodies, spans = np.empty(capacity, np.int64), np.empty(capacity, np.int64), np.empty((capacity, 2))
    for n in range(leg_ends.shape[0]):
        if status[n] != CLEAR:
            continue
        x, y = leg_ends[n, 0] - position[0], leg_ends[n, 1] - position[1]
        square = x * x + y * y
        for b in range(bounds.shape[0]):
            # the circle around a body first: most legs miss it
            u, v = (bounds[b, 0] + bounds[b, 3]) / 2 - position[0], (bounds[b, 1] + bounds[b, 4]) / 2 - position[1]
            squared_diameter = (bounds[b, 3] - bounds[b, 0]) ** 2 + (bounds[b, 4] - bounds[b, 1]) ** 2
            offset = x * v - y * u
            if 4 * offset * offset > squared_diameter * square:
                continue
            first, last = 0.0, 1.0
            for axis in range(2):
                step, start = (x, position[0]) if axis == 0 else (y, position[1])
                low, high = bounds[b, axis] - start, bounds[b, axis + 3] - start
                if abs(step) < 1e-12:
                    if low > 0 or high < 0:
                        first, last = 1.0, 0.0
                else:
                    first = max(first, min(low / step, high / step))
                    last = min(last, max(low / step, high / step))
            if first > last:
                continue
            if count == capacity:
                capacity *= 2
                legs, bodies, spans = np.append(legs, legs), np.append(bodies, bodies), np.append(spans, spans, axis=0)
            legs[count], bodies[count], spans[count, 0], spans[count, 1] = n, b, first, last
            count += 1
    return legs[:count], bodies[:count], spans[:count, 0].copy(), spans[:count, 1].copy()
