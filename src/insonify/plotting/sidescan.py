"""Sidescan waterfall: port to the left, starboard to the right, the latest ping on top."""

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats, RecordingLevels, colour_span
from insonify.plotting.waterfall import thinned
from insonify.processing.sidescan import sidescan as image_of

COLUMNS = 900
"""Columns of each side; more samples are averaged as energy, so that no echo is lost [1]."""
EVEN = 0.02
"""Largest deviation from uniform ping spacing, relative to the distance run, for an axis of distance [1]."""
ENOUGH = 16
"""Fewest pings for an empirical gain [1]."""
NAMES = {
    "none": "level [dB re 1 uPa]",
    "tvg20": "level + 20 log R + 2 a R [dB]",
    "tvg30": "level + 30 log R + 2 a R [dB]",
    "tvg40": "level + 40 log R + 2 a R [dB]",
    "lambert": "level + gain for a flat Lambert bed [dB]",
    "empirical": "level re the median at its range [dB]",
}
"""Label of the colour bar for each gain."""


def has_sides(dataset: xr.Dataset) -> bool:
    """True for a recording of a sonar with a port and a starboard side."""
    return "side" in dataset and bool(np.any(dataset["side"].values != 0))


def sidescan_image(dataset: xr.Dataset, sound: RecordingLevels, *, ground: bool = False, gain: str | None = None,
                   beam: int | None = None) -> xr.Dataset:  # fmt: skip
    """Sidescan image of a recording, with the water and the altitude of its scenario.

    Args:
        dataset: Recording.
        sound: Levels of the recording.
        ground: True for ground range instead of slant range.
        gain: See `insonify.processing.sidescan`; None: empirical from `ENOUGH` pings on, else lambert.
        beam: Channel, and the corresponding one on the other side; None: the first.
    """
    ping_count = int((~np.isnan(sound.level)).any(axis=(1, 2)).sum())
    scenario, chosen = sound.scenario, gain or ("empirical" if ping_count >= ENOUGH else "lambert")
    options: dict[str, Any] = {
        "geometry": "ground" if ground else "slant",
        "gain": chosen,
        "beam": _beam(dataset, beam),
    }
    if scenario is not None:
        # from the logged navigation, as images of real data are
        logged = dataset["logged_position" if "logged_position" in dataset else "position"].values
        options["altitude"] = scenario.seabed.depth - np.asarray(logged, float)[:, 2]
        options["absorption_db_per_m"] = float(scenario.water.absorption(scenario.sonar.pulse.frequency))
    return image_of(dataset, sound_speed=sound.sound_speed, **options)


def _beam(dataset: xr.Dataset, channel: int | None) -> int:
    """Number of a channel among the beams of its side."""
    sides = len(np.unique(dataset["side"].values)) if "side" in dataset else 1
    return (channel or 0) % (dataset.sizes["channel"] // sides)


def sidescan(image: xr.Dataset, title: str = "", note: str = "") -> Figure:
    """Draw a sidescan image.

    Args:
        image: As from `insonify.processing.sidescan`.
        title: Title of the figure.
        note: Addition to the label of the abscissa, see `across_label`.
    """
    figure = style.new_figure(10, 7)
    axes = figure.subplots()
    drawn = lines(axes, image)
    axes.set(xlabel=across_label(image, note), title=title)
    figure.colorbar(drawn, ax=axes, label=NAMES[image.attrs["gain"]], pad=0.01)
    return figure


def lines(axes: Axes, image: xr.Dataset) -> AxesImage:
    """Draw the lines of a sidescan image in the colours of `style.COPPER`.

    Args:
        axes: Axes to draw on.
        image: As from `insonify.processing.sidescan`.
    """
    level, across = image["level_db"].values, image["across"].values
    span = colour_span(level)
    low, high, name = rows(image)
    for half in (across <= 0, across > 0):
        if half.sum() > 1:
            drawn = _half(axes, level[:, half], across[half], (low, high), span)
    axes.set_xlim(across.min(), across.max())
    axes.set_ylim(low, high)
    axes.set_facecolor("#303030")
    axes.grid(False)
    axes.set_xlabel(across_label(image))
    axes.xaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    axes.set_ylabel(name)
    return drawn


def across_label(image: xr.Dataset, note: str = "") -> str:
    """Label of the abscissa of an image.

    Args:
        image: Sidescan image.
        note: Addition to the label, such as the sound speed.
    """
    across, slant = image["across"].values, image.attrs["geometry"] == "slant"
    sides = "port  |  starboard,  " if (across < 0).any() and (across > 0).any() else ""
    return f"{sides}{'slant range' if slant else 'distance across the track'}{note} [m]"


def sidescan_waterfall(dataset: xr.Dataset, sound: RecordingLevels, **options: Any) -> Figure:
    """Draw a recording as a sidescan image.

    Args:
        dataset: Recording.
        sound: Levels of the recording.
        options: Arguments of `sidescan_image`.
    """
    return sidescan(sidescan_image(dataset, sound, **options), sound.named(), sound.sound_speed_note)


def rows(image: xr.Dataset) -> tuple[float, float, str]:
    """Lower and upper edge of the rows, and their label: the distance run where it grows evenly, else pings."""
    along, pings = image["along"].values, image["ping"].values
    if along[-1] > 0 and np.abs(along - np.linspace(0, along[-1], len(along))).max() <= EVEN * along[-1]:
        half = float(along[-1]) / (len(along) - 1) / 2
        return -half, float(along[-1]) + half, "distance run [m]"
    return float(pings[0]) - 0.5, float(pings[-1]) + 0.5, "ping"


def _half(axes: Axes, level: Floats, across: Floats, rows: tuple[float, float], span: tuple[float, float]) -> AxesImage:
    return axes.imshow(
        thinned(level, COLUMNS), aspect="auto", origin="lower", cmap=style.COPPER, vmin=span[0], vmax=span[1],
        interpolation="nearest", extent=(across[0], across[-1], *rows),
    )  # fmt: skip
