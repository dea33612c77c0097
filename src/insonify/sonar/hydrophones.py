"""Hydrophones: the elements of a receiving array, each recorded as a separate channel.

An element receives a wavefront at its own position, through its own pattern, with its errors: of gain, phase and
position, or without any signal.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from insonify import random_keys
from insonify.model import Decibels, Metres, Model, Radians
from insonify.sonar.aperture import element_positions
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.element_array import AnyArray, ArcArray, ElementArray
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
BeamArray = LineArray | PlanarArray | PointTransducer


class ElementErrors(Model):
    """Random errors of the elements, the same in all pings of a sonar.

    Example:
        >>> errors = ElementErrors(phase="5 deg")
        >>> response = hydrophones(LineArray(length="6 m", elements=400), errors, seed=1).response
        >>> f"{np.degrees(np.angle(response).std()):.0f} deg rms"
        '5 deg rms'
    """

    gain_db: Annotated[Decibels, Field(ge=0, le=40)] = 0.0
    """Root mean square error of the gain [dB]."""
    phase: Annotated[Radians, Field(ge=0, le=np.pi)] = 0.0
    """Root mean square error of the phase [rad]."""
    position: Annotated[Metres, Field(ge=0, le=1)] = 0.0
    """Root mean square error of the position, along each axis [m]."""
    dead: tuple[Annotated[int, Field(ge=0, lt=10_000)], ...] = ()
    """Numbers of elements without a signal, from 0 [1]."""


@dataclass(frozen=True, slots=True)
class Hydrophones:
    """The m elements of a receiving array.

    Example:
        >>> array = hydrophones(LineArray(length="0.4 m", elements=4), ElementErrors(), seed=1)
        >>> array.positions[:, 1].round(3).tolist()
        [-0.15, -0.05, 0.05, 0.15]
    """

    positions: Floats
    """Position from the array's centre: along boresight, right, down [m], shape (m, 3)."""
    orientations: Floats
    """Angle to the right of the array's boresight that each element faces [rad], shape (m,)."""
    response: NDArray[np.complex128]
    """Response of each element: 1 but for errors, 0 if dead [1], shape (m,)."""

    def __len__(self) -> int:
        """Number of elements."""
        return len(self.positions)


MAX_APERTURE = 100.0
"""Largest side of the filled aperture of an array; that of a larger array is taken to be this long [m]."""


def hydrophones(array: AnyArray, errors: ElementErrors, seed: int, side: int = 0) -> Hydrophones:
    """The elements of an array, with their errors.

    Args:
        array: The array; a continuous aperture is one element.
        errors: Root mean square errors, and dead elements.
        seed: Seed of the scenario.
        side: Number of the side of the platform, on which the random errors depend.

    Example:
        >>> array = hydrophones(LineArray(length="0.4 m", elements=4), ElementErrors(dead=[2]), seed=1)
        >>> array.response.real.tolist()
        [1.0, 1.0, 0.0, 1.0]
    """
    position, orientation = element_layout(array)
    count = len(position)
    draw = np.array([random_keys.complex_normals(seed, random_keys.ELEMENTS, side, row, 8) for row in range(count)])
    # each complex number is two real ones, of which the first five are gain, phase and position
    normals = np.stack([draw.real, draw.imag], axis=-1).reshape(count, -1) * np.sqrt(2)
    gain = amplitude_ratio(errors.gain_db * normals[:, 0])
    response = gain * np.exp(1j * errors.phase * normals[:, 1])
    for row in errors.dead:
        if row < count:
            response[row] = 0
    return Hydrophones(position + errors.position * normals[:, 2:5], orientation, response)


def element_layout(array: AnyArray) -> tuple[Floats, Floats]:
    """Positions of an array's elements from its centre [m], (m, 3), and angles to the right that they face [rad], (m,).

    Args:
        array: The array: elements of a line are in order from left to right, those of a panel row by row from the top.

    Example:
        >>> positions, orientations = element_layout(LineArray(length="0.4 m", elements=4))
        >>> positions[:, 1].round(3).tolist()
        [-0.15, -0.05, 0.05, 0.15]
    """
    if isinstance(array, ElementArray | ArcArray):
        position = np.array(array.positions, float)
        orientations = array.orientations
        return position, np.zeros(len(position)) if orientations is None else np.array(orientations, float)
    if isinstance(array, LineArray):
        right = element_positions(array.elements or 1) * array.length
        return np.stack([np.zeros(len(right)), right, np.zeros(len(right))], axis=1), np.zeros(len(right))
    if isinstance(array, PlanarArray):
        right = element_positions(array.columns or 1) * array.width
        down = element_positions(array.rows or 1) * array.height
        element_down, element_right = (grid.ravel() for grid in np.meshgrid(down, right, indexing="ij"))
        return np.stack([np.zeros(len(element_right)), element_right, element_down], axis=1), np.zeros(
            len(element_right)
        )
    return np.zeros((1, 3)), np.zeros(1)


def single_element(array: AnyArray) -> BeamArray:
    """One element of an array, as an array of its own, whose pattern is that of every element.

    Args:
        array: The array. An element of a line that is a piston is as long as the pitch; a continuous aperture is
            itself one element.
    """
    if isinstance(array, LineArray):
        if array.elements is None:
            return array.unchecked_copy(steer=(0.0,))
        return _element_aperture(array.length / array.elements, 0.0, array.element)
    if isinstance(array, PlanarArray):
        if array.columns is None and array.rows is None:
            return array.unchecked_copy(steer=(0.0,), steer_down=0.0)
        return _element_aperture(array.width / (array.columns or 1), array.height / (array.rows or 1), array.element)
    if isinstance(array, ElementArray | ArcArray) and max(array.size) > 0:
        return _uniform_aperture(*array.size, array.element)
    return PointTransducer(element=array.element)


def filled_aperture(array: AnyArray) -> BeamArray:
    """Continuous aperture of an array's size, steered to boresight: bounds the resolution of any beam of the array."""
    if isinstance(array, ElementArray | ArcArray):
        position, _ = element_layout(array)
        width, height = np.ptp(position[:, 1:], axis=0) + np.array(array.size)
        return _uniform_aperture(min(float(width), MAX_APERTURE), min(float(height), MAX_APERTURE), "omni")
    return array.unchecked_copy(steer=(0.0,)) if not isinstance(array, PointTransducer) else array


def _element_aperture(width: float, height: float, element: str) -> BeamArray:
    """Aperture of one element of a width and a height [m]: a baffled aperture for a piston, else a point."""
    return _uniform_aperture(width, height, "baffled") if element == "piston" else PointTransducer(element=element)


def _uniform_aperture(width: float, height: float, element: str) -> BeamArray:
    """A uniform aperture of a width and a height [m]: a line or a point where one of them is 0, or both are."""
    if width > 0 and height > 0:
        return PlanarArray(width=width, height=height, element=element, steer=(0.0,))
    if width > 0:
        return LineArray(length=width, element=element, steer=(0.0,))
    if height > 0:
        return PlanarArray(width=1e-6, height=height, element=element, steer=(0.0,))
    return PointTransducer(element=element)
