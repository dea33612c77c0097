"""Figure 4: one ping around the target with seabed reflections: a larger peak, and smaller ones after it.

The scenario is that of `sidescan_model`, with one reflection off the bed and none off the surface. Sound reflected by
the bed in front of the face on one leg arrives 0 to 80 us later (ac), on both legs 0 to 160 us
later (cc). The two mixed pairs of legs have the same length and add as amplitudes: with a reflection coefficient R
the face, which scatters by Lambert's law, returns 1 + 4 R^2 + R^4 times as much energy. That is 1.8 dB with the paper's
0.35, and 7 dB with the Rayleigh coefficient of its sand, which at such grazing angles reflects nearly everything.
The level of the bed does not change: sound reflected by a flat bed does not return to it.

A smooth face has a larger effect. Its specular reflection passes 3 degrees over the sonar, but face and bed form a
corner reflector: all of ac is in phase, and the peak rises by some 20 dB even with the paper's 0.35.
"""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.paper import sidescan_model
from insonify.paper.checked_numbers import CheckedNumber, write_numbers
from insonify.paper.nominal_scenario import box
from insonify.paper.sidescan_model import WATERS, Water
from insonify.plotting import style
from insonify.plotting.leg_diagram import LETTERS
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.sediments import Sediment
from insonify.scenario.scenario import Scenario
from insonify.simulator import levels
from insonify.units import level_db

TITLE = "One ping about the target with reflections off the seabed"
WINDOW = (0.197, 0.206)
CLOSE = {"one speed": (0.20020, 0.20062), "thermocline": (0.20085, 0.20145)}
"""Window around the face's echoes, for the short pulse [s]."""
PAPER_REFLECTION, SAND = 0.35, "medium sand"
"""Reflection coefficients of the bed: the paper's scenarios', and that of the sediment."""
MIDDLE = sidescan_model.BED - 0.5
"""Depth of the middle of the face [m]."""
AWAY = 10.0
"""Distance from the target beyond which the level should not change [m]."""
LEAST = 3.0
"""Least rise of the peak over sand [dB]."""
SHORT = {"sonar.pulse.duration": "30 us", "sonar.pulse.taper": "hann", "sonar.receiver.bandwidth": "150 kHz"}
"""Pulse that separates the echoes."""
SMOOTH = 0.8
"""Reflection coefficient of the smooth face, in addition to its rough scattering [1]."""
SPAN = (40.0, 130.0)
SEEN = {"D-D": "D", "D-B": "B", "B-B": "SB"}
"""Pairs of legs, and families that define their colours."""

Floats = NDArray[np.float64]


def scene(
    water: Water, reflection: float | str | None, *, relief: float = 0.0, changes: dict[str, Any] | None = None
) -> Scenario:
    """The figure's scenario.

    Args:
        water: Water with or without the profile.
        reflection: Reflection coefficient or sediment of the bed; None for direct paths only.
        relief: Rms height of the bed's relief [m].
        changes: Other values by dotted name.
    """
    values = {"paths.max_reflections": 0, "track.window": WINDOW}
    if reflection is not None:
        values |= {"paths.max_reflections": 1, "paths.families": ["D", "B"], "seabed.reflection": reflection}
    return sidescan_model.scene(water, {**values, **(changes or {})}, relief=relief)


@lru_cache(maxsize=12)
def echoes(water: Water, reflection: float | str, *, short: bool = False, smooth: bool = False) -> xr.Dataset:
    """Expected level of the target by pair of legs, over (pair, time) [dB re 1 uPa].

    Args:
        water: Water with or without the profile.
        reflection: Reflection coefficient or sediment of the bed.
        short: True for a pulse of 30 us instead of 0.2 ms.
        smooth: True for additional specular reflection by the target's faces.
    """
    face = {"targets": [{**box(sidescan_model.OWN), "face_reflection_coefficient": SMOOTH}]} if smooth else {}
    values = sidescan_model.target_only({**(SHORT if short else {}), **face})
    return levels(scene(water, reflection, changes=values)).sel(contribution="target")


def later(water: Water, pair: str) -> tuple[float, float]:
    """Delay of a pair of legs after the direct echo, measured and by exact rays [s]."""
    out, back = pair.split("-")
    position = (sidescan_model.FACE, MIDDLE)
    expected = sidescan_model.two_way(water, out, back, *position) - sidescan_model.two_way(water, "D", "D", *position)
    curves = echoes(water, PAPER_REFLECTION)
    return sidescan_model.echo(curves, pair)[0] - sidescan_model.echo(curves, "D-D")[0], expected


def gain(water: Water, reflection: float | str) -> tuple[float, float]:
    """Rise of the target's echo energy by the bed's reflections, measured and 1 + 4 R^2 + R^4 [dB].

    Args:
        water: Water with or without the profile.
        reflection: Reflection coefficient or sediment of the bed.
    """
    direct, reflected = (sidescan_model.ray(water, name, sidescan_model.FACE, MIDDLE) for name in ("D", "B"))
    coefficient = reflection
    if isinstance(reflection, str):
        coefficient = float(np.abs(reflection_coefficient(Sediment.named(reflection), np.abs(reflected.angle))))
    ratio = float(coefficient) * reflected.amplitude / direct.amplitude
    leg = ratio**2 * np.cos(reflected.angle) / np.cos(direct.angle)
    curves = echoes(water, reflection)
    measured = sidescan_model.echo(curves, "all")[1] / sidescan_model.echo(curves, "D-D")[1]
    return float(level_db(measured)), float(level_db(1 + 4 * leg + leg**2))


def peak(water: Water, reflection: float | str, *, smooth: bool = False) -> float:
    """Rise of the target's peak by the bed's reflections [dB]; with `smooth`, of a target with smooth faces."""
    curves = echoes(water, reflection, smooth=smooth)["level_db"]
    return float(curves.sel(pair="all").max() - curves.sel(pair="D-D").max())


def elsewhere(water: Water) -> float:
    """Largest change of the fractal bed's level more than 10 m from the target [dB]."""
    before = sidescan_model.two_way(water, "D", "D", sidescan_model.FACE - AWAY, sidescan_model.BED)
    values = {"track.window": (before - 0.02, before), "paths.scatterers_per_cell": sidescan_model.GRAINS}
    beds = (scene(water, reflection, relief=sidescan_model.RELIEF, changes=values) for reflection in (None, SAND))
    without, with_it = (sidescan_model.expected_ping(bed)[1] for bed in beds)
    return float(np.abs(level_db(with_it / without)).max())


def numbers() -> list[CheckedNumber]:
    """Rise of the target's peak, delays of its parts, and change of the bed elsewhere."""
    rows = []
    exact = "exact rays to the middle of the face"
    for water in WATERS:
        for pair in ("D-B", "B-B"):
            value, expected = later(water, pair)
            name = f"{water}: {''.join(LETTERS[leg] for leg in pair.split('-'))} later than aa by"
            rows.append(CheckedNumber(name, 1e6 * value, "us", 1e6 * expected, 8.0, exact))
        for reflection, name in ((PAPER_REFLECTION, f"R = {PAPER_REFLECTION:g}"), (SAND, SAND)):
            value, expected = gain(water, reflection)
            source = "1 + 4 |A|^2 + |A|^4: two paths of one length add as amplitudes"
            rows.append(CheckedNumber(f"{water}: target's energy, {name}, up by", value, "dB", expected, 0.3, source))
            least = LEAST if reflection == SAND else None
            source = "the paper's larger peak" if least else ""
            rows.append(
                CheckedNumber(
                    f"{water}: target's peak, {name}, up by", peak(water, reflection), "dB", least, None, source
                )
            )
        source = "the paper's larger peak, from a smooth face"
        rise = peak(water, PAPER_REFLECTION, smooth=True)
        rows.append(
            CheckedNumber(
                f"{water}: smooth target's peak, R = {PAPER_REFLECTION:g}, up by", rise, "dB", LEAST, None, source
            )
        )
        rows.append(CheckedNumber(f"{water}: bed more than 10 m away, largest change", elsewhere(water), "dB", 0.0, 0.5,
                           "a flat bed reflects away from itself"))  # fmt: skip
    return rows


def draw(folder: Path) -> list[Path]:
    """The picture and its numbers.

    Returns:
        The files written.
    """
    with style.plot_style():
        figure = style.new_figure(10.5, 12.0)
        above, below, last = figure.subplots(3, 2, sharey="row")
        for axes, letter, water in zip(above, "ab", WATERS, strict=True):
            _panel(axes, water)
            axes.set_title(f"{letter}  {sidescan_model.TITLES[water]}")
        for axes, letter, water in zip(below, "cd", WATERS, strict=True):
            _pairs(axes, echoes(water, SAND, short=True), water, (80, 130))
            axes.set_title(f"{letter}  the face by a pulse of 30 us, {SAND}")
        for axes, letter, water in zip(last, "ef", WATERS, strict=True):
            _pairs(axes, echoes(water, PAPER_REFLECTION, short=True, smooth=True), water, (80, 170))
            axes.set_title(f"{letter}  the same, but smooth, over R = {PAPER_REFLECTION:g}")
        for axes in (above[0], below[0], last[0]):
            axes.set_ylabel("level [dB re 1 uPa]")
        for axes in (above[1], below[1], last[1]):
            axes.legend(loc="upper right")
        picture = style.save_figure(figure, folder / "figure4.png")
    scenarios = {
        f"{water}, {bed}": scene(water, bed, relief=sidescan_model.RELIEF)
        for water in WATERS
        for bed in (PAPER_REFLECTION, SAND)
    }
    return [picture, write_numbers(folder / "figure4.json", 4, TITLE, scenarios, numbers())]


def _panel(axes: Axes, water: Water) -> None:
    """Draw the fractal bed and the target, with and without reflections off the bed."""
    for reflection, colour, wide, name in (
        (SAND, style.CONTRIBUTION_COLOURS["target"], 2.0, f"reflections off {SAND}"),
        (PAPER_REFLECTION, style.FAMILIES["B"], 1.4, f"reflections, R = {PAPER_REFLECTION:g}"),
        (None, style.INK, 0.9, "direct paths only"),
    ):
        time, intensity = sidescan_model.expected_ping(scene(water, reflection, relief=sidescan_model.RELIEF))
        axes.plot(1e3 * time, level_db(np.maximum(intensity, 1.0)), color=colour, linewidth=wide, label=name)
    axes.set_xlim(*(1e3 * when for when in WINDOW))
    axes.set_ylim(*SPAN)
    axes.set_xlabel("time after the start of transmission [ms]")


def _pairs(axes: Axes, curves: xr.Dataset, water: Water, span: tuple[float, float]) -> None:
    """Draw the face's echoes by each pair of legs."""
    time = 1e3 * curves["time"].values
    total = np.maximum(curves["level_db"].sel(pair="all").values, 0.0)
    axes.fill_between(time, total, color=style.CONTRIBUTION_COLOURS["target"], alpha=0.2, linewidth=0, label="all")
    for pair, family in SEEN.items():
        level = np.maximum(curves["level_db"].sel(pair=pair).values, 0.0)
        letters = "".join(LETTERS[leg] for leg in pair.split("-"))
        axes.plot(time, level, color=style.FAMILIES[family], linewidth=1.5, label=letters)
    axes.set_xlim(*(1e3 * when for when in CLOSE[water]))
    axes.set_ylim(*span)
    axes.set_xlabel("time after the start of transmission [ms]")
