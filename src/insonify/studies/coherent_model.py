"""Coherent model: three models of one scene under one scattering law, and what only the coherent one has.

The nominal scene of the paper with the scattering law of medium sand is simulated as the expected intensity (the
paper's first model), as a coherent sum in the vertical plane (its second model), and as a coherent sum in three
dimensions. Over many draws the coherent models have the mean of the first and the statistics of speckle. Between
pings at neighbouring positions only the three-dimensional model has the coherence of a real array.
"""

from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.paper.nominal_scenario import nominal
from insonify.paper.sidescan_model import APERTURE, WAVELENGTH
from insonify.plotting import style
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.studies.page import Section, table
from insonify.units import level_db

Floats = NDArray[np.float64]

LAW: dict[str, Any] = {
    "seabed.scattering": {"law": "jackson", "sediment": "medium sand"}, "track.window": (0.150, 0.234),
    "paths.edge_diffraction": "knife-edge",
}  # fmt: skip
"""Changes to the nominal scene."""
MODELS: dict[str, dict[str, Any]] = {
    "expected intensity": {"field": "incoherent"},
    "coherent, vertical plane": {"paths.geometry": "slice"},
    "coherent, three dimensions": {},
}
"""Models, and their changes to the scene."""
COLOURS = dict(zip(MODELS, (style.EXPECTED, "#1E8FD5", style.INK), strict=True))
PARTS = {"seabed before the target": (0.170, 0.195), "highlight": (0.2000, 0.2004), "shadow": (0.203, 0.220),
         "seabed behind the shadow": (0.2225, 0.234)}  # fmt: skip
"""Parts of a ping, by their times [s]."""
STEP, PINGS = 0.05, 31
"""Spacing of the pings for the coherence along the track [m], and their number."""
COHERENT, SLANT_RANGE = (0.171, 0.181), 132.0
"""Window of the coherence [s], and slant range in its middle [m]."""


@dataclass(frozen=True, slots=True)
class ModelResults:
    """Numbers of the three models."""

    time: Floats
    """Sample times [s], shape (time,)."""
    pings: dict[str, NDArray[Any]]
    """Expected intensity [uPa^2], shape (1, time); or pressure of each draw [uPa], shape (draw, time)."""
    seconds: dict[str, float]
    """Processor time of one ping of each model [s]."""
    coherence: dict[str, Floats]
    """Coherence of each coherent model over distance, shape (ping,)."""

    def intensity(self, model: str) -> Floats:
        """Intensity of each draw [uPa^2], shape (draw, time)."""
        drawn = self.pings[model]
        return np.asarray(np.abs(drawn) ** 2 if np.iscomplexobj(drawn) else drawn, float)

    def mean_error_db(self, model: str, part: str) -> float:
        """Mean intensity of a part of the ping re the expected intensity [dB]."""
        return float(level_db(self.part(model, part).mean() / self.part("expected intensity", part).mean()))

    def scintillation(self, model: str, part: str) -> float:
        """Variance of the intensity over the draws re its squared mean, averaged over a part of the ping [1]."""
        drawn = self.part(model, part)
        return float(np.mean(drawn.var(axis=0, ddof=1) / drawn.mean(axis=0) ** 2))

    def part(self, model: str, part: str) -> Floats:
        """Intensity of each draw within a part of the ping [uPa^2], shape (draw, time)."""
        first, last = PARTS[part]
        return self.intensity(model)[:, (self.time >= first) & (self.time < last)]


def evaluate(draws: int) -> ModelResults:
    """Simulate the three models.

    Args:
        draws: Number of random seabeds of each coherent model.
    """
    pings, seconds, time = {}, {}, np.empty(0)
    for model, changes in MODELS.items():
        simulate(nominal({**LAW, **changes}))  # compiles, and fills tables that all pings share
        start, drawn = process_time(), []
        for seed in range(1 if model == "expected intensity" else draws):
            ping = simulate(nominal({**LAW, **changes, "seed": seed}))
            time = ping["time"].values
            drawn.append(ping["pressure" if "pressure" in ping else "intensity"].values[0, 0])
        pings[model], seconds[model] = np.array(drawn), (process_time() - start) / len(drawn)
    coherence = {model: _coherence(MODELS[model], max(draws // 6, 2)) for model in list(MODELS)[1:]}
    return ModelResults(time, pings, seconds, coherence)


def _passing(changes: dict[str, Any], seed: int) -> Scenario:
    """Scene without the target, seen from a moving sonar."""
    track = {"kind": "line", "start": [0.0, 0.0, 11.0], "heading": 0.0, "speed": STEP / 0.3, "pings": PINGS,
             "interval": 0.3, "window": COHERENT, "stop_and_hop": True}  # fmt: skip
    return nominal({**LAW, **changes, "targets": [], "paths.edge_diffraction": "none", "seed": seed, "track": track})


def _coherence(changes: dict[str, Any], draws: int) -> Floats:
    """Coherence of each ping with the first, shape (ping,)."""
    products = np.zeros(PINGS, complex)
    for seed in range(draws):
        pressure = simulate(_passing(changes, seed))["pressure"].values[:, 0].astype(complex)
        products += pressure @ pressure[0].conj()
    return np.asarray(np.abs(products) / np.abs(products[0]), float)


def coherence_of_lines(distance: Floats, slant_range: float = SLANT_RANGE) -> Floats:
    """Coherence of the seabed's echo between two positions of the sonar, from the patterns of its two lines.

    Args:
        distance: Distances along the track [m], shape (n,).
        slant_range: Slant range of the seabed [m].

    Source: van Cittert-Zernike theorem; the mean over uncorrelated scatterers of one range of the product of both
    echoes, each with its own pattern sinc^2.
    """
    along = np.linspace(-0.2, 0.2, 20_001) * slant_range
    path = np.hypot(along - np.asarray(distance, float)[:, None], slant_range)
    echo = np.sinc(APERTURE * (along - np.asarray(distance, float)[:, None]) / path / WAVELENGTH) ** 2
    phase = np.exp(4j * np.pi * (path - path[0]) / WAVELENGTH)
    product = np.abs((echo * echo[0] * phase).sum(axis=1))
    return np.asarray(product / (echo[0] ** 2).sum(), float)


def section(study: ModelResults) -> Section:
    """Text and picture of the question."""
    rows = []
    for model in MODELS:
        row = [model, f"{study.seconds[model] * 1e3:.0f} ms"]
        for part in ("seabed before the target", "highlight", "shadow"):
            if model == "expected intensity":
                row.append("0 / 0")
            else:
                row.append(f"{study.mean_error_db(model, part):+.1f} dB / {study.scintillation(model, part):.2f}")
        at = {m: study.coherence[m][round(0.45 / STEP)] for m in study.coherence}
        rows.append([*row, f"{at[model]:.2f}" if model in at else "none"])
    draws = len(study.pings["coherent, three dimensions"])
    text = f"""## Is a fully coherent model worth it?

Three models, one scene (the box of the paper in 20 m of water, up to two reflections), one law (medium sand,
APL-UW TR 9407), {draws} random seabeds each. Each cell is the mean intensity re the expected intensity, and the
scintillation index (1 for fully developed speckle). Processor time is of one ping, tables and machine code at hand.

{table(["model", "time", "seabed", "highlight", "shadow", "coherence of two pings 0.45 m apart"], rows)}

In the mean the models agree: for an image of mean levels, the expected intensity has it in one ping
without speckle. What it cannot have is speckle itself and everything that is made of phase: the interference of a
target's multipath, detection against speckle, interferometry, synthetic aperture. The model of the vertical plane has
the speckle of one ping, and no memory: its scatterers stand for whole footprints, and are others at the next ping
({study.coherence["coherent, vertical plane"][round(0.45 / STEP)]:.2f}). In three dimensions two pings 0.45 m apart have
a coherence of {study.coherence["coherent, three dimensions"][round(0.45 / STEP)]:.2f}; the patterns of the arrays give
{coherence_of_lines(np.array([0.0, 0.45]))[1]:.2f}. It costs no more than the plane. So yes: for anything that is
processed beyond the level of single pings, and it is no longer the more costly model."""
    return Section(text, draw(study), "coherent-model", "One ping by three models; speckle; coherence along the track")


def draw(results: ModelResults) -> Figure:
    """A-scan under A-scan, distribution of intensities, coherence along the track."""
    with style.plot_style():
        figure = style.new_figure(9.5, 8.5)
        grid = figure.add_gridspec(4, 2, height_ratios=(1, 1, 1, 1.3))
        for row, model in enumerate(MODELS):
            axes = figure.add_subplot(grid[row, :])
            level = level_db(results.intensity(model)[0])
            axes.plot(results.time * 1e3, level, color=COLOURS[model], linewidth=0.7)
            axes.set(xlim=(results.time[0] * 1e3, results.time[-1] * 1e3), ylim=(50, 125), ylabel="dB re 1 uPa")
            axes.set_title(f"{model}, one ping")
            for name, (first, last) in PARTS.items():
                axes.axvspan(first * 1e3, last * 1e3, color="#B8720A", alpha=0.08, linewidth=0)
                if row == 0:
                    axes.text(
                        (first + last) * 500, 119, name.replace(" before the target", ""), ha="center", fontsize=8
                    )
        axes.set_xlabel("time after the start of transmission [ms]")
        _draw_distribution(figure.add_subplot(grid[3, 0]), results)
        _draw_coherence(figure.add_subplot(grid[3, 1]), results)
        return figure


def _draw_distribution(axes: Any, results: ModelResults) -> None:
    x = np.linspace(0, 8, 161)
    axes.semilogy(x, np.exp(-x), color=style.EXPECTED, linewidth=3, alpha=0.5, label="exponential (speckle)")
    mean = results.part("expected intensity", "seabed before the target")
    for model in list(MODELS)[1:]:
        ratio = np.sort((results.part(model, "seabed before the target") / mean).ravel())
        exceeded = 1 - np.arange(ratio.size) / ratio.size
        axes.semilogy(ratio[::50], exceeded[::50], color=COLOURS[model], label=model)
    axes.set(
        xlim=(0, 8), ylim=(2e-4, 1), xlabel="intensity re expected intensity [1]", ylabel="probability of more [1]"
    )
    axes.set_title("speckle of the seabed")
    axes.legend(fontsize=8)


def _draw_coherence(axes: Any, results: ModelResults) -> None:
    distance = np.linspace(0.0, STEP * (PINGS - 1), PINGS)
    axes.plot(distance, coherence_of_lines(distance), color=style.EXPECTED, linewidth=3, alpha=0.5, label="theory")
    for model, coherence in results.coherence.items():
        axes.plot(distance, coherence, ".-", color=COLOURS[model], label=model)
    axes.set(xlabel="distance along the track [m]", ylabel="coherence [1]", ylim=(0, 1.05))
    axes.set_title("seabed between pings")
    axes.legend(fontsize=8)
