"""Fields of every track: ping interval, recording window, motion of the platform about its path."""

from abc import abstractmethod
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from insonify.caller_warning import warn_caller
from insonify.model import Coordinate, FullTurn, Model, Radians, Seconds, field_error
from insonify.sonar.track.motion import Motion
from insonify.sonar.track.navigation_errors import NavigationErrors
from insonify.validity import PhysicsWarning

MAX_WINDOW = 100.0
"""Latest stop of a recording [s]."""
MAX_PINGS = 2_000_000
"""Largest number of pings of a track [1]."""
Position = tuple[Coordinate, Coordinate, Coordinate]
Floats = NDArray[np.float64]


def _not_empty(pings: int | None) -> int | None:
    if pings is not None and pings < 1:
        raise ValueError(f"{pings} pings are an empty track. Give 1 to {MAX_PINGS}.")
    return pings


def _within_longest_window(time: float) -> float:
    if time < 0:
        raise field_error("", f"{time:g} s", "is before the transmission. Give 0 s or later.")
    if time > MAX_WINDOW:
        raise field_error("", f"{time:g} s", f"is too late; {MAX_WINDOW:g} s, 75 km of range, is the latest stop. "
                          f"Did you mean {time:g} ms?")  # fmt: skip
    return time


WindowTime = Annotated[Seconds, AfterValidator(_within_longest_window), Field(ge=0, le=MAX_WINDOW)]
PingCount = Annotated[int, AfterValidator(_not_empty), Field(ge=1, le=MAX_PINGS)]


class PingSchedule(Model):
    """Fields of every track: ping interval, recording window, motion of the platform about its path."""

    interval: Seconds = Field(default=0.3, gt=0, le=1e6)
    """Time from one ping to the next [s]."""
    window: tuple[WindowTime, WindowTime] = (0.0, 0.24)
    """Start and stop of the recording after each transmission [s]."""
    motion: Motion = Motion()
    """Random motion of the platform's true position and attitude about the path."""
    navigation_errors: NavigationErrors = NavigationErrors()
    """Errors of the logged navigation."""
    stop_and_hop: bool = False
    """True: the platform does not move from each pulse to the end of its window. False: it moves; pressures have
    Doppler shifts, and the receive beams of pressures and expected intensities move during the window."""

    @property
    @abstractmethod
    def ping_count(self) -> int:
        """Number of pings: each kind of track has it from other fields."""

    @model_validator(mode="after")
    def _check_window(self) -> Self:
        start, stop = self.window
        if stop <= start:
            raise field_error(
                "window.1", f"{stop:g} s", f"is not after the window's start, {start:g} s. Give a later stop."
            )
        return self

    @model_validator(mode="after")
    def _window_ends_before_next_ping(self) -> Self:
        stop = self.window[1]
        if stop > self.interval and self.ping_count > 1:
            warn_caller(
                f"window stops at {stop:g} s, after the next ping at {self.interval:g} s: "
                "echoes of earlier pings are ignored",
                PhysicsWarning,
            )
        return self


class FixedHeading(Model):
    """Heading of a platform that does not turn."""

    heading: FullTurn = 0.0
    """Compass heading, clockwise from north [rad]."""


class FixedTilt(Model):
    """Constant pitch and roll of a platform, to which its motion adds."""

    pitch: Radians = Field(default=0.0, ge=-np.pi / 2, le=np.pi / 2)
    """Bow up, positive [rad]."""
    roll: Radians = Field(default=0.0, ge=-np.pi, le=np.pi)
    """Starboard down, positive [rad]."""


def ping_times(count: int, interval: float) -> Floats:
    """Time of each transmission since the first [s], shape (count,)."""
    return np.arange(count, dtype=np.float64) * interval


def max_ping_count(duration: float, interval: float) -> int:
    """Largest number of pings in a duration, the first at its start [1].

    Args:
        duration: The duration [s].
        interval: Time from ping to ping [s].
    """
    # a path of a whole number of intervals ends with a ping, whatever the rounding
    return int(np.floor(duration / interval * (1 + 1e-9) + 1e-9)) + 1


def checked_ping_count(requested: int | None, max_count: int, path: str, **words: Any) -> int:
    """Number of pings of a track of limited length.

    Args:
        requested: Requested number of pings; None: `max_count`.
        max_count: Largest number of pings on the track.
        path: Key of the requested number, for the message.
        words: `end`: description of the end of the track, for the message.

    Raises:
        PydanticCustomError: More pings than fit, or more than any track may have.
    """
    if requested is None and max_count > MAX_PINGS:
        raise field_error(
            path, f"{max_count}", f"pings would fit; {MAX_PINGS} is the most. Give a longer interval, or `pings`."
        )
    if requested is not None and requested > max_count:
        raise field_error(
            path, f"{requested}", f"pings run beyond {words['end']}, and nothing is extrapolated. "
            f"Give {max_count} or fewer, or null for all that fit, or a shorter interval.",
        )  # fmt: skip
    return max_count if requested is None else requested
