"""Legs off explicit waves: one for every point of the surface that reflects a path, each at its own time.

A path bounces where its length is stationary: once on a calm sea, at one point for every facet of the right slope on a
rough one. Each such point is a leg of its own, whose spreading follows from the curvature of the path's length there
(Kirchhoff's integral by stationary phase): troughs and crests focus or defocus. Where two legs merge at a fold, the
Airy function limits both. Waves too short to be explicit reduce each leg to its coherent part and add glints, see
`glints`.

Waves are slow compared with sound: each bounce is evaluated on the surface frozen at the time of reflection.

In layered water the length is the travel time times the speed at the surface, by refracted rays to both ends. Rays that
turn before or after the surface keep the bounce of a calm one.
"""

import math
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.directional_spreading import ElfouhailySpreading
from insonify.ocean.elfouhaily import Elfouhaily
from insonify.ocean.sea_surface import SeaSurface
from insonify.ocean.wave_spectrum import angular_frequency
from insonify.propagation._stationary_point_kernel import COLUMNS, BounceSearch, LegEnds, bounce_points
from insonify.propagation._stationary_point_kernel import MOST_NODES as MOST_NODES
from insonify.propagation._stationary_point_kernel import bounce_range_for_slope as bounce_range_for_slope
from insonify.propagation.caustic import merging_factor
from insonify.propagation.families import bounce_sequence, surface_bounces
from insonify.propagation.glints import (
    LEG_COLUMNS,
    GlintBouncePoints,
    GlintSurface,
    SonarEnd,
    calm_grazing_sine,
    leg_rows,
    update_grazing,
)
from insonify.propagation.layered_surface_path_kernel import bounce_rays
from insonify.propagation.surface_water import surface_water
from insonify.propagation.wind_waves import shortest_wavenumber, wind_waves
from insonify.records.legs import Legs, LegStatus
from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.surface import Surface

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

MAX_BOUNCE_POINTS = 16
"""Largest number of bounce points of one leg: the weakest beyond that are left out [1]."""
BANDS, SECTORS = 24, 8
"""Number of wavelengths and directions of the wind waves."""
STEEPEST = 4.5
"""Largest slope in the search for bounce points, over the rms slope [1]."""
NODES = 8.0
"""Search points per shortest wavelength."""
SHARED = 12.0
"""Shortest wavelength over the size of the cell whose points share a search [1]."""
APART = 2.0
"""Distance at which two bounce points have independent glints, over the shortest wavelength [1]."""
_NORTH, _EAST, _HEIGHT, _BEFORE, _AFTER, _COSINE, _SINE, _WEAK, _STRONG, _FOURTH, _ASIDE, _GRADIENT = range(12)


class ExplicitWaves(NamedTuple):
    """Explicit waves of a surface."""

    waves: Floats
    """Cycles per metre north and east, per second (negative), phase [cycles], amplitude [m], shape (5, m)."""
    max_slope: float
    """Slope that the surface exceeds very rarely [1]."""
    shortest_wavelength: float
    """Shortest explicit wavelength [m]."""


@lru_cache(maxsize=8)
def explicit_waves(surface: Surface, seed: int, water_depth: float) -> ExplicitWaves:
    """Explicit waves of a surface: swell and wind waves.

    Args:
        surface: A surface with explicit waves.
        seed: Seed of the scenario: another seed is another realisation.
        water_depth: Mean depth of the water [m].

    Source: spectrum and directions of Elfouhaily et al. (1997), linear waves, see `insonify.ocean`.
    """
    columns, lengths = [], []
    if surface.swell is not None:
        k = 2 * math.pi / surface.swell.length
        turning = float(angular_frequency(k, water_depth=water_depth)) / (2 * math.pi)
        north, east = math.cos(surface.wave_direction), math.sin(surface.wave_direction)
        swell_wave = [
            north / surface.swell.length,
            east / surface.swell.length,
            -turning,
            0.0,
            surface.swell.height / 2,
        ]
        columns.append(np.array(swell_wave)[:, None])
        lengths.append(surface.swell.length)
    if surface.wind_speed is not None:
        spectrum = Elfouhaily(surface.wind_speed)
        drawn = SeaSurface(
            spectrum, ElfouhailySpreading(spectrum), surface.wave_direction, seed, surface.shortest_explicit_wavelength,
            water_depth, BANDS, SECTORS,
        )  # fmt: skip
        cycles = np.stack([*drawn.wavenumber, -drawn.frequency]) / (2 * math.pi)
        columns.append(np.concatenate([cycles, drawn.phase[None], drawn.amplitude[None]]))
        lengths.append(surface.shortest_explicit_wavelength)
    waves = np.concatenate(columns, axis=1)
    steep = waves[4] * 2 * math.pi * np.hypot(waves[0], waves[1])
    slope = min(float(steep.sum()), STEEPEST * float(np.sqrt(np.sum(steep**2) / 2)))
    return ExplicitWaves(np.ascontiguousarray(waves), slope, min(lengths))


class SurfaceRays(NamedTuple):
    """Refracted rays of one family's legs, in units of the speed at the surface."""

    rays: Floats
    """Product of both spreading distances [m^2], length [m], slowness before and after, (n, the greatest count, 4)."""
    calm: Floats
    """Off a calm surface: spreading distance, length [m], slowness, travel time [m], 0 for none, shape (n, 4)."""
    speed: float
    """Sound speed at the surface [m/s]."""


class SurfaceBouncePoints(NamedTuple):
    """Bounce points of one family's legs."""

    bounce_count: Integers
    """Number of bounce points of each leg, shape (n,)."""
    points: Floats
    """Columns of the bounce points, nearest to the sonar first, shape (n, the greatest count, COLUMNS)."""
    sonar_position: Floats
    """North and east of the sonar from the sea's origin, depth with bottom bounces unfolded [m], shape (3,)."""
    point_positions: Floats
    """North, east and unfolded depth of the points [m], shape (n, 3)."""
    refracted: SurfaceRays | None = None
    """Rays in layered water; None: straight ones."""


def find_bounce_points(
    sea: ExplicitWaves, family: str, scatterers: Scatterers, sonar_end: SonarEnd, scene: Scene, frequency: float, *,
    is_transmit_leg: bool, max_count: int = MAX_BOUNCE_POINTS,
) -> SurfaceBouncePoints:  # fmt: skip
    """Find all points of a surface that reflect the legs of a family with one surface bounce.

    Args:
        sea: Explicit waves.
        family: Name of the family.
        scatterers: Ends of the legs.
        sonar_end: End of the sonar at which the legs begin.
        scene: The scene.
        frequency: Frequency of the sound [Hz].
        is_transmit_leg: True for transmit legs, False for receive legs.
        max_count: Largest number of bounce points for one leg.
    """
    string, bed = bounce_sequence(family), scene.seabed.depth
    before, after = string.index("S"), len(string) - 1 - string.index("S")
    origin = np.array([*scene.seabed.scatterer_grid.origin, 0.0])
    speed = float(scene.water.sound_speed_at(sonar_end.position[2]))
    size = sea.shortest_wavelength / SHARED
    positions, water = scatterers.position, surface_water(scene, speed, before > 0, after > 0)
    if water.depth.size:
        positions = np.column_stack([positions[:, :2], np.clip(positions[:, 2], 0.0, water.depth[-1])])
    cells = _cells(positions, scene.seabed.scatterer_grid, size)

    def node_values(nodes: Floats) -> tuple[Floats, Floats]:
        transmit_delay = 0.0 if is_transmit_leg else np.linalg.norm(nodes - sonar_end.transmit_position, axis=1) / speed
        ends = nodes - origin
        ends[:, 2] = _unfolded_depth(nodes[:, 2], after, bed)
        return ends, sonar_end.ping_time + np.broadcast_to(transmit_delay, len(nodes))

    start = sonar_end.position - origin
    start[2] = _unfolded_depth(sonar_end.position[2], before, bed)
    ends, base = node_values(positions)
    count, at = np.zeros(len(ends), np.int64), np.empty((len(ends), max_count, COLUMNS))
    groups = LegEnds(ends, base, cells.first_row, cells.order, *node_values(cells.centre))
    at_surface = float(water.speed[0]) if water.depth.size else speed
    search = BounceSearch(sea.max_slope, sea.shortest_wavelength / NODES, size, 2 * math.pi * frequency / at_surface)
    bounce_points(start, groups, is_transmit_leg, sea.waves, water, search, count, at)
    at = at[:, : max(1, int(count.max(initial=0)))].copy()
    at[np.arange(at.shape[1]) >= count[:, None]] = 1.0
    if not water.depth.size:
        return SurfaceBouncePoints(count, at, start, ends)
    rays, calm = np.empty((*at.shape[:2], 4)), np.empty((len(ends), 4))
    bounce_rays(start, ends, at, water, rays, calm)
    count[calm[:, 3] == 0] = 0
    return SurfaceBouncePoints(count, at, start, ends, SurfaceRays(rays, calm, at_surface))


def explicit_surface_legs(
    legs: Legs, scene: Scene, seed: int, scatterers: Scatterers, frequency: float, sonar_end: SonarEnd
) -> tuple[Legs, Legs]:
    """Legs off all bounce points of an explicit sea surface.

    Args:
        legs: Legs off a flat surface, f families to n points, with at most one surface bounce each.
        scene: The scene.
        seed: Seed of the scenario.
        scatterers: Ends of the legs.
        frequency: Frequency of the sound [Hz].
        sonar_end: End of the sonar at which the legs begin, and its time.

    Returns:
        Transmit legs and receive legs; further rays of a family are numbered from the bounce nearest to the sonar.
    """
    surface_rows = [row for row, family in enumerate(legs.families) if surface_bounces(family)]
    if not surface_rows:
        return legs, legs
    if scene.water.layered:
        legs, surface_rows = _separate_rising_rays(legs)
    sea = explicit_waves(scene.surface, seed, scene.seabed.depth)
    out_and_back = []
    for out in (True, False):
        bounces = {
            row: find_bounce_points(
                sea, legs.families[row], scatterers, sonar_end, scene, frequency, is_transmit_leg=out
            )
            for row in surface_rows
        }
        moved, sines, bounce_points = _moved(legs, bounces, scene, scatterers, frequency, float(sonar_end.position[2]))
        with_glints = _with_rough_reflection(
            moved, sines, GlintBouncePoints(bounce_points, APART * sea.shortest_wavelength), scene, seed, scatterers,
            frequency, sonar_end,
        )  # fmt: skip
        out_and_back.append(with_glints[not out])
    return out_and_back[0], out_and_back[1]


def _separate_rising_rays(legs: Legs) -> tuple[Legs, list[int]]:
    """Legs whose rays that do not turn have a row of their own, and the rows of those off the surface.

    Only rays of S turn, before the surface or after it: those leave downwards or arrive upwards.
    """
    rising = (legs.departure[..., 2] < 0) & (legs.arrival[..., 2] > 0) & (legs.status < LegStatus.SHADOW)
    rows: list[int] = []
    surface_rows: list[int] = []
    for family in dict.fromkeys(legs.families):
        mine = [row for row, name in enumerate(legs.families) if name == family]
        turned = [row for row in mine if family == "S" and np.any(~rising[row] & (legs.status[row] < LegStatus.SHADOW))]
        surface_rows += [len(rows)] if surface_bounces(family) else []
        rows += mine[:1] + turned if family == "S" else mine
    separated = leg_rows(legs, rows)
    if "S" not in legs.families:
        return separated, surface_rows
    first, mine = (rows.index(legs.families.index("S")), [r for r, name in enumerate(legs.families) if name == "S"])
    source, points = np.array(mine)[np.argmax(rising[mine], axis=0)], np.arange(rising.shape[1])
    for name in (*LEG_COLUMNS, "caustic"):
        column = getattr(separated, name)
        if column is not None:
            column[first] = getattr(legs, name)[source, points]
    if separated.aperture_expansion is not None and legs.aperture_expansion is not None:
        separated.aperture_expansion[first] = legs.aperture_expansion[source, :, points].T
    absent = [(first, ~rising[mine].any(axis=0))]
    absent += [(to, rising[row]) for to, row in enumerate(rows) if to > first and legs.families[row] == "S"]
    for row, which in absent:
        separated.status[row][which], separated.visibility[row][which] = LegStatus.SHADOW, 0.0
    return separated, surface_rows


def _moved(
    legs: Legs, surface_points: dict[int, SurfaceBouncePoints], scene: Scene, scatterers: Scatterers, frequency: float,
    sonar_depth: float,
) -> tuple[Legs, Floats, Floats]:  # fmt: skip
    """Legs with one row for each bounce point off the surface, sine of the grazing angle and position of the bounce."""
    rows: list[int] = []
    number: list[int] = []
    for row, family in enumerate(legs.families):
        bounced = row in surface_points
        branch_count = max(1, int(surface_points[row].bounce_count.max(initial=0))) if bounced else 1
        rows += [row] * branch_count
        first = sum(legs.families[earlier_row] == family for earlier_row in rows[:-branch_count])
        number += range(first, first + branch_count)
    moved = replace(leg_rows(legs, rows), branch=tuple(number))
    caustic = np.ones(moved.delay.shape, complex) if moved.caustic is None else moved.caustic
    moved = replace(moved, caustic=caustic)
    sines, bounce_points = np.full(moved.delay.shape, 1e-6), np.zeros((*moved.delay.shape, 2))
    wavenumber = 2 * math.pi * frequency / float(scene.water.sound_speed_at(0.0))
    spread = {row: bounce_spreading(points_of_row, wavenumber) for row, points_of_row in surface_points.items()}
    for to, (row, branch) in enumerate(zip(rows, number, strict=True)):
        if row in surface_points:
            exists = (surface_points[row].bounce_count > branch) & (legs.status[row] < LegStatus.SHADOW)
            sines[to] = np.where(exists, surface_points[row].points[:, branch, _SINE], sines[to])
            bounce_points[to] = surface_points[row].points[:, branch, _NORTH : _EAST + 1]
            strength = spread[row][exists, branch]
            moved.spreading[to, exists] *= np.abs(strength) * _calm_distance(surface_points[row], exists)
            caustic[to, exists] = strength / np.abs(strength)
            _bounce(moved, to, surface_points[row], branch, exists, scene)
            update_grazing(moved, to, scatterers.normal)
            moved.status[to][~exists] = LegStatus.SHADOW
            moved.visibility[to][~exists] = 0.0
        elif surface_bounces(legs.families[row]):  # rays that turn
            sines[to] = calm_grazing_sine(legs, row, scene, sonar_depth)
    return moved, sines, bounce_points


def _bounce(
    legs: Legs, row: int, surface_points: SurfaceBouncePoints, branch: int, has_bounce: NDArray[np.bool_], scene: Scene
) -> None:  # fmt: skip
    """Redirect one row of legs off a flat surface over their bounce points, in place.

    Evaluated as a change of the flat surface's leg, so that bottom bounces keep their local planes over relief.
    """
    at = surface_points.points[has_bounce, branch].T
    point = np.stack([at[_NORTH], at[_EAST], -at[_HEIGHT]], axis=1)
    flat = _level(surface_points, has_bounce)
    string, refracted = bounce_sequence(legs.families[row]), surface_points.refracted
    before = string.index("S")
    after = len(string) - 1 - before
    steep = [legs.departure[row, has_bounce, 2], legs.arrival[row, has_bounce, 2]]
    if refracted is None:
        norm = np.linalg.norm(flat, axis=1)
        length = legs.length[row, has_bounce] + (at[_BEFORE] + at[_AFTER] - norm)
        legs.delay[row, has_bounce] *= length / legs.length[row, has_bounce]
        flat /= norm[:, None]
        out_and_back = (point - surface_points.sonar_position) / at[_BEFORE, :, None], flat
        onward = (surface_points.point_positions[has_bounce] - point) / at[_AFTER, :, None], flat * (1, 1, -1)
    else:
        rays, calm = refracted.rays[has_bounce, branch], refracted.calm[has_bounce]
        length = legs.length[row, has_bounce] + rays[:, 1] - calm[:, 1]
        legs.delay[row, has_bounce] += (at[_BEFORE] + at[_AFTER] - calm[:, 3]) / refracted.speed
        out_and_back, onward = _refracted_directions(
            surface_points, rays, calm, point, flat, has_bounce, (before, after), scene
        )
    legs.absorption[row, has_bounce] *= legs.absorption[row, has_bounce] ** (length / legs.length[row, has_bounce] - 1)
    legs.caustics[row, has_bounce] = ((at[_WEAK] < 0) & (at[_GRADIENT] == 0)).astype(np.uint8) + (at[_STRONG] < 0)
    legs.length[row, has_bounce] = length
    for column, (direction, mirror), bottoms in ((legs.departure, out_and_back, before), (legs.arrival, onward, after)):
        turned = column[row, has_bounce] + (direction - mirror) * (1, 1, (-1) ** bottoms)
        column[row, has_bounce] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
    departure, arrival = legs.departure[row, has_bounce], legs.arrival[row, has_bounce]
    # The bottom's coefficient follows the changed angle of incidence.
    for count, old_sine, new_sine, side in (
        (before, steep[0], departure[:, 2], 2),
        (after, steep[1], arrival[:, 2], 3),
    ):
        if count:
            if refracted is not None:
                speed_ratio = float(scene.water.sound_speed_at(scene.seabed.depth)) / refracted.speed
                old_sine, new_sine = (
                    np.sqrt(np.maximum(1 - (speed_ratio * p) ** 2, 0.0)) for p in (calm[:, 2], rays[:, side])
                )
            old, new = (
                scene.seabed.reflection_coefficient(np.arcsin(np.minimum(np.abs(z), 1.0))) for z in (old_sine, new_sine)
            )
            ratio = np.divide(new, old, out=np.zeros_like(new), where=old != 0)
            legs.reflection_coefficient[row, has_bounce] *= ratio**count


def _refracted_directions(
    surface_points: SurfaceBouncePoints, rays: Floats, calm: Floats, point: Floats, flat: Floats,
    has_bounce: NDArray[np.bool_], bottoms: tuple[int, int], scene: Scene,
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:  # fmt: skip
    """Directions at the sonar by the bounce and off a calm surface, and both at the points; bottoms unfolded."""
    assert surface_points.refracted is not None
    ends, bed = surface_points.point_positions[has_bounce], scene.seabed.depth
    at_surface = surface_points.refracted.speed
    directions = []
    for side, position, count in ((0, surface_points.sonar_position, bottoms[0]), (1, ends, bottoms[1])):
        depth = np.asarray(position)[..., 2]
        ratio = scene.water.sound_speed_at(2 * bed - depth if count else depth) / at_surface
        sense = -1.0 if side == 0 else 1.0
        pair = []
        for slowness, offset in ((rays[:, 2 + side], -sense * (point - position)[:, :2]), (calm[:, 2], flat[:, :2])):
            cosine = np.minimum(slowness * ratio, 1.0)
            along = offset / np.maximum(np.linalg.norm(offset, axis=1), 1e-12)[:, None]
            pair.append(np.column_stack([along * cosine[:, None], sense * np.sqrt(1 - cosine**2)]))
        directions.append((pair[0], pair[1]))
    return directions[0], directions[1]


def _calm_distance(surface_points: SurfaceBouncePoints, has_bounce: NDArray[np.bool_]) -> Floats:
    """Spreading distance of some points off a flat surface [m]."""
    if surface_points.refracted is not None:
        return surface_points.refracted.calm[has_bounce, 0]
    return np.asarray(np.linalg.norm(_level(surface_points, has_bounce), axis=1))


def _level(surface_points: SurfaceBouncePoints, has_bounce: NDArray[np.bool_]) -> Floats:
    """Vector from the sonar to some points off a flat surface, unfolded at the surface [m], shape (n, 3)."""
    ends = surface_points.point_positions[has_bounce]
    return np.column_stack(
        [ends[:, :2] - surface_points.sonar_position[:2], -(ends[:, 2] + surface_points.sonar_position[2])]
    )


def bounce_spreading(surface_points: SurfaceBouncePoints, wavenumber: float) -> NDArray[np.complex128]:
    """Geometric spreading with focusing at each bounce point, re 1 m, with the phase of the caustics touched.

    With H the second derivatives of the path length as its bounce moves over the surface, and n the cosine there,
    the amplitude is n / (r1 r2 sqrt |det H|), and each negative curvature of H advances the phase by 90 degrees:
    Kirchhoff's integral by stationary phase, which for a flat surface is 1 / (r1 + r2). Neighbours along the path, one
    of least and one of greatest length, merge at a fold and share Airy's function with its shadow (Chester, Friedman
    & Ursell 1957). A single one is focused by a trough or crest: with a fourth derivative its integral is a Bessel
    function of order 1/4, the Pearcey function on the axis of its cusp; its value at the cusp is the upper limit of any
    bounce.

    Args:
        surface_points: Bounce points of n legs.
        wavenumber: Wavenumber of the sound [rad/m].

    Returns:
        Spreading, shape (n, the greatest count); undefined beyond the count of each leg.
    """
    at = surface_points.points
    before, after, cosine, weak, strong, fourth, aside, gradient = (
        at[..., row] for row in (_BEFORE, _AFTER, _COSINE, _WEAK, _STRONG, _FOURTH, _ASIDE, _GRADIENT)
    )
    shaded = gradient != 0  # also where there is no bounce
    curved = np.where(shaded, 1.0, np.where(weak == 0, 1e-12, weak))
    along = _axis_factor(curved, np.where(shaded, 0.0, fourth), wavenumber, _merging_factors(at, shaded, wavenumber))
    beyond = shaded & (np.arange(at.shape[1]) < surface_points.bounce_count[:, None])
    along[beyond] = _beyond(gradient[beyond], fourth[beyond], wavenumber)
    both = before * after if surface_points.refracted is None else surface_points.refracted.rays[..., 0]
    return np.asarray(cosine / both * along * _axis_factor(strong, aside, wavenumber, None))


def _axis_factor(
    curvature: Floats, fourth: Floats, k: float, merging: NDArray[np.complex128] | None
) -> NDArray[np.complex128]:
    """Contribution of one axis of a bounce, over sqrt(2 pi / k) and the phase of a path of least length [m^0.5]."""
    from scipy.special import gamma

    size = np.abs(curvature)
    part = np.asarray(np.where(curvature < 0, 1j, 1.0) / np.sqrt(size), complex)
    focused = (curvature > 0) & (fourth > 0)
    unmerged = focused if merging is None else focused & (merging == 1)
    part[unmerged] *= _cusp_factor(0.75 * k * size[unmerged] ** 2 / fourth[unmerged])
    if merging is not None:
        part = part * merging
    max_factor = (
        math.sqrt(k / (2 * math.pi)) * 2 * gamma(1.25) * np.sqrt(np.sqrt(24 / (k * np.maximum(np.abs(fourth), 1e-30))))
    )
    return np.asarray(part * np.minimum(1.0, max_factor / np.abs(part)))


def _cusp_factor(z: Floats) -> NDArray[np.complex128]:
    """Integral of exp(-j k (a u^2 / 2 + d u^4 / 24)) over its value without d, where z = 3 k a^2 / (4 d).

    Source: integral of exp(-p u^2 - q u^4) is sqrt(p / q) / 2 exp(p^2 / 8 q) K_1/4(p^2 / 8 q) (Gradshteyn & Ryzhik
    3.323, not verified; checked by quadrature), with K by DLMF 10.27.8.
    """
    from scipy.special import hankel2e

    factor = 1 + (3 / 32) * 1j / np.maximum(z, 1e-12)  # the next term of the series is below 2e-4
    is_small = z < 20
    close = np.maximum(z[is_small], 1e-12)
    factor[is_small] = np.sqrt(np.pi * close / 2) * np.exp(-0.375j * np.pi) * hankel2e(0.25, close)
    return np.asarray(factor)


def _merging_factors(at: Floats, shadow: NDArray[np.bool_], k: float) -> NDArray[np.complex128]:
    """Factor of each bounce that merges with its neighbours, 1 for a single one; see `merging_factor`."""
    length = at[..., _BEFORE] + at[..., _AFTER]
    sign = np.where(at[..., _WEAK] * at[..., _STRONG] < 0, 1.0, -1.0)  # +1 for the bounce that has touched the fold
    factor = np.ones(length.shape, complex)
    for row in range(length.shape[1] - 1):
        meeting = ~(shadow[:, row] | shadow[:, row + 1]) & (sign[:, row] != sign[:, row + 1])
        length_difference = np.abs(length[meeting, row + 1] - length[meeting, row])
        distance = np.maximum(0.75 * k * length_difference, 1e-12) ** (2 / 3)
        shared = merging_factor(distance, sign[meeting, row])
        factor[meeting, row] *= shared
        factor[meeting, row + 1] *= shared.conj()  # on the other side of the fold
    return factor


def _beyond(gradient: Floats, third: Floats, k: float) -> NDArray[np.complex128]:
    """Contribution of the weak axis in the shadow beyond a fold, in the units of `_axis_factor`."""
    from scipy.special import airy

    distance = np.abs(gradient) * np.cbrt(2 * k**2 / np.abs(third))
    value = np.sqrt(2 * np.pi * k) * np.cbrt(2 / (k * np.abs(third))) * airy(distance)[0]
    return np.asarray(value * np.exp(0.25j * np.pi))


def _with_rough_reflection(
    legs: Legs, sines: Floats, bounced: GlintBouncePoints, scene: Scene, seed: int, scatterers: Scatterers,
    frequency: float, sonar_end: SonarEnd,
) -> tuple[Legs, Legs]:  # fmt: skip
    """Legs off a surface with waves too short to be explicit; a swell alone leaves them unchanged."""
    wind = scene.surface.wind_speed
    if wind is None:
        return legs, legs
    finest = shortest_wavenumber(frequency, float(scene.water.sound_speed_at(0.0)))
    drawn = 2 * math.pi / scene.surface.shortest_explicit_wavelength
    waves = wind_waves(wind, finest, drawn)
    sea = GlintSurface(scene, seed, frequency, waves, grazing_sines=sines, bounce_points=bounced)
    return sea.legs(legs, scatterers, sonar_end)


def _unfolded_depth(depth: Floats, bottom_bounces: int, bed: float) -> Floats:
    """Depth of a point unfolded at the bottom, for the surface bounce: at most one bottom bounce [m]."""
    return np.asarray(2 * bed - depth if bottom_bounces else depth)


class PointGroups(NamedTuple):
    """Points in groups that share a search: cells of the grid, a quarter as high as wide."""

    first_row: Integers
    """First row of each group in the order, and its end, shape (cells + 1,)."""
    order: Integers
    """Rows of the points, group by group, shape (n,)."""
    centre: Floats
    """North, east, depth of each cell's centre [m], shape (cells, 3)."""


def _cells(positions: Floats, scatterer_grid: ScattererGrid, size: float) -> PointGroups:
    """Group points by grid cells; a group depends on its cell alone."""
    grid_position = scatterer_grid.from_world(positions[:, :2])
    cell = np.floor(np.column_stack([grid_position / size, positions[:, 2] / (size / 4)])).astype(np.int64)
    order = np.lexsort(cell.T).astype(np.int64)
    ordered = cell[order]
    is_first = np.concatenate([[True], np.any(ordered[1:] != ordered[:-1], axis=1)]) if len(cell) else np.zeros(0, bool)
    first = np.append(np.flatnonzero(is_first), len(cell)).astype(np.int64)
    cell_numbers = ordered[first[:-1]]
    centre: Floats = (cell_numbers.astype(float) + 0.5) * size
    horizontal = scatterer_grid.to_world(centre[:, 0], centre[:, 1])
    return PointGroups(first, order, np.column_stack([horizontal, centre[:, 2] / 4]))
