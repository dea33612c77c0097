"""Estimates of smooth targets: facets are counted as a ping splits them, their pairs priced, pieces bounded."""

import tracemalloc

import pytest

from insonify.engines import targets
from insonify.engines.facet_count import facet_count
from insonify.engines.facet_subdivision import smooth_facets
from insonify.engines.patch_subdivision import Patches
from insonify.engines.ping_scatterers import ping_scatterers
from insonify.estimates import ping_work as work_module
from insonify.estimates import unit_costs
from insonify.estimates.ping_work import ping_work
from insonify.estimates.run_cost import estimate_cost
from insonify.simulator import build_simulator
from oracles.scenes import nominal

BOX = {"shape": "box", "label": "box", "position": (0, 7.0), "size": (0.3, 0.3, 0.3)}


def near(*targets, max_reflections=1, pings=1, **changes):
    """Targets a few metres from a sonar at 300 kHz, under waves."""
    return nominal(
        targets=list(targets), sonar={"pulse": {"kind": "cw", "frequency": 300e3, "duration": 0.1e-3}},
        line={"length": 0.5}, seabed={"depth": 10.0}, surface={"reflection": "statistical", "wind_speed": 5},
        track={"position": (0, 0, 7.0), "window": (0.005, 0.025), "pings": pings},
        paths={"contributions": ["target"], "max_reflections": max_reflections}, **changes,
    )  # fmt: skip


def test_facets_are_counted_as_a_ping_splits_them():
    """Facets of smooth faces in an estimate are as many as the engine makes."""
    rough, smooth = near(BOX), near({**BOX, "face_reflection_coefficient": 0.5})
    ready = build_simulator(smooth)
    here = ready.ping_geometry(0)
    seen = ping_scatterers(smooth.scene, smooth.paths, smooth.seed, here, ready.engine.rays)
    facets = len(
        smooth_facets(
            smooth.scene, smooth.targets[0], smooth.paths, here, seen.resolution.slant_resolution, ready.engine.rays
        )
    )
    more = ping_work(ready).points - ping_work(build_simulator(rough)).points
    assert facets > 1000
    assert more == pytest.approx(facets, rel=0.1)


PIECES_PER_TILE = [
    {"shape": "sphere", "position": (0, 20), "diameter": 1},
    {"shape": "sphere", "position": (0, 8), "diameter": 0.5, "burial": 0.4},
    {"shape": "cone", "position": (0, 8), "diameter": 0.6, "height": 0.5, "burial": 0.2},
    {"shape": "cylinder", "position": (0, 9), "diameter": 0.25, "length": 4},
    {"shape": "rock", "position": (0, 9), "size": (0.3, 0.3, 0.3)},
]


@pytest.mark.parametrize("body", PIECES_PER_TILE, ids=lambda body: f"{body['shape']}, {body.get('burial', 0)}")
def test_a_sample_of_pieces_counts_all_of_them(body):
    """Spheres, cut ones, long ones and meshes: within a fifth, of 2000 pieces and more."""
    scene = near({**body, "face_reflection_coefficient": 0.9})
    ready = build_simulator(scene)
    here = ready.ping_geometry(0)
    slant = ping_scatterers(scene.scene, scene.paths, scene.seed, here, ready.engine.rays).resolution.slant_resolution
    requested = (scene.scene, scene.targets[0], scene.paths, here, slant, ready.engine.rays)
    exact = len(smooth_facets(*requested))
    assert facet_count(*requested) == pytest.approx(exact, rel=0.2) and exact > 2000


SMALL_ROCK = {"shape": "rock", "position": (0, 9), "size": (0.1, 0.1, 0.1)}


@pytest.mark.parametrize("shape", [BOX, SMALL_ROCK], ids=["patches", "triangles"])
def test_facets_take_the_memory_that_is_estimated(shape):
    """Memory of facets, traced: during the ping, and while faces are split, 0.6 to 1.1 of the estimate."""
    ready = build_simulator(near({**shape, "face_reflection_coefficient": 0.5}))
    scenario, here = ready.scenario, ready.ping_geometry(0)
    requested = (scenario.scene, scenario.targets[0], scenario.paths, here, 0.08, ready.engine.rays)
    smooth_facets(*requested)
    tracemalloc.start()
    facets = smooth_facets(*requested)
    held, peak = (each / len(facets) for each in tracemalloc.get_traced_memory())
    tracemalloc.stop()
    assert len(facets) > 5000
    assert 0.6 < held / unit_costs.BYTES_PER_FACET < 1.1
    assert 0.6 < peak / (unit_costs.BYTES_PER_FACET + unit_costs.BYTES_PER_FACET_IN_SPLIT) < 1.1


def test_a_large_smooth_target_is_counted_by_few_pieces(monkeypatch):
    """No more than a sample of each level is halved, however large the sphere: the estimate is quick."""
    halved = []
    split = Patches.halved
    monkeypatch.setattr(Patches, "halved", lambda self, along: halved.append(len(self.s)) or split(self, along))
    ready = build_simulator(
        near({"shape": "sphere", "position": (0, 20), "diameter": 3, "face_reflection_coefficient": 0.9})
    )
    assert ping_work(ready).points > 50_000
    assert 0 < sum(halved) < 10_000


def test_bounces_off_waves_make_smooth_targets_costly():
    """Orders 1 and 4 have 9 and 51 legs to each facet: pairs, and their estimated time, grow 20 times and more."""
    box = {**BOX, "face_reflection_coefficient": 0.5}
    rough, *seconds = (
        ping_work(build_simulator(scene)).seconds for scene in (near(BOX), near(box), near(box, max_reflections=4))
    )
    assert seconds[1] - rough > 15 * (seconds[0] - rough) > 0


def test_a_pipeline_of_200_m_is_not_estimated_to_need_70_gb():
    """Its slivers are cut into no more than a million pieces, and estimates know it."""
    pipe = {"shape": "cylinder", "label": "pipe", "position": (0, 9), "length": 200, "diameter": 0.5}
    found = estimate_cost(near(pipe))
    assert 0.3e9 < found.memory < 1.5e9


def test_many_targets_are_counted_at_few_pings(monkeypatch):
    """A hundred targets over a hundred pings: some hundred counts of single targets, and none is cut into its cells."""
    counts = []
    counted = work_module.target_count
    monkeypatch.setattr(
        work_module, "target_count", lambda scene, *more: counts.append(len(scene.targets)) or counted(scene, *more)
    )
    monkeypatch.setattr(targets, "solid_scatterers", None)
    drums = [{"shape": "drum", "label": f"drum {n}", "position": (n % 10, 10 + n // 10)} for n in range(100)]
    block = {"shape": "box", "label": "block", "position": (0, 14), "size": (3, 2, 1)}
    simulator = build_simulator(near(*drums, block, pings=100))
    some = ping_work(simulator)
    assert some.points > 1000 and 100 <= sum(counts) <= 400
    monkeypatch.setattr(work_module, "LARGEST", 51)
    assert some.points == pytest.approx(ping_work(simulator).points, rel=0.1)
    assert len(some.pieces) == pytest.approx(101, abs=3)
