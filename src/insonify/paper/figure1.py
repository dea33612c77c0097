"""Figure 1: the sound-speed profile of the scenario.

The paper prints it as a picture without numbers; `thermocline_model` has the values used instead. The numbers are
those of a scenario that was written as YAML and read back, and of a table that was written and read.
"""

import tempfile
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from insonify.ocean.profile import SoundSpeedProfile
from insonify.ocean.profile_file import read_profile
from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.thermocline_model import PROFILE, layered
from insonify.plotting import style
from insonify.plotting.profile import gradients, speeds
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml

TITLE = "Sound-speed profile: a summer thermocline about the sonar"
SONAR, TARGET = 11.0, (19.0, 20.0)
"""Depth of the sonar, and of the target's top and foot [m]."""


def profile_read_from_yaml() -> SoundSpeedProfile:
    """Profile of a scenario that was written as YAML and read back."""
    scenario = parse_model(Scenario, to_yaml(layered()))
    return scenario.water.profile_to_depth(scenario.seabed.depth)


def profile_read_from_table() -> SoundSpeedProfile:
    """Profile of a table of comma-separated values that was written and read back."""
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "cast.csv"
        rows = [f"{depth!r},{speed!r}" for depth, speed in PROFILE]
        table.write_text("\n".join(["depth,speed", *rows]) + "\n", encoding="utf-8")
        return read_profile(table)


def numbers() -> list[CheckedNumber]:
    """Speeds at the knots after the round trip, and between them."""
    rows = []
    for name, profile in (("scenario file", profile_read_from_yaml()), ("table", profile_read_from_table())):
        for depth, speed in PROFILE:
            value = float(profile.at(depth))
            rows.append(
                CheckedNumber(f"{name}: speed at the knot at {depth:g} m", value, "m/s", speed, 0.0, "as written")
            )
    profile, line = profile_read_from_yaml(), "straight line between knots"
    rows.append(CheckedNumber("speed at the sonar, 11 m", float(profile.at(SONAR)), "m/s", 1500.0, 1e-10, line))
    slope = (PROFILE[2][1] - PROFILE[1][1]) / (PROFILE[2][0] - PROFILE[1][0])
    rows.append(CheckedNumber("gradient at the sonar", float(profile.gradient(SONAR)), "1/s", slope, 1e-12, line))
    rows.append(CheckedNumber("radius of a horizontal ray at the sonar", 1500.0 / abs(slope), "m"))
    return rows


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    profile = profile_read_from_yaml()
    figure = style.new_figure(9, 5.5)
    left, right = figure.subplots(1, 2, sharey=True)
    speeds(left, profile)
    gradients(right, profile)
    left.set(ylim=(21.0, -1.0), ylabel="depth [m]")
    for axes in (left, right):
        axes.axhline(0, color=style.CONTRIBUTION_COLOURS["surface"], linewidth=2)
        axes.axhspan(20, 21, color=style.CONTRIBUTION_COLOURS["seabed"], alpha=0.3, linewidth=0)
        axes.axhline(20, color=style.CONTRIBUTION_COLOURS["seabed"], linewidth=2)
    _mark_depths(left)
    return figure, {"thermocline": layered()}, numbers()


def _mark_depths(axes: Axes) -> None:
    """Mark sonar and target at their depths."""
    low, high = axes.get_xlim()
    depths, knot_speeds = np.array(PROFILE).T
    speed = float(np.interp(SONAR, depths, knot_speeds))
    axes.plot([speed], [SONAR], "o", color=style.CONTRIBUTION_COLOURS["target"], markersize=8)
    axes.annotate(
        f"sonar, {SONAR:g} m: {speed:g} m/s", (speed, SONAR), xytext=(10, 0), textcoords="offset points", va="center"
    )
    axes.axhspan(*TARGET, xmin=0.93, color=style.CONTRIBUTION_COLOURS["target"], alpha=0.8, linewidth=0)
    axes.annotate("target", (low + 0.92 * (high - low), sum(TARGET) / 2), ha="right", va="center")
