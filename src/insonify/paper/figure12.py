"""Figure 12: the shadow of the target fills with paths of one and two reflections.

Changed in the nominal scene: `paths.max_reflections` is 0, 1 and 2; the pictures are of the vertical plane
(`paths.geometry: slice`, the paper's 2-D) in the paper's window of 35 ms. The numbers are of the whole scene, from the
expected intensity, once with a box 6 m wide, so that little sound passes its sides, and once with the paper's
2 m: level without the box over level with it, on the bed behind it. Without edge diffraction.
"""

from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.nominal_scenario import box, nominal
from insonify.plotting import style
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.units import level_db

TITLE = "The shadow of the target with direct paths, one and two reflections per leg"
WINDOW = (0.195, 0.230)
LATE_WINDOW, DOUBLE_WINDOW = (0.2145, 0.2255), (0.206, 0.211)
"""Behind the target: in the direct path's shadow alone, and in that of the surface path as well [s]."""
WIDE, OWN = 6.0, 2.0
"""Lengths of the box in the numbers: a wide one, and the paper's [m]."""
DARK = 30.0
"""Contrast above which only this lower bound is reported [dB]."""
SOURCE = "independent prototype, 120 realisations; ratios of Lambert strengths with and without the cut legs"
ORDERS = ("direct paths", "one reflection per leg", "two reflections per leg")
EXPECTED: dict[tuple[int, tuple[float, float]], tuple[float, float | None]] = {
    (0, LATE_WINDOW): (DARK, None), (1, LATE_WINDOW): (3.5, 0.6), (2, LATE_WINDOW): (2.6, 0.6),
    (0, DOUBLE_WINDOW): (DARK, None), (1, DOUBLE_WINDOW): (DARK, None), (2, DOUBLE_WINDOW): (11.0, 1.5),
}  # fmt: skip
"""Contrast of the 6 m box and its tolerance [dB]; None: lower bound."""


def scene(reflections: int, **changes: Any) -> Scenario:
    """The figure's scenario.

    Args:
        reflections: Largest number of bounces of one leg.
        changes: Other values, with `__` for the dots.
    """
    named = {name.replace("__", "."): value for name, value in changes.items()}
    return nominal({"paths.max_reflections": reflections, "track.window": WINDOW, **named})


def shadow_scene(reflections: int, length: float) -> Scenario:
    """Scenario of the expected intensity of the bed only, behind a box or without one.

    Args:
        reflections: Largest number of bounces of one leg.
        length: Length of the box along the track [m]; 0 for none.
    """
    targets = [box(length)] if length else []
    return scene(reflections, field="incoherent", targets=targets, paths__contributions=["seabed"])


@lru_cache(maxsize=16)
def _intensity(reflections: int, length: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    recording = simulate(shadow_scene(reflections, length))
    return recording["time"].values, recording["intensity"].values[0, 0]


def contrast(reflections: int, length: float, window: tuple[float, float]) -> float:
    """Level of the bare seabed over that behind a box [dB].

    Args:
        reflections: Largest number of bounces of one leg.
        length: Length of the box along the track [m].
        window: Time over which both are averaged [s].
    """
    time, free = _intensity(reflections, 0.0)
    _, cut = _intensity(reflections, length)
    inside = (time >= window[0]) & (time <= window[1])
    return float(level_db(free[inside].mean() / cut[inside].mean()))


def numbers() -> list[CheckedNumber]:
    """Contrast of the shadow for each number of reflections."""
    rows = []
    for (reflections, window), (expected, tolerance) in EXPECTED.items():
        when = f"{window[0] * 1e3:g}-{window[1] * 1e3:g} ms"
        name = f"shadow contrast, 6 m box, {reflections} reflections, {when}"
        rows.append(CheckedNumber(name, contrast(reflections, WIDE, window), "dB", expected, tolerance, SOURCE))
    round_the_sides = "sound round the sides of a 2 m box: integral of the two-way beam beyond it"
    name = f"shadow contrast, 2 m box, 0 reflections, {LATE_WINDOW[0] * 1e3:g}-{LATE_WINDOW[1] * 1e3:g} ms"
    rows.append(CheckedNumber(name, contrast(0, OWN, LATE_WINDOW), "dB", 20.8, 1.0, round_the_sides))
    return rows


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    scenarios = {name: scene(n, paths__geometry="slice") for n, name in enumerate(ORDERS)}
    figure = style.new_figure(9.5, 8)
    figure.suptitle("traces: one vertical plane (slice); boxed: shadow contrast in the whole scene", fontsize=10)
    rows = figure.subplots(3, 1, sharex=True, sharey=True)
    for axes, letter, (name, scenario) in zip(rows, "abc", scenarios.items(), strict=True):
        _panel(axes, scenario)
        axes.set_title(f"{letter}  {name}")
        _contrasts(axes, scenario.paths.max_reflections)
    rows[0].set(xlim=[1e3 * t for t in WINDOW], ylim=(25, 134))
    rows[0].legend(ncols=4, loc="upper right")
    rows[-1].set_xlabel("time after the start of transmission [ms]")
    behind = {f"6 m box, {name}": shadow_scene(n, WIDE) for n, name in enumerate(ORDERS)}
    return figure, {**scenarios, **behind}, numbers()


def _contrasts(axes: Axes, reflections: int) -> None:
    """Write the contrasts of the whole scene into both windows."""
    for window in (LATE_WINDOW, DOUBLE_WINDOW):
        lines = [f"{length:g} m box: {_contrast_text(contrast(reflections, length, window))}" for length in (WIDE, OWN)]
        middle = 1e3 * (window[0] + window[1]) / 2
        axes.text(middle, 27.5, "\n".join(lines), ha="center", va="bottom", fontsize=9, color=style.INK,
                  bbox={"facecolor": "white", "alpha": 0.7, "linewidth": 0, "pad": 1.5})  # fmt: skip


def _contrast_text(contrast_db: float) -> str:
    """Text of a contrast; above the bound it depends on the resolution of sidelobes only."""
    return f"≥ {DARK:g} dB" if contrast_db >= DARK else f"{contrast_db:.1f} dB"


def _panel(axes: Axes, scenario: Scenario) -> None:
    """Draw one ping and its expected level, with the two windows of the numbers marked."""
    recording = simulate(scenario)
    level = level_db(np.abs(recording["pressure"].values[0, 0]) ** 2)
    mean = simulate(scenario.model_copy(update={"field": "incoherent"}))["intensity"].values[0, 0]
    time = recording["time"].values * 1e3
    for window, contribution, name in (
        (LATE_WINDOW, "surface", "late window"),
        (DOUBLE_WINDOW, "seabed", "double shadow"),
    ):
        first, last = (1e3 * t for t in window)
        axes.axvspan(first, last, color=style.CONTRIBUTION_COLOURS[contribution], alpha=0.1, linewidth=0, label=name)
    axes.plot(time, level, color=style.INK, linewidth=0.7, label="one ping")
    axes.plot(time, level_db(mean), color=style.EXPECTED, linewidth=1.6, alpha=0.8, label="expected")
    axes.set_ylabel("level [dB re 1 uPa]")
