"""The fan: the beams of one ping laid out over the sector they look into."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

from insonify.drawing import style
from insonify.drawing.heard import Floats, Heard, colour_span
from insonify.drawing.waterfall import thinned

LABELS = 5
"""Bearings and ranges that are written on the picture."""


def fan(sound: Heard, row: int) -> Figure:
    """One ping of many beams, to scale.

    Args:
        sound: The recording.
        row: Which ping.
    """
    order = np.argsort(sound.steer)
    extent = _extent(sound)
    figure = style.sheet(*extent)
    axes = figure.subplots()
    level = sound.strength()[row][order]
    mesh = sector(axes, sound.time * sound.sound_speed / 2, sound.steer[order], level, colour_span(level))
    axes.set_title(sound.title if sound.level.shape[0] == 1 else f"{sound.title}, ping {row}", pad=26)
    known = sound.scenario is not None
    label = "apparent target strength [dB re 1 m$^2$]" if known else "level [dB re 1 uPa]"
    figure.colorbar(mesh, ax=axes, label=label, shrink=0.7, pad=0.02)
    return figure


def sector(axes: Axes, slant: Floats, steer: Floats, level: Floats,
           span: tuple[float, float], ink: str = style.QUIET) -> QuadMesh:  # fmt: skip
    """Levels over a sector, boresight upwards and steer angles to the right.

    Args:
        axes: Where to draw.
        slant: Slant range of each sample [m], shape (n,).
        steer: Steer angles, ascending [rad], shape (beams,).
        level: Levels [dB], shape (beams, n).
        span: Levels of the darkest and brightest colour [dB].
        ink: Colour of the marks.
    """
    shown = thinned(level)
    edges = np.linspace(slant[0], slant[-1], shown.shape[1] + 1)
    middles = (steer[1:] + steer[:-1]) / 2
    angles = np.concatenate([[2 * steer[0] - middles[0]], middles, [2 * steer[-1] - middles[-1]]])
    x, y = np.outer(np.sin(angles), edges), np.outer(np.cos(angles), edges)
    mesh = axes.pcolormesh(x, y, shown, cmap=style.COPPER, vmin=span[0], vmax=span[1], rasterized=True)
    axes.set_aspect("equal")
    axes.use_sticky_edges = False
    axes.margins(0.04)
    axes.grid(False)
    for side in axes.spines.values():
        side.set_visible(False)
    axes.set_xlabel("to the right of boresight [m]")
    axes.set_ylabel("along boresight [m]")
    _marks(axes, edges[-1], steer, ink)
    return mesh


def _marks(axes: Axes, farthest: float, steer: Floats, ink: str) -> None:
    """Bearings along the outer edge."""
    for angle in np.linspace(steer[0], steer[-1], LABELS):
        tip = farthest * 1.006
        axes.annotate(
            f"{np.degrees(angle):+.3g}°".replace("+0°", "0°"), (tip * np.sin(angle), tip * np.cos(angle)),
            ha="center", va="bottom", rotation=-np.degrees(angle), fontsize=9, color=ink, annotation_clip=False,
        )  # fmt: skip


def _extent(sound: Heard) -> tuple[float, float]:
    """Width and height of the figure [inch], after the shape of the sector."""
    slant = sound.time[[0, -1]] * sound.sound_speed / 2
    angle = np.abs(sound.steer).max()
    across = 2 * slant[1] * np.sin(min(angle, np.pi / 2))
    ahead = slant[1] - slant[0] * np.cos(angle)
    width = float(np.clip(7.0 * across / max(ahead, 1e-9), 3.5, 10.0))
    return width + 2.0, float(np.clip(width * ahead / across, 3.0, 8.0)) + 1.2
