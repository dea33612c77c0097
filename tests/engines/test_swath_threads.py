"""A claim about threads that share what the quick way knows."""

import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

from insonify.engines import swath
from insonify.simulation import prepare
from oracles.scenes import nominal


def test_threads_make_room_side_by_side(monkeypatch):
    """Eight threads that each ask for 6000 stances of their own, of which few are kept: none is disturbed."""
    listening = prepare(nominal(field="incoherent"))
    scenario, here, rays = listening.scenario, listening.stance(0), listening.engine.rays
    monkeypatch.setattr(swath, "_known", lambda *_: None)
    monkeypatch.setattr(swath, "_LAST", {})
    often = sys.getswitchinterval()

    def ask(thread):
        for n in range(6000):
            assert swath.swath_of(scenario.scene, scenario.paths, replace(here, moved=8.0 * n + thread), rays) is None

    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as pool:
            list(pool.map(ask, range(8)))
    finally:
        sys.setswitchinterval(often)
