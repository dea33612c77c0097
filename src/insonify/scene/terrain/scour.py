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

from insonify.model import Metres, Model, Radians
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
    """Below the seabed, along the edge of the footprint [m]."""
    width: ScourWidth = 0.5
    """Distance from that edge to the undisturbed seabed [m]."""

    @model_validator(mode="after")
    def _check_slope(self) -> Self:
        slope = np.pi / 2 * self.depth / self.width
        warn_outside("A scour in sand", "steepest slope", float(slope), 0.0, STEEPEST, "")
        return self


class Scour(ScourDimensions):
    """Scour pit as a component of the relief."""

    kind: Literal["scour"] = "scour"
    position: tuple[Metres, Metres]
    """North and east of the footprint's middle [m]."""
    size: tuple[_Side, _Side]
    """Length of the footprint along its heading, and width across it [m]."""
    corner: Annotated[Metres, Field(ge=0, le=500)] = 0.0
    """Radius of the footprint's corners [m]: half of a side for a round footprint."""
    heading: Radians = 0.0
    """Compass heading of its length [rad]."""

    def build_relief(self, lattice: ScattererGrid) -> "ScourRelief":
        """The scour pit as relief.

        Args:
            lattice: Frame in which it is evaluated.
        """
        along, across = lattice.from_world(np.array(self.position))
        return ScourRelief(self, (float(along), float(across)), self.heading - lattice.heading)


@dataclass(frozen=True, slots=True)
class ScourRelief(Relief):
    """Relief of one scour pit."""

    scour: Scour
    middle: tuple[float, float]
    """Middle in the frame in which it is evaluated [m]."""
    heading: float
    """Heading of the footprint's length in that frame [rad]."""

    @property
    def span(self) -> tuple[float, float]:
        """Heights of its bottom and of the undisturbed seabed [m], see `Relief.span`."""
        return -self.scour.depth, 0.0

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient, see `Relief.sample`."""
        n, e = broadcast_positions(north, east)
        c, s = np.cos(self.heading), np.sin(self.heading)
        x, y = c * (n - self.middle[0]) + s * (e - self.middle[1]), c * (e - self.middle[1]) - s * (n - self.middle[0])
        away, ahead, aside = self._from_edge(x, y)
        half = min(self.scour.size) / 2
        reach = np.where(away < 0, min(self.scour.width, half), self.scour.width)
        turn = np.pi * np.clip(away / reach, -1, 1)
        height = -self.scour.depth / 2 * (1 + np.cos(turn))
        rate = self.scour.depth / 2 * np.pi / reach * np.sin(turn)
        return TerrainSample(
            height, np.stack([rate * (c * ahead - s * aside), rate * (s * ahead + c * aside)], axis=-1)
        )

    def _from_edge(self, x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
        """Distance from the footprint's edge, negative inside [m], and its gradient along and across."""
        length, width = self.scour.size
        corner = min(self.scour.corner, length / 2, width / 2)
        p, q = np.abs(x) - length / 2 + corner, np.abs(y) - width / 2 + corner
        out = np.hypot(np.maximum(p, 0), np.maximum(q, 0))
        inside, along = out == 0, p >= q
        ahead = np.where(inside, along, np.maximum(p, 0) / np.where(inside, 1, out)) * np.sign(x)
        aside = np.where(inside, ~along, np.maximum(q, 0) / np.where(inside, 1, out)) * np.sign(y)
        return out + np.minimum(np.maximum(p, q), 0) - corner, ahead, aside
