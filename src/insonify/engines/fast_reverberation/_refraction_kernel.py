"""Refracted legs to the samples of radials: straight ones with corrections from a table. Plain numbers and arrays only.

The differences between a refracted ray and the straight one from its image source are small and smooth, so they are
interpolated linearly between the nodes of a coarse grid.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation import refraction_columns as column
from insonify.engines.fast_reverberation._radial_legs_kernel import (
    Facets,
    FamilyImage,
    FamilyLegs,
    RadialBearings,
    drop_unreached,
)
from insonify.engines.fast_reverberation._simd_bilinear import bilinear_columns
from insonify.engines.radial_tables import RefractionTable
from insonify.fast_exponential import exp2_nonpositive
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

_FAST = {"contract", "reassoc", "nsz", "arcp"}


class BouncingRay(NamedTuple):
    """Geometry of a ray with bounces, for its clearance of the seabed."""

    distance: float
    """Horizontal distance of the point that it reaches [m]."""
    first: float
    """Horizontal distance of its first bounce [m]."""
    period: float
    """Horizontal distance between successive bounces [m]."""
    launch_tangent: float
    """Tangent of its launch angle, positive towards the first boundary [1]."""
    grazing_tangent: float
    """Tangent of its grazing angle at the mean seabed [1]."""


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate_refraction(distance: Floats, depth: Floats, f: int, table: RefractionTable, columns: Singles) -> None:
    """Fill the columns of one family at some points, bilinearly between the nodes of the table.

    Args:
        distance: Horizontal distances of the points [m], (n,).
        depth: Depths of the points [m], (n,).
        f: Row of the family.
        table: The refraction table.
        columns: Result, `refraction_columns` of each point in turn, (at least 8 n,).
    """
    _, depths, ranges, _ = table.nodes.shape
    nodes = table.nodes[f].reshape(depths * ranges * column.COUNT)
    per_range, per_depth = 1 / table.range_spacing, 1 / table.depth_spacing
    last_range, last_depth = np.uint64(ranges - 2), np.uint64(depths - 2)
    right, below = np.uint64(column.COUNT), np.uint64(column.COUNT * ranges)
    for i in range(np.uint64(distance.size)):
        u, v = distance[i] * per_range, max((depth[i] - table.first_depth) * per_depth, 0.0)
        j, k = min(np.uint64(u), last_range), min(np.uint64(v), last_depth)
        a, b = np.float32(u - np.float64(j)), np.float32(v - np.float64(k))
        bilinear_columns(nodes, k * below + j * right, below, (a, b), columns, right * i)


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def refracted_legs(
    facets: Facets, depth: Floats, image: FamilyImage, bearings: RadialBearings, reached_families: Integers,
    columns: Singles, legs: FamilyLegs, bounce_sine: Singles,
) -> None:  # fmt: skip
    """Fill refracted legs of one family to samples of radials; see `straight_legs` for straight ones.

    Args:
        facets: Facets at the samples, (n,).
        depth: Depths of the samples [m], (n,).
        image: Image source of the family.
        bearings: Bearings of the radials.
        reached_families: Families that reach each sample, (n,); the family's bit is cleared where the facet faces away.
        columns: Result of `interpolate_refraction`, (at least 8 n,).
        legs: Result.
        bounce_sine: Result, sine of the grazing angle at the mean seabed [1], (n,).
    """
    distance = facets.distance
    delay, arrival_n, arrival_e, arrival_d, departure_n, departure_e, departure_d, pressure, _ = legs
    (cosines, sines, beam_n, beam_e), slowness, sign = bearings, image.slowness, np.float32(image.vertical_sign)
    absorption, one = np.float32(image.absorption_exponent), np.float32(1)
    for i in range(np.uint64(distance.size)):
        row = np.uint64(8) * i
        dz = depth[i] - image.depth
        length = math.sqrt(distance[i] * distance[i] + dz * dz)
        inverse = one / np.float32(length)
        delay[i] = length * slowness + columns[row + np.uint64(column.DELAY)]
        vertical = np.float32(dz) * inverse
        arrival_d[i] = min(max(vertical + columns[row + np.uint64(column.ARRIVAL)], -one), one)
        departure_d[i] = sign * min(max(vertical + columns[row + np.uint64(column.DEPARTURE)], -one), one)
        bounce_sine[i] = vertical + columns[row + np.uint64(column.GRAZING)]
        straight_pressure = inverse * exp2_nonpositive(-absorption * np.float32(length))
        pressure[i] = columns[row + np.uint64(column.PRESSURE)] * straight_pressure
    for i in range(distance.size):
        arrival, departure = (
            math.sqrt(one - arrival_d[i] * arrival_d[i]),
            math.sqrt(one - departure_d[i] * departure_d[i]),
        )
        arrival_n[i], arrival_e[i] = arrival * cosines[i], arrival * sines[i]
        departure_n[i], departure_e[i] = departure * beam_n[i], departure * beam_e[i]
    drop_unreached(facets, np.int32(1 << image.family), reached_families, legs)


@njit(cache=True, nogil=True, error_model="numpy")
def refracted_launch_slopes(
    terrain: Singles, row: int, deepest: float, step: float, start_steps: float, samples: tuple[int, int],
    table: RefractionTable, launch_slope: Singles,
) -> None:  # fmt: skip
    """Fill launch slopes of the refracted rays to the terrain at each sample of a radial.

    Args:
        terrain: Depth of the seabed [m], (at least count,).
        row: Row of the launch horizon.
        deepest: Depth of the mean seabed if the last bounce is there, from where rays rise; else infinite [m].
        step: Spacing of samples [m].
        start_steps: Horizontal distance of the first sample, in steps [1].
        samples: Index of the first sample that is needed, and count, the index after the last.
        table: The refraction table.
        launch_slope: Result, tangents [1], (at least count,); infinite without a ray, so that it occludes none.
    """
    climb, (begin, count) = table.horizon_climb[row], samples
    depths, ranges = climb.shape
    per_range, per_depth = step / table.range_spacing, 1 / table.depth_spacing
    last_range, last_depth = np.uint64(ranges - 2), np.uint64(depths - 2)
    none = np.float32(-np.inf if deepest < np.inf else np.inf)
    for k in range(np.uint64(begin), np.uint64(count)):
        steps = np.float64(k) + start_steps
        u, v = steps * per_range, max((terrain[k] - table.first_depth) * per_depth, 0.0)
        i, j = min(np.uint64(v), last_depth), min(np.uint64(u), last_range)
        a, b = np.float32(u - np.float64(j)), np.float32(v - np.float64(i))
        upper, lower = climb[i, j], climb[i + np.uint64(1), j]
        upper += a * (climb[i, j + np.uint64(1)] - upper)
        lower += a * (climb[i + np.uint64(1), j + np.uint64(1)] - lower)
        slope = (upper + b * (lower - upper)) / np.float32(steps * step)
        exists = slope == slope and terrain[k] <= deepest
        launch_slope[k] = slope if exists else none


@njit(cache=True, nogil=True, error_model="numpy")
def refracted_bounces(
    family: int, distance: float, depth: float, image: float, table: RefractionTable, work: Floats, columns: Singles
) -> BouncingRay:
    """Bounces of the refracted ray of one family to a point.

    Args:
        family: Row of the family.
        distance: Horizontal distance of the point [m].
        depth: Its depth [m].
        image: Depth of the family's image source [m].
        table: The refraction table.
        work: Working array, (2,).
        columns: Working array, (8,).
    """
    work[0], work[1] = distance, depth
    interpolate_refraction(work[:1], work[1:], family, table, columns)
    vertical = (depth - image) / math.sqrt(distance * distance + (depth - image) ** 2)
    grazing = min(max(vertical + columns[column.GRAZING], 1e-6), 1 - 1e-12)
    launch = min(max(vertical + columns[column.DEPARTURE], -1 + 1e-12), 1 - 1e-12)
    return BouncingRay(
        distance, columns[column.BOUNCE] * distance, columns[column.PERIOD] * distance,
        launch / math.sqrt(1 - launch * launch), grazing / math.sqrt(1 - grazing * grazing),
    )  # fmt: skip
