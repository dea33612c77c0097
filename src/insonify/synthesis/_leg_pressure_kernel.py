"""Kernel for the transmitted pressure at scatterers. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def transmitted_pressure(
    amplitude: NDArray[np.complex128], amplitude_factor: Floats, phase: NDArray[np.complex128], source_pressure: float,
    extra_ratio: Floats, beam_gain: Floats, transmitted: NDArray[np.complex64],
) -> None:  # fmt: skip
    """Pressure at the scatterers by each transmit beam, with the phase of the scatterer.

    Args:
        amplitude: Amplitude of the transmit legs re 1 m [1], (f, n).
        amplitude_factor: Pressure ratio by the transmitter's motion [1], (f, n).
        phase: Phasors of the scatterers [1], (n,).
        source_pressure: Pressure at 1 m [uPa].
        extra_ratio: Further pressure ratio, by absorption at this frequency re the carrier [1], (f, n); (0, 0): 1.
        beam_gain: Amplitude of each beam towards the legs [1], (beams, f, n).
        transmitted: Result [uPa], (beams, f, n).
    """
    has_no_ratio = extra_ratio.size == 0
    for beam in range(beam_gain.shape[0]):
        for f in range(amplitude.shape[0]):
            for n in range(amplitude.shape[1]):
                ratio = 1.0 if has_no_ratio else extra_ratio[f, n]
                factor = source_pressure * amplitude_factor[f, n] * beam_gain[beam, f, n] * ratio
                transmitted[beam, f, n] = amplitude[f, n] * phase[n] * factor
