"""Scenario of a recording of a real instrument: what its file states, and marked defaults for what it does not.

Every value of the text is followed by its source: the group and variable that it is read from, the datagram of a
setting with its offset, or `assumed`. The track is a navigation log of its own where the file has positions of more
than one moment, else a fixed position.
"""

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.formats.instruments.instrument_file import InstrumentFile
from insonify.formats.instruments.recorder_text import recorder_lines, source_level
from insonify.formats.instruments.scenario_values import ScenarioValues, Stated, preferred_group
from insonify.scene.terrain.bathymetry_file import DEEPEST

Floats = NDArray[np.float64]

NO_READING = 1e-3
"""Temperatures and salinities below are those of a sensor that is absent [degC, g/kg]."""
NOISE_OF_BAND = 1 + 0.25 * 3 / 8
"""Noise bandwidth of a scenario's receiver re its flat band: edges of 1/8 with a mean power of 3/8, cos^4 [1]."""
FASTEST = 10.0
"""Speed of a platform whose Doppler shift the receiver's band includes [m/s]."""


def scenario_text(
    file: InstrumentFile, title: str, group: str | None = None, log: str = "", *, sector: int | None = None,
    bathymetry: str = "",
) -> str:  # fmt: skip
    """Scenario of one group of a file, as YAML with comments.

    Args:
        file: The file.
        title: Title of the scenario.
        group: One of the file's groups; None: `preferred_group`.
        log: Path of the navigation log as seen from the scenario; empty: a fixed position.
        sector: Transmit sector, from 0; None: the one in the middle.
        bathymetry: Path of a grid of `soundings_grid` as seen from the scenario; empty: a flat seabed.

    Raises:
        StoreError: The group has no frequency, or there is no such group or sector.
    """
    chosen = preferred_group(file, group)
    values = ScenarioValues(file, chosen, sector)
    maker = " ".join(word for word in (file.instrument.maker, file.instrument.model) if word)
    head = (
        f"# Scenario of {file.path.name} ({file.format}{', ' + maker if maker else ''}), group {chosen}.\n"
        "# Behind each value stands where it comes from; `assumed` marks what the file does not state: check those.\n"
        f"{_sector_note(values)}\n"
    )
    text = "".join(
        (head, f"title: {title}\nseed: 1\n\n", _water(values), _seabed(values, bathymetry), _sonar(values),
         _track(values, log), "\npaths: {max_reflections: 2} # assumed\n\nfield: coherent\n")
    )  # fmt: skip
    return "".join(sign if sign.isprintable() or sign == "\n" else "?" for sign in text)  # names of a damaged file


def _water(values: ScenarioValues) -> str:
    """Lines on the water: the first sound-speed profile, else the sound speed that the sonar uses."""
    text = "water:\n"
    profiles = values.file.sound_speed_profiles()
    knots = _knots(profiles[0], values.seabed_depth().number) if profiles else []
    if len(knots) > 1:
        text += f"  profile: {[list(knot) for knot in knots]} # the file's first sound-speed profile\n"
    else:
        text += values.stated("sound_speed", "m/s", 1500.0).line("sound_speed")
    for key, name, unit in (("temperature", "temperature", "degC"), ("salinity", "salinity", "")):
        if abs(values.median(name) or 0.0) > NO_READING:
            text += values.stated(name, unit, 0.0).line(key)
    return text + "  noise_level_db: 30 dB # assumed\n\n"


def _knots(profile: xr.Dataset, seabed: float) -> list[tuple[float, float]]:
    """Knots of a profile down to the first below the seabed, those without a plausible sound speed left out."""
    depth, speed = (np.asarray(profile[name].values, float) for name in ("depth", "sound_speed"))
    good = np.isfinite(depth) & np.isfinite(speed) & (speed > 1300) & (speed < 1700) & (depth >= 0) & (depth <= DEEPEST)
    depth, speed = np.round(depth[good], 3), np.round(speed[good], 3)
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(depth)) > 0]) if depth.size else np.empty(0, bool)
    depth, speed = depth[rising], speed[rising]
    last = int(np.searchsorted(depth, seabed)) + 1
    above = [(0.0, float(speed[0]))] if depth.size and depth[0] > 0 else []
    return above + list(zip(depth[:last].tolist(), speed[:last].tolist(), strict=True))


def _sector_note(values: ScenarioValues) -> str:
    """Comment on the transmit sector, empty of a sonar with one."""
    if values.sector_count < 2:
        return ""
    note = f"# Transmit sector {values.sector} of 0 to {values.sector_count - 1}"
    if "sector" in values.data and "beam_angle" in values.data:
        angle = np.degrees(values.data["beam_angle"].values[values.data["sector"].values == values.sector])
        if np.isfinite(angle).any():
            note += f", beams {np.nanmin(angle):.3g} to {np.nanmax(angle):.3g} deg"
    if (delay := values.median("sector_delay")) is not None:
        note += f", transmitted {delay * 1e3:.4g} ms after the first"
    if focus := values.median("focus_range"):
        note += f", focused at {focus:.3g} m"
    return f"{note}; `--sector` writes another, `--sector all` one file for each.\n"


def _seabed(values: ScenarioValues, bathymetry: str) -> str:
    """Lines on the seabed: flat, or a grid."""
    origin = "# origin: the first row of the navigation log"
    grid = f"  relief: [{{kind: grid, file: {bathymetry}, origin: [0 m, 0 m]}}] {origin}\n" if bathymetry else ""
    return (
        "seabed:\n" + values.seabed_depth().line("depth") + grid
        + "  scattering: {sediment: medium sand} # assumed\n  reflection: medium sand # assumed\n\n"
    )  # fmt: skip


def _sonar(values: ScenarioValues) -> str:
    """Lines on the sonar: by the kind of the group an echosounder, a multibeam, a sidescan or an imaging sonar."""
    if "voltage" in values.data:
        arrays, tilt = _echosounder(values), "90 deg} # straight down"
    elif values.is_multibeam:
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
    level, recorder = source_level(values).line("source_level_db"), recorder_lines(values)
    mounting = f"  mounting: {{bearing: {bearing}, tilt: {tilt}\n\n"
    return f"sonar:\n{level}{_pulse(values)}{arrays}{recorder}{mounting}"


def _pulse(values: ScenarioValues) -> str:
    """The pulse of the group, swept where the file states it."""
    duration = values.stated("pulse_length", "ms", _assumed_pulse(values) * 1e3, 1e3)
    frequency = values.stated("frequency", "kHz", 0.0, 1e-3)
    source = f"{frequency.source}; pulse_length" + ("" if values.median("pulse_length") else " assumed")
    start, stop = values.median("frequency_start"), values.median("frequency_end")
    if start and stop and stop != start:
        middle = f"{(start + stop) / 2e3:.6g} kHz"
        shape = (
            f"{{kind: lfm, frequency: {middle}, bandwidth: {(stop - start) / 1e3:.6g} kHz, duration: {duration.text}"
        )
    else:
        shape = f"{{kind: cw, frequency: {frequency.text}, duration: {duration.text}"
    if slope := values.median("slope"):
        shape, source = f"{shape}, taper_fraction: {min(2 * slope, 1):.4g}", f"{source}; slope at both ends"
    shape = f"{shape}}}"
    return Stated(shape, source).line("pulse") + _receiver(values)


def _assumed_pulse(values: ScenarioValues) -> float:
    """Pulse that the file does not state [s]: a quarter of a bin of a sidescan, one range step, or 0.1 ms."""
    if (bins := values.median("sample_interval")) and values.group in ("port", "starboard"):
        return bins / 4
    step = values.median("range_step")
    return 2 * step / values.sound_speed if step else 1e-4


def _receiver(values: ScenarioValues) -> str:
    """The receiver's band: that of stated filters; else twice the pulse's and the Doppler shift at `FASTEST`."""
    duration = values.median("pulse_length") or _assumed_pulse(values)
    start, stop = values.median("frequency_start") or 0.0, values.median("frequency_end") or 0.0
    shift = 4 * FASTEST / values.sound_speed * float(values.frequency or 0.0)
    width = (max(2 / duration, 1.25 * abs(stop - start)) + shift) / 1e3
    record = "elements" if values.is_multibeam or "bearing" in values.data else "beams"
    noise, source = values.noise_bandwidth(), "assumed"
    if noise is not None:
        width, source = noise / NOISE_OF_BAND / 1e3, f"{values.group}: filter_1, filter_2, equal noise bandwidth"
    return f"  receiver: {{bandwidth: {width:.4g} kHz, record: {record}, sub_bands: auto}} # {source}\n"


def _echosounder(values: ScenarioValues) -> str:
    widths = [values.median(f"beam_width_{direction}") for direction in ("athwartship", "alongship")]
    width, height = (values.aperture(beam_width or np.radians(7.0)) for beam_width in widths)
    shape = f"{{kind: planar, width: {width}, height: {height}}}"
    stated = f"{values.group}: beam_width_athwartship and beam_width_alongship, uniform aperture"
    source = stated if all(widths) else "assumed: 7 deg where the file has no beam width"
    return Stated(shape, source).line("transmit") + Stated(shape, source).line("receive")


def _multibeam(values: ScenarioValues) -> str:
    stated = {"tx": "transmit beam width", "rx": "receive beam width"}
    along, across = (values.median(f"{end}_beam_width") or values.setting(name) for end, name in stated.items())
    height, length = values.aperture(along or np.radians(1.0)), values.aperture(across or np.radians(1.0))
    count = values.element_count(across or np.radians(1.0))
    source, tilt = f"{values.group}: tx_beam_width, or runtime parameters" if along else "assumed: 1 deg", ""
    if values.forward_tilt:
        tilt, source = f", steer_down: {-np.degrees(values.forward_tilt):.4g} deg", f"{source}, tilt to the bow"
    width = f"{values.wavelength / 2 * 1e3:.4g} mm"
    transmit = Stated(f"{{kind: planar, width: {width}, height: {height}{tilt}}}", source)
    spaced = f"{values.group}: rx_beam_width, or runtime parameters; elements half a wavelength apart"
    receive = Stated(f"{{kind: line, length: {length}, elements: {count}}}", spaced if across else "assumed: 1 deg")
    return transmit.line("transmit") + receive.line("receive")


def _sidescan(values: ScenarioValues) -> str:
    shape = f"{{kind: planar, width: {values.aperture(np.radians(0.4))}, height: {values.aperture(np.radians(50.0))}}}"
    stated = Stated(shape, "assumed: 0.4 deg by 50 deg")
    sides = f"  sides: [{', '.join(side for side in ('port', 'starboard') if side in values.file.groups)}]\n"
    return stated.line("transmit") + stated.line("receive") + sides


def _imaging(values: ScenarioValues) -> str:
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


def _track(values: ScenarioValues, log: str) -> str:
    """The track: a log, or a fixed position."""
    window, time = values.window(), values.times[np.isfinite(values.times)]
    interval = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    if log:
        timing = Stated(f"{interval:.6g} s", f"{values.group}: time" if time.size > 1 else "assumed").line("interval")
        return f"track:\n  kind: navigation\n  file: {log} # {_log_source(values)}\n{timing}" + window.line("window")
    where = Stated(f"[0 m, 0 m, {values.depth.text}]", values.depth.source)
    return "track:\n  kind: static\n" + where.line("position") + window.line("window")


def _log_source(values: ScenarioValues) -> str:
    """Content of the navigation log, with the lever arm that is in it."""
    arm = values.file.lever_arm(values.group)
    if arm is None:
        return "navigation and attitude of the file; no lever arm is stated"
    return f"navigation and attitude of the file, moved to the transducer by [{arm.text}] m ({arm.source})"
