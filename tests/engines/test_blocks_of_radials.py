"""Radials whose samples are evaluated together do not depend on one another."""

from dataclasses import replace

import numpy as np
import pytest

from engines.test_fast_reverberation import made
from insonify.simulator import build_simulator

RADIALS, COLUMNS = 24, ("radials", "list_rows", "passes_target")


@pytest.mark.parametrize("order", [0, 2])
def test_legs_of_a_radial_are_the_same_alone_and_beside_others(order):
    """All radials of a ping at once, and one by one: delays, directions, pressures and weights to a rounding error."""
    simulator = build_simulator(made(order))
    reverberation = simulator.fast_reverberation(simulator.ping_geometry(0))
    part = reverberation.radial_sets[0]
    several = [slice(0, RADIALS), *(slice(k, k + 1) for k in range(RADIALS))]
    parts = [part._replace(**{name: getattr(part, name)[rows] for name in COLUMNS}) for rows in several]

    def columns(samples):
        counts = list(enumerate(samples.count.tolist()))
        pairs = [samples.cross_section[k, :n].copy() for k, n in counts]
        used = np.unique(np.concatenate([samples.rows[k, :n] for k, n in counts]))
        kept = samples.amplitude[:, used] != 0
        return (np.where(kept, samples.delay[:, used], 0), samples.amplitude[:, used],
                np.where(kept[:, None], samples.departure[:, :, used], 0), pairs)  # fmt: skip

    whole, *alone = replace(reverberation, radial_sets=parts).accumulate(map, columns)
    for k in range(3):
        joined = np.concatenate([one[k] for one in alone], axis=-1)
        np.testing.assert_allclose(whole[k], joined, rtol=1e-6, atol=1e-9)
    for k, weights in enumerate(whole[3]):
        np.testing.assert_allclose(weights, np.concatenate([one[3][k] for one in alone]), rtol=1e-6)
    assert (whole[1] != 0).sum() > 512
