"""A synthetic-aperture image from a recording of elements and its navigation."""

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
    """Complex image of a part of the bed by back-projection; see `backproject`.

    Args:
        recording: Matched-filtered `pressure` [uPa] over (ping, channel, time), `element_position` over (channel,
            axis), and poses at each ping.
        north: Places of the pixels [m], shape (n,).
        east: Places of the pixels [m], shape (m,).
        depth: Of the bed [m]: one number, or shape (n, m).
        sound_speed: Of the water [m/s].
        stop_and_hop: Whether the sonar is taken to stand still while it listens; otherwise its elements move on as
            their places from ping to ping tell, and send and hear each echo where they are at the middle of its pulse,
            if the recording tells how long that was (`compressed_recording` does).
        max_angle: Widest angle off broadside that counts for a pixel [rad]; None: all.
        angle_shading: Taper over that angle.
        shading: Weight of each ping (ping,), or of each series (ping, channel).
        transmitter_position: Forward, starboard, down [m]; None: as the recording says, or the middle of the elements;
            of two platforms the reference point of the transmitter's.
        navigation: Whether the log or the truth is taken: what the log gets wrong defocuses the image.
        threads: How many cores to use.

    Returns:
        `pressure` over (north, east), complex [uPa]: the mean over pings, so a point echo keeps its level; `depth`.
    """
    place, rotation = recorded_poses(recording, navigation)
    heard = body_to_world(*recorded_poses(recording, navigation, receiver=True), recorded_element_positions(recording))
    sent = body_to_world(place, rotation, recorded_transmitter_position(recording, transmitter_position))
    sending, moving = (_velocity(ends, recording, stop_and_hop) for ends in (sent, heard))
    # what the matched filter gives the time of a pulse's start has the phase of its middle
    half = float(recording.attrs.get("pulse_duration", 0.0)) / 2
    sent, heard = sent + half * sending, heard + half * moving
    x, y = (np.atleast_1d(np.asarray(axis, float)) for axis in (north, east))
    below = np.broadcast_to(np.asarray(depth, float), (x.size, y.size))
    pixels = np.stack([*np.meshgrid(x, y, indexing="ij"), below], axis=-1)
    image = backproject(
        recording["pressure"].transpose("ping", "channel", "time").values, recording["time"].values, sent, heard,
        pixels, centre_frequency=centre_frequency(recording), sound_speed=sound_speed,
        receive_velocity=moving, shading=shading, track_direction=None if max_angle is None else rotation[:, :, 0],
        max_angle=max_angle, angle_shading=angle_shading, threads=threads,
    )  # fmt: skip
    about = {"units": "uPa", "long_name": "back-projected pressure, complex, mean over pings"}
    axes = {name: (name, values, {"units": "m", "long_name": name}) for name, values in (("north", x), ("east", y))}
    held = {"pressure": (("north", "east"), image, about),
            "depth": (("north", "east"), below.copy(), {"units": "m", "long_name": "depth of the pixel"})}  # fmt: skip
    attributes = dict(recording.attrs) | {"sound_speed": sound_speed, "navigation": navigation}
    return xr.Dataset(held, axes, attributes)


def _velocity(positions: Floats, recording: xr.Dataset, stop_and_hop: bool) -> Floats:
    """Velocity of transmitter or elements at each ping, from their places at the pings about it [m/s]."""
    if stop_and_hop or len(positions) < 2:
        return np.zeros(positions.shape)
    return np.asarray(np.gradient(positions, np.asarray(recording["ping_time"].values, float), axis=0))
