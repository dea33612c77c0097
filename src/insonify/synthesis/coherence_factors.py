"""Mean coherence between the paths of one scatterer in inhomogeneous water.

Two replicas p and q of a scatterer keep exp(-w^2 var(t_p - t_q) / 2) of the mean of their product, w the carrier and t
their random delays; a pair of legs and its reverse keep all of it. That matrix K over replicas is L L', so

    E |sum_p A_p|^2 = sum_pq K_pq A_p A_q* = sum_r |sum_p L_pr A_p|^2

and each column of L makes a copy of the block, of fewer and fewer replicas, that interferes as in homogeneous water.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.delay_field import DelayField
from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]
NEGLIGIBLE = 1e-3
"""Elements of L below this at all points are left out: a millionth of the energy [1]."""
SAMPLE_POINTS = 256
"""Points of a block at which L is evaluated, about; the others take it from the point before them [1]."""
DIAGONAL_LOADING = 1e-9
"""Added to the diagonal of K, so that equal replicas keep it positive definite [1]."""


def split_by_coherence(pairs: Pairs, field: DelayField | None, ping_geometry: PingGeometry) -> Iterator[Pairs]:
    """Yield blocks that a block is split into, whose intensities add, each as if the water were homogeneous.

    Args:
        pairs: Pairs of one block; returned as they are where the water is homogeneous.
        field: Random delays in the water; None: homogeneous water.
        ping_geometry: The sonar at this ping.
    """
    if field is None or field.inhomogeneity.rms_index == 0 or len(pairs.pair) < 2 or not len(pairs.scatterers):
        yield pairs
        return
    monostatic = pairs.out is pairs.back
    # legs of one family share their random delay, as do the two orders of a pair
    family_rows = [np.array([legs.families.index(name) for name in legs.families]) for legs in (pairs.out, pairs.back)]
    family_pairs = np.column_stack([rows[legs] for rows, legs in zip(family_rows, pairs.pair.T, strict=True)])
    sorted_pairs = np.sort(family_pairs, axis=1) if monostatic else family_pairs
    replicas, replica_row = np.unique(sorted_pairs, axis=0, return_inverse=True)
    replica_row = replica_row.ravel()
    # consecutive points are neighbours and share the water
    sample_points = np.arange(0, len(pairs.scatterers), max(1, len(pairs.scatterers) // SAMPLE_POINTS))
    # a moving surface makes many legs, of which each part of a block has few
    if monostatic:
        legs, leg_index = np.unique(replicas, return_inverse=True)
        sides, replica_legs = [(pairs.out, ping_geometry.transmit_position, legs)], leg_index.reshape(replicas.shape)
    else:
        (out, first), (back, second) = (np.unique(column, return_inverse=True) for column in replicas.T)
        sides = [(pairs.out, ping_geometry.transmit_position, out), (pairs.back, ping_geometry.receive_position, back)]
        replica_legs = np.column_stack([first.ravel(), second.ravel() + len(out)])
    coherence = _mean_products(
        replica_legs, field.covariance(sides, pairs.scatterers.position, sample_points), ping_geometry.frequency
    )
    lower = np.linalg.cholesky(coherence + DIAGONAL_LOADING * np.eye(len(replicas)))
    represented = np.diff(np.append(sample_points, len(pairs.scatterers)))
    for column in range(len(replicas)):
        factor = lower[:, :, column].T  # (replicas, sampled points)
        rows = np.flatnonzero((np.abs(factor).max(axis=1) >= NEGLIGIBLE)[replica_row])
        if len(rows):
            subset, factors = pairs.select(rows), np.repeat(factor[replica_row[rows]], represented, axis=1)
            yield replace(subset, stored_strengths=subset.strength * factors)


def _mean_products(replicas: NDArray[np.int64], covariance: Floats, frequency: float) -> Floats:
    """Mean product of every two replicas, re that without random delays [1], shape (n, replicas, replicas)."""
    leg_count = np.zeros((len(replicas), covariance.shape[-1]))
    for row, (i, j) in enumerate(replicas):
        leg_count[row, i] += 1
        leg_count[row, j] += 1
    covariances = np.einsum("pa,nab,qb->npq", leg_count, covariance, leg_count, optimize=True)
    variances = np.einsum("npp->np", covariances)
    difference_variance = variances[:, :, None] + variances[:, None, :] - 2 * covariances
    return np.asarray(np.exp(-2 * (np.pi * frequency) ** 2 * np.maximum(difference_variance, 0)))
