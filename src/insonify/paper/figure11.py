"""Figure 11: near the target, the energy model, its spikes, and one coherent series computed from them.

Changed in the nominal scene: one vertical plane (`paths.geometry: slice`, the paper's 2-D); a window of 35 ms around
the target, as in the paper; a sea surface that scatters by Lambert's law at -30 dB, a little less than the bed, so
that both reverberations are visible; and noise of 5 dB re 1 uPa^2/Hz in the beam, from about
28 dB of thermal and wind noise at 100 kHz less the array's directivity of 10 log10(2 L / wavelength) = 23 dB.
"""

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.paper.checked_numbers import CheckedNumber, Drawn
from insonify.paper.nominal_scenario import nominal
from insonify.plotting import style
from insonify.plotting.levels import curves
from insonify.plotting.spikes import spike_array
from insonify.records.arrivals import Arrivals
from insonify.scenario.scenario import Scenario
from insonify.simulator import arrivals, build_simulator, levels, simulate
from insonify.synthesis.arrival_weights import arrival_weights
from insonify.synthesis.noise import noise_intensity
from insonify.synthesis.spike_power import spike_power
from insonify.units import level_db

TITLE = "Energy model, spike array and coherent series about the target"
WINDOW = (0.195, 0.230)
REALISATIONS = 200
BIN = 1e-3
"""Width of the bins in which spikes are summed [s]."""
PARTS = {
    "whole window": WINDOW,
    "before the target": (0.195, 0.2),
    "behind the target, one bounce": (0.206, 0.211),
    "behind the target": (0.2145, 0.2255),
}
"""Windows in which the mean coherent power is compared with the energy model [s]."""

Floats = NDArray[np.float64]


def scene(seed: int = 1, field: str = "coherent") -> Scenario:
    """Scenario of the figure.

    Args:
        seed: Random seed.
        field: Coherent pressure or expected (incoherent) intensity.
    """
    return nominal(
        {
            "seed": seed, "field": field, "paths.geometry": "slice", "track.window": WINDOW,
            "surface.scattering": {"strength_db": -30.0}, "water.noise_level_db": 5.0,
        }
    )  # fmt: skip


def mean_power(realisations: int = REALISATIONS) -> tuple[Floats, Floats]:
    """Mean coherent power, and mean of the energy model, over the same realisations [uPa^2], shape (time,).

    Args:
        realisations: Number of seeds.
    """
    coherent, expected = [], []
    for seed in range(1, realisations + 1):
        coherent.append(np.abs(simulate(scene(seed))["pressure"].values[0, 0].astype(complex)) ** 2)
        if seed <= max(1, realisations // 10):  # the energy model hardly changes from draw to draw
            expected.append(simulate(scene(seed, "incoherent"))["intensity"].values[0, 0])
    return np.mean(coherent, axis=0), np.mean(expected, axis=0)


def binned_spikes() -> tuple[Floats, Floats]:
    """Mean power of the spikes, and of the energy model, in bins of 1 ms [uPa^2], shape (bins,) each."""
    scenario = scene(field="incoherent")
    simulator = build_simulator(scenario)
    counted = spike_power(arrivals(scenario), simulator.ping_geometry(0), simulator.grid.time)
    counted += noise_intensity(simulator.pulse, scenario.water.noise_level_db)
    modelled = simulate(scenario)["intensity"].values[0, 0]
    size = round(BIN * simulator.grid.sample_rate)
    return counted.reshape(-1, size).mean(axis=1), modelled.reshape(-1, size).mean(axis=1)


def numbers(realisations: int = REALISATIONS) -> list[CheckedNumber]:
    """Agreement of energy model, spikes and coherent series of one list of paths.

    Args:
        realisations: Number of seeds that are averaged.
    """
    coherent, expected = mean_power(realisations)
    time = build_simulator(scene()).grid.time
    rows = []
    for name, (first, last) in PARTS.items():
        inside = (time >= first) & (time < last)
        difference = float(level_db(np.mean(coherent[inside] / expected[inside])))
        # fewer cells in the shorter windows: three standard errors of about 0.2 dB there
        limit = 0.2 if name == "whole window" else 0.5
        rows.append(
            CheckedNumber(
                f"mean coherent power re energy model, {name}", difference, "dB", 0.0, limit, "conservation of energy"
            )
        )
    counted, modelled = binned_spikes()
    difference = np.abs(level_db(counted / modelled)).max()
    name, source = "spike energy in 1 ms re energy model, worst bin", "conservation of energy"
    rows.append(CheckedNumber(name, difference, "dB", 0.0, 0.1, source))
    rows.append(CheckedNumber("realisations", realisations, "1"))
    return rows


def draw(realisations: int = REALISATIONS) -> Drawn:
    """The picture, its scenarios by name, and its numbers.

    Args:
        realisations: Number of seeds of the numbers.
    """
    figure = style.new_figure(9.5, 9.5)
    _panels(figure)
    return figure, {"seed 1": scene()}, numbers(realisations)


def _panels(figure: Figure) -> None:
    energy, stems, series = figure.subplots(3, 1, sharex=True)
    curves(energy, levels(scene()), WINDOW)
    energy.set_title("a  energy model, by contribution")
    scenario = scene()
    paths, geometry = _sampled(arrivals(scenario)), build_simulator(scenario).ping_geometry(0)
    spike_array(stems, paths, level_db(np.abs(arrival_weights(paths, geometry)) ** 2), "level [dB re 1 uPa]")
    stems.set_title("b  spike array: one mark for each path, in the hue of the longer of its two legs")
    recording = simulate(scenario)
    pressure = recording["pressure"].values[0, 0] / 1e3
    time = recording["time"].values * 1e3
    series.plot(time, np.abs(pressure), color=style.INK, linewidth=0.9, label="envelope")
    series.plot(time, pressure.real, color=style.EXPECTED, linewidth=0.5, label="in-phase part")
    series.set_title("c  coherent series, rms scale")
    series.legend(ncols=2, loc="upper right")
    series.set(xlabel="time after the start of transmission [ms]", ylabel="pressure [mPa]")
    for axes in (energy, stems):
        axes.set_xlabel("")


def _sampled(paths: Arrivals) -> Arrivals:
    """Select all paths of targets, and every fifth of the others, for drawing."""
    drawn = ((paths.object != "seabed") & (paths.object != "surface")) | (paths.group % 5 == 0)
    return paths.take(drawn)
