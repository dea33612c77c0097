"""Crests of the ground along lines, and what bends around them. Plain numbers and arrays only.

A crest is ground behind which ground lies hidden. It acts as a knife edge, in the measure in which its shadow is a
shadow at all: a hollow that is shallow against a Fresnel zone is filled by diffraction, and its rim dims nothing.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation._knife_edge_kernel import ENDLESS, differs_less, edge_factor

Floats = NDArray[np.floating[Any]]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
Rows = NDArray[np.int32]

CRESTS = 4
"""Crests that are looked at before a point: the nearest ones that stand out."""

FAINT = 1e-3
"""Crests that change the pressure by less take nothing: 60 dB below what passes them [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def find_crests(
    launch: Floats, distance: Floats, rising: bool, wavelength: float, bound: Floats, crest: Rows, met: Floats
) -> None:
    """Skylines, and crests along them: where a skyline stops sinking, and how deep the hollow behind each is.

    Args:
        launch: Launch that meets the ground at each sample, (s, n); where none does, one that hides nothing is set.
        distance: Of the samples, evenly from the first on [m], (n,).
        rising: Whether rays rise from a bounce: then lines are walked inwards, and what lies above hides.
        wavelength: Of the sound [m].
        bound: Result, smallest launch up to each sample; of rays that rise, the largest from it on, (s, n).
        crest: Result, number of the crest met last up to each sample, -1 for none, (s, n).
        met: Result, for each crest in the order of the walk: its sample, its launch, the most by which ground behind
            lies below the ray over it [m], and of `felt_until` [m], (s, n // 2 + 1, 4).
    """
    count, sense = launch.shape[1], np.float32(-1 if rising else 1)
    never = np.float32(np.inf)
    for s in range(launch.shape[0]):
        lowest, at, last, dark, deep = never, -1, -1, False, np.float32(0)
        for j in range(count):
            k = count - 1 - j if rising else j
            value = sense * launch[s, k]
            if not -never < value < never:
                launch[s, k] = sense * never
            elif value <= lowest:
                if dark:
                    met[s, last, 2], dark = deep, False
                lowest, at = value, k
            else:
                if not dark:
                    last, deep, dark = last + 1, np.float32(0), True
                    met[s, last, 0], met[s, last, 1] = at, sense * lowest
                deep = max(deep, (value - lowest) * distance[k])
            bound[s, k], crest[s, k] = sense * lowest, last
        if dark:
            met[s, last, 2] = deep
        for number in range(last + 1):
            near = float(distance[int(met[s, number, 0])])
            met[s, number, 3] = felt_until(near, float(met[s, number, 2]), wavelength)


@njit(cache=True, nogil=True, error_model="numpy")
def felt_until(near: float, hollow: float, wavelength: float) -> float:
    """Horizontal distance from which on a crest changes rays that clear it by less than `FAINT` [m].

    The hollow behind it is too shallow for the Fresnel zone, however near it a ray passes, see
    `_knife_edge_kernel.differs_less`.

    Args:
        near: Distance of the crest [m].
        hollow: Depth of the hollow [m].
        wavelength: Of the sound [m].
    """
    left = 0.999 * 2 * FAINT * wavelength / (2 * math.pi * max(hollow * hollow, 1e-30)) - 1 / near
    return near + max(1 / left, wavelength) if left > 0 else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def never_rises(depth: Floats, distance: Floats, image: np.float32, step: int) -> bool:
    """Whether rays that go straight from an image of the sonar surely meet farther ground less steeply: none is hidden.

    Args:
        depth: Depth of the ground at the samples [m], (s, n).
        distance: Of the samples [m], (n,).
        image: Depth of the image [m]; ground above it is not told about.
        step: Samples that are looked at before it is asked whether that was enough.
    """
    more = np.float32(1 + 1e-6)  # than what rounding can make of a product, or of a quotient
    for s in range(depth.shape[0]):
        for first in range(0, depth.shape[1] - 1, step):
            end = min(first + step, depth.shape[1] - 1)
            here, there = depth[s, first:end], depth[s, first + 1 : end + 1]
            near, far = distance[first:end], distance[first + 1 : end + 1]
            sinks = 0
            for k in range(near.size):  # no number where the ground is not known: nothing is told then
                low, high = here[k] - image, there[k] - image
                sinks += (high * near[k] * more <= low * far[k]) & (low > 0) & (high > 0)
            if sinks < near.size:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def over_crests(
    launch: Floats, lowest: Floats, crest: Rows, met: Floats, rows: Integers, points: Integers, reach: Floats,
    steepness: Floats, step: float, distance: Floats, wavelength: float, table: Complexes, per_unit: float,
    ground: bool, soft: bool, lit: NDArray[np.bool_], left: Complexes,
) -> None:  # fmt: skip
    """What crests leave of rays that pass over the ground of a line, and whether the ground itself is seen.

    Args:
        launch: Launch that meets the ground at each sample, (s, n).
        lowest: Smallest up to each sample, (s, n).
        crest: Of `find_crests`, (s, n).
        met: Likewise, (s, crests, 4).
        rows: Line of each point, (points,).
        points: Which points, (points,).
        reach: Distance [m] up to which the ground can cut, (all,).
        steepness: Of the rays; not read where they end on the ground, (all,).
        step: Distance of samples [m].
        distance: Horizontal length of the whole leg [m], (all,).
        wavelength: Of the sound [m].
        table: See `insonify.propagation._knife_edge_kernel.past_edge`.
        per_unit: Likewise.
        ground: Whether rays end on the ground of the lines: between samples it is as linear as the launches to it.
        soft: Whether sound bends around crests.
        lit: Result, False is written where the ground is hidden that rays end on, (all,).
        left: Result, multiplied, where edges are soft [1], (all,).
    """
    last, per_step = launch.shape[1] - 2, 1 / step
    for m in range(points.size):
        n, s = points[m], rows[m]
        steps = min(reach[n] * per_step, last + 2.0)
        k = min(int(steps) - 1, last)
        if k < 0:
            continue
        here, at, alone = launch[s, k], crest[s, k], -1
        if ground:
            way = float(here + min(steps - (k + 1), 1.0) * (launch[s, k + 1] - here))
            # the skyline is the ground itself, or the launch over the last crest
            if way > (here if at < 0 else min(here, met[s, at, 1])):
                lit[n], at = False, crest[s, k + 1]
        else:
            way = float(steepness[n])
            if way > lowest[s, k] and here <= lowest[s, k]:
                alone = k  # it dips into ground that still rises
        if soft and (at >= 0 or alone >= 0):
            left[n] *= least_left(launch, met, s, at, alone, 1.0, way, ENDLESS, step, distance[n], wavelength,
                                  table, per_unit)  # fmt: skip


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
        left[n] *= least_left(launch, met, s, crest[s, first], alone, -1.0, way, float(end), step,
                              distance[n], wavelength, table, per_unit)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def least_left(
    launch: Floats, met: Floats, s: int, last: int, alone: int, sense: float, way: float, end: float, step: float,
    distance: float, wavelength: float, table: Complexes, per_unit: float,
) -> complex:  # fmt: skip
    """What the crest that takes most leaves of one ray [1].

    Args:
        launch: Launch that meets the ground at each sample, (lines, n).
        met: Of `find_crests`, (lines, crests, 4).
        s: Line of the ray.
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
    stretch, least, most = math.sqrt(1 + way * way), 1 + 0j, 0.0
    length, level = distance * stretch, 1 / stretch
    if alone >= 0:
        near = (alone + 1) * step
        high = sense * (way - launch[s, alone]) * near * level
        least = edge_factor(high, ENDLESS, length - near * stretch, length, wavelength, table, per_unit)
        most = (1 - least.real) ** 2 + least.imag**2
    for number in range(last, max(last - CRESTS, -1), -1):
        at, above = float(met[s, number, 0]), sense * (way - met[s, number, 1])
        if at >= end:
            break
        if above < 0 and distance > met[s, number, 3]:
            continue
        near = (at + 1) * step
        clear, hollow, behind = above * near * level, met[s, number, 2] * level, length - near * stretch
        if clear < 0 and differs_less(-clear, hollow, behind, length, wavelength, max(FAINT * FAINT, most)):
            continue
        left = edge_factor(clear, hollow, behind, length, wavelength, table, per_unit)
        differs = (1 - left.real) ** 2 + left.imag**2
        if differs > most:
            least, most = left, differs
    return least
