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
    """Intensity by sample [uPa^2], (contributions, channels, samples)."""
    object_row: Integers
    """Row of the object, (contributions,)."""
    is_occluded: Masks
    """True: the seabed echo that the object occludes; False: the echo of the object, (contributions,)."""
    has_surface: Masks
    """True: by a path with a surface reflection, (contributions,)."""


class SampleMasks(NamedTuple):
    """Results by sample, (channels, samples) each."""

    expected_intensity: Floats
    """Sum of all objects [uPa^2]."""
    strongest_object: Integers
    """Row of the strongest object."""
    shadowing_object: Integers
    """Row of the object that occludes most of a shadow's echo."""
    contribution: Integers
    """Number of the strongest contribution of the strongest object; in a shadow, of the strongest that the shadowing
    object occludes; -1 for none."""
    received: Masks
    """True where any echo has energy."""
    highlight: Masks
    """True where targets make at least half of the intensity with noise, no less than is occluded, and no ghost."""
    shadow: Masks
    """True where more is occluded than the seabed returns directly, and there is no highlight."""
    ghost: Masks
    """True where targets make at least half of the intensity with noise, most of it by paths with the surface."""


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
        straight: Number of the contribution that is the seabed's echo by the direct path; -1 for none.
        noise: Mean-square noise pressure that a target has to exceed [uPa^2].
        none: Row of no object.
        masks: Result.
    """
    energy, object_row, is_occluded, has_surface = contributions
    sums = np.empty((6, by_object.shape[2]))
    target, surroundings, echo, occluded, by_surface, without_surface = sums
    for c in range(by_object.shape[0]):
        sums[:], masks.expected_intensity[c] = 0.0, 0.0
        for row in range(by_object.shape[1]):
            _add(by_object[c, row], masks.expected_intensity[c])
            _add(by_object[c, row], target if is_target[row] else surroundings)
        for k in range(energy.shape[0]):
            _add(energy[k, c], occluded if is_occluded[k] else echo)
            if is_target[object_row[k]] and not is_occluded[k]:
                _add(energy[k, c], by_surface if has_surface[k] else without_surface)
        received, highlight, shadow, ghost = masks.received[c], masks.highlight[c], masks.shadow[c], masks.ghost[c]
        for n in range(target.size):
            received[n] = echo[n] > 0
            # the tail of the filter, 60 dB below an echo and further, would dominate silent water
            has_target = by_surface[n] + without_surface[n] > 0
            dominates = has_target and target[n] >= surroundings[n] + noise
            ghost[n] = dominates and by_surface[n] > without_surface[n]
            highlight[n] = dominates and not ghost[n] and target[n] >= occluded[n]
            direct = energy[straight, c, n] if straight >= 0 else 0.0
            shadow[n] = occluded[n] > direct and not highlight[n]
        largest_rows(by_object[c], received, none, masks.strongest_object[c])
        _fill_shadowing_objects(contributions, c, shadow, none, masks.shadowing_object[c])
        _fill_strongest_contributions(contributions, c, none, masks)


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_shadowing_objects(contributions: Contributions, c: int, shadow: Masks, none: int, result: Integers) -> None:
    """Fill the row of the object that occludes most in each sample of a shadow of channel c, (samples,)."""
    energy, object_row, is_occluded, _ = contributions
    highest, result[:] = np.zeros(shadow.size), none
    for k in range(energy.shape[0]):
        for n in range(shadow.size if is_occluded[k] else 0):
            if shadow[n] and energy[k, c, n] > highest[n]:
                highest[n], result[n] = energy[k, c, n], object_row[k]


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_strongest_contributions(contributions: Contributions, c: int, none: int, masks: SampleMasks) -> None:
    """Fill the number of the strongest contribution to each sample of channel c."""
    energy, object_row, is_occluded, _ = contributions
    shadowing, strongest, result = masks.shadowing_object[c], masks.strongest_object[c], masks.contribution[c]
    highest, result[:] = np.zeros(result.size), -1
    for k in range(energy.shape[0]):
        for n in range(result.size):
            is_shadow = shadowing[n] != none
            row = shadowing[n] if is_shadow else strongest[n]
            if row == object_row[k] and is_shadow == is_occluded[k] and energy[k, c, n] > highest[n]:
                highest[n], result[n] = energy[k, c, n], k


@njit(cache=True, nogil=True, error_model="numpy")
def _add(values: Floats, sums: Floats) -> None:
    """Add values to sums."""
    for n in range(sums.size):
        sums[n] += values[n]


@njit(cache=True, nogil=True, error_model="numpy")
def largest_rows(values: Floats, counts: Masks, none: int, largest: Integers) -> None:
    """Fill the row of the largest value of each sample, the first of equals.

    Args:
        values: Values, (rows, samples).
        counts: False: samples that get `none`, (samples,).
        none: Number that stands for no row.
        largest: Result: row of each sample, (samples,).
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
