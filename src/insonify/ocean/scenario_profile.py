"""A sound-speed profile as a scenario holds it: rows, columns, or the name of a table.

A table is read when the scenario is, and what it said stays in the scenario with the file's name and
hash: a recording can be explained where the file has gone, and shows whether it has changed.
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
FORMS = "write a table's name (cast.csv), rows of [depth, speed], or columns {depth: [...], speed: [...]}"


class ScenarioProfile(Model):
    """Sound speed at increasing depths, and the table it was read from, if it was."""

    depth: tuple[Metres, ...]
    """Depths of the knots, increasing [m]."""
    speed: tuple[Annotated[MetresPerSecond, Field(ge=1300, le=1700)], ...]
    """Sound speed at the knots [m/s], as many."""
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
        """The profile that is written here."""
        return SoundSpeedProfile(np.array(self.depth), np.array(self.speed))


@dataclass(frozen=True, slots=True)
class _Cell:
    """One value, and where it stands below the profile."""

    path: str
    value: object


def _no_profile(value: object) -> object:
    raise field_error("", repr(value), f"is no sound-speed profile; {FORMS}. For water of one speed, use sound_speed.")


def _from_file(name: object, folder: Path, path: str = "") -> dict[str, Any]:
    """Columns and hash of a table, which lies beside the scenario's file."""
    if not isinstance(name, str) or not name.strip():
        raise field_error(path, repr(name), f"is no file's name; {FORMS}.")
    place = folder / name
    try:
        content = place.read_bytes()
        profile = read_profile(place)
    except FileNotFoundError:
        near = sorted(found.name for found in folder.glob("*.csv"))[:5]
        there = f" There: {', '.join(near)}." if near else ""
        where = f"the folder {folder.resolve()}" if place.parent == folder else f"{place.parent}"
        raise field_error(path, name, f"is not in {where}.{there} Names are relative to the scenario's file.") from None
    except OSError as fault:
        raise field_error(path, name, f"cannot be read: {fault.strerror}. Give the name of a table (CSV).") from None
    except ValueError as fault:  # it says file, line, column, value and way out
        raise field_error(path, None, str(fault)) from None
    hashed = hashlib.sha256(content).hexdigest()
    return {"depth": profile.depth.tolist(), "speed": profile.speed.tolist(), "file": name, "sha256": hashed}


def _from_rows(rows: list[Any]) -> dict[str, Any]:
    """Columns behind rows of depth and speed."""
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
    """Columns of numbers behind columns as they were written: depth and speed, or temperature and salinity."""
    known = {"depth", "speed", "temperature", "salinity", "file", "sha256"}
    raise_errors(
        field_error(str(key), None, "is no column of a profile. Known here: depth, speed, temperature, salinity, file.")
        for key in columns if key not in known
    )  # fmt: skip
    wanted = ["depth", "speed"] if "speed" in columns else ["depth", "temperature", "salinity"]
    missing = [name for name in wanted if name not in columns]
    if missing:
        need = "speed" if set(missing) == {"temperature", "salinity"} else missing[0]
        raise field_error(
            "", None, f"the column {need} is missing. Give depth and speed, or depth, temperature and salinity."
        )
    raise_errors(_malformed_columns({name: columns[name] for name in wanted}))
    cells = {name: [_Cell(f"{name}.{i}", value) for i, value in enumerate(columns[name])] for name in wanted}
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
    """The columns depth and speed as SI numbers, or every fault at its place.

    Args:
        cells: Columns by name, of equal length.
        depths: Where the depths stand, for a word on all of them.
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
    made = SoundSpeedProfile.from_temperature_salinity(depth, columns["temperature"], columns["salinity"])
    return {"depth": depth, "speed": made.speed.tolist()}


def _number(name: str, cell: _Cell, faults: list[PydanticCustomError]) -> float:
    """The SI number in a cell; NaN where it has a fault, which is noted."""
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
