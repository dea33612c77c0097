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
from insonify.propagation.families import bounces
from insonify.scenario.bistatic_faults import bistatic_faults, clock_faults
from insonify.scenario.carried import platforms
from insonify.scenario.element_faults import element_faults
from insonify.scenario.ground_faults import ground_faults
from insonify.scenario.receiver_faults import receiver_faults
from insonify.scenario.swell_faults import swell_faults
from insonify.scenario.track_faults import ENDS, out_of_the_water, places
from insonify.scene.scene import inside_body, scene_faults
from insonify.scene.target import PointTarget
from insonify.scene.volume import patch_faults
from insonify.sonar.array import PointTransducer
from insonify.sonar.beam import beams
from insonify.sonar.stance import end_depths
from insonify.sonar.track import LineTrack, StaticTrack

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

Floats = NDArray[np.float64]

NEAREST_POINT = 1.0
"""Distance that source level and target strength refer to: no point target may be nearer to the sonar [m]."""


def scenario_faults(scenario: Scenario) -> Iterator[PydanticCustomError]:
    """Everything that keeps a scenario of valid parts from being simulated.

    Args:
        scenario: The scenario; each of its nouns has passed its own checks.

    Yields:
        Errors of `located`, each at the guilty value, with its limit and the way out.
    """
    if untimely := list(clock_faults(scenario)):
        yield from untimely
        return
    yield from scene_faults(scenario.settled_seabed, scenario.targets)
    yield from patch_faults(scenario.water.patches, scenario.settled_seabed, scenario.targets)
    yield from _profile_short_of_the_water(scenario)
    found = places(scenario)
    yield from out_of_the_water(scenario, found)
    yield from ground_faults(scenario, found)
    yield from _sonar_in_a_body(scenario, found)
    yield from _deaf_beams(scenario)
    yield from element_faults(scenario)
    yield from bistatic_faults(scenario)
    yield from receiver_faults(scenario)
    if scenario.paths.geometry == "slice":
        yield from _out_of_the_slice(scenario)
    if scenario.paths.engine == "tracer":
        yield from _beyond_the_tracer(scenario)
    if scenario.surface.bounce == "waves":
        yield from _beyond_the_waves(scenario)
    if scenario.surface.bounce == "tilted":
        yield from swell_faults(scenario, found)


def _beyond_the_waves(scenario: Scenario) -> Iterator[PydanticCustomError]:
    """What bounce points on drawn waves are not looked for in."""
    if scenario.water.layered:
        yield located("surface.bounce", "waves", "needs straight rays, and water.profile bends them. Give the water "
                      "one sound_speed, or write bounce: statistical.")  # fmt: skip
    twice = [name for name in scenario.paths.followed if bounces(name).count("S") > 1]
    if twice:
        once = [name for name in scenario.paths.followed if name not in twice]
        yield located(
            "surface.bounce", "waves", f"follows one surface bounce of a leg, and {twice[0]} has more. Write "
            f"reflections: 2 under paths, or families: [{', '.join(once)}], or bounce: statistical.",
        )  # fmt: skip


def _scattering_water(scenario: Scenario, place: str) -> Iterator[PydanticCustomError]:
    """What hangs in the water, where nobody looks for it."""
    for name in ("volume_strength_db", "patches"):
        if getattr(scenario.water, name) not in (None, ()):
            yield located(f"water.{name}", None, f"is not heard by {place}. Write geometry: 3d and engine: paths under "
                          "paths, or leave it out.")  # fmt: skip


def _beyond_the_tracer(scenario: Scenario) -> Iterator[PydanticCustomError]:
    """What rays that are straight, and energies, cannot tell."""
    yield from _scattering_water(scenario, "the tracer")
    if scenario.seabed.texture is not None:
        yield located("seabed.texture", None, "is not known to the tracer. Write engine: paths under paths, or "
                      "leave it out.")  # fmt: skip
    if scenario.field == "coherent":
        yield located("field", "coherent", "needs phases, and the tracer's rays have none. Write field: incoherent, or "
                      "engine: paths under paths.")  # fmt: skip
    if scenario.water.layered:
        yield located("water.profile", None, "bends rays, and those of the tracer are straight. Give the water one "
                      "sound_speed, or write engine: paths under paths.")  # fmt: skip
    if scenario.surface.bounce != "mirror":
        yield located("surface.bounce", scenario.surface.bounce, "is not for the tracer, whose surface is a mirror. "
                      "Write bounce: mirror, or engine: paths under paths.")  # fmt: skip


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


def _sonar_in_a_body(scenario: Scenario, places: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    seabed = scenario.settled_seabed
    for row, target in enumerate(scenario.targets):
        if isinstance(target, PointTarget):
            yield from _point_at_the_sonar(row, target, places)
            continue
        for name, place in places.items():
            pings = np.flatnonzero(inside_body(target, seabed, place))
            if len(pings):
                when = f"at ping {pings[0]}" if len(pings) == 1 else f"from ping {pings[0]} to {pings[-1]}"
                yield located(
                    f"targets.{row}.position", None, f"{name} is inside {target.label} {when}. "
                    "Move the target, or the track.",
                )  # fmt: skip
                break


def _point_at_the_sonar(row: int, point: PointTarget, places: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    """A point target nearer than the distance that source level and target strength refer to."""
    for name, place in places.items():
        away = np.linalg.norm(place - np.array(point.position), axis=1)
        ping = int(np.argmin(away))
        if away[ping] < NEAREST_POINT:
            yield located(
                f"targets.{row}.position", None, f"{point.label} is {away[ping]:.2g} m from {name} at ping {ping}. "
                f"Levels refer to 1 m: move the target to {NEAREST_POINT:g} m or farther, or the track.",
            )  # fmt: skip
            return


def _deaf_beams(scenario: Scenario) -> Iterator[PydanticCustomError]:
    # Whether a steered beam exists depends on the wavelength, which no array knows by itself.
    depths = end_depths(scenario.sonar, platforms(scenario))
    speeds = scenario.water.speed_at(depths)
    for end, array in zip(ENDS, scenario.sonar.steered_arrays, strict=False):
        for speed in sorted({float(speeds.min()), float(speeds.max())}):
            try:
                beams(array, scenario.sonar.pulse.frequency, speed)
            except ValueError as fault:
                yield located(f"sonar.{end}.steer", None, str(fault))
                break


def _out_of_the_slice(scenario: Scenario) -> Iterator[PydanticCustomError]:
    """A slice is the vertical plane of one beam, which must not lean and must look along boresight."""
    sonar, track = scenario.sonar, scenario.track
    yield from _scattering_water(scenario, "a slice, which is one plane")
    if not isinstance(track, StaticTrack | LineTrack) or not track.motion.still:
        path, shown = ("track.kind", track.kind) if track.motion.still else ("track.motion", None)
        yield located(
            path, shown, "takes the beam out of the one vertical plane of a slice. Write paths.geometry: 3d, or a "
            "static or line track without motion.",
        )  # fmt: skip
        return
    if sonar.receiver.record == "elements":
        yield located("sonar.receiver.record", "elements", "need the third dimension. Write paths.geometry: 3d.")
    elif sonar.channel_count > 1:
        has = f"steers {sonar.channel_count}" if sonar.sides is None else f"has {sonar.channel_count} on its sides"
        yield located(
            "paths.geometry", "slice", f"has one beam, but the sonar {has}. "
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
