"""Spikes by the source of the return: who echoed, when, how loud."""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.plotting.spikes import BELOW
from insonify.records.arrivals import Arrivals

BOUNDARIES = ("seabed", "surface", "water")


def spikes_by_source(axes: Axes, arrivals: Arrivals, level: NDArray[np.float64], label: str, *,
                 span: tuple[float, float] | None = None) -> None:  # fmt: skip
    """Targets as stems, seabed, surface and water as dust, each source in its colour.

    Args:
        axes: Where to draw.
        arrivals: The paths, n of them.
        level: Level of each [dB], shape (n,).
        label: What the level is, with its reference.
        span: Lowest and highest level shown [dB]; by default as the loudest path asks.
    """
    highest = 5 * np.ceil(level.max() / 5) + 10 if level.size else 0.0
    (floor, top), delay = span or (highest - BELOW, highest), arrivals.delay * 1e3
    for owner in BOUNDARIES:
        own = arrivals.object == owner
        if own.any():
            axes.scatter(delay[own], level[own], s=2.5, color=style.CONTRIBUTION_COLOURS[owner], alpha=0.65, linewidths=0,
                         rasterized=True)  # fmt: skip
            axes.plot([], [], "o", color=style.CONTRIBUTION_COLOURS[owner], markersize=4, label=owner)
    own = ~np.isin(arrivals.object, BOUNDARIES)
    if own.any():
        axes.vlines(delay[own], floor, level[own], color=style.CONTRIBUTION_COLOURS["target"], linewidth=0.4, alpha=0.25,
                    rasterized=True)  # fmt: skip
        axes.scatter(
            delay[own], level[own], s=3, color=style.CONTRIBUTION_COLOURS["target"], linewidths=0, rasterized=True
        )
        axes.plot([], [], "o", color=style.CONTRIBUTION_COLOURS["target"], markersize=4, label="target")
    axes.set_ylim(floor, top)
    axes.set_xlabel("delay [ms]")
    axes.set_ylabel(label)
    if level.size:
        axes.legend(ncols=3, loc="upper right", handletextpad=0.2, columnspacing=1.0)
