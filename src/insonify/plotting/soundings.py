"""What a multibeam shows: one ping in depth and across, the swath's depths beside the true ones, and the errors."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LightSource, LinearSegmentedColormap, Normalize, to_rgba
from matplotlib.figure import Figure
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.plotting.recording_levels import Floats, colour_span

DEPTHS = LinearSegmentedColormap.from_list(
    "depths", ["#FFF6D6", "#F4C46B", "#E2814C", "#A74B6C", "#5D3A7F", "#20315F", "#0A1A30"]
)
"""Colours of depth, shallow ones light; lightness falls evenly."""
CELLS = 500
"""Samples of range that are drawn."""
CELL = 0.5
"""Side of the cells of a map across the track, and least along it [m]."""
LEAST = 0.1
"""Least error that the axis of errors reaches to [cm]."""
LIT = 3.0
"""How much higher the bed is for the light than it is [1]."""


@dataclass(frozen=True, slots=True)
class SwathSoundings:
    """Depths of a swath, each over (ping, beam), and one ping closer."""

    angle: Floats
    """Of the beams from the keel, to starboard [rad], shape (beam,)."""
    along: Floats
    """Where they were put, along the track [m]."""
    across: Floats
    """And to starboard of it [m]."""
    depth: Floats
    """Measured [m]."""
    truth: Floats
    """What is met there from above [m]."""
    bed: NDArray[np.bool_]
    """Whether that is bed, with no target near."""
    row: int
    """Which ping is closer."""
    slant: Floats
    """Slant range of the samples [m], shape (time,)."""
    level: Floats
    """Of the beams of that ping [dB re 1 uPa], shape (beam, time)."""
    keel: tuple[float, float]
    """Depth of the sonar in that ping [m], and its roll [rad]."""
    profile: tuple[Floats, Floats]
    """Places across [m] and true depths there [m], under that ping."""


def depth_span(depth: Floats) -> tuple[float, float]:
    """Depths of the first and the last colour [m].

    Args:
        depth: What is drawn [m], any shape; where there is none, 0 to 1 m.
    """
    if not np.isfinite(depth).any():
        return 0.0, 1.0
    low, high = np.nanquantile(depth, [0.01, 0.999])
    return float(np.floor(4 * low) / 4), float(np.ceil(4 * high) / 4)


def soundings_view(soundings: SwathSoundings, title: str) -> Figure:
    """The swath of a multibeam.

    Args:
        soundings: What was sounded.
        title: Above it all.
    """
    figure = style.new_figure(14, 11)
    figure.suptitle(title, fontweight="bold", fontsize=11)
    panels = figure.subplot_mosaic([["ping", "ping", "ping"], ["depth", "truth", "error"]], height_ratios=(1, 1.15),
                                   width_ratios=(1, 1, 0.75))  # fmt: skip
    _ping(figure, panels["ping"], soundings)
    span = depth_span(soundings.truth)
    for name, values, caption in (
        ("depth", soundings.depth, "Depth sounded"),
        ("truth", soundings.truth, "True depth there"),
    ):
        mesh = _map(panels[name], soundings, values, span)
        panels[name].set_title(caption)
    panels["truth"].set_ylabel("")
    figure.colorbar(mesh, ax=[panels["depth"], panels["truth"]], label="depth [m]", pad=0.01).ax.invert_yaxis()
    _errors(panels["error"], soundings)
    return figure


def _ping(figure: Figure, axes: Axes, found: SwathSoundings) -> None:
    step = max(1, len(found.slant) // CELLS)
    kept = len(found.slant) // step * step
    power = 10 ** (found.level[:, :kept] / 10)
    level = 10 * np.log10(power.reshape(len(power), -1, step).mean(axis=2))
    slant = found.slant[:kept].reshape(-1, step).mean(axis=1)
    looking = found.angle - found.keel[1]
    x, y = np.outer(np.sin(looking), slant), found.keel[0] + np.outer(np.cos(looking), slant)
    span = colour_span(level)
    mesh = axes.pcolormesh(x, y, level, cmap=style.COPPER, vmin=span[0], vmax=span[1], shading="gouraud",
                           rasterized=True)  # fmt: skip
    axes.plot(*found.profile, color=style.FAMILIES["S"], linewidth=1.2, label="true bed and targets under the ship")
    axes.plot(
        found.across[found.row], found.depth[found.row], ".", color=style.EXPECTED, markersize=3, label="soundings"
    )
    axes.set_aspect("equal")
    deepest = float(np.nanmax(found.profile[1]))
    axes.set_ylim(deepest + 0.25 * (deepest - found.keel[0]), found.keel[0] - 0.5)
    edge = float(np.nanmax(np.abs(found.across[found.row]))) * 1.05
    axes.set_xlim(-edge, edge)
    axes.grid(False)
    axes.set_xlabel("across the track, to starboard [m]")
    axes.set_ylabel("depth [m]")
    axes.set_title(f"Ping {found.row}: {len(found.angle)} beams")
    axes.legend(loc="upper right", fontsize=8, frameon=True, framealpha=0.9)
    figure.colorbar(mesh, ax=axes, label="level [dB re 1 uPa]", pad=0.01)


def _map(axes: Axes, found: SwathSoundings, values: Floats, span: tuple[float, float]) -> ScalarMappable:
    """Depths in cells, lit from the side so that the bed's own relief is seen beside what stands on it."""
    from scipy.stats import binned_statistic_2d

    edge, ends = float(np.nanquantile(np.abs(found.across), 0.97)), np.nanquantile(found.along, [0.002, 0.998])
    step = max(1.25 * float(np.ptp(ends)) / max(found.depth.shape[0] - 1, 1), CELL)  # none without a ping
    rows, columns = np.arange(ends[0] - step, ends[1] + 2 * step, step), np.arange(-edge, edge + CELL, CELL)
    there = np.isfinite(values) & np.isfinite(found.across)
    position = found.along[there], found.across[there], values[there]
    depth = binned_statistic_2d(*position, "median", [rows, columns]).statistic
    colours = Normalize(*span)
    light = LightSource(azdeg=315, altdeg=40)
    known = np.isfinite(depth)
    high = -np.where(known, depth, np.nanmedian(depth))
    lit = light.shade(high, DEPTHS.reversed(), norm=Normalize(-span[1], -span[0]),
                      blend_mode="soft", vert_exag=LIT, dx=CELL, dy=step)  # fmt: skip
    lit[~known] = to_rgba("#303030")
    axes.imshow(lit, origin="lower", extent=(-edge, edge, rows[0], rows[-1]), interpolation="nearest", aspect="equal")
    axes.grid(False)
    axes.set_xlabel("across the track, to starboard [m]")
    axes.set_ylabel("along the track [m]")
    return ScalarMappable(colours, DEPTHS)


def _errors(axes: Axes, found: SwathSoundings) -> None:
    off = np.where(found.bed, found.depth - found.truth, np.nan)
    degrees = np.degrees(found.angle)
    told = np.isfinite(off).sum(axis=0) >= min(3, len(off))
    axes.axhline(0, color=style.QUIET, linewidth=0.8)
    axes.set_title("Sounded less true depth, bed alone")
    axes.set_xlabel("angle of the beam from the keel [deg]")
    axes.set_ylabel("depth error [cm]")
    if not told.any():
        return
    low, middle, high = np.nanquantile(off[:, told], [0.159, 0.5, 0.841], axis=0)
    axes.fill_between(degrees[told], 100 * low, 100 * high, color=style.CONTRIBUTION_COLOURS["surface"], alpha=0.25, linewidth=0,
                      label="middle 68 %")  # fmt: skip
    axes.plot(degrees[told], 100 * middle, color=style.CONTRIBUTION_COLOURS["surface"], label="median")
    most = max(float(np.nanquantile(np.abs(np.concatenate([low, high])), 0.98)) * 100, LEAST)
    axes.set_ylim(-1.3 * most, 1.3 * most)
    axes.legend(loc="upper center", ncols=2)
