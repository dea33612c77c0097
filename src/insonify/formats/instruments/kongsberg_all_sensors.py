"""Datagrams of other sensors in Kongsberg .all files: clock, height, heading, sound speed, tide, tilt, attitude.

Kongsberg (2018), EM series multibeam echo sounders, datagram formats, 850-160692/W, tables 34 to 42 and 48.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.formats.instruments import kongsberg_all_layouts as layouts
from insonify.formats.instruments.columns import DEGREE, Column

HEAD = layouts.HEADER.itemsize
ATTITUDE = layouts.highest_is_none(layouts.ATTITUDE, (
    Column("roll", "roll", "rad", "roll, positive starboard down", 0.01 * DEGREE),
    Column("pitch", "pitch", "rad", "pitch, positive bow up", 0.01 * DEGREE),
    Column("yaw", "yaw", "rad", "heading", 0.01 * DEGREE),
    Column("heave", "heave", "m", "heave, positive down", 0.01),
))  # fmt: skip
"""Variables of both kinds of attitude datagrams."""


class Sensor(NamedTuple):
    """One kind of datagram: name, records, variables, seconds of a step of the time field, and a count in front."""

    name: str
    layout: np.dtype[Any]
    columns: tuple[Column, ...]
    step: float = 0.0
    """Seconds of one step of the field `elapsed`, 0 of a datagram with one reading at its own time."""


_STATED = {
    "C": Sensor("clock", layouts.CLOCK, (
        Column("external_date", "date", "code", "date of the external clock, such as 20221109"),
        Column("external_time", "milliseconds", "s", "time of the day of the external clock", 1e-3),
        Column("synchronised", "pps", "code", "0 without a pulse per second"))),
    "h": Sensor("height", layouts.HEIGHT, (
        Column("height", "height", "m", "height of the water level, or depth of a depth sensor", 0.01),
        Column("height_type", "type", "code", "0 of the position system, 100 of depth datagrams, 200 depth sensor"))),
    "H": Sensor("heading", layouts.HEADING, (Column("heading", "heading", "rad", "heading", 0.01 * DEGREE),), 1e-3),
    "G": Sensor("sound speed at the transducer", layouts.SPEED, (
        Column("sound_speed", "sound_speed", "m/s", "sound speed at the transducer", 0.1),), 1.0),
    "T": Sensor("tide", layouts.TIDE, (Column("tide", "tide", "m", "tide offset", 0.01),)),
    "J": Sensor("tilt of the transducer", layouts.TILT, (
        Column("tilt", "tilt", "rad", "mechanical tilt of the transducer", 0.01 * DEGREE),), 1e-3),
    "E": Sensor("single-beam depth", layouts.SINGLE_BEAM, (
        Column("depth", "depth", "m", "depth of a single-beam echosounder below the water line", 0.01),)),
    "n": Sensor("attitude of the network", layouts.NETWORK_ATTITUDE, ATTITUDE, 1e-3),
}  # fmt: skip
SENSORS: Mapping[str, Sensor] = {
    kind: sensor._replace(columns=layouts.highest_is_none(sensor.layout, sensor.columns))
    for kind, sensor in _STATED.items()
}
"""Sensors by the kind of their datagrams."""


def readings(sensor: Sensor, content: bytes) -> NDArray[Any]:
    """Readings in a datagram, shape (n,).

    Args:
        sensor: One of `SENSORS`.
        content: The datagram.

    Raises:
        DatagramError: It is shorter than its counts state.
    """
    if not sensor.step:
        return layouts.ordered_records(content, sensor.layout, HEAD)
    count = int(layouts.ordered_records(content, np.dtype("<u2"), HEAD)[0])
    if sensor.layout != layouts.NETWORK_ATTITUDE:
        return layouts.ordered_records(content, sensor.layout, HEAD + 2, count)
    tables, offset = [], HEAD + 4
    for _ in range(count):  # each is followed by the message of the sensor
        tables.append(layouts.ordered_records(content, sensor.layout, offset))
        offset += sensor.layout.itemsize + int(tables[-1]["message"][0])
    return np.concatenate(tables) if tables else np.empty(0, sensor.layout)
