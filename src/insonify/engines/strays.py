"""Rays that no skyline tells of, walked over the ground step by step.

A skyline is made of rays that do not cross. What turns on its way about a bounce, or has touched a caustic, or comes
as a second ray to its place, is out of that order; such rays are few, and each is compared with the ground under it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _skyline_kernel as kernel

if TYPE_CHECKING:
    from insonify.engines.skyline import Skylines
    from insonify.engines.slices import Group

Floats = NDArray[np.floating[Any]]

TOGETHER = 256
"""Rays that are walked together."""
TOUCH = 1e-3
"""How far a ray may dip into the ground [m]."""


def walk_over_ground(
    skylines: Skylines, family: str, groups: list[Group], distance: Floats, steepness: Floats, depth: Floats,
    wanted: NDArray[np.bool_], *, ground: bool,
) -> NDArray[np.bool_]:  # fmt: skip
    """Whether rays are clear of the ground, sample by sample of the line that they follow.

    Near the mean plane, within the height that a ray gains over half the Fresnel zone of a bounce, a family with bottom
    bounces is not asked: there the ground is the mirror.

    Args:
        skylines: The ground about the sonar, and its rays.
        family: Name of the family.
        groups: Points by the lines that pass them.
        distance: Horizontal distance of the points [m], shape (n,).
        steepness: Of their rays [1], see `insonify.propagation.launches`, shape (n,).
        depth: Depth of the points [m], shape (n,).
        wanted: Which are walked, shape (n,).
        ground: Whether the points lie on the ground: then rays end on the ground of their line instead.

    Returns:
        True where a ray is clear, shape (n,).
    """
    lit = np.ones(len(distance), bool)
    for lines, points, rows in groups:
        chosen = np.flatnonzero(wanted[points])
        for start in range(0, len(chosen), TOGETHER):
            some = chosen[start : start + TOGETHER]
            mine, line = points[some], rows[some]
            reach = distance[mine] / skylines.step
            count = int(min(np.ceil(reach.max()), lines.depth.shape[1] - 1))
            if count < 1:
                continue
            ways = skylines.launches.ways(family, steepness[mine], skylines.step, count)
            spare = np.full(len(mine), np.inf)
            if "B" in family:
                spare = skylines.bed.depth - np.sqrt(skylines.wavelength * distance[mine]) / 2
            lit[mine] = kernel.clear_of_ground(
                ways, lines.depth, line, reach, np.asarray(depth[mine], float), spare, TOUCH, ground
            )
    return lit
