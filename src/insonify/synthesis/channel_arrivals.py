"""Arrivals at one receive channel: delay at its element, strength and Doppler factor.

The numbers come from the kernels that make the recording.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water, absorption_np_per_m
from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._arrival_time_kernel import ArrayWater, ArrivalColumns, arrival_times
from insonify.synthesis.element_arrivals import (
    PairEchoes,
    ReceivePoints,
    echo_directions,
    pair_echoes,
    receive_points,
    transmitter_motion,
)

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ChannelBlockArrivals:
    """Arrivals of a block of scatterers at one receive channel."""

    pairs: Pairs
    """Pairs of legs of the block."""
    echoes: tuple[PairEchoes, ...]
    """Echoes of each ordered pair of legs."""
    ping_geometry: PingGeometry
    receive_points: ReceivePoints
    """Receiver channels as points."""
    channel: int
    """Index of the element; a beam receives at the array's centre whatever the index."""
    water: Water
    directions: Floats
    """Unit vectors from the channel towards the arriving sound [1], shape (pairs, n, 3)."""

    def __call__(self, row: int) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """Arrivals of one ordered pair of legs at the channel.

        Args:
            row: Row of the pair.

        Returns:
            Delay of the pulse's start [s], shape (n,).
            Factor on the pressure [1], shape (n,).
            Pressure ratio by absorption in each band re the centre frequency [1], shape (n, bands).
            Doppler factor less one [1], shape (n,).
            Unit vectors towards the arriving sound [1], shape (n, 3).
        """
        i, j = self.pairs.pair[row]
        delay, factor, doppler = arrivals_at_channel(
            self.echoes[row], self.ping_geometry, self.receive_points, self.channel, self.water
        )
        path_length = self.pairs.transmit_legs.length[i] + self.pairs.receive_legs.length[j]
        carrier = self.ping_geometry.frequency
        offsets = [band.offset for band in self.ping_geometry.interpolated_bands] or [0.0]
        bands = [self.water.relative_absorption(path_length, offset, carrier) for offset in offsets]
        return delay, factor, np.stack(bands, axis=1), doppler, self.directions[row]


def channel_arrivals(pairs: Pairs, ping_geometry: PingGeometry, channel: int, water: Water) -> ChannelBlockArrivals:
    """Arrivals of a block at one receive channel.

    Args:
        pairs: Transmit and receive legs of the block.
        ping_geometry: The sonar at this ping.
        channel: Index of the element; of beams, any.
        water: Water between sonar and scatterers.
    """
    points = receive_points(ping_geometry)
    emission_delay = transmitter_motion(pairs.transmit_legs.departure, pairs.transmit_legs.length, ping_geometry)[0]
    rows, direction, _ = echo_directions(pairs, ping_geometry, emission_delay, points)
    channel_direction = direction[channel if len(direction) > 1 else 0][rows]
    return ChannelBlockArrivals(
        pairs, tuple(pair_echoes(pairs, ping_geometry, water)), ping_geometry, points, channel, water, channel_direction
    )


def arrivals_at_channel(
    echoes: PairEchoes, ping_geometry: PingGeometry, receive_points: ReceivePoints, channel: int, water: Water
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Delays, pressure factors and Doppler factors of echoes at one channel, as used for its recording.

    Args:
        echoes: Echoes of one pair of legs, n of them.
        ping_geometry: The sonar at this ping.
        receive_points: Receiver channels as points, from `receive_points`.
        channel: Index of the element; of beams, any.
        water: Water between sonar and scatterers.

    Returns:
        Delay of the pulse's start [s], factor on the pressure [1], Doppler factor less one [1], each of shape (n,).
    """
    element = channel if ping_geometry.elements is not None else 0
    n = len(echoes.delay)
    delay, doppler, factor = np.empty(n), np.zeros(n), np.empty(n, np.float32)
    pulse_middle = 0.0 if ping_geometry.is_static else ping_geometry.pulse.pulse.duration / 2
    (north, east, down), slowness = np.ascontiguousarray(echoes.direction.T), 1 / ping_geometry.receive_sound_speed
    attenuation = absorption_np_per_m(water, ping_geometry.frequency)
    wavefront, emission_rate = echoes.wavefront, 1 / (1 - echoes.transmitter_mach)
    columns = ArrivalColumns(
        echoes.delay, wavefront.vertical_curvature, 1 / wavefront.vertical_curvature, wavefront.horizontal_distance,
        north, east, down, emission_rate, wavefront.expansion,
    )  # fmt: skip
    array_water = ArrayWater(slowness, wavefront.sound_speed_gradient, attenuation, water.layered, pulse_middle)
    arrival_times(columns, n, receive_points.motion(element), array_water, delay, factor, doppler)
    # the kernel returns the start of an unstretched pulse with the same middle
    return delay + pulse_middle * doppler / (1 + doppler), np.asarray(factor * echoes.amplitude_factor), doppler
