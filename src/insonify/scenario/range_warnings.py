"""Warnings on objects out of reach of every ping: more often a slip of units than a wish."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.scattering_layers import ScatteringPatch
from insonify.scenario.platform_poses import platforms
from insonify.scenario.track_errors import PLATFORM, RECEIVER, array_positions, seabed_depth_span
from insonify.scene.solid import complete_triangles, seabed_depth_at
from insonify.scene.target import PointTarget, Target
from insonify.scene.volume_scatterers import max_water_depth

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

Floats = NDArray[np.float64]

SLOPES = 2.0
"""Over relief the bed may come as much nearer to one side [1]."""


def range_warnings(scenario: ScenarioParts) -> list[str]:
    """Warnings on a seabed, targets, patches or layers out of reach of every ping's window."""
    ends = [position for name, position in array_positions(scenario).items() if name not in (PLATFORM, RECEIVER)]
    stop = scenario.track.window[1]
    farthest = float(scenario.water.max_sound_speed * stop / 2)
    reach = f"and echoes that come within track.window, up to {1e3 * stop:g} ms, are from {farthest:.3g} m at most"
    warnings = [_receiver(scenario, reach)]
    warnings += [_bed(scenario, ends, farthest, reach)] if "seabed" in scenario.paths.contributions else []
    if "target" in scenario.paths.contributions and scenario.paths.geometry == "3d":
        warnings += [_target(scenario, target, ends, farthest, reach) for target in scenario.targets]
    if "water" in scenario.paths.contributions:
        warnings += [_patch(patch, ends, farthest, reach) for patch in scenario.water.patches]
        warnings += _layers(scenario)
    return [word for word in warnings if word]


def _receiver(scenario: ScenarioParts, reach: str) -> str:
    """Warning on a receiver so far from the transmitter that no window holds an echo; empty otherwise."""
    poses = platforms(scenario)
    nearest = float(np.linalg.norm(poses.transmitter_poses.position - poses.receiver_poses.position, axis=1).min())
    if nearest <= scenario.water.max_sound_speed * scenario.track.window[1]:
        return ""
    return (
        f"receiver_track: it runs {nearest:.4g} m or more from the transmitter's track, {reach}, out and back: nothing "
        "is received. Bring them nearer, or give a longer window."
    )


def _bed(scenario: ScenarioParts, ends: list[Floats], farthest: float, reach: str) -> str:
    """Warning on a seabed below the reach of every ping; empty otherwise."""
    if scenario.seabed.scattering is None:
        return ""
    deepest, (shallowest, lowest) = max(position[:, 2].max() for position in ends), seabed_depth_span(scenario)
    nearest = float(shallowest - deepest)
    if nearest <= farthest:
        reached = farthest * (SLOPES if scenario.seabed.relief else 1.0)
        if lowest - deepest <= reached:
            return ""
        bed = scenario.completed_seabed
        nearest = float(min(np.nanmin(seabed_depth_at(bed, position) - position[:, 2]) for position in ends))
        if nearest <= reached:
            return ""
    return (
        f"seabed: it lies {nearest:.4g} m or more below the sonar, {reach}: none of its echoes is received. Give a "
        "deeper track or a longer window; of a surveyed grid, see whether its heights are in metres."
    )


def _target(scenario: ScenarioParts, target: Target, ends: list[Floats], farthest: float, reach: str) -> str:
    """Warning on a target that no ping comes near; empty otherwise."""
    label = target.label
    nearest = float(min(np.hypot(*(end_position[:, :2] - target.position[:2]).T).min() for end_position in ends))
    if nearest > farthest and not isinstance(target, PointTarget):
        corners = complete_triangles(target, scenario.completed_seabed).corners[..., :2]
        nearest -= float(np.linalg.norm(corners - np.array(target.position[:2]), axis=-1).max())
    if nearest <= farthest:
        return ""
    return (
        f"target {label}: it lies {nearest:.4g} m or more from the track, {reach}: no echo of it is received. Move it "
        "(north, then east), or the track, or give a longer window."
    )


def _patch(patch: ScatteringPatch, ends: list[Floats], farthest: float, reach: str) -> str:
    """Warning on a patch of water that no ping comes near; empty otherwise."""
    away = min(np.linalg.norm(position - np.array(patch.position), axis=1).min() for position in ends)
    nearest = float(away - np.linalg.norm(patch.size) / 2)
    if nearest <= farthest:
        return ""
    return (
        f"water.patches: {patch.label} lies {nearest:.4g} m or more from the track, {reach}: no echo of it is "
        "received. Move it (north, east, depth), or the track, or give a longer window."
    )


def _layers(scenario: ScenarioParts) -> list[str]:
    """Words on layers of the water that begin where there is none any more."""
    written, bed = scenario.water.volume_strength_db, max_water_depth(scenario.completed_seabed)
    rows = written if isinstance(written, tuple) else ()
    return [
        f"water.volume_strength_db: the layer from {depth:g} m down lies below the seabed, which is at {bed:.4g} m at "
        "most: no echo of it is received. Give a lesser depth, or leave the row out."
        for depth, strength in rows
        if strength is not None and depth >= bed
    ]
