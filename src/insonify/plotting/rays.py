"""Ray diagram beside the sound-speed profile, over one depth axis."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import ArrayLike

from insonify.ocean.profile import SoundSpeedProfile
from insonify.plotting import style
from insonify.propagation.eigenray import eigenrays
from insonify.propagation.families import DIRECT
from insonify.propagation.ray_fan import RayFan, trace_fan
from insonify.propagation.sound_speed_layers import sound_speed_layers

RAYS = 121
"""Default number of rays of a fan [1]."""
WIDEST = np.radians(20.0)
"""Default largest launch elevation of a fan [rad]."""
NAMED = 7
"""Largest number of families in the legend [1]."""
GRID = 480, 200
"""Cells along range and depth of the map of shadow zones [1]."""
SHADOW_ZONE_COLOUR = "#D9DDE3"
"""Colour of water that no direct ray reaches."""


def rays(
    profile: SoundSpeedProfile, path: str | Path, *, source_depth: float, water_depth: float | None = None,
    max_range: float = 200.0, launch: ArrayLike | None = None, bounces: int = 2, title: str = "",
) -> Path:  # fmt: skip
    """Draw rays from a source, and the sound-speed profile beside them.

    Args:
        profile: Sound speed over depth.
        path: File of the figure.
        source_depth: Depth of the source [m].
        water_depth: Depth of the seabed [m]; by default the end of the profile.
        max_range: Range at which rays end [m].
        launch: Launch elevations, + down [rad], shape (rays,); by default from -20 to 20 deg.
        bounces: Largest number of bounces of a ray that are drawn.
        title: Title, such as the name of the water.

    Returns:
        The path.

    Raises:
        ValueError: The profile does not cover the water, or the source is not in it.

    Example:
        >>> thermocline = insonify.ocean.SoundSpeedProfile([0, 8, 14, 20], [1510, 1510, 1490, 1490])
        >>> picture = rays(thermocline, "rays.png", source_depth=5.0, max_range=300.0)
        >>> picture.name, picture.stat().st_size > 0
        ('rays.png', True)
    """
    layers = sound_speed_layers(profile, float(profile.depth[-1]) if water_depth is None else water_depth)
    angles = np.linspace(-WIDEST, WIDEST, RAYS) if launch is None else np.atleast_1d(np.asarray(launch, float))
    traced = trace_fan(layers, source_depth, angles, max_range=max_range, max_bounces=bounces, step=max_range / 400)
    with style.plot_style():
        figure = style.new_figure(12, 4.8)
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=(1, 4.6))
        speed(left, layers.depth, layers.speed, source_depth)
        dark = shadow_zone(right, profile, layers.water_depth, source_depth, max_range)
        section(right, traced, layers.water_depth, source_depth, dark=dark)
        low, high = np.degrees(traced.launch_elevation.min()), np.degrees(traced.launch_elevation.max())
        right.set_title(f"{len(traced)} rays, launched from {low:.1f} to {high:.1f} deg (+ down)")
        figure.suptitle(title, ha="left", x=0.01, fontsize=11)
        return style.save_figure(figure, path)


def speed(axes: Axes, depth: ArrayLike, speeds: ArrayLike, source_depth: float) -> None:
    """Draw sound speed over depth, in a narrow panel beside rays.

    Args:
        axes: Axes to draw on.
        depth: Depths of the knots [m], shape (m,).
        speeds: Sound speed at the knots [m/s], shape (m,).
        source_depth: Depth of the source, marked [m].
    """
    z, c = np.asarray(depth, float), np.asarray(speeds, float)
    axes.plot(c, z, color=style.INK)
    if z.size <= 60:
        axes.plot(c, z, "o", color=style.INK, markersize=3.0)
    axes.plot(
        [np.interp(source_depth, z, c)], [source_depth], "o", color=style.CONTRIBUTION_COLOURS["target"], markersize=7
    )
    margin = max(0.12 * float(np.ptp(c)), 0.5)
    axes.set(xlim=(c.min() - margin, c.max() + margin), xlabel="sound speed [m/s]", ylabel="depth [m]")


def shadow_zone(
    axes: Axes, profile: SoundSpeedProfile, water_depth: float, source_depth: float, farthest: float
) -> bool:
    """Draw the shadow zone, water that no direct ray reaches, by the exact eigenray solver for each cell.

    Args:
        axes: Axes to draw on.
        profile: Sound speed over depth.
        water_depth: Depth of the seabed [m].
        source_depth: Depth of the source [m].
        farthest: Largest range of the cells [m].

    Returns:
        True where a shadow zone was drawn.
    """
    x, z = (np.linspace(0, stop, cells + 1) for stop, cells in zip((farthest, water_depth), GRID, strict=True))
    middle_x, middle_z = (x[1:] + x[:-1]) / 2, (z[1:] + z[:-1]) / 2
    direct = eigenrays(
        profile, water_depth=water_depth, source_depth=source_depth, point_depth=middle_z[:, None], range=middle_x,
        families=("D",),
    )  # fmt: skip
    dark = np.ones((z.size - 1) * (x.size - 1))
    dark[direct.point[direct.status == "ok"]] = np.nan
    has_shadow = bool(np.isfinite(dark).any())
    if has_shadow:
        axes.pcolormesh(
            x, z, dark.reshape(z.size - 1, -1), cmap=ListedColormap([SHADOW_ZONE_COLOUR]), rasterized=True, zorder=0
        )
    return has_shadow


def section(axes: Axes, traced: RayFan, water_depth: float, source_depth: float, *, dark: bool = False) -> None:
    """Draw rays in a vertical plane, coloured by family.

    Args:
        axes: Axes to draw on.
        traced: Traced rays.
        water_depth: Depth of the seabed [m].
        source_depth: Depth of the source, marked [m].
        dark: True where the legend names the shadow zone.
    """
    lines: dict[str, list[np.ndarray]] = {}
    for family, x, z in traced.segments():
        lines.setdefault(family, []).append(np.stack([x, z], axis=-1))
    order = sorted(lines, key=lambda name: (name != DIRECT, len(name), name[::-1]))
    thin = float(np.clip(60 / max(len(traced), 1), 0.35, 1.1))
    for name in reversed(order):  # the direct rays on top
        share, alpha = (1.1, 0.9) if name == DIRECT else (0.8, 0.55)
        colour = style.FAMILIES.get(name, style.QUIET)
        axes.add_collection(LineCollection(lines[name], colors=colour, linewidths=thin * share, alpha=alpha))
    axes.axhline(0, color=style.CONTRIBUTION_COLOURS["surface"], linewidth=2, zorder=3)
    axes.axhline(water_depth, color=style.CONTRIBUTION_COLOURS["seabed"], linewidth=2, zorder=3)
    axes.axhspan(water_depth, 1.06 * water_depth, color=style.CONTRIBUTION_COLOURS["seabed"], alpha=0.3, linewidth=0)
    axes.plot(
        [0], [source_depth], "o", color=style.CONTRIBUTION_COLOURS["target"], markersize=7, zorder=4, clip_on=False
    )
    axes.set_xlim(0, float(traced.range.max()) if len(traced) else 1.0)
    axes.set_ylim(1.06 * water_depth, -0.06 * water_depth)
    axes.set_xlabel("horizontal range [m]")
    axes.grid(False)
    named: list[Line2D | Patch] = [
        Line2D([], [], color=style.FAMILIES.get(name, style.QUIET), label=name) for name in order[:NAMED]
    ]
    if dark:
        named.append(Patch(color=SHADOW_ZONE_COLOUR, label="no direct path"))
    axes.legend(handles=named, ncols=len(named), loc="lower right", bbox_to_anchor=(1.0, 1.0), handlelength=1.2,
                columnspacing=1.0)  # fmt: skip
