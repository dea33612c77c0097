"""Bistatic geometry at a patch of interface.

A law depends on the directions through both grazing angles and the change of the wave vector: its component in the
plane of the interface (transverse) and along the normal (vertical). Jackson's formulas are written in these two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scattering.law import checked_angles
from insonify.validity import require_numbers

Floats = NDArray[np.float64]

SPECULAR_BLUR2 = 1e-8
"""Added to the square of half the transverse change [1]: a power law would diverge in the specular direction."""
_LEAST_SINE = 1e-12


class ScatteringGeometry(NamedTuple):
    """Geometry of a pair of directions; every array has the broadcast shape of the angles."""

    sine_in: Floats
    """Sine of the grazing angle of the incident sound [1]."""
    sine_out: Floats
    """Sine of the grazing angle of the scattered sound [1]."""
    in_plane_product: Floats
    """Scalar product of both directions' components in the plane, cos(in) cos(out) cos(azimuth) [1]."""
    transverse2: Floats
    """Square of half the change of direction (of unit vectors) in the plane, plus `SPECULAR_BLUR2` [1]."""
    vertical: Floats
    """Half the change of direction along the normal, the mean of both sines [1]."""
    is_illuminated: NDArray[np.bool_]
    """True where both directions are on the water's side."""

    @property
    def facet_grazing_sine(self) -> Floats:
        """Sine of the grazing angle at the facet that reflects one direction into the other [1]."""
        return np.minimum(np.sqrt(self.transverse2 + self.vertical**2), 1.0)

    def where_illuminated(self, cross_section: Floats) -> Floats:
        """Cross section, 0 where a direction lies behind the interface [1]."""
        return np.asarray(np.where(self.is_illuminated, cross_section, 0.0))


def scattering_geometry(grazing_in: ArrayLike, grazing_out: ArrayLike, azimuth: ArrayLike) -> ScatteringGeometry:
    """Compute the bistatic geometry of two directions at a patch.

    Args:
        grazing_in: Grazing angle of the incident sound, from the plane of the interface [rad], any shape.
        grazing_out: Grazing angle of the scattered sound [rad], broadcast.
        azimuth: Azimuth between the two directions, 0 forward, pi back [rad], broadcast.

    Source: Jackson & Richardson (2007), High-Frequency Seafloor Acoustics; Williams & Jackson (1998), J. Acoust. Soc.
    Am. 103, 169. Symmetric in the two grazing angles, bit-identical.
    """
    a, b, azimuth = np.broadcast_arrays(*checked_angles(grazing_in, grazing_out, azimuth))
    sine_in, sine_out = np.maximum(np.sin(a), _LEAST_SINE), np.maximum(np.sin(b), _LEAST_SINE)
    cosines = np.cos(a) * np.cos(b)
    # ((cos a - cos b)^2 + 4 cos a cos b sin^2(azimuth/2)) / 4: no cancellation near the specular direction.
    transverse2 = 0.25 * (np.cos(a) - np.cos(b)) ** 2 + cosines * np.sin(azimuth / 2) ** 2
    is_illuminated = ~((np.sin(a) <= 0) | (np.sin(b) <= 0))  # NaN counts as illuminated: a gap stays a gap
    vertical = 0.5 * (sine_in + sine_out)
    return ScatteringGeometry(
        sine_in, sine_out, cosines * np.cos(azimuth), transverse2 + SPECULAR_BLUR2, vertical, is_illuminated
    )


def local_angles(incoming: ArrayLike, outgoing: ArrayLike, normal: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Grazing angles and azimuth of two directions at a tilted facet, as a scattering law takes them.

    Args:
        incoming: Unit vectors of travel towards the facet [1], shape (..., 3), any frame.
        outgoing: Unit vectors of travel away from the facet [1], broadcast.
        normal: Unit normals of the facet into the water [1], broadcast; (0, 0, -1) on a flat seabed, z down.

    Returns:
        Grazing in, grazing out (negative behind the facet) and azimuth, 0 forward to pi back [rad], shape (...).

    Raises:
        ValueError: A vector does not have three components, or is not of unit length.

    Example:
        >>> from insonify.frames import direction
        >>> down, back = direction(0.0, np.radians(20)), direction(np.pi, np.radians(-20))
        >>> np.degrees(local_angles(down, back, normal=[0, 0, -1])).round().tolist()
        [20.0, 20.0, 180.0]
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
    """Vectors of length 1 within a thousandth, or gaps."""
    vectors = require_numbers(name, value, "")
    if vectors.ndim == 0 or vectors.shape[-1] != 3:
        raise ValueError(f"{name} has shape {vectors.shape}; give vectors of 3 components along the last axis")
    length = np.linalg.norm(vectors, axis=-1)
    wrong = length[np.abs(length - 1) > 1e-3]
    if wrong.size:
        raise ValueError(f"{name} has a vector of length {wrong[0]:g}; give unit vectors")
    return vectors
