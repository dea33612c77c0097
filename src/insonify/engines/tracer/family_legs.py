"""Legs between one end of the sonar and positions by families of reflections: straight, or refracted, ray by ray.

In water of one sound speed they are straight lines from image sources. In layered water they are the eigenrays of the
propagation model, in open water: a family has one set of legs for each of its rays.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer.image_legs import coherent_intensity_factor, image_legs, refracted_sine
from insonify.engines.tracer.ray_bundle import TracedPing
from insonify.propagation.families import bottom_bounces, surface_bounces
from insonify.records.legs import LegStatus
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Boundary, Scatterers

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class TracedLegs:
    """Legs of one ray of one family between one end and n positions, not tested for occlusion."""

    delay: Floats
    """Travel time [s], infinite where there is no such ray, (n,)."""
    length: Floats
    """Path length [m], (n,)."""
    departure: Floats
    """Direction of travel at the sonar, for sound that leaves it [1], (n, 3)."""
    arrival: Floats
    """Direction of travel at the position, for sound that leaves the sonar [1], (n, 3)."""
    reflected: Floats
    """Product of the reflections' intensity factors [1], 0 without a ray, (n,)."""
    spreading: Floats
    """Intensity by spreading alone, re that at 1 m [1], (n,)."""

    def intensity(self, attenuation: float) -> Floats:
        """Intensity re that at 1 m from the source [1], shape (n,).

        Args:
            attenuation: Absorption coefficient of intensity, see `TracedPing` [1/m].
        """
        return np.asarray(self.reflected * np.exp(-attenuation * self.length) * self.spreading)


def family_legs(
    ping: TracedPing, end: Floats, position: Floats, family: str, boundary: Boundary = "target"
) -> list[TracedLegs]:
    """Legs of all rays of one family.

    Args:
        ping: The ping.
        end: Position of transmitter or receiver [m], shape (3,).
        position: Positions [m], shape (n, 3).
        family: Name of the family.
        boundary: Boundary on which the positions lie.
    """
    scene, wavelength = ping.scene, ping.ping_geometry.wavelength
    if ping.propagation_model is None:
        image = image_legs(scene, end, position, family, wavelength)
        delay = image.length / scene.water.sound_speed
        reflected = image.intensity
        if ping.facets is not None and surface_bounces(family):
            reflected = reflected * ping.facets.coherent_intensity(np.abs(image.arrival[:, 2])) ** surface_bounces(
                family
            )
        return [TracedLegs(delay, image.length, image.departure, image.arrival, reflected, 1 / image.length**2)]
    n = len(position)
    points = Scatterers(
        boundary, boundary, PointTargetLaw(0.0), position, np.zeros((n, 3)), np.ones(n), np.ones(n, complex),
        np.zeros(n, np.uint64),
    )  # fmt: skip
    legs = ping.propagation_model.open_water().legs(end, points, (family,), ping.ping_geometry.frequency)
    at_end, at_bed, at_surface = scene.water.sound_speed_at(np.array([end[2], scene.seabed.depth, 0.0]))
    result = []
    for row in range(len(legs.families)):
        horizontal, exists = np.hypot(*legs.departure[row, :, :2].T), legs.status[row] == LegStatus.CLEAR
        reflected = np.abs(legs.reflection_coefficient[row]) ** 2 * exists
        if bottom_bounces(family):
            sine = refracted_sine(horizontal * at_bed / at_end)
            reflected *= coherent_intensity_factor(scene, family, float(end[2]), legs.length[row], sine, wavelength)
        if ping.facets is not None and surface_bounces(family):
            sine = refracted_sine(horizontal * at_surface / at_end)
            reflected *= ping.facets.coherent_intensity(sine) ** surface_bounces(family)
        result.append(TracedLegs(
            np.where(exists, legs.delay[row], np.inf), legs.length[row], legs.departure[row], legs.arrival[row],
            reflected, legs.spreading[row] ** 2,
        ))  # fmt: skip
    return result


def nearest_delay(legs: list[TracedLegs], delay: Floats) -> Floats:
    """Travel times, among the rays of a family, nearest to given ones [s], infinite without a ray, shape (n,).

    Args:
        legs: Legs of all rays of the family.
        delay: Given travel times [s], shape (n,).
    """
    if not legs:
        return np.full(len(delay), np.inf)
    delays = np.array([ray_legs.delay for ray_legs in legs])
    given = np.where(np.isfinite(delay), delay, 0.0)  # no given ray: any will do
    return np.asarray(delays[np.argmin(np.abs(delays - given), axis=0), np.arange(len(delay))])


def is_clear(
    ping: TracedPing, position: Floats, family: str, legs: TracedLegs, requested: NDArray[np.bool_], *,
    end: Floats | None = None,
) -> NDArray[np.bool_]:  # fmt: skip
    """True for positions whose legs are not occluded, shape (n,).

    Args:
        ping: The ping.
        position: The positions [m], (n, 3).
        family: Family of the legs.
        legs: The legs.
        requested: Positions to test, (n,).
        end: Position, or positions, from which the legs come [m], (3,) or (n, 3); None: the receiver.
    """
    wavelength = ping.ping_geometry.wavelength
    if ping.propagation_model is None:
        other_end = ping.receive if end is None else end
        return ping.intersector.is_clear_straight(other_end, position, family, wavelength, requested)
    return ping.intersector.is_clear_refracted(position, -legs.arrival, legs.length, family, wavelength, requested)
