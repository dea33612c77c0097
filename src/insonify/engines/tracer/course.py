"""The course of rays: straight on until something is met, then as a mirror sends them, until too little is left."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer._trace_kernel import BED, BODY, SURFACE
from insonify.engines.tracer.answer import left_over, reflected
from insonify.engines.tracer.bundle import Hits, Ping, Rays
from insonify.engines.tracer.mirrors import kept, letters, roughened
from insonify.engines.tracer.world import has_flat_faces
from insonify.scene.target import Solid

Floats = NDArray[np.float64]

NEGLIGIBLE = 1e-7
"""A ray of which mirrors have left less than this part of the energy is given up [1]."""
LETTERS = {BED: "B", SURFACE: "S", BODY: "T"}
CAUSES = {BED: "seabed", SURFACE: "surface", BODY: "target"}
UP = np.array([0.0, 0.0, -1.0])


def course(ping: Ping, rays: Rays) -> Iterator[Hits]:
    """Everything that some rays meet, interface by interface.

    Args:
        ping: The ping.
        rays: Rays that leave the sonar.

    Yields:
        Hits, chain by chain; those that nothing follows from are among them.
    """
    under_way = [rays]
    while under_way:
        now = under_way.pop()
        for hits in _met(ping, now):
            yield hits
            if goes_on(ping, now.chain + hits.letter):
                after = _mirrored(ping, hits)
                after = after.take(after.left > NEGLIGIBLE)
                if len(after.length):
                    under_way.append(after)


def goes_on(ping: Ping, chain: str) -> bool:
    """Whether rays of a chain of mirrors are followed.

    Those of level mirrors as far as a family asks for them. Those with a target's face up to the most reflections, off
    the level mirrors of the families; where families are named, only if `target_mirror` is, too.
    """
    choice = ping.choice
    if "T" not in chain:
        return any(letters(family).startswith(chain) for family in choice.followed)
    asked = choice.families is None or choice.target_mirror is not None
    return asked and len(chain) <= choice.reflections and set(chain) <= {"T", *"".join(map(letters, choice.followed))}


def _met(ping: Ping, rays: Rays) -> list[Hits]:
    """What rays of one chain meet first, one interface after another."""
    bodies = ping.scene.occluders
    distance, met, owner, normal = ping.sheet.hits(rays.origin, rays.way, ping.farthest - rays.length)
    arrived = replace(rays, origin=rays.origin + distance[:, None] * rays.way, length=rays.length + distance)
    found = []
    for kind, row in ((BED, -1), (SURFACE, -1), *((BODY, row) for row in range(len(bodies)))):
        mine = np.flatnonzero((met == kind) & (owner == row))
        if not mine.size:
            continue
        own, mirror, flat = ping.laws.get(kind), 0.0, True
        if kind == BODY:
            own, flat = bodies[row].scattering, has_flat_faces(bodies[row])
            mirror = _face_mirror(ping, bodies[row])
        part = arrived.take(mine)
        if kind == SURFACE:
            part.origin[:, 2] = 0.0
        elif kind == BED and ping.scene.seabed.bed is None:
            part.origin[:, 2] = ping.scene.seabed.depth
        name = bodies[row].label if kind == BODY else CAUSES[kind]
        found.append(Hits(part, normal[mine], CAUSES[kind], name, LETTERS[kind], own, mirror, flat))
    return found


def _face_mirror(ping: Ping, body: Solid) -> float:
    """Share of the energy that a target's face mirrors [1], all of it with the ray that goes on.

    The law of the face is its rough part's alone, so that nothing of a mirror's lobe is scattered as well. Where the
    scenario says how smooth the face is, its coefficient is the mirror's.
    """
    asked = ping.choice.target_mirror if body.smooth is None else body.smooth**2
    least = left_over(body.scattering)
    return least if asked is None else min(asked, least)


def _mirrored(ping: Ping, hits: Hits) -> Rays:
    """Rays after the mirror that they have met; the bed mirrors as its mean plane does."""
    rays = hits.rays
    normal = hits.normal if hits.letter == "T" else np.broadcast_to(UP, rays.way.shape)
    left = rays.left * _left(ping, hits)
    way, flat = reflected(rays.way, normal), rays.flat and hits.flat
    return replace(rays, chain=rays.chain + hits.letter, way=way, left=left, flat=flat)


def _left(ping: Ping, hits: Hits) -> Floats:
    """Part of the energy that one mirror leaves [1], (n,)."""
    rays, wavelength = hits.rays, ping.stance.wavelength
    sine = np.minimum(np.abs(rays.way[:, 2]), 1.0)
    if hits.letter != "T":
        left = kept(ping.scene, hits.letter, np.arcsin(sine))
        bed = ping.scene.seabed.bed
        if hits.letter == "B" and "T" in rays.chain and bed is not None:
            # how far the ray still goes is not known: taken as far as it has come
            zone = np.sqrt(wavelength * rays.length / np.maximum(sine, 1e-9))
            left = left * bed.smoothness(sine, wavelength, np.maximum(zone, 1e-6)) ** 2
        return left
    facing = np.where(np.einsum("ij,ij->i", rays.way, hits.normal) < 0, hits.mirror, 0.0)
    if "T" in rays.chain:
        return facing
    # until here a chain of level mirrors, whose roughness is counted where its way ends
    return facing * roughened(ping.scene, rays.family, float(ping.transmit[2]), rays.length, sine, wavelength)
