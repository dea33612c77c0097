"""Where the elements of a recording were: in the body, and in the world at each ping."""

from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from insonify.frames import pose_rotation
from insonify.processing.element_series import checked_positions

Floats = NDArray[np.float64]
Navigation = Literal["logged", "true"]


def recorded_element_positions(recording: xr.Dataset) -> Floats:
    """Places of the receiving elements from the platform's reference point: forward, starboard, down [m].

    Args:
        recording: With `element_position` over (channel, axis) [m].

    Returns:
        Shape (channel, 3).

    Raises:
        ValueError: The recording does not say where its elements are.
    """
    if "element_position" not in recording:
        raise ValueError(
            "the recording has no element_position; add it over (channel, axis): forward, starboard, down [m]"
        )
    return checked_positions("element_position", recording["element_position"].values, (recording.sizes["channel"], 3))


def recorded_transmitter_position(recording: xr.Dataset, override: ArrayLike | None = None) -> Floats:
    """Place of the transmitter on its platform: forward, starboard, down [m], shape (3,).

    Args:
        recording: With `transmitter_position` over (axis,), or else the middle of its elements is taken; of two
            platforms the reference point of the transmitter's.
        override: What the caller knows better [m], shape (3,).
    """
    if override is not None:
        return checked_positions("transmitter", override, (3,))
    if "transmitter_position" in recording:
        return checked_positions("transmitter_position", recording["transmitter_position"].values, (3,))
    if is_bistatic(recording):
        return np.zeros(3)
    return np.asarray(recorded_element_positions(recording).mean(axis=0))


def is_bistatic(recording: xr.Dataset) -> bool:
    """Whether the receiver has a platform of its own.

    Args:
        recording: Of any field.
    """
    return "receiver_position" in recording


def require_one_platform(recording: xr.Dataset) -> None:
    """Refuse a recording whose receiver has a platform of its own.

    Args:
        recording: Of any field.

    Raises:
        ValueError: It has.
    """
    if is_bistatic(recording):
        raise ValueError(
            "the recording has receiver_position, and an echo's time tells a range only where one platform sends and "
            "hears; between two it tells an ellipse. Back-project it: synthetic_aperture_image"
        )


def centre_frequency(recording: xr.Dataset) -> float:
    """Centre frequency of the baseband [Hz].

    Args:
        recording: With the attribute `centre_frequency`.

    Raises:
        ValueError: The recording does not say.
    """
    if "centre_frequency" not in recording.attrs:
        raise ValueError("the recording has no attribute centre_frequency; assign the baseband's centre [Hz]")
    return float(recording.attrs["centre_frequency"])


def recorded_poses(
    recording: xr.Dataset, navigation: Navigation = "logged", *, receiver: bool = False
) -> tuple[Floats, Floats]:
    """Place of the platform at the start of each ping, and how it lay.

    Args:
        recording: With `position` and `attitude`, and what was logged of them.
        navigation: Whether the log or the truth is taken; where there is no log, the truth.
        receiver: Whether the platform that carries the receiver is wanted, where that is another.

    Returns:
        North, east, down [m], shape (ping, 3); rotation, body to world, shape (ping, 3, 3).

    Raises:
        ValueError: Another kind of navigation.
    """
    if navigation not in ("logged", "true"):
        raise ValueError(f"navigation is {navigation!r}; choose logged or true")
    prefix = "logged_" if navigation == "logged" and "logged_position" in recording else ""
    prefix += "receiver_" if receiver and is_bistatic(recording) else ""
    place = np.asarray(recording[f"{prefix}position"].values, float)
    return place, pose_rotation(*np.asarray(recording[f"{prefix}attitude"].values, float).T)


def body_to_world(platform_position: Floats, rotation: Floats, body_points: Floats) -> Floats:
    """Places in the world of points of the body.

    Args:
        platform_position: Of the platform at each ping [m], shape (ping, 3).
        rotation: Body to world, shape (ping, 3, 3).
        body_points: Points: forward, starboard, down [m], shape (..., 3).

    Returns:
        North, east, down [m], shape (ping, ..., 3).
    """
    turned = np.einsum("pij,...j->p...i", rotation, body_points)
    return np.asarray(turned + platform_position.reshape(len(platform_position), *(1,) * (body_points.ndim - 1), 3))
