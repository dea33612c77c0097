"""Kernel of straight legs from image sources, folded between surface and bottom. Plain numbers and arrays only."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.families import Bounces

Floats = NDArray[np.float64]
Integers = NDArray[Any]

CLEAR, FACING_AWAY, OCCLUDED = 0, 1, 2  # the values of records.legs.LegStatus


class FoldedLegs(NamedTuple):
    """Straight legs from one sonar, folded at flat boundaries: f families."""

    source: Floats
    """North, east, depth of the sonar [m], (3,)."""
    image_depths: Floats
    """Depth of the image source of each family [m], (f,)."""
    bounces: Integers
    """Number of bounces of each family, (f,)."""
    first_up: NDArray[np.bool_]
    """True where the first bounce is at the surface, (f,)."""
    water_depth: float
    """Depth of the plane that reflects at the bottom [m]."""


class StraightLegs(NamedTuple):
    """Columns of straight legs: f families to n points."""

    delay: Floats
    """One-way travel time [s], (f, n)."""
    length: Floats
    """Path length [m], (f, n)."""
    spreading: Floats
    """Pressure re that at 1 m by spreading, 1 m over the length [1], (f, n)."""
    departure: Floats
    """Unit vector of travel at the sonar, (f, n, 3)."""
    arrival: Floats
    """Unit vector of travel at the point, (f, n, 3)."""
    grazing_sine: Floats
    """Sine of the grazing angle at the point's interface, negative from behind; 0 without one [1], (f, n)."""
    status: Integers
    """`LegStatus`, (f, n)."""
    occluder: Integers
    """Row of the first box that cuts the leg, -1 for none, (f, n)."""


class BoxCrossing(NamedTuple):
    """Passage of a leg over the footprint of an upright box, seen from above."""

    enter: float
    """Fraction of the leg's horizontal distance at which it comes over the footprint [1]."""
    leave: float
    """Fraction at which the leg leaves the footprint [1]; less than `enter` where the leg misses it."""
    top: float
    """Depth of the box's top [m]."""
    base: float
    """Depth of its base [m]."""
    is_own: bool
    """True where the leg ends on this box."""


@njit(cache=True, nogil=True, error_model="numpy")
def straight_legs(
    folded: FoldedLegs, speed: float, points: Floats, normals: Floats, boxes: Floats, own_box: int, legs: StraightLegs
) -> None:
    """Write the geometry of every leg, and its occlusion by boxes.

    Args:
        folded: Image sources of the families.
        speed: Speed of sound [m/s].
        points: North, east, depth of the scatterers [m], (n, 3).
        normals: Unit normals of the scatterers, 0 for those without an interface, (n, 3).
        boxes: Occluding bodies, (b, 8), see `insonify.scene.box.box_body`.
        own_box: Row of the box that the points lie on, or -1.
        legs: Result.
    """
    (source, image_depths, bounces, _, _), slowness = folded, 1 / speed
    delay, length, spreading, departure, arrival, grazing_sine, status, occluder = legs
    for f in range(image_depths.size):
        sign = 1.0 if bounces[f] % 2 == 0 else -1.0
        for n in range(points.shape[0]):
            dx = points[n, 0] - source[0]
            dy = points[n, 1] - source[1]
            dz = points[n, 2] - image_depths[f]
            distance = max(math.sqrt(dx * dx + dy * dy + dz * dz), 1e-6)
            inverse = 1 / distance
            length[f, n], delay[f, n], spreading[f, n] = distance, distance * slowness, inverse
            arrival[f, n, 0] = departure[f, n, 0] = dx * inverse
            arrival[f, n, 1] = departure[f, n, 1] = dy * inverse
            arrival[f, n, 2] = dz * inverse
            departure[f, n, 2] = sign * dz * inverse
            sine = -(dx * normals[n, 0] + dy * normals[n, 1] + dz * normals[n, 2]) * inverse
            grazing_sine[f, n] = min(1.0, max(-1.0, sine))
            occluder[f, n] = -1
            # A point without a normal scatters in all directions.
            has_no_normal = normals[n, 0] == 0 and normals[n, 1] == 0 and normals[n, 2] == 0
            status[f, n] = CLEAR if sine > 0 or has_no_normal else FACING_AWAY
        if boxes.shape[0] > 0:
            _occlude_by_boxes(folded, f, points, boxes, own_box, status[f], occluder[f])


@njit(cache=True, nogil=True, error_model="numpy")
def write_factors(
    status: Integers, needed: NDArray[np.bool_], surface_product: NDArray[np.complex128],
    reflection_coefficient: NDArray[np.complex128], visibility: Floats,
) -> None:  # fmt: skip
    """Write reflection and visibility of every leg, as far as they follow from its family and status.

    Args:
        status: `LegStatus`, (f, n).
        needed: True for the legs to evaluate, (f, n); (f, 0): all.
        surface_product: Product of the surface's reflection coefficients of each family [1], (f,).
        reflection_coefficient: Result: that product, 0 for legs that are not needed [1], (f, n).
        visibility: Result: 1 for clear legs, 0 for others [1], (f, n).
    """
    for f in range(status.shape[0]):
        for n in range(np.uint64(status.shape[1])):
            visibility[f, n] = 1.0 if status[f, n] == CLEAR else 0.0
            reflection_coefficient[f, n] = surface_product[f]
        for n in range(needed.shape[1]):
            if not needed[f, n]:
                reflection_coefficient[f, n] = 0.0


@njit(cache=True, nogil=True, error_model="numpy")
def mark_legs(
    folded: FoldedLegs, points: Floats, normals: Floats, boxes: Floats, own_box: int, status: Integers,
    occluder: Integers,
) -> None:  # fmt: skip
    """Write only status and occluder of every leg; results and arguments as in `straight_legs`."""
    source, image_depths = folded.source, folded.image_depths
    for f in range(image_depths.size):
        for n in range(points.shape[0]):
            dx, dy, dz = points[n, 0] - source[0], points[n, 1] - source[1], points[n, 2] - image_depths[f]
            facing = -(dx * normals[n, 0] + dy * normals[n, 1] + dz * normals[n, 2])
            has_no_normal = normals[n, 0] == 0 and normals[n, 1] == 0 and normals[n, 2] == 0
            status[f, n], occluder[f, n] = CLEAR if facing > 0 or has_no_normal else FACING_AWAY, -1
        if boxes.shape[0] > 0:
            _occlude_by_boxes(folded, f, points, boxes, own_box, status[f], occluder[f])


@njit(cache=True, nogil=True, error_model="numpy")
def _occlude_by_boxes(
    folded: FoldedLegs, f: int, points: Floats, boxes: Floats, own_box: int, status: Integers, occluder: Integers
) -> None:
    """Mark the clear legs of family f that boxes cut, see `straight_legs`."""
    (source, image_depths, bounces, first_up, water_depth) = folded
    for n in range(points.shape[0]):
        if status[n] != CLEAR:
            continue
        dx, dy, dz = points[n, 0] - source[0], points[n, 1] - source[1], points[n, 2] - image_depths[f]
        leg_bounces = Bounces(bounces[f], first_up[f] if bounces[f] > 0 else dz < 0)
        box_row = first_occluder(source, dx, dy, abs(dz), leg_bounces, water_depth, boxes, own_box)
        if box_row >= 0:
            status[n], occluder[n] = OCCLUDED, box_row


@njit(cache=True, nogil=True, error_model="numpy")
def first_occluder(
    source: Floats, dx: float, dy: float, vertical_travel: float, bounces: Bounces, water_depth: float, boxes: Floats,
    own_box: int,
) -> int:  # fmt: skip
    """Row of the first box that cuts a leg, or -1.

    Seen from above a leg is one straight line, whatever reflects it; only its depth folds. source: its start [m], (3,);
    dx, dy: its horizontal extent north, east [m]; vertical_travel: its unfolded vertical travel [m].
    """
    for b in range(boxes.shape[0]):
        enter, leave = footprint_crossing(source, dx, dy, boxes, b)
        if enter > leave:
            continue
        box = BoxCrossing(enter, leave, boxes[b, 6], boxes[b, 7], b == own_box)
        if hits_in_depth(source[2], vertical_travel, bounces, water_depth, box):
            return b
    return -1


@njit(cache=True, nogil=True, error_model="numpy")
def footprint_crossing(source: Floats, dx: float, dy: float, boxes: Floats, b: int) -> tuple[float, float]:
    """Fractions of the horizontal distance, 0 to 1, at which a leg enters and leaves the footprint of box b.

    Enter exceeds leave where the leg misses it; a vertical leg over the footprint has 0 and 1.
    """
    c, s = boxes[b, 2], boxes[b, 3]
    x = source[0] - boxes[b, 0]
    y = source[1] - boxes[b, 1]
    enter, leave = 0.0, 1.0
    for axis in range(2):
        position = c * x + s * y if axis == 0 else c * y - s * x
        step = c * dx + s * dy if axis == 0 else c * dy - s * dx
        half = boxes[b, 4 + axis]
        if abs(step) < 1e-12:
            if abs(position) > half:
                return 1.0, 0.0
        else:
            near_side = (-math.copysign(half, step) - position) / step
            far_side = (math.copysign(half, step) - position) / step
            enter = max(enter, near_side)
            leave = min(leave, far_side)
    return enter, leave


@njit(cache=True, nogil=True, error_model="numpy")
def hits_in_depth(
    depth: float, vertical_travel: float, bounces: Bounces, water_depth: float, box: BoxCrossing
) -> bool:  # fmt: skip
    """Return True if the folded leg is at a depth of the box while over its footprint.

    A leg that ends on the box itself may touch it with its last segment: the box is convex, and the end of the leg lies
    on a face that is in contact with water.
    """
    start = 0.0
    goes_down = not bounces.first_up
    z = depth
    for segment in range(bounces.number + 1):
        is_last = segment == bounces.number
        if is_last:
            stop = 1.0
        else:
            span = (water_depth - z) if goes_down else z
            stop = start + span / max(vertical_travel, 1e-12)
        if not (is_last and box.is_own) and box.enter <= stop and box.leave >= start:
            sense = 1.0 if goes_down else -1.0
            z1 = z + sense * vertical_travel * (max(box.enter, start) - start)
            z2 = z + sense * vertical_travel * (min(box.leave, stop) - start)
            if max(z1, z2) >= box.top and min(z1, z2) <= box.base:
                return True
        z = water_depth if goes_down else 0.0
        goes_down = not goes_down
        start = stop
    return False
