"""Bathymetry from recordings of elements: swaths from the phase of two receivers, soundings from beams."""

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
    """Seabed positions from the phase between two receivers, one above the other; see `interferometric_depth`.

    Ranges are half the two-way path lengths, as if the transmitter were at the middle of the two: one that is d
    away shifts them by up to d / 2. A pulse of duration T without matched filter is c T / 4 too far, timed by its
    middle.

    Args:
        recording: `pressure` [uPa] over (ping, channel, time), matched-filtered or short, and `element_position`.
        altitude: Expected height above the seabed, which resolves whole cycles [m]: one number, or (ping,).
        channels: Index of the upper receiver, and of the lower one.
        sound_speed: Sound speed of the water [m/s].
        looks: Pings and samples to average each phase over; odd.
        navigation: Logged or true roll and depth. Pitch is not compensated.

    Returns:
        `across` (to starboard of the platform's reference point) and `depth` below the mean surface [m], and
        `coherence` [1], over (ping, time).

    Raises:
        ValueError: No such channels, or receivers that are not one above the other.

    Example:
        >>> import xarray as xr
        >>> slant_range = np.array([15.0, 20.0, 40.0])  # over a flat seabed, 10 m below two receivers 4 cm apart
        >>> elevation = flat_bed_elevation(slant_range, 10.0)
        >>> phase = elevation_to_phase(elevation, baseline=0.04, tilt=0.0, centre_frequency=150e3)
        >>> recording = xr.Dataset({
        ...     "pressure": (("ping", "channel", "time"), np.exp(1j * np.stack([phase, 0 * phase]))[None]),
        ...     "element_position": (("channel", "axis"), [[0.0, 0.0, -0.02], [0.0, 0.0, 0.02]]),
        ...     "position": (("ping", "axis"), [[0.0, 0.0, 5.0]]),
        ...     "attitude": (("ping", "axis"), np.zeros((1, 3))),
        ... }, {"time": slant_range / 750}, {"centre_frequency": 150e3})
        >>> swath = interferometric_bathymetry(recording, altitude=9.0, looks=1)
        >>> print(swath["across"].values.round(1), swath["depth"].values.round(1))
        [[11.2 17.3 38.7]] [[15. 15. 15.]]
    """
    count = recording.sizes["channel"]
    if any(not 0 <= channel < count for channel in channels):
        raise ValueError(f"channels is {channels}; the recording has channels 0 to {count - 1}")
    upper, lower = recorded_element_positions(recording)[list(channels)]
    baseline_vector, side = upper - lower, _side(recording, channels[0], upper - lower)
    if not baseline_vector[2] < 0 or abs(baseline_vector[0]) > 1e-3 * np.linalg.norm(baseline_vector):
        raise ValueError(
            f"channels {channels} are apart by {baseline_vector} m; give the upper one first, none ahead of the other"
        )
    require_one_platform(recording)
    position, rotation = recorded_poses(recording, navigation)
    tilt = np.arctan2(side * baseline_vector[1], -baseline_vector[2]) + side * np.arctan2(
        rotation[:, 2, 1], rotation[:, 2, 2]
    )
    series = recording["pressure"].transpose("ping", "channel", "time").values
    across, depth, coherence = interferometric_depth(
        series[:, channels[0]], series[:, channels[1]], recording["time"].values * sound_speed / 2, altitude=altitude,
        baseline=float(np.linalg.norm(baseline_vector)), tilt=tilt, centre_frequency=centre_frequency(recording),
        sound_speed=sound_speed, looks=looks,
    )  # fmt: skip
    middle = body_to_world(position, rotation, (upper + lower) / 2)
    across_offset = (middle - position)[:, 1] * rotation[:, 0, 0] - (middle - position)[:, 0] * rotation[:, 1, 0]
    across_offset /= np.hypot(rotation[:, 0, 0], rotation[:, 1, 0])  # perpendicular to the bow, seen from above
    dims, across_offset = ("ping", "time"), across_offset[:, None] + side * across
    return xr.Dataset(
        {"across": (dims, across_offset, {"units": "m", "long_name": "distance across the track, to starboard"}),
         "depth": (dims, middle[:, 2:] + depth, {"units": "m", "long_name": "depth of the seabed"}),
         "coherence": (dims, coherence, {"units": "1", "long_name": "coherence of the two receivers"})},
        {name: recording[name] for name in ("ping", "time", "ping_time") if name in recording},
        dict(recording.attrs) | {"sound_speed": sound_speed},
    )  # fmt: skip


def _side(recording: xr.Dataset, channel: int, end_distance: Floats) -> int:
    """Side of a pair of receivers: 1 starboard, -1 port; from the recording, or else from the tilt of its baseline."""
    recorded_side = int(recording["side"].values[channel]) if "side" in recording else 0
    return recorded_side or (1 if end_distance[1] >= 0 else -1)


def multibeam_soundings(
    recording: xr.Dataset, angles: ArrayLike, *, sound_speed: float = 1500.0, shading: str | ArrayLike = "hamming",
    looks: int = 5, transmitter_position: ArrayLike | None = None, navigation: Navigation = "logged",
    threads: int | None = None,
) -> xr.Dataset:  # fmt: skip
    """Soundings of a multibeam sonar from its elements; see `bottom_detection`.

    Beams point down and to either side; each is formed of the whole line and of its two halves. A pulse without
    matched filter is detected by its middle: soundings of a tone of duration T are late by up to T / 2, and too deep by
    about a quarter of its length c T. Apply the matched filter first, or subtract c T / 4.

    Args:
        recording: `pressure` [uPa] over (ping, channel, time) of a line across the ship, and `element_position`.
        angles: Angles of the beams from the keel, positive to starboard [rad], shape (beam,).
        sound_speed: Sound speed of the water, constant [m/s].
        shading: Shading of the whole line.
        looks: Least number of samples to smooth over; odd.
        transmitter_position: Forward, starboard, down [m]; None: from the recording, or the middle of the line.
        navigation: Logged or true attitude of the beams.
        threads: Number of cores.

    Returns:
        Over (ping, beam): `travel_time` [s] with its `deviation`, `by_phase`, and `north`, `east`, `depth` [m] of the
        soundings; coordinate `angle` [rad].

    Example:
        >>> import xarray as xr
        >>> element = np.stack([np.zeros(32), 0.005 * (np.arange(32) - 15.5), np.zeros(32)], axis=-1)
        >>> time, stone = np.arange(0.028, 0.032, 1 / 40e3), np.array([0.0, 10.0, 20.0])  # to starboard, below
        >>> delay = (np.linalg.norm(stone) + np.linalg.norm(stone - element, axis=1)[:, None]) / 1500
        >>> pressure = np.sinc(10e3 * (time - delay)) * np.exp(-2j * np.pi * 150e3 * delay)
        >>> recording = xr.Dataset({
        ...     "pressure": (("ping", "channel", "time"), pressure[None]),
        ...     "element_position": (("channel", "axis"), element),
        ...     "position": (("ping", "axis"), [[0.0, 0.0, 2.0]]),
        ...     "attitude": (("ping", "axis"), np.zeros((1, 3))),
        ... }, {"time": time}, {"centre_frequency": 150e3})
        >>> soundings = multibeam_soundings(recording, np.arctan([10 / 20]))
        >>> print(soundings["east"].values.round(1), soundings["depth"].values.round(1))
        [[10.]] [[22.]]
    """
    require_one_platform(recording)
    angle, element = np.atleast_1d(np.asarray(angles, float)), recorded_element_positions(recording)
    beam_directions = direction(np.pi / 2, np.pi / 2 - angle)
    starboard = element[:, 1] > np.median(element[:, 1])
    series = recording["pressure"].transpose("ping", "channel", "time").values
    time = np.asarray(recording["time"].values, float)
    transmitter = recorded_transmitter_position(recording, transmitter_position)
    full, fore, aft = (
        beamform_delay_sum(series, element, time, beam_directions, centre_frequency=centre_frequency(recording),
                           sound_speed=sound_speed, shading=weights, transmitter=transmitter, threads=threads)
        for weights in (element_weights(shading, element), ~starboard * 1.0, starboard * 1.0)
    )  # fmt: skip
    detection = [bottom_detection(full[p], fore[p], aft[p], time, looks=looks) for p in range(len(series))]
    travel_time = np.array([detection.time for detection in detection])
    centre = element.mean(axis=0)
    body_points = centre + _reach(travel_time, sound_speed, beam_directions, transmitter - centre) * beam_directions
    position, rotation = recorded_poses(recording, navigation)
    deviation = np.array([d.standard_deviation for d in detection])
    columns = {
        "travel_time": (travel_time, "s", "two-way travel time to the seabed"),
        "deviation": (deviation, "s", "standard deviation of the travel time"),
        "by_phase": (np.array([d.is_by_phase for d in detection]), "1", "whether the travel time is from phase"),
    }
    soundings = position[:, None] + np.einsum("pij,pbj->pbi", rotation, body_points)
    for axis, name in enumerate(("north", "east", "depth")):
        columns[name] = (soundings[..., axis], "m", f"{name} of the sounding")
    variables = {name: (("ping", "beam"), values, {"units": unit, "long_name": text})
            for name, (values, unit, text) in columns.items()}  # fmt: skip
    angle_attributes = {"units": "rad", "long_name": "angle of the beam from the keel, to starboard"}
    coords = {name: recording[name] for name in ("ping", "ping_time") if name in recording}
    attributes = dict(recording.attrs) | {"sound_speed": sound_speed}
    return xr.Dataset(variables, coords | {"angle": ("beam", angle, angle_attributes)}, attributes)


def _reach(travel_time: Floats, sound_speed: float, beam_directions: Floats, end_distance: Floats) -> Floats:
    """Range on each beam's axis from the line's middle [m], shape (ping, beam, 1), for a displaced transmitter.

    The transmit and the receive path together have the measured length; `end_distance` is the transmitter's.
    """
    path = travel_time[..., None] * sound_speed
    return np.asarray(
        (path**2 - end_distance @ end_distance) / (2 * (path - (beam_directions @ end_distance)[:, None]))
    )
