"""Sector image of a forward-looking sonar, and its beams at targets of known position."""

from dataclasses import replace

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.demos.products.peaks import parabolic_peak_position, width
from insonify.paper.checked_numbers import CheckedNumber
from insonify.plotting.recording_levels import RecordingLevels
from insonify.plotting.sector_view import BeamCut, sector_view
from insonify.plotting.target_view import TargetView, targets_in_view
from insonify.processing import compressed_recording, decimated_recording, recorded_level
from insonify.processing.beamforming import beamform_delay_sum
from insonify.scenario.scenario import Scenario
from insonify.scene.target import PointTarget
from insonify.sonar.aperture import pattern, shading_weight
from insonify.sonar.beam import beams
from insonify.sonar.hydrophones import element_layout, single_element
from insonify.units import level_db

Floats = NDArray[np.float64]

FIELD_DB = -6.0
"""Two-way level of transmitter and elements, re their maximum, down to which bearings are drawn [dB]."""
WIDEST = np.radians(80)
"""Largest bearing of a beam from boresight [rad]."""
BEAMS_IN_A_WIDTH = 4
"""Number of beams within a beam width [1]."""
SHADING = "hamming"
SHOWN = 600
"""Samples of range in the figure, averaged as energy [1]."""
ABOUT = np.radians(15)
"""Half width of the cut over bearing through a point [rad]."""
ALONE = 1.0
"""Half length of the search window for a point's echo in range [m]."""


def forward_looking(recording: xr.Dataset, scenario: Scenario, ping: int | None) -> tuple[Figure, list[CheckedNumber]]:
    """Draw the sector image of one ping, and compute its numbers.

    Args:
        recording: Complete recording of elements.
        scenario: Scenario of the recording.
        ping: Number of the ping; None: the first.
    """
    number = int(recording["ping"].values[0]) if ping is None else ping
    short = compressed(recording.sel(ping=[number]), scenario)
    bearings = recorded_bearings(scenario)
    fan = beams_of(short, scenario, bearings)
    seen = targets_in_view(scenario, number)
    numbers: list[CheckedNumber] = []
    cuts: list[BeamCut] = []
    farthest = (fan.time[-1] - scenario.sonar.pulse.duration) * fan.sound_speed / 2
    for target, position in zip(scenario.targets, seen, strict=True):
        if not bearings[0] <= position.bearing <= bearings[-1] or position.slant + position.half_extent > farthest:
            continue
        if isinstance(target, PointTarget):
            cuts.append(cut_through(short, scenario, position))
            numbers += point_numbers(cuts[-1], position)
        else:
            numbers += body_numbers(fan, position)
    sonar = scenario.sonar
    title = (f"{scenario.title}: {sonar.beam_count} elements, {sonar.pulse.frequency / 1e3:g} kHz, "
             f"{len(bearings)} beams {np.degrees(beam_width(scenario)):.1f}° wide")  # fmt: skip
    return sector_view(fewer(fan), seen, cuts[:1], title), numbers


def recorded_bearings(scenario: Scenario) -> Floats:
    """Bearings of the beams that are drawn: those that the scenario steers, or the whole field of view.

    Returns:
        Bearings to the right of boresight, increasing [rad], shape (beams,).
    """
    steer = getattr(scenario.sonar.receive, "steer", None)
    if steer is not None and len(steer) > 1:
        return np.unique(np.asarray(steer, float))
    step = beam_width(scenario) / BEAMS_IN_A_WIDTH
    first, last = field_of_view(scenario)
    return np.asarray(step * np.arange(np.ceil(first / step), np.floor(last / step) + 1), float)


def field_of_view(scenario: Scenario) -> tuple[float, float]:
    """Bearings between which transmitter and elements are at most `FIELD_DB` below their maximum [rad]."""
    sonar, speed = scenario.sonar, scenario.water.sound_speed
    bearing = np.linspace(-WIDEST, WIDEST, 1601)
    transmit = beams(sonar.beam_arrays[0], sonar.pulse.frequency, speed)
    receive = beams(single_element(sonar.receive), sonar.pulse.frequency, speed)
    orientations = np.unique(element_layout(sonar.receive)[1])
    gain = np.abs(transmit.gain(_ahead(bearing))).max(axis=0)
    gain *= np.max([np.abs(receive.gain(_ahead(bearing - angle))).max(axis=0) for angle in orientations], axis=0)
    inside = bearing[gain >= 10 ** (FIELD_DB / 20) * gain.max()]
    return float(inside[0]), float(inside[-1])


def _ahead(bearing: Floats) -> Floats:
    """Directions in the plane of an array: boresight, right, down [1], shape (..., 3)."""
    return np.stack([np.cos(bearing), np.sin(bearing), np.zeros_like(bearing)], axis=-1)


def compressed(recording: xr.Dataset, scenario: Scenario) -> xr.Dataset:
    """Apply the matched filter to a recording, unless it has been applied."""
    sonar = scenario.sonar
    if sonar.receiver.matched_filter:
        return recording
    window = "hamming" if sonar.pulse.bandwidth > 0 else "uniform"
    return compressed_recording(recording, sonar.pulse, window=window)


def beams_of(recording: xr.Dataset, scenario: Scenario, bearings: Floats) -> RecordingLevels:
    """Form beams in the plane of an array, and return their levels with beams as channels.

    Args:
        recording: Recording of elements, compressed.
        scenario: Scenario of the recording.
        bearings: Bearings to the right of boresight in the plane of the array [rad], shape (beam,).
    """
    sonar, time = scenario.sonar, np.asarray(recording["time"].values, float)
    position = element_layout(sonar.receive)[0]
    formed = beamform_delay_sum(
        recording["pressure"].transpose("ping", "channel", "time").values, position, time, _ahead(bearings),
        centre_frequency=sonar.pulse.frequency, sound_speed=scenario.water.sound_speed, shading=_weights(scenario),
    )  # fmt: skip
    level = recorded_level(recording.drop_vars("pressure").assign(pressure=(("ping", "beam", "time"), formed)))
    return RecordingLevels(np.asarray(level.values, float), time, bearings, scenario, scenario.title)


def fewer(fan: RecordingLevels) -> RecordingLevels:
    """Average beams as energy to the samples that the figure shows."""
    dataset = xr.Dataset({"intensity": (("ping", "beam", "time"), 10 ** (fan.level / 10))}, {"time": fan.time})
    thin = decimated_recording(dataset, min(SHOWN, len(fan.time)))
    return replace(fan, level=np.asarray(recorded_level(thin).values, float), time=thin["time"].values)


def _right(scenario: Scenario) -> tuple[Floats, float]:
    """Positions of the elements to the right of the array's centre [m], and length of the array [m]."""
    right = element_layout(scenario.sonar.receive)[0][:, 1]
    return right - (right.max() + right.min()) / 2, float(np.ptp(right) * len(right) / (len(right) - 1))


def _weights(scenario: Scenario) -> Floats:
    right, length = _right(scenario)
    return shading_weight(SHADING, right / length)


def expected_pattern(scenario: Scenario, sine: Floats) -> Floats:
    """Expected level of a beam of a line array off its axis [dB], shape of sine.

    Args:
        scenario: Scenario of the recording.
        sine: Difference of the sines of direction and axis [1].
    """
    right, length = _right(scenario)
    x = sine * length * scenario.sonar.pulse.frequency / scenario.water.sound_speed
    return np.asarray(level_db(np.maximum(pattern(x, SHADING, len(right))[0] ** 2, 1e-6)))


def beam_width(scenario: Scenario) -> float:
    """Width at -3 dB of a beam that looks ahead [rad]."""
    sine = np.linspace(-0.5, 0.5, 20001)
    return width(np.arcsin(sine), expected_pattern(scenario, sine), 10000)


def cut_through(short: xr.Dataset, scenario: Scenario, target: TargetView) -> BeamCut:
    """Levels around a point target over bearing and over range, with the expected beam pattern."""
    bearings = target.bearing + np.linspace(-ABOUT, ABOUT, 301)
    beams = beams_of(short, scenario, bearings)
    slant, level = beams.time * beams.sound_speed / 2, beams.level[0]
    near = np.flatnonzero(np.abs(slant - target.slant) < ALONE)
    row, column = np.unravel_index(int(np.argmax(level[:, near])), (len(level), near.size))
    sample = int(near[column])
    expected = expected_pattern(scenario, np.sin(bearings) - np.sin(target.bearing))
    peak = float(level[row, sample])
    return BeamCut(
        target.label, bearings, level[:, sample] - peak, expected, slant, level[row] - peak, int(row), sample
    )


def point_numbers(cut: BeamCut, target: TargetView) -> list[CheckedNumber]:
    """Measured bearing, range and beam width at a point target."""
    bearing = parabolic_peak_position(cut.bearings, cut.over_bearing, cut.row)
    reach = parabolic_peak_position(cut.slant, cut.over_range, cut.sample)
    due = width(cut.bearings, cut.expected, int(np.argmax(cut.expected)))
    wide = width(cut.bearings, cut.over_bearing, cut.row)
    put, line = "true position of the point", "pattern of a Hamming line"
    return [
        _degrees(f"{target.label}: bearing", bearing, target.bearing, due / 10, put),
        CheckedNumber(f"{target.label}: slant range", reach, "m", target.slant, 0.05, put),
        _degrees(f"{target.label}: beam width at -3 dB", wide, due, due / 10, line),
    ]


def body_numbers(fan: RecordingLevels, target: TargetView) -> list[CheckedNumber]:
    """Bearing and slant range of the strongest echo of a body, which must lie on it."""
    slant = fan.time * fan.sound_speed / 2
    half = target.half_extent
    near = np.flatnonzero(np.abs(slant - target.slant) < half + ALONE)
    about = np.flatnonzero(np.abs(fan.steer - target.bearing) < np.arctan(half / target.slant) + np.radians(4))
    if not near.size or not about.size:
        return []
    part = fan.level[0][np.ix_(about, near)]
    row, column = np.unravel_index(int(np.argmax(part)), part.shape)
    step = float(fan.steer[1] - fan.steer[0])
    put = "middle of the body, and its half length"
    return [
        _degrees(f"{target.label}: bearing of the brightest", float(fan.steer[about[row]]), target.bearing,
                 float(np.arctan(half / target.slant)) + step, put),
        CheckedNumber(f"{target.label}: slant range of the brightest", float(slant[near[column]]), "m", target.slant,
               half + 0.1, put),
    ]  # fmt: skip


def _degrees(name: str, value: float, expected: float, tolerance: float, source: str) -> CheckedNumber:
    measured, target, limit = (float(angle) for angle in np.degrees([value, expected, tolerance]))
    return CheckedNumber(name, measured, "deg", target, limit, source)
