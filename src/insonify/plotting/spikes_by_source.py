"""Spike array by contribution: delay and level of every arrival, coloured by what returned it."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.plotting.spikes import BELOW
from insonify.records.arrivals import Arrivals

BOUNDARIES = ("seabed", "surface", "water")


def spikes_by_source(axes: Axes, arrivals: Arrivals, level: NDArray[np.float64], label: str, *,
                 span: tuple[float, float] | None = None) -> None:  # fmt: skip
    """Draw targets as stems, and seabed, surface and water as points, each contribution in its colour.

    Args:
        axes: Axes to draw on.
        arrivals: Paths, n of them.
        level: Level of each path [dB], shape (n,).
        label: Label of the level axis, with its reference.
        span: Lowest and highest level shown [dB]; by default from the strongest path.
    """
    highest = 5 * np.ceil(level.max() / 5) + 10 if level.size else 0.0
    (floor, top), delay = span or (highest - BELOW, highest), arrivals.delay * 1e3
    for name in BOUNDARIES:
        rows, colour = arrivals.object == name, style.CONTRIBUTION_COLOURS[name]
        if rows.any():
            axes.scatter(delay[rows], level[rows], s=2.5, color=colour, alpha=0.65, linewidths=0, rasterized=True)
            axes.plot([], [], "o", color=colour, markersize=4, label=name)
    rows, colour = ~np.isin(arrivals.object, BOUNDARIES), style.CONTRIBUTION_COLOURS["target"]
    if rows.any():
        axes.vlines(delay[rows], floor, level[rows], color=colour, linewidth=0.4, alpha=0.25, rasterized=True)
        axes.scatter(delay[rows], level[rows], s=3, color=colour, linewidths=0, rasterized=True)
        axes.plot([], [], "o", color=colour, markersize=4, label="target")
    axes.set(ylim=(floor, top), xlabel="delay [ms]", ylabel=label)
    if level.size:
        axes.legend(ncols=3, loc="upper right", handletextpad=0.2, columnspacing=1.0)
