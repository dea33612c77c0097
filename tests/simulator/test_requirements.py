"""Claims about what accumulators require: the engine of one sum has the scatterers, pairs and caches that it needs."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from insonify.engines.parts import SerialPool
from insonify.simulator import _engine, build_simulator
from insonify.synthesis.accumulator import Requirements
from insonify.synthesis.label_accumulator import POINTS
from insonify.synthesis.level_curves import LevelAccumulator
from insonify.synthesis.traced_intensity import TracedAccumulator, TracedLevelAccumulator
from oracles.scenes import nominal


@pytest.fixture(scope="module")
def simulator():
    """The nominal scene, with random delays of its water."""
    water = {"inhomogeneity": {"rms_index": 1e-5, "correlation_length": 2.0}}
    return build_simulator(nominal(water=water, paths={"scatterers_per_cell": 4.0}))


def test_each_accumulator_declares_its_scatterers_and_pairs(simulator):
    """Pressures: random scatterers and the pairs that importance sampling keeps; all others: expectations."""
    here = simulator.ping_geometry(0)
    pressure = simulator.coherent_accumulator(here).requirements
    assert not pressure.quadrature and not pressure.negligible_pairs and not pressure.fast_reverberation
    intensity = simulator.incoherent_accumulator(here)
    assert intensity.requirements == Requirements(fast_reverberation=intensity.is_short_pulse, approximate_edges=True)
    assert LevelAccumulator(intensity).requirements == Requirements(approximate_edges=True)
    labels = simulator.label_accumulator(here).requirements
    assert labels.quadrature and labels.origins and labels.max_scatterers_per_cell == POINTS


def test_only_accumulators_of_the_tracer_require_rays():
    """Its expected intensity and its levels; by eigenrays neither does."""
    traced = build_simulator(nominal(field="incoherent", paths={"engine": "tracer"}))
    whole = traced.expectation_accumulator(traced.ping_geometry(0))
    assert isinstance(whole, TracedAccumulator)
    assert whole.requirements.rays and TracedLevelAccumulator(whole).requirements.rays
    plain = build_simulator(nominal(field="incoherent"))
    assert not plain.expectation_accumulator(plain.ping_geometry(0)).requirements.rays


def test_the_engine_of_a_sum_has_its_density_and_delays(simulator):
    """Random delays for pressures alone; no more scatterers than matter; nothing changed is the engine itself."""
    with ThreadPoolExecutor(1) as pool:
        engine = simulator.engine
        assert engine.delay_field is not None
        assert _engine(engine, Requirements(quadrature=False), pool, None) is engine
        expected = _engine(engine, Requirements(), pool, None)
        assert expected.delay_field is None and expected.path_settings is engine.path_settings
        sparse = _engine(engine, Requirements(max_scatterers_per_cell=1.5), pool, None)
        assert sparse.path_settings.scatterers_per_cell == 1.5 and engine.path_settings.scatterers_per_cell == 4.0
        dense = _engine(engine, Requirements(max_scatterers_per_cell=40.0), pool, None)
        assert dense.path_settings is engine.path_settings


def test_pings_on_one_thread_keep_their_terrain_occlusion_apart(simulator):
    """A serial pool belongs to one ping: its engine shares the pool's cache, and no other."""
    first, second = SerialPool(), SerialPool()
    wants = Requirements(quadrature=False)
    assert _engine(simulator.engine, wants, first, None).caches.terrain_occlusion is first.terrain_occlusion
    assert _engine(simulator.engine, wants, second, None).caches.terrain_occlusion is second.terrain_occlusion
    assert first.terrain_occlusion is not second.terrain_occlusion
