"""Points of a moving surface that rays from the receiver reach: ends of receive legs that are reflected off facets.

A hit of a ray from the transmitter is connected with some of them, by the density of the facets that the connection
requires. So both ends of a path lie in the beams, however narrow.

Method: bidirectional path tracing, Veach & Guibas (1994), Proc. 5th Eurographics Workshop on Rendering, 147.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer.family_legs import TracedLegs
from insonify.engines.tracer.image_legs import (
    bounce_letters,
    coherent_intensity_factor,
    image_source_depth,
    reflected_intensity,
)
from insonify.engines.tracer.ray_bundle import RayBundle, TracedPing
from insonify.engines.tracer.ray_tracing import trace_hits

Floats = NDArray[np.float64]


class SurfaceVertices(NamedTuple):
    """Points of the surface by one chain of reflections, m of them."""

    chain: str
    """Letters of the reflections before the surface, from the receiver outwards."""
    position: Floats
    """Positions [m], (m, 3)."""
    direction: Floats
    """Directions of the rays towards them [1], (m, 3)."""
    delay: Floats
    """Travel times from the receiver [s], (m,)."""
    weight: Floats
    """Solid angle of each at the receiver, times beam gain, reflection and absorption [sr], (beams, m)."""
    seed: int
    """Seed of the random connections."""

    def drawn(self, calm: Floats, uniform: Floats, spread: float) -> tuple[NDArray[np.int64], Floats]:
        """Points drawn about the grazing angles of calm bounces, and the probability of each, shapes (n,).

        Points are in the order of their grazing angles. Angles are drawn from Cauchy's distribution; the probability
        of a point is that of the interval halfway to its neighbours.

        Args:
            calm: Grazing angles [rad], (n,).
            uniform: Uniform numbers [1], (n,).
            spread: Half width of the distribution at half of its maximum [rad].
        """
        angle = np.arcsin(np.minimum(np.abs(self.direction[:, 2]), 1.0))
        borders = np.concatenate([[-np.inf], (angle[1:] + angle[:-1]) / 2, [np.inf]])
        row = np.searchsorted(borders, calm + spread * np.tan(np.pi * (uniform - 0.5))) - 1
        row = np.clip(row, 0, len(angle) - 1)
        low, high = (np.arctan((borders[row + step] - calm) / spread) / np.pi for step in (0, 1))
        return row, np.maximum(high - low, 1e-12)


def surface_vertices(ping: TracedPing, rays: RayBundle, seed: int) -> list[SurfaceVertices]:
    """Points of the surface that rays reach by boundaries, chain by chain.

    Args:
        ping: The ping with both ends exchanged.
        rays: Rays that leave the receiver.
        seed: Seed of the random connections.
    """
    vertices = []
    for hits in trace_hits(ping, rays):
        bundle = hits.rays
        if hits.letter != "S" or "T" in bundle.chain or not len(bundle.delay):
            continue
        weight = bundle.solid_angle * bundle.energy_fraction * np.exp(-ping.attenuation * bundle.length)
        sine = np.minimum(np.abs(bundle.direction[:, 2]), 1.0)
        weight = weight * coherent_intensity_factor(
            ping.scene, bundle.family, float(ping.transmit[2]), bundle.length, sine, ping.ping_geometry.wavelength
        )
        gain = ping.transmit_beams.gain(bundle.launch) ** 2
        order = np.argsort(np.abs(bundle.direction[:, 2]), kind="stable")
        bundle, weight = bundle.take(order), (weight * gain)[:, order]
        vertices.append(
            SurfaceVertices(bounce_letters(bundle.family), bundle.origin, bundle.direction, bundle.delay, weight, seed)
        )
    return vertices


def legs_from_surface(ping: TracedPing, point: Floats, position: Floats, family: str) -> TracedLegs:
    """Straight legs from points of the surface to positions, both (n, 3) [m], by a family whose surface is calm."""
    scene, wavelength = ping.scene, ping.ping_geometry.wavelength
    ray = position - point
    ray[:, 2] = position[:, 2] - image_source_depth(family, 0.0, scene.seabed.depth)
    length = np.maximum(np.linalg.norm(ray, axis=1), 1e-6)
    arrival = ray / length[:, None]
    departure = arrival * np.array([1, 1, -1 if len(bounce_letters(family)) % 2 else 1])
    sine = np.minimum(np.abs(arrival[:, 2]), 1.0)
    reflected = reflected_intensity(scene, family, np.arcsin(sine))
    reflected = reflected * coherent_intensity_factor(scene, family, 0.0, length, sine, wavelength)
    if ping.facets is not None and "S" in family:
        reflected = reflected * ping.facets.coherent_intensity(sine) ** family.count("S")
    delay = length / scene.water.sound_speed
    return TracedLegs(delay, length, departure, arrival, reflected, 1 / length**2)
