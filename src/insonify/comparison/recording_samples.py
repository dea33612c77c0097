"""Samples of our own recordings and images."""

import numpy as np
import xarray as xr

from insonify.comparison.samples import Floats, Samples, amplitude_of_level
from insonify.formats.store_description import StoreError

SOUND_SPEED = 1500.0
"""Sound speed where a recording states none [m/s]."""


def recording_samples(recording: xr.Dataset, name: str, group: str | None = None) -> Samples:
    """Samples of a recording of ours: pings that were simulated, one side of it or all channels.

    Args:
        recording: `pressure` [uPa] or `intensity` [uPa^2] over (ping, channel or beam, time).
        name: File or title.
        group: "port" or "starboard" of a sonar with sides; None: all channels, or the only side.

    Raises:
        StoreError: No ping was simulated, or there is no such group.
    """
    recording = recording.rename(beam="channel") if "beam" in recording.dims else recording
    if "done" in recording:
        recording = recording.isel(ping=np.flatnonzero(recording["done"].values))
    if not recording.sizes["ping"]:
        raise StoreError(f"{name} holds no ping yet. Simulate one: insonify run FILE -o {name}")
    rows = _channels(recording, name, group)
    notes = []
    if "pressure" in recording:
        values = recording["pressure"].values[:, rows]
    else:
        values = np.sqrt(recording["intensity"].values[:, rows])
        notes.append("expected intensity: without speckle, so distributions and correlations mean nothing")
    time = np.asarray(recording["time"].values, float)
    speed = _sound_speed(recording, time)
    scenario = _scenario(recording)
    elements = "record: elements" in recording.attrs.get("scenario", "")
    return Samples(
        name if group is None else f"{name}, {group}", values, time * speed / 2, "uPa", speed,
        frequency=float(recording.attrs.get("centre_frequency", np.nan)),
        pulse_length=scenario.get("pulse_length", np.nan),
        angle=_angles(recording, rows, scenario.get("tilt", np.nan), elements), altitude=_altitude(recording, scenario),
        depth=float(np.mean(recording["position"].values[:, 2])) if "position" in recording else np.nan,
        parts=elements, notes=tuple(notes),
    )  # fmt: skip


def image_samples(image: xr.Dataset, name: str) -> Samples:
    """Samples of an image of levels over (ping, across), as `processing.sidescan` makes it.

    Args:
        image: `level_db` [dB] with the coordinate `across` [m].
        name: File or title.
    """
    across = np.asarray(image["across"].values, float)
    rows = np.flatnonzero(across >= 0) if (across >= 0).any() else np.arange(across.size)[::-1]
    note = f"image, gain {image.attrs.get('gain', 'not stated')}"
    if (across < 0).any() and (across >= 0).any():
        note += "; starboard side"
    level = np.asarray(image["level_db"].values[:, rows], float)
    altitude = np.asarray(image["altitude"].values, float) if "altitude" in image.variables else np.empty(0)
    return Samples(
        name, amplitude_of_level(level)[:, None], np.abs(across[rows]), "dB", altitude=altitude, notes=(note,)
    )


def _channels(recording: xr.Dataset, name: str, group: str | None) -> list[int]:
    count = recording.sizes["channel"]
    sides = np.asarray(recording["side"].values if "side" in recording.variables else np.zeros(count)).astype(int)
    requested = {"port": -1, "starboard": 1}.get(group or "")
    if requested is None and (sides < 0).any() and (sides > 0).any():
        raise StoreError(f"{name} has two sides. Name one of them: --group port or --group starboard")
    rows = np.flatnonzero(sides == requested) if requested is not None else np.arange(count)
    if requested is not None and not rows.size:
        rows = np.arange(count)  # a sonar without sides: the group is that of the other file
    return [int(row) for row in rows]


def _sound_speed(recording: xr.Dataset, time: Floats) -> float:
    """Ratio of path and time that the recording itself uses [m/s]."""
    if "slant_range" in recording.variables and time.size and time[-1] > 0:
        return float(2 * recording["slant_range"].values[-1] / time[-1])
    return SOUND_SPEED


def _scenario(recording: xr.Dataset) -> dict[str, float]:
    """Depth of a level seabed [m], pulse length [s] and tilt of the beams [rad] from the scenario in a recording."""
    import yaml

    known = yaml.safe_load(recording.attrs.get("scenario", "")) or {}
    sonar = known.get("sonar") or {}
    sonar = sonar[0] if isinstance(sonar, list) else sonar
    values = {
        "seabed_depth": (known.get("seabed") or {}).get("depth"),
        "pulse_length": (sonar.get("pulse") or {}).get("duration"),
        "tilt": (sonar.get("mounting") or {}).get("tilt"),
    }
    return {key: float(value) for key, value in values.items() if isinstance(value, int | float)}


def _angles(recording: xr.Dataset, rows: list[int], tilt: float, elements: bool) -> Floats:
    """Angles of beams from the vertical [rad]: steering of a fan that looks down; empty of a sonar with one beam."""
    if elements or len(rows) < 2 or "steer" not in recording.variables or not abs(tilt - np.pi / 2) < 0.1:
        return np.empty(0)
    return np.asarray(recording["steer"].values[rows], float)


def _altitude(recording: xr.Dataset, scenario: dict[str, float]) -> Floats:
    if "seabed_depth" not in scenario or "position" not in recording:
        return np.empty(0)
    return np.asarray(scenario["seabed_depth"] - recording["position"].values[:, 2], float)
