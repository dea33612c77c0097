"""Samples of recordings of real instruments: stated gains undone, beams set on one axis of range."""

from dataclasses import replace

import numpy as np
import xarray as xr

from insonify.comparison.samples import Floats, Samples, Values, amplitude_of_level
from insonify.formats.instruments.instrument_file import InstrumentFile
from insonify.formats.instruments.simrad_ek80 import TRANSMITTED
from insonify.formats.store_description import StoreError
from insonify.processing.split_beam import pressure_per_volt
from insonify.units import level_db

MAX_VALUES = 1 << 25
"""Most values of one file that are read: beyond, pings at the middle of the file."""
FIELDS = {"voltage": "V", "amplitude": "counts", "level": "dB", "level_db": "dB", "power_db": "W"}
"""Variables that hold samples, with the unit of their amplitude."""


def instrument_samples(file: InstrumentFile, group: str | None = None, frequency: float = np.nan) -> Samples:
    """Samples of one group of a recording of a real instrument.

    Args:
        file: The open file.
        group: Name of the group; None: the only one with samples, or the one nearest in frequency.
        frequency: Frequency of the other recording of the comparison [Hz].

    Raises:
        StoreError: There is no such group, several would do, or no ping could be read.
    """
    chosen = group or _only_group(file, frequency)
    first = file.read(chosen, slice(0, 1))
    values = max(int(np.prod([size for dim, size in first.sizes.items() if dim in _AXES])), 1)
    count = file.groups.get(chosen, 0)
    most = max(MAX_VALUES // values, 1)
    start = max((count - most) // 2, 0)
    pings = file.read(chosen, slice(start, start + most))
    if not pings.sizes.get("ping"):
        raise StoreError(f"{file.path}, group {chosen!r}: no ping could be read. `insonify info {file.path}` shows why")
    notes = [f"pings {start} to {start + most - 1} of {count}: the file is large"] if count > most else []
    notes += [f"left out at byte {part.offset}: {part.reason}" for part in file.omissions[:5]]
    samples = group_samples(pings, f"{file.path.name}, {chosen}", notes)
    return samples if np.isfinite(samples.depth) else replace(samples, depth=_mounting_depth(file, chosen, pings))


_NO_IMAGES = ("soundings", "extra detections")
_AXES = ("sector", "beam", "sample")
_PULSE_ABOVE = 20.0  # dB of a transmitted pulse above the median of a record that opens with it


def _mounting_depth(file: InstrumentFile, group: str, pings: xr.Dataset) -> float:
    """Depth of a transducer by its mounting and the water level [m], NaN where the file does not state it."""
    name = f"{group}.mounting.TransducerOffsetZ"
    offset = next((setting.value for setting in file.settings() if setting.name == name), None)
    return float(offset) + _median(pings, "water_level", 0.0) if isinstance(offset, int | float) else np.nan


def _only_group(file: InstrumentFile, frequency: float) -> str:
    names = list(file.groups)
    images = [name for name in names if name not in _NO_IMAGES and not name.endswith(TRANSMITTED)] or names
    if len(images) == 1:
        return images[0]
    near = {}
    for name in images:
        ping = file.read(name, slice(0, 1))
        if "frequency" in ping and ping["frequency"].size:
            near[name] = abs(float(np.nanmedian(ping["frequency"].values)) - frequency)
    best = [name for name in near if near[name] <= 0.02 * abs(frequency)]
    if len(best) == 1:
        return best[0]
    raise StoreError(f"{file.path} has several groups. Name one: --group " + " or ".join(f"'{name}'" for name in names))


def group_samples(pings: xr.Dataset, name: str, notes: list[str] | None = None) -> Samples:
    """Samples of pings as an instrument's reader returns them.

    Args:
        pings: Pings of one group.
        name: File and group.
        notes: Remarks on the reading.

    Raises:
        StoreError: The group has neither samples nor detections.
    """
    remarks = list(notes or ())
    field = next((key for key in FIELDS if key in pings and "sample" in pings[key].dims), None)
    if field is None:
        if "travel_time" in pings:
            return _detections(pings, name, remarks)
        raise StoreError(f"{name}: no samples to compare. Choose another group: `insonify info` lists them")
    pings = _of_one_step(pings, name, remarks)
    values = pings[field].values
    values = values[:, None] if values.ndim == 2 else values
    unit = FIELDS[field]
    if field == "voltage" and np.isfinite(factor := _pressure_per_volt(pings)):
        values, unit = values * np.float32(factor), "uPa"
        remarks.append(f"{level_db(factor**2):.1f} dB re 1 uPa for 1 V, by gain and impedances that the file states")
    if field in ("level", "level_db", "power_db"):
        values = amplitude_of_level(values.astype(float))
    if field == "amplitude" and "gamma" in pings:
        values = _without_gamma(values, pings, remarks)
    values, slant_range = _on_one_axis(values, pings)
    if field == "voltage":
        slant_range = slant_range - _pulse_edge(values, slant_range, pings, remarks)
    values = _without_gain(values, slant_range, pings, remarks)
    angle = _angle(pings)
    return Samples(
        name, values, slant_range, unit, _median(pings, "sound_speed", 1500.0),
        frequency=_median(pings, "frequency"), pulse_length=_median(pings, "pulse_length"),
        angle=angle if angle.size == values.shape[1] else np.empty(0), altitude=_altitude(pings),
        depth=_median(pings, "transducer_depth", _median(pings, "sensor_depth")),
        parts="sector" in pings[field].dims, notes=tuple(remarks),
    )  # fmt: skip


def _detections(pings: xr.Dataset, name: str, notes: list[str]) -> Samples:
    """Levels of detections as one sample a beam, with their slant ranges."""
    speed = _median(pings, "sound_speed", 1500.0)
    detected = np.asarray(pings["travel_time"].values, float) * speed / 2
    if "detection" in pings:
        detected = np.where(pings["detection"].values <= 1, detected, np.nan)
    key = "backscatter" if "backscatter" in pings else None
    level = np.asarray(pings[key].values, float) if key else np.full(detected.shape, np.nan)
    return Samples(
        name, amplitude_of_level(level)[..., None], np.zeros(1), "dB", speed,
        frequency=_median(pings, "frequency"), angle=_angle(pings), depth=_median(pings, "transducer_depth"),
        detected_range=detected, notes=tuple(notes),
    )  # fmt: skip


def _median(pings: xr.Dataset, name: str, default: float = np.nan) -> float:
    if name not in pings.variables:
        return float(pings.attrs.get(name, default))
    values = np.asarray(pings[name].values, float)
    values = values[np.isfinite(values)]
    return float(np.median(values)) if values.size else default


def _steps(pings: xr.Dataset) -> Floats:
    """Step of range of each ping [m], shape (ping,)."""
    shape = pings.sizes["ping"]
    speed = np.broadcast_to(pings["sound_speed"].values if "sound_speed" in pings else 1500.0, (shape,)).astype(float)
    if "range_step" in pings:
        steps = pings["range_step"].values
    elif "sample_interval" in pings:
        steps = speed / 2 * pings["sample_interval"].values
    else:
        key = next(key for key in ("image_sample_rate", "sample_rate") if key in pings)
        rate = np.asarray(pings[key].values, float)
        steps = speed / 2 / np.where(rate > 0, rate, np.nan)
    return np.broadcast_to(np.asarray(steps, float), (shape,))


def _of_one_step(pings: xr.Dataset, name: str, notes: list[str]) -> xr.Dataset:
    """Pings with the commonest step of range; the others are left out."""
    steps = np.round(_steps(pings), 7)
    steps_present, counts = np.unique(steps[np.isfinite(steps) & (steps > 0)], return_counts=True)
    if not steps_present.size:
        raise StoreError(f"{name}: no ping states its sample interval and sound speed. Choose another group")
    keep = np.abs(steps - steps_present[np.argmax(counts)]) <= 1e-3 * steps_present[np.argmax(counts)]
    if not keep.all():
        notes.append(f"{int((~keep).sum())} of {keep.size} pings left out: another sample interval")
    return pings.isel(ping=np.flatnonzero(keep))


def _on_one_axis(values: Values, pings: xr.Dataset) -> tuple[Values, Floats]:
    """Beams that start at samples of their own, set on one axis of range padded with NaN."""
    step = float(np.median(_steps(pings)))
    if "first_sample" in pings:
        first = np.asarray(pings["first_sample"].values)
        valid = first >= 0
    elif "centre_sample" in pings and "travel_time" in pings:
        speed = _median(pings, "sound_speed", 1500.0)
        centre = np.asarray(pings["travel_time"].values, float) * speed / 2 / step
        valid = np.isfinite(centre) & (pings["centre_sample"].values > 0)
        first = np.where(valid, np.round(np.where(valid, centre, 0)) - pings["centre_sample"].values + 1, 0).astype(int)
    else:
        start = _median(pings, "first_range", 0.0)
        return values, np.asarray(start + step * np.arange(values.shape[2]), float)
    low = int(first[valid].min()) if valid.any() else 0
    high = int(first[valid].max()) if valid.any() else 0
    placed = np.full((*values.shape[:2], high - low + values.shape[2]), np.nan, values.dtype)
    for ping, beam in np.argwhere(valid):
        at = int(first[ping, beam]) - low
        placed[ping, beam, at : at + values.shape[2]] = values[ping, beam]
    return placed, np.asarray(step * (low + np.arange(placed.shape[2])), float)


def _pressure_per_volt(pings: xr.Dataset) -> float:
    """Pressure of tones per volt [uPa/V]; NaN for sweeps, whose gain follows the frequency."""
    return float("nan") if _median(pings, "swept", 0.0) else pressure_per_volt(pings)


def _pulse_edge(values: Values, slant_range: Floats, pings: xr.Dataset, notes: list[str]) -> float:
    """Range of the leading edge of the transmitted pulse, at half its amplitude, in a record that opens with it [m]."""
    pulse = _median(pings, "pulse_length") * _median(pings, "sound_speed", 1500.0) / 2
    head = int(np.nan_to_num(2 * pulse / (slant_range[1] - slant_range[0])))
    amplitude = np.abs(values.mean(axis=1)).mean(axis=0).astype(float)
    if head < 2 or not amplitude[:head].max() > np.nanmedian(amplitude) * 10 ** (_PULSE_ABOVE / 20):
        return 0.0
    half = amplitude[:head].max() / 2
    at = int(np.argmax(amplitude[:head] >= half))
    share = (half - amplitude[at - 1]) / (amplitude[at] - amplitude[at - 1]) - 1 if at else 0.0
    edge = float(slant_range[at] + share * (slant_range[1] - slant_range[0]))
    notes.append(f"ranges count from the leading edge of the transmitted pulse, {edge * 1e3:.1f} mm behind its start")
    return edge


def _without_gain(values: Values, slant_range: Floats, pings: xr.Dataset, notes: list[str]) -> Values:
    """Amplitudes with the gain undone that the file states over range."""
    if "gain_exponent" in pings:
        exponent, offset = _median(pings, "gain_exponent"), _median(pings, "gain_offset", 0.0)
        gain = exponent * np.log10(np.maximum(slant_range, 0.1)) + offset
        notes.append(f"gain of {exponent:g} log10(r) + {offset:g} dB undone; its absorption is not stated with it")
        return np.asarray(values * 10 ** (-gain / 20))
    if "processing" in pings and int(_median(pings, "processing", 0.0)) & 4:
        notes.append("a time-varied gain that the file does not describe is left in")
    return values


def _without_gamma(values: Values, pings: xr.Dataset, notes: list[str]) -> Values:
    gamma = _median(pings, "gamma", 255.0)
    if gamma in (0.0, 255.0):
        return values
    notes.append(f"gamma of {gamma:g}/255 undone")
    return np.asarray(values.astype(float) ** (255.0 / gamma))


def _angle(pings: xr.Dataset) -> Floats:
    """Angles of beams from the vertical [rad]; those of imaging sonars are bearings, and are not."""
    name = next((name for name in ("beam_angle", "angle") if name in pings.variables), None)
    if name is None:
        return np.empty(0)
    angles = np.asarray(pings[name].values, float)
    if angles.ndim == 1:
        return angles
    return np.nanmean(angles, axis=0) if np.isfinite(angles).any(axis=0).all() else np.empty(0)


def _altitude(pings: xr.Dataset) -> Floats:
    altitude = np.asarray(pings["altitude"].values, float) if "altitude" in pings else np.empty(0)
    return np.where(altitude > 0, altitude, np.nan) if altitude.size else altitude
