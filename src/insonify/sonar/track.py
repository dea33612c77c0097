"""The track: where the platform is, and how it leans, at every ping."""

import warnings
from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator

from insonify.frames import pose_rotation
from insonify.noun import Metres, MetresPerSecond, Noun, Radians, Seconds, located
from insonify.validity import PhysicsWarning

LONGEST_WINDOW = 100.0
"""Latest stop of a recording [s]."""
Coordinate = Annotated[Metres, Field(ge=-1e7, le=1e7)]
Place = tuple[Coordinate, Coordinate, Coordinate]
Floats = NDArray[np.float64]

MOST_PINGS = 1_000_000
"""More than any survey line has [1]."""


def _not_empty(pings: int) -> int:
    if pings < 1:
        raise ValueError(f"{pings} pings are an empty track. Give 1 to {MOST_PINGS}.")
    return pings


class _Pinging(Noun):
    """What every track has: how often it pings, how long it listens, how it leans."""

    heading: Radians = Field(default=0.0, ge=-2 * np.pi, le=2 * np.pi)
    """Compass heading, clockwise from north [rad]."""
    pitch: Radians = Field(default=0.0, ge=-np.pi / 2, le=np.pi / 2)
    """Bow up, positive [rad]."""
    roll: Radians = Field(default=0.0, ge=-np.pi, le=np.pi)
    """Starboard down, positive [rad]."""
    pings: Annotated[int, AfterValidator(_not_empty), Field(ge=1, le=MOST_PINGS)] = 1
    """Number of pings."""
    interval: Seconds = Field(default=0.3, gt=0, le=1e6)
    """Time from one ping to the next [s]."""
    window: tuple[Seconds, Seconds] = (0.0, 0.24)
    """Start and stop of the recording after each transmission [s]."""

    @model_validator(mode="after")
    def _window_in_order(self) -> Self:
        start, stop = self.window
        if start < 0:
            raise located("window.0", f"{start:g} s", "is before the transmission. Give 0 s or later.")
        if stop > LONGEST_WINDOW:
            raise ValueError(f"window stops at {stop:g} s; {LONGEST_WINDOW:g} s, 75 km of range, is the longest.")
        if stop <= start:
            raise located(
                "window.1", f"{stop:g} s", f"is not after the window's start, {start:g} s. Give a later stop."
            )
        if self.pings > 1 and stop > self.interval:
            warnings.warn(
                f"window stops at {stop:g} s, after the next ping at {self.interval:g} s: "
                "echoes of earlier pings are ignored",
                PhysicsWarning,
                stacklevel=2,
            )
        return self


class StaticTrack(_Pinging):
    """A platform that stays where it is."""

    kind: Literal["static"] = "static"
    position: Place
    """Platform's reference point: north, east, depth [m]."""


class LineTrack(_Pinging):
    """A platform that runs straight ahead at constant depth and speed."""

    kind: Literal["line"] = "line"
    start: Place
    """Reference point at the first ping: north, east, depth [m]."""
    speed: MetresPerSecond = Field(ge=0, le=100)
    """Speed along the heading [m/s]."""


Track = Annotated[StaticTrack | LineTrack, Field(discriminator="kind")]


@dataclass(frozen=True, slots=True)
class Poses:
    """Where the platform is and how it leans, one row per ping."""

    time: Floats
    """Time of transmission since the first ping [s], shape (pings,)."""
    position: Floats
    """Reference point in north, east, down [m], shape (pings, 3)."""
    heading: Floats
    """Compass heading [rad], shape (pings,)."""
    pitch: Floats
    """Bow up, positive [rad], shape (pings,)."""
    roll: Floats
    """Starboard down, positive [rad], shape (pings,)."""

    def __post_init__(self) -> None:
        """Every column has a row per ping."""
        for name in ("position", "heading", "pitch", "roll"):
            rows = len(getattr(self, name))
            if rows != len(self.time):
                raise ValueError(f"Poses.{name} has {rows} rows; time has {len(self.time)}")

    def __len__(self) -> int:
        """Number of pings."""
        return len(self.time)

    def rotation(self, ping: int) -> Floats:
        """Axes of the platform in the world at one ping.

        Args:
            ping: Number of the ping, from 0.

        Returns:
            Forward, starboard and down as columns in north, east, down [1], shape (3, 3).
        """
        return pose_rotation(float(self.heading[ping]), float(self.pitch[ping]), float(self.roll[ping]))


def poses(track: StaticTrack | LineTrack) -> Poses:
    """Every pose of a track."""
    time: Floats = np.arange(track.pings, dtype=np.float64) * track.interval
    if isinstance(track, LineTrack):
        way = np.array([np.cos(track.heading), np.sin(track.heading), 0.0])
        position = np.asarray(track.start) + track.speed * time[:, None] * way
    else:
        position = np.tile(np.asarray(track.position, dtype=float), (track.pings, 1))
    lean = {name: np.full(track.pings, getattr(track, name)) for name in ("heading", "pitch", "roll")}
    return Poses(time=time, position=position, **lean)
