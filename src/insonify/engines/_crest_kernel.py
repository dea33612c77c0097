"""Crests of the ground along lines, and what bends around them. Plain numbers and arrays only.

A crest is ground behind which ground lies hidden. It acts as a knife edge, in the measure in which its shadow is a
shadow at all: a hollow that is shallow against a Fresnel zone is filled by diffraction, and its rim dims nothing.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from insonify.propagation._knife_edge_kernel import ENDLESS, edge_factor

Floats = NDArray[np.floating[Any]]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
Rows = NDArray[np.int32]

CRESTS = 4
"""Crests that are looked at before a point: the nearest ones that stand out."""

FAINT = 1e-3
"""Crests that change the pressure by less take nothing: 60 dB below what passes them [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def find_crests(launch: Floats, step: float, rising: bool, bound: Floats, crest: Rows, met: Floats) -> None:
    """Skylines, and crests along them: where a skyline stops sinking, and how deep the hollow behind each is.

    Args:
        launch: Launch that meets the ground at each sample, (s, n); where none does, one that hides nothing is set.
        step: Distance of samples [m].
        rising: Whether rays rise from a bounce: then lines are walked inwards, and what lies above hides.
        bound: Result, smallest launch up to each sample; of rays that rise, the largest from it on, (s, n).
        crest: Result, number of the crest met last up to each sample, -1 for none, (s, n).
        met: Result, for each crest in the order of the walk: its sample, its launch, and the most by which ground
            behind lies below the ray over it [m], (s, n // 2 + 1, 3).
    """
    count, sense = launch.shape[1], -1.0 if rising else 1.0
    for s in range(launch.shape[0]):
        lowest, at, last, dark, deep = np.inf, -1, -1, False, 0.0
        for j in range(count):
            k = count - 1 - j if rising else j
            value = sense * launch[s, k]
            if not math.isfinite(value):
                launch[s, k] = sense * np.inf
            else:
                if value <= lowest:
                    lowest, at, dark = value, k, False
                else:
                    if not dark:
                        last, deep, dark = last + 1, 0.0, True
                        met[s, last, 0], met[s, last, 1] = at, launch[s, at]
                    deep = max(deep, (value - lowest) * (k + 1) * step)
                    met[s, last, 2] = deep
            bound[s, k], crest[s, k] = sense * lowest, last


@njit(cache=True, nogil=True, error_model="numpy")
def over_crests(
    launch: Floats, lowest: Floats, crest: Rows, met: Floats, rows: Integers, points: Integers, reach: Floats,
    steepness: Floats, ground: bool, step: float, distance: Floats, wavelength: float, table: Complexes,
    per_unit: float, left: Complexes,
) -> None:  # fmt: skip
    """Multiply what crests leave of rays that pass over the ground of a line into `left`.

    Args:
        launch: Launch that meets the ground at each sample, (s, n).
        lowest: Smallest up to each sample, (s, n).
        crest: Of `find_crests`, (s, n).
        met: Likewise, (s, crests, 3).
        rows: Line of each point, (points,).
        points: Which points, (points,).
        reach: Distance in steps up to which the ground can cut, (all,).
        steepness: Of the rays, (all,).
        ground: Whether the points lie on the ground of the line, at `reach`: then the rays are those to it.
        step: Distance of samples [m].
        distance: Horizontal length of the whole leg [m], (all,).
        wavelength: Of the sound [m].
        table: See `insonify.propagation._knife_edge_kernel.past_edge`.
        per_unit: Likewise.
        left: Result [1], (all,).
    """
    last = launch.shape[1] - 2
    for m in range(points.size):
        n, s = points[m], rows[m]
        k = min(math.floor(reach[n]) - 1, last)
        if k < 0:
            continue
        way, at = float(steepness[n]), crest[s, k]
        if ground:
            way = launch[s, k] + min(reach[n] - (k + 1), 1.0) * (launch[s, k + 1] - launch[s, k])
        alone = -1
        if way > lowest[s, k]:
            if ground:
                at = crest[s, k + 1]
            elif launch[s, k] <= lowest[s, k]:
                alone = k  # it dips into ground that still rises
        left[n] *= least_left(launch[s], met[s], at, alone, 1.0, way, ENDLESS, step, distance[n],
                              wavelength, table, per_unit)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def under_crests(
    launch: Floats, crest: Rows, met: Floats, rows: Integers, points: Integers, start: Floats, stop: Floats,
    steepness: Floats, step: float, distance: Floats, wavelength: float, table: Complexes,
    per_unit: float, lit: NDArray[np.bool_], left: Complexes,
) -> None:  # fmt: skip
    """Multiply what crests leave of rays that rise from a bounce into `left`.

    Args:
        launch: As of `over_crests`.
        crest: As of `over_crests`.
        met: As of `over_crests`.
        rows: As of `over_crests`.
        points: As of `over_crests`.
        start: Distance in steps from which the ray is looked at, (all,).
        stop: Distance at which it ends, (all,).
        steepness: As of `over_crests`.
        step: As of `over_crests`.
        distance: As of `over_crests`.
        wavelength: As of `over_crests`.
        table: As of `over_crests`.
        per_unit: As of `over_crests`.
        lit: Whether this segment of each ray clears the ground, (all,).
        left: Result [1], (all,).
    """
    for m in range(points.size):
        n, s = points[m], rows[m]
        first, end = max(math.ceil(start[n]) - 1, 0), min(math.floor(stop[n]), launch.shape[1])
        if first >= end:
            continue
        way, alone = float(steepness[n]), -1
        if not lit[n] and launch[s, first] > way:
            alone = first  # it rises out of the ground itself
        left[n] *= least_left(launch[s], met[s], crest[s, first], alone, -1.0, way, float(end), step,
                              distance[n], wavelength, table, per_unit)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def least_left(
    launch: Floats, met: Floats, last: int, alone: int, sense: float, way: float, end: float, step: float,
    distance: float, wavelength: float, table: Complexes, per_unit: float,
) -> complex:  # fmt: skip
    """What the crest that takes most leaves of one ray [1].

    Args:
        launch: Launch that meets the ground of the ray's line at each sample, (n,).
        met: Of `find_crests`, (crests, 3).
        last: Number of the first crest to look at, -1 for none.
        alone: Sample of ground that cuts without being a crest, -1 for none.
        sense: 1 for rays that come down on the ground, -1 for those that rise.
        way: Launch of the ray.
        end: Sample from which on nothing cuts.
        step: Distance of samples [m].
        distance: Horizontal length of the whole leg [m].
        wavelength: Of the sound [m].
        table: See `over_crests`.
        per_unit: Likewise.
    """
    stretch, least = math.sqrt(1 + way * way), 1 + 0j
    length = distance * stretch
    if alone >= 0:
        near = (alone + 1) * step
        high = sense * (way - launch[alone]) * near / stretch
        least = edge_factor(high, ENDLESS, length - near * stretch, length, wavelength, table, per_unit)
    for number in range(last, max(last - CRESTS, -1), -1):
        at, edge, rise = float(met[number, 0]), float(met[number, 1]), float(met[number, 2])
        if at >= end:
            break
        near = (at + 1) * step
        high = sense * (way - edge) * near / stretch
        left = edge_factor(high, rise / stretch, length - near * stretch, length, wavelength, table, per_unit,
                           max(FAINT, abs(1 - least)))  # fmt: skip
        if abs(1 - left) > abs(1 - least):
            least = left
    return least
