"""Beam patterns from tables: the arithmetic per direction and beam.

A table row has the four coefficients of one cubic; an empty table is a pattern of one everywhere. Patterns are even
functions, so tables start on the axis.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]

OMNI, BAFFLED, COSINE = 0, 1, 2
"""Directivity of one element: all round, front half space, cosine of the angle from boresight."""
CHANNELS_PER_BLOCK = 32
"""Consecutive channels that are bounded together [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate_pattern(table: Floats, per_unit: float, x: float) -> float:
    """Amplitude pattern at a direction cosine x off its axis, from a table of cubics [1].

    Args:
        table: Coefficients of the cubics, constant first, shape (rows, 4); no rows: 1 everywhere.
        per_unit: Rows of the table per unit of direction cosine [1].
        x: Difference of direction cosines, within the table [1].
    """
    if table.shape[0] == 0:
        return 1.0
    index = abs(x) * per_unit
    row = min(int(index), table.shape[0] - 1)
    t, index_of_row = index - row, np.uintp(row)  # unsigned: a signed index costs a test
    return table[index_of_row, 0] + t * (
        table[index_of_row, 1] + t * (table[index_of_row, 2] + t * table[index_of_row, 3])
    )


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate_majorant(bound: Floats, per_unit: float, x: float) -> float:
    """Largest magnitude of a pattern at direction cosine x off its axis or beyond [1].

    Args:
        bound: Largest magnitude from each row outwards [1], shape (rows,); no rows: 1 everywhere.
        per_unit: Rows of the table per unit of direction cosine [1].
        x: Difference of direction cosines [1].
    """
    if bound.shape[0] == 0:
        return 1.0
    # slightly inwards: a position rounded across a row's edge must include that row's maximum
    return bound[min(int(max(abs(x) * per_unit - 1e-9, 0.0)), bound.shape[0] - 1)]


@njit(cache=True, nogil=True, error_model="numpy")
def element_gain(element: int, w: float) -> float:
    """Amplitude directivity of one element (`OMNI`, ...) by the cosine w of the angle from boresight [1]."""
    if element == OMNI:
        return 1.0
    if element == BAFFLED:
        return 1.0 if w >= 0.0 else 0.0
    return max(w, 0.0)


class BeamTables(NamedTuple):
    """Arguments of beam kernels: the beams of one array, see `Beams`."""

    axes: Floats
    """Boresight, right and down of the array in the world, as rows [1], shape (3, 3)."""
    steer: Floats
    """Direction cosines to the right and down that each channel is steered to [1], shape (channels, 2)."""
    scale: Floats
    """Amplitude factor of each channel [1], shape (channels,)."""
    tables: tuple[Floats, Floats, Floats, Floats]
    """Patterns of the array across and down, and of one element across and down, each of shape (rows, 4)."""
    per_unit: Floats
    """Rows of each table per unit of direction cosine [1], shape (4,)."""
    element: int
    """Directivity of one element: `OMNI`, `BAFFLED` or `COSINE`."""


@njit(cache=True, nogil=True, error_model="numpy")
def array_cosines(axes: Floats, north: float, east: float, depth: float) -> tuple[float, float, float]:
    """Cosines [1] to an array's boresight, right and down of a direction (north, east, depth) in the world [1]."""
    w = north * axes[0, 0] + east * axes[0, 1] + depth * axes[0, 2]
    u = north * axes[1, 0] + east * axes[1, 1] + depth * axes[1, 2]
    v = north * axes[2, 0] + east * axes[2, 1] + depth * axes[2, 2]
    return w, u, v


@njit(cache=True, nogil=True, error_model="numpy")
def element_amplitude(beams: BeamTables, w: float, u: float, v: float) -> float:
    """Amplitude of one element at direction cosines to boresight, right and down [1]."""
    directivity = element_gain(beams.element, w)
    return (
        directivity
        * interpolate_pattern(beams.tables[2], beams.per_unit[2], u)
        * interpolate_pattern(beams.tables[3], beams.per_unit[3], v)
    )


@njit(cache=True, nogil=True, error_model="numpy")
def beam_amplitude(beams: BeamTables, channel: int, u: float, v: float) -> float:
    """Amplitude of one beam at direction cosines to the right and down, without that of the element [1].

    The product of the array's patterns across and down about the steering cosines, times the channel's factor.
    """
    beam = interpolate_pattern(beams.tables[0], beams.per_unit[0], u - beams.steer[channel, 0])
    beam *= interpolate_pattern(beams.tables[1], beams.per_unit[1], v - beams.steer[channel, 1])
    return beam * beams.scale[channel]


@njit(cache=True, nogil=True, error_model="numpy")
def beam_gains(direction: Floats, beams: BeamTables, out: Floats) -> None:
    """Fill the amplitude of every beam in every direction (n, 3) of the world [1], shape (channels, n)."""
    for i in range(direction.shape[0]):
        w, u, v = array_cosines(beams.axes, direction[i, 0], direction[i, 1], direction[i, 2])
        element = element_amplitude(beams, w, u, v)
        for channel in range(beams.steer.shape[0]):
            out[channel, i] = element * beam_amplitude(beams, channel, u, v)


@njit(cache=True, nogil=True, error_model="numpy")
def cosine_bounds(cosine: float, cos_margin: float, sin_margin: float) -> tuple[float, float]:
    """Least and greatest cosine to an axis [1] of all directions within a margin of one with the given cosine."""
    sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
    least = -1.0 if cosine <= -cos_margin else cosine * cos_margin - sine * sin_margin
    greatest = 1.0 if cosine >= cos_margin else cosine * cos_margin + sine * sin_margin
    return least, greatest


@njit(cache=True, nogil=True, error_model="numpy")
def distance_to_interval(least: float, greatest: float, axis: float) -> float:
    """Distance from the cosine of an axis to the nearest point of an interval of cosines [1]."""
    return max(least - axis, axis - greatest, 0.0)


class BeamMajorants(NamedTuple):
    """Arguments of kernels that bound beams: those of `BeamTables`, with majorants in place of patterns."""

    axes: Floats
    """Boresight, right and down of the array in the world, as rows [1], shape (3, 3)."""
    steer: Floats
    """Direction cosines to the right and down that each channel is steered to [1], shape (channels, 2)."""
    scale: Floats
    """Amplitude factor of each channel [1], shape (channels,)."""
    majorants: tuple[Floats, Floats, Floats, Floats]
    """Largest magnitude of each of the four patterns from each row of its table outwards [1], each of shape (rows,)."""
    per_unit: Floats
    """Rows of each table per unit of direction cosine [1], shape (4,)."""
    element: int
    """Directivity of one element: `OMNI`, `BAFFLED` or `COSINE`."""
    blocks: Floats
    """Least and greatest steering cosine to the right, the same downwards, and largest factor, of every
    `CHANNELS_PER_BLOCK` channels in order: blocks far from a direction are left out as a whole [1], shape (blocks, 5).
    """


@njit(cache=True, nogil=True, error_model="numpy")
def interval_distance(interval: tuple[float, float], least: float, greatest: float) -> float:
    """Distance between two intervals of direction cosines; 0 where they overlap [1]."""
    return max(interval[0] - greatest, least - interval[1], 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_block(beams: BeamMajorants, u: tuple[float, float]) -> int:
    """Index of the block of channels nearest to an interval of cosines to the right."""
    nearest, distance = 0, 4.0
    for block in range(beams.blocks.shape[0]):
        gap = interval_distance(u, beams.blocks[block, 0], beams.blocks[block, 1])
        if gap < distance:
            nearest, distance = block, gap
    return nearest


@njit(cache=True, nogil=True, error_model="numpy")
def block_bound(beams: BeamMajorants, block: int, u: tuple[float, float], v: tuple[float, float]) -> float:
    """Upper bound of the magnitudes of a block of channels over spans of direction cosines, without the element [1]."""
    off_right = interval_distance(u, beams.blocks[block, 0], beams.blocks[block, 1])
    off_down = interval_distance(v, beams.blocks[block, 2], beams.blocks[block, 3])
    bound = interpolate_majorant(beams.majorants[0], beams.per_unit[0], off_right)
    bound *= interpolate_majorant(beams.majorants[1], beams.per_unit[1], off_down)
    return bound * beams.blocks[block, 4]


@njit(cache=True, nogil=True, error_model="numpy")
def channel_bound(beams: BeamMajorants, channel: int, u: tuple[float, float], v: tuple[float, float]) -> float:
    """Upper bound of the magnitude of one channel over spans of direction cosines, without the element [1]."""
    off_right = distance_to_interval(u[0], u[1], beams.steer[channel, 0])
    off_down = distance_to_interval(v[0], v[1], beams.steer[channel, 1])
    bound = interpolate_majorant(beams.majorants[0], beams.per_unit[0], off_right)
    bound *= interpolate_majorant(beams.majorants[1], beams.per_unit[1], off_down)
    return bound * beams.scale[channel]


@njit(cache=True, nogil=True, error_model="numpy")
def largest_gains(direction: Floats, beams: BeamTables, majorants: BeamMajorants, out: Floats) -> None:
    """Fill the largest magnitude over all beams in every direction, the largest row of `beam_gains` [1], shape (n,)."""
    for i in range(direction.shape[0]):
        w, u, v = array_cosines(beams.axes, direction[i, 0], direction[i, 1], direction[i, 2])
        largest, count = 0.0, majorants.blocks.shape[0]
        nearest = nearest_block(majorants, (u, u))
        for k in range(count):
            block = (nearest + k) % count
            if k > 0 and block_bound(majorants, block, (u, u), (v, v)) <= largest:
                continue
            first = block * CHANNELS_PER_BLOCK
            for channel in range(first, min(first + CHANNELS_PER_BLOCK, beams.steer.shape[0])):
                largest = max(largest, abs(beam_amplitude(beams, channel, u, v)))
        out[i] = largest * abs(element_amplitude(beams, w, u, v))


@njit(cache=True, nogil=True, error_model="numpy")
def largest_beam(beams: BeamMajorants, w: float, u: tuple[float, float], v: tuple[float, float]) -> float:
    """Upper bound of the magnitudes of all beams over intervals of direction cosines [1].

    Args:
        beams: The beams.
        w: Greatest cosine to boresight [1].
        u: Least and greatest cosine to the right [1].
        v: Least and greatest cosine downwards [1].
    """
    # no local names for the fields of `beams`: numba would count references to these arrays
    element = element_gain(beams.element, w)
    element *= interpolate_majorant(beams.majorants[2], beams.per_unit[2], distance_to_interval(u[0], u[1], 0.0))
    element *= interpolate_majorant(beams.majorants[3], beams.per_unit[3], distance_to_interval(v[0], v[1], 0.0))
    largest, nearest, count = 0.0, nearest_block(beams, u), beams.blocks.shape[0]
    for i in range(count):
        block = nearest + i if nearest + i < count else nearest + i - count
        if i > 0 and block_bound(beams, block, u, v) <= largest:  # the nearest block is evaluated anyway
            continue
        first = block * CHANNELS_PER_BLOCK
        for channel in range(first, min(first + CHANNELS_PER_BLOCK, beams.steer.shape[0])):
            largest = max(largest, channel_bound(beams, channel, u, v))
    return largest * element


@njit(cache=True, nogil=True, error_model="numpy")
def beam_bounds(direction: Floats, margin: Floats, beams: BeamMajorants, out: Floats) -> None:
    """Fill an upper bound of the magnitude of all beams within a margin [rad] of each direction [1], shape (n,)."""
    for i in range(direction.shape[0]):
        cos_margin, sin_margin = math.cos(min(margin[i], math.pi)), math.sin(min(margin[i], math.pi))
        w, u, v = array_cosines(beams.axes, direction[i, 0], direction[i, 1], direction[i, 2])
        _, w_max = cosine_bounds(w, cos_margin, sin_margin)
        # the baffle's edge is sharp: rounding of w must not exclude directions just in front of it
        out[i] = largest_beam(
            beams, w_max + 1e-12, cosine_bounds(u, cos_margin, sin_margin), cosine_bounds(v, cos_margin, sin_margin)
        )
