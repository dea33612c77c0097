"""Sonar: pulse, arrays, receiver, recorder, and mounting on the platform."""

from functools import lru_cache
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from insonify.frames import array_axes, mounting_rotation
from insonify.model import Decibels, FullTurn, Model, Radians, field_error
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.element_array import AnyArray, ArcArray, Array, ElementArray
from insonify.sonar.hull import Hull
from insonify.sonar.hydrophones import element_layout, single_element
from insonify.sonar.pulse import MIN_PLAUSIBLE_FREQUENCY, Pulse
from insonify.sonar.receiver import FULL_TO_FLAT_BANDWIDTH, Receiver
from insonify.sonar.recorder import Recorder

STARBOARD = np.pi / 2
"""Bearing of a sidescan's starboard side, clockwise from the bow [rad]."""
MIN_BEARING_SINE = 1e-6
"""Sine of the boresight's bearing that a sonar with sides exceeds [1]."""
Side = Literal["port", "starboard"]


class Mounting(Model):
    """Orientation of the arrays on the platform.

    Example:
        >>> mounting = Mounting(bearing="90 deg", tilt="30 deg")
        >>> round(mounting.tilt, 3)
        0.524
    """

    bearing: FullTurn = STARBOARD
    """Direction of boresight, clockwise from the bow [rad]."""
    tilt: Radians = Field(default=0.0, ge=-np.pi / 2, le=np.pi / 2)
    """Angle of boresight below the platform's horizontal plane [rad]."""


class Sonar(Model):
    """A transmitter and its receiver, with the same mounting if on one platform; or a pair of these, one a side.

    Example:
        >>> pulse, array = Pulse(frequency="450 kHz", duration="0.1 ms"), LineArray(length="0.45 m")
        >>> sonar = Sonar(source_level_db=210, pulse=pulse, transmit=array, receive=array, sides=["port", "starboard"])
        >>> sonar.channel_sides
        (-1, 1)
    """

    source_level_db: Decibels = Field(ge=0, le=300)
    """Rms level on the axis of the transmit beam [dB re 1 uPa at 1 m]."""
    pulse: Pulse
    transmit: Array
    receive: Array
    receiver: Receiver = Receiver()
    recorder: Recorder | None = None
    """Stages between received beams and the file of an instrument; None: pressures are recorded as received."""
    mounting: Mounting = Mounting()
    receive_mounting: Mounting | None = None
    """Orientation of the receive array on a platform of its own; None: that of the transmit array."""
    hull: Hull | None = None
    """Hull above the transmitter, whose underside reflects boundary echoes; None: none."""
    sides: tuple[Side, ...] | None = None
    """Sides of a sidescan, in the order of their channels: starboard as mounted, port its mirror image, each with a
    transmitter and a receiver, without crosstalk between the sides; None: one sonar, as mounted."""

    @model_validator(mode="after")
    def _check_sides(self) -> Self:
        if self.sides is None:
            return self
        if not self.sides or len(set(self.sides)) < len(self.sides):
            raise field_error("sides", None, f"[{', '.join(self.sides)}] is no choice of sides. Write [port, "
                          "starboard], one of them, or null.")  # fmt: skip
        if np.sin(self.mounting.bearing) <= MIN_BEARING_SINE:
            raise field_error(
                "mounting.bearing", f"{np.degrees(self.mounting.bearing):g} deg",
                "is not to starboard of the bow, and port is made its mirror image. Write the bearing of the "
                "starboard side, such as 90 deg, or leave `sides` out.",
            )  # fmt: skip
        return self

    @model_validator(mode="after")
    def _band_above_zero(self) -> Self:
        if FULL_TO_FLAT_BANDWIDTH / 2 * self.receiver.bandwidth >= self.pulse.frequency:
            if self.pulse.frequency <= MIN_PLAUSIBLE_FREQUENCY:
                raise field_error(
                    "pulse.frequency",
                    f"{self.pulse.frequency:g} Hz",
                    f"is too low for a receiver of {self.receiver.bandwidth / 1e3:g} kHz. "
                    f"Did you mean {self.pulse.frequency:g} kHz? Write the unit.",
                )
            limit = self.pulse.frequency * 2 / FULL_TO_FLAT_BANDWIDTH / 1e3
            raise field_error(
                "receiver.bandwidth",
                f"{self.receiver.bandwidth / 1e3:g} kHz",
                f"at a centre of {self.pulse.frequency / 1e3:g} kHz; with its edges the band would reach below 0 Hz. "
                f"Give a band under {limit:g} kHz.",
            )
        return self

    @model_validator(mode="after")
    def _check_recorded_elements(self) -> Self:
        if isinstance(self.transmit, ElementArray | ArcArray):
            raise field_error("transmit.kind", self.transmit.kind, "is for receiving. Write line, planar or point.")
        if isinstance(self.receive, ElementArray | ArcArray) and self.receiver.record == "beams":
            raise field_error("receive.kind", self.receive.kind, "has elements but no beams. Write receiver.record: "
                          "elements and steer afterwards, or give a line or planar array.")  # fmt: skip
        if self.receiver.record == "beams" and self.receiver.errors != type(self.receiver.errors)():
            raise field_error("receiver.errors", None, "are those of single elements. Write receiver.record: elements.")
        missing = [row for row in self.receiver.errors.dead if row >= self.beam_count]
        if self.receiver.record == "elements" and missing:
            raise field_error(
                "receiver.errors.dead", f"{missing[0]}", f"is no element; there are 0 to {self.beam_count - 1}."
            )
        if self.receiver.record == "elements" and len(self.transmit.steers) > 1:
            raise field_error("transmit.steer", f"{len(self.transmit.steers)} angles", "send several beams at once, "
                          "but elements receive one transmission. Give one.")  # fmt: skip
        return self

    @model_validator(mode="after")
    def _check_beam_pairs(self) -> Self:
        if self.receiver.record == "elements":
            return self
        transmit_count, receive_count = len(self.transmit.steers), len(self.receive.steers)
        if transmit_count > 1 and receive_count > 1 and transmit_count != receive_count:
            raise field_error(
                "transmit.steer",
                f"{transmit_count} angles",
                f"and receive.steer has {receive_count}; beams pair up one to one. "
                "Give both as many, or one of them a single angle, or leave transmit.steer out to follow.",
            )
        return self

    @property
    def beam_count(self) -> int:
        """Channels of one side: one per pair of a transmit and a receive beam, or per element recorded."""
        if self.receiver.record == "elements":
            return len(element_layout(self.receive)[0])
        return max(len(self.transmit.steers), len(self.receive.steers))

    @property
    def channel_count(self) -> int:
        """Number of recorded channels: all channels of the first side, then those of the second."""
        return self.beam_count * len(self.side_sonars)

    @property
    def steers(self) -> tuple[float, ...]:
        """Angle of each channel to the right of boresight [rad].

        That of its receive beam; of its transmit beam where only the transmit array has several; 0 for elements.
        """
        return tuple(angle for side in self.side_sonars for angle in side._beam_steers)

    @property
    def channel_sides(self) -> tuple[int, ...]:
        """Side of each channel: -1 port, 1 starboard, 0 where the sonar has no sides."""
        number = {"port": -1, "starboard": 1}
        sides = (0,) if self.sides is None else tuple(number[side] for side in self.sides)
        return tuple(side for side in sides for _ in range(self.beam_count))

    @property
    def at_carrier(self) -> "Sonar":
        """The sonar with beams and absorption at its carrier frequency alone, as expected intensities use them."""
        return self.unchecked_copy(receiver=self.receiver.unchecked_copy(sub_bands=1))

    @property
    def side_sonars(self) -> tuple["Sonar", ...]:
        """The sonar of each side, in the order of the channels; the sonar itself if it has no sides."""
        if self.sides is None:
            return (self,)
        starboard = self.unchecked_copy(sides=None)
        return tuple(starboard if side == "starboard" else mirror_image(starboard) for side in self.sides)

    @property
    def _beam_steers(self) -> tuple[float, ...]:
        if self.receiver.record == "elements":
            return (0.0,) * self.beam_count
        steered = self.receive if len(self.receive.steers) == self.beam_count else self.transmit
        return tuple(angle for angle, _ in steered.steers)

    @property
    def arrays(self) -> tuple[AnyArray, AnyArray]:
        """Transmit and receive array; each has one beam or one per channel.

        A transmit array without steer angles takes those of the receive array, unless elements are recorded.
        """
        if self.receiver.record == "elements" or isinstance(self.transmit, PointTransducer | ElementArray | ArcArray):
            return self.transmit, self.receive
        if self.transmit.steer is not None:
            return self.transmit, self.receive
        return self.transmit.steered(self.receive.steers), self.receive

    @property
    def channel_arrays(self) -> tuple[LineArray | PlanarArray | PointTransducer, ...]:
        """Arrays whose patterns one channel has: transmit array, and receive array or one element of it."""
        if self.receiver.record == "elements":
            return *self.beam_arrays, single_element(self.receive)
        return self.beam_arrays

    @property
    def beam_arrays(self) -> tuple[LineArray | PlanarArray | PointTransducer, ...]:
        """Those of `arrays` that form beams: all but a receive array whose elements are recorded."""
        arrays = self.arrays[:1] if self.receiver.record == "elements" else self.arrays
        return tuple(array for array in arrays if not isinstance(array, ElementArray | ArcArray))


def mirror_image(sonar: Sonar) -> Sonar:
    """Mirror image of a sonar in the vertical plane through the fore-and-aft axis: the other side of a sidescan.

    A hull is left as it is.
    """
    mounting = sonar.mounting.unchecked_copy(bearing=-sonar.mounting.bearing)
    ends = {"transmit": _mirror_image_of_array(sonar.transmit), "receive": _mirror_image_of_array(sonar.receive)}
    return sonar.unchecked_copy(mounting=mounting, **ends)


def _mirror_image_of_array(array: AnyArray) -> AnyArray:
    """Mirror image of an array, with right and left exchanged."""
    forward, starboard, down = array.offset
    changes: dict[str, object] = {"offset": (forward, -starboard, down)}
    if isinstance(array, ElementArray | ArcArray):
        changes |= array.mirror_image_fields()
    elif not isinstance(array, PointTransducer) and array.steer is not None:
        changes["steer"] = tuple(-angle for angle in array.steer)
    return array.unchecked_copy(**changes)


def array_rotation(sonar: Sonar, body: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axes of the transmit array in the world, and of the receive array if it has the same mounting.

    Args:
        sonar: The sonar; only its mounting matters.
        body: Axes of the platform in the world as columns, shape (3, 3), as from `Poses.rotation`.

    Returns:
        Boresight, right and down as rows in north, east, down [1], shape (3, 3).

    Example:
        >>> from insonify.frames import pose_rotation
        >>> pulse, point = Pulse(frequency="100 kHz", duration="1 ms"), PointTransducer()
        >>> down = Mounting(bearing="90 deg", tilt="30 deg")
        >>> sonar = Sonar(source_level_db=200, pulse=pulse, transmit=point, receive=point, mounting=down)
        >>> array_rotation(sonar, pose_rotation(heading=0.0))[0].round(3).tolist()  # boresight
        [0.0, 0.866, 0.5]
    """
    return array_axes(body, _mounting_axes(sonar.mounting.bearing, sonar.mounting.tilt))


@lru_cache(maxsize=64)
def _mounting_axes(bearing: float, tilt: float) -> NDArray[np.float64]:
    """Read-only `mounting_rotation` of one array, the same at all pings."""
    axes = mounting_rotation(bearing, tilt)
    axes.flags.writeable = False
    return axes


def receiver_rotation(sonar: Sonar, body: NDArray[np.float64]) -> NDArray[np.float64]:
    """Axes of the receive array in the world, see `array_rotation`.

    Args:
        sonar: The sonar; only the mounting of its receive array matters.
        body: Axes of the receiver's platform in the world as columns, shape (3, 3).
    """
    mounting = receiver_mounting(sonar)
    return array_axes(body, _mounting_axes(mounting.bearing, mounting.tilt))


def receiver_mounting(sonar: Sonar) -> Mounting:
    """Orientation of the receive array on its platform."""
    return sonar.mounting if sonar.receive_mounting is None else sonar.receive_mounting


def array_position(array: AnyArray, position: NDArray[np.float64], body: NDArray[np.float64]) -> NDArray[np.float64]:
    """Position of an array's centre in the world frame [m].

    Args:
        array: The array; only its offset matters.
        position: Platform's reference point in north, east, down [m], shape (3,).
        body: Axes of the platform in the world as columns, shape (3, 3).

    Returns:
        Centre of the array in north, east, down [m], shape (3,).

    Example:
        >>> from insonify.frames import pose_rotation
        >>> east = pose_rotation(heading=np.radians(90))
        >>> array_position(PointTransducer(offset=(2, 0, "0.5 m")), np.array([0.0, 0.0, 5.0]), east).round(3).tolist()
        [0.0, 2.0, 5.5]
    """
    return np.asarray(position + body @ np.asarray(array.offset))


def channel_positions(sonar: Sonar) -> NDArray[np.float64]:
    """Receive position of each channel on its platform: its element, or the centre of its array.

    Args:
        sonar: The sonar, with all its sides.

    Returns:
        Forward, starboard, down from the platform's reference point [m], shape (channels, 3); nominal, without errors.
    """
    rows = []
    for side in sonar.side_sonars:
        position = np.zeros((side.beam_count, 3))
        if side.receiver.record == "elements":
            mounting = receiver_mounting(side)
            position = element_layout(side.receive)[0] @ mounting_rotation(mounting.bearing, mounting.tilt)
        rows.append(position + np.asarray(side.receive.offset))
    return np.concatenate(rows)
