"""Kernel for the transmitted pressure at scatterers. Plain numbers and arrays only."""

import numpy as np
from numpy.typing import NDArray

from insonify.jit import njit

Floats = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def transmitted_pressure(
    amplitude: NDArray[np.complex128], amplitude_factor: Floats, phase: NDArray[np.complex128], source_pressure: float,
    lost: Floats, beams: Floats, transmitted: NDArray[np.complex64],
) -> None:  # fmt: skip
    """Pressure at the scatterers by each transmit beam, with the phase of the scatterer.

    Args:
        amplitude: Amplitude of the transmit legs re 1 m [1], (f, n).
        amplitude_factor: Pressure ratio by the transmitter's motion [1], (f, n).
        phase: Phasors of the scatterers [1], (n,).
        source_pressure: Pressure at 1 m [uPa].
        lost: Further pressure ratio at this frequency [1], (f, n); or (0, 0): 1.
        beams: Gain of each beam along the legs [1], (beams, f, n).
        transmitted: Result [uPa], (beams, f, n).
    """
    no_loss = lost.size == 0
    for beam in range(beams.shape[0]):
        for f in range(amplitude.shape[0]):
            for n in range(amplitude.shape[1]):
                size = source_pressure * amplitude_factor[f, n] * beams[beam, f, n] * (1.0 if no_loss else lost[f, n])
                transmitted[beam, f, n] = amplitude[f, n] * phase[n] * size
