"""Waves of a sea at the hits of rays: one glint for each. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.glint_kernel import sample_glint
from insonify.propagation.wind_waves import WindWaves
from insonify.random_keys import philox

Floats = NDArray[np.float64]

DRAW_KIND = (1 << 16) + 4
"""Fourth counter of the random number that selects slope or wavenumber of a glint; larger than those of glints."""


@njit(cache=True, nogil=True, error_model="numpy")
def sample_wavenumbers(
    ray_id: NDArray[np.uint64], code: int, key: tuple[int, int], phase: Floats, waves: WindWaves, wavenumber: Floats,
    gives_slope: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Sample the horizontal wavenumbers that glints add to rays.

    Args:
        ray_id: Identifiers of the rays, (n,).
        code: Number of the bounce.
        key: Key of the random numbers.
        phase: Phase per height of the bounces, the vertical change of the wave vector [rad/m], (n,).
        waves: Tables of the waves.
        wavenumber: Result: wavenumbers along and across the wind [rad/m], (n, 2).
        gives_slope: Result: True, with probability 1/2, for rays that take the slope of the glint, (n,).
    """
    for n in range(ray_id.size):
        along, across, _, _ = sample_glint(ray_id[n], code, key, phase[n], True, waves, 0.0, 0)
        wavenumber[n, 0], wavenumber[n, 1] = along, across
        word, _, _, _ = philox(ray_id[n] & np.uint64(0xFFFFFFFF), ray_id[n] >> np.uint64(32), code, DRAW_KIND, *key)
        gives_slope[n] = word & np.uint32(1) == 0
