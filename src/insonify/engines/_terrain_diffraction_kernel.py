"""Crests of the seabed along lines, and diffraction over them. Plain numbers and arrays only.

A crest is terrain behind which terrain lies hidden. It acts as a knife edge, less so the shallower the hollow behind
it: one that is shallow against a Fresnel zone is filled by diffraction, and its rim takes nothing.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit
from insonify.propagation.knife_edge_kernel import ENDLESS, crest_diffraction_factor, crest_is_negligible

Floats = NDArray[np.floating[Any]]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
Rows = NDArray[np.int32]

MAX_CRESTS = 4
"""Crests that are looked at before a point: the nearest ones that stand out."""

NEGLIGIBLE_CHANGE = 1e-3
"""Largest change of the pressure by a crest that is neglected: 60 dB below what passes it [1]."""


class LaunchHorizon(NamedTuple):
    """Launch horizon along some lines, see `find_crests`."""

    launch: Floats
    """Launch that reaches the seabed at each sample, shape (lines, samples)."""
    bound: Floats
    """Launch horizon: the smallest up to each sample; of families that rise, the largest from it on."""
    crest: Rows
    """Number of the last crest, -1 for none."""
    crests: Floats
    """Sample, launch, depth behind and reach of each crest, shape (lines, crests, 4)."""


class LineRays(NamedTuple):
    """Rays over the seabed of some lines, to some of n points."""

    rows: Integers
    """Line of each point, (points,)."""
    points: Integers
    """Indices of the points, (points,)."""
    steepness: Floats
    """Launch slopes of the rays; not read where they end on the seabed, (n,)."""
    distance: Floats
    """Horizontal length of the whole leg [m], (n,)."""
    visible: NDArray[np.bool_]
    """False where the seabed hides the point, (n,)."""
    left: Complexes
    """Product of the factors of crests on the pressure [1], (n,)."""


class CrestRay(NamedTuple):
    """One ray that passes crests."""

    sense: float
    """1 for rays that come down on the seabed, -1 for those that rise."""
    launch: float
    """Launch slope of the ray."""
    end: float
    """Sample from which on no terrain is hidden."""
    distance: float
    """Horizontal length of the whole leg [m]."""


@njit(cache=True, nogil=True, error_model="numpy")
def find_crests(
    launch: Floats, distance: Floats, rising: bool, wavelength: float, bound: Floats, last_crest: Rows, crests: Floats
) -> None:
    """Launch horizons, and crests along them: samples at which a horizon stops sinking, and the depth of the hollows.

    Args:
        launch: Launch that reaches the seabed at each sample, (s, n); where none does, one that hides nothing.
        distance: Distances of the samples, evenly from the first on [m], (n,).
        rising: True if rays rise from a bounce: profiles are then processed inwards, and terrain above a ray occludes.
        wavelength: Acoustic wavelength [m].
        bound: Result, smallest launch up to each sample; of rays that rise, the largest from it on, (s, n).
        last_crest: Result, number of the last crest up to each sample, -1 for none, (s, n).
        crests: Result, for each crest in the order of processing: its sample, its launch, the greatest depth of the
            terrain behind it below the ray over it [m], and `negligible_beyond` [m], (s, n // 2 + 1, 4).
    """
    count, sense = launch.shape[1], np.float32(-1 if rising else 1)
    never = np.float32(np.inf)
    for s in range(launch.shape[0]):
        lowest, at, last, in_shadow, deep = never, -1, -1, False, np.float32(0)
        for j in range(count):
            k = count - 1 - j if rising else j
            value = sense * launch[s, k]
            if not -never < value < never:
                launch[s, k] = sense * never
            elif value <= lowest:
                if in_shadow:
                    crests[s, last, 2], in_shadow = deep, False
                lowest, at = value, k
            else:
                if not in_shadow:
                    last, deep, in_shadow = last + 1, np.float32(0), True
                    crests[s, last, 0], crests[s, last, 1] = at, sense * lowest
                deep = max(deep, (value - lowest) * distance[k])
            bound[s, k], last_crest[s, k] = sense * lowest, last
        if in_shadow:
            crests[s, last, 2] = deep
        for number in range(last + 1):
            crest_distance = float(distance[int(crests[s, number, 0])])
            crests[s, number, 3] = negligible_beyond(crest_distance, float(crests[s, number, 2]), wavelength)


@njit(cache=True, nogil=True, error_model="numpy")
def negligible_beyond(distance: float, hollow_depth: float, wavelength: float) -> float:
    """Horizontal distance from which on a crest changes rays that clear it by less than `NEGLIGIBLE_CHANGE` [m].

    The hollow behind it is too shallow for the Fresnel zone, however near it a ray passes, see
    `insonify.propagation.knife_edge_kernel.crest_is_negligible`.

    Args:
        distance: Distance of the crest [m].
        hollow_depth: Depth of the hollow [m].
        wavelength: Acoustic wavelength [m].
    """
    left = (
        0.999 * 2 * NEGLIGIBLE_CHANGE * wavelength / (2 * math.pi * max(hollow_depth * hollow_depth, 1e-30))
        - 1 / distance
    )
    return distance + max(1 / left, wavelength) if left > 0 else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def surely_unobstructed(depth: Floats, distance: Floats, image: np.float32, step: int) -> bool:
    """Return True if launch angles from an image of the sonar surely steepen with distance: no terrain is hidden.

    Args:
        depth: Depth of the seabed at the samples [m], (s, n).
        distance: Distances of the samples [m], (n,).
        image: Depth of the image [m]; terrain above it is not evaluated.
        step: Samples that are looked at before it is evaluated whether that was enough.
    """
    rounding_margin = np.float32(1 + 1e-6)  # above the rounding error of a product or a quotient
    for s in range(depth.shape[0]):
        for first in range(0, depth.shape[1] - 1, step):
            end = min(first + step, depth.shape[1] - 1)
            near_depth, far_depth = depth[s, first:end], depth[s, first + 1 : end + 1]
            near_distance, far_distance = distance[first:end], distance[first + 1 : end + 1]
            sinks = 0
            for k in range(near_distance.size):  # NaN where the depth is unknown: then nothing is certain
                low, high = near_depth[k] - image, far_depth[k] - image
                sinks += (high * near_distance[k] * rounding_margin <= low * far_distance[k]) & (low > 0) & (high > 0)
            if sinks < near_distance.size:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def diffract_over_crests(
    horizon: LaunchHorizon, step: float, rays: LineRays, reach: Floats, wavelength: float, table: Complexes,
    on_terrain: bool, soft: bool,
) -> None:  # fmt: skip
    """Multiply what crests leave of rays over the seabed into `rays.left`, and mark points that the seabed hides.

    Args:
        horizon: Launch horizon along the lines.
        step: Distance of samples [m].
        rays: The rays; hidden points are marked where rays end on the seabed.
        reach: Distance [m] up to which the seabed can cut, (all,).
        wavelength: Acoustic wavelength [m].
        table: See `insonify.propagation.knife_edge_kernel.edge_diffraction`.
        on_terrain: True if rays end on the seabed of the lines: between samples it is as linear as the launches to it.
        soft: True if sound bends around crests.
    """
    launch, lowest, last_crest, crests = horizon
    rows, points, steepness, distance, visible, left = rays
    last, per_step = launch.shape[1] - 2, 1 / step
    for m in range(points.size):
        n, s = points[m], rows[m]
        steps = min(reach[n] * per_step, last + 2.0)
        k = min(int(steps) - 1, last)
        if k < 0:
            continue
        launch_slope, at, blocking_sample = launch[s, k], last_crest[s, k], -1
        if on_terrain:
            slope = float(launch_slope + min(steps - (k + 1), 1.0) * (launch[s, k + 1] - launch_slope))
            # the launch horizon is the seabed itself, or the launch over the last crest
            if slope > (launch_slope if at < 0 else min(launch_slope, crests[s, at, 1])):
                visible[n], at = False, last_crest[s, k + 1]
        else:
            slope = float(steepness[n])
            if slope > lowest[s, k] and launch_slope <= lowest[s, k]:
                blocking_sample = k  # it dips into ground that still rises
        if soft and (at >= 0 or blocking_sample >= 0):
            ray = CrestRay(1.0, slope, ENDLESS, distance[n])
            left[n] *= strongest_crest_factor(horizon, s, at, blocking_sample, ray, step, wavelength, table)


@njit(cache=True, nogil=True, error_model="numpy")
def diffract_rising_rays(
    horizon: LaunchHorizon, step: float, rays: LineRays, start: Floats, stop: Floats, wavelength: float,
    table: Complexes,
) -> None:  # fmt: skip
    """Multiply what crests leave of rays that rise from a bounce into `rays.left`.

    Args:
        horizon: Launch horizon along the lines.
        step: Distance of samples [m].
        rays: The rays, with True in `visible` if this segment of each clears the seabed.
        start: Distance in steps from which the ray is looked at, (all,).
        stop: Distance at which it ends, (all,).
        wavelength: Acoustic wavelength [m].
        table: See `diffract_over_crests`.
    """
    launch, last_crest = horizon.launch, horizon.crest
    rows, points, steepness, distance, visible, left = rays
    for m in range(points.size):
        n, s = points[m], rows[m]
        first, end = max(math.ceil(start[n]) - 1, 0), min(math.floor(stop[n]), launch.shape[1])
        if first >= end:
            continue
        slope, blocking_sample = float(steepness[n]), -1
        if not visible[n] and launch[s, first] > slope:
            blocking_sample = first  # it rises out of the seabed itself
        ray = CrestRay(-1.0, slope, float(end), distance[n])
        left[n] *= strongest_crest_factor(
            horizon, s, last_crest[s, first], blocking_sample, ray, step, wavelength, table
        )


@njit(cache=True, nogil=True, error_model="numpy")
def strongest_crest_factor(
    horizon: LaunchHorizon, s: int, last: int, blocking_sample: int, ray: CrestRay, step: float, wavelength: float,
    table: Complexes,
) -> complex:  # fmt: skip
    """Factor of the crest that reduces one ray most [1].

    Args:
        horizon: Launch horizon along the lines.
        s: Line of the ray.
        last: Number of the first crest to look at, -1 for none.
        blocking_sample: Sample of ground that cuts without being a crest, -1 for none.
        ray: The ray.
        step: Distance of samples [m].
        wavelength: Acoustic wavelength [m].
        table: See `diffract_over_crests`.
    """
    launch, crests = horizon.launch, horizon.crests
    sense, slope, end, distance = ray
    stretch, factor, max_change = math.sqrt(1 + slope * slope), 1 + 0j, 0.0
    length, cosine = distance * stretch, 1 / stretch
    if blocking_sample >= 0:
        reach = (blocking_sample + 1) * step
        high = sense * (slope - launch[s, blocking_sample]) * reach * cosine
        factor = crest_diffraction_factor(high, ENDLESS, length - reach * stretch, length, wavelength, table)
        max_change = (1 - factor.real) ** 2 + factor.imag**2
    for number in range(last, max(last - MAX_CRESTS, -1), -1):
        at, above = float(crests[s, number, 0]), sense * (slope - crests[s, number, 1])
        if at >= end:
            break
        if above < 0 and distance > crests[s, number, 3]:
            continue
        reach = (at + 1) * step
        clear, hollow_depth, behind = (
            above * reach * cosine, crests[s, number, 2] * cosine, length - reach * stretch,
        )  # fmt: skip
        if clear < 0 and crest_is_negligible(
            -clear, hollow_depth, behind, length, wavelength, max(NEGLIGIBLE_CHANGE * NEGLIGIBLE_CHANGE, max_change)
        ):
            continue
        left = crest_diffraction_factor(clear, hollow_depth, behind, length, wavelength, table)
        differs = (1 - left.real) ** 2 + left.imag**2
        if differs > max_change:
            factor, max_change = left, differs
    return factor
