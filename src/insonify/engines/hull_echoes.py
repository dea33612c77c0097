"""Boundary echoes under a hull: multiples between seabed and hull, and what the hull leaves of those by the surface.

The underside is a finite mirror. For the water below it, it is the surface of a sea whose depths begin at the hull: the
legs of that sea are those of the propagation model, with H in place of S.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.scenario_profile import ScenarioProfile
from insonify.ocean.water import Water
from insonify.propagation.families import bounce_sequence
from insonify.propagation.image_sources import StraightRays
from insonify.propagation.propagation_model import PropagationModel, RayDomain
from insonify.propagation.propagation_model_choice import propagation_model_for
from insonify.records.legs import Legs, joined_legs
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.scene.surface import Surface
from insonify.sonar.hull import HullPlate

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def hull_families(followed: tuple[str, ...]) -> tuple[str, ...]:
    """Families of multiples between seabed and hull: those followed that begin and end at the seabed, H for S."""
    return tuple(name.replace("S", "H") for name in followed if name[0] == name[-1] == "B" and "S" in name)


def with_hull(
    legs: Legs, families: tuple[str, ...], scene: Scene, plate: HullPlate, position: Floats, transmitter: Scatterers,
    frequency: float,
) -> Legs:  # fmt: skip
    """Legs to the transmitter under a hull: those past it in its shadow, and its multiples.

    Args:
        legs: Legs of the open sea.
        families: Families from `hull_families`.
        scene: The scene.
        plate: The hull's underside.
        position: North, east, depth of the receiver [m], shape (3,).
        transmitter: Point at the transmitter.
        frequency: Frequency of the sound [Hz].
    """
    ends = position, transmitter.position[0], scene.seabed.depth
    shadow = plate_factors(legs, plate, *ends, scene.water, frequency)
    legs = replace(legs, reflection_coefficient=legs.reflection_coefficient * shadow)
    if not families:
        return legs
    return joined_legs(legs, hull_legs(scene, plate, position, transmitter, families, frequency))


def hull_legs(
    scene: Scene, plate: HullPlate, position: Floats, transmitter: Scatterers, families: tuple[str, ...],
    frequency: float,
) -> Legs:  # fmt: skip
    """Legs between seabed and hull from the receiver to the transmitter.

    Args:
        scene: The scene; its seabed's relief and its targets take no part.
        plate: The hull's underside.
        position: North, east, depth of the receiver [m], shape (3,).
        transmitter: Point at the transmitter.
        families: Families from `hull_families`.
        frequency: Frequency of the absorption [Hz].
    """
    down = np.array([0.0, 0.0, plate.centre[2]])
    rays = _below_hull(
        scene.water, scene, float(plate.centre[2]), float(position[2]), float(transmitter.position[0, 2])
    )
    below = replace(transmitter, position=transmitter.position - down)
    legs = rays.legs(position - down, below, tuple(name.replace("H", "S") for name in families), frequency)
    legs = replace(legs, families=tuple(name.replace("S", "H") for name in legs.families))
    flat = np.array([[(-plate.reflection) ** name.count("H")] for name in legs.families])  # in place of the sea's -1
    return replace(
        legs, reflection_coefficient=legs.reflection_coefficient * flat
        * plate_factors(legs, plate, position, transmitter.position[0], scene.seabed.depth, scene.water, frequency),
    )  # fmt: skip


def plate_factors(
    legs: Legs, plate: HullPlate, position: Floats, end: Floats, bed_depth: float, water: Water, frequency: float
) -> Complexes:
    """Factor of the hull on each leg, shape (f, n): of its size on bounces off it, of its shadow on paths past it [1].

    Args:
        legs: Legs by flat mirrors from a position to an end point; H bounces off the hull, S passes it.
        plate: The hull's underside.
        position: North, east, depth at which the legs begin [m], shape (3,).
        end: North, east, depth at which they end [m], shape (3,).
        bed_depth: Depth of the seabed [m].
        water: The water.
        frequency: Frequency [Hz].
    """
    wavelength = float(water.sound_speed_at(plate.centre[2])) / frequency
    factor = np.ones(legs.delay.shape, complex)
    for row, family in enumerate(legs.families):
        bounces, crossings, whole = _unfolded_depths(family, position[2], end[2], float(plate.centre[2]), bed_depth)
        for at, passes in [(at, False) for at in bounces] + [(at, True) for at in crossings]:
            part = at / max(whole, 1e-9)
            place = position[:2] + part * (end[:2] - position[:2])
            distances = legs.length[row] * part, legs.length[row] * (1 - part)
            within = rectangle_factor(plate, place, *distances, wavelength)
            factor[row] *= 1 - within if passes else within
    return factor


def rectangle_factor(plate: HullPlate, position: Floats, before: Floats, after: Floats, wavelength: float) -> Complexes:
    """Part of a plane mirror's reflected pressure that a rectangle about the bounce reflects [1], shape (n,).

    Args:
        plate: The rectangle.
        position: North and east of the bounce [m], shape (2,).
        before: Path length to the bounce [m], shape (n,).
        after: Path length from the bounce [m], shape (n,).
        wavelength: Wavelength of the sound [m].

    Source: Fresnel's integral over a rectangular aperture, as in Born & Wolf (1999), Principles of Optics, section 8.7
    (section number from memory). Valid: near normal incidence, the plate's size small against both lengths or
    large against the Fresnel zone.
    """
    from scipy.special import fresnel

    scale = np.sqrt(2 * (before + after) / (wavelength * np.maximum(before * after, 1e-12)))
    product = np.ones(np.shape(scale), complex)
    for axis, half in zip(plate.axes, plate.half_size, strict=True):
        off = float(axis @ (position - plate.centre[:2]))
        (s0, c0), (s1, c1) = fresnel((-half - off) * scale), fresnel((half - off) * scale)
        product = product * (1 + 1j) / 2 * ((c1 - c0) - 1j * (s1 - s0))
    return product


def _unfolded_depths(
    family: str, start: float, stop: float, hull: float, bed: float
) -> tuple[list[float], list[float], float]:
    """Vertical travel to each bounce off the hull, to each crossing of its depth on the way by the surface, in all."""
    turning = {"B": bed, "S": 0.0, "H": hull}
    travel, depth, bounces, crossings = 0.0, start, [], []
    for letter in bounce_sequence(family):
        travel, depth = travel + abs(turning[letter] - depth), turning[letter]
        if letter == "H":
            bounces.append(travel)
        elif letter == "S":
            crossings += [travel - hull, travel + hull]
    return bounces, crossings, travel + abs(stop - depth)


@lru_cache(maxsize=8)
def _below_hull(water: Water, scene: Scene, hull: float, *depths: float) -> PropagationModel:
    """Propagation model of the water below a hull, with depths from there."""
    bed = scene.seabed.unchecked_copy(depth=scene.seabed.depth - hull, relief=())
    if water.profile is not None and water.layered:
        deeper = [depth for depth in water.profile.depth if hull < depth]
        rows = np.array([hull, *deeper])
        speed = tuple(float(value) for value in water.sound_speed_at(rows))
        moved = ScenarioProfile.model_validate({"depth": (rows - hull).tolist(), "speed": speed})
        water = water.unchecked_copy(profile=moved)
    shifted = scene.unchecked_copy(water=water, seabed=bed, surface=Surface(), targets=())
    if not water.layered:
        return StraightRays(shifted)
    ends = tuple(sorted({max(depth - hull, 0.0) for depth in depths}))
    return propagation_model_for(shifted, RayDomain(ends, False, (0.0, bed.depth), 2 * bed.depth))
