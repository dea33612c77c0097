"""Arrivals from a narrow sector, received at a few points along an array and interpolated to its elements.

An echo's phase along the array is linear (by its direction) plus curved (by its distance).
Echoes of one delay have nearly the same curvature. Without it, a phase of at most a few radians remains; each path is
band-limited along the array, so that its values at a few points determine it everywhere: only these are
deposited. Their time series are interpolated, after convolution with the pulse: the curvature removed from a sample is
that of its own time, within half a pulse of the echo's. The interpolation weights minimise the error for waves of the
whole sector: a least-squares fit, which takes about a quarter fewer points than polynomials would.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.synthesis._element_arrivals_kernel import ArraySector, SectorLimits
from insonify.synthesis._sector_interpolation_kernel import interpolate_to_elements
from insonify.synthesis._waveform_basis_kernel import BasisWeights
from insonify.synthesis.chebyshev_nodes import straight_array
from insonify.synthesis.time_grid import TimeGrid

Floats = NDArray[np.float64]
POINT_COUNT = 16
"""Number of interpolation points along the array [1]."""
MAX_LINEAR_PHASE = 8.0
"""Largest linear phase of echoes of a sector, from the array's middle to its end [rad]."""
MAX_RESIDUAL_PHASE = 0.3
"""Largest deviation of the curved phase at the array's end from that of echoes of the same delay [rad]."""
MAX_CURVATURE_PHASE = 8.0
"""Largest curved phase of echoes of a sector at the array's end [rad]."""
MIN_ELEMENTS = 24
"""Least number of elements for which interpolation is faster [1]."""
_NOTHING = np.empty(0, np.float32)
NO_SECTOR = ArraySector(
    SectorLimits(0.0, 0.0, 0.0, 0.0, 1.0), BasisWeights(0.0, 0.0, _NOTHING, _NOTHING, np.empty((0, 8), np.float32))
)


@dataclass(frozen=True, slots=True)
class SectorInterpolation:
    """Sector of an array, with its interpolation points."""

    limits: SectorLimits
    axis: Floats
    """Unit vector along the array in the world, shape (3,)."""
    max_cosine: float
    """Largest magnitude of the cosine between `axis` and the directions of the sector [1]."""
    point_position: Floats
    """Interpolation points along the array, -1..1, shape (p,)."""
    element_position: Floats
    """Positions of the elements along the array, -1..1, shape (m,)."""
    weights: NDArray[np.float32]
    """Weight of each point at each element [1], shape (m, p)."""
    first_delay: float
    """Delay of the echoes whose pulse has its middle in the first sample [s]."""
    sample_rate: float
    """Samples per second [Hz]."""

    def add_to_elements(self, points: NDArray[np.complex64], elements: NDArray[np.complex64]) -> None:
        """Add the time series at the interpolation points to those of the elements.

        Args:
            points: Time series at the points [uPa], shape (p, samples).
            elements: Time series of the elements [uPa], added to in place, shape (m, samples).
        """
        interpolate_to_elements(
            points, elements, self.first_delay, self.sample_rate, self.limits, self.point_position,
            self.element_position, self.weights,
        )  # fmt: skip


def sector_interpolation(
    element_position: Floats, velocity: Floats, acceleration: Floats, grid: TimeGrid, frequency: float, speed: float,
    pulse: tuple[float, float],
) -> SectorInterpolation | None:  # fmt: skip
    """Sector interpolation of an array of equal elements; None for a curved array or few elements.

    Args:
        element_position: Element positions from the array's centre [m], shape (m, 3).
        velocity: Element velocities [m/s], shape (m, 3).
        acceleration: Element accelerations [m/s^2], shape (m, 3).
        grid: Time grid.
        frequency: Carrier frequency [Hz].
        speed: Sound speed at the array [m/s].
        pulse: Start and end of an echo's received pulse re its delay, which is that of the pulse's middle where the
            array moves [s].
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
    curvature_phase, half_pulse = 2 * math.pi * frequency * (half / speed) ** 2, (pulse[1] - pulse[0]) / 2
    limits = SectorLimits(
        MAX_LINEAR_PHASE / (2 * math.pi * highest),
        curvature_phase,
        MAX_RESIDUAL_PHASE * frequency / highest,
        half_pulse,
        max(curvature_phase / MAX_CURVATURE_PHASE, 2 * half_pulse),
    )
    node = np.cos((np.arange(POINT_COUNT) + 0.5) * math.pi / POINT_COUNT)
    first_delay = grid.start - (pulse[0] + pulse[1]) / 2
    return SectorInterpolation(
        limits, ends[1, :3] / half, limits.max_delay_slope * speed / half, node, element, _weights(tuple(element)),
        first_delay, grid.sample_rate,
    )  # fmt: skip


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
