"""A swath: all the ground that one ping hears, as lit points with a row for every family of legs.

Both ends of the sonar are at one place, so that legs out and back are the same. Unlike `records.pairs` it holds
neither reasons nor what cannot be heard: only what an expected intensity asks for.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Swath:
    """Points of the ground, n of them, and their legs by f families."""

    delay: NDArray[np.float64]
    """One-way travel time [s], shape (f, n)."""
    amplitude: NDArray[np.complex64]
    """Pressure at the point re 1 m from the source, without carrier; 0 where there is no path [1], shape (f, n)."""
    departure: NDArray[np.float32]
    """Unit vector of travel at the sonar, in the world, shape (f, 3, n)."""
    pair: NDArray[np.int64]
    """Rows of two legs, in either order, shape (p, 2); the first never comes after the second."""
    section: NDArray[np.floating[Any]]
    """Cross section of each pair times the area of the point, in either order [m^2], shape (p, n)."""
