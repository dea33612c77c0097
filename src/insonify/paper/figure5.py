"""Figure 5: one ping about the target with sea surface and bottom in it: ghosts of the target, and a filled shadow.

The scenario is that of `sidescan_model`, with up to two reflections per leg off a flat surface and a flat bed. A leg
reflected by the surface arrives steeper and later: with one such leg (ab) a ghost of the target follows 1.9 ms later,
with two (bb) 3.8 ms later. The two mixed pairs of legs have the same length and add as amplitudes, so that the first
ghost is stronger than the target itself. Surface paths pass over the box and insonify its shadow. Over the fractal bed
the legs reflected steeply by it (e) are weaker: roughness of a few millimetres reduces the coherent reflection.
"""

from functools import lru_cache

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.paper import figure2, sidescan_model
from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.sidescan_model import WATERS, Water
from insonify.plotting import style
from insonify.plotting.leg_diagram import LETTERS
from insonify.scenario.scenario import Scenario
from insonify.simulator import arrivals, levels
from insonify.units import level_db

TITLE = "One ping about the target with surface and bottom reflections"
WINDOW = (0.195, 0.230)
ECHOES = (0.1995, 0.2130)
"""Window of the target's echoes [s]."""
GHOSTS = {"D-S": "ab", "S-S": "bb"}
"""Pairs of legs that make the ghosts, and the paper's letters."""
MIDDLE = sidescan_model.BED - 0.5
"""Depth of the middle of the face [m]."""
RISE = 10.0
"""Least rise of the level in the shadow [dB]."""
SPAN = (30.0, 128.0)
EXACT = "exact rays to the middle of the face"

Floats = NDArray[np.float64]


def scene(water: Water, *, reflections: int = 2, relief: float = 0.0, only_target: bool = False) -> Scenario:
    """The figure's scenario.

    Args:
        water: Water with or without the profile.
        reflections: Largest number of bounces of one leg.
        relief: Rms height of the bed's relief [m].
        only_target: True for the contribution of the box only.
    """
    changes = {"paths.max_reflections": reflections, "track.window": WINDOW}
    return sidescan_model.scene(water, sidescan_model.target_only(changes) if only_target else changes, relief=relief)


@lru_cache(maxsize=2)
def echoes(water: Water) -> xr.Dataset:
    """Expected level of the target by pair of legs [dB re 1 uPa], over (pair, time)."""
    return levels(scene(water, only_target=True)).sel(contribution="target")


def ghost_delay(water: Water, pair: str) -> tuple[float, float]:
    """Delay of a ghost after the target, measured and by exact rays [s]."""
    out, back = pair.split("-")
    point = (sidescan_model.FACE, MIDDLE)
    expected = sidescan_model.two_way(water, out, back, *point) - sidescan_model.two_way(water, "D", "D", *point)
    return sidescan_model.echo(echoes(water), pair)[0] - sidescan_model.echo(echoes(water), "D-D")[0], expected


def ghost_level(water: Water, pair: str) -> tuple[float, float]:
    """Energy of a ghost re the target's direct echo, measured and by exact rays [dB].

    Each leg by the surface has another spreading, absorption and angle at the face, which scatters by Lambert's law;
    the two mixed pairs of legs add as amplitudes: twice the pressure, four times the energy.
    """
    direct, reflected = (sidescan_model.ray(water, name, sidescan_model.FACE, MIDDLE) for name in ("D", "S"))
    scenario = scene(water)
    lost = float(scenario.water.absorption(scenario.sonar.pulse.frequency)) * (reflected.length - direct.length)
    one = (
        2 * level_db(reflected.amplitude / direct.amplitude)
        - lost
        + level_db(np.cos(reflected.angle) / np.cos(direct.angle))
    )
    expected = {"D-S": float(one) + float(level_db(4.0)), "S-S": 2 * float(one)}[pair]
    ghost, target = (sidescan_model.echo(echoes(water), name)[1] for name in (pair, "D-D"))
    return float(level_db(ghost / target)), expected


def slope(water: Water) -> tuple[float, float]:
    """Change of the first ghost's delay re the target per metre of depth, computed and by exact rays [s/m].

    By Fermat's principle the travel time of a leg grows by the sine of its angle of arrival over the sound speed.
    """
    paths = arrivals(scene(water, reflections=1, only_target=True), window=ECHOES)
    face = paths.take(paths.position[:, 1] < sidescan_model.FACE + 1e-6)
    direct = face.take((face.transmit_family == "D") & (face.receive_family == "D"))
    ghost = face.take((face.transmit_family == "D") & (face.receive_family == "S"))
    order = np.argsort(direct.group), np.argsort(ghost.group)
    later = ghost.delay[order[1]] - direct.delay[order[0]]
    fitted = np.polyfit(direct.position[order[0], 2], later, 1)[0]
    down, steep = (sidescan_model.ray(water, name, sidescan_model.FACE, MIDDLE).angle for name in ("D", "S"))
    speed = float(scene(water).water.sound_speed_at(MIDDLE))
    return float(fitted), float((np.sin(steep) - np.sin(down)) / speed)


def rise(water: Water) -> float:
    """Rise of the level in the shadow on the flat bed by reflections, without ghosts of the target [dB]."""
    window = figure2.dark(water)
    changes = {"paths.contributions": ["seabed"], "track.window": WINDOW}
    beds = [sidescan_model.scene(water, {**changes, "paths.max_reflections": n}) for n in (0, 2)]
    direct, reflected = (sidescan_model.mean_level(*sidescan_model.expected_ping(bed), window) for bed in beds)
    return reflected - direct


def numbers() -> list[CheckedNumber]:
    """Delays and levels of the ghosts, and rise of the level in the shadow."""
    rows = []
    for water in WATERS:
        for pair, letters in GHOSTS.items():
            simulated, expected = ghost_delay(water, pair)
            name = f"{water}: ghost {letters} later than the target by"
            rows.append(CheckedNumber(name, 1e3 * simulated, "ms", 1e3 * expected, 0.01, EXACT))
            simulated, expected = ghost_level(water, pair)
            rows.append(
                CheckedNumber(
                    f"{water}: ghost {letters} stronger by", simulated, "dB", expected, 0.3, f"{EXACT}; 4 |A|^2"
                )
            )
        simulated, expected = slope(water)
        name = f"{water}: ghost ab later by, for each metre of depth"
        rows.append(
            CheckedNumber(name, 1e6 * simulated, "us/m", 1e6 * expected, 1.0, "Fermat: sines of arrival over the speed")
        )
        rows.append(
            CheckedNumber(
                f"{water}: rise of the shadow by surface paths to the bed", rise(water), "dB", RISE, None,
                "surface paths pass over the box",
            )
        )  # fmt: skip
    return rows


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    figure = style.new_figure(10.5, 10)
    above, below = figure.subfigures(2, 1, height_ratios=(2, 1.1), squeeze=False)[:, 0]
    rows = above.subplots(2, 1, sharex=True, sharey=True)
    for axes, letter, water in zip(rows, "ab", WATERS, strict=True):
        _panel(axes, water)
        axes.set_title(f"{letter}  {sidescan_model.TITLES[water]}")
    rows[0].legend(ncols=2, loc="upper right")
    rows[-1].set_xlabel("time after the start of transmission [ms]")
    for axes, letter, water in zip(below.subplots(1, 2, sharey=True), "cd", WATERS, strict=True):
        _pairs(axes, water)
        axes.set_title(f"{letter}  the target alone on a flat bed, {water}")
    scenarios = {f"{water}, fractal": scene(water, relief=sidescan_model.RELIEF) for water in WATERS}
    scenarios |= {f"{water}, flat": scene(water) for water in WATERS}
    return figure, scenarios, numbers()


def _panel(axes: Axes, water: Water) -> None:
    """Draw the fractal bed with and without reflections, and target, ghosts and shadow by exact rays."""
    start, end = (1e3 * when for when in figure2.dark(water))
    axes.axvspan(start - 1e3 * sidescan_model.PULSE, end, color=style.QUIET, alpha=0.13, linewidth=0)
    for reflections, colour, wide, name in (
        (0, style.QUIET, 0.9, "direct paths only"), (2, style.INK, 1.1, "with two reflections per leg"),
    ):  # fmt: skip
        time, intensity = sidescan_model.expected_ping(
            scene(water, reflections=reflections, relief=sidescan_model.RELIEF)
        )
        axes.plot(1e3 * time, level_db(np.maximum(intensity, 1.0)), color=colour, linewidth=wide, label=name)
    for pair, letters in {"D-D": "aa", **GHOSTS}.items():
        out, back = pair.split("-")
        when = 1e3 * (sidescan_model.two_way(water, out, back, sidescan_model.FACE, MIDDLE) + sidescan_model.PULSE / 2)
        axes.axvline(when, color=style.PAIRS[pair], linewidth=0.9, linestyle=":")
        axes.annotate(letters, (when, SPAN[1]), xytext=(0, -11), textcoords="offset points", ha="center",
                      color=style.PAIRS[pair], fontweight="bold", backgroundcolor="#FFFFFFB0")  # fmt: skip
    axes.set(xlim=[1e3 * when for when in WINDOW], ylim=SPAN, ylabel="level [dB re 1 uPa]")


def _pairs(axes: Axes, water: Water) -> None:
    """Draw the target's echoes by the pairs of legs that are separate in time."""
    curve = echoes(water)
    for pair, colour in style.PAIRS.items():
        if pair in curve["pair"].values:
            level = np.maximum(curve["level_db"].sel(pair=pair).values, 0.0)
            letters = "".join(LETTERS[leg] for leg in pair.split("-"))
            axes.plot(1e3 * curve["time"].values, level, color=colour, label=letters)
    axes.set_xlim(*(1e3 * when for when in ECHOES))
    axes.set_ylim(50, SPAN[1])
    axes.set_xlabel("time after the start of transmission [ms]")
    axes.set_ylabel("level [dB re 1 uPa]")
    axes.legend(ncols=6, loc="lower center", handlelength=1.2, columnspacing=1.0)
