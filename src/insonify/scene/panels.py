"""Smooth bodies as panels: flat faces and surfaces of revolution in closed form, each over two parameters.

A panel gives the position and its derivatives to third order at any pair of parameters, so that patches of any size
have the curvature of the body. Meshes and shapes of the library have no panels, only triangles.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.scene.seabed import Seabed
from insonify.scene.solid import resting_pose, submerged
from insonify.scene.target import Box, Cone, Cylinder, Plate, Solid, Sphere, TruncatedCone

Floats = NDArray[np.float64]
_UP = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
"""Axes (up, starboard, forward) of an upright frustum in forward, starboard, down, as rows."""
_FACES = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
"""Axis along the normal, along s and along t of the faces of a block."""


class PanelDerivatives(NamedTuple):
    """Position on a panel and its derivatives by the parameters s and t, named by them [m], each of shape (n, 3)."""

    position: Floats
    s: Floats
    t: Floats
    ss: Floats
    tt: Floats
    st: Floats
    sss: Floats
    sst: Floats
    stt: Floats
    ttt: Floats


@dataclass(frozen=True, eq=False)
class FlatPanel:
    """A parallelogram: origin + s first + t second, s and t from 0 to 1; the normal is second x first."""

    origin: Floats
    """Corner at s = t = 0 [m], shape (3,)."""
    first: Floats
    """Side along s [m], shape (3,)."""
    second: Floats
    """Side along t [m], shape (3,)."""

    @property
    def first_division(self) -> tuple[int, int, float, float]:
        """Number of patches of the first division along s and along t, and the range of s and of t."""
        return 1, 1, 1.0, 1.0

    def at(self, s: Floats, t: Floats) -> PanelDerivatives:
        """Point and derivatives at parameters of shape (n,)."""
        none = np.zeros((len(s), 3))
        position = self.origin + s[:, None] * self.first + t[:, None] * self.second
        return PanelDerivatives(position, none + self.first, none + self.second, *(none,) * 7)

    def area(self, s: Floats, t: Floats, half_s: Floats, half_t: Floats) -> Floats:
        """Area of patches, given the parameters of their middles and half of their ranges [m^2], shape (n,)."""
        return 4 * half_s * half_t * float(np.linalg.norm(np.cross(self.first, self.second)))


@dataclass(frozen=True, eq=False)
class RevolvedPanel:
    """A surface of revolution of a line or a half circle; t is the angle about the axis, 0 to 2 pi."""

    origin: Floats
    """Middle of the body [m], shape (3,)."""
    axes: Floats
    """Axis, and two directions across it; right-handed unit vectors as rows, shape (3, 3)."""
    line: tuple[float, float, float, float] | None
    """Position along the axis and distance from it where s is 0, and where it is 1 [m]; None: a half circle."""
    radius: float = 0.0
    """Radius of the half circle about the origin; s is the angle from its aft end, 0 to pi [m]."""

    @property
    def first_division(self) -> tuple[int, int, float, float]:
        """Number of patches of the first division along s (8 on a half circle) and t (16); the ranges of s and t."""
        return (8 if self.line is None else 1), 16, (np.pi if self.line is None else 1.0), 2 * np.pi

    def at(self, s: Floats, t: Floats) -> PanelDerivatives:
        """Point and derivatives at parameters of shape (n,)."""
        axis, right, down = self.axes
        radial = np.cos(t)[:, None] * right + np.sin(t)[:, None] * down
        tangent = np.cos(t)[:, None] * down - np.sin(t)[:, None] * right
        axial, radius = self._profile(s)
        x, x1, x2, x3 = (part[:, None] * axis for part in axial)
        r, r1, r2, r3 = (part[:, None] for part in radius)
        return PanelDerivatives(
            self.origin + x + r * radial, x1 + r1 * radial, r * tangent, x2 + r2 * radial, -r * radial, r1 * tangent,
            x3 + r3 * radial, r2 * tangent, -r1 * radial, -r * tangent,
        )  # fmt: skip

    def area(self, s: Floats, t: Floats, half_s: Floats, half_t: Floats) -> Floats:
        """Area of patches, given the parameters of their middles and half of their ranges [m^2], shape (n,)."""
        if self.line is None:
            return np.asarray(4 * self.radius**2 * np.sin(s) * np.sin(half_s) * half_t)
        (_, slope, *_), (radius, widening, *_) = self._profile(s)
        return np.asarray(4 * half_s * half_t * radius * np.hypot(slope, widening))

    def _profile(self, s: Floats) -> tuple[tuple[Floats, ...], tuple[Floats, ...]]:
        """Position along the axis and distance from it [m], each with its first three derivatives along s, (n,)."""
        none = np.zeros(len(s))
        if self.line is not None:
            x0, r0, x1, r1 = self.line
            return (x0 + s * (x1 - x0), none + (x1 - x0), none, none), (
                r0 + s * (r1 - r0),
                none + (r1 - r0),
                none,
                none,
            )
        sine, cosine = self.radius * np.sin(s), self.radius * np.cos(s)
        return (-cosine, sine, cosine, -sine), (sine, cosine, -sine, -cosine)


Panel = FlatPanel | RevolvedPanel


def panels(solid: Solid, seabed: Seabed, sonar_position: Floats) -> list[Panel]:
    """Surface of a solid in the world in closed form; empty for meshes and shapes of the library.

    Args:
        solid: The target.
        seabed: Seabed that it lies on.
        sonar_position: North, east, depth of the sonar [m], shape (3,). The azimuth t of a sphere, about its vertical
            axis, begins at the sonar's bearing, so that its patches do not depend on the bearing.
    """
    solid = submerged(solid, seabed)
    rotation, middle = resting_pose(solid, seabed)
    body = rotation.T  # its own forward, starboard and down in the world, as rows
    match solid:
        case Sphere(diameter=diameter):
            # vertical axis: seabed and surface cut the sphere along circles of equal s
            bearing = np.arctan2(*(sonar_position - middle)[1::-1])
            c, s = np.cos(bearing), np.sin(bearing)
            return [RevolvedPanel(middle, np.array([[0.0, 0, -1], [c, s, 0], [s, -c, 0]]), None, diameter / 2)]
        case Cylinder(length=length, diameter=diameter):
            return _frustum_panels(middle, body, length, diameter, diameter)
        case Cone(height=height, diameter=diameter):
            return _frustum_panels(middle, _UP @ body, height, diameter, 0.0)
        case TruncatedCone(height=height, diameter=diameter, top_diameter=top):
            return _frustum_panels(middle, _UP @ body, height, diameter, top)
        case Box(size=size):
            return _block_panels(middle, body, size)
        case Plate(length=length, width=width, thickness=thickness):
            return _block_panels(middle, body, (length, width, thickness))
    return []


def _frustum_panels(middle: Floats, axes: Floats, length: float, aft: float, fore: float) -> list[Panel]:
    """Ends and side of a frustum along the first axis: its length, and the diameters of its ends [m]."""
    half = length / 2
    lines = [(-half, 0.0, -half, aft / 2), (-half, aft / 2, half, fore / 2), (half, fore / 2, half, 0.0)]
    return [RevolvedPanel(middle, axes, line) for line in lines if line[1] or line[3]]


def _block_panels(middle: Floats, body: Floats, size: tuple[float, float, float]) -> list[Panel]:
    """The six faces of a block."""
    result: list[Panel] = []
    for axis_n, axis_s, axis_t in _FACES:
        normal_edge, edge_s, edge_t = (body[axis] * size[axis] for axis in (axis_n, axis_s, axis_t))
        for side in (1, -1):
            corner = middle + (side * normal_edge - edge_s - edge_t) / 2
            result.append(FlatPanel(corner, *((edge_t, edge_s) if side > 0 else (edge_s, edge_t))))
    return result
