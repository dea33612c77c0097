"""The smooth faces of a target as triangles in the world: round where the sound would notice, and above ground only."""

import numpy as np
from numpy.typing import NDArray

from insonify.scene.seabed import Seabed
from insonify.scene.shapes import AROUND
from insonify.scene.solid import body_triangles, finer_triangles, ground_depth, resting
from insonify.scene.target import Cone, Cylinder, Solid, Sphere, TruncatedCone

Floats = NDArray[np.float64]

ROUND = 0.25
"""Most by which a step of a round shape may change the phase of an echo [rad]."""
MOST_AROUND = 4 * AROUND
"""Steps of a round shape about its axis at most [1]."""
_TOUCHING = 1e-6  # a face this close to the bed lies on it [m]


def radius(solid: Solid) -> float:
    """Greatest radius of a shape that can be made rounder [m]; 0 for all others."""
    match solid:
        case Sphere(diameter=diameter) | Cylinder(diameter=diameter) | Cone(diameter=diameter):
            return diameter / 2
        case TruncatedCone(diameter=diameter, top_diameter=top):
            return max(diameter, top) / 2
    return 0.0


def steps_around(solid: Solid, wavelength: float) -> int:
    """Steps about the axis in which a round shape is as good as round, a multiple of `AROUND` [1].

    Args:
        solid: The solid.
        wavelength: Of the sound [m].
    """
    enough = (n for n in range(AROUND, MOST_AROUND, AROUND) if phase_of_steps(solid, n, wavelength) <= ROUND)
    return next(enough, MOST_AROUND)


def phase_of_steps(solid: Solid, around: int, wavelength: float) -> float:
    """Most by which the steps of a round shape change the phase of an echo [rad]; 0 for all other shapes.

    Between two corners a step of N lies r (1 - cos(pi / N)) inside the circle, and an echo goes there and back.

    Args:
        solid: The solid.
        around: Steps about the axis.
        wavelength: Of the sound [m].
    """
    return float(4 * np.pi / wavelength * radius(solid) * (1 - np.cos(np.pi / around)))


def smooth_triangles(solid: Solid, seabed: Seabed, wavelength: float) -> Floats:
    """Corners of the faces of a target where it lies, counter-clockwise from outside [m], shape (t, 3, 3).

    Args:
        solid: The target.
        seabed: What it lies on.
        wavelength: Of the sound [m].
    """
    steps = steps_around(solid, wavelength)
    surface = body_triangles(solid) if steps == AROUND else finer_triangles(solid, steps)
    return surface.moved(*resting(solid, seabed)).corners


def above_ground(corners: Floats, seabed: Seabed) -> Floats:
    """The parts of triangles that water can reach: cut along the ground, which is taken as level under each.

    Args:
        corners: Of the triangles [m], shape (t, 3, 3).
        seabed: What may hide them.

    Returns:
        Triangles with the same normals, shape (..., 3, 3).
    """
    bed = ground_depth(seabed, corners[:, :, :2].mean(axis=1))
    height = bed[:, None] - corners[:, :, 2]
    reached = ~(height.max(axis=1) <= _TOUCHING)
    cut = reached & (height.min(axis=1) < -_TOUCHING)
    parts = [corners[reached & ~cut]]
    for count in (1, 2):
        # corners turned so that those above come first, or the one below last
        rows = np.flatnonzero(cut & ((height > 0).sum(axis=1) == count))
        first = (height[rows] > 0).argmax(axis=1) if count == 1 else ((height[rows] <= 0).argmax(axis=1) + 1) % 3
        order = (first[:, None] + np.arange(3)) % 3
        a, b, c = np.moveaxis(np.take_along_axis(corners[rows], order[:, :, None], axis=1), 1, 0)
        at_a, at_b, at_c = np.take_along_axis(height[rows], order, axis=1).T[:, :, None]
        if count == 1:
            parts.append(np.stack([a, _level(a, b, at_a, at_b), _level(a, c, at_a, at_c)], axis=1))
        else:
            one, other = _level(b, c, at_b, at_c), _level(a, c, at_a, at_c)
            parts += [np.stack([a, b, one], axis=1), np.stack([a, one, other], axis=1)]
    return np.concatenate(parts)


def _level(a: Floats, b: Floats, at_a: Floats, at_b: Floats) -> Floats:
    """Where the sides from places above ground to places below it meet the ground [m], shape (n, 3)."""
    return np.asarray(a + (b - a) * at_a / (at_a - at_b))
