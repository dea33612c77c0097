"""Where the lines of one ping lie: on the ground's map, and beside targets."""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._ground_kernel import CELLS, pieces_on_lines
from insonify.engines._points_kernel import Points
from insonify.engines.swath_plan import Plan
from insonify.propagation.knife_edge import ROUGH_RIPPLES
from insonify.scene.bed import Bed
from insonify.scene.ground_map import MOST_PIECES
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]


class Listed(NamedTuple):
    """Lines of one ping with their points."""

    lines: Floats
    """As of `_swath_kernel.walk`, (m, 9)."""
    lists: Points
    """Lists of points."""
    taken: NDArray[np.int64]
    """Row in `lists` of each line, (m,)."""
    passing: NDArray[np.bool_]
    """Lines that may pass a target, (m,)."""


@dataclass(frozen=True, slots=True)
class Window:
    """The stretch of the ground's map that the lines of one ping may cross."""

    start: tuple[float, float] = (0.0, 0.0)
    """Where the lines start, along its axes from the first node of the window [m]."""
    side: int = 1
    """Pieces along each side of the window."""
    corner: NDArray[np.int64] = field(default_factory=lambda: np.zeros(2, np.int64))
    """Numbers of its first piece."""
    crossed: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    """Numbers in the window of the pieces that the lines cross, (n, 2)."""


def window_of(bed: Bed | None, stance: Stance, step: float, parts: list[Listed], farthest: float) -> Window | None:
    """The window of one ping, or None where its lines cross more pieces than are kept.

    Args:
        bed: The ground; None for a flat bed.
        stance: The sonar at this ping.
        step: Distance of samples along the lines [m].
        parts: All its lines with their points.
        farthest: Distance that is heard [m].
    """
    if bed is None:
        return Window()
    lattice, piece = bed.ground.terrain.lattice, bed.map_cell * CELLS
    own = lattice.from_world(stance.transmit_place[:2]).tolist()
    reach = math.ceil(farthest / piece) + 1
    first = [math.floor(place / piece) - reach for place in own]
    start = own[0] - first[0] * piece, own[1] - first[1] * piece
    side = 2 * reach + 1
    mark, found = np.zeros((side, side), np.int8), np.empty((MOST_PIECES + 1, 2), np.int64)
    crossed = np.zeros((side, side), bool)
    for part in parts:
        count = pieces_on_lines(
            *start, part.lines, step, part.lists.samples, part.taken, bed.map_cell, mark, found
        )  # fmt: skip
        crossed[tuple(found[:count].T)] = True
    pieces = np.argwhere(crossed)
    return None if len(pieces) > MOST_PIECES else Window(start, side, np.array(first), pieces)


def lines_passing(plan: Plan, stance: Stance, heading: float, edges: str) -> NDArray[np.bool_]:
    """Lines that pass each target, or come so near that its soft edge is looked at, (t, s).

    Args:
        plan: The plan of the lines.
        stance: The sonar at this ping.
        heading: Heading of the frame of the lines [rad].
        edges: Hard or soft edges.
    """
    passed = np.zeros((len(plan.rims), len(plan.lines)), bool)
    if not len(plan.rims):
        return passed
    bearing, place = np.arctan2(plan.lines[:, 1], plan.lines[:, 0]) + heading, stance.transmit_place
    for t, (north, east, radius) in enumerate(plan.rims[:, :3].tolist()):
        apart, towards = math.hypot(north - place[0], east - place[1]), math.atan2(east - place[1], north - place[0])
        off = np.abs(np.mod(bearing - towards + np.pi, 2 * np.pi) - np.pi) - plan.lines[:, 2] / 2
        half = math.asin(min(1.0, radius / max(apart, 1e-9))) + _rippled(apart, stance.wavelength, edges)
        passed[t] = (apart <= radius) | (off <= half)
    return passed


def _rippled(apart: float, wavelength: float, edges: str) -> float:
    """Bearing beside a target's rim up to which its soft edge is looked at [rad]."""
    if edges == "hard":
        return 0.0
    return ROUGH_RIPPLES * math.sqrt(wavelength / (2 * max(apart, wavelength)))
