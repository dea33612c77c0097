"""Scenario of a recording of a real instrument: what its file states, and marked defaults for what it does not.

Every value of the text is followed by its source: the group and variable that it is read from, the datagram of a
setting with its offset, or `assumed`. The track is a navigation log of its own where the file has positions of more
than one moment, else a fixed position.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments.instrument_file import InstrumentFile, Setting
from insonify.formats.store_description import StoreError

Floats = NDArray[np.float64]

MOST_FIXES = 20_000
"""Most rows of a navigation log; longer ones are thinned."""
PINGS_READ = 64
"""Pings from which settings are taken; the median counts."""
NO_READING = 1e-3
"""Temperatures and salinities below are those of a sensor that is absent [degC, g/kg]."""
FASTEST = 10.0
"""Speed of a platform whose Doppler shift the receiver's band includes [m/s]."""
_BLANKED = 1.0  # m in front of a transducer that are not searched for the seabed
_DRAFT = 2.0  # m, assumed depth of a sonar without one


@dataclass(frozen=True, slots=True)
class Stated:
    """Value as YAML, with its source."""

    text: str
    source: str
    number: float = np.nan
    """The value in the unit of the text, NaN where it is not one number."""

    def line(self, key: str, indent: str = "  ") -> str:
        """One line of the scenario."""
        return f"{indent}{key}: {self.text} # {self.source}\n"


def preferred_group(file: InstrumentFile, group: str | None = None) -> str:
    """Group of a file from which a scenario is made.

    Args:
        file: The file.
        group: Wanted group; None: the soundings, else the first group.

    Raises:
        StoreError: There is no such group, or the file has no data.
    """
    if not file.groups:
        raise StoreError(f"{file.path}: the file has no pings. Give one that has, or write a scenario by hand")
    if group is None:
        return "soundings" if "soundings" in file.groups else next(iter(file.groups))
    if group not in file.groups:
        raise StoreError(f"{file.path}: there is no group {group!r}. Its groups: {', '.join(file.groups)}")
    return group


def scenario_text(file: InstrumentFile, title: str, group: str | None = None, log: str = "") -> str:
    """Scenario of one group of a file, as YAML with comments.

    Args:
        file: The file.
        title: Title of the scenario.
        group: One of the file's groups; None: `preferred_group`.
        log: Path of the navigation log as seen from the scenario; empty: a fixed position.

    Raises:
        StoreError: The group has no frequency, or there is no such group.
    """
    chosen = preferred_group(file, group)
    data = file.read(chosen, slice(0, min(PINGS_READ, file.groups[chosen])))
    values = _Values(file, chosen, data)
    maker = " ".join(word for word in (file.instrument.maker, file.instrument.model) if word)
    head = (
        f"# Scenario of {file.path.name} ({file.format}{', ' + maker if maker else ''}), group {chosen}.\n"
        "# Behind each value stands where it comes from; `assumed` marks what the file does not state: check those.\n\n"
    )
    return "".join(
        (head, f"title: {title}\nseed: 1\n\n", _water(values), _seabed(values), _sonar(values), _track(values, log),
         "\npaths: {max_reflections: 2} # assumed\n\nfield: coherent\n")
    )  # fmt: skip


class _Values:
    """Values of one group, with their sources."""

    def __init__(self, file: InstrumentFile, group: str, data: xr.Dataset) -> None:
        self.file, self.group, self.data = file, group, data
        self.settings: dict[str, Setting] = {setting.name: setting for setting in file.settings()}
        self.frequency = self.median("frequency")
        if self.frequency is None or self.frequency <= 0:
            raise StoreError(f"{file.path}: group {group} states no frequency. Choose another with --group")
        self.sound_speed = self.median("sound_speed") or 1500.0
        self.depth = self.transducer_depth()

    def median(self, name: str) -> float | None:
        """Median of a variable, None where the group does not have it."""
        if name not in self.data:
            return None
        value = np.asarray(self.data[name].values, float)
        value = value[np.isfinite(value)]
        return float(np.median(value)) if value.size else None

    def stated(self, name: str, unit: str, default: float, scale: float = 1.0, why: str = "assumed") -> Stated:
        """Median of a variable with its unit and source, or an assumed value."""
        value = self.median(name)
        if value is None or value == 0:
            return Stated(f"{default:.6g} {unit}".strip(), why, default)
        return Stated(f"{value * scale:.6g} {unit}".strip(), f"{self.group}: {name}", value * scale)

    def setting(self, name: str) -> float | None:
        """Number of a setting, None where there is none."""
        found = self.settings.get(name)
        return float(found.value) if found is not None and not isinstance(found.value, str) else None

    def setting_source(self, name: str) -> str:
        """Datagram of a setting, with its offset."""
        found = self.settings[name]
        return f"{found.datagram} at byte {found.offset}: {name}"

    def aperture(self, width: float) -> str:
        """Length of a uniform aperture with a half-power beam width [rad]: 0.886 wavelengths / (2 sin(width / 2)).

        Source: Urick (1983), Principles of Underwater Sound, ch. 3: a continuous line, 50.8 lambda / L degrees.
        """
        return f"{self._aperture_wavelengths(width) * self.wavelength * 1e3:.4g} mm"

    def element_count(self, width: float) -> int:
        """Number of elements half a wavelength apart that fill such an aperture."""
        return max(2, int(np.ceil(2 * self._aperture_wavelengths(width))))

    @property
    def wavelength(self) -> float:
        """Wavelength at the sonar [m]."""
        return self.sound_speed / float(self.frequency or 1.0)

    @staticmethod
    def _aperture_wavelengths(width: float) -> float:
        return float(0.886 / (2 * np.sin(min(width, 3.0) / 2)))

    def transducer_depth(self) -> Stated:
        """Depth of the transducer below the water surface."""
        if self.depth_name:
            return self.stated(self.depth_name, "m", _DRAFT)
        below = self.setting(f"{self.group}.mounting.TransducerOffsetZ")
        if below is not None:
            level = self.median("water_level") or 0.0
            source = self.setting_source(f"{self.group}.mounting.TransducerOffsetZ")
            return _metres(below + level, f"{source}, plus {self.group}: water_level")
        return _metres(_DRAFT, "assumed")

    @property
    def depth_name(self) -> str:
        """Variable with the depth of the transducer at each ping, empty where there is none."""
        return next((name for name in ("transducer_depth", "sensor_depth") if self.median(name)), "")

    def seabed_depth(self) -> Stated:
        """Depth of the seabed below the water surface."""
        if (depth := self.median("depth")) and "travel_time" in self.data:
            return _metres(depth, f"{self.group}: depth, median of the soundings")
        if altitude := self.median("altitude"):
            return _metres(altitude + self.depth.number, f"{self.group}: altitude, plus depth of the sonar")
        if "voltage" in self.data:
            first, step = self.median("first_range") or 0.0, self.median("range_step") or 0.0
            power = np.nanmean(np.abs(self.data["voltage"].mean("sector").values) ** 2, axis=0)
            away = first + step * np.arange(power.size)
            far = away > _BLANKED
            if step > 0 and far.any():
                slant = float(away[far][np.nanargmax(power[far])])
                return _metres(self.depth.number + slant, f"{self.group}: range of the strongest echo, {slant:.2f} m")
        last = self.window().number * 1e-3 * self.sound_speed / 2
        return _metres(self.depth.number + last / 4, "assumed: a quarter of the range below the sonar")

    def window(self) -> Stated:
        """Start and stop of the recorded time; the number is the stop [ms]."""
        if (longest := self._longest_travel_time()) is not None:
            stop = 1.3e3 * longest
            return Stated(f"[0 ms, {stop:.4g} ms]", f"{self.group}: 1.3 times the longest travel_time", stop)
        count = self.data.sizes.get("sample", 0)
        step = self.median("sample_interval")
        if step is None and (across := self.median("range_step")):
            step = 2 * across / self.sound_speed
        start = 2 * (self.median("first_range") or 0.0) / self.sound_speed
        if step is None or not count:
            return Stated("[0 ms, 100 ms]", "assumed", 100.0)
        stop = 1e3 * (start + count * step)
        return Stated(f"[{1e3 * start:.4g} ms, {stop:.5g} ms]", f"{self.group}: samples", stop)

    def _longest_travel_time(self) -> float | None:
        if "travel_time" not in self.data:
            return None
        value = np.asarray(self.data["travel_time"].values, float)
        return float(np.nanmax(value)) if np.isfinite(value).any() else None


def _metres(length: float, source: str) -> Stated:
    """A length or depth [m]."""
    return Stated(f"{length:.4g} m", source, length)


def _water(values: _Values) -> str:
    """Lines on the water: the first sound-speed profile, else the sound speed that the sonar uses."""
    text = "water:\n"
    profiles = values.file.sound_speed_profiles()
    knots = _knots(profiles[0], values.seabed_depth().number) if profiles else []
    if len(knots) > 1:
        text += f"  profile: {[[round(d, 3), round(c, 3)] for d, c in knots]} # the file's first sound-speed profile\n"
    else:
        text += values.stated("sound_speed", "m/s", 1500.0).line("sound_speed")
    for key, name, unit in (("temperature", "temperature", "degC"), ("salinity", "salinity", "")):
        if abs(values.median(name) or 0.0) > NO_READING:
            text += values.stated(name, unit, 0.0).line(key)
    return text + "  noise_level_db: 30 dB # assumed\n\n"


def _knots(profile: xr.Dataset, seabed: float) -> list[tuple[float, float]]:
    """Knots of a profile down to the first below the seabed, those without a plausible sound speed left out."""
    depth, speed = (np.asarray(profile[name].values, float) for name in ("depth", "sound_speed"))
    good = np.isfinite(depth) & np.isfinite(speed) & (speed > 1300) & (speed < 1700) & (depth >= 0)
    depth, speed = depth[good], speed[good]
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(depth)) > 0]) if depth.size else np.empty(0, bool)
    depth, speed = depth[rising], speed[rising]
    last = int(np.searchsorted(depth, seabed)) + 1
    above = [(0.0, float(speed[0]))] if depth.size and depth[0] > 0 else []
    return above + list(zip(depth[:last].tolist(), speed[:last].tolist(), strict=True))


def _seabed(values: _Values) -> str:
    """Lines on the seabed."""
    return (
        "seabed:\n" + values.seabed_depth().line("depth")
        + "  scattering: {sediment: medium sand} # assumed\n  reflection: medium sand # assumed\n\n"
    )  # fmt: skip


def _sonar(values: _Values) -> str:
    """Lines on the sonar: by the kind of the group an echosounder, a multibeam, a sidescan or an imaging sonar."""
    if "voltage" in values.data:
        arrays, tilt = _echosounder(values), "90 deg} # straight down"
    elif "travel_time" in values.data:
        arrays, tilt = _multibeam(values), "90 deg} # straight down"
    elif values.group in ("port", "starboard"):
        arrays, tilt = _sidescan(values), "20 deg} # assumed"
    else:
        angle = values.median("tilt")
        arrays = _imaging(values)
        tilt = "15 deg} # assumed" if angle is None else f"{-np.degrees(angle):.4g} deg}} # {values.group}: tilt"
    if tilt.startswith("90"):
        tilt += "\n  # hull: {length: 30 m, width: 8 m, reflection: 0.9} # of a ship: multiples at 2, 3 ... ranges"
    bearing = "90 deg" if values.group in ("port", "starboard") else "0 deg"
    return f"sonar:\n{_source_level(values)}{_pulse(values)}{arrays}  mounting: {{bearing: {bearing}, tilt: {tilt}\n\n"


def _source_level(values: _Values) -> str:
    """Source level as stated, or of the electric power and the transducer's gain: 170.8 dB + 10 log P + G.

    Source: Urick (1983), Principles of Underwater Sound, ch. 4: 170.8 dB + 10 log P + DI for the power P [W] radiated;
    the gain G holds the directivity index and the efficiency.
    """
    if values.median("source_level"):
        return values.stated("source_level", "dB", 220.0).line("source_level_db")
    power, gain = values.median("transmit_power"), values.median("gain_db")
    if "voltage" in values.data and power and gain:
        level = 170.8 + 10 * np.log10(power) + gain
        return Stated(f"{level:.4g} dB", f"{values.group}: transmit_power and gain_db").line("source_level_db")
    return Stated("210 dB", "assumed").line("source_level_db")


def _pulse(values: _Values) -> str:
    """The pulse of the group, swept where the file says so."""
    duration = values.stated("pulse_length", "ms", 0.1, 1e3)
    frequency = values.stated("frequency", "kHz", 0.0, 1e-3)
    source = f"{frequency.source}; pulse_length" + ("" if values.median("pulse_length") else " assumed")
    start, stop = values.median("frequency_start"), values.median("frequency_end")
    if start and stop and stop != start:
        middle = f"{(start + stop) / 2e3:.6g} kHz"
        shape = (
            f"{{kind: lfm, frequency: {middle}, bandwidth: {(stop - start) / 1e3:.6g} kHz, duration: {duration.text}}}"
        )
    else:
        shape = f"{{kind: cw, frequency: {frequency.text}, duration: {duration.text}}}"
    return Stated(shape, source).line("pulse") + _receiver(values)


def _receiver(values: _Values) -> str:
    """The receiver's band: twice the pulse's and the Doppler shift at `FASTEST`, whatever the file samples at."""
    duration = values.median("pulse_length") or 1e-4
    start, stop = values.median("frequency_start") or 0.0, values.median("frequency_end") or 0.0
    shift = 4 * FASTEST / values.sound_speed * float(values.frequency or 0.0)
    width = (max(2 / duration, 1.25 * abs(stop - start)) + shift) / 1e3
    record = "elements" if "travel_time" in values.data or "bearing" in values.data else "beams"
    return f"  receiver: {{bandwidth: {width:.4g} kHz, record: {record}, sub_bands: auto}} # assumed\n"


def _echosounder(values: _Values) -> str:
    widths = [values.median(f"beam_width_{direction}") for direction in ("athwartship", "alongship")]
    width, height = (values.aperture(beam_width or np.radians(7.0)) for beam_width in widths)
    shape = f"{{kind: planar, width: {width}, height: {height}}}"
    stated = f"{values.group}: beam_width_athwartship and beam_width_alongship, uniform aperture"
    source = stated if all(widths) else "assumed: 7 deg where the file has no beam width"
    return Stated(shape, source).line("transmit") + Stated(shape, source).line("receive")


def _multibeam(values: _Values) -> str:
    along, across = (values.median(f"{end}_beam_width") for end in ("tx", "rx"))
    height, length = values.aperture(along or np.radians(1.0)), values.aperture(across or np.radians(1.0))
    count = values.element_count(across or np.radians(1.0))
    transmit = Stated(
        f"{{kind: planar, width: {values.wavelength / 2 * 1e3:.4g} mm, height: {height}}}",
        f"{values.group}: tx_beam_width" if along else "assumed: 1 deg",
    )
    receive = Stated(
        f"{{kind: line, length: {length}, elements: {count}}}",
        f"{values.group}: rx_beam_width, elements half a wavelength apart" if across else "assumed: 1 deg",
    )
    return transmit.line("transmit") + receive.line("receive")


def _sidescan(values: _Values) -> str:
    shape = f"{{kind: planar, width: {values.aperture(np.radians(0.4))}, height: {values.aperture(np.radians(50.0))}}}"
    found = Stated(shape, "assumed: 0.4 deg by 50 deg")
    sides = f"  sides: [{', '.join(side for side in ('port', 'starboard') if side in values.file.groups)}]\n"
    return found.line("transmit") + found.line("receive") + sides


def _imaging(values: _Values) -> str:
    """A forward-looking sonar that resolves the spacing of the file's beams."""
    bearing = np.unique(np.asarray(values.data["bearing"].values, float)) if "bearing" in values.data else np.empty(0)
    spacing = float(np.median(np.diff(bearing))) if bearing.size > 1 else np.radians(1.0)
    length, count = values.aperture(2 * spacing), values.element_count(2 * spacing)
    height = values.aperture(np.radians(14.0))
    transmit = Stated(
        f"{{kind: planar, width: {values.wavelength / 2 * 1e3:.4g} mm, height: {height}}}", "assumed: 14 deg high"
    )
    receive = Stated(
        f"{{kind: planar, width: {length}, height: {height}, columns: {count}}}",
        f"{values.group}: bearing, beams of twice their spacing",
    )
    return transmit.line("transmit") + receive.line("receive")


def _track(values: _Values, log: str) -> str:
    """The track: a log, or a fixed position."""
    window, time = values.window(), np.unique(np.asarray(values.data["time"].values, float))
    time = time[np.isfinite(time)]
    interval = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    if log:
        timing = Stated(f"{interval:.6g} s", f"{values.group}: time" if time.size > 1 else "assumed").line("interval")
        return (
            f"track:\n  kind: navigation\n  file: {log} # navigation and attitude of the file\n{timing}"
            + window.line("window")
        )
    where = Stated(f"[0 m, 0 m, {values.depth.text}]", values.depth.source)
    return "track:\n  kind: static\n" + where.line("position") + window.line("window")


def navigation_log(file: InstrumentFile, group: str | None = None) -> str:
    """Navigation log of a file as comma-separated values; empty where it has positions of one moment at most.

    Args:
        file: The file.
        group: Group whose transducer depth counts; None: `preferred_group`.

    Depths are those of the transducer at each ping, else its mean depth and the heave.
    """
    chosen = preferred_group(file, group)
    values = _Values(file, chosen, file.read(chosen, slice(0, min(PINGS_READ, file.groups[chosen]))))
    fixes = file.navigation()
    known = None if fixes is None else _increasing(fixes, "latitude", "longitude")
    if known is None or known["time"].size < 2:
        return ""
    poses = file.attitude()
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
    digits = {"latitude": 9, "longitude": 9, "depth": 3}
    rows = ["time [s],latitude [deg],longitude [deg],depth [m],heading [deg],pitch [deg],roll [deg]"]
    for k, moment in enumerate(time - time[0]):
        rows.append(",".join([f"{moment:.4f}", *(f"{columns[n][k]:.{digits.get(n, 4)}f}" for n in columns)]))
    return "\n".join(rows) + "\n"


def _depths(file: InstrumentFile, group: str, time: Floats, values: _Values) -> Floats:
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
