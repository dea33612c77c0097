"""Recordings as an instrument's file has them: gain, looks, decimation, companding, quantisation, clipping.

The stages of `insonify.sonar.recorder` act on the envelope, line by line: memory is that of the pings of one line.
"""

from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from insonify.processing.decimation import decimate, decimated_time
from insonify.records.recording import RECORDED, RECORDER_COLUMNS
from insonify.sonar.recorder import (
    Clipping,
    Companding,
    Decimation,
    Looks,
    Quantisation,
    Recorder,
    RecorderGain,
    Stage,
)
from insonify.units import amplitude_ratio, level_db

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class _Signal:
    """Envelope between two stages."""

    values: Floats
    """Amplitude [uPa], counts, fraction of full scale or level [dB], shape (pings, ..., samples)."""
    time: Floats
    """Time of each sample [s], shape (samples,)."""
    top: float
    """Value at full scale; infinite: none."""
    is_level: bool = False


def record_series(
    series: ArrayLike, time: ArrayLike, recorder: Recorder, *, sound_speed: float = 1500.0,
    absorption_db_per_m: float = 0.0,
) -> tuple[Floats, Floats]:  # fmt: skip
    """Series as an instrument records them.

    Args:
        series: Pressure, complex envelope or rms [uPa], shape (pings, ..., samples), or (samples,) for one.
        time: Time of each sample after the start of transmission, evenly spaced [s], shape (samples,).
        recorder: Stages of the instrument.
        sound_speed: That its gain takes ranges with [m/s].
        absorption_db_per_m: One-way absorption of the water, for gains without their own [dB/m].

    Returns:
        Recorded numbers, in `recorder.units`, shape (lines, ..., bins), pings that fill no line left out; and times of
        the bins [s], shape (bins,).

    Example:
        >>> from insonify.sonar import Recorder
        >>> gain = {"kind": "gain", "tvg_db_per_decade": 40}
        >>> recorder = Recorder(stages=[gain, {"kind": "quantisation", "bits": 8}], full_scale_db=150)
        >>> counts, time = record_series([31600.0, 7900.0, 1000.0], [0.02, 0.04, 0.08], recorder)  # 90, 78, 60 dB
        >>> counts.tolist()
        [57.0, 57.0, 29.0]
    """
    amplitude, times = np.abs(np.asarray(series)).astype(float), np.asarray(time, float)
    if amplitude.shape[-1:] != times.shape:
        raise ValueError(f"series has shape {amplitude.shape}; time has {times.size} samples. Give as many")
    full_scale = np.inf if recorder.full_scale_db is None else float(amplitude_ratio(recorder.full_scale_db))
    signal = _Signal(np.atleast_2d(amplitude), times, full_scale)
    for stage in recorder.stages:
        if isinstance(stage, RecorderGain):
            gain = amplitude_ratio(stage.db(signal.time, sound_speed, absorption_db_per_m))
            signal = replace(signal, values=signal.values * gain)
        else:
            signal = _after(stage, signal)
    return signal.values if amplitude.ndim > 1 else signal.values[0], signal.time


@singledispatch
def _after(stage: Stage, signal: _Signal) -> _Signal:
    """Signal behind one stage."""
    raise TypeError(f"{stage!r} is no stage of a recorder")


@_after.register
def _(stage: Looks, signal: _Signal) -> _Signal:
    pings, count = signal.values.shape[0] // stage.pings, signal.values.shape[-1]
    if stage.samples > count:
        raise ValueError(f"looks.samples is {stage.samples}, and a line has {count}. Give at most as many")
    power = 2.0 if stage.of == "intensity" else 1.0
    values = signal.values[: pings * stage.pings] ** power
    values = values.reshape(pings, stage.pings, *values.shape[1:]).mean(axis=1)
    starts = np.arange(0, count - stage.samples + 1, stage.step or stage.samples)
    # sums of each mean by itself: differences of a running sum would lose weak samples behind strong ones
    mean = sum(values[..., starts + k] for k in range(stage.samples)) / stage.samples
    time = signal.time[starts] + (stage.samples - 1) / 2 * _step(signal.time)
    return replace(signal, values=np.asarray(mean) ** (1 / power), time=time)


@_after.register
def _(stage: Decimation, signal: _Signal) -> _Signal:
    time = decimated_time(signal.time, stage.samples)
    if stage.keep == "sample":
        count = signal.time.size
        if stage.samples > count:
            raise ValueError(f"decimation.samples is {stage.samples}, and a line has {count}. Give at most as many")
        middle = np.floor((np.arange(stage.samples) + 0.5) * count / stage.samples).astype(int)
        return replace(signal, values=signal.values[..., middle], time=signal.time[middle])
    if stage.keep == "mean" and not signal.is_level:
        return replace(signal, values=np.sqrt(decimate(signal.values**2, stage.samples)), time=time)
    return replace(signal, values=decimate(signal.values, stage.samples, keep=stage.keep), time=time)


@_after.register
def _(stage: Clipping, signal: _Signal) -> _Signal:
    return replace(signal, values=np.minimum(signal.values, signal.top))


@_after.register
def _(stage: Companding, signal: _Signal) -> _Signal:
    if stage.law == "log":
        return replace(signal, values=level_db(signal.values**2), top=float(level_db(signal.top**2)), is_level=True)
    fraction = np.minimum(signal.values / signal.top, 1)
    companded = fraction**stage.gamma if stage.law == "gamma" else np.log1p(stage.mu * fraction) / np.log1p(stage.mu)
    return replace(signal, values=companded, top=1.0)


@_after.register
def _(stage: Quantisation, signal: _Signal) -> _Signal:
    if stage.step_db is not None:
        lowest = -(2.0 ** (stage.bits - 1)) if stage.signed else 0.0
        highest = lowest + 2.0**stage.bits - 1
        codes = np.clip(np.rint(signal.values / stage.step_db), lowest, highest)
        return replace(signal, values=codes * stage.step_db, top=min(signal.top, highest * stage.step_db))
    top = 2.0**stage.bits - 1
    return replace(signal, values=np.rint(np.minimum(signal.values / signal.top, 1) * top), top=top)


def _step(time: Floats) -> float:
    return float(time[1] - time[0]) if time.size > 1 else 0.0


def received_level(
    recorded: ArrayLike, time: ArrayLike, recorder: Recorder, *, sound_speed: float = 1500.0,
    absorption_db_per_m: float = 0.0,
) -> Floats:  # fmt: skip
    """Level of the pressure that recorded numbers stand for, companding and gain undone [dB re 1 uPa].

    Args:
        recorded: Numbers in `recorder.units`, shape (..., bins).
        time: Time of each bin [s], shape (bins,).
        recorder: Stages of the instrument.
        sound_speed: That its gain takes ranges with [m/s].
        absorption_db_per_m: One-way absorption of the water, for gains without their own [dB/m].

    Returns:
        Levels, shape of `recorded`; within the errors of rounding where nothing was clipped. Looks and decimation
        cannot be undone.

    Example:
        >>> from insonify.sonar import Recorder
        >>> gain = {"kind": "gain", "tvg_db_per_decade": 40}
        >>> recorder = Recorder(stages=[gain, {"kind": "quantisation", "bits": 8}], full_scale_db=150)
        >>> received_level([57, 57, 29], [0.02, 0.04, 0.08], recorder).round().tolist()
        [90.0, 78.0, 60.0]
    """
    values = np.asarray(recorded, float)
    if recorder.units != "dB re 1 uPa":
        bits = [stage.bits for stage in recorder.stages if isinstance(stage, Quantisation)]
        values = values / (2.0 ** bits[-1] - 1) if bits else values
        law = next((stage for stage in recorder.stages if isinstance(stage, Companding)), None)
        if law is not None:
            mu = law.mu
            values = values ** (1 / law.gamma) if law.law == "gamma" else np.expm1(values * np.log1p(mu)) / mu
        full_scale = recorder.full_scale_db if recorder.units == "1" else None
        values = level_db(values**2) + (full_scale or 0.0)
    return np.asarray(values - recorder.gain_db(np.asarray(time, float), sound_speed, absorption_db_per_m))


def instrument_recording(
    recording: xr.Dataset, recorder: Recorder, *, sound_speed: float = 1500.0, absorption_db_per_m: float = 0.0
) -> xr.Dataset:
    """A recording with what an instrument would have written of it.

    Args:
        recording: `pressure` [uPa] or `intensity` [uPa^2] over (ping, ..., time); read line by line.
        recorder: Stages of the instrument, such as `scenario.sonar.recorder`.
        sound_speed: That its gain takes ranges with [m/s].
        absorption_db_per_m: One-way absorption of the water, for gains without their own [dB/m].

    Returns:
        The recording with `recorded` over (line, ..., bin), `bin_time` [s] and `line_ping`, the first ping of each
        line; without its field where the recorder keeps the recorded numbers only.

    Example:
        >>> from insonify.sonar import Recorder
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> looks = {"kind": "looks", "pings": 3, "samples": 7}
        >>> recorder = Recorder(stages=[looks, {"kind": "companding", "law": "log"}])
        >>> recorded = instrument_recording(insonify.simulate(scenario, pings=range(6)), recorder)["recorded"]
        >>> dict(recorded.sizes), recorded.attrs["units"]  # lines of three pings, as levels
        ({'line': 2, 'channel': 2, 'bin': 250}, 'dB re 1 uPa')
    """
    name = "pressure" if "pressure" in recording else "intensity"
    field = recording[name].transpose("ping", ..., "time")
    per_line, time = recorder.pings_per_line, np.asarray(recording["time"].values, float)
    lines: list[Floats] = []
    bins = recorded_time(time, recorder)
    for first in range(0, field.sizes["ping"] - per_line + 1, per_line):
        series = field[first : first + per_line].values
        series = series if name == "pressure" else np.sqrt(series)
        lines.append(
            record_series(series, time, recorder, sound_speed=sound_speed, absorption_db_per_m=absorption_db_per_m)[0][
                0
            ]
        )
    kept = recording if recorder.keep == "both" else recording.drop_vars(name)
    numbers = np.asarray(recording["ping"].values if "ping" in recording.coords else np.arange(field.sizes["ping"]))
    values = np.asarray(lines, np.float32).reshape(len(lines), *field.shape[1:-1], bins.size)
    dims = ("line", *map(str, field.dims[1:-1]), "bin")
    attributes = {"units": recorder.units, "long_name": RECORDED[recorder.units]}
    columns = {"bin_time": bins, "line_ping": numbers[::per_line][: len(lines)]}
    coordinates = {
        column: (dim, columns[column], {"units": unit, "long_name": meaning})
        for column, (dim, unit, meaning) in RECORDER_COLUMNS.items()
    }
    return kept.assign(recorded=(dims, values, attributes)).assign_coords(coordinates)


def recorded_time(time: ArrayLike, recorder: Recorder) -> Floats:
    """Time of each bin of a recorder's lines [s], shape (bins,).

    Args:
        time: Time of each sample after the start of transmission, evenly spaced [s], shape (samples,).
        recorder: Stages of the instrument.
    """
    alone = [stage.unchecked_copy(pings=1) if isinstance(stage, Looks) else stage for stage in recorder.stages]
    return record_series(np.ones(np.shape(time)), time, recorder.unchecked_copy(stages=tuple(alone)))[1]


def lines_as_pings(recording: xr.Dataset) -> xr.Dataset:
    """Recorded lines in the form of a recording: `recorded` over (ping, channel, time), for images and levels.

    Args:
        recording: With `recorded` over (line, channel, bin), as `instrument_recording` and a run leave it.

    Returns:
        Dataset of the lines, each with the data of its first ping; without pressure.

    Example:
        >>> from insonify.sonar import Recorder
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> recorder = Recorder(stages=[{"kind": "looks", "pings": 3, "samples": 7}])
        >>> lines = lines_as_pings(instrument_recording(insonify.simulate(scenario, pings=range(6)), recorder))
        >>> dict(lines["recorded"].sizes), lines["ping"].values.tolist()
        ({'ping': 2, 'channel': 2, 'time': 250}, [0, 3])
    """
    first = np.searchsorted(recording["ping"].values, recording["line_ping"].values)
    rest = [name for name, variable in recording.variables.items() if "time" in variable.dims]
    lines = recording.drop_vars([*rest, "recorded", "bin_time", "line_ping"]).isel(ping=first)
    time = recording["bin_time"]
    numbers = recording["recorded"].reset_coords(drop=True).rename(line="ping", bin="time").variable  # read on access
    return lines.assign(recorded=numbers).assign_coords(time=("time", time.values, time.attrs))


def field_or_lines(recording: xr.Dataset) -> xr.Dataset:
    """The recording; where a recorder has left neither pressure nor intensity, its lines as pings."""
    has_field = bool({"pressure", "intensity"} & set(recording.variables))
    return recording if has_field or "line_ping" not in recording.variables else lines_as_pings(recording)
