"""Targets: what lies in the scene and is looked for."""

from typing import Annotated, Literal

from pydantic import Field

from insonify.noun import Decibels, Metres, Noun, Radians
from insonify.scattering.lambert import Lambert

Size = Annotated[Metres, Field(gt=0, le=1000)]


class Box(Noun):
    """A box: rough faces that scatter by Lambert's law, and a body that casts shadows."""

    shape: Literal["box"] = "box"
    label: str = "box"
    position: tuple[Metres, Metres] = Field(
        json_schema_extra={"fix": "Write north and east; the depth of a box is its base_depth"}
    )
    """North and east of the centre of its base [m]."""
    size: tuple[Size, Size, Size]
    """Length along its heading, width across it, height [m]."""
    heading: Radians = 0.0
    """Compass heading of its length [rad]."""
    base_depth: Metres | None = None
    """Depth of its base [m]; None: it stands on the seabed."""
    scattering: Lambert = Lambert(strength_db=-10.0)
    """Law of its faces."""


class PointTarget(Noun):
    """A point that echoes alike in all directions and casts no shadow."""

    shape: Literal["point"] = "point"
    label: str = "point"
    position: tuple[Metres, Metres, Metres]
    """North, east and depth [m]."""
    target_strength_db: Annotated[Decibels, Field(ge=-200, le=100)] = 0.0
    """Target strength [dB re 1 m^2]."""


Target = Annotated[Box | PointTarget, Field(discriminator="shape")]
