"""Frequency dependence within the band: a few frequencies at which beams and absorption are taken.

A beam is narrower at the top of the band than at its bottom, and water takes more there. What an echo loses is a smooth
function of frequency; here it is the polynomial through its values at Chebyshev's nodes across the band that holds the
pulse's energy. Beyond that band the polynomial stays as it is at the edge.

Source: interpolation at Chebyshev nodes, error of exp(j phi x) on -1..1 at most 2 (phi / 2)^n / n!; Trefethen (2013),
Approximation Theory and Approximation Practice, ch. 2, 5 and 8 (from memory).
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.beam import Beams
from insonify.sonar.received_pulse import ReceivedPulse

Floats = NDArray[np.float64]

ENERGY = 1e-4
"""Share of the received pulse's energy that may lie outside the band that the nodes span [1]."""
_POINTS = 4096


@dataclass(frozen=True, slots=True)
class SubBand:
    """The beams at one frequency of the band."""

    offset: float
    """Offset from the carrier [Hz]."""
    transmit_beams: Beams
    receive_beams: Beams


@lru_cache(maxsize=4)  # one pulse is received in all pings
def half_bandwidth(pulse: ReceivedPulse) -> float:
    """Half the width about the carrier that holds the received pulse's energy, but for `ENERGY` of it [Hz]."""
    edge = pulse.receiver.sample_rate / 2
    offset = (np.arange(_POINTS) + 0.5) / _POINTS * edge
    energy = sum(np.abs(pulse.spectrum(sign * offset)) ** 2 for sign in (1, -1))
    held = np.cumsum(energy)
    return float(offset[int(np.searchsorted(held, (1 - ENERGY) * held[-1]))])


def band_nodes(pulse: ReceivedPulse, count: int) -> Floats:
    """Offsets from the carrier of the nodes [Hz], increasing, shape (count,).

    Args:
        pulse: Pulse as received.
        count: Number of nodes; one is the carrier.
    """
    return -half_bandwidth(pulse) * np.cos((np.arange(count) + 0.5) * np.pi / count) if count > 1 else np.zeros(1)


def node_count(phase: float, error: float, most: int) -> int:
    """Number of Chebyshev nodes on -1..1 for exp(j phase x); `most` where that is not enough.

    Args:
        phase: Largest phase [rad].
        error: Largest error of the interpolation [1].
        most: Largest number.
    """
    count, half = 1, math.log(max(phase / 2, 1e-300))
    while count < most and math.log(2) + count * half - math.lgamma(count + 1) > math.log(error):
        count += 1
    return count


def barycentric_weights(node: Floats) -> Floats:
    """One over the product of each node's distances from the others: Lagrange's polynomials, shape (nodes,).

    Args:
        node: The nodes, none twice, shape (nodes,).
    """
    return np.array([1 / np.prod(node[k] - np.delete(node, k)) for k in range(len(node))])


def lagrange_weights(node: Floats, offset: Floats, low: float = -np.inf, high: float = np.inf) -> Floats:
    """Weight of the value at each node elsewhere: Lagrange's polynomials [1], shape (nodes, n).

    Args:
        node: The nodes, shape (nodes,).
        offset: Frequency offsets of the weights [Hz], shape (n,).
        low: Offset below which the polynomials stay as they are there [Hz].
        high: Offset above which the polynomials stay as they are there [Hz].
    """
    scale = 2.0 ** np.ceil(np.log2(np.abs(node).max() or 1.0))  # products of many frequencies would overflow
    node, x = node / scale, np.clip(offset, low, high) / scale
    rows = [np.prod(x - np.delete(node, k)[:, None], axis=0) for k in range(len(node))]
    return np.asarray(barycentric_weights(node)[:, None] * np.array(rows).reshape(len(node), -1))
