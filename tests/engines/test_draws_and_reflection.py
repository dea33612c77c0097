"""Reflection coefficients weigh echoes; which scatterers there are, and by which paths, does not depend on them."""

import numpy as np
import pytest

from insonify.simulator import build_simulator, simulate
from oracles.scenes import nominal

RELIEF = {"relief": {"kind": "power-law", "rms": 0.05, "hurst": 0.8, "outer_scale": 10.0}}


def direct(reflection, seabed):
    """Keys of the scatterers of a ping by nine pairs, and the strength of their direct pair."""
    scenario = nominal(
        seabed={**seabed, "reflection": reflection}, track={"window": (0.05, 0.055)}, line={"length": 0.3},
        paths={"contributions": ["seabed"], "max_reflections": 2},
    )  # fmt: skip
    simulator = build_simulator(scenario)
    here, keys, strengths = simulator.ping_geometry(0), [], []
    for block in simulator.engine.blocks(here):
        pairs = simulator.engine.pairs(here, block, include_negligible=False)
        (row,) = (
            n
            for n, (i, j) in enumerate(pairs.pair)
            if pairs.transmit_legs.families[i] == pairs.receive_legs.families[j] == "D"
        )
        keys.append(pairs.scatterers.scatterer_id)
        strengths.append(np.asarray(pairs.strength)[row])
    return np.concatenate(keys), np.concatenate(strengths)


@pytest.mark.parametrize("seabed", [{}, RELIEF])
def test_a_bed_that_reflects_less_has_the_same_scatterers_and_direct_echoes(seabed):
    """Reflection 0.35 and 0.1, flat and over relief: bit-identical keys and direct strengths, side lobes included."""
    one, other = (direct(reflection, seabed) for reflection in (0.35, 0.1))
    np.testing.assert_array_equal(one[0], other[0])
    np.testing.assert_array_equal(one[1], other[1])


GENTLE = {"relief": {"kind": "power-law", "rms": 0.01, "hurst": 0.8, "outer_scale": 10.0}}
"""Relief that bottom bounces survive."""
SEAS = {
    "flat": {},
    "1 m/s": {"reflection": "statistical", "wind_speed": 1.0},
    "3 m/s": {"reflection": "statistical", "wind_speed": 3.0},
}


@pytest.mark.parametrize("sea", SEAS)
@pytest.mark.parametrize("seabed", [{}, GENTLE])
def test_pressure_is_a_polynomial_of_the_reflection_coefficient(seabed, sea):
    """Pairs of D, S and BS have 0, 1 or 2 bottom bounces: p = a + R b + R^2 c, to 1e-5 of what bounces.

    Pressures at R = 0.1, 0.35 and 0.9 determine those at 0 and -0.5; scatterers or pairs drawn anew would not fit.
    """

    def pressure(reflection):
        scenario = nominal(
            seabed={**seabed, "reflection": reflection}, track={"window": (0.16, 0.17)}, line={"length": 0.3},
            surface=SEAS[sea], paths={"contributions": ["seabed"], "max_reflections": 2},
        )  # fmt: skip
        return simulate(scenario, threads=1).pressure.values[0, 0].astype(complex)

    known = np.array([0.1, 0.35, 0.9])
    parts = np.linalg.solve(known[:, None] ** np.arange(3), np.array([pressure(reflection) for reflection in known]))
    assert np.linalg.norm(parts[1]) > 1e-2 * np.linalg.norm(parts[0])
    for reflection in (0.0, -0.5):
        off = pressure(reflection) - reflection ** np.arange(3) @ parts
        assert np.linalg.norm(off) < 1e-5 * np.linalg.norm(parts)


def test_the_same_scatterers_have_the_same_pairs():
    """Over relief each pair is evaluated at the same scatterers, and as strong, for R = 0.1, 0.9, -0.5 and 0.35."""

    def strengths(reflection):
        scenario = nominal(
            seabed={**GENTLE, "reflection": reflection}, track={"window": (0.16, 0.17)}, line={"length": 0.3},
            paths={"contributions": ["seabed"], "max_reflections": 4},
        )  # fmt: skip
        simulator = build_simulator(scenario)
        here, found = simulator.ping_geometry(0), {}
        for block in simulator.engine.blocks(here):
            pairs = simulator.engine.pairs(here, block, include_negligible=False)
            for name, row in zip(pairs.names(), np.asarray(pairs.strength), strict=True):
                found.setdefault(name, []).append(row)
        return found

    one = strengths(0.35)
    assert any((np.concatenate(rows) == 0).any() for rows in one.values())
    for reflection in (0.1, 0.9, -0.5):
        other = strengths(reflection)
        assert set(one) == set(other)
        for name, rows in one.items():
            np.testing.assert_array_equal(np.concatenate(rows), np.concatenate(other[name]), str(name))
