"""Figure 4: one ping around the target with seabed reflections: a larger peak, and smaller ones after it.

The scenario is that of `sidescan_model`, with one reflection off the bed and none off the surface. Sound reflected by
the bed in front of the face on one leg arrives 0 to 80 us later (ac), on both legs 0 to 160 us
later (cc). The two mixed pairs of legs have the same length and add as amplitudes: with a reflection coefficient R
the face, which scatters by Lambert's law, returns 1 + 4 R^2 + R^4 times as much energy. That is 1.8 dB with the paper's
0.35, and 7 dB with the Rayleigh coefficient of its sand, which at such grazing angles reflects nearly everything.
The level of the bed does not change: sound reflected by a flat bed does not return to it.

A face that is smooth has a larger effect. The paper's rays go on from the target in the specular direction; here the
face reflects what its law does not scatter. Its own reflection passes 3 degrees over the sonar, but face and bed form a
corner reflector: all of ac is in phase, and the target's peak rises by some 20 dB with the paper's 0.35 and 30 dB over
sand. And the bed in front of the face is lit by it: once by the face (af), sound that the bed scatters near the
specular direction comes back at the same time as the corner's, 10 to 16 dB below it; twice (ff), after the target and
into its shadow, smaller. Without phase there is no corner echo: af is the larger peak of the paper's rays, and ff the
smaller ones after it. The tracer is that procedure; after the peak it lacks what the edges of the face diffract.

The smooth bed reflects all that its coefficient allows, and its law scatters the same energy again. So af is no
addition to the corner echo but another description of it, and the panels show both apart.
"""

import math
from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.paper import sidescan_model
from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.nominal_scenario import box
from insonify.paper.sidescan_model import WATERS, Water
from insonify.plotting import style
from insonify.plotting.leg_diagram import LETTERS
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.sediments import Sediment
from insonify.scenario.scenario import Scenario
from insonify.simulator import levels
from insonify.units import intensity_ratio, level_db

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
SMOOTH = math.sqrt(1 - math.pi * 0.1)
"""Reflection coefficient of the smooth face, which reflects all that its rough scattering of -10 dB leaves [1]."""
RAYS = 200_000
"""Rays of the tracer over a flat bed; four times as many over relief [1]."""
SPAN = (40.0, 170.0)
SEEN = {"D-D": "D", "D-B": "B", "B-B": "SB"}
"""Pairs of legs, and families that define their colours."""
BY_FACE = {"D-F": ("af", "--"), "F-F": ("ff", ":")}
"""Pairs of legs of the bed by the face once and twice: names and styles of lines."""

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


@lru_cache(maxsize=8)
def smooth_target(
    water: Water, reflection: float | str, *, relief: float = 0.0, short: bool = False, tracer: bool = False
) -> xr.Dataset:
    """Expected levels with a smooth target that lights the bed, over (contribution, pair, time) [dB re 1 uPa].

    Args:
        water: Water with or without the profile.
        reflection: Reflection coefficient or sediment of the bed.
        relief: Rms height of the bed's relief [m].
        short: True for a pulse of 30 us instead of 0.2 ms.
        tracer: True for rays without phase, the paper's procedure, in water of one speed.
    """
    target = {"targets": [{**box(sidescan_model.OWN), "face_reflection_coefficient": SMOOTH}]}
    values = {"paths.face_reflections": True, **target, **(SHORT if short else {})}
    if tracer:
        rays = {"paths.rays": RAYS * (4 if relief else 1), "paths.target_specular_fraction": SMOOTH**2}
        values |= {"paths.engine": "tracer", **rays}
    return levels(scene(water, reflection, relief=relief, changes=values))


def bed_by_face(curves: xr.Dataset) -> dict[str, float]:
    """Level of the mean intensity of the bed by the face once and twice [dB re 1 uPa].

    Args:
        curves: Levels of `smooth_target` by either engine; the tracer's letter of a face is T.
    """
    seabed = curves["level_db"].sel(contribution="seabed")
    return {
        pair: float(level_db(intensity_ratio(seabed.sel(pair=name).values).mean()))
        for pair in BY_FACE for name in (pair, pair.replace("F", "T")) if name in seabed["pair"]
    }  # fmt: skip


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
        lit = smooth_target(water, SAND)["level_db"]
        once, corner = (
            float(lit.sel(contribution=one, pair=pair).max()) for one, pair in (("seabed", "D-F"), ("target", "D-B"))
        )
        bare = float(lit.sel(contribution="seabed", pair="D-D").max())
        source = "the paper's brighter bed in front of the target"
        rows.append(
            CheckedNumber(f"{water}: bed by the face once, over the bed", once - bare, "dB", LEAST, None, source)
        )
        rows.append(
            CheckedNumber(f"{water}: corner echo, over the bed by the face", corner - once, "dB", None, None, "")
        )
        rows.append(CheckedNumber(f"{water}: bed more than 10 m away, largest change", elsewhere(water), "dB", 0.0, 0.5,
                           "a flat bed reflects away from itself"))  # fmt: skip
    straight, traced = (bed_by_face(smooth_target("one speed", SAND, tracer=tracer)) for tracer in (False, True))
    for pair, (name, _) in BY_FACE.items():
        rows.append(
            CheckedNumber(
                f"one speed: {name} of the bed, mean level", straight[pair], "dB", traced[pair], 0.2, "the tracer"
            )
        )
    return rows


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    figure = style.new_figure(10.5, 12.0)
    above, below, last = figure.subplots(3, 2, sharey="row")
    for axes, letter, water in zip(above, "ab", WATERS, strict=True):
        _panel(axes, water)
        axes.set_title(f"{letter}  {sidescan_model.TITLES[water]}")
    for axes, letter, water in zip(below, "cd", WATERS, strict=True):
        _pairs(axes, echoes(water, SAND, short=True), water, (80, 130))
        axes.set_title(f"{letter}  the face by a pulse of 30 us, {SAND}")
    for axes, letter, water in zip(last, "ef", WATERS, strict=True):
        curves = smooth_target(water, PAPER_REFLECTION, short=True)
        _pairs(axes, curves.sel(contribution="target"), water, (50, 170))
        _bed_by_face(axes, curves.sel(contribution="seabed"))
        axes.set_title(f"{letter}  the same, but smooth, over R = {PAPER_REFLECTION:g}")
    for axes in (above[0], below[0], last[0]):
        axes.set_ylabel("level [dB re 1 uPa]")
    for axes in (above[0], below[1], last[1]):
        axes.legend(loc="upper right")
    scenarios = {
        f"{water}, {bed}": scene(water, bed, relief=sidescan_model.RELIEF)
        for water in WATERS
        for bed in (PAPER_REFLECTION, SAND)
    }
    return figure, scenarios, numbers()


def _panel(axes: Axes, water: Water) -> None:
    """Draw the smooth target on the fractal bed: direct paths, corner echo, bed by the face, and the paper's rays."""
    curves = smooth_target(water, SAND, relief=sidescan_model.RELIEF)
    time, level = 1e3 * curves["time"].values, curves["level_db"].clip(min=0.0)
    direct = level.sel(contribution="total", pair="D-D")
    colours = style.CONTRIBUTION_COLOURS
    axes.plot(time, level.sel(contribution="target", pair="all"), color=colours["target"], linewidth=2.0,
              label=f"target by {SAND}: corner echo")  # fmt: skip
    axes.plot(time, level.sel(contribution="seabed", pair="all"), color=colours["seabed"], linewidth=2.0,
              label="bed, by the face too")  # fmt: skip
    axes.plot(time, direct, color=style.INK, linewidth=0.9, label="direct paths only")
    if water == "one speed":
        rays = smooth_target(water, SAND, relief=sidescan_model.RELIEF, tracer=True)
        total = rays["level_db"].sel(contribution="total", pair="all").clip(min=0.0)
        axes.plot(1e3 * rays["time"], total, ":", color=style.EXPECTED, linewidth=1.6, label="rays without phase")
    axes.set(xlim=[1e3 * when for when in WINDOW], ylim=SPAN, xlabel="time after the start of transmission [ms]")


def _bed_by_face(axes: Axes, curves: xr.Dataset) -> None:
    """Draw the echoes of the bed by the face once and twice."""
    for pair, (name, line) in BY_FACE.items():
        level = np.maximum(curves["level_db"].sel(pair=pair).values, 0.0)
        colour = style.CONTRIBUTION_COLOURS["seabed"]
        axes.plot(1e3 * curves["time"].values, level, line, color=colour, linewidth=1.5, label=name)


def _pairs(axes: Axes, curves: xr.Dataset, water: Water, span: tuple[float, float]) -> None:
    """Draw the face's echoes by each pair of legs."""
    time = 1e3 * curves["time"].values
    total = np.maximum(curves["level_db"].sel(pair="all").values, 0.0)
    axes.fill_between(time, total, color=style.CONTRIBUTION_COLOURS["target"], alpha=0.2, linewidth=0, label="all")
    for pair, family in SEEN.items():
        level = np.maximum(curves["level_db"].sel(pair=pair).values, 0.0)
        letters = "".join(LETTERS[leg] for leg in pair.split("-"))
        axes.plot(time, level, color=style.FAMILIES[family], linewidth=1.5, label=letters)
    axes.set(xlim=[1e3 * when for when in CLOSE[water]], ylim=span, xlabel="time after the start of transmission [ms]")
