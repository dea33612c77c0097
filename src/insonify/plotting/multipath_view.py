"""Sidescan past a body with and without multipath, and the levels of its echoes."""

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats
from insonify.plotting.waterfall import thinned
from insonify.units import level_db

COLUMNS = 900
SPAN = 40.0
"""Range of levels from the darkest to the brightest colour [dB]."""
ABOVE = 22.0
"""Level of the brightest colour above the seabed [dB]."""


@dataclass(frozen=True, slots=True)
class TargetEcho:
    """Echo of a body by one pair of families."""

    pair: str
    delay: float
    """Start of the echo of the nearest part of the face [s]."""
    spread: float
    """Delay of the farthest part of the face after the nearest [s]."""


@dataclass(frozen=True, slots=True)
class PassByLevels:
    """Mean-square pressures [uPa^2] of a sonar that passes a body."""

    time: Floats
    """Time after the start of transmission [s], shape (time,)."""
    along: Floats
    """Along-track position of each ping relative to the centre of the body [m], shape (ping,)."""
    image: Floats
    """All paths, shape (ping, time)."""
    direct: Floats
    """Direct paths only, shape (ping, time)."""
    trace: Floats
    """Mean of the pings on the body, all paths, shape (time,)."""
    direct_trace: Floats
    """Mean of the pings on the body, direct paths only, shape (time,)."""
    expected: Floats
    """Expected intensity of the pings on the body, all paths, shape (time,)."""
    direct_expected: Floats
    """Expected intensity of the pings on the body, direct paths only, shape (time,)."""


def multipath_view(
    passing: PassByLevels, echoes: list[TargetEcho], dark: tuple[float, float], sound_speed: float, title: str
) -> Figure:
    """Draw both images, and the mean of the pings on the body.

    Args:
        passing: Mean-square pressures of the pass.
        echoes: Echoes of the body with their start times.
        dark: Start and end of the shadow of direct sound [s].
        sound_speed: Sound speed of the water [m/s].
        title: Title of the figure.
    """
    figure = style.new_figure(13, 10)
    figure.suptitle(title, fontweight="bold", fontsize=11)
    first, second, below = figure.subplots(3, 1, height_ratios=(1, 1, 1.15), sharex=True)
    ms = passing.time * 1e3
    bed = [float(level_db(np.median(power))) for power in (passing.direct, passing.image)]
    panels = (first, passing.direct, "direct paths alone"), (second, passing.image, "all paths")
    for (axes, power, name), median in zip(panels, bed, strict=True):
        level = thinned(level_db(np.maximum(power, 1e-12)), COLUMNS) - median
        image = axes.imshow(level, origin="lower", aspect="auto", cmap=style.COPPER, vmin=ABOVE - SPAN, vmax=ABOVE,
                            extent=(ms[0], ms[-1], passing.along[0], passing.along[-1]),
                            interpolation="nearest")  # fmt: skip
        axes.set_title(f"{name}; the bed at {median:.0f} dB re 1 uPa")
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
    for name, trace, expected, colour in lines:
        below.plot(
            ms, level_db(np.maximum(trace, 1e-12)), color=colour, linewidth=0.6, alpha=0.7, label=f"{name}, simulated"
        )
        below.plot(ms, level_db(np.maximum(expected, 1e-12)), color=colour, linewidth=1.8, label=f"{name}, expected")
    below.axvspan(dark[0] * 1e3, dark[1] * 1e3, color=style.QUIET, alpha=0.12, linewidth=0)
    for echo in echoes:
        below.axvline(echo.delay * 1e3, color=style.QUIET, linewidth=0.8, linestyle=":")
    below.set_ylim(bed[0] - 25, float(level_db(passing.trace.max())) + 5)
    below.set_xlim(ms[0], ms[-1])
    below.set_title("mean of the pings on the box; dotted: predicted echoes; grey: shadow of direct sound")
    below.set_xlabel("time after the start of transmission [ms]")
    below.set_ylabel("level [dB re 1 uPa]")
    below.legend(loc="upper right", ncols=2)
    style.range_axis(first, sound_speed)
    return figure
