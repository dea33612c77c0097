"""Line of sight to the samples of a radial by family, by the rules of `insonify.engines.terrain_occlusion`."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation._refraction_kernel import BouncingRay, refracted_bounces
from insonify.engines.radial_tables import FamilyTable, IsovelocityChannel
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]
OCCLUDING_MARGIN = 0.98
"""Factor on heights and distances of terrain that cannot occlude, for rounding between nodes of the map [1]."""
LEAST_LENGTH_FACTOR = (27 / 4) ** 0.25
"""Least L^1.5 / (d sqrt(h)) of a leg of length L, horizontal distance d and height h [1], where d = sqrt(2) h."""


class RadialProfile(NamedTuple):
    """Terrain and launch horizons at the samples of one radial."""

    terrain: Singles
    """Depth of the terrain [m], (at least sample_count,)."""
    sample_count: int
    """Number of samples of the radial."""
    start_steps: float
    """Horizontal distance of the first sample, in steps [1]."""
    step: float
    """Spacing of samples [m]."""
    launch_slope: Singles
    """Launch slopes of `running_horizon` [1], (horizons, samples)."""
    horizon: Singles
    """Launch horizons of `running_horizon` [1], (horizons, samples)."""


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def running_horizon(
    terrain: Singles, image: float, rising: bool, step: float, start_steps: float, samples: tuple[int, int],
    launch_slope: Singles, horizon: Singles,
) -> None:  # fmt: skip
    """Fill launch slopes to the terrain at each sample of a radial, and launch horizons, as in `terrain_profiles`.

    Args:
        terrain: Depth of the seabed [m], (at least count,).
        image: Depth of the image source of a family [m].
        rising: True if the family's last bounce is at the bottom.
        step: Spacing of samples [m].
        start_steps: Horizontal distance of the first sample, in steps [1].
        samples: Index of the first sample that is needed, and count, the index after the last.
        launch_slope: Result, tangents of launch angles [1], (at least count,).
        horizon: Result, smallest tangent up to each sample, or largest from it on if `rising` [1], (at least count,).
    """
    sign = np.float32(-1.0 if rising else 1.0)
    image_depth, (begin, count) = np.float32(image), samples
    for k in range(begin, count):
        x = sign * (terrain[k] - image_depth) / np.float32((k + start_steps) * step)
        launch_slope[k] = x if x == x else sign * np.float32(np.inf)
    running_extreme(rising, samples, launch_slope, horizon)


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def running_extreme(rising: bool, samples: tuple[int, int], launch_slope: Singles, horizon: Singles) -> None:
    """Fill the launch horizons from the launch slopes; arguments are those of `running_horizon`."""
    begin, count = samples
    if rising:
        most = np.float32(-np.inf)
        for k in range(count - 1, begin - 1, -1):
            most = max(most, launch_slope[k])
            horizon[k] = most
        return
    size, part = count - begin, (count - begin) // 4
    # minima of four parts side by side, since each minimum depends on the one before; the parts are joined below
    first, second, third = np.float32(np.inf), np.float32(np.inf), np.float32(np.inf)
    fourth = np.float32(np.inf)
    slopes_1, least_1 = launch_slope[begin : begin + part], horizon[begin : begin + part]
    slopes_2, least_2 = launch_slope[begin + part : begin + 2 * part], horizon[begin + part : begin + 2 * part]
    slopes_3, least_3 = launch_slope[begin + 2 * part : begin + 3 * part], horizon[begin + 2 * part : begin + 3 * part]
    slopes_4, least_4 = launch_slope[begin + 3 * part : count], horizon[begin + 3 * part : count]
    for k in range(part):
        first, second = min(first, slopes_1[k]), min(second, slopes_2[k])
        third, fourth = min(third, slopes_3[k]), min(fourth, slopes_4[k])
        least_1[k], least_2[k], least_3[k], least_4[k] = first, second, third, fourth
    for k in range(part, size - 3 * part):
        fourth = min(fourth, slopes_4[k])
        least_4[k] = fourth
    second = min(first, second)
    third = min(second, third)
    for k in range(part):
        least_2[k] = min(least_2[k], first)
        least_3[k] = min(least_3[k], second)
    for k in range(size - 3 * part):
        least_4[k] = min(least_4[k], third)


@njit(cache=True, nogil=True, error_model="numpy")
def mark_clear_bounces(channel: IsovelocityChannel, families: FamilyTable, clear: NDArray[np.bool_]) -> None:
    """Mark the families whose rays no seabed occludes before their last bounce, at any distance.

    Seabed that rises by r occludes a ray before or behind a bottom bounce only where it is nearer to the bounce than
    r / tan(grazing). Terrain within half the length of the Fresnel zone about the bounce reflects and does not occlude:
    w L / (d tan(grazing)), with w = sqrt(wavelength L f (1 - f)) for a leg of length L, horizontally d, of which the
    fraction f = c / h lies before the bounce, c and h vertically. As L^1.5 / d is at least (27 / 4)^0.25 h^0.5, no
    seabed occludes the ray where (27 / 4)^0.25 sqrt(wavelength c (1 - f)) > r.

    Args:
        channel: Water of the straight rays, with the span of the seabed.
        families: Tables of the families.
        clear: Result, also True for families without bottom bounces, (f,).
    """
    if families.refraction.nodes.size > 0:
        clear[:] = families.refraction.clear_bounces
        return
    bounce_codes, (highest, lowest) = families.bounce_codes, channel.terrain_span
    rise = max(channel.water_depth - highest, lowest - channel.water_depth)
    for f in range(bounce_codes.shape[0]):
        height = abs(channel.water_depth - families.image_depths[f]) - rise
        climb = channel.water_depth - channel.sonar_depth if bounce_codes[f, 0] == 2 else channel.sonar_depth
        clear[f] = True
        for s in range(bounce_codes.shape[1]):
            if bounce_codes[f, s] == 2:
                max_rise = LEAST_LENGTH_FACTOR * math.sqrt(channel.wavelength * climb * max(1 - climb / height, 0.0))
                clear[f] = clear[f] and OCCLUDING_MARGIN * max_rise > rise
            climb += channel.water_depth


@njit(cache=True, nogil=True, error_model="numpy")
def mark_used_horizons(clear: NDArray[np.bool_], families: FamilyTable, used: NDArray[np.bool_]) -> None:
    """Mark the launch horizons of all segments of families; of those of `mark_clear_bounces` only of the last segment.

    Args:
        clear: Result of `mark_clear_bounces`, (f,).
        families: Tables of the families.
        used: Result, True for such launch horizons, (h,).
    """
    used[:] = False
    for f in range(clear.size):
        bounces = bounce_count(f, families)
        for s in range(bounces if clear[f] else 0, bounces + 1):
            used[families.horizon_row[f, s]] = True


@njit(inline="always")
def bounce_count(family: int, families: FamilyTable) -> int:
    """Number of bounces of a family."""
    bounces = 0
    while bounces < families.bounce_codes.shape[1] and families.bounce_codes[family, bounces] > 0:
        bounces += 1
    return bounces


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def first_occluding_sample(
    listed: int, channel: IsovelocityChannel, families: FamilyTable, used: NDArray[np.bool_]
) -> int:
    """First sample of a radial that may occlude a given one or one beyond it, by rays that do not rise from the seabed.

    In water of one sound speed a ray to a sample at distance d has at most the launch slope of the deepest seabed,
    below / d. Seabed at x has at least the slope above / x, so it occludes only from x = d above / below on.

    Args:
        listed: Index of the first sample that is evaluated.
        channel: Water of the straight rays, with the span of the seabed.
        families: Tables of the families.
        used: Result of `mark_used_horizons`, (h,).
    """
    highest, lowest = channel.terrain_span
    ratio = 1.0
    for row in range(families.horizon_image_depths.size):
        if not used[row]:
            continue
        above, below = highest - families.horizon_image_depths[row], lowest - families.horizon_image_depths[row]
        if families.horizon_rising[row] or above <= 0 or families.refraction.nodes.size > 0:
            return 0
        ratio = min(ratio, above / below)
    return max(int(OCCLUDING_MARGIN * ratio * listed) - 1, 0)


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def mark_lit_samples(
    family_bits: int, profile: RadialProfile, first: int, families: FamilyTable, clear: NDArray[np.bool_],
    lit_families: Integers,
) -> None:  # fmt: skip
    """Mark the samples of a radial that the last segment of each family of `mark_clear_bounces` reaches.

    Args:
        family_bits: Families that are requested, a bit for each.
        profile: Terrain and launch horizons along the radial.
        first: Index of the first sample that is needed.
        families: Tables of the families.
        clear: Result of `mark_clear_bounces`.
        lit_families: Result from that sample on, families that reach each sample, a bit for each, (samples,).
    """
    depth, lit = profile.terrain[first : profile.sample_count], lit_families[first : profile.sample_count]
    lit[:] = 0
    for f in range(clear.size):
        if clear[f] and family_bits & (1 << f) != 0:
            bit, row = np.int32(1 << f), families.horizon_row[f, bounce_count(f, families)]
            slope = profile.launch_slope[row, first : profile.sample_count]
            least = profile.horizon[row, first : profile.sample_count]
            for k in range(lit.size):
                lit[k] |= bit if (slope[k] <= least[k]) & (depth[k] > 0) else np.int32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def mark_reached_samples(
    family: int, reached_families: Integers, sample_number: Integers, requested_families: Integers,
    profile: RadialProfile, channel: IsovelocityChannel, families: FamilyTable,
) -> None:  # fmt: skip
    """Mark the listed samples of a radial that one family reaches; only for terrain below the sonar.

    Args:
        family: Row of the family, and the bit that is set.
        reached_families: Result, families that reach each listed sample, a bit for each, (at least m,).
        sample_number: Index of each listed sample along the radial, (m,).
        requested_families: Families requested at each listed sample, a bit for each, (m,).
        profile: Terrain and launch horizons along the radial.
        channel: Water of the straight rays.
        families: Tables of the families.
    """
    terrain, bounces, codes = profile.terrain, bounce_count(family, families), families.bounce_codes[family]
    work, columns = np.empty(2), np.empty(8, np.float32)
    bit = np.int32(1 << family)
    horizon_row = families.horizon_row[family, bounces]
    launch_slope, horizon = profile.launch_slope[horizon_row], profile.horizon[horizon_row]
    for i in range(sample_number.size):
        index = sample_number[i]
        if (requested_families[i] & bit) != 0 and launch_slope[index] <= horizon[index] and terrain[index] > 0:
            distance = (index + profile.start_steps) * profile.step
            if families.refraction.nodes.size > 0:
                ray = refracted_bounces(
                    family, distance, terrain[index], families.image_depths[family], families.refraction, work, columns
                )
            else:
                tangent = abs(terrain[index] - families.image_depths[family]) / distance
                to_boundary = channel.water_depth - channel.sonar_depth if codes[0] == 2 else channel.sonar_depth
                ray = BouncingRay(distance, to_boundary / tangent, channel.water_depth / tangent, tangent, tangent)
            if _clears_terrain(codes, families.horizon_row[family], bounces, ray, profile, channel.wavelength):
                reached_families[i] |= bit


@njit(cache=True, nogil=True, error_model="numpy")
def _clears_terrain(
    codes: Integers, horizon_row: Integers, bounces: int, ray: BouncingRay, profile: RadialProfile, wavelength: float
) -> bool:
    """Return True if a ray clears the seabed before its last bounce.

    Args:
        codes: Codes of the bounces of its family, see `FamilyTable`.
        horizon_row: Row of the launch horizon of each of its segments.
        bounces: Number of its bounces.
        ray: The ray.
        profile: See `mark_reached_samples`.
        wavelength: Acoustic wavelength [m].
    """
    launch_slope, horizon, tangent = profile.launch_slope, profile.horizon, ray.launch_tangent
    stretch = math.sqrt(1 + ray.grazing_tangent * ray.grazing_tangent)
    previous, previous_half = 0.0, 0.0
    for s in range(bounces):
        stop, half = ray.first + s * ray.period, 0.0
        if codes[s] == 2:
            fraction = min(max(stop / ray.distance, 0.0), 1.0)
            zone = wavelength * ray.distance * stretch * fraction * (1 - fraction)
            half = math.sqrt(zone) * stretch / ray.grazing_tangent
        row = horizon_row[s]
        if s > 0 and codes[s - 1] == 2:
            m = max(math.ceil((previous + previous_half) / profile.step - profile.start_steps), 0)
            end = min(math.floor((stop - half) / profile.step - profile.start_steps) + 1, profile.sample_count)
            if m < end and horizon[row, m] > tangent:
                while m < end:
                    if launch_slope[row, m] > tangent:
                        return False
                    m += 1
        elif s > 0 or codes[0] == 2:
            m = min(math.floor((stop - half) / profile.step - profile.start_steps), profile.sample_count - 1)
            if m >= 0 and tangent > horizon[row, m]:
                return False
        previous, previous_half = stop, half
    return True
