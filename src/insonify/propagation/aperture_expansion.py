"""Aperture expansion: field of a leg about an array's centre beyond the spherical wavefront, in layered water.

The curvature of a wavefront gives delays over an array to second order, but not levels: a single ray does not determine
how its tube's width changes with position. Rays to four positions about the centre, at the aperture's extent,
determine both: ahead and behind at its depth, above and below at its distance. Their deviation from the
sphere's expansion is a polynomial of the element's offset, exact at those four and nearly so in between.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.propagation._eigenray_kernel import AMPLITUDE, DELAY, FOLD_SIDE, MOST, SIN_LAUNCH, SLOWNESS
from insonify.propagation.eigenray_tables import FamilyRays
from insonify.propagation.wavefront import wavefront
from insonify.records.legs import Legs

Floats = NDArray[np.float64]
RaySource = Callable[[str, float, Floats], FamilyRays]
"""Rays of a family from a depth [m] to all points, at their own distances [m], (n,)."""

LATER = 9
"""Terms of the delay: x^2, x z, z^2, x^3, x^2 z, x z^2, z^3, x^4, z^4, with x the approach and z the depth offset."""
TERMS = 13
"""Those terms, and of the logarithm of the pressure: x, z, x^2, z^2."""
LEAST = 0.02
"""Least horizontal distance of the rays [m]."""
NEARER = 0.25
"""Largest approach of the position ahead, as a fraction of the distance [1]."""
ANOTHER = 3e-6
"""Rays whose delay deviates more than this from the sphere's are of another branch [s]."""


def aperture_expansion(
    legs: Legs, position: Floats, points: Floats, water: Water, aperture_extent: tuple[float, float], max_depth: float,
    ray_source: RaySource,
) -> Floats:  # fmt: skip
    """Expansion of the field about an array's centre beyond spherical wavefronts, for all its legs.

    Args:
        legs: Legs from the centre to the points, f of them to each.
        position: North, east, depth of the centre [m], shape (3,).
        points: North, east, depth of the points [m], shape (n, 3).
        water: Water between.
        aperture_extent: Largest offset of elements from the centre, horizontal and vertical [m].
        max_depth: Greatest depth at which rays exist [m].
        ray_source: Function that returns the rays.

    Returns:
        Coefficients of `TERMS`, delay [s] and logarithm of pressure [1] over powers of metres, shape (f, TERMS, n);
        zero where there is no such ray, or where it ends near a caustic.
    """
    ahead = np.minimum(
        max(aperture_extent[0], LEAST), NEARER * np.hypot(points[:, 0] - position[0], points[:, 1] - position[1])
    )
    ahead = np.maximum(ahead, 1e-3)
    depth = float(position[2])
    down = min(max(aperture_extent[1], LEAST), depth, max_depth - depth) if aperture_extent[1] > 1e-4 else 0.0
    terms = np.zeros((len(legs.families), TERMS, len(points)))
    rays_at: dict[str, list[FamilyRays]] = {}
    for row, family in enumerate(legs.families):
        front = wavefront(legs, row, position, points, water)
        if family not in rays_at:
            rays_at[family] = [ray_source(family, depth, front.horizontal_distance - side * ahead) for side in (1, -1)]
            rays_at[family] += [
                ray_source(family, depth + side * down, front.horizontal_distance) for side in (1, -1) if down > 1e-3
            ]
        around = _RayExpansion(legs, row, position, front.vertical_curvature, front.sound_speed_gradient, water)
        level = [around.excess(rays_at[family][k], side * ahead, 0.0) for k, side in ((0, 1), (1, -1))]
        upright = [
            around.excess(one, 0.0, side * down) for one, side in zip(rays_at[family][2:], (1, -1), strict=False)
        ]
        _terms(terms[row], level, upright, ahead, down)
    return np.nan_to_num(terms)


class _RayExpansion:
    """One row of legs, and the spherical expansion about the centre."""

    def __init__(
        self, legs: Legs, row: int, position: Floats, vertical_curvature: Floats, gradient: float, water: Water
    ) -> None:
        self.delay, self.bend, self.gradient = legs.delay[row], vertical_curvature, gradient
        self.water, self.depth = water, float(position[2])
        self.speed = float(water.sound_speed_at(self.depth))
        self.sine = legs.departure[row, :, 2]
        self.cosine = np.hypot(legs.departure[row, :, 0], legs.departure[row, :, 1])
        self.amplitude = np.where(legs.spreading[row] > 0, legs.spreading[row], np.nan)

    def sphere(self, x: Floats | float, z: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Delay less that of the centre [s], its derivatives to x and z [s/m], and logarithm of the pressure [1]."""
        c, s, b = self.cosine, self.sine, self.bend
        along, aside = x * c + z * s, z * c - x * s
        root = np.sqrt(np.maximum(1 - 2 * b * along + b**2 * (x**2 + z**2), 1e-6))
        turn = self.gradient / (2 * self.speed**2)
        delay_change = (b * (x**2 + z**2) - 2 * along) / (1 + root) / self.speed + turn * (
            s * along + 2 * c * aside
        ) * along
        slope = turn * 2 * (s * along + c * aside), turn * 2 * c * along  # along, and aside
        to_x = (b * x - c) / root / self.speed + slope[0] * c - slope[1] * s
        to_z = (b * z - s) / root / self.speed + slope[0] * s + slope[1] * c
        return delay_change, to_x, to_z, -np.log(root)

    def excess(self, family_rays: FamilyRays, x: Floats | float, z: float) -> Floats:
        """Deviation of rays to one position from the sphere: delay, both derivatives, log pressure, (4, n)."""
        delay_change, to_x, to_z, log_reference = self.sphere(x, z)
        exists = np.arange(family_rays.rays.shape[1]) < np.minimum(family_rays.count, MOST)[:, None]
        deviation = np.where(
            exists, np.abs(family_rays.rays[:, :, DELAY] - (self.delay + delay_change)[:, None]), np.inf
        )
        nearest = np.argmin(deviation, axis=1)
        n = np.arange(len(nearest))
        ray = family_rays.rays[n, nearest]
        speed = float(self.water.sound_speed_at(self.depth + z))
        with np.errstate(divide="ignore", invalid="ignore"):
            log_ratio = np.log(ray[:, AMPLITUDE] / self.amplitude) - log_reference
        terms = np.array(
            [
                ray[:, DELAY] - self.delay - delay_change,
                -ray[:, SLOWNESS] - to_x,
                -ray[:, SIN_LAUNCH] / speed - to_z,
                log_ratio,
            ]
        )
        terms[:, ~(deviation[n, nearest] < ANOTHER)] = np.nan
        terms[3, ray[:, FOLD_SIDE] != 0] = np.nan
        return terms


def _terms(coefficients: Floats, level: list[Floats], upright: list[Floats], ahead: Floats, down: float) -> None:
    """Fill in the coefficients of one row from the deviations at the positions; see `LATER` and `TERMS`."""
    odd, even = (level[0] - level[1]) / 2, (level[0] + level[1]) / 2
    h = ahead
    coefficients[0] = 2 * even[0] / h**2 - odd[1] / (2 * h)
    coefficients[1] = odd[2] / h
    coefficients[3] = odd[0] / h**3
    coefficients[4] = even[2] / h**2
    coefficients[7] = (odd[1] / (2 * h) - even[0] / h**2) / h**2
    coefficients[9], coefficients[11] = odd[3] / h, even[3] / h**2
    if not upright:
        return
    odd, even = (upright[0] - upright[1]) / 2, (upright[0] + upright[1]) / 2
    coefficients[2] = 2 * even[0] / down**2 - odd[2] / (2 * down)
    coefficients[5] = even[1] / down**2
    coefficients[6] = odd[0] / down**3
    coefficients[8] = (odd[2] / (2 * down) - even[0] / down**2) / down**2
    coefficients[10], coefficients[12] = odd[3] / down, even[3] / down**2
