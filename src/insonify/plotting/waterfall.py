"""Waterfall image of a recording: one line for each ping."""

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats, RecordingLevels, colour_span
from insonify.units import intensity_ratio, level_db

COLUMNS = 1600
"""Columns of an image; more samples are averaged as energy, so that no echo is lost [1]."""


def waterfall(sound: RecordingLevels) -> Figure:
    """Draw all pings of a recording, one panel for each channel."""
    channels = sound.level.shape[1]
    figure = style.new_figure(10, 1.0 + 4.2 * channels)
    rows = figure.subplots(channels, 1, squeeze=False)[:, 0]
    level = sound.strength()
    span = colour_span(level)
    for channel, axes in enumerate(rows):
        image = _lines(axes, sound, level[:, channel], span)
        axes.set_title(sound.named(channel=channel))
    unit = "dB re 1 uPa" if sound.scenario is None else "dB re 1 m$^2$"
    name = "level" if sound.scenario is None else "apparent target strength"
    figure.colorbar(image, ax=list(rows), label=f"{name} [{unit}]", pad=0.01)
    return figure


def _lines(axes: Axes, sound: RecordingLevels, level: Floats, span: tuple[float, float]) -> AxesImage:
    slant = sound.time * sound.sound_speed / 2
    image = axes.imshow(
        thinned(level), aspect="auto", cmap=style.COPPER, vmin=span[0], vmax=span[1], interpolation="nearest",
        extent=(slant[0], slant[-1], len(level) - 0.5, -0.5),
    )  # fmt: skip
    axes.grid(False)
    axes.set_facecolor("#303030")
    axes.set_xlabel(f"slant range{sound.sound_speed_note} [m]")
    axes.set_ylabel("ping")
    return image


def thinned(level: Floats, columns: int = COLUMNS) -> Floats:
    """Levels [dB], neighbours along the last axis averaged as energy to at most `columns`."""
    step = -(-level.shape[-1] // columns)
    if step == 1:
        return level
    blocks = level[..., : level.shape[-1] // step * step].reshape(*level.shape[:-1], -1, step)
    power = intensity_ratio(blocks)
    return level_db(power.mean(axis=-1))
