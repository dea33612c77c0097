"""Receive legs of the tracer: scattering at the interfaces that rays hit, towards the receiver by every family."""

from collections.abc import Iterator
from itertools import product

import numpy as np
from numpy.typing import NDArray

from insonify.engines.boundary_echoes import boundary_echo_families, sediment_bounce_factor
from insonify.engines.tracer.facet_echoes import facet_echoes
from insonify.engines.tracer.family_legs import TracedLegs, family_legs, is_clear, nearest_delay
from insonify.engines.tracer.hit_energies import (
    OWN_BOUNCE,
    channel_energies,
    in_window,
    interference,
    transmitted_energy,
)
from insonify.engines.tracer.interaction import scattered_per_steradian
from insonify.engines.tracer.ray_bundle import RayBundle, RayHits, ReceiverPaths, TracedPing
from insonify.engines.tracer.ray_tracing import MAX_MISS_DISTANCE, face_chains, receiver_paths
from insonify.engines.tracer.surface_vertices import SurfaceVertices
from insonify.records.echo_energies import EchoEnergies
from insonify.scene.scatterers import BOUNDARY_ECHO
from insonify.scene.target import PointTarget
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]


MAX_DELAY_DIFFERENCE = 1e-7
"""Difference of delays below which two refracted rays of one chain are one [s]."""


def echoes(ping: TracedPing, hits: RayHits, vertices: list[SurfaceVertices]) -> Iterator[EchoEnergies]:
    """Echoes of some hits at the receiver, family by family.

    A path with two different families arrives together with its reverse, and the two interfere. Each item
    has the energy of one order, and as `reciprocal` the interference with the other order: 0 where there is no
    distinct other order. Paths over a target's face are traced from the transmitter; those with a face on the receive
    leg alone are the same path of a monostatic sonar, and otherwise traced from the receiver, in an exchanged ping.
    Receive legs by flat faces are added: by the reflections of the transmit leg, and by others.

    Args:
        ping: The ping.
        hits: Hits of rays on one interface.
        vertices: Points of a moving surface that rays from the receiver reach.
    """
    rays, law, own_bounce = hits.rays, hits.law, OWN_BOUNCE[hits.contribution]
    by_target = "T" in rays.chain
    if law is None or hits.contribution not in ping.path_settings.contributions or rays.chain.endswith(own_bounce):
        return
    if not by_target and rays.family not in ping.path_settings.followed_families:
        return
    transmitted = transmitted_energy(ping, rays)
    yield from facet_echoes(ping, hits, transmitted, vertices)
    if "s" in rays.chain or (ping.is_reversed and not by_target):
        return
    for family in ping.path_settings.followed_families:
        if family.endswith(own_bounce):
            continue
        rows = np.flatnonzero(_may_arrive(ping, rays))
        arriving, normal = rays.take(rows), hits.normal[rows]
        legs = family_legs(ping, ping.receive, arriving.origin, family, hits.contribution)
        for receive_leg in legs:
            returned = scattered_per_steradian(law, arriving.direction, -receive_leg.arrival, normal)
            returned *= receive_leg.intensity(ping.attenuation)
            delay = arriving.delay + receive_leg.delay
            requested = (returned > 0) & in_window(ping, delay)
            clear = np.flatnonzero(is_clear(ping, arriving.origin, family, receive_leg, requested))
            if not clear.size:
                continue
            gain = ping.receive_beams.gain(receive_leg.departure[clear]) ** 2
            energy = channel_energies(ping, transmitted[:, rows[clear]], gain * returned[clear])
            if by_target:
                energy *= 2 if ping.ping_geometry.is_monostatic else 1
            reciprocal = _reverse_interference(ping, arriving, family, receive_leg, legs)[clear]
            chains = (family, rays.family) if ping.is_reversed else (rays.family, family)
            yield EchoEnergies(hits.contribution, hits.object, *chains, delay[clear], energy, reciprocal)
    if by_target and rays.is_flat and not ping.is_reversed:
        yield from _face_chain_echoes(ping, hits, transmitted)


def _face_chain_echoes(ping: TracedPing, hits: RayHits, transmitted: Floats) -> Iterator[EchoEnergies]:
    """Echoes that return by flat faces of targets; with one sound speed first those by the faces of the transmit leg.

    Args:
        ping: The ping.
        hits: Hits of rays that flat faces have reflected.
        transmitted: Result of `transmitted_energy`, (beams, n).
    """
    rays, own_bounce = hits.rays, OWN_BOUNCE[hits.contribution]
    is_isovelocity, is_monostatic = ping.propagation_model is None, ping.ping_geometry.is_monostatic
    if is_isovelocity:
        n = len(rays.length)
        retraced_paths = [ReceiverPaths(-rays.direction, rays.launch, rays.length, rays.delay, 1 / rays.length**2,
                              rays.energy_fraction, np.ones(n, bool))]  # fmt: skip
        if not is_monostatic:
            retraced_paths = receiver_paths(ping, rays.origin, rays.receiver_image, rays.chain)
        for receiver_path in retraced_paths:
            paths = receiver_path._replace(energy_fraction=rays.energy_fraction)
            yield from _face_echoes(ping, hits, transmitted, rays.chain, paths, np.zeros(n))
    dimensions = 3 if is_isovelocity else 2
    for chain, transmit_image, image in face_chains(ping):
        is_other_path = np.linalg.norm((rays.receiver_image - image)[:, :dimensions], axis=1) > MAX_MISS_DISTANCE
        is_other_path |= chain != rays.chain
        if chain.endswith(own_bounce) or (is_isovelocity and not is_other_path.any()):
            continue
        for paths in receiver_paths(ping, rays.origin, image, chain):
            reciprocal = is_other_path.astype(float)
            if is_isovelocity:
                paths = paths._replace(is_clear=paths.is_clear & is_other_path)
            elif is_monostatic:  # another ray of the same chain
                reciprocal[np.abs(paths.delay - rays.delay) > MAX_DELAY_DIFFERENCE] = 1.0
            if not is_monostatic:
                transmit_delay = _face_delay(ping, rays.origin, transmit_image, ping.transmit[2], chain, paths.delay)
                lag = rays.delay + paths.delay - transmit_delay - _reverse_receive_delay(ping, rays)
                reciprocal *= interference(ping, lag)
            yield from _face_echoes(ping, hits, transmitted, chain, paths, reciprocal)


def _face_echoes(
    ping: TracedPing, hits: RayHits, transmitted: Floats, chain: str, paths: ReceiverPaths, reciprocal: Floats
) -> Iterator[EchoEnergies]:
    """Echoes that return by one chain of flat faces and boundaries.

    Args:
        ping: The ping.
        hits: Hits of n rays that flat faces have reflected.
        transmitted: Result of `transmitted_energy`, (beams, n).
        chain: Reflections of the receive legs, from the receiver outwards.
        paths: The receive legs.
        reciprocal: Interference with the path travelled backwards [1], (n,).
    """
    rays, delay = hits.rays, hits.rays.delay + paths.delay
    if hits.law is None:
        return
    returned = scattered_per_steradian(hits.law, rays.direction, paths.leaving_hit, hits.normal)
    returned = returned * paths.energy_fraction * np.exp(-ping.attenuation * paths.length) * paths.spreading
    rows = np.flatnonzero(paths.is_clear & (returned > 0) & in_window(ping, delay))
    if rows.size:
        gain = ping.receive_beams.gain(paths.receiver_direction[rows]) ** 2
        energy = channel_energies(ping, transmitted[:, rows], gain * returned[rows])
        yield EchoEnergies(
            hits.contribution, hits.object, rays.family, chain, delay[rows], energy, reciprocal[rows]
        )  # fmt: skip


def _face_delay(
    ping: TracedPing, position: Floats, image: Floats, depth: float, chain: str, expected_delay: Floats
) -> Floats:
    """Delays of legs between one end of the sonar and positions by a chain with flat faces [s], shape (n,).

    Args:
        ping: The ping.
        position: The positions [m], (n, 3).
        image: Images of that end in the planes of the chain [m], (n, 3) or (3,).
        depth: Depth of that end [m].
        chain: Letters of the reflections.
        expected_delay: Delays near which those of refracted rays are sought [s], (n,).
    """
    if ping.propagation_model is None:
        return np.asarray(np.linalg.norm(position - image, axis=1) / ping.scene.water.sound_speed)
    delay, image = np.full(len(position), np.inf), np.broadcast_to(image, position.shape)[:, :2]
    for xy in np.unique(np.round(image, 3), axis=0):  # rays of one chain have few faces
        rows = np.flatnonzero(np.linalg.norm(image - xy, axis=1) < 2 * MAX_MISS_DISTANCE)
        end, family = np.array([*image[rows[0]], depth]), chain.replace("T", "") or "D"
        delay[rows] = nearest_delay(family_legs(ping, end, position[rows], family), expected_delay[rows])
    return delay


def point_echoes(ping: TracedPing, target: PointTarget, position: Floats) -> Iterator[EchoEnergies]:
    """Echoes of a point target, which no ray hits: every transmit leg with every receive leg, occlusion included.

    Args:
        ping: The ping.
        target: The point.
        position: Its position in the scatterer grid's frame [m], shape (1, 3).
    """
    strength = float(intensity_ratio(target.target_strength_db))
    source_intensity = float(intensity_ratio(ping.ping_geometry.source_level_db))
    ends: list[list[tuple[str, int, Floats, Floats]]] = []
    for end, beams in ((ping.transmit, ping.transmit_beams), (ping.receive, ping.receive_beams)):
        end_paths = []
        for family in ping.path_settings.followed_families:
            for ray, legs in enumerate(family_legs(ping, end, position, family)):
                clear = is_clear(ping, position, family, legs, legs.reflected > 0, end=end)
                gain = beams.gain(legs.departure) ** 2 * legs.intensity(ping.attenuation) * clear
                end_paths.append((family, ray, legs.delay, gain))
        ends.append(end_paths)
    delays = [{(family, ray): delay for family, ray, delay, _ in end_paths} for end_paths in ends]
    for transmit_leg, receive_leg in product(*ends):
        transmit_family, transmit_ray, transmit_delay, transmitted = transmit_leg
        receive_family, receive_ray, receive_delay, received = receive_leg
        delay = transmit_delay + receive_delay
        energy = channel_energies(ping, source_intensity * transmitted, strength * received)
        if not in_window(ping, delay)[0] or not energy.any():
            continue
        reciprocal = np.zeros(1)
        if (transmit_family, transmit_ray) != (receive_family, receive_ray):
            infinite = np.full(1, np.inf)
            reverse_delay = delays[0].get((receive_family, receive_ray), infinite)
            reverse_delay = reverse_delay + delays[1].get((transmit_family, transmit_ray), infinite)
            reciprocal = interference(ping, delay - reverse_delay)
        yield EchoEnergies("target", target.label, transmit_family, receive_family, delay, energy, reciprocal)


def boundary_echo_energies(ping: TracedPing) -> Iterator[EchoEnergies]:
    """Sound from the transmitter to the receiver by reflections alone, family by family in the order of travel.

    A path and the same path travelled backwards, such as BS and SB, interfere; others add as energies.

    Args:
        ping: The ping.
    """
    geometry, position = ping.ping_geometry, ping.transmit[None]
    families = boundary_echo_families(ping.path_settings, two_platforms=False)
    source_intensity, depth = float(intensity_ratio(geometry.source_level_db)), float(ping.receive[2])
    for family in families:
        legs = family_legs(ping, ping.receive, position, family, BOUNDARY_ECHO)
        reverse = family[::-1]
        for receive_leg in legs:
            requested = (receive_leg.reflected > 0) & in_window(ping, receive_leg.delay)
            clear = is_clear(ping, position, family, receive_leg, requested)
            sine = np.abs(receive_leg.departure[:, 2])
            rough = sediment_bounce_factor(
                family, depth, receive_leg.length, sine, ping.scene.seabed, geometry.wavelength
            )
            transmitted = (
                source_intensity
                * rough**2
                * receive_leg.intensity(ping.attenuation)
                * ping.transmit_beams.gain(-receive_leg.arrival) ** 2
            )
            energy = channel_energies(ping, transmitted, ping.receive_beams.gain(receive_leg.departure) ** 2)
            if not clear[0] or not energy.any():
                continue
            reciprocal = np.zeros(1)
            if reverse != family and reverse in families:
                others = family_legs(ping, ping.receive, position, reverse, BOUNDARY_ECHO)
                reciprocal = interference(ping, receive_leg.delay - nearest_delay(others, receive_leg.delay))
            yield EchoEnergies(BOUNDARY_ECHO, BOUNDARY_ECHO, reverse, "", receive_leg.delay, energy, reciprocal)


def _reverse_interference(
    ping: TracedPing, rays: RayBundle, family: str, receive_leg: TracedLegs, all_legs: list[TracedLegs]
) -> Floats:  # fmt: skip
    """Interference of paths with receive legs of a family with the same paths travelled backwards [1], shape (n,).

    0 where a path is its own reverse, and 1 for any other if transmitter and receiver are at one position.

    Args:
        ping: The ping.
        rays: Rays at their hits, n of them.
        family: Family of the receive legs.
        receive_leg: The receive legs.
        all_legs: Receive legs of all rays of the family.
    """
    if family == rays.family and ping.propagation_model is None:
        return np.zeros(len(rays.delay))
    is_other_path = nearest_delay(all_legs, rays.delay) != receive_leg.delay if family == rays.family else True
    if ping.ping_geometry.is_monostatic:
        return np.ones(len(rays.delay)) * is_other_path
    transmit_delay = nearest_delay(family_legs(ping, ping.transmit, rays.origin, family), receive_leg.delay)
    lag = rays.delay + receive_leg.delay - transmit_delay - _reverse_receive_delay(ping, rays)
    return interference(ping, lag) * is_other_path


def _reverse_receive_delay(ping: TracedPing, rays: RayBundle) -> Floats:
    """Delays of the receive legs of the reversed paths, by the reflections of the rays [s], shape (n,)."""
    if "T" in rays.chain:
        return _face_delay(ping, rays.origin, rays.receiver_image, ping.receive[2], rays.chain, rays.delay)
    return nearest_delay(family_legs(ping, ping.receive, rays.origin, rays.family), rays.delay)


def _may_arrive(ping: TracedPing, rays: RayBundle) -> NDArray[np.bool_]:
    """True for rays from whose hits sound by the shortest path arrives before the window ends, shape (n,)."""
    shortest = np.linalg.norm(rays.origin - ping.receive, axis=1) / ping.scene.water.max_sound_speed
    return np.asarray(rays.delay + shortest <= ping.ping_geometry.recorded_delays[1])
