"""Reflection coefficients weigh echoes; which scatterers there are, and direct echoes, do not depend on them."""

import numpy as np
import pytest

from insonify.simulation import prepare
from oracles.scenes import nominal

RELIEF = {"relief": {"kind": "power-law", "rms": 0.05, "hurst": 0.8, "outer_scale": 10.0}}


def direct(reflection, seabed):
    """Keys of the scatterers of a ping by nine pairs, and the strength of their direct pair."""
    scenario = nominal(
        seabed={**seabed, "reflection": reflection}, track={"window": (0.05, 0.055)}, line={"length": 0.3},
        paths={"causes": ["seabed"], "reflections": 2},
    )  # fmt: skip
    listening = prepare(scenario)
    here, keys, strengths = listening.stance(0), [], []
    for block in listening.engine.blocks(here):
        pairs = listening.engine.pairs(here, block, drowned=False)
        (row,) = (n for n, (i, j) in enumerate(pairs.pair) if pairs.out.families[i] == pairs.back.families[j] == "D")
        keys.append(pairs.scatterers.place)
        strengths.append(np.asarray(pairs.strength)[row])
    return np.concatenate(keys), np.concatenate(strengths)


@pytest.mark.parametrize("seabed", [{}, RELIEF])
def test_a_bed_that_reflects_less_has_the_same_scatterers_and_direct_echoes(seabed):
    """Reflection 0.35 and 0.1, flat and over relief: bit-identical keys and direct strengths, side lobes included."""
    one, other = (direct(reflection, seabed) for reflection in (0.35, 0.1))
    np.testing.assert_array_equal(one[0], other[0])
    np.testing.assert_array_equal(one[1], other[1])
