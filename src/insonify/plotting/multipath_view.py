"""A sidescan past a body with and without multipath, and the echoes on it."""

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats
from insonify.plotting.waterfall import thinned
from insonify.units import level_db

COLUMNS = 900
SPAN = 40.0
"""Levels from the darkest to the brightest colour [dB]."""
ABOVE = 22.0
"""How far the brightest colour is above the bed [dB]."""


@dataclass(frozen=True, slots=True)
class TargetEcho:
    """An echo of a body by one pair of legs."""

    pair: str
    delay: float
    """When it begins [s]."""
    spread: float
    """How much later that of the farthest of the face begins [s]."""


@dataclass(frozen=True, slots=True)
class PassByLevels:
    """Mean-square pressures [uPa^2] of a sonar that passes a body."""

    time: Floats
    """After the start of transmission [s], shape (time,)."""
    along: Floats
    """Of each ping, from the middle of the body [m], shape (ping,)."""
    image: Floats
    """With all paths, shape (ping, time)."""
    direct: Floats
    """By direct paths alone, shape (ping, time)."""
    trace: Floats
    """Mean of the pings on the body, with all paths, shape (time,)."""
    direct_trace: Floats
    """By direct paths alone."""
    expected: Floats
    """What is expected of them on average, with all paths."""
    direct_expected: Floats
    """By direct paths alone."""


def multipath_view(
    passing: PassByLevels, echoes: list[TargetEcho], dark: tuple[float, float], sound_speed: float, title: str
) -> Figure:
    """Two images, and the mean of the pings on the body.

    Args:
        passing: What was heard.
        echoes: Of the body, where they begin.
        dark: When the shadow of direct sound begins and ends [s].
        sound_speed: Of the water [m/s].
        title: Above it all.
    """
    figure = style.new_figure(13, 10)
    figure.suptitle(title, fontweight="bold", fontsize=11)
    first, second, below = figure.subplots(3, 1, height_ratios=(1, 1, 1.15), sharex=True)
    ms = passing.time * 1e3
    bed = [float(level_db(np.median(power))) for power in (passing.direct, passing.image)]
    panels = (first, passing.direct, "direct paths alone"), (second, passing.image, "all paths")
    for (axes, power, name), usual in zip(panels, bed, strict=True):
        level = thinned(level_db(np.maximum(power, 1e-12)), COLUMNS) - usual
        image = axes.imshow(level, origin="lower", aspect="auto", cmap=style.COPPER, vmin=ABOVE - SPAN, vmax=ABOVE,
                            extent=(ms[0], ms[-1], passing.along[0], passing.along[-1]),
                            interpolation="nearest")  # fmt: skip
        axes.set_title(f"{name}; the bed at {usual:.0f} dB re 1 uPa")
        axes.grid(False)
        axes.set_ylabel("along the track,\nfrom the box [m]")
    figure.colorbar(image, ax=[first, second], label="level re the bed [dB]", pad=0.01)
    for echo in echoes:
        second.annotate(echo.pair, (echo.delay * 1e3, passing.along[-1] * 0.25), xytext=(0, 26),
                        textcoords="offset points", ha="center", fontsize=8, color=style.COPPER(1.0),
                        arrowprops={"arrowstyle": "-", "color": style.COPPER(1.0), "linewidth": 0.6})  # fmt: skip
    blue = style.CONTRIBUTION_COLOURS["surface"]
    lines = (("all paths", passing.trace, passing.expected, style.CONTRIBUTION_COLOURS["target"]),
             ("direct paths alone", passing.direct_trace, passing.direct_expected, blue))  # fmt: skip
    for name, trace, hoped, colour in lines:
        below.plot(
            ms, level_db(np.maximum(trace, 1e-12)), color=colour, linewidth=0.6, alpha=0.7, label=f"{name}, heard"
        )
        below.plot(ms, level_db(np.maximum(hoped, 1e-12)), color=colour, linewidth=1.8, label=f"{name}, expected")
    below.axvspan(dark[0] * 1e3, dark[1] * 1e3, color=style.QUIET, alpha=0.12, linewidth=0)
    for echo in echoes:
        below.axvline(echo.delay * 1e3, color=style.QUIET, linewidth=0.8, linestyle=":")
    below.set_ylim(bed[0] - 25, float(level_db(passing.trace.max())) + 5)
    below.set_xlim(ms[0], ms[-1])
    below.set_title("mean of the pings on the box; dotted: echoes due; grey: shadow of direct sound")
    below.set_xlabel("time after the start of transmission [ms]")
    below.set_ylabel("level [dB re 1 uPa]")
    below.legend(loc="upper right", ncols=2)
    style.range_axis(first, sound_speed)
    return figure
