"""Figure 4: one ping about the target with the seabed's own reflections: a larger peak, and smaller ones after it.

The scenario is that of `sidescan_model`, with one reflection off the bed and none off the surface. Sound reflected by
the bed in front of the face, before the face or after it, comes back 0 to 80 us later (ac), before and after 0 to 160
us later (cc). Out one way and back the other, two paths of one length add as amplitudes: with a reflection coefficient
R the face, which scatters by Lambert's law, echoes 1 + 4 R^2 + R^4 times as much energy. That is 1.8 dB with the
paper's 0.35, and 7 dB with the Rayleigh coefficient of its sand, which at such grazing angles mirrors nearly
everything. Elsewhere nothing changes: sound that bounces off the bed goes away from it.

A smooth face shows it more strongly. Its own flash passes 3 degrees over the sonar, but face and bed make a corner,
which reflects sound back to the sonar: all of ac is in phase, and the peak rises by some 20 dB even with the paper's
0.35.
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
"""About the face's echoes, for the short pulse [s]."""
PAPER_REFLECTION, SAND = 0.35, "medium sand"
"""Reflection coefficients of the bed: the paper's scenarios', and that of the sediment."""
MIDDLE = sidescan_model.BED - 0.5
"""Depth of the middle of the face [m]."""
AWAY = 10.0
"""Distance from the target beyond which nothing should change [m]."""
LEAST = 3.0
"""By how much the peak rises at least over sand [dB]."""
SHORT = {"sonar.pulse.duration": "30 us", "sonar.pulse.taper": "hann", "sonar.receiver.bandwidth": "150 kHz"}
"""A pulse that separates the echoes."""
SMOOTH = 0.8
"""Reflection coefficient of the smooth face; it is as rough as before, too."""
SPAN = (40.0, 130.0)
SEEN = {"D-D": "D", "D-B": "B", "B-B": "SB"}
"""Pairs of legs, and families that lend their colours."""

Floats = NDArray[np.float64]


def scene(
    water: Water, reflection: float | str | None, *, relief: float = 0.0, changes: dict[str, Any] | None = None
) -> Scenario:
    """The figure's scenario.

    Args:
        water: With or without the profile.
        reflection: Of the bed; None for direct paths only.
        relief: Rms height of the bed's relief [m].
        changes: Other values by dotted name.
    """
    settings = {"paths.max_reflections": 0, "track.window": WINDOW}
    if reflection is not None:
        settings |= {"paths.max_reflections": 1, "paths.families": ["D", "B"], "seabed.reflection": reflection}
    return sidescan_model.scene(water, {**settings, **(changes or {})}, relief=relief)


@lru_cache(maxsize=12)
def echoes(water: Water, reflection: float | str, *, short: bool = False, smooth: bool = False) -> xr.Dataset:
    """Expected level of the target by pair of legs, over (pair, time) [dB re 1 uPa].

    Args:
        water: With or without the profile.
        reflection: Of the bed.
        short: Heard by a pulse of 30 us instead of 0.2 ms.
        smooth: Whether the target's faces are smooth, too.
    """
    face = {"targets": [{**box(sidescan_model.OWN), "face_reflection_coefficient": SMOOTH}]} if smooth else {}
    settings = sidescan_model.target_only({**(SHORT if short else {}), **face})
    return levels(scene(water, reflection, changes=settings)).sel(contribution="target")


def later(water: Water, pair: str) -> tuple[float, float]:
    """Delay of the echo over a pair of legs after the direct one: as simulated, and by exact rays [s]."""
    out, back = pair.split("-")
    position = (sidescan_model.FACE, MIDDLE)
    expected = sidescan_model.two_way(water, out, back, *position) - sidescan_model.two_way(water, "D", "D", *position)
    curves = echoes(water, PAPER_REFLECTION)
    return sidescan_model.echo(curves, pair)[0] - sidescan_model.echo(curves, "D-D")[0], expected


def gain(water: Water, reflection: float | str) -> tuple[float, float]:
    """Energy that the target's echo gains by the bed's reflections: as simulated, and 1 + 4 R^2 + R^4 [dB].

    Args:
        water: With or without the profile.
        reflection: Of the bed.
    """
    direct, bent = (sidescan_model.ray(water, name, sidescan_model.FACE, MIDDLE) for name in ("D", "B"))
    mirrored = reflection
    if isinstance(reflection, str):
        mirrored = float(np.abs(reflection_coefficient(Sediment.named(reflection), np.abs(bent.angle))))
    leg = (float(mirrored) * bent.amplitude / direct.amplitude) ** 2 * np.cos(bent.angle) / np.cos(direct.angle)
    curves = echoes(water, reflection)
    found = sidescan_model.echo(curves, "all")[1] / sidescan_model.echo(curves, "D-D")[1]
    return float(level_db(found)), float(level_db(1 + 4 * leg + leg**2))


def peak(water: Water, reflection: float | str, *, smooth: bool = False) -> float:
    """Rise of the target's peak by the bed's reflections [dB]; smooth: of a target with smooth faces, too."""
    curves = echoes(water, reflection, smooth=smooth)["level_db"]
    return float(curves.sel(pair="all").max() - curves.sel(pair="D-D").max())


def elsewhere(water: Water) -> float:
    """Largest change of the fractal bed's level more than 10 m from the target [dB]."""
    before = sidescan_model.two_way(water, "D", "D", sidescan_model.FACE - AWAY, sidescan_model.BED)
    settings = {"track.window": (before - 0.02, before), "paths.scatterers_per_cell": sidescan_model.GRAINS}
    beds = (scene(water, reflection, relief=sidescan_model.RELIEF, changes=settings) for reflection in (None, SAND))
    without, with_it = (sidescan_model.expected_ping(bed)[1] for bed in beds)
    return float(np.abs(level_db(with_it / without)).max())


def numbers() -> list[CheckedNumber]:
    """Rise of the target's peak, delays of its parts, and changes elsewhere."""
    rows = []
    source = "exact rays to the middle of the face"
    for water in WATERS:
        for pair in ("D-B", "B-B"):
            found, expected = later(water, pair)
            name = f"{water}: {''.join(LETTERS[leg] for leg in pair.split('-'))} later than aa by"
            rows.append(CheckedNumber(name, 1e6 * found, "us", 1e6 * expected, 8.0, source))
        for reflection, name in ((PAPER_REFLECTION, f"R = {PAPER_REFLECTION:g}"), (SAND, SAND)):
            found, expected = gain(water, reflection)
            source = "1 + 4 |A|^2 + |A|^4: two paths of one length add as amplitudes"
            rows.append(CheckedNumber(f"{water}: target's energy, {name}, up by", found, "dB", expected, 0.3, source))
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
                           "what the bed mirrors goes away from it"))  # fmt: skip
    return rows


def draw(folder: Path) -> list[Path]:
    """The picture and its numbers.

    Args:
        folder: Where they go.

    Returns:
        The files written.
    """
    with style.plot_style():
        figure = style.new_figure(10.5, 12.0)
        above, below, last = figure.subplots(3, 2, sharey="row")
        for axes, letter, water in zip(above, "ab", WATERS, strict=True):
            _panel(axes, water)
            axes.set_title(f"{letter}  {sidescan_model.WATER_TITLES[water]}")
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
    """The fractal bed and the target, with and without reflections off the bed."""
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
    """The face's echoes over each pair of legs by itself, and their greatest delays."""
    time = 1e3 * curves["time"].values
    whole = np.maximum(curves["level_db"].sel(pair="all").values, 0.0)
    axes.fill_between(time, whole, color=style.CONTRIBUTION_COLOURS["target"], alpha=0.2, linewidth=0, label="all")
    for pair, family in SEEN.items():
        level = np.maximum(curves["level_db"].sel(pair=pair).values, 0.0)
        letters = "".join(LETTERS[leg] for leg in pair.split("-"))
        axes.plot(time, level, color=style.FAMILIES[family], linewidth=1.5, label=letters)
    axes.set_xlim(*(1e3 * when for when in CLOSE[water]))
    axes.set_ylim(*span)
    axes.set_xlabel("time after the start of transmission [ms]")
