"""Tracing of rays: straight to the first hit, then in the specular direction, until little energy is left."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer._trace_kernel import BED, BODY, SURFACE
from insonify.engines.tracer.image_legs import bounce_letters, coherent_intensity_factor, reflected_intensity
from insonify.engines.tracer.interaction import specular_direction, specular_fraction
from insonify.engines.tracer.ray_bundle import RayBundle, RayHits, TracedPing
from insonify.engines.tracer.tracing_scene import has_flat_faces
from insonify.scene.target import Solid

Floats = NDArray[np.float64]

MIN_ENERGY_FRACTION = 1e-7
"""A ray of which mirrors have left less than this part of the energy is given up [1]."""
SAME_POINT = 1e-3
"""Distance from the receiver at which a path by the mirrors of a ray ends where they are the same mirrors [m]."""
BOUNCE_LETTERS = {BED: "B", SURFACE: "S", BODY: "T"}
CONTRIBUTIONS = {BED: "seabed", SURFACE: "surface", BODY: "target"}
UP = np.array([0.0, 0.0, -1.0])


def trace_hits(ping: TracedPing, rays: RayBundle) -> Iterator[RayHits]:
    """Hits of some rays, interface by interface.

    Yields:
        RayHits, chain by chain, including those of chains that are not followed further.
    """
    under_way = [rays]
    while under_way:
        now = under_way.pop()
        for hits in _first_hits(ping, now):
            yield hits
            if is_followed(ping, now.chain + hits.letter):
                after = _reflected_rays(ping, hits)
                after = after.take(after.left > MIN_ENERGY_FRACTION)
                if len(after.length):
                    under_way.append(after)


def is_followed(ping: TracedPing, chain: str) -> bool:
    """Return True if rays of a chain of mirrors are followed.

    Those of level mirrors as far as a family requests them. Those with a target's face up to the most reflections, off
    the level mirrors of the families; where families are named, only if `target_specular_fraction` is, too.
    """
    choice = ping.choice
    if "T" not in chain:
        return any(bounce_letters(family).startswith(chain) for family in choice.followed_families)
    coefficient = choice.families is None or choice.target_specular_fraction is not None
    return (
        coefficient
        and len(chain) <= choice.max_reflections
        and set(chain) <= {"T", *"".join(map(bounce_letters, choice.followed_families))}
    )


def _first_hits(ping: TracedPing, rays: RayBundle) -> list[RayHits]:
    """First hits of the rays of one chain, one interface after another."""
    bodies = ping.scene.occluders
    distance, interface, body_row, normal = ping.intersector.hits(rays.origin, rays.way, ping.farthest - rays.length)
    arrived = replace(rays, origin=rays.origin + distance[:, None] * rays.way, length=rays.length + distance)
    found = []
    for kind, row in ((BED, -1), (SURFACE, -1), *((BODY, row) for row in range(len(bodies)))):
        mine = np.flatnonzero((interface == kind) & (body_row == row))
        if not mine.size:
            continue
        own, mirror, flat = ping.laws.get(kind), 0.0, True
        if kind == BODY:
            own, flat = bodies[row].scattering, has_flat_faces(bodies[row])
            mirror = _face_specular_fraction(ping, bodies[row])
        part = arrived.take(mine)
        if kind == SURFACE:
            part.origin[:, 2] = 0.0
        elif kind == BED and ping.scene.seabed.terrain is None:
            part.origin[:, 2] = ping.scene.seabed.depth
        name = bodies[row].label if kind == BODY else CONTRIBUTIONS[kind]
        found.append(RayHits(part, normal[mine], CONTRIBUTIONS[kind], name, BOUNCE_LETTERS[kind], own, mirror, flat))
    return found


def _face_specular_fraction(ping: TracedPing, body: Solid) -> float:
    """Share of the energy that a target's face mirrors [1], all of it with the ray that goes on.

    The law of the face is that of its rough part alone, so that no energy of the specular lobe is scattered as well. A
    face reflection coefficient of the scenario replaces the specular fraction of the law.
    """
    specular = (
        ping.choice.target_specular_fraction
        if body.face_reflection_coefficient is None
        else body.face_reflection_coefficient**2
    )
    least = specular_fraction(body.scattering)
    return least if specular is None else min(specular, least)


def _reflected_rays(ping: TracedPing, hits: RayHits) -> RayBundle:
    """Rays after the reflection at their hits; the seabed reflects as its mean plane."""
    rays = hits.rays
    normal = hits.normal if hits.letter == "T" else np.broadcast_to(UP, rays.way.shape)
    left = rays.left * _reflected_fraction(ping, hits)
    way, flat = specular_direction(rays.way, normal), rays.flat and hits.flat
    image = rays.origin + specular_direction(rays.receiver_image - rays.origin, normal)
    return replace(rays, chain=rays.chain + hits.letter, way=way, left=left, receiver_image=image, flat=flat)


def receiver_paths(ping: TracedPing, rays: RayBundle) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """Paths from where rays are to the receiver by the flat mirrors of their chain, in reverse order.

    Args:
        ping: The ping.
        rays: The rays, n of them, which left the transmitter.

    Returns:
        Directions in which the paths leave (n, 3), directions from the receiver (n, 3), lengths [m] (n,), and True
        where a path is clear and by the same mirrors (n,).
    """
    if ping.ping_geometry.is_monostatic:
        return -rays.way, rays.launch, rays.length, np.ones(len(rays.length), bool)
    straight = rays.receiver_image - rays.origin
    length = np.linalg.norm(straight, axis=1)
    leaving = straight / np.maximum(length, 1e-9)[:, None]
    origin, way, left, clear = rays.origin, leaving, length, np.ones(len(length), bool)
    for letter in (*reversed(rays.chain), ""):
        distance, kind, _, normal = ping.intersector.hits(origin, way, left)
        origin, left = origin + distance[:, None] * way, left - distance
        clear &= np.array([BOUNCE_LETTERS.get(int(one), "") == letter for one in kind], bool)
        if letter:
            way = specular_direction(way, normal if letter == "T" else np.broadcast_to(UP, way.shape))
    return leaving, -way, length, clear & (np.linalg.norm(origin - ping.receive, axis=1) < SAME_POINT)


def _reflected_fraction(ping: TracedPing, hits: RayHits) -> Floats:
    """Part of the energy that one mirror leaves [1], (n,)."""
    rays, wavelength = hits.rays, ping.ping_geometry.wavelength
    sine = np.minimum(np.abs(rays.way[:, 2]), 1.0)
    if hits.letter != "T":
        left = reflected_intensity(ping.scene, hits.letter, np.arcsin(sine))
        terrain = ping.scene.seabed.terrain
        if hits.letter == "B" and "T" in rays.chain and terrain is not None:
            # the remaining path is unknown: taken as long as the path so far
            zone = np.sqrt(wavelength * rays.length / np.maximum(sine, 1e-9))
            left = left * terrain.roughness_reflection_factor(sine, wavelength, np.maximum(zone, 1e-6)) ** 2
        return left
    facing = np.where(np.einsum("ij,ij->i", rays.way, hits.normal) < 0, hits.mirror, 0.0)
    if "T" in rays.chain:
        return facing
    # until here a chain of level mirrors, whose roughness is counted where its way ends
    return facing * coherent_intensity_factor(
        ping.scene, rays.family, float(ping.transmit[2]), rays.length, sine, wavelength
    )
