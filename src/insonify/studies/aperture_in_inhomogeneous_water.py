"""Synthetic aperture in inhomogeneous water: loss and width of a focused point, simulated and by theory.

The sonar of the demonstration, on a longer track, focuses a point 75 m away. Patches of warmer and colder water change
the travel times at random; the expected loss follows from the covariance of phases over the aperture, without the
engine's random field.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.demos.products import synthetic_aperture as strip
from insonify.demos.products.forward_looking import compressed
from insonify.demos.products.peaks import width
from insonify.plotting import style
from insonify.plotting.strip_map import PointResponse
from insonify.processing.recorded_geometry import recorded_element_positions
from insonify.scenario.scenario import Scenario
from insonify.scenario.template import load_template
from insonify.simulator import simulate
from insonify.studies.page import Section, table
from insonify.units import level_db

Floats = NDArray[np.float64]

RANGE, PINGS, SPACING = 75.0, 60, 0.4
"""Ground range of the point [m], number of pings, and their spacing [m]."""
POINTS_PER_LENGTH = 4
"""Points of a ray in a correlation length: covariances are within 0.2 % where the rays share their ends alone."""
LENGTHS, INDICES = (0.5, 2.0, 8.0), (3e-5, 1e-4, 3e-4)
"""Correlation lengths [m] and rms relative changes of sound speed [1]."""


@dataclass(frozen=True, slots=True)
class FocusResults:
    """Focused points by correlation length and rms index, shape (length, index, draw) each."""

    loss: Floats
    """Level at the true position re homogeneous water [dB]."""
    peak_loss: Floats
    """Level of the brightest pixel re homogeneous water [dB]."""
    width: Floats
    """Width at -3 dB along the track [m]."""
    theory: Floats
    """Expected level at the true position re homogeneous water [dB], shape (length, index)."""
    cuts: Floats
    """Level along the track of the first draw of each length at the largest index [dB], shape (length, pixel)."""
    along: Floats
    """Offsets along the track [m], shape (pixel,)."""
    unchanged: Floats
    """Level along the track in homogeneous water [dB], shape (pixel,)."""


def scenario(index: float, length: float, seed: int) -> Scenario:
    """The demonstration's sonar and one point, in inhomogeneous water.

    Args:
        index: Rms relative change of sound speed [1]; 0 for homogeneous water.
        length: Correlation length [m].
        seed: Seed of the draw.
    """
    values: dict[str, Any] = load_template("synthetic-aperture").model_dump(mode="json")
    values["targets"] = [
        {"shape": "point", "position": [0.0, RANGE, 15.9], "target_strength_db": -15, "label": "point"}
    ]
    values["paths"]["contributions"] = ["target"]
    values["water"]["noise_level_db"] = None
    values["water"]["inhomogeneity"] = {"rms_index": index, "correlation_length": length} if index else None
    values["seabed"]["relief"] = None
    start = [-(PINGS - 1) / 2 * SPACING, 0.0, 10.0]
    values["track"] |= {"start": start, "pings": PINGS, "window": [0.099, 0.106]}
    values["sonar"]["receiver"]["synthetic_aperture"] = 14.0
    return Scenario.model_validate(values | {"seed": seed})


def _response(index: float, length: float, seed: int) -> PointResponse:
    given = scenario(index, length, seed)
    recording = simulate(given)
    frame = strip.StripFrame.of(recording, given)
    return strip.response(compressed(recording, given), given, frame, given.targets[0])  # type: ignore[arg-type]


def evaluate(draws: int, lengths: tuple[float, ...] = LENGTHS, indices: tuple[float, ...] = INDICES) -> FocusResults:
    """Simulate and focus every correlation length and index.

    Args:
        draws: Number of random waters of each.
        lengths: Correlation lengths [m].
        indices: Rms relative changes of sound speed [1].
    """
    still = _response(0.0, 1.0, 1)
    middle = len(still.off) // 2
    true = still.peak_db + still.level[middle, middle]
    shape = len(lengths), len(indices), draws
    loss, peak, widths = np.empty(shape), np.empty(shape), np.empty(shape)
    cuts = np.empty((len(lengths), len(still.off)))
    for i, j, seed in np.ndindex(*shape):
        point = _response(indices[j], lengths[i], seed + 1)
        row, column = point.top
        loss[i, j, seed] = point.peak_db + point.level[middle, middle] - true
        peak[i, j, seed] = point.peak_db - still.peak_db
        widths[i, j, seed] = width(point.off, point.level[:, column], row)
        if seed == 0:
            cuts[i] = point.level[:, column] + point.peak_db - still.peak_db
    theory = np.array([[expected_loss_db(index, length) for index in indices] for length in lengths])
    return FocusResults(loss, peak, widths, theory, cuts, still.off, still.level[:, still.top[1]])


def expected_loss_db(index: float, length: float) -> float:
    """Expected level of a focused point at its true position re homogeneous water [dB].

    The sum over pairs of echoes of their weights and of exp(-D / 2), with D the variance of the difference of their
    two-way phases. The covariance of two rays that meet at the point is the double integral along both of
    exp(-d^2 / l^2), d the distance of their points.

    Args:
        index: Rms relative change of sound speed [1].
        length: Correlation length l [m].
    """
    transmit, receive, weight = _aperture()
    covariance = _covariance(index, length)
    ends = np.concatenate([transmit, receive])
    of_pairs = np.interp(np.abs(ends[:, None] - ends[None, :]), *covariance)
    n = len(transmit)
    two_way = of_pairs[:n, :n] + of_pairs[n:, n:] + of_pairs[:n, n:] + of_pairs[n:, :n]
    variance = np.diag(two_way)
    difference = variance[:, None] + variance[None, :] - 2 * two_way
    return float(level_db(weight @ np.exp(-difference / 2) @ weight / weight.sum() ** 2))


@lru_cache(maxsize=1)
def _aperture() -> tuple[Floats, Floats, Floats]:
    """Along-track positions of transmitter and element of each echo that is focused [m], and their weights [1]."""
    given = scenario(0.0, 1.0, 1)
    few = given.with_("track.pings", 2)
    elements = recorded_element_positions(simulate(few))[:, 0]
    pings = (np.arange(PINGS) - (PINGS - 1) / 2) * SPACING
    speed, widest = given.water.sound_speed, strip.half_angle(given)
    wavelength = speed / given.sonar.pulse.frequency
    transmit = np.repeat(pings, len(elements))
    receive = transmit + np.tile(elements, PINGS)
    sine = [np.sin(np.arctan2(end, RANGE)) for end in (transmit, receive)]
    weight = np.prod([np.sinc(a * s / wavelength) for a, s in zip(strip.lengths(given), sine, strict=True)], axis=0)
    inside = np.abs(np.arctan2((transmit + receive) / 2, RANGE)) < widest
    return transmit[inside], receive[inside], weight[inside]


def _covariance(index: float, length: float) -> tuple[Floats, Floats]:
    """Distances along the track [m], and covariances of the one-way phases of two rays to the point [rad^2]."""
    given = scenario(0.0, 1.0, 1)
    wavenumber = 2 * np.pi * given.sonar.pulse.frequency / given.water.sound_speed
    distance, integral = _shared_path(length)
    return distance, (wavenumber * index) ** 2 * integral


@lru_cache(maxsize=8)
def _shared_path(length: float) -> tuple[Floats, Floats]:
    """Distances along the track [m], and the double integral of exp(-d^2 / length^2) along two rays [m^2]."""
    path = float(np.hypot(RANGE, 5.9))
    points = int(np.ceil(POINTS_PER_LENGTH * path / length))
    along = (np.arange(points) + 0.5) * path / points
    distance = np.linspace(0, PINGS * SPACING, 241)
    mean = 1 - (along[:, None] + along[None, :]) / (2 * path)
    lag = (along[:, None] - along[None, :]) ** 2
    step = (path / points) ** 2
    return distance, np.array([np.exp(-(lag + (d * mean) ** 2) / length**2).sum() * step for d in distance])


def section(results: FocusResults) -> Section:
    """Text and picture of the question."""
    rows = []
    for i, length in enumerate(LENGTHS):
        for j, index in enumerate(INDICES):
            mean, peak = (float(level_db(np.mean(10 ** (x[i, j] / 10)))) for x in (results.loss, results.peak_loss))
            rows.append([f"{length:g} m", f"{index:.0e} ({index * 1500:.2g} m/s)", f"{results.theory[i, j]:.1f} dB",
                         f"{mean:.1f} dB", f"{peak:.1f} dB",
                         f"{np.median(results.width[i, j]) * 100:.1f} cm"])  # fmt: skip
    header = ["patches", "rms change of sound speed", "loss by theory", "loss", "loss of the brightest pixel", "width"]
    text = f"""## What does inhomogeneous water cost a synthetic aperture?

A point 75 m away is focused over {strip.aperture(scenario(0.0, 1.0, 1), RANGE):.0f} m of track at 100 kHz, through
patches of water that do not change while the sonar passes; {results.loss.shape[2]} draws of each. In homogeneous water
the point is {width(results.along, results.unchanged, int(np.argmax(results.unchanged))) * 100:.1f} cm wide. Theory is
the expected level at the true position, from the covariance of the phases.

{table(header, rows)}

A change of 0.05 m/s (3e-5, or 0.015 degC) costs next to nothing. At 0.15 m/s the loss depends on the size of the
patches: small ones scatter energy into side lobes, large ones tilt and bend the wavefront, which moves the point and
widens it while the brightest pixel loses little. Autofocus can undo the second and not the first. The model has
straight rays: it holds while the wavelength is short re the patches and the Fresnel zone is smaller than they are."""
    return Section(
        text, draw(results), "aperture-in-inhomogeneous-water", "Loss of a focused point, and cuts through it"
    )


def draw(results: FocusResults) -> Figure:
    """Loss over the rms index with theory, and cuts along the track."""
    colours = ("#D5350E", "#1E8FD5", "#009E73")
    with style.plot_style():
        figure = style.new_figure(9.5, 4.2)
        loss, cut = figure.subplots(1, 2)
        for i, (length, colour) in enumerate(zip(LENGTHS, colours, strict=True)):
            x, mean = np.array(INDICES) * 1500, level_db(np.mean(10 ** (results.loss[i] / 10), axis=1))
            loss.plot(x, results.theory[i], color=colour, label=f"patches of {length:g} m: theory")
            loss.plot(x, mean, "o", color=colour, label="simulated, at the true position")
            loss.plot(x, level_db(np.mean(10 ** (results.peak_loss[i] / 10), axis=1)), "x", color=colour,
                      label="brightest pixel")  # fmt: skip
            cut.plot(results.along * 100, results.cuts[i], color=colour, label=f"patches of {length:g} m", linewidth=1)
        cut.plot(results.along * 100, results.unchanged, color=style.INK, label="homogeneous water", linewidth=1)
        loss.set(xlabel="rms change of sound speed [m/s]", ylabel="level re homogeneous water [dB]", xlim=(0, None))
        cut.set(xlabel="along the track [cm]", ylabel="level re homogeneous water [dB]", ylim=(-40, 2), xlim=(-40, 40))
        loss.set_title("a focused point loses")
        cut.set_title(f"one draw at {INDICES[-1] * 1500:.2g} m/s")
        loss.legend(fontsize=7)
        cut.legend(fontsize=8)
        return figure
