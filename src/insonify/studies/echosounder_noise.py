"""Noise floor of an echosounder: level, distribution and whiteness where no echo is left, real and simulated.

At 333 kHz the EK80 of the echo trains receives nothing but noise from 30 m on. Its spectrum level is fitted to the last
ping, and predicts the stretch of the other ping before a foreign sound; distribution and bandwidth are those of white
noise behind the stated filters.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.formats.instruments import open_instrument
from insonify.formats.instruments.scenario_text import scenario_text
from insonify.formats.instruments.scenario_values import filter_response
from insonify.plotting import style
from insonify.processing.split_beam import pressure_per_volt
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.studies.harbour_echo_trains import FILE, SOUND_SPEED
from insonify.studies.page import Section, table
from insonify.units import level_db

Floats = NDArray[np.float64]

GROUP = "333 kHz"
QUIET = ((30.0, 39.0), (30.0, 44.0))
"""Ranges of noise alone, of each ping [m]."""
PINGS = 8
"""Simulated pings [1]."""


@dataclass(frozen=True, slots=True)
class Noise:
    """Numbers of noise-only samples."""

    level_db: float
    """Level in the band [dB re 1 uPa]."""
    index: float
    """Variance of the intensity re its squared mean [1]."""
    bandwidth: float
    """Bandwidth of a rectangle with the same integral of the squared correlation [Hz]."""
    lag: Floats
    """Lags [s], shape (lag,)."""
    correlation: Floats
    """Modulus of the correlation coefficient [1], shape (lag,)."""


@dataclass(frozen=True, slots=True)
class NoiseResults:
    """Noise of the fitted ping, the other one, and the simulation."""

    fitted: Noise
    predicted: Noise
    simulated: Noise
    filtered: Noise
    """White noise behind the stated filters, of the fitted level."""
    spectrum_db: float
    """Fitted spectrum level [dB re 1 uPa^2/Hz]."""


def noise_of(field: Floats, interval: float) -> Noise:
    """Numbers of noise.

    Args:
        field: Complex pressure [uPa], shape (ping, sample).
        interval: Sample interval [s].
    """
    intensity = np.abs(field) ** 2
    mean = float(intensity.mean())
    count = min(int(200e-6 / interval) + 1, field.shape[1] // 2)
    products = [np.mean(field[:, k:] * np.conj(field[:, : field.shape[1] - k])) for k in range(count)]
    correlation = np.abs(products) / mean
    bandwidth = 1 / (interval * (1 + 2 * np.sum(correlation[1:] ** 2)))
    return Noise(float(level_db(mean)), float(intensity.var() / mean**2), float(bandwidth),
                 interval * np.arange(count), np.asarray(correlation, float))  # fmt: skip


def evaluate(folder: Path) -> NoiseResults:
    """Fit the spectrum level to one ping, and predict the other."""
    with open_instrument(folder / FILE) as file:
        pings = file.read(GROUP)
        scenario = parse_model(Scenario, scenario_text(file, "noise", GROUP))
    field = pings["voltage"].values.mean(axis=1) * pressure_per_volt(pings)
    interval = float(pings["sample_interval"].median())
    slant = SOUND_SPEED / 2 * interval * np.arange(field.shape[1])
    other, last = (noise_of(row[None, (slant > low) & (slant < high)], interval)
                   for row, (low, high) in zip(field, QUIET, strict=True))  # fmt: skip
    silent = scenario.with_({"seabed.scattering": None, "seabed.reflection": 0.0, "water.noise_level_db": 0.0})
    noise_pings = [simulate(silent.with_("seed", seed + 1))["pressure"].values.reshape(1, -1) for seed in range(PINGS)]
    samples = np.concatenate(noise_pings)
    unit = noise_of(samples, 1 / scenario.sonar.receiver.sample_rate)
    spectrum = last.level_db - unit.level_db
    simulated = noise_of(samples * 10 ** (spectrum / 20), float(unit.lag[1]))
    return NoiseResults(last, other, simulated, _filtered(pings, last), spectrum)


def _filtered(pings: xr.Dataset, like: Noise) -> Noise:
    """White noise behind the stated filters, at the lags of another."""
    response = filter_response(pings)
    step = float(like.lag[1]) * float(pings["receiver_sample_rate"].median())
    whole = np.correlate(response, response, "full")[response.size - 1 :]
    at = np.round(step * np.arange(like.lag.size)).astype(int)
    correlation = np.where(at < whole.size, np.abs(whole[np.minimum(at, whole.size - 1)]), 0.0) / abs(whole[0])
    bandwidth = 1 / (like.lag[1] * (1 + 2 * np.sum(correlation[1:] ** 2)))
    return Noise(like.level_db, 1.0, float(bandwidth), like.lag, correlation)


def section(results: NoiseResults) -> Section:
    """Text and picture."""
    rows = [[name, f"{one.level_db:.1f}", f"{one.index:.2f}", f"{one.bandwidth / 1e3:.1f}"]
            for name, one in (("real, fitted ping", results.fitted), ("real, other ping", results.predicted),
                              ("white noise behind the stated filters", results.filtered),
                              ("simulated", results.simulated))]  # fmt: skip
    text = f"""## Noise floor of the echosounder: 333 kHz

From {QUIET[0][0]:.0f} m on the 333 kHz channel receives noise alone. Its spectrum level, fitted to the last ping, is
{results.spectrum_db:.1f} dB re 1 uPa^2/Hz of a wave on the axis. Thermal noise of the sea (Mellen 1952: 35 dB from all
directions, 9 dB in this beam) is far below it: it is the receiver's own. Whiteness: the bandwidth of a rectangle with
the same integral of the squared correlation; the picture has the correlation itself. Real noise is as white as noise
behind the stated filters; the simulated band passes as much noise, but with flatter top and steeper edges. The real
index is above 1: some samples are hit by short foreign sounds.

{table(["", "level [dB re 1 uPa]", "scintillation index", "bandwidth [kHz]"], rows)}"""
    return Section(text, draw(results), "echosounder-noise", "Correlation of noise, real and simulated")


def draw(results: NoiseResults) -> Figure:
    """Correlation over lag."""
    with style.plot_style():
        figure = style.new_figure(6.0, 3.2)
        axes = figure.subplots()
        for one, name in ((results.fitted, "real, fitted ping"), (results.predicted, "real, other ping")):
            axes.plot(one.lag * 1e6, one.correlation, linewidth=1, label=name)
        axes.plot(results.filtered.lag * 1e6, results.filtered.correlation, "--", label="behind the stated filters")
        axes.plot(
            results.simulated.lag * 1e6, results.simulated.correlation, "o-", color=style.EXPECTED, label="simulated"
        )
        axes.set(xlabel="lag [us]", ylabel="correlation [1]", ylim=(0, 1.05))
        axes.legend()
        return figure
