"""What every track has: how often the sonar pings, how long it listens, how the platform moves about its path."""

import warnings
from typing import Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from insonify.noun import Metres, Noun, Radians, Seconds, located
from insonify.sonar.track.logged import LoggedNavigation
from insonify.sonar.track.motion import Motion
from insonify.validity import PhysicsWarning

LONGEST_WINDOW = 100.0
"""Latest stop of a recording [s]."""
MOST_PINGS = 1_000_000
"""More than any survey line has [1]."""
Coordinate = Annotated[Metres, Field(ge=-1e7, le=1e7)]
Place = tuple[Coordinate, Coordinate, Coordinate]
Floats = NDArray[np.float64]


def _not_empty(pings: int | None) -> int | None:
    if pings is not None and pings < 1:
        raise ValueError(f"{pings} pings are an empty track. Give 1 to {MOST_PINGS}.")
    return pings


PingCount = Annotated[int, AfterValidator(_not_empty), Field(ge=1, le=MOST_PINGS)]


class Pinging(Noun):
    """What every track has: how often it pings, how long it listens, how it moves about its path."""

    interval: Seconds = Field(default=0.3, gt=0, le=1e6)
    """Time from one ping to the next [s]."""
    window: tuple[Seconds, Seconds] = (0.0, 0.24)
    """Start and stop of the recording after each transmission [s]."""
    motion: Motion = Motion()
    """Waves in the platform's true position and attitude, about the path."""
    logged: LoggedNavigation = LoggedNavigation()
    """What the navigation that is written down has wrong."""
    stop_and_hop: bool = False
    """True: the platform stands still from each pulse to the end of its window. False: it moves on; pressures are
    shifted in frequency, and pressures and expected intensities alike are received by beams that have moved."""

    @property
    def ping_count(self) -> int:
        """Number of pings."""
        raise NotImplementedError

    @model_validator(mode="after")
    def _window_in_order(self) -> Self:
        start, stop = self.window
        if start < 0:
            raise located("window.0", f"{start:g} s", "is before the transmission. Give 0 s or later.")
        if stop > LONGEST_WINDOW:
            raise located(
                "window.1", f"{stop:g} s", f"is too late; {LONGEST_WINDOW:g} s, 75 km of range, is the latest stop."
            )
        if stop <= start:
            raise located(
                "window.1", f"{stop:g} s", f"is not after the window's start, {start:g} s. Give a later stop."
            )
        return self

    @model_validator(mode="after")
    def _deaf_to_earlier_pings(self) -> Self:
        stop = self.window[1]
        if stop > self.interval and self.ping_count > 1:
            warnings.warn(
                f"window stops at {stop:g} s, after the next ping at {self.interval:g} s: "
                "echoes of earlier pings are ignored",
                PhysicsWarning,
                stacklevel=2,
            )
        return self


class Heading(Noun):
    """How a platform faces that does not turn."""

    heading: Radians = Field(default=0.0, ge=-2 * np.pi, le=2 * np.pi)
    """Compass heading, clockwise from north [rad]."""


class Lean(Noun):
    """How a platform leans all the time; waves in it are its motion."""

    pitch: Radians = Field(default=0.0, ge=-np.pi / 2, le=np.pi / 2)
    """Bow up, positive [rad]."""
    roll: Radians = Field(default=0.0, ge=-np.pi, le=np.pi)
    """Starboard down, positive [rad]."""


def ping_times(count: int, interval: float) -> Floats:
    """Time of each transmission since the first [s], shape (count,)."""
    return np.arange(count, dtype=np.float64) * interval


def most_pings(longest: float, interval: float) -> int:
    """How many pings fit into a time, the first at its start [1].

    Args:
        longest: The time [s].
        interval: From ping to ping [s].
    """
    # A path that is an even number of intervals long ends with a ping, whatever the rounding.
    return int(np.floor(longest / interval * (1 + 1e-9) + 1e-9)) + 1


def pings_that_fit(asked: int | None, fit: int, path: str, **words: Any) -> int:
    """The number of pings of a track that has an end.

    Args:
        asked: Pings asked for; None: as many as fit.
        fit: Pings that fit.
        path: Key of the noun that asks, for the message.
        words: `end`: what the pings would run beyond.

    Raises:
        PydanticCustomError: More pings than fit, or more than any track may have.
    """
    if asked is None and fit > MOST_PINGS:
        raise located(path, f"{fit}", f"pings would fit; {MOST_PINGS} is the most. Give a longer interval, or `pings`.")
    if asked is not None and asked > fit:
        raise located(
            path, f"{asked}", f"pings run beyond {words['end']}, and nothing is extrapolated. "
            f"Give {fit} or fewer, or null for all that fit, or a shorter interval.",
        )  # fmt: skip
    return fit if asked is None else asked
