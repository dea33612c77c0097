"""Soundings of a multibeam sonar, compared with true depths."""

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.demos.products.forward_looking import compressed
from insonify.demos.products.true_depths import depth_from_above, is_clear_of_targets
from insonify.paper.checked_numbers import CheckedNumber
from insonify.plotting.soundings import SwathSoundings, soundings_view
from insonify.processing import beam_recording, multibeam_soundings, recorded_level
from insonify.scenario.scenario import Scenario

Floats = NDArray[np.float64]

BEAMS, WIDEST = 256, np.radians(64)
"""Number of beams, and the angle of the outermost from the keel [rad]."""
MARGIN = 3.0
"""Least distance of evaluated soundings from targets, whose echoes and shadows extend beyond them [m]."""
BLUNDER = 0.05
"""Error of a blunder, relative to the height above the seabed [1]."""
STEEP = np.radians(45)
"""Angle from the keel between inner and outer beams [rad]."""


def multibeam(recording: xr.Dataset, scenario: Scenario, ping: int | None) -> tuple[Figure, list[CheckedNumber]]:
    """Draw a ping, the swath and its errors, and compute the errors of the soundings.

    Args:
        recording: Complete recording of the elements of a line across the ship.
        scenario: Scenario of the recording.
        ping: Number of the ping that is drawn; None: the one with the shallowest target, or the middle one.
    """
    short, angles = compressed(recording, scenario), np.linspace(-WIDEST, WIDEST, BEAMS)
    soundings = soundings_and_truth(short, scenario, angles, ping)
    sonar = scenario.sonar
    title = (f"{scenario.title}: {BEAMS} beams of {sonar.beam_count} elements, {sonar.pulse.frequency / 1e3:g} kHz, "
             f"{recording.sizes['ping']} pings")  # fmt: skip
    return soundings_view(soundings, title), sounding_numbers(soundings, scenario)


def soundings_and_truth(
    short: xr.Dataset, scenario: Scenario, angles: Floats, ping: int | None = None
) -> SwathSoundings:
    """Soundings and the true depths at the same positions, and one ping's beams.

    Args:
        short: Elements, compressed.
        scenario: Scenario of the recording.
        angles: Angles of the beams from the keel [rad], shape (beam,).
        ping: Number of the ping drawn in detail.
    """
    speed = scenario.water.sound_speed
    measured = multibeam_soundings(short, angles, sound_speed=speed)
    north, east, depth = (measured[name].values for name in ("north", "east", "depth"))
    truth = depth_from_above(scenario, np.nan_to_num(north), np.nan_to_num(east))
    rows = short["ping"].values
    row = _shallowest(truth) if ping is None else int(np.flatnonzero(rows == ping)[0])
    position, attitude = short["logged_position"].values, short["logged_attitude"].values
    bow = attitude[0, 0]
    off_north, off_east = north - position[0, 0], east - position[0, 1]
    across = off_east * np.cos(bow) - off_north * np.sin(bow)
    one = beam_recording(short.isel(ping=[row]), np.full(len(angles), np.pi / 2), elevation=np.pi / 2 - angles,
                         sound_speed=speed, shading="hamming")  # fmt: skip
    reach = float(np.nanmax(np.abs(across[row])))
    beside = np.linspace(-reach, reach, 600)
    under = depth_from_above(scenario, position[row, 0] - np.sin(bow) * beside, position[row, 1] + np.cos(bow) * beside)
    return SwathSoundings(
        angles, off_north * np.cos(bow) + off_east * np.sin(bow), across, depth, truth,
        np.isfinite(depth) & is_clear_of_targets(scenario, north, east, MARGIN), row, int(rows[row]),
        short["time"].values * speed / 2, np.asarray(recorded_level(one).values[0], float),
        (float(position[row, 2]), float(attitude[row, 2])), (beside, under),
    )  # fmt: skip


def _shallowest(truth: Floats) -> int:
    """Row of the ping with most soundings well above the seabed."""
    high = np.nanmedian(truth) - truth
    return int(np.argmax(np.sum(high > 0.25 * np.nanmax(high), axis=1)))


def sounding_numbers(soundings: SwathSoundings, scenario: Scenario) -> list[CheckedNumber]:
    """Errors of the soundings of the seabed."""
    height = scenario.seabed.depth - soundings.keel[0]
    error, angle = soundings.depth - soundings.truth, np.broadcast_to(np.abs(soundings.angle), soundings.depth.shape)
    numbers = []
    for name, chosen in (("inner", angle < STEEP), ("outer", angle >= STEEP)):
        errors = error[soundings.bed & chosen]
        if not errors.size:
            continue
        good = errors[np.abs(errors) < BLUNDER * height]
        about = f"beams {'within' if name == 'inner' else 'beyond'} {np.degrees(STEEP):.0f} deg, bed alone"
        share = 100 * good.size / errors.size
        numbers += [
            CheckedNumber(f"{name} beams: mean of depth less truth", float(good.mean()) * 100, "cm", 0.0, 5.0, about),
            CheckedNumber(f"{name} beams: rms of depth less truth", float(np.sqrt(np.mean(good**2))) * 100, "cm", 0.0,
                          height, f"1 % of the height, {about}"),
            CheckedNumber(f"{name} beams: soundings within 5 % of the height", share, "%", 98.0, None, about),
        ]  # fmt: skip
    return numbers
