"""Figure of a scenario: map of the seabed with track, swath and targets, and vertical section along the beam."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from numpy.typing import NDArray

from insonify.plotting import style
from insonify.plotting.seabed_map import draw_seabed_map, frame, middle_bearing
from insonify.scenario.scenario import Scenario
from insonify.scenario.track_errors import seabed_depth_span
from insonify.scene.solid import seabed_depth_at, world_triangles
from insonify.scene.solid_section import cut_segments
from insonify.scene.target import PointTarget
from insonify.scene.triangle_surfaces import Triangles
from insonify.sonar.beam import beams
from insonify.sonar.sonar import Sonar, array_position, array_rotation
from insonify.sonar.track import Poses, true_poses

Floats = NDArray[np.float64]
SHOWN_RANGE = 30.0
"""Range of levels of the two-way beam drawn below its axis [dB]."""
LIT = LinearSegmentedColormap.from_list("water", ["#FFFFFF", "#9CCBEB"])
WIDE, SECTION = 9.0, 2.7
"""Width of the map and height of the vertical plane [inch]."""
PLANES = 200
"""Largest number of pings whose beams are searched for targets [1]."""
MAX_OFFSET_RATIO = 0.05
"""Largest offset of a target from the plane of a beam to be drawn in it, relative to its distance [1]."""
CELLS = 500, 160
"""Cells of the beam along range and depth."""


def scene(scenario: Scenario, path: str | Path) -> Path:
    """Draw the map and the vertical section of a scenario.

    Args:
        scenario: Scenario to draw.
        path: File of the figure.

    Returns:
        The path.

    Example:
        >>> picture = scene(insonify.load_scenario("sidescan.yaml"), "scene.png")
        >>> picture.name, picture.stat().st_size > 0
        ('scene.png', True)
    """
    with style.plot_style():
        (south, west), (north, east) = frame(scenario)
        tall = float(np.clip(WIDE * (north - south) / (east - west), 2.0, 8.0))
        figure = style.new_figure(11, tall + SECTION + 1.6)
        upper, lower = figure.subplots(2, 1, height_ratios=(tall, SECTION))
        draw_seabed_map(upper, scenario, near=True)
        section(lower, scenario)
        return style.save_figure(figure, path)


def section(axes: Axes, scenario: Scenario) -> None:
    """Draw the vertical plane of the beam at the first ping: water, seabed, beam, and the targets that beams pass."""
    track = true_poses(scenario.track, seed=scenario.seed)
    far = scenario.water.max_sound_speed * scenario.track.window[1] / 2
    edges, signs = [0.0], [side or 1 for side in scenario.sonar.channel_sides[:: scenario.sonar.beam_count]]
    for sign, side in zip(signs, scenario.sonar.side_sonars, strict=True):
        position = array_position(side.transmit, track.position[0], track.rotation(0))
        edges.append(sign * far)
        _beam(axes, scenario, side, track, sign, far)
        _ground(axes, scenario, position, middle_bearing(side, track, 0), sign, far)
        _targets(axes, scenario, side, track, sign, far)
        axes.plot([0], [position[2]], "o", color=style.INK, markersize=7, zorder=5)
    axes.axhline(0, color=style.CONTRIBUTION_COLOURS["surface"], linewidth=2)
    bed = max(seabed_depth_span(scenario)[1], scenario.seabed.depth)
    margin = 0.03 * (max(edges) - min(edges))
    axes.set(xlim=(min(edges) - margin, max(edges) + margin), ylim=(1.1 * bed, -0.06 * bed))
    axes.grid(False)
    axes.xaxis.set_major_formatter(lambda value, _: f"{abs(value):g}")
    axes.set_xlabel(("port  |  starboard,  " if min(signs) < 0 else "") + "distance along the first ping's beam [m]")
    axes.set_ylabel("depth [m]")
    note = ", drawn without refraction" if scenario.water.layered else ""
    axes.set_title(f"In the beam's plane: two-way beam down to {-SHOWN_RANGE:g} dB{note}; bed; targets it passes",
                   fontsize=10)  # fmt: skip


def _beam(axes: Axes, scenario: Scenario, side: Sonar, track: Poses, sign: int, far: float) -> None:
    """Draw the two-way level of the beam in its vertical plane."""
    body = track.rotation(0)
    position = array_position(side.transmit, track.position[0], body)
    rotation, frequency = array_rotation(side, body), side.pulse.frequency
    speed = float(scenario.water.sound_speed_at(position[2]))
    x, z = (np.linspace(low, high, cells + 1) for low, high, cells in
            ((0, far, CELLS[0]), (0, scenario.seabed.depth, CELLS[1])))  # fmt: skip
    middle_x, middle_z = (x[1:] + x[:-1]) / 2, ((z[1:] + z[:-1]) / 2)[:, None]
    length = np.hypot(middle_x, middle_z - position[2])
    bearing = middle_bearing(side, track, 0)
    cosine = middle_x / length
    direction = np.stack([cosine * np.cos(bearing), cosine * np.sin(bearing), (middle_z - position[2]) / length], -1)
    power = np.ones(length.shape)
    for array in side.channel_arrays:
        power = power * np.max(np.abs(beams(array, frequency, speed, rotation).gain(direction)) ** 2, axis=0)
    level = 10 * np.log10(np.maximum(power, 1e-30))
    shown = np.where((level > -SHOWN_RANGE) & (length <= far), level, np.nan)
    axes.pcolormesh(sign * x, z, shown, cmap=LIT, vmin=-SHOWN_RANGE, vmax=0, rasterized=True, zorder=0)


def _ground(axes: Axes, scenario: Scenario, position: Floats, bearing: float, sign: int, far: float) -> None:
    """Draw the seabed along the beam."""
    x = np.linspace(0, far, 4 * CELLS[0])
    bed = seabed_depth_at(scenario.completed_seabed, position[:2] + x[:, None] * [np.cos(bearing), np.sin(bearing)])
    colour = style.CONTRIBUTION_COLOURS["seabed"]
    axes.plot(sign * x, bed, color=colour, linewidth=1.4, zorder=2)
    axes.fill_between(sign * x, bed, 1.2 * np.nanmax(bed, initial=scenario.seabed.depth), color=colour, alpha=0.3,
                      linewidth=0)  # fmt: skip


def _cut_along(surface: Triangles, origin: Floats, bearing: float) -> Floats:
    """Outline of the section of triangles in a vertical plane: ends of its segments, shape (segments, 2, 2) [m].

    The last axis has distance and depth. All segments go the same way about the solid, seen from starboard of the
    bearing.

    Args:
        surface: The triangles.
        origin: North and east of the start of the plane [m], shape (2,).
        bearing: Bearing of the plane [rad]; what is behind the origin is left out.
    """
    ahead, aside = np.array([np.cos(bearing), np.sin(bearing)]), np.array([-np.sin(bearing), np.cos(bearing)])
    starts, ends, normal = cut_segments(surface, (np.asarray(surface.corners, float)[..., :2] - origin) @ aside)
    start, end = (np.column_stack([(point[:, :2] - origin) @ ahead, point[:, 2]]) for point in (starts, ends))
    step = end - start
    against = step[:, 0] * normal[:, 2] > step[:, 1] * (normal[:, :2] @ ahead)
    start, step = np.where(against[:, None], end, start), np.where(against[:, None], -step, step)
    at_origin = np.divide(-start[:, 0], step[:, 0], out=np.where(start[:, 0] > 0, 0.0, 1.0), where=step[:, 0] != 0)
    at_origin, forward = np.clip(at_origin, 0, 1), step[:, 0] >= 0
    part = np.stack([np.where(forward, at_origin, 0.0), np.where(forward, 1.0, at_origin)], axis=1)
    kept = part[:, 0] < part[:, 1]
    return np.asarray(start[kept, None] + part[kept, :, None] * step[kept, None])


def _draw_section(axes: Axes, outline: Floats, colour: str) -> None:
    """Fill an outline as from `_cut_along`: the strips between its segments and its top add up to what is inside."""
    top = np.stack([outline[:, ::-1, 0], np.full(outline.shape[:2], outline[..., 1].min())], axis=-1)
    strips = Outline.make_compound_path_from_polys(np.concatenate([outline, top], axis=1))
    axes.add_patch(PathPatch(strips, facecolor=colour, linewidth=0, zorder=4))
    axes.add_collection(LineCollection(list(outline), colors=colour, linewidths=1, zorder=4), autolim=False)


def _targets(axes: Axes, scenario: Scenario, side: Sonar, track: Poses, sign: int, far: float) -> None:
    """Draw targets at their distance and height in the plane of the beam that passes them."""
    pings = np.unique(np.linspace(0, len(track) - 1, PLANES).astype(int))
    bearing = np.array([middle_bearing(side, track, int(ping)) for ping in pings])
    positions = track.position[pings, :2]
    spacing = float(np.max(np.linalg.norm(np.diff(positions, axis=0), axis=1), initial=0.0))
    colour, towards = style.CONTRIBUTION_COLOURS["target"], np.array([sign, 1.0])
    for target in scenario.targets:
        surface = None if isinstance(target, PointTarget) else world_triangles(target, scenario.completed_seabed)
        if surface is None:
            low = high = np.asarray(target.position, float)
        else:
            low, high = np.asarray(surface.low), np.asarray(surface.high)
        offset, half = (low + high)[:2] / 2 - positions, float(np.max((high - low)[:2])) / 2
        along = offset[:, 0] * np.cos(bearing) + offset[:, 1] * np.sin(bearing)
        aside = offset[:, 1] * np.cos(bearing) - offset[:, 0] * np.sin(bearing)
        distance = np.where((along <= 0) | (along > far), np.inf, np.abs(aside))
        nearest = int(np.argmin(distance))
        if distance[nearest] > half + spacing + MAX_OFFSET_RATIO * along[nearest]:
            continue
        middle, top = sign * along[nearest], low[2]
        outline = np.empty((0, 2, 2))
        if surface is not None:
            direction = float(bearing[nearest])
            outline = _cut_along(surface, positions[nearest], direction)
            if not len(outline):  # the planes of all pings miss it: the section through its middle
                to_middle = aside[nearest] * np.array([-np.sin(direction), np.cos(direction)])
                outline = _cut_along(surface, positions[nearest] + to_middle, direction)
        if len(outline):
            outline = outline * towards
            _draw_section(axes, outline, colour)
            top = outline[..., 1].min()
            middle = (outline[..., 0].min() + outline[..., 0].max()) / 2
        else:
            axes.plot([middle], [top], "+", color=colour, markersize=9, zorder=4)
        axes.annotate(target.label, (middle, top), xytext=(0, 4), textcoords="offset points", ha="center",
                      fontsize=8, zorder=6)  # fmt: skip
