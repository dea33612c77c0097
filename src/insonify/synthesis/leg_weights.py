"""Complex weight of a leg in each beam: amplitude of the leg, amplitude of the beam and phase of the carrier."""

import numpy as np
from numpy.typing import NDArray

from insonify.fast_sincos import sincos_cycles
from insonify.jit import njit
from insonify.records.legs import Legs
from insonify.sonar.beam import Beams

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def leg_weights(legs: Legs, beams: Beams, frequency: float, scale: float = 1.0) -> Complexes:
    """Complex weight of every leg in every beam.

    Args:
        legs: Legs between one end and n points, by f families.
        beams: Beams of that end.
        frequency: Carrier [Hz].
        scale: Factor on all weights: 1, or the source's pressure at 1 m [uPa].

    Returns:
        Amplitude times beam amplitude times exp(-j 2 pi frequency delay), shape (beams, f, n).
    """
    return weights_from_gain(beams.gain(legs.departure), legs, frequency, scale)


def weights_from_gain(gain: Floats, legs: Legs, frequency: float, scale: float = 1.0) -> Complexes:
    """Complex weight of every leg, given the gain of every beam.

    Args:
        gain: Amplitude of the beams towards the legs [1], shape (beams, f, n).
        legs: Legs between one end and n points, by f families.
        frequency: Carrier [Hz].
        scale: Factor on all weights.

    Returns:
        Amplitude times gain times exp(-j 2 pi frequency delay), shape (beams, f, n).
    """
    return weights_from_two_gains(gain, gain[:0], legs, frequency, scale)[0]


def weights_from_two_gains(
    transmit_gain: Floats, receive_gain: Floats, legs: Legs, frequency: float, scale: float
) -> tuple[Complexes, Complexes]:
    """Complex weights of legs that serve for transmission and for reception; see `weights_from_gain`.

    Args:
        transmit_gain: Amplitude of the transmit beams towards the legs [1], shape (transmit beams, f, n).
        receive_gain: Amplitude of the receive beams towards the legs [1], shape (receive beams, f, n).
        legs: Legs between one end and n points, by f families.
        frequency: Carrier [Hz].
        scale: Factor on the weights of the transmit beams.

    Returns:
        Weights of the transmit and of the receive beams, shapes of the gains.
    """
    transmit, receive = np.empty(transmit_gain.shape, complex), np.empty(receive_gain.shape, complex)
    _fill_weights(transmit_gain, receive_gain, legs.amplitude, legs.delay, frequency, scale, transmit, receive)
    return transmit, receive


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_weights(
    transmit_gain: Floats, receive_gain: Floats, amplitude: Complexes, delay: Floats, frequency: float, scale: float,
    transmit: Complexes, receive: Complexes,
) -> None:  # fmt: skip
    """Fill the weights; cycles of the carrier are in float64: of thousands, the fraction counts."""
    for f in range(delay.shape[0]):
        for n in range(delay.shape[1]):
            cycles = -frequency * delay[f, n]
            sine, cosine = sincos_cycles(cycles - np.rint(cycles))
            carrier = scale * amplitude[f, n] * complex(cosine, sine)
            for c in range(transmit_gain.shape[0]):
                transmit[c, f, n] = transmit_gain[c, f, n] * carrier
            if receive_gain.shape[0] > 0:
                carrier = amplitude[f, n] * complex(cosine, sine)
            for c in range(receive_gain.shape[0]):
                receive[c, f, n] = receive_gain[c, f, n] * carrier
