"""Figure 6: the sidescan image with surface and bottom reflections: the target is harder to see.

The image of figure 3 with up to two reflections per leg. Ghosts follow the target, and surface paths fill the shadow,
with arrays omnidirectional in elevation. The third image shows the remedy of real sonars: arrays
10 degrees wide in elevation, tilted 6 degrees down, which receive little from the surface.
"""

from functools import lru_cache
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.paper import figure2, figure3, sidescan_model
from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.figure5 import GHOSTS
from insonify.paper.sidescan_model import WATERS, Water
from insonify.plotting import style
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.units import level_db

TITLE = "Sidescan image of the target with surface and bottom reflections"
Beam = Literal["broad", "narrow"]
TILT, WIDE = 6.0, 10.0
"""Tilt and one-way beam width at half power of the narrow arrays [deg]."""
HEIGHT = 0.8859 * sidescan_model.WAVELENGTH / float(np.radians(WIDE))
"""Height of a line with that beam width [m]: sinc^2 is half where its argument is 0.443."""
FALL = 15.0
"""Least reduction of the contrast with arrays omnidirectional in elevation, in water of one speed [dB]."""
WINDOW = (0.193, 0.232)
HALF, PINGS = 4.4, 19
"""Distance run before and after the target [m], and pings of each image."""
LATE_WINDOW = (0.2145, 0.2255)
"""Window in the direct path's shadow, after all ghosts, in water of one speed [s]."""

Floats = NDArray[np.float64]


def sonar(beam: Beam) -> dict[str, Any]:
    """Changes of the sonar for one of the two beams."""
    if beam == "broad":
        return {}
    array = {"kind": "planar", "width": sidescan_model.APERTURE, "height": HEIGHT}
    mounting = {"bearing": "90 deg", "tilt": f"{TILT:g} deg"}
    return {"sonar.transmit": array, "sonar.receive": array, "sonar.mounting": mounting}


def scene(water: Water, *, beam: Beam = "broad") -> Scenario:
    """Scenario of an image.

    Args:
        water: Water with or without the profile.
        beam: Beam width of the arrays in elevation.
    """
    return figure3.scene(
        water, pings=PINGS, half=HALF, window=WINDOW, changes={"paths.max_reflections": 2, **sonar(beam)}
    )


@lru_cache(maxsize=16)
def _bed(water: Water, reflections: int, boxed: bool, beam: Beam) -> tuple[Floats, Floats]:
    """Time [s] and expected intensity of the flat bed only, abeam, with or without the box [uPa^2]."""
    changes = {
        "paths.max_reflections": reflections,
        "paths.contributions": ["seabed"],
        "track.window": (0.2, 0.228),
        **sonar(beam),
    }
    return sidescan_model.expected_ping(
        sidescan_model.scene(water, changes if boxed else sidescan_model.without_box(changes))
    )


def shadow_contrast(water: Water, reflections: int, beam: Beam = "broad") -> float:
    """Level of the bare flat bed over that in the shadow [dB].

    Args:
        water: Water with or without the profile.
        reflections: Largest number of bounces of one leg.
        beam: Beam width of the arrays in elevation.
    """
    window = LATE_WINDOW if water == "one speed" else figure2.dark(water)
    free, cut = (sidescan_model.mean_level(*_bed(water, reflections, boxed, beam), window) for boxed in (False, True))
    return free - cut


def highlight(water: Water, reflections: int) -> float:
    """Peak of the target over the mean of its shadow, including ghosts [dB].

    Args:
        water: Water with or without the profile.
        reflections: Largest number of bounces of one leg.
    """
    changes = {"paths.max_reflections": reflections, "track.window": (0.2, 0.228)}
    time, intensity = sidescan_model.expected_ping(sidescan_model.scene(water, changes))
    start, end = figure2.dark(water)
    return float(level_db(intensity[time < start - sidescan_model.PULSE].max())) - sidescan_model.mean_level(
        time, intensity, (start, end)
    )


def numbers() -> list[CheckedNumber]:
    """Contrast of shadow and target with and without reflections."""
    rows = []
    for water in WATERS:
        none, two = (shadow_contrast(water, n) for n in (0, 2))
        source = "sound round the sides of a 2 m box: integral of sinc^4"
        rows.append(
            CheckedNumber(
                f"{water}: shadow contrast, direct paths", none, "dB", sidescan_model.beam_leakage_db(), 1.0, source
            )
        )
        rows.append(CheckedNumber(f"{water}: shadow contrast, two reflections", two, "dB"))
        least = FALL if water == "one speed" else None
        source = "surface paths pass over the box" if least else ""
        rows.append(CheckedNumber(f"{water}: shadow contrast falls by", none - two, "dB", least, None, source))
        bright = highlight(water, 0) - highlight(water, 2)
        rows.append(
            CheckedNumber(f"{water}: target over its shadow falls by", bright, "dB", FALL, None, "ghosts and surface")
        )
        narrow = shadow_contrast(water, 2, "narrow")
        rows.append(CheckedNumber(f"{water}: shadow contrast, two reflections, narrow in elevation", narrow, "dB"))
    return rows


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    scenarios = {sidescan_model.TITLES[water]: scene(water) for water in WATERS}
    narrow = f"1500 m/s, arrays {WIDE:g} deg wide in elevation, {TILT:g} deg down"
    scenarios[narrow] = scene("one speed", beam="narrow")
    waters: tuple[Water, ...] = (*WATERS, "one speed")
    figure = style.new_figure(10.5, 9.6)
    _panels(figure, scenarios, waters)
    return figure, scenarios, numbers()


def _panels(figure: Figure, scenarios: dict[str, Scenario], waters: tuple[Water, ...]) -> None:
    sounds = [
        (title, water, simulate(scenario)) for (title, scenario), water in zip(scenarios.items(), waters, strict=True)
    ]
    for axes, water in zip(figure3.picture(figure, sounds), waters, strict=True):
        _name_ghosts(axes, water)


def _name_ghosts(axes: Axes, water: Water) -> None:
    """Label target and ghosts with the paper's letters at the slant ranges by exact rays."""
    for pair, letters in {"D-D": "aa", **GHOSTS}.items():
        out, back = pair.split("-")
        slant = figure3.two_way_slant(water, out, back, sidescan_model.FACE, sidescan_model.BED - 0.5)
        axes.annotate(letters, (slant, 3.8), ha="center", va="center", color="white", fontweight="bold", fontsize=9)
