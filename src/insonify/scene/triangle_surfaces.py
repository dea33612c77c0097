"""Triangulated surfaces, which represent every solid.

Each shape is defined in its own axes, forward, starboard, down, with its middle at the origin. Circles are polygons
with `CIRCLE_STEPS` corners on the true circle, from which their sides differ by at most 0.05 % of the radius.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

CIRCLE_STEPS = 96
"""Number of steps of a round shape about its axis [1]."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """A surface of triangles, whose corners are counter-clockwise as viewed from outside."""

    vertices: Floats
    """Corners [m], shape (v, 3)."""
    faces: Integers
    """Rows of the three corners of each triangle, shape (t, 3)."""

    @cached_property
    def corners(self) -> Floats:
        """Positions of the corners of every triangle [m], shape (t, 3, 3)."""
        return self.vertices[self.faces]

    @cached_property
    def normal(self) -> Floats:
        """Outward normal of every triangle, with a length of twice its area [m^2], shape (t, 3)."""
        return np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0])

    @cached_property
    def area(self) -> Floats:
        """Area of every triangle [m^2], shape (t,)."""
        return np.asarray(np.linalg.norm(self.normal, axis=1) / 2)

    @property
    def volume(self) -> float:
        """Enclosed volume by the divergence theorem, negative if the normals point inwards [m^3]."""
        a, b, c = np.moveaxis(self.corners - self.vertices.mean(axis=0), 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)

    @cached_property
    def low(self) -> Floats:
        """Least coordinates [m], shape (3,)."""
        return np.asarray(self.vertices.min(axis=0))

    @cached_property
    def high(self) -> Floats:
        """Greatest coordinates [m], shape (3,)."""
        return np.asarray(self.vertices.max(axis=0))

    def transformed(self, rotation: Floats, shift: Floats) -> "Triangles":
        """The surface after a rotation (3, 3) and a shift [m] (3,)."""
        return Triangles(self.vertices @ rotation.T + shift, self.faces)

    def scaled(self, factor: Floats | float) -> "Triangles":
        """The surface scaled along its own axes by positive factors [1], shape (3,) or one."""
        return Triangles(self.vertices * factor, self.faces)

    def part(self, selected: NDArray[np.bool_]) -> "Triangles":
        """Surface of the triangles that a mask (t,) selects, without unused corners."""
        used, faces = np.unique(self.faces[selected], return_inverse=True)
        return Triangles(self.vertices[used], np.asarray(faces).reshape(-1, 3))

    def centred(self) -> "Triangles":
        """The surface shifted so that the middle of its extent is at the origin."""
        return Triangles(self.vertices - (self.low + self.high) / 2, self.faces)


def merged_surfaces(parts: list[Triangles]) -> Triangles:
    """Several surfaces as one."""
    starts = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    return Triangles(np.concatenate([part.vertices for part in parts]), np.concatenate(faces))


def block(length: float, width: float, height: float) -> Triangles:
    """A block of twelve triangles.

    Args:
        length: Length forward [m].
        width: Width across [m].
        height: Height [m].
    """
    return wedge(length, length, width, height)


def wedge(length: float, top_length: float, width: float, height: float) -> Triangles:
    """A block whose top is shorter than its base, with an upright aft face.

    Args:
        length: Length of the base [m].
        top_length: Length of the top [m].
        width: Width across [m].
        height: Height [m].
    """
    aft, fore, top = -length / 2, length / 2, top_length - length / 2
    lower, upper = [(aft, -1), (fore, -1), (fore, 1), (aft, 1)], [(aft, -1), (top, -1), (top, 1), (aft, 1)]
    vertices = [(x, y * width / 2, height / 2) for x, y in lower] + [(x, y * width / 2, -height / 2) for x, y in upper]
    quads = [(0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return Triangles(np.array(vertices, float), np.array(faces, np.int64))


def surface_of_revolution(
    profile: list[tuple[float, float]], *, steps: int = CIRCLE_STEPS, closed: bool = False
) -> Triangles:
    """Surface of revolution of a line about the forward axis.

    Args:
        profile: Points of the line from aft to fore: position along the axis and distance from it [m]. The surface is
            closed at an end of the line that lies on the axis.
        steps: Number of steps about the axis.
        closed: True if the line is closed, as for a ring: forward outside, aft inside.
    """
    along, radius = np.array(profile, float).T
    azimuth = 2 * np.pi * np.arange(steps) / steps
    ring = np.stack([0 * azimuth, np.cos(azimuth), np.sin(azimuth)], axis=-1)
    rings = [np.array([[x, 0, 0]]) if r == 0 else ring * r + [x, 0, 0] for x, r in zip(along, radius, strict=True)]
    starts = np.cumsum([0] + [len(part) for part in rings])
    rows = [start + np.arange(steps) % len(part) for start, part in zip(starts, rings, strict=False)]
    pairs = list(zip(rows, rows[1:] + rows[:1] if closed else rows[1:], strict=False))
    faces = np.concatenate([_band(aft, fore) for aft, fore in pairs])
    return Triangles(np.concatenate(rings), faces)


def _band(aft: Integers, fore: Integers) -> Integers:
    """Triangles between two rings of a surface of revolution; a ring on the axis has the same corner throughout."""
    next_aft, next_fore = np.roll(aft, -1), np.roll(fore, -1)
    faces = np.concatenate([np.stack([aft, next_aft, next_fore], -1), np.stack([aft, next_fore, fore], -1)])
    a, b, c = faces.T
    return np.asarray(faces[(a != b) & (b != c) & (c != a)])


def sphere(diameter: float, *, steps: int = CIRCLE_STEPS) -> Triangles:
    """A sphere of a diameter [m] with a number of steps about its axis."""
    polar = np.linspace(0, np.pi, steps // 2 + 1)
    profile = [(-np.cos(t) * diameter / 2, np.sin(t) * diameter / 2) for t in polar[1:-1]]
    return surface_of_revolution([(-diameter / 2, 0.0), *profile, (diameter / 2, 0.0)], steps=steps)


def cylinder(length: float, diameter: float, *, steps: int = CIRCLE_STEPS) -> Triangles:
    """A cylinder along the forward axis, of a length and a diameter [m]."""
    return frustum(length, diameter, diameter, steps=steps)


def frustum(length: float, diameter: float, end_diameter: float, *, steps: int = CIRCLE_STEPS) -> Triangles:
    """A cone or truncated cone along the forward axis, base aft.

    Args:
        length: Length from base to forward end [m].
        diameter: Diameter of the base [m].
        end_diameter: Diameter of the forward end [m]; 0 for a point.
        steps: Number of steps about the axis.
    """
    ends = [(-length / 2, 0.0), (-length / 2, diameter / 2), (length / 2, end_diameter / 2), (length / 2, 0.0)]
    return surface_of_revolution(ends if end_diameter > 0 else ends[:3], steps=steps)


def with_axis_up(shape: Triangles) -> Triangles:
    """A shape rotated about its starboard axis so that its forward axis points up."""
    return shape.transformed(np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]), np.zeros(3))


def torus(diameter: float, thickness: float, *, width: float | None = None) -> Triangles:
    """A ring about the forward axis.

    Args:
        diameter: Outer diameter [m].
        thickness: Radial thickness of the ring [m].
        width: Width of the ring along the axis [m]; None: equal to the thickness.
    """
    angle = 2 * np.pi * np.arange(CIRCLE_STEPS // 4) / (CIRCLE_STEPS // 4)
    half, middle = (thickness if width is None else width) / 2, (diameter - thickness) / 2
    return surface_of_revolution([(-half * np.cos(t), middle + thickness / 2 * np.sin(t)) for t in angle], closed=True)


def tube(length: float, diameter: float, wall: float) -> Triangles:
    """An open pipe along the forward axis, of a length, an outer diameter and a wall thickness [m]."""
    half, outer, inner = length / 2, diameter / 2, diameter / 2 - wall
    return surface_of_revolution([(-half, inner), (-half, outer), (half, outer), (half, inner)], closed=True)
