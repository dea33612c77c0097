"""Sums of samples between edges, which may cut samples in two.

Each sum is formed from its own samples: the difference of two cumulative sums would resolve a weak echo only to 1e-16
of all power before it, and the first bottom return is stronger than the last echo by more than that.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def sums_between_edges(values: Floats, edges: Floats) -> Floats:
    """Sums of samples between edges; a sample cut by an edge counts in proportion.

    Args:
        values: Samples, shape (..., samples); a NaN sample makes NaN of the sums that contain it, and no others.
        edges: Increasing edges in units of samples, shape (cells + 1,): sample k extends from k to k + 1. Those before
                the first sample or after the last are moved there.

    Returns:
        Sums in the unit of the samples, shape (..., cells).
    """
    padded = np.concatenate([values, np.zeros((*values.shape[:-1], 1))], axis=-1)
    inside = np.clip(edges, 0, values.shape[-1])
    first = np.asarray(np.floor(inside), int)
    fraction = inside - first
    complete = np.where(first[:-1] == first[1:], 0.0, np.add.reduceat(padded, first, axis=-1)[..., :-1])
    divided = np.where(fraction > 0, fraction * padded[..., first], 0.0)
    return np.asarray(complete - divided[..., :-1] + divided[..., 1:])
