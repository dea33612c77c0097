"""Bounds of the two-way gain towards patches of the seabed, by radial and distance. Plain numbers and arrays only."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar.beam_kernels import BeamMajorants, array_cosines, largest_beam

Floats = NDArray[np.float64]

BEARINGS_PER_PATCH = 5
"""Bearings at which a patch of ground is looked at, from edge to edge."""


@njit(cache=True, nogil=True, error_model="numpy")
def patch_gain_bound(
    bearing: float, width: float, zone: tuple[float, float], vertical: float, odd: bool, beams: BeamMajorants
) -> float:
    """Largest that a beam can be towards a patch of ground by one family, from the spans of its direction cosines.

    Args:
        bearing: Middle of the patch in the world [rad].
        width: Its width [rad].
        zone: Horizontal distances of its inner and outer edge [m].
        vertical: From the image source down to it [m].
        odd: True if the family has an odd number of bounces.
        beams: The beams.
    """
    nearest, farthest = zone
    u_min = v_min = np.inf
    w_max = u_max = v_max = -np.inf
    for i in range(BEARINGS_PER_PATCH):
        azimuth = bearing + width * (i / (BEARINGS_PER_PATCH - 1) - 0.5)
        c, s = math.cos(azimuth), math.sin(azimuth)
        for j in range(3):
            reach = nearest + (farthest - nearest) * 0.5 * j
            inverse = 1 / math.sqrt(reach * reach + vertical * vertical)
            x, y, z = c * reach * inverse, s * reach * inverse, vertical * inverse
            z = -z if odd else z
            w, u, v = array_cosines(beams.axes, x, y, z)
            w_max = max(w_max, w)
            u_min, u_max = min(u_min, u), max(u_max, u)
            v_min, v_max = min(v_min, v), max(v_max, v)
    return largest_beam(beams, w_max, (u_min, u_max), (v_min, v_max))


@njit(cache=True, nogil=True, error_model="numpy")
def patch_gain_bounds(
    bearing: Floats, width: float, zone: tuple[float, float], verticals: Floats, odd: NDArray[np.bool_],
    beams: BeamMajorants, out: Floats,
) -> None:  # fmt: skip
    """Apply `patch_gain_bound` of all families to some patches, into out of the shape of `bearing`."""
    for n in range(bearing.size):
        out[n] = 0.0
        for f in range(verticals.size):
            out[n] = max(out[n], patch_gain_bound(bearing[n], width, zone, verticals[f], odd[f], beams))
