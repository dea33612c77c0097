"""Legs under a hull: reflections between seabed and hull, and the part of the surface reflections that passes it.

The underside is a finite specular reflector. For the water below, it is the surface of a sea whose depths are counted
from the hull: the legs are those of the propagation model in that sea, with H in place of S.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.engines.relief_reflections import relief_roughness_factor
from insonify.ocean.scenario_profile import ScenarioProfile
from insonify.propagation.bed_roughness import bed_roughness
from insonify.propagation.families import bounce_sequence, first_boundary, last_boundary, surface_bounces
from insonify.propagation.glints import GlintSurface, SonarEnd
from insonify.propagation.propagation_model import PropagationModel, RayDomain
from insonify.propagation.propagation_model_choice import propagation_model_for
from insonify.records.legs import Legs, joined_legs
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.surface import Surface
from insonify.sonar.hull import HullPlate

Floats = NDArray[np.float64]
ROUNDING = 1e-6
"""Height above the hull's depth of a point that is still below it [m]."""
Complexes = NDArray[np.complex128]


def hull_families(followed: tuple[str, ...], *, echoes: bool = False) -> tuple[str, ...]:
    """Families between seabed and hull: those followed that begin at the seabed, with H for S.

    Args:
        followed: Families of the legs.
        echoes: True: of boundary echoes, which end at the sonar and so with a reflection off the seabed too.
    """
    return tuple(
        name.replace("S", "H")
        for name in followed
        if first_boundary(name) == "bottom"
        and surface_bounces(name)
        and (last_boundary(name) == "bottom" or not echoes)
    )


def with_hull(
    legs: tuple[Legs, Legs], families: tuple[str, ...], rays: PropagationModel, plate: HullPlate, sonar_end: SonarEnd,
    scatterers: Scatterers, frequency: float, seed: int | None,
) -> tuple[Legs, Legs]:  # fmt: skip
    """Legs under a hull: those of the open sea, in its shadow where they pass it, and those between it and the seabed.

    Args:
        legs: Transmit and receive legs of the open sea between one end and the scatterers; one object if equal.
        families: Families from `hull_families`.
        rays: Propagation model of the open sea; legs by the hull disregard relief and targets of its scene.
        plate: The hull's underside.
        sonar_end: The end.
        scatterers: End points of the legs, n of them.
        frequency: Frequency of the sound [Hz].
        seed: Seed of the glints of a rough seabed; None: its reflections have their coherent part alone.

    Returns:
        Transmit legs and receive legs.
    """
    (transmit, receive), scene, position = legs, rays.scene, sonar_end.position
    shadow = plate_factors(transmit, plate, position, scatterers.position, scene, frequency)
    shadowed = transmit.times(shadow)
    both = shadowed, shadowed
    if receive is not transmit:
        both = shadowed, replace(receive, reflection_coefficient=shadowed.reflection_coefficient)
    if not families or scatterers.boundary == "surface":
        return both
    under = _legs_off_hull(families, rays, plate, sonar_end, scatterers, frequency, seed)
    factor = plate_factors(under[0], plate, position, scatterers.position, scene, frequency)
    factor *= [[(-plate.reflection) ** name.count("H")] for name in under[0].families]  # in place of the sea's -1
    below = scatterers.position[:, 2] >= plate.centre[2] - ROUNDING
    hull_legs = [replace(off_hull, reflection_coefficient=off_hull.reflection_coefficient * factor,
                    visibility=off_hull.visibility * below) for off_hull in under]  # fmt: skip
    first = joined_legs(both[0], hull_legs[0])
    return first, first if receive is transmit and under[0] is under[1] else joined_legs(both[1], hull_legs[1])


def _legs_off_hull(
    families: tuple[str, ...], rays: PropagationModel, plate: HullPlate, sonar_end: SonarEnd, scatterers: Scatterers,
    frequency: float, seed: int | None,
) -> tuple[Legs, Legs]:  # fmt: skip
    """Legs between seabed and hull, of the sea whose depths begin there and whose surface is plane: see `with_hull`."""
    scene, top = rays.scene, float(plate.centre[2])
    down = np.array([0.0, 0.0, top])
    farthest = 0.0
    if scene.water.layered:
        from insonify.propagation.refracted_rays import RefractedRays  # kernels that straight rays do not need

        assert isinstance(rays, RefractedRays)
        farthest = rays.domain.max_range
    end = SonarEnd(sonar_end.position - down, sonar_end.ping_time, sonar_end.transmit_position - down)
    below = _below_hull(scene, top, float(end.position[2]), farthest)
    points = replace(scatterers, position=np.maximum(scatterers.position - down, [-np.inf, -np.inf, 0.0]))
    names, bed = tuple(name.replace("H", "S") for name in families), below.scene.seabed.depth
    legs = below.legs(end.position, points, names, frequency)
    speed = float(scene.water.sound_speed_at(scene.seabed.depth))
    roughness = None if seed is None else bed_roughness(scene.seabed, frequency, speed)
    terrain = scene.seabed.terrain
    if terrain is not None and (roughness is None or not terrain.relief.is_waves):
        coherent = relief_roughness_factor(legs, end.position, terrain, speed / frequency, bed)
        legs = legs.times(coherent)
    both = legs, legs
    if roughness is not None and seed is not None:
        moved = replace(roughness, depth=bed)
        both = GlintSurface(below.scene, seed, frequency, None, moved, under_hull=True).legs(legs, points, end)
    if both[0] is both[1]:
        return (_renamed(legs),) * 2
    return _renamed(both[0]), _renamed(both[1])


def _renamed(legs: Legs) -> Legs:
    """Legs with H for S."""
    return replace(legs, families=tuple(name.replace("S", "H") for name in legs.families))


def plate_factors(
    legs: Legs, plate: HullPlate, position: Floats, points: Floats, scene: Scene, frequency: float
) -> Complexes:
    """Factor of the hull on each leg, shape (f, n): of its size where it reflects, of its shadow on paths past it [1].

    Args:
        legs: Legs by flat boundaries from a position to n points, or glints; H is reflected by the hull, S passes it.
        plate: The hull's underside.
        position: North, east, depth at which the legs begin [m], shape (3,).
        points: North, east, depth at which they end [m], shape (n, 3).
        scene: Water and seabed.
        frequency: Frequency [Hz].
    """
    wavelength, hull = float(scene.water.sound_speed_at(plate.centre[2])) / frequency, float(plate.centre[2])
    factor = np.ones(legs.delay.shape, complex)
    for row, family in enumerate(legs.families):
        bounces, crossings, first, last = _unfolded_depths(family, position[2], hull, scene.seabed.depth)
        total_travel = np.maximum(last[0] + np.abs(points[:, 2] - last[1]), 1e-9)
        for at, passes in [(at, False) for at in bounces] + [(at, True) for at in crossings]:
            fraction = np.clip(at / total_travel, 0.0, 1.0)
            crossing = position[:2] + fraction[:, None] * (points[:, :2] - position[:2])
            if legs.glints is not None and legs.glints.bounce_id[row] >= 0:
                ends = position[:2], points[:, :2]
                crossing = _displaced(at, (first, last[0], total_travel), ends, legs.departure[row], legs.arrival[row])
            length = legs.length[row]
            within = rectangle_factor(plate, crossing, length * fraction, length * (1 - fraction), wavelength)
            if passes:  # a path that ends before it returns to the hull's depth does not cross it again
                within = np.where(at <= total_travel, 1 - within, 1.0)
            factor[row] *= within
    return factor


def _displaced(
    at: float, travels: tuple[float, float, Floats], ends: tuple[Floats, Floats], departure: Floats, arrival: Floats
) -> Floats:
    """North and east of glint legs after some vertical travel, straight between first and last bounce [m], (n, 2).

    Args:
        at: Vertical travel [m].
        travels: Vertical travel to the first bounce, to the last, and to the end, shape (n,) [m].
        ends: North and east of the beginning, shape (2,), and of the end, shape (n, 2) [m].
        departure: Unit vectors of travel at the beginning, shape (n, 3).
        arrival: Unit vectors of travel at the end, shape (n, 3).
    """
    first, last, total_travel = travels
    departure_cotangent, arrival_cotangent = (
        ray[:, :2] / np.maximum(np.abs(ray[:, 2:]), 1e-3) for ray in (departure, arrival)
    )

    def before(travel: float) -> Floats:
        return np.asarray(ends[0] + travel * departure_cotangent)

    def after(travel: float) -> Floats:
        return np.asarray(ends[1] - np.maximum(total_travel - travel, 0.0)[:, None] * arrival_cotangent)

    if at <= first or at >= last:
        return before(at) if at <= first else after(at)
    return before(first) + (at - first) / (last - first) * (after(last) - before(first))


def rectangle_factor(plate: HullPlate, position: Floats, before: Floats, after: Floats, wavelength: float) -> Complexes:
    """Pressure reflected by a rectangle about the bounce, re that of an unbounded plane [1], shape (n,).

    Args:
        plate: The rectangle.
        position: North and east of the bounces [m], shape (n, 2).
        before: Path length to the bounce [m], shape (n,).
        after: Path length from the bounce [m], shape (n,).
        wavelength: Wavelength of the sound [m].

    Source: Fresnel's integral over a rectangular aperture, as in Born & Wolf (1999), Principles of Optics, section 8.7
    (section number not verified). Valid: near normal incidence, the plate's size small against both lengths or
    large against the Fresnel zone.
    """
    from scipy.special import fresnel

    scale = np.sqrt(2 * (before + after) / (wavelength * np.maximum(before * after, 1e-12)))
    product = np.ones(np.shape(scale), complex)
    for axis, half in zip(plate.axes, plate.half_size, strict=True):
        offset = (position - plate.centre[:2]) @ axis
        (s0, c0), (s1, c1) = fresnel((-half - offset) * scale), fresnel((half - offset) * scale)
        product = product * (1 + 1j) / 2 * ((c1 - c0) - 1j * (s1 - s0))
    return product


def _unfolded_depths(
    family: str, start: float, hull: float, bed: float
) -> tuple[list[float], list[float], float, tuple[float, float]]:
    """Vertical distances travelled along a path with reflections.

    Args:
        family: Family of the path.
        start: Depth at which it begins [m].
        hull: Depth of the hull [m].
        bed: Depth of the seabed [m].

    Returns:
        Vertical travel to each reflection at the hull [m]; to each passage of its depth on the path to and from the
        surface [m]; to the first bounce [m]; to the last bounce, and the depth of that [m].
    """
    turning = {"B": bed, "S": 0.0, "H": hull}
    travel, depth, bounces, crossings = 0.0, start, [], []
    for letter in bounce_sequence(family):
        travel, depth = travel + abs(turning[letter] - depth), turning[letter]
        if letter == "H":
            bounces.append(travel)
        elif letter == "S":
            crossings += [travel - hull, travel + hull]
    letters = bounce_sequence(family)
    first = abs(turning[letters[0]] - start) if letters else 0.0
    return bounces, crossings, first, (travel, depth)


@lru_cache(maxsize=8)
def _below_hull(scene: Scene, hull: float, end: float, farthest: float) -> PropagationModel:
    """Propagation model of the water below a hull, with depths from there.

    Args:
        scene: The scene.
        hull: Depth of the hull [m].
        end: Depth of the sonar's end [m].
        farthest: Greatest horizontal distance of a point in layered water [m].
    """
    water, bed = scene.water, scene.seabed.unchecked_copy(depth=scene.seabed.depth - hull, relief=())
    if water.profile is not None and water.layered:
        rows = np.array([hull, *(depth for depth in water.profile.depth if hull < depth)])
        speed = tuple(float(value) for value in water.sound_speed_at(rows))
        moved = ScenarioProfile.model_validate({"depth": (rows - hull).tolist(), "speed": speed})
        water = water.unchecked_copy(profile=moved)
    shifted = scene.unchecked_copy(water=water, seabed=bed, surface=Surface(), targets=())
    return propagation_model_for(shifted, RayDomain((max(end - hull, 0.0),), False, (0.0, bed.depth), farthest))
