"""Sector image: the beams of one ping over range and bearing, to scale."""

from textwrap import fill

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats, RecordingLevels, colour_span
from insonify.plotting.target_view import TargetView, targets_in_view
from insonify.plotting.waterfall import thinned
from insonify.scenario.scenario import Scenario
from insonify.sonar.sonar import receiver_mounting

LABELS = 5
"""Largest number of labelled bearings [1]."""
LABEL_WIDTH = 0.55
"""Width of one label of a bearing [inch]."""
LARGEST = 9.0, 8.0
"""Largest width and height of a sector [inch]."""
LEFT, RIGHT, BELOW, ABOVE = 0.85, 1.25, 0.65, 0.85
"""Margins around the sector [inch]: axis, colours, axis, title and bearings."""
TITLE_PAD, BEARINGS = 6, 20
"""Space below the title, and that of the bearings along the outer edge [point]."""
LETTER, LINE = 0.105, 0.19
"""Mean width of a letter of a title, and height of its lines [inch]."""
EDGE = 0.03
"""Free space around a sector, relative to its longer side [1]."""
STEEP = np.radians(45)
"""Tilt of a mounting above which a sector is drawn with the sonar at the top [rad]."""


def sector_image(sound: RecordingLevels, row: int) -> Figure:
    """Draw one ping of many beams, to scale.

    Args:
        sound: Levels of the recording.
        row: Row of the ping.
    """
    order = np.argsort(sound.steer)
    steer, slant = sound.steer[order], sound.time * sound.sound_speed / 2
    width, height, axes_width = _extent(slant, steer)
    title = fill(sound.named(ping=row), int((axes_width + 2 * LEFT) / LETTER))
    figure = Figure(figsize=(LEFT + axes_width + RIGHT, BELOW + height + ABOVE + LINE * title.count("\n")))
    page = figure.get_size_inches()
    axes = figure.add_axes((LEFT / page[0], BELOW / page[1], axes_width / page[0], height / page[1]))
    level = sound.strength()[row][order]
    labels = int(np.clip(width / LABEL_WIDTH, 2, LABELS)) // 2 * 2 + 1 if width > 2 * LABEL_WIDTH else 1
    mesh = sector(axes, slant, steer, level, colour_span(level), labels=labels, down=looks_down(sound.scenario))
    if sound.scenario is not None:
        name_targets(axes, targets_in_view(sound.scenario, row), slant, steer)
    spare = (axes_width / width - 1) / 2 * np.ptp(axes.get_xlim())  # beside a narrow sector
    axes.set_xlim(axes.get_xlim()[0] - spare, axes.get_xlim()[1] + spare)
    write_title(axes, title)
    colours = figure.add_axes(((LEFT + axes_width + 0.2) / page[0], (BELOW + 0.15 * height) / page[1],
                               0.18 / page[0], 0.7 * height / page[1]))  # fmt: skip
    known = sound.scenario is not None
    label = "apparent target strength [dB re 1 m$^2$]" if known else "level [dB re 1 uPa]"
    figure.colorbar(mesh, cax=colours, label=label)
    return figure


def looks_down(scenario: Scenario | None) -> bool:
    """Return True if the boresight of the receiver points more down than ahead.

    Args:
        scenario: Scenario of the recording; None: unknown.
    """
    return scenario is not None and bool(receiver_mounting(scenario.sonar).tilt > STEEP)


def sector(axes: Axes, slant: Floats, steer: Floats, level: Floats, span: tuple[float, float], *,
           labels: int = LABELS, ink: str = style.QUIET, down: bool = False) -> QuadMesh:  # fmt: skip
    """Draw levels over a sector, boresight upwards or downwards and steer angles to the right.

    Args:
        axes: Axes to draw on.
        slant: Slant range of each sample [m], shape (n,).
        steer: Steer angles, ascending [rad], shape (beams,).
        level: Levels [dB], shape (beams, n).
        span: Levels of the darkest and brightest colour [dB].
        labels: Bearings written along the outer edge; 1: both ends in one label.
        ink: Colour of the marks.
        down: True for boresight downwards, with the sonar at the top.
    """
    mesh = sector_cells(axes, slant, steer, thinned(level))
    mesh.set(cmap=style.COPPER, clim=span)
    sector_axes(axes, slant, steer, labels=labels, ink=ink, down=down)
    return mesh


def sector_cells(axes: Axes, slant: Floats, steer: Floats, values: ArrayLike) -> QuadMesh:
    """Draw values, or colours, on the cells of a sector.

    Args:
        axes: Axes to draw on.
        slant: Slant range of each sample [m], shape (n,).
        steer: Steer angles, ascending [rad], shape (beams,).
        values: Values, shape (beams, any), or colours, shape (beams, any, 3): columns divide the ranges evenly.
    """
    edges = np.linspace(slant[0], slant[-1], np.shape(values)[1] + 1)
    angles = beam_edges(steer)
    x, y = np.outer(np.sin(angles), edges), np.outer(np.cos(angles), edges)
    return axes.pcolormesh(x, y, values, rasterized=True)


def sector_axes(axes: Axes, slant: Floats, steer: Floats, *, labels: int = LABELS, ink: str = style.QUIET,
                down: bool = False) -> None:  # fmt: skip
    """Set limits and labels of a sector to scale; for the arguments see `sector`."""
    left, right, low, high = _bounds(slant, steer)
    axes.set(aspect="equal", xlim=(left, right), ylim=(high, low) if down else (low, high))
    axes.grid(False)
    for side in axes.spines.values():
        side.set_visible(False)
    axes.set_xlabel("to the right of boresight [m]")
    axes.set_ylabel("below the sonar, along boresight [m]" if down else "along boresight [m]")
    _bearings(axes, slant[-1], steer, labels, ink)


def write_title(axes: Axes, title: str) -> None:
    """Write the title above a sector, and above its bearings where they are there."""
    axes.set_title(title, loc="center", pad=TITLE_PAD if axes.yaxis_inverted() else TITLE_PAD + BEARINGS)


def name_targets(axes: Axes, seen: list[TargetView], slant: Floats, steer: Floats) -> None:
    """Label the targets that lie in a sector, on the near side of their echoes.

    Args:
        axes: Axes of the sector.
        seen: Targets relative to the array.
        slant: Slant range of each sample [m], shape (n,).
        steer: Steer angles, ascending [rad], shape (beams,).
    """
    angles = beam_edges(steer)
    offset, anchor = (7, "bottom") if axes.yaxis_inverted() else (-7, "top")
    for target in seen:
        if angles[0] <= target.bearing <= angles[-1] and slant[0] <= target.slant <= slant[-1]:
            near = max(target.near_side, slant[0])
            position = near * np.sin(target.bearing), near * np.cos(target.bearing)
            axes.annotate(
                target.label, position, xytext=(0, offset), textcoords="offset points", ha="center", va=anchor,
                fontsize=8, color="#FFFBEA", path_effects=[withStroke(linewidth=2.0, foreground="#2A1608")],
            )  # fmt: skip


def _bearings(axes: Axes, farthest: float, steer: Floats, labels: int, ink: str) -> None:
    """Label bearings along the outer edge."""
    angles = _round_angles(steer, labels) if labels > 1 else [(steer[0] + steer[-1]) / 2]
    texts = [_degrees(angle) for angle in angles] if labels > 1 else [f"{_degrees(steer[0])} to {_degrees(steer[-1])}"]
    tip = farthest * 1.006
    anchor, turn = ("top", 1) if axes.yaxis_inverted() else ("bottom", -1)
    for angle, text in zip(angles, texts, strict=True):
        axes.annotate(
            text, (tip * np.sin(angle), tip * np.cos(angle)), ha="center", va=anchor, fontsize=9, color=ink,
            rotation=turn * np.degrees(angle), rotation_mode="anchor", annotation_clip=False,
        )  # fmt: skip


def _round_angles(steer: Floats, most: int) -> Floats:
    """Angles of a round number of degrees within a sector [rad]; its ends where there are fewer than three."""
    first, last = np.degrees(steer[0]), np.degrees(steer[-1])
    ticks = MaxNLocator(most, steps=[1, 1.5, 2, 3, 4.5, 5, 6, 10]).tick_values(first, last)
    ticks = ticks[(ticks >= first) & (ticks <= last)]
    return np.radians(ticks) if len(ticks) > 2 else np.linspace(steer[0], steer[-1], most)


def _degrees(angle: float) -> str:
    return f"{np.degrees(angle) + 0.0:+.3g}°" if abs(angle) > 1e-9 else "0°"


def beam_edges(steer: Floats) -> Floats:
    """Edges of the beams, halfway between their angles [rad], shape (beams + 1,)."""
    middles = (steer[1:] + steer[:-1]) / 2
    return np.concatenate([[2 * steer[0] - middles[0]], middles, [2 * steer[-1] - middles[-1]]])


def _bounds(slant: Floats, steer: Floats) -> tuple[float, float, float, float]:
    """Left, right, lower and upper edge of a sector with its free space [m]."""
    ends = beam_edges(steer)[[0, -1]]
    rim = np.linspace(ends[0], ends[1], 181)
    x, y = (np.outer(along(rim), slant[[0, -1]]) for along in (np.sin, np.cos))
    free = EDGE * max(np.ptp(x), np.ptp(y))
    return float(x.min() - free), float(x.max() + free), float(y.min() - free), float(y.max() + free)


def _extent(slant: Floats, steer: Floats) -> tuple[float, float, float]:
    """Width and height of the sector on the page, and the width of its axes, at least 2 [inch]."""
    left, right, low, high = _bounds(slant, steer)
    scale = min(LARGEST[0] / (right - left), LARGEST[1] / (high - low))
    width, height = scale * (right - left), scale * (high - low)
    return width, height, max(width, 2.0)
