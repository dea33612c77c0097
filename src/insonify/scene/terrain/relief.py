"""Relief: height and gradient of the terrain at any point of an unbounded seabed.

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
from insonify.scene.terrain._gradient_rotation_kernel import rotate
from insonify.validity import require_numbers

Floats = NDArray[np.float64]

MAX_COORDINATE = 1e9
"""Largest coordinate that float64 resolves well below a centimetre [m]."""


def broadcast_positions(north: ArrayLike, east: ArrayLike, *, allow_nan: bool = True) -> tuple[Floats, Floats]:
    """Positions as float64 arrays of one shape.

    Args:
        north: Northing [m], any shape.
        east: Easting [m], broadcast.
        allow_nan: True: NaN is permitted; the terrain there is NaN.

    Raises:
        ValueError: A coordinate is not a number within `MAX_COORDINATE`.
    """
    n, e = np.broadcast_arrays(*_checked_positions(north, east, allow_nan=allow_nan))
    return n, e


def _checked_positions(north: ArrayLike, east: ArrayLike, *, allow_nan: bool = True) -> tuple[Floats, Floats]:
    """Positions as float64 arrays, see `broadcast_positions`, not broadcast."""
    n, e = (
        require_numbers(name, x, "m", -MAX_COORDINATE, MAX_COORDINATE, allow_nan=allow_nan)
        for name, x in (("north", north), ("east", east))
    )
    return n, e


class TerrainSample(NamedTuple):
    """The terrain at some points.

    Example:
        >>> sample = TerrainSample(height=np.array([0.2]), slope=np.array([[0.1, 0.0]]))
        >>> f"slope {np.degrees(np.arctan(np.hypot(*sample.slope[0]))):.1f} deg"
        'slope 5.7 deg'
    """

    height: Floats
    """Height above the mean plane, positive up [m], shape (...)."""
    slope: Floats
    """Exact gradient of the height to the north and the east [1], shape (..., 2)."""


class Relief(Protocol):
    """Height and gradient of a terrain as functions of position.

    Example:
        >>> relief: Relief = build_terrain([PowerLaw(hurst=0.6, rms="10 cm")], seed=1)
        >>> relief.height(0.0, [0.0, 1.0]).shape, relief.slope(0.0, [0.0, 1.0]).shape
        ((2,), (2, 2))
    """

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient.

        Args:
            north: Northing [m], any shape.
            east: Easting [m], broadcast.

        Returns:
            Height [m] and slopes [1] of the broadcast shape. A position's values are bit-identical,
            whatever the other positions are.
        """
        ...

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest height of the terrain [m], exceeded at one position in 1e9 at most."""
        ...

    def height(self, north: ArrayLike, east: ArrayLike) -> Floats:
        """Height above the mean plane, positive up [m], broadcast shape of north and east [m]."""
        return self.sample(north, east).height

    def slope(self, north: ArrayLike, east: ArrayLike) -> Floats:
        """Gradient of the height to the north and the east [1], shape (..., 2)."""
        return self.sample(north, east).slope


@dataclass(frozen=True, slots=True)
class ReliefSum(Relief):
    """Sum of reliefs, in the frame of the scene's scatterer grid.

    Example:
        >>> terrain = build_terrain([Ripples(direction="0 deg"), Ripples(direction="90 deg")], seed=1)
        >>> crossed: ReliefSum = terrain.resolved
        >>> bool(crossed.height(5.0, 5.0) == sum(part.height(5.0, 5.0) for part in crossed.parts))
        True
    """

    parts: tuple[Relief, ...]
    """Reliefs that are added; each is evaluated in grid coordinates. Empty: flat terrain."""
    scatterer_grid: ScattererGrid = field(default_factory=ScattererGrid)
    """Frame in which the parts are defined; moving the whole scene moves the terrain with it."""

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient of all parts together, see `Relief.sample`."""
        return self.to_world(self._sample_without_rotation(north, east))

    def height(self, north: ArrayLike, east: ArrayLike) -> Floats:
        """Height of all parts together, see `Relief.height`."""
        return self._sample_without_rotation(north, east).height

    def _sample_without_rotation(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height, and gradient along the grid's axes, at positions in the world."""
        return self.sample_in_grid_axes(*self.scatterer_grid.axes_from_world(*_checked_positions(north, east)))

    def sample_in_grid_axes(self, along: ArrayLike, across: ArrayLike) -> TerrainSample:
        """Height, and gradient along the grid's axes, at grid coordinates [m], any shape.

        Moving the whole scene leaves these bit-identical.
        """
        if len(self.parts) == 1:  # nothing to add
            return self.parts[0].sample(along, across)
        along, across = broadcast_positions(along, across)
        height, slope = np.zeros(along.shape), np.zeros((*along.shape, 2))
        for part in self.parts:
            sample = part.sample(along, across)
            height += sample.height
            slope += sample.slope
        return TerrainSample(height, slope)

    def to_world(self, terrain_sample: TerrainSample) -> TerrainSample:
        """Terrain sample with its gradient rotated from the grid's axes to the north and the east."""
        rows = self.gradient_rows_in_world(terrain_sample).reshape(*terrain_sample.height.shape, 3)
        return TerrainSample(rows[..., 0].copy(), rows[..., 1:].copy())

    def gradient_rows_in_world(self, terrain_sample: TerrainSample) -> Floats:
        """Rows of height [m], slope to the north and slope to the east [1] of a terrain sample, shape (n, 3)."""
        rows = np.empty((terrain_sample.height.size, 3))
        rotate(terrain_sample.height.ravel(), terrain_sample.slope.reshape(-1, 2), *self.scatterer_grid.frame[2:], rows)
        return rows

    @property
    def span(self) -> tuple[float, float]:
        """Sums of the lowest and of the highest heights of the parts [m], see `Relief.span`."""
        low, high = np.sum([part.span for part in self.parts], axis=0) if self.parts else (0.0, 0.0)
        return float(low), float(high)


def upward_normal(slope: ArrayLike) -> Floats:
    """Unit normal of the terrain, from the seabed into the water, in north, east, down.

    Args:
        slope: Gradient of the height to the north and the east [1], shape (..., 2).

    Returns:
        Unit vectors, shape (..., 3); (0, 0, -1) on flat terrain.

    Example:
        >>> upward_normal([0.1, 0.1]).round(3).tolist()
        [-0.099, -0.099, -0.99]
    """
    slope = require_numbers("slope", slope, "")
    if slope.ndim == 0 or slope.shape[-1] != 2:
        raise ValueError(f"slope has shape {slope.shape}; give the gradient to the north and the east, shape (..., 2)")
    normal = np.concatenate([-slope, np.full((*slope.shape[:-1], 1), -1.0)], axis=-1)
    return np.asarray(normal / np.linalg.norm(normal, axis=-1, keepdims=True))
