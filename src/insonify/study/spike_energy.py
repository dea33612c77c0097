"""The energy in a list of arrivals, counted straight from the spikes: a second way to the expected intensity."""

import numpy as np
from numpy.typing import NDArray

from insonify.records.arrivals import Arrivals
from insonify.sonar.stance import Stance
from insonify.study.weights import weights

STEPS = 4096
"""Points of the pulse over which its energy is summed."""

Floats = NDArray[np.float64]


def spike_energy(arrivals: Arrivals, stance: Stance, edges: Floats, channel: int = 0) -> Floats:
    """Expected energy heard in each bin of time: sum of |A|^2 over spikes, and 2 Re A A* over pairs of one group.

    A spike's energy is spread over the bins as its pulse is. The product of two spikes of one group is weighed by
    the pulse's autocorrelation at their lag, and spread as a pulse midway between them.

    Args:
        arrivals: Paths of one ping, all that touch the bins.
        stance: The sonar at that ping.
        edges: Edges of the bins, ascending [s], shape (bins + 1,).
        channel: Which beam.

    Returns:
        Energy in each bin [uPa^2 s], shape (bins,).
    """
    order = np.lexsort((arrivals.delay, arrivals.group))
    group, delay = arrivals.group[order], arrivals.delay[order]
    weight = weights(arrivals, stance, channel)[order]
    step, pulse = _pulse(stance)
    share = np.concatenate([[0.0], np.cumsum(np.abs(pulse) ** 2) * step])
    energy = _binned(delay, np.abs(weight) ** 2, stance.pulse.start, step, share, edges)
    for apart in range(1, int(np.bincount(group - group[0]).max())):
        rows = np.flatnonzero(
            (group[apart:] == group[:-apart]) & (delay[apart:] - delay[:-apart] < len(pulse) * step)
        )
        first, second = delay[rows], delay[rows + apart]
        product = weight[rows] * np.conj(weight[rows + apart]) * _overlap(pulse, second - first, step) / share[-1]
        energy += _binned((first + second) / 2, 2 * product.real, stance.pulse.start, step, share, edges)
    return energy


def _pulse(stance: Stance) -> tuple[float, NDArray[np.complex128]]:
    """Step [s] and samples [1] of the heard pulse."""
    step = (stance.pulse.stop - stance.pulse.start) / STEPS
    return step, stance.pulse.samples(stance.pulse.start + (np.arange(STEPS) + 0.5) * step)


def _overlap(pulse: NDArray[np.complex128], lag: Floats, step: float) -> NDArray[np.complex128]:
    """Integral of p(t - first) p*(t - second) over time [s], for each lag second - first [s]."""
    spectrum = np.fft.fft(pulse, 2 * STEPS)
    whole = np.fft.ifft(np.abs(spectrum) ** 2)[:STEPS] * step
    at = np.arange(STEPS) * step
    return np.asarray(np.interp(lag, at, whole.real) + 1j * np.interp(lag, at, whole.imag))


def _binned(delay: Floats, energy: Floats, start: float, step: float, share: Floats, edges: Floats) -> Floats:
    """Energies that begin to be heard at their delay, handed to the bins as the pulse goes by."""
    at = start + np.arange(len(share)) * step
    passed = [float(np.sum(energy * np.interp(edge - delay, at, share))) for edge in edges]
    return np.diff(passed)
