"""Arrays given element by element: at any positions, or along an arc, as in the head of a multibeam.

Positions are in the array's own frame: along boresight, to the right, down, from the array's centre.
"""

from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from insonify.model import Heading, Metres, Model, Radians, field_error
from insonify.sonar.array import LineArray, Offset, PlanarArray, PointTransducer

Directivity = Literal["omni", "baffled", "cosine"]
Size = tuple[Annotated[Metres, Field(ge=0, le=10)], Annotated[Metres, Field(ge=0, le=10)]]
FromCentre = Annotated[Metres, Field(ge=-1e5, le=1e5)]
ElementPosition = tuple[FromCentre, FromCentre, FromCentre]
MIN_ELEMENT_SPACING = 1e-5
"""Smallest distance between elements; closer ones are refused as identical [m]."""


class _Elements(Model):
    """Fields that arrays of given elements have in common."""

    size: Size = (0.0, 0.0)
    """Width and height of one element, a uniform aperture of its own [m]; 0 for a point."""
    element: Directivity = "baffled"
    """Directivity of one element besides that of its size: all round, front half space, or the cosine of the angle from
    the direction that it faces. Baffled steps from 1 to 0 at the plane of its face: what lies on that plane is received
    in full or not at all."""
    offset: Offset = (0.0, 0.0, 0.0)
    """Position of the array's centre from the platform's reference point: forward, starboard, down [m]."""

    @property
    def steers(self) -> tuple[tuple[float, float], ...]:
        """Steering of the elements: one direction, boresight."""
        return ((0.0, 0.0),)

    @property
    def steer(self) -> tuple[float, ...] | None:
        """Steering angle of the elements [rad]: 0, for they are not steered."""
        return (0.0,)

    def steered(self, steers: tuple[tuple[float, float], ...]) -> Self:
        """The array itself, since its elements are recorded separately and beams are formed afterwards."""
        return self


class ElementArray(_Elements):
    """Elements at any positions.

    Example:
        >>> pair = ElementArray(positions=[(0, 0, "-5 cm"), (0, 0, "5 cm")], element="omni")
        >>> pair.positions
        ((0.0, 0.0, -0.05), (0.0, 0.0, 0.05))
    """

    kind: Literal["elements"] = "elements"
    positions: Annotated[tuple[ElementPosition, ...], Field(min_length=1, max_length=10_000)]
    """Position of each element from the array's centre: along boresight, right, down [m]."""
    orientations: tuple[Heading, ...] | None = None
    """Angle to the right of boresight that each element faces [rad]; None: all face along boresight."""

    @model_validator(mode="after")
    def _check_elements(self) -> Self:
        if self.orientations is not None and len(self.orientations) != len(self.positions):
            raise field_error(
                "orientations",
                f"{len(self.orientations)} angles",
                f"for {len(self.positions)} positions. Give one each.",
            )
        from scipy.spatial import cKDTree  # loading takes a tenth of a second, which sonars with beams avoid

        close_pairs = cKDTree(self.positions).query_pairs(MIN_ELEMENT_SPACING)
        if close_pairs:
            first, second = min(close_pairs)
            raise field_error(f"positions.{second}", f"{list(self.positions[second])} m", f"is that of element {first} "
                          "as well. Give elements positions of their own.")  # fmt: skip
        return self

    def mirror_image_fields(self) -> dict[str, Any]:
        """Fields that differ in the mirror image of the array, with right and left exchanged."""
        orientations = None if self.orientations is None else tuple(-angle for angle in self.orientations)
        return {"positions": tuple((a, -r, d) for a, r, d in self.positions), "orientations": orientations}


class ArcArray(_Elements):
    """Elements evenly along an arc about boresight, each facing outwards: a cylindrical head.

    Example:
        >>> head = ArcArray(radius="10 cm", arc_angle="120 deg", elements=5)
        >>> np.degrees(head.orientations).round().tolist()
        [-60.0, -30.0, 0.0, 30.0, 60.0]
    """

    kind: Literal["arc"] = "arc"
    radius: Metres = Field(gt=0, le=100)
    """Radius of the arc [m]; the array's centre is that of the arc."""
    arc_angle: Radians = Field(gt=0, le=2 * np.pi)
    """Angle from the first to the last element, about boresight [rad]."""
    elements: int = Field(ge=2, le=10_000)
    """Number of elements [1]."""

    @model_validator(mode="after")
    def _check_element_spacing(self) -> Self:
        pitch = self.radius * self.arc_angle / (self.elements - 1)
        if pitch < MIN_ELEMENT_SPACING or (self.arc_angle > 2 * np.pi - MIN_ELEMENT_SPACING / self.radius):
            raise field_error("arc_angle", f"{np.degrees(self.arc_angle):g} deg", f"puts elements {pitch * 1e3:.3g} mm "
                          "apart, or the last on the first. Give a smaller arc_angle, or fewer elements.")  # fmt: skip
        return self

    @property
    def orientations(self) -> tuple[float, ...]:
        """Angle to the right of boresight that each element faces [rad]."""
        return tuple(np.linspace(-self.arc_angle / 2, self.arc_angle / 2, self.elements).tolist())

    @property
    def positions(self) -> tuple[Offset, ...]:
        """Position of each element from the arc's centre: along boresight, right, down [m]."""
        facing = np.array(self.orientations)
        rows = self.radius * np.stack([np.cos(facing), np.sin(facing), np.zeros(self.elements)], axis=1)
        return tuple((float(a), float(r), float(d)) for a, r, d in rows)

    def mirror_image_fields(self) -> dict[str, Any]:
        """Fields that differ in the mirror image of the array: none, for only the order of the elements is reversed."""
        return {}


AnyArray = LineArray | PlanarArray | PointTransducer | ElementArray | ArcArray
Array = Annotated[AnyArray, Field(discriminator="kind")]
