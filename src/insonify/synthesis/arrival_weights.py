"""What each arrival weighs in a recording: its amplitude at the source's level, through both beams, on its carrier."""

import numpy as np
from numpy.typing import NDArray

from insonify.records.arrivals import Arrivals
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.sub_bands import SubBand
from insonify.synthesis.element_arrivals import directions_at_reception, rotated_beams
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def beam_gains(
    arrivals: Arrivals, ping_geometry: PingGeometry, channel: int, band: int = 0
) -> tuple[Floats, Complexes]:
    """Amplitude of the transmit and of the receive beam towards each arrival [1], each of shape (n,).

    Args:
        arrivals: Paths of one ping as that channel hears them, n of them.
        ping_geometry: The sonar at that ping.
        channel: Which pair of beams, or which element: its own response is part of its beam.
        band: Which frequency of the band, where there are several.
    """
    there = (
        ping_geometry.sub_bands[band]
        if ping_geometry.sub_bands
        else SubBand(0.0, ping_geometry.transmit_beams, ping_geometry.receive_beams)
    )
    middle = 0.0 if ping_geometry.is_static else ping_geometry.pulse.pulse.duration / 2
    towards = directions_at_reception(ping_geometry, arrivals.arrival, arrivals.delay + middle)
    sent, ears, own = there.transmit_beams.single_beam(channel), there.receive_beams, 1.0 + 0j
    if ping_geometry.elements is None:
        ears = ears.single_beam(channel)
    else:
        ears, own = (
            rotated_beams(ears, float(ping_geometry.elements.orientations[channel])),
            complex(ping_geometry.elements.response[channel]),
        )
    return sent.gain(arrivals.departure)[0], own * ears.gain(towards)[0]


def arrival_weights(arrivals: Arrivals, ping_geometry: PingGeometry, channel: int = 0, band: int = 0) -> Complexes:
    """Complex pressure of each arrival, had the pulse no shape [uPa], shape (n,).

    Args:
        arrivals: Paths of one ping as that channel hears them, n of them.
        ping_geometry: The sonar at that ping.
        channel: Which pair of beams, or which element.
        band: Which frequency of the band, where there are several.
    """
    sent, heard = beam_gains(arrivals, ping_geometry, channel, band)
    cycles = ping_geometry.frequency * arrivals.delay  # float64: there are thousands of them
    carrier = np.exp(-2j * np.pi * (cycles - np.rint(cycles)))
    level = float(amplitude_ratio(ping_geometry.source_level_db))
    return np.asarray(level * sent * heard * arrivals.amplitude[:, band] * carrier)
