"""Line of sight to the samples of a line, by family, by the rules of `insonify.engines.terrain_occlusion`."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def running_horizon(terrain: Singles, image: float, rising: bool, step: float, first: float, count: int,
              launch: Singles, bound: Singles) -> None:  # fmt: skip
    """Launch that reaches the seabed at each sample of a line, and the launch horizon, as in `terrain_profiles`.

    Args:
        terrain: Depth of the seabed [m], (at least count,).
        image: Depth of the image source of a family [m].
        rising: True if the family's last bounce is off the bottom.
        step: Distance of samples [m].
        first: Place of the first sample in steps.
        count: Samples of the line.
        launch: Result, tangents [1], (at least count,).
        bound: Result, smallest tangent so far, or largest from here on [1], (at least count,).
    """
    sign = np.float32(-1.0 if rising else 1.0)
    from_image = np.float32(image)
    for k in range(count):
        x = sign * (terrain[k] - from_image) / np.float32((k + first) * step)
        launch[k] = x if x == x else sign * np.float32(np.inf)
    if rising:
        most = np.float32(-np.inf)
        for k in range(count - 1, -1, -1):
            most = max(most, launch[k])
            bound[k] = most
    else:
        least = np.float32(np.inf)
        for k in range(count):
            least = min(least, launch[k])
            bound[k] = least


@njit(cache=True, nogil=True, error_model="numpy")
def mark_reached_samples(
    family: int, reached: Integers, sample: Integers, wanted: Integers, count: int, first: float, step: float,
    terrain: Singles, image: float, source: float, water_depth: float, wavelength: float, bounce_codes: Integers,
    horizon_row: Integers, launch: Singles, bound: Singles,
) -> None:  # fmt: skip
    """Mark the points of a line that one family reaches, segment by segment; for ground below the sonar only.

    Args:
        family: Row of the family, and the bit that is set.
        reached: Bits of the families that reach each point, (at least m,).
        sample: Number of each point along the line, (m,).
        wanted: Bits of the families that it is wanted by, (m,).
        count: Samples of the line.
        first: Place of the first sample in steps.
        step: Distance of samples [m].
        terrain: Depth [m], (at least count,).
        image: Depth of the family's image source [m].
        source: Depth of the sonar [m].
        water_depth: Depth of the mean seabed [m].
        wavelength: Acoustic wavelength, for the size of a bounce's mirror [m].
        bounce_codes: Bounces of each family, 1 surface, 2 bottom, 0 no more, (f, most).
        horizon_row: Row in `launch` of what has been passed up to each segment, (f, most + 1).
        launch: Of `running_horizon`, (rows, samples).
        bound: Result, see `launch_bound`.
    """
    bounces = 0
    while bounces < bounce_codes.shape[1] and bounce_codes[family, bounces] > 0:
        bounces += 1
    bit, none = np.int32(1 << family), np.int32(0)
    free = bounces == 0 or (bounces == 1 and bounce_codes[family, 0] == 1)  # on its way up it clears the seabed
    own_launch, own_bound = launch[horizon_row[family, bounces]], bound[horizon_row[family, bounces]]
    for i in range(sample.size if free else 0):
        k = np.uint32(sample[i])
        unobstructed = (own_launch[k] <= own_bound[k]) & (terrain[k] > 0)
        reached[i] |= wanted[i] & (bit if unobstructed else none)
    for i in range(0 if free else sample.size):
        at = sample[i]
        if (wanted[i] & bit) != 0 and own_launch[at] <= own_bound[at] and terrain[at] > 0:
            reach = (at + first) * step
            tangent = abs(terrain[at] - image) / reach
            if _clears_terrain(family, bounces, reach, tangent, count, first, step, source, water_depth, wavelength,
                      bounce_codes, horizon_row, launch, bound):  # fmt: skip
                reached[i] |= bit


@njit(cache=True, nogil=True, error_model="numpy")
def _clears_terrain(
    family: int, bounces: int, reach: float, tangent: float, count: int, first: float, step: float, source: float,
    water_depth: float, wavelength: float, bounce_codes: Integers, horizon_row: Integers, launch: Singles,
    bound: Singles,
) -> bool:  # fmt: skip
    """Return True if a ray clears the seabed before its last bounce; arguments see `mark_reached_samples`."""
    stretch = math.sqrt(1 + tangent * tangent)
    begin = water_depth - source if bounce_codes[family, 0] == 2 else source
    before, before_half = 0.0, 0.0
    for s in range(bounces):
        stop, half = (begin + s * water_depth) / tangent, 0.0
        if bounce_codes[family, s] == 2:
            share = min(max(stop / reach, 0.0), 1.0)
            half = math.sqrt(wavelength * reach * stretch * share * (1 - share)) * stretch / tangent
        passed = horizon_row[family, s]
        if s > 0 and bounce_codes[family, s - 1] == 2:
            m = max(math.ceil((before + before_half) / step - first), 0)
            end = min(math.floor((stop - half) / step - first) + 1, count)
            if m < end and bound[passed, m] > tangent:
                while m < end:
                    if launch[passed, m] > tangent:
                        return False
                    m += 1
        elif s > 0 or bounce_codes[family, 0] == 2:
            m = min(math.floor((stop - half) / step - first), count - 1)
            if m >= 0 and tangent > bound[passed, m]:
                return False
        before, before_half = stop, half
    return True
