"""Pairs of legs off a moving surface, sorted by what still interferes in the mean.

The phase of a glint is random, so an echo by a glint interferes in the mean only with echoes that have met the same
glints: with its reciprocal, which met them earlier or later and has turned in between as far as the glint's own
frequency goes. The mean over the glints' phases is exact here; that over their frequencies and directions, which
belong together, comes from the many points. It makes E[rho_out rho_back*] = exp(-4 Gamma^2 (1 - rho_eta(dt))) where
beams take in all of the glints, and more where a narrow beam takes in the slow ones only.
"""

import numpy as np

from insonify.records.pairs import Pairs


def coherent_subsets(pairs: Pairs) -> list[Pairs]:
    """The pairs of a block in parts that do not interfere with one another in the mean.

    Args:
        pairs: Pairs whose legs may have met a moving surface.

    Returns:
        Parts whose intensities add; the pairs themselves where nothing is random.
    """
    out, back = pairs.out.glints, pairs.back.glints
    if out is None or back is None:
        return [pairs]
    parts: dict[tuple[int, int], list[int]] = {}
    for row, (i, j) in enumerate(pairs.pair):
        one, other = sorted((out.bounce_id[i], back.bounce_id[j]))
        parts.setdefault((one, other), []).append(row)
    return [pairs.select(np.array(rows)) for rows in parts.values()]
