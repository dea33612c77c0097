"""Figure of multibeam soundings: one ping over depth and across-track distance, depths, true depths, and errors."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LightSource, LinearSegmentedColormap, Normalize, to_rgba
from matplotlib.figure import Figure, FigureBase
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats, colour_span

DEPTHS = LinearSegmentedColormap.from_list(
    "depths", ["#FFF6D6", "#F4C46B", "#E2814C", "#A74B6C", "#5D3A7F", "#20315F", "#0A1A30"]
)
"""Colours of depth, shallow ones light; lightness falls evenly."""
CELLS = 500
"""Samples of range that are drawn [1]."""
CELL = 0.5
"""Cell size of a map across the track, and least size along it [m]."""
LEAST = 0.1
"""Least limit of the axis of errors [cm]."""
LIT = 3.0
"""Vertical exaggeration of the relief shading [1]."""
PING, MAPS = 5.6, 8.4
"""Height of the panel of one ping, and width of both maps side by side [inch]."""
WIDE = 0.4
"""Length over width of a map below which the two maps lie above each other [1]."""


@dataclass(frozen=True, slots=True)
class SwathSoundings:
    """Soundings of a swath, arrays over (ping, beam), and one ping in detail."""

    angle: Floats
    """Angle of the beams from the keel, to starboard [rad], shape (beam,)."""
    along: Floats
    """Along-track position of the soundings [m]."""
    across: Floats
    """Across-track position of the soundings, to starboard [m]."""
    depth: Floats
    """Measured depth [m]."""
    truth: Floats
    """True depth of the highest surface at the position of the sounding [m]."""
    bed: NDArray[np.bool_]
    """True for soundings of the seabed, with no target near."""
    row: int
    """Row of the ping in detail."""
    ping: int
    """Number of that ping."""
    slant: Floats
    """Slant range of the samples [m], shape (time,)."""
    level: Floats
    """Level of the beams of that ping [dB re 1 uPa], shape (beam, time)."""
    keel: tuple[float, float]
    """Depth of the sonar in that ping [m], and its roll [rad]."""
    profile: tuple[Floats, Floats]
    """Across-track positions [m] and true depths [m] under that ping."""


def depth_span(depth: Floats) -> tuple[float, float]:
    """Depths of the first and the last colour [m].

    Args:
        depth: Depths to draw [m], any shape; without finite depths, 0 to 1 m.
    """
    if not np.isfinite(depth).any():
        return 0.0, 1.0
    low, high = np.nanquantile(depth, [0.01, 0.999])
    return float(np.floor(4 * low) / 4), float(np.ceil(4 * high) / 4)


def soundings_view(soundings: SwathSoundings, title: str) -> Figure:
    """Draw the swath of a multibeam."""
    cells = _cell_edges(soundings)
    shape = float(np.ptp(cells[0]) / np.ptp(cells[1]))
    down = 2 if shape < WIDE else 1  # maps of a short track lie above each other
    height = float(np.clip(MAPS * shape * down**2 / 2, 3.0, 9.0)) + 0.7 * down
    figure = style.new_figure(14, PING + height)
    figure.suptitle(title, fontweight="bold", fontsize=11)
    above, below = figure.subfigures(2, 1, height_ratios=(PING, height), squeeze=False)[:, 0]
    _ping(above, above.subplots(), soundings)
    left, right = below.subfigures(1, 2, width_ratios=(MAPS + 1.4, 14 - MAPS - 1.4), squeeze=False)[0]
    maps = left.subplots(down, 3 - down, sharex=True, sharey=True).ravel()
    left.supylabel("along the track, from the first ping [m]", fontsize=10)
    span = depth_span(soundings.truth)
    for axes, values, caption in zip(maps, (soundings.depth, soundings.truth), ("Depth sounded", "True depth"),
                                     strict=True):  # fmt: skip
        mesh = _map(axes, soundings, values, span, cells)
        axes.set_title(caption)
        axes.label_outer()
    left.colorbar(mesh, ax=maps.tolist(), label="depth [m]", pad=0.01).ax.invert_yaxis()
    _errors(right.subplots(), soundings)
    return figure


def _ping(figure: FigureBase, axes: Axes, soundings: SwathSoundings) -> None:
    step = max(1, len(soundings.slant) // CELLS)
    samples = len(soundings.slant) // step * step
    power = 10 ** (soundings.level[:, :samples] / 10)
    level = 10 * np.log10(power.reshape(len(power), -1, step).mean(axis=2))
    slant = soundings.slant[:samples].reshape(-1, step).mean(axis=1)
    angle = soundings.angle - soundings.keel[1]
    x, y = np.outer(np.sin(angle), slant), soundings.keel[0] + np.outer(np.cos(angle), slant)
    span = colour_span(level)
    mesh = axes.pcolormesh(x, y, level, cmap=style.COPPER, vmin=span[0], vmax=span[1], shading="gouraud",
                           rasterized=True)  # fmt: skip
    axes.plot(*soundings.profile, color=style.FAMILIES["S"], linewidth=1.2, label="true bed and targets under the ship")
    axes.plot(
        soundings.across[soundings.row], soundings.depth[soundings.row], ".", color=style.EXPECTED, markersize=3,
        label="soundings",
    )  # fmt: skip
    axes.set_aspect("equal")
    deepest = float(np.nanmax(soundings.profile[1]))
    axes.set_ylim(deepest + 0.25 * (deepest - soundings.keel[0]), soundings.keel[0] - 0.5)
    edge = float(np.nanmax(np.abs(soundings.across[soundings.row]))) * 1.05
    axes.set_xlim(-edge, edge)
    axes.grid(False)
    axes.set_xlabel("across the track, to starboard [m]")
    axes.set_ylabel("depth [m]")
    axes.set_title(f"Ping {soundings.ping}: {len(soundings.angle)} beams")
    axes.legend(loc="upper right", fontsize=8, frameon=True, framealpha=0.9)
    figure.colorbar(mesh, ax=axes, label="level [dB re 1 uPa]", pad=0.01)


def _cell_edges(soundings: SwathSoundings) -> tuple[Floats, Floats]:
    """Edges of the cells of a map along and across the track [m]; the first and last ping lie inside of theirs."""
    edge, ends = float(np.nanquantile(np.abs(soundings.across), 0.97)), np.nanquantile(soundings.along, [0.002, 0.998])
    spacing = max(float(np.ptp(ends)) / max(soundings.depth.shape[0] - 1, 1), CELL)
    length = float(np.ptp(ends)) + spacing
    rows = max(1, int(length / (1.25 * spacing)))  # none without a ping
    along = np.linspace(ends[0] - spacing / 2, ends[1] + spacing / 2, rows + 1)
    return along, np.linspace(-edge, edge, max(1, int(2 * edge / CELL)) + 1)


def _map(
    axes: Axes, soundings: SwathSoundings, values: Floats, span: tuple[float, float], cells: tuple[Floats, Floats]
) -> ScalarMappable:
    """Draw depths in cells with relief shading."""
    from scipy.stats import binned_statistic_2d

    rows, columns = cells
    finite = np.isfinite(values) & np.isfinite(soundings.across)
    position = soundings.along[finite], soundings.across[finite], values[finite]
    depth = binned_statistic_2d(*position, "median", list(cells)).statistic
    depth = np.repeat(depth, 2, axis=0) if len(depth) == 1 else depth  # slopes need two rows
    colours = Normalize(*span)
    light = LightSource(azdeg=315, altdeg=40)
    known = np.isfinite(depth)
    high = -np.where(known, depth, np.nanmedian(depth))
    shaded = light.shade(high, DEPTHS.reversed(), norm=Normalize(-span[1], -span[0]),
                      blend_mode="soft", vert_exag=LIT, dx=columns[1] - columns[0], dy=rows[1] - rows[0])  # fmt: skip
    shaded[~known] = to_rgba("#303030")
    axes.imshow(
        shaded,
        origin="lower",
        extent=(columns[0], columns[-1], rows[0], rows[-1]),
        interpolation="nearest",
        aspect="equal",
    )
    axes.grid(False)
    axes.set_xlabel("across the track, to starboard [m]")
    return ScalarMappable(colours, DEPTHS)


def _errors(axes: Axes, soundings: SwathSoundings) -> None:
    error = np.where(soundings.bed, soundings.depth - soundings.truth, np.nan)
    degrees = np.degrees(soundings.angle)
    enough = np.isfinite(error).sum(axis=0) >= min(3, len(error))
    axes.axhline(0, color=style.QUIET, linewidth=0.8)
    axes.set_title("Sounded minus true depth, bed only")
    axes.set_xlabel("angle of the beam from the keel [deg]")
    axes.set_ylabel("depth error [cm]")
    if not enough.any():
        return
    low, middle, high = np.nanquantile(error[:, enough], [0.159, 0.5, 0.841], axis=0)
    blue = style.CONTRIBUTION_COLOURS["surface"]
    axes.fill_between(degrees[enough], 100 * low, 100 * high, color=blue, alpha=0.25, linewidth=0, label="middle 68 %")
    axes.plot(degrees[enough], 100 * middle, color=blue, label="median")
    most = max(float(np.nanquantile(np.abs(np.concatenate([low, high])), 0.98)) * 100, LEAST)
    axes.set_ylim(-1.3 * most, 1.3 * most)
    axes.legend(loc="upper center", ncols=2)
