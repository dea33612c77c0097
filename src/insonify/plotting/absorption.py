"""Absorption of different waters against frequency, up to a megahertz."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from insonify.ocean.absorption import absorption_db_per_m
from insonify.ocean.water import Water
from insonify.plotting import style
from insonify.plotting.validity_style import Caveats, LawCurve, add_caveats, evaluate_with_caveats

WATERS: Mapping[str, Water] = {
    "tropical, 22 °C, 35 g/kg": Water(temperature=22.0, salinity=35.0),
    "temperate, 10 °C, 35 g/kg": Water(temperature=10.0, salinity=35.0),
    "polar, -1 °C, 34 g/kg": Water(temperature=-1.0, salinity=34.0),
    "Baltic, 8 °C, 8 g/kg": Water(temperature=8.0, salinity=8.0),
}
"""Typical waters near the surface."""
COLOURS = ("#D55E00", "#1A1A1A", "#0072B2", "#009E73", "#E69F00", "#CC79A7")
FREQUENCY = np.geomspace(1e3, 1e6, 301)
"""Frequencies drawn [Hz]."""


def absorption(path: str | Path, *, waters: Mapping[str, Water] = WATERS, depth: float = 0.0) -> Path:
    """Draw absorption against frequency by both published laws, and their difference.

    Args:
        path: File of the figure.
        waters: Waters by name, at most six; their measured absorption is ignored.
        depth: Depth [m].

    Returns:
        The path.

    Example:
        >>> waters = {"North Sea, 10 °C": insonify.ocean.Water(temperature=10.0, salinity=35.0)}
        >>> picture = absorption("absorption.png", waters=waters, depth=30.0)
        >>> picture.name, picture.stat().st_size > 0
        ('absorption.png', True)
    """
    if not 1 <= len(waters) <= len(COLOURS):
        raise ValueError(f"{len(waters)} waters were given; a figure distinguishes 1 to {len(COLOURS)} by colour.")
    with style.plot_style():
        figure = style.new_figure(9, 8)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
        add_caveats(figure, losses(upper, lower, waters, depth), "Thin: ")
        return style.save_figure(figure, path)


def losses(upper: Axes, lower: Axes, waters: Mapping[str, Water], depth: float) -> Caveats:
    """Draw absorption over frequency, and below it the difference of the laws.

    Args:
        upper: Axes for the absorption.
        lower: Axes for the ratio of the laws.
        waters: As for `absorption`.
        depth: Depth [m].

    Returns:
        The caveats of the laws.
    """
    caveats: Caveats = ()
    for (name, water), colour in zip(waters.items(), COLOURS, strict=False):
        francois, ainslie = (_loss(water, depth, model) for model in ("francois-garrison", "ainslie-mccolm"))
        for loss, line, label in ((francois, "-", name), (ainslie, "--", None)):
            alpha = 0.45 if loss.caveats else 1.0
            upper.plot(FREQUENCY / 1e3, loss.values, line, color=colour, label=label, alpha=alpha)
        difference = 100 * (ainslie.values / francois.values - 1)
        alpha = 0.45 if francois.caveats or ainslie.caveats else 1.0
        lower.plot(FREQUENCY / 1e3, difference, color=colour, alpha=alpha)
        caveats += francois.caveats + ainslie.caveats
    upper.plot([], [], "-", color=style.QUIET, label="Francois & Garrison (1982)")
    upper.plot([], [], "--", color=style.QUIET, label="Ainslie & McColm (1998)")
    upper.set_xscale("log")
    upper.set_yscale("log")
    upper.set_title(f"Absorption of sound in sea water at a depth of {depth:g} m")
    upper.set_ylabel("absorption [dB/km]")
    upper.legend(loc="upper left")
    lower.axhline(0, color=style.QUIET, linewidth=0.8)
    lower.set_title("Ainslie & McColm over Francois & Garrison")
    lower.set_ylabel("difference [%]")
    lower.set_xlabel("frequency [kHz]")
    lower.set_xlim(FREQUENCY[0] / 1e3, FREQUENCY[-1] / 1e3)
    lower.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    return caveats


def _loss(water: Water, depth: float, model: str) -> LawCurve:
    return evaluate_with_caveats(
        lambda: 1e3 * absorption_db_per_m(
            FREQUENCY, temperature=water.temperature, salinity=water.salinity, depth=depth, ph=water.ph, model=model
        )
    )  # fmt: skip
