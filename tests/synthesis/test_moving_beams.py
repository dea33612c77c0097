"""Claims about blocks of scatterers received by moving beams: however they are cut and given, they sound the same."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.records.pairs import SeparableStrengths
from insonify.simulator import build_simulator
from oracles.scenes import nominal

TRACK = {
    "kind": "line", "start": (0, 0, 11.0), "speed": 2.0, "pings": 1, "interval": 0.1, "stop_and_hop": False,
    "window": (0.08, 0.085), "motion": {"yaw": {"rms": 0.03, "period": 4.0}},
}  # fmt: skip
ROUGH = {"depth": 20.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}


def under_way(*, turning=True, **more):
    """Coherent accumulator, ping geometry and engine of a moving sonar 60 m from a rough seabed."""
    scenario = nominal(seabed=ROUGH, paths={"max_reflections": 2, "scatterers_per_cell": 2.0}, **more)
    track = TRACK if turning else {key: value for key, value in TRACK.items() if key != "motion"}
    simulator = build_simulator(type(scenario)(**{**scenario.model_dump(), "track": track}))
    here = simulator.ping_geometry(0)
    return simulator.coherent_accumulator(here), here, simulator.engine


def received(reading, *blocks):
    """Cells of some pairs of legs."""
    cells = reading.empty()
    for pairs in blocks:
        reading.add(cells, pairs)
    return cells


@pytest.mark.parametrize("turning", [True, False])
def test_strengths_that_are_products_need_not_be_written_out(turning):
    """Sampled pairs under Lambert's law: the recording is that of the stored strengths, to 1e-6 of its rms."""
    reading, here, engine = under_way(turning=turning)
    block = max(
        (engine.pairs(here, one, include_negligible=False) for one in engine.blocks(here)),
        key=lambda p: len(p.scatterers),
    )
    assert isinstance(block.stored_strengths, SeparableStrengths) and block.stored_strengths.sampling is not None
    one, other = received(reading, block), received(reading, replace(block, stored_strengths=block.strength))
    assert np.linalg.norm(one - other) < 1e-6 * np.linalg.norm(other) > 0


def test_a_block_may_be_cut_anywhere():
    """Blocks of 1, 511, 512, 513 and all scatterers: the sum of two parts is the whole, to 1e-6 of its rms."""
    reading, here, engine = under_way()
    points = max((block() for block in engine.blocks(here)), key=len)
    assert len(points) > 1500
    whole = received(reading, engine.path_pairs(here, points))
    for cut in (1, 511, 512, 513):
        parts = [engine.path_pairs(here, points.take(rows)) for rows in (slice(None, cut), slice(cut, None))]
        assert np.linalg.norm(received(reading, *parts) - whole) < 1e-6 * np.linalg.norm(whole)


def test_nothing_is_received_of_no_scatterers_and_no_pairs():
    """An empty block, and one of which no pair is left: silence."""
    reading, here, engine = under_way()
    points = max((block() for block in engine.blocks(here)), key=len)
    assert not received(reading, engine.path_pairs(here, points.take(slice(0, 0)))).any()
    assert not received(reading, engine.path_pairs(here, points).select(np.zeros(0, np.int64))).any()
