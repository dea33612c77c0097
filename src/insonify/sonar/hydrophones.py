"""Hydrophones: the elements of a receiving array, when each is recorded as a channel of its own.

An element receives a wavefront at its own position, by its own small pattern, with its faults: an error of gain and
phase, a position that is not quite the drawing's, or no signal at all.
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
Steered = LineArray | PlanarArray | PointTransducer


class ElementErrors(Model):
    """Errors of real elements, drawn once for a sonar."""

    gain_db: Annotated[Decibels, Field(ge=0, le=40)] = 0.0
    """Root mean square error of the gain [dB]."""
    phase: Annotated[Radians, Field(ge=0, le=np.pi)] = 0.0
    """Root mean square error of the phase [rad]."""
    position: Annotated[Metres, Field(ge=0, le=1)] = 0.0
    """Root mean square error of the position, along each axis [m]."""
    dead: tuple[Annotated[int, Field(ge=0, lt=10_000)], ...] = ()
    """Numbers of elements without a signal, from 0."""


@dataclass(frozen=True, slots=True)
class Hydrophones:
    """The elements of a receiving array, m of them."""

    positions: Floats
    """From the array's centre, along boresight, right, down [m], shape (m, 3)."""
    orientations: Floats
    """Angle to the right of boresight that each faces [rad], shape (m,)."""
    response: NDArray[np.complex128]
    """Response of each element: 1 but for errors, 0 if dead [1], shape (m,)."""

    def __len__(self) -> int:
        """Number of elements."""
        return len(self.positions)


WIDEST = 100.0
"""Longest side of an aperture that has a pattern; elements farther apart count as one of that size [m]."""


def hydrophones(array: AnyArray, errors: ElementErrors, seed: int, side: int = 0) -> Hydrophones:
    """The elements of an array, with their errors.

    Args:
        array: The array; a continuous aperture is one element.
        errors: Errors.
        seed: Of the scenario.
        side: Which side of the platform they are on: each has errors of its own.
    """
    position, facing = element_layout(array)
    count = len(position)
    draw = np.array([random_keys.complex_normals(seed, random_keys.ELEMENTS, side, row, 8) for row in range(count)])
    # Two real draws to each complex one: the first row of them is gain, phase and position.
    flat = np.stack([draw.real, draw.imag], axis=-1).reshape(count, -1) * np.sqrt(2)
    gain = amplitude_ratio(errors.gain_db * flat[:, 0])
    response = gain * np.exp(1j * errors.phase * flat[:, 1])
    for row in errors.dead:
        if row < count:
            response[row] = 0
    return Hydrophones(position + errors.position * flat[:, 2:5], facing, response)


def element_layout(array: AnyArray) -> tuple[Floats, Floats]:
    """Places of an array's elements from its centre [m], shape (m, 3), and where they face [rad], shape (m,).

    Args:
        array: The array: elements of a line go from left to right, those of a panel row by row from the top.
    """
    if isinstance(array, ElementArray | ArcArray):
        position = np.array(array.positions, float)
        facings = array.orientations
        return position, np.zeros(len(position)) if facings is None else np.array(facings, float)
    if isinstance(array, LineArray):
        right = element_positions(array.elements or 1) * array.length
        return np.stack([np.zeros(len(right)), right, np.zeros(len(right))], axis=1), np.zeros(len(right))
    if isinstance(array, PlanarArray):
        right = element_positions(array.columns or 1) * array.width
        down = element_positions(array.rows or 1) * array.height
        d, r = (grid.ravel() for grid in np.meshgrid(down, right, indexing="ij"))
        return np.stack([np.zeros(len(r)), r, d], axis=1), np.zeros(len(r))
    return np.zeros((1, 3)), np.zeros(1)


def one_element(array: AnyArray) -> Steered:
    """One element of an array, as an array by itself: its own pattern is that of every element.

    Args:
        array: The array. An element of a line that is a piston is as long as the pitch; a continuous aperture is
            itself one element.
    """
    if isinstance(array, LineArray):
        if array.elements is None:
            return array.unchecked_copy(steer=(0.0,))
        return _bare(array.length / array.elements, 0.0, array.element)
    if isinstance(array, PlanarArray):
        if array.columns is None and array.rows is None:
            return array.unchecked_copy(steer=(0.0,), steer_down=0.0)
        return _bare(array.width / (array.columns or 1), array.height / (array.rows or 1), array.element)
    if isinstance(array, ElementArray | ArcArray) and max(array.size) > 0:
        return _piston(*array.size, array.element)
    return PointTransducer(element=array.element)


def filled_aperture(array: AnyArray) -> Steered:
    """The array as one filled aperture facing ahead: as fine as anything that can be made of its elements."""
    if isinstance(array, ElementArray | ArcArray):
        position, _ = element_layout(array)
        width, height = np.ptp(position[:, 1:], axis=0) + np.array(array.size)
        return _piston(min(float(width), WIDEST), min(float(height), WIDEST), "omni")
    return array.unchecked_copy(steer=(0.0,)) if not isinstance(array, PointTransducer) else array


def _bare(width: float, height: float, element: str) -> Steered:
    return _piston(width, height, "baffled") if element == "piston" else PointTransducer(element=element)


def _piston(width: float, height: float, element: str) -> Steered:
    """A uniform aperture that may be a line, or a point."""
    if width > 0 and height > 0:
        return PlanarArray(width=width, height=height, element=element, steer=(0.0,))
    if width > 0:
        return LineArray(length=width, element=element, steer=(0.0,))
    if height > 0:
        return PlanarArray(width=1e-6, height=height, element=element, steer=(0.0,))
    return PointTransducer(element=element)
