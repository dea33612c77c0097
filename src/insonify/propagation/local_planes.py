"""Legs by local planes: over relief each bounce is a reflection by the plane fitted to its first Fresnel zone.

Images of the sonar in one plane after the other give the leg to a point exactly, as between flat boundaries, except
that each leg has its own planes. The bounce lies where the line from the image reaches the plane; the zone about it
determines the plane. Planes are therefore fitted twice: approximately about the bounce on the mean plane, and
accurately about the resulting bounce. On an even slope once would suffice.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import bounce_sequence
from insonify.propagation.image_path_kernel import (
    ImagePaths,
    TerrainFrame,
    bounce_fresnel_zones,
    extent_on_grid,
    image_paths,
    paths_off_local_planes,
)
from insonify.scene.plane_fit_samples import COARSE_PATTERN, FINE_PATTERN, min_half_axis
from insonify.scene.seabed_terrain import SeabedTerrain

Floats = NDArray[np.float64]

_DOWN = np.array([0.0, 0.0, 1.0])
_TINY = 1e-9
_PATTERNS = tuple(np.ascontiguousarray(pattern.T, np.float32) for pattern in (COARSE_PATTERN, FINE_PATTERN))
"""Samples of the unit disc for the first and for the final planes."""


def paths_off_planes(position: Floats, points: Floats, plane_point: Floats, plane_normal: Floats) -> ImagePaths:
    """Images in planes, one after the other, and the paths that they unfold.

    Args:
        position: North, east, depth of the sonar [m], shape (3,).
        points: North, east, depth of the points [m], shape (n, 3).
        plane_point: A point of each plane [m], shape (m, n, 3).
        plane_normal: Unit normal of each plane, into the water, shape (m, n, 3).

    Source: images as in Allen & Berkley (1979), J. Acoust. Soc. Am. 65, 943 (for the idea); exact for planes of any
    tilt.
    """
    paths = _columns(*plane_point.shape[:2])
    image_paths(np.asarray(position, float), points, plane_point, plane_normal, paths)
    return paths


def flat_image_paths(family: str, position: Floats, points: Floats, bed_depth: float) -> ImagePaths:
    """Paths of a family between the flat surface and a flat seabed.

    Args:
        family: Name of a family with bounces.
        position: North, east, depth of the sonar [m], shape (3,).
        points: North, east, depth of the points [m], shape (n, 3).
        bed_depth: Depth of the seabed [m].
    """
    return paths_off_planes(position, points, *_flat_planes(family, len(points), bed_depth))


class BounceGeometry(NamedTuple):
    """Fields of `ImagePaths` that describe the m bounces of n paths: lengths (n,), others (m, n) or m in a tuple."""

    length: Floats
    fraction: Floats
    grazing_sine: tuple[Floats, ...]
    residual_variance: tuple[float, ...]


def flat_bounces(family: str, depth: float, length: Floats, sine: Floats, bed_depth: float) -> BounceGeometry:
    """Bounces of a family between the flat surface and a flat seabed, from the path lengths.

    Args:
        family: Name of a family with bounces.
        depth: Depth of the sonar [m].
        length: Lengths of the paths [m], shape (n,).
        sine: Sine of their grazing angle, equal at all bounces [1], shape (n,).
        bed_depth: Depth of the seabed [m].
    """
    sequence = bounce_sequence(family)
    first = depth if sequence[0] == "S" else bed_depth - depth
    vertical_travel = np.array([first + k * bed_depth for k in range(len(sequence))])  # up to each bounce
    fraction = np.clip(vertical_travel[:, None] / np.maximum(length * sine, _TINY), 0.0, 1.0)
    return BounceGeometry(length, fraction, (sine,) * len(sequence), (0.0,) * len(sequence))


def local_plane_paths(
    family: str, position: Floats, points: Floats, terrain: SeabedTerrain, wavelength: float, *,
    terrain_bounce_ranges: Floats | None = None,
) -> ImagePaths:  # fmt: skip
    """Paths of a family reflected by the planes fitted to the terrain over the first Fresnel zone of each bounce.

    Args:
        family: Name of a family with bounces.
        position: North, east, depth of the sonar [m], shape (3,).
        points: North, east, depth of the points [m], shape (n, 3).
        terrain: Terrain of the seabed.
        wavelength: Wavelength of the sound [m].
        terrain_bounce_ranges: Horizontal distance of the bounces of refracted rays over a flat seabed [m], shape
            (m, n): the planes are fitted there, and moved under the bounces of straight rays. None: straight rays.

    Returns:
        Paths in water of one sound speed; the sonar's images, the bounces and the grazing angles are exact for the
        fitted planes.
    """
    sequence = bounce_sequence(family)
    paths = _columns(len(sequence), len(points))
    if not len(points):
        return paths
    bounce_shift = np.empty((len(sequence), 0, 2))
    if terrain_bounce_ranges is not None:
        offset = points[:, :2] - position[:2]
        direction = offset / np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), _TINY)
        bounce_shift = (
            position[:2]
            + terrain_bounce_ranges[..., None] * direction
            - flat_image_paths(family, position, points, terrain.depth).bounce_position[..., :2]
        )
    scatterer_grid, is_done = terrain.relief.resolved.scatterer_grid, np.zeros(len(points), bool)
    frame = TerrainFrame(
        *scatterer_grid.origin, np.cos(scatterer_grid.heading), np.sin(scatterer_grid.heading), terrain.depth,
        wavelength, min_half_axis(terrain),
    )  # fmt: skip
    is_seabed_bounce = np.array([letter == "B" for letter in sequence])
    source = np.asarray(position, float)
    span = np.empty((2, 2))
    extent_on_grid(source, points, frame, span)
    terrain.read_heightmap(
        span,
        lambda heightmap, missing: paths_off_local_planes(
            source, points, is_seabed_bounce, bounce_shift, frame, _PATTERNS, heightmap, missing, is_done, paths
        ),
    )
    return paths


def fresnel_zone(paths: ImagePaths | BounceGeometry, bounce: int, wavelength: float) -> tuple[Floats, Floats]:
    """Half the length and half the width of the first Fresnel zone of a bounce [m], each of shape (n,).

    Args:
        paths: The paths.
        bounce: Index of the bounce from the sonar, from 0.
        wavelength: Wavelength of the sound [m].

    Source: half width sqrt(wavelength r1 r2 / (r1 + r2)), half length that over the sine of the grazing angle, r1 and
    r2 the path lengths before and after the bounce; no longer than the shorter one of them.
    """
    axes = np.empty((2, len(paths.length)))
    bounce_fresnel_zones(paths.length, paths.fraction[bounce], paths.grazing_sine[bounce], wavelength, axes)
    return axes[0], axes[1]


def _columns(planes: int, points: int) -> ImagePaths:
    """Columns, yet to be filled, of the paths to a number of points by a number of planes."""
    per_point, per_bounce = (points,), (planes, points)
    return ImagePaths(
        np.empty(per_point), np.empty((points, 3)), np.empty((points, 3)), np.empty((planes, points, 3)),
        np.empty(per_bounce), np.empty(per_bounce), np.zeros(per_bounce), np.empty(per_point, bool),
    )  # fmt: skip


def _flat_planes(family: str, count: int, bed_depth: float) -> tuple[Floats, Floats]:
    """A point [m] and the normal into the water [1] of each plane of a family, all horizontal, (m, count, 3) each."""
    sequence = bounce_sequence(family)
    plane_point, normal = np.zeros((len(sequence), count, 3)), np.zeros((len(sequence), count, 3))
    for k, letter in enumerate(sequence):
        plane_point[k, :, 2] = bed_depth if letter == "B" else 0.0
        normal[k] = -_DOWN if letter == "B" else _DOWN
    return plane_point, normal
