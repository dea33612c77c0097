"""Whether a track stays in the water, at every ping and with every array that it carries."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.noun import located
from insonify.scenario.carried import platforms

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

Floats = NDArray[np.float64]
PLATFORM = "the platform"
RECEIVER = "the receiver's platform"
WRITTEN = {"static": "position", "line": "start", "waypoints": "waypoints", "navigation": "file"}
"""The key of each kind of track that says how deep it runs."""
ENDS = ("transmit", "receive")


def places(scenario: Scenario) -> dict[str, Floats]:
    """Where each platform and its arrays are at every ping: north, east, depth [m], each of shape (pings, 3).

    Args:
        scenario: The scenario.
    """
    carried = platforms(scenario)
    found = {PLATFORM: carried.sending.position}
    if carried.two:
        found[RECEIVER] = carried.hearing.position
    for side, sonar in zip(scenario.sonar.sides or ("",), scenario.sonar.one_sided, strict=True):
        for end, array, carrier in zip(ENDS, (sonar.transmit, sonar.receive), carried.carriers, strict=True):
            name = " ".join(["the", *([side] if side else []), end, "array"])
            found[name] = carrier.carried(array.offset)
    return found


def out_of_the_water(scenario: Scenario, found: dict[str, Floats]) -> Iterator[PydanticCustomError]:
    """The first array that leaves the water, and where.

    Args:
        scenario: The scenario.
        found: Its `places`.
    """
    if RECEIVER not in found:
        arrays = {name: place for name, place in found.items() if name != PLATFORM}
        yield from _out_of_the_water(scenario, "track", found[PLATFORM], arrays)
        return
    for key, track, end in (("track", PLATFORM, "transmit"), ("receiver_track", RECEIVER, "receive")):
        arrays = {name: place for name, place in found.items() if name.endswith(f"{end} array")}
        yield from _out_of_the_water(scenario, key, found[track], arrays)


def _out_of_the_water(
    scenario: Scenario, key: str, platform: Floats, arrays: dict[str, Floats]
) -> Iterator[PydanticCustomError]:
    """The first of one platform's arrays that leaves the water."""
    depths = {name: place[:, 2] for name, place in arrays.items()}
    for name, lies in depths.items():
        floor = floor_under(scenario, arrays[name])
        wrong = np.flatnonzero((lies <= 0) | (lies >= floor))
        if wrong.size:
            depth, bed = float(lies[wrong[0]]), float(floor[wrong[0]])
            side = "at or above the sea surface (0 m)" if depth <= 0 else f"at or below the seabed ({bed:.6g} m)"
            path = f"{key}.{WRITTEN[getattr(scenario, key).kind]}"
            everywhere = np.ptp(list(depths.values()), axis=1).max() == 0 and np.ptp(floor) == 0
            advise = _level_advice if everywhere else _advice
            yield advise(path, platform[:, 2], depths, f"puts {name} {side}, at {depth:.6g} m", wrong, bed)
            return  # the other arrays hang on the same depth


def floor_under(scenario: Scenario, place: Floats) -> Floats:
    """Depth of the seabed under some places [m], shape (n,).

    Args:
        scenario: The scenario.
        place: North, east, depth [m], shape (n, 3).
    """
    bed = scenario.settled_seabed.bed
    if bed is None:
        return np.full(len(place), scenario.seabed.depth)
    return bed.depth_at(place[:, 0], place[:, 1])


def _level_advice(
    path: str, platform: Floats, depths: dict[str, Floats], what: str, wrong: NDArray[np.int64], bed: float
) -> PydanticCustomError:
    """What to say of a track that is too deep or too shallow as a whole."""
    if bed <= 0:
        return located(
            path, None, f"{what}: the ground rises out of the water there. Move the track, or lower the ground."
        )
    depth, lies = float(platform[0]), [float(column[0]) for column in depths.values()]
    low, high = depth - min(lies), bed + depth - max(lies)
    index = ".2" if path.endswith(("position", "start")) else ""
    return located(
        f"{path}{index}", f"{depth:g} m", f"{what}. Depths are positive downwards; write a depth between {low:g} and "
        f"{high:g} m.",
    )  # fmt: skip


def _advice(
    path: str, platform: Floats, depths: dict[str, Floats], what: str, wrong: NDArray[np.int64], bed: float
) -> PydanticCustomError:
    """What to say of a track that leaves the water at some of its pings."""
    several = "" if wrong.size == 1 else f", the first of {wrong.size} such pings"
    if bed <= 0:
        return located(path, None, f"ping {wrong[0]}{several}, {what}: the ground rises out of the water there. Move "
                       "the track, or lower the ground.")  # fmt: skip
    lies = np.array(list(depths.values()))
    return located(
        path, None, f"ping {wrong[0]}{several}, {what}. Depths are positive downwards, and the platform's own runs "
        f"from {platform.min():.4g} to {platform.max():.4g} m; keep the arrays, now at {lies.min():.4g} to "
        f"{lies.max():.4g} m with all motion, between 0 and {bed:g} m.",
    )  # fmt: skip
