"""Recording: received pressure or expected intensity over ping, channel and time, as a labelled dataset."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import xarray as xr

FIELDS: dict[str, tuple[type, str, str]] = {
    "pressure": (np.complex64, "uPa", "received pressure, complex envelope, rms scale"),
    "intensity": (np.float64, "uPa^2", "expected mean-square pressure"),
}
"""Type, units and long name of the received quantities."""
RECORDED = {
    "uPa": "rms pressure behind the recorder's gain",
    "dB re 1 uPa": "level behind the recorder's gain",
    "1": "counts or fraction of full scale, as the instrument writes them",
}
"""Long names of the numbers of a recorder, `recorded` over (line, channel, bin), by their units."""
RECORDER_COLUMNS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "bin_time": (("bin",), "s", "time of the recorded bin after the start of transmission"),
    "line_ping": (("line",), "1", "first ping of the recorded line"),
}
"""Columns that accompany `recorded`."""

COLUMNS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "time": (("time",), "s", "time after the start of transmission"),
    "ping_time": (("ping",), "s", "start of transmission after the start of the track"),
    "steer": (("channel",), "rad", "steering of the beam, to the right of boresight"),
    "side": (("channel",), "1", "side of the platform: -1 port, 1 starboard, 0 where the sonar has no sides"),
    "element_position": (("channel", "axis"), "m", "position of the channel on its platform: forward, starboard, down"),
    "position": (("ping", "axis"), "m", "platform position: north, east, down"),
    "attitude": (("ping", "axis"), "rad", "platform heading, pitch, roll"),
    "logged_position": (("ping", "axis"), "m", "platform position as its navigation system logged it"),
    "logged_attitude": (("ping", "axis"), "rad", "platform heading, pitch, roll as its navigation system logged them"),
}
"""Dimensions, units and long name of the columns that accompany a recording."""
BISTATIC_COLUMNS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "receiver_position": (("ping", "axis"), "m", "receiver's platform: north, east, down"),
    "receiver_attitude": (("ping", "axis"), "rad", "receiver's platform: heading, pitch, roll"),
    "logged_receiver_position": (("ping", "axis"), "m", "receiver's platform as its navigation system logged it"),
    "logged_receiver_attitude": (
        ("ping", "axis"),
        "rad",
        "heading, pitch, roll of the receiver's platform as its navigation system logged them",
    ),
}
"""Further columns where the receiver has a platform of its own; `element_position` then refers to that platform."""
RANGE_COLUMNS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "slant_range": (("time",), "m", "slant range of a direct echo, half its path at the sound speed of the scenario")
}
"""Column of monostatic sonars only: between two platforms, a travel time is an ellipse."""
COORDINATES = ("ping_time", "slant_range", "steer", "side", "element_position", "bin_time", "line_ping")
"""Columns that are coordinates of pings, channels, times, and of a recorder's lines and bins."""
OPTIONAL_COLUMNS = ("side", "element_position", "logged_position", "logged_attitude")
"""Columns that recordings of earlier versions lack; their defaults: no side, element at the reference point, true
poses."""


@dataclass(frozen=True, slots=True)
class RecordingLayout:
    """Axes and platform data of a recording: everything but the recorded samples."""

    field: Literal["pressure", "intensity"]
    """Complex pressure [uPa] or expected intensity [uPa^2]."""
    time: NDArray[np.float64]
    """Time of each sample after the start of its ping's transmission [s], shape (time,)."""
    ping_time: NDArray[np.float64]
    """Start of each ping's transmission after the start of the track [s], shape (ping,)."""
    steer: NDArray[np.float64]
    """Steering of each channel, to the right of boresight [rad], shape (channel,)."""
    position: NDArray[np.float64]
    """True position of the platform at the start of each ping: north, east, down [m], shape (ping, 3)."""
    attitude: NDArray[np.float64]
    """Platform's true heading, pitch, roll at the start of each ping [rad], shape (ping, 3)."""
    logged_position: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """Position reported by the navigation system [m], shape (ping, 3); default: the true one."""
    logged_attitude: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """Heading, pitch, roll reported by the navigation system [rad], shape (ping, 3); default: the true ones."""
    side: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """Side of each channel: -1 port, 1 starboard, 0 none [1], shape (channel,); default: none."""
    element_position: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """Position of each channel (its element, or the centre of its array) from the platform's reference point: forward,
    starboard, down [m], shape (channel, 3); default: that point."""
    receiver_position: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """True position of the receiver's own platform at the start of each ping: north, east, down [m], shape (ping, 3);
    empty, as the next three columns, where one platform carries both ends."""
    receiver_attitude: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """True heading, pitch, roll of the receiver's own platform [rad], shape (ping, 3)."""
    logged_receiver_position: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """Position of the receiver's platform reported by its navigation system [m], shape (ping, 3); default: the true
    one."""
    logged_receiver_attitude: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """Heading, pitch, roll of the receiver's platform reported by its navigation system [rad], shape (ping, 3);
    default: the true ones."""

    slant_range: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """Slant range of a direct echo at each time [m], shape (time,); empty: not known, or a receiver on a platform of
    its own."""
    bin_time: NDArray[np.float64] = dataclasses.field(default_factory=lambda: np.empty(0))
    """Time of each bin of a recorder's lines [s], shape (bin,); empty: no recorder."""
    line_ping: NDArray[np.int64] = dataclasses.field(default_factory=lambda: np.empty(0, np.int64))
    """First ping of each of its lines [1], shape (line,)."""
    recorded_units: str = ""
    """Units of its numbers."""
    keeps_field: bool = True
    """False: its numbers alone are kept."""

    def __post_init__(self) -> None:
        """Fill in defaults; refuse columns of unequal length."""
        defaults = {
            "element_position": np.zeros((self.steer.size, 3)),
            "logged_position": self.position,
            "logged_attitude": self.attitude,
            "logged_receiver_position": self.receiver_position,
            "logged_receiver_attitude": self.receiver_attitude,
            "side": np.zeros(self.steer.shape),
        }
        for name, values in defaults.items():
            if not getattr(self, name).size:
                object.__setattr__(self, name, values)
        rows, beams = (self.ping_time.size, 3), self.steer.shape
        bistatic = BISTATIC_COLUMNS if self.receiver_position.size else ()
        expected: dict[str, tuple[int, ...]] = {
            name: rows for name in ("position", "attitude", "logged_position", "logged_attitude", *bistatic)
        }
        element_shape = (*beams, 3)
        if self.slant_range.size:
            expected["slant_range"] = self.time.shape
        for name, shape in (expected | {"side": beams, "element_position": element_shape}).items():
            actual = getattr(self, name).shape
            if actual != shape:
                raise ValueError(f"RecordingLayout.{name} has shape {actual}; it should be {shape}")


def columns_of(layout: RecordingLayout) -> dict[str, tuple[tuple[str, ...], str, str]]:
    """Columns that accompany a recording, in the form of `COLUMNS`."""
    columns = COLUMNS | RANGE_COLUMNS if layout.slant_range.size else COLUMNS
    columns = columns | RECORDER_COLUMNS if layout.bin_time.size else columns
    return columns | BISTATIC_COLUMNS if layout.receiver_position.size else columns


def coordinates_of(layout: RecordingLayout) -> list[str]:
    """Names of the columns of a recording that are among `COORDINATES`."""
    return [name for name in COORDINATES if name in columns_of(layout)]


def recording_dataset(
    layout: RecordingLayout, attributes: Mapping[str, Any], data: NDArray[np.generic], pings: NDArray[np.int64],
    *, of_pings: bool = False,
) -> xr.Dataset:  # fmt: skip
    """A recording in memory, as a labelled dataset.

    Args:
        layout: Layout of the recording.
        attributes: Attributes of the dataset.
        data: Pressure [uPa] or intensity [uPa^2], shape (selected pings, channel, time).
        pings: Numbers of the selected pings.
        of_pings: True: the layout is that of these pings alone. False: of the whole track.

    Returns:
        A dataset in which every variable has units and a long name.
    """
    from insonify.records.netcdf_recording import Recording

    dtype, units, long_name = FIELDS[layout.field]
    attrs = {"units": units, "long_name": long_name}
    variables: dict[str, Any] = {layout.field: (("ping", "channel", "time"), np.asarray(data, dtype), attrs)}
    for name, (dims, unit, meaning) in columns_of(layout).items():
        column = getattr(layout, name)
        values = column[pings] if dims[0] == "ping" and not of_pings else column
        variables[name] = (dims, values, {"units": unit, "long_name": meaning})
    recording = Recording(
        variables, coords={"ping": ("ping", pings, {"units": "1", "long_name": "number of the ping"})}
    )
    return recording.set_coords(coordinates_of(layout)).assign_attrs(dict(attributes))
