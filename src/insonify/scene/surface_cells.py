"""Cells of a surface: shares of equal area, for drawn points on any triangles, large or small.

Large triangles are halved across their longest side until they are no longer than a cell, slivers of large bodies cut
into strips before; all pieces are then put
in a row, neighbours beside neighbours and faces that look alike together, and the row is cut into equal areas. A
cell is a stretch of that row: a part of a large triangle, or many small ones.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.scene.triangle_surfaces import Triangles

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

LONGEST = 1.5
"""Longest side of a piece, in sides of a cell [1]."""
MAX_PIECES = 500_000
"""Pieces of a surface beyond which they stay longer [1]."""
MANY_PIECES = 100_000
"""Pieces of a surface by halving alone beyond which slivers are cut into strips first [1]."""
# Roberts (2018), "The unreasonable effectiveness of quasirandom sequences": the plastic number's powers.
_PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])


@dataclass(frozen=True, eq=False)
class SurfaceCells:
    """A surface as a row of pieces, to be cut into n cells of equal area."""

    corners: Floats
    """Corners of the pieces, in the order of the row [m], shape (p, 3, 3)."""
    ends: Floats
    """Area of the row up to the end of each piece, the whole being 1, shape (p,)."""
    count: int
    """Number of cells."""

    def __len__(self) -> int:
        """Number of cells."""
        return self.count

    def points(self, u: Floats, *, quadrature: bool = False) -> tuple[Floats, Floats]:
        """A point of each cell and the surface's normal there, each of shape (n, 3).

        Args:
            u: Three uniform random numbers for each cell: position in the cell's part of the row, and in the piece.
            quadrature: Evenly spaced points instead.
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
    """A surface cut into cells of equal area, no larger than a square.

    Args:
        surface: The surface.
        side: Side of that square [m].
    """
    corners = bisect_triangles(surface.corners, LONGEST * side)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normal, axis=1) / 2
    order = np.lexsort((_morton_order(corners.mean(axis=1)), _dominant_axis(normal)))
    ends = np.cumsum(area[order])
    return SurfaceCells(corners[order], ends / ends[-1], int(np.ceil(ends[-1] / side**2 * (1 - 1e-12))))


def even_points(surface: Triangles, count: int) -> tuple[Floats, Floats]:
    """Points spread evenly over a surface, neighbours one after another, and unit normals there, each of shape (n, 3).

    Args:
        surface: The surface.
        count: Number of points.
    """
    ends = np.cumsum(surface.area)
    n = np.arange(count)
    row = np.minimum(np.searchsorted(ends, (n + 0.5) / count * ends[-1], side="right"), len(ends) - 1)
    a, b, c = np.moveaxis(surface.corners[row], 1, 0)
    first, second = np.mod(0.5 + n[:, None] * _PLASTIC, 1).T[:, :, None]
    root = np.sqrt(first)
    position = (1 - root) * a + root * (1 - second) * b + root * second * c
    normal = surface.normal[row] / (2 * np.maximum(surface.area[row], 1e-300))[:, None]
    order = np.lexsort((_morton_order(position), _dominant_axis(normal)))
    return position[order], normal[order]


def bisect_triangles(corners: Floats, longest: float) -> Floats:
    """Triangles halved across their longest side until none is longer than a length [m], shape (t, 3, 3)."""
    if pieces_by_halving(corners, longest) > MANY_PIECES:
        corners = strips(corners, longest)
    done: list[Floats] = []
    held = 0
    while len(corners):
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        small = sides.max(axis=1) <= longest
        if held + 2 * len(corners) - int(small.sum()) > MAX_PIECES:
            small[:] = True
        held += int(small.sum())
        done.append(corners[small])
        corners, sides = corners[~small], sides[~small]
        turn = (np.argmax(sides, axis=1)[:, None] + np.arange(3)) % 3  # the longest side first
        a, b, c = np.moveaxis(np.take_along_axis(corners, turn[:, :, None], axis=1), 1, 0)
        middle = (a + b) / 2
        corners = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return np.concatenate(done)


def pieces_by_halving(corners: Floats, longest: float) -> float:
    """Pieces that halving makes of triangles [1], about.

    A sliver that is halved across its longest side leaves three of half its length, of its width or half of it.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        longest: Longest side of a piece [m].
    """
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    return float(np.sum(np.maximum(sides / longest, 1.0) ** np.log2(3.0)))


def pieces_about(corners: Floats, longest: float) -> float:
    """Pieces that `bisect_triangles` makes of triangles [1], about.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        longest: Longest side of a piece [m].
    """
    count = pieces_by_halving(corners, longest)
    if count > MANY_PIECES:
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        width, length = sides.min(axis=1), sides.max(axis=1)
        sliver = (width <= longest / 2) & (length > longest)
        count = pieces_by_halving(corners[~sliver], longest)
        count += float(np.sum(2 * length[sliver] / (longest - width[sliver])))
    return min(count, float(MAX_PIECES))


def strips(corners: Floats, longest: float) -> Floats:
    """Triangles of which slivers are cut parallel to their shortest side, so that pieces grow with the length alone.

    Args:
        corners: Corners of the triangles [m], shape (t, 3, 3).
        longest: Longest side of a piece [m]; slivers are those whose shortest side is half of it at most.

    Returns:
        Triangles of the same surface and sense, no more than about `MAX_PIECES`, shape (p, 3, 3).
    """
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    sliver = (sides.min(axis=1) <= longest / 2) & (sides.max(axis=1) > longest)
    thin, width = corners[sliver], sides[sliver].min(axis=1)
    turn = (np.argmin(sides[sliver], axis=1)[:, None] + 2 + np.arange(3)) % 3  # the corner opposite first
    thin = np.take_along_axis(thin, turn[:, :, None], axis=1)
    count = np.ceil(sides[sliver].max(axis=1) / (longest - width))
    count = np.maximum(np.floor(count * min(1.0, MAX_PIECES / max(2 * float(count.sum()), 1.0))), 1).astype(np.int64)
    row = np.repeat(np.arange(len(thin)), count)
    step = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    apex, towards = thin[row, 0], thin[row, 1:] - thin[row, :1]
    near = apex[:, None] + (step / count[row])[:, None, None] * towards
    far = apex[:, None] + ((step + 1) / count[row])[:, None, None] * towards
    outer = np.stack([near[:, 0], far[:, 0], far[:, 1]], axis=1)
    inner = np.stack([near[:, 0], far[:, 1], near[:, 1]], axis=1)[step > 0]  # at the corner there is none
    return np.concatenate([corners[~sliver], outer, inner])


def _dominant_axis(normal: Floats) -> Integers:
    """Main direction of a face, one of six, so that two sides of a thin plate share no cell."""
    axis = np.argmax(np.abs(normal), axis=1)
    return np.asarray(2 * axis + (np.take_along_axis(normal, axis[:, None], axis=1)[:, 0] < 0))


def _morton_order(position: Floats) -> Integers:
    """Rank of positions along a curve that visits neighbours one after another (Morton 1966), shape (n,)."""
    low, high = position.min(axis=0), position.max(axis=0)
    step = np.floor((position - low) / max(float(np.max(high - low)), 1e-300) * 1023.5).astype(np.int64)
    rank = np.zeros(len(position), np.int64)
    for bit in range(10):
        for axis in range(3):
            rank |= ((step[:, axis] >> bit) & 1) << (3 * bit + axis)
    return rank
