"""Coordinate frames and the rotations between them.

World: x north, y east, z down; z = 0 is the mean sea surface, so z is depth.
Body: x to the bow, y to starboard, z down.
Array: first axis along the boresight, then to the right of it, then down.

Heading is the compass heading, clockwise from north; pitch is bow up; roll is starboard
down. A mounting's bearing is clockwise from the bow, its tilt is down. These are the
navigator's own signs. All angles are in radians, and all frames are right handed.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def pose_rotation(heading: ArrayLike, pitch: ArrayLike = 0.0, roll: ArrayLike = 0.0) -> Floats:
    """Attitude of a platform in the world: its bow, starboard and keel directions.

    Args:
        heading: Compass heading, clockwise from north [rad], any shape.
        pitch: Bow up [rad], broadcast against heading.
        roll: Starboard side down [rad], broadcast against heading.

    Returns:
        Rotation, body to world, shape (..., 3, 3). Its columns are the body's axes in the
        world, so `rotation @ vector_in_body` is the vector in the world.

    The turns are applied in the navigator's order: heading, then pitch, then roll.
    """
    heading, pitch, roll = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in (heading, pitch, roll)))
    ch, sh = np.cos(heading), np.sin(heading)
    cp, sp = np.cos(pitch), np.sin(pitch)
    cr, sr = np.cos(roll), np.sin(roll)
    bow = ch * cp, sh * cp, -sp
    starboard = ch * sp * sr - sh * cr, sh * sp * sr + ch * cr, cp * sr
    keel = ch * sp * cr + sh * sr, sh * sp * cr - ch * sr, cp * cr
    rotation = np.empty((*heading.shape, 3, 3))
    for column, axis in enumerate((bow, starboard, keel)):
        for row, part in enumerate(axis):
            rotation[..., row, column] = part
    return rotation


def mounting_rotation(bearing: ArrayLike, tilt: ArrayLike = 0.0) -> Floats:
    """Attitude of an array on its platform: its boresight, right and down directions.

    Args:
        bearing: Bearing of the boresight, clockwise from the bow [rad], any shape.
        tilt: Tilt of the boresight, down from the deck plane [rad], broadcast against bearing.

    Returns:
        Rotation, body to array, shape (..., 3, 3). Its rows are the array's axes in the
        body, so `rotation @ vector_in_body` is the vector in the array's axes.
    """
    bearing, tilt = np.broadcast_arrays(np.asarray(bearing, dtype=float), np.asarray(tilt, dtype=float))
    cb, sb = np.cos(bearing), np.sin(bearing)
    ct, st = np.cos(tilt), np.sin(tilt)
    boresight = np.stack([ct * cb, ct * sb, st], axis=-1)
    right = np.stack([-sb, cb, np.zeros_like(sb)], axis=-1)
    down = np.stack([-st * cb, -st * sb, ct], axis=-1)
    return np.stack([boresight, right, down], axis=-2)


def array_axes(pose: Floats, mounting: Floats) -> Floats:
    """An array's boresight, right and down directions in the world.

    Args:
        pose: Body to world, from `pose_rotation`, shape (..., 3, 3).
        mounting: Body to array, from `mounting_rotation`, shape (..., 3, 3).

    Returns:
        Rotation, world to array, shape (..., 3, 3). For a unit vector d in the world,
        `axes @ d` is its direction cosines (w, u, v): along boresight, right and down.
    """
    return np.asarray(mounting @ np.swapaxes(pose, -1, -2))


def direction(bearing: ArrayLike, elevation: ArrayLike = 0.0) -> Floats:
    """Unit vector that points along a bearing and an elevation.

    Args:
        bearing: Clockwise from the first axis (north, or the bow) [rad], any shape.
        elevation: Down from the plane of the first two axes [rad], broadcast against bearing.

    Returns:
        Unit vectors [1], shape (..., 3).
    """
    bearing, elevation = np.broadcast_arrays(np.asarray(bearing, dtype=float), np.asarray(elevation, dtype=float))
    horizontal = np.cos(elevation)
    return np.stack([horizontal * np.cos(bearing), horizontal * np.sin(bearing), np.sin(elevation)], axis=-1)
