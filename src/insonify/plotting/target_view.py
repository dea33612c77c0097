"""Where the targets of a scenario are, as one ping hears them: when their echoes come, and how loud in which beam."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import families_up_to, image_depth
from insonify.scenario.scenario import Scenario
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles
from insonify.scene.target import Box, PointTarget, Solid
from insonify.simulator import arrivals, build_simulator
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis.arrival_weights import arrival_weights

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TargetView:
    """A target as the beams see it."""

    label: str
    slant: float
    """Distance from the receiver [m]."""
    bearing: float
    """To the right of boresight, as beams are steered [rad]; nan behind the array."""
    half_extent: float
    """Half its horizontal diagonal [m]; 0 for a point."""


def loudest_target(scenario: Scenario, ping: int, channels: list[int]) -> tuple[int, int] | None:
    """The target that is heard best over direct paths, and the channel in which it is.

    Args:
        scenario: What was simulated.
        ping: Number of the ping.
        channels: Beams to choose from.

    Returns:
        Row of the target and number of the channel; None where no target is heard in the window.
    """
    direct = scenario.paths.model_copy(update={"max_reflections": 0, "families": None, "contributions": ("target",)})
    only, simulator, beams = (
        scenario.model_copy(update={"paths": direct}),
        build_simulator(scenario),
        scenario.sonar.beam_count,
    )
    sides = {channel // beams: arrivals(only, ping, channel=channel) for channel in channels}
    best, found = 0.0, None
    for channel in channels:
        paths, here = sides[channel // beams], simulator.ping_geometry(ping, channel=channel)
        energy = np.abs(arrival_weights(paths, here, channel % beams)) ** 2
        for row, target in enumerate(scenario.targets):
            heard = float(energy[paths.object == target.label].sum())
            if heard > best:
                best, found = heard, (row, channel)
    return found


def echo_window(scenario: Scenario, ping: int, target: Solid | PointTarget) -> tuple[float, float]:
    """Time between the start of a target's first echo and the end of its last [s].

    Every family is followed to the far and the near side of the target, over image sources.

    Args:
        scenario: What was simulated.
        ping: Number of the ping.
        target: One of its targets.
    """
    here, floor = build_simulator(scenario).ping_geometry(ping), scenario.seabed.depth
    chosen = scenario.paths.families or families_up_to(scenario.paths.max_reflections)
    position, half = middle(target, scenario.scene), half_extent(target, scenario.scene)
    reach = np.zeros((2, len(chosen), 2))  # transmitter and receiver, family, near and far side [m]
    for end, source in enumerate((here.transmit_position, here.receive_position)):
        across = float(np.hypot(*(position - source)[:2]))
        for row, family in enumerate(chosen):
            down = position[2] - image_depth(family, float(source[2]), floor)
            reach[end, row] = np.hypot(np.maximum(across + np.array([-half, half]), 0), down)
    first, last = (of(reach, axis=(1, 2)).sum() / scenario.water.sound_speed for of in (np.min, np.max))
    return float(first + here.pulse.start), float(last + here.pulse.stop)


def middle(target: Solid | PointTarget, scene: Scene) -> Floats:
    """North, east, depth of the middle of what is under water of a target [m], shape (3,).

    Args:
        target: The target.
        scene: Where it lies.
    """
    if isinstance(target, PointTarget):
        return np.array(target.position)
    surface = world_triangles(target, scene.seabed)
    return (surface.low + surface.high) / 2


def half_extent(target: Solid | PointTarget, scene: Scene) -> float:
    """Half the horizontal diagonal of a target [m]; 0 for a point.

    Args:
        target: The target.
        scene: Where it lies.
    """
    if isinstance(target, PointTarget):
        return 0.0
    if isinstance(target, Box) and target.is_upright:
        return float(np.hypot(*target.size[:2])) / 2
    surface = world_triangles(target, scene.seabed)
    return float(np.hypot(*(surface.high - surface.low)[:2])) / 2


def targets_in_view(scenario: Scenario, ping: int) -> list[TargetView]:
    """All targets as the beams of one ping see them.

    Args:
        scenario: What was simulated.
        ping: Number of the ping.
    """
    here: PingGeometry = build_simulator(scenario).ping_geometry(ping)
    ahead, right, _ = here.receive_beams.axes
    seen, scene = [], scenario.scene
    for target in scenario.targets:
        away = middle(target, scene) - here.receive_position
        slant = float(np.linalg.norm(away))
        bearing = float(np.arcsin(np.clip(away @ right / slant, -1, 1))) if away @ ahead > 0 else np.nan
        seen.append(TargetView(target.label, slant, bearing, half_extent(target, scene)))
    return seen
