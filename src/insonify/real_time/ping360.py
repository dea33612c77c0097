"""Ping360: a mechanically scanned sonar, as its clients see it."""

import struct
import time
from typing import Any

import numpy as np

from insonify.real_time.ping_device import DEVICE_NUMBERS, PingDevice, in_range
from insonify.real_time.ping_protocol import Message

SET_DEVICE_ID, DEVICE_DATA, AUTO_DEVICE_DATA = 2000, 2300, 2301
RESET, TRANSDUCER, AUTO_TRANSMIT, MOTOR_OFF = 2600, 2601, 2602, 2903
PERIOD = 25e-9
"""Unit of the sample period [s]."""
GRADIANS = 400
"""Angles of a full turn."""
SAMPLES, PERIODS, FREQUENCIES, DURATIONS = (200, 1200), (80, 40_000), (500, 1000), (1, 1000)
"""Least and greatest number of samples, sample period [25 ns], frequency [kHz] and pulse duration [us]."""
GAIN_DB = (-20.0, 0.0, 20.0)
"""Gains of the settings low, normal and high [dB]: the maker publishes none."""
MEASURED = struct.Struct("<BBHHHHHH")
AUTO_MEASURED = struct.Struct("<BBHHHHHHBBHH")
SETTINGS = struct.Struct("<BBHHHHHBB")
AUTO_SETTINGS = struct.Struct("<BBHHHHHHBB")


class Ping360(PingDevice):
    """A Ping360; angle 0 is the bearing that the scenario mounts the sonar at, and angles grow to starboard."""

    device_type = 2

    def __init__(self, scenario: Any, host: str = "127.0.0.1", port: int = 0, **options: Any) -> None:
        """Prepare the sonar; arguments as those of `PingDevice`."""
        super().__init__(scenario, host, port, **options)
        self._initial()

    def _initial(self) -> None:
        pulse, stop = self._scenario.sonar.pulse, self._scenario.track.window[1]
        self._gain, self._angle, self._scan = 1, 0, (0, GRADIANS - 1, 1, 0)
        self._frequency, self._duration = round(pulse.frequency / 1e3), round(pulse.duration * 1e6)
        self._count, self._sense = SAMPLES[1], 1
        self._period = int(np.clip(round(stop / self._count / PERIOD), *PERIODS))
        self._own = (self._frequency, self._duration)
        self._data = b""
        self._reader = None

    def report(self, number: int) -> bytes | None:
        """Payload of the last measurement, or of general information."""
        if number == DEVICE_DATA:
            head = MEASURED.pack(1, self._gain, self._angle, self._duration, self._period, self._frequency,
                                 self._count, len(self._data))  # fmt: skip
            return head + self._data
        if number == AUTO_DEVICE_DATA:
            head = AUTO_MEASURED.pack(1, self._gain, self._angle, self._duration, self._period, self._frequency,
                                      *self._scan, self._count, len(self._data))  # fmt: skip
            return head + self._data
        return super().report(number)

    def command(self, message: Message) -> list[Message] | None:
        """Set and transmit, scan a sector, or stop."""
        if message.number == TRANSDUCER:
            _, gain, angle, duration, period, frequency, count, transmit, _ = SETTINGS.unpack(message.payload)
            in_range("angle", angle, (0, GRADIANS - 1))
            self._set(gain, duration, period, frequency, count)
            self._angle = angle
            self._data = self._measure() if transmit else b""
            return [Message(DEVICE_DATA, self.report(DEVICE_DATA) or b"")]
        if message.number == AUTO_TRANSMIT:
            _, gain, duration, period, frequency, count, *scan = AUTO_SETTINGS.unpack(message.payload)
            first, last, step, delay = scan
            for angle in (first, last):
                in_range("angle", angle, (0, GRADIANS - 1))
            in_range("num_steps", step, (1, 10))
            in_range("delay", delay, (0, 100))
            self._set(gain, duration, period, frequency, count)
            self._scan = first, last, step, delay
            self._angle, self._sense, self._due, self._reader = first, 1, time.monotonic(), self._sender
            return []
        if message.number == MOTOR_OFF:
            self._reader = None
            return [self.acknowledgement(MOTOR_OFF)]
        if message.number == RESET:
            struct.unpack("<BB", message.payload)
            self._initial()
            return [self.acknowledgement(RESET)]
        if message.number == SET_DEVICE_ID:
            number, _ = struct.unpack("<BB", message.payload)
            self.number_of_device = in_range("id", number, DEVICE_NUMBERS)
            return [self.acknowledgement(SET_DEVICE_ID)]
        return super().command(message)

    def stream(self) -> list[Message]:
        """Measurement at the next angle of the sector; at its end the head turns back, or goes on round."""
        first, last, step, delay = self._scan
        self._data = self._measure()
        sent = Message(AUTO_DEVICE_DATA, self.report(AUTO_DEVICE_DATA) or b"")
        width = (last - first) % GRADIANS
        if width == GRADIANS - 1:
            self._angle = (self._angle + step) % GRADIANS
        else:
            along = (self._angle - first) % GRADIANS
            if not 0 <= along + self._sense * step <= width:
                self._sense = -self._sense
            along = min(max(along + self._sense * step, 0), width)
            self._angle = (first + along) % GRADIANS
        self._due = time.monotonic() + delay / 1e3
        return [sent]

    def _set(self, gain: int, duration: int, period: int, frequency: int, count: int) -> None:
        """Settings, all of them or, where one is out of range, none."""
        in_range("gain_setting", gain, (0, 2))
        if (frequency, duration) != self._own:  # a scenario may have a pulse that the device has not
            in_range("transmit_frequency", frequency, FREQUENCIES)
            in_range("transmit_duration", duration, DURATIONS)
        in_range("sample_period", period, PERIODS)
        in_range("number_of_samples", count, SAMPLES)
        self._gain, self._duration, self._period, self._frequency, self._count = (
            gain, duration, period, frequency, count
        )  # fmt: skip

    def _measure(self) -> bytes:
        """Samples of one ping at the present angle."""
        pulse, stop = self._scenario.sonar.pulse, self._count * self._period * PERIOD
        changes: dict[str, Any] = {}
        if self._frequency != round(pulse.frequency / 1e3):
            changes["sonar.pulse.frequency"] = self._frequency * 1e3
        if self._duration != round(pulse.duration * 1e6):
            changes["sonar.pulse.duration"] = self._duration * 1e-6
        if stop > self._scenario.track.window[1] * (1 + 1e-3):
            changes["track.window"] = (self._scenario.track.window[0], stop)
        time_axis, power = self.intensity(self._angle * 2 * np.pi / GRADIANS, changes)
        at = (np.arange(self._count) + 0.5) * self._period * PERIOD
        return self.samples(np.interp(at, time_axis, power, left=0.0, right=0.0), GAIN_DB[self._gain])
