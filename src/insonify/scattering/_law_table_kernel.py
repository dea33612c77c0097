"""Cross sections by interpolation in a table of a scattering law over both grazing angles and the azimuth."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Singles = NDArray[np.float32]

OCTAVES = 14
"""Range of a table: tan(grazing / 2) from 2^-14, which is 0.007 degrees, to 1, the normal [octaves]."""
_ZERO, _ONE, _LEAST_SINE, _FIRST = (np.float32(x) for x in (0, 1, 1e-6, -OCTAVES))


class LawGrid(NamedTuple):
    """Grid of a table: log2 of tan(grazing / 2) of the incident, then of the scattered sound, then the azimuth."""

    grazing_nodes: int
    """Nodes from -`OCTAVES` to 0, for each of both grazing angles [1]."""
    azimuth_nodes: int
    """Nodes from 0 to pi [1]; 1 for a law without azimuth."""


@njit(inline="always")
def _grazing_index(sine: float, nodes_per_octave: float) -> float:
    """Fractional index of a grazing angle in the table, from its sine [1] and the nodes per octave."""
    sine_above_0 = max(np.float32(sine), _LEAST_SINE)
    cosine = math.sqrt(max(_ONE - sine_above_0 * sine_above_0, _ZERO))
    index: Any = np.float32((np.float32(math.log2(sine_above_0 / (_ONE + cosine))) - _FIRST) * nodes_per_octave)
    return index


@njit(inline="always")
def _cell(index: float, nodes: int) -> int:
    """Node below a fractional index; beyond the ends that of the outermost cell, so that NaN reads inside the table."""
    cell: Any = min(max(np.int64(index), 0), nodes - 2)
    return cell


@njit(inline="always")
def _along_azimuth(table: Singles, row: int, grid: LawGrid, k: int, fraction: float) -> float:
    """Interpolate the entries of one pair of grazing angles (row) at azimuth node k plus a fraction."""
    first: Any = table[row * grid.azimuth_nodes + k]
    if grid.azimuth_nodes == 1:
        return first
    return first + fraction * (table[row * grid.azimuth_nodes + k + 1] - first)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def tabulated_cross_sections(
    grid: LawGrid, table: Singles, into: Singles, out: Singles, up: Singles, section: Singles
) -> None:
    """Fill section, shape (count,), for unit vectors of shape (3, count), all float32; table: log2 of cross sections.

    Below the first node of a grazing angle, the last step is extrapolated: the law is a power of the angle there.
    """
    nodes_per_octave = np.float32((grid.grazing_nodes - 1) / OCTAVES)
    for i in range(section.size):
        a = -(into[0, i] * up[0, i] + into[1, i] * up[1, i] + into[2, i] * up[2, i])
        b = out[0, i] * up[0, i] + out[1, i] * up[1, i] + out[2, i] * up[2, i]
        index_in, index_out = _grazing_index(a, nodes_per_octave), _grazing_index(b, nodes_per_octave)
        row, column = _cell(index_in, grid.grazing_nodes), _cell(index_out, grid.grazing_nodes)
        k, fraction = 0, _ZERO
        if grid.azimuth_nodes > 1:
            in_plane_product = into[0, i] * out[0, i] + into[1, i] * out[1, i] + into[2, i] * out[2, i] + a * b
            lengths = math.sqrt(max((_ONE - a * a) * (_ONE - b * b), np.float32(1e-12)))
            azimuth = np.float32(math.acos(min(max(in_plane_product / lengths, -_ONE), _ONE)))
            index = azimuth * np.float32((grid.azimuth_nodes - 1) / math.pi)
            k = _cell(index, grid.azimuth_nodes)
            fraction = index - np.float32(k)
        corner = row * grid.grazing_nodes + column
        below = corner + grid.grazing_nodes
        index_in -= np.float32(row)
        index_out -= np.float32(column)
        first: Any = _along_azimuth(table, corner, grid, k, fraction)
        second: Any = _along_azimuth(table, below, grid, k, fraction)
        first += index_out * (_along_azimuth(table, corner + 1, grid, k, fraction) - first)
        second += index_out * (_along_azimuth(table, below + 1, grid, k, fraction) - second)
        value = np.float32(math.exp2(first + index_in * (second - first)))
        section[i] = value if (a > _ZERO) & (b > _ZERO) else _ZERO
