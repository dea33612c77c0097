"""Sound-speed profile in a text table with a header.

Depth and speed, or depth, temperature and salinity; commas, semicolons or tabs; a row of
units or units in the header; lines that begin with # are comments. Every error names line and column.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from insonify.data_file import is_number, name_and_unit, table_rows
from insonify.ocean.profile import FASTEST, SLOWEST, SoundSpeedProfile
from insonify.units import UNITS

SALINITY_UNITS = {"g/kg": 1.0, "psu": 1.0, "ppt": 1.0, "1": 1.0, "-": 1.0}
QUANTITIES: dict[str, tuple[dict[str, float], float, float]] = {
    "depth": (UNITS["length"], -100.0, 12e3),
    "speed": (UNITS["speed"], SLOWEST, FASTEST),
    "temperature": ({**UNITS["temperature"], "°C": 1.0, "deg C": 1.0}, -6.0, 45.0),
    "salinity": (SALINITY_UNITS, 0.0, 45.0),
}
"""Units of each column, and the smallest and largest value of natural water."""
SYNONYMS = {"sound_speed": "speed", "sound speed": "speed", "sound_velocity": "speed"}


@dataclass(frozen=True, slots=True)
class _ProfileColumn:
    """Column of the table that is read: quantity, index and unit."""

    name: str
    index: int
    unit: str

    def value(self, text: str, where: str) -> float:
        """SI number of a cell (degC, g/kg), refused outside natural water; where: file and line for the message."""
        units, low, high = QUANTITIES[self.name]
        cell = f"{where}, column {self.index + 1} ({self.name})"
        try:
            number = float(text)
        except ValueError:
            point = text.replace(",", ".")
            hint = f" The decimal mark is a point: {point}." if text.count(",") == 1 and is_number(point) else ""
            advice = hint or " Write a plain number, such as 12.5."
            raise ValueError(f"{cell}: {text!r} is not a number.{advice}") from None
        number *= units[self.unit]
        if not low <= number <= high:
            raise ValueError(f"{cell}: {text} {self.unit} is not possible; natural water has {low:g} to {high:g}.")
        return number


def read_profile(path: str | Path, *, model: str = "teos10") -> SoundSpeedProfile:
    """Read a sound-speed profile from a table of comma-separated values.

    Args:
        path: File with a header naming the columns: depth and speed, or depth, temperature and
            salinity (a column of speed is preferred; other columns are ignored). Units in
            the header, "depth [m]", or in a row of their own; else m, m/s, degC and g/kg.
        model: Law that turns temperature and salinity into speed, as in `insonify.ocean.sound_speed`.

    Returns:
        The profile.

    Raises:
        FileNotFoundError: The file does not exist.
        ValueError: The table cannot be read; the message names file, line and column.

    Example:
        >>> cast = [(0.0, 18.0, 35.0), (20.0, 12.0, 35.0)]
        >>> np.savetxt("cast.csv", cast, delimiter=",", header="depth,temperature,salinity", comments="")
        >>> read_profile("cast.csv")
        SoundSpeedProfile: 2 knots, 0-20 m, 1496.9-1515.6 m/s
    """
    rows = table_rows(path, "depth,speed")
    line, header = next(rows, (1, []))
    columns = _columns(header, f"{path}, line {line}")
    table: list[list[float]] = []
    for line, row in rows:
        where = f"{path}, line {line}"
        if not table and (units := _units_row(row, columns, where)) is not None:
            columns = units
            continue
        table.append([column.value(row[column.index], where) for column in columns])
        if len(table) > 1 and table[-1][0] <= table[-2][0]:
            cell = f"{where}, column {columns[0].index + 1} (depth)"
            raise ValueError(
                f"{cell}: {table[-1][0]:g} m after {table[-2][0]:g} m; depths must increase. "
                f"{_depth_order_advice(*table[-2:])}"
            )
    if len(table) < 2:
        raise ValueError(f"{path}, line {line}: the file ends after {len(table)} row(s) of values; give at least two.")
    values = np.array(table).T
    if len(columns) == 2:
        return SoundSpeedProfile(*values)
    return SoundSpeedProfile.from_temperature_salinity(*values, model=model)


def _depth_order_advice(before: list[float], row: list[float]) -> str:
    """Remedy for a depth that does not increase, a sentence of the error message."""
    if row[0] == before[0]:
        return "Keep one row of each depth."
    if row[0] < 0:
        return "They are positive downwards: leave out the minus."
    return "Sort the rows."


def _columns(header: list[str], where: str) -> list[_ProfileColumn]:
    """Columns that are read, in the order depth, speed or depth, temperature, salinity."""
    by_name: dict[str, _ProfileColumn] = {}
    for index, title in enumerate(header):
        name, unit = name_and_unit(title, SYNONYMS)
        if name not in QUANTITIES:
            continue
        if name in by_name:
            raise ValueError(f"{where}, column {index + 1}: a second column of {name}. Keep one.")
        by_name[name] = _ProfileColumn(
            name, index, _known_unit(name, unit, f"{where}, column {index + 1}") if unit else _default_unit(name)
        )
    required = ["depth", "speed"] if "speed" in by_name else ["depth", "temperature", "salinity"]
    if missing := [name for name in required if name not in by_name]:
        wrong = next((i for i, title in enumerate(header) if name_and_unit(title, SYNONYMS)[0] not in QUANTITIES), 0)
        raise ValueError(
            f"{where}, column {wrong + 1}: the header is {', '.join(header)!r}; no column is named {missing[0]}. "
            "Begin the table with depth,speed or with depth,temperature,salinity."
        )
    return [by_name[name] for name in required]


def _units_row(row: list[str], columns: list[_ProfileColumn], where: str) -> list[_ProfileColumn] | None:
    """Columns with the units of this row; None if it is a row of values."""
    if any(is_number(row[column.index]) for column in columns if column.name != "salinity"):
        return None
    if not any(row[column.index].strip("[]()") in QUANTITIES[column.name][0] for column in columns):
        return None
    units = [_known_unit(c.name, row[c.index].strip("[]()"), f"{where}, column {c.index + 1}") for c in columns]
    return [_ProfileColumn(c.name, c.index, unit) for c, unit in zip(columns, units, strict=True)]


def _known_unit(name: str, unit: str, where: str) -> str:
    units = QUANTITIES[name][0]
    spelt = {known.lower(): known for known in units}
    if unit.lower() not in spelt:
        raise ValueError(f"{where}: {unit!r} is not a unit of {name}; use one of {', '.join(units)}.")
    return spelt[unit.lower()]


def _default_unit(name: str) -> str:
    return next(iter(QUANTITIES[name][0]))
