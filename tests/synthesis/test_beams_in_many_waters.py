"""Claims about moving beams where rays bend, bands are distinguished and replicas are shaken.

One sound, given twice.
"""

from dataclasses import replace

import numpy as np
import pytest

from insonify.records.pairs import SeparableStrengths
from insonify.simulator import build_simulator, simulate_pings
from oracles.scenes import nominal, point
from synthesis.oracle import relative_rms

TRACK = {
    "kind": "line", "start": (0, 0, 11.0), "speed": 2.0, "pings": 1, "interval": 0.1, "stop_and_hop": False,
    "window": (0.08, 0.083),
}  # fmt: skip
THERMOCLINE = {"profile": [[0, 1520], [8, 1518], [12, 1495], [20, 1490]], "smoothing": 1.0, "noise_level_db": None}
WATERS = {
    "even": {},
    "layered": {"water": THERMOCLINE},
    "bands": {"sonar": {"receiver": {"bandwidth": 20e3, "sub_bands": 3}}},
    "shaken": {"paths": {"jitter": 0.3, "amplitude_perturbation": 0.2}},
}


def under_way(*, track=None, paths=None, **more):
    """A bed at 60 m from a moving sonar: its reading, and the largest block of pairs."""
    scenario = nominal(paths={"max_reflections": 1, "scatterers_per_cell": 2.0, **(paths or {})}, **more)
    settings = {**scenario.model_dump(), "track": {**TRACK, **(track or {})}}
    simulator = build_simulator(type(scenario)(**settings))
    here = simulator.ping_geometry(0)
    blocks = [simulator.engine.pairs(here, block, include_negligible=False) for block in simulator.engine.blocks(here)]
    return simulator.coherent_accumulator(here), max(blocks, key=lambda pairs: len(pairs.scatterers))


def received(reading, *blocks):
    """Cells of some pairs of legs."""
    cells = reading.empty()
    for pairs in blocks:
        reading.add(cells, pairs)
    return cells


@pytest.fixture(params=list(WATERS))
def world(request):
    """A reading and a block of it."""
    return under_way(**WATERS[request.param])


def test_strengths_may_be_written_out_first(world):
    """Products, or the strengths that they come to: the same cells, to 2e-6 of their rms."""
    reading, pairs = world
    assert isinstance(pairs.stored_strengths, SeparableStrengths) and len(pairs.pair) > 1
    whole = received(reading, pairs)
    assert relative_rms(received(reading, replace(pairs, stored_strengths=pairs.strength)), whole) < 2e-6


def test_pairs_add_up(world):
    """Each ordered pair by itself, in turn: the sum is what all of them are, to 2e-6."""
    reading, pairs = world
    alone = [pairs.select(np.array([row])) for row in range(len(pairs.pair))]
    assert relative_rms(sum(received(reading, one) for one in alone), received(reading, pairs)) < 2e-6


def test_what_a_caustic_turns_is_turned(world):
    """A quarter turn given as a caustic of each leg, or of its mirrors: the same; both legs by one make a half turn."""
    reading, pairs = world
    quarter = 1j * np.ones_like(pairs.transmit_legs.reflection_coefficient)
    out = pairs.transmit_legs.caustic if pairs.transmit_legs.caustic is not None else 1
    turned, mirrored = (
        replace(pairs, transmit_legs=legs, receive_legs=legs)
        if pairs.receive_legs is pairs.transmit_legs
        else replace(pairs, transmit_legs=legs)
        for legs in (
            replace(pairs.transmit_legs, caustic=quarter * out),
            replace(pairs.transmit_legs, reflection_coefficient=quarter * pairs.transmit_legs.reflection_coefficient),
        )
    )
    assert relative_rms(received(reading, turned), received(reading, mirrored)) < 1e-6
    if pairs.receive_legs is pairs.transmit_legs:
        assert relative_rms(received(reading, turned), -received(reading, pairs)) < 1e-6


def test_a_leg_may_be_given_twice(world):
    """The legs back as a copy of those out: the same cells to 1e-6."""
    reading, pairs = world
    assert (
        relative_rms(
            received(reading, replace(pairs, receive_legs=replace(pairs.receive_legs))), received(reading, pairs)
        )
        < 1e-6
    )


@pytest.mark.parametrize("water", ["even", "layered"])
def test_a_sonar_at_no_speed_is_one_that_hops(water):
    """Moving at a millionth of a metre per second, or from ping to ping: 2e-4 of a buoy's echo and the bed's."""
    more = {**WATERS[water], "targets": [point(0.0, 60.0, 15.0)]}
    slow, hops = (under_way(track=track, **more) for track in ({"speed": 1e-6}, {"speed": 1e-6, "stop_and_hop": True}))
    series = [reading.time_series(received(reading, pairs)) for reading, pairs in (slow, hops)]
    assert relative_rms(series[0], series[1]) < 2e-4


@pytest.mark.parametrize("record", ["beams", "elements"])
def test_thinned_pings_of_a_moving_sonar_have_bits_of_their_own(record):
    """Rough ground, two pings, received by two threads the other way round, or one alone: the same bits."""
    line = {"length": 0.06, "elements": 8, "element": "baffled"}
    scenario = nominal(
        seabed={"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}, line=line,
        paths={"max_reflections": 1, "scatterers_per_cell": 1.0, "contributions": ["seabed"]},
        sonar={"receiver": {"bandwidth": 20e3, "record": record}},
    )  # fmt: skip
    scenario = type(scenario)(**{**scenario.model_dump(), "track": {**TRACK, "pings": 2, "window": (0.08, 0.0805)}})
    simulator = build_simulator(scenario)
    whole = dict(simulate_pings(simulator, [0, 1], 1))
    for order in ([1, 0], [1]):
        for ping, one in simulate_pings(simulator, order, 2):
            np.testing.assert_array_equal(one, whole[ping])
    assert not np.array_equal(whole[0], whole[1])
