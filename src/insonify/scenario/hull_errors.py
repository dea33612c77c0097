"""Errors of a hull that is not in the water, or has the sonar or a target inside it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.model import field_error
from insonify.scenario.platform_poses import platforms
from insonify.scenario.track_errors import seabed_depth_span
from insonify.scene.clipping import overlap_box
from insonify.scene.solid import complete_triangles, seabed_depth_at
from insonify.scene.target import PointTarget, Target

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts
    from insonify.sonar.hull import Hull
    from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]
ROUNDING = 1e-6
"""Height of an array, and length of a part of a target, above the underside that count as none [m]."""
PAIRS = 200_000
"""Pairs of a ping and a triangle that are evaluated at a time [1]."""
MAX_PINGS = 500
"""Pings, spread evenly over the track, at which a hull is compared with relief [1]."""


def hull_errors(scenario: ScenarioParts, array_positions: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    """Errors of `sonar.hull`: out of the water at some ping, around an array or a target, or of one of two platforms.

    Args:
        scenario: The scenario.
        array_positions: Positions of the arrays at every ping, see `track_errors.array_positions`.
    """
    hull = scenario.sonar.hull
    if hull is None:
        return
    if scenario.receiver_track is not None:
        yield field_error("sonar.hull", None, "reflects sound between two ends under it, and receiver_track puts the "
                          "receiver on another platform. Leave one of the two out.")  # fmt: skip
        return
    poses = platforms(scenario).transmitter_poses
    depth = poses.offset_positions(hull.offset)[:, 2]
    high, low = float(depth.min()), float(depth.max())
    if high <= 0 or low >= scenario.seabed.depth:
        where = "at or above the sea surface" if high <= 0 else f"at or below the seabed ({scenario.seabed.depth:g} m)"
        yield field_error("sonar.hull.offset", None, f"puts the underside {where} at some ping. Give the third number "
                          "(down) such that it stays in the water, or move the track.")  # fmt: skip
        return
    inside = {
        name: float((depth - position[:, 2]).max())
        for name, position in array_positions.items() if name.endswith("array")
    }  # fmt: skip
    name = max(inside, key=inside.__getitem__, default=None)
    if name is not None and inside[name] > ROUNDING:
        yield field_error("sonar.hull.offset", None, f"puts the underside {inside[name]:.3g} m below {name}, which "
                          "would be inside the hull. Give a smaller third number (down), or mount the array lower."
                          )  # fmt: skip
        return
    yield from _aground_error(scenario, hull, poses)
    for row, target in enumerate(scenario.targets):
        ping = _first_ping_inside(hull, poses, _triangles(scenario, target))
        if ping is not None:
            yield field_error(f"targets.{row}.position", None, f"{target.label} reaches into the hull above the sonar "
                              f"at ping {ping}. Move the target or the track, or change sonar.hull.")  # fmt: skip


def _aground_error(scenario: ScenarioParts, hull: Hull, poses: Poses) -> Iterator[PydanticCustomError]:
    """Error of a hull whose underside relief reaches."""
    underside = poses.offset_positions(hull.offset)
    if seabed_depth_span(scenario)[0] > underside[:, 2].max():
        return
    rows = np.unique(np.linspace(0, len(poses) - 1, min(MAX_PINGS, len(poses))).astype(int))
    ahead, aside = (side.ravel() for side in np.meshgrid(np.linspace(-0.5, 0.5, 9), np.linspace(-0.5, 0.5, 5)))
    c, s = np.cos(poses.heading[rows, None]), np.sin(poses.heading[rows, None])
    ahead, aside = ahead * hull.length, aside * hull.width
    offset = np.stack([c * ahead - s * aside, s * ahead + c * aside, np.zeros((len(rows), len(ahead)))], axis=-1)
    position = (underside[rows, None] + offset).reshape(-1, 3)
    aground = np.flatnonzero(position[:, 2] >= seabed_depth_at(scenario.completed_seabed, position))
    if len(aground):
        north, east, _ = position[aground[0]]
        yield field_error("sonar.hull.offset", None, f"puts the underside at or below the seabed at ping "
                          f"{rows[aground[0] // len(ahead)]}, at north {north:.6g} m, east {east:.6g} m. Give the "
                          "third number (down) such that it stays in the water, or move the track.")  # fmt: skip


def _triangles(scenario: ScenarioParts, target: Target) -> Floats:
    """Corners of a target's triangles [m], out of the water too, shape (n, 3, 3); all three the position of a point."""
    if isinstance(target, PointTarget):
        return np.broadcast_to(np.array(target.position), (1, 3, 3))
    return complete_triangles(target, scenario.completed_seabed).corners


def _first_ping_inside(hull: Hull, poses: Poses, corners: Floats) -> int | None:
    """First ping at which triangles reach into the hull: above its underside, within its outline. None: at no ping.

    Args:
        hull: The hull.
        poses: The platform that carries it.
        corners: Corners of the triangles [m], shape (n, 3, 3).
    """
    underside = poses.offset_positions(hull.offset)
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    away = np.maximum(np.maximum(low - underside, underside - high)[:, :2], 0.0)
    is_near = np.hypot(*away.T) < np.hypot(hull.length, hull.width) / 2
    near = np.flatnonzero(is_near & (underside[:, 2] - ROUNDING > low[2]))
    if not len(near):
        return None
    corners = corners[(corners[..., 2] < underside[near, 2].max() - ROUNDING).any(axis=1)]
    centre = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centre[:, None], axis=2).max(axis=1) + np.hypot(hull.length, hull.width) / 2
    for pings in np.array_split(near, -(-len(near) * len(corners) // PAIRS)):
        offset = centre[:, :2] - underside[pings, None, :2]
        row, triangle = np.nonzero((offset**2).sum(axis=-1) < radius**2)
        ping = pings[row]
        c, s = np.cos(poses.heading[ping]), np.sin(poses.heading[ping])
        axes = np.stack([np.stack([c, s], axis=-1), np.stack([-s, c], axis=-1)], axis=-1)
        moved = corners[triangle] - underside[ping, None]
        moved[..., :2] = moved[..., :2] @ axes
        # a box from the underside to above all of the target
        tall = underside[ping, 2] - low[2] + 1.0
        moved[..., 2] += tall[:, None] / 2
        half_size = np.column_stack([np.broadcast_to([hull.length, hull.width], (len(ping), 2)), tall]) / 2 - ROUNDING
        inside = overlap_box(moved, half_size)
        if inside.any():
            return int(ping[inside.argmax()])
    return None
