"""Navigation log of a recording of a real instrument: positions of its transducer, moved by the lever arm."""

from typing import Any

import numpy as np
import xarray as xr

from insonify.formats.instruments.instrument_file import InstrumentFile
from insonify.formats.instruments.scenario_values import PINGS_READ, Floats, ScenarioValues, preferred_group
from insonify.frames import pose_rotation
from insonify.scene.terrain.bathymetry_file import metres_per_degree

MOST_FIXES = 20_000
"""Most rows of a navigation log; longer ones are thinned."""


def navigation_log(file: InstrumentFile, group: str | None = None) -> str:
    """Navigation log of a file as comma-separated values; empty where it has positions of one moment at most.

    Args:
        file: The file.
        group: Group whose transducer depth counts; None: `preferred_group`.

    Positions are those of the transducer: of the active system, moved by the lever arm in the attitude of the moment.
    Depths are those of the transducer at each ping, else its mean depth and the heave.
    """
    chosen = preferred_group(file, group)
    values, fixes = ScenarioValues(file, chosen), active_rows(file.navigation())
    known = None if fixes is None else _increasing(fixes, "latitude", "longitude")
    if known is None or known["time"].size < 2:
        return ""
    poses = active_rows(file.attitude())
    turned = None if poses is None else _increasing(poses, "roll", "pitch", "yaw")
    time = known["time"]
    if turned is not None and turned["time"].size > 1:
        inside = (turned["time"] >= time[0]) & (turned["time"] <= time[-1])
        time = turned["time"][inside] if inside.sum() > 1 else time
    time = time[:: max(1, -(-time.size // MOST_FIXES))]
    columns: dict[str, Floats] = {
        name: np.degrees(np.interp(time, known["time"], known[name])) for name in ("latitude", "longitude")
    }
    columns["depth"] = _depths(file, chosen, time, values)
    heading = np.arctan2(np.gradient(columns["longitude"]) * np.cos(np.radians(columns["latitude"])),
                         np.gradient(columns["latitude"]))  # fmt: skip
    columns |= {"heading": np.degrees(np.unwrap(heading)), "pitch": 0 * time, "roll": 0 * time}
    if turned is not None and turned["time"].size > 1:
        for name, of in (("heading", "yaw"), ("pitch", "pitch"), ("roll", "roll")):
            columns[name] = np.degrees(np.interp(time, turned["time"], np.unwrap(turned[of])))
        if "heave" in turned and not values.depth_name:
            columns["depth"] = columns["depth"] + np.interp(time, turned["time"], turned["heave"])
    arm = file.lever_arm(chosen)
    if arm is not None:
        heading, pitch, roll = (np.radians(columns[name]) for name in ("heading", "pitch", "roll"))
        offset = pose_rotation(heading, pitch, roll) @ np.array(arm.position)
        north, east = metres_per_degree(float(columns["latitude"][0]))
        columns["latitude"] = columns["latitude"] + offset[:, 0] / north
        columns["longitude"] = columns["longitude"] + offset[:, 1] / east
    digits = {"latitude": 9, "longitude": 9, "depth": 3}
    rows = ["time [s],latitude [deg],longitude [deg],depth [m],heading [deg],pitch [deg],roll [deg]"]
    for k, moment in enumerate(time - time[0]):
        rows.append(",".join([f"{moment:.4f}", *(f"{columns[n][k]:.{digits.get(n, 4)}f}" for n in columns)]))
    return "\n".join(rows) + "\n"


def active_rows(table: xr.Dataset | None) -> xr.Dataset | None:
    """Rows of the sensor in use, where a file logs others beside it."""
    if table is None or "active" not in table or not table["active"].values.any():
        return table
    return table.isel(time=np.flatnonzero(table["active"].values))


def _depths(file: InstrumentFile, group: str, time: Floats, values: ScenarioValues) -> Floats:
    """Depths of the transducer at some times [m]: interpolated between the pings where they state it."""
    name, parts = values.depth_name, []
    if not name:
        return np.full(time.size, values.depth.number)
    for first in range(0, file.groups[group], PINGS_READ):
        data = file.read(group, slice(first, first + PINGS_READ))
        if name in data:
            parts.append(np.column_stack([data["time"].values, data[name].values]).astype(float))
    rows = np.concatenate(parts)
    rows = rows[np.isfinite(rows).all(axis=1) & (rows[:, 1] != 0)]
    rows = rows[np.unique(rows[:, 0], return_index=True)[1]]
    return np.asarray(np.interp(time, rows[:, 0], rows[:, 1]))


def _increasing(table: xr.Dataset, *names: str) -> dict[str, Any] | None:
    """Columns of a table over increasing times, rows without a number in one of them left out."""
    present = [name for name in (*names, "heave") if name in table]
    if not set(names) <= set(present):
        return None
    columns = {name: np.asarray(table[name].values, float) for name in present}
    time = np.asarray(table["time"].values, float)
    good = np.isfinite(time) & np.all([np.isfinite(columns[name]) for name in names], axis=0)
    time, columns = time[good], {name: np.nan_to_num(column[good]) for name, column in columns.items()}
    order = np.unique(time, return_index=True)[1]
    return {"time": time[order], **{name: column[order] for name, column in columns.items()}}
