"""Synthetic-aperture image of a recording of elements with its navigation."""

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from insonify.processing.recorded_geometry import (
    Navigation,
    body_to_world,
    centre_frequency,
    recorded_element_positions,
    recorded_poses,
    recorded_transmitter_position,
)
from insonify.processing.synthetic_aperture import backproject

Floats = NDArray[np.float64]


def synthetic_aperture_image(
    recording: xr.Dataset, north: ArrayLike, east: ArrayLike, depth: ArrayLike, *, sound_speed: float = 1500.0,
    stop_and_hop: bool = False, max_angle: float | None = None, angle_shading: str = "uniform",
    shading: ArrayLike | None = None, transmitter_position: ArrayLike | None = None, navigation: Navigation = "logged",
    threads: int | None = None,
) -> xr.Dataset:  # fmt: skip
    """Complex image of a part of the seabed by back-projection; see `backproject`.

    Args:
        recording: Matched-filtered `pressure` [uPa] over (ping, channel, time), `element_position` over (channel,
            axis), and poses at each ping.
        north: North coordinates of the pixels [m], shape (n,).
        east: East coordinates of the pixels [m], shape (m,).
        depth: Depth of the seabed [m]: one number, or shape (n, m).
        sound_speed: Sound speed of the water [m/s].
        stop_and_hop: True for a sonar at rest during each ping; otherwise the velocity of its elements follows from
            their
                positions from ping to ping, and each echo is transmitted and received where they are at the middle of
                its pulse, if the recording has the pulse duration (`compressed_recording` adds it).
        max_angle: Largest angle off broadside that contributes to a pixel [rad]; None: all.
        angle_shading: Taper over that angle.
        shading: Weight of each ping (ping,), or of each series (ping, channel).
        transmitter_position: Forward, starboard, down [m]; None: from the recording, or the middle of the elements;
                of a bistatic sonar the reference point of the transmitter's platform.
        navigation: Logged or true poses; errors of the log defocus the image.
        threads: Number of cores.

    Returns:
        `pressure` over (north, east), complex [uPa]: the mean over pings, so a point echo keeps its level; and `depth`.

    Example:
        >>> pulse = {"kind": "lfm", "frequency": "100 kHz", "bandwidth": "20 kHz", "duration": "1 ms"}
        >>> scenario = insonify.Scenario(
        ...     sonar={"source_level_db": 200, "pulse": pulse, "transmit": {"kind": "point"},
        ...            "receive": {"kind": "elements", "positions": [[0, 0, 0]]},
        ...            "receiver": {"record": "elements", "bandwidth": "30 kHz"}},
        ...     targets=[{"shape": "point", "position": [0, 20, 5], "target_strength_db": -20}],
        ...     track={"kind": "line", "start": [-1, 0, 5], "speed": "1 m/s", "pings": 21, "interval": "0.1 s",
        ...            "window": ["26 ms", "29 ms"]},
        ...     paths={"contributions": ["target"], "families": ["D"]},
        ... )
        >>> recording = compressed_recording(insonify.simulate(scenario), scenario.sonar.pulse)
        >>> image = synthetic_aperture_image(recording, north=[-0.5, 0.0, 0.5], east=[20.0], depth=5.0)
        >>> level = recorded_level(image)
        >>> print(level.values.ravel().round())  # SL + TS - 40 log R - absorption
        [ 88. 127.  87.]
    """
    position, rotation = recorded_poses(recording, navigation)
    receive_positions = body_to_world(
        *recorded_poses(recording, navigation, receiver=True), recorded_element_positions(recording)
    )
    transmit_positions = body_to_world(
        position, rotation, recorded_transmitter_position(recording, transmitter_position)
    )
    transmit_velocity, receive_velocity = (
        _velocity(ends, recording, stop_and_hop) for ends in (transmit_positions, receive_positions)
    )
    # the matched filter's output at the time of a pulse's start has the phase of its middle
    half_duration = float(recording.attrs.get("pulse_duration", 0.0)) / 2
    transmit_positions = transmit_positions + half_duration * transmit_velocity
    receive_positions = receive_positions + half_duration * receive_velocity
    x, y = (np.atleast_1d(np.asarray(axis, float)) for axis in (north, east))
    pixel_depth = np.broadcast_to(np.asarray(depth, float), (x.size, y.size))
    pixels = np.stack([*np.meshgrid(x, y, indexing="ij"), pixel_depth], axis=-1)
    image = backproject(
        recording["pressure"].transpose("ping", "channel", "time").values, recording["time"].values, transmit_positions,
        receive_positions, pixels, centre_frequency=centre_frequency(recording), sound_speed=sound_speed,
        receive_velocity=receive_velocity, shading=shading,
        track_direction=None if max_angle is None else rotation[:, :, 0], max_angle=max_angle,
        angle_shading=angle_shading, threads=threads,
    )  # fmt: skip
    pressure_attributes = {"units": "uPa", "long_name": "back-projected pressure, complex, mean over pings"}
    axes = {name: (name, values, {"units": "m", "long_name": name}) for name, values in (("north", x), ("east", y))}
    variables = {
        "pressure": (("north", "east"), image, pressure_attributes),
        "depth": (("north", "east"), pixel_depth.copy(), {"units": "m", "long_name": "depth of the pixel"}),
    }
    attributes = dict(recording.attrs) | {"sound_speed": sound_speed, "navigation": navigation}
    return xr.Dataset(variables, axes, attributes)


def _velocity(positions: Floats, recording: xr.Dataset, stop_and_hop: bool) -> Floats:
    """Velocity of transmitter or elements at each ping, from their positions at neighbouring pings [m/s]."""
    if stop_and_hop or len(positions) < 2:
        return np.zeros(positions.shape)
    return np.asarray(np.gradient(positions, np.asarray(recording["ping_time"].values, float), axis=0))
