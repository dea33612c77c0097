"""What lies so far from the whole track that no ping can hear it: more often a slip of units than a wish."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from insonify.scenario.carried import platforms
from insonify.scenario.track_faults import PLATFORM, RECEIVER, floor_under, places

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

Floats = NDArray[np.float64]

BODY = 50.0
"""Beyond this much more than the farthest range heard, even an end of a long target is out of reach [m]."""
SLOPES = 2.0
"""Over relief the bed may come as much nearer to one side [1]."""


def reach_cautions(scenario: Scenario) -> list[str]:
    """Words on a bed or on targets out of reach of every ping's window; none where all may be heard.

    Args:
        scenario: A scenario without faults.
    """
    ends = [place for name, place in places(scenario).items() if name not in (PLATFORM, RECEIVER)]
    stop = scenario.track.window[1]
    farthest = float(scenario.water.fastest * stop / 2)
    told = f"and echoes that come within track.window, up to {1e3 * stop:g} ms, are from {farthest:.3g} m at most"
    said = [_receiver(scenario, told)]
    said += [_bed(scenario, ends, farthest, told)] if "seabed" in scenario.paths.causes else []
    if "target" in scenario.paths.causes and scenario.paths.geometry == "3d":
        said += [_target(target.label, target.position, ends, farthest, told) for target in scenario.targets]
    return [word for word in said if word]


def _receiver(scenario: Scenario, told: str) -> str:
    """A word on a receiver so far from the transmitter that no window holds an echo; empty otherwise."""
    carried = platforms(scenario)
    nearest = float(np.linalg.norm(carried.sending.position - carried.hearing.position, axis=1).min())
    if nearest <= scenario.water.fastest * scenario.track.window[1]:
        return ""
    return (
        f"receiver_track: it runs {nearest:.4g} m or more from the transmitter's track, {told}, out and back: nothing "
        "is heard. Bring them nearer, or give a longer window."
    )


def _bed(scenario: Scenario, ends: list[Floats], farthest: float, told: str) -> str:
    """A word on a bed below all that is heard; empty otherwise."""
    if scenario.seabed.scattering is None:
        return ""
    nearest = float(min(np.nanmin(floor_under(scenario, place) - place[:, 2]) for place in ends))
    if nearest <= farthest * (SLOPES if scenario.seabed.relief else 1.0):
        return ""
    return (
        f"seabed: it lies {nearest:.4g} m or more below the sonar, {told}: nothing of it is heard. Give a deeper track "
        "or a longer window; of a surveyed grid, see whether its heights are in metres."
    )


def _target(label: str, position: tuple[float, ...], ends: list[Floats], farthest: float, told: str) -> str:
    """A word on a target that no ping comes near; empty otherwise."""
    nearest = float(min(np.hypot(*(place[:, :2] - position[:2]).T).min() for place in ends))
    if nearest <= farthest + BODY:
        return ""
    return (
        f"target {label}: it lies {nearest:.4g} m or more from the track, {told}: it is not heard. Move it "
        "(north, then east), or the track, or give a longer window."
    )
