"""The ground of a scenario from above, as far as its sonar hears it: depths, track, targets and gaps."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.drawing import style
from insonify.scenario.scenario import Scenario
from insonify.sonar.track import poses

Floats = NDArray[np.float64]
POINTS = 600
"""Points along the longer side of the map."""
UNKNOWN = "0.82"
"""Grey of ground that was not surveyed."""


def bed(scenario: Scenario, path: str | Path) -> Path:
    """Draw the depth of the seabed around a scenario's track.

    Args:
        scenario: What is simulated.
        path: Picture to write.

    Returns:
        The path.
    """
    with style.page():
        figure = style.sheet(9, 7)
        bed_map(figure.subplots(), scenario)
        return style.keep(figure, path)


def bed_map(axes: Axes, scenario: Scenario) -> None:
    """The depth of the ground as far as a direct echo comes from, north up.

    Args:
        axes: Where to draw.
        scenario: What is simulated.
    """
    track = poses(scenario.track, seed=scenario.seed).position
    reach = scenario.water.sound_speed * scenario.track.window[1] / 2
    (south, west), (north, east) = track[:, :2].min(axis=0) - reach, track[:, :2].max(axis=0) + reach
    step = max(north - south, east - west) / POINTS
    norths, easts = np.arange(south, north, step) + step / 2, np.arange(west, east, step) + step / 2
    image = axes.imshow(
        depths(scenario, norths, easts), origin="lower", extent=(west, east, south, north), cmap=style.COPPER.reversed()
    )
    axes.set_facecolor(UNKNOWN)
    axes.grid(False)
    axes.figure.colorbar(image, ax=axes, label="depth [m]", pad=0.02)
    axes.plot(track[:, 1], track[:, 0], color=style.FAMILIES["S"], marker="." if len(track) == 1 else "", label="track")
    for target in scenario.targets:
        axes.plot(target.position[1], target.position[0], "+", color=style.CAUSES["target"], markersize=9)
        axes.annotate(
            target.label, target.position[1::-1], xytext=(5, 5), textcoords="offset points", fontsize=8,
            annotation_clip=True,
        )  # fmt: skip
    axes.set(xlim=(west, east), ylim=(south, north))
    grid = scenario.seabed.grid
    axes.set_title(scenario.title or "The seabed" if grid is None else grid.told, fontsize=10)
    axes.set_xlabel("east [m]")
    axes.set_ylabel("north [m]")
    axes.legend(loc="upper right", frameon=True)


def depths(scenario: Scenario, north: Floats, east: Floats) -> Floats:
    """Depth of the ground [m] on a grid, shape (north, east); NaN where it was not surveyed.

    Args:
        scenario: What is simulated.
        north: Rows [m], shape (n,).
        east: Columns [m], shape (m,).
    """
    ground = scenario.settled_seabed.bed
    if ground is None:
        return np.full((len(north), len(east)), scenario.seabed.depth)
    return ground.depth_at(north[:, None], east[None, :])
