"""Summary of a recording of a real instrument: datagrams by kind, groups with their shapes, ranges of settings."""

from datetime import UTC, datetime
from typing import Any

import numpy as np
import xarray as xr

from insonify.formats.instruments.instrument_file import InstrumentFile

PINGS_READ = 50
"""Most pings of a group that are read for its shape and its ranges, evenly over the file."""
_RANGES = ("frequency", "pulse_length", "sample_interval", "sample_rate", "sound_speed", "source_level", "depth")
"""Variables or coordinates of a group whose smallest and largest values are given, where it has them."""


def file_summary(file: InstrumentFile) -> dict[str, Any]:
    """Summary of a file, of values that JSON has; units are SI."""
    about, index = file.instrument, file.datagrams
    times = index.time[np.isfinite(index.time) & (index.time > 0)]
    groups = [_group(name, count, file.read(name, _some(count))) for name, count in file.groups.items()]
    return {
        "file": str(file.path), "format": file.format, "bytes": file.path.stat().st_size,
        "maker": about.maker, "model": about.model, "serial": about.serial,
        "start": _utc(times.min()) if times.size else None, "end": _utc(times.max()) if times.size else None,
        "datagrams": [
            {"kind": kind, "content": file.kinds.get(kind, "unknown"), "count": int((index.kind == kind).sum()),
             "bytes": int(index.size[index.kind == kind].sum())}
            for kind in np.unique(index.kind).tolist()
        ],
        "groups": groups,
        "series": {name: _series(series) for name, series in (("navigation", file.navigation()),
                   ("attitude", file.attitude()), *file.sensors().items()) if series is not None},
        "sound_speed_profiles": len(file.sound_speed_profiles()),
        "settings": len(file.settings()),
        "clock_jumps": [{"offset": jump.offset, "reason": jump.reason} for jump in file.clock_jumps],
        "omissions": [{"offset": part.offset, "reason": part.reason} for part in (*file.omissions, *file.not_read)],
    }  # fmt: skip


def _some(count: int) -> slice:
    return slice(None, None, max(-(-count // PINGS_READ), 1))


def _group(name: str, count: int, read: xr.Dataset) -> dict[str, Any]:
    largest = max(read.data_vars.values(), key=lambda data: data.size * 10 + data.ndim)
    shape = {str(dim): int(size) for dim, size in largest.sizes.items() if dim != "ping"}
    read_count = int(read.sizes.get("ping", 0))
    summary: dict[str, Any] = {"name": name, "pings": count, "pings_read": read_count, "shape": shape}
    for quantity in _RANGES:
        if quantity in read.variables:
            values = read[quantity].values.astype(float)
            values = values[np.isfinite(values)]
            if values.size:
                summary[quantity] = [float(values.min()), float(values.max())]
    return summary


def _series(series: xr.Dataset) -> dict[str, Any]:
    return {"samples": int(series.sizes["time"]), "variables": [str(name) for name in series.data_vars]}


def _utc(seconds: float) -> str | None:
    try:
        return datetime.fromtimestamp(float(seconds), UTC).isoformat(timespec="milliseconds")
    except (ValueError, OverflowError, OSError):
        return None
