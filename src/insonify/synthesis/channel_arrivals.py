"""Arrivals as a channel hears them: when they come to its element, how strong, and how much quicker than when sent.

The numbers are those that the recording is made of, from the same kernels.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.ocean.water import Water
from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis._arrival_time_kernel import arrival_moving, arrival_refracted, arrival_stationary
from insonify.synthesis.element_arrivals import (
    PairEchoes,
    ReceivePoints,
    absorption_np_per_m,
    echo_directions,
    pair_echoes,
    receive_points,
    relative_absorption,
    transmitter_motion,
)

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ChannelBlockArrivals:
    """One channel's hearing of a block of scatterers."""

    pairs: Pairs
    echoes: tuple[PairEchoes, ...]
    """By each ordered pair of legs."""
    ping_geometry: PingGeometry
    ends: ReceivePoints
    channel: int
    """Which element; of beams, any."""
    water: Water
    directions: Floats
    """Directions in which the channel hears them, away from the sonar, shape (pairs, n, 3)."""

    def __call__(self, row: int) -> tuple[Floats, Floats, Floats, Floats]:
        """How the echoes by one ordered pair of legs are heard.

        Args:
            row: Which pair.

        Returns:
            Delay of the pulse's start [s], shape (n,); factor on the pressure in each band [1], shape (n, bands);
            Doppler factor less one [1], shape (n,); directions in which they are heard [1], shape (n, 3).
        """
        i, j = self.pairs.pair[row]
        delay, factor, doppler = arrivals_at_channel(
            self.echoes[row], self.ping_geometry, self.ends, self.channel, self.water
        )
        travelled, carrier = self.pairs.out.length[i] + self.pairs.back.length[j], self.ping_geometry.frequency
        offsets = [band.offset for band in self.ping_geometry.sub_bands] or [0.0]
        bands = [factor * relative_absorption(travelled, offset, carrier, self.water) for offset in offsets]
        return delay, np.stack(bands, axis=1), doppler, self.directions[row]


def channel_arrivals(pairs: Pairs, ping_geometry: PingGeometry, channel: int, water: Water) -> ChannelBlockArrivals:
    """One channel's hearing of a block.

    Args:
        pairs: Legs out and back of the block.
        ping_geometry: The sonar at this ping.
        channel: Which element; of beams, any.
        water: Between sonar and scatterers.
    """
    ends, gone = (
        receive_points(ping_geometry),
        transmitter_motion(pairs.out.departure, pairs.out.length, ping_geometry)[0],
    )
    rows, towards, _ = echo_directions(pairs, ping_geometry, gone, ends)
    mine = towards[channel if len(towards) > 1 else 0][rows]
    return ChannelBlockArrivals(
        pairs, tuple(pair_echoes(pairs, ping_geometry, water)), ping_geometry, ends, channel, water, mine
    )


def arrivals_at_channel(
    echoes: PairEchoes, ping_geometry: PingGeometry, receive_points: ReceivePoints, channel: int, water: Water
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Echoes as one channel hears them: the numbers that its recording is made of.

    Args:
        echoes: By one pair of legs, n of them.
        ping_geometry: The sonar at this ping.
        receive_points: Of `receive_points`.
        channel: Which element; of beams, any.
        water: Between sonar and scatterers.

    Returns:
        Delay of the pulse's start [s], factor on the pressure [1], Doppler factor less one [1], each of shape (n,).
    """
    e = channel if ping_geometry.elements is not None else 0
    n = len(echoes.delay)
    when, doppler, fade = np.empty(n), np.zeros(n), np.empty(n, np.float32)
    motion = receive_points.position[e], receive_points.velocity[e], receive_points.acceleration[e]
    middle = 0.0 if ping_geometry.is_static else ping_geometry.pulse.pulse.duration / 2
    towards, slowness = list(np.ascontiguousarray(echoes.direction.T)), 1 / ping_geometry.receive_sound_speed
    loss = absorption_np_per_m(water, ping_geometry.frequency)
    front, following = echoes.wavefront, 1 / (1 - echoes.transmitter_mach)
    if water.layered:
        arrival_refracted(echoes.delay, front.vertical_curvature, front.horizontal_distance, *towards, following,
                          front.expansion, *motion, slowness,
                    front.sound_speed_gradient, loss, middle, when, fade, doppler)  # fmt: skip
    elif ping_geometry.is_static:
        arrival_stationary(
            echoes.delay, 1 / front.vertical_curvature, *towards, receive_points.position[e], slowness, loss, when, fade
        )
    else:
        arrival_moving(echoes.delay, 1 / front.vertical_curvature, *towards, following, *motion, slowness, loss,
                       middle, when,
                      fade, doppler)  # fmt: skip
    # the kernel tells where an unstretched pulse would start that has the same middle
    return when + middle * doppler / (1 + doppler), np.asarray(fade * echoes.amplitude_factor), doppler
