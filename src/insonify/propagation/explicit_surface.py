"""Legs reflected by explicit waves: one for every point of the surface that reflects a path.

A path is reflected where its length is stationary: at one point of a calm sea, on a rough one at each point of the
right slope. Each such point is a leg of its own, whose spreading follows from the curvature of the path's length there
(Kirchhoff's integral by stationary phase): troughs and crests focus or defocus. Where two legs merge at a fold, the
Airy function limits both. Waves too short to be explicit reduce each leg to its coherent part and add glints, see
`glints`.

Heights and slopes are those at the time at which sound arrives at each point: slopes include the motion of the waves
while the sound travels from one point of the surface to the next.
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
"""Number of bands of wavelength, and of directions in each, of the explicit wind waves: 192 waves."""
STEEPEST = 4.5
"""Largest slope in the search for bounce points, over the rms slope [1]."""
NODES = 8.0
"""Search points per shortest explicit wavelength [1]."""
SHARED = 12.0
"""Shortest explicit wavelength over the size of the cell whose points share a search [1]."""
APART = 2.0
"""Distance at which two bounce points have independent glints, over the shortest explicit wavelength [1]."""
_NORTH, _EAST, _HEIGHT, _BEFORE, _AFTER, _COSINE, _SINE, _WEAK, _STRONG, _FOURTH, _ASIDE, _GRADIENT = range(12)
"""First columns of a bounce point, see `_stationary_point_kernel.COLUMNS`."""


class ExplicitWaves(NamedTuple):
    """Explicit waves of a surface."""

    waves: Floats
    """Wavenumber north and east [1/m], minus frequency [Hz], phase [cycles], amplitude [m] of m waves, shape (5, m)."""
    max_slope: float
    """Slope that the surface exceeds rarely or never: 4.5 times its rms, or the sum over all waves if less [1]."""
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
        swell_frequency = float(angular_frequency(k, water_depth=water_depth)) / (2 * math.pi)
        north, east = math.cos(surface.wave_direction), math.sin(surface.wave_direction)
        length, amplitude = surface.swell.length, surface.swell.height / 2
        columns.append(np.array([north / length, east / length, -swell_frequency, 0.0, amplitude])[:, None])
        lengths.append(length)
    if surface.wind_speed is not None:
        spectrum = Elfouhaily(surface.wind_speed)
        wind_sea = SeaSurface(
            spectrum, ElfouhailySpreading(spectrum), surface.wave_direction, seed, surface.shortest_explicit_wavelength,
            water_depth, BANDS, SECTORS,
        )  # fmt: skip
        cycles = np.stack([*wind_sea.wavenumber, -wind_sea.frequency]) / (2 * math.pi)
        columns.append(np.concatenate([cycles, wind_sea.phase[None], wind_sea.amplitude[None]]))
        lengths.append(surface.shortest_explicit_wavelength)
    waves = np.concatenate(columns, axis=1)
    slopes = waves[4] * 2 * math.pi * np.hypot(waves[0], waves[1])
    max_slope = min(float(slopes.sum()), STEEPEST * float(np.sqrt(np.sum(slopes**2) / 2)))
    return ExplicitWaves(np.ascontiguousarray(waves), max_slope, min(lengths))


class SurfaceRays(NamedTuple):
    """Refracted rays of one family's legs to n scatterers; slownesses [1] are times the sound speed at the surface."""

    rays: Floats
    """By each of k bounce points: product of the spreading distances of both rays [m^2], length of both [m],
    horizontal slowness before and after the bounce [1], shape (n, k, 4)."""
    calm: Floats
    """By a calm surface: spreading distance [m], length [m], horizontal slowness [1], travel time times the speed at
    the surface [m], 0 where no ray arrives, shape (n, 4)."""
    speed: float
    """Sound speed at the surface [m/s]."""


class SurfaceBouncePoints(NamedTuple):
    """Bounce points of one family's legs to n scatterers, at most k for each."""

    bounce_count: Integers
    """Number of bounce points of each leg, shape (n,)."""
    points: Floats
    """Columns of the bounce points, nearest to the sonar first, 1 beyond the count, shape (n, k, COLUMNS)."""
    sonar_position: Floats
    """North and east of the sonar re the origin of the waves, depth with bottom bounces unfolded [m], shape (3,)."""
    point_positions: Floats
    """North and east of the scatterers re that origin, depth with bottom bounces unfolded [m], shape (n, 3)."""
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
    sequence, bed = bounce_sequence(family), scene.seabed.depth
    bottoms_before, bottoms_after = sequence.index("S"), len(sequence) - 1 - sequence.index("S")
    origin = np.array([*scene.seabed.scatterer_grid.origin, 0.0])
    speed = float(scene.water.sound_speed_at(sonar_end.position[2]))
    cell_size = sea.shortest_wavelength / SHARED
    positions, water = scatterers.position, surface_water(scene, speed, bottoms_before > 0, bottoms_after > 0)
    if water.depth.size:
        positions = np.column_stack([positions[:, :2], np.clip(positions[:, 2], 0.0, water.depth[-1])])
    cells = _cells(positions, scene.seabed.scatterer_grid, cell_size)

    def ends_and_times(nodes: Floats) -> tuple[Floats, Floats]:  # unfolded [m]; time at which sound begins the leg [s]
        transmit_delay = 0.0 if is_transmit_leg else np.linalg.norm(nodes - sonar_end.transmit_position, axis=1) / speed
        ends = nodes - origin
        ends[:, 2] = _unfolded_depth(nodes[:, 2], bottoms_after, bed)
        return ends, sonar_end.ping_time + np.broadcast_to(transmit_delay, len(nodes))

    start = sonar_end.position - origin
    start[2] = _unfolded_depth(sonar_end.position[2], bottoms_before, bed)
    ends, times = ends_and_times(positions)
    count, points = np.zeros(len(ends), np.int64), np.empty((len(ends), max_count, COLUMNS))
    groups = LegEnds(ends, times, cells.first_row, cells.order, *ends_and_times(cells.centre))
    surface_speed = float(water.speed[0]) if water.depth.size else speed
    wavenumber = 2 * math.pi * frequency / surface_speed
    search = BounceSearch(sea.max_slope, sea.shortest_wavelength / NODES, cell_size, wavenumber)
    bounce_points(start, groups, is_transmit_leg, sea.waves, water, search, count, points)
    points = points[:, : max(1, int(count.max(initial=0)))].copy()
    points[np.arange(points.shape[1]) >= count[:, None]] = 1.0
    if not water.depth.size:
        return SurfaceBouncePoints(count, points, start, ends)
    rays, calm = np.empty((*points.shape[:2], 4)), np.empty((len(ends), 4))
    bounce_rays(start, ends, points, water, rays, calm)
    count[calm[:, 3] == 0] = 0
    return SurfaceBouncePoints(count, points, start, ends, SurfaceRays(rays, calm, surface_speed))


def explicit_surface_legs(
    legs: Legs, scene: Scene, seed: int, scatterers: Scatterers, frequency: float, sonar_end: SonarEnd
) -> tuple[Legs, Legs]:
    """Legs by all bounce points of an explicit sea surface.

    Args:
        legs: Legs reflected by a flat surface, f families to n points, with at most one surface bounce each.
        scene: The scene.
        seed: Seed of the scenario.
        scatterers: Ends of the legs.
        frequency: Frequency of the sound [Hz].
        sonar_end: End of the sonar at which the legs begin, and its time.

    Returns:
        Transmit legs and receive legs; the rays of a family are numbered from the bounce nearest to the sonar.
    """
    surface_rows = [row for row, family in enumerate(legs.families) if surface_bounces(family)]
    if not surface_rows:
        return legs, legs
    if scene.water.layered:
        legs, surface_rows = _separate_rising_rays(legs)
    sea = explicit_waves(scene.surface, seed, scene.seabed.depth)
    transmit_and_receive = []
    for is_transmit_leg in (True, False):
        bounces = {
            row: find_bounce_points(
                sea, legs.families[row], scatterers, sonar_end, scene, frequency, is_transmit_leg=is_transmit_leg
            )
            for row in surface_rows
        }
        reflected, sines, bounce_positions = _legs_by_bounce_points(
            legs, bounces, scene, scatterers, frequency, float(sonar_end.position[2])
        )
        with_glints = _with_rough_reflection(
            reflected, sines, GlintBouncePoints(bounce_positions, APART * sea.shortest_wavelength), scene, seed,
            scatterers, frequency, sonar_end,
        )  # fmt: skip
        transmit_and_receive.append(with_glints[0 if is_transmit_leg else 1])
    return transmit_and_receive[0], transmit_and_receive[1]


def _separate_rising_rays(legs: Legs) -> tuple[Legs, list[int]]:
    """Legs of which rays that do not turn have a row of their own, and the rows that explicit waves reflect.

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
    rising_row, points = np.array(mine)[np.argmax(rising[mine], axis=0)], np.arange(rising.shape[1])
    for name in (*LEG_COLUMNS, "caustic"):
        column = getattr(separated, name)
        if column is not None:
            column[first] = getattr(legs, name)[rising_row, points]
    if separated.aperture_expansion is not None and legs.aperture_expansion is not None:
        separated.aperture_expansion[first] = legs.aperture_expansion[rising_row, :, points].T
    absent = [(first, ~rising[mine].any(axis=0))]
    absent += [(to, rising[row]) for to, row in enumerate(rows) if to > first and legs.families[row] == "S"]
    for row, is_absent in absent:
        separated.status[row][is_absent], separated.visibility[row][is_absent] = LegStatus.SHADOW, 0.0
    return separated, surface_rows


def _legs_by_bounce_points(
    legs: Legs, surface_points: dict[int, SurfaceBouncePoints], scene: Scene, scatterers: Scatterers, frequency: float,
    sonar_depth: float,
) -> tuple[Legs, Floats, Floats]:  # fmt: skip
    """Legs with one row for each bounce point, of which `surface_points` has those of some rows of the given legs.

    Returns:
        The legs; sine of the angle between path and horizontal at each bounce [1], shape (rows, n); north and east of
        each bounce re the origin of the waves [m], shape (rows, n, 2).
    """
    rows: list[int] = []
    branches: list[int] = []
    for row, family in enumerate(legs.families):
        has_points = row in surface_points
        branch_count = max(1, int(surface_points[row].bounce_count.max(initial=0))) if has_points else 1
        rows += [row] * branch_count
        first = sum(legs.families[earlier_row] == family for earlier_row in rows[:-branch_count])
        branches += range(first, first + branch_count)
    reflected = replace(leg_rows(legs, rows), branch=tuple(branches))
    caustic = np.ones(reflected.delay.shape, complex) if reflected.caustic is None else reflected.caustic
    reflected = replace(reflected, caustic=caustic)
    sines, bounce_positions = np.full(reflected.delay.shape, 1e-6), np.zeros((*reflected.delay.shape, 2))
    wavenumber = 2 * math.pi * frequency / float(scene.water.sound_speed_at(0.0))
    spread = {row: bounce_spreading(points_of_row, wavenumber) for row, points_of_row in surface_points.items()}
    for to, (row, branch) in enumerate(zip(rows, branches, strict=True)):
        if row in surface_points:
            exists = (surface_points[row].bounce_count > branch) & (legs.status[row] < LegStatus.SHADOW)
            sines[to] = np.where(exists, surface_points[row].points[:, branch, _SINE], sines[to])
            bounce_positions[to] = surface_points[row].points[:, branch, _NORTH : _EAST + 1]
            spreading = spread[row][exists, branch]
            reflected.spreading[to, exists] *= np.abs(spreading) * _calm_distance(surface_points[row], exists)
            caustic[to, exists] = spreading / np.abs(spreading)
            _redirect(reflected, to, surface_points[row], branch, exists, scene)
            update_grazing(reflected, to, scatterers.normal)
            reflected.status[to][~exists] = LegStatus.SHADOW
            reflected.visibility[to][~exists] = 0.0
        elif surface_bounces(legs.families[row]):  # rays that turn
            sines[to] = calm_grazing_sine(legs, row, scene, sonar_depth)
    return reflected, sines, bounce_positions


def _redirect(
    legs: Legs, row: int, surface_points: SurfaceBouncePoints, branch: int, has_bounce: NDArray[np.bool_], scene: Scene
) -> None:  # fmt: skip
    """Redirect one row of legs from the bounce on a flat surface to one of their bounce points, in place.

    Evaluated as a change of the flat surface's leg, so that bottom bounces keep their local planes over relief.
    """
    at = surface_points.points[has_bounce, branch].T
    point = np.stack([at[_NORTH], at[_EAST], -at[_HEIGHT]], axis=1)
    to_image = _vector_to_image(surface_points, has_bounce)
    sequence, refracted = bounce_sequence(legs.families[row]), surface_points.refracted
    bottoms_before = sequence.index("S")
    bottoms_after = len(sequence) - 1 - bottoms_before
    flat_sines = [legs.departure[row, has_bounce, 2], legs.arrival[row, has_bounce, 2]]
    if refracted is None:
        norm = np.linalg.norm(to_image, axis=1)
        length = legs.length[row, has_bounce] + (at[_BEFORE] + at[_AFTER] - norm)
        legs.delay[row, has_bounce] *= length / legs.length[row, has_bounce]
        to_image /= norm[:, None]
        departures = (point - surface_points.sonar_position) / at[_BEFORE, :, None], to_image
        arrivals = (surface_points.point_positions[has_bounce] - point) / at[_AFTER, :, None], to_image * (1, 1, -1)
    else:
        rays, calm = refracted.rays[has_bounce, branch], refracted.calm[has_bounce]
        length = legs.length[row, has_bounce] + rays[:, 1] - calm[:, 1]
        legs.delay[row, has_bounce] += (at[_BEFORE] + at[_AFTER] - calm[:, 3]) / refracted.speed
        departures, arrivals = _refracted_directions(
            surface_points, rays, calm, point, to_image, has_bounce, (bottoms_before, bottoms_after), scene
        )
    legs.absorption[row, has_bounce] *= legs.absorption[row, has_bounce] ** (length / legs.length[row, has_bounce] - 1)
    legs.caustics[row, has_bounce] = ((at[_WEAK] < 0) & (at[_GRADIENT] == 0)).astype(np.uint8) + (at[_STRONG] < 0)
    legs.length[row, has_bounce] = length
    both_ends = (legs.departure, departures, bottoms_before), (legs.arrival, arrivals, bottoms_after)
    for column, (direction, flat_direction), bottoms in both_ends:
        changed = column[row, has_bounce] + (direction - flat_direction) * (1, 1, (-1) ** bottoms)
        column[row, has_bounce] = changed / np.linalg.norm(changed, axis=1, keepdims=True)
    departure, arrival = legs.departure[row, has_bounce], legs.arrival[row, has_bounce]
    # The bottom's coefficient follows the changed angle of incidence.
    for count, old_sine, new_sine, side in (
        (bottoms_before, flat_sines[0], departure[:, 2], 2),
        (bottoms_after, flat_sines[1], arrival[:, 2], 3),
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
    surface_points: SurfaceBouncePoints, rays: Floats, calm: Floats, point: Floats, to_image: Floats,
    has_bounce: NDArray[np.bool_], bottoms: tuple[int, int], scene: Scene,
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats]]:  # fmt: skip
    """Directions of travel at the sonar by the bounce and by a calm surface, and both at the points; bottoms unfolded.

    Rays, calm rays (see `SurfaceRays`), bounce point and `_vector_to_image` [m] are those of legs that have the bounce;
    the bottoms are the numbers of bottom bounces before and after it.
    """
    assert surface_points.refracted is not None
    ends, bed = surface_points.point_positions[has_bounce], scene.seabed.depth
    surface_speed = surface_points.refracted.speed
    directions = []
    for side, position, count in ((0, surface_points.sonar_position, bottoms[0]), (1, ends, bottoms[1])):
        depth = np.asarray(position)[..., 2]
        speed_ratio = scene.water.sound_speed_at(2 * bed - depth if count else depth) / surface_speed
        sense = -1.0 if side == 0 else 1.0
        pair, by_bounce = [], (rays[:, 2 + side], -sense * (point - position)[:, :2])
        for slowness, offset in (by_bounce, (calm[:, 2], to_image[:, :2])):
            cosine = np.minimum(slowness * speed_ratio, 1.0)
            along = offset / np.maximum(np.linalg.norm(offset, axis=1), 1e-12)[:, None]
            pair.append(np.column_stack([along * cosine[:, None], sense * np.sqrt(1 - cosine**2)]))
        directions.append((pair[0], pair[1]))
    return directions[0], directions[1]


def _calm_distance(surface_points: SurfaceBouncePoints, has_bounce: NDArray[np.bool_]) -> Floats:
    """Spreading distance by a flat surface of the points that have a bounce [m]."""
    if surface_points.refracted is not None:
        return surface_points.refracted.calm[has_bounce, 0]
    return np.asarray(np.linalg.norm(_vector_to_image(surface_points, has_bounce), axis=1))


def _vector_to_image(surface_points: SurfaceBouncePoints, has_bounce: NDArray[np.bool_]) -> Floats:
    """Vector from the sonar to the images in the mean surface of the points that have a bounce [m], shape (b, 3)."""
    ends = surface_points.point_positions[has_bounce]
    return np.column_stack(
        [ends[:, :2] - surface_points.sonar_position[:2], -(ends[:, 2] + surface_points.sonar_position[2])]
    )


def bounce_spreading(surface_points: SurfaceBouncePoints, wavenumber: float) -> NDArray[np.complex128]:
    """Pressure ratio by spreading with focusing at each bounce point, re 1 m, with the phase of the caustics touched.

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
        Spreading [1/m], shape (n, k); undefined beyond the count of each leg.
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
    """Stationary-phase integral along one axis of a bounce, re that of a path of least length with curvature 1 / m.

    It is 1 / sqrt|curvature| [m^0.5], 90 degrees ahead if that is negative; times the factor for a merging neighbour
    (None: 1), or near a cusp that by the fourth derivative [1/m^3]; at most the value at the cusp. k is in rad/m.
    """
    from scipy.special import gamma

    size = np.abs(curvature)
    contribution = np.asarray(np.where(curvature < 0, 1j, 1.0) / np.sqrt(size), complex)
    focused = (curvature > 0) & (fourth > 0)
    unmerged = focused if merging is None else focused & (merging == 1)
    contribution[unmerged] *= _cusp_factor(0.75 * k * size[unmerged] ** 2 / fourth[unmerged])
    if merging is not None:
        contribution = contribution * merging
    cusp_value = (
        math.sqrt(k / (2 * math.pi)) * 2 * gamma(1.25) * np.sqrt(np.sqrt(24 / (k * np.maximum(np.abs(fourth), 1e-30))))
    )
    return np.asarray(contribution * np.minimum(1.0, cusp_value / np.abs(contribution)))


def _cusp_factor(z: Floats) -> NDArray[np.complex128]:
    """Integral of exp(-j k (a u^2 / 2 + d u^4 / 24)) over u, re its value for d = 0, where z = 3 k a^2 / (4 d) [1].

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
    """Factor on the pressure of each bounce that merges with a neighbour, 1 for a single one; see `merging_factor`.

    The bounces are given by their columns and by True for folds in whose shadow the scatterer lies; k is in rad/m.
    """
    length = at[..., _BEFORE] + at[..., _AFTER]
    sign = np.where(at[..., _WEAK] * at[..., _STRONG] < 0, 1.0, -1.0)  # +1 for the bounce that has touched the fold
    factor = np.ones(length.shape, complex)
    for bounce in range(length.shape[1] - 1):
        merges = ~(shadow[:, bounce] | shadow[:, bounce + 1]) & (sign[:, bounce] != sign[:, bounce + 1])
        length_difference = np.abs(length[merges, bounce + 1] - length[merges, bounce])
        distance = np.maximum(0.75 * k * length_difference, 1e-12) ** (2 / 3)
        shared = merging_factor(distance, sign[merges, bounce])
        factor[merges, bounce] *= shared
        factor[merges, bounce + 1] *= shared.conj()  # on the other side of the fold
    return factor


def _beyond(gradient: Floats, third: Floats, k: float) -> NDArray[np.complex128]:
    """Integral along the weak axis in the shadow beyond a fold, as `_axis_factor` [m^0.5].

    Gradient [1] and third derivative [1/m^2] are those of the path length along that axis at the fold; k is in rad/m.
    """
    from scipy.special import airy

    distance = np.abs(gradient) * np.cbrt(2 * k**2 / np.abs(third))
    value = np.sqrt(2 * np.pi * k) * np.cbrt(2 / (k * np.abs(third))) * airy(distance)[0]
    return np.asarray(value * np.exp(0.25j * np.pi))


def _with_rough_reflection(
    legs: Legs, sines: Floats, bounced: GlintBouncePoints, scene: Scene, seed: int, scatterers: Scatterers,
    frequency: float, sonar_end: SonarEnd,
) -> tuple[Legs, Legs]:  # fmt: skip
    """Transmit and receive legs with the effect of waves too short to be explicit; a swell alone has none."""
    wind = scene.surface.wind_speed
    if wind is None:
        return legs, legs
    max_wavenumber = shortest_wavenumber(frequency, float(scene.water.sound_speed_at(0.0)))
    max_explicit_wavenumber = 2 * math.pi / scene.surface.shortest_explicit_wavelength
    waves = wind_waves(wind, max_wavenumber, max_explicit_wavenumber)
    sea = GlintSurface(scene, seed, frequency, waves, grazing_sines=sines, bounce_points=bounced)
    return sea.legs(legs, scatterers, sonar_end)


def _unfolded_depth(depth: Floats, bottom_bounces: int, bed: float) -> Floats:
    """Depth of a leg's end, or of its image in the bottom if one of the 0 or 1 bottom bounces lies on its side [m]."""
    return np.asarray(2 * bed - depth if bottom_bounces else depth)


class PointGroups(NamedTuple):
    """Points in groups that share a search: cells of the scatterer grid, a quarter as high as wide."""

    first_row: Integers
    """First row in `order` of each group, and the end of the last, shape (cells + 1,)."""
    order: Integers
    """Rows of the points, group by group, shape (n,)."""
    centre: Floats
    """North, east, depth of each cell's centre [m], shape (cells, 3)."""


def _cells(positions: Floats, scatterer_grid: ScattererGrid, size: float) -> PointGroups:
    """Group points by cells of a horizontal size [m]; a cell's centre depends on the grid alone, not on the points."""
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
