"""Pairs of legs reflected by a moving surface, sorted by their coherence.

The phase of a glint is random, so an arrival by a glint interferes in the mean only with arrivals by the same
glints: with its reciprocal, reflected by the same glints at another time, whose phase has advanced at the glint's own
frequency. The mean over the glints' phases is exact here; the mean over their frequencies and directions, which
are correlated, is taken over the many points. It makes E[rho_out rho_back*] = exp(-4 Gamma^2 (1 - rho_eta(dt))) where
beams cover all glints, and more where a narrow beam covers slow glints only.
"""

import numpy as np

from insonify.records.pairs import Pairs


def coherent_subsets(pairs: Pairs) -> list[Pairs]:
    """Split the pairs of a block into parts that do not interfere with one another in the mean.

    Args:
        pairs: Pairs with legs that a moving surface may reflect.

    Returns:
        Parts whose intensities add; the pairs themselves where nothing is random.
    """
    transmit_legs, receive_legs = pairs.transmit_legs.glints, pairs.receive_legs.glints
    if transmit_legs is None or receive_legs is None:
        return [pairs]
    parts: dict[tuple[int, int], list[int]] = {}
    for row, (i, j) in enumerate(pairs.pair):
        lower_id, higher_id = sorted((transmit_legs.bounce_id[i], receive_legs.bounce_id[j]))
        parts.setdefault((lower_id, higher_id), []).append(row)
    return [pairs.select(np.array(rows)) for rows in parts.values()]
