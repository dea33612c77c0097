"""Echo trains of an echosounder in a harbour: bottom echo and its multiples off the hull, real and simulated.

A Simrad EK80 on a moored research vessel, 5.8 m above the bed of the port of Zeebrugge, at 38 to 333 kHz; second and
third bottom echo go by the ship's hull. Levels are apparent reflection losses: the energy in a gate about n times the
first range, over that of a perfect mirror at that range, absorption undone. One sediment and one reflection
coefficient of the hull are fitted at 200 kHz; the other frequencies are predicted. Ranges are those of leading edges,
at half the amplitude of an echo's peak. A ping in which other sounds stand between the echoes is left out.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.formats.instruments import open_instrument
from insonify.formats.instruments.scenario_text import scenario_text
from insonify.formats.instruments.scenario_values import leading_edge
from insonify.ocean.absorption import absorption_db_per_m
from insonify.plotting import style
from insonify.processing.split_beam import echosounder_levels
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.studies.harbour_angular_response import SEDIMENTS
from insonify.studies.page import Section, table
from insonify.units import level_db

Floats = NDArray[np.float64]

FILE = "ek80-zeebrugge-38-70-120-200-333khz.raw"
GROUPS = ("38 kHz", "70 kHz", "120 kHz", "200 kHz", "333 kHz")
FITTED = "200 kHz"
"""Group at which grain size and hull are fitted."""
ECHOES = 3
"""Echoes of the train."""
SOUND_SPEED = 1502.0
"""Sound speed that the recording states [m/s]."""
GATE = (-0.4, 0.9)
"""Gate about n times the first range [m]."""
DRAWS = 12
"""Random seabeds for the spread of single pings [1]."""
WINDOW = 4.0
"""End of the simulated window re the first range [1]."""
INTERFERENCE = 6.0
"""Level between the echoes above that of the other ping, from which a ping is left out [dB]."""


@dataclass(frozen=True, slots=True)
class Train:
    """Apparent levels of the echoes of one group."""

    group: str
    real: Floats
    """Each ping [dB], shape (ping, echo)."""
    simulated: Floats
    """Expected [dB], shape (echo,)."""
    late: Floats
    """Range of the leading edge of each real echo less n times the first's [m], shape (ping, echo)."""
    limited: bool
    """True where the receiver clips the first echo: it stays at its largest value for longer than the pulse."""
    profile: tuple[Floats, Floats, Floats]
    """Range [m], real level of the last ping used and expected level [dB]."""


@dataclass(frozen=True, slots=True)
class TrainResults:
    """Echo trains of all groups, and the fit."""

    trains: list[Train]
    sediment: str
    """Fitted sediment."""
    hull_db: float
    """Fitted level that the hull returns at each reflection [dB]."""
    misfit: dict[str, float]
    """Rms difference of the three echoes at the fitted frequency by sediment [dB]."""
    drawn: Floats
    """Levels of single simulated pings at the fitted frequency [dB], shape (draw, echo)."""
    drawn_late: Floats
    """Range of the leading edges of their echoes less n times the first's [m], shape (draw, echo)."""
    smooth_late: Floats
    """The same of a bed with a smooth interface, shape (echo,)."""

    @property
    def spread(self) -> Floats:
        """Standard deviation of the levels of single simulated pings, and of second and third re first [dB], (5,)."""
        relative = self.drawn[:, 1:] - self.drawn[:, :1]
        return np.std(np.hstack([self.drawn, relative]), axis=0, ddof=1)


def evaluate(folder: Path, groups: tuple[str, ...] = GROUPS) -> TrainResults:
    """Fit at one frequency, and predict the others.

    Args:
        folder: Folder of the recording.
        groups: Groups to predict; the fitted one among them.
    """
    path = folder / FILE
    misfit, best, bounces = {}, (np.inf, SEDIMENTS[0], 0.0), np.arange(ECHOES)
    measured = _real(path, FITTED)[0].mean(axis=0)
    for sediment in SEDIMENTS:
        excess = measured - _levels(_scenario(path, FITTED, sediment))[0]
        hull_db = float(np.clip(np.polyfit(bounces, excess, 1)[0], -40, 0))
        misfit[sediment] = float(np.sqrt(np.mean((excess - bounces * hull_db) ** 2)))
        best = min(best, (misfit[sediment], sediment, hull_db))
        print(f"{sediment}: {misfit[sediment]:.1f} dB rms, hull {hull_db:.1f} dB")
    _, sediment, hull_db = best
    trains = []
    for group in groups:
        levels, lags, limited, profile = _real(path, group)
        scenario = _scenario(path, group, sediment, 10 ** (hull_db / 20))
        expected, _, curve = _levels(scenario)
        level = np.interp(profile[0], *curve, left=np.nan, right=np.nan)
        trains.append(Train(group, levels, expected, lags, limited, (profile[0], profile[1], level)))
        print(f"{group}: real {levels.mean(axis=0).round(1)}, simulated {expected.round(1)}")
    drawn = _scenario(path, FITTED, sediment, 10 ** (hull_db / 20)).with_("field", "coherent")
    pings = [_levels(drawn.with_("seed", seed + 1))[:2] for seed in range(DRAWS)]
    smooth = _levels(drawn.with_({"seabed.reflecting_interface": "smooth", "seabed.scattering": None}))[1]
    levels, lags = (np.array(rows) for rows in zip(*pings, strict=True))
    return TrainResults(trains, sediment, hull_db, misfit, levels, lags, smooth)


def _scenario(path: Path, group: str, sediment: str, hull: float = 1.0) -> Scenario:
    """Scenario of a group, with a sediment and a ship's hull, out to the third echo."""
    with open_instrument(path) as file:
        scenario = parse_model(Scenario, scenario_text(file, "harbour", group))
    first = scenario.seabed.depth - scenario.track.position[2]  # type: ignore[union-attr]
    return scenario.with_({
        "seabed.scattering": {"sediment": sediment}, "seabed.reflection": sediment, "water.noise_level_db": None,
        "seabed.reflecting_interface": "rough", "field": "incoherent", "paths.max_reflections": 5,
        "sonar.hull": {"length": "30 m", "width": "8 m", "reflection": round(hull, 4)},
        "track.window": [0.0, 2 * WINDOW * first / SOUND_SPEED],
    })  # fmt: skip


def _real(path: Path, group: str) -> tuple[Floats, Floats, bool, tuple[Floats, Floats]]:
    """Levels and lateness of the echoes of each ping, whether the first is clipped, and the profile of one ping."""
    with open_instrument(path) as file:
        pings = file.read(group)
        strengths = echosounder_levels(pings)
    apparent = strengths["point_scattering_strength"].values
    slant = strengths["range"].values[0]
    edge = slant[0] + (slant[1] - slant[0]) * leading_edge(np.abs(pings["voltage"].values.mean(axis=(0, 1)))[slant < 1])
    slant = slant - edge
    level = apparent - 20 * np.log10(np.maximum(slant, 1e-3) / 2)
    far = slant > 2.0
    first = slant[far][np.nanargmax(np.nanmean(level[:, far], axis=0))]
    level = level[without_interference(slant, level, first)]
    near = np.abs(pings["voltage"].values[:, :, np.abs(slant - first) < 1.0])
    plateau = np.mean(np.sum(near > 0.95 * near.max(axis=-1, keepdims=True), axis=-1)) * (slant[1] - slant[0])
    limited = bool(plateau > float(pings["pulse_length"].median()) * SOUND_SPEED / 2)
    rows = [_train(slant, row, first) for row in level]
    levels, lags = (np.array(part) for part in zip(*rows, strict=True))
    return levels, lags, limited, (slant, level[-1])


def without_interference(slant: Floats, level: Floats, first: float) -> NDArray[np.bool_]:
    """Mask of the pings without strong sounds between second and third echo.

    Args:
        slant: Range [m], shape (sample,).
        level: Level of each ping [dB], shape (ping, sample).
        first: Range of the first echo [m].
    """
    between = (slant > 2.3 * first) & (slant < 2.9 * first)
    quiet = level_db(np.nanmean(10 ** (level[:, between] / 10), axis=1))
    return np.asarray(quiet < quiet.min() + INTERFERENCE)


def _levels(scenario: Scenario) -> tuple[Floats, Floats, tuple[Floats, Floats]]:
    """Apparent levels and lateness of the echoes of a scenario's ping, shape (echo,); ranges [m] and levels [dB]."""
    slant, level = _apparent(simulate(scenario), scenario)
    first = scenario.seabed.depth - scenario.track.position[2]  # type: ignore[union-attr]
    return *_train(slant, level, first), (slant, level)


def _train(slant: Floats, level: Floats, first: float) -> tuple[Floats, Floats]:
    """Levels of the echoes [dB], and range of their leading edges less n times the first's [m], shape (echo,) each."""
    echoes: list[float] = []
    edges: list[float] = []
    for n in range(1, ECHOES + 1):
        centre = n * (edges[0] if edges else first)
        echoes.append(_gated(slant, level, centre))
        gate = (slant > centre + (2 * GATE[0] if n == 1 else GATE[0])) & (slant < centre + GATE[1])
        rows = np.flatnonzero(gate)
        edge = rows[0] + leading_edge(10 ** (level[gate] / 20))
        edges.append(float(np.interp(edge, np.arange(slant.size), slant)))
    return np.array(echoes), np.array(edges) - edges[0] * np.arange(1, ECHOES + 1)


def _apparent(ping: xr.Dataset, scenario: Scenario) -> tuple[Floats, Floats]:
    """Range [m] and apparent reflection level of a simulated ping [dB]."""
    water, frequency = scenario.water, scenario.sonar.pulse.frequency
    coherent = "pressure" in ping
    sound = ping["pressure" if coherent else "intensity"].values.reshape(-1, ping.sizes["time"])[0]
    intensity = np.abs(sound).astype(float) ** 2 if coherent else sound.astype(float)
    slant = ping["slant_range"].values
    loss = float(absorption_db_per_m(frequency, temperature=water.temperature, salinity=water.salinity, ph=water.ph,
                                     depth=scenario.seabed.depth / 2))  # fmt: skip
    level = level_db(np.maximum(intensity, 1e-30)) - scenario.sonar.source_level_db
    return slant, level + 20 * np.log10(np.maximum(2 * slant, 1e-3)) + 2 * loss * slant


def _gated(slant: Floats, level: Floats, centre: float) -> float:
    """Level of the energy in the gate about a range [dB]: the mean times the gate's length over one metre."""
    inside = (slant > centre + GATE[0]) & (slant < centre + GATE[1]) & np.isfinite(level)
    return float(level_db(np.mean(10 ** (level[inside] / 10)) * (GATE[1] - GATE[0])))


def section(study: TrainResults) -> Section:
    """Text and picture of the recording."""
    rows, needed = [], []
    for train in study.trains:
        real, simulated = train.real.mean(axis=0), train.simulated
        cells = [f"{train.group}{' (clipped)' if train.limited else ''}, {len(train.real)}"]
        cells += [f"{r:.1f} / {s:.1f} / {s - r:+.1f}" for r, s in zip(real, simulated, strict=True)]
        relative = (simulated[1:] - simulated[0]) - (real[1:] - real[0])
        behind = ", ".join(f"{100 * x:+.1f}" for x in train.late.mean(axis=0)[1:])
        rows.append([*cells, ", ".join(f"{x:+.1f}" for x in relative), behind])
        loss = np.polyfit(np.arange(ECHOES), real - simulated, 1)[0] + study.hull_db
        needed.append(f"{loss:+.1f} dB at {train.group}")
    fits = ", ".join(f"{name} {rms:.1f} dB" for name, rms in study.misfit.items())
    level = ", ".join(f"{s:.1f}" for s in study.spread)
    lags, smooth = study.drawn_late[:, 1:] * 100, study.smooth_late[1:] * 100
    first = [t.real.mean(axis=0)[0] for t in study.trains if not t.limited]
    text = f"""## Multiples of a harbour's bottom echo: Simrad EK80, 38 to 333 kHz

Five split-beam transducers, 5.75 m above the bed. Apparent reflection levels of first, second and third
echo [dB], real / simulated / difference. Fitted at {FITTED}: {study.sediment} and a hull that returns
{study.hull_db:.1f} dB at each reflection (rms difference by sediment: {fits}). Late: leading edge less n times that of
the first echo.

{table(["channel, pings", "first echo", "second", "third", "2nd, 3rd re first", "2nd, 3rd late [cm]"], rows)}

Single simulated pings at {FITTED} scatter by {level} dB (first, second, third, second re first, third re first;
{DRAWS} draws), so differences re the first echo have a standard error of about {study.spread[3]:.0f} dB.

*Delays.* Simulated second and third echoes at {FITTED} are {lags[:, 0].mean():.0f} +- {lags[:, 0].std(ddof=1):.0f} cm
and {lags[:, 1].mean():.0f} +- {lags[:, 1].std(ddof=1):.0f} cm late in single pings by the same definition, and
{smooth[0]:.1f} and {smooth[1]:.1f} cm over a bed that mirrors smoothly. The rough bed makes the third echo late: its
middle reflection needs not lie in the beam, and a reflection 2 to 3 m to the side, by slopes of some degrees, comes
0.2 to 0.4 m later; what is left in the specular direction is weaker than that.

*Hull.* The loss at each reflection that would fit second and third echo best is {", ".join(needed)}. It neither rises
nor falls with frequency. A rough hull (Eckart 1953: loss in dB as the square of frequency) that is fitted at {FITTED}
would return {study.hull_db * (38 / 200) ** 2:.2f} dB at 38 kHz and {study.hull_db * (333 / 200) ** 2:.1f} dB at 333
kHz: that changes no third echo by more than {2 * abs(study.hull_db) * ((333 / 200) ** 2 - 1):.1f} dB, and mends none.

*First echo.* The four first echoes that are not clipped lie within {max(first) - min(first):.1f} dB of one another; the
simulated ones fall by {_fall(study):.1f} dB, and scatter by {study.spread[0]:.1f} dB where Rayleigh's distribution has
5.6. The real bed reflects more steadily: roughness at scales of millimetres that the spectrum of the handbook, which
holds to 100 kHz, extrapolates, is not there.
{_clipped(study)}"""
    return Section(text, draw(study), "harbour-echo-trains", "Echo trains, real and simulated, at five frequencies")


def _fall(results: TrainResults) -> float:
    """Fall of the simulated first echo from the first to the last channel that is not clipped [dB]."""
    kept = [train.simulated[0] for train in results.trains if not train.limited]
    return float(kept[0] - kept[-1])


def _clipped(results: TrainResults) -> str:
    names = [train.group for train in results.trains if train.limited]
    if not names:
        return ""
    return (f"The receiver clips the first echo of {' and '.join(names)}: their first level is a lower bound, and "
            "levels re the first mean little there.")  # fmt: skip


def draw(results: TrainResults) -> Figure:
    """Level over range of each channel, real and simulated."""
    with style.plot_style():
        figure = style.new_figure(9.5, 2.2 * len(results.trains))
        panels = np.atleast_1d(figure.subplots(len(results.trains), 1, sharex=True))
        for axes, train in zip(panels, results.trains, strict=True):
            slant, real, simulated = train.profile
            axes.plot(slant, real, color=style.INK, linewidth=0.8, label="real, one ping")
            axes.plot(slant, simulated, color=style.EXPECTED, linewidth=1.6, label="simulated, expected intensity")
            axes.set(xlim=(2, 23), ylim=(-110, -15), ylabel="apparent\nreflection [dB]")
            axes.set_title(train.group + (", first echo clipped" if train.limited else ""))
        panels[0].legend(ncols=2)
        panels[-1].set_xlabel("range [m]")
        return figure
