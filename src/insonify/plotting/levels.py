"""Level curves: expected level of each contribution over time."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from insonify.plotting import style

BELOW = 80.0
"""Range of levels shown below the maximum [dB]."""


def levels(dataset: xr.Dataset, path: str | Path, *, window: tuple[float, float] | None = None) -> Path:
    """Draw level curves by contribution.

    Args:
        dataset: `level_db` over (contribution, pair, time) [dB re 1 uPa], as from `insonify.levels`.
        path: File of the figure.
        window: Start and stop [s]; all by default.

    Returns:
        The path.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> picture = levels(insonify.levels(scenario, ping=40), "levels.png", window=(0.03, 0.05))
        >>> picture.name, picture.stat().st_size > 0
        ('levels.png', True)
    """
    with style.plot_style():
        figure = style.new_figure(9, 4.5)
        curves(figure.subplots(), dataset, window)
        return style.save_figure(figure, path)


def curves(axes: Axes, dataset: xr.Dataset, window: tuple[float, float] | None = None) -> None:
    """Draw one curve for each contribution with a finite level.

    Args:
        axes: Axes to draw on.
        dataset: As for `levels`.
        window: Start and stop [s].
    """
    time = dataset["time"].values
    first, last = window or (time[0], time[-1])
    inside = (time >= first) & (time <= last)
    all_pairs = dataset["level_db"].sel(pair="all").values[:, inside]
    for contribution, level in zip(dataset["contribution"].values, all_pairs, strict=True):
        if np.isfinite(level).any():
            is_total = contribution == "total"
            axes.plot(
                time[inside] * 1e3, np.where(np.isfinite(level), level, np.nan), label=str(contribution),
                color=style.CONTRIBUTION_COLOURS[str(contribution)], linewidth=2.6 if is_total else 1.3,
                alpha=0.35 if is_total else 1.0,
                linestyle="--" if contribution == "noise" else "-", zorder=1 if is_total else 2,
            )  # fmt: skip
    top = all_pairs[np.isfinite(all_pairs)].max() if np.isfinite(all_pairs).any() else 0.0
    axes.set_xlim(first * 1e3, last * 1e3)
    axes.set_ylim(top - BELOW, top + 8)
    axes.set_xlabel("time after the start of transmission [ms]")
    axes.set_ylabel("level [dB re 1 uPa]")
    axes.legend(ncols=5, loc="upper right", handlelength=1.6, columnspacing=1.2)
