"""Figure 7: a moving sea surface makes surface paths random from ping to ping.

The scenario is that of `sidescan_model` with one reflection per leg. The images are of a swell, 0.35 m high and 60 m
long, which tilts the plane of each bounce by the slope of the wave at its position and time: the method of the paper.
The curves are of a sonar at rest that pings every half second: the correlation of its coherent pings under the swell,
under the wind sea of a breeze of 3 m/s (coherent part and glints), and without surface paths.
"""

from functools import lru_cache
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.paper import figure3, sidescan_model
from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.figure5 import GHOSTS
from insonify.paper.sidescan_model import WATERS, Water
from insonify.plotting import style
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate

TITLE = "A moving surface: image, and correlation of pings"
Sea = Literal["still", "swell", "wind"]
SURFACES: dict[Sea, dict[str, Any]] = {
    "still": {"reflection": "flat"},
    "swell": {"reflection": "tilted", "swell": {"height": 0.35, "length": 60.0}, "wave_direction": "20 deg"},
    "wind": {"reflection": "statistical", "wind_speed": 3.0},
}
"""States of the surface."""
STILL_FAMILIES, FAMILIES = ["D", "B"], ["D", "S", "B"]
"""Legs without and with the surface."""
PINGS, INTERVAL = 10, 0.5
"""Number of pings that are compared, and the interval between them [s]."""
WINDOW = (0.1985, 0.2070)
RUNNING = 0.4e-3
"""Time over which pings are compared in the curves [s]."""
COHERENT, INCOHERENT = 0.95, 0.3
"""Least correlation of pings without surface paths, and largest in the ghosts [1]."""
CHANCE = "independent pings: 0 in the mean, 0.1 by chance"
CURVES: tuple[tuple[Sea, str, str], ...] = (
    ("still", style.INK, "no surface paths"),
    ("swell", style.FAMILIES["B"], "swell, 0.35 m high"),
    ("wind", style.FAMILIES["S"], "wind sea, 3 m/s"),
)

Floats = NDArray[np.float64]


def image_scene(water: Water) -> Scenario:
    """Scenario of an image under the swell.

    Args:
        water: Water with or without the profile.
    """
    changes = {"paths.max_reflections": 1, "paths.families": ["D", "S"], "surface": SURFACES["swell"]}
    return figure3.scene(water, pings=17, half=4.0, window=(0.193, 0.232), changes=changes)


def pings_scene(water: Water, sea: Sea) -> Scenario:
    """Scenario of coherent pings from one position.

    Args:
        water: Water with or without the profile.
        sea: State of the surface; without surface paths for "still".
    """
    changes = {
        "field": "coherent", "paths.max_reflections": 1, "surface": SURFACES[sea], "track.window": WINDOW,
        "paths.families": STILL_FAMILIES if sea == "still" else FAMILIES,
        "track.pings": PINGS, "track.interval": INTERVAL, "paths.scatterers_per_cell": sidescan_model.GRAINS,
    }  # fmt: skip
    return sidescan_model.scene(water, changes)


@lru_cache(maxsize=8)
def pings(water: Water, sea: Sea) -> xr.Dataset:
    """Coherent pings from one position, see `pings_scene`."""
    return simulate(pings_scene(water, sea))


def ping_correlation(sound: xr.Dataset, first: float, last: float) -> float:
    """Magnitude of the mean complex correlation of different pings between two times [1].

    Args:
        sound: Coherent pings.
        first: Start [s].
        last: Stop [s].
    """
    time = sound["time"].values
    part = sound["pressure"].values[:, 0, (time >= first) & (time < last)].astype(complex)
    part /= np.linalg.norm(part, axis=1, keepdims=True)
    products = part.conj() @ part.T
    return float(np.abs(products[np.triu_indices(len(part), 1)].mean()))


def window(water: Water, pair: str) -> tuple[float, float]:
    """Start and end of the face's echo by a pair of legs [s]."""
    out, back = pair.split("-")
    first, last = sorted(
        sidescan_model.two_way(water, out, back, sidescan_model.FACE, depth)
        for depth in (sidescan_model.TOP, sidescan_model.BED)
    )
    return first, last + sidescan_model.PULSE


def numbers() -> list[CheckedNumber]:
    """Correlation of pings in the direct echo and in the ghosts, in both waters."""
    rows = []
    for water in WATERS:
        for pair, letters in {"D-D": "aa", **GHOSTS}.items():
            still = ping_correlation(pings(water, "still"), *window(water, pair))
            name = f"{water}: correlation of pings during {letters}"
            rows.append(CheckedNumber(f"{name}, no surface", still, "1", COHERENT, None, "static scene"))
            windy = ping_correlation(pings(water, "wind"), *window(water, pair))
            if pair == "D-D":
                rows.append(CheckedNumber(f"{name}, wind sea", windy, "1", COHERENT, None, "no surface path"))
            else:
                rows.append(CheckedNumber(f"{name}, wind sea", windy, "1", 0.0, INCOHERENT, CHANCE))
            rows.append(
                CheckedNumber(f"{name}, swell", ping_correlation(pings(water, "swell"), *window(water, pair)), "1")
            )
    return rows


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    figure = style.new_figure(10.5, 10)
    above, below = figure.subfigures(2, 1, height_ratios=(1.7, 1), squeeze=False)[:, 0]
    sounds = [(f"{sidescan_model.TITLES[water]}, swell", water, simulate(image_scene(water))) for water in WATERS]
    figure3.picture(above, sounds)
    curves = below.subplots(1, 2, sharey=True)
    for axes, letter, water in zip(curves, "cd", WATERS, strict=True):
        _curves(axes, water)
        axes.set_title(f"{letter}  correlation of coherent pings, {water}")
    curves[0].set_ylabel("correlation of pings [1]")
    curves[1].legend(loc="center right")
    scenarios = {f"{water}, image": image_scene(water) for water in WATERS}
    scenarios |= {f"{water}, {sea}": pings_scene(water, sea) for water in WATERS for sea in SURFACES}
    return figure, scenarios, numbers()


def _curves(axes: Axes, water: Water) -> None:
    """Draw the correlation over time under each sea, with the times of target and ghosts."""
    middle = np.arange(WINDOW[0] + RUNNING, WINDOW[1] - RUNNING, 0.05e-3)
    for sea, colour, name in CURVES:
        sound = pings(water, sea)
        correlation = [ping_correlation(sound, when - RUNNING / 2, when + RUNNING / 2) for when in middle]
        axes.plot(1e3 * middle, correlation, color=colour, label=name)
    for pair, letters in {"D-D": "aa", **GHOSTS}.items():
        first, last = (1e3 * when for when in window(water, pair))
        axes.axvspan(first, last, color=style.PAIRS[pair], alpha=0.12, linewidth=0)
        axes.text((first + last) / 2, 1.04, letters, ha="center", color=style.PAIRS[pair], fontweight="bold")
    axes.set_xlim(1e3 * middle[0], 1e3 * middle[-1])
    axes.set_ylim(0, 1.12)
    axes.set_xlabel("time after the start of transmission [ms]")
