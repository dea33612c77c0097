"""Interaction with boundaries and bodies: scattering laws by directions, and energies after reflection."""

import numpy as np
from numpy.typing import NDArray

from insonify.scattering.compiled_law import CompiledLaw
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Law

Floats = NDArray[np.float64]


def scattered_per_steradian(law: Law, incoming: Floats, outgoing: Floats, normal: Floats) -> Floats:
    """Bistatic cross section per unit area over the sine of the incident grazing angle [1/sr], shape (n,).

    The energy of a ray, which represents a solid angle at the source, does not depend on distance; the area that it
    insonifies is inversely proportional to that sine.

    Args:
        law: Scattering law of the interface.
        incoming: Directions of the incident rays [1], shape (n, 3).
        outgoing: Directions of the scattered rays [1], shape (n, 3).
        normal: Unit normals into the water [1], shape (n, 3).
    """
    sine_in, sine_out = -_dot(incoming, normal), _dot(outgoing, normal)
    is_insonified = (sine_in > 0) & (sine_out > 0)
    if isinstance(law, CompiledLaw):
        section = np.asarray(law.cross_section(incoming.T, outgoing.T, normal.T), float)
    else:
        grazing_in, grazing_out = (np.arcsin(np.clip(sine, -1, 1)) for sine in (sine_in, sine_out))
        section = law.cross_section(grazing_in, grazing_out, _bistatic_azimuth(incoming, outgoing, normal))
    return np.asarray(np.where(is_insonified, section / np.maximum(sine_in, 1e-12), 0.0))


def specular_direction(direction: Floats, normal: Floats) -> Floats:
    """Directions of travel after specular reflection at planes with given unit normals [1], all of shape (n, 3)."""
    return np.asarray(direction - 2 * _dot(direction, normal)[:, None] * normal)


def specular_fraction(law: Lambert) -> float:
    """Fraction of the energy that a Lambert face reflects specularly [1]: one less its albedo, pi mu."""
    return max(0.0, 1 - np.pi * 10 ** (law.strength_db / 10))


def _dot(a: Floats, b: Floats) -> Floats:
    """Scalar products of vectors (n, 3), shape (n,)."""
    return np.einsum("ij,ij->i", a, b)


def _bistatic_azimuth(incoming: Floats, outgoing: Floats, normal: Floats) -> Floats:
    """Bistatic azimuth [rad], (n,): 0 for forward scattering, pi for backscattering."""
    a, b = (ray - _dot(ray, normal)[:, None] * normal for ray in (incoming, outgoing))
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), _dot(a, b))
