"""A claim about threads that share what fast reverberation knows."""

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from insonify.engines.fast_reverberation import reverberation
from insonify.recent_results import RecentResults
from insonify.simulator import build_simulator
from oracles.scenes import nominal


def test_threads_share_the_cache(monkeypatch):
    """Eight threads that each request 1500 ping_geometries of their own, of which few are kept: none is disturbed."""
    simulator = build_simulator(nominal(field="incoherent"))
    scenario, here, rays = simulator.scenario, simulator.ping_geometry(0), simulator.engine.rays
    monkeypatch.setattr(reverberation, "_prepare", lambda *_: None)
    monkeypatch.setattr(reverberation, "_PREPARED", RecentResults(8))
    often = sys.getswitchinterval()

    def request(thread):
        for n in range(1500):
            assert (
                reverberation.prepare_fast_reverberation(
                    scenario.scene, scenario.paths, replace(here, max_displacement=8.0 * n + thread), rays
                )
                is None
            )

    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as pool:
            list(pool.map(request, range(8)))
    finally:
        sys.setswitchinterval(often)
