"""Scattering by smooth curved patches: Kirchhoff's integral with phases of second order.

A patch is a piece of a surface over two parameters, u and v from -1 to 1. The phase of an echo over it is kept to
second order in both: the curvature of the surface, and that of the wavefronts of both legs. The integral is then a
product of two Fresnel integrals; the mixed term u v, which must be small, is added to second order. A patch may be
as large as third-order terms allow, some Fresnel zones of a round body, and a flat face near a sonar needs no
splitting to follow curved wavefronts.

A short pulse changes within the delays of a patch. The patch is then given as its sides: each has its own delay and
the part of the integral that falls off linearly towards the opposite side, so that the envelope of the echo is
interpolated between them. With one delay for each patch, neighbours would not cancel, and a face would have echoes from
the borders of its patches in directions other than the specular one.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.scattering._kirchhoff_patch_kernel import fresnel_tail, patch_pressures

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
TERMS = 8
"""Rows of a patch: terms of the position in u, v, u^2, v^2 and u v [m]; growth of the vector area along u and v,
relative to the area at the centre [1]; then u and v of the side whose delay it has (-1 or 1; 0: the middle), and 0."""


def side_offset(terms: Floats) -> Floats:
    """Positions of the sides whose delays patches have, relative to their centres [m], shape (n, 3)."""
    return np.asarray(terms[:, 0] * terms[:, 7, :1] + terms[:, 1] * terms[:, 7, 1:2])


@dataclass(frozen=True, slots=True)
class KirchhoffPatch:
    """Curved patch with specular reflection: the coherent part of its echo."""

    reflection: float = 1.0
    """Pressure reflection coefficient [1]: 1 for a rigid body, -1 for an air-filled one."""

    def echoes(
        self, terms: Floats, area: Floats, normal: Floats, from_transmitter: Floats, from_receiver: Floats,
        radius_in: Floats, radius_out: Floats, wavenumber: Floats,
    ) -> Complexes:  # fmt: skip
        """Scattered pressure at 1 m of patches under incident waves of unit pressure [m].

        The phase refers to the centre of the patch, or of its side: multiply by the phases of both legs to it.

        Args:
            terms: Rows t0 to t7, shape (n, 8, 3): position minus centre is t0 u + t1 v + t2 u^2 + t3 v^2 + t4 u v [m];
                vector area over the area at the centre is normal + t5 u + t6 v; t7 is the side, see `TERMS`.
            area: Area of each whole patch [m^2], shape (n,).
            normal: Unit normals at the centres, into the water, shape (n, 3).
            from_transmitter: Unit directions of travel towards the patches from the transmitter, shape (p, n, 3).
            from_receiver: Unit directions of travel towards the patches from the receiver, shape (p, n, 3).
            radius_in: Radii of curvature of the wavefronts from the transmitter [m], shape (p, n).
            radius_out: Radii of curvature of the wavefronts from the receiver [m], shape (p, n).
            wavenumber: Wavenumber at each patch [rad/m], shape (n,).

        Returns:
            (j / wavelength) R times the integral of (sine_in + sine_out) / 2 exp(-j k path) over the patch's area [m],
            shape (p, n); sines are of grazing angles. 0 where either direction is behind the patch.

        Source: Kirchhoff's integral as in `insonify.scattering.kirchhoff_facet`; Fresnel integrals of a quadratic
            phase, Abramowitz & Stegun (1964), 7.3.
        """
        echo = np.empty(from_transmitter.shape[:2], complex)
        patch_pressures(
            self.reflection, terms, area, normal, np.array(from_transmitter), np.array(from_receiver), radius_in,
            radius_out, wavenumber, fresnel_tail(), echo,
        )  # fmt: skip
        return echo
