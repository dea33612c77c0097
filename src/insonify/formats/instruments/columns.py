"""Fields of datagrams as variables of a dataset: named, scaled to SI and padded to one shape."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments.instrument_file import Setting, require_memory

DEGREE = np.pi / 180
TIME_UNIT = "seconds since 1970-01-01T00:00:00Z"
NO_CODE = -1
"""Value of a code or count where a shorter ping has none."""
_NAMES = {
    "ping": ("1", "number of the ping in the file"),
    "time": (TIME_UNIT, "time of the datagram"),
}


class Column(NamedTuple):
    """One field of a record, and the variable that it becomes."""

    name: str
    field: str
    unit: str
    """SI; "code" marks a whole number with a meaning of its own."""
    long_name: str
    scale: float = 1.0
    """Factor from the unit of the file to `unit`."""
    missing: float = np.nan
    """Value in the file that states that there is none."""


def layout(text: str, order: str = "<") -> np.dtype[Any]:
    """Structured type of a record without gaps.

    Args:
        text: Types with the names of their fields, such as "u2 size; f4 depth speed".
        order: "<" little-endian, ">" big-endian.
    """
    fields = []
    for part in text.split(";"):
        kind, *names = part.split()
        fields += [(name, kind if kind[0] in "SV" else order + kind) for name in names]
    return np.dtype(fields)


def values_of(records: NDArray[Any], column: Column) -> NDArray[Any]:
    """Values of one field in SI: float64, or int64 of a code."""
    raw = records[column.field]
    if column.unit == "code":
        return np.asarray(raw, np.int64)
    with np.errstate(all="ignore"):  # a damaged number may be any
        values = np.asarray(raw, np.float64) * column.scale
    return values if np.isnan(column.missing) else np.where(raw == raw.dtype.type(column.missing), np.nan, values)


def stacked(rows: Sequence[NDArray[Any]], least: int = 0, axes: int = 1) -> NDArray[Any]:
    """Arrays of one ping each, padded to the largest: floats with NaN, whole numbers with `NO_CODE`.

    Args:
        rows: Arrays of equal dimension.
        least: Least length of their last axis.
        axes: Number of their axes, for a stack of none.
    """
    if not rows:
        return np.empty((0,) * (axes + 1))
    shape = np.max([row.shape for row in rows], axis=0)
    shape[-1:] = np.maximum(shape[-1:], least)
    kind = np.result_type(*rows)
    filled = np.full((len(rows), *shape), np.nan if kind.kind in "fc" else NO_CODE, kind)
    for number, row in enumerate(rows):
        inside: tuple[int | slice, ...] = (number, *(slice(length) for length in row.shape))
        filled[inside] = row
    return filled


def ragged(
    content: bytes, kind: str, starts: Sequence[int], counts: Sequence[int], scale: float
) -> NDArray[np.float32]:
    """Samples of beams of different lengths, shape (beam, sample), padded with NaN.

    Args:
        content: The datagram, which holds all of them.
        kind: Type of the samples.
        starts: First byte of each beam.
        counts: Number of its samples.
        scale: Factor from the unit of the file.
    """
    filled = np.full((len(counts), max(counts, default=0)), np.nan, np.float32)
    for beam, (start, count) in enumerate(zip(starts, counts, strict=True)):
        filled[beam, :count] = np.frombuffer(content, kind, count, start) * np.float32(scale)
    return filled


def variables(
    tables: Sequence[NDArray[Any]], columns: Iterable[Column], dims: Sequence[str], least: int = 0
) -> dict[str, xr.Variable]:
    """Variables of the records of several pings.

    Args:
        tables: Records of each ping, shape (n,), or () where a ping has one record.
        columns: Fields that become variables.
        dims: Dimensions of the variables, of the pings first.
        least: Least length of the last of them.
    """
    result = {}
    for column in columns:
        values = (
            stacked([values_of(table, column) for table in tables], least) if tables else np.empty((0,) * len(dims))
        )
        result[column.name] = variable(dims, values, column.unit, column.long_name)
    return result


def record_settings(
    record: NDArray[Any], columns: Iterable[Column], source: tuple[str, int], prefix: str = ""
) -> Iterator[Setting]:
    """Settings of the fields of one record, shape (), without those of which the file states no value.

    Args:
        record: The record.
        columns: Fields that become settings.
        source: Kind of the datagram and its first byte.
        prefix: Prefix of the names.
    """
    for column in columns:
        raw = record[column.field]
        if raw.dtype.kind == "S":
            yield Setting(prefix + column.name, text_of(raw), "", *source)
        elif (value := values_of(record, column).item()) == value:  # not NaN
            unit = "1" if column.unit == "code" else column.unit
            yield Setting(prefix + column.name, value, unit, *source)


def text_of(raw: NDArray[np.bytes_]) -> str:
    """Text of a field of characters, up to the first zero."""
    return bytes(raw).split(b"\0")[0].decode("latin-1").strip()


def along(dim: str, rows: NDArray[Any], columns: Iterable[Column]) -> dict[str, xr.Variable]:
    """Variables of one table of records, shape (n,), over one dimension."""
    return {c.name: variable(dim, values_of(rows, c), c.unit, c.long_name) for c in columns}


def variable(dims: str | Sequence[str], values: Any, unit: str, long_name: str) -> xr.Variable:
    """Variable with its unit and meaning."""
    return xr.Variable(dims, values, {"units": "1" if unit == "code" else unit, "long_name": long_name})


def sample_levels(path: Path, rows: Sequence[NDArray[np.float32]], long_name: str) -> xr.Variable:
    """Levels [dB] over (ping, beam, sample), refused before their memory is taken if they are too many."""
    if rows:
        require_memory(path, len(rows), *np.max([row.shape for row in rows], axis=0).tolist())
    values = stacked(rows) if rows else np.empty((0, 0, 0), np.float32)
    return variable(("ping", "beam", "sample"), values, "dB", long_name)


def ping_dataset(
    group: str, pings: Sequence[int] | NDArray[Any], times: NDArray[np.float64], columns: Mapping[str, xr.Variable]
) -> xr.Dataset:
    """Dataset of one group with the coordinates ping and time.

    Args:
        group: Name of the group.
        pings: Numbers of the pings in the group, from 0.
        times: Their times [s since 1970].
        columns: Variables.
    """
    coordinates = {
        name: variable("ping", np.asarray(values), *_NAMES[name])
        for name, values in (("ping", np.asarray(pings, np.int64)), ("time", np.asarray(times, float)))
    }
    return xr.Dataset(dict(columns), coordinates, {"group": group})


def with_active(table: xr.Dataset | None, active: Sequence[bool]) -> xr.Dataset | None:
    """A table over time with the mask of the rows of the sensor in use."""
    about = {"units": "1", "long_name": "whether the sensor is the one that the sonar uses"}
    return None if table is None else table.assign(active=("time", np.array(active, bool), about))


def time_dataset(records: Sequence[NDArray[Any]], times: NDArray[Any], columns: Iterable[Column]) -> xr.Dataset | None:
    """Dataset over time of records with one sample each, None without records.

    Args:
        records: Records in the order of the file, each of shape (n,).
        times: Time of each [s since 1970].
        columns: Fields that become variables.
    """
    if not records:
        return None
    return xr.Dataset(
        along("time", np.concatenate(records), columns), {"time": variable("time", times, *_NAMES["time"])}
    )
