"""Kernels from rays in layered water to legs: directions, grazing angles, boxes. Plain numbers and arrays only."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._eigenray_kernel import AMPLITUDE, CAUSTICS, DELAY, LENGTH, SIN_ARRIVAL, SIN_LAUNCH, SLOWNESS
from insonify.propagation._image_source_kernel import CLEAR, FACING_AWAY, OCCLUDED, footprint_crossing
from insonify.propagation._refracted_box_shadow import ray_hits_box

Floats = NDArray[np.float64]
Integers = NDArray[Any]

SHADOW = 3  # the value of records.legs.LegStatus
RANGE, DEPTH, NORTH, EAST, SPEED = range(5)
"""Rows of `horizontal_geometry`: quantities common to all rays to a point."""


@njit(cache=True, nogil=True, error_model="numpy")
def horizontal_geometry(knots: Floats, speeds: Floats, position: Floats, points: Floats, point_columns: Floats) -> None:
    """Horizontal distance, depth, bearing and sound speed of some points, clamped between surface and bottom.

    Args:
        knots: Depths of the column [m], (m,).
        speeds: Speeds there [m/s], (m,).
        position: North, east, depth of the sonar [m], (3,).
        points: Scatterers [m], (n, 3).
        point_columns: Result: distance [m], depth [m], north and east of the unit vector, sound speed [m/s], (5, n).
    """
    layer = 0
    for n in range(points.shape[0]):
        dx, dy = points[n, 0] - position[0], points[n, 1] - position[1]
        away = math.sqrt(dx * dx + dy * dy)
        depth = min(max(points[n, 2], 0.0), knots[-1])
        while layer > 0 and depth < knots[layer]:
            layer -= 1
        while layer < knots.size - 2 and depth > knots[layer + 1]:
            layer += 1
        part = (depth - knots[layer]) / (knots[layer + 1] - knots[layer])
        point_columns[RANGE, n], point_columns[DEPTH, n] = away, depth
        point_columns[NORTH, n], point_columns[EAST, n] = (dx / away, dy / away) if away > 1e-12 else (1.0, 0.0)
        point_columns[SPEED, n] = speeds[layer] + part * (speeds[layer + 1] - speeds[layer])


@njit(cache=True, nogil=True, error_model="numpy")
def refracted_leg_row(
    point_columns: Floats, normals: Floats, source_depth: float, source_speed: float, branch: int, rays: Floats,
    count: Integers, missing: Integers, delay: Floats, length: Floats, spreading: Floats, caustics: Integers,
    slowness: Floats, departure: Floats, arrival: Floats, grazing: Floats, status: Integers,
) -> None:  # fmt: skip
    """Fill the legs of one branch of one family.

    Args:
        point_columns: See `horizontal_geometry`, (5, n).
        normals: Unit normals of the points, (n, 3).
        source_depth: Depth of the sonar [m].
        source_speed: Sound speed at the sonar [m/s].
        branch: Index of the ray to each point.
        rays: The family's rays to the points, (n, branches, COLUMNS).
        count: Number of rays to each point, (n,).
        missing: `LegStatus` of the points without rays, (n,).
        delay: Result: one-way travel time [s], (n,).
        length: Result: path length [m], (n,).
        spreading: Result: spreading re 1 m [1], (n,).
        caustics: Result: caustics touched, (n,).
        slowness: Result: horizontal slowness [s/m], (n,).
        departure: Result: direction of travel at the sonar, (n, 3).
        arrival: Result: direction of travel at the point, (n, 3).
        grazing: Result: angle between the ray and the point's interface [rad], (n,).
        status: Result: `LegStatus`, (n,).
    """
    for n in range(delay.size):
        north, east = point_columns[NORTH, n], point_columns[EAST, n]
        if branch >= count[n]:
            # No leg: numbers of a straight line, which keep later arithmetic finite.
            dz = point_columns[DEPTH, n] - source_depth
            away = max(math.sqrt(point_columns[RANGE, n] ** 2 + dz * dz), 1e-6)
            level, down = point_columns[RANGE, n] / away, dz / away
            delay[n], length[n], slowness[n] = away / source_speed, away, level / source_speed
            spreading[n], caustics[n] = 0.0, 0
            launch, landing, down_there = level, level, down
            status[n] = missing[n] if count[n] == 0 else SHADOW
        else:
            p = rays[n, branch, SLOWNESS]
            delay[n], length[n], slowness[n] = rays[n, branch, DELAY], rays[n, branch, LENGTH], p
            spreading[n], caustics[n] = rays[n, branch, AMPLITUDE], int(rays[n, branch, CAUSTICS])
            launch, landing = p * source_speed, p * point_columns[SPEED, n]
            down, down_there = rays[n, branch, SIN_LAUNCH], rays[n, branch, SIN_ARRIVAL]
            status[n] = CLEAR
        departure[n, 0], departure[n, 1], departure[n, 2] = launch * north, launch * east, down
        arrival[n, 0], arrival[n, 1], arrival[n, 2] = landing * north, landing * east, down_there
        sine = -(landing * (north * normals[n, 0] + east * normals[n, 1]) + down_there * normals[n, 2])
        grazing[n] = math.asin(min(1.0, max(-1.0, sine)))
        # A point without a normal scatters in all directions.
        free = normals[n, 0] == 0 and normals[n, 1] == 0 and normals[n, 2] == 0
        if status[n] == CLEAR and not (sine > 0 or free):
            status[n] = FACING_AWAY


@njit(cache=True, nogil=True, error_model="numpy")
def occlude_row_by_boxes(
    knots: Floats, speeds: Floats, plane: float, position: Floats, points: Floats, point_columns: Floats, bounces: int,
    first_up: bool, slowness: Floats, departure: Floats, boxes: Floats, own_box: int, status: Integers,
    occluder: Integers,
) -> None:  # fmt: skip
    """Mark the clear legs of one row that a box cuts. Seen from above a leg is straight, also a refracted one.

    Args:
        knots: Depths of the column [m], (m,).
        speeds: Speeds there [m/s], (m,).
        plane: Depth of the knot that reflects sound [m]; infinite for the last one.
        position: North, east, depth of the sonar [m], (3,).
        points: Scatterers [m], (n, 3).
        point_columns: See `horizontal_geometry`, (5, n).
        bounces: Number of bounces of the family.
        first_up: True if the first is off the surface.
        slowness: Horizontal slowness of the rays [s/m], (n,).
        departure: Directions of the rays at the sonar, (n, 3).
        boxes: Occluding bodies, (b, 8), see `insonify.scene.box.box_body`.
        own_box: Row of the box that the points lie on, or -1.
        status: Result: `LegStatus`, (n,).
        occluder: Result: row of the first box that cuts the leg, (n,).
    """
    for n in range(slowness.size):
        if status[n] != CLEAR:
            continue
        dx, dy, away = points[n, 0] - position[0], points[n, 1] - position[1], point_columns[RANGE, n]
        for b in range(boxes.shape[0]):
            enter, leave = footprint_crossing(position, dx, dy, boxes, b)
            if enter <= leave and ray_hits_box(knots, speeds, plane, position[2], slowness[n], departure[n, 2], bounces,
                                           first_up, away, point_columns[DEPTH, n], enter * away, leave * away,
                                           boxes[b, 6],
                                           boxes[b, 7], b == own_box):  # fmt: skip
                status[n], occluder[n] = OCCLUDED, b
                break


@njit(cache=True, nogil=True, error_model="numpy")
def bodies_passed_over(
    position: Floats, leg_ends: Floats, bounds: Floats, status: Integers
) -> tuple[NDArray[np.int64], NDArray[np.int64], Floats, Floats]:
    """Pairs of clear legs and bodies that the leg passes over, seen from above.

    Args:
        position: North, east, depth of the sonar [m], (3,).
        leg_ends: Ends of the legs [m], (n, 3).
        bounds: Least and greatest coordinates of the bodies [m], (b, 6).
        status: `LegStatus` of the legs, (n,).

    Returns:
        Rows of legs and of bodies, and the fractions of the leg at which it enters and leaves the body, all (m,).
    """
    total = 0
    for fill in range(2):
        legs, bodies = np.empty(total, np.int64), np.empty(total, np.int64)
        enter, leave = np.empty(total), np.empty(total)
        row = 0
        for n in range(leg_ends.shape[0]):
            if status[n] != CLEAR:
                continue
            x, y = leg_ends[n, 0] - position[0], leg_ends[n, 1] - position[1]
            square = x * x + y * y
            for b in range(bounds.shape[0]):
                # the circle around a body first: most legs miss it
                u, v = (bounds[b, 0] + bounds[b, 3]) / 2 - position[0], (bounds[b, 1] + bounds[b, 4]) / 2 - position[1]
                reach = (bounds[b, 3] - bounds[b, 0]) ** 2 + (bounds[b, 4] - bounds[b, 1]) ** 2
                aside = x * v - y * u
                if 4 * aside * aside > reach * square:
                    continue
                near, far = 0.0, 1.0
                for axis in range(2):
                    step, start = (x, position[0]) if axis == 0 else (y, position[1])
                    low, high = bounds[b, axis] - start, bounds[b, axis + 3] - start
                    if abs(step) < 1e-12:
                        if low > 0 or high < 0:
                            near, far = 1.0, 0.0
                    else:
                        near = max(near, min(low / step, high / step))
                        far = min(far, max(low / step, high / step))
                if near > far:
                    continue
                if fill == 1:
                    legs[row], bodies[row], enter[row], leave[row] = n, b, near, far
                row += 1
        total = row
    return legs, bodies, enter, leave
