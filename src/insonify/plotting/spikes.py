"""Spike array: every arrival of a ping at its delay, coloured by its pair of families."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.records.arrivals import Arrivals
from insonify.units import level_db

NEARLY = {"B": "D", "SB": "S"}
"""Families drawn as the family without the last bounce, which changes the delay by less than a pulse near the bed."""
STEMS = 350
"""Largest number of stems side by side [1]."""
BELOW = 60.0
"""Range of levels shown below the strongest arrival [dB]."""


def spikes(arrivals: Arrivals, path: str | Path) -> Path:
    """Draw the paths of a ping as spikes.

    Args:
        arrivals: Paths of the ping.
        path: File of the figure.

    Returns:
        The path.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml").with_("paths.contributions", ["target"])
        >>> picture = spikes(insonify.arrivals(scenario, ping=40), "spikes.png")
        >>> picture.name, picture.stat().st_size > 0
        ('spikes.png', True)
    """
    with style.plot_style():
        figure = style.new_figure(9, 4.5)
        level = level_db(np.abs(arrivals.amplitude) ** 2)
        spike_array(figure.subplots(), arrivals, level, "level re the source at 1 m [dB]")
        return style.save_figure(figure, path)


def spike_array(axes: Axes, arrivals: Arrivals, level: NDArray[np.float64], label: str) -> None:
    """Draw targets as stems, and seabed, surface and water as points, each pair of families in its colour.

    Args:
        axes: Axes to draw on.
        arrivals: Paths, n of them.
        level: Level of each path [dB], shape (n,).
        label: Label of the level axis, with its reference.
    """
    floor = level.max() - BELOW if level.size else -BELOW
    colours = pair_colour(arrivals)
    dust = np.isin(arrivals.object, ("seabed", "surface", "water"))
    delay = arrivals.delay * 1e3
    stems = _tallest(delay, level, colours, np.flatnonzero(~dust))
    axes.vlines(delay[stems], floor, level[stems], colors=colours[stems].tolist(), linewidth=0.7, alpha=0.8)
    axes.scatter(delay[dust], level[dust], s=1.2, c=colours[dust], alpha=0.45, linewidths=0, rasterized=True)
    axes.scatter(delay[~dust], level[~dust], s=5, c=colours[~dust], linewidths=0)
    for name in (*style.PAIRS, "surface"):
        colour = style.PAIRS.get(name, style.QUIET)
        if (colours == colour).any():
            axes.plot([], [], "o", color=colour, markersize=4, label="off the surface" if name == "surface" else name)
    axes.set(ylim=(floor, floor + BELOW + 8), xlabel="delay [ms]", ylabel=label)
    if level.size:
        axes.legend(ncols=7, loc="upper right", handletextpad=0.2, columnspacing=1.0)


def _tallest(delay: NDArray[np.float64], level: NDArray[np.float64], colours: NDArray[np.str_],
             rows: NDArray[np.int64]) -> NDArray[np.int64]:  # fmt: skip
    """Rows of the tallest spike of each colour among those that would overlap."""
    if rows.size == 0:
        return rows
    width = max(float(np.ptp(delay)) / STEMS, 1e-12)
    tallest: dict[tuple[int, str], int] = {}
    for row in rows[np.argsort(level[rows], kind="stable")]:
        tallest[int(delay[row] / width), str(colours[row])] = int(row)
    return np.array(list(tallest.values()))


def pair_colour(arrivals: Arrivals) -> NDArray[np.str_]:
    """Colour of each arrival by its pair of families, or one colour for scattering by the surface, shape (n,)."""
    names = np.array([arrivals.transmit_family, arrivals.receive_family])
    for short, plain in NEARLY.items():
        names[names == short] = plain
    colour = np.full(len(arrivals), style.QUIET, "<U7")
    for name, value in style.PAIRS.items():
        a, b = name.split("-")
        colour[((names[0] == a) & (names[1] == b)) | ((names[0] == b) & (names[1] == a))] = value
    colour[arrivals.object == "surface"] = style.QUIET
    return colour
