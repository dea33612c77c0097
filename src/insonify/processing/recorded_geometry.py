"""Positions of a recording's elements on the platform, and in the world at each ping."""

from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from insonify.frames import pose_rotation
from insonify.processing.element_series import checked_positions

Floats = NDArray[np.float64]
Navigation = Literal["logged", "true"]


def recorded_element_positions(recording: xr.Dataset) -> Floats:
    """Positions of the receiving elements from the platform's reference point: forward, starboard, down [m].

    Args:
        recording: Recording with `element_position` over (channel, axis) [m].

    Returns:
        Shape (channel, 3).

    Raises:
        ValueError: The recording has no element positions.
    """
    if "element_position" not in recording:
        raise ValueError(
            "the recording has no element_position; add it over (channel, axis): forward, starboard, down [m]"
        )
    return checked_positions("element_position", recording["element_position"].values, (recording.sizes["channel"], 3))


def recorded_transmitter_position(recording: xr.Dataset, override: ArrayLike | None = None) -> Floats:
    """Position of the transmitter on its platform: forward, starboard, down [m], shape (3,).

    Args:
        recording: Recording with `transmitter_position` over (axis,); otherwise the middle of its elements is taken, or
                for a bistatic sonar the reference point of the transmitter's platform.
        override: Position in place of the recording's [m], shape (3,).
    """
    if override is not None:
        return checked_positions("transmitter", override, (3,))
    if "transmitter_position" in recording:
        return checked_positions("transmitter_position", recording["transmitter_position"].values, (3,))
    if is_bistatic(recording):
        return np.zeros(3)
    return np.asarray(recorded_element_positions(recording).mean(axis=0))


def is_bistatic(recording: xr.Dataset) -> bool:
    """Return True if the receiver has its own platform."""
    return "receiver_position" in recording


def require_one_platform(recording: xr.Dataset) -> None:
    """Refuse a recording whose receiver has its own platform.

    Raises:
        ValueError: The receiver has its own platform.
    """
    if is_bistatic(recording):
        raise ValueError(
            "the recording has receiver_position; a delay is a range only where one platform carries transmitter "
            "and receiver; otherwise it is an ellipse. Back-project it: synthetic_aperture_image"
        )


def centre_frequency(recording: xr.Dataset) -> float:
    """Centre frequency of the baseband [Hz].

    Args:
        recording: Recording with the attribute `centre_frequency`.

    Raises:
        ValueError: The recording has no such attribute.
    """
    if "centre_frequency" not in recording.attrs:
        raise ValueError("the recording has no attribute centre_frequency; assign the baseband's centre [Hz]")
    return float(recording.attrs["centre_frequency"])


def recorded_poses(
    recording: xr.Dataset, navigation: Navigation = "logged", *, receiver: bool = False
) -> tuple[Floats, Floats]:
    """Position and rotation of the platform at the start of each ping.

    Args:
        recording: Recording with `position` and `attitude`, and perhaps their logged values.
        navigation: Logged or true poses; true ones where there are no logged ones.
        receiver: True for the platform of the receiver, where that is another.

    Returns:
        North, east, down [m], shape (ping, 3); rotation, body to world, shape (ping, 3, 3).

    Raises:
        ValueError: An unknown value of `navigation`.
    """
    if navigation not in ("logged", "true"):
        raise ValueError(f"navigation is {navigation!r}; choose logged or true")
    prefix = "logged_" if navigation == "logged" and "logged_position" in recording else ""
    prefix += "receiver_" if receiver and is_bistatic(recording) else ""
    position = np.asarray(recording[f"{prefix}position"].values, float)
    return position, pose_rotation(*np.asarray(recording[f"{prefix}attitude"].values, float).T)


def body_to_world(platform_position: Floats, rotation: Floats, body_points: Floats) -> Floats:
    """Positions in the world of points on the platform.

    Args:
        platform_position: Position of the platform at each ping [m], shape (ping, 3).
        rotation: Body to world, shape (ping, 3, 3).
        body_points: Points on the platform: forward, starboard, down [m], shape (..., 3).

    Returns:
        North, east, down [m], shape (ping, ..., 3).
    """
    rotated = np.einsum("pij,...j->p...i", rotation, body_points)
    return np.asarray(rotated + platform_position.reshape(len(platform_position), *(1,) * (body_points.ndim - 1), 3))
