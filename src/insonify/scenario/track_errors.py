"""Errors of tracks that leave the water, at any ping and with any array of the platform."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.model import field_error
from insonify.scenario.platform_poses import platforms
from insonify.scene.solid import seabed_depth_at

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts
    from insonify.sonar.platforms import Platforms

Floats = NDArray[np.float64]
PLATFORM = "the platform"
RECEIVER = "the receiver's platform"
WRITTEN = {"static": "position", "line": "start", "waypoints": "waypoints", "navigation": "file"}
"""The key of each kind of track that states its depth."""
ENDS = ("transmit", "receive")


def array_positions(scenario: ScenarioParts, poses: Platforms | None = None) -> dict[str, Floats]:
    """Positions of each platform and its arrays at every ping: north, east, depth [m], each of shape (pings, 3).

    Args:
        scenario: The scenario.
        poses: Its platforms at these pings; None: at all of its track.
    """
    poses = poses or platforms(scenario)
    positions = {PLATFORM: poses.transmitter_poses.position}
    if poses.is_bistatic:
        positions[RECEIVER] = poses.receiver_poses.position
    for side, sonar in zip(scenario.sonar.sides or ("",), scenario.sonar.side_sonars, strict=True):
        for end, array, carrier in zip(
            ENDS, (sonar.transmit, sonar.receive), poses.transmitter_and_receiver_poses, strict=True
        ):
            name = " ".join(["the", *([side] if side else []), end, "array"])
            positions[name] = carrier.offset_positions(array.offset)
    return positions


def track_out_of_water_errors(
    scenario: ScenarioParts, array_positions: dict[str, Floats]
) -> Iterator[PydanticCustomError]:
    """The first array that leaves the water, and where.

    Args:
        scenario: The scenario.
        array_positions: Its `array_positions`.
    """
    if RECEIVER not in array_positions:
        arrays = {name: position for name, position in array_positions.items() if name != PLATFORM}
        yield from _out_of_water_errors(scenario, "track", array_positions[PLATFORM], arrays)
        return
    for key, track, end in (("track", PLATFORM, "transmit"), ("receiver_track", RECEIVER, "receive")):
        arrays = {name: position for name, position in array_positions.items() if name.endswith(f"{end} array")}
        yield from _out_of_water_errors(scenario, key, array_positions[track], arrays)


def _out_of_water_errors(
    scenario: ScenarioParts, key: str, platform: Floats, arrays: dict[str, Floats]
) -> Iterator[PydanticCustomError]:
    """The first of one platform's arrays that leaves the water."""
    depths = {name: position[:, 2] for name, position in arrays.items()}
    for name, lies in depths.items():
        if lies.min() > 0 and lies.max() < seabed_depth_span(scenario)[0]:
            continue
        floor = seabed_depth_at(scenario.completed_seabed, arrays[name])
        wrong = np.flatnonzero((lies <= 0) | (lies >= floor))
        if wrong.size:
            depth, bed = float(lies[wrong[0]]), float(floor[wrong[0]])
            side = "at or above the sea surface (0 m)" if depth <= 0 else f"at or below the seabed ({bed:.6g} m)"
            path = f"{key}.{WRITTEN[getattr(scenario, key).kind]}"
            everywhere = np.ptp(list(depths.values()), axis=1).max() == 0 and np.ptp(floor) == 0
            advise = _constant_depth_advice if everywhere else _advice
            yield advise(path, platform[:, 2], depths, f"puts {name} {side}, at {depth:.6g} m", wrong, bed)
            return  # the other arrays hang on the same depth


def seabed_depth_span(scenario: ScenarioParts) -> tuple[float, float]:
    """Depths between which all of the seabed lies [m]."""
    bed = scenario.completed_seabed.terrain
    return (scenario.seabed.depth,) * 2 if bed is None else bed.span


def _constant_depth_advice(
    path: str, platform: Floats, depths: dict[str, Floats], what: str, wrong: NDArray[np.int64], bed: float
) -> PydanticCustomError:
    """Error of a track that is too deep or too shallow as a whole."""
    if bed <= 0:
        return field_error(
            path, None, f"{what}: the ground rises out of the water there. Move the track, or lower the ground."
        )
    depth, lies = float(platform[0]), [float(column[0]) for column in depths.values()]
    low, high = depth - min(lies), bed + depth - max(lies)
    index = ".2" if path.endswith(("position", "start")) else ""
    return field_error(
        f"{path}{index}", f"{depth:g} m", f"{what}. Depths are positive downwards; write a depth between {low:g} and "
        f"{high:g} m.",
    )  # fmt: skip


def _advice(
    path: str, platform: Floats, depths: dict[str, Floats], what: str, wrong: NDArray[np.int64], bed: float
) -> PydanticCustomError:
    """Error of a track that leaves the water at some of its pings."""
    several = "" if wrong.size == 1 else f", the first of {wrong.size} such pings"
    if bed <= 0:
        return field_error(path, None, f"ping {wrong[0]}{several}, {what}: the ground rises out of the water there. "
                       "Move the track, or lower the ground.")  # fmt: skip
    lies = np.array(list(depths.values()))
    return field_error(
        path, None, f"ping {wrong[0]}{several}, {what}. Depths are positive downwards, and the platform's own runs "
        f"from {platform.min():.4g} to {platform.max():.4g} m; keep the arrays, now at {lies.min():.4g} to "
        f"{lies.max():.4g} m with all motion, between 0 and {bed:g} m.",
    )  # fmt: skip
