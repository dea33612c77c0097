"""Arrivals at each element, for arrays and motions beyond the far field of a stationary centre.

The leg to an array's centre determines those to its elements: `_arrival_time_kernel`. The strength of a scatterer, its
occlusion and the transmit beam are taken at the start of the ping; delay, spreading, the receive pattern and the
Doppler factor at the time of reception.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.propagation.wavefront import MIN_RADIUS, Wavefront, wavefronts
from insonify.records.pairs import Pairs
from insonify.sonar.beam import POINTS_PER_LOBE, Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.sub_bands import SubBand
from insonify.synthesis._arrival_kernel import ReceiveBeams, ReceiveLegs, Reception, TransmitLegs
from insonify.synthesis._arrival_time_kernel import CLOSEST, ArrayWater, ElementMotion, transmit_moving, turn_to_element
from insonify.synthesis._element_arrivals_kernel import ArraySector, PairedLegs, deposit_on_elements
from insonify.synthesis._leg_pressure_kernel import transmitted_pressure
from insonify.synthesis.chebyshev_nodes import aperture_nodes, few_nodes_beyond
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.synthesis.sector_interpolation import NO_SECTOR, SectorInterpolation
from insonify.synthesis.time_grid import TimeGrid
from insonify.synthesis.waveform_basis import WaveformBasis
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Cells = NDArray[np.complex64]
PARALLAX_TOLERANCE = 0.02
"""Largest parallax between elements that is neglected, re the pattern's width wavelength / (pi aperture) [1]."""


@dataclass(slots=True)
class ElementCells:
    """Grids of pressure of an array's elements and of the interpolation points of its sector."""

    elements: Cells
    """Pressures of the elements [uPa], shape (bands, elements, groups, cells, waveforms of a group)."""
    points: Cells
    """Pressures of the interpolation points [uPa], in the waveforms of the sector, shape (bands, points, groups, cells,
    waveforms of a group); without a sector, no points."""

    @property
    def nbytes(self) -> int:
        """Memory [bytes]."""
        return self.elements.nbytes + self.points.nbytes

    def __iadd__(self, other: "ElementCells") -> Self:
        """Add the grids of another part of the scatterers."""
        self.elements += other.elements
        self.points += other.points
        return self


@dataclass(frozen=True, slots=True)
class ReceivePoints:
    """The receiver's channels as m points with position, velocity and acceleration."""

    position: Floats
    """Position from the array's centre, in the world, at the start of the ping [m], shape (m, 3)."""
    velocity: Floats
    """Velocity in the world [m/s], shape (m, 3)."""
    acceleration: Floats
    """Acceleration in the world [m/s^2], shape (m, 3)."""
    orientation_row: NDArray[np.int64]
    """Row of each channel in `orientations`, -1 for a dead one among several orientations, shape (m,)."""
    orientations: Floats
    """Distinct angles of elements to the right of the array's boresight [rad], shape (orientations,)."""

    def motion(self, point: int) -> ElementMotion:
        """Motion of one point, in the form of the kernels.

        Args:
            point: Index of the point.
        """
        return ElementMotion(self.position[point], self.velocity[point], self.acceleration[point])


def receive_points(ping_geometry: PingGeometry) -> ReceivePoints:
    """Elements of the receiver in the world; for beams, the array's centre."""
    elements, motion = ping_geometry.elements, ping_geometry.receive_motion
    position = np.zeros((1, 3)) if elements is None else elements.positions @ ping_geometry.receive_beams.axes
    if motion is None:
        velocity, acceleration = np.zeros((2, *position.shape))
    else:
        arm = ping_geometry.lever_arms[1:]
        offset = arm if elements is None else arm + position @ motion.rotation[0]
        _, velocity, acceleration = motion.kinematics(offset)
    if elements is None:
        return ReceivePoints(position, velocity, acceleration, np.zeros(1, np.int64), np.zeros(1))
    orientations, row = np.unique(elements.orientations, return_inverse=True)
    if len(orientations) > 1:  # of one orientation, all elements are computed together: a dead one is 0 afterwards
        row = np.where(elements.response == 0, -1, row)
    return ReceivePoints(position, velocity, acceleration, row, orientations)


@dataclass(frozen=True, slots=True)
class PairEchoes:
    """Echoes of n scatterers by one transmit and one receive leg, before beams and carrier."""

    delay: Floats
    """Time at which the pulse's middle (sonar at rest: its start) would reach a centre at rest [s], shape (n,)."""
    direction: Floats
    """Unit vector from the receiver towards the arriving sound, in the world [1], shape (n, 3)."""
    transmitter_mach: Floats
    """Radial speed of the transmitter towards the departing sound over the speed of sound [1], shape (n,)."""
    amplitude_factor: Floats
    """Pressure ratio by the transmitter's own motion [1], shape (n,)."""
    wavefront: Wavefront
    """Wavefronts at the receiver."""


def pair_echoes(pairs: Pairs, ping_geometry: PingGeometry, water: Water) -> Iterator[PairEchoes]:
    """Echoes of each ordered pair of legs of a block, in their order.

    Args:
        pairs: Transmit and receive legs of a block.
        ping_geometry: The sonar at this ping.
        water: Water between sonar and scatterers.
    """
    transmit, receive, positions = pairs.transmit_legs, pairs.receive_legs, pairs.scatterers.position
    motion_by_leg = {
        i: transmitter_motion(transmit.departure[i], transmit.length[i], ping_geometry)
        for i in np.unique(pairs.pair[:, 0])
    }
    rows = [int(j) for j in np.unique(pairs.pair[:, 1])]
    fronts = dict(zip(rows, wavefronts(receive, rows, ping_geometry.receive_position, positions, water), strict=True))
    for i, j in pairs.pair:
        emission_delay, mach, amplitude_factor = motion_by_leg[i]
        delay = transmit.delay[i] + receive.delay[j] + emission_delay
        yield PairEchoes(delay, receive.departure[j], mach, amplitude_factor, fronts[j])


@dataclass(frozen=True)
class PingReception:
    """Conditions under which the echoes of one ping are received."""

    ping_geometry: PingGeometry
    """The sonar at this ping."""
    grid: TimeGrid
    """Time grid of the cells."""
    replica_jitter: ReplicaJitter
    """Jitter of replicas."""
    basis: WaveformBasis
    """Waveforms of which received echoes are weighted sums."""
    receive_points: ReceivePoints
    """Receiver channels as points, from `receive_points`."""
    water: Water
    """Water between sonar and scatterers."""
    attenuation: float
    """Absorption at the carrier, from `absorption_np_per_m` [Np/m]."""

    def for_kernels(self, sound_speed_gradient: float) -> Reception:
        """Time grid, carrier and water in the form of the kernels.

        Args:
            sound_speed_gradient: Growth of the speed of sound with depth at the array [1/s].
        """
        geometry, grid = self.ping_geometry, self.grid
        pulse_middle = 0.0 if geometry.is_static else geometry.pulse.pulse.duration / 2
        slowness = 1 / geometry.receive_sound_speed
        water = ArrayWater(slowness, sound_speed_gradient, self.attenuation, self.water.layered, pulse_middle)
        return Reception(grid.first_time, grid.cell_rate, geometry.frequency, self.basis.weight_table, water)


def deposit(
    cells: ElementCells, pairs: Pairs, ping: PingReception, sector: tuple[SectorInterpolation, WaveformBasis] | None
) -> None:
    """Deposit the echoes of one block of scatterers on the cells of all elements.

    Args:
        cells: Grids of pressure [uPa], added to in place.
        pairs: Transmit and receive legs of the block, and strengths.
        ping: Conditions of reception.
        sector: Sector interpolation, and the waveform basis of its echoes; None: all echoes go to each element.
    """
    ping_geometry, grid, receive_points, water = ping.ping_geometry, ping.grid, ping.receive_points, ping.water
    transmit, receive, strength = pairs.transmit_legs, pairs.receive_legs, pairs.strength
    if not ping.replica_jitter.is_zero:
        factors = [
            ping.replica_jitter.factor(pairs.scatterers.scatterer_id, *names, pairs.scatterers.object)
            for names in pairs.rays()
        ]
        strength = strength * np.array(factors)
    emission_delay, mach, amplitude_factor = transmitter_motion(transmit.departure, transmit.length, ping_geometry)
    amplitude = transmit.amplitude
    source_pressure = float(amplitude_ratio(ping_geometry.source_level_db))
    phase = np.ascontiguousarray(pairs.scatterers.phase)
    receive_amplitude = amplitude if receive is transmit else receive.amplitude
    curvature, distance, gradient, expansion = wavefront_columns(pairs, ping_geometry, water)
    rows, directions = _directions(pairs, ping_geometry, emission_delay, receive_points)
    receive_beams = _receive_beams(receive_points, ping_geometry.channel_count, len(directions))
    reception = ping.for_kernels(gradient)
    min_radius = 1 / float(np.fmax.reduce(np.abs(curvature), axis=None, initial=1e-9))
    if water.layered:
        min_radius = float(np.fmin.reduce(distance, axis=None, initial=min_radius))
    latest_arrival = grid.start + grid.sample_count / grid.sample_rate
    wavelength = ping_geometry.receive_sound_speed / ping_geometry.frequency
    extra_positions, array_sector = None, NO_SECTOR
    if sector is not None:
        extra_positions, array_sector = (
            sector[0].point_position,
            ArraySector(sector[0].limits, sector[1].weight_table),
        )
    motion = receive_points.position, receive_points.velocity, receive_points.acceleration
    all_nodes = aperture_nodes(*motion, min_radius, latest_arrival, wavelength, extra_positions)
    parts = [(all_nodes, strength)]
    if water.layered and not len(all_nodes.series):  # points below the array: wavefronts are expanded horizontally
        beyond = few_nodes_beyond(*motion, latest_arrival)
        is_near = ~((distance >= beyond) & (np.abs(curvature) * beyond <= 1)).all(axis=0)
        few_nodes = aperture_nodes(*motion, beyond, latest_arrival, wavelength, extra_positions)
        if len(few_nodes.series):
            far, near = np.where(is_near, 0, strength), np.where(is_near, strength, 0)
            parts = [(few_nodes, far), (all_nodes, near)]
    for band, sub_band in enumerate(ping_geometry.sub_bands or (carrier_band(ping_geometry),)):
        absorption_factor, receive_pressure = np.empty((0, 0)), receive_amplitude
        if sub_band.offset != 0:
            absorption_factor = water.relative_absorption(transmit.length, sub_band.offset, ping_geometry.frequency)
            receive_pressure = receive_amplitude * water.relative_absorption(
                receive.length, sub_band.offset, ping_geometry.frequency
            )
        transmit_gain = sub_band.transmit_beams.gain(transmit.departure)
        transmit_pressure = np.empty(transmit_gain.shape, np.complex64)
        transmitted_pressure(
            amplitude, amplitude_factor, phase, source_pressure, absorption_factor, transmit_gain, transmit_pressure
        )
        gain = element_gains(ping_geometry, sub_band.receive_beams, receive_points, directions)
        transmit_legs = TransmitLegs(transmit.delay + emission_delay, 1 / (1 - mach), transmit_pressure)
        receive_legs = ReceiveLegs(
            receive.delay, curvature, distance, expansion, receive.departure, receive_pressure.astype(np.complex64),
            np.ascontiguousarray(np.moveaxis(gain, 1, 0)),
        )  # fmt: skip
        for nodes, part_strength in parts:
            legs = PairedLegs(np.column_stack([pairs.pair, rows]), transmit_legs, receive_legs, part_strength)
            deposit_on_elements(
                cells.elements[band], cells.points[band], legs, receive_beams, nodes, array_sector, reception
            )


def wavefront_columns(pairs: Pairs, ping_geometry: PingGeometry, water: Water) -> tuple[Floats, Floats, float, Floats]:
    """Wavefronts of all receive legs at the receiver, g legs to n points; see `Wavefront`.

    Returns:
        Vertical curvature [1/m], (g, n).
        Horizontal distance [m], (g, n); in water of one sound speed a placeholder.
        Growth of the speed of sound with depth [1/s].
        Deviations from spherical wavefronts, (g, terms, n).
    """
    receive = pairs.receive_legs
    if not water.layered:
        curvature = 1 / np.maximum(receive.length, MIN_RADIUS)
        return curvature, curvature, 0.0, np.zeros((len(curvature), 0, curvature.shape[1]))
    receiver_position, points = ping_geometry.receive_position, pairs.scatterers.position
    fronts = wavefronts(receive, range(len(receive.length)), receiver_position, points, water)
    curvature, distance, expansion = (
        np.array([getattr(front, name) for front in fronts])
        for name in ("vertical_curvature", "horizontal_distance", "expansion")
    )
    return curvature, distance, fronts[0].sound_speed_gradient, expansion


def _directions(
    pairs: Pairs, ping_geometry: PingGeometry, pulse_middle_delay: Floats, receive_points: ReceivePoints
) -> tuple[NDArray[np.int64], list[Floats]]:  # fmt: skip
    """Row of each pair among the directions, and directions towards the echoes in the attitude of the ping's start.

    Arguments and shapes are those of `echo_directions`.
    """
    rows, directions, arrival_times = echo_directions(pairs, ping_geometry, pulse_middle_delay, receive_points)
    motion = ping_geometry.receive_motion
    if motion is None or not motion.is_rotating:
        return rows, directions
    return rows, [
        np.array([motion.to_initial_attitude(*row) for row in zip(directions, arrival_times, strict=True)])
        for directions in directions
    ]


def echo_directions(
    pairs: Pairs, ping_geometry: PingGeometry, pulse_middle_delay: Floats, receive_points: ReceivePoints
) -> tuple[NDArray[np.int64], list[Floats], Floats]:  # fmt: skip
    """Unit vectors from the receiver towards echoes in the world, and times of arrival.

    They are those of the receive legs where nothing rotates.

    Args:
        pairs: Transmit and receive legs of a block of n scatterers.
        ping_geometry: The sonar at this ping.
        pulse_middle_delay: Emission delay of the pulse's middle, from `transmitter_motion` [s], shape (legs, n).
        receive_points: Receiver channels as points, from `receive_points`.

    Returns:
        Row of each pair in the other results, whose rows are receive legs, or pairs where the array rotates, (pairs,).
        Directions [1], each of shape (legs or pairs, n, 3): one array for all elements, or one for each.
        Times [s], shape (legs or pairs, n).
    """
    transmit, receive = pairs.transmit_legs, pairs.receive_legs
    rows, direction, path_length = pairs.pair[:, 1], receive.departure, receive.length
    arrival_time = transmit.delay[0] + pulse_middle_delay[0] + receive.delay  # nearly the same by other transmit legs
    if ping_geometry.receive_motion is not None and ping_geometry.receive_motion.is_rotating:
        (i, j), rows = pairs.pair.T, np.arange(len(pairs.pair))
        direction, path_length = direction[j], path_length[j]
        arrival_time = transmit.delay[i] + pulse_middle_delay[i] + receive.delay[j]
    if not has_parallax(
        ping_geometry,
        receive_points,
        float(np.fmin.reduce(path_length, axis=None)),
        float(np.fmax.reduce(arrival_time, axis=None)),
    ):
        return rows, [direction], arrival_time
    return (
        rows,
        [
            element_directions(receive_points.motion(e), direction, path_length, arrival_time)
            for e in range(len(receive_points.position))
        ],
        arrival_time,
    )


def has_parallax(
    ping_geometry: PingGeometry, receive_points: ReceivePoints, min_path_length: float, latest_arrival: float
) -> bool:
    """Return True if patterns resolve the change of direction to the nearest scatterer over elements and motion.

    Args:
        ping_geometry: The sonar at this ping.
        receive_points: Receiver channels as points, from `receive_points`.
        min_path_length: Shortest receive leg [m].
        latest_arrival: Time of the last arrival [s].
    """
    distance, speed = (np.sqrt(np.vecdot(v, v)) for v in (receive_points.position, receive_points.velocity))
    displacement = float((distance + latest_arrival * speed).max())
    return resolves_parallax(ping_geometry.receive_beams, displacement, min_path_length)


def resolves_parallax(beams: Beams, displacement: float, min_path_length: float) -> bool:
    """Return True if patterns resolve the change of direction of the nearest scatterer with the displacement of a beam.

    Args:
        beams: The beams.
        displacement: Displacement [m].
        min_path_length: Shortest receive leg [m].
    """
    waves = beams.largest_per_unit / POINTS_PER_LOBE
    return waves > 1 and math.pi * waves * displacement > PARALLAX_TOLERANCE * max(min_path_length, CLOSEST)


def element_directions(motion: ElementMotion, direction: Floats, path_length: Floats, arrival_time: Floats) -> Floats:
    """Directions from an element at the times of arrival, given those from the array's centre at the start of the ping.

    Args:
        motion: Motion of the element.
        direction: Unit vectors from the centre towards the echoes [1], shape (..., 3).
        path_length: Lengths of the receive legs [m], shape (...).
        arrival_time: Times of arrival [s], shape (...).
    """
    element_direction = np.empty(direction.shape)
    turn_to_element(
        np.ascontiguousarray(direction).reshape(-1, 3), np.ascontiguousarray(path_length).ravel(),
        np.ascontiguousarray(arrival_time).ravel(), motion, element_direction.reshape(-1, 3),
    )  # fmt: skip
    return element_direction


def _receive_beams(receive_points: ReceivePoints, channels: int, direction_sets: int) -> ReceiveBeams:
    """Receive patterns of channels that are elements; direction_sets: length of the directions of `_directions`."""
    number = np.arange(channels)
    channel_ranges = np.stack([number, number + 1], axis=1)
    orientation_row = receive_points.orientation_row
    pattern = orientation_row if direction_sets == 1 else np.where(orientation_row < 0, -1, number)
    return ReceiveBeams(
        receive_points.position, receive_points.velocity, receive_points.acceleration, channel_ranges, 0 * number,
        pattern,
    )  # fmt: skip


def carrier_band(ping_geometry: PingGeometry) -> SubBand:
    """Carrier and its beams as one sub-band, for beams that are constant over the band."""
    return SubBand(0.0, ping_geometry.transmit_beams, ping_geometry.receive_beams)


def directions_at_reception(ping_geometry: PingGeometry, direction: Floats, delay: Floats) -> Floats:
    """Directions re the platform at the time of reception, expressed in its attitude at the start of the ping.

    Args:
        ping_geometry: The sonar at this ping.
        direction: Unit vectors from the receiver in the world [1], shape (n, 3).
        delay: Time of arrival of each echo [s], shape (n,).
    """
    return (
        direction
        if ping_geometry.receive_motion is None
        else ping_geometry.receive_motion.to_initial_attitude(direction, delay)
    )


def transmitter_motion(
    departure: Floats, wavefront_radius: Floats, ping_geometry: PingGeometry
) -> tuple[Floats, Floats, Floats]:
    """Effects of the transmitter's motion on the pulse's middle: emission delay, radial speed, pressure.

    A stationary sonar has no emission delay: its echoes are timed by their starts.

    Args:
        departure: Unit vectors of departure in the world [1], shape (..., 3).
        wavefront_radius: Radius of the wavefronts [m], shape (...).
        ping_geometry: The sonar.

    Returns:
        Emission delay [s], radial speed of the transmitter towards the departing sound over that of sound [1], and
        pressure ratio [1], each of shape (...).
    """
    emission_delay, mach = np.zeros(wavefront_radius.shape), np.zeros(wavefront_radius.shape)
    amplitude_factor = np.ones(wavefront_radius.shape)
    if ping_geometry.receive_motion is not None:
        transmit_moving(
            np.ascontiguousarray(departure).reshape(-1, 3), np.ascontiguousarray(wavefront_radius).ravel(),
            ping_geometry.transmit_velocity, ping_geometry.pulse.pulse.duration / 2, 1 / ping_geometry.sound_speed,
            emission_delay.ravel(), mach.ravel(), amplitude_factor.ravel(),
        )  # fmt: skip
    return emission_delay, mach, amplitude_factor


def element_gains(
    ping_geometry: PingGeometry, beams: Beams, receive_points: ReceivePoints, directions: list[Floats]
) -> NDArray[np.float32]:
    """Amplitude of an element in each orientation, (orientations, ...), or of each element, (elements, ...) [1].

    Args:
        ping_geometry: The sonar at this ping.
        beams: Its receive beams, at one frequency.
        receive_points: Receiver channels as points, from `receive_points`.
        directions: Directions from `directions_at_reception`, shape (..., 3), of the whole array or of each element.
    """
    if len(directions) == 1:
        return np.asarray(
            [rotated_beams(beams, angle).gain(directions[0])[0] for angle in receive_points.orientations], np.float32
        )
    rows = [
        rotated_beams(beams, angle).gain(cosines)[0]
        for angle, cosines in zip(receive_points.orientations[receive_points.orientation_row], directions, strict=True)
    ]
    return np.asarray(rows, np.float32)


def rotated_beams(beams: Beams, angle: float) -> Beams:
    """Pattern of an element rotated away from boresight.

    Args:
        beams: Pattern of an element on boresight.
        angle: Rotation to the right of boresight [rad].
    """
    c, s = np.cos(angle), np.sin(angle)
    forward, right, down = beams.axes
    return beams.rotated(np.stack([c * forward + s * right, c * right - s * forward, down]))


def element_as_beam(ping_geometry: PingGeometry, channel: int) -> PingGeometry:
    """Sonar with one of its elements as its only beam, at the array's centre; unchanged if it has beams.

    Args:
        ping_geometry: The sonar at one ping.
        channel: Index of the element.
    """
    if ping_geometry.elements is None:
        return ping_geometry
    pattern = rotated_beams(ping_geometry.receive_beams, float(ping_geometry.elements.orientations[channel]))
    scale = pattern.scale * abs(ping_geometry.elements.response[channel])
    return replace(
        ping_geometry, receive_beams=replace(pattern, scale=scale), elements=None, sub_bands=(), channel_count=1
    )
