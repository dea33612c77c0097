"""Labels over their recording: highlights, shadows and ghosts in colour, everything else in grey."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.plotting.recording import is_sector
from insonify.plotting.recording_levels import Floats, RecordingLevels, colour_span, recording_levels
from insonify.plotting.sector_image import (
    looks_down,
    name_targets,
    sector,
    sector_axes,
    sector_cells,
    write_title,
)
from insonify.plotting.sidescan import COLUMNS, NAMES, across_label, lines, rows, sidescan_image
from insonify.plotting.target_view import targets_in_view
from insonify.plotting.waterfall import COLUMNS as SECTOR_COLUMNS
from insonify.plotting.waterfall import thinned
from insonify.processing.image_labels import image_labels
from insonify.records.labels import over_pings
from insonify.units import level_db

KINDS = {"shadow": "#2E6DB4", "ghost": "#A0349B", "highlight": "#F0A202"}
"""Colour of each mask, the later ones on top."""
MEANING = {
    "shadow": "shadow: most of the direct echo is cut",
    "ghost": "ghost: target by surface paths",
    "highlight": "highlight: target",
}
NARROW = np.radians(80)
"""Widest sector that is drawn to the left of its labels; a wider one is drawn above them [rad]."""
STRENGTH = 0.65
"""Weight of the mask's colour over that of the level [1]."""
TARGET_COLOURS = ("#009E73", "#D5350E", "#8E2F66", "#E69F00", "#1E8FD5", "#7A4B12")
"""Colours of targets, in turn; seabed and surface have their own."""
SHOWN = 80.0
"""Range of levels of a trace below its maximum [dB]."""


def labels(
    recording: xr.Dataset, label_dataset: xr.Dataset, path: str | Path, *, ping: int | None = None,
    beam: int | None = None, ground: bool = False, gain: str | None = None,
) -> Path:  # fmt: skip
    """Draw labels: an image, and the same image in grey with its masks in colour.

    Many beams give sectors of one ping, many pings an image over pings and range, all others expected levels by object
    over time.

    Args:
        recording: As from `open_recording`.
        label_dataset: Labels of the recording, as from `open_labels`, or of a single ping, as from `insonify.labels`.
        path: File of the figure, .png, .pdf or .svg.
        ping: Row of a single ping; by default all, or for sectors the first that is labelled.
        beam: Row of a single beam, and the corresponding one on the other side; by default all of a sector, else the
            first.
        ground: True for images over ground range on a flat seabed, instead of slant range.
        gain: Gain of the images: one of `insonify.processing.GAINS`.

    Returns:
        The path.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> masks = insonify.labels(scenario, ping=40)
        >>> picture = labels(insonify.simulate(scenario, pings=40), masks, "labels.png")
        >>> picture.name, picture.stat().st_size > 0
        ('labels.png', True)
    """
    sound, label_dataset = recording_levels(recording), over_pings(label_dataset)
    row = ping if ping is not None else int(np.flatnonzero(label_dataset["done"].values)[0])
    with style.plot_style():
        if not ground and gain is None and is_sector(recording, ping=ping, beam=beam):
            figure = _sectors(label_dataset.isel(ping=row), sound, row)
        elif ping is None and recording.sizes["ping"] > 1:
            image = sidescan_image(recording, sound, ground=ground, gain=gain, beam=beam or 0)
            figure = _images(image, image_labels(label_dataset[[*KINDS, "done"]], image), sound)
        else:
            figure = _trace(label_dataset.isel(ping=row), sound, beam or 0, row)
        return style.save_figure(figure, path)


def _sectors(ping_labels: xr.Dataset, sound: RecordingLevels, row: int) -> Figure:
    """Draw the sector of one ping, and the same in grey with its masks in colour."""
    order = np.argsort(sound.steer)
    steer, slant = sound.steer[order], sound.time * sound.sound_speed / 2
    level = sound.strength()[row][order]
    span = colour_span(level)
    size, panels = ((15, 7.5), (1, 2)) if np.ptp(steer) < NARROW else ((10, 13), (2, 1))
    figure = style.new_figure(*size)
    level_axes, label_axes = figure.subplots(*panels).ravel()
    down = looks_down(sound.scenario)
    mesh = sector(level_axes, slant, steer, level, span, down=down)
    masks = {kind: ping_labels[kind].values[order] for kind in KINDS}
    shown = {kind: _any(mask, SECTOR_COLUMNS) for kind, mask in masks.items()}
    sector_cells(label_axes, slant, steer, _coloured(thinned(level, SECTOR_COLUMNS), shown, span))
    sector_axes(label_axes, slant, steer, down=down)
    write_title(level_axes, sound.named(ping=row))
    write_title(label_axes, "labels")
    if sound.scenario is not None:
        name_targets(level_axes, targets_in_view(sound.scenario, row), slant, steer)
    name = "level [dB re 1 uPa]" if sound.scenario is None else "apparent target strength [dB re 1 m$^2$]"
    figure.colorbar(mesh, ax=[level_axes, label_axes], label=name, pad=0.01, shrink=0.7)
    _legend(figure, masks)
    return figure


def _images(image: xr.Dataset, masks_dataset: xr.Dataset, sound: RecordingLevels) -> Figure:
    """Draw the sidescan image, and below it the same in grey with its masks in colour."""
    figure = style.new_figure(10, 9.5)
    upper, lower = figure.subplots(2, 1, sharex=True, sharey=True)
    drawn = lines(upper, image)
    upper.set(title=", ".join(part for part in (sound.title, "image", sound.part) if part), xlabel="")
    figure.colorbar(drawn, ax=[upper, lower], label=NAMES[image.attrs["gain"]], pad=0.01)
    low, high, name = rows(image)
    span, across = colour_span(image["level_db"].values), image["across"].values
    for half in (across <= 0, across > 0):
        if half.sum() > 1:
            masks = {kind: _any(masks_dataset[kind].values[:, half], COLUMNS) for kind in KINDS}
            picture = _coloured(thinned(image["level_db"].values[:, half], COLUMNS), masks, span)
            lower.imshow(picture, aspect="auto", origin="lower", interpolation="nearest",
                         extent=(across[half][0], across[half][-1], low, high))  # fmt: skip
    lower.set_facecolor("#303030")
    lower.grid(False)
    lower.set(xlabel=across_label(image, sound.sound_speed_note), ylabel=name, title="labels")
    _legend(figure, {kind: masks_dataset[kind].values for kind in KINDS})
    return figure


def _legend(figure: Figure, masks: dict[str, NDArray[np.bool_]]) -> None:
    """Explain the colours of the masks that occur."""
    figure.legend(
        handles=[Patch(color=KINDS[kind], label=MEANING[kind]) for kind in KINDS if masks[kind].any()]
        or [Patch(color="none", label="no highlight, shadow or ghost anywhere")],
        loc="outside lower center", ncols=len(KINDS),
    )  # fmt: skip


def _any(mask: NDArray[np.bool_], columns: int) -> NDArray[np.bool_]:
    """Masks with columns combined as `thinned` combines levels: True where any column is."""
    step = -(-mask.shape[-1] // columns)
    return np.asarray(mask[:, : mask.shape[-1] // step * step].reshape(len(mask), -1, step).any(axis=-1))


def _coloured(level: Floats, masks: dict[str, NDArray[np.bool_]], span: tuple[float, float]) -> Floats:
    """Levels as grey, blended with the colours of the masks, shape (ping, columns, 3)."""
    shade = np.clip((np.nan_to_num(level, nan=span[0], neginf=span[0]) - span[0]) / (span[1] - span[0]), 0, 1)
    picture = np.repeat(shade[..., None], 3, axis=-1)
    for name, colour in KINDS.items():
        picture[masks[name]] = (1 - STRENGTH) * picture[masks[name]] + STRENGTH * np.array(to_rgb(colour))
    return np.asarray(picture)


def _trace(ping_labels: xr.Dataset, sound: RecordingLevels, channel: int, ping: int) -> Figure:
    """Draw the expected level of each object over one ping, with its masks in the background."""
    figure = style.new_figure()
    axes = figure.subplots()
    time, level = sound.time * 1e3, level_db(ping_labels["object_intensity"].values[channel].astype(float))
    peak = float(np.max(level, initial=-np.inf, where=np.isfinite(level)))
    low, high = (peak - SHOWN, peak + 6) if np.isfinite(peak) else (-1.0, 0.0)
    for name, colour in KINDS.items():
        mask = ping_labels[name].values[channel]
        axes.fill_between(time, low, high, where=mask, step="mid", color=colour, alpha=0.25, lw=0, label=name)
    targets = 0
    for name, curve in zip(ping_labels["object"].values.astype(str), level, strict=True):
        if np.isfinite(curve).any():
            colour = style.CONTRIBUTION_COLOURS.get(str(name)) or TARGET_COLOURS[targets % len(TARGET_COLOURS)]
            axes.plot(time, np.maximum(curve, low), color=colour, label=str(name))
            targets += name not in style.CONTRIBUTION_COLOURS
    axes.set_xlim(time[0], time[-1])
    axes.set_ylim(low, high)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("expected level [dB re 1 uPa]")
    axes.set_title(sound.named(ping=ping, channel=channel) or "labels")
    style.range_axis(axes, sound.sound_speed, note=sound.sound_speed_note)
    figure.legend(loc="outside lower center", ncols=6)
    return figure
