"""Processing of recordings of elements, as datasets: matched filter, beams, sector images, decimation."""

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from insonify.frames import direction
from insonify.processing.beamforming import beamform_delay_sum
from insonify.processing.decimation import Keep, decimate, decimated_time
from insonify.processing.element_series import uniform_clock
from insonify.processing.pulse_compression import matched_filter
from insonify.processing.recorded_geometry import (
    centre_frequency,
    is_bistatic,
    recorded_element_positions,
    recorded_transmitter_position,
)
from insonify.processing.recording_level import recorded_level
from insonify.processing.sector_images import sector_image
from insonify.sonar.pulse import Pulse
from insonify.units import intensity_ratio, level_db

PRESSURE = {"units": "uPa", "long_name": "received pressure, complex envelope, rms scale"}


def compressed_recording(recording: xr.Dataset, replica: Pulse | ArrayLike, *, window: str = "uniform") -> xr.Dataset:
    """A recording after its matched filter; see `matched_filter`.

    Args:
        recording: `pressure` [uPa], complex, over any dimensions and time.
        replica: The transmitted pulse, or its baseband at the recording's rate, shape (n,).
        window: Taper of the replica.

    Returns:
        The recording with `pressure` after the filter: an echo is a peak of its own level at its delay. The attribute
        `pulse_duration` [s] holds the duration of the replica.

    Example:
        >>> import xarray as xr
        >>> from insonify.sonar import Pulse, envelope
        >>> pulse = Pulse(kind="lfm", frequency="100 kHz", bandwidth="20 kHz", duration="2 ms")
        >>> time = np.arange(0, 0.03, 1 / 50e3)
        >>> recording = xr.Dataset({"pressure": ("time", 100 * envelope(pulse, time - 0.02))}, {"time": time})
        >>> level = recorded_level(compressed_recording(recording, pulse))
        >>> print(level.max().values.round(1), level.idxmax().values)  # an echo of 100 uPa at 20 ms
        40.0 0.02
    """
    rate = uniform_clock(recording["time"].values)[1]
    series = recording["pressure"].transpose(..., "time")
    attributes = PRESSURE | {"long_name": "received pressure after the matched filter, complex envelope, rms scale"}
    compressed = series.copy(data=matched_filter(series.values, replica, rate, window=window)).assign_attrs(attributes)
    duration = replica.duration if isinstance(replica, Pulse) else np.size(replica) / rate
    return recording.assign(pressure=compressed).assign_attrs(matched_filter_window=window, pulse_duration=duration)


def beam_recording(
    recording: xr.Dataset, bearings: ArrayLike, *, elevation: ArrayLike = 0.0, sound_speed: float = 1500.0,
    shading: str | ArrayLike = "uniform", focus: str | float = "dynamic", transmitter_position: ArrayLike | None = None,
    threads: int | None = None,
) -> xr.Dataset:  # fmt: skip
    """Beams of a recording of elements by delay and sum; see `beamform_delay_sum`.

    Args:
        recording: `pressure` [uPa] over (ping, channel, time), `element_position` over (channel, axis).
        bearings: Bearings of the beams, clockwise from the bow [rad], shape (beam,).
        elevation: Elevation of the beams, down from the deck [rad], one number or shape (beam,).
        sound_speed: Sound speed of the water [m/s].
        shading: Shading of the elements: a name, or weights of shape (channel,).
        focus: "dynamic", "far", or a range [m].
        transmitter_position: Forward, starboard, down [m], shape (3,); None: from the recording, or the array's middle.
        threads: Number of cores.

    Returns:
        `pressure` over (ping, beam, time) with coordinates `bearing`, `elevation` and `side`, and the recording's other
        variables of pings and times. `sidescan` makes its image of beams abeam.

    Example:
        >>> import xarray as xr
        >>> element = np.stack([np.zeros(16), 0.0075 * (np.arange(16) - 7.5), np.zeros(16)], axis=-1)
        >>> time, ahead = np.arange(0.02, 0.03, 1 / 50e3), np.array([15.0, 10.0, 0.0])  # a point ahead and to starboard
        >>> delay = (np.linalg.norm(ahead) + np.linalg.norm(ahead - element, axis=1)[:, None]) / 1500
        >>> pressure = 1e3 * np.sinc(10e3 * (time - delay)) * np.exp(-2j * np.pi * 100e3 * delay)
        >>> recording = xr.Dataset({
        ...     "pressure": (("channel", "time"), pressure), "element_position": (("channel", "axis"), element)
        ... }, {"time": time}, {"centre_frequency": 100e3})
        >>> beams = beam_recording(recording, np.radians([0, 33.7]))
        >>> print(recorded_level(beams).max("time").values.round())
        [37. 60.]
    """
    if focus == "dynamic" and is_bistatic(recording):
        raise ValueError("focus is dynamic, which follows the range of one platform, and the recording has "
                         "receiver_position. Write far, or a range from the receiver [m].")  # fmt: skip
    bearing = np.atleast_1d(np.asarray(bearings, float))
    elevations = np.broadcast_to(np.asarray(elevation, float), bearing.shape)
    formed = beamform_delay_sum(
        recording["pressure"].transpose(..., "channel", "time").values, recorded_element_positions(recording),
        recording["time"].values, direction(bearing, elevations), centre_frequency=centre_frequency(recording),
        sound_speed=sound_speed, shading=shading, focus=focus,
        transmitter=recorded_transmitter_position(recording, transmitter_position), threads=threads,
    )  # fmt: skip
    template = recording.drop_vars(
        [name for name, variable in recording.variables.items() if "channel" in variable.dims]
    )
    dims = ("ping", "beam", "time") if formed.ndim == 3 else ("beam", "time")
    bearing_attributes = {"units": "rad", "long_name": "bearing of the beam, clockwise from the bow"}
    elevation_attributes = {"units": "rad", "long_name": "elevation of the beam, down from the deck"}
    side = np.sign(np.round(np.sin(bearing), 9)).astype(int)
    side_attributes = {"units": "1", "long_name": "side of the platform: -1 port, 1 starboard, 0 along the keel"}
    return template.assign(pressure=(dims, formed, PRESSURE)).assign_coords(
        bearing=("beam", bearing, bearing_attributes), elevation=("beam", elevations, elevation_attributes),
        side=("beam", side, side_attributes)
    ).assign_attrs(sound_speed=sound_speed)  # fmt: skip


def sector_image_of_beams(
    beams: xr.Dataset, ahead: ArrayLike, starboard: ArrayLike, *, sound_speed: float | None = None
) -> xr.Dataset:
    """Sector image of beams in one plane, ahead and to starboard; see `sector_image`.

    Ranges are half the two-way path lengths, as if the transmitter were at the array: one that is d away shifts
    them by up to d / 2.

    Args:
        beams: `pressure` [uPa] over (..., beam, time) with the coordinate `bearing`, as `beam_recording` gives it.
        ahead: Grid ahead of the array [m], shape (n,).
        starboard: Grid to starboard [m], shape (m,).
        sound_speed: Sound speed of the water [m/s]; None: that of the beamforming.

    Returns:
        `level_db` over (..., ahead, starboard) [dB re 1 uPa]; NaN outside the sector.

    Example:
        >>> import xarray as xr
        >>> pressure = np.full((3, 4), 10 + 0j)
        >>> pressure[1, 2] = 1000  # [uPa] in the beam ahead, at 26.7 ms: 20 m
        >>> coordinates = {"bearing": ("beam", np.radians([-30, 0, 30])), "time": np.arange(4) / 75}
        >>> beams = xr.Dataset({"pressure": (("beam", "time"), pressure)}, coordinates)
        >>> sector_image_of_beams(beams, [10.0, 20.0], [0.0])["level_db"].values.round(1).tolist()
        [[20.0], [60.0]]
    """
    speed = float(beams.attrs.get("sound_speed", 1500.0)) if sound_speed is None else sound_speed
    level = recorded_level(beams).transpose(..., "beam", "time")
    ranges = np.asarray(beams["time"].values, float) * speed / 2
    power = sector_image(intensity_ratio(level.values), beams["bearing"].values, ranges, ahead, starboard)
    attributes = {"units": "dB re 1 uPa", "long_name": "level of the received pressure"}
    axes = {
        "ahead": ("ahead", np.asarray(ahead, float), {"units": "m", "long_name": "distance ahead of the array"}),
        "starboard": ("starboard", np.asarray(starboard, float), {"units": "m", "long_name": "distance to starboard"}),
    }
    dims = (*level.dims[:-2], "ahead", "starboard")
    return xr.Dataset({"level_db": (dims, level_db(power), attributes)}, axes, dict(beams.attrs))


def decimated_recording(recording: xr.Dataset, samples: int, *, keep: Keep = "mean") -> xr.Dataset:
    """Recording reduced to mean-square pressure in fewer samples; see `decimate`.

    Args:
        recording: `pressure` [uPa] or `intensity` [uPa^2] over any dimensions and time.
        samples: Number of samples of each series after decimation.
        keep: "mean" or "peak".

    Returns:
        The recording with `intensity` [uPa^2] at the middles of its samples, in place of its field.

    Example:
        >>> import xarray as xr
        >>> recording = xr.Dataset({"intensity": ("time", [4.0, 2.0, 0.0, 8.0])}, {"time": [0.0, 1e-4, 2e-4, 3e-4]})
        >>> peaks = decimated_recording(recording, 2, keep="peak")
        >>> (1e3 * peaks["time"].values).round(3).tolist(), peaks["intensity"].values.round(3).tolist()  # [ms], [uPa^2]
        ([0.05, 0.25], [4.0, 8.0])
    """
    level = recorded_level(recording).transpose(..., "time")
    template = recording.drop_vars([name for name, variable in recording.variables.items() if "time" in variable.dims])
    intensity_attributes = {"units": "uPa^2", "long_name": f"mean-square pressure, {keep} over each sample"}
    time_attributes = {"units": "s", "long_name": "time after the start of transmission"}
    decimated = decimate(intensity_ratio(level.values), samples, keep=keep)
    return template.assign(intensity=(level.dims, decimated, intensity_attributes)).assign_coords(
        time=("time", decimated_time(recording["time"].values, samples), time_attributes)
    ).assign_attrs(kept=keep)  # fmt: skip
