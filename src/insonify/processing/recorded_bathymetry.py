"""Depths of the bed from recordings of elements: a swath from two receivers' phase, soundings from beams."""

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from insonify.frames import direction
from insonify.processing.beamforming import beamform_delay_sum
from insonify.processing.bottom_detectors import bottom_detection
from insonify.processing.element_series import element_weights
from insonify.processing.interferometry import interferometric_depth
from insonify.processing.recorded_geometry import (
    Navigation,
    body_to_world,
    centre_frequency,
    recorded_element_positions,
    recorded_poses,
    recorded_transmitter_position,
    require_one_platform,
)

Floats = NDArray[np.float64]


def interferometric_bathymetry(
    recording: xr.Dataset, altitude: ArrayLike, *, channels: tuple[int, int] = (0, 1), sound_speed: float = 1500.0,
    looks: int | tuple[int, int] = (1, 15), navigation: Navigation = "logged",
) -> xr.Dataset:  # fmt: skip
    """Where the bed is by the phase between two receivers one above the other; see `interferometric_depth`.

    Ranges are halves of the ways heard, as if sound had come from the middle of the two: a transmitter that stands d
    off it moves them by up to d / 2. A pulse of duration T without compression is heard c T / 4 too far, by its middle.

    Args:
        recording: `pressure` [uPa] over (ping, channel, time), matched-filtered or short, and `element_position`.
        altitude: Height above the bed that is expected, which settles whole turns [m]: one number, or (ping,).
        channels: Of the upper receiver, and of the lower one.
        sound_speed: Of the water [m/s].
        looks: Pings and samples that each phase is averaged over; odd.
        navigation: Whether the log or the truth gives roll and depth. Pitch is not made up for.

    Returns:
        `across` (to starboard of the platform's reference point) and `depth` below the mean surface [m], and
        `coherence` [1], over (ping, time).

    Raises:
        ValueError: No such channels, or receivers that are not one above the other.
    """
    count = recording.sizes["channel"]
    if any(not 0 <= channel < count for channel in channels):
        raise ValueError(f"channels is {channels}; the recording has channels 0 to {count - 1}")
    upper, lower = recorded_element_positions(recording)[list(channels)]
    apart, side = upper - lower, _side(recording, channels[0], upper - lower)
    if not apart[2] < 0 or abs(apart[0]) > 1e-3 * np.linalg.norm(apart):
        raise ValueError(
            f"channels {channels} are apart by {apart} m; give the upper one first, none ahead of the other"
        )
    require_one_platform(recording)
    place, rotation = recorded_poses(recording, navigation)
    tilt = np.arctan2(side * apart[1], -apart[2]) + side * np.arctan2(rotation[:, 2, 1], rotation[:, 2, 2])
    series = recording["pressure"].transpose("ping", "channel", "time").values
    across, depth, gamma = interferometric_depth(
        series[:, channels[0]], series[:, channels[1]], recording["time"].values * sound_speed / 2, altitude=altitude,
        baseline=float(np.linalg.norm(apart)), tilt=tilt, centre_frequency=centre_frequency(recording),
        sound_speed=sound_speed, looks=looks,
    )  # fmt: skip
    middle = body_to_world(place, rotation, (upper + lower) / 2)
    beside = (middle - place)[:, 1] * rotation[:, 0, 0] - (middle - place)[:, 0] * rotation[:, 1, 0]
    beside /= np.hypot(rotation[:, 0, 0], rotation[:, 1, 0])  # square to the bow as seen from above
    dims, beside = ("ping", "time"), beside[:, None] + side * across
    return xr.Dataset(
        {"across": (dims, beside, {"units": "m", "long_name": "distance across the track, to starboard"}),
         "depth": (dims, middle[:, 2:] + depth, {"units": "m", "long_name": "depth of the bed"}),
         "coherence": (dims, gamma, {"units": "1", "long_name": "coherence of the two receivers"})},
        {name: recording[name] for name in ("ping", "time", "ping_time") if name in recording},
        dict(recording.attrs) | {"sound_speed": sound_speed},
    )  # fmt: skip


def _side(recording: xr.Dataset, channel: int, end_distance: Floats) -> int:
    """Which way a pair looks: 1 to starboard, -1 to port; from the recording, or else where it leans back from."""
    told = int(recording["side"].values[channel]) if "side" in recording else 0
    return told or (1 if end_distance[1] >= 0 else -1)


def multibeam_soundings(
    recording: xr.Dataset, angles: ArrayLike, *, sound_speed: float = 1500.0, shading: str | ArrayLike = "hamming",
    looks: int = 5, transmitter_position: ArrayLike | None = None, navigation: Navigation = "logged",
    threads: int | None = None,
) -> xr.Dataset:  # fmt: skip
    """Soundings of a multibeam sonar from its elements; see `bottom_detection`.

    Beams look down and to either side; each is formed of the whole line and of its two halves. A pulse without
    compression is found by its middle: soundings of a tone of duration T come late by up to T / 2, and are too deep by
    about a quarter of its length c T. Compress the recording first, or take c T / 4 off.

    Args:
        recording: `pressure` [uPa] over (ping, channel, time) of a line across the ship, and `element_position`.
        angles: Of the beams from the keel, to starboard positive [rad], shape (beam,).
        sound_speed: Of the water, all the way [m/s].
        shading: Of the whole line.
        looks: Least number of samples smoothed over; odd.
        transmitter_position: Forward, starboard, down [m]; None: as the recording says, or the middle of the line.
        navigation: Whether the log or the truth tells where the beams look.
        threads: How many cores to use.

    Returns:
        Over (ping, beam): `travel_time` [s] with its `deviation`, `by_phase`, and `north`, `east`, `depth` [m] of the
        soundings; coordinate `angle` [rad].
    """
    require_one_platform(recording)
    angle, element = np.atleast_1d(np.asarray(angles, float)), recorded_element_positions(recording)
    looking = direction(np.pi / 2, np.pi / 2 - angle)
    starboard = element[:, 1] > np.median(element[:, 1])
    series = recording["pressure"].transpose("ping", "channel", "time").values
    time = np.asarray(recording["time"].values, float)
    sent = recorded_transmitter_position(recording, transmitter_position)
    full, fore, aft = (
        beamform_delay_sum(series, element, time, looking, centre_frequency=centre_frequency(recording),
                           sound_speed=sound_speed, shading=weights, transmitter=sent, threads=threads)
        for weights in (element_weights(shading, element), ~starboard * 1.0, starboard * 1.0)
    )  # fmt: skip
    found = [bottom_detection(full[p], fore[p], aft[p], time, looks=looks) for p in range(len(series))]
    travel = np.array([detections.time for detections in found])
    body = element.mean(axis=0) + _reach(travel, sound_speed, looking, sent - element.mean(axis=0)) * looking
    place, rotation = recorded_poses(recording, navigation)
    columns = {
        "travel_time": (travel, "s", "two-way travel time to the bed"),
        "deviation": (np.array([d.standard_deviation for d in found]), "s", "standard deviation of the travel time"),
        "by_phase": (np.array([d.is_by_phase for d in found]), "1", "whether the phase told the travel time"),
    }
    soundings = place[:, None] + np.einsum("pij,pbj->pbi", rotation, body)
    for axis, name in enumerate(("north", "east", "depth")):
        columns[name] = (soundings[..., axis], "m", f"{name} of the sounding")
    held = {name: (("ping", "beam"), values, {"units": unit, "long_name": text})
            for name, (values, unit, text) in columns.items()}  # fmt: skip
    about = {"units": "rad", "long_name": "angle of the beam from the keel, to starboard"}
    coords = {name: recording[name] for name in ("ping", "ping_time") if name in recording}
    attributes = dict(recording.attrs) | {"sound_speed": sound_speed}
    return xr.Dataset(held, coords | {"angle": ("beam", angle, about)}, attributes)


def _reach(travel_time: Floats, sound_speed: float, looking: Floats, end_distance: Floats) -> Floats:
    """Range from the line's middle on each beam's axis [m], shape (ping, beam, 1), the transmitter being `end_distance` of it.

    Where the way out and the way back together are as long as was heard.
    """
    path = travel_time[..., None] * sound_speed
    return np.asarray((path**2 - end_distance @ end_distance) / (2 * (path - (looking @ end_distance)[:, None])))
