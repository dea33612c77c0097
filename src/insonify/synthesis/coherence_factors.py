"""What uneven water leaves of the interference between the paths of one place, in the mean.

Two replicas p and q of a place keep exp(-w^2 var(t_p - t_q) / 2) of the mean of their product, w the carrier and t
their random delays; a pair of legs and its reverse between one place keep all. That matrix K over replicas is L L', so

    E |sum_p A_p|^2 = sum_pq K_pq A_p A_q* = sum_r |sum_p L_pr A_p|^2

and each column of L makes a copy of the block, of fewer and fewer replicas, that interferes as if the water were even.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.delay_field import DelayField
from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry

Floats = NDArray[np.float64]
FAINT = 1e-3
"""Columns of L that nowhere reach this are left out: a millionth of the energy [1]."""
ASKED = 256
"""Points of a block for which L is found, about; the others have that of the one before them [1]."""
FLOOR = 1e-9
"""Added to the diagonal of K, so that replicas that are alike keep it definite [1]."""


def split_by_coherence(pairs: Pairs, field: DelayField | None, ping_geometry: PingGeometry) -> list[Pairs]:
    """A block as blocks whose intensities add, each as if the water were even.

    Args:
        pairs: Of one block; the block itself comes back where the water is even.
        field: Of the water's delays; None: the water is even.
        ping_geometry: The sonar at this ping.
    """
    if field is None or field.inhomogeneity.rms_index == 0 or len(pairs.pair) < 2 or not len(pairs.scatterers):
        return [pairs]
    both = pairs.out is pairs.back
    met = np.sort(pairs.pair, axis=1) if both else pairs.pair
    replicas, which = np.unique(met, axis=0, return_inverse=True)
    which = which.ravel()
    # neighbours follow one another, and share their water
    asked = np.arange(0, len(pairs.scatterers), max(1, len(pairs.scatterers) // ASKED))
    # legs off a moving surface are many, and each part of a block has but a few of them
    if both:
        used, number = np.unique(replicas, return_inverse=True)
        sides, of = [(pairs.out, ping_geometry.transmit_position, used)], number.reshape(replicas.shape)
    else:
        (out, first), (back, second) = (np.unique(column, return_inverse=True) for column in replicas.T)
        sides = [(pairs.out, ping_geometry.transmit_position, out), (pairs.back, ping_geometry.receive_position, back)]
        of = np.column_stack([first.ravel(), second.ravel() + len(out)])
    kept = _kept(of, field.covariance(sides, pairs.scatterers.position, asked), ping_geometry.frequency)
    lower = np.linalg.cholesky(kept + FLOOR * np.eye(len(replicas)))
    lower = np.repeat(lower, np.diff(np.append(asked, len(pairs.scatterers))), axis=0)
    made = []
    for column in range(len(replicas)):
        share = lower[:, column:, column].T  # (replicas from this one on, n)
        if np.abs(share).max() >= FAINT:
            rows = np.flatnonzero(which >= column)
            some = pairs.select(rows)
            made.append(replace(some, stored_strengths=some.strength * share[which[rows] - column]))
    return made


def _kept(replicas: NDArray[np.int64], covariance: Floats, frequency: float) -> Floats:
    """What is left of the product of every two replicas [1], shape (n, replicas, replicas)."""
    taken = np.zeros((len(replicas), covariance.shape[-1]))
    for row, (i, j) in enumerate(replicas):
        taken[row, i] += 1
        taken[row, j] += 1
    together = np.einsum("pa,nab,qb->npq", taken, covariance, taken, optimize=True)
    own = np.einsum("npp->np", together)
    apart = own[:, :, None] + own[:, None, :] - 2 * together
    return np.asarray(np.exp(-2 * (np.pi * frequency) ** 2 * np.maximum(apart, 0)))
