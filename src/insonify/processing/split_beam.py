"""Power, backscattering strength and angles from the sectors of a split-beam echosounder.

Andersen et al. (2024), "Quantitative processing of broadband data as implemented in a scientific split-beam
echosounder", Methods Ecol. Evol. 15, 317-328; equation numbers are those of the manuscript that its authors publish
with their code. The time factor is exp(+j 2 pi f t): the sector that the echo reaches first has the greater phase.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
import xarray as xr
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.absorption import absorption_db_per_m

Floats = NDArray[np.float64]
SECTORS = {1: 4, 17: 3, 49: 4, 65: 4, 81: 4}
"""Number of sectors by type of beam: quadrants; thirds; thirds about a centre that counts with each."""
# stored angles of thirds are means of two differences, not yet scaled (maker's help, "Special scaling")
_THIRDS = (17, 49, 65, 81)
TRANSDUCER_IMPEDANCE = 75.0
"""Impedance of a transducer where none is stated [ohm]."""


@dataclass(frozen=True, slots=True)
class Replica:
    """Transmitted pulse behind the filters of the receiver."""

    samples: NDArray[np.complex128]
    """Complex baseband from the start of the pulse, shape (n,) [1]."""
    sample_rate: float
    """Sample rate behind the decimation [Hz]."""

    def resolution_time(self, *, compressed: bool) -> float:
        """Duration of a rectangle with peak and energy of the received pulse [s]: eq. 6, the effective pulse duration.

        Args:
            compressed: True behind a matched filter; else the envelope stands for the autocorrelation of eq. 5.
        """
        pulse = self.samples
        shape = scipy.signal.fftconvolve(pulse, np.conj(pulse[::-1])) if compressed else pulse
        power = np.abs(shape) ** 2
        return float(power.sum() / (power.max() * self.sample_rate))

    def compress(self, voltage: ArrayLike) -> NDArray[np.complex128]:
        """Samples behind the matched filter: eq. 7; an echo of the replica's amplitude a has a peak of a at its start.

        Args:
            voltage: Complex samples at `sample_rate`, shape (..., samples).

        Returns:
            Samples of the same shape. They are double precision: a record opens with the transmitted pulse, more than
            100 dB above the echoes at its end.
        """
        given = np.asarray(voltage, complex)
        kernel = np.conj(self.samples[::-1]).reshape((1,) * (given.ndim - 1) + (-1,))
        compressed = scipy.signal.fftconvolve(given, kernel, axes=-1)[..., self.samples.size - 1 :]
        return np.asarray(compressed / np.sum(np.abs(self.samples) ** 2))


@dataclass(frozen=True, slots=True)
class PowerBudget:
    """Constants of the sonar equation of one ping."""

    wavelength: float
    """At the centre frequency [m]."""
    sound_speed: float
    """Sound speed [m/s]."""
    absorption_db_per_m: float
    """One-way loss [dB/m]."""
    transmit_power: float
    """Electrical power [W]."""
    gain_db: float
    """Gain of the transducer on its axis [dB]."""
    equivalent_beam_angle_db: float
    """Two-way beam angle [dB re 1 sr]."""
    resolution_time: float
    """Duration of a rectangle with peak and energy of the received pulse [s]."""
    sa_correction_db: float = 0.0
    """Correction of the integrated echo [dB]."""

    def point_scattering_strength(self, power: ArrayLike, slant_range: ArrayLike) -> Floats:
        """Target strength of a point on the axis [dB re 1 m^2]: eq. 20.

        Args:
            power: Received power [W].
            slant_range: Range [m], broadcast with the power; NaN results at a range that is not positive.
        """
        r, loss = self._spread(power, slant_range)
        reference = self.transmit_power * self.wavelength**2 / (16 * np.pi**2)
        return np.asarray(loss + 40 * np.log10(r) - 10 * np.log10(reference) - 2 * self.gain_db)

    def volume_backscattering_strength(self, power: ArrayLike, slant_range: ArrayLike) -> Floats:
        """Volume backscattering strength [dB re 1/m]: eq. 30, less twice the correction of the integrated echo.

        Args:
            power: Received power [W].
            slant_range: Range [m], broadcast with the power; NaN results at a range that is not positive.
        """
        r, loss = self._spread(power, slant_range)
        reference = self.transmit_power * self.wavelength**2 * self.sound_speed * self.resolution_time
        angle = self.equivalent_beam_angle_db + 2 * (self.gain_db + self.sa_correction_db)
        return np.asarray(loss + 20 * np.log10(r) - 10 * np.log10(reference / (32 * np.pi**2)) - angle)

    def _spread(self, power: ArrayLike, slant_range: ArrayLike) -> tuple[Floats, Floats]:
        """Range where it is positive, else NaN, and the received level with absorption undone."""
        r = np.asarray(slant_range, float)
        r = np.where(r > 0, r, np.nan)
        p = np.asarray(power, float)
        level = 10 * np.log10(np.where(p > 0, p, np.nan))
        return r, level + 2 * self.absorption_db_per_m * r


def transmit_replica(
    band: tuple[float, float],
    duration: float,
    slope: float,
    sample_rate: float,
    filters: Sequence[tuple[ArrayLike, int]],
) -> Replica:
    """Transmitted pulse behind the filters of the receiver: eq. 3 and 4, with the windowed sweep of section II.B.

    Args:
        band: Frequency at the start and at the end of the pulse [Hz]; equal for a tone.
        duration: Duration of the pulse [s].
        slope: Part of the duration over which the envelope rises, and over which it falls [1].
        sample_rate: Sample rate before the filters [Hz].
        filters: Coefficients and decimation of each stage.
    """
    count = int(duration * sample_rate)
    t = np.arange(count) / sample_rate
    pulse = np.cos(np.pi * (band[1] - band[0]) / duration * t**2 + 2 * np.pi * band[0] * t)
    window = np.hanning(min(round(2 * duration * sample_rate * slope), count))
    rise = window.size // 2
    pulse[:rise] *= window[:rise]
    pulse[count - window.size + rise :] *= window[rise:]
    samples, rate = (pulse / pulse.max()).astype(complex), sample_rate
    for coefficients, decimation in filters:
        samples = scipy.signal.fftconvolve(samples, np.asarray(coefficients, complex))[::decimation]
        rate /= decimation
    return Replica(samples, rate)


def received_power(voltage: ArrayLike, transducer_impedance: float, transceiver_impedance: float) -> Floats:
    """Power that all sectors deliver to a matched load [W]: eq. 8 and 13.

    Args:
        voltage: Complex samples of each sector [V], shape (..., sectors, samples).
        transducer_impedance: Impedance of a sector [ohm].
        transceiver_impedance: Input impedance of a channel of the receiver [ohm].

    Returns:
        Power, shape (..., samples).
    """
    sectors = np.asarray(voltage)
    amplitude = np.abs(sectors.mean(axis=-2)).astype(float) / (2 * np.sqrt(2))
    divider = abs(transceiver_impedance + transducer_impedance) / transceiver_impedance
    return np.asarray(sectors.shape[-2] * amplitude**2 * divider**2 / abs(transducer_impedance))


def pressure_per_volt(pings: xr.Dataset) -> float:
    """Rms pressure of a wave on the axis per volt of the mean over all sectors [uPa/V]; NaN where settings are missing.

    The received power is that of the wave's intensity on the effective area G lambda^2 / (4 pi); with the source level
    170.8 dB + 10 log P + G of the same transducer, eq. 20 follows.

    Args:
        pings: Group of an EK80 file with complex samples of tones; the median of each setting counts.
    """
    names = ("frequency", "sound_speed", "gain_db", "transceiver_impedance")
    known = [float(np.nanmedian(pings[name].values)) if name in pings else np.nan for name in names]
    frequency, sound_speed, gain_db, receiver = known
    if not np.all(np.isfinite(known)):
        return float("nan")
    transducer = _calibrated(pings.isel(ping=0), "transducer_impedance", frequency, TRANSDUCER_IMPEDANCE)
    power = received_power(np.ones((pings.sizes["sector"], 1)), transducer, receiver)[0]
    # 170.8 dB is the level at 1 m of 1 W into all directions
    level = 10 * np.log10(power) + 170.8 + 20 * np.log10(4 * np.pi * frequency / sound_speed) - gain_db
    return float(10 ** (level / 20))


def electrical_angles(voltage: ArrayLike, beam_type: int) -> tuple[Floats, Floats]:
    """Phase between parts of a transducer, positive forward and positive to starboard [rad].

    Four sectors: eq. 9 to 15 between halves. Three sectors at 120 deg, of which one is forward: the differences forward
    less starboard and forward less port are (sqrt(3) a - b) / 2 and (sqrt(3) a + b) / 2 for electrical angles a
    alongship and b athwart over the distance of two sectors, from their geometry.

    Args:
        voltage: Complex samples [V], shape (..., sectors, samples), in the order of the instrument: aft starboard, aft
            port, fore port, fore starboard; or starboard, port, forward and perhaps the centre.
        beam_type: Type of the beam as the instrument numbers it.

    Returns:
        Alongship and athwartship angle, each of shape (..., samples).

    Raises:
        ValueError: The beam is not split, or the number of sectors is not that of its type.
    """
    sectors = np.moveaxis(np.asarray(voltage), -2, 0)
    if SECTORS.get(beam_type) != len(sectors):
        raise ValueError(f"beam_type {beam_type} with {len(sectors)} sectors is not split into three or four")
    if beam_type == 1:
        first, second, third, fourth = sectors
        along = (third + fourth) * np.conj(first + second)
        return np.angle(along), np.angle((first + fourth) * np.conj(second + third))
    if len(sectors) == 4:
        sectors = sectors[:3] + sectors[3]
    starboard, port, fore = sectors
    to_starboard, to_port = np.angle(fore * np.conj(starboard)), np.angle(fore * np.conj(port))
    return (to_starboard + to_port) / np.sqrt(3), to_port - to_starboard


def echosounder_levels(pings: xr.Dataset) -> xr.Dataset:
    """Backscattering strength and angles of the echoes of a split-beam echosounder.

    Swept pulses are compressed by the matched filter. The absorption is that of Francois & Garrison (1982) in the water
    that the file states. Pings of which the file lacks a setting are NaN.

    Args:
        pings: Group of an EK80 file, as read.

    Returns:
        `received_power` [W], `point_scattering_strength` [dB re 1 m^2] and `volume_backscattering_strength` [dB re 1/m]
        over (ping, sample), `angle_alongship` and `angle_athwartship` [rad] of split beams, and the coordinate `range`.

    Raises:
        ValueError: The dataset has no echoes of an echosounder, or a setting is missing in all pings.

    Example:
        >>> import xarray as xr
        >>> settings = {
        ...     "frequency": 38e3, "nominal_frequency": 38e3, "transmit_power": 1000.0, "gain_db": 25.5, "slope": 0.1,
        ...     "equivalent_beam_angle_db": -20.7, "pulse_length": 1e-3, "swept": 0.0, "sound_speed": 1500.0,
        ...     "first_range": 0.0, "range_step": 10.0,
        ... }
        >>> variables = {name: ("ping", [value]) for name, value in settings.items()}
        >>> variables["power_db"] = (("ping", "sample"), [[-20.0, -61.0, -120.0]])  # re 1 W, at 0, 10 and 20 m
        >>> levels = echosounder_levels(xr.Dataset(variables, {"ping": [0], "time": ("ping", [0.0])}))
        >>> levels["point_scattering_strength"].values.round(1).tolist()  # [dB re 1 m^2]
        [[nan, -51.7, -98.5]]
    """
    if not {"ping", "sample"} <= set(pings.dims) or not {"voltage", "power_db"} & set(pings.data_vars):
        raise ValueError(
            "the dataset has neither voltage nor power_db over (ping, sample). Give a group of the file of an "
            'echosounder: with insonify.open_instrument("survey.raw") as file, file.read("38 kHz")'
        )
    rows: list[dict[str, Floats]] = []
    missing: list[str] = []
    for number in range(pings.sizes["ping"]):
        ping = pings.isel(ping=number)
        known = {str(name): float(value) for name, value in ping.data_vars.items() if not value.dims}
        missing = [name for name in _needed(ping, known) if not np.isfinite(known.get(name, np.nan))]
        rows.append({} if missing else _ping_levels(ping, known))
    if missing and not any(rows):
        raise ValueError(
            f"the file does not state {', '.join(missing)}. Assign what is known of the instrument, such as "
            f"pings[{missing[0]!r}] = 5400.0"
        )
    shape = (pings.sizes["ping"], pings.sizes["sample"])
    levels = xr.Dataset(coords={name: pings[name] for name in ("ping", "time")}, attrs=pings.attrs)
    for name, (unit, text) in _LEVELS.items():
        if any(name in row for row in rows):
            values = np.full(shape, np.nan)
            for target, row in zip(values, rows, strict=True):
                target[:] = row.get(name, np.nan)
            levels[name] = xr.Variable(("ping", "sample"), values, {"units": unit, "long_name": text})
    return levels.set_coords([name for name in ("range",) if name in levels])


_LEVELS = {
    "range": ("m", "range"),
    "received_power": ("W", "received power in a matched load"),
    "point_scattering_strength": ("dB re 1 m^2", "target strength of a point on the axis"),
    "volume_backscattering_strength": ("dB re 1/m", "volume backscattering strength"),
    "angle_alongship": ("rad", "angle of the echo from the axis, positive forward"),
    "angle_athwartship": ("rad", "angle of the echo from the axis, positive to starboard"),
}


def _needed(ping: xr.Dataset, known: dict[str, float]) -> list[str]:
    """Settings without which a ping has no levels."""
    names = ["frequency", "nominal_frequency", "sound_speed", "first_range", "range_step", "transmit_power",
             "pulse_length", "equivalent_beam_angle_db", "gain_db"]  # fmt: skip
    if "voltage" in ping:
        names.append("transceiver_impedance")
    return [*names, "slope", "receiver_sample_rate"] if known.get("swept", 0.0) else names


def _ping_levels(ping: xr.Dataset, known: dict[str, float]) -> dict[str, Floats]:
    """Levels and angles of one ping, each of shape (samples,)."""
    swept = bool(known.get("swept", 0.0))
    replica = _replica(ping, known)
    time = known["pulse_length"] if replica is None else replica.resolution_time(compressed=swept)
    budget = _budget(ping, known, time)
    slant_range = np.asarray(known["first_range"] + known["range_step"] * np.arange(ping.sizes["sample"]))
    phases: tuple[Floats, Floats] | None = None
    if "voltage" in ping:
        voltage = ping["voltage"].values
        if swept and replica is not None:
            voltage = replica.compress(np.nan_to_num(voltage))
        impedance = _calibrated(ping, "transducer_impedance", known["frequency"], TRANSDUCER_IMPEDANCE)
        power = received_power(voltage, impedance, known["transceiver_impedance"])
        if SECTORS.get(int(known.get("beam_type", 0))) == len(voltage):
            phases = electrical_angles(voltage, int(known["beam_type"]))
    else:
        power = 10 ** (ping["power_db"].values.astype(float) / 10)
        if "phase_alongship" in ping:
            along, athwart = (2 / np.sqrt(3), 2.0) if int(known.get("beam_type", 0)) in _THIRDS else (1.0, 1.0)
            phases = along * ping["phase_alongship"].values, athwart * ping["phase_athwartship"].values
    columns = {
        "range": slant_range,
        "received_power": power,
        "point_scattering_strength": budget.point_scattering_strength(power, slant_range),
        "volume_backscattering_strength": budget.volume_backscattering_strength(power, slant_range),
    }
    for side, phase in zip(("alongship", "athwartship"), phases or (), strict=False):
        sensitivity = known[f"angle_sensitivity_{side}"] * known["frequency"] / known["nominal_frequency"]
        sine = np.clip(phase / sensitivity, -1, 1)  # eq. 16 and 17
        columns[f"angle_{side}"] = np.arcsin(sine) - known[f"angle_offset_{side}"]
    return columns


def _replica(ping: xr.Dataset, known: dict[str, float]) -> Replica | None:
    """Replica of the pulse of one ping; None of a tone whose slope the file does not state."""
    rate, slope = known.get("receiver_sample_rate", np.nan), known.get("slope", np.nan)
    if not (np.isfinite(rate) and np.isfinite(slope)) or known["pulse_length"] * rate < 2:
        return None
    stages = [
        (ping[name].values, int(ping[name].attrs["decimation"])) for name in ("filter_1", "filter_2") if name in ping
    ]
    band = known["frequency_start"], known["frequency_end"]
    return transmit_replica(band, known["pulse_length"], slope, rate, stages)


def _budget(ping: xr.Dataset, known: dict[str, float], resolution_time: float) -> PowerBudget:
    """Sonar equation of one ping: the gain of a sweep is that calibrated, or that of a constant aperture."""
    centre, swept = known["frequency"], bool(known.get("swept", 0.0))
    aperture_db = 20 * np.log10(centre / known["nominal_frequency"])
    gain, correction = known["gain_db"], known.get("sa_correction_db", np.nan)
    return PowerBudget(
        wavelength=known["sound_speed"] / centre,
        sound_speed=known["sound_speed"],
        absorption_db_per_m=_absorption(known, centre),
        transmit_power=known["transmit_power"],
        gain_db=_calibrated(ping, "gain_db", centre, gain + aperture_db) if swept else gain,
        equivalent_beam_angle_db=known["equivalent_beam_angle_db"] - aperture_db,  # eq. 29
        resolution_time=resolution_time,
        sa_correction_db=0.0 if swept or not np.isfinite(correction) else correction,
    )


def _calibrated(ping: xr.Dataset, name: str, frequency: float, otherwise: float) -> float:
    """Value of the calibration over frequency, or another where there is none."""
    if f"calibrated_{name}" not in ping:
        return otherwise
    values, over = ping[f"calibrated_{name}"].values, ping["calibration_frequency"].values
    sound = np.isfinite(values) & np.isfinite(over)
    return float(np.interp(frequency, over[sound], values[sound])) if sound.any() else otherwise


def _absorption(known: dict[str, float], frequency: float) -> float:
    """Absorption in the water that a ping states [dB/m]."""
    water = {"temperature": "temperature", "salinity": "salinity", "depth": "environment_depth", "ph": "acidity"}
    stated: dict[str, Any] = {
        name: known[field] for name, field in water.items() if np.isfinite(known.get(field, np.nan))
    }
    return float(absorption_db_per_m(frequency, **stated))
