"""What each arrival weighs in a recording: its amplitude at the source's level, through both beams, on its carrier."""

import numpy as np
from numpy.typing import NDArray

from insonify.records.arrivals import Arrivals
from insonify.sonar.stance import Stance
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]


def beam_gains(arrivals: Arrivals, stance: Stance, channel: int) -> tuple[Floats, Floats]:
    """Amplitude of the transmit and of the receive beam towards each arrival [1], each of shape (n,).

    Args:
        arrivals: Paths of one ping, n of them.
        stance: The sonar at that ping.
        channel: Which pair of beams.
    """
    sent = stance.transmit_beams.only(channel).gain(arrivals.departure)
    heard = stance.receive_beams.only(channel).gain(arrivals.arrival)
    return sent[0], heard[0]


def arrival_weights(arrivals: Arrivals, stance: Stance, channel: int = 0) -> NDArray[np.complex128]:
    """Complex pressure of each arrival, had the pulse no shape [uPa], shape (n,).

    Args:
        arrivals: Paths of one ping, n of them.
        stance: The sonar at that ping.
        channel: Which pair of beams.
    """
    sent, heard = beam_gains(arrivals, stance, channel)
    cycles = stance.frequency * arrivals.delay  # float64: there are thousands of them
    carrier = np.exp(-2j * np.pi * (cycles - np.rint(cycles)))
    level = float(amplitude_ratio(stance.source_level_db))
    return np.asarray(level * sent * heard * arrivals.amplitude[:, 0] * carrier)
