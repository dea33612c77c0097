"""Figure of a recording: an A-scan, a waterfall, or a sector image, by pings and beams."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from insonify.formats.zarr_store import open_recording
from insonify.plotting import style
from insonify.plotting.ascan import ascan
from insonify.plotting.recording_levels import recording_levels
from insonify.plotting.sector_image import sector_image
from insonify.plotting.sidescan import has_sides, sidescan_waterfall
from insonify.plotting.waterfall import waterfall
from insonify.processing.recorder import field_or_lines
from insonify.records.recording import FIELDS

MIN_SECTOR_BEAMS = 5
"""Fewest beams of a ping that is drawn as a sector image [1]."""


def recording(
    recorded: xr.Dataset | str | Path, path: str | Path | None = None, *, ping: int | None = None,
    beam: int | None = None, ground: bool = False, gain: str | None = None,
) -> Path | Figure:  # fmt: skip
    """Draw a recording.

    Many beams give a sector image of one ping, many pings a waterfall (port and starboard side by side where the sonar
    has both), all others traces of level over time.

    Args:
        recorded: `pressure` [uPa] or `intensity` [uPa^2] over (ping, channel, time), or the folder of a recording, or
            its URL.
        path: File of the figure, .png, .pdf or .svg; None: no file.
        ping: Row of a single ping; by default all, or for a sector image the first that is recorded.
        beam: Row of a single beam; all by default.
        ground: True for a waterfall over ground range on a flat seabed, instead of slant range.
        gain: Gain of a waterfall: one of `insonify.processing.GAINS`.

    Returns:
        The path; without one the figure, to be shown or drawn on.

    Example:
        >>> survey = insonify.simulate(insonify.load_scenario("sidescan.yaml"), pings=range(40, 44))
        >>> figure = recording(survey, ground=True, gain="lambert")
        >>> [axes.get_xlabel() for axes in figure.axes if axes.get_xlabel()]
        ['port | starboard, distance across the track [m]']
    """
    if not isinstance(recorded, xr.Dataset | str | Path):
        raise TypeError(f"recorded is a {type(recorded).__name__}; give a recording as a dataset, or its folder")
    dataset = recorded if isinstance(recorded, xr.Dataset) else open_recording(recorded)
    lines = field_or_lines(dataset)
    if ping is not None and lines is not dataset:
        ping = int(np.searchsorted(dataset["line_ping"].values, ping, "right")) - 1
    dataset = _with_all_axes(lines)
    sound = recording_levels(dataset)
    if beam is not None:
        if not 0 <= beam < len(sound.steer):
            raise ValueError(f"beam is {beam}; the recording has beams 0 to {len(sound.steer) - 1}")
        sound = sound.only(beam)
    recorded_rows = np.flatnonzero(
        np.isfinite(sound.level).any(axis=(1, 2)) | np.isneginf(sound.level).any(axis=(1, 2))
    )
    if recorded_rows.size == 0:
        raise ValueError("the recording holds no ping yet. Run the scenario to the end, or at least one ping of it.")
    pings = len(sound.level)
    row = int(recorded_rows[0]) if ping is None else ping
    is_sidescan_option = ground or gain is not None
    with style.plot_style():
        if not is_sidescan_option and is_sector(dataset, ping=ping, beam=beam):
            figure = sector_image(sound, row)
        elif is_sidescan_option or (ping is None and beam is None and pings > 1 and has_sides(dataset)):
            figure = sidescan_waterfall(dataset, sound, ground=ground, gain=gain, beam=beam)
        elif pings > 1 and ping is None:
            figure = waterfall(sound)
        else:
            figure = ascan(sound, row)
        return figure if path is None else style.save_figure(figure, path)


def is_sector(dataset: xr.Dataset, *, ping: int | None, beam: int | None) -> bool:
    """True for a recording that is drawn as a sector: of many beams, on each side where all pings are drawn.

    Args:
        dataset: Recording.
        ping: Row of a single ping; None: all.
        beam: Row of a single beam; None: all.
    """
    sides = 2 if ping is None and dataset.sizes["ping"] > 1 and has_sides(dataset) else 1
    return beam is None and dataset.sizes["channel"] >= sides * MIN_SECTOR_BEAMS


def _with_all_axes(dataset: xr.Dataset) -> xr.Dataset:
    """A recording with the axes that a selection of one ping or one channel has removed."""
    field = next((name for name in (*FIELDS, "recorded") if name in dataset), None)
    if field is None or not {"time", "steer"} <= set(dataset.variables):
        raise ValueError("the dataset is no recording. Give one of simulate or open_recording")
    if "ping" not in dataset[field].dims:
        dataset = dataset.expand_dims("ping")
    if "channel" not in dataset[field].dims:
        channel = {name: dataset[name].expand_dims("channel") for name in (field, "steer", "side") if name in dataset}
        dataset = dataset.assign({**channel, field: channel[field].transpose("ping", "channel", ...)})
    return dataset
