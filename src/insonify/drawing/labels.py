"""Labels over the recording that they belong to: highlights, shadows and ghosts in colour, everything else in grey."""

from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from insonify.drawing import style
from insonify.drawing.heard import Floats, Heard, colour_span, heard
from insonify.units import level_db

KINDS = {"shadow": "#2E6DB4", "ghost": "#A0349B", "highlight": "#F0A202"}
"""Colour of each mask, the later ones on top."""
STRENGTH = 0.65
"""Part of a labelled colour that is the mask's, not the level's [1]."""
OWNERS = ("#009E73", "#D5350E", "#8E2F66", "#E69F00", "#1E8FD5", "#7A4B12")
"""Colours of targets, in turn; seabed and surface have their own."""
SHOWN = 80.0
"""How far below the loudest a trace is followed [dB]."""


def labels(
    recording: xr.Dataset, said: xr.Dataset, path: str | Path, *, ping: int | None = None, beam: int = 0
) -> Path:
    """Draw labels.

    Args:
        recording: As from `open_recording`, one channel or a port and a starboard side.
        said: Its labels, as from `open_labels`.
        path: Picture to write, .png, .pdf or .svg.
        ping: The only ping wanted, drawn as expected levels by owner; None: all, where there are several.
        beam: Channel wanted, and its mirror image on the other side.

    Returns:
        The path.
    """
    sound = heard(recording)
    with style.page():
        if ping is None and recording.sizes["ping"] > 1:
            figure = _waterfall(recording, said, sound, beam)
        else:
            row = ping if ping is not None else int(np.flatnonzero(said["done"].values)[0])
            figure = _trace(said.isel(ping=row), sound, beam, row)
        return style.keep(figure, path)


def _waterfall(recording: xr.Dataset, said: xr.Dataset, sound: Heard, beam: int) -> Figure:
    """All pings over slant range, port to the left."""
    slant = sound.time * sound.sound_speed / 2
    span = colour_span(sound.level)
    figure = style.sheet(10, 7)
    axes = figure.subplots()
    channels = _channels(recording, beam)
    for side, channel in channels:
        picture = _coloured(sound.level[:, channel], {name: said[name].values[:, channel] for name in KINDS}, span)
        reach = (slant[0], slant[-1]) if side >= 0 else (-slant[-1], -slant[0])
        axes.imshow(
            picture if side >= 0 else picture[:, ::-1], aspect="auto", origin="lower", interpolation="nearest",
            extent=(*reach, -0.5, len(picture) - 0.5),
        )  # fmt: skip
    left, right = min(side for side, _ in channels), max(side for side, _ in channels)
    axes.set_xlim(-slant[-1] if left < 0 else slant[0], slant[-1] if right >= 0 else -slant[0])
    axes.set_facecolor("#303030")
    axes.grid(False)
    axes.xaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    axes.set_xlabel(("port  |  starboard,  " if left < 0 < right else "") + "slant range [m]")
    axes.set_ylabel("ping")
    axes.set_title(", ".join(part for part in (sound.title, "labels") if part))
    figure.legend(handles=_patches(), loc="outside lower center", ncols=len(KINDS))
    return figure


def _channels(recording: xr.Dataset, beam: int) -> list[tuple[int, int]]:
    """Side and channel of what is drawn: a beam, and where the sonar has sides the same one of the other side."""
    sides = np.asarray(recording["side"].values if "side" in recording else np.zeros(recording.sizes["channel"]))
    each = [np.flatnonzero(sides == side) for side in np.unique(sides)]
    return [(int(sides[rows[beam % len(rows)]]), int(rows[beam % len(rows)])) for rows in each]


def _coloured(level: Floats, masks: dict[str, NDArray[np.bool_]], span: tuple[float, float]) -> Floats:
    """Levels as grey, with the colours of the masks mixed in, shape (ping, samples, 3)."""
    shade = np.clip((np.nan_to_num(level, nan=span[0], neginf=span[0]) - span[0]) / (span[1] - span[0]), 0, 1)
    picture = np.repeat(shade[..., None], 3, axis=-1)
    for name, colour in KINDS.items():
        picture[masks[name]] = (1 - STRENGTH) * picture[masks[name]] + STRENGTH * np.array(to_rgb(colour))
    return np.asarray(picture)


def _patches() -> list[Patch]:
    return [Patch(color=colour, label=name) for name, colour in KINDS.items()]


def _trace(said: xr.Dataset, sound: Heard, channel: int, ping: int) -> Figure:
    """Expected level of each owner over one ping, with its masks behind."""
    figure = style.sheet()
    axes = figure.subplots()
    time, level = sound.time * 1e3, level_db(said["owner_intensity"].values[channel].astype(float))
    loudest = float(np.max(level, initial=-np.inf, where=np.isfinite(level)))
    low, high = (loudest - SHOWN, loudest + 6) if np.isfinite(loudest) else (-1.0, 0.0)
    for name, colour in KINDS.items():
        mask = said[name].values[channel]
        axes.fill_between(time, low, high, where=mask, step="mid", color=colour, alpha=0.25, lw=0, label=name)
    targets = 0
    for owner, curve in zip(said["owner"].values, level, strict=True):
        if np.isfinite(curve).any():
            known = style.CAUSES.get(str(owner))
            axes.plot(time, np.maximum(curve, low), color=known or OWNERS[targets % len(OWNERS)], label=str(owner))
            targets += known is None
    axes.set_xlim(time[0], time[-1])
    axes.set_ylim(low, high)
    axes.set_xlabel("time [ms]")
    axes.set_ylabel("expected level [dB re 1 uPa]")
    axes.set_title(sound.named(ping=ping, channel=channel) or "labels")
    style.range_axis(axes, sound.sound_speed)
    figure.legend(loc="outside lower center", ncols=6)
    return figure
