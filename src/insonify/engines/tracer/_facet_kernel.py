"""Waves of a sea at the hits of rays: one glint for each. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.glint_kernel import sample_glint
from insonify.propagation.wind_waves import WindWaves

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def sample_wavenumbers(
    ray_id: NDArray[np.uint64], code: int, key: tuple[int, int], phase: Floats, waves: WindWaves, wavenumber: Floats
) -> None:
    """Wavenumbers that glints add to rays.

    Args:
        ray_id: Identifiers of the rays, (n,).
        code: Number of the bounce.
        key: Key of the random numbers.
        phase: Phase per height of the bounces [rad/m], (n,).
        waves: Tables of the waves.
        wavenumber: Result: wavenumbers along and across the wind [rad/m], (n, 2).
    """
    for n in range(ray_id.size):
        along, across, _, _ = sample_glint(ray_id[n], code, key, phase[n], True, waves, 0.0, 0)
        wavenumber[n, 0], wavenumber[n, 1] = along, across
