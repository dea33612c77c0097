"""Outline of a mask along the edges of its cells, as one polygon."""

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

Corner = tuple[int, int]


def outline(mask: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Corners of a polygon that encloses the cells of a mask, shape (n, 2): column and row in cells.

    Parts are joined by bridges of no width, and holes likewise, so that filling the polygon gives the mask.
    """
    rings = _rings(mask)
    start = rings[0][0]
    corners = list[Corner]()
    for ring in rings:  # each from the first corner of all, and back to it
        corners += [*ring, ring[0]] if ring[0] == start else [*ring, ring[0], start]
    return np.array(corners[:-1] if len(rings) == 1 else corners, float)


def _rings(mask: NDArray[np.bool_]) -> list[list[Corner]]:
    """Closed lines of edges between cells inside and outside, inside to the right; corners (column, row)."""
    filled = np.pad(mask, 1).astype(np.int8)
    across, down = np.diff(filled, axis=0)[:, 1:-1], np.diff(filled, axis=1)[1:-1]
    ahead = defaultdict[Corner, list[Corner]](list)
    for row, column in zip(*np.nonzero(across), strict=True):  # edges between rows
        ends = [(int(column), int(row)), (int(column) + 1, int(row))]
        first, last = ends if across[row, column] > 0 else ends[::-1]
        ahead[first].append(last)
    for row, column in zip(*np.nonzero(down), strict=True):  # edges between columns
        ends = [(int(column), int(row) + 1), (int(column), int(row))]
        first, last = ends if down[row, column] > 0 else ends[::-1]
        ahead[first].append(last)
    rings = list[list[Corner]]()
    while ahead:
        first = min(ahead)
        ring = [first]
        while True:
            corner = ring[-1]
            following = ahead[corner].pop()
            if not ahead[corner]:
                del ahead[corner]
            if following == first:
                break
            ring.append(following)
        rings.append(_without_straight_corners(ring))
    return rings


def _without_straight_corners(ring: list[Corner]) -> list[Corner]:
    """Corners at which a ring turns."""
    corners = np.array(ring)
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    turns = np.flatnonzero((before != after).any(axis=1))
    return [ring[index] for index in turns.tolist()]
