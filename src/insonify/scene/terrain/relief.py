"""Relief: how high the terrain stands, and how steeply, at any point of an endless seabed.

Height is positive up, from the mean plane of the seabed: depth = mean depth - height, and the
slopes of the depth are minus those of the height. The normal that points from the seabed into
the water is (-dh/dnorth, -dh/deast, -1) / norm in north, east, down.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.terrain._gradient_rotation_kernel import turned
from insonify.validity import require_numbers

Floats = NDArray[np.float64]

FARTHEST = 1e9
"""Distance from the origin beyond which a position has too few digits left for centimetres [m]."""


def broadcast_positions(north: ArrayLike, east: ArrayLike, *, allow_nan: bool = True) -> tuple[Floats, Floats]:
    """Positions as numbers of one shape.

    Args:
        north: Place [m], any shape.
        east: Place [m], broadcast.
        allow_nan: Whether NaN may pass; the terrain there is NaN.

    Raises:
        ValueError: Something is no place.
    """
    n, e = (
        require_numbers(name, x, "m", -FARTHEST, FARTHEST, allow_nan=allow_nan)
        for name, x in (("north", north), ("east", east))
    )
    n, e = np.broadcast_arrays(n, e)
    return n, e


class TerrainSample(NamedTuple):
    """The terrain at some points."""

    height: Floats
    """Above the mean plane, positive up [m], shape (...)."""
    slope: Floats
    """Exact gradient of the height, to the north and to the east [1], shape (..., 2)."""


class Relief(Protocol):
    """Answers one question: how does the terrain lie here?"""

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient.

        Args:
            north: Place [m], any shape.
            east: Place [m], broadcast.

        Returns:
            Height [m] and slopes [1] of the broadcast shape. A position's values are bit-identical,
            whatever the other positions are.
        """
        ...

    @property
    def span(self) -> tuple[float, float]:
        """Heights between which the terrain stays [m], lowest and highest; but for one place in a thousand million."""
        ...

    def height(self, north: ArrayLike, east: ArrayLike) -> Floats:
        """Height above the mean plane, positive up [m], broadcast shape of north and east [m]."""
        return self.sample(north, east).height

    def slope(self, north: ArrayLike, east: ArrayLike) -> Floats:
        """Gradient of the height to the north and the east [1], shape (..., 2)."""
        return self.sample(north, east).slope


@dataclass(frozen=True, slots=True)
class ReliefSum(Relief):
    """Reliefs on top of one another, in the frame of the scene's lattice."""

    parts: tuple[Relief, ...]
    """Parts that are added; each is evaluated in grid coordinates. None of them: flat terrain."""
    scatterer_grid: ScattererGrid = field(default_factory=ScattererGrid)
    """Frame in which the parts were drawn; a world moved as a whole keeps its ground."""

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient of all parts together, see `Relief.sample`."""
        own = self.scatterer_grid.from_world(np.stack(broadcast_positions(north, east), axis=-1))
        return self.to_world(self.sample_in_grid_axes(own[..., 0], own[..., 1]))

    def sample_in_grid_axes(self, along: ArrayLike, across: ArrayLike) -> TerrainSample:
        """Height, and gradient along the lattice's axes, at grid coordinates [m], any shape.

        A world moved as a whole keeps these to the last bit.
        """
        if len(self.parts) == 1:  # nothing to add
            return self.parts[0].sample(along, across)
        along, across = broadcast_positions(along, across)
        height, slope = np.zeros(along.shape), np.zeros((*along.shape, 2))
        for part in self.parts:
            found = part.sample(along, across)
            height += found.height
            slope += found.slope
        return TerrainSample(height, slope)

    def to_world(self, terrain_sample: TerrainSample) -> TerrainSample:
        """A survey whose gradient is along the lattice's axes, turned to the north and the east."""
        rows = self.gradient_rows_in_world(terrain_sample).reshape(*terrain_sample.height.shape, 3)
        return TerrainSample(rows[..., 0].copy(), rows[..., 1:].copy())

    def gradient_rows_in_world(self, terrain_sample: TerrainSample) -> Floats:
        """The same as rows of height, slope to the north and slope to the east, shape (n, 3)."""
        rows = np.empty((terrain_sample.height.size, 3))
        turned(terrain_sample.height.ravel(), terrain_sample.slope.reshape(-1, 2), *self.scatterer_grid.frame[2:], rows)
        return rows

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest that the parts come to together, see `Relief.span`."""
        low, high = np.sum([part.span for part in self.parts], axis=0) if self.parts else (0.0, 0.0)
        return float(low), float(high)


def upward_normal(slope: ArrayLike) -> Floats:
    """Unit normal of the terrain, from the seabed into the water, in north, east, down.

    Args:
        slope: Gradient of the height to the north and the east [1], shape (..., 2).

    Returns:
        Unit vectors, shape (..., 3); (0, 0, -1) on flat ground.
    """
    slope = require_numbers("slope", slope, "")
    if slope.ndim == 0 or slope.shape[-1] != 2:
        raise ValueError(f"slope has shape {slope.shape}; give the gradient to the north and the east, shape (..., 2)")
    normal = np.concatenate([-slope, np.full((*slope.shape[:-1], 1), -1.0)], axis=-1)
    return np.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True))
