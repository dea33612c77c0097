"""Recording: what the sonar writes down, over ping, channel and time, as a labelled dataset."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import xarray as xr
from numpy.typing import NDArray

FIELDS: dict[str, tuple[type, str, str]] = {
    "pressure": (np.complex64, "uPa", "received pressure, complex envelope, rms scale"),
    "intensity": (np.float64, "uPa^2", "expected mean-square pressure"),
}
"""Type, units and long name of what is recorded."""

COLUMNS: dict[str, tuple[tuple[str, ...], str, str]] = {
    "time": (("time",), "s", "time after the start of transmission"),
    "ping_time": (("ping",), "s", "start of transmission after the start of the track"),
    "steer": (("channel",), "rad", "steering of the beam, to the right of boresight"),
    "position": (("ping", "axis"), "m", "platform position: north, east, down"),
    "attitude": (("ping", "axis"), "rad", "platform heading, pitch, roll"),
}
"""Dimensions, units and long name of what stands beside it."""


@dataclass(frozen=True, slots=True)
class Layout:
    """What a recording will hold: everything but the sound."""

    field: Literal["pressure", "intensity"]
    """Complex pressure [uPa] or expected intensity [uPa^2]."""
    time: NDArray[np.float64]
    """Time of each sample after the start of its ping's transmission [s], shape (time,)."""
    ping_time: NDArray[np.float64]
    """Start of each ping's transmission after the start of the track [s], shape (ping,)."""
    steer: NDArray[np.float64]
    """Steering of each channel, to the right of boresight [rad], shape (channel,)."""
    position: NDArray[np.float64]
    """Platform at the start of each ping: north, east, down [m], shape (ping, 3)."""
    attitude: NDArray[np.float64]
    """Platform's heading, pitch, roll at the start of each ping [rad], shape (ping, 3)."""

    def __post_init__(self) -> None:
        """Refuse columns of unequal length."""
        rows = (self.ping_time.size, 3)
        for name in ("position", "attitude"):
            shape = getattr(self, name).shape
            if shape != rows:
                raise ValueError(f"Layout.{name} has shape {shape}; {self.ping_time.size} pings want {rows}")


def dataset(
    layout: Layout, attributes: Mapping[str, Any], data: NDArray[np.generic], pings: NDArray[np.int64]
) -> xr.Dataset:
    """A recording in memory.

    Args:
        layout: What it holds.
        attributes: What describes it as a whole.
        data: Pressure [uPa] or intensity [uPa^2], shape (pings wanted, channel, time).
        pings: Numbers of the pings wanted.

    Returns:
        A dataset in which every variable has units and a long name.
    """
    dtype, units, long_name = FIELDS[layout.field]
    about = {"units": units, "long_name": long_name}
    variables: dict[str, Any] = {layout.field: (("ping", "channel", "time"), np.asarray(data, dtype), about)}
    for name, (dims, unit, meaning) in COLUMNS.items():
        values = getattr(layout, name)
        variables[name] = (dims, values[pings] if dims[0] == "ping" else values, {"units": unit, "long_name": meaning})
    held = xr.Dataset(variables, coords={"ping": ("ping", pings, {"units": "1", "long_name": "number of the ping"})})
    return held.set_coords(["ping_time", "steer"]).assign_attrs(dict(attributes))
