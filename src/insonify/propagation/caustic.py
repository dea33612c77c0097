"""Ray amplitude at a caustic, limited by diffraction.

Where neighbouring rays cross, the ray tube has zero width and ray theory gives infinite pressure. In the wave equation
the two rays that merge at a fold are the two halves of one Airy function (Chester, Friedman & Ursell
1957, Proc. Camb. Phil. Soc. 53, 599; Ludwig 1966, Comm. Pure Appl. Math. 19, 215; both not verified). Its modulus and
phase (DLMF section 9.8) give each ray its own factor, so that rays stay separate arrivals and their sum is the wave's.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

_RAYS_ALONE = 40.0
"""Distance from the fold in Airy's scale beyond which ray amplitudes are exact to 2e-6 and 0.03 degrees [1]."""


def fold_distance(fold: ArrayLike, fold_curvature: ArrayLike, frequency: float) -> Floats:
    """Horizontal distance of a ray's end from the fold, in the scale of Airy's function [1].

    With X(p) the horizontal range at which rays of slowness p cross the depth of the point, rays merge where
    dX/dp = 0, at X_f. Between two merging rays the delay differs by (2/3) sqrt(8 |R - X_f|^3 / |X''|), and that times
    the angular frequency is (4/3) zeta^(3/2).

    Args:
        fold: Horizontal distance |R - X_f| to the fold [m], inf for no fold, any shape.
        fold_curvature: |d2X/dp2| at the fold [m^3/s^2], broadcast with `fold`.
        frequency: Frequency of the sound [Hz].

    Returns:
        zeta = |R - X_f| (2 omega^2 / |X''|)^(1/3), broadcast shape.
    """
    return np.asarray(
        np.asarray(fold, float) * np.cbrt(2 * (2 * np.pi * frequency) ** 2 / np.asarray(fold_curvature, float))
    )


def fold_factor(
    fold: ArrayLike, fold_curvature: ArrayLike, fold_side: ArrayLike, frequency: float
) -> NDArray[np.complex128]:
    """Diffraction factor on the amplitude of one ray near a fold; 1 at a distance.

    The modulus is sqrt(pi) zeta^(1/4) M(zeta), with M^2 = Ai^2 + Bi^2 at -zeta: it cancels the ray's zeta^(-1/4) and
    leaves a finite pressure at the fold. The phase, at most 15 degrees, separates the two rays as the Airy function
    does. The +90 degrees of the ray that has touched the caustic are not part of this factor.

    Args:
        fold: Horizontal distance to the fold [m], inf for no fold, any shape (`FOLD` of the eigenray kernel).
        fold_curvature: |d2X/dp2| at the fold [m^3/s^2] (`FOLD_CURVATURE`).
        fold_side: +1 for the ray that has touched the caustic, -1 for its partner, 0 for no fold (`FOLD_SIDE`).
        frequency: Frequency of the sound [Hz].

    Returns:
        Factor on the ray's pressure [1], for a time factor exp(+j omega t), broadcast shape. Zero at the fold itself,
        where the pressure is infinite: such a ray counts as none.

    Source: Chester, Friedman & Ursell (1957), leading term; modulus and phase as in DLMF 9.8.1-9.8.11 (not verified).
    Valid: two merging rays, isolated and of nearly equal amplitudes. Sound in the shadow beyond the fold is neglected:
    3.7 dB below that at the fold at zeta = -0.5, 20 dB at -2.
    """
    fold, fold_curvature, fold_side = np.broadcast_arrays(
        *(np.asarray(values, float) for values in (fold, fold_curvature, fold_side))
    )
    has_fold = fold_side != 0
    distance = fold_distance(
        np.where(has_fold, np.abs(fold), np.inf), np.where(has_fold, fold_curvature, 1.0), frequency
    )
    return merging_factor(distance, fold_side)


def merging_factor(distance: Floats, fold_side: Floats) -> NDArray[np.complex128]:
    """Factor of `fold_factor`, from the distance to the fold in the scale of Airy's function.

    Args:
        distance: zeta of `fold_distance` [1], any shape.
        fold_side: +1 for a ray that has touched the caustic, -1 for its partner, 0 for none; of the same shape.
    """
    factor = np.ones(distance.shape, complex)
    is_close = distance < _RAYS_ALONE
    if is_close.any():
        factor[is_close] = _airy_factor(distance[is_close], fold_side[is_close])
    return factor


def _airy_factor(distance: Floats, fold_side: Floats) -> NDArray[np.complex128]:
    """Factor of `fold_factor` [1] by Airy's functions at minus the distance zeta [1]."""
    from scipy.special import airy

    ai, _, bi, _ = airy(-distance)
    modulus = np.sqrt(np.pi) * distance**0.25 * np.hypot(ai, bi)
    # Ai = M cos(angle), Bi = -M sin(angle); at a distance the angle is that of two separate rays.
    ray_angle = (2 / 3) * distance**1.5 - np.pi / 4
    phase = np.angle((ai - 1j * bi) * np.exp(-1j * ray_angle))
    return np.asarray(modulus * np.exp(-1j * fold_side * phase))
