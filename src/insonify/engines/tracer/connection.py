"""The way back: what interfaces scatter of the rays that meet them, towards the receiver by every family."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from insonify.engines.tracer.answer import scattered
from insonify.engines.tracer.bundle import Hits, Ping, Rays
from insonify.engines.tracer.mirrors import roughened, ways
from insonify.records.echoes import Echoes
from insonify.scene.target import PointTarget
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]

OWN = {"seabed": "B", "surface": "S", "target": "-"}
"""Mirrors that an interface does not answer through: its own, right at the place, is part of its law."""


def echoes(ping: Ping, hits: Hits) -> Iterator[Echoes]:
    """What gets back to the receiver of some hits, family by family.

    A way out by one family and back by another arrives together with the same way travelled backwards, and the two
    interfere. Between level mirrors both are traced, each with its half of what they make of each other. No way back
    is looked for over a target's face, save the very way out: there one stands for both.

    Args:
        ping: The ping.
        hits: Rays as they meet one interface.
    """
    rays, law, own = hits.rays, hits.law, OWN[hits.cause]
    by_target = "T" in rays.chain
    if law is None or hits.cause not in ping.choice.causes or rays.chain.endswith(own):
        return
    if not by_target and rays.family not in ping.choice.followed:
        return
    sent = _sent(ping, rays)
    for family in ping.choice.followed:
        if family.endswith(own):
            continue
        back = ways(ping.scene, ping.receive, rays.origin, family, ping.stance.wavelength)
        returned = scattered(law, rays.way, -back.arrival, hits.normal)
        returned *= back.intensity * np.exp(-ping.attenuation * back.length) / back.length**2
        length = rays.length + back.length
        asked = ping.sheet.clear(
            ping.receive, rays.origin, family, ping.stance.wavelength, (returned > 0) & _heard(ping, length)
        )
        rows = np.flatnonzero(asked)
        if not rows.size:
            continue
        gain = ping.receive_beams.gain(back.departure[rows]) ** 2
        energy = _channels(ping, sent[:, rows], gain * returned[rows])
        reciprocal = np.ones(rows.size)
        if by_target:
            energy *= 2
        elif family == rays.family:
            reciprocal = np.zeros(rows.size)
        else:
            reciprocal = _reciprocal(ping, rays.origin[rows], rays.family, family)
        yield Echoes(hits.cause, hits.owner, rays.family, family, length[rows] / _speed(ping), energy, reciprocal)
    if by_target and rays.flat and ping.stance.together:
        yield from _retraced(ping, hits, sent)


def _sent(ping: Ping, rays: Rays) -> Floats:
    """Energy that rays bring to where they are, by transmit beam [uPa^2 m^2], (beams, n)."""
    level = float(intensity_ratio(ping.stance.source_level_db))
    left = rays.solid_angle * rays.left * np.exp(-ping.attenuation * rays.length)
    if "T" not in rays.chain:
        sine = np.minimum(np.abs(rays.way[:, 2]), 1.0)
        left = left * roughened(
            ping.scene, rays.family, float(ping.transmit[2]), rays.length, sine, ping.stance.wavelength
        )
    return np.asarray(level * left * ping.transmit_beams.gain(rays.launch) ** 2)


def _retraced(ping: Ping, hits: Hits, sent: Floats) -> Iterator[Echoes]:
    """What goes back the very way it came, over targets' faces: flat mirrors spread it as a straight way would."""
    rays = hits.rays
    returned = np.zeros(len(rays.length)) if hits.law is None else scattered(hits.law, rays.way, -rays.way, hits.normal)
    returned = returned * rays.left * np.exp(-ping.attenuation * rays.length) / rays.length**2
    rows = np.flatnonzero((returned > 0) & _heard(ping, 2 * rays.length))
    if rows.size:
        gain = ping.receive_beams.gain(rays.launch[rows]) ** 2
        energy = _channels(ping, sent[:, rows], gain * returned[rows])
        delay = 2 * rays.length[rows] / _speed(ping)
        yield Echoes(hits.cause, hits.owner, rays.family, rays.family, delay, energy, np.zeros(rows.size))


def point_echoes(ping: Ping, target: PointTarget, place: Floats) -> Iterator[Echoes]:
    """Echoes of a point, which no ray would ever meet: every way out with every way back.

    Args:
        ping: The ping.
        target: The point.
        place: Where it is, in the lattice's frame [m], shape (1, 3).
    """
    wavelength, strength = ping.stance.wavelength, float(intensity_ratio(target.target_strength_db))
    level = float(intensity_ratio(ping.stance.source_level_db))
    ends = []
    for end, beams in ((ping.transmit, ping.transmit_beams), (ping.receive, ping.receive_beams)):
        found = {}
        for family in ping.choice.followed:
            one = ways(ping.scene, end, place, family, wavelength)
            clear = ping.sheet.clear(end, place, family, wavelength, np.ones(1, bool))
            loss = one.intensity * np.exp(-ping.attenuation * one.length) / one.length**2
            found[family] = one.length, beams.gain(one.departure) ** 2 * loss * clear
        ends.append(found)
    for out, (length_out, sent) in ends[0].items():
        for back, (length_back, heard) in ends[1].items():
            length = length_out + length_back
            energy = _channels(ping, level * sent, strength * heard)
            if _heard(ping, length)[0] and energy.any():
                same = np.zeros(1) if out == back else _reciprocal(ping, place, out, back)
                yield Echoes("target", target.label, out, back, length / _speed(ping), energy, same)


def _reciprocal(ping: Ping, place: Floats, out: str, back: str) -> Floats:
    """Cosine of the phase between a way and the same travelled backwards [1]: 1 where both ends are at one place."""
    if ping.stance.together:
        return np.ones(len(place))
    apart = np.zeros(len(place))
    for end, sign in ((ping.transmit, 1.0), (ping.receive, -1.0)):
        for family, turn in ((out, sign), (back, -sign)):
            apart += turn * ways(ping.scene, end, place, family, ping.stance.wavelength).length
    return np.asarray(np.cos(2 * np.pi * ping.stance.frequency / _speed(ping) * apart))


def _channels(ping: Ping, sent: Floats, heard: Floats) -> Floats:
    """Energy in every channel from that of its beams, (channels, n)."""
    channel = np.arange(ping.stance.channel_count)
    return np.asarray(sent[channel % len(sent)] * heard[channel % len(heard)])


def _heard(ping: Ping, length: Floats) -> NDArray[np.bool_]:
    first, last = ping.stance.heard_delays
    return np.asarray((length >= first * _speed(ping)) & (length <= last * _speed(ping)))


def _speed(ping: Ping) -> float:
    return ping.scene.water.sound_speed
