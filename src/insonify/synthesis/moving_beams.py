"""Echoes of one block for beams: under way, or told at several frequencies of the band.

Legs go to the kernel as they are: what becomes of them is worked out there, a stretch of the block at a time.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.records.legs import Legs
from insonify.records.pairs import Pairs, SeparableStrengths
from insonify.sonar.beam import Beams
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._arrival_kernel import ReceiveBeams
from insonify.synthesis._beam_arrivals_kernel import (
    LegColumns,
    ReceivingArray,
    ScatteringStrengths,
    Transmitter,
    WavefrontColumns,
    deposit_block,
)
from insonify.synthesis.direction_grid import NO_DIRECTION_GRID, DirectionGrid
from insonify.synthesis.element_arrivals import (
    ReceivePoints,
    absorption_np_per_m,
    carrier_band,
    has_parallax,
    wavefront_columns,
)
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.synthesis.time_grid import TimeGrid
from insonify.synthesis.waveform_basis import WaveformBasis
from insonify.units import amplitude_ratio

_NONE = np.empty(0)
_NOTHING = np.empty((0, 0), np.float32)


def deposit_beams(
    cells: NDArray[np.complex64], pairs: Pairs, ping_geometry: PingGeometry, grid: TimeGrid,
    replica_jitter: ReplicaJitter,
    basis: WaveformBasis, receive_points: ReceivePoints, water: Water, attenuation: float,
    direction_grid: DirectionGrid | None = None,
) -> None:  # fmt: skip
    """Add the echoes of one block of scatterers to the cells of all beams.

    The strength of a scatterer, its shadows and the beam that insonified it are those of the start of the ping; delay,
    spreading, the pattern that hears it and the Doppler factor are those of the moment when the echo comes.

    Args:
        cells: Grids of pressure, shape (bands, channels, groups, cells, dopplers of a group).
        pairs: Legs out and back of the block, and strengths.
        ping_geometry: The sonar at this ping.
        grid: The grid that the cells belong to.
        replica_jitter: Jitter of replicas.
        basis: Waveforms of which echoes are sums.
        receive_points: Of `receive_points`.
        water: Between sonar and scatterers.
        attenuation: Of `absorption_np_per_m`.
        direction_grid: Rows of which beams are sums; channels are these rows then.
    """
    if not len(pairs.scatterers) or not len(pairs.pair):
        return
    out, back = pairs.out, pairs.back
    away = _ways(out)
    home = away if back is out else _ways(back)
    gradient, fronts = 0.0, WavefrontColumns(np.empty((0, 0)), np.empty((0, 0)), np.empty((0, 0, 0)))
    if water.layered:
        bend, level, gradient, beside = wavefront_columns(pairs, ping_geometry, water)
        fronts = WavefrontColumns(bend, level, beside)
    answers, phase = _answers(pairs, replica_jitter), np.ascontiguousarray(pairs.scatterers.phase)
    middle = 0.0 if ping_geometry.is_static else ping_geometry.pulse.pulse.duration / 2
    fan = direction_grid
    rows, ears = (
        np.ascontiguousarray(pairs.pair),
        _receive_beams(receive_points, cells.shape[1] if fan is None else 1, ping_geometry),
    )
    apart = has_parallax(
        ping_geometry, receive_points, _nearest(back), grid.start + grid.sample_count / grid.sample_rate
    )
    for band, sub_band in enumerate(ping_geometry.sub_bands or (carrier_band(ping_geometry),)):
        taken = 0.0
        if sub_band.offset != 0:
            taken = absorption_np_per_m(water, ping_geometry.frequency + sub_band.offset) - attenuation
        sends, hears = (sub_band.transmit_beams, sub_band.receive_beams) if fan is None else fan.shared_patterns[band]
        listener = _receiving_array(ping_geometry, hears, middle, has_parallax=apart)
        deposit_block(
            cells[band], grid.first_time, grid.cell_rate, rows, away, home, back is out, taken, phase, answers,
            _transmitter(ping_geometry, sends, middle), listener, fronts, ears, 1 / ping_geometry.receive_sound_speed,
            gradient, attenuation,
            water.layered, middle, ping_geometry.frequency, basis.doppler,
            NO_DIRECTION_GRID if fan is None else fan.rows[band],
        )  # fmt: skip


def _ways(legs: Legs) -> LegColumns:
    """Columns of legs for the kernel."""
    boundary, visibility = legs.reflection_coefficient, np.asarray(legs.visibility, complex)
    if legs.caustic is not None:
        boundary = boundary * legs.caustic
    if legs.glints is not None:
        boundary = boundary * legs.glints.phasor
    own = np.ascontiguousarray
    return LegColumns(
        own(legs.delay), own(legs.length), own(legs.spreading), own(legs.absorption), own(boundary), own(visibility),
        own(legs.departure), own(legs.grazing),
    )  # fmt: skip


def _nearest(legs: Legs) -> float:
    """Shortest of some legs [m]; those that are not there may have no length."""
    nearest = float(legs.length.min())  # several times as quick as to look for what is no number
    return nearest if np.isfinite(nearest) else float(np.fmin.reduce(legs.length, axis=None))


def _answers(pairs: Pairs, replica_jitter: ReplicaJitter) -> ScatteringStrengths:
    """What scatterers make of pairs, as kernels want it: products if they are, and replicas are not shaken."""
    answer, number, range_bin, keep_probability = (
        pairs.stored_strengths,
        np.empty(0, np.float32),
        np.empty(0, np.uint8),
        _NOTHING,
    )
    if isinstance(answer, SeparableStrengths) and replica_jitter.is_zero:
        if answer.sampling is not None:
            number, range_bin, keep_probability = (
                answer.sampling.priority,
                answer.sampling.range_bin,
                answer.sampling.keep_probability,
            )
        given = np.empty((0, 0), np.complex64)
        return ScatteringStrengths(
            given, answer.direction_factor, answer.root_area, answer.weight, number, range_bin, keep_probability
        )
    strength = pairs.strength
    if not replica_jitter.is_zero:
        strength = strength * np.array(
            [replica_jitter.factor(pairs.scatterers.scatterer_id, *ray) for ray in pairs.rays()]
        )
    return ScatteringStrengths(
        np.ascontiguousarray(strength, np.complex64), _NONE, _NONE, _NONE, number, range_bin, keep_probability
    )


def _receive_beams(receive_points: ReceivePoints, channels: int, ping_geometry: PingGeometry) -> ReceiveBeams:
    """Who hears: beams all at the array's centre."""
    number = np.arange(channels)
    return ReceiveBeams(
        receive_points.position, receive_points.velocity, receive_points.acceleration, np.array([[0, channels]]),
        number % ping_geometry.transmit_beams.channel_count, number % ping_geometry.receive_beams.channel_count,
    )  # fmt: skip


def _transmitter(ping_geometry: PingGeometry, beams: Beams, pulse_middle: float) -> Transmitter:
    level, velocity = (
        float(amplitude_ratio(ping_geometry.source_level_db)),
        np.ascontiguousarray(ping_geometry.transmit_velocity),
    )
    return Transmitter(level, velocity, pulse_middle, 1 / ping_geometry.sound_speed, beams.kernel_tables)


def _receiving_array(
    ping_geometry: PingGeometry, beams: Beams, pulse_middle: float, *, has_parallax: bool
) -> ReceivingArray:
    turns = ping_geometry.receive_motion is not None and ping_geometry.receive_motion.is_rotating
    rate, bend = (np.zeros((3, 3)),) * 2
    if ping_geometry.receive_motion is not None and turns:
        rate, bend = (np.ascontiguousarray(part) for part in ping_geometry.receive_motion.rotation_rates)
    return ReceivingArray(pulse_middle, has_parallax, turns, rate, bend, beams.kernel_tables)
