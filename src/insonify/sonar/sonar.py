"""The sonar: what it sends, through which arrays, and how it is fixed to its platform."""

from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from insonify.frames import array_axes, mounting_rotation
from insonify.noun import Decibels, Noun, Radians, located
from insonify.sonar.array import Array, LineArray, PlanarArray, PointTransducer
from insonify.sonar.pulse import Pulse
from insonify.sonar.receiver import ROLL_OFF, Receiver

STARBOARD = np.pi / 2
"""Bearing of a sidescan's starboard side, clockwise from the bow [rad]."""


class Mounting(Noun):
    """How the arrays face on the platform."""

    bearing: Radians = Field(default=STARBOARD, ge=-2 * np.pi, le=2 * np.pi)
    """Direction of boresight, clockwise from the bow [rad]."""
    tilt: Radians = Field(default=0.0, ge=-np.pi / 2, le=np.pi / 2)
    """Angle of boresight below the platform's horizontal plane [rad]."""


class Sonar(Noun):
    """A source and its receiver, on one platform, with the same mounting."""

    source_level_db: Decibels = Field(ge=0, le=300)
    """Rms level on the axis of the transmit beam [dB re 1 uPa at 1 m]."""
    pulse: Pulse
    transmit: Array
    receive: Array
    receiver: Receiver = Receiver()
    mounting: Mounting = Mounting()

    @model_validator(mode="after")
    def _band_above_zero(self) -> Self:
        if ROLL_OFF / 2 * self.receiver.band >= self.pulse.frequency:
            limit = self.pulse.frequency * 2 / ROLL_OFF / 1e3
            raise located(
                "receiver.band",
                f"{self.receiver.band / 1e3:g} kHz",
                f"at a centre of {self.pulse.frequency / 1e3:g} kHz; with its edges the band would reach below 0 Hz. "
                f"Give a band under {limit:g} kHz.",
            )
        return self

    @model_validator(mode="after")
    def _beams_pair_up(self) -> Self:
        sent, heard = len(self.transmit.steers), len(self.receive.steers)
        if sent > 1 and heard > 1 and sent != heard:
            raise located(
                "transmit.steer",
                f"{sent} angles",
                f"and receive.steer has {heard}; beams pair up one to one. "
                "Give both as many, or one of them a single angle, or leave transmit.steer out to follow.",
            )
        return self

    @property
    def channel_count(self) -> int:
        """Number of recorded channels, one per pair of a transmit and a receive beam."""
        return max(len(self.transmit.steers), len(self.receive.steers))

    @property
    def steers(self) -> tuple[float, ...]:
        """Angle of each channel to the right of boresight [rad]: the receive beam's, or the only steered one."""
        chosen = self.receive if len(self.receive.steers) == self.channel_count else self.transmit
        return tuple(angle for angle, _ in chosen.steers)

    @property
    def arrays(self) -> tuple[LineArray | PlanarArray | PointTransducer, LineArray | PlanarArray | PointTransducer]:
        """Transmit and receive array with every steer angle filled in; each has one beam or one per channel."""
        if isinstance(self.transmit, PointTransducer) or self.transmit.steer is not None:
            return self.transmit, self.receive
        return self.transmit.steered(self.receive.steers), self.receive


def array_rotation(sonar: Sonar, body: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axes of the arrays in the world.

    Args:
        sonar: The sonar; only its mounting matters.
        body: Axes of the platform in the world as columns, shape (3, 3), as from `Poses.rotation`.

    Returns:
        Boresight, right and down as rows in north, east, down [1], shape (3, 3).
    """
    return array_axes(body, mounting_rotation(sonar.mounting.bearing, sonar.mounting.tilt))


def array_position(
    array: LineArray | PlanarArray | PointTransducer, position: NDArray[np.float64], body: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Place of an array's centre in the world [m].

    Args:
        array: The array; only its offset matters.
        position: Platform's reference point in north, east, down [m], shape (3,).
        body: Axes of the platform in the world as columns, shape (3, 3).

    Returns:
        Centre of the array in north, east, down [m], shape (3,).
    """
    return np.asarray(position + body @ np.asarray(array.offset))
