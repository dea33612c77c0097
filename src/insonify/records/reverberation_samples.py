"""Reverberation samples: points of the seabed in view of one ping, with a row of legs for every family.

Both ends of the sonar are at one position, so transmit and receive legs are the same. Unlike `records.pairs`, only the
columns that an expected intensity needs are held: no reasons for missing legs, no points outside window and beams.
Weak pairs of legs are evaluated at a subset of the points, which stands for the rest.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Origins:
    """Positions of n reverberation samples and their m occluded direct legs: further columns that labels need."""

    families: tuple[str, ...]
    """Name of each row of legs."""
    positions: Callable[[], tuple[NDArray[np.float64], NDArray[np.float32]]]
    """Function that evaluates north, east, depth of each point [m], shape (3, n), and the grazing angle of each leg
    at its point [rad], shape (f, n)."""
    direct: int
    """Row of the direct legs."""
    direct_pair: int
    """Row in `ReverberationSamples.pair` of the direct path, transmit and receive; -1 where there is none."""
    occluded: NDArray[np.int64]
    """Indices in row `direct_pair` of `ReverberationSamples.rows` of points with an occluded direct leg, shape (m,)."""
    unoccluded_amplitude: NDArray[np.complex64]
    """Amplitude of these legs without occlusion, as `ReverberationSamples.amplitude` [1], shape (m,)."""
    occluded_fraction: NDArray[np.float64]
    """Fraction of the two-way energy that is occluded [1], shape (m,)."""
    occluder_row: NDArray[np.int16]
    """Occluder of each: row among the scene's occluders, or `SEABED_OCCLUDER`, shape (m,)."""


@dataclass(frozen=True, slots=True)
class ReverberationSamples:
    """Points of the seabed, n of them, and their legs by f families."""

    delay: NDArray[np.float64]
    """One-way travel time [s], shape (f, n)."""
    amplitude: NDArray[np.complex64]
    """Pressure at the point re 1 m from the source, without carrier; 0 where there is no path [1], shape (f, n)."""
    departure: NDArray[np.float32]
    """Unit vector of travel at the sonar, in the world, shape (f, 3, n)."""
    pair: NDArray[np.int64]
    """Rows of two legs, in either order, shape (p, 2); the first never comes after the second."""
    count: NDArray[np.int64]
    """Number of points at which each pair is evaluated, shape (p,)."""
    rows: NDArray[np.int32]
    """Indices of these points, increasing; the first `count` of each row are used, shape (p, any)."""
    cross_section: NDArray[np.floating[Any]]
    """Cross section of each pair, in either order, times the area that such a point stands for [m^2], shape (p,
    any)."""
    interference_ranges: NDArray[np.int64]
    """First and one past the last point of ranges where pairs may arrive together and interfere, shape (any, 2).

    Pairs that interfere have the same points in these ranges.
    """
    origins: Origins | None = None
    """Positions and occlusion of the points; None where no labels are computed."""
