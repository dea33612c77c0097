"""Errors of a hull that is not in the water, or has the sonar inside it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from pydantic_core import PydanticCustomError

from insonify.model import field_error
from insonify.scenario.platform_poses import platforms

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

ROUNDING = 1e-6
"""Height of an array above the underside that is still at its depth [m]."""


def hull_errors(scenario: Scenario, array_positions: dict[str, NDArray[np.float64]]) -> Iterator[PydanticCustomError]:
    """Errors of `sonar.hull`: out of the water at some ping, above an array, or of one of two platforms.

    Args:
        scenario: The scenario.
        array_positions: Positions of the arrays at every ping, see `track_errors.array_positions`.
    """
    hull = scenario.sonar.hull
    if hull is None:
        return
    if scenario.receiver_track is not None:
        yield field_error("sonar.hull", None, "reflects sound between two ends under it, and receiver_track puts the "
                          "receiver on another platform. Leave one of the two out.")  # fmt: skip
        return
    depth = platforms(scenario).transmitter_poses.offset_positions(hull.offset)[:, 2]
    high, low = float(depth.min()), float(depth.max())
    if high <= 0 or low >= scenario.seabed.depth:
        where = "at or above the sea surface" if high <= 0 else f"at or below the seabed ({scenario.seabed.depth:g} m)"
        yield field_error("sonar.hull.offset", None, f"puts the underside {where} at some ping. Give the third number "
                          "(down) such that it stays in the water, or move the track.")  # fmt: skip
        return
    inside = {
        name: float((depth - position[:, 2]).max())
        for name, position in array_positions.items() if name.endswith("array")
    }  # fmt: skip
    name = max(inside, key=inside.__getitem__, default=None)
    if name is not None and inside[name] > ROUNDING:
        yield field_error("sonar.hull.offset", None, f"puts the underside {inside[name]:.3g} m below {name}, which "
                          "would be inside the hull. Give a smaller third number (down), or mount the array lower."
                          )  # fmt: skip
