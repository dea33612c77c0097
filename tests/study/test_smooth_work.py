"""Estimates of smooth targets: facets are counted as a ping splits them, their pairs priced, pieces bounded."""

import pytest

from insonify.engines.faces import smooth_facets
from insonify.engines.view import view
from insonify.simulation import prepare
from insonify.study.cost import cost
from insonify.study.work import ping_work
from oracles.scenes import nominal

BOX = {"shape": "box", "label": "box", "position": (0, 7.0), "size": (0.3, 0.3, 0.3)}


def near(*targets, reflections=1, pings=1, **changes):
    """Targets a few metres from a sonar at 300 kHz, under waves."""
    return nominal(
        targets=list(targets), sonar={"pulse": {"kind": "cw", "frequency": 300e3, "duration": 0.1e-3}},
        line={"length": 0.5}, seabed={"depth": 10.0}, surface={"bounce": "statistical", "wind_speed": 5},
        track={"position": (0, 0, 7.0), "window": (0.005, 0.025), "pings": pings},
        paths={"causes": ["target"], "reflections": reflections}, **changes,
    )  # fmt: skip


def test_facets_are_counted_as_a_ping_splits_them():
    """What smooth faces add to the scatterers of an estimate is what the engine makes of them."""
    rough, smooth = near(BOX), near({**BOX, "smooth": 0.5})
    ready = prepare(smooth)
    here = ready.stance(0)
    seen = view(smooth.scene, smooth.paths, smooth.seed, here, ready.engine.rays)
    facets = len(
        smooth_facets(smooth.scene, smooth.targets[0], smooth.paths, here, seen.resolution.slant, ready.engine.rays)
    )
    more = ping_work(ready).points - ping_work(prepare(rough)).points
    assert facets > 1000
    assert more == pytest.approx(facets)


def test_bounces_off_waves_make_smooth_targets_dear():
    """Orders 1 and 4 have 9 and 51 legs to each facet: pairs, and the time told for them, grow 20 times and more."""
    box = {**BOX, "smooth": 0.5}
    rough, *seconds = (ping_work(prepare(scene)).seconds for scene in (near(BOX), near(box), near(box, reflections=4)))
    assert seconds[1] - rough > 15 * (seconds[0] - rough) > 0


def test_a_pipeline_of_200_m_is_not_told_to_need_70_gb():
    """Its slivers are cut into no more than a million pieces, and estimates know it."""
    pipe = {"shape": "cylinder", "label": "pipe", "position": (0, 9), "length": 200, "diameter": 0.5}
    found = cost(near(pipe))
    assert 0.3e9 < found.memory < 1.5e9
