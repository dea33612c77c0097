"""Line of sight to the samples of a radial by family, by the rules of `insonify.engines.terrain_occlusion`."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.radial_tables import FamilyTable, IsovelocityChannel
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]


class RadialProfile(NamedTuple):
    """Terrain and launch horizons at the samples of one radial."""

    terrain: Singles
    """Depth of the terrain [m], (at least sample_count,)."""
    sample_count: int
    """Number of samples of the radial."""
    first: float
    """Distance of the first sample [steps]."""
    step: float
    """Distance of samples [m]."""
    launch: Singles
    """Tangents of `running_horizon`, (rows, samples)."""
    bound: Singles
    """Horizons of `running_horizon`, (rows, samples)."""


@njit(cache=True, nogil=True, error_model="numpy")
def running_horizon(terrain: Singles, image: float, rising: bool, step: float, first: float, count: int,
              launch: Singles, bound: Singles) -> None:  # fmt: skip
    """Fill launch slopes to the terrain at each sample of a radial, and launch horizons, as in `terrain_profiles`.

    Args:
        terrain: Depth of the seabed [m], (at least count,).
        image: Depth of the image source of a family [m].
        rising: True if the family's last bounce is off the bottom.
        step: Distance of samples [m].
        first: Distance of the first sample [steps].
        count: Number of samples of the radial.
        launch: Result, tangents [1], (at least count,).
        bound: Result, smallest tangent up to each sample, or largest from it on if `rising` [1], (at least count,).
    """
    sign = np.float32(-1.0 if rising else 1.0)
    image_depth = np.float32(image)
    for k in range(count):
        x = sign * (terrain[k] - image_depth) / np.float32((k + first) * step)
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
    family: int, reached: Integers, sample: Integers, requested: Integers, profile: RadialProfile,
    channel: IsovelocityChannel, families: FamilyTable,
) -> None:  # fmt: skip
    """Mark the listed samples of a radial that one family reaches; only for terrain below the sonar.

    Args:
        family: Row of the family, and the bit that is set.
        reached: Result, families that reach each listed sample, a bit for each, (at least m,).
        sample: Number of each listed sample along the radial, (m,).
        requested: Families requested at each listed sample, a bit for each, (m,).
        profile: Terrain and launch horizons along the radial.
        channel: Water of the straight rays.
        families: Tables of the families.
    """
    bounce_codes, terrain = families.bounce_codes, profile.terrain
    bounces = 0
    while bounces < bounce_codes.shape[1] and bounce_codes[family, bounces] > 0:
        bounces += 1
    bit, none = np.int32(1 << family), np.int32(0)
    direct = bounces == 0 or (bounces == 1 and bounce_codes[family, 0] == 1)  # a rising ray clears the seabed
    horizon = families.horizon_row[family, bounces]
    launch, bound = profile.launch[horizon], profile.bound[horizon]
    for i in range(sample.size if direct else 0):
        k = np.uint32(sample[i])
        unobstructed = (launch[k] <= bound[k]) & (terrain[k] > 0)
        reached[i] |= requested[i] & (bit if unobstructed else none)
    for i in range(0 if direct else sample.size):
        index = sample[i]
        if (requested[i] & bit) != 0 and launch[index] <= bound[index] and terrain[index] > 0:
            reach = (index + profile.first) * profile.step
            tangent = abs(terrain[index] - families.images[family]) / reach
            if _clears_terrain(family, bounces, reach, tangent, profile, channel, families):
                reached[i] |= bit


@njit(cache=True, nogil=True, error_model="numpy")
def _clears_terrain(
    family: int, bounces: int, reach: float, tangent: float, profile: RadialProfile, channel: IsovelocityChannel,
    families: FamilyTable,
) -> bool:  # fmt: skip
    """Return True if a ray clears the seabed before its last bounce.

    Args:
        family: Row of the family.
        bounces: Number of its bounces.
        reach: Horizontal distance of the end of the ray [m].
        tangent: Tangent of its grazing angle [1].
        profile: See `mark_reached_samples`.
        channel: Water of the straight rays.
        families: Tables of the families.
    """
    codes, launch, bound = families.bounce_codes[family], profile.launch, profile.bound
    stretch = math.sqrt(1 + tangent * tangent)
    begin = channel.water_depth - channel.source if codes[0] == 2 else channel.source
    before, before_half = 0.0, 0.0
    for s in range(bounces):
        stop, half = (begin + s * channel.water_depth) / tangent, 0.0
        if codes[s] == 2:
            fraction = min(max(stop / reach, 0.0), 1.0)
            half = math.sqrt(channel.wavelength * reach * stretch * fraction * (1 - fraction)) * stretch / tangent
        horizon = families.horizon_row[family, s]
        if s > 0 and codes[s - 1] == 2:
            m = max(math.ceil((before + before_half) / profile.step - profile.first), 0)
            end = min(math.floor((stop - half) / profile.step - profile.first) + 1, profile.sample_count)
            if m < end and bound[horizon, m] > tangent:
                while m < end:
                    if launch[horizon, m] > tangent:
                        return False
                    m += 1
        elif s > 0 or codes[0] == 2:
            m = min(math.floor((stop - half) / profile.step - profile.first), profile.sample_count - 1)
            if m >= 0 and tangent > bound[horizon, m]:
                return False
        before, before_half = stop, half
    return True
