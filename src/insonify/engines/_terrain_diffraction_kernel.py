"""Crests of the seabed along terrain profiles (lines), and diffraction over them. Plain numbers and arrays only.

A crest is terrain that hides terrain behind it. It acts as a knife edge, with a weight that falls with the depth of the
hollow behind it: a hollow that is shallow against a Fresnel zone causes no diffraction loss, see
`insonify.propagation.knife_edge_kernel.crest_diffraction_factor`.

Sample j of a line lies (j + 1) steps from the sonar. Of two rays that descend, the one of smaller launch slope passes
above the other; of two that rise from a bounce, the one of greater.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines._prefetch import prefetch
from insonify.jit import njit
from insonify.propagation.knife_edge_kernel import (
    ENDLESS,
    crest_is_negligible,
    edge_fresnel_number,
    trough_exponent,
    weighted_crest_factor,
)

Floats = NDArray[np.floating[Any]]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
Rows = NDArray[np.int32]

MAX_CRESTS = 4
"""Largest number of crests before a point that are evaluated, from the last one back towards the sonar [1]."""

CREST = np.dtype(
    [("sample", "i4"), ("launch_slope", "f4"), ("trough_depth", "f4"), ("negligible_beyond", "f4")],
)
"""One crest: its sample; the launch slope of the ray that touches it [1]; the greatest depth of the terrain behind it
below that ray [m]; the distance from which on it has no effect on clear rays, see `negligible_beyond` [m]."""

CANDIDATES = 128
"""Capacity of the arrays of crests that are evaluated together [1]."""
_HEIGHT, _TROUGH, _BEHIND, _LENGTH, _NUMBER, _EXPONENT, _REAL, _IMAG = (np.uint64(k * CANDIDATES) for k in range(8))
"""Offsets of the columns of `CrestCandidates`: height of each crest above its ray (negative below it), depth of the
hollow behind it, distance from it to the end of the leg, length of the leg [m]; its Fresnel number, exponent of its
weight, and real and imaginary part of its factor [1]."""
RAYS_AHEAD = 12
"""Number of rays between the one that is evaluated and the one whose samples are prefetched [1]."""
NEGLIGIBLE_CHANGE = 1e-3
"""Largest change of the pressure by a crest that is neglected: 60 dB below the pressure that passes it [1]."""


class LaunchHorizon(NamedTuple):
    """Launch horizon along some lines, see `launch_horizon`."""

    launch_slope: Floats
    """Launch slope of the ray that reaches the seabed at each sample [1], shape (lines, samples)."""
    horizon: Floats
    """Smallest launch slope up to each sample; of rays that rise, largest from it on [1], shape (lines, samples)."""
    last_crest: Rows
    """Index in `crests` of the last crest up to each sample, -1 for none, shape (lines, samples)."""
    crests: NDArray[Any]
    """Crests, dtype `CREST`, in the order in which the profile is processed, shape (lines, crests)."""


class LineRays(NamedTuple):
    """Rays over the seabed of some lines, to m of n points.

    The columns of the points have n rows; `points` selects m of them.
    """

    lines: Integers
    """Line of each selected point, (m,)."""
    points: Integers
    """Indices of the selected points, (m,)."""
    launch_slope: Floats
    """Launch slopes of the rays [1], (n,); `occlude_terrain_points` does not read them."""
    distance: Floats
    """Horizontal length of the whole leg, for the Fresnel zone [m], (n,)."""
    visible: NDArray[np.bool_]
    """False where the seabed hides the point, (n,); set, or read, as the function states."""
    diffraction_factor: Complexes
    """Factor of diffraction over crests on the one-way pressure [1], (n,); multiplied in place."""


class CrestRay(NamedTuple):
    """One ray that passes crests."""

    line: int
    """Index of the line that it follows."""
    point: int
    """Index of the point that it reaches."""
    sign: float
    """1 for rays that descend to the seabed, -1 for those that rise from a bounce [1]."""
    launch_slope: float
    """Launch slope of the ray [1]."""
    end_sample: float
    """Sample at which the ray ends; crests from it on are left out."""
    distance: float
    """Horizontal length of the whole leg [m]."""


class CrestCandidates(NamedTuple):
    """Crests that may change the pressure of rays, those of one ray together."""

    columns: Floats
    """Columns from `_HEIGHT` on, one after the other, (8 * CANDIDATES,)."""
    points: Integers
    """Index of the point that the ray over each crest reaches, (CANDIDATES,)."""


@njit(cache=True, nogil=True, error_model="numpy")
def launch_horizon(launch_slope: Floats, distance: Floats, rising: bool, wavelength: float) -> LaunchHorizon:
    """Launch horizon along lines, and crests: samples at which it stops falling, with the depth of the hollows behind.

    Args:
        launch_slope: Launch slope of the ray that reaches the seabed at each sample [1], (lines, samples); NaN and
            infinity are overwritten by a slope that hides nothing.
        distance: Distances of the samples, evenly spaced from one step on [m], (samples,).
        rising: True if rays rise from a bounce; a profile is then processed inwards, with slopes of opposite sign.
        wavelength: Acoustic wavelength [m].
    """
    lines, count = launch_slope.shape
    sign, never = np.float32(-1 if rising else 1), np.float32(np.inf)
    horizon, last_crest = np.empty_like(launch_slope), np.empty((lines, count), np.int32)
    crests = np.empty((lines, count // 2 + 1), CREST)
    for s in range(lines):
        lowest, crest_sample, last, in_shadow, trough_depth = never, -1, -1, False, np.float32(0)
        for j in range(count):
            k = count - 1 - j if rising else j
            slope = sign * launch_slope[s, k]
            if not -never < slope < never:
                launch_slope[s, k] = sign * never
            elif slope <= lowest:
                if in_shadow:
                    crests[s, last].trough_depth, in_shadow = trough_depth, False
                lowest, crest_sample = slope, k
            else:
                if not in_shadow:
                    last, trough_depth, in_shadow = last + 1, np.float32(0), True
                    crests[s, last].sample, crests[s, last].launch_slope = crest_sample, sign * lowest
                trough_depth = max(trough_depth, (slope - lowest) * distance[k])
            horizon[s, k], last_crest[s, k] = sign * lowest, last
        if in_shadow:
            crests[s, last].trough_depth = trough_depth
        for crest in range(last + 1):
            crest_distance = float(distance[crests[s, crest].sample])
            crests[s, crest].negligible_beyond = negligible_beyond(
                crest_distance, float(crests[s, crest].trough_depth), wavelength
            )
    return LaunchHorizon(launch_slope, horizon, last_crest, crests)


@njit(cache=True, nogil=True, error_model="numpy")
def negligible_beyond(distance: float, trough_depth: float, wavelength: float) -> float:
    """Horizontal length of a leg beyond which a crest changes clear rays by less than `NEGLIGIBLE_CHANGE` [m].

    The hollow behind it is then shallow against the Fresnel zone, for any clear ray, see
    `insonify.propagation.knife_edge_kernel.crest_is_negligible`.

    Args:
        distance: Horizontal distance of the crest from the sonar [m].
        trough_depth: Depth of the hollow behind it [m].
        wavelength: Acoustic wavelength [m].
    """
    # the change is negligible while 1 / distance before + 1 / distance behind stays below the first term
    inverse_distance_behind = (
        0.999 * 2 * NEGLIGIBLE_CHANGE * wavelength / (2 * math.pi * max(trough_depth * trough_depth, 1e-30))
        - 1 / distance
    )
    return distance + max(1 / inverse_distance_behind, wavelength) if inverse_distance_behind > 0 else np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def surely_unobstructed(depth: Floats, distance: Floats, image: np.float32, step: int) -> bool:
    """Return True if no terrain is hidden from straight rays: the launch slope surely falls from sample to sample.

    The ray to a sample cuts nearer terrain of smaller launch slope. False where the depth is unknown, or the terrain is
    not below the image.

    Args:
        depth: Depth of the seabed at the samples [m], (lines, samples).
        distance: Distances of the samples [m], (samples,).
        image: Depth of the image of the sonar from which the rays are straight [m].
        step: Number of samples that are tested before the loop may end early.
    """
    rounding_margin = np.float32(1 + 1e-6)  # above the rounding error of a product or a quotient
    for s in range(depth.shape[0]):
        for first in range(0, depth.shape[1] - 1, step):
            end = min(first + step, depth.shape[1] - 1)
            near_depth, far_depth = depth[s, first:end], depth[s, first + 1 : end + 1]
            near_distance, far_distance = distance[first:end], distance[first + 1 : end + 1]
            falls = 0
            for k in range(near_distance.size):  # NaN where the depth is unknown: then nothing is certain
                near, far = near_depth[k] - image, far_depth[k] - image
                falls += (far * near_distance[k] * rounding_margin <= near * far_distance[k]) & (near > 0) & (far > 0)
            if falls < near_distance.size:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def falls_within(depth: Floats, largest_fall: Floats) -> bool:
    """Return True if the seabed nowhere falls by more than a limit from one sample of a line to the next.

    Args:
        depth: Depth of the seabed at the samples [m], (lines, samples); False where it is unknown.
        largest_fall: Limit from each sample to the next [m], (samples - 1 or more,).
    """
    for s in range(depth.shape[0]):
        near, far, within = depth[s, :-1], depth[s, 1:], 0
        for k in range(near.size):
            within += far[k] - near[k] <= largest_fall[k]
        if within < near.size:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def occlude_terrain_points(
    horizon: LaunchHorizon, step: float, rays: LineRays, reach: Floats, wavelength: float, table: Complexes, soft: bool
) -> None:
    """Set `rays.visible` False for points of the seabed that it hides; multiply the factors of crests before them.

    The launch slope of the ray to a point is interpolated linearly between the samples of its line, so
    `rays.launch_slope` is not read.

    Args:
        horizon: Launch horizon along the lines.
        step: Distance between samples [m].
        rays: The rays; all end on the seabed of their lines.
        reach: Horizontal distance at which each ends [m], (n,).
        wavelength: Acoustic wavelength [m].
        table: Table of the field of a half plane, see `insonify.propagation.knife_edge_kernel.edge_diffraction`.
        soft: True: evaluate diffraction over crests; False: mark hidden points alone.
    """
    terrain_slope, _, last_crest, crests = horizon
    lines, points, _, distance, visible, factor = rays
    last, per_step, count = terrain_slope.shape[1] - 2, 1 / step, 0
    candidates = CrestCandidates(np.empty(8 * CANDIDATES), np.empty(CANDIDATES, np.int64))
    width = np.uint64(terrain_slope.shape[1])
    flat_slope, flat_crest = terrain_slope.reshape(terrain_slope.size), last_crest.reshape(last_crest.size)
    for m in range(points.size):
        ahead = min(m + RAYS_AHEAD, points.size - 1)
        sample = min(max(reach[points[ahead]] * per_step - 1.0, 0.0), float(last))
        at = np.uint64(lines[ahead]) * width + np.uint64(sample)
        prefetch(flat_slope, at)
        prefetch(flat_crest, at)
        n, s = points[m], lines[m]
        steps = min(reach[n] * per_step, last + 2.0)
        k = min(int(steps) - 1, last)
        if k < 0:
            continue
        slope_before, crest = terrain_slope[s, k], last_crest[s, k]
        slope = float(slope_before + min(steps - (k + 1), 1.0) * (terrain_slope[s, k + 1] - slope_before))
        # the launch horizon is the seabed itself, or the launch slope over the last crest
        if slope > (slope_before if crest < 0 else min(slope_before, crests[s, crest].launch_slope)):
            visible[n], crest = False, last_crest[s, k + 1]
        if soft and crest >= 0:
            ray = CrestRay(s, n, 1.0, slope, ENDLESS, distance[n])
            count = add_candidates(horizon, crest, -1, ray, step, wavelength, candidates, count)
            if count > CANDIDATES - MAX_CRESTS:
                multiply_strongest_crests(candidates, count, wavelength, table, factor)
                count = 0
    multiply_strongest_crests(candidates, count, wavelength, table, factor)


@njit(cache=True, nogil=True, error_model="numpy")
def diffract_over_crests(
    horizon: LaunchHorizon, step: float, rays: LineRays, reach: Floats, wavelength: float, table: Complexes
) -> None:
    """Multiply `rays.diffraction_factor` by those of crests that rays pass before a point that is not on the seabed.

    Args:
        horizon: Launch horizon along the lines.
        step: Distance between samples [m].
        rays: The rays; `visible` is not used.
        reach: Horizontal distance up to which the seabed can cut the ray [m], (n,).
        wavelength: Acoustic wavelength [m].
        table: See `occlude_terrain_points`.
    """
    terrain_slope, lowest, last_crest, _ = horizon
    lines, points, launch_slope, distance, _, factor = rays
    last, per_step = terrain_slope.shape[1] - 2, 1 / step
    candidates = CrestCandidates(np.empty(8 * CANDIDATES), np.empty(CANDIDATES, np.int64))
    for m in range(points.size):
        n, s = points[m], lines[m]
        k = min(int(min(reach[n] * per_step, last + 2.0)) - 1, last)
        if k < 0:
            continue
        slope, blocking_sample = float(launch_slope[n]), -1
        if slope > lowest[s, k] and terrain_slope[s, k] <= lowest[s, k]:
            blocking_sample = k  # it enters terrain where the launch horizon still falls: no crest yet
        ray = CrestRay(s, n, 1.0, slope, ENDLESS, distance[n])
        count = add_candidates(horizon, last_crest[s, k], blocking_sample, ray, step, wavelength, candidates, 0)
        multiply_strongest_crests(candidates, count, wavelength, table, factor)


@njit(cache=True, nogil=True, error_model="numpy")
def diffract_rising_rays(
    horizon: LaunchHorizon, step: float, rays: LineRays, start: Floats, stop: Floats, wavelength: float,
    table: Complexes,
) -> None:  # fmt: skip
    """Multiply `rays.diffraction_factor` by those of crests that rays pass as they rise from a bounce.

    Args:
        horizon: Launch horizon along the lines, of rays that rise.
        step: Distance between samples [m].
        rays: The rays; `visible` is True where this segment of the ray clears the seabed.
        start: Horizontal distance from which the ray is tested [steps], (n,).
        stop: Horizontal distance at which it ends [steps], (n,).
        wavelength: Acoustic wavelength [m].
        table: See `occlude_terrain_points`.
    """
    terrain_slope, last_crest = horizon.launch_slope, horizon.last_crest
    lines, points, launch_slope, distance, visible, factor = rays
    candidates = CrestCandidates(np.empty(8 * CANDIDATES), np.empty(CANDIDATES, np.int64))
    for m in range(points.size):
        n, s = points[m], lines[m]
        first, end = max(math.ceil(start[n]) - 1, 0), min(math.floor(stop[n]), terrain_slope.shape[1])
        if first >= end:
            continue
        slope, blocking_sample = float(launch_slope[n]), -1
        if not visible[n] and terrain_slope[s, first] > slope:
            blocking_sample = first  # the ray lies below the terrain at the first sample tested
        ray = CrestRay(s, n, -1.0, slope, float(end), distance[n])
        count = add_candidates(horizon, last_crest[s, first], blocking_sample, ray, step, wavelength, candidates, 0)
        multiply_strongest_crests(candidates, count, wavelength, table, factor)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def add_candidates(
    horizon: LaunchHorizon, last: int, blocking_sample: int, ray: CrestRay, step: float, wavelength: float,
    candidates: CrestCandidates, count: int,
) -> int:  # fmt: skip
    """Add the crests that may change one ray to the candidates, and return their new number.

    Args:
        horizon: Launch horizon along the lines.
        last: Index of the crest nearest to the point, -1 for none; up to `MAX_CRESTS` from it back are added.
        blocking_sample: Sample of terrain that cuts the ray without being a crest, -1 for none.
        ray: The ray.
        step: Distance between samples [m].
        wavelength: Acoustic wavelength [m].
        candidates: Changed: the crests are appended.
        count: Number of candidates before the call.
    """
    crests, (columns, points) = horizon.crests, candidates
    s, point, sign, slope, end_sample, distance = ray
    stretch = math.sqrt(1 + slope * slope)
    length, cosine = distance * stretch, 1 / stretch
    if blocking_sample >= 0:
        before, at = (blocking_sample + 1) * step, np.uint64(count)
        columns[_HEIGHT + at] = sign * (slope - horizon.launch_slope[s, blocking_sample]) * before * cosine
        columns[_TROUGH + at], columns[_BEHIND + at] = ENDLESS, length - before * stretch
        columns[_LENGTH + at], points[at] = length, point
        count += 1
    for number in range(last, max(last - MAX_CRESTS, -1), -1):
        crest = crests[s, number]
        sample, slope_below = float(crest.sample), sign * (slope - crest.launch_slope)
        if sample >= end_sample:
            break
        if slope_below < 0 and distance > crest.negligible_beyond:
            continue
        before = (sample + 1) * step
        height, trough_depth, behind = (
            slope_below * before * cosine, crest.trough_depth * cosine, length - before * stretch,
        )  # fmt: skip
        if height < 0 and crest_is_negligible(
            -height, trough_depth, behind, length, wavelength, NEGLIGIBLE_CHANGE * NEGLIGIBLE_CHANGE
        ):
            continue
        at = np.uint64(count)
        columns[_HEIGHT + at], columns[_TROUGH + at] = height, trough_depth
        columns[_BEHIND + at], columns[_LENGTH + at], points[at] = behind, length, point
        count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def multiply_strongest_crests(
    candidates: CrestCandidates, count: int, wavelength: float, table: Complexes, factor: Complexes
) -> None:
    """Multiply the factor of each ray by that of the crest among its candidates that changes it most.

    Factors are those of `insonify.propagation.knife_edge_kernel.crest_diffraction_factor`, computed column by column.

    Args:
        candidates: From `add_candidates`; the columns from `_NUMBER` on are overwritten.
        count: Number of candidates.
        wavelength: Acoustic wavelength [m].
        table: See `occlude_terrain_points`.
        factor: Pressure factor of each point [1], multiplied in place, (n,).
    """
    columns, points = candidates
    for i in range(np.uint64(count)):
        height, trough_depth, behind, length = (
            columns[_HEIGHT + i],
            columns[_TROUGH + i],
            columns[_BEHIND + i],
            columns[_LENGTH + i],
        )
        columns[_NUMBER + i] = edge_fresnel_number(height, behind, length, wavelength)
        columns[_EXPONENT + i] = trough_exponent(trough_depth, behind, length, wavelength)
    for i in range(np.uint64(count)):
        past = weighted_crest_factor(columns[_NUMBER + i], columns[_EXPONENT + i], columns[_TROUGH + i], table)
        columns[_REAL + i], columns[_IMAG + i] = past.real, past.imag
    last, strongest, max_change = np.int64(-1), 1 + 0j, 0.0
    for i in range(np.uint64(count)):
        if points[i] != last:
            if last >= 0:
                factor[last] *= strongest
            last, strongest, max_change = points[i], 1 + 0j, 0.0
        real, imag = columns[_REAL + i], columns[_IMAG + i]
        change = (1 - real) ** 2 + imag**2
        if change > max_change:
            strongest, max_change = complex(real, imag), change
    if last >= 0:
        factor[last] *= strongest
