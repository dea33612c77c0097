"""Values of a recording of a real instrument as a scenario needs them, each with its source."""

from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments.instrument_file import InstrumentFile, Setting
from insonify.formats.store_description import StoreError
from insonify.scene.terrain.bathymetry_file import DEEPEST
from insonify.sonar.track import MAX_WINDOW

Floats = NDArray[np.float64]

PINGS_READ = 64
"""Pings from which settings are taken; the median counts."""
_BLANKED = 1.0  # m in front of a transducer that are not searched for the seabed
_DRAFT = 2.0  # m, assumed depth of a sonar without one
_BEHIND_LONGEST = 1.3  # stop of the recorded time re the longest travel time


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
        group: Requested group; None: the soundings, else the first group.

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


class ScenarioValues:
    """Values of one group and one of its transmit sectors, with their sources.

    Args:
        file: The file.
        group: One of its groups.
        sector: Transmit sector, from 0; None: the one in the middle. Pings with the sector's commonest frequency count.

    Raises:
        StoreError: The group has no frequency, or no such sector.
    """

    def __init__(self, file: InstrumentFile, group: str, sector: int | None = None) -> None:
        whole = file.read(group, slice(0, min(PINGS_READ, file.groups[group])))
        self.file, self.group, self.times = file, group, np.unique(np.asarray(whole["time"].values, float))
        self.sector_count = whole.sizes.get("tx_sector", 1)
        self.sector = (self.sector_count - 1) // 2 if sector is None else sector
        if not 0 <= self.sector < self.sector_count:
            raise StoreError(
                f"{file.path}: there is no sector {sector}; group {group} has 0 to {self.sector_count - 1}"
            )
        self.data = _of_sector(whole, self.sector)
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

    def stated(self, name: str, unit: str, default: float, scale: float = 1.0) -> Stated:
        """Median of a variable with its unit and source, or an assumed value."""
        value = self.median(name)
        if value is None or value == 0:
            return Stated(f"{default:.6g} {unit}".strip(), "assumed", default)
        return Stated(f"{value * scale:.6g} {unit}".strip(), f"{self.group}: {name}", value * scale)

    def setting(self, name: str) -> float | None:
        """Number of a setting, None where there is none."""
        setting = self.settings.get(name)
        return float(setting.value) if setting is not None and not isinstance(setting.value, str) else None

    def setting_source(self, name: str) -> str:
        """Datagram of a setting, with its offset."""
        setting = self.settings[name]
        return f"{setting.datagram} at byte {setting.offset}: {name}"

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
        if "TRAI_TX1.Z" in self.settings and "EMXI.SWLZ" in self.settings:
            source = f"{self.setting_source('TRAI_TX1.Z')} less EMXI.SWLZ"
            return _metres((self.setting("TRAI_TX1.Z") or 0.0) - (self.setting("EMXI.SWLZ") or 0.0), source)
        return _metres(_DRAFT, "assumed")

    @property
    def is_multibeam(self) -> bool:
        """True where the group has beams of a multibeam."""
        return "beam_angle" in self.data or "travel_time" in self.data

    @property
    def forward_tilt(self) -> float | None:
        """Steering of the transmit sector towards the bow [rad], None where the file has none.

        Stated is that re the array, which may be mounted with its back to the bow.
        """
        tilt = self.median("tilt")
        if tilt is None or not self.is_multibeam:
            return None
        heading = next((self.setting(name) for name in ("TRAI_TX1.H", "TRAI_HD1.H", "S1H") if name in self.settings), 0)
        return tilt * float(np.cos(heading or 0.0))

    @property
    def depth_name(self) -> str:
        """Variable with the depth of the transducer at each ping, empty where there is none."""
        return next((name for name in ("transducer_depth", "sensor_depth") if self.median(name)), "")

    def seabed_depth(self) -> Stated:
        """Depth of the seabed below the water surface."""
        if (depth := self.median("depth")) and 0 < depth <= DEEPEST and "travel_time" in self.data:
            return _metres(depth, f"{self.group}: depth, median of the soundings")
        if (rate := self.median("sample_rate")) and "detected_sample" in self.data:
            below = self.data["detected_sample"] * np.cos(self.data["beam_angle"]) * (self.sound_speed / 2 / rate)
            source = f"{self.group}: detected_sample and beam_angle, plus depth of the sonar"
            return _metres(float(np.nanmedian(below)) + self.depth.number, source)
        if altitude := self.median("altitude"):
            return _metres(altitude + self.depth.number, f"{self.group}: altitude, plus depth of the sonar")
        if "voltage" in self.data:
            first, step = self.median("first_range") or 0.0, self.median("range_step") or 0.0
            voltage = self.data["voltage"].mean("sector").values.astype(complex)
            amplitude = np.sqrt(np.nanmean(np.abs(voltage) ** 2, axis=0))
            near = max(int((_BLANKED - first) / step), 0) + 1 if step > 0 else amplitude.size
            if near < amplitude.size:
                pulse = first + step * leading_edge(amplitude[:near])
                slant = first + step * (near + leading_edge(amplitude[near:])) - max(pulse, 0.0)
                source = f"{self.group}: leading edge of the strongest echo, {slant:.2f} m behind that of the pulse"
                return _metres(self.depth.number + slant, source)
        last = self.window().number * 1e-3 * self.sound_speed / 2
        return _metres(self.depth.number + last / 4, "assumed: a quarter of the range below the sonar")

    def noise_bandwidth(self) -> float | None:
        """Bandwidth of a rectangle that passes as much white noise as the filters [Hz]; None: none are stated."""
        if "filter_2" not in self.data or (rate := self.median("receiver_sample_rate")) is None:
            return None
        power = np.abs(np.fft.fft(filter_response(self.data), 1 << 16)) ** 2
        return float(rate * power.mean() / power.max())

    def window(self) -> Stated:
        """Start and stop of the recorded time; the number is the stop [ms]."""
        if (longest := self._longest_travel_time()) is not None:
            stop = 1e3 * _BEHIND_LONGEST * longest
            return Stated(
                f"[0 ms, {stop:.4g} ms]", f"{self.group}: {_BEHIND_LONGEST:g} times the longest travel_time", stop
            )
        count = self.data.sizes.get("sample", 0)
        step = self.median("sample_interval")
        if step is None and (rate := self.median("sample_rate")):
            step = 1 / rate
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
        possible = value[value * _BEHIND_LONGEST <= MAX_WINDOW]  # a damaged file states any number
        return float(possible.max()) if possible.size else None


def filter_response(pings: xr.Dataset) -> NDArray[np.complex128]:
    """Impulse response of both filters of a receiver, finite ones, at the rate before them, shape (n,) [1].

    Args:
        pings: Group with `filter_1`, which decimates, and `filter_2` behind it.
    """
    inner, outer = (pings[name].values.reshape(-1, pings[name].shape[-1])[0] for name in ("filter_1", "filter_2"))
    step = int(pings["filter_1"].attrs["decimation"])
    upsampled = np.zeros((outer.size - 1) * step + 1, complex)
    upsampled[::step] = outer
    return np.convolve(inner, upsampled)


def leading_edge(amplitude: Floats) -> float:
    """Sample at which the amplitude rises through half its largest value for the last time before it, interpolated [1].

    Args:
        amplitude: Amplitude, NaN where it is unknown, shape (n,).
    """
    known = np.nan_to_num(amplitude)
    top = int(np.argmax(known))
    below = np.flatnonzero(known[:top] < known[top] / 2)
    if not below.size:
        return float(top)
    low, high = known[below[-1]], known[below[-1] + 1]
    return float(below[-1] + (known[top] / 2 - low) / (high - low))


def _metres(length: float, source: str) -> Stated:
    """A length or depth [m]."""
    return Stated(f"{length:.4g} m", source, length)


def _of_sector(data: xr.Dataset, sector: int) -> xr.Dataset:
    """Pings of one transmit sector: those with its commonest frequency, the first of several."""
    if "tx_sector" not in data.dims:
        return data
    own = data.isel(tx_sector=sector)
    if "frequency" not in own or not np.isfinite(own["frequency"].values).any():
        return own
    frequency = own["frequency"].values
    known, first, count = np.unique(frequency[np.isfinite(frequency)], return_index=True, return_counts=True)
    best = max(range(known.size), key=lambda row: (count[row], -first[row]))
    return own.isel(ping=np.flatnonzero(frequency == known[best]))
