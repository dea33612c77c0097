"""Arrivals from a narrow sector, deposited at a few points along an array and interpolated to its elements.

An echo's phase along the array is linear (by its direction) plus curved (by its distance).
Echoes of one delay have nearly the same curvature. A remaining phase of at most a few radians
each path is band-limited along the array, so that its values at a few points determine it everywhere: only these are
deposited. The interpolation weights minimise the error for waves of the whole sector: a least-squares fit,
which takes about a quarter fewer points than polynomials would.
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
POINT_COUNT = 16
"""Number of interpolation points along the array [1]."""
MAX_LINEAR_PHASE = 8.0
"""Largest linear phase of echoes of a sector, from the array's middle to its end [rad]."""
MAX_RESIDUAL_PHASE = 0.3
"""Largest deviation of the curved phase at the array's end from that of echoes of the same delay [rad]."""
MIN_ELEMENTS = 24
"""Least number of elements for which interpolation is faster [1]."""
NO_SECTOR = ArraySector(0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class SectorInterpolation:
    """Sector of an array, with its interpolation points."""

    sector: ArraySector
    point_position: Floats
    """Interpolation points along the array, -1..1, shape (p,)."""
    element_position: Floats
    """Positions of the elements along the array, -1..1, shape (m,)."""
    weights: NDArray[np.float32]
    """Weight of each point at each element, shape (m, p)."""

    def to_elements(self, cells: NDArray[np.complex64], grid: TimeGrid, pulse_middle: float) -> NDArray[np.complex64]:
        """Add the cells of the interpolation points to those of the elements, and clear the former.

        Args:
            cells: Cells of elements and points, shape (bands, m + p, groups, cells, waveforms of a group).
            grid: Time grid of the cells.
            pulse_middle: Time from the pulse's start to its middle, for a moving array [s].
        """
        for band in cells:
            interpolate_to_elements(
                band, grid.first_time + pulse_middle, grid.cell_rate, self.sector.curvature_phase, self.point_position,
                self.element_position, self.weights,
            )  # fmt: skip
        return cells[:, : len(self.element_position)]


def sector_interpolation(
    element_position: Floats, velocity: Floats, acceleration: Floats, grid: TimeGrid, frequency: float, speed: float
) -> SectorInterpolation | None:
    """Sector interpolation of an array of equal elements; None for a curved array or few elements.

    Args:
        element_position: Element positions from the array's centre [m], shape (m, 3).
        velocity: Element velocities [m/s], shape (m, 3).
        acceleration: Element accelerations [m/s^2], shape (m, 3).
        grid: Time grid.
        frequency: Carrier frequency [Hz].
        speed: Sound speed at the array [m/s].
    """
    along = None
    if len(element_position) >= MIN_ELEMENTS:
        along = straight_array(
            element_position, velocity, acceleration, grid.start + grid.sample_count / grid.sample_rate
        )
    if along is None:
        return None
    element, ends = along
    half = float(np.linalg.norm(ends[1, :3]))
    highest = frequency + grid.sample_rate / 2  # of the recorded band
    sector = ArraySector(
        POINT_COUNT,
        MAX_LINEAR_PHASE / (2 * math.pi * highest),
        2 * math.pi * frequency * (half / speed) ** 2,
        MAX_RESIDUAL_PHASE * frequency / highest,
    )
    node = np.cos((np.arange(POINT_COUNT) + 0.5) * math.pi / POINT_COUNT)
    return SectorInterpolation(sector, node, element, _weights(tuple(element)))


@lru_cache(maxsize=16)
def _weights(element: tuple[float, ...]) -> NDArray[np.float32]:
    """Weight of each point at elements, fitted to waves of all linear and curved phases of the sector, shape (m, p)."""
    linear, quadratic = (
        part.ravel()
        for part in np.meshgrid(
            np.linspace(0, MAX_LINEAR_PHASE, 60), np.linspace(-MAX_RESIDUAL_PHASE, MAX_RESIDUAL_PHASE, 5)
        )
    )

    def waves(x: Floats) -> Floats:
        phase = x[:, None] * linear + x[:, None] ** 2 * quadratic
        return np.concatenate([np.cos(phase), np.sin(phase)], axis=1)

    node = np.cos((np.arange(POINT_COUNT) + 0.5) * math.pi / POINT_COUNT)
    fitted = np.linalg.lstsq(waves(node).T, waves(np.array(element)).T, rcond=1e-9)[0].T
    return np.ascontiguousarray(fitted, np.float32)
