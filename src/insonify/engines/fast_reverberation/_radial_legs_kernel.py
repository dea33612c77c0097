"""Straight legs to the samples of radials: delay, directions, pressure, normals. Plain numbers and arrays only."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.fast_exponential import exp2_nonpositive
from insonify.jit import njit

Floats = NDArray[np.float64]
Integers = NDArray[Any]
Singles = NDArray[np.float32]

_FAST = {"contract", "reassoc", "nsz", "arcp"}


class Facets(NamedTuple):
    """Planes tangential to the seabed at n samples of radials, each column of shape (n,)."""

    distance: Floats
    """Horizontal distance from the sonar [m]."""
    along: Singles
    """Slope along the frame's first axis, positive upwards [1]."""
    across: Singles
    """Slope along its second axis [1]."""
    normal_n: Singles
    """North component of the unit normal into the water."""
    normal_e: Singles
    """East component."""
    normal_d: Singles
    """Down component."""
    area: Singles
    """Area of seabed that the sample represents, if all samples of its radial are evaluated [m^2]."""


class FamilyImage(NamedTuple):
    """Image source of one family, and the water of its straight rays."""

    depth: float
    """Depth of the image source [m]."""
    slowness: float
    """One over the speed of sound [s/m]."""
    absorption_exponent: float
    """Absorption as the base-2 exponent of pressure [1/m]."""
    vertical_sign: float
    """Sign of the vertical direction at the sonar re that at the sample: -1 for an odd number of bounces, else 1."""
    family: int
    """Row of the family, and its bit in columns of families."""


class RadialBearings(NamedTuple):
    """Bearings of the radials of n samples, and those at which the beams are evaluated at the samples."""

    cosine: Singles
    """Cosine of the bearing, (n,)."""
    sine: Singles
    """Sine of the bearing, (n,)."""
    beam_n: Singles
    """North component of the bearing for the beams [1], (n,)."""
    beam_e: Singles
    """East component [1], (n,)."""


class FamilyLegs(NamedTuple):
    """Legs of one family to n samples, each column of shape (n,)."""

    delay: Floats
    """Travel time [s]."""
    arrival_n: Singles
    """Direction of travel at the sample, north component [1]."""
    arrival_e: Singles
    """East component [1]."""
    arrival_d: Singles
    """Down component [1]."""
    departure_n: Singles
    """Direction of travel at the sonar, north component [1]."""
    departure_e: Singles
    """East component [1]."""
    departure_d: Singles
    """Down component [1]."""
    pressure: Singles
    """Pressure re the source at 1 m without reflection coefficients, 0 where there is no leg [1]."""
    root_slant: Singles
    """Root of one less the sine of the facet's grazing angle [1]."""


class SampleBlock(NamedTuple):
    """Samples of successive radials, up to m of them, whose legs are evaluated together."""

    facet: Singles
    """Two slopes [1]; pressure of a leg [1]; area [m^2]; see `FamilyLegs.root_slant`; sine of the grazing angle of a
    refracted leg at its bottom bounces [1]; (6, m)."""
    reached_families: Integers
    """Families that reach each sample, a bit for each, (m,)."""
    bearing: Singles
    """Columns of `RadialBearings` [1], (4, m)."""
    cell_width: Floats
    """Step [m] times angular width [rad] of the cells of the radial of each sample, (m,)."""
    refraction: Singles
    """`refraction_columns` of each sample in turn in layered water, (8 m,) or empty."""


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False, fastmath=_FAST)
def facet_normals(facets: Facets, cos_h: float, sin_h: float, cell_width: Floats) -> None:
    """Fill unit normals into the water, and areas, of facets.

    Args:
        facets: Distances and slopes; normals and areas are the result.
        cos_h: Cosine of the frame's heading.
        sin_h: Sine of the frame's heading.
        cell_width: Step [m] times angular width [rad] of the cell of each sample, (n,).
    """
    distance, along, across, north, east, down, area = facets
    c, s = np.float32(cos_h), np.float32(sin_h)
    for i in range(distance.size):
        a, b = c * along[i] - s * across[i], s * along[i] + c * across[i]
        stretch = math.sqrt(np.float32(1) + a * a + b * b)
        up = np.float32(1) / stretch
        north[i], east[i], down[i] = -a * up, -b * up, -up
        area[i] = np.float32(distance[i] * cell_width[i]) * stretch


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False, fastmath=_FAST)
def straight_legs(
    facets: Facets, depth: Floats, image: FamilyImage, bearings: RadialBearings, reached_families: Integers,
    legs: FamilyLegs,
) -> None:  # fmt: skip
    """Fill straight legs of one family to samples of radials: delay, directions, spreading with absorption.

    Args:
        facets: Facets at the samples, (n,).
        depth: Depths of the samples [m], (n,).
        image: Image source of the family.
        bearings: Bearings of the radials.
        reached_families: Families that reach each sample, (n,); the family's bit is cleared where the facet faces away.
        legs: Result.
    """
    distance = facets.distance
    delay, arrival_n, arrival_e, arrival_d, departure_n, departure_e, departure_d, pressure, root_slant = legs
    (cosines, sines, beam_n, beam_e), slowness, sign = bearings, image.slowness, np.float32(image.vertical_sign)
    absorption = np.float32(image.absorption_exponent)
    cosine = root_slant  # of the leg's elevation, until the last loop
    # Three loops: the compiler vectorises no loop over all of these columns.
    for i in range(distance.size):
        dz = depth[i] - image.depth
        length = math.sqrt(distance[i] * distance[i] + dz * dz)
        inverse = np.float32(1) / np.float32(length)
        delay[i] = length * slowness
        cosine[i], vertical = np.float32(distance[i]) * inverse, np.float32(dz) * inverse
        arrival_d[i], departure_d[i] = vertical, vertical * sign
        pressure[i] = inverse * exp2_nonpositive(-absorption * np.float32(length))
    for i in range(distance.size):
        arrival_n[i], arrival_e[i] = cosine[i] * cosines[i], cosine[i] * sines[i]
        departure_n[i], departure_e[i] = cosine[i] * beam_n[i], cosine[i] * beam_e[i]
    drop_unreached(facets, np.int32(1 << image.family), reached_families, legs)


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False, fastmath=_FAST)
def drop_unreached(facets: Facets, bit: np.int32, reached_families: Integers, legs: FamilyLegs) -> None:
    """Set pressures to 0 where a family does not reach a sample, has no ray or the seabed faces away; fill root slants.

    Args:
        facets: Facets at the samples, (n,).
        bit: Bit of the family.
        reached_families: Families that reach each sample, (n,); the bit is cleared where no leg is left.
        legs: Directions and pressures, of which `pressure` is changed; `root_slant` is a result.
    """
    _, _, _, normal_n, normal_e, normal_d, _ = facets
    _, arrival_n, arrival_e, arrival_d, _, _, _, pressure, root_slant = legs
    for i in range(pressure.size):
        facing = arrival_n[i] * normal_n[i] + arrival_e[i] * normal_e[i] + arrival_d[i] * normal_d[i]
        exists = ((reached_families[i] & bit) != 0) & (facing < np.float32(0)) & (pressure[i] > np.float32(0))
        root_slant[i] = math.sqrt(max(np.float32(1) + facing, np.float32(0)))
        pressure[i] = pressure[i] if exists else np.float32(0)
        reached_families[i] &= np.int32(-1) if exists else ~bit


@njit(inline="always")
def root_direction_factor(factor: Singles, root_slant: Any) -> float:
    """Root of the direction factor of a separable scattering law [1].

    Args:
        factor: See `FamilyTable`, not empty.
        root_slant: Root of one less the sine of the facet's grazing angle, 0 to 1 [1].
    """
    last = factor.size - 1
    index = root_slant * last
    cell = min(int(index), last - 1)
    return math.sqrt(factor[cell] + (index - cell) * (factor[cell + 1] - factor[cell]))


@njit(cache=True, nogil=True, error_model="numpy", reference_counts=False)
def apply_direction_factor(factor: Singles, root_slant: Singles, pressure: Singles) -> None:
    """Multiply pressures by the root of the direction factor of a separable scattering law.

    Args:
        factor: See `FamilyTable`.
        root_slant: See `FamilyLegs`, (n,).
        pressure: Result, see `FamilyLegs`, (n,).
    """
    intervals, last = np.float32(factor.size - 1), np.uint32(factor.size - 2)
    for i in range(pressure.size):
        index = min(root_slant[i], np.float32(1)) * intervals
        cell = min(np.uint32(index), last)
        fraction = index - np.float32(cell)
        pressure[i] *= math.sqrt(factor[cell] + fraction * (factor[cell + np.uint32(1)] - factor[cell]))
