"""Speckle, shadow and highlight of a wreck in a sidescan image of 600 kHz, real and simulated.

The starboard image of an AUV that passes a wreck with a mast, 2.6 to 11 m above the bed. The recorder, of unknown gain,
keeps the peak of some five samples in each bin (`docs/explanation/noise-and-receivers.md`). Fitted are the gain, by
the mean level over range where no wreck is, the noise, by the shadow of the mast, which ends nowhere, and a texture of
the bed; predicted are distribution and correlation of the amplitudes, the hull's shadow and the highlights.
"""

import tempfile
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import skew

from insonify.formats.instruments import open_instrument
from insonify.plotting import style
from insonify.processing.recorder import record_series
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from insonify.sonar.recorder import Recorder
from insonify.studies.page import Section, table
from insonify.units import level_db

Floats = NDArray[np.float64]

FILE = "scotsman-iver2.xtf"
FULL_SCALE = 32767.0
"""Largest number of the recording [1]."""
SPACING, DEPTH = 0.119, 30.0
"""Distance between pings [m] and depth of the bed, out of reach of the surface [m]."""
TEXTURE = (1.2, 0.02)
"""Shape [1] and correlation length of the bed's texture [m], those of the homogeneous patches."""
HULL_HEIGHT, MAST = 1.0, (0.6, 7.0)
"""Height of the wreck's sides; width and height of its mast [m]."""
OUTLINE = ((180, 10.5), (215, 7.0), (262, 5.0), (318, 4.6), (362, 4.6), (366, 9.3), (310, 11.6), (262, 12.2),
           (215, 12.0), (180, 10.5))  # fmt: skip
"""Corners of the wreck: ping, and ground range [m]."""
MAST_AT = (366, 9.6)
"""Ping and ground range of the mast [m]."""
MAST_PINGS = slice(340, 400)
"""Pings among which the mast's shadow lies."""
CLEAN = (10, 150, 420)
"""Pings without wreck: from, to, and from."""
PATCH = (40, 120)
"""Pings and bins of a patch of homogeneous bed."""


WATER = (2.0, 0.8)
"""Water column: from a range [m] to a part of the altitude [1]."""
SHADOW = (18.0, 28.0)
"""Ranges of the mast's shadow [m]."""
BLOCK = (9, 25)
"""Pings and bins of the blocks whose least and greatest mean are taken."""


@dataclass(frozen=True, slots=True)
class SidescanResults:
    """Images and their numbers."""

    slant_range: Floats
    """Range of each bin [m], shape (bin,)."""
    images: tuple[Floats, Floats]
    """Real and simulated amplitude re full scale [1], shape (ping, bin)."""
    numbers: dict[str, tuple[float, float]]
    """Real and simulated value by name."""


def evaluate(folder: Path) -> SidescanResults:
    """Simulate the line, and measure both images in the same way."""
    with open_instrument(folder / FILE) as file:
        group = file.read("starboard").load()
    counts = group["amplitude"].values[1:].astype(float)  # the first ping has no navigation
    altitude = group["altitude"].values[1:].astype(float)
    step = float(group["sample_interval"].median()) * float(group["sound_speed"].median()) / 2
    slant = np.asarray(step * (np.arange(counts.shape[1]) + 0.5), float)
    with tempfile.TemporaryDirectory() as folder_name:
        scenario = _scenario(altitude, Path(folder_name), step * counts.shape[1])
        echoes = simulate(scenario)
        silent = scenario.with_({"water.noise_level_db": 0.0, "seabed.scattering": None, "targets": [],
                                 "seabed.texture": None})  # fmt: skip
        noise = simulate(silent)
    print(f"{echoes.sizes['ping']} pings of {echoes.sizes['time']} samples")
    fields = (echoes["pressure"].values[:, 0], noise["pressure"].values[:, 0])
    images = counts / FULL_SCALE, recorded(fields, echoes["time"].values, counts / FULL_SCALE, slant, altitude)
    real, ours = (numbers(image, slant, altitude) for image in images)
    return SidescanResults(slant, images, {name: (real[name], ours[name]) for name in real})


def recorded(fields: tuple[Floats, Floats], time: Floats, real: Floats, slant: Floats, altitude: Floats) -> Floats:
    """Simulated image behind the recorder, gain and noise fitted, re full scale [1], shape (ping, bin).

    Args:
        fields: Pressure of echoes, and of noise of any level [uPa], shape (ping, sample).
        time: Time of each sample [s], shape (sample,).
        real: Real image re full scale [1], shape (ping, bin).
        slant: Range of each bin [m], shape (bin,).
        altitude: Altitude of each ping [m], shape (ping,).
    """
    recorder = Recorder.model_validate({"stages": [{"kind": "decimation", "samples": slant.size, "keep": "peak"}]})
    echo, noise = (record_series(field, time, recorder)[0] for field in fields)
    gain = 10 ** (_gain_db(real, echo, slant, altitude) / 20)
    far = (slant > SHADOW[0]) & (slant < SHADOW[1])
    dark = np.convolve(real[:, far].mean(axis=1), np.ones(3) / 3, "same")[MAST_PINGS].min()
    factor = dark / np.mean((noise * gain)[:, far])
    whole = record_series(fields[0] + factor * fields[1], time, recorder)[0]
    return np.minimum(np.round(whole * gain * FULL_SCALE) / FULL_SCALE, 1.0)


def _gain_db(real: Floats, echo: Floats, slant: Floats, altitude: Floats) -> Floats:
    """Gain as a cubic of the logarithm of range, by the mean levels of bed without wreck [dB], shape (bin,)."""
    pings = np.arange(len(real))
    clean = ((pings >= CLEAN[0]) & (pings < CLEAN[1])) | (pings >= CLEAN[2])
    bed = clean[:, None] & (slant > 1.3 * altitude[:, None])
    known = bed.sum(axis=0) > 10
    levels = [level_db(np.sum(np.where(bed, image, 0.0) ** 2, axis=0)[known]) for image in (real, echo)]
    x = np.log10(slant)
    return np.asarray(np.polyval(np.polyfit(x[known], levels[0] - levels[1], 3), np.maximum(x, x[known].min())))


def _water(slant: Floats, altitude: Floats) -> NDArray[np.bool_]:
    return np.asarray((slant > WATER[0]) & (slant < WATER[1] * altitude[:, None]))


def numbers(image: Floats, slant: Floats, altitude: Floats) -> dict[str, float]:
    """Numbers of an image, levels by mean amplitude, as sidescan images are measured.

    Args:
        image: Amplitude re full scale [1], shape (ping, bin).
        slant: Range of each bin [m], shape (bin,).
        altitude: Altitude of each ping [m], shape (ping,).
    """
    patches = sorted((_patch(patch) for patch in _patches(image, slant, altitude)), key=lambda row: row[0])[:6]
    names = "std / mean", "skew", "std of ln A", "skew of ln A", "correlation across", "correlation along"
    statistics = dict(zip(names, np.mean(patches, axis=0), strict=True))
    far = (slant > SHADOW[0]) & (slant < SHADOW[1])
    profile = 20 * np.log10(np.maximum(image[:, far].mean(axis=1), 1e-6))
    at = MAST_PINGS.start + int(np.argmin(np.convolve(profile, np.ones(3) / 3, "same")[MAST_PINGS]))
    beside = np.r_[at - 22 : at - 12, at + 12 : at + 22]
    bottom = float(np.mean(profile[beside]))
    deep = profile[at - 10 : at + 11] - bottom
    statistics["shadow of the mast [dB re bed]"] = float(profile[at - 1 : at + 2].mean() - bottom)
    statistics["its width at half the depth in dB [m]"] = SPACING * float((deep < deep.min() / 2).sum())
    column = 20 * np.log10(image[_water(slant, altitude)].mean())
    statistics["water column [dB re full scale]"] = float(column)
    statistics["shadow of the mast [dB re water column]"] = float(profile[at - 1 : at + 2].mean() - column)
    wreck = image[170:385][:, (slant > 4.0) & (slant < 17.0)]
    blocks = np.lib.stride_tricks.sliding_window_view(wreck, BLOCK)[::3, ::5].mean(axis=(2, 3))
    bed = 20 * np.log10(image[10:150][:, (slant > 14) & (slant < 17)].mean())
    statistics["brightest block of the wreck [dB re bed]"] = float(20 * np.log10(blocks.max()) - bed)
    statistics["darkest block behind it [dB re bed]"] = float(20 * np.log10(blocks[:, 20:].min()) - bed)
    statistics["clipped in the wreck [%]"] = 100 * float((wreck >= 1).mean())
    last = image[-30:]
    for name, low, high in (("8 to 10 m", 8, 10), ("26 to 28 m", 26, 28)):
        rows = last[:, (slant > low) & (slant < high)]
        statistics[f"std / mean at {name}, altitude 3 m"] = float(rows.std() / rows.mean())
    return statistics


def _patches(image: Floats, slant: Floats, altitude: Floats) -> list[Floats]:
    """Patches of bed without wreck, the trend removed."""
    patches = []
    for ping in range(CLEAN[0], CLEAN[1] - PATCH[0] + 1, PATCH[0]):
        first = int(np.searchsorted(slant, 1.5 * altitude[ping : ping + PATCH[0]].max()))
        for at in range(first, slant.size - PATCH[1] + 1, PATCH[1]):
            patches.append(image[ping : ping + PATCH[0], at : at + PATCH[1]])
    return patches


def _patch(amplitude: Floats) -> tuple[float, ...]:
    """Moments and correlations of a patch, divided by a quadratic trend."""
    y, x = (axis.ravel() / size - 0.5 for axis, size in zip(np.indices(amplitude.shape), amplitude.shape, strict=True))
    design = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    trend = design @ np.linalg.lstsq(design, amplitude.ravel(), rcond=None)[0]
    flat = amplitude / trend.reshape(amplitude.shape)
    log = np.log(np.maximum(flat, 1e-3))
    centred = flat - flat.mean()
    power = np.mean(centred**2)
    across, along = np.mean(centred[:, 1:] * centred[:, :-1]), np.mean(centred[1:] * centred[:-1])
    spread, skews = flat.std() / flat.mean(), [skew(part, axis=None) for part in (flat, log)]
    return tuple(float(one) for one in (spread, skews[0], log.std(), skews[1], across / power, along / power))


def _scenario(altitude: Floats, folder: Path, farthest: float) -> Scenario:
    """Scenario of a straight line with the altitudes of the recording."""
    along = SPACING * np.arange(altitude.size)
    rows = [
        f"{0.1135 * k:.4f},{x:.4f},0,{DEPTH - a:.4f},0" for k, (x, a) in enumerate(zip(along, altitude, strict=True))
    ]
    log = folder / "line.csv"
    log.write_text("time [s],north [m],east [m],depth [m],heading [deg]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    text = f"""
seed: 1
seabed: {{depth: {DEPTH} m, scattering: {{law: lambert, strength_db: -20}}, reflection: 0.3,
  texture: {{k_shape: {TEXTURE[0]}, correlation_length: {TEXTURE[1]} m}}}}
surface: {{scattering: null}}
water: {{sound_speed: 1500 m/s, noise_level_db: null}}
sonar:
  source_level_db: 210
  pulse: {{kind: cw, frequency: 600 kHz, duration: 9.8 us}}
  receiver: {{bandwidth: 220 kHz}}
  transmit: {{kind: planar, width: 0.317 m, height: 2.6 mm}}
  receive: {{kind: planar, width: 0.317 m, height: 2.6 mm}}
  mounting: {{bearing: 90 deg, tilt: 20 deg}}
track: {{kind: navigation, file: {log}, interval: 0.1135 s, window: [0 ms, {2e3 * farthest / 1500:.3f} ms]}}
paths: {{max_reflections: 0, contributions: [seabed, target]}}
"""
    return parse_model(Scenario, text).with_("targets", _wreck())


def _wreck() -> list[dict[str, object]]:
    """Sides of the hull as planks, and a mast."""
    corners = np.array([(SPACING * ping, ground_range) for ping, ground_range in OUTLINE])
    bodies: list[dict[str, object]] = []
    for row, (first, second) in enumerate(pairwise(corners)):
        middle, across = (first + second) / 2, second - first
        bodies.append({"shape": "box", "label": f"side {row}", "position": middle.tolist(),
                        "heading": float(np.arctan2(across[1], across[0])),
                       "size": [float(np.hypot(*across)), 0.3, HULL_HEIGHT]})  # fmt: skip
    position, size = [SPACING * MAST_AT[0], MAST_AT[1]], [MAST[0], MAST[0], MAST[1]]
    return [*bodies, {"shape": "box", "label": "mast", "position": position, "size": size}]


def section(results: SidescanResults) -> Section:
    """Text and picture of the recording."""
    rows = [
        [name, f"{real:.2f}", f"{ours:.2f}", f"{ours - real:+.2f}"] for name, (real, ours) in results.numbers.items()
    ]
    text = f"""## A wreck in a sidescan image, 600 kHz

Starboard, 460 pings. Fitted: gain over range where no wreck is, noise by the mast's shadow, and shape and length of the
bed's texture, {TEXTURE[0]:g} and {100 * TEXTURE[1]:g} cm. The wreck is of nine planks, {HULL_HEIGHT:g} m high, and a
square mast, where the image shows them. The first six rows are means of the six least variable patches of
{PATCH[0]} pings by {PATCH[1]} bins.

{table(["", "real", "simulated", "difference"], rows)}"""
    return Section(text, draw(results), "sidescan-wreck", "Sidescan images of a wreck, real and simulated")


def draw(results: SidescanResults) -> Figure:
    """Both images on one scale."""
    with style.plot_style():
        figure = style.new_figure(9.5, 8.0)
        panels = figure.subplots(2, 1, sharex=True, sharey=True)
        step = results.slant_range[1] - results.slant_range[0]
        length = SPACING * len(results.images[0])
        for axes, image, name in zip(panels, results.images, ("real", "simulated"), strict=True):
            level = 20 * np.log10(np.maximum(image, 1e-6)).T
            shown = axes.imshow(level, aspect="auto", cmap="gray", vmin=-50, vmax=0, interpolation="antialiased",
                                extent=(0, length, results.slant_range[-1] + step / 2, 0))  # fmt: skip
            axes.set(title=name, ylabel="slant range [m]")
            axes.grid(False)
        panels[-1].set_xlabel("distance along the track [m]")
        figure.colorbar(shown, ax=panels, label="amplitude [dB re full scale]", shrink=0.6)
        return figure
