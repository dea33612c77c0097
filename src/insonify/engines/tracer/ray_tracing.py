"""Tracing of rays: straight to the first hit, then in the specular direction, until little energy remains."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer._trace_kernel import BED, BODY, SURFACE
from insonify.engines.tracer.facet_scattering import FacetSurface
from insonify.engines.tracer.family_legs import family_legs
from insonify.engines.tracer.image_legs import (
    bounce_roughness_factor,
    coherent_intensity_factor,
    reflected_intensity,
)
from insonify.engines.tracer.interaction import specular_direction, specular_fraction
from insonify.engines.tracer.ray_bundle import RayBundle, RayHits, ReceiverPaths, TracedPing
from insonify.engines.tracer.tracing_scene import FacePlane, face_planes, has_flat_faces
from insonify.propagation.families import bounce_sequence, image_depth
from insonify.scene.target import Solid

Floats = NDArray[np.float64]

MIN_ENERGY_FRACTION = 1e-7
"""Fraction of its launched energy below which a ray is not traced further [1]."""
MAX_MISS_DISTANCE = 1e-3
"""Largest distance from the receiver at which a path by the faces of a ray's chain may end [m]; else the path hit other
faces of the same kind."""
MAX_REFRACTED_MISS_DISTANCE = 0.1
"""Largest such distance for a refracted path, which chords approximate [m]."""
SPLIT_FACTOR, MAX_PARTS = 2.0, 256
"""Number of rays into which a ray of mean energy is split at a facet, and the largest number for any ray [1]."""
MAX_UPRIGHT_COMPONENT = 1e-6
"""Vertical component of a face's normal below which it is upright [1]."""
BOUNCE_LETTERS = {BED: "B", SURFACE: "S", BODY: "T"}
CONTRIBUTIONS = {BED: "seabed", SURFACE: "surface", BODY: "target"}
"""Letter of a reflection, and contribution of an echo, by kind of interface."""
UP = np.array([0.0, 0.0, -1.0])


def trace_hits(ping: TracedPing, rays: RayBundle) -> Iterator[RayHits]:
    """Hits of some rays, interface by interface.

    Yields:
        Hits, chain by chain, including those of chains that are not followed further.
    """
    pending = [rays]
    while pending:
        bundle = pending.pop()
        for hits in _first_hits(ping, bundle):
            yield hits
            if is_followed(ping, (bundle.chain + hits.letter).upper()):
                parts = [_reflected_rays(ping, hits)]
                if ping.facets is not None and hits.letter == "S" and "T" not in bundle.chain:
                    parts.append(_facet_rays(ping, ping.facets, hits))
                for reflected in parts:
                    remaining = reflected.energy_fraction > MIN_ENERGY_FRACTION
                    if remaining.any():
                        pending.append(reflected.take(remaining))


def is_followed(ping: TracedPing, chain: str) -> bool:
    """Return True if rays of a chain of reflections are followed.

    Chains of boundaries only: where a requested family begins with them. Chains with a target's face: up to
    `max_reflections`, by the boundaries of the requested families; if the scenario names families, it must also give
    `target_specular_fraction`.
    """
    path_settings = ping.path_settings
    if "T" not in chain:
        return any(bounce_sequence(family).startswith(chain) for family in path_settings.followed_families)
    faces_reflect = path_settings.families is None or path_settings.target_specular_fraction is not None
    return (
        faces_reflect
        and len(chain) <= path_settings.max_reflections
        and set(chain) <= {"T", *"".join(map(bounce_sequence, path_settings.followed_families))}
    )


def _first_hits(ping: TracedPing, rays: RayBundle) -> list[RayHits]:
    """First hits of the rays of one chain, one record for each interface that any of them hits."""
    bodies = ping.scene.solids_of_one_law
    hits = ping.intersector.hits(rays.origin, rays.direction, ping.longest_path - rays.length)
    interface, body_row, normal = hits.kind, hits.body_row, hits.normal
    arrived = replace(
        rays, origin=hits.position, direction=hits.direction, length=rays.length + hits.distance,
        delay=rays.delay + hits.delay,
    )  # fmt: skip
    parts = []
    for kind, row in ((BED, -1), (SURFACE, -1), *((BODY, row) for row in range(len(bodies)))):
        selected = np.flatnonzero((interface == kind) & (body_row == row))
        if not selected.size:
            continue
        law, fraction, is_flat = ping.laws.get(kind), 0.0, True
        if kind == BODY:
            law, is_flat = bodies[row].scattering, has_flat_faces(bodies[row])
            fraction = _face_specular_fraction(ping, bodies[row])
        part = arrived.take(selected)
        if kind == SURFACE:
            part.origin[:, 2] = 0.0
        elif kind == BED and ping.scene.seabed.terrain is None:
            part.origin[:, 2] = ping.scene.seabed.depth
        name = bodies[row].label if kind == BODY else CONTRIBUTIONS[kind]
        parts.append(
            RayHits(part, normal[selected], CONTRIBUTIONS[kind], name, BOUNCE_LETTERS[kind], law, fraction, is_flat)
        )
    return parts


def _face_specular_fraction(ping: TracedPing, body: Solid) -> float:
    """Fraction of the energy that a target's face reflects specularly [1], all of it into the continued ray.

    The scattering law of a face has no specular lobe, so that no energy is counted twice. A face reflection coefficient
    of the scenario replaces the requested fraction; the albedo of the scattering law limits both.
    """
    requested = (
        ping.path_settings.target_specular_fraction
        if body.face_reflection_coefficient is None
        else body.face_reflection_coefficient**2
    )
    largest = specular_fraction(body.scattering)
    return largest if requested is None else min(requested, largest)


def _reflected_rays(ping: TracedPing, hits: RayHits) -> RayBundle:
    """Rays after the specular reflection at their hits; seabed and surface reflect like horizontal planes."""
    rays = hits.rays
    normal = hits.normal if hits.letter == "T" else np.broadcast_to(UP, rays.direction.shape)
    energy_fraction = rays.energy_fraction * _reflected_fraction(ping, hits)
    direction, is_flat = specular_direction(rays.direction, normal), rays.is_flat and hits.is_flat
    image = rays.origin + specular_direction(rays.receiver_image - rays.origin, normal)
    return replace(
        rays, chain=rays.chain + hits.letter, direction=direction, energy_fraction=energy_fraction,
        receiver_image=image, is_flat=is_flat,
    )  # fmt: skip


def _facet_rays(ping: TracedPing, facets: FacetSurface, hits: RayHits) -> RayBundle:
    """Rays after the reflection by random facets of a moving surface; strong rays are split into several."""
    energy = hits.rays.solid_angle * hits.rays.energy_fraction
    energy = energy * (ping.transmit_beams.gain(hits.rays.launch) ** 2).max(axis=0)
    splits = np.clip(np.ceil(SPLIT_FACTOR * energy / max(energy.mean(), 1e-300)), 1, MAX_PARTS).astype(np.int64)
    row = np.repeat(np.arange(len(splits)), splits)
    rays, number = hits.rays.take(row), np.arange(len(row)) - np.repeat(np.cumsum(splits) - splits, splits)
    direction, fraction = facets.reflected(rays.direction, rays.launch, number, len(rays.chain))
    bounce = np.column_stack([rays.delay, *facets.phase_rate(rays.direction, direction), rays.origin])
    return replace(
        rays, chain=rays.chain + "s", direction=direction,
        energy_fraction=rays.energy_fraction * fraction / splits[row], last_facet=bounce,
    )  # fmt: skip


def receiver_paths(ping: TracedPing, position: Floats, image: Floats, chain: str) -> list[ReceiverPaths]:
    """Paths from positions to the receiver by a chain of flat faces and boundaries, in reverse order, ray by ray.

    Args:
        ping: The ping.
        position: The positions [m], shape (n, 3).
        image: Images of the receiver in the planes of the chain [m], shape (n, 3) or (3,).
        chain: Letters of the reflections, from the receiver outwards.
    """
    if ping.propagation_model is None:
        image_vector = image - position
        length = np.linalg.norm(image_vector, axis=1)
        leaving_hit = image_vector / np.maximum(length, 1e-9)[:, None]
        return [_trace_to_receiver(ping, position, leaving_hit, length, chain)]
    # horizontal boundaries are their own images in an upright face
    end, family = np.array([*image[:2], ping.receive[2]]), chain.replace("T", "") or "D"
    path_parts = []
    for legs in family_legs(ping, end, position, family):
        paths = _trace_to_receiver(ping, position, -legs.arrival, legs.length, chain)
        is_clear = paths.is_clear & (legs.reflected > 0)
        path_parts.append(paths._replace(delay=legs.delay, spreading=legs.spreading, is_clear=is_clear))
    return path_parts


def _trace_to_receiver(
    ping: TracedPing, position: Floats, leaving_hit: Floats, length: Floats, chain: str
) -> ReceiverPaths:
    """Paths from positions to the receiver, traced through the hits of a chain, with spherical spreading.

    Args:
        ping: The ping.
        position: The positions [m], shape (n, 3).
        leaving_hit: Directions in which the paths leave them [1], shape (n, 3).
        length: Path lengths to the receiver [m], shape (n,).
        chain: Letters of the reflections, from the receiver outwards.
    """
    origin, direction, remaining, is_clear = position, leaving_hit, length, np.ones(len(length), bool)
    fraction, delay, wavelength = np.ones(len(length)), np.zeros(len(length)), ping.ping_geometry.wavelength
    body_fractions = np.array([*(_face_specular_fraction(ping, body) for body in ping.scene.solids_of_one_law), 0.0])
    for letter in (*reversed(chain), ""):
        hits = ping.intersector.hits(origin, direction, remaining)
        origin, direction, remaining = hits.position, hits.direction, remaining - hits.distance
        delay = delay + hits.delay
        normal = hits.normal
        is_clear &= np.array([BOUNCE_LETTERS.get(int(kind), "") == letter for kind in hits.kind], bool)
        if letter == "T":
            fraction *= np.where(np.einsum("ij,ij->i", direction, normal) < 0, body_fractions[hits.body_row], 0.0)
        elif letter:
            sine, normal = np.minimum(np.abs(direction[:, 2]), 1.0), np.broadcast_to(UP, direction.shape)
            fraction *= reflected_intensity(ping.scene, letter, np.arcsin(sine))
            if letter == "S" and ping.facets is not None:
                fraction *= ping.facets.coherent_intensity(sine)
            if letter == "B":
                fraction *= bounce_roughness_factor(ping.scene, remaining / length, length, sine, wavelength)
        if letter:
            direction = specular_direction(direction, normal)
    miss = MAX_MISS_DISTANCE if ping.propagation_model is None else MAX_REFRACTED_MISS_DISTANCE
    is_clear &= np.linalg.norm(origin - ping.receive, axis=1) < miss
    return ReceiverPaths(leaving_hit, -direction, length, delay, 1 / length**2, fraction, is_clear)


def face_chains(ping: TracedPing) -> list[tuple[str, Floats, Floats]]:
    """Chains of reflections with one flat face, each with the images of transmitter and receiver in its planes [m]."""
    boundaries = "".join(sorted(set("".join(map(bounce_sequence, ping.path_settings.followed_families)))))
    sequences, chains = [""], list[str]()
    for _ in range(ping.path_settings.max_reflections):
        sequences = [
            sequence + letter for sequence in sequences for letter in "T" + boundaries if not sequence.endswith(letter)
        ]
        sequences = [sequence for sequence in sequences if sequence.count("T") < 2]
        chains += [sequence for sequence in sequences if "T" in sequence and is_followed(ping, sequence)]
    images: list[tuple[str, Floats, Floats]] = []
    for chain, plane in product(chains, face_planes(ping.scene)):
        transmit, receive = (
            _chain_image(chain, plane, position, ping.scene.seabed.depth) for position in (ping.transmit, ping.receive)
        )
        is_reflected = ping.propagation_model is None or abs(plane.normal[2]) < MAX_UPRIGHT_COMPONENT
        if is_reflected and transmit is not None and receive is not None:
            images.append((chain, transmit, receive))
    return images


def _chain_image(chain: str, plane: FacePlane, position: Floats, bed: float) -> Floats | None:
    """Image of a position in the planes of a chain with one face [m], (3,); None where it is behind the face."""
    image = position
    for letter in chain:
        if letter != "T":
            image = np.array([image[0], image[1], image_depth(letter, image[2], bed)])
        elif (reflected := plane.image(image)) is not None:
            image = reflected
        else:
            return None
    return image


def _reflected_fraction(ping: TracedPing, hits: RayHits) -> Floats:
    """Fraction of the energy that is reflected specularly at a hit [1], (n,)."""
    rays, wavelength = hits.rays, ping.ping_geometry.wavelength
    sine = np.minimum(np.abs(rays.direction[:, 2]), 1.0)
    if hits.letter != "T":
        reflected = reflected_intensity(ping.scene, hits.letter, np.arcsin(sine))
        if hits.letter == "S" and ping.facets is not None:
            reflected = reflected * ping.facets.coherent_intensity(sine)
        if hits.letter == "B" and "T" in rays.chain:
            # the length of the remaining path is unknown; it is set to that of the path so far
            half = np.full(len(sine), 0.5)
            reflected = reflected * bounce_roughness_factor(ping.scene, half, 2 * rays.length, sine, wavelength)
        return reflected
    facing = np.where(np.einsum("ij,ij->i", rays.direction, hits.normal) < 0, hits.specular_fraction, 0.0)
    if "T" in rays.chain:
        return facing
    # a chain of boundaries only ends at this face: the roughness at all its bounces is applied here
    return facing * coherent_intensity_factor(
        ping.scene, rays.family, float(ping.transmit[2]), rays.length, sine, wavelength
    )
