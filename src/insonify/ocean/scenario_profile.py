"""Sound-speed profile in a scenario: rows, columns, or the name of a table.

A table is read together with the scenario, and its values stay in the scenario with the file's name and
hash: a recording can be explained without the file, and shows whether the file has changed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, SerializerFunctionWrapHandler, ValidationInfo, model_serializer, model_validator
from pydantic_core import PydanticCustomError

from insonify.model import Metres, MetresPerSecond, Model, field_error, raise_errors
from insonify.ocean.profile import SoundSpeedProfile
from insonify.ocean.profile_file import QUANTITIES, read_profile
from insonify.units import si

DIMENSIONS = {"depth": "length", "speed": "speed", "temperature": "temperature"}
ProfileDepth = Annotated[Metres, Field(ge=QUANTITIES["depth"][1], le=QUANTITIES["depth"][2])]
ProfileSpeed = Annotated[MetresPerSecond, Field(ge=QUANTITIES["speed"][1], le=QUANTITIES["speed"][2])]
FORMS = "write a table's name (cast.csv), rows of [depth, speed], or columns {depth: [...], speed: [...]}"


class ScenarioProfile(Model):
    """Sound speed at increasing depths, and the table that it was read from, if any."""

    depth: tuple[ProfileDepth, ...]
    """Depths of the knots, increasing [m]."""
    speed: tuple[ProfileSpeed, ...]
    """Sound speed at the knots [m/s], as many as depths."""
    file: str | None = None
    """Name of the table, as it was written; relative to the scenario's file."""
    sha256: str | None = None
    """Hash of the table's bytes when it was read."""

    @model_validator(mode="before")
    @classmethod
    def _read(cls, value: object, info: ValidationInfo) -> object:
        folder = Path((info.context or {}).get("folder", "."))
        if isinstance(value, SoundSpeedProfile):
            return {"depth": value.depth.tolist(), "speed": value.speed.tolist()}
        if isinstance(value, Path):
            value = str(value)
        if isinstance(value, str):
            return _from_file(value, folder)
        if isinstance(value, Mapping):
            is_only_named = "file" in value and not set(value) & {"depth", *QUANTITIES}
            return _from_file(value["file"], folder, "file") if is_only_named else _from_columns(value)
        if isinstance(value, Sequence | np.ndarray):
            return _from_rows(list(value))
        return value if isinstance(value, ScenarioProfile) else _no_profile(value)

    @model_serializer(mode="wrap")
    def _without_gaps(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = dump(self)
        return {key: value for key, value in values.items() if value is not None}

    def profile(self) -> SoundSpeedProfile:
        """Profile with the depths and speeds of the scenario."""
        return SoundSpeedProfile(np.array(self.depth), np.array(self.speed))


@dataclass(frozen=True, slots=True)
class _Cell:
    """Value and its path below the profile's key."""

    path: str
    value: object


def _no_profile(value: object) -> object:
    raise field_error("", repr(value), f"is no sound-speed profile; {FORMS}. For water of one speed, use sound_speed.")


def _from_file(name: object, folder: Path, path: str = "") -> dict[str, Any]:
    """Columns and hash of a table whose name is relative to the scenario's folder."""
    if not isinstance(name, str) or not name.strip():
        raise field_error(path, repr(name), f"is not a file name; {FORMS}.")
    table = folder / name
    try:
        content = table.read_bytes()
        profile = read_profile(table)
    except FileNotFoundError:
        tables = sorted(file.name for file in folder.glob("*.csv"))[:5]
        hint = f" Tables in it: {', '.join(tables)}." if tables else ""
        where = f"the folder {folder.resolve()}" if table.parent == folder else f"{table.parent}"
        raise field_error(path, name, f"is not in {where}.{hint} Names are relative to the scenario's file.") from None
    except OSError as fault:
        raise field_error(path, name, f"cannot be read: {fault.strerror}. Give the name of a table (CSV).") from None
    except ValueError as fault:  # its message names file, line, column, value and remedy
        raise field_error(path, None, str(fault)) from None
    hashed = hashlib.sha256(content).hexdigest()
    return {"depth": profile.depth.tolist(), "speed": profile.speed.tolist(), "file": name, "sha256": hashed}


def _from_rows(rows: list[Any]) -> dict[str, Any]:
    """Columns of depth and speed from rows."""
    raise_errors(_malformed_rows(rows))
    cells = [[_Cell(f"{i}.{j}", row[j]) for i, row in enumerate(rows)] for j in (0, 1)]
    return _checked({"depth": cells[0], "speed": cells[1]}, "")


def _malformed_rows(rows: list[Any]) -> Iterator[PydanticCustomError]:
    for i, row in enumerate(rows):
        is_row = isinstance(row, Sequence | np.ndarray) and not isinstance(row, str)
        if not is_row:
            yield field_error(
                f"{i}", repr(row), "is no row of a profile. Write [depth, speed], such as [10 m, 1505 m/s]."
            )
        elif len(row) != 2:
            yield field_error(
                f"{i}", None, f"has {len(row)} values; a row is [depth, speed], such as [10 m, 1505 m/s]."
            )


def _from_columns(columns: Mapping[str, Any]) -> dict[str, Any]:
    """Columns depth and speed from columns as written: depth and speed, or depth, temperature and salinity."""
    known = {"depth", "speed", "temperature", "salinity", "file", "sha256"}
    raise_errors(
        field_error(str(key), None, "is no column of a profile. Known here: depth, speed, temperature, salinity, file.")
        for key in columns if key not in known
    )  # fmt: skip
    required = ["depth", "speed"] if "speed" in columns else ["depth", "temperature", "salinity"]
    missing = [name for name in required if name not in columns]
    if missing:
        need = "speed" if set(missing) == {"temperature", "salinity"} else missing[0]
        raise field_error(
            "", None, f"the column {need} is missing. Give depth and speed, or depth, temperature and salinity."
        )
    raise_errors(_malformed_columns({name: columns[name] for name in required}))
    cells = {name: [_Cell(f"{name}.{i}", value) for i, value in enumerate(columns[name])] for name in required}
    return _checked(cells, "depth") | {key: columns[key] for key in ("file", "sha256") if key in columns}


def _malformed_columns(columns: dict[str, Any]) -> Iterator[PydanticCustomError]:
    for name, column in columns.items():
        if isinstance(column, str) or not isinstance(column, Sequence | np.ndarray):
            yield field_error(name, repr(column), "is no column. Write a list with one value for each depth.")
        elif isinstance(columns["depth"], Sequence | np.ndarray) and len(column) != len(columns["depth"]):
            yield field_error(
                name, None, f"has {len(column)} values for {len(columns['depth'])} depths. Give one for each depth."
            )


def _checked(cells: dict[str, list[_Cell]], depths: str) -> dict[str, Any]:
    """Columns depth and speed as SI numbers, or every error with the path of its value.

    Args:
        cells: Columns by name, of equal length.
        depths: Path of the depths, for an error that concerns all of them.
    """
    faults: list[PydanticCustomError] = []
    columns = {name: [_number(name, cell, faults) for cell in column] for name, column in cells.items()}
    raise_errors(faults)
    depth = columns["depth"]
    if len(depth) < 2:
        raise field_error(
            depths, None, f"{len(depth)} depth(s) make no profile; give two or more, the first at the surface (0 m) "
            "and the last at the seabed or below. For water of one speed, use sound_speed.",
        )  # fmt: skip
    raise_errors(_require_increasing_depths(cells["depth"], depth))
    if "speed" in columns:
        return {"depth": depth, "speed": columns["speed"]}
    profile = SoundSpeedProfile.from_temperature_salinity(depth, columns["temperature"], columns["salinity"])
    return {"depth": depth, "speed": profile.speed.tolist()}


def _number(name: str, cell: _Cell, faults: list[PydanticCustomError]) -> float:
    """SI number of a cell; NaN where it has a fault, which is appended to `faults`."""
    units, low, high = QUANTITIES[name]
    unit = next(iter(units))
    value = cell.value
    try:
        value = si(value, DIMENSIONS[name]) if name in DIMENSIONS else value
    except ValueError as fault:
        faults.append(field_error(cell.path, None, f"{fault}."))
        return np.nan
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
        shown = "nothing" if value is None else repr(value)
        faults.append(field_error(cell.path, shown, f"is no {name}. Write a number, {low:g} to {high:g} {unit}."))
        return np.nan
    if not low <= float(value) <= high:  # NaN fails too
        hint = " Are depth and speed exchanged?" if name in ("depth", "speed") else ""
        faults.append(
            field_error(
                cell.path, f"{value:g} {unit}", f"is no {name} of any water ({low:g} to {high:g} {unit}).{hint}"
            )
        )
    return float(value)


def _require_increasing_depths(cells: list[_Cell], depth: list[float]) -> Iterator[PydanticCustomError]:
    for i in range(1, len(depth)):
        if depth[i] <= depth[i - 1]:
            yield field_error(
                cells[i].path, f"{depth[i]:g} m", f"comes after {depth[i - 1]:g} m; depths must increase downward. "
                "Sort the rows, and keep one of each depth.",
            )  # fmt: skip
