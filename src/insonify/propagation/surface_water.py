"""Water between surface and seabed in the form of the kernels of paths by an uneven boundary."""

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.layered_surface_path_kernel import SurfaceWater as SurfaceWater
from insonify.propagation.layered_surface_path_kernel import rays_down
from insonify.propagation.sound_speed_layers import scene_layers
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]
_NO_KNOTS = np.zeros(0)
_NO_KNOTS.setflags(write=False)  # as the knots of layers: kernels are compiled once for both


def surface_water(scene: Scene, speed: float, bottom_before: bool, bottom_after: bool) -> SurfaceWater:
    """Water of the paths of one family; without knots where it has one sound speed.

    Args:
        scene: The scene.
        speed: Sound speed at the sonar [m/s].
        bottom_before: True if the family has a bottom bounce before the surface.
        bottom_after: True if it has one after the surface.
    """
    if not scene.water.layered:
        return SurfaceWater(
            _NO_KNOTS, _NO_KNOTS, 1 / speed, scene.seabed.depth, bottom_before, bottom_after, np.zeros(2)
        )
    layers = scene_layers(scene)
    return SurfaceWater(
        layers.depth, layers.speed, 1 / speed, layers.bottom_reflection_depth, bottom_before, bottom_after, np.zeros(2)
    )  # fmt: skip


def image_in_surface(water: SurfaceWater) -> SurfaceWater:
    """Water joined to its image in the mean surface, in which a reflected ray is one ray; unchanged without knots."""
    if not water.depth.size:
        return water
    depth = np.concatenate([-water.depth[:0:-1], water.depth])
    speed = np.concatenate([water.speed[:0:-1], water.speed])
    for values in (depth, speed):
        values.setflags(write=False)
    return water._replace(depth=depth, speed=speed)


def rays_to(points: Floats, end: Floats, water: SurfaceWater) -> Floats:
    """Rays from one end of a leg down to n points, with the columns of `rays_down`, shape (n, 6).

    Args:
        points: North, east, depth of the points, all below the end [m], shape (n, 3).
        end: North, east, depth of the end, or of its image in the surface [m], shape (3,).
        water: Layered water.
    """
    rays = np.empty((len(points), 6))
    rays_down(np.linalg.norm(points[:, :2] - end[:2], axis=1), points[:, 2].copy(), float(end[2]), water, rays)
    return rays
