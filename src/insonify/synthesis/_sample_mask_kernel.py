"""Masks of samples and the strongest contribution to each, from intensities and energies. Plain numbers and arrays."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Masks = NDArray[np.bool_]


class Contributions(NamedTuple):
    """Echoes of one object by one pair of families each, and echoes that one object occludes."""

    energy: Floats
    """Energies by sample, (contributions, channels, samples)."""
    object_row: Integers
    """Row of the object, (contributions,)."""
    is_occluded: Masks
    """True: the echo that the object occludes, (contributions,)."""
    has_surface: Masks
    """True: by a path that reflects off the surface, (contributions,)."""


class SampleMasks(NamedTuple):
    """Results by sample, (channels, samples) each."""

    expected_intensity: Floats
    """Sum of all objects [uPa^2]."""
    strongest_object: Integers
    """Row of the strongest object."""
    shadowing_object: Integers
    """Row of the object that occludes most of a shadow's echo."""
    contribution: Integers
    """Number of the strongest contribution of that object: in a shadow, of what it occludes; -1 for none."""
    received: Masks
    """True where anything is received."""
    highlight: Masks
    """True where targets dominate, no less than is occluded, by paths without the surface."""
    shadow: Masks
    """True where more is occluded than the seabed returns directly, and there is no highlight."""
    ghost: Masks
    """True where targets dominate by paths that reflect off the surface."""


@njit(cache=True, nogil=True, error_model="numpy")
def fill_masks(
    by_object: Floats, is_target: Masks, contributions: Contributions, straight: int, noise: float, none: int,
    masks: SampleMasks,
) -> None:  # fmt: skip
    """Fill the masks of all samples.

    Args:
        by_object: Intensity of each object [uPa^2], (channels, objects, samples).
        is_target: True for the objects that are targets, (objects,).
        contributions: Echoes and occluded echoes.
        straight: Number of the seabed's echo by the direct path; -1 for none.
        noise: Mean-square noise pressure that a target has to exceed [uPa^2].
        none: Row of no object.
        masks: Result.
    """
    energy, object_row, is_occluded, has_surface = contributions
    expected, strongest, shadowing, winner, received, highlight, shadow, ghost = masks
    sums = np.empty((6, by_object.shape[2]))
    target, rest, echo, occluded, by_surface, without = sums
    for c in range(by_object.shape[0]):
        sums[:], expected[c] = 0.0, 0.0
        for row in range(by_object.shape[1]):
            _add(by_object[c, row], expected[c])
            _add(by_object[c, row], target if is_target[row] else rest)
        for k in range(energy.shape[0]):
            _add(energy[k, c], occluded if is_occluded[k] else echo)
            if is_target[object_row[k]] and not is_occluded[k]:
                _add(energy[k, c], by_surface if has_surface[k] else without)
        for n in range(target.size):
            received[c, n] = echo[n] > 0
            # the tail of the filter, 60 dB below an echo and further, would dominate silent water
            dominates = by_surface[n] + without[n] > 0 and target[n] >= rest[n] + noise
            ghost[c, n] = dominates and by_surface[n] > without[n]
            highlight[c, n] = dominates and not ghost[c, n] and target[n] >= occluded[n]
            direct = energy[straight, c, n] if straight >= 0 else 0.0
            shadow[c, n] = occluded[n] > direct and not highlight[c, n]
        largest_rows(by_object[c], received[c], none, strongest[c])
        shadowing[c], winner[c], rest[:], target[:] = none, -1, 0.0, 0.0
        for k in range(energy.shape[0]):
            for n in range(rest.size if is_occluded[k] else 0):
                if shadow[c, n] and energy[k, c, n] > rest[n]:
                    rest[n], shadowing[c, n] = energy[k, c, n], object_row[k]
        for k in range(energy.shape[0]):
            for n in range(target.size):
                own = strongest[c, n] if shadowing[c, n] == none else shadowing[c, n]
                if own == object_row[k] and is_occluded[k] == (shadowing[c, n] != none) and energy[k, c, n] > target[n]:
                    target[n], winner[c, n] = energy[k, c, n], k


@njit(cache=True, nogil=True, error_model="numpy")
def _add(values: Floats, sums: Floats) -> None:
    """Add values to sums."""
    for n in range(sums.size):
        sums[n] += values[n]


@njit(cache=True, nogil=True, error_model="numpy")
def largest_rows(values: Floats, counts: Masks, none: int, largest: Integers) -> None:
    """Row of the largest value of each sample, the first of equals.

    Args:
        values: Values, (rows, samples).
        counts: False: a sample of no row, (samples,).
        none: Number of no row.
        largest: Result, (samples,).
    """
    best = values[0].copy()
    largest[:] = 0
    for k in range(1, values.shape[0]):
        for n in range(best.size):
            if values[k, n] > best[n]:
                best[n], largest[n] = values[k, n], k
    for n in range(best.size):
        if not counts[n]:
            largest[n] = none
