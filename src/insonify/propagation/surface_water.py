"""Water between surface and seabed in the form of the kernels of paths by an uneven boundary."""

import numpy as np

from insonify.propagation._layered_surface_path_kernel import SurfaceWater
from insonify.propagation.sound_speed_layers import scene_layers
from insonify.scene.scene import Scene


def surface_water(scene: Scene, speed: float, bottom_before: bool, bottom_after: bool) -> SurfaceWater:
    """Water of the paths of one family; without knots where it has one sound speed."""
    if not scene.water.layered:
        return SurfaceWater(
            np.zeros(0), np.zeros(0), 1 / speed, scene.seabed.depth, bottom_before, bottom_after, np.zeros(2)
        )
    layers = scene_layers(scene)
    return SurfaceWater(
        layers.depth, layers.speed, 1 / speed, layers.bottom_reflection_depth, bottom_before, bottom_after, np.zeros(2)
    )  # fmt: skip
