"""Navigation log in a text file: a table with a header and one row per fix.

Columns are time, position (north and east, or latitude and longitude), depth and heading, optionally pitch and roll,
separated by commas, semicolons or tabs; units stand in the header, "heading [deg]", comments after #. Time is in
seconds, or a date and time by ISO 8601. Every error is reported with its file, line and column.
"""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from insonify.data_file import is_number, name_and_unit, table_rows
from insonify.units import UNITS

Floats = NDArray[np.float64]

DEGREES = {"deg": 1.0, "°": 1.0, "rad": 180 / np.pi}
ANGLES = {**UNITS["angle"], "°": np.pi / 180}
COLUMNS: dict[str, tuple[dict[str, float], float, float]] = {
    "time": (UNITS["time"], -1e12, 1e12),
    "north": (UNITS["length"], -1e8, 1e8),
    "east": (UNITS["length"], -1e8, 1e8),
    "latitude": (DEGREES, -90.0, 90.0),
    "longitude": (DEGREES, -360.0, 360.0),
    "depth": (UNITS["length"], -100.0, 12e3),
    "heading": (ANGLES, -4 * np.pi, 4 * np.pi),
    "pitch": (ANGLES, -np.pi / 2, np.pi / 2),
    "roll": (ANGLES, -np.pi, np.pi),
}
"""Units that each column may have, and the smallest and largest value that it may hold [SI; degrees on the globe]."""
SYNONYMS = {"lat": "latitude", "lon": "longitude", "long": "longitude", "northing": "north", "easting": "east",
            "yaw": "heading", "x": "north", "y": "east", "z": "depth"}  # fmt: skip
COLUMNS_WITHOUT_DEFAULT_UNIT = ("heading", "pitch", "roll")
"""Columns whose unit must be in the header, since logs have degrees as often as radians."""
MAX_PROJECTED_DISTANCE = 100e3
"""Largest distance from the origin of positions in degrees, which are projected onto a plane [m]."""
SEMI_MAJOR, ECCENTRICITY_SQUARED = 6378137.0, 6.69437999014e-3
"""Semi-major axis [m] and squared eccentricity [1] of the WGS 84 ellipsoid."""


@dataclass(frozen=True, slots=True)
class NavigationLog:
    """Fixes in order of time, as columns of equal length n."""

    time: Floats
    """Time after the first row [s], shape (n,)."""
    position: Floats
    """North, east, depth [m], shape (n, 3)."""
    attitude: Floats
    """Heading, pitch, roll without jumps of a whole turn [rad], shape (n, 3)."""
    line: NDArray[np.int64]
    """Line of the file of each row, from 1, shape (n,)."""
    origin: tuple[float, float] | None = None
    """Latitude and longitude of north 0, east 0 [deg]; None: the file has north and east."""


@dataclass(frozen=True, slots=True)
class _LogColumn:
    """One column that is read."""

    name: str
    index: int
    """Position in a row, from 0."""
    unit: str

    def value(self, text: str, where: str) -> float:
        """Value of a cell in the units of `COLUMNS`; where: file and line, for the message of an error."""
        location = f"{where}, column {self.index + 1} ({self.name})"
        if not text:
            raise ValueError(f"{location}: nothing stands here. Fill it in, or delete the row.")
        if self.name == "time" and not is_number(text):
            return _seconds_since_1970(text, location)
        try:
            number = float(text)
        except ValueError:
            raise ValueError(f"{location}: {text!r} is not a number. Write a plain number, such as 12.5.") from None
        if not np.isfinite(number):
            raise ValueError(f"{location}: {text} is not a finite number. Fill the gap, or delete the row.")
        units, low, high = COLUMNS[self.name]
        number *= units[self.unit]
        if not low <= number <= high:
            size = units[self.unit]
            raise ValueError(
                f"{location}: {text} {self.unit} is not possible; {self.name} is {low / size:.6g} to {high / size:.6g} "
                f"{self.unit}. Is the header's unit right?"
            )
        return number


def read_navigation(path: str | Path, *, origin: tuple[float, float] | None = None) -> NavigationLog:
    """Navigation log in a table of comma-separated values.

    Args:
        path: File with a header naming the columns: time; north and east, or latitude and longitude;
            depth; heading; where they are known pitch and roll (else 0). Units in the header, "heading [deg]";
            they may be left out for m, s and for degrees of latitude and longitude. Other columns are ignored.
        origin: Latitude and longitude of north 0, east 0 [deg]; by default the first row.

    Returns:
        The log, with times re its first row.

    Raises:
        OSError: The file cannot be opened.
        ValueError: The table cannot be read; the message names file, line and column.
    """
    rows = table_rows(path, "time,north,east,depth,heading [deg]")
    line, header = next(rows, (1, []))
    columns = _columns(header, f"{path}, line {line}")
    lines: list[int] = []
    table: list[list[float]] = []
    for line, row in rows:
        where = f"{path}, line {line}"
        table.append([column.value(row[column.index], where) for column in columns])
        lines.append(line)
        if len(table) > 1 and table[-1][0] <= table[-2][0]:
            when = row[columns[0].index]
            raise ValueError(
                f"{where}, column {columns[0].index + 1} (time): {when} is not after the row before it. Times must "
                "increase: sort the rows, and keep one of each time."
            )
    if len(table) < 2:
        raise ValueError(f"{path}, line {line}: the file ends after {len(table)} row(s) of values; give at least two.")
    values = {column.name: np.array(cells) for column, cells in zip(columns, zip(*table, strict=True), strict=True)}
    return _log(values, np.array(lines), origin, path)


def local_plane_position(latitude: Floats, longitude: Floats, origin: tuple[float, float]) -> Floats:
    """North and east of positions near an origin.

    Args:
        latitude: Geodetic latitude [deg], shape (n,).
        longitude: Longitude, east positive [deg], shape (n,).
        origin: Latitude and longitude of north 0, east 0 [deg].

    Returns:
        North and east [m], shape (n, 2): arcs of the WGS 84 ellipsoid, with its radii of curvature at the latitude
        midway to the origin. Wrong by 1e-6 or less of the distance out to 10 km.

    Source: radii of curvature of an ellipsoid in the meridian and the prime vertical, Rapp (1991), Geometric
    Geodesy Part I, eqs. 3.87 and 3.99 (not verified); ellipsoid of WGS 84.
    """
    middle = np.radians((latitude + origin[0]) / 2)
    w = 1 - ECCENTRICITY_SQUARED * np.sin(middle) ** 2
    meridian = SEMI_MAJOR * (1 - ECCENTRICITY_SQUARED) / w**1.5
    vertical = SEMI_MAJOR / np.sqrt(w)
    east = np.mod(longitude - origin[1] + 180, 360) - 180
    return np.stack(
        [meridian * np.radians(latitude - origin[0]), vertical * np.cos(middle) * np.radians(east)], axis=-1
    )


def geodetic_position_of_plane(north: Floats, east: Floats, origin: tuple[float, float]) -> tuple[Floats, Floats]:
    """Latitude and longitude [deg] of positions in the plane of an origin: the inverse of `local_plane_position`.

    Args:
        north: North of the origin [m], shape (n,).
        east: East of the origin [m], shape (n,).
        origin: Latitude and longitude of north 0, east 0 [deg].
    """
    latitude, longitude = np.full(np.shape(north), origin[0]), np.full(np.shape(north), origin[1])
    for _ in range(4):  # the radii of curvature vary by 1e-9 for a metre: it converges from the first step
        position = local_plane_position(latitude, longitude, origin)
        metres = local_plane_position(latitude + 1e-3, longitude + 1e-3, origin) - position  # for 1e-3 deg
        latitude = latitude + (north - position[:, 0]) / metres[:, 0] * 1e-3
        longitude = longitude + (east - position[:, 1]) / metres[:, 1] * 1e-3
    return latitude, longitude


def _log(
    values: dict[str, Floats], lines: NDArray[np.int64], origin: tuple[float, float] | None, path: str | Path
) -> NavigationLog:
    time = values["time"] - values["time"][0]
    if "north" in values:
        if origin is not None:
            raise ValueError(f"{path}: an origin is given, but positions are north and east [m] already. Leave it out.")
        log_origin = None
        horizontal = np.stack([values["north"], values["east"]], axis=-1)
    else:
        log_origin = (float(values["latitude"][0]), float(values["longitude"][0])) if origin is None else origin
        horizontal = local_plane_position(values["latitude"], values["longitude"], log_origin)
        far = np.flatnonzero(np.hypot(*horizontal.T) > MAX_PROJECTED_DISTANCE)
        if far.size:
            raise ValueError(
                f"{path}, line {lines[far[0]]}: {np.hypot(*horizontal[far[0]]) / 1e3:.4g} km from the origin at "
                f"{log_origin[0]:g}, {log_origin[1]:g} deg; degrees are projected onto a plane up to "
                f"{MAX_PROJECTED_DISTANCE / 1e3:g} km. Give an `origin` nearby, or mend the row."
            )
    zeros = np.zeros(len(time))
    angles = [np.unwrap(values.get(name, zeros)) for name in COLUMNS_WITHOUT_DEFAULT_UNIT]
    position = np.column_stack([horizontal, values["depth"]])
    return NavigationLog(time, position, np.stack(angles, axis=-1), lines, log_origin)


def _columns(header: list[str], where: str) -> list[_LogColumn]:
    """Columns that are read, time first."""
    columns: dict[str, _LogColumn] = {}
    for index, title in enumerate(header):
        name, unit = name_and_unit(title, SYNONYMS)
        if name not in COLUMNS:
            continue
        location = f"{where}, column {index + 1}"
        if name in columns:
            raise ValueError(f"{location}: a second column of {name}. Keep one.")
        columns[name] = _LogColumn(name, index, _checked_unit(name, unit, location))
    is_geographic = "latitude" in columns or "longitude" in columns
    if is_geographic and ("north" in columns or "east" in columns):
        raise ValueError(
            f"{where}: positions both in metres and in degrees. Keep north and east, or latitude and longitude."
        )
    required = ["time", *(("latitude", "longitude") if is_geographic else ("north", "east")), "depth", "heading"]
    if missing := [name for name in required if name not in columns]:
        raise ValueError(
            f"{where}: the header is {', '.join(header)!r}; no column is named {missing[0]}. Name the columns time, "
            "north and east (or latitude and longitude), depth, heading, and where known pitch and roll; add a "
            f"column {missing[0]}."
        )
    return [columns.pop("time"), *columns.values()]


def _checked_unit(name: str, unit: str, where: str) -> str:
    units = COLUMNS[name][0]
    if not unit and name in COLUMNS_WITHOUT_DEFAULT_UNIT:
        raise ValueError(f"{where}: {name} has no unit. Write {name} [deg] or {name} [rad] in the header.")
    if not unit:
        return next(iter(units))
    spellings = {unit_name.lower(): unit_name for unit_name in units} | {
        "degrees": "deg",
        "sec": "s",
        "metres": "m",
        "meters": "m",
    }
    if spellings.get(unit.lower()) not in units:
        raise ValueError(f"{where}: {unit!r} is not a unit of {name}; use one of {', '.join(units)}.")
    return spellings[unit.lower()]


def _seconds_since_1970(text: str, location: str) -> float:
    """Seconds since 1970 of a date and time, in universal time if it has no zone [s]."""
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        raise ValueError(
            f"{location}: {text!r} is neither a number nor a date and time. Write seconds, or 2026-05-04T12:30:00.25."
        ) from None
    return (time if time.tzinfo else time.replace(tzinfo=UTC)).timestamp()
