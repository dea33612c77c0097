"""Reasons that keep a valid scenario from being run on this machine, the same before a run and in `check`."""

import numpy as np

from insonify.engines.view import view
from insonify.engines.volume import TOO_MANY, Suspended
from insonify.scenario.scenario import Scenario
from insonify.simulation import prepare
from insonify.study.cost import Cost, too_big


def refusal(scenario: Scenario, whole: Cost, *, labels: bool = False) -> str:
    """Why a run of a scenario would be refused, and what to change; empty where it can be run.

    Args:
        scenario: The scenario.
        whole: Its cost.
        labels: Whether labels are wanted that the scenario itself does not ask for.
    """
    if labels and scenario.sonar.receiver.record == "elements":
        return (
            "--labels is for beams, and sonar.receiver.record is elements. Leave it out; a run of the same scene with "
            "record: beams has them"
        )
    return too_big(whole) or _too_much_water(scenario, labels=labels or scenario.output.labels)


def _too_much_water(scenario: Scenario, *, labels: bool) -> str:
    """The fault of a ping that receives too much scattering water, at any depth of the track; empty otherwise."""
    if not scenario.water.scatters or "water" not in scenario.paths.causes or scenario.paths.geometry == "slice":
        return ""
    listening = prepare(scenario)
    depth = listening.platforms.sending.position[:, 2]
    kinds = {scenario.field == "incoherent"} | ({True} if labels else set())
    for ping in sorted({0, int(np.argmin(depth)), int(np.argmax(depth))}):
        for side in listening.stances(ping):
            seen = view(listening.engine.scene, scenario.paths, scenario.seed, side, listening.engine.rays)
            suspended = Suspended(listening.engine.scene, scenario.paths, scenario.seed, side, seen.resolution)
            if any(np.isinf(suspended.count(even=even)) for even in kinds):
                return TOO_MANY
    return ""
