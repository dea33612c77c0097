"""What lies between edges of a row of samples, of which an edge may cut one in two.

Each sum is made of its own samples: the difference of two running sums would hold a faint echo only to a part in
10^16 of all that was heard before it, and the first echo of a bed is louder than the last one by more than that.
"""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def sums_between_edges(values: Floats, edges: Floats) -> Floats:
    """Sums of samples between edges; a sample that an edge cuts counts by its parts.

    Args:
        values: Samples, shape (..., samples); one that is NaN makes NaN of the sums that it is part of, and no others.
        edges: Counted in samples, growing, shape (cells + 1,): sample k lies from k to k + 1. Those before the first
            sample or after the last are taken to lie there.

    Returns:
        Sums in the unit of the samples, shape (..., cells).
    """
    held = np.concatenate([values, np.zeros((*values.shape[:-1], 1))], axis=-1)
    inside = np.clip(edges, 0, values.shape[-1])
    first = np.asarray(np.floor(inside), int)
    part = inside - first
    whole = np.where(first[:-1] == first[1:], 0.0, np.add.reduceat(held, first, axis=-1)[..., :-1])
    cut = np.where(part > 0, part * held[..., first], 0.0)
    return np.asarray(whole - cut[..., :-1] + cut[..., 1:])
