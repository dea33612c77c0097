"""Errors between the parts of a scenario: scene, sonar, track and paths that do not go together.

Each check yields errors of `field_error`; the scenario raises them all at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.model import field_error
from insonify.propagation.families import surface_bounces
from insonify.scenario.bistatic_errors import bistatic_errors, clock_errors
from insonify.scenario.element_errors import element_errors
from insonify.scenario.face_errors import overlapping_face_errors
from insonify.scenario.hull_errors import hull_errors
from insonify.scenario.platform_poses import platforms
from insonify.scenario.receiver_errors import receiver_errors
from insonify.scenario.swell_errors import swell_errors
from insonify.scenario.terrain_errors import terrain_errors
from insonify.scenario.track_errors import ENDS, array_positions, track_out_of_water_errors
from insonify.scene.scene import inside_body, scene_errors
from insonify.scene.target import PointTarget
from insonify.scene.volume_scatterers import patch_errors
from insonify.sonar.array import PointTransducer
from insonify.sonar.beam import beams
from insonify.sonar.ping_geometry import array_depths
from insonify.sonar.track import LineTrack, StaticTrack

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

Floats = NDArray[np.float64]

MIN_POINT_DISTANCE = 1.0
"""Distance that source level and target strength refer to: no point target may be nearer to the sonar [m]."""


def scenario_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors in the combination of valid parts of a scenario.

    Args:
        scenario: The scenario; each of its models has passed its own checks.

    Yields:
        Errors of `field_error`, each at the faulty value, with its limit and the fix.
    """
    if untimely := list(clock_errors(scenario)):
        yield from untimely
        return
    misplaced = list(scene_errors(scenario.completed_seabed, scenario.targets))
    yield from misplaced or overlapping_face_errors(scenario)
    yield from patch_errors(scenario.water.patches, scenario.completed_seabed, scenario.targets)
    yield from _profile_depth_errors(scenario)
    positions = array_positions(scenario)
    position_errors = [
        *track_out_of_water_errors(scenario, positions), *terrain_errors(scenario, positions),
        *_sonar_inside_target(scenario, positions),
    ]  # fmt: skip
    yield from position_errors
    yield from _blind_beam_errors(scenario)
    yield from element_errors(scenario)
    yield from bistatic_errors(scenario)
    yield from receiver_errors(scenario)
    if not position_errors:
        yield from hull_errors(scenario, positions)
    yield from _unknown_objects(scenario)
    if scenario.paths.geometry == "slice":
        yield from _slice_errors(scenario)
    if scenario.paths.engine == "tracer":
        yield from _tracer_limits(scenario)
    if scenario.surface.reflection == "explicit":
        yield from _explicit_sea_limits(scenario)
    if scenario.seabed.reflecting_interface == "rough" and scenario.surface.reflection in ("explicit", "tilted"):
        yield field_error("seabed.reflecting_interface", "rough", "has no glints off an explicit or a tilted surface. "
                          "Write reflection: statistical under surface, or smooth.")  # fmt: skip
    if scenario.surface.reflection == "tilted":
        yield from swell_errors(scenario, positions)


def _unknown_objects(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors of replica perturbations of objects that the scene lacks."""
    labels = [*(one.label for one in scenario.targets), *(one.label for one in scenario.water.patches)]
    known = (*labels, "seabed", "surface", "water", "boundary echo")
    for row, one in enumerate(scenario.paths.replica_perturbations):
        for name in one.objects or ():
            if name not in known:
                yield field_error(f"paths.replica_perturbations.{row}.objects", name, "is no object of the scene. "
                                  f"Write one of {', '.join(known)}.")  # fmt: skip


def _explicit_sea_limits(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors of settings for which bounce points on an explicit sea surface are not searched."""
    twice = [name for name in scenario.paths.followed_families if surface_bounces(name) > 1]
    if twice:
        once = [name for name in scenario.paths.followed_families if name not in twice]
        yield field_error(
            "surface.reflection", "explicit", f"follows one surface bounce of a leg, and {twice[0]} has more. Write "
            f"max_reflections: 2 under paths, or families: [{', '.join(once)}], or reflection: statistical.",
        )  # fmt: skip


def _volume_scattering_limits(scenario: ScenarioParts, position: str) -> Iterator[PydanticCustomError]:
    """Errors of volume scattering that an engine or a geometry does not simulate."""
    for name in ("volume_strength_db", "patches"):
        if getattr(scenario.water, name) not in (None, ()):
            yield field_error(f"water.{name}", None, f"is not simulated by {position}. Write geometry: 3d and engine: "
                          "eigenrays under paths, or leave it out.")  # fmt: skip


def _tracer_limits(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors of settings that straight rays of energy cannot represent."""
    yield from _volume_scattering_limits(scenario, "the tracer")
    if scenario.seabed.texture is not None:
        yield field_error("seabed.texture", None, "is not known to the tracer. Write engine: eigenrays under paths, or "
                      "leave it out.")  # fmt: skip
    if scenario.field == "coherent":
        yield field_error("field", "coherent", "needs phases, and the tracer's rays have none. Write field: "
                      "incoherent, or engine: eigenrays under paths.")  # fmt: skip
    if scenario.sonar.hull is not None:
        yield field_error("sonar.hull", None, "reflects sound, which the tracer does not follow. Leave it out, "
                          "or write engine: eigenrays under paths.")  # fmt: skip
    if scenario.seabed.reflecting_interface != "smooth":
        yield field_error("seabed.reflecting_interface", "rough", "is not for the tracer, whose seabed is smooth. "
                      "Write smooth, or engine: eigenrays under paths.")  # fmt: skip
    if scenario.surface.reflection not in ("flat", "statistical"):
        yield field_error("surface.reflection", scenario.surface.reflection, "is not for the tracer, whose surface is "
                      "flat or statistical. Write one of these, or engine: eigenrays under paths.")  # fmt: skip
    if scenario.surface.reflection == "statistical" and any(isinstance(one, PointTarget) for one in scenario.targets):
        yield field_error("surface.reflection", "statistical", "is not for point targets in the tracer. Write "
                      "reflection: flat, give a sphere, or write engine: eigenrays under paths.")  # fmt: skip


def _profile_depth_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    written, bed = scenario.water.profile, scenario.seabed.depth
    if written is None:
        return
    first, last = written.depth[0], written.depth[-1]
    if first > 0:
        yield field_error(
            "water.profile", None, f"begins at {first:g} m; sound speed must be known from the surface (0 m) "
            f"to the seabed ({bed:g} m). Add a row for 0 m, or move the first one there.",
        )  # fmt: skip
    if last < bed:
        yield field_error(
            "water.profile", None, f"ends at {last:g} m, above the seabed ({bed:g} m). "
            f"Add a row for {bed:g} m or deeper, such as [{bed:g}, {written.speed[-1]:g}].",
        )  # fmt: skip


def _sonar_inside_target(scenario: ScenarioParts, positions: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    seabed = scenario.completed_seabed
    for row, target in enumerate(scenario.targets):
        if isinstance(target, PointTarget):
            yield from _point_target_too_near(row, target, positions)
            continue
        for name, position in positions.items():
            pings = np.flatnonzero(inside_body(target, seabed, position))
            if len(pings):
                when = f"at ping {pings[0]}" if len(pings) == 1 else f"from ping {pings[0]} to {pings[-1]}"
                yield field_error(
                    f"targets.{row}.position", None, f"{name} is inside {target.label} {when}. "
                    "Move the target, or the track.",
                )  # fmt: skip
                break


def _point_target_too_near(row: int, point: PointTarget, positions: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    """A point target nearer than the distance that source level and target strength refer to."""
    for name, position in positions.items():
        away = np.linalg.norm(position - np.array(point.position), axis=1)
        ping = int(np.argmin(away))
        if away[ping] < MIN_POINT_DISTANCE:
            yield field_error(
                f"targets.{row}.position", None, f"{point.label} is {away[ping]:.2g} m from {name} at ping {ping}. "
                f"Levels refer to 1 m: move the target to {MIN_POINT_DISTANCE:g} m or farther, or the track.",
            )  # fmt: skip
            return


def _blind_beam_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    # Whether a steered beam exists depends on the wavelength, which is no field of an array.
    depths = array_depths(scenario.sonar, platforms(scenario))
    speeds = scenario.water.sound_speed_at(depths)
    for end, array in zip(ENDS, scenario.sonar.beam_arrays, strict=False):
        for speed in sorted({float(speeds.min()), float(speeds.max())}):
            try:
                beams(array, scenario.sonar.pulse.frequency, speed)
            except ValueError as fault:
                yield field_error(f"sonar.{end}.steer", None, str(fault))
                break


def _slice_errors(scenario: ScenarioParts) -> Iterator[PydanticCustomError]:
    """Errors of slices: the vertical plane of one beam, which must not lean and must point along boresight."""
    sonar, track = scenario.sonar, scenario.track
    yield from _volume_scattering_limits(scenario, "a slice, which is one plane")
    if not isinstance(track, StaticTrack | LineTrack) or not track.motion.is_still:
        path, shown = ("track.kind", track.kind) if track.motion.is_still else ("track.motion", None)
        yield field_error(
            path, shown, "takes the beam out of the one vertical plane of a slice. Write paths.geometry: 3d, or a "
            "static or line track without motion.",
        )  # fmt: skip
        return
    if sonar.receiver.record == "elements":
        yield field_error("sonar.receiver.record", "elements", "need the third dimension. Write paths.geometry: 3d.")
    elif sonar.channel_count > 1:
        has = f"steers {sonar.channel_count}" if sonar.sides is None else f"has {sonar.channel_count} on its sides"
        yield field_error(
            "paths.geometry", "slice", f"has one beam, but the sonar {has}. "
            "Write 3d, for a bearing needs the third dimension, or give one steer angle.",
        )  # fmt: skip
    angles = {"track.pitch": track.pitch, "track.roll": track.roll}
    for end, array in zip(ENDS, (sonar.transmit, sonar.receive), strict=True):
        if not isinstance(array, PointTransducer) and len(array.steers) == 1:
            angles[f"sonar.{end}.steer"] = array.steers[0][0]
    for path, angle in angles.items():
        if angle != 0:
            yield field_error(
                path, f"{np.degrees(angle):g} deg", "takes the beam out of the one vertical plane of a slice. "
                "Write 0 deg, or paths.geometry: 3d.",
            )  # fmt: skip
