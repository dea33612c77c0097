"""Arrays of transducers: positions, sizes, steering directions.

An array has its own frame: boresight (its facing direction), right, down. A line array lies along `right` and is
equally sensitive at all elevations; a planar array also extends along `down`.
"""

import math
from functools import lru_cache
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field

from insonify.model import Metres, Model, Radians
from insonify.sonar.angle_range import RIGHT_ANGLE, AngleRange, SteerAngle, angle_range

Shading = Literal["uniform", "cosine", "hann", "hamming", "taylor"]
Element = Literal["omni", "baffled", "cosine", "piston"]
PlatformMetres = Annotated[Metres, Field(ge=-1000, le=1000)]
"""Coordinate of a point on a platform; a receiver farther away needs a platform of its own [m]."""
Offset = tuple[PlatformMetres, PlatformMetres, PlatformMetres]


def _as_tuple(value: object) -> object:
    if isinstance(value, dict):
        return angle_range(value)
    return value if value is None or isinstance(value, list | tuple) else (value,)


def _not_empty(angles: tuple[float, ...] | None) -> tuple[float, ...] | None:
    if angles is not None and not angles:
        raise ValueError("steer has no angle; give at least one, or leave it out")
    return angles


# One angle, several, or {from: ..., to: ..., step: ...}; a bare number stands for a list of one.
Steers = Annotated[
    tuple[SteerAngle, ...] | None,
    BeforeValidator(
        _as_tuple,
        json_schema_input_type=Annotated[tuple[SteerAngle, ...], Field(min_length=1)] | SteerAngle | AngleRange | None,
    ),
    AfterValidator(_not_empty),
]


class PointTransducer(Model):
    """A transducer too small to have a beam of its own.

    Example:
        >>> hydrophone = PointTransducer(element="omni", offset=(0, 0, "0.5 m"))
        >>> hydrophone.offset
        (0.0, 0.0, 0.5)
    """

    kind: Literal["point"] = "point"
    element: Literal["omni", "baffled", "cosine"] = "omni"
    """Directivity: all round, the front half space, or the cosine of the angle from boresight. Baffled steps from 1 to
    0 at the plane of the face: what lies on that plane is received in full or not at all."""
    offset: Offset = (0.0, 0.0, 0.0)
    """Position from the platform's reference point: forward, starboard, down [m]."""

    @property
    def steers(self) -> tuple[tuple[float, float], ...]:
        """Steering directions: angle to the right of boresight and angle down [rad], one pair per beam."""
        return ((0.0, 0.0),)

    def steered(self, steers: tuple[tuple[float, float], ...]) -> Self:
        """The transducer itself, since a point cannot be steered."""
        return self


class LineArray(Model):
    """A line of transducers along the array's right: narrow across, open in elevation.

    Example:
        >>> array = LineArray(length="0.45 m", steer={"from": "-60 deg", "to": "60 deg", "step": "30 deg"})
        >>> np.degrees(array.steer).round().tolist()
        [-60.0, -30.0, 0.0, 30.0, 60.0]
    """

    kind: Literal["line"] = "line"
    length: Metres = Field(gt=0, le=100)
    """Length of the aperture [m]; discrete elements fill it, each one pitch wide."""
    elements: int | None = Field(default=None, ge=1, le=10_000)
    """Number of elements [1]; None: a continuous aperture."""
    shading: Shading = "uniform"
    """Shading along the aperture; taylor has side lobes at -30 dB."""
    element: Element = "baffled"
    """Directivity of one element: omni, front half space, cosine, or a piston one pitch wide with a baffle. A baffle
    steps from 1 to 0 at the plane of the array: what lies on that plane is received in full or not at all."""
    steer: Steers = None
    """Angles of the beams to the right of boresight [rad]; None: as the receive array, which itself points ahead."""
    offset: Offset = (0.0, 0.0, 0.0)
    """Position of the array's centre from the platform's reference point: forward, starboard, down [m]."""

    @property
    def steers(self) -> tuple[tuple[float, float], ...]:
        """Steering directions: angle to the right of boresight and angle down [rad], one pair per beam."""
        return tuple((angle, 0.0) for angle in self.steer or (0.0,))

    def steered(self, steers: tuple[tuple[float, float], ...]) -> Self:
        """The same array with its beams on the cones that hold the given directions [rad]."""
        return self.unchecked_copy(steer=tuple(_cone(*pair) for pair in steers))


class PlanarArray(Model):
    """A flat panel of transducers: it has a width to the right and a height down.

    Example:
        >>> panel = PlanarArray(width="0.2 m", height="0.1 m", steer=["-10 deg", "10 deg"], steer_down="20 deg")
        >>> np.degrees(panel.steers).round().tolist()
        [[-10.0, 20.0], [10.0, 20.0]]
    """

    kind: Literal["planar"] = "planar"
    width: Metres = Field(gt=0, le=100)
    """Extent along the array's right [m]."""
    height: Metres = Field(gt=0, le=100)
    """Extent along the array's down [m]."""
    columns: int | None = Field(default=None, ge=1, le=10_000)
    """Number of elements across the width [1]; None: a continuous aperture."""
    rows: int | None = Field(default=None, ge=1, le=10_000)
    """Number of elements down the height [1]; None: a continuous aperture."""
    shading: Shading = "uniform"
    """Weight across the width."""
    shading_down: Shading = "uniform"
    """Weight down the height."""
    element: Element = "baffled"
    """Directivity of one element: omni, front half space, cosine, or a piston one pitch wide with a baffle. A baffle
    steps from 1 to 0 at the plane of the array: what lies on that plane is received in full or not at all."""
    steer: Steers = None
    """Angles of the beams to the right of boresight [rad]; None: as the receive array, which itself points ahead."""
    steer_down: Radians | None = Field(default=None, gt=-RIGHT_ANGLE, lt=RIGHT_ANGLE)
    """Angle of all beams below the array's horizontal plane [rad]; None: as `steer`."""
    offset: Offset = (0.0, 0.0, 0.0)
    """Position of the array's centre from the platform's reference point: forward, starboard, down [m]."""

    @property
    def steers(self) -> tuple[tuple[float, float], ...]:
        """Steering directions: angle to the right of boresight and angle down [rad], one pair per beam."""
        return _with_elevation(self.steer or (0.0,), self.steer_down or 0.0)

    def steered(self, steers: tuple[tuple[float, float], ...]) -> Self:
        """The same array with its beams at the given angles to the right and down [rad]."""
        down = steers[0][1] if self.steer_down is None else self.steer_down
        return self.unchecked_copy(steer=tuple(angle for angle, _ in steers), steer_down=down)


@lru_cache(maxsize=16)
def _with_elevation(angles: tuple[float, ...], down: float) -> tuple[tuple[float, float], ...]:
    """Pairs of an angle to the right and one angle down [rad], cached because beams are many and often requested."""
    return tuple((angle, down) for angle in angles)


def _cone(right: float, down: float) -> float:
    """Angle off the array's cross plane of a direction given by its angles right and down [rad]."""
    return math.asin(math.sin(right) * math.cos(down))
