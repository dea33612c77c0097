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
def _grazing_index(sine: float, rate: float) -> float:
    """Fractional index of a grazing angle in the table, from its sine [1]."""
    above = max(np.float32(sine), _LEAST_SINE)
    cosine = math.sqrt(max(_ONE - above * above, _ZERO))
    index: Any = np.float32((np.float32(math.log2(above / (_ONE + cosine))) - _FIRST) * rate)
    return index


@njit(inline="always")
def _cell(index: float, nodes: int) -> int:
    """Cell of a fractional index; beyond the ends the nearest. NaN must not read outside the table."""
    cell: Any = min(max(np.int64(index), 0), nodes - 2)
    return cell


@njit(inline="always")
def _along_azimuth(table: Singles, row: int, grid: LawGrid, k: int, part: float) -> float:
    """Entry of a pair of grazing angles, linear in azimuth."""
    first: Any = table[row * grid.azimuth_nodes + k]
    if grid.azimuth_nodes == 1:
        return first
    return first + part * (table[row * grid.azimuth_nodes + k + 1] - first)


@njit(cache=True, nogil=True, fastmath=True, error_model="numpy")
def tabulated_cross_sections(
    grid: LawGrid, table: Singles, into: Singles, out: Singles, up: Singles, section: Singles
) -> None:
    """Fill section, shape (count,), for unit vectors of shape (3, count), all float32; table: log2 of cross sections.

    Below the first node of a grazing angle, the last step is extrapolated: the law is a power of the angle there.
    """
    rate = np.float32((grid.grazing_nodes - 1) / OCTAVES)
    for i in range(section.size):
        a = -(into[0, i] * up[0, i] + into[1, i] * up[1, i] + into[2, i] * up[2, i])
        b = out[0, i] * up[0, i] + out[1, i] * up[1, i] + out[2, i] * up[2, i]
        x, y = _grazing_index(a, rate), _grazing_index(b, rate)
        row, column = _cell(x, grid.grazing_nodes), _cell(y, grid.grazing_nodes)
        k, part = 0, _ZERO
        if grid.azimuth_nodes > 1:
            across = into[0, i] * out[0, i] + into[1, i] * out[1, i] + into[2, i] * out[2, i] + a * b
            lengths = math.sqrt(max((_ONE - a * a) * (_ONE - b * b), np.float32(1e-12)))
            azimuth = np.float32(math.acos(min(max(across / lengths, -_ONE), _ONE)))
            z = azimuth * np.float32((grid.azimuth_nodes - 1) / math.pi)
            k = _cell(z, grid.azimuth_nodes)
            part = z - np.float32(k)
        corner = row * grid.grazing_nodes + column
        below = corner + grid.grazing_nodes
        x -= np.float32(row)
        y -= np.float32(column)
        first: Any = _along_azimuth(table, corner, grid, k, part)
        second: Any = _along_azimuth(table, below, grid, k, part)
        first += y * (_along_azimuth(table, corner + 1, grid, k, part) - first)
        second += y * (_along_azimuth(table, below + 1, grid, k, part) - second)
        value = np.float32(math.exp2(first + x * (second - first)))
        section[i] = value if (a > _ZERO) & (b > _ZERO) else _ZERO
