"""Interaction with boundaries and bodies: scattering laws by directions, and energies after reflection."""

import numpy as np
from numpy.typing import NDArray

from insonify.scattering.compiled_law import CompiledLaw
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Law

Floats = NDArray[np.float64]


def scattered_per_steradian(law: Law, incoming: Floats, outgoing: Floats, normal: Floats) -> Floats:
    """Bistatic cross section per unit area, over the sine of the grazing angle of what arrives [1/sr].

    A ray that represents a solid angle at the source carries the same energy at any distance; the area it insonifies
    grows as one over that sine.

    Args:
        law: Scattering law of the interface.
        incoming: Directions of travel towards it [1], shape (n, 3).
        outgoing: Directions of travel from the interface [1], shape (n, 3).
        normal: Unit normals into the water [1], shape (n, 3).
    """
    sine_in, sine_out = -_dot(incoming, normal), _dot(outgoing, normal)
    lit = (sine_in > 0) & (sine_out > 0)
    if isinstance(law, CompiledLaw):
        section = np.asarray(law.cross_section(incoming.T, outgoing.T, normal.T), float)
    else:
        grazing_in, grazing_out = (np.arcsin(np.clip(sine, -1, 1)) for sine in (sine_in, sine_out))
        section = law.cross_section(grazing_in, grazing_out, _turn(incoming, outgoing, normal))
    return np.asarray(np.where(lit, section / np.maximum(sine_in, 1e-12), 0.0))


def specular_direction(way: Floats, normal: Floats) -> Floats:
    """Directions after a mirror of some normals, shape (n, 3)."""
    return np.asarray(way - 2 * _dot(way, normal)[:, None] * normal)


def specular_fraction(law: Lambert) -> float:
    """Share of the energy that a Lambert face does not scatter, and so mirrors [1]: its albedo is pi mu."""
    return max(0.0, 1 - np.pi * 10 ** (law.strength_db / 10))


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("ij,ij->i", a, b)


def _turn(incoming: Floats, outgoing: Floats, normal: Floats) -> Floats:
    """Bistatic azimuth: 0 where the sound goes on ahead, pi where it comes straight back."""
    a, b = (ray - _dot(ray, normal)[:, None] * normal for ray in (incoming, outgoing))
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), _dot(a, b))
