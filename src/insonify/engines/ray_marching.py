"""Terrain occlusion of rays that cross others, sample by sample of the terrain profile under each ray.

The sweep of `insonify.engines.terrain_occlusion` needs rays that do not cross. Rays that turn about a bounce, that
have touched a caustic, or that are a second arrival at their point are out of that order; they are few, and each is
marched alone.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _terrain_occlusion_kernel as kernel
from insonify.engines.terrain_profiles import ProfileGroup
from insonify.propagation.families import bottom_bounces
from insonify.propagation.launch_angles import LaunchAngles

Floats = NDArray[np.floating[Any]]

RAYS_PER_BATCH = 256
"""Number of rays that are marched together."""
PENETRATION = 1e-3
"""Largest depth below the terrain at which a ray counts as clear [m]."""


class RayModel(NamedTuple):
    """Rays from one end of the sonar over terrain."""

    launches: LaunchAngles
    """Shapes of the rays by launch angle."""
    seabed_depth: float
    """Depth of the mean seabed [m]."""
    wavelength: float
    """Acoustic wavelength at transmitter or receiver [m]."""
    step: float
    """Distance between samples of a terrain profile [m]."""


def march_over_terrain(
    rays: RayModel, family: str, groups: list[ProfileGroup], distance: Floats, launch_slope: Floats, depth: Floats,
    marched: NDArray[np.bool_], *, on_terrain: bool,
) -> NDArray[np.bool_]:  # fmt: skip
    """Compare rays with the terrain profile that each follows.

    Near the mean seabed, within the height that a ray gains over half the Fresnel zone of a bounce, rays with bottom
    bounces are not compared: there the terrain is the reflecting surface.

    Args:
        rays: Rays of one end of the sonar.
        family: Name of the path family.
        groups: Points by the terrain profiles that pass them.
        distance: Horizontal distance of the points [m], shape (n,).
        launch_slope: Launch slopes of their rays [1], see `insonify.propagation.launch_angles`, shape (n,).
        depth: Depth of the points [m], shape (n,).
        marched: True for points whose rays are marched, shape (n,).
        on_terrain: True if the points lie on the terrain; rays then end on the terrain of their profile instead.

    Returns:
        True where a ray is clear, and where it was not marched, shape (n,).
    """
    clear = np.ones(len(distance), bool)
    for profiles, points, rows in groups:
        chosen = np.flatnonzero(marched[points])
        for start in range(0, len(chosen), RAYS_PER_BATCH):
            batch = chosen[start : start + RAYS_PER_BATCH]
            selected, profile = points[batch], rows[batch]
            samples = distance[selected] / rays.step
            count = int(min(np.ceil(samples.max()), profiles.depth.shape[1] - 1))
            if count < 1:
                continue
            depths = rays.launches.ray_depths(family, launch_slope[selected], rays.step, count)
            reflecting_depth = np.full(len(selected), np.inf)
            if bottom_bounces(family):
                reflecting_depth = rays.seabed_depth - np.sqrt(rays.wavelength * distance[selected]) / 2
            clear[selected] = kernel.clear_of_terrain(
                depths,
                profiles.depth,
                profile,
                samples,
                np.asarray(depth[selected], float),
                reflecting_depth,
                PENETRATION,
                on_terrain,
            )
    return clear
