"""Common style of all figures: one colour for one meaning.

Hues are those of Okabe & Ito (2008), "Color Universal Design", which readers with any kind of colour vision can
distinguish; legs are lighter than the boundaries that reflect them, and pairs of legs have the hue of the longer one.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

CONTRIBUTION_COLOURS = {
    "seabed": "#B8720A",
    "surface": "#0B3F73",
    "target": "#D5350E",
    "water": "#2A9D8F",
    "boundary echo": "#7B3294",
    "noise": "#8A8A8A",
    "total": "#1A1A1A",
}
"""Colour of each contribution."""
FAMILIES = {"D": "#1A1A1A", "S": "#1E8FD5", "B": "#E69F00", "SB": "#009E73", "BS": "#CC79A7"}
"""Colour of each family of legs."""
PAIRS = {"D-D": "#1A1A1A", "D-S": "#1E8FD5", "S-S": "#7CC4EE", "D-BS": "#8E2F66", "S-BS": "#CC79A7", "BS-BS": "#E3A9C9"}
"""Colour of each pair of families that differs in delay near the seabed: the hue of the longer leg."""
INK = "#1A1A1A"
EXPECTED = "#009E73"
"""Colour of expected values, beside one ping in `INK`."""
QUIET = "#6B6B6B"
COPPER = LinearSegmentedColormap.from_list(
    "sonar copper", ["#050302", "#2A1608", "#6B3710", "#B86A1E", "#EBAA4B", "#FBDD97", "#FFFBEA"]
)
"""Colour map of sonar images, dark for low levels; lightness grows evenly."""
_RULES: Any = {
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 10,
    "axes.labelcolor": INK,
    "axes.edgecolor": QUIET,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E4E4E4",
    "grid.linewidth": 0.6,
    "xtick.color": QUIET,
    "ytick.color": QUIET,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "lines.linewidth": 1.2,
    "figure.facecolor": "white",
    "savefig.dpi": 130,
    "svg.hashsalt": "insonify",  # the same picture, the same bytes
}


@contextmanager
def plot_style() -> Iterator[None]:
    """Apply the common style to all figures that are drawn and saved in the context."""
    with matplotlib.rc_context(_RULES):
        yield


def new_figure(width: float = 9.0, height: float = 5.0) -> Figure:
    """Create an empty figure without global state.

    Args:
        width: Width [inch].
        height: Height [inch].
    """
    return Figure(figsize=(width, height), layout="constrained")


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a figure to disk, in the format of the suffix.

    Args:
        figure: Figure to write.
        path: File to write, .png, .pdf or .svg.
    """
    target = Path(path)
    # no date and no version inside: the same picture has the same bytes
    about = {".png": {"Software": None}, ".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    figure.savefig(target, metadata=about.get(target.suffix.lower(), {}))
    return target


def range_axis(axes: Axes, sound_speed: float, altitude: float | None = None, note: str = "") -> None:
    """Add a second axis on top of a time axis in milliseconds: the range of a direct echo.

    Args:
        axes: Axes whose abscissa is time [ms].
        sound_speed: Sound speed [m/s].
        altitude: Height of the sonar above the seabed [m]; then the axis is ground range, where all times shown
            reach the seabed. None: slant range.
        note: Addition to the label of the axis, such as the sound speed.
    """
    metres_per_ms = sound_speed / 2 * 1e-3
    first = axes.get_xlim()[0] * metres_per_ms
    if altitude is not None and first > 2 * altitude:
        h = altitude

        def ground(time: ArrayLike) -> NDArray[np.float64]:
            slant = np.asarray(time, float) * metres_per_ms
            return np.sqrt(np.maximum(slant**2 - h**2, 0))

        def back(distance: ArrayLike) -> NDArray[np.float64]:
            return np.hypot(np.asarray(distance, float), h) / metres_per_ms

        top = axes.secondary_xaxis("top", functions=(ground, back))
        top.set_xlabel(f"ground range of a direct echo{note} [m]")
    else:

        def slant(time: ArrayLike) -> NDArray[np.float64]:
            return np.asarray(time, float) * metres_per_ms

        def again(distance: ArrayLike) -> NDArray[np.float64]:
            return np.asarray(distance, float) / metres_per_ms

        top = axes.secondary_xaxis("top", functions=(slant, again))
        top.set_xlabel(f"slant range of a direct echo{note} [m]")
