"""Energy received over time from all pairs of legs, by the sonar equation, against which a weak pair is negligible."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

NEGLIGIBLE = 3e-5
"""Fraction of the energy received at any time that a pair may lack altogether [1]."""
TIME_SAMPLES = 1024
"""Times at which the whole level is computed."""


def arrived_energy(arrival_time: Floats, energy: Floats) -> Floats:
    """Energy of all pairs that has arrived by some times.

    Args:
        arrival_time: Delays of each pair from the edges of the range bins [s], (p, b + 1).
        energy: Energy of each pair from each range bin, (p, b).

    Returns:
        At each of these delays, (p, b + 1).
    """
    time = np.linspace(arrival_time.min(), arrival_time.max(), TIME_SAMPLES)
    arrived = np.zeros(TIME_SAMPLES)
    for own, part in zip(arrival_time, energy, strict=True):
        arrived += np.interp(time, own, np.append(0.0, np.cumsum(part)))
    return np.asarray(np.interp(arrival_time, time, arrived))
