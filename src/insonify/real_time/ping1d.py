"""Ping1D: a single-beam echosounder, as its clients see it."""

import struct
import time
from typing import Any

import numpy as np

from insonify.real_time.ping_device import DEVICE_NUMBERS, FIRMWARE, PingDevice, in_range
from insonify.real_time.ping_protocol import Message

SETS = {1000: "B", 1001: "II", 1002: "I", 1003: "B", 1004: "H", 1005: "B", 1006: "B"}
"""Payloads of the commands that set a value, by number."""
PROFILE, CONTINUOUS_START, CONTINUOUS_STOP = 1300, 1400, 1401
POINTS = 200
"""Points of a profile."""
GAINS = (0.6, 1.8, 5.5, 12.9, 30.2, 66.1, 144.0)
"""Gains of the settings, from the message definitions [1]."""
MIDDLE = 3
DETECTED = 0.25
"""Intensity of the first return as a part of the highest [1]."""
SURE_DB = 20.0
"""Height of the return above the median of the profile at which confidence is 100 % [dB]."""


class Ping1D(PingDevice):
    """A Ping1D; its distance is that of the first return within 6 dB of the highest one in the scan range."""

    device_type = 1

    def __init__(self, scenario: Any, host: str = "127.0.0.1", port: int = 0, **options: Any) -> None:
        """Prepare the sonar; arguments as those of `PingDevice`."""
        super().__init__(scenario, host, port, **options)
        speed = scenario.water.sound_speed
        longest = round(1e3 * speed * scenario.track.window[1] / 2)
        self._range, self._speed, self._auto, self._enabled = (0, longest), round(1e3 * speed), 1, 1
        self._whole, self._interval, self._gain, self._pings = self._range, 100, MIDDLE, 0
        self._distance, self._confidence, self._profile = 0, 0, bytes(POINTS)

    def report(self, number: int) -> bytes | None:
        """Payload of a setting, of a measurement (made when it is requested), or of general information."""
        settings = {
            1200: ("BBHH", (1, 1, *FIRMWARE[:2])), 1201: ("B", (self.number_of_device,)), 1202: ("H", (5000,)),
            1203: ("I", (self._speed,)), 1204: ("II", self._range), 1205: ("B", (self._auto,)),
            1206: ("H", (self._interval,)), 1207: ("I", (self._gain,)), 1208: ("H", (self._duration,)),
            1210: ("HHHHBB", (*FIRMWARE[:2], 5000, self._interval, self._gain, self._auto)), 1213: ("H", (2500,)),
            1214: ("H", (2500,)), 1215: ("B", (self._enabled,)),
        }  # fmt: skip
        if number in settings:
            form, values = settings[number]
            return struct.pack(f"<{form}", *values)
        if number not in (1211, 1212, PROFILE):
            return super().report(number)
        if self._enabled:
            self._measure()
        if number == 1211:
            return struct.pack("<IB", self._distance, self._confidence)
        head = struct.pack("<IHHIIII", self._distance, self._confidence, self._duration, self._pings, *self._range,
                           self._gain)  # fmt: skip
        return head if number == 1212 else head + struct.pack("<H", POINTS) + self._profile

    def command(self, message: Message) -> list[Message] | None:
        """Set a value; begin or end to send profiles."""
        if message.number in SETS:
            self._set(message.number, *struct.unpack(f"<{SETS[message.number]}", message.payload))
            return [self.acknowledgement(message.number)]
        if message.number in (CONTINUOUS_START, CONTINUOUS_STOP):
            (number,) = struct.unpack("<H", message.payload)
            if number != PROFILE:
                raise ValueError(f"message {number} is not sent continuously; {PROFILE} is")
            self._reader, self._due = self._sender if message.number == CONTINUOUS_START else None, time.monotonic()
            return [self.acknowledgement(message.number)]
        return super().command(message)

    def stream(self) -> list[Message]:
        """A profile."""
        self._due = time.monotonic() + self._interval / 1e3
        return [Message(PROFILE, self.report(PROFILE) or b"")]

    @property
    def _duration(self) -> int:
        return min(round(self._scenario.sonar.pulse.duration * 1e6), 65535)

    def _set(self, number: int, *values: int) -> None:
        first = values[0]
        if number == 1000:
            self.number_of_device = in_range("device_id", first, (0, DEVICE_NUMBERS[1]))
        elif number == 1001:
            if values[1] < 1000 or first + values[1] > 300_000:
                raise ValueError(f"scan_length is {values[1]} mm from {first} mm; give 1000 mm or more, up to 300 m")
            self._range = values[0], values[1]
        elif number == 1002:
            if not 1_000_000 <= first <= 2_000_000:
                raise ValueError(f"speed_of_sound is {first} mm/s, not 1000000 to 2000000")
            self._speed = first
        elif number == 1003:
            self._auto = int(first > 0)
        elif number == 1004:
            self._interval = max(first, 1)
        elif number == 1005:
            if first >= len(GAINS):
                raise ValueError(f"gain_setting is {first}, not 0 to {len(GAINS) - 1}")
            self._gain = first
        else:
            self._enabled = int(first > 0)

    def _measure(self) -> None:
        """Profile of one ping, its distance and confidence."""
        if self._auto:
            self._range = self._whole
        begin, length = (value / 1e3 for value in self._range)
        speed, window = self._speed / 1e3, self._scenario.track.window
        stop = 2 * (begin + length) / speed
        changes = {"track.window": (window[0], stop)} if stop > window[1] * (1 + 1e-3) else {}
        axis, power = self.intensity(0.0, changes)
        distance = axis * speed / 2
        inside = (distance >= begin) & (distance <= begin + length)
        self._pings += 1
        point = begin + (np.arange(POINTS) + 0.5) * length / POINTS
        self._profile = self.samples(
            np.interp(point, distance, power, left=0.0, right=0.0), 20 * np.log10(GAINS[self._gain] / GAINS[MIDDLE])
        )
        if not inside.any() or power[inside].max() <= 0:
            self._distance = self._confidence = 0
            return
        among = power[inside]
        first = int(np.argmax(among >= DETECTED * among.max()))
        above = 10 * np.log10(among.max() / max(float(np.median(among)), 1e-30))
        self._distance, self._confidence = (
            round(1e3 * distance[inside][first]),
            int(np.clip(100 * above / SURE_DB, 0, 100)),
        )
