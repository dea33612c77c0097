"""Errors of sonars over terrain: positions without terrain, and below the seabed's mean plane that reflects sound."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.model import field_error
from insonify.scenario.track_errors import PLATFORM

if TYPE_CHECKING:
    from insonify.scenario.scenario_parts import ScenarioParts

Floats = NDArray[np.float64]
MAX_UNKNOWN_FRACTION = 0.01
"""Share of the ground in reach that may be missing without a word [1]."""
_PINGS, _BEARINGS, _DISTANCES = 20, 24, 16  # where a survey is tried


def terrain_errors(scenario: ScenarioParts, array_positions: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    """Errors of a sonar over a seabed with relief.

    Args:
        scenario: The scenario.
        array_positions: Places of the platform and of its arrays [m], by name, each of shape (pings, 3).
    """
    grid = scenario.seabed.grid
    bed = scenario.completed_seabed.terrain
    if bed is None:
        return
    if grid is None:
        yield from _land_error(scenario, array_positions[PLATFORM])
        return
    for name, position in array_positions.items():
        unknown = np.flatnonzero(np.isnan(bed.depth_at(position[:, 0], position[:, 1])))
        if unknown.size:
            north, east, _ = position[unknown[0]]
            several = "" if unknown.size == 1 else f", the first of {unknown.size} such pings,"
            yield field_error(
                "track", None, f"ping {unknown[0]}{several} has {name} at north {north:.6g} m, east {east:.6g} m, "
                f"where the survey has a hole or ends. Move the track, or the origin of the grid ({grid.description}).",
            )  # fmt: skip
            return
    deepest = max(float(position[:, 2].max()) for position in array_positions.values())
    if deepest >= bed.depth:
        yield field_error(
            "seabed.depth", f"{bed.depth:g} m", f"is the plane that reflects sound, and the sonar goes down to "
            f"{deepest:.4g} m. Write the mean depth of the part in its range, above {deepest:.4g} m.",
        )  # fmt: skip


def _land_error(scenario: ScenarioParts, position: Floats) -> Iterator[PydanticCustomError]:
    """Error of synthetic relief that stands out of the water: a slip of units more often than an island."""
    bed = scenario.completed_seabed.terrain
    if bed is None or bed.span[0] > 0:
        return
    depth, farthest = _terrain_depths_in_range(scenario, position)
    if (shallowest := float(depth.min())) <= 0:
        yield field_error(
            "seabed.relief", None, f"rises {bed.depth - shallowest:.3g} m above its mean plane within {farthest:.3g} m "
            f"of the track, and the water is {bed.depth:g} m deep. Give lower relief, or a deeper seabed; land is for "
            "surveyed grids.",
        )  # fmt: skip


def _terrain_depths_in_range(scenario: ScenarioParts, position: Floats) -> tuple[Floats, float]:
    """Depths of the ground at positions spread evenly over what is in reach of a track, and how far that is [m]."""
    bed = scenario.completed_seabed.terrain
    assert bed is not None
    farthest = scenario.water.max_sound_speed * scenario.track.window[1] / 2
    tried = position[np.linspace(0, len(position) - 1, min(_PINGS, len(position))).astype(int)]
    # evenly over the area of a disc
    distance = farthest * np.sqrt((np.arange(_DISTANCES) + 0.5) / _DISTANCES)
    bearing = 2 * np.pi * np.arange(_BEARINGS) / _BEARINGS
    north = tried[:, 0, None, None] + distance[:, None] * np.cos(bearing)
    east = tried[:, 1, None, None] + distance[:, None] * np.sin(bearing)
    return bed.depth_at(north, east), farthest


def terrain_gap_warning(scenario: ScenarioParts, position: Floats) -> str:
    """Warning on a survey that ends within reach of the sonar; empty where it does not.

    Args:
        scenario: The scenario.
        position: North, east, depth of the platform at all pings [m], shape (pings, 3).
    """
    grid = scenario.seabed.grid
    bed = None if grid is None else scenario.completed_seabed.terrain
    if bed is None or grid is None:
        return ""
    depth, farthest = _terrain_depths_in_range(scenario, position)
    share = float(np.isnan(depth).mean())
    if share <= MAX_UNKNOWN_FRACTION:
        return ""
    return (
        f"seabed.relief: {100 * share:.0f} % of the ground within {farthest:.0f} m of the track is not in the survey "
        f"({grid.description}); it neither scatters nor casts shadows. Shorten the window, or move the track."
    )
