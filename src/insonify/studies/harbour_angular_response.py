"""Angular response of a flat harbour bed: backscatter of a multibeam from 5 to 65 degrees, real and simulated.

A Kongsberg EM2042 over a bed 8.2 m below the surface, six pings of up to three transmit sectors between 190 and
680 kHz. The backscatter level of each sounding, its maker's gain undone, is freed of the source level and sensitivity
that the file states for it, of spreading and absorption, and of the insonified area; a constant of the instrument
remains, which the mean over all angles of each ping takes out. One sediment is fitted to the pings at 320 and 380 kHz.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import skew

from insonify.formats.instruments import open_instrument
from insonify.formats.instruments.scenario_text import scenario_text
from insonify.ocean.absorption import absorption_db_per_m
from insonify.plotting import style
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.studies.page import Section, table
from insonify.units import level_db

Floats = NDArray[np.float64]

FILE = "em2042-ostend-os02-300khz-b.kmall"
ANGLES = np.arange(5.0, 66.0, 5.0)
"""Angles from the vertical [deg]; soundings within half their spacing count."""
LEAST = 6
"""Least number of soundings of an angle [1]."""
SEDIMENTS = ("coarse sand", "medium sand", "very fine sand", "coarse silt", "clay")
"""Sediments tried, from the coarsest to the finest."""
FITTED, FIRST = (0, 5), 320e3
"""Pings to which the sediment is fitted, those at 320 and 380 kHz, and their first frequency [Hz]."""
OUTER, NEIGHBOURS, DRAWS, SPACING = (50.0, 65.0), 24, 24, 0.5
"""Angles of the speckle [deg], number of beams in whose mean it is measured, simulated pings [1], and the spacing of
their beams [deg]."""


@dataclass(frozen=True, slots=True)
class Response:
    """Angular response of one ping."""

    frequency: str
    """Frequencies of its sectors [kHz]."""
    real: Floats
    """Backscatter re the mean over angles [dB], shape (angle,); NaN where too few soundings are."""
    error: Floats
    """Standard error of `real` over its soundings [dB], shape (angle,)."""
    simulated: Floats
    """Simulated, re its mean over the same angles [dB], shape (angle,)."""

    @property
    def difference(self) -> Floats:
        """Simulated less real [dB], shape (angle,)."""
        return self.simulated - self.real


@dataclass(frozen=True, slots=True)
class AngularResults:
    """Angular responses, and the fit."""

    responses: list[Response]
    sediment: str
    """Fitted sediment."""
    misfit: dict[str, float]
    """Rms difference at the fitted pings by sediment [dB]."""
    speckle: list[Floats]
    """Level of single samples re their neighbours, 50 to 65 degrees from the vertical [dB], by ping of the recording;
    empty where too few are."""
    simulated_speckle: list[Floats]
    """The same of simulated pings."""


def evaluate(folder: Path) -> AngularResults:
    """Fit the sediment at some pings, and predict the others."""
    with open_instrument(folder / FILE) as file:
        soundings, image = file.read("soundings").load(), file.read("seabed image").load()
        base = parse_model(Scenario, scenario_text(file, "bed", "soundings"))
    pings = [mean_by_angle(*_backscatter(soundings, ping)) for ping in range(soundings.sizes["ping"])]
    cache: dict[tuple[str, float], Floats] = {}
    misfit = {}
    for sediment in SEDIMENTS:
        differences = [_response(base, soundings, pings[ping], ping, sediment, cache).difference for ping in FITTED]
        misfit[sediment] = float(np.sqrt(np.nanmean(np.square(differences))))
        print(f"{sediment}: {misfit[sediment]:.1f} dB rms")
    best = min(misfit, key=lambda name: misfit[name])
    responses = [_response(base, soundings, real, ping, best, cache) for ping, real in enumerate(pings)]
    contrasts = [_real_speckle(image, soundings, ping) for ping in range(len(pings))]
    drawn = [simulated_speckle(base, FIRST, best, seed + 1, SPACING) for seed in range(DRAWS)]
    return AngularResults(responses, best, misfit, contrasts, drawn)


def _angle(soundings: xr.Dataset, ping: int) -> tuple[Floats, Floats]:
    """Range [m] and angle from the vertical [deg] of each sounding."""
    one = soundings.isel(ping=ping)
    slant = float(one["sound_speed"]) * one["travel_time"].values / 2
    down = one["depth"].values - float(one["transducer_depth"])
    return slant, np.degrees(np.arccos(np.clip(down / slant, -1, 1)))


def _area_db(slant: Floats, angle: Floats, width: float, across: float, length: Floats) -> Floats:
    """Insonified area of a beam at an angle from the vertical [dB re 1 m^2]: by the pulse, or by the beam."""
    sine, cosine = np.sin(np.radians(angle)), np.cos(np.radians(angle))
    by_pulse = width * slant * length / np.maximum(sine, 1e-6)
    return level_db(np.minimum(by_pulse, width * slant * across * slant / cosine))


def _backscatter(soundings: xr.Dataset, ping: int) -> tuple[Floats, Floats]:
    """Angle from the vertical [deg] and backscatter up to a constant [dB] of the detected soundings of a ping."""
    one = soundings.isel(ping=ping)
    slant, angle = _angle(soundings, ping)
    sector = np.clip(one["sector"].values, 0, None)
    length = one["effective_pulse_length"].values[sector] * float(one["sound_speed"]) / 2
    area = _area_db(slant, angle, float(one["tx_beam_width"]), float(one["rx_beam_width"]), length)
    level = one["backscatter"].values - one["source_level_applied"].values - one["sensitivity_applied"].values
    level = level + 40 * np.log10(slant) + 2 * one["absorption"].values * slant - area
    detected = (one["detection"].values == 0) & (one["sector"].values >= 0) & np.isfinite(level)
    return angle[detected], level[detected]


def mean_by_angle(angle: Floats, level: Floats) -> tuple[Floats, Floats]:
    """Mean backscatter by angle [dB] and its standard error, shape (angle,) each; NaN where soundings are few.

    Args:
        angle: Angle of each sounding from the vertical [deg], shape (n,).
        level: Its backscatter [dB], shape (n,).
    """
    mean, error = np.full(ANGLES.size, np.nan), np.full(ANGLES.size, np.nan)
    for k, middle in enumerate(ANGLES):
        near = level[np.abs(angle - middle) < np.diff(ANGLES)[0] / 2]
        if near.size >= LEAST:
            mean[k], error[k] = level_db(np.mean(10 ** (near / 10))), near.std(ddof=1) / np.sqrt(near.size)
    return mean, error


def _response(base: Scenario, soundings: xr.Dataset, real: tuple[Floats, Floats], ping: int, sediment: str,
              cache: dict[tuple[str, float], Floats]) -> Response:  # fmt: skip
    """Response of a ping and of its simulation, each angle at the frequency of its sector."""
    one = soundings.isel(ping=ping)
    _, angle = _angle(soundings, ping)
    tones = one["frequency"].values
    simulated = np.full(ANGLES.size, np.nan)
    for k in np.flatnonzero(np.isfinite(real[0])):
        sector = one["sector"].values[(np.abs(angle - ANGLES[k]) < 2.5) & (one["sector"].values >= 0)]
        tone = float(np.median(tones[sector]))
        if (sediment, tone) not in cache:
            cache[sediment, tone] = simulated_response(base, tone, sediment)
        simulated[k] = cache[sediment, tone][k]
    known = np.isfinite(real[0])
    name = "/".join(f"{tone / 1e3:.0f}" for tone in tones if np.isfinite(tone))
    return Response(name, real[0] - real[0][known].mean(), real[1], simulated - simulated[known].mean())


def _steered(base: Scenario, frequency: float, sediment: str, angles: Floats) -> Scenario:
    """Scenario of the sonar with beams at some angles from the vertical [deg]."""
    return base.with_({
        "seabed.scattering": {"sediment": sediment}, "seabed.reflection": sediment, "water.noise_level_db": None,
        "sonar.pulse.frequency": frequency, "sonar.receiver.record": "beams", "paths.max_reflections": 0,
        "sonar.receive.steer": [f"{angle:g} deg" for angle in angles],
    })  # fmt: skip


def simulated_response(base: Scenario, frequency: float, sediment: str) -> Floats:
    """Backscatter by angle of a simulated sonar [dB], shape (angle,).

    Args:
        base: Scenario of its recording.
        frequency: Frequency [Hz].
        sediment: Sediment of the bed.
    """
    scenario = _steered(base, frequency, sediment, ANGLES).with_("field", "incoherent")
    ping = simulate(scenario)
    water, pulse = scenario.water, scenario.sonar.pulse
    height = scenario.seabed.depth - scenario.track.position[2]  # type: ignore[union-attr]
    slant, speed = height / np.cos(np.radians(ANGLES)), float(water.sound_speed_at(np.array(scenario.seabed.depth)))
    time, intensity = ping["slant_range"].values, ping["intensity"].values[0].astype(float)
    # An echo lasts as long as the pulse: in its middle it is from all of the pulse's length.
    level = np.array([level_db(np.interp(r + pulse.duration * speed / 4, time, row))
                      for r, row in zip(slant, intensity, strict=True)])  # fmt: skip
    loss = float(absorption_db_per_m(frequency, temperature=water.temperature, salinity=water.salinity, ph=water.ph,
                                     depth=height / 2))  # fmt: skip
    wavelength = speed / frequency
    width = 0.886 * wavelength / scenario.sonar.transmit.height  # type: ignore[union-attr]
    across = 0.886 * wavelength / scenario.sonar.receive.length / np.cos(np.radians(ANGLES))  # type: ignore[union-attr]
    area = _area_db(slant, ANGLES, width, 1.0, np.full(ANGLES.size, pulse.duration * speed / 2))
    area = np.minimum(area, level_db(width * across * slant**2 / np.cos(np.radians(ANGLES))))
    return level - scenario.sonar.source_level_db + 40 * np.log10(slant) + 2 * loss * slant - area


def speckle(angle: Floats, level: Floats) -> Floats:
    """Level of each outer beam re the mean intensity of its 24 neighbours [dB]; empty where too few beams are.

    Args:
        angle: Angle of each beam from the vertical [deg], shape (beam,).
        level: Level of one of its samples [dB], shape (beam,).
    """
    intensity = 10 ** (level / 10)
    around = np.convolve(intensity, np.ones(NEIGHBOURS + 1), "same") - intensity
    count = np.convolve(np.ones(level.size), np.ones(NEIGHBOURS + 1), "same") - 1
    outer = (level - level_db(around / count))[(angle > OUTER[0]) & (angle < OUTER[1])]
    return outer if outer.size >= NEIGHBOURS else outer[:0]


def speckle_moments(contrasts: list[Floats]) -> Floats:
    """Standard deviation [dB] and skew of levels, and standard deviation over mean of intensities, shape (3,).

    Args:
        contrasts: Levels of each ping re their neighbours [dB].
    """
    level = np.concatenate(contrasts)
    intensity = 10 ** (level / 10)
    return np.array([level.std(ddof=1), skew(level), intensity.std(ddof=1) / intensity.mean()])


def speckle_table(real: list[Floats], simulated: list[Floats]) -> str:
    """Table of the speckle of all pings together; errors are those of bootstrapped beams.

    Args:
        real: Levels of each real ping re their neighbours [dB].
        simulated: The same of simulated ones.
    """
    rng = np.random.default_rng(1)
    rows = {"real": real, "simulated": simulated}
    cells, moments = [], {}
    for name, contrasts in rows.items():
        whole = np.concatenate(contrasts)
        error = np.std([speckle_moments([rng.choice(whole, whole.size)]) for _ in range(200)], axis=0)
        moments[name] = speckle_moments(contrasts)
        values = [f"{value:.2f} +- {e:.2f}" for value, e in zip(moments[name], error, strict=True)]
        cells.append([name, *values, f"{whole.size}"])
    cells.append(["difference", *(f"{x:+.2f}" for x in moments["simulated"] - moments["real"]), ""])
    cells.append(["Rayleigh", "5.57", "-1.14", "1", ""])
    header = ["speckle, 50 to 65 deg", "std of level [dB]", "skew of level", "std / mean of intensity", "beams"]
    return table(header, cells)


def _real_speckle(image: xr.Dataset, soundings: xr.Dataset, ping: int) -> Floats:
    """Speckle of the middle sample of each beam of the seabed image."""
    one, (_, angle) = image.isel(ping=ping), _angle(soundings, ping)
    level = middle_level(one)
    detected = (one["detection"].values == 0) & np.isfinite(level)
    return speckle(angle[detected], level[detected])


def middle_level(image: xr.Dataset) -> Floats:
    """Level of the sample at the detection of each beam [dB], shape (beam,).

    Args:
        image: One ping of a seabed image.
    """
    middle = np.clip(image["centre_sample"].values, 0, image.sizes["sample"] - 1)
    level = image["level"].values[np.arange(middle.size), middle].astype(float)
    return np.where(image["sample_count"].values > 0, level, np.nan)


def simulated_speckle(base: Scenario, frequency: float, sediment: str, seed: int, spacing: float) -> Floats:
    """Speckle of the sample at the centre of each simulated beam.

    Args:
        base: Scenario of the recording.
        frequency: Frequency [Hz].
        sediment: Sediment of the bed.
        seed: Seed of the random scatterers.
        spacing: Angle between beams [deg].
    """
    angles = np.arange(OUTER[0] - 12 * spacing, OUTER[1] + min(12 * spacing, 2.0), spacing)
    ping = simulate(
        _steered(base, frequency, sediment, angles).with_(
            {"field": "coherent", "seed": seed, "paths.scatterers_per_cell": 20}
        )
    )
    height = base.seabed.depth - base.track.position[2]  # type: ignore[union-attr]
    sample = np.searchsorted(ping["slant_range"].values, height / np.cos(np.radians(angles)))
    pressure = ping["pressure"].values[0, np.arange(angles.size), sample]
    return speckle(angles, level_db(np.abs(pressure.astype(complex)) ** 2))


def response_table(responses: list[Response], fitted: tuple[int, ...]) -> str:
    """Table of angular responses.

    Args:
        responses: Responses.
        fitted: Rows to which the sediment was fitted.
    """
    rows = []
    for row, response in enumerate(responses):
        known = np.isfinite(response.difference)
        within = np.abs(response.difference[known]) < 2
        rows.append([
            response.frequency + (" (fitted)" if row in fitted else ""),
            f"{ANGLES[known].min():.0f} to {ANGLES[known].max():.0f} deg",
            f"{np.sqrt(np.mean(response.difference[known] ** 2)):.1f}",
            f"{np.abs(response.difference[known]).max():.1f}",
            f"{within.sum()} of {known.sum()}", f"{np.nanmean(response.error):.1f}",
        ])  # fmt: skip
    header = ["sectors [kHz]", "angles", "rms difference [dB]", "largest [dB]", "angles within 2 dB",
              "standard error of the real mean [dB]"]  # fmt: skip
    return table(header, rows)


def section(results: AngularResults) -> Section:
    """Text and picture of the recording."""
    fits = ", ".join(f"{name} {rms:.1f} dB" for name, rms in results.misfit.items())
    text = f"""## Angular response of a flat bed: Kongsberg EM2042, 190 to 680 kHz

Backscatter re its mean over the angles of each ping. The sediment fitted is {results.sediment} (rms difference by
sediment: {fits}).

{response_table(results.responses, FITTED)}

Speckle is the level of the sample in the middle of each beam re the mean of its {NEIGHBOURS} neighbours; simulated
beams are half a degree apart.

{speckle_table(results.speckle, results.simulated_speckle)}"""
    return Section(
        text, draw(results.responses), "harbour-angular-response", "Backscatter by angle, real and simulated"
    )


def draw(responses: list[Response]) -> Figure:
    """Responses, real with their standard error, and simulated.

    Args:
        responses: Two, or up to six.
    """
    rows = 1 if len(responses) <= 3 else 2
    with style.plot_style():
        figure = style.new_figure(9.5, 2.75 * rows + 0.5)
        columns = -(-len(responses) // rows)
        panels = np.atleast_1d(figure.subplots(rows, columns, sharex=True, sharey=True))
        for axes, response in zip(panels.flat, responses, strict=False):
            axes.errorbar(ANGLES, response.real, response.error, color=style.INK, fmt="o", markersize=3, label="real")
            axes.plot(ANGLES, response.simulated, color=style.EXPECTED, linewidth=2, label="simulated")
            axes.set_title(response.frequency if "head" in response.frequency else response.frequency + " kHz")
            axes.set(ylim=(-10, 14))
        figure.axes[0].legend()
        figure.supxlabel("angle from the vertical [deg]", fontsize=10)
        figure.supylabel("backscatter re its mean [dB]", fontsize=10)
        return figure
