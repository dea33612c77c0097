"""Figure of an interferometric sidescan: image, phase, depth, true depth, and the profile of one ping."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats, colour_span
from insonify.plotting.soundings import DEPTHS, depth_span
from insonify.plotting.waterfall import thinned
from insonify.processing import empirical_gain_db

THIN = 500
"""Columns drawn on each side [1]."""


@dataclass(frozen=True, slots=True)
class SwathSide:
    """One side of the swath; arrays over (ping, time)."""

    sign: int
    """-1 port, 1 starboard."""
    level: Floats
    """Level at the upper receiver [dB re 1 uPa]."""
    phase: Floats
    """Phase between the receivers [rad]."""
    across: Floats
    """Across-track position of each depth, to starboard [m]."""
    depth: Floats
    """Measured depth [m]."""
    truth: Floats
    """True depth at the measured position [m]."""
    sure: NDArray[np.bool_]
    """True where the coherence of the receivers is sufficient."""


def interferogram_view(sides: list[SwathSide], slant: Floats, run: Floats, row: int, title: str) -> Figure:
    """Draw four images of a swath, and the profile of one ping.

    Args:
        sides: One side, or port and starboard.
        slant: Slant range of the samples [m], shape (time,).
        run: Along-track distance of each ping [m], shape (ping,).
        row: Row of the ping of the profile.
        title: Title of the figure.
    """
    figure = style.new_figure(14, 10)
    figure.suptitle(title, fontweight="bold", fontsize=11)
    panels = figure.subplot_mosaic([["image", "phase"], ["depth", "truth"], ["profile", "profile"]],
                                   height_ratios=(1, 1, 0.8))  # fmt: skip
    level = [side.level + empirical_gain_db(side.level, slant) for side in sides]
    span = colour_span(np.concatenate([one.ravel() for one in level]))
    deep = depth_span(np.concatenate([side.truth[side.sure] for side in sides]))
    pictures: dict[str, tuple[list[Floats], str | Colormap, tuple[float, float], str, str]] = {
        "image": ([thinned(one, THIN) for one in level], style.COPPER, span, "level re the usual one [dB]",
                  "Sidescan image"),
        "phase": ([_every(side.phase) for side in sides], "twilight", (-np.pi, np.pi), "phase [rad]",
                  "Phase between the receivers"),
        "depth": ([_every(np.where(side.sure, side.depth, np.nan)) for side in sides], DEPTHS, deep, "depth [m]",
                  "Depth by phase"),
        "truth": ([_every(np.where(side.sure, side.truth, np.nan)) for side in sides], DEPTHS, deep, "depth [m]",
                  "True depth at the same positions"),
    }  # fmt: skip
    for name, (parts, colours, limits, label, caption) in pictures.items():
        axes = panels[name]
        for side, values in zip(sides, parts, strict=True):
            axes.imshow(values, origin="lower", aspect="auto", cmap=colours, vmin=limits[0], vmax=limits[1],
                        extent=(side.sign * slant[0], side.sign * slant[-1], run[0], run[-1]),
                        interpolation="nearest")  # fmt: skip
        _as_swath(axes, [side.sign * slant[-1] for side in sides])
        axes.set_title(caption)
        figure.colorbar(axes.images[-1], ax=axes, label=label, pad=0.01)
    _profile(panels["profile"], sides, row, run)
    return figure


def _every(values: Floats) -> Floats:
    """Every n-th column, as many as are drawn: phases and depths are not averaged."""
    return values[:, :: max(1, -(-values.shape[1] // THIN))]


def _as_swath(axes: Axes, ends: list[float]) -> None:
    axes.set_xlim(min([0.0, *ends]), max([0.0, *ends]))
    axes.set_facecolor("#303030")
    axes.grid(False)
    axes.xaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    sides = "port  |  starboard,  " if min(ends) < 0 < max(ends) else ""
    axes.set(xlabel=f"{sides}slant range [m]", ylabel="distance run [m]")


def _profile(axes: Axes, sides: list[SwathSide], row: int, run: Floats) -> None:
    for side in sides:
        sure, blue = side.sure[row], style.CONTRIBUTION_COLOURS["surface"]
        across, truth, depth = (values[row][sure] for values in (side.across, side.truth, side.depth))
        order = np.argsort(across)
        axes.plot(across[order], truth[order], color=blue, linewidth=2.5, alpha=0.5,
                  label="true" if side is sides[0] else None)  # fmt: skip
        axes.plot(across, depth, ".", markersize=2, color=style.INK, label="by phase" if side is sides[0] else None)
    deep = depth_span(np.concatenate([side.truth[row][side.sure[row]] for side in sides]))
    axes.set_ylim(deep[1] + 0.5, deep[0] - 0.5)
    axes.set_xlabel("across the track, to starboard [m]")
    axes.set_ylabel("depth [m]")
    axes.set_title(f"Profile of the ping at {run[row]:.1f} m")
    axes.legend(loc="upper center", ncols=2)
