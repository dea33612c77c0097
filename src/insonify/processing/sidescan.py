"""Sidescan image: a recording's pings as lines, port to the left and starboard to the right."""

from typing import get_args

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.former_names import FORMER_WORDS
from insonify.processing.gain import LAWS, along_track_gain_db, empirical_gain_db, lambert_gain_db
from insonify.processing.recorded_geometry import require_one_platform
from insonify.processing.recorder import field_or_lines
from insonify.processing.recording_level import recorded_level
from insonify.processing.slant_range_correction import first_bottom_return, slant_to_ground_range
from insonify.records.image import Geometry, image_dataset
from insonify.sonar.time_varied_gain import tvg_db

Floats = NDArray[np.float64]

GAINS = ("none", *LAWS, "lambert", "empirical")
"""Names of the gains."""


def sidescan(
    recording: xr.Dataset, *, geometry: Geometry = "slant", gain: str = "empirical", sound_speed: float = 1500.0,
    absorption_db_per_m: float = 0.0, altitude: float | Floats | None = None, beam: int = 0,
    normalise_along_track: bool = False,
) -> xr.Dataset:  # fmt: skip
    """Sidescan image of a recording.

    Args:
        recording: `pressure` [uPa] or `intensity` [uPa^2] over (ping, channel, time), with the coordinate `side`; or
                over (ping, beam, time), as beams formed from an array's elements; or a recorder's lines alone.
        geometry: "slant" for slant range, or "ground" for distance on a flat seabed.
        gain: One of `GAINS`: none, tvg20, tvg30, tvg40, lambert (a flat seabed that scatters by Lambert's law becomes
            uniform), empirical (the median over all pings becomes uniform).
        sound_speed: Sound speed of the water [m/s].
        absorption_db_per_m: One-way absorption of the water, for the gains by law [dB/m].
        altitude: Height above the seabed [m], one number or shape (ping,); None: from the first bottom return.
        beam: Index of the beam within each side, from 0.
        normalise_along_track: True to even out pings that are weaker or stronger as a whole.

    Returns:
        Dataset as from `insonify.records.image.image_dataset`.

    Raises:
        ValueError: An unknown geometry or gain, or a beam that the sides lack.

    Example:
        >>> recording = insonify.simulate(insonify.load_scenario("sidescan.yaml"), pings=40)  # a crate to starboard
        >>> image = sidescan(recording, geometry="ground", gain="lambert", altitude=8.0)
        >>> level = image["level_db"].isel(ping=0)
        >>> across = {"seabed": slice(-34, -32), "crate": slice(29, 30), "shadow": slice(32, 34)}
        >>> {name: level.sel(across=cells).median().round().item() for name, cells in across.items()}
        {'seabed': 157.0, 'crate': 176.0, 'shadow': 150.0}
    """
    recording = field_or_lines(recording)
    recording = recording.rename(beam="channel") if "beam" in recording.dims else recording
    _require_choice("geometry", geometry, get_args(Geometry))
    _require_choice("gain", gain, GAINS)
    if geometry == "ground":
        require_one_platform(recording)
    level = np.asarray(recorded_level(recording).values, float)
    slant = np.asarray(recording["time"].values, float) * sound_speed / 2
    height = _altitudes(altitude, level, slant)
    sides = []
    for side, channel in _channels(recording, beam):
        lines = level[:, channel] + _gain(gain, level[:, channel], slant, height, absorption_db_per_m)
        if normalise_along_track:
            lines = lines + along_track_gain_db(lines)[:, None]
        across = slant
        if geometry == "ground":
            across = _ground_cells(slant, height)
            lines = slant_to_ground_range(lines, slant, height, across)
        order = slice(None, None, -1) if side < 0 else slice(None)
        sides.append((lines[:, order], (side or 1) * across[order], np.full(len(across), channel)))
    position = recording["logged_position" if "logged_position" in recording else "position"]
    image = image_dataset(
        np.concatenate([lines for lines, _, _ in sides], axis=1), np.concatenate([across for _, across, _ in sides]),
        distance_run(np.asarray(position.values, float)), geometry=geometry, gain=gain, altitude=height,
        pings=_ping_numbers(recording), attributes={"sound_speed": sound_speed},
    )  # fmt: skip
    channels = np.concatenate([channel for _, _, channel in sides])
    channel_attributes = {"units": "1", "long_name": "row of the recording's channel"}
    return image.assign_coords(channel=("across", channels, channel_attributes))


def _require_choice(name: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        if FORMER_WORDS.get(value) in choices:
            raise ValueError(f"{name} is {value!r}, which is called {FORMER_WORDS[value]!r}")
        raise ValueError(f"{name} is {value!r}; choose one of {', '.join(choices)}")


def _channels(recording: xr.Dataset, beam: int) -> list[tuple[int, int]]:
    """Side and channel of each side of the image, port first."""
    count = recording.sizes["channel"]
    sides = np.asarray(recording["side"].values if "side" in recording else np.zeros(count)).astype(int)
    side_channels = []
    for side in np.unique(sides):
        rows = np.flatnonzero(sides == side)
        if not 0 <= beam < len(rows):
            raise ValueError(f"beam is {beam}; each side has beams 0 to {len(rows) - 1}")
        side_channels.append((int(side), int(rows[beam])))
    return side_channels


def _altitudes(altitude: float | Floats | None, level: Floats, slant_range: Floats) -> Floats:
    if altitude is not None:
        return np.broadcast_to(np.asarray(altitude, float), (len(level),))
    return first_bottom_return(level, slant_range)


def _gain(gain: str, level: Floats, slant_range: Floats, altitude: Floats, absorption_db_per_m: float) -> Floats:
    """Gain of one side [dB], shape (samples,) or (pings, samples)."""
    if gain in LAWS:
        return tvg_db(slant_range, LAWS[gain], absorption_db_per_m=absorption_db_per_m)
    if gain == "lambert":
        return lambert_gain_db(slant_range, altitude, absorption_db_per_m=absorption_db_per_m)
    if gain == "empirical":
        return empirical_gain_db(level, slant_range, absorption_db_per_m=absorption_db_per_m)
    return np.zeros(len(slant_range))


def _ground_cells(slant_range: Floats, altitude: Floats) -> Floats:
    """Middles of ground cells with the spacing of the slant range [m]."""
    lowest = float(np.nanmin(altitude)) if np.isfinite(altitude).any() else 0.0
    max_range = np.sqrt(max(float(slant_range[-1]) ** 2 - lowest**2, 0.0))
    cell = float(slant_range[1] - slant_range[0])
    return np.asarray((np.arange(max(int(max_range / cell), 2)) + 0.5) * cell, float)


def distance_run(position: Floats) -> Floats:
    """Distance along a track at each of its positions, shape (ping, 3), over ground [m], shape (ping,)."""
    steps = np.linalg.norm(np.diff(position[:, :2], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _ping_numbers(recording: xr.Dataset) -> NDArray[np.int64]:
    return np.asarray(recording["ping"].values if "ping" in recording else np.arange(recording.sizes["ping"]))
