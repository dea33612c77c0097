"""Body: what every target but a point has, whatever its shape."""

from abc import abstractmethod
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from insonify.model import Coordinate, Depth, Heading, Metres, Model, Radians, field_error
from insonify.scattering.lambert import Lambert
from insonify.scene.terrain.scour import ScourDimensions
from insonify.scene.triangle_surfaces import Triangles

Size = Annotated[Metres, Field(gt=0, le=1000)]
Dimensions = tuple[Size, Size, Size]


class Body(Model):
    """Fields of every target but points: position, attitude, burial, scattering."""

    reflects_legs: ClassVar[bool] = True
    """True: large flat faces of the shape, if it has any, reflect legs to other scatterers."""

    position: tuple[Coordinate, Coordinate] = Field(
        json_schema_extra={"fix": "Write north and east; the depth of a body is its base_depth"}
    )
    """North and east of the target's middle [m]."""
    base_depth: Depth | None = None
    """Depth of the lowest point [m]; None: the target lies on the seabed."""
    heading: Heading = 0.0
    """Compass heading of the target's forward axis [rad]."""
    pitch: Annotated[Radians, Field(ge=-np.pi / 2, le=np.pi / 2)] = 0.0
    """Pitch, forward end up positive [rad]: 90 degrees puts a cylinder on its end."""
    roll: Annotated[Radians, Field(ge=-np.pi, le=np.pi)] = 0.0
    """Roll, starboard side down positive [rad]."""
    burial: Annotated[float, Field(ge=0, lt=1)] = 0.0
    """Fraction of the target's height that is below the seabed [1]."""
    burial_depth: Annotated[Metres, Field(ge=0, le=1000)] = 0.0
    """Depth of the lowest point below the seabed, instead of `burial` [m]."""
    scour: ScourDimensions | None = None
    """Scour pit around the target, such as `{depth: 0.2 m, width: 0.5 m}`; None: none."""
    scattering: Lambert = Lambert(strength_db=-10.0)
    """Scattering law of the rough part of the faces."""
    face_reflection_coefficient: Annotated[float, Field(ge=-1, le=1)] | None = None
    """Pressure reflection coefficient of the smooth part of the faces, which reflects specularly [1]: 1 for a rigid
    body, -1 for one filled with air; None: rough faces only."""

    @model_validator(mode="after")
    def _check_depth_or_burial(self) -> Self:
        if self.base_depth is not None and (self.burial or self.burial_depth):
            word = "burial" if self.burial else "burial_depth"
            raise field_error(word, f"{getattr(self, word):g}", "is for a target on the seabed, but base_depth is "
                          "given. Leave one of the two out.")  # fmt: skip
        if self.base_depth is not None and self.scour is not None:
            raise field_error("scour", None, "is for a target on the seabed, but base_depth is given. Leave one of the "
                          "two out.")  # fmt: skip
        if self.burial and self.burial_depth:
            raise field_error("burial_depth", f"{self.burial_depth:g} m", "repeats burial. Leave one out.")
        return self

    @abstractmethod
    def triangles(self) -> Triangles:
        """Surface in its own axes: forward, starboard, down, with the middle at the origin [m]."""
