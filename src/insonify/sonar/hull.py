"""Hull that carries the sonar: its flat underside reflects sound that comes from below."""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from insonify.model import Metres, Model
from insonify.sonar.array import Offset

Floats = NDArray[np.float64]


class Hull(Model):
    """Underside of the hull above the transmitter, as a horizontal rectangular plate that moves with the platform."""

    length: Annotated[Metres, Field(gt=0, le=500)]
    """Length along the heading [m]."""
    width: Annotated[Metres, Field(gt=0, le=100)]
    """Width across the heading [m]."""
    offset: Offset = (0.0, 0.0, 0.0)
    """Middle of the underside from the platform's reference point: forward, starboard, down [m]."""
    reflection: Annotated[float, Field(ge=-1, le=1)] = 1.0
    """Pressure reflection coefficient from below [1]: near 1 for plating whose mass impedance is far above that of
    water, such as 8 mm of steel above 10 kHz; -1 for a hull lined with foam or air."""


class HullPlate(NamedTuple):
    """The underside of the hull at one ping."""

    centre: Floats
    """North, east, depth of its middle [m], shape (3,)."""
    axes: Floats
    """Horizontal unit vectors along the heading and to starboard: north and east components [1], shape (2, 2)."""
    half_size: Floats
    """Half of its length and width [m], shape (2,)."""
    reflection: float
    """Pressure reflection coefficient [1]."""


def hull_plate(hull: Hull, position: Floats, body: Floats) -> HullPlate:
    """Underside of a hull in the world, horizontal whatever the platform's roll and pitch.

    Args:
        hull: The hull.
        position: North, east, depth of the platform's reference point [m], shape (3,).
        body: Axes of the platform in the world as columns [1], shape (3, 3).
    """
    forward = body[:2, 0] / max(float(np.linalg.norm(body[:2, 0])), 1e-9)
    return HullPlate(
        np.asarray(position + body @ np.asarray(hull.offset)), np.array([forward, [-forward[1], forward[0]]]),
        np.array([hull.length, hull.width]) / 2, hull.reflection,
    )  # fmt: skip
