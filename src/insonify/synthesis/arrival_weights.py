"""What each arrival weighs in a recording: its amplitude at the source's level, through both beams, on its carrier."""

import numpy as np
from numpy.typing import NDArray

from insonify.records.arrivals import Arrivals
from insonify.sonar.stance import Stance
from insonify.sonar.sub_bands import SubBand
from insonify.synthesis.elements import faced, seen_from
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def beam_gains(arrivals: Arrivals, stance: Stance, channel: int, band: int = 0) -> tuple[Floats, Complexes]:
    """Amplitude of the transmit and of the receive beam towards each arrival [1], each of shape (n,).

    Args:
        arrivals: Paths of one ping as that channel hears them, n of them.
        stance: The sonar at that ping.
        channel: Which pair of beams, or which element: its own response is part of its beam.
        band: Which frequency of the band, where there are several.
    """
    there = stance.bands[band] if stance.bands else SubBand(0.0, stance.transmit_beams, stance.receive_beams)
    middle = 0.0 if stance.still else stance.pulse.pulse.duration / 2
    towards = seen_from(stance, arrivals.arrival, arrivals.delay + middle)
    sent, ears, own = there.transmit_beams.only(channel), there.receive_beams, 1.0 + 0j
    if stance.elements is None:
        ears = ears.only(channel)
    else:
        ears, own = faced(ears, float(stance.elements.facing[channel])), complex(stance.elements.response[channel])
    return sent.gain(arrivals.departure)[0], own * ears.gain(towards)[0]


def arrival_weights(arrivals: Arrivals, stance: Stance, channel: int = 0, band: int = 0) -> Complexes:
    """Complex pressure of each arrival, had the pulse no shape [uPa], shape (n,).

    Args:
        arrivals: Paths of one ping as that channel hears them, n of them.
        stance: The sonar at that ping.
        channel: Which pair of beams, or which element.
        band: Which frequency of the band, where there are several.
    """
    sent, heard = beam_gains(arrivals, stance, channel, band)
    cycles = stance.frequency * arrivals.delay  # float64: there are thousands of them
    carrier = np.exp(-2j * np.pi * (cycles - np.rint(cycles)))
    level = float(amplitude_ratio(stance.source_level_db))
    return np.asarray(level * sent * heard * arrivals.amplitude[:, band] * carrier)
