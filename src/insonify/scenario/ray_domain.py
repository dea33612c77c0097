"""Region in which the pings of a scenario need rays, and the delays that uneven water adds."""

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.aperture_expansion import MIN_OFFSET
from insonify.propagation.delay_field import DelayField
from insonify.propagation.propagation_model import MAX_SEPARATE_DEPTHS, RayDomain
from insonify.scenario.scenario import Scenario
from insonify.sonar.hydrophones import element_layout
from insonify.sonar.ping_geometry import array_depths
from insonify.sonar.platforms import Platforms
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.sonar.sonar import array_position, receiver_rotation
from insonify.sonar.track import Poses


def delay_field(scenario: Scenario) -> DelayField | None:
    """Delays that the water of a scenario adds to travel times; None where it is even."""
    uneven = scenario.water.inhomogeneity
    if uneven is None or uneven.rms_index == 0:
        return None
    return DelayField(uneven, scenario.seed, scenario.seabed.depth, scenario.seabed.scatterer_grid)


def domain(scenario: Scenario, track: Poses | Platforms, pulse: ReceivedPulse) -> RayDomain:
    """Region in which the pings of a scenario need rays.

    Args:
        scenario: The scenario.
        track: Poses of the platform, or the platforms.
        pulse: The sonar's pulse as received.
    """
    poses = Platforms(track) if isinstance(track, Poses) else track
    scene, stop = scenario.scene, scenario.track.window[1] - pulse.ringing_start
    # Separated ends receive a little beyond half of the path.
    largest_spacing = 2 * max(float(np.linalg.norm(array.offset)) for array in scenario.sonar.arrays)
    apart = largest_spacing + poses.max_separation + _element_excursion(scenario, poses)
    farthest = scenario.water.max_sound_speed * max(stop, 0.0) / 2 + apart
    if (
        scenario.paths.face_reflections or scenario.paths.engine == "tracer"
    ):  # out by way of a face, and back by a short way
        farthest *= 2
    depths = [float(depth) for depth in _required_depths(scenario, poses)]
    spanned = len(depths) > MAX_SEPARATE_DEPTHS
    return RayDomain((depths[0], depths[-1]) if spanned else tuple(depths), spanned, scene.body_depths, farthest)


def _required_depths(scenario: Scenario, poses: Platforms) -> NDArray[np.float64]:
    """Depths of the sonar's ends [m], and those of its highest and lowest elements where a platform keeps its depth."""
    depths, sonar = array_depths(scenario.sonar, poses), scenario.sonar
    if not scenario.water.layered or sonar.receiver.record != "elements" or len(depths) > 2:
        return depths
    body = poses.receiver_poses.rotation(0)
    centre = array_position(sonar.receive, poses.receiver_poses.position[0], body)[2]
    rise = float(np.abs((element_layout(sonar.receive)[0] @ receiver_rotation(sonar, body))[:, 2]).max())
    if rise < MIN_OFFSET:
        return depths
    return np.unique(np.clip([*depths, centre - rise, centre + rise], 0.0, scenario.seabed.depth))


def _element_excursion(scenario: Scenario, poses: Platforms) -> float:
    """Twice the largest distance of an element from its array's centre at the start of a ping, about [m]."""
    size, moved = 0.0, 0.0
    if scenario.sonar.receiver.record == "elements":
        size = float(np.linalg.norm(element_layout(scenario.sonar.receive)[0], axis=1).max())
    for array, (first, *later) in zip(scenario.sonar.arrays, poses.window_poses, strict=True):
        for then in later:
            displacement = then.offset_positions(array.offset) - first.offset_positions(array.offset)
            moved = max(moved, float(np.linalg.norm(displacement, axis=-1).max()))
    return 2 * (size + moved)
