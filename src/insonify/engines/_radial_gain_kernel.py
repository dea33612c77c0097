"""Bounds of the two-way gain towards patches of the seabed, by radial and distance. Plain numbers and arrays only."""

import math

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.sonar.beam_kernels import distance_to_interval, element_gain, interpolate_majorant

Floats = NDArray[np.float64]

BEARINGS_PER_PATCH = 5
"""Bearings at which a patch of ground is looked at, from edge to edge."""


@njit(cache=True, nogil=True, error_model="numpy")
def patch_gain_bound(
    bearing: float, width: float, near: float, far: float, vertical: float, odd: bool, axes: Floats, steer: Floats,
    scale: Floats, majorants: tuple[Floats, ...], per_unit: Floats, element: int,
) -> float:  # fmt: skip
    """Largest that a beam can be towards a patch of ground by one family, from the spans of its direction cosines.

    Args:
        bearing: Middle of the patch in the world [rad].
        width: Its width [rad].
        near: Horizontal distance of its inner edge [m].
        far: Of its outer edge [m].
        vertical: From the image source down to it [m].
        odd: True if the family has an odd number of bounces.
        axes: See `Beams`.
        steer: See `Beams`.
        scale: See `Beams`.
        majorants: See `Beams`.
        per_unit: See `Beams`.
        element: See `Beams`.
    """
    across, down, piston_across, piston_down = majorants
    u_least = v_least = np.inf
    w_most = u_most = v_most = -np.inf
    for i in range(BEARINGS_PER_PATCH):
        azimuth = bearing + width * (i / (BEARINGS_PER_PATCH - 1) - 0.5)
        c, s = math.cos(azimuth), math.sin(azimuth)
        for j in range(3):
            reach = near + (far - near) * 0.5 * j
            inverse = 1 / math.sqrt(reach * reach + vertical * vertical)
            x, y, z = c * reach * inverse, s * reach * inverse, vertical * inverse
            z = -z if odd else z
            w_most = max(w_most, x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2])
            u = x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
            v = x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2]
            u_least, u_most = min(u_least, u), max(u_most, u)
            v_least, v_most = min(v_least, v), max(v_most, v)
    one = element_gain(element, w_most)
    one *= interpolate_majorant(piston_across, per_unit[2], distance_to_interval(u_least, u_most, 0.0))
    one *= interpolate_majorant(piston_down, per_unit[3], distance_to_interval(v_least, v_most, 0.0))
    most = 0.0
    for channel in range(steer.shape[0]):
        beam = interpolate_majorant(across, per_unit[0], distance_to_interval(u_least, u_most, steer[channel, 0]))
        beam *= interpolate_majorant(down, per_unit[1], distance_to_interval(v_least, v_most, steer[channel, 1]))
        most = max(most, beam * scale[channel])
    return most * one


@njit(cache=True, nogil=True, error_model="numpy")
def patch_gain_bounds(
    bearing: Floats, width: float, near: float, far: float, verticals: Floats, odd: NDArray[np.bool_], axes: Floats,
    steer: Floats, scale: Floats, majorants: tuple[Floats, ...], per_unit: Floats, element: int, out: Floats,
) -> None:  # fmt: skip
    """Apply `patch_gain_bound` of all families to some patches, into out of the shape of `bearing`."""
    for n in range(bearing.size):
        out[n] = 0.0
        for f in range(verticals.size):
            out[n] = max(out[n], patch_gain_bound(bearing[n], width, near, far, verticals[f], odd[f], axes, steer,
            scale,
                                         majorants, per_unit, element))  # fmt: skip
