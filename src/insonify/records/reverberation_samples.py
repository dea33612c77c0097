"""A swath: all the ground that one ping hears, as lit points with a row for every family of legs.

Both ends of the sonar are at one place, so that legs out and back are the same. Unlike `records.pairs` it holds
neither reasons nor what cannot be heard: only what an expected intensity asks for. Nor has every pair of legs all the
points: what is faint is asked at some of them, that stand for the rest.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Origins:
    """Places of n points of a swath, and direct legs that something cuts, m of them: what labels ask for besides."""

    families: tuple[str, ...]
    """Name of each row of legs."""
    position: NDArray[np.float64]
    """North, east, depth of each point [m], shape (3, n)."""
    grazing: NDArray[np.float32]
    """Grazing angle of each leg at its point [rad], shape (f, n)."""
    direct: int
    """Row of the direct legs."""
    straight: int
    """Row in `Swath.pair` of the direct leg out and back; -1 where there is none."""
    cut: NDArray[np.int64]
    """Which of the points in its row of `Swath.rows` have a direct leg that is cut, shape (m,)."""
    free: NDArray[np.complex64]
    """Amplitude of these legs as if nothing cut them [1], shape (m,)."""
    lost: NDArray[np.float64]
    """Part of the energy out and back that is taken away [1], shape (m,)."""
    occluder_row: NDArray[np.int16]
    """What cuts each: row among the scene's occluders, or `SEABED`, shape (m,)."""


@dataclass(frozen=True, slots=True)
class ReverberationSamples:
    """Points of the ground, n of them, and their legs by f families."""

    delay: NDArray[np.float64]
    """One-way travel time [s], shape (f, n)."""
    amplitude: NDArray[np.complex64]
    """Pressure at the point re 1 m from the source, without carrier; 0 where there is no path [1], shape (f, n)."""
    departure: NDArray[np.float32]
    """Unit vector of travel at the sonar, in the world, shape (f, 3, n)."""
    pair: NDArray[np.int64]
    """Rows of two legs, in either order, shape (p, 2); the first never comes after the second."""
    count: NDArray[np.int64]
    """Points that each pair is heard from, shape (p,)."""
    rows: NDArray[np.int32]
    """Which they are, increasing; so many in each row count, shape (p, any)."""
    cross_section: NDArray[np.floating[Any]]
    """Cross section of each pair times the area that such a point stands for, in either order [m^2], likewise."""
    interference_ranges: NDArray[np.int64]
    """First point and after the last of ranges where pairs may arrive together and interfere, shape (any, 2).

    Pairs that do have the same points there.
    """
    origins: Origins | None = None
    """Where the points lie, and what is cut; None where nobody labels them."""
