"""Aperture expansion: field of a leg about an array's centre beyond the spherical wavefront, in layered water.

The curvature of a wavefront gives delays over an array to second order, but not pressures: a single ray does not
determine how its tube's width changes with position. Rays from four positions about the centre, at the aperture's
extent, determine both: ahead and behind at its depth, above and below at its distance. Their deviation from the
sphere's expansion is a polynomial of the element's offset, exact at those four and nearly so in between.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.propagation._eigenray_kernel import AMPLITUDE, DELAY, FOLD_SIDE, MAX_RAYS, SIN_LAUNCH, SLOWNESS
from insonify.propagation.eigenray_tables import FamilyRays
from insonify.propagation.wavefront import wavefronts
from insonify.records.legs import Legs

Floats = NDArray[np.float64]
RaySource = Callable[[str, float, Floats], FamilyRays]
"""Function of family, depth of its rays' start [m] and horizontal distances of the n points [m], (n,)."""

DELAY_TERMS = 9
"""Number of the terms of the delay: x^2, x z, z^2, x^3, x^2 z, x z^2, z^3, x^4, z^4, with x the
horizontal offset towards the point and z the downward offset [m]."""
TERMS = 13
"""Number of all terms: those of the delay, then those of the natural logarithm of the pressure: x, z, x^2, z^2."""
MIN_OFFSET = 0.02
"""Least offset from the centre at which rays are evaluated [m]."""
MAX_APPROACH = 0.25
"""Largest offset towards the point, as a fraction of the horizontal distance [1]."""
MAX_DELAY_DEVIATION = 3e-6
"""Deviation from the sphere's delay beyond which a ray counts as one of another branch [s]."""


def aperture_expansion(
    legs: Legs, position: Floats, points: Floats, water: Water, aperture_extent: tuple[float, float], max_depth: float,
    ray_source: RaySource,
) -> Floats:  # fmt: skip
    """Expansion of the field about an array's centre beyond spherical wavefronts, for all its legs.

    Args:
        legs: Legs from the centre to the points, f of them to each.
        position: North, east, depth of the centre [m], shape (3,).
        points: North, east, depth of the points [m], shape (n, 3).
        water: Sound speed of the water column.
        aperture_extent: Largest offset of elements from the centre, horizontal and vertical [m].
        max_depth: Greatest depth at which rays exist [m].
        ray_source: Source of rays from other positions.

    Returns:
        Coefficients of `TERMS`, delay [s] and logarithm of pressure [1] over powers of metres, shape (f, TERMS, n);
        NaN where there is no ray of the same branch, or one that ends near a caustic (pressure only).
    """
    offset = np.minimum(
        max(aperture_extent[0], MIN_OFFSET),
        MAX_APPROACH * np.hypot(points[:, 0] - position[0], points[:, 1] - position[1]),
    )
    offset = np.maximum(offset, 1e-3)
    depth = float(position[2])
    down = min(max(aperture_extent[1], MIN_OFFSET), depth, max_depth - depth) if aperture_extent[1] > 1e-4 else 0.0
    terms = np.zeros((len(legs.families), TERMS, len(points)))
    rays_at: dict[str, list[FamilyRays]] = {}
    fronts = wavefronts(legs, range(len(legs.families)), position, points, water)
    for row, (family, front) in enumerate(zip(legs.families, fronts, strict=True)):
        if family not in rays_at:
            rays_at[family] = [ray_source(family, depth, front.horizontal_distance - side * offset) for side in (1, -1)]
            rays_at[family] += [
                ray_source(family, depth + side * down, front.horizontal_distance) for side in (1, -1) if down > 1e-3
            ]
        expansion = _RayExpansion(legs, row, position, front.vertical_curvature, front.sound_speed_gradient, water)
        horizontal = [expansion.deviation_of(rays_at[family][k], side * offset, 0.0) for k, side in ((0, 1), (1, -1))]
        vertical = [
            expansion.deviation_of(family_rays, 0.0, side * down)
            for family_rays, side in zip(rays_at[family][2:], (1, -1), strict=False)
        ]
        _fill_terms(terms[row], horizontal, vertical, offset, down)
    return terms


def largest_change(terms: Floats, aperture_extent: tuple[float, float]) -> tuple[Floats, Floats]:
    """Bounds of the changes by some terms at any element of an array.

    Args:
        terms: Coefficients of `TERMS`, (..., TERMS, n).
        aperture_extent: Largest offset of elements from the array's centre, horizontal and vertical [m].

    Returns:
        Bounds of the changes of delay [s] and of the logarithm of pressure [1], each (..., n).
    """
    x, z = aperture_extent
    powers = [x**2, x * z, z**2, x**3, x**2 * z, x * z**2, z**3, x**4, z**4, x, z, x**2, z**2]
    change = np.abs(terms) * np.array(powers)[:, None]
    return change[..., :DELAY_TERMS, :].sum(axis=-2), change[..., DELAY_TERMS:, :].sum(axis=-2)


class _RayExpansion:
    """One row of legs, and the spherical expansion about the centre."""

    def __init__(
        self, legs: Legs, row: int, position: Floats, vertical_curvature: Floats, gradient: float, water: Water
    ) -> None:
        self.delay, self.vertical_curvature, self.gradient = legs.delay[row], vertical_curvature, gradient
        self.water, self.depth = water, float(position[2])
        self.speed = float(water.sound_speed_at(self.depth))
        self.sine = legs.departure[row, :, 2]
        self.cosine = np.hypot(legs.departure[row, :, 0], legs.departure[row, :, 1])
        self.amplitude = np.where(legs.spreading[row] > 0, legs.spreading[row], np.nan)

    def spherical_field(self, x: Floats | float, z: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Field of a spherical wavefront at an offset from the centre, with the gradient of sound speed there.

        The gradient g adds the integral of g z / c^2 along the ray: the eikonal equation to first order in g.

        Args:
            x: Horizontal offset towards the point [m], scalar or (n,).
            z: Downward offset [m].

        Returns:
            Delay less that of the centre [s], its derivatives by x and by z [s/m], and logarithm of the pressure re
            that at the centre [1], each (n,).
        """
        c, s, b = self.cosine, self.sine, self.vertical_curvature
        along, across = x * c + z * s, z * c - x * s
        root = np.sqrt(np.maximum(1 - 2 * b * along + b**2 * (x**2 + z**2), 1e-6))
        gradient_factor = self.gradient / (2 * self.speed**2)
        delay_change = (b * (x**2 + z**2) - 2 * along) / (1 + root) / self.speed + gradient_factor * (
            s * along + 2 * c * across
        ) * along
        along_slope, across_slope = gradient_factor * 2 * (s * along + c * across), gradient_factor * 2 * c * along
        delay_slope_x = (b * x - c) / root / self.speed + along_slope * c - across_slope * s
        delay_slope_z = (b * z - s) / root / self.speed + along_slope * s + across_slope * c
        return delay_change, delay_slope_x, delay_slope_z, -np.log(root)

    def deviation_of(self, family_rays: FamilyRays, x: Floats | float, z: float) -> Floats:
        """Deviation from `spherical_field` of the rays that start at an offset, (4, n); NaN for rays of another branch.

        Rows: delay [s], its derivatives by x and by z [s/m], logarithm of the pressure [1].
        """
        delay_change, delay_slope_x, delay_slope_z, log_reference = self.spherical_field(x, z)
        exists = np.arange(family_rays.rays.shape[1]) < np.minimum(family_rays.count, MAX_RAYS)[:, None]
        delay_error = np.abs(family_rays.rays[:, :, DELAY] - (self.delay + delay_change)[:, None])
        deviation = np.where(exists, delay_error, np.inf)
        nearest = np.argmin(deviation, axis=1)
        n = np.arange(len(nearest))
        ray = family_rays.rays[n, nearest]
        speed = float(self.water.sound_speed_at(self.depth + z))
        with np.errstate(divide="ignore", invalid="ignore"):
            log_ratio = np.log(ray[:, AMPLITUDE] / self.amplitude) - log_reference
        slope_x, slope_z = -ray[:, SLOWNESS] - delay_slope_x, -ray[:, SIN_LAUNCH] / speed - delay_slope_z
        terms = np.array([ray[:, DELAY] - self.delay - delay_change, slope_x, slope_z, log_ratio])
        terms[:, ~(deviation[n, nearest] < MAX_DELAY_DEVIATION)] = np.nan
        terms[3, ray[:, FOLD_SIDE] != 0] = np.nan
        return terms


def _fill_terms(
    coefficients: Floats, horizontal: list[Floats], vertical: list[Floats], offset: Floats, depth_offset: float
) -> None:
    """Compute the coefficients of one row of legs from the deviations at four offsets.

    Args:
        coefficients: Result, in the order of `DELAY_TERMS` and `TERMS`, (TERMS, n).
        horizontal: Results of `_RayExpansion.deviation_of` at offsets +x and -x.
        vertical: Its results at offsets +z and -z; empty for an aperture without height.
        offset: Horizontal offset x [m], (n,).
        depth_offset: Downward offset z [m].
    """
    odd, even = (horizontal[0] - horizontal[1]) / 2, (horizontal[0] + horizontal[1]) / 2
    h = offset
    coefficients[0] = 2 * even[0] / h**2 - odd[1] / (2 * h)
    coefficients[1] = odd[2] / h
    coefficients[3] = odd[0] / h**3
    coefficients[4] = even[2] / h**2
    coefficients[7] = (odd[1] / (2 * h) - even[0] / h**2) / h**2
    coefficients[9], coefficients[11] = odd[3] / h, even[3] / h**2
    if not vertical:
        return
    odd, even = (vertical[0] - vertical[1]) / 2, (vertical[0] + vertical[1]) / 2
    coefficients[2] = 2 * even[0] / depth_offset**2 - odd[2] / (2 * depth_offset)
    coefficients[5] = even[1] / depth_offset**2
    coefficients[6] = odd[0] / depth_offset**3
    coefficients[8] = (odd[2] / (2 * depth_offset) - even[0] / depth_offset**2) / depth_offset**2
    coefficients[10], coefficients[12] = odd[3] / depth_offset, even[3] / depth_offset**2
