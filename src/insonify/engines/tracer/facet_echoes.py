"""Echoes with receive legs that facets of a moving surface reflect."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.engines.boundary_echoes import boundary_echo_families, surface_law_has_facets
from insonify.engines.tracer.family_legs import TracedLegs, family_legs, is_clear, nearest_delay
from insonify.engines.tracer.hit_energies import (
    OWN_BOUNCE,
    channel_energies,
    in_window,
    interference,
    transmitted_energy,
)
from insonify.engines.tracer.interaction import scattered_per_steradian
from insonify.engines.tracer.ray_bundle import RayBundle, RayHits, TracedPing
from insonify.engines.tracer.surface_vertices import SurfaceVertices
from insonify.propagation.families import bounce_sequence, image_depth
from insonify.records.echo_energies import EchoEnergies
from insonify.scene.scatterers import BOUNDARY_ECHO

Floats = NDArray[np.float64]

CONNECTIONS = 4
"""Points of a moving surface with which each hit of a ray is connected, for each family [1]."""
FIRST_COUNTER = 1 << 16
"""Third counter of the random numbers of connections: above those of groups of rays."""


def facet_echoes(
    ping: TracedPing, hits: RayHits, transmitted: Floats, vertices: list[SurfaceVertices]
) -> Iterator[EchoEnergies]:  # fmt: skip
    """Echoes of hits that a facet of a moving surface reflects to the receiver.

    Each hit is connected with `CONNECTIONS` random points of the surface.

    Paths with facets on the transmit leg alone are the same paths travelled backwards.

    Args:
        ping: The ping.
        hits: Hits of rays on one interface.
        transmitted: Result of `transmitted_energy`, (beams, n).
        vertices: Points of the surface.
    """
    by_facet, own_bounce = "s" in hits.rays.chain, OWN_BOUNCE[hits.contribution]
    if by_facet and ping.is_reversed:
        return
    for vertex_group, group_vertices in enumerate(vertices):
        for family in ping.path_settings.followed_families:
            bounces_to_facet = group_vertices.chain + "S"
            if family.startswith(bounces_to_facet) and not family.endswith(own_bounce):
                yield from _connected_echoes(ping, hits, transmitted, group_vertices, (family, vertex_group))


def _connected_echoes(
    ping: TracedPing, hits: RayHits, transmitted: Floats, vertices: SurfaceVertices, leg: tuple[str, int]
) -> Iterator[EchoEnergies]:  # fmt: skip
    """Echoes of hits that reach the receiver by one family and a facet at a random one of some surface points.

    Args:
        ping: The ping.
        hits: Hits of n rays on one interface.
        transmitted: Result of `transmitted_energy`, (beams, n).
        vertices: Points of the surface.
        leg: Family of the receive legs, and index of these points among all groups.
    """
    (family, vertex_group), n, facets = leg, len(hits.rays.delay), ping.facets
    remaining_family = family[len(vertices.chain) + 1 :] or "D"
    assert hits.law is not None and facets is not None
    counter = FIRST_COUNTER + (vertex_group << 8) + (len(hits.rays.chain) << 4) + len(remaining_family)
    uniform = random_keys.uniforms(
        vertices.seed, random_keys.TRACER, np.arange(n), counter, ping.ping_geometry.ping, 2 + ping.is_reversed
    )[:, :CONNECTIONS]
    image_ray = hits.rays.origin - ping.receive
    image_ray[:, 2] = hits.rays.origin[:, 2] - image_depth(family, ping.receive[2], ping.scene.seabed.depth)
    flat_grazing = np.arctan2(np.abs(image_ray[:, 2]), np.hypot(image_ray[:, 0], image_ray[:, 1]))
    vertex_row, probability = vertices.draw(np.repeat(flat_grazing, CONNECTIONS), uniform.ravel(), facets.spread)
    hit_row = np.repeat(np.arange(n), CONNECTIONS)
    mean_count = probability * CONNECTIONS
    connected = _Connections(hits.rays.take(hit_row), hits.normal[hit_row], vertex_row, hit_row, mean_count)
    # boundaries are horizontal: only the difference of positions counts
    from_point = connected.rays.origin - vertices.position[vertex_row]
    for legs in family_legs(ping, np.zeros(3), from_point, remaining_family):
        yield from _echoes_by_legs(ping, hits, transmitted, vertices, connected, legs, (family, remaining_family))


class _Connections(NamedTuple):
    """Hits connected with points of the surface, m of them."""

    rays: RayBundle
    """Rays at their hits."""
    normal: Floats
    """Unit normals there [1], (m, 3)."""
    vertex_row: NDArray[np.int64]
    """Row of each point of the surface among the vertices, (m,)."""
    hit_row: NDArray[np.int64]
    """Row of each hit, (m,)."""
    mean_count: Floats
    """Mean number of connections of the hit with that point, by which the energy is divided [1], (m,)."""


def _echoes_by_legs(
    ping: TracedPing, hits: RayHits, transmitted: Floats, vertices: SurfaceVertices, connected: _Connections,
    legs: TracedLegs, names: tuple[str, str],
) -> Iterator[EchoEnergies]:  # fmt: skip
    """Echoes of connections, each by one ray between the hit and the point of the surface.

    Args:
        ping: The ping.
        hits: Hits of rays on one interface.
        transmitted: Result of `transmitted_energy`, (beams, n).
        vertices: Points of the surface.
        connected: The connections.
        legs: Their legs from the surface.
        names: Family of the receive legs, and its reflections after the facet.
    """
    (family, remaining_family), facets = names, ping.facets
    assert hits.law is not None and facets is not None
    rays, normal, vertex_row, hit_row, mean_count = connected
    delay = rays.delay + legs.delay + vertices.delay[vertex_row]
    returned = scattered_per_steradian(hits.law, rays.direction, -legs.arrival, normal)
    returned *= facets.scattered_per_steradian(vertices.direction[vertex_row], legs.departure)
    returned *= legs.intensity(ping.attenuation) / mean_count
    requested = (returned > 0) & in_window(ping, delay)
    vertex = vertices.position[vertex_row]
    clear = np.flatnonzero(is_clear(ping, rays.origin, remaining_family, legs, requested, end=vertex))
    if not clear.size:
        return
    rays, vertex_row, hit_row = rays.take(clear), vertex_row[clear], hit_row[clear]
    receive_delay = legs.delay[clear] + vertices.delay[vertex_row]
    energy = channel_energies(ping, transmitted[:, hit_row], vertices.weight[:, vertex_row] * returned[clear])
    rate, variance = facets.phase_rate(vertices.direction[vertex_row], legs.departure[clear])
    lag = rays.delay + receive_delay - 2 * vertices.delay[vertex_row]
    phase, phase_variance = rate * lag, variance * lag**2
    if "s" in rays.chain:
        lag_of_transmit_facet = rays.delay + receive_delay - 2 * rays.last_facet[:, 0]
        phase = phase - rays.last_facet[:, 1] * lag_of_transmit_facet
        phase_variance = phase_variance + rays.last_facet[:, 2] * lag_of_transmit_facet**2
    elif ping.ping_geometry.is_monostatic:
        energy *= 2
    reciprocal = np.cos(phase) * np.exp(-phase_variance / 2)
    if not ping.ping_geometry.is_monostatic:
        delay_difference = _excess_delay(
            ping, vertices.chain, vertices.position[vertex_row], vertices.delay[vertex_row]
        )
        if "s" in rays.chain:
            delay_difference = delay_difference - _excess_delay(
                ping, rays.chain[: rays.chain.rindex("s")].upper(), rays.last_facet[:, 3:], rays.last_facet[:, 0]
            )
        elif "T" in rays.chain:
            delay_difference = np.full(len(delay_difference), np.inf)
        else:
            delay_difference = delay_difference - _excess_delay(ping, rays.family, rays.origin, rays.delay)
        reciprocal *= interference(ping, delay_difference)
    chains = (family, rays.family) if ping.is_reversed else (rays.family, family)
    yield EchoEnergies(hits.contribution, hits.object, *chains, delay[clear], energy, reciprocal)


def _excess_delay(ping: TracedPing, chain: str, position: Floats, expected_delay: Floats) -> Floats:
    """Delay of legs of a chain from positions to the receiver, less that to the transmitter [s], (n,).

    Args:
        ping: The ping.
        chain: Letters of the reflections; empty for none.
        position: The positions [m], (n, 3).
        expected_delay: Delays near which those of refracted rays are sought [s], (n,).
    """
    from_receiver, from_transmitter = (
        nearest_delay(family_legs(ping, end, position, chain or "D"), expected_delay)
        for end in (ping.receive, ping.transmit)
    )
    return np.asarray(from_receiver - from_transmitter)


def facet_boundary_echoes(ping: TracedPing, hits: RayHits) -> Iterator[EchoEnergies]:
    """Sound from the transmitter to the receiver by reflections alone, the last one at the surface by facets.

    Args:
        ping: The ping.
        hits: Hits of rays on one interface.
    """
    rays, facets = hits.rays, ping.facets
    if facets is None or hits.letter != "S" or "T" in rays.chain or ping.is_reversed:
        return
    if surface_law_has_facets(ping.scene, ping.path_settings):
        return
    echoes = boundary_echo_families(ping.path_settings, two_platforms=False)
    for family in ping.path_settings.followed_families:
        name = bounce_sequence(rays.family) + "S" + bounce_sequence(family)[::-1]
        if name not in echoes:
            continue
        for receive_leg in family_legs(ping, ping.receive, rays.origin, family, "surface"):
            returned = facets.scattered_per_steradian(rays.direction, -receive_leg.arrival)
            returned = returned * receive_leg.intensity(ping.attenuation)
            delay = rays.delay + receive_leg.delay
            requested = (returned > 0) & in_window(ping, delay)
            clear = np.flatnonzero(is_clear(ping, rays.origin, family, receive_leg, requested))
            if clear.size:
                transmitted = transmitted_energy(ping, rays.take(clear))
                gain = ping.receive_beams.gain(receive_leg.departure[clear]) ** 2
                energy = channel_energies(ping, transmitted, gain * returned[clear])
                yield EchoEnergies(BOUNDARY_ECHO, BOUNDARY_ECHO, name, "", delay[clear], energy, np.zeros(clear.size))
