"""Figure 13: the same spikes with increasing phase jitter.

Changed in the nominal scene: one vertical plane (`paths.geometry: slice`), `paths.jitter` of 0, 0.1, 0.25, 0.5 and 1
wavelength, and a static track of two pings, which differ only in their jitter. The numbers are of direct paths
and of the seabed before the target, 30-195 ms, where replicas do not overlap: there the correlation of two pings is
|E exp(-j 2 pi J u)|^2 = sinc^2(J), for u uniform in 0..1.
"""

from typing import Any

import numpy as np

from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.nominal_scenario import nominal
from insonify.plotting import style
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.units import level_db

TITLE = "One spike array with different levels of phase jitter"
JITTERS = (0.0, 0.1, 0.25, 0.5, 1.0)
WINDOW = (0.195, 0.230)
BEFORE = (0.030, 0.195)
REALISATIONS = 40
"""Seeds that are averaged: 33000 cells of 0.2 ms, a standard error of 0.005."""


def scene(jitter: float, changes: dict[str, Any] | None = None) -> Scenario:
    """The figure's scenario.

    Args:
        jitter: Largest random delay of each replica [wavelengths].
        changes: Other values by dotted name.
    """
    fixed = {"paths.geometry": "slice", "paths.jitter": jitter, "track.pings": 2, "track.window": WINDOW}
    return nominal({**fixed, **(changes or {})})


def correlation(jitter: float, realisations: int = REALISATIONS) -> float:
    """Magnitude of the normalised complex correlation of two jittered pings of the same seabed [1].

    Args:
        jitter: Largest random delay of each replica [wavelengths].
        realisations: Number of seeds.
    """
    changes = {"paths.max_reflections": 0, "paths.contributions": ["seabed"], "track.window": BEFORE}
    steady = scene(0.0, {**changes, "field": "incoherent", "track.pings": 1})
    root = np.sqrt(simulate(steady)["intensity"].values[0, 0])
    pings = [
        simulate(scene(jitter, {**changes, "seed": seed}))["pressure"].values[:, 0].astype(complex) / root
        for seed in range(1, realisations + 1)
    ]
    first, second = np.stack(pings, axis=1).reshape(2, -1)
    return float(abs(np.vdot(first, second)) / np.linalg.norm(first) / np.linalg.norm(second))


def numbers(realisations: int = REALISATIONS) -> list[CheckedNumber]:
    """Correlation of two pings at each level of jitter.

    Args:
        realisations: Number of seeds.
    """
    source, rows = "characteristic function of a uniform phase: sinc^2(J)", []
    for jitter in JITTERS:
        name, value = f"correlation of two pings, jitter {jitter:g} wavelengths", correlation(jitter, realisations)
        rows.append(CheckedNumber(name, value, "1", float(np.sinc(jitter) ** 2), 0.02, source))
    return rows


def draw(realisations: int = REALISATIONS) -> Drawn:
    """The picture, its scenarios by name, and its numbers.

    Args:
        realisations: Number of seeds of the numbers.
    """
    scenarios = {f"jitter {jitter:g}": scene(jitter) for jitter in JITTERS}
    rows = numbers(realisations)
    figure = style.new_figure(9.5, 9.5)
    panels = figure.subplots(len(JITTERS), 1, sharex=True, sharey=True)
    for axes, scenario, row in zip(panels, scenarios.values(), rows, strict=True):
        recording = simulate(scenario)
        time = recording["time"].values * 1e3
        level = level_db(np.abs(recording["pressure"].values[:, 0]) ** 2)
        axes.plot(time, level[1], color=style.FAMILIES["B"], linewidth=1.4)
        axes.plot(time, level[0], color=style.INK, linewidth=0.6)
        axes.set_ylim(40, 126)
        axes.set_title(
            f"jitter up to {scenario.paths.jitter:g} $\\lambda$: pings of bare seabed correlate {row.value:.2f} "
            f"(sinc$^2$: {row.expected:.2f})"
        )
    panels[0].set_xlim(*(1e3 * t for t in WINDOW))
    panels[0].legend(["second ping", "first ping"], ncols=2, loc="upper right")
    panels[2].set_ylabel("level [dB re 1 uPa]")
    panels[-1].set_xlabel("time after the start of transmission [ms]")
    return figure, scenarios, rows
