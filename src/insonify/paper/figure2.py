"""Figure 2: one ping about the target, direct paths only, over a fractal bed and over a flat one.

The scenario is that of `sidescan_model`. The mean level of a flat bed is smooth; that of a fractal one of a few
centimetres rms, at 3.4 degrees grazing angle, is not, because of shadows. The box causes the echo of its face and the
shadow behind it. Under the thermocline the grazing angle on the bed is 9 degrees: the shadow is a third as long, the
level fluctuates less, and no direct sound reaches the bed beyond 162 m.
"""

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.paper import sidescan_model
from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.sidescan_model import WATERS, Water
from insonify.plotting import style
from insonify.scenario.scenario import Scenario
from insonify.units import level_db

TITLE = "One ping about the target over a fractal and a flat bed, direct paths"
WINDOW = (0.195, 0.230)
BEFORE = (0.160, 0.198)
"""Window of the bed only [s]."""
LOCAL = (0.1985, 0.2)
"""Bed just before the target in both waters [s]."""
SEEDS = 3
"""Number of beds whose fluctuation is averaged."""
ROUGHNESS = {0.02: 1.5, 0.05: 3.0}
"""Rms height of the relief [m], and least fluctuation of the level [dB]."""
SPAN = (30.0, 120.0)
PROTOTYPE = "independent prototype: 2.2 dB at 2 cm, 5.8 dB at 5 cm of relief with Lambert's law"

Floats = NDArray[np.float64]


def scene(water: Water, *, relief: float = 0.0, boxed: bool = True, window: tuple[float, float] = WINDOW) -> Scenario:
    """The figure's scenario.

    Args:
        water: Water with or without the profile.
        relief: Rms height of the bed's relief [m].
        boxed: True for the scene with the target.
        window: Recorded window [s].
    """
    changes = {"paths.max_reflections": 0, "track.window": window}
    return sidescan_model.scene(water, changes if boxed else sidescan_model.without_box(changes), relief=relief)


def fluctuation(relief: float, *, seeds: int = SEEDS, geometry: str = "3d") -> float:
    """Fluctuation of the level of the bed before the target at one sound speed, mean over realisations [dB].

    Args:
        relief: Rms height of the relief [m].
        seeds: Number of realisations of the bed.
        geometry: "3d" for the whole scene, or "slice" for one vertical plane.
    """
    changes = sidescan_model.without_box(
        {"paths.max_reflections": 0, "paths.geometry": geometry, "paths.scatterers_per_cell": sidescan_model.GRAINS,
         "track.window": BEFORE}
    )  # fmt: skip
    beds = [sidescan_model.scene("one speed", {**changes, "seed": seed}, relief=relief) for seed in range(1, seeds + 1)]
    return float(np.mean([sidescan_model.ripple(*sidescan_model.expected_ping(bed), BEFORE) for bed in beds]))


def dark(water: Water) -> tuple[float, float]:
    """Start and end of the window in which the whole pulse is in the box's shadow [s]."""
    foot = sidescan_model.two_way(water, "D", "D", sidescan_model.BACK, sidescan_model.BED) + sidescan_model.PULSE
    return foot, sidescan_model.two_way(water, "D", "D", sidescan_model.shadow_end(water), sidescan_model.BED)


def contrast(water: Water) -> float:
    """Level of the bare flat bed over that in the shadow [dB]."""
    free, cut = (sidescan_model.expected_ping(scene(water, boxed=boxed)) for boxed in (False, True))
    return sidescan_model.mean_level(*free, dark(water)) - sidescan_model.mean_level(*cut, dark(water))


def peak(water: Water, relief: float) -> float:
    """Peak of the target over the mean of the bed just before it [dB]."""
    time, intensity = sidescan_model.expected_ping(scene(water, relief=relief))
    return float(level_db(intensity[time < dark(water)[0]].max())) - sidescan_model.mean_level(time, intensity, LOCAL)


def numbers(seeds: int = SEEDS) -> list[CheckedNumber]:
    """Fluctuation over a flat and a fractal bed; level of the target; level and length of its shadow.

    Args:
        seeds: Number of fractal beds that are averaged.
    """
    smooth = "a flat bed is smooth: less than 0.2 dB"
    rows = []
    for relief, least in ROUGHNESS.items():
        name = f"fluctuation of the level, {100 * relief:g} cm rms of relief"
        rows.append(CheckedNumber(name, fluctuation(relief, seeds=seeds), "dB", least, None, PROTOTYPE))
    name = f"{name}, vertical plane"
    rows.append(CheckedNumber(name, fluctuation(0.05, seeds=seeds, geometry="slice"), "dB", 3.0, None, PROTOTYPE))
    for water in WATERS:
        flat = sidescan_model.expected_ping(scene(water, boxed=False, window=BEFORE))
        rows.append(
            CheckedNumber(
                f"{water}: fluctuation, flat bed", sidescan_model.ripple(*flat, BEFORE), "dB", 0.0, 0.2, smooth
            )
        )
        for name, relief in (("flat", 0.0), ("fractal", sidescan_model.RELIEF)):
            rows.append(
                CheckedNumber(f"{water}: target over a {name} bed", peak(water, relief), "dB", 10.0, None, "stands out")
            )
        source, leakage = "sound round the sides of a 2 m box: integral of sinc^4", sidescan_model.beam_leakage_db()
        rows.append(CheckedNumber(f"{water}: shadow below the flat bed", contrast(water), "dB", leakage, 1.0, source))
        time, intensity = sidescan_model.expected_ping(scene(water))
        end = dark(water)[1]
        measured = sidescan_model.shadow_end_time(time, intensity, end)
        rows.append(
            CheckedNumber(f"{water}: shadow ends", 1e3 * measured, "ms", 1e3 * end, 0.05, "exact ray over the far edge")
        )
    return rows


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    figure = style.new_figure(9.5, 7.5)
    rows = figure.subplots(2, 1, sharex=True, sharey=True)
    for axes, letter, water in zip(rows, "ab", WATERS, strict=True):
        _panel(axes, water)
        axes.set_title(f"{letter}  {sidescan_model.TITLES[water]}")
    rows[0].legend(ncols=2, loc="upper right")
    rows[-1].set_xlabel("time after the start of transmission [ms]")
    scenarios = {f"{water}, fractal": scene(water, relief=sidescan_model.RELIEF) for water in WATERS}
    scenarios |= {f"{water}, flat": scene(water) for water in WATERS}
    return figure, scenarios, numbers()


def _panel(axes: Axes, water: Water) -> None:
    """Draw both beds in one water, with the shadow by exact rays."""
    start, end = (1e3 * when for when in dark(water))
    axes.axvspan(start - 1e3 * sidescan_model.PULSE, end, color=style.QUIET, alpha=0.13, linewidth=0)
    axes.text((start + end) / 2, SPAN[1] - 16, "shadow by exact rays", ha="center", color=style.QUIET, fontsize=9)
    for relief, colour, wide, name in (
        (sidescan_model.RELIEF, style.INK, 0.9, f"fractal bed, {100 * sidescan_model.RELIEF:g} cm rms"),
        (0.0, style.EXPECTED, 1.6, "flat bed"),
    ):
        time, intensity = sidescan_model.expected_ping(scene(water, relief=relief))
        level = np.maximum(level_db(np.maximum(intensity, 1.0)), SPAN[0] - 20)
        axes.plot(1e3 * time, level, color=colour, linewidth=wide, label=name)
        if relief:
            top = int(np.argmax(level))
            axes.annotate("target", (1e3 * time[top], level[top]), xytext=(8, -4), textcoords="offset points",
                          color=style.CONTRIBUTION_COLOURS["target"], fontweight="bold")  # fmt: skip
    axes.set(xlim=[1e3 * when for when in WINDOW], ylim=SPAN, ylabel="level [dB re 1 uPa]")
    axes.grid(True)
