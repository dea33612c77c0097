"""Whether the sonar swims over ground that somebody knows, above the plane that mirrors its sound."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.noun import located
from insonify.scenario.track_faults import PLATFORM

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

Floats = NDArray[np.float64]
MOST_UNKNOWN = 0.01
"""Share of the ground in reach that may be missing without a word [1]."""
_PINGS, _BEARINGS, _DISTANCES = 20, 24, 16  # where a survey is tried


def ground_faults(scenario: Scenario, found: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    """What keeps a sonar from being heard over a seabed with relief.

    Args:
        scenario: The scenario.
        found: Places of the platform and of its arrays [m], by name, each of shape (pings, 3).
    """
    grid = scenario.seabed.grid
    bed = scenario.settled_seabed.bed
    if bed is None:
        return
    if grid is None:
        yield from _made_land(scenario, found[PLATFORM])
        return
    for name, place in found.items():
        unknown = np.flatnonzero(np.isnan(bed.depth_at(place[:, 0], place[:, 1])))
        if unknown.size:
            north, east, _ = place[unknown[0]]
            several = "" if unknown.size == 1 else f", the first of {unknown.size} such pings,"
            yield located(
                "track", None, f"ping {unknown[0]}{several} has {name} at north {north:.6g} m, east {east:.6g} m, "
                f"where the survey has a hole or ends. Move the track, or the origin of the grid ({grid.told}).",
            )  # fmt: skip
            return
    deepest = max(float(place[:, 2].max()) for place in found.values())
    if deepest >= bed.depth:
        yield located(
            "seabed.depth", f"{bed.depth:g} m", f"is the plane that mirrors sound, and the sonar goes down to "
            f"{deepest:.4g} m. Write the mean depth of the part that it hears, above {deepest:.4g} m.",
        )  # fmt: skip


def _made_land(scenario: Scenario, place: Floats) -> Iterator[PydanticCustomError]:
    """Relief that nobody surveyed and that stands out of the water: a slip of units more often than an island."""
    bed = scenario.settled_seabed.bed
    if bed is None or bed.span[0] > 0:
        return
    depth, farthest = _in_reach(scenario, place)
    if (shallowest := float(depth.min())) <= 0:
        yield located(
            "seabed.relief", None, f"rises {bed.depth - shallowest:.3g} m above its mean plane within {farthest:.3g} m "
            f"of the track, and the water is {bed.depth:g} m deep. Give lower relief, or a deeper seabed; land is for "
            "surveyed grids.",
        )  # fmt: skip


def _in_reach(scenario: Scenario, place: Floats) -> tuple[Floats, float]:
    """Depths of the ground at places spread evenly over what is in reach of a track, and how far that is [m]."""
    bed = scenario.settled_seabed.bed
    assert bed is not None
    farthest = scenario.water.fastest * scenario.track.window[1] / 2
    tried = place[np.linspace(0, len(place) - 1, min(_PINGS, len(place))).astype(int)]
    # evenly over the area of a disc
    distance = farthest * np.sqrt((np.arange(_DISTANCES) + 0.5) / _DISTANCES)
    bearing = 2 * np.pi * np.arange(_BEARINGS) / _BEARINGS
    north = tried[:, 0, None, None] + distance[:, None] * np.cos(bearing)
    east = tried[:, 1, None, None] + distance[:, None] * np.sin(bearing)
    return bed.depth_at(north, east), farthest


def unknown_ground(scenario: Scenario, place: Floats) -> str:
    """A word on a survey that ends within reach of the sonar; empty where it does not.

    Args:
        scenario: The scenario.
        place: North, east, depth of the platform at all pings [m], shape (pings, 3).
    """
    grid = scenario.seabed.grid
    bed = None if grid is None else scenario.settled_seabed.bed
    if bed is None or grid is None:
        return ""
    depth, farthest = _in_reach(scenario, place)
    share = float(np.isnan(depth).mean())
    if share <= MOST_UNKNOWN:
        return ""
    return (
        f"seabed.relief: {100 * share:.0f} % of the ground within {farthest:.0f} m of the track is not in the survey "
        f"({grid.told}); it neither scatters nor casts shadows. Shorten the window, or move the track."
    )
