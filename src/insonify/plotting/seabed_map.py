"""Map of a scenario's seabed within the range of its sonar: depths, track, swaths and targets."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.patches import Patch, Polygon
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.scenario.scenario import Scenario
from insonify.scene.solid import seabed_depth_at, world_triangles
from insonify.scene.target import PointTarget
from insonify.sonar.beam import beams
from insonify.sonar.sonar import Sonar, array_rotation
from insonify.sonar.track import Poses, true_poses
from insonify.sonar.two_way_beam import two_way_width

Floats = NDArray[np.float64]
POINTS = 600
"""Points along the longer side of the map."""
UNKNOWN = "0.82"
"""Grey of seabed that was not surveyed."""
FLAT = "#EBD9BD"
"""Colour of a flat seabed."""
VEIL = 0.32
"""Largest opacity of the relief shading [1]."""
NARROWEST = 0.3
"""Least ratio of the shorter to the longer side of a map [1]."""
PINGS = 200
"""Largest number of pings for the outline of a swath [1]."""
EDGE_POINTS = 50_000
"""Points along the edges of a target among which the place of its label is chosen [1]."""
SIDES = {-1: ("#B02318", "port swath"), 0: ("#0B3F73", "beam on the bed"), 1: ("#0B7A3B", "starboard swath")}
"""Colour and name of the swath of each side: red and green, as a ship's lamps."""


def draw_seabed_map(axes: Axes, scenario: Scenario, *, near: bool = False) -> None:
    """Draw the depth of the seabed within the range of a direct echo, north up, shaded from the north-west.

    Args:
        axes: Axes to draw on.
        scenario: Scenario to draw.
        near: True for the surroundings of the swath only, instead of all within the range of an echo.
    """
    track = true_poses(scenario.track, seed=scenario.seed)
    (south, west), (north, east) = frame(scenario, near=near)
    step = max(north - south, east - west) / POINTS
    norths, easts = np.arange(south, north, step) + step / 2, np.arange(west, east, step) + step / 2
    nodes = np.stack(np.meshgrid(norths, easts, indexing="ij"), axis=-1)
    depth, extent = seabed_depth_at(scenario.completed_seabed, nodes), (west, east, south, north)
    low, high = float(np.nanmin(depth, initial=np.inf)), float(np.nanmax(depth, initial=-np.inf))
    if high > low:
        image = axes.imshow(depth, origin="lower", extent=extent, cmap=style.COPPER.reversed())
        axes.imshow(_shade(depth, step), origin="lower", extent=extent, interpolation="bilinear")
        axes.figure.colorbar(image, ax=axes, label="depth [m]", pad=0.02).ax.invert_yaxis()
    elif np.isfinite(low):
        axes.imshow(depth, origin="lower", extent=extent, cmap=ListedColormap([FLAT]))
        axes.text(0.01, 0.02, f"flat bed, {low:g} m deep", transform=axes.transAxes, fontsize=8)
    axes.set_facecolor(UNKNOWN)
    axes.grid(False)
    _swaths(axes, swaths(scenario, track))
    line = track.position
    axes.plot(line[:, 1], line[:, 0], color=style.INK, linewidth=1.6, marker="." if len(line) == 1 else "",
              markersize=10, label="sonar" if len(line) == 1 else "track")  # fmt: skip
    if len(line) > 1:
        pointer = (3, 0, -float(np.degrees(track.heading[-1])))
        axes.plot(line[-1, 1], line[-1, 0], marker=pointer, color=style.INK, markersize=9)
    axes.set(xlim=(west, east), ylim=(south, north))
    _targets(axes, scenario)
    named = axes.get_legend_handles_labels()[0]
    if not np.isfinite(depth).all():
        named.append(Patch(facecolor=UNKNOWN, edgecolor=style.QUIET, label="not surveyed"))
    axes.legend(handles=named, loc="upper right", frameon=True)
    grid = scenario.seabed.grid
    axes.set_title(
        "\n".join([scenario.title or "The seabed", *([] if grid is None else [grid.description])]), fontsize=9
    )
    axes.set(xlabel="east [m]", ylabel="north [m]")


def frame(scenario: Scenario, *, near: bool = True) -> tuple[Floats, Floats]:
    """South-western and north-eastern corner of the map of a scenario [m], (2,) each.

    Args:
        scenario: Scenario to draw.
        near: True for the surroundings of the swath, else all within the range of an echo.
    """
    track = true_poses(scenario.track, seed=scenario.seed)
    if not near:
        reach = scenario.water.sound_speed * scenario.track.window[1] / 2
        return track.position[:, :2].min(axis=0) - reach, track.position[:, :2].max(axis=0) + reach
    corners = np.concatenate([track.position[:, :2], *(ring for _, ring in swaths(scenario, track))])
    middle, half = (corners.max(axis=0) + corners.min(axis=0)) / 2, np.ptp(corners, axis=0) / 2
    half = 1.08 * half
    # as wide as a page, or wider than high: a long track to the north shows its surroundings
    half = np.maximum(half, [NARROWEST * half[1], half[0]])
    return middle - half, middle + half


def _shade(depth: Floats, step: float) -> Floats:
    """Relief shading with light from the north-west, black and white with opacity, shape (n, m, 4)."""
    down_north, down_east = np.gradient(depth, step)
    # steepest tenth of the slopes in full light, so that gentle ground shows its shape too
    slope = down_north * np.sin(np.pi / 4) - down_east * np.cos(np.pi / 4)
    known = np.isfinite(slope)
    strong = float(np.quantile(np.abs(slope[known]), 0.95)) if known.any() else 0.0
    light = np.clip(np.where(known, slope, 0.0) / max(strong, 1e-9), -1, 1)
    veil = np.zeros((*depth.shape, 4))
    veil[..., :3] = (light > 0)[..., None]
    veil[..., 3] = VEIL * np.abs(light)
    return veil


def middle_bearing(side: Sonar, track: Poses, ping: int) -> float:
    """Bearing of the middle beam of one side of a sonar [rad].

    Args:
        side: The sonar, of one side.
        track: Poses of its platform.
        ping: Number of the ping.
    """
    return float(_bearings(side, track, ping, np.array([(min(side.steers) + max(side.steers)) / 2]))[0])


def _bearings(side: Sonar, track: Poses, ping: int, steer: Floats) -> Floats:
    """Bearings of steer angles at one ping [rad]."""
    rotation = array_rotation(side, track.rotation(ping))
    facing = np.cos(steer)[:, None] * rotation[0] + np.sin(steer)[:, None] * rotation[1]
    return np.asarray(np.arctan2(facing[:, 1], facing[:, 0]))


def swaths(scenario: Scenario, track: Poses) -> list[tuple[int, Floats]]:
    """Outline of the seabed in the beams and the recorded window: a strip along the track, or a sector of one ping.

    Returns:
        For each side of the sonar -1, 0 or 1 and a ring of north and east [m], shape (n, 2).
    """
    speed, outlines = scenario.water.sound_speed, []
    pings = np.unique(np.linspace(0, len(track) - 1, PINGS).astype(int))
    for row, side in enumerate(scenario.sonar.side_sonars):
        number = scenario.sonar.channel_sides[row * scenario.sonar.beam_count]
        height = np.maximum(scenario.seabed.depth - track.position[pings, 2], 0.0)
        near, far = (np.sqrt(np.maximum((speed * t / 2) ** 2 - height**2, 0)) for t in scenario.track.window)
        if len(pings) > 1:
            bearing = np.array([middle_bearing(side, track, int(ping)) for ping in pings])
            start = track.position[pings, :2]
        else:
            ends = [beams(array, side.pulse.frequency, speed) for array in side.channel_arrays]
            half = two_way_width(*ends) / 2
            bearing = _bearings(side, track, 0, np.linspace(min(side.steers) - half, max(side.steers) + half, 33))
            start, near, far = np.repeat(track.position[:1, :2], 33, axis=0), np.repeat(near, 33), np.repeat(far, 33)
        direction = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
        inner, outer = start + near[:, None] * direction, start + far[:, None] * direction
        outlines.append((number, np.concatenate([inner, outer[::-1]])))
    return outlines


def _swaths(axes: Axes, seen: list[tuple[int, Floats]]) -> None:
    """Draw the outlines of the swaths, each side in its colour."""
    for side, ring in seen:
        colour, name = SIDES[side]
        axes.add_patch(Polygon(ring[:, ::-1], closed=True, fill=True, facecolor=(*to_rgb(colour), 0.08),
                               edgecolor=colour, linewidth=1.3, label=name))  # fmt: skip


def _targets(axes: Axes, scenario: Scenario) -> None:
    """Draw the outlines of the targets, and their labels."""
    for target in scenario.targets:
        north, east = target.position[:2]
        colour, named = style.CONTRIBUTION_COLOURS["target"], np.array([north, east])
        if isinstance(target, PointTarget):
            axes.plot(east, north, "+", color=colour, markersize=9)
        else:
            footprint = np.asarray(world_triangles(target, scenario.completed_seabed).corners)[..., :2]
            axes.add_collection(PolyCollection(list(footprint[..., ::-1]), facecolors=colour, edgecolors=colour,
                                               linewidths=1.5), autolim=False)  # fmt: skip
            named = _in_frame(axes, named, footprint)
        axes.annotate(
            target.label, (named[1], named[0]), xytext=(5, 5), textcoords="offset points", fontsize=8,
            annotation_clip=True, path_effects=[withStroke(linewidth=2.0, foreground="#FFFFFFB0")],
        )  # fmt: skip


def _in_frame(axes: Axes, middle: Floats, footprint: Floats) -> Floats:
    """North and east of a target's label: its centre, or the nearest point of its edges inside the frame.

    Args:
        axes: Axes of the map, with their limits.
        middle: North and east of the target [m].
        footprint: Corners of its triangles, north and east [m], shape (n, 3, 2).
    """
    (west, east), (south, north) = axes.get_xlim(), axes.get_ylim()
    part = np.linspace(0, 1, max(2, min(65, EDGE_POINTS // len(footprint))))[:, None, None, None]
    edges = footprint + part * (np.roll(footprint, -1, axis=1) - footprint)
    points = np.concatenate([middle[None], edges.reshape(-1, 2)])
    inside = (points[:, 0] >= south) & (points[:, 0] <= north) & (points[:, 1] >= west) & (points[:, 1] <= east)
    shown = points[inside]
    return shown[np.argmin(np.hypot(*(shown - middle).T))] if len(shown) else middle
