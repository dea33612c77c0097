"""Points of a moving surface that rays from the receiver reach: there facets reflect receive legs.

A hit of a ray from the transmitter is connected with some of them, by the density of the facets that the connection
requires. So both legs of a path lie in the beams, however narrow.

Method: bidirectional path tracing, Veach & Guibas (1994), Proc. 5th Eurographics Workshop on Rendering, 147.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer.hit_energies import ray_energy
from insonify.engines.tracer.ray_bundle import RayBundle, TracedPing
from insonify.engines.tracer.ray_tracing import trace_hits
from insonify.propagation.families import bounce_sequence

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
    """Solid angle of each ray times intensity pattern of the beam, reflection and absorption [sr], (beams, m)."""
    seed: int
    """Seed of the random connections."""

    def draw(self, flat_grazing: Floats, uniform: Floats, spread: float) -> tuple[NDArray[np.int64], Floats]:
        """Points drawn about the grazing angles of calm bounces, and the probability of each, shapes (n,).

        Points are in the order of their grazing angles. Angles are drawn from Cauchy's distribution; the probability
        of a point is that of the interval halfway to its neighbours.

        Args:
            flat_grazing: Grazing angles [rad], (n,).
            uniform: Uniform numbers [1], (n,).
            spread: Half width of the distribution at half of its maximum [rad].
        """
        angle = np.arcsin(np.minimum(np.abs(self.direction[:, 2]), 1.0))
        borders = np.concatenate([[-np.inf], (angle[1:] + angle[:-1]) / 2, [np.inf]])
        row = np.searchsorted(borders, flat_grazing + spread * np.tan(np.pi * (uniform - 0.5))) - 1
        row = np.clip(row, 0, len(angle) - 1)
        low, high = (np.arctan((borders[row + step] - flat_grazing) / spread) / np.pi for step in (0, 1))
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
        order = np.argsort(np.abs(bundle.direction[:, 2]), kind="stable")
        bundle, weight = bundle.take(order), ray_energy(ping, bundle)[:, order]
        vertices.append(
            SurfaceVertices(bounce_sequence(bundle.family), bundle.origin, bundle.direction, bundle.delay, weight, seed)
        )
    return vertices
