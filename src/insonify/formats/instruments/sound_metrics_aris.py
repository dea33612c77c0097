"""Sound Metrics ARIS: frames of an acoustic camera, beams by samples.

Sound Metrics (2018), ARIS File SDK, "Understanding ARIS Data" and the definitions of its headers. A file header and the
header of each frame take 1024 bytes and carry the mark "DDF", 5; there is no checksum. A count of 0 to 255 stands for 0
to 80 dB. Beam 0 is the rightmost.
"""

import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments.columns import (
    DEGREE,
    Column,
    ping_dataset,
    stacked,
    time_dataset,
    variable,
    variables,
)
from insonify.formats.instruments.instrument_file import (
    DatagramError,
    Instrument,
    InstrumentFile,
    Setting,
    records,
    require_memory,
)

MARK = b"DDF\x05"
HEADER_SIZE = 1024
_FIELDS = {
    "index": ("<u4", 0), "time": ("<u8", 4), "mark": ("S4", 12), "gain": ("<u4", 68), "focus": ("<u4", 84),
    "depth": ("<f4", 128), "yaw": ("<f4", 160), "pitch": ("<f4", 164), "roll": ("<f4", 168), "latitude": ("<f8", 172),
    "longitude": ("<f8", 180), "temperature": ("<f4", 224), "pan": ("<f4", 244), "tilt": ("<f4", 248),
    "ping_mode": ("<u4", 436), "high_frequency": ("<u4", 440), "pulse_width": ("<u4", 444),
    "cycle_period": ("<u4", 448), "sample_period": ("<u4", 452), "transmitting": ("<u4", 456),
    "frame_rate": ("<f4", 460), "sound_speed": ("<f4", 464), "samples": ("<u4", 468), "full_power": ("<u4", 472),
    "start_delay": ("<u4", 476), "telephoto": ("<u4", 480), "system": ("<u4", 484), "serial": ("<u4", 488),
    "ordered": ("<u4", 516), "salinity": ("<u4", 520),
}  # fmt: skip
FRAME = np.dtype(
    {
        "names": list(_FIELDS),
        "formats": [kind for kind, _ in _FIELDS.values()],
        "offsets": [position for _, position in _FIELDS.values()],
        "itemsize": HEADER_SIZE,
    }
)
"""Fields of the header of a frame that are read."""
BEAMS = (0, 48, 48, 96, 96, 96, 64, 64, 64, 128, 128, 128, 128)
"""Number of beams of each ping mode."""
MODELS = {0: ("ARIS 1800", 1.1e6, 1.8e6), 1: ("ARIS 3000", 1.8e6, 3e6), 2: ("ARIS 1200", 0.7e6, 1.2e6)}
"""Name, lower and higher frequency [Hz] of each system, from the maker's data sheets."""
_UNKNOWN = ("ARIS", np.nan, np.nan)
CHANNEL_BEAM = np.array([10, 2, 14, 6, 8, 0, 12, 4, 11, 3, 15, 7, 9, 1, 13, 5])
"""Position of each of the 16 channels of one transmission among the beams that it forms."""
LENSES = {
    (48, False): (16.0901, -3.3308, 0.8195),
    (96, False): (16.3222, -3.2622, 0.7569),
    (64, False): (15.0083, -0.0585, -0.0609),
    (128, False): (15.1319, -0.0648, -0.0537),
    (48, True): (7.5101, -0.1277, -0.0445),
    (96, True): (7.5912, -0.1249, -0.0488),
}
"""Odd polynomial [deg] in the position from -1 to 1 along the array that the lens of so many beams, telephoto or not,
maps to angles: fitted to the maker's tables, within 0.07 deg for 96 beams without telephoto lens, else 0.01 deg."""
DECIBELS_PER_COUNT = 80 / 255
_COLUMNS = (
    Column("frame_index", "index", "code", "number of the frame in the recording"),
    Column("gain_db", "gain", "dB", "receiver gain"),
    Column("focus", "focus", "code", "position of the focus, 0 to 1000"),
    Column("depth", "depth", "m", "depth of the platform"),
    Column("temperature", "temperature", "degC", "temperature of the water"),
    Column("pan", "pan", "rad", "pan of the rotator", DEGREE),
    Column("tilt", "tilt", "rad", "tilt of the rotator", DEGREE),
    Column("ping_mode", "ping_mode", "code", "ping mode, 1 to 12"),
    Column("high_frequency", "high_frequency", "code", "1 at the higher frequency, 0 at the lower"),
    Column("pulse_length", "pulse_width", "s", "duration of the pulse", 1e-6),
    Column("cycle_period", "cycle_period", "s", "time between transmissions", 1e-6),
    Column("sample_interval", "sample_period", "s", "interval of samples", 1e-6),
    Column("first_delay", "start_delay", "s", "two-way travel time of sample 0", 1e-6),
    Column("transmitting", "transmitting", "code", "1 with transmission, 0 without"),
    Column("full_power", "full_power", "code", "1 at full, 0 at low transmit power"),
    Column("frame_rate", "frame_rate", "Hz", "rate of frames"),
    Column("sound_speed", "sound_speed", "m/s", "sound speed of the instrument"),
    Column("salinity", "salinity", "g/kg", "salinity as set: 0 fresh, 15 brackish, 35 sea"),
    Column("ordered", "ordered", "code", "1 where the file has the beams in order"),
)
_ATTITUDE = (
    Column("roll", "roll", "rad", "roll of the compass of the sonar", DEGREE),
    Column("pitch", "pitch", "rad", "pitch of the compass of the sonar", DEGREE),
    Column("yaw", "yaw", "rad", "heading of the compass of the sonar", DEGREE),
)
_POSITION = (
    Column("latitude", "latitude", "rad", "latitude", DEGREE),
    Column("longitude", "longitude", "rad", "longitude", DEGREE),
)


class SoundMetricsArisFile(InstrumentFile):
    """Frames of an ARIS file."""

    format = "Sound Metrics ARIS"
    suffixes = (".aris",)
    kinds: ClassVar[Mapping[str, str]] = {"file header": "recording", "frame": "image, attitude and settings"}

    @staticmethod
    def matches(head: bytes) -> bool:
        """Return True if a file may be of this format, by its first 2048 bytes."""
        return head.startswith(MARK)

    def _index(self) -> Iterator[tuple[int, int, str, float]]:
        if self._size < HEADER_SIZE or self._bytes(0, 4) != MARK:
            self._omit(0, "no file header with the mark DDF, version 5")
        else:
            yield 0, HEADER_SIZE, "file header", np.nan
        mark, offset = re.compile(re.escape(MARK)), HEADER_SIZE
        while offset < self._size:
            try:
                frame = _frame(self._bytes(offset, HEADER_SIZE))
                size = HEADER_SIZE + BEAMS[int(frame["ping_mode"])] * int(frame["samples"])
                if offset + size > self._size:
                    raise DatagramError(f"{size} bytes are stated, and the file has {self._size - offset} more")
            except DatagramError as fault:
                self._omit(offset, f"frame: {fault}")
                offset = max(self._find(mark, offset + 13) - 12, offset + 1)
                continue
            yield offset, size, "frame", float(frame["time"]) * 1e-6
            offset += size

    @property
    def groups(self) -> Mapping[str, int]:
        """Number of pings of each group of data."""
        count = self.datagrams.rows("frame").size
        return {"image": int(count)} if count else {}

    @cached_property
    def _first(self) -> Any:
        """Header of the first frame, None without frames."""
        rows = self.datagrams.rows("frame")
        return _frame(self._bytes(int(self.datagrams.offset[rows[0]]), HEADER_SIZE)) if rows.size else None

    @property
    def instrument(self) -> Instrument:
        """Maker, model and serial number."""
        if self._first is None:
            return Instrument("Sound Metrics", "ARIS")
        model = MODELS.get(int(self._first["system"]), _UNKNOWN)[0]
        return Instrument("Sound Metrics", model, str(self._first["serial"]))

    def read(self, group: str, pings: slice = slice(None)) -> xr.Dataset:
        """Read frames.

        Args:
            group: "image".
            pings: Some of its frames.

        Returns:
            `level_db` over (ping, beam, sample), 0 to 80 dB; the bearing of each beam, positive to the right, range of
            sample 0 and step of range; the settings of each frame.

        Raises:
            StoreError: There is no such group, or the frames need more memory than is allowed.
        """
        self._require_group(group)
        every = self.datagrams.rows("frame")
        require_memory(self.path, len(every[pings]), int(self.datagrams.size[every[pings]].max(initial=0)))
        by_row = dict(self._parsed(every[pings], _image))
        kept, headers = list(by_row), [header for header, _ in by_row.values()]
        columns = variables(headers, _COLUMNS, ("ping",))
        level = stacked([image for _, image in by_row.values()], axes=2)
        columns["level_db"] = variable(("ping", "beam", "sample"), level, "dB", "level of the echo")
        bearing = stacked([bearings(image.shape[0], bool(header["telephoto"])) for header, image in by_row.values()])
        columns["bearing"] = variable(("ping", "beam"), bearing, "rad", "bearing of the beam, positive to the right")
        tones = [MODELS.get(int(h["system"]), _UNKNOWN)[2 if h["high_frequency"] else 1] for h in headers]
        columns["frequency"] = variable("ping", np.array(tones, float), "Hz", "frequency of the model")
        half_speed = columns["sound_speed"].values / 2
        first, step = (columns[name].values * half_speed for name in ("first_delay", "sample_interval"))
        columns["first_range"] = variable("ping", first, "m", "range of sample 0")
        columns["range_step"] = variable("ping", step, "m", "step of range")
        return ping_dataset(group, np.searchsorted(every, kept), self.datagrams.time[kept], columns)

    def settings(self) -> tuple[Setting, ...]:
        """Settings of the first frame."""
        if self._first is None:
            return ()
        offset = int(self.datagrams.offset[self.datagrams.rows("frame")[0]])
        stated = variables([self._first], _COLUMNS, ("ping",))
        beams = BEAMS[int(self._first["ping_mode"])]
        values = {"beams": (beams, "1"), "samples": (int(self._first["samples"]), "1")}
        values |= {name: (column.values[0].item(), column.attrs["units"]) for name, column in stated.items()}
        return tuple(Setting(name, value, unit, "frame", offset) for name, (value, unit) in values.items())

    def navigation(self) -> xr.Dataset | None:
        """Latitude and longitude [rad] over time, None where no frame has any."""
        return self._over_time(_POSITION)

    def attitude(self) -> xr.Dataset | None:
        """Roll, pitch and yaw [rad] of the sonar's own compass over time, None where no frame has any."""
        return self._over_time(_ATTITUDE)

    def _over_time(self, columns: tuple[Column, ...]) -> xr.Dataset | None:
        rows = self.datagrams.rows("frame")
        headers = [np.array([_frame(self._bytes(int(self.datagrams.offset[row]), HEADER_SIZE))]) for row in rows]
        if not any(header[column.field].any() for header in headers for column in columns):
            return None
        return time_dataset(headers, self.datagrams.time[rows], columns)


def bearings(beams: int, telephoto: bool) -> NDArray[np.float64]:
    """Bearing of each beam of an ARIS [rad], positive to the right, shape (beams,).

    Args:
        beams: Number of beams.
        telephoto: True with the telephoto lens.
    """
    lens = LENSES.get((beams, telephoto))
    if lens is None:  # no such combination is sold
        lens = LENSES[(beams, False)]
    position = np.linspace(1.0, -1.0, beams)  # beam 0 is the rightmost
    return np.asarray(DEGREE * sum(factor * position ** (2 * power + 1) for power, factor in enumerate(lens)))


def _frame(content: bytes) -> Any:
    """Header of a frame, refused without its mark or with a ping mode that is none."""
    frame = records(content, FRAME, 0)[0]
    if frame["mark"] != MARK:
        raise DatagramError("no header with the mark DDF, version 5")
    if not 0 < frame["ping_mode"] < len(BEAMS) or not frame["samples"]:
        raise DatagramError(f"ping mode {frame['ping_mode']} with {frame['samples']} samples is none")
    return frame


def _image(content: bytes) -> tuple[Any, NDArray[np.float32]]:
    """Header of a frame and its levels [dB], shape (beams, samples)."""
    frame = _frame(content)
    beams, samples = BEAMS[int(frame["ping_mode"])], int(frame["samples"])
    if len(content) != HEADER_SIZE + beams * samples:
        raise DatagramError(f"{beams} beams of {samples} samples do not fill {len(content) - HEADER_SIZE} bytes")
    counts = np.frombuffer(content, np.uint8, beams * samples, HEADER_SIZE)
    if frame["ordered"]:
        image = counts.reshape(samples, beams).T
    else:  # as received: one transmission after the other, each with 16 channels
        raw = counts.reshape(beams // 16, samples, 16)
        image = np.empty((beams, samples), np.uint8)
        for shot in range(beams // 16):
            image[CHANNEL_BEAM * (beams // 16) + shot] = raw[shot].T
    return frame, image * np.float32(DECIBELS_PER_COUNT)
