"""Echoes heard element by element: what a centre's far field and a standing sonar cannot tell.

The leg to an array's centre gives those to its elements: `_element_kernel`. The strength of a scatterer, its shadows
and the beam that insonified it are those of the start of the ping; delay, spreading, the pattern that hears it and the
Doppler factor are those of the moment when the echo comes.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.propagation.wavefront import CLOSEST_SOURCE, Wavefront, wavefront
from insonify.records.pairs import Pairs
from insonify.sonar.beam import POINTS_PER_LOBE, Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.sub_bands import SubBand
from insonify.synthesis._arrival_kernel import ReceiveBeams, ReceiveLegs, TransmitLegs
from insonify.synthesis._arrival_time_kernel import CLOSEST, transmit_moving, turn_to_element
from insonify.synthesis._element_arrivals_kernel import deposit_on_elements
from insonify.synthesis._leg_pressure_kernel import transmitted_pressure
from insonify.synthesis.chebyshev_nodes import aperture_nodes
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.synthesis.sector_interpolation import NONE, SectorInterpolation
from insonify.synthesis.time_grid import TimeGrid
from insonify.synthesis.waveform_basis import WaveformBasis
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
PARALLAX_TOLERANCE = 0.02
"""Part of a pattern's own angle, a wavelength over pi apertures, by which elements may see one echo apart [1]."""
Cells = NDArray[np.complex64]


@dataclass(frozen=True, slots=True)
class ReceivePoints:
    """The receiver's channels as points that hear: m of them."""

    position: Floats
    """From the array's centre, in the world, at the start of the ping [m], shape (m, 3)."""
    velocity: Floats
    """In the world [m/s], shape (m, 3)."""
    acceleration: Floats
    """In the world [m/s^2], shape (m, 3)."""
    orientation_row: NDArray[np.int64]
    """Row of `facings` that each has, -1 for one that is dead, shape (m,)."""
    orientations: Floats
    """Angles to the right of boresight that there are [rad], shape (facings,)."""


def receive_points(ping_geometry: PingGeometry) -> ReceivePoints:
    """The receiver's elements in the world; for beams, the array's centre.

    Args:
        ping_geometry: The sonar at one ping.
    """
    elements = ping_geometry.elements
    axes = ping_geometry.receive_beams.axes
    own = np.zeros((1, 3)) if elements is None else elements.positions
    place = own @ axes
    velocity, acceleration = np.zeros_like(place), np.zeros_like(place)
    if ping_geometry.receive_motion is not None:
        on_platform = ping_geometry.lever_arms[1] + place @ ping_geometry.receive_motion.rotation[0]
        _, velocity, acceleration = ping_geometry.receive_motion.kinematics(on_platform)
    if elements is None:
        return ReceivePoints(place, velocity, acceleration, np.zeros(1, np.int64), np.zeros(1))
    facings, row = np.unique(elements.orientations, return_inverse=True)
    return ReceivePoints(place, velocity, acceleration, np.where(elements.response == 0, -1, row), facings)


@dataclass(frozen=True, slots=True)
class PairEchoes:
    """What comes back from n scatterers by one leg out and one leg back, before any beam and any carrier."""

    delay: Floats
    """Out and back at the receiver's centre [s], shape (n,); under way: of the pulse's middle, the centre at rest."""
    direction: Floats
    """Direction that each comes from, away from the sonar, shape (n, 3)."""
    transmitter_mach: Floats
    """Part of the speed of sound at which the transmitter follows what it sends [1], shape (n,)."""
    amplitude_factor: Floats
    """By what the transmitter's own way changes the pressure [1], shape (n,)."""
    wavefront: Wavefront


def pair_echoes(pairs: Pairs, ping_geometry: PingGeometry, water: Water) -> Iterator[PairEchoes]:
    """What comes back by each ordered pair of legs of a block, in their order.

    Args:
        pairs: Legs out and back of a block.
        ping_geometry: The sonar at this ping.
        water: Between sonar and scatterers.
    """
    out, back, places = pairs.out, pairs.back, pairs.scatterers.position
    sent = {i: transmitter_motion(out.departure[i], out.length[i], ping_geometry) for i in np.unique(pairs.pair[:, 0])}
    fronts = {j: wavefront(back, j, ping_geometry.receive_position, places, water) for j in np.unique(pairs.pair[:, 1])}
    for i, j in pairs.pair:
        gone, leaving, louder = sent[i]
        delay = out.delay[i] + back.delay[j] + gone
        yield PairEchoes(delay, back.departure[j], leaving, louder, fronts[j])


def deposit(
    cells: Cells, pairs: Pairs, ping_geometry: PingGeometry, grid: TimeGrid, replica_jitter: ReplicaJitter,
    basis: WaveformBasis, receive_points: ReceivePoints,
    water: Water, attenuation: float, interpolation: SectorInterpolation | None = None,
) -> None:  # fmt: skip
    """Add the echoes of one block of scatterers to the cells of all elements.

    Args:
        cells: Grids of pressure, shape (bands, elements, groups, cells, dopplers of a group).
        pairs: Legs out and back of the block, and strengths.
        ping_geometry: The sonar at this ping.
        grid: The grid that the cells belong to.
        replica_jitter: Jitter of replicas.
        basis: Waveforms of which echoes are sums.
        receive_points: Of `receive_points`.
        water: Between sonar and scatterers.
        attenuation: Of `absorption_np_per_m`.
        interpolation: Of `shared`; its places are channels after the elements.
    """
    out, back, strength = pairs.out, pairs.back, pairs.strength
    if not replica_jitter.is_zero:
        factors = [replica_jitter.factor(pairs.scatterers.scatterer_id, *names) for names in pairs.rays()]
        strength = strength * np.array(factors)
    gone, leaving, louder = transmitter_motion(out.departure, out.length, ping_geometry)
    amplitude = out.amplitude
    level, phase = float(amplitude_ratio(ping_geometry.source_level_db)), np.ascontiguousarray(pairs.scatterers.phase)
    left = amplitude if back is out else back.amplitude
    bend, away, gradient, beside = wavefront_columns(pairs, ping_geometry, water)
    rows, seen = _directions(pairs, ping_geometry, gone, receive_points)
    ears = _receive_beams(receive_points, ping_geometry.channel_count, len(seen))
    middle = 0.0 if ping_geometry.is_static else ping_geometry.pulse.pulse.duration / 2
    end = (
        1 / ping_geometry.receive_sound_speed, gradient, attenuation, water.layered, middle, ping_geometry.frequency,
        basis.doppler,
    )  # fmt: skip
    nearest = 1 / float(np.fmax.reduce(np.abs(bend), axis=None, initial=1e-9))
    if water.layered:
        nearest = float(np.fmin.reduce(away, axis=None, initial=nearest))
    latest, wavelength = (
        grid.start + grid.sample_count / grid.sample_rate,
        ping_geometry.receive_sound_speed / ping_geometry.frequency,
    )
    also = None if interpolation is None else interpolation.point_position
    nodes = aperture_nodes(
        receive_points.position, receive_points.velocity, receive_points.acceleration, nearest, latest, wavelength, also
    )
    sector = (
        NONE
        if interpolation is None or nodes.weights.shape[1] == len(receive_points.position)
        else interpolation.sector
    )
    for band, sub_band in enumerate(ping_geometry.sub_bands or (carrier_band(ping_geometry),)):
        lost, kept = np.empty((0, 0)), left
        if sub_band.offset != 0:
            lost = relative_absorption(out.length, sub_band.offset, ping_geometry.frequency, water)
            kept = left * relative_absorption(back.length, sub_band.offset, ping_geometry.frequency, water)
        beams = sub_band.transmit_beams.gain(out.departure)
        sent = np.empty(beams.shape, np.complex64)
        transmitted_pressure(amplitude, louder, phase, level, lost, beams, sent)
        gain = element_gains(ping_geometry, sub_band.receive_beams, receive_points, seen)
        deposit_on_elements(
            cells[band], grid.first_time, grid.cell_rate, np.column_stack([pairs.pair, rows]),
            TransmitLegs(out.delay + gone, 1 / (1 - leaving), sent),
            ReceiveLegs(back.delay, bend, away, beside, back.departure, kept.astype(np.complex64),
                  np.ascontiguousarray(np.moveaxis(gain, 1, 0))),
            strength, ears, nodes, sector, *end,
        )  # fmt: skip


def wavefront_columns(pairs: Pairs, ping_geometry: PingGeometry, water: Water) -> tuple[Floats, Floats, float, Floats]:
    """The wavefronts of all legs back, as of `Wavefront`, leg by leg; distances on ground where rays bend alone."""
    back = pairs.back
    if not water.layered:
        bend = 1 / np.maximum(back.length, CLOSEST_SOURCE)
        return bend, bend, 0.0, np.zeros((len(bend), 0, bend.shape[1]))
    place, points = ping_geometry.receive_position, pairs.scatterers.position
    fronts = [wavefront(back, j, place, points, water) for j in range(len(back.length))]
    curvature, distance, expansion = (
        np.array([getattr(front, name) for front in fronts])
        for name in ("vertical_curvature", "horizontal_distance", "expansion")
    )
    return curvature, distance, fronts[0].sound_speed_gradient, expansion


def _directions(
    pairs: Pairs, ping_geometry: PingGeometry, pulse_middle_delay: Floats, receive_points: ReceivePoints
) -> tuple[NDArray[np.int64], list[Floats]]:  # fmt: skip
    """Directions of echoes as the platform sees them, and the row of each pair among them; see `echo_directions`."""
    rows, towards, when = echo_directions(pairs, ping_geometry, pulse_middle_delay, receive_points)
    course = ping_geometry.receive_motion
    if course is None or not course.is_rotating:
        return rows, towards
    return rows, [
        np.array([course.to_initial_attitude(*row) for row in zip(one, when, strict=True)]) for one in towards
    ]


def echo_directions(
    pairs: Pairs, ping_geometry: PingGeometry, pulse_middle_delay: Floats, receive_points: ReceivePoints
) -> tuple[NDArray[np.int64], list[Floats], Floats]:  # fmt: skip
    """Directions in which echoes are heard in the world, and when; those of a leg back, if nothing turns.

    Args:
        pairs: Legs of a block of n scatterers.
        ping_geometry: The sonar at this ping.
        pulse_middle_delay: Of `transmitter_motion`, shape (legs, n).
        receive_points: Of `receive_points`.

    Returns:
        Row of each pair among the legs back, or among the pairs; directions of shape (legs or pairs, n, 3), one for
        the whole array or one for each of its elements; times [s], shape (legs or pairs, n).
    """
    out, back = pairs.out, pairs.back
    rows, towards, away = pairs.pair[:, 1], back.departure, back.length
    when = out.delay[0] + pulse_middle_delay[0] + back.delay  # by another leg out it is hardly another place
    if ping_geometry.receive_motion is not None and ping_geometry.receive_motion.is_rotating:
        (i, j), rows = pairs.pair.T, np.arange(len(pairs.pair))
        towards, away, when = towards[j], away[j], out.delay[i] + pulse_middle_delay[i] + back.delay[j]
    if not has_parallax(
        ping_geometry, receive_points, float(np.fmin.reduce(away, axis=None)), float(np.fmax.reduce(when, axis=None))
    ):
        return rows, [towards], when
    return (
        rows,
        [element_directions(receive_points, e, towards, away, when) for e in range(len(receive_points.position))],
        when,
    )


def has_parallax(
    ping_geometry: PingGeometry, receive_points: ReceivePoints, min_path_length: float, latest_arrival: float
) -> bool:
    """Whether elements, or beams under way, see the nearest scatterer in directions that their patterns tell apart.

    Args:
        ping_geometry: The sonar at this ping.
        receive_points: Of `receive_points`.
        min_path_length: Shortest way back [m].
        latest_arrival: When the last echo comes [s].
    """
    waves = float(ping_geometry.receive_beams.per_unit.max()) / POINTS_PER_LOBE
    if not waves > 1:
        return False
    reach = np.linalg.norm(receive_points.position, axis=1) + latest_arrival * np.linalg.norm(
        receive_points.velocity, axis=1
    )
    return bool(np.pi * waves * reach.max() > PARALLAX_TOLERANCE * max(min_path_length, CLOSEST))


def element_directions(
    receive_points: ReceivePoints, element: int, direction: Floats, path_length: Floats, arrival_time: Floats
) -> Floats:
    """Directions in which an element sees what the array's centre sees at the start, from its place when echoes come.

    Args:
        receive_points: Of `receive_points`.
        element: Which.
        direction: Directions from the centre [1], shape (..., 3).
        path_length: Ways back [m], shape (...).
        arrival_time: When the echoes come [s], shape (...).
    """
    seen = np.empty(direction.shape)
    turn_to_element(
        np.ascontiguousarray(direction).reshape(-1, 3), np.ascontiguousarray(path_length).ravel(),
        np.ascontiguousarray(arrival_time).ravel(), receive_points.position[element],
        receive_points.velocity[element], receive_points.acceleration[element],
        seen.reshape(-1, 3),
    )  # fmt: skip
    return seen


def _receive_beams(receive_points: ReceivePoints, channels: int, views: int) -> ReceiveBeams:
    """Who hears: each element for itself."""
    number = np.arange(channels)
    own = np.stack([number, number + 1], axis=1)
    pattern = receive_points.orientation_row if views == 1 else np.where(receive_points.orientation_row < 0, -1, number)
    return ReceiveBeams(
        receive_points.position, receive_points.velocity, receive_points.acceleration, own, 0 * number, pattern
    )


def carrier_band(ping_geometry: PingGeometry) -> SubBand:
    """The carrier and its beams, for a sonar whose beams are the same throughout the band."""
    return SubBand(0.0, ping_geometry.transmit_beams, ping_geometry.receive_beams)


def absorption_np_per_m(water: Water, frequency: float) -> float:
    """Part of the pressure that the water takes on a metre [1/m].

    Args:
        water: What takes it.
        frequency: Of the sound [Hz].
    """
    return float(water.absorption(frequency)) * np.log(10) / 20


def relative_absorption(length: Floats, offset: float, frequency: float, water: Water) -> Floats:
    """Pressure that is left at one frequency of the band, relative to that left at the carrier [1], any shape.

    Args:
        length: Of the way [m], any shape.
        offset: From the carrier [Hz].
        frequency: Of the carrier [Hz].
        water: What takes it.
    """
    if offset == 0:
        return np.ones(length.shape)
    more = float(water.absorption(frequency + offset)) - float(water.absorption(frequency))
    return np.asarray(amplitude_ratio(-more * length))


def directions_at_reception(ping_geometry: PingGeometry, direction: Floats, delay: Floats) -> Floats:
    """Directions as the platform sees them when the echo comes, told by its attitude at the start of the ping.

    Args:
        ping_geometry: The sonar at this ping.
        direction: Unit vectors in the world [1], shape (n, 3).
        delay: When each echo comes [s], shape (n,).
    """
    return (
        direction
        if ping_geometry.receive_motion is None
        else ping_geometry.receive_motion.to_initial_attitude(direction, delay)
    )


def transmitter_motion(
    departure: Floats, wavefront_radius: Floats, ping_geometry: PingGeometry
) -> tuple[Floats, Floats, Floats]:
    """What is later for the pulse's middle than for its start, and what else the transmitter's own way does.

    Nothing is later for a sonar that stands still: its echoes are told by their starts.

    Args:
        departure: Directions in which the sound leaves, shape (..., 3).
        wavefront_radius: Radius of its wavefronts [m], shape (...).
        ping_geometry: The sonar.

    Returns:
        By what it is later [s], part of the speed of sound at which the transmitter follows what it sends [1], by what
        the pressure changes [1], each of shape (...).
    """
    later, leaving, louder = (
        np.zeros(wavefront_radius.shape),
        np.zeros(wavefront_radius.shape),
        np.ones(wavefront_radius.shape),
    )
    if ping_geometry.receive_motion is not None:
        transmit_moving(
            np.ascontiguousarray(departure).reshape(-1, 3), np.ascontiguousarray(wavefront_radius).ravel(),
            ping_geometry.transmit_velocity,
            ping_geometry.pulse.pulse.duration / 2, 1 / ping_geometry.sound_speed, later.ravel(), leaving.ravel(),
            louder.ravel(),
        )  # fmt: skip
    return later, leaving, louder


def element_gains(
    ping_geometry: PingGeometry, beams: Beams, receive_points: ReceivePoints, directions: list[Floats]
) -> NDArray[np.float32]:
    """Gain of an element that faces each way, (facings, ...), or of each element.

    Args:
        ping_geometry: The sonar at this ping.
        beams: Its receive beams, at one frequency.
        receive_points: Of `receive_points`.
        directions: Directions, as of `directions_at_reception`, of shape (..., 3): of the whole array, or of each of
            its elements.
    """
    if len(directions) == 1:
        return np.asarray(
            [rotated_beams(beams, angle).gain(directions[0])[0] for angle in receive_points.orientations], np.float32
        )
    rows = [
        rotated_beams(beams, angle).gain(one)[0]
        for angle, one in zip(receive_points.orientations[receive_points.orientation_row], directions, strict=True)
    ]
    return np.asarray(rows, np.float32)


def rotated_beams(beams: Beams, angle: float) -> Beams:
    """The pattern of an element that faces aside.

    Args:
        beams: Of an element that faces along boresight.
        angle: To the right of boresight [rad].
    """
    c, s = np.cos(angle), np.sin(angle)
    ahead, right, down = beams.axes
    return beams.rotated(np.stack([c * ahead + s * right, c * right - s * ahead, down]))


def element_as_beam(ping_geometry: PingGeometry, channel: int) -> PingGeometry:
    """The sonar with one of its elements as its only beam, at the array's centre; itself where it has beams.

    Args:
        ping_geometry: The sonar at one ping.
        channel: Which element.
    """
    if ping_geometry.elements is None:
        return ping_geometry
    ears = rotated_beams(ping_geometry.receive_beams, float(ping_geometry.elements.orientations[channel]))
    scale = ears.scale * abs(ping_geometry.elements.response[channel])
    return replace(
        ping_geometry, receive_beams=replace(ears, scale=scale), elements=None, sub_bands=(), channel_count=1
    )
