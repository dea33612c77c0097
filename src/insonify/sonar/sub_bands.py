"""Frequency dependence within the band: a few frequencies at which beams and absorption are evaluated.

At the top of the band a beam is narrower than at its bottom, and absorption is greater. Their effect on an echo is a
smooth function of frequency, represented by the polynomial through its values at Chebyshev nodes across the band that
contains the pulse's energy. Beyond that band the value at its edge is used.

Source: interpolation at Chebyshev nodes, error of exp(j phi x) on -1..1 at most 2 (phi / 2)^n / n!; Trefethen (2013),
Approximation Theory and Approximation Practice, ch. 2, 5 and 8 (not verified).
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.beam import Beams
from insonify.sonar.received_pulse import ReceivedPulse

Floats = NDArray[np.float64]

MAX_OUT_OF_BAND_ENERGY = 1e-4
"""Fraction of the received pulse's energy outside the band that the nodes span [1]."""
_POINTS = 4096
"""Number of frequencies on either side of the carrier at which the pulse's energy is summed."""


@dataclass(frozen=True, slots=True)
class SubBand:
    """The beams at one frequency of the band."""

    offset: float
    """Offset from the carrier [Hz]."""
    transmit_beams: Beams
    receive_beams: Beams


@lru_cache(maxsize=4)  # all pings have the same pulse
def half_bandwidth(pulse: ReceivedPulse) -> float:
    """Half the width of the band about the carrier with all of the pulse but `MAX_OUT_OF_BAND_ENERGY` [Hz]."""
    edge = pulse.receiver.sample_rate / 2
    offset = (np.arange(_POINTS) + 0.5) / _POINTS * edge
    energy = sum(np.abs(pulse.spectrum(sign * offset)) ** 2 for sign in (1, -1))
    cumulative = np.cumsum(energy)
    return float(offset[int(np.searchsorted(cumulative, (1 - MAX_OUT_OF_BAND_ENERGY) * cumulative[-1]))])


def band_nodes(pulse: ReceivedPulse, count: int) -> Floats:
    """Offsets of the nodes from the carrier [Hz], increasing, shape (count,).

    Args:
        pulse: Pulse as received.
        count: Number of nodes; 1: the carrier alone.
    """
    return -half_bandwidth(pulse) * np.cos((np.arange(count) + 0.5) * np.pi / count) if count > 1 else np.zeros(1)


def node_count(phase: float, error: float, max_count: int) -> int:
    """Number of Chebyshev nodes on -1..1 that interpolate exp(j phase x) within an error, at most `max_count`.

    Args:
        phase: Largest phase [rad].
        error: Largest error of the interpolation [1].
        max_count: Largest number.
    """
    count, log_half_phase = 1, math.log(max(phase / 2, 1e-300))
    while count < max_count and math.log(2) + count * log_half_phase - math.lgamma(count + 1) > math.log(error):
        count += 1
    return count


def barycentric_weights(node: Floats) -> Floats:
    """Barycentric weights of Lagrange's polynomials: one over the product of each node's distances from the others.

    Args:
        node: The nodes, none twice, shape (nodes,).
    """
    return np.array([1 / np.prod(node[k] - np.delete(node, k)) for k in range(len(node))])


def lagrange_weights(node: Floats, offset: Floats, low: float = -np.inf, high: float = np.inf) -> Floats:
    """Lagrange's polynomials [1], shape (nodes, n): weights of the values at the nodes in those at other offsets.

    Args:
        node: The nodes, shape (nodes,).
        offset: Frequency offsets of the weights [Hz], shape (n,).
        low: Offset below which the polynomials are constant [Hz].
        high: Offset above which the polynomials are constant [Hz].
    """
    scale = 2.0 ** np.ceil(np.log2(np.abs(node).max() or 1.0))  # products of many frequencies would overflow
    node, x = node / scale, np.clip(offset, low, high) / scale
    rows = [np.prod(x - np.delete(node, k)[:, None], axis=0) for k in range(len(node))]
    return np.asarray(barycentric_weights(node)[:, None] * np.array(rows).reshape(len(node), -1))
