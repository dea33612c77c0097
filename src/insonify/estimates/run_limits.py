"""Reasons that keep a valid scenario from being run on this machine, the same before a run and in `check`."""

import numpy as np

from insonify.engines.ping_scatterers import ping_scatterers
from insonify.engines.volume import TOO_MANY, VolumeScatterers
from insonify.estimates.run_cost import RunCost, size_refusal
from insonify.scenario.scenario import Scenario
from insonify.simulator import build_simulator

ALIKE = 0.05
"""Part of the water depth within which sonars receive about the same number of points in the water [1]."""


def run_refusal(scenario: Scenario, whole: RunCost, *, labels: bool = False) -> str:
    """Reason to refuse a run of a scenario, and the remedy; empty where it can be run.

    Args:
        scenario: The scenario.
        whole: Its cost.
        labels: True if labels are computed in addition to those that the scenario requests.
    """
    if labels and scenario.sonar.receiver.record == "elements":
        return (
            "--labels is for beams, and sonar.receiver.record is elements. Leave it out; a run of the same scene with "
            "record: beams and sonar.receive.steer, the bearings of the beams, has them"
        )
    counted = {(0, scenario.field == "incoherent")} if np.isfinite(whole.scatterers) else set()
    return size_refusal(whole) or _water_limit_error(scenario, counted, labels=labels or scenario.output.labels)


def _water_limit_error(scenario: Scenario, counted: set[tuple[int, bool]], *, labels: bool) -> str:
    """The fault of a ping that receives too much scattering water, at any depth of the track; empty otherwise.

    Args:
        scenario: The scenario.
        counted: Pings whose points have been counted, with True for quadrature points; they are few enough.
        labels: True if labels are computed.
    """
    if not scenario.water.scatters or "water" not in scenario.paths.contributions or scenario.paths.geometry == "slice":
        return ""
    simulator = build_simulator(scenario)
    depth = simulator.platforms.transmitter_poses.position[:, 2]
    kinds = {scenario.field == "incoherent"} | ({True} if labels else set())
    extremes = {int(np.argmin(depth)), int(np.argmax(depth))}
    elsewhere = {ping for ping in extremes if abs(depth[ping] - depth[0]) > ALIKE * scenario.seabed.depth}
    for ping in sorted({0} | elsewhere):
        for side in simulator.ping_geometries(ping):
            seen = ping_scatterers(simulator.engine.scene, scenario.paths, scenario.seed, side, simulator.engine.rays)
            suspended = VolumeScatterers(simulator.engine.scene, scenario.paths, scenario.seed, side, seen.resolution)
            if any(np.isinf(suspended.count(quadrature=even)) for even in kinds if (ping, even) not in counted):
                return TOO_MANY
    return ""
