"""Strip map of a synthetic aperture, beside the image of single pings, with cuts through a point target."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patheffects import withStroke

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats

SPAN = -20.0, 25.0
"""Levels of the darkest and the brightest colour, re the seabed [dB]."""
DEEP = -40.0
"""Lowest level in cuts through a point, re its peak [dB]."""


@dataclass(frozen=True, slots=True)
class StripMap:
    """Levels of a strip of the seabed [dB re 1 uPa]."""

    along: Floats
    """Along-track position [m], shape (n,)."""
    across: Floats
    """Across-track distance [m], shape (m,)."""
    level: Floats
    """Level of the focused image, shape (n, m)."""
    run: Floats
    """Along-track position of each ping [m], shape (ping,)."""
    single: Floats
    """Level of each single ping, shape (ping, m)."""


@dataclass(frozen=True, slots=True)
class PointResponse:
    """Image around a point target."""

    label: str
    off: Floats
    """Offset from the true position, along and across [m], shape (n,)."""
    level: Floats
    """Level re the peak [dB], shape (along, across)."""
    top: tuple[int, int]
    """Pixel of the peak."""
    peak_db: float
    """Level of the peak [dB re 1 uPa]."""
    across: float
    """True across-track distance of the point [m]."""


def strip_map_view(
    strip: StripMap, names: list[tuple[str, float, float]], points: list[PointResponse], title: str
) -> Figure:
    """Draw the strip map, the image of single pings, and cuts through a point.

    Args:
        strip: Levels of the strip.
        names: Labels of targets, with their position along and across [m].
        points: At most one point target.
        title: Title of the figure.
    """
    tall = float(np.ptp(strip.across) / np.ptp(strip.along))
    width = 3.5 if points else 0.0
    side = min(5.6, 7.0 / tall)
    figure = style.new_figure(2 * side + 2.2 + width, min(max(side * tall + 1.3, 5.6), 12))
    figure.suptitle(title, fontweight="bold", fontsize=11)
    ratios = (2 * side + 2.2, width) if points else (1.0,)
    parts = figure.subfigures(1, len(ratios), width_ratios=ratios, squeeze=False)[0]
    left, right = parts[0].subplots(1, 2, sharey=True)
    _image(left, strip.single, (*_edges(strip.run), strip.across[0], strip.across[-1]), strip)
    image = _image(right, strip.level, (strip.along[0], strip.along[-1], strip.across[0], strip.across[-1]), strip)
    left.set_title("each ping by itself, its elements as one array")
    right.set_title("all pings focused together")
    left.set_ylabel("across the track [m]")
    for label, along, across in names:
        if strip.along[0] <= along <= strip.along[-1]:
            right.annotate(label, (along, across), xytext=(0, -20), textcoords="offset points", ha="center", va="top",
                           fontsize=8, color="#FFFBEA", path_effects=[withStroke(linewidth=2.0, foreground="#2A1608")],
                           )  # fmt: skip
    parts[0].colorbar(image, ax=[left, right], label="level re the bed at its range [dB]", pad=0.01)
    for point in points:
        _cuts(parts[1], point)
    return figure


def _edges(run: Floats) -> tuple[float, float]:
    half = float(np.ptp(run)) / max(len(run) - 1, 1) / 2
    return float(run.min()) - half, float(run.max()) + half


def _image(axes: Axes, level: Floats, extent: tuple[float, float, float, float], strip: StripMap) -> AxesImage:
    image = axes.imshow(
        (level - range_trend(level)).T, origin="lower", extent=extent, cmap=style.COPPER, vmin=SPAN[0], vmax=SPAN[1],
        aspect="equal", interpolation="antialiased", interpolation_stage="data",
    )  # fmt: skip
    axes.set_xlim(strip.along[0], strip.along[-1])
    axes.set_ylim(strip.across[0], strip.across[-1])
    axes.set_facecolor("#303030")
    axes.grid(False)
    axes.set_xlabel("along the track [m]")
    return image


def range_trend(level: Floats) -> Floats:
    """Level of the seabed over range, a straight line through the medians [dB], shape (across,), robust to shadows.

    Args:
        level: Level of a strip [dB], shape (along, across).
    """
    position = np.arange(level.shape[1], dtype=float)
    known = np.isfinite(level).any(axis=0)
    median = np.nanmedian(level[:, known], axis=0)
    return np.asarray(np.polyval(np.polyfit(position[known], median, 1), position), float)


def _cuts(figure: Figure, point: PointResponse) -> None:
    patch, cuts = figure.subplots(2, 1)
    edge = (100 * point.off[0], 100 * point.off[-1]) * 2
    patch.imshow(point.level.T, origin="lower", extent=edge, cmap=style.COPPER, vmin=DEEP, vmax=0)
    patch.grid(False)
    patch.set(title=f"{point.label}, closer", xlabel="along, from the true position [cm]", ylabel="across [cm]")
    row, column = point.top
    cuts.plot(100 * point.off, point.level[:, column], color=style.INK, label="along")
    cuts.plot(100 * point.off, point.level[row], color=style.FAMILIES["B"], label="across")
    cuts.set(ylim=(DEEP, 2), xlabel="from the true position [cm]", ylabel="level [dB re peak]")
    cuts.legend(loc="upper right")
