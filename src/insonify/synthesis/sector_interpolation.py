"""A narrow sector of directions, from which a few places along an array tell what all its elements hear.

An echo's phase along the array is the sum of a turn, which its direction gives, and a bow, which its distance gives.
Echoes that come at one time have one bow but for a little. What is left of a phase that turns by no more than some
radians each way is a function of so narrow a band that its values at a few places tell it everywhere: they are laid
down there only. Weights are those that do so with the least error for waves from all the sector: a least-squares fit,
which takes about a quarter fewer places than polynomials would.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.synthesis._element_arrivals_kernel import ArraySector
from insonify.synthesis._sector_interpolation_kernel import interpolate_to_elements
from insonify.synthesis.chebyshev_nodes import straight_array
from insonify.synthesis.time_grid import TimeGrid

Floats = NDArray[np.float64]
PLACES = 16
"""Along the array [1]."""
TURN = 8.0
"""Phase from an array's middle to its end by which echoes of a sector may be turned [rad]."""
LEFT = 0.3
"""By how much their bow there may differ from that of others of their delay [rad]."""
FEWEST = 24
"""Elements below which places would save too little [1]."""
NONE = ArraySector(0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class SectorInterpolation:
    """The sector of an array."""

    sector: ArraySector
    point_position: Floats
    """Of the places along the array, -1..1, shape (p,)."""
    element_position: Floats
    """Of its elements, shape (m,)."""
    weights: NDArray[np.float32]
    """What each place counts for at each element, shape (m, p)."""

    def to_elements(self, cells: NDArray[np.complex64], grid: TimeGrid, pulse_middle: float) -> NDArray[np.complex64]:
        """Cells of the elements, with what the places heard; the places have heard nothing then.

        Args:
            cells: Of elements and places, shape (bands, m + p, groups, cells, shapes of a group).
            grid: The grid they belong to.
            pulse_middle: Time from the pulse's start to its middle, for an array under way [s].
        """
        for band in cells:
            interpolate_to_elements(
                band,
                grid.first_time + pulse_middle,
                grid.cell_rate,
                self.sector.curvature_phase,
                self.point_position,
                self.element_position,
                self.weights,
            )
        return cells[:, : len(self.element_position)]


def sector_interpolation(
    element_position: Floats, velocity: Floats, acceleration: Floats, grid: TimeGrid, frequency: float, speed: float
) -> SectorInterpolation | None:
    """The sector of an array of like elements; none where it is not straight, or has few elements.

    Args:
        element_position: As of `aperture_nodes`.
        velocity: Likewise.
        acceleration: Likewise.
        grid: Times wanted.
        frequency: Of the carrier [Hz].
        speed: Of sound at the array [m/s].
    """
    along = None
    if len(element_position) >= FEWEST:
        along = straight_array(
            element_position, velocity, acceleration, grid.start + grid.sample_count / grid.sample_rate
        )
    if along is None:
        return None
    element, ends = along
    half = float(np.linalg.norm(ends[1, :3]))
    highest = frequency + grid.sample_rate / 2  # of the band that is heard
    sector = ArraySector(
        PLACES,
        TURN / (2 * math.pi * highest),
        2 * math.pi * frequency * (half / speed) ** 2,
        LEFT * frequency / highest,
    )
    node = np.cos((np.arange(PLACES) + 0.5) * math.pi / PLACES)
    return SectorInterpolation(sector, node, element, _weights(tuple(element)))


@lru_cache(maxsize=16)
def _weights(element: tuple[float, ...]) -> NDArray[np.float32]:
    """What each place counts for at elements, fitted to waves of all turns and bows of the sector, shape (m, p)."""
    turn, bow = (part.ravel() for part in np.meshgrid(np.linspace(0, TURN, 60), np.linspace(-LEFT, LEFT, 5)))

    def waves(x: Floats) -> Floats:
        phase = x[:, None] * turn + x[:, None] ** 2 * bow
        return np.concatenate([np.cos(phase), np.sin(phase)], axis=1)

    node = np.cos((np.arange(PLACES) + 0.5) * math.pi / PLACES)
    fitted = np.linalg.lstsq(waves(node).T, waves(np.array(element)).T, rcond=1e-9)[0].T
    return np.ascontiguousarray(fitted, np.float32)
