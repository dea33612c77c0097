"""Expected intensity from a list of arrivals, as an independent check of the incoherent accumulator."""

import numpy as np
from numpy.typing import NDArray

from insonify.records.arrivals import Arrivals
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis.arrival_weights import arrival_weights

AT_ONCE = 200_000
"""Number of arrivals, or of pairs of them, that are deposited together: their pulses fit in memory."""

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


def spike_power(arrivals: Arrivals, ping_geometry: PingGeometry, time: Floats, channel: int = 0) -> Floats:
    """Expected intensity: |A p|^2 of every arrival, and 2 Re A p A* p* of every two of one group.

    Args:
        arrivals: Paths of one ping, all that are received at those times.
        ping_geometry: The sonar at that ping.
        time: Times in equal steps [s], shape (time,).
        channel: Index of the beam pair, or of the element.

    Returns:
        Intensity at those times [uPa^2], shape (time,).
    """
    order = np.lexsort((arrivals.delay, arrivals.group))
    group, delay = arrivals.group[order], arrivals.delay[order]
    weight = arrival_weights(arrivals, ping_geometry, channel)[order]
    power = np.zeros(len(time))
    _deposit(power, time, ping_geometry, delay, delay, weight * np.conj(weight))
    longest = ping_geometry.pulse.stop - ping_geometry.pulse.start
    for offset in range(1, int(np.bincount(group - group[0]).max())):
        rows = np.flatnonzero((group[offset:] == group[:-offset]) & (delay[offset:] - delay[:-offset] < longest))
        product = 2 * weight[rows] * np.conj(weight[rows + offset])
        _deposit(power, time, ping_geometry, delay[rows], delay[rows + offset], product)
    return power


def _deposit(
    power: Floats, time: Floats, ping_geometry: PingGeometry, first: Floats, second: Floats, product: Complexes
) -> None:
    """Add Re product p(t - first) p*(t - second) to the samples in which both overlap."""
    step = time[1] - time[0]
    samples = np.arange(int(np.ceil((ping_geometry.pulse.stop - ping_geometry.pulse.start) / step)) + 1)
    for start in range(0, len(first), AT_ONCE):
        part = slice(start, start + AT_ONCE)
        row = np.ceil((first[part] + ping_geometry.pulse.start - time[0]) / step).astype(int)[:, None] + samples
        sample_time = time[0] + row * step
        first_pulse = ping_geometry.pulse.samples(sample_time - first[part, None])
        second_pulse = first_pulse
        if second is not first:
            second_pulse = ping_geometry.pulse.samples(sample_time - second[part, None])
        inside = (row >= 0) & (row < len(time))
        power += np.bincount(
            row[inside], (product[part, None] * first_pulse * np.conj(second_pulse)).real[inside], len(time)
        )
