"""Scour pit: the depression that currents dig around an object on a sandy seabed.

A ring about a footprint, which is a rectangle with rounded corners: deepest along the edge of the footprint, at the
original height of the seabed one width away on both sides. The middle of the footprint keeps its height, and so does an
object that rests there.
"""

from dataclasses import dataclass
from typing import Annotated, Literal, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from insonify.model import Coordinate, Heading, Metres, Model
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.terrain.relief import Relief, TerrainSample, broadcast_positions
from insonify.validity import warn_outside

Floats = NDArray[np.float64]
ScourDepth = Annotated[Metres, Field(gt=0, le=20)]
ScourWidth = Annotated[Metres, Field(ge=0.05, le=100)]
_Side = Annotated[Metres, Field(gt=0, le=1000)]

STEEPEST = 0.7
"""Slope at the angle of repose of sand, tan(35 deg) [1]."""


class ScourDimensions(Model):
    """Depth and width of a scour pit around a target's footprint."""

    depth: ScourDepth = 0.2
    """Depth below the seabed, along the edge of the footprint [m]."""
    width: ScourWidth = 0.5
    """Distance from the edge of the footprint to the undisturbed seabed [m]."""

    @model_validator(mode="after")
    def _check_slope(self) -> Self:
        slope = np.pi / 2 * self.depth / self.width
        warn_outside("A scour in sand", "steepest slope", float(slope), 0.0, STEEPEST, "")
        return self


class Scour(ScourDimensions):
    """Scour pit as a component of the relief."""

    kind: Literal["scour"] = "scour"
    position: tuple[Coordinate, Coordinate]
    """North and east of the footprint's middle [m]."""
    size: tuple[_Side, _Side]
    """Length of the footprint along its heading, and width across it [m]."""
    corner: Annotated[Metres, Field(ge=0, le=500)] = 0.0
    """Radius of the footprint's corners [m]: half of a side for a round footprint."""
    heading: Heading = 0.0
    """Compass heading of the footprint's length [rad]."""

    def build_relief(self, scatterer_grid: ScattererGrid) -> "ScourRelief":
        """The scour pit as relief.

        Args:
            scatterer_grid: Frame in which the relief is evaluated.
        """
        along, across = scatterer_grid.from_world(np.array(self.position))
        return ScourRelief(self, (float(along), float(across)), self.heading - scatterer_grid.heading)


@dataclass(frozen=True, slots=True)
class ScourRelief(Relief):
    """Relief of one scour pit."""

    scour: Scour
    middle: tuple[float, float]
    """Middle of the footprint along both axes of the frame of the relief [m]."""
    heading: float
    """Heading of the footprint's length in that frame [rad]."""

    @property
    def span(self) -> tuple[float, float]:
        """Heights of the bottom of the pit and of the undisturbed seabed [m], see `Relief.span`."""
        return -self.scour.depth, 0.0

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient, see `Relief.sample`."""
        n, e = broadcast_positions(north, east)
        c, s = np.cos(self.heading), np.sin(self.heading)
        x, y = c * (n - self.middle[0]) + s * (e - self.middle[1]), c * (e - self.middle[1]) - s * (n - self.middle[0])
        distance, da, db = self._from_edge(x, y)
        half = min(self.scour.size) / 2
        reach = np.where(distance < 0, min(self.scour.width, half), self.scour.width)
        phase = np.pi * np.clip(distance / reach, -1, 1)
        height = -self.scour.depth / 2 * (1 + np.cos(phase))
        rate = self.scour.depth / 2 * np.pi / reach * np.sin(phase)
        return TerrainSample(height, np.stack([rate * (c * da - s * db), rate * (s * da + c * db)], axis=-1))

    def _from_edge(self, x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
        """Distance from the footprint's edge, negative inside [m], and its gradient along and across [1]."""
        length, width = self.scour.size
        corner = min(self.scour.corner, length / 2, width / 2)
        p, q = np.abs(x) - length / 2 + corner, np.abs(y) - width / 2 + corner
        outside = np.hypot(np.maximum(p, 0), np.maximum(q, 0))
        inside, is_along = outside == 0, p >= q
        da = np.where(inside, is_along, np.maximum(p, 0) / np.where(inside, 1, outside)) * np.sign(x)
        db = np.where(inside, ~is_along, np.maximum(q, 0) / np.where(inside, 1, outside)) * np.sign(y)
        return outside + np.minimum(np.maximum(p, q), 0) - corner, da, db
