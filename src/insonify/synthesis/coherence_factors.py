"""Mean coherence between the paths of one scatterer in inhomogeneous water.

Two replicas p and q of a scatterer keep exp(-w^2 var(t_p - t_q) / 2) of the mean of their product, w the carrier and t
their random delays; a pair of legs and its reverse keep all of it. That matrix K over replicas is L L', so

    E |sum_p A_p|^2 = sum_pq K_pq A_p A_q* = sum_r |sum_p L_pr A_p|^2

and each column of L makes a copy of the block, of fewer and fewer replicas, that interferes as in homogeneous water.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.delay_field import DelayField
from insonify.records.legs import Legs
from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
NEGLIGIBLE = 1e-3
"""Magnitude of elements of L below which they are left out, if so at all points: a millionth of the energy [1]."""
SAMPLE_POINTS = 256
"""Approximate number of points of a block at which L is evaluated; other points take it from the preceding one."""
DIAGONAL_LOADING = 1e-9
"""Added to the diagonal of K, so that equal replicas keep it positive definite [1]."""


def split_by_coherence(
    parts: Sequence[Pairs], field: DelayField | None, ping_geometry: PingGeometry
) -> Iterator[Pairs]:  # fmt: skip
    """Split a block into copies whose intensities add, each with interference as in homogeneous water.

    Args:
        parts: Parts of one block, with the same legs, that do not interfere; unchanged where the water is homogeneous.
        field: Random delays in the water; None: homogeneous water.
        ping_geometry: The sonar at this ping.
    """
    if field is None or field.inhomogeneity.rms_index == 0 or not len(parts[0].scatterers):
        yield from parts
        return
    factors: _CoherenceFactors | None = None  # a moving surface makes many parts, of few different pairs of families
    for pairs in parts:
        if len(pairs.pair) < 2:
            yield pairs
            continue
        factors = factors or _CoherenceFactors(pairs, field, ping_geometry)
        yield from factors.copies(pairs)


class _CoherenceFactors:
    """Factors L of the parts of one block: one factor for all parts with the same pairs of families."""

    def __init__(self, pairs: Pairs, field: DelayField, ping_geometry: PingGeometry) -> None:
        """Evaluate the covariance of the delays of all families of a block.

        Args:
            pairs: Some of the pairs of the block.
            field: Random delays in the water.
            ping_geometry: The sonar at this ping.
        """
        self.frequency, self.is_monostatic = ping_geometry.frequency, pairs.transmit_legs is pairs.receive_legs
        count = len(pairs.scatterers)
        # consecutive points are neighbours and share the water
        self.sample_points = np.arange(0, count, max(1, count // SAMPLE_POINTS))
        self.represented = np.diff(np.append(self.sample_points, count))
        # legs of one family share their random delay, as do the two orders of a pair
        transmit_end = pairs.transmit_legs, ping_geometry.transmit_position
        ends = [transmit_end, (pairs.receive_legs, ping_geometry.receive_position)]
        sides, self.family_rows = list[tuple[Legs, Floats, Integers]](), list[Integers]()
        for legs, position in ends[:1] if self.is_monostatic else ends:
            first = np.array([legs.families.index(name) for name in legs.families])
            rows, number = np.unique(first, return_inverse=True)
            self.family_rows.append(number + sum(len(others) for _, _, others in sides))
            sides.append((legs, position, rows))
        self.covariance = field.covariance(sides, pairs.scatterers.position, self.sample_points)
        self.factors = dict[bytes, Floats]()

    def copies(self, pairs: Pairs) -> Iterator[Pairs]:
        """Yield the copies of one part, one for each column of L that is not negligible, see the module."""
        families = np.column_stack([self.family_rows[0][pairs.pair[:, 0]], self.family_rows[-1][pairs.pair[:, 1]]])
        families = np.sort(families, axis=1) if self.is_monostatic else families
        count = self.covariance.shape[-1]
        number, replica_row = np.unique(families @ [count, 1], return_inverse=True)
        replicas = np.column_stack([number // count, number % count])
        key = replicas.tobytes()
        if key not in self.factors:
            self.factors[key] = self._factor(replicas)
        lower = self.factors[key]
        for column in range(len(replicas)):
            factor = lower[:, :, column].T  # (replicas, sampled points)
            rows = np.flatnonzero((np.abs(factor).max(axis=1) >= NEGLIGIBLE)[replica_row])
            if len(rows):
                subset, factors = pairs.select(rows), np.repeat(factor[replica_row[rows]], self.represented, axis=1)
                yield replace(subset, stored_strengths=subset.strength * factors)

    def _factor(self, replicas: Integers) -> Floats:
        """Factor L of some replicas at the sampled points [1], shape (m, replicas, replicas)."""
        legs, replica_legs = np.unique(replicas, return_inverse=True)
        covariance = np.ascontiguousarray(self.covariance[:, legs[:, None], legs])
        coherence = _mean_products(replica_legs.reshape(replicas.shape), covariance, self.frequency)
        return np.asarray(np.linalg.cholesky(coherence + DIAGONAL_LOADING * np.eye(len(replicas))))


def _mean_products(replicas: Integers, covariance: Floats, frequency: float) -> Floats:
    """Mean product of every two replicas, re that without random delays [1], shape (n, replicas, replicas)."""
    leg_count = np.zeros((len(replicas), covariance.shape[-1]))
    for row, (i, j) in enumerate(replicas):
        leg_count[row, i] += 1
        leg_count[row, j] += 1
    covariances = np.einsum("pa,nab,qb->npq", leg_count, covariance, leg_count, optimize=True)
    variances = np.einsum("npp->np", covariances)
    difference_variance = variances[:, :, None] + variances[:, None, :] - 2 * covariances
    return np.asarray(np.exp(-2 * (np.pi * frequency) ** 2 * np.maximum(difference_variance, 0)))
