"""Where the lines of one ping lie: on the ground's map, and beside targets."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from insonify.engines._ground_kernel import CELLS, pieces_on_lines
from insonify.engines.swath_plan import Plan
from insonify.propagation.knife_edge import ROUGH_RIPPLES
from insonify.scene.bed import Bed
from insonify.scene.ground_map import MOST_PIECES
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]


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


def window_of(
    bed: Bed | None, stance: Stance, plan: Plan, taken: NDArray[np.int64], farthest: float
) -> Window | None:  # fmt: skip
    """The window of one ping, or None where its lines cross more pieces than are kept.

    Args:
        bed: The ground; None for a flat bed.
        stance: The sonar at this ping.
        plan: The plan of its lines.
        taken: Which list of points each line has, see `chosen`.
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
    count = pieces_on_lines(
        *start, plan.lines, plan.step, plan.lists.samples, taken, bed.map_cell, mark, found
    )  # fmt: skip
    if count > MOST_PIECES:
        return None
    return Window(start, side, np.array(first), found[:count].copy())


def chosen(passing: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Which of a plan's lists of points each line has: its own, or if it passes a target that of all points.

    Args:
        passing: Whether it does, (s,).
    """
    return np.asarray(np.arange(len(passing)) + len(passing) * passing)


def lines_passing(plan: Plan, stance: Stance, heading: float, edges: str) -> NDArray[np.bool_]:
    """Which lines pass a target, or come so near that its soft edge is looked at, (s,).

    Args:
        plan: The plan of the lines.
        stance: The sonar at this ping.
        heading: Of the frame of the lines [rad].
        edges: Whether edges are hard or soft.
    """
    cut = np.zeros(len(plan.lines), bool)
    if not len(plan.rims):
        return cut
    bearing, place = np.arctan2(plan.lines[:, 1], plan.lines[:, 0]) + heading, stance.transmit_place
    for north, east, radius in plan.rims.tolist():
        apart, towards = math.hypot(north - place[0], east - place[1]), math.atan2(east - place[1], north - place[0])
        off = np.abs(np.mod(bearing - towards + np.pi, 2 * np.pi) - np.pi)
        half = math.asin(min(1.0, radius / max(apart, 1e-9))) + _rippled(apart, stance.wavelength, edges)
        cut |= (apart <= radius) | (off <= half)
    return cut


def _rippled(apart: float, wavelength: float, edges: str) -> float:
    """Bearing beside a target's rim up to which its soft edge is looked at [rad]."""
    if edges == "hard":
        return 0.0
    return ROUGH_RIPPLES * math.sqrt(wavelength / (2 * max(apart, wavelength)))
