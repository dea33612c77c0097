"""A recording as the picture that fits it: one echo sounder trace, a waterfall, or a fan of beams."""

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

FAN = 5
"""Beams from which on a ping is drawn as a fan."""


def recording(
    recorded: xr.Dataset | str | Path, path: str | Path | None = None, *, ping: int | None = None,
    beam: int | None = None, ground: bool = False, gain: str | None = None,
) -> Path | Figure:  # fmt: skip
    """Draw a recording.

    Many beams make a fan of one ping, many pings a waterfall (port and starboard side by side where the sonar has
    both), everything else traces of level over time.

    Args:
        recorded: `pressure` [uPa] or `intensity` [uPa^2] over (ping, channel, time), or the folder of a recording.
        path: Picture to write, .png, .pdf or .svg; None: nothing is written.
        ping: Row of the only ping wanted; by default all, or for a fan the first that is there.
        beam: Row of the only beam wanted; all by default.
        ground: A waterfall over distance on a level bed, instead of slant range.
        gain: Of a waterfall: one of `insonify.processing.GAINS`.

    Returns:
        The path; without one the figure, whose `axes` may be drawn on, and which notebooks show.
    """
    dataset = recorded if isinstance(recorded, xr.Dataset) else open_recording(recorded)
    sound = recording_levels(dataset) if beam is None else recording_levels(dataset).only(beam)
    there = np.flatnonzero(np.isfinite(sound.level).any(axis=(1, 2)) | np.isneginf(sound.level).any(axis=(1, 2)))
    if there.size == 0:
        raise ValueError("the recording holds no ping yet. Run the scenario to the end, or at least one ping of it.")
    pings, channels, _ = sound.level.shape
    row = int(there[0]) if ping is None else ping
    asked = ground or gain is not None
    with style.plot_style():
        if (ping is None and beam is None and pings > 1 and has_sides(dataset) and channels < 2 * FAN) or asked:
            figure = sidescan_waterfall(dataset, sound, ground=ground, gain=gain, beam=beam)
        elif channels >= FAN:
            figure = sector_image(sound, row)
        elif pings > 1 and ping is None:
            figure = waterfall(sound)
        else:
            figure = ascan(sound, row)
        return figure if path is None else style.save_figure(figure, path)
