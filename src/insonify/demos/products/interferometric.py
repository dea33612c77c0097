"""Product of an interferometric sidescan: image, phase and depths of both sides, compared with true depths."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.demos.products.forward_looking import compressed
from insonify.demos.products.true_depths import depth_from_above, is_clear_of_targets
from insonify.paper.checked_numbers import CheckedNumber
from insonify.plotting.interferogram import SwathSide, interferogram_view
from insonify.processing import interferometric_bathymetry, recorded_level
from insonify.processing.recorded_geometry import recorded_element_positions, recorded_poses
from insonify.processing.sidescan import distance_run
from insonify.scenario.scenario import Scenario

Floats = NDArray[np.float64]

LOOKS = 3, 9
"""Pings and samples over which each phase is averaged."""
STEEP, FLAT = np.radians(60), np.radians(10)
"""Elevations between which depths are evaluated: under the sonar the swath is one cell, at long range noise [rad]."""
MARGIN = 3.0
"""Least distance of evaluated depths from targets, which cause shadows and layover [m]."""
COHERENT = 0.6
"""Coherence below which there is no depth [1]."""


@dataclass(frozen=True, slots=True)
class InterferometricDepths:
    """Depths of one side, over (ping, time)."""

    across: Floats
    """Distance to starboard of the platform [m]."""
    depth: Floats
    """Measured depth [m]."""
    truth: Floats
    """True depth of the highest surface at that position [m]."""
    coherence: Floats
    bed: NDArray[np.bool_]
    """True for evaluated depths: no target near, coherent, within the elevations."""


def interferometric(recording: xr.Dataset, scenario: Scenario, ping: int | None) -> tuple[Figure, list[CheckedNumber]]:
    """Draw image, phase and depths, and compute the errors of the depths.

    Args:
        recording: Complete recording of receivers in pairs.
        scenario: Scenario of the recording.
        ping: Number of the ping whose profile is drawn; None: the middle one.
    """
    short = compressed(recording, scenario)
    sides, numbers = [], []
    for name, upper, lower in pairs(recording):
        depths = swath(short, scenario, (upper, lower))
        numbers += swath_numbers(name, depths, recording, scenario)
        pressure = short["pressure"].transpose("ping", "channel", "time").values
        level = recorded_level(short).transpose("ping", "channel", "time").values[:, upper]
        phase = np.angle(pressure[:, upper] * np.conj(pressure[:, lower]))
        sides.append(SwathSide(-1 if name == "port" else 1, np.asarray(level, float), phase, depths.across,
                               depths.depth, depths.truth, depths.coherence >= COHERENT))  # fmt: skip
    rows = recording["ping"].values
    row = len(rows) // 2 if ping is None else int(np.flatnonzero(rows == ping)[0])
    run = distance_run(recording["logged_position"].values)
    slant = recording["time"].values * scenario.water.sound_speed / 2
    sonar = scenario.sonar
    baseline = f"receivers {wavelengths(recording, scenario):.1f} wavelengths apart"
    title = f"{scenario.title}: {sonar.pulse.frequency / 1e3:g} kHz, {baseline}"
    return interferogram_view(sides, slant, run, row, title), numbers


def pairs(recording: xr.Dataset) -> list[tuple[str, int, int]]:
    """Name of each side, and its upper and lower channel.

    Args:
        recording: Recording of two receivers on each side, or on one.
    """
    position, sides = recorded_element_positions(recording), recording["side"].values
    channels = []
    for side in np.unique(sides):
        rows = np.flatnonzero(sides == side)
        upper, lower = rows[np.argsort(position[rows, 2])]
        leans = position[upper, 1] - position[lower, 1]
        channels.append(("port" if side < 0 or (side == 0 and leans < 0) else "starboard", int(upper), int(lower)))
    return channels


def wavelengths(recording: xr.Dataset, scenario: Scenario) -> float:
    """Baseline between the two receivers of a side [wavelengths]."""
    _, upper, lower = pairs(recording)[0]
    position = recorded_element_positions(recording)
    baseline = float(np.linalg.norm(position[upper] - position[lower]))
    return baseline * scenario.sonar.pulse.frequency / scenario.water.sound_speed


def swath(short: xr.Dataset, scenario: Scenario, channels: tuple[int, int]) -> InterferometricDepths:
    """Depths of one side, and the true depths at the same positions.

    Args:
        short: Recording of the receivers, compressed.
        scenario: Scenario of the recording.
        channels: Upper and lower channel.
    """
    position, rotation = recorded_poses(short, "logged")
    altitude = scenario.seabed.depth - position[:, 2]
    looks = (LOOKS[0] if short.sizes["ping"] >= LOOKS[0] else 1, LOOKS[1])
    bathymetry = interferometric_bathymetry(
        short, altitude, channels=channels, sound_speed=scenario.water.sound_speed, looks=looks
    )
    across, depth, coherence = (bathymetry[name].values for name in ("across", "depth", "coherence"))
    bow = np.arctan2(rotation[:, 1, 0], rotation[:, 0, 0])[:, None]
    safe = np.nan_to_num(across)
    north, east = position[:, :1] - np.sin(bow) * safe, position[:, 1:2] + np.cos(bow) * safe
    truth = depth_from_above(scenario, north, east)
    down = np.arctan2(depth - position[:, 2:], np.abs(across))
    bed = (coherence >= COHERENT) & (down < STEEP) & (down > FLAT) & is_clear_of_targets(scenario, north, east, MARGIN)
    return InterferometricDepths(across, depth, truth, coherence, bed)


def swath_numbers(
    name: str, depths: InterferometricDepths, recording: xr.Dataset, scenario: Scenario
) -> list[CheckedNumber]:
    """Errors of the depths of one side.

    Args:
        name: Name of the side.
        depths: Depths of the side.
        recording: Recording from which they were computed.
        scenario: Scenario of the recording.
    """
    error = (depths.depth - depths.truth)[depths.bed]
    if not error.size:
        return []
    height = scenario.seabed.depth - float(np.mean(recording["position"].values[:, 2]))
    elevations = f"{np.degrees(FLAT):.0f} to {np.degrees(STEEP):.0f} deg down, {MARGIN:g} m from targets"
    spread = float(np.subtract(*np.quantile(error, [0.841, 0.159])))
    return [
        CheckedNumber(f"{name}: median of depth less truth", float(np.median(error)) * 100, "cm", 0.0, 2.0, elevations),
        CheckedNumber(f"{name}: spread of depth less truth", spread * 50, "cm", 0.0, height * 2,
                      "2 % of the altitude; half of the middle 68 %"),
        CheckedNumber(f"{name}: depths on the bed", float(error.size), "1"),
        CheckedNumber(f"{name}: median coherence there", float(np.median(depths.coherence[depths.bed])), "1"),
    ]  # fmt: skip
