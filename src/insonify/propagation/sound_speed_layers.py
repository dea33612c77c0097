"""Water column of the ray solvers: layers of constant gradient, from the surface exactly to the seabed.

Over relief there are two depths: that of the flat plane that reflects sound, and that of the deepest terrain.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.profile import SoundSpeedProfile
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]


class SoundSpeedLayers(NamedTuple):
    """Sound speed of a water column at knots, linear in between; an argument of the ray kernels."""

    depth: Floats
    """Depths of the knots, from exactly 0 to exactly the deepest seabed, strictly increasing [m], (m,), m >= 2."""
    speed: Floats
    """Sound speed at the knots [m/s], shape (m,)."""
    reflecting_depth: float = math.inf
    """Depth of the plane that reflects sound at the bottom, one of the knots [m]; infinite for the last knot."""

    @property
    def water_depth(self) -> float:
        """Greatest depth of the seabed [m]."""
        return float(self.depth[-1])

    @property
    def bottom_reflection_depth(self) -> float:
        """Depth of the plane that reflects sound at the bottom [m]."""
        return min(self.reflecting_depth, self.water_depth)

    def __repr__(self) -> str:
        speeds = f"{self.speed.min():.1f}-{self.speed.max():.1f} m/s"
        return f"Column: {self.depth.size - 1} layers, {self.water_depth:g} m deep, {speeds}"


def sound_speed_layers(profile: SoundSpeedProfile, water_depth: float, *, plane: float = math.inf) -> SoundSpeedLayers:
    """Layers of the part of a profile within the water.

    Args:
        profile: Sound speed; must cover the water. Knots below the seabed are ignored.
        water_depth: Greatest depth of the seabed [m].
        plane: Depth of the plane that reflects sound at the bottom [m]; at or below `water_depth`: the seabed itself.

    Returns:
        Layers from the surface to the seabed, with every knot of the profile between them.

    Raises:
        ValueError: The depth is not positive, or the profile begins below the surface or ends above the seabed.
    """
    if not (np.isfinite(water_depth) and water_depth > 0):
        raise ValueError(f"water_depth is {water_depth:g} m; give a positive number, such as 20.")
    profile.require_depth(water_depth)
    inside = (profile.depth > 0) & (profile.depth < water_depth)
    depth = np.concatenate([[0.0], profile.depth[inside], [float(water_depth)]])
    speed = np.concatenate([profile.at([0.0]), profile.speed[inside], profile.at([water_depth])])
    if plane < water_depth and plane not in depth:
        row = int(np.searchsorted(depth, plane))
        depth, speed = np.insert(depth, row, plane), np.insert(speed, row, profile.at([plane]))
    for values in (depth, speed):
        values.setflags(write=False)
    return SoundSpeedLayers(depth, speed, float(plane) if plane < water_depth else math.inf)


@lru_cache(maxsize=16)
def scene_layers(scene: Scene) -> SoundSpeedLayers:
    """Layers of a scene with a profile, down to its deepest terrain, cached.

    Args:
        scene: Layered water over a seabed, whose mean plane reflects.

    Raises:
        ValueError: The profile does not cover the depths from the surface to the seabed.
    """
    depth, bed = scene.seabed.depth, scene.seabed.terrain
    deepest = depth if bed is None else max(depth, bed.span[1])
    # below the profile's last knot the speed is constant, as wherever the water's sound speed is evaluated
    return sound_speed_layers(scene.water.profile_to_depth(depth).extended(deepest), deepest, plane=depth)
