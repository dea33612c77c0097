"""Claims about what an array can steer apart in height, and what that makes of pairs that others mask."""

import numpy as np
import pytest

from insonify.engines.pair_importance import _elevation_cells
from insonify.simulator import build_simulator, simulate
from oracles.scenes import nominal

ROUGH = {"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}
WAVE = 0.015
"""Wavelength [m]: 100 kHz at 1500 m/s."""


def scenario_with(places, bearing=0.0, **changes):
    """The nominal sonar over rough ground with elements ahead, to the right of and below its middle [m]."""
    receive = {"kind": "elements", "positions": [tuple(map(float, place)) for place in places], "length": None}
    sonar = {"receiver": {"record": "elements"}, "mounting": {"bearing": bearing}}
    return nominal(receive=receive, sonar=sonar, seabed=ROUGH, **changes)


def ping_geometry(places, bearing=0.0):
    """That sonar at its first ping."""
    return build_simulator(scenario_with(places, bearing)).ping_geometry(0)


def occlude_by_terrain(places):
    """The same, with a window that receives the seabed at 150 m, by legs of up to two bounces."""
    return scenario_with(
        places, track={"window": (0.2, 0.206)}, paths={"max_reflections": 2, "scatterers_per_cell": 1.0}
    )  # fmt: skip


def line(direction, length, count):
    """Elements along a direction."""
    return np.linspace(-length / 2, length / 2, count)[:, None] * np.asarray(direction, float)


@pytest.mark.parametrize("bearing", [0.0, 1.0, -2.5])
def test_a_level_array_abeam_resolves_no_elevations(bearing):
    """All legs from one position abeam come from one bearing: 32 elements along 1 m receive them alike."""
    assert _elevation_cells(ping_geometry(line([0, 1, 0], 1.0, 32), bearing=bearing)) == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("length", [0.03, 0.12, 0.3])
def test_an_upright_array_has_a_beam_for_each_half_wavelength(length):
    """Between up and down fit 1 + 2 L / wavelength beams."""
    assert _elevation_cells(ping_geometry(line([0, 0, 1], length, 64))) == pytest.approx(
        1 + 2 * length / WAVE, rel=1e-3
    )


def test_no_more_beams_than_elements():
    """Three elements that are a metre apart in height resolve three directions at most."""
    assert _elevation_cells(ping_geometry(line([0, 0, 1], 2.0, 3))) == 3


def test_an_array_along_the_boresight_resolves_elevations_too():
    """Rays that climb differently pass it at different pace: it counts by its length, whatever the bearing."""
    for bearing in (0.0, 0.7):
        found = _elevation_cells(ping_geometry(line([1, 0, 0], 0.3, 64), bearing=bearing))
        assert found == pytest.approx(1 + 2 * 0.3 / WAVE, rel=1e-3)


def test_beams_resolve_one_elevation():
    """A beam has been steered already."""
    assert _elevation_cells(build_simulator(nominal(seabed=ROUGH)).ping_geometry(0)) == 1.0


def evaluate(places):
    """Part of the seabed's scatterers at which each kind of leg is followed, by family."""
    simulator, found = build_simulator(occlude_by_terrain(places)), {}
    here = simulator.ping_geometry(0)
    for block in simulator.engine.blocks(here):
        if block().boundary != "seabed":
            continue
        pairs = simulator.engine.pairs(here, block, include_negligible=False)
        for row, family in enumerate(pairs.transmit_legs.families):
            found.setdefault(family, []).append(pairs.transmit_legs.amplitude[row] != 0)
    return {family: float(np.concatenate(there).mean()) for family, there in found.items()}


def test_an_upright_array_follows_legs_that_a_level_one_leaves_out():
    """Legs off the bottom are evaluated at several times as many positions where the array could steer to them."""
    level, upright = evaluate(line([0, 1, 0], 0.2, 16)), evaluate(line([0, 0, 1], 0.2, 16))
    assert level["D"] == pytest.approx(upright["D"], abs=0.05)
    assert upright["BS"] > 2 * level["BS"] > 0


def test_what_is_evaluated_more_often_is_the_same_in_the_mean():
    """Both arrays receive the same ground: powers within 1 dB over 6 ms, some 30 cells of 16 elements."""
    power = [
        np.mean(np.abs(simulate(occlude_by_terrain(line(direction, 0.02, 16)), threads=1).pressure.values[0]) ** 2)
        for direction in ([0, 1, 0], [0, 0, 1])
    ]
    assert 10 * np.log10(power[0] / power[1]) == pytest.approx(0, abs=1.0)
