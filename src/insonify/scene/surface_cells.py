"""Cells of equal area of a triangulated surface, for random points on triangles of any size.

Large triangles are bisected across their longest side until they are no longer than a cell; slivers of large bodies are
cut into strips first. The pieces are sorted by the direction that they face and then along a space-filling curve, and
the sorted sequence is divided into equal areas. A cell is a part of a large triangle, or many small ones.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.scene.triangle_surfaces import Triangles

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MAX_PIECE_SIDE = 1.5
"""Longest side of a piece, re the side of a cell [1]."""
MAX_PIECES = 500_000
"""Largest number of pieces of a surface, beyond which longer pieces are not bisected [1]."""
MANY_PIECES = 100_000
"""Number of pieces by bisection alone above which slivers are cut into strips first [1]."""
# Roberts (2018), "The unreasonable effectiveness of quasirandom sequences": the plastic number's powers.
_PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True, eq=False)
class SurfaceCells:
    """A surface as a sequence of p pieces, divided into n cells of equal area."""

    corners: Floats
    """Corners of the pieces, in sequence [m], shape (p, 3, 3)."""
    ends: Floats
    """Cumulative area of the pieces, each included, re the whole area [1], shape (p,)."""
    count: int
    """Number of cells."""

    def __len__(self) -> int:
        """Number of cells."""
        return self.count

    def points(self, u: Floats, *, quadrature: bool = False) -> tuple[Floats, Floats]:
        """A point of each cell [m] and the unit normal of the surface there, each of shape (n, 3).

        Args:
            u: Uniform random numbers [1], shape (n, 3): position in the cell's part of the sequence, and in the piece.
            quadrature: True: evenly spaced points, without `u`.
        """
        n = np.arange(self.count)
        along, first, second = np.array(u.T)
        if quadrature:
            along = np.full(self.count, 0.5)
            first, second = np.mod(0.5 + n[:, None] * _PLASTIC, 1).T
        piece = np.minimum(np.searchsorted(self.ends, (n + along) / self.count, side="right"), len(self.ends) - 1)
        a, b, c = np.moveaxis(self.corners[piece], 1, 0)
        root = np.sqrt(first)[:, None]
        position = (1 - root) * a + root * (1 - second[:, None]) * b + root * second[:, None] * c
        normal = np.cross(b - a, c - a)
        return position, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def surface_cells(surface: Triangles, side: float) -> SurfaceCells:
    """A surface divided into cells of equal area, no larger than that of a square.

    Args:
        surface: The surface.
        side: Side of the square [m].
    """
    corners = bisect_triangles(surface.corners, MAX_PIECE_SIDE * side)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1) / 2
    order = np.lexsort((_morton_order(corners.mean(axis=1)), _dominant_axis(normal)))
    ends = np.cumsum(area[order])
    return SurfaceCells(corners[order], ends / ends[-1], int(np.ceil(ends[-1] / side**2 * (1 - 1e-12))))


def even_points(surface: Triangles, count: int) -> tuple[Floats, Floats]:
    """Evenly distributed points on a surface [m], neighbours in sequence, and unit normals there, each of shape (n, 3).

    Args:
        surface: The surface.
        count: Number of points.
    """
    ends = np.cumsum(surface.area)
    n = np.arange(count)
    triangle = np.minimum(np.searchsorted(ends, (n + 0.5) / count * ends[-1], side="right"), len(ends) - 1)
    a, b, c = np.moveaxis(surface.corners[triangle], 1, 0)
    first, second = np.mod(0.5 + n[:, None] * _PLASTIC, 1).T[:, :, None]
    root = np.sqrt(first)
    position = (1 - root) * a + root * (1 - second) * b + root * second * c
    normal = surface.normal[triangle] / (2 * np.maximum(surface.area[triangle], 1e-300))[:, None]
    order = np.lexsort((_morton_order(position), _dominant_axis(normal)))
    return position[order], normal[order]


def bisect_triangles(corners: Floats, longest: float) -> Floats:
    """Triangles (t, 3, 3) bisected across their longest side until none is longer than a length [m], (p, 3, 3)."""
    if halved_piece_count(corners, longest) > MANY_PIECES:
        corners = cut_slivers(corners, longest)
    pieces: list[Floats] = []
    piece_count = 0
    while len(corners):
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        small = sides.max(axis=1) <= longest
        if piece_count + 2 * len(corners) - int(small.sum()) > MAX_PIECES:
            small[:] = True
        piece_count += int(small.sum())
        pieces.append(corners[small])
        corners, sides = corners[~small], sides[~small]
        order = (np.argmax(sides, axis=1)[:, None] + np.arange(3)) % 3  # the longest side first
        a, b, c = np.moveaxis(np.take_along_axis(corners, order[:, :, None], axis=1), 1, 0)
        middle = (a + b) / 2
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate(pieces)


def halved_piece_count(corners: Floats, longest: float) -> float:
    """Approximate number of pieces after bisection alone [1].

    A sliver becomes about three pieces with each halving of the length.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        longest: Longest side of a piece [m].
    """
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    return float(np.sum(np.maximum(sides / longest, 1.0) ** np.log2(3.0)))


def estimated_piece_count(corners: Floats, longest: float) -> float:
    """Approximate number of pieces after `bisect_triangles` [1].

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        longest: Longest side of a piece [m].
    """
    count = halved_piece_count(corners, longest)
    if count > MANY_PIECES:
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        width, length = sides.min(axis=1), sides.max(axis=1)
        sliver = (width <= longest / 2) & (length > longest)
        count = halved_piece_count(corners[~sliver], longest)
        count += float(np.sum(2 * length[sliver] / (longest - width[sliver])))
    return min(count, float(MAX_PIECES))


def cut_slivers(corners: Floats, longest: float) -> Floats:
    """Triangles with slivers cut parallel to their shortest side, so that their number grows with the length alone.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        longest: Longest side of a piece [m]; slivers are those whose shortest side is half of it at most.

    Returns:
        Triangles of the same surface and orientation, no more than about `MAX_PIECES`, shape (p, 3, 3).
    """
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    sliver = (sides.min(axis=1) <= longest / 2) & (sides.max(axis=1) > longest)
    slivers, width = corners[sliver], sides[sliver].min(axis=1)
    order = (np.argmin(sides[sliver], axis=1)[:, None] + 2 + np.arange(3)) % 3  # the corner opposite first
    slivers = np.take_along_axis(slivers, order[:, :, None], axis=1)
    count = np.ceil(sides[sliver].max(axis=1) / (longest - width))
    count = np.maximum(np.floor(count * min(1.0, MAX_PIECES / max(2 * float(count.sum()), 1.0))), 1).astype(np.int64)
    row = np.repeat(np.arange(len(slivers)), count)
    step = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    apex, towards = slivers[row, 0], slivers[row, 1:] - slivers[row, :1]
    near = apex[:, None] + (step / count[row])[:, None, None] * towards
    far = apex[:, None] + ((step + 1) / count[row])[:, None, None] * towards
    outer = np.stack([near[:, 0], far[:, 0], far[:, 1]], axis=1)
    inner = np.stack([near[:, 0], far[:, 1], near[:, 1]], axis=1)[step > 0]  # at the corner there is none
    return np.concatenate([corners[~sliver], outer, inner])


def _dominant_axis(normal: Floats) -> Integers:
    """Dominant direction of each normal, 0 to 5, (n,): opposite sides of a thin plate are then in different cells."""
    axis = np.argmax(np.abs(normal), axis=1)
    return np.asarray(2 * axis + (np.take_along_axis(normal, axis[:, None], axis=1)[:, 0] < 0))


def _morton_order(position: Floats) -> Integers:
    """Rank of positions along Morton's space-filling curve (Morton 1966), shape (n,)."""
    low, high = position.min(axis=0), position.max(axis=0)
    step = np.floor((position - low) / max(float(np.max(high - low)), 1e-300) * 1023.5).astype(np.int64)
    rank = np.zeros(len(position), np.int64)
    for bit in range(10):
        for axis in range(3):
            rank |= ((step[:, axis] >> bit) & 1) << (3 * bit + axis)
    return rank
