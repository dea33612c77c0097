"""Receive legs of the tracer: scattering at the interfaces that rays hit, towards the receiver by every family."""

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.engines.boundary_echoes import boundary_echo_families, sediment_bounce_factor
from insonify.engines.tracer.image_legs import coherent_intensity_factor, image_legs
from insonify.engines.tracer.interaction import scattered_per_steradian
from insonify.engines.tracer.ray_bundle import RayBundle, RayHits, ReceiverPaths, TracedPing
from insonify.engines.tracer.ray_tracing import MAX_MISS_DISTANCE, face_chains, receiver_paths
from insonify.records.echo_energies import EchoEnergies
from insonify.scene.scatterers import BOUNDARY_ECHO
from insonify.scene.target import PointTarget
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.units import intensity_ratio

Floats = NDArray[np.float64]

OWN_BOUNCE = {"seabed": "B", "surface": "S", "target": "-"}
"""Bounces excluded from receive legs of an interface: a reflection at the scatterer itself is part of its law."""


def echoes(ping: TracedPing, hits: RayHits) -> Iterator[EchoEnergies]:
    """Echoes of some hits at the receiver, family by family.

    A path out by one family and back by another arrives together with its reverse, and the two interfere. Each item
    has the energy of one order, and as `reciprocal` the interference with the other order: 0 where there is no
    distinct other order. Paths over a target's face are traced from the transmitter; those with a face on the receive
    leg alone are the same path of a monostatic sonar, and otherwise traced from the receiver, in an exchanged ping.
    Paths back over flat faces are added: by the same reflections, and by others.

    Args:
        ping: The ping.
        hits: Hits of rays on one interface.
    """
    rays, law, own_bounce = hits.rays, hits.law, OWN_BOUNCE[hits.contribution]
    by_target = "T" in rays.chain
    if law is None or hits.contribution not in ping.choice.contributions or rays.chain.endswith(own_bounce):
        return
    if not by_target and (ping.is_reversed or rays.family not in ping.choice.followed_families):
        return
    sent = _transmitted_energy(ping, rays)
    for family in ping.choice.followed_families:
        if family.endswith(own_bounce):
            continue
        back = image_legs(ping.scene, ping.receive, rays.origin, family, ping.ping_geometry.wavelength)
        returned = scattered_per_steradian(law, rays.direction, -back.arrival, hits.normal)
        returned *= back.intensity * np.exp(-ping.attenuation * back.length) / back.length**2
        length = rays.length + back.length
        requested = ping.intersector.clear(
            ping.receive, rays.origin, family, ping.ping_geometry.wavelength, (returned > 0) & _in_window(ping, length)
        )
        rows = np.flatnonzero(requested)
        if not rows.size:
            continue
        gain = ping.receive_beams.gain(back.departure[rows]) ** 2
        energy = _channels(ping, sent[:, rows], gain * returned[rows])
        reciprocal = np.zeros(rows.size)
        if by_target:
            energy *= 2 if ping.ping_geometry.is_monostatic else 1
            reciprocal = _exchanged_interference(ping, rays.take(rows), family, length[rows])
        elif family != rays.family:
            reciprocal = _reciprocal(ping, rays.origin[rows], rays.family, family)
        chains = (family, rays.family) if ping.is_reversed else (rays.family, family)
        delay = length[rows] / _speed(ping)
        yield EchoEnergies(hits.contribution, hits.object, *chains, delay, energy, reciprocal)
    if by_target and rays.flat and not ping.is_reversed:
        yield from _retraced_echoes(ping, hits, sent)


def _transmitted_energy(ping: TracedPing, rays: RayBundle) -> Floats:
    """Mean-square pressure times the area of each ray at its hit, by transmit beam [uPa^2 m^2], shape (beams, n)."""
    level = float(intensity_ratio(ping.ping_geometry.source_level_db))
    factor = rays.solid_angle * rays.energy_fraction * np.exp(-ping.attenuation * rays.length)
    if "T" not in rays.chain:
        sine = np.minimum(np.abs(rays.direction[:, 2]), 1.0)
        factor = factor * coherent_intensity_factor(
            ping.scene, rays.family, float(ping.transmit[2]), rays.length, sine, ping.ping_geometry.wavelength
        )
    return np.asarray(level * factor * ping.transmit_beams.gain(rays.launch) ** 2)


def _retraced_echoes(ping: TracedPing, hits: RayHits, sent: Floats) -> Iterator[EchoEnergies]:
    """Echoes that return by flat faces of targets, with spherical spreading: first those along the transmit path."""
    rays, own_bounce = hits.rays, OWN_BOUNCE[hits.contribution]
    same = ReceiverPaths(
        -rays.direction, rays.launch, rays.length, rays.energy_fraction, np.ones(len(rays.length), bool)
    )
    if not ping.ping_geometry.is_monostatic:
        same = receiver_paths(ping, rays.origin, rays.receiver_image, rays.chain)
        same = same._replace(energy_fraction=rays.energy_fraction)
    yield from _face_echoes(ping, hits, sent, rays.chain, same, None)
    for chain, transmit_image, image in face_chains(ping):
        other = np.linalg.norm(rays.receiver_image - image, axis=1) > MAX_MISS_DISTANCE
        if chain.endswith(own_bounce) or (chain == rays.chain and not other.any()):
            continue
        paths = receiver_paths(ping, rays.origin, image, chain)
        if chain == rays.chain:
            paths = paths._replace(is_clear=paths.is_clear & other)
        yield from _face_echoes(ping, hits, sent, chain, paths, transmit_image)


def _face_echoes(
    ping: TracedPing, hits: RayHits, sent: Floats, chain: str, paths: ReceiverPaths, transmit_image: Floats | None
) -> Iterator[EchoEnergies]:
    """Echoes that return by one chain of flat faces and boundaries.

    Args:
        ping: The ping.
        hits: Hits of rays by flat faces.
        sent: Their energies from `_transmitted_energy`.
        chain: Reflections of the receive legs, from the receiver outwards.
        paths: The receive legs.
        transmit_image: Image of the transmitter in the planes of that chain [m], (3,); None for the transmit path.
    """
    rays, length = hits.rays, hits.rays.length + paths.length
    if hits.law is None:
        return
    returned = scattered_per_steradian(hits.law, rays.direction, paths.leaving, hits.normal)
    returned = returned * paths.energy_fraction * np.exp(-ping.attenuation * paths.length) / paths.length**2
    rows = np.flatnonzero(paths.is_clear & (returned > 0) & _in_window(ping, length))
    if not rows.size:
        return
    energy = _channels(ping, sent[:, rows], ping.receive_beams.gain(paths.departure[rows]) ** 2 * returned[rows])
    reciprocal = np.full(rows.size, 0.0 if transmit_image is None else 1.0)
    if transmit_image is not None and not ping.ping_geometry.is_monostatic:
        out = np.linalg.norm(rays.origin - transmit_image, axis=1)
        back = np.linalg.norm(rays.origin - rays.receiver_image, axis=1)
        reciprocal = _interference(ping, (length - out - back)[rows])
    delay = length[rows] / _speed(ping)
    yield EchoEnergies(hits.contribution, hits.object, rays.family, chain, delay, energy, reciprocal)


def point_echoes(ping: TracedPing, target: PointTarget, position: Floats) -> Iterator[EchoEnergies]:
    """Echoes of a point target, which no ray hits: every transmit leg with every receive leg, occlusion included.

    Args:
        ping: The ping.
        target: The point.
        position: Its position in the frame of the scatterer grid [m], shape (1, 3).
    """
    wavelength, strength = ping.ping_geometry.wavelength, float(intensity_ratio(target.target_strength_db))
    level = float(intensity_ratio(ping.ping_geometry.source_level_db))
    ends = []
    for end, beams in ((ping.transmit, ping.transmit_beams), (ping.receive, ping.receive_beams)):
        found = {}
        for family in ping.choice.followed_families:
            one = image_legs(ping.scene, end, position, family, wavelength)
            clear = ping.intersector.clear(end, position, family, wavelength, np.ones(1, bool))
            loss = one.intensity * np.exp(-ping.attenuation * one.length) / one.length**2
            found[family] = one.length, beams.gain(one.departure) ** 2 * loss * clear
        ends.append(found)
    for out, (length_out, sent) in ends[0].items():
        for back, (length_back, channels) in ends[1].items():
            length = length_out + length_back
            energy = _channels(ping, level * sent, strength * channels)
            if _in_window(ping, length)[0] and energy.any():
                same = np.zeros(1) if out == back else _reciprocal(ping, position, out, back)
                yield EchoEnergies("target", target.label, out, back, length / _speed(ping), energy, same)


def boundary_echo_energies(ping: TracedPing) -> Iterator[EchoEnergies]:
    """Sound from the transmitter to the receiver by reflections alone, family by family in the order of travel.

    A path and the same path travelled backwards, such as BS and SB, interfere; others add as energies.

    Args:
        ping: The ping.
    """
    geometry, position = ping.ping_geometry, ping.transmit[None]
    families = boundary_echo_families(ping.choice, two_platforms=False)
    level, depth = float(intensity_ratio(geometry.source_level_db)), float(ping.receive[2])
    for family in families:
        back = image_legs(ping.scene, ping.receive, position, family, geometry.wavelength)
        clear = ping.intersector.clear(
            ping.receive, position, family, geometry.wavelength, _in_window(ping, back.length)
        )
        sine = np.abs(back.departure[:, 2])
        rough = sediment_bounce_factor(family, depth, back.length, sine, ping.scene.seabed, geometry.wavelength)
        loss = back.intensity * rough**2 * np.exp(-ping.attenuation * back.length) / back.length**2
        sent = level * loss * ping.transmit_beams.gain(-back.arrival) ** 2
        energy = _channels(ping, sent, ping.receive_beams.gain(back.departure) ** 2)
        if not clear[0] or not energy.any():
            continue
        same, reverse = np.zeros(1), family[::-1]
        if reverse != family and reverse in families:
            other = image_legs(ping.scene, ping.receive, position, reverse, geometry.wavelength).length
            same = _interference(ping, back.length - other)
        yield EchoEnergies(BOUNDARY_ECHO, BOUNDARY_ECHO, reverse, "", back.length / _speed(ping), energy, same)


def _reciprocal(ping: TracedPing, position: Floats, out: str, back: str) -> Floats:
    """Interference of paths with the same travelled backwards [1]: 1 where both ends are at one position."""
    if ping.ping_geometry.is_monostatic:
        return np.ones(len(position))
    path_difference = np.zeros(len(position))
    for end, sign in ((ping.transmit, 1.0), (ping.receive, -1.0)):
        for family, turn in ((out, sign), (back, -sign)):
            path_difference += (
                turn * image_legs(ping.scene, end, position, family, ping.ping_geometry.wavelength).length
            )
    return _interference(ping, path_difference)


def _exchanged_interference(ping: TracedPing, rays: RayBundle, family: str, length: Floats) -> Floats:
    """Interference of paths out over a target's face and back by a family with the other order of both [1].

    Args:
        ping: The ping.
        rays: Rays at their hits, n of them.
        family: Family of the receive legs.
        length: Length of both legs together [m], shape (n,).
    """
    if ping.ping_geometry.is_monostatic:
        return np.ones(len(length))
    out = image_legs(ping.scene, ping.transmit, rays.origin, family, ping.ping_geometry.wavelength).length
    return _interference(ping, length - out - np.linalg.norm(rays.origin - rays.receiver_image, axis=1))


def _interference(ping: TracedPing, path_difference: Floats) -> Floats:
    """Interference term of two equal echoes, re the mean-square pressure of one of them.

    Args:
        ping: The ping.
        path_difference: Difference of their path lengths [m], shape (n,).

    Returns:
        The autocorrelation of the received pulse with its carrier [1], 1 without a difference, shape (n,).
    """
    lag, (step, correlation) = path_difference / _speed(ping), _pulse_correlation(ping.ping_geometry.pulse)
    value = np.interp(np.abs(lag), step * np.arange(len(correlation)), correlation, right=0.0)
    return np.asarray(np.real(np.exp(2j * np.pi * ping.ping_geometry.frequency * np.abs(lag)) * value))


@lru_cache(maxsize=4)
def _pulse_correlation(pulse: ReceivedPulse) -> tuple[float, NDArray[np.complex128]]:
    """Step of lags [s], and autocorrelation of the received pulse at lags from 0 on, 1 at no lag [1], shape (n,)."""
    step = 1 / (8 * (4 / pulse.resolution_time + abs(pulse.pulse.bandwidth or 0.0)))
    waveform = pulse.samples(np.arange(pulse.start, pulse.stop, step))
    correlation = np.correlate(waveform, waveform, "full")[len(waveform) - 1 :]
    return step, correlation / correlation[0].real


def _channels(ping: TracedPing, sent: Floats, gains: Floats) -> Floats:
    """Energy in every channel from its transmit and receive beams, (channels, n)."""
    channel = np.arange(ping.ping_geometry.channel_count)
    return np.asarray(sent[channel % len(sent)] * gains[channel % len(gains)])


def _in_window(ping: TracedPing, length: Floats) -> NDArray[np.bool_]:
    first, last = ping.ping_geometry.recorded_delays
    return np.asarray((length >= first * _speed(ping)) & (length <= last * _speed(ping)))


def _speed(ping: TracedPing) -> float:
    return ping.scene.water.sound_speed
