"""What no part of a scenario can see by itself: whether scene, sonar, track and paths go together.

Each check yields errors of `located`; the scenario raises them all at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.noun import located
from insonify.scene.box import box_body, inside_box
from insonify.scene.scene import scene_faults
from insonify.scene.target import Box
from insonify.sonar.array import PointTransducer
from insonify.sonar.beam import beams
from insonify.sonar.sonar import array_position
from insonify.sonar.track import StaticTrack, poses

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

Floats = NDArray[np.float64]
ENDS = ("transmit", "receive")


def scenario_faults(scenario: Scenario) -> Iterator[PydanticCustomError]:
    """Everything that keeps a scenario of valid parts from being simulated.

    Args:
        scenario: The scenario; each of its nouns has passed its own checks.

    Yields:
        Errors of `located`, each at the guilty value, with its limit and the way out.
    """
    yield from scene_faults(scenario.seabed, scenario.targets)
    yield from _profile_short_of_the_water(scenario)
    places = _places(scenario)
    yield from _arrays_out_of_the_water(scenario, places)
    yield from _sonar_in_a_box(scenario, places)
    yield from _deaf_beams(scenario)
    if scenario.paths.geometry == "slice":
        yield from _out_of_the_slice(scenario)


def _profile_short_of_the_water(scenario: Scenario) -> Iterator[PydanticCustomError]:
    written, bed = scenario.water.profile, scenario.seabed.depth
    if written is None:
        return
    first, last = written.depth[0], written.depth[-1]
    if first > 0:
        yield located(
            "water.profile", None, f"begins at {first:g} m; sound speed must be known from the surface (0 m) "
            f"to the seabed ({bed:g} m). Add a row for 0 m, or move the first one there.",
        )  # fmt: skip
    if last < bed:
        yield located(
            "water.profile", None, f"ends at {last:g} m, above the seabed ({bed:g} m). "
            f"Add a row for {bed:g} m or deeper, such as [{bed:g}, {written.speed[-1]:g}].",
        )  # fmt: skip


def _places(scenario: Scenario) -> dict[str, Floats]:
    """Where the platform and its two arrays are at every ping: north, east, depth [m], each of shape (pings, 3)."""
    stances = poses(scenario.track)
    body = stances.rotation(0)  # a platform does not change its attitude
    ends = zip(ENDS, (scenario.sonar.transmit, scenario.sonar.receive), strict=True)
    arrays = {f"the {end} array": array_position(array, stances.position, body) for end, array in ends}
    return {"the platform": stances.position} | arrays


def _arrays_out_of_the_water(scenario: Scenario, places: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    where = "position" if isinstance(scenario.track, StaticTrack) else "start"
    depth, bed = float(places["the platform"][0, 2]), scenario.seabed.depth
    depths = {end: float(places[f"the {end} array"][0, 2]) for end in ENDS}  # the same at every ping: tracks are level
    for end, lies in depths.items():
        if not 0 < lies < bed:
            low, high = depth - min(depths.values()), bed + depth - max(depths.values())
            side = "at or above the sea surface (0 m)" if lies <= 0 else f"at or below the seabed ({bed:g} m)"
            yield located(
                f"track.{where}.2", f"{depth:g} m", f"puts the {end} array {side}, at {lies:g} m. "
                f"Depths are positive downwards; write a depth between {low:g} and {high:g} m.",
            )  # fmt: skip
            return  # the other array hangs on the same depth


def _sonar_in_a_box(scenario: Scenario, places: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    for row, target in enumerate(scenario.targets):
        if not isinstance(target, Box):
            continue
        body = box_body(target, scenario.seabed.depth)
        for name, place in places.items():
            pings = _pings_inside(body, place)
            if pings:
                when = f"at ping {pings[0]}" if len(pings) == 1 else f"from ping {pings[0]} to {pings[-1]}"
                yield located(
                    f"targets.{row}.position", None, f"{name} is inside {target.label} {when}. "
                    "Move the target, or the track.",
                )  # fmt: skip
                break


def _pings_inside(body: Floats, place: Floats) -> list[int]:
    """Numbers of the pings at which a place lies in a body of `box_body`."""
    near = np.hypot(*(place[:, :2] - body[:2]).T) <= np.hypot(body[4], body[5])
    return [int(ping) for ping in np.flatnonzero(near) if inside_box(body, place[ping])]


def _deaf_beams(scenario: Scenario) -> Iterator[PydanticCustomError]:
    # Whether a steered beam exists depends on the wavelength, which no array knows by itself.
    for end, array in zip(ENDS, scenario.sonar.arrays, strict=True):
        try:
            beams(array, scenario.sonar.pulse.frequency, _speed_at_the_sonar(scenario))
        except ValueError as fault:
            yield located(f"sonar.{end}.steer", None, str(fault))


def _speed_at_the_sonar(scenario: Scenario) -> float:
    """Sound speed at the platform [m/s]; its depth is the same at every ping."""
    return float(scenario.water.speed_at(poses(scenario.track).position[0, 2]))


def _out_of_the_slice(scenario: Scenario) -> Iterator[PydanticCustomError]:
    """A slice is the vertical plane of one beam, which must not lean and must look along boresight."""
    sonar, track = scenario.sonar, scenario.track
    if sonar.channel_count > 1:
        yield located(
            "paths.geometry", "slice", f"has one beam, but the sonar steers {sonar.channel_count}. "
            "Write 3d, for a bearing needs the third dimension, or give one steer angle.",
        )  # fmt: skip
    ways = {"track.pitch": track.pitch, "track.roll": track.roll}
    for end, array in zip(ENDS, (sonar.transmit, sonar.receive), strict=True):
        if not isinstance(array, PointTransducer) and len(array.steers) == 1:
            ways[f"sonar.{end}.steer"] = array.steers[0][0]
    for path, angle in ways.items():
        if angle != 0:
            yield located(
                path, f"{np.degrees(angle):g} deg", "takes the beam out of the one vertical plane of a slice. "
                "Write 0 deg, or paths.geometry: 3d.",
            )  # fmt: skip
