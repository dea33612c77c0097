"""Arrivals of one block of scatterers in beams of a moving sonar, or of several sub-bands.

The kernel takes legs as they are, and derives their pressures for a range of the block at a time.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import absorption_np_per_m
from insonify.records.legs import Legs
from insonify.records.pairs import Pairs, SeparableStrengths
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._arrival_kernel import ReceiveBeams
from insonify.synthesis._beam_arrivals_kernel import (
    LegColumns,
    ReceivingArray,
    ScattererBlock,
    ScatteringStrengths,
    Transmitter,
    WavefrontColumns,
    deposit_block,
)
from insonify.synthesis.direction_grid import DirectionGrid
from insonify.synthesis.element_arrivals import (
    PingReception,
    ReceivePoints,
    carrier_band,
    has_parallax,
    wavefront_columns,
)
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.units import amplitude_ratio

_NONE = np.empty(0)
_NOTHING = np.empty((0, 0), np.float32)


def deposit_beams(
    cells: NDArray[np.complex64], pairs: Pairs, ping: PingReception, direction_grid: DirectionGrid | None = None
) -> None:
    """Deposit the echoes of one block of scatterers on the cells of all beams.

    The strength of a scatterer, its occlusion and the transmit beam are taken at the start of the ping; delay,
    spreading, the receive pattern and the Doppler factor at the time of reception.

    Args:
        cells: Grids of pressure [uPa], added to in place, shape (bands, channels, groups, cells, waveforms of a group).
        pairs: Transmit and receive legs of the block, and strengths.
        ping: Conditions of reception.
        direction_grid: Direction grid, whose rows replace the channels; None: beams directly.
    """
    if not len(pairs.scatterers) or not len(pairs.pair):
        return
    ping_geometry, grid, receive_points, water = ping.ping_geometry, ping.grid, ping.receive_points, ping.water
    transmit_legs, receive_legs = pairs.transmit_legs, pairs.receive_legs
    transmit_columns = _leg_columns(transmit_legs)
    receive_columns = transmit_columns if receive_legs is transmit_legs else _leg_columns(receive_legs)
    gradient, wavefronts = 0.0, WavefrontColumns(np.empty((0, 0)), np.empty((0, 0)), np.empty((0, 0, 0)))
    if water.layered:
        curvature, distance, gradient, expansion = wavefront_columns(pairs, ping_geometry, water)
        wavefronts = WavefrontColumns(curvature, distance, expansion)
    reception, grid_rows = ping.for_kernels(gradient), direction_grid
    pulse_middle = reception.water.pulse_middle
    channels = _receive_beams(receive_points, cells.shape[1] if grid_rows is None else 1, ping_geometry)
    block = ScattererBlock(
        np.ascontiguousarray(pairs.pair), transmit_columns, receive_columns, receive_legs is transmit_legs,
        np.ascontiguousarray(pairs.scatterers.phase), _kernel_strengths(pairs, ping.replica_jitter), wavefronts,
    )  # fmt: skip
    parallax = has_parallax(
        ping_geometry, receive_points, _min_length(receive_legs), grid.start + grid.sample_count / grid.sample_rate
    )
    sub_bands = ping_geometry.sub_bands or (carrier_band(ping_geometry),)
    for band, sub_band in enumerate(sub_bands if grid_rows is None else grid_rows.bands):
        extra_absorption = 0.0
        if sub_band.offset != 0:
            extra_absorption = absorption_np_per_m(water, ping_geometry.frequency + sub_band.offset) - ping.attenuation
        transmitter = _transmitter(ping_geometry, sub_band.transmit_beams, pulse_middle)
        receiver = _receiving_array(
            ping_geometry, sub_band.receive_beams, channels, pulse_middle, has_parallax=parallax
        )
        rows = None if grid_rows is None else grid_rows.rows[band]
        deposit_block(cells[band], block, extra_absorption, transmitter, receiver, reception, rows)


def _leg_columns(legs: Legs) -> LegColumns:
    """Columns of legs for the kernel."""
    reflection, visibility = legs.reflection_coefficient, np.asarray(legs.visibility, complex)
    if legs.caustic is not None:
        reflection = reflection * legs.caustic
    if legs.glints is not None:
        reflection = reflection * legs.glints.phasor
    contiguous = np.ascontiguousarray
    return LegColumns(
        contiguous(legs.delay), contiguous(legs.length), contiguous(legs.spreading), contiguous(legs.absorption),
        contiguous(reflection), contiguous(visibility), contiguous(legs.departure), contiguous(legs.grazing_sine),
    )  # fmt: skip


def _min_length(legs: Legs) -> float:
    """Shortest of some legs [m]; legs that do not exist may have NaN."""
    shortest = float(legs.length.min())  # several times as fast as a search for NaN
    return shortest if np.isfinite(shortest) else float(np.fmin.reduce(legs.length, axis=None))


def _kernel_strengths(pairs: Pairs, replica_jitter: ReplicaJitter) -> ScatteringStrengths:
    """Strengths in the form of the kernel: separable where possible, with replica jitter as an array."""
    stored, priority, range_bin = pairs.stored_strengths, np.empty(0, np.float32), np.empty(0, np.uint8)
    keep_probability = _NOTHING
    if isinstance(stored, SeparableStrengths) and replica_jitter.is_zero:
        if stored.sampling is not None:
            priority, range_bin = stored.sampling.priority, stored.sampling.range_bin
            keep_probability = stored.sampling.keep_probability
        no_strengths = np.empty((0, 0), np.complex64)
        return ScatteringStrengths(
            no_strengths, stored.direction_factor, stored.root_area, stored.weight, priority, range_bin,
            keep_probability,
        )  # fmt: skip
    strength = pairs.strength
    if not replica_jitter.is_zero:
        strength = strength * np.array(
            [
                replica_jitter.factor(pairs.scatterers.scatterer_id, *ray, pairs.scatterers.object)
                for ray in pairs.rays()
            ]
        )
    return ScatteringStrengths(
        np.ascontiguousarray(strength, np.complex64), _NONE, _NONE, _NONE, priority, range_bin, keep_probability
    )


def _receive_beams(receive_points: ReceivePoints, channels: int, ping_geometry: PingGeometry) -> ReceiveBeams:
    """Receive beams, all at the array's centre."""
    number = np.arange(channels)
    return ReceiveBeams(
        receive_points.position, receive_points.velocity, receive_points.acceleration, np.array([[0, channels]]),
        number % ping_geometry.transmit_beams.channel_count, number % ping_geometry.receive_beams.channel_count,
    )  # fmt: skip


def _transmitter(ping_geometry: PingGeometry, beams: Beams, pulse_middle: float) -> Transmitter:
    source_pressure = float(amplitude_ratio(ping_geometry.source_level_db))
    velocity = np.ascontiguousarray(ping_geometry.transmit_velocity)
    return Transmitter(source_pressure, velocity, pulse_middle, 1 / ping_geometry.sound_speed, beams.kernel_tables)


def _receiving_array(
    ping_geometry: PingGeometry, beams: Beams, point: ReceiveBeams, pulse_middle: float, *, has_parallax: bool
) -> ReceivingArray:
    is_rotating = ping_geometry.receive_motion is not None and ping_geometry.receive_motion.is_rotating
    rate, acceleration = (np.zeros((3, 3)),) * 2
    if ping_geometry.receive_motion is not None and is_rotating:
        rate, acceleration = (np.ascontiguousarray(part) for part in ping_geometry.receive_motion.rotation_rates)
    return ReceivingArray(pulse_middle, has_parallax, is_rotating, rate, acceleration, beams.kernel_tables, point)
