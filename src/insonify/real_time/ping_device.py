"""UDP server that replies as a sonar with ping-protocol does, with echoes of a scenario."""

import socket
import struct
import time
import warnings
from abc import abstractmethod
from collections.abc import Callable, Mapping
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.frames import pose_rotation
from insonify.real_time import ping_protocol as protocol
from insonify.real_time.live_sonar import LiveSonar, live
from insonify.real_time.ping_protocol import Message
from insonify.real_time.socket_server import SocketServer
from insonify.scenario.scenario import Scenario
from insonify.sonar.track import true_poses

Floats = NDArray[np.float64]
PoseFunction = Callable[[float], Mapping[str, Any]]

FIRMWARE = (3, 29, 0)
SPAN_DB = 60.0
"""Levels between the samples 0 and 255 [dB]."""
FULL_SCALE_BELOW_SOURCE_DB = 40.0
"""Level of the sample 255 at the middle gain, below the source level [dB]: the maker publishes none."""

DEVICE_NUMBERS = (1, 254)
"""Least and greatest number of a device: 0 is unknown, 255 addresses all."""
MAX_MESSAGES = 16
"""Messages of one datagram that get replies: each may take a ping, and a datagram holds thousands."""


SECONDS_AFTER_FAILURE = 0.5
"""Time from a ping that failed to the next one that is sent unasked [s]: refusals are no flood."""


class PingDevice(SocketServer):
    """A sonar at a UDP port; closes with its context, or by `close`. Its samples are levels, 60 dB in 255 steps."""

    device_type = 0
    """Type in the device information."""
    number_of_device = 1

    def __init__(
        self, scenario: Scenario, host: str = "127.0.0.1", port: int = 0, *, pose: PoseFunction | None = None,
        threads: int | None = None,
    ) -> None:  # fmt: skip
        """Prepare the sonar and bind its port; it serves from `start` or `serve_forever` on.

        Args:
            scenario: What is simulated; channel 0 is the device's.
            host: Address to bind to; the loopback address by default.
            port: Port; 0: any that is free.
            pose: Arguments `position`, `attitude` and others of `LiveSonar.ping` at a time since the start [s]; None:
                the platform runs along the scenario's track.
            threads: Number of threads; all cores by default.

        Raises:
            OSError: Address or port cannot be bound.
        """
        self._scenario, self._threads = scenario, threads
        self._pose = pose or (lambda elapsed: track_pose(scenario, elapsed))
        self._settings: dict[str, Any] = {}
        self._sonar = live(scenario, threads=threads)
        self._begin = time.monotonic()
        bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        bound.bind((host, port))
        super().__init__(bound)
        self._reader: Any = None
        self._due = 0.0

    def serve_forever(self) -> None:
        """Serve until `close`."""
        while not self._stopped.is_set():
            wait = 0.1 if self._reader is None else min(max(self._due - time.monotonic(), 1e-4), 0.1)
            self._socket.settimeout(wait)
            try:
                datagram, sender = self._socket.recvfrom(1 << 16)
            except TimeoutError:
                datagram, sender = b"", None
            except OSError:
                if self._stopped.is_set():
                    return
                continue
            for message in islice(protocol.messages(datagram), MAX_MESSAGES):
                if not self._stopped.is_set():
                    self._send(self._replies(message, sender), sender)
            if self._reader is not None and time.monotonic() >= self._due:
                sent = self._guarded(0, self.stream)
                self._send(sent, self._reader)
                if any(message.number == protocol.NACK for message in sent):
                    self._due = time.monotonic() + SECONDS_AFTER_FAILURE

    def close(self) -> None:
        """Release the port and end the sonar."""
        self._stopped.set()
        self._join()
        self._socket.close()
        self._sonar.close()

    def report(self, number: int) -> bytes | None:
        """Payload of a message that was requested; None: the device has no such message."""
        if number == protocol.DEVICE_INFORMATION:
            return struct.pack("<6B", self.device_type, 1, *FIRMWARE, 0)
        return struct.pack("<4B", 1, 0, 0, 0) if number == protocol.PROTOCOL_VERSION else None

    def command(self, message: Message) -> list[Message] | None:
        """Replies to a command; None: the device has no such command."""
        if message.number != protocol.SET_ANY_DEVICE_ID:
            return None
        (number,) = struct.unpack("<B", message.payload)
        self.number_of_device = in_range("device_id", number, DEVICE_NUMBERS)
        return [self.acknowledgement(message.number)]

    @abstractmethod
    def stream(self) -> list[Message]:
        """Messages that are sent unasked, when they are due."""

    def acknowledgement(self, number: int) -> Message:
        """Message that a command was obeyed."""
        return Message(protocol.ACK, struct.pack("<H", number))

    def intensity(self, head_angle: float, changes: Mapping[str, Any]) -> tuple[Floats, Floats]:
        """Simulate a ping.

        Args:
            head_angle: Angle by which the head is turned about the platform's down axis, to starboard [rad].
            changes: Values of the scenario that the device's settings change, by their keys.

        Returns:
            Times after transmission [s] and mean-square pressures of channel 0 [uPa^2], each of shape (samples,).
        """
        self._prepare(dict(changes))
        elapsed = time.monotonic() - self._begin
        recording = self._sonar.ping(elapsed, **_with_head(self._pose(elapsed), head_angle))
        field = "pressure" if "pressure" in recording else "intensity"
        values = recording[field].values[0, 0]
        power = np.abs(values.astype(np.complex128)) ** 2 if field == "pressure" else values
        return recording["time"].values, np.asarray(power, float)

    def samples(self, intensity: Floats, gain_db: float) -> bytes:
        """Samples of 8 bits.

        Args:
            intensity: Mean-square pressure [uPa^2], shape (n,).
            gain_db: Gain above that of the middle setting [dB].
        """
        full = self._scenario.sonar.source_level_db - FULL_SCALE_BELOW_SOURCE_DB - gain_db
        level = 10 * np.log10(np.maximum(intensity, 1e-30))
        return np.clip(np.rint(255 * (1 + (level - full) / SPAN_DB)), 0, 255).astype(np.uint8).tobytes()

    def _prepare(self, changes: dict[str, Any]) -> None:
        """Prepare the scenario anew where the device's settings have changed."""
        if changes == self._settings:
            return
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            changed: LiveSonar = live(self._scenario.with_(changes) if changes else self._scenario,
                                      threads=self._threads)  # fmt: skip
        self._sonar.close()
        self._sonar, self._settings = changed, changes

    def _replies(self, message: Message, sender: Any) -> list[Message]:
        """Replies to one message: that requested, those of a command, or a refusal."""
        number = message.number
        if number == protocol.GENERAL_REQUEST:
            if len(message.payload) != 2:
                return [_refusal(number, "a request has the number of a message")]
            (number,) = struct.unpack("<H", message.payload)
            return self._guarded(number, lambda: self._requested(number))
        self._sender = sender
        # a message without payload may be a request, in the older form
        return self._guarded(
            number, lambda: (None if message.payload else self._requested(number)) or self.command(message)
        )

    def _requested(self, number: int) -> list[Message] | None:
        payload = self.report(number)
        return None if payload is None else [Message(number, payload)]

    def _guarded(self, number: int, reply: Callable[[], list[Message] | None]) -> list[Message]:
        """Replies, or a refusal with its reason."""
        try:
            result = reply()
        except struct.error:
            return [_refusal(number, "the message has another length")]
        except Exception as fault:  # no ping that fails ends the device
            return [_refusal(number, str(fault))]
        return [_refusal(number, "there is no such message")] if result is None else result

    def _send(self, replies: list[Message], reader: Any) -> None:
        for message in replies:
            try:
                self._socket.sendto(protocol.packed(message._replace(source=self.number_of_device)), reader)
            except OSError:  # the port is closed
                continue


def in_range(name: str, value: int, limits: tuple[int, int]) -> int:
    """Value of a setting.

    Args:
        name: Its name in the message definitions.
        value: Its value.
        limits: Least and greatest value.

    Raises:
        ValueError: The value is out of range.
    """
    if not limits[0] <= value <= limits[1]:
        raise ValueError(f"{name} is {value}, not {limits[0]} to {limits[1]}")
    return value


def track_pose(scenario: Scenario, elapsed: float) -> dict[str, Any]:
    """Arguments of `LiveSonar.ping` of a platform that runs along a scenario's track.

    Args:
        scenario: What is simulated.
        elapsed: Time since the first ping [s].
    """
    stop = scenario.track.window[1]
    moments = [true_poses(scenario.track, seed=scenario.seed, after=elapsed + t) for t in (0.0, stop / 2, stop)]
    (position, attitude), *later = [(poses.position[0], poses.attitude[0]) for poses in moments]
    return {"position": position, "attitude": attitude, "window_poses": tuple(later)}


def _with_head(pose: Mapping[str, Any], angle: float) -> dict[str, Any]:
    """The pose of a platform that is turned with the head on it."""
    turned = dict(pose) | {"attitude": _turned(pose.get("attitude", (0.0, 0.0, 0.0)), angle)}
    if pose.get("window_poses") is not None:
        turned["window_poses"] = tuple(
            (position, _turned(attitude, angle)) for position, attitude in pose["window_poses"]
        )
    elif pose.get("turn_rate") is None:
        turned["turn_rate"] = (0.0, 0.0, 0.0)  # the head stands while it receives
    return turned


def _turned(attitude: Any, angle: float) -> Floats:
    """Heading, pitch, roll of a platform turned about its own down axis [rad], shape (3,)."""
    c, s = np.cos(angle), np.sin(angle)
    heading, pitch, roll = (np.array([value], float) for value in attitude)
    body = pose_rotation(heading, pitch, roll)[0] @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.array([
        np.arctan2(body[1, 0], body[0, 0]), -np.arcsin(np.clip(body[2, 0], -1, 1)), np.arctan2(body[2, 1], body[2, 2])
    ])  # fmt: skip


def _refusal(number: int, reason: str) -> Message:
    return Message(protocol.NACK, struct.pack("<H", number) + reason.encode("ascii", "replace")[:200])
