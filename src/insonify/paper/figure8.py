"""Figure 8: rays under the profile, spike array by contribution, and the coherent series.

The scenario is that of `thermocline_model`: one vertical plane, direct paths only. The numbers check that the series is
the sum of its replicas, that coherent addition causes speckle of a flat bed (index 2, where expected intensity
has 1), the effect of the random amplitude, and the largest range of direct paths to the bed.
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from numpy.typing import NDArray

from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.thermocline_model import (
    PERTURBATION,
    PROFILE,
    STRENGTHS_DB,
    WINDOW,
    draw_rays,
    replica_sum,
    scene,
    thinned,
)
from insonify.plotting import style
from insonify.plotting.levels import curves
from insonify.plotting.spikes_by_source import spikes_by_source
from insonify.records.arrivals import Arrivals
from insonify.scenario.scenario import Scenario
from insonify.simulator import arrivals, build_simulator, levels, simulate
from insonify.synthesis.arrival_weights import arrival_weights
from insonify.units import level_db

TITLE = "Rays, spike array and coherent series under the profile, direct paths"
BEFORE = (0.060, 0.195)
"""Window of the seabed only [s]."""
SPAN = (32.0, 128.0)
"""Levels of the pictures [dB re 1 uPa]."""
REALISATIONS = 15
"""Seeds of the speckle: 10000 cells of 0.2 ms, a standard error of 2 / sqrt(N) = 0.02."""
CROWDED = 40
"""Scatterers in each cell of the speckle: N unit phasors have an index of 2 - 1 / N, less at the edges of a cell."""

Floats = NDArray[np.float64]


def speckle_index(realisations: int = REALISATIONS) -> tuple[float, float]:
    """Mean square over squared mean of the bed's intensity without its trend: coherent, and expected [1].

    Args:
        realisations: Number of seeds.
    """
    changes = {"paths.contributions": ["seabed"], "paths.scatterers_per_cell": CROWDED, "track.window": BEFORE}
    smooth = simulate(scene(True, {**changes, "field": "incoherent"}))["intensity"].values[0, 0]
    time = np.linspace(-1, 1, smooth.size)
    trend = 10 ** np.polyval(np.polyfit(time, np.log10(smooth), 12), time)
    speckled = [
        np.abs(simulate(scene(True, {**changes, "seed": seed}))["pressure"].values[0, 0].astype(complex)) ** 2 / trend
        for seed in range(1, realisations + 1)
    ]
    return _index(np.array(speckled)), _index(smooth / trend)


def _index(intensity: Floats) -> float:
    return float(np.mean(intensity**2) / np.mean(intensity) ** 2)


def perturbation_gain() -> float:
    """Increase of the expected intensity by the random amplitude [dB]."""
    perturbed, unperturbed = (
        simulate(scene(True, {"field": "incoherent", "paths.amplitude_perturbation": part}))["intensity"].values.mean()
        for part in (PERTURBATION, 0.0)
    )
    return float(level_db(perturbed / unperturbed))


def shadow_edge() -> tuple[float, float]:
    """Largest horizontal range [m] and two-way delay [s] of direct paths to the bed, in closed form.

    The last ray turns just below 8 m, where it is horizontal: cos(launch) = 1500 / 1510. From that knot it is an arc
    of a circle of radius c / |g| down to 14 m, and straight below.
    """
    (_, _), (top, fast), (foot, slow), (bed, _) = PROFILE
    gradient, source, source_speed = (fast - slow) / (foot - top), 11.0, 1500.0
    sine, steep = (np.sqrt(1 - (speed / fast) ** 2) for speed in (source_speed, slow))
    # in the gradient: x = s / (p g), t = atanh(s) / g, up from the sonar and down to 14 m
    reach = (sine + steep) * fast / gradient + (bed - foot) * (slow / fast) / steep
    time = (np.arctanh(sine) + np.arctanh(steep)) / gradient + (bed - foot) / (slow * steep)
    assert top < source < foot
    return float(reach), float(2 * time)


def numbers(realisations: int = REALISATIONS) -> list[CheckedNumber]:
    """Agreement of the series with the sum of its replicas, speckle index and range of direct paths.

    Args:
        realisations: Number of seeds of the speckle index.
    """
    total, series = replica_sum(scene(True)), simulate(scene(True))["pressure"].values[0, 0]
    off = float(np.linalg.norm(series - total) / np.linalg.norm(total))
    speckled, smooth = speckle_index(realisations)
    reach, delay = shadow_edge()
    bed = paths_of(arrivals(scene(True)), "seabed")
    gain = 10 * np.log10(1 + PERTURBATION**2 / 3)
    circle, uniform = "arcs of circles: the ray that is horizontal at 8 m", "variance of a uniform change, e^2 / 3"
    rows = [
        CheckedNumber("series re the sum of its replicas, rms", off, "1", 0.0, 1e-5, "sum of pulses in float64"),
        CheckedNumber("speckle index of the coherent seabed", speckled, "1", 2.0, 0.07, "complex Gaussian sum"),
        CheckedNumber("speckle index of the expected seabed", smooth, "1", 1.0, 0.01, "a flat bed is smooth"),
        CheckedNumber("random amplitude: more expected intensity", perturbation_gain(), "dB", gain, 1e-3, uniform),
        CheckedNumber("last direct return of the seabed", float(bed.delay.max()), "s", delay, 1e-4, circle),
        CheckedNumber("its range", float(np.hypot(*bed.position[:, :2].T).max()), "m", reach, 0.05, circle),
    ]
    rows += [CheckedNumber(f"Lambert strength of the {name}", value, "dB") for name, value in STRENGTHS_DB.items()]
    return rows + strongest(scene(True))


def strongest(scenario: Scenario) -> list[CheckedNumber]:
    """Level of the strongest spike and number of spikes of each object."""
    paths = arrivals(scenario, window=WINDOW)
    level = level_db(np.abs(arrival_weights(paths, build_simulator(scenario).ping_geometry(0))) ** 2)
    rows = []
    for name in ("box", "seabed", "surface"):
        own = paths.object == name
        rows.append(CheckedNumber(f"strongest spike of the {name}", float(level[own].max()), "dB re 1 uPa"))
        rows.append(CheckedNumber(f"spikes of the {name}", float(own.sum()), "1"))
    return rows


def paths_of(paths: Arrivals, name: str) -> Arrivals:
    """Paths of one object, by its name."""
    return paths.take(paths.object == name)


def draw() -> Drawn:
    """The picture, its scenarios by name, and its numbers."""
    figure = style.new_figure(10.5, 10.5)
    panels(figure, scene(True))
    return figure, {"thermocline": scene(True)}, numbers()


def panels(figure: Figure, scenario: Scenario) -> None:
    """Draw rays, spikes and series of one scenario, from top to bottom."""
    above, below = figure.subfigures(2, 1, height_ratios=(1, 1.75), squeeze=False)[:, 0]
    scene_panel(above, scenario, "a  direct rays, -20 to 20 deg")
    spikes, energy, series = below.subplots(3, 1, sharex=True)
    spike_panel(spikes, scenario, "b  spike array: one mark for each path, by contribution")
    curves(energy, levels(scenario), WINDOW)
    energy.set(title="c  expected level of each contribution", ylim=SPAN)
    series_panel(series, scenario, "d  coherent series")
    for axes in (spikes, energy):
        axes.set_xlabel("")


def scene_panel(above: SubFigure, scenario: Scenario, title: str) -> None:
    """Draw rays over the scene, beside the profile.

    Args:
        above: Part of the figure to draw on.
        scenario: Scenario with the water.
        title: Title of the rays.
    """
    left, right = above.subplots(1, 2, sharey=True, width_ratios=(1, 4.2))
    draw_rays(left, right, scenario)
    right.set_title(title)


def spike_panel(axes: Axes, scenario: Scenario, title: str) -> None:
    """Draw the spike array of a scenario by contribution."""
    paths = thinned(arrivals(scenario))
    weight = arrival_weights(paths, build_simulator(scenario).ping_geometry(0))
    spikes_by_source(axes, paths, level_db(np.abs(weight) ** 2), "level [dB re 1 uPa]", span=(36, 102))
    axes.set_title(title)


def series_panel(axes: Axes, scenario: Scenario, title: str) -> None:
    """Draw one coherent ping of a scenario, and its expected level."""
    recording = simulate(scenario)
    level, time = level_db(np.abs(recording["pressure"].values[0, 0]) ** 2), recording["time"].values * 1e3
    mean = simulate(scenario.model_copy(update={"field": "incoherent"}))["intensity"].values[0, 0]
    axes.plot(time, level, color=style.INK, linewidth=0.7, label="one ping")
    axes.plot(time, level_db(mean), color=style.EXPECTED, linewidth=1.6, alpha=0.8, label="expected")
    axes.set_title(title)
    axes.legend(ncols=2, loc="upper right")
    axes.set_xlabel("time after the start of transmission [ms]")
    axes.set_ylabel("level [dB re 1 uPa]")
    axes.set_xlim(*(1e3 * t for t in WINDOW))
    axes.set_ylim(*SPAN)
