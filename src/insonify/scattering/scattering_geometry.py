"""Two directions at a patch of interface, and what scattering wants to know of them.

A law depends on the directions only through the change that the patch makes to the sound's wavenumber: how much of
it lies in the plane (transverse) and how much across it (vertical). Jackson's formulas are written in these two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scattering.law import checked_angles
from insonify.validity import require_numbers

Floats = NDArray[np.float64]

SPECULAR_BLUR2 = 1e-8
"""Least square of the transverse change [1]: a power law's mirror direction would be infinitely bright."""
_LEAST_SINE = 1e-12


class ScatteringGeometry(NamedTuple):
    """Geometry of a pair of directions; every column has the broadcast shape of the angles."""

    sine_in: Floats
    """Sine of the grazing angle of the sound that arrives [1]."""
    sine_out: Floats
    """Likewise of the sound that leaves [1]."""
    along: Floats
    """Cosine of in, cosine of out and cosine of the azimuth, multiplied [1]."""
    transverse2: Floats
    """Square of half the change of unit vectors in the plane, blurred a little at the mirror direction [1]."""
    vertical: Floats
    """Half the change across the plane [1]."""
    is_illuminated: NDArray[np.bool_]
    """Whether both directions are on the water's side."""

    @property
    def facet_grazing_sine(self) -> Floats:
        """Half the length of the change: sine of the grazing angle at a facet that would mirror one into the other."""
        return np.minimum(np.sqrt(self.transverse2 + self.vertical**2), 1.0)

    def where_illuminated(self, cross_section: Floats) -> Floats:
        """The cross section, and 0 where a direction lies behind the interface [1]."""
        return np.asarray(np.where(self.is_illuminated, cross_section, 0.0))


def scattering_geometry(grazing_in: ArrayLike, grazing_out: ArrayLike, azimuth: ArrayLike) -> ScatteringGeometry:
    """What two directions at a patch mean for scattering.

    Args:
        grazing_in: Of the sound that arrives, from the plane of the interface [rad], any shape.
        grazing_out: Of the sound that leaves, likewise [rad], broadcast.
        azimuth: Between the two: 0 forward, pi back [rad], broadcast.

    Source: Jackson & Richardson (2007), High-Frequency Seafloor Acoustics; Williams & Jackson (1998), J. Acoust. Soc.
    Am. 103, 169. Symmetric in the two grazing angles, to the bit.
    """
    a, b, azimuth = np.broadcast_arrays(*checked_angles(grazing_in, grazing_out, azimuth))
    sine_in, sine_out = np.maximum(np.sin(a), _LEAST_SINE), np.maximum(np.sin(b), _LEAST_SINE)
    both = np.cos(a) * np.cos(b)
    # ((cos a - cos b)^2 + 4 cos a cos b sin^2(azimuth/2)) / 4: no cancellation near the mirror direction.
    transverse2 = 0.25 * (np.cos(a) - np.cos(b)) ** 2 + both * np.sin(azimuth / 2) ** 2
    lit = ~((np.sin(a) <= 0) | (np.sin(b) <= 0))  # a gap stays one
    vertical = 0.5 * (sine_in + sine_out)
    return ScatteringGeometry(sine_in, sine_out, both * np.cos(azimuth), transverse2 + SPECULAR_BLUR2, vertical, lit)


def local_angles(incoming: ArrayLike, outgoing: ArrayLike, normal: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Angles that a law asks for, of two directions at a facet that may be tilted.

    Args:
        incoming: Unit vectors of travel towards the facet [1], shape (..., 3), any frame.
        outgoing: Unit vectors of travel away from it [1], broadcast.
        normal: Unit vectors out of the facet into the water [1], broadcast; (0, 0, -1) on a flat seabed, z down.

    Returns:
        Grazing in, grazing out (negative behind the facet) and azimuth, 0 forward to pi back [rad], shape (...).

    Raises:
        ValueError: Something is no vector of three components, or not of unit length.
    """
    named = (("incoming", incoming), ("outgoing", outgoing), ("normal", normal))
    into, out, up = np.broadcast_arrays(*(_unit_vectors(name, value) for name, value in named))
    sine_in, sine_out = -np.sum(into * up, axis=-1), np.sum(out * up, axis=-1)
    flat_in = into + sine_in[..., None] * up
    flat_out = out - sine_out[..., None] * up
    forward, sideways = np.sum(flat_in * flat_out, axis=-1), np.sum(np.cross(flat_in, flat_out) * up, axis=-1)
    azimuth = np.abs(np.arctan2(sideways, forward))
    return np.arcsin(np.clip(sine_in, -1, 1)), np.arcsin(np.clip(sine_out, -1, 1)), azimuth


def _unit_vectors(name: str, value: ArrayLike) -> Floats:
    """Vectors of length 1, to a thousandth, or gaps."""
    vectors = require_numbers(name, value, "")
    if vectors.ndim == 0 or vectors.shape[-1] != 3:
        raise ValueError(f"{name} has shape {vectors.shape}; give vectors of 3 components along the last axis")
    length = np.linalg.norm(vectors, axis=-1)
    strange = length[np.abs(length - 1) > 1e-3]
    if strange.size:
        raise ValueError(f"{name} has a vector of length {strange[0]:g}; give unit vectors")
    return vectors
