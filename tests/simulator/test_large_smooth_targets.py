"""Smooth targets a part at a time: no more memory for a large one, and the same echo as all at once."""

import numpy as np
import pytest

from insonify.engines import memory_budget, target_culling, targets
from insonify.engines.eigenray_engine import EigenrayEngine
from insonify.engines.memory_budget import BYTES_AT_ONCE, bytes_per_point
from insonify.engines.targets import target_points
from insonify.simulator import build_simulator, simulate
from oracles.few_of import few_of
from oracles.scenes import nominal
from oracles.smooth import ROUGH

BOX = {
    "shape": "box",
    "position": (0.0, 7.0),
    "size": (0.76, 0.76, 0.76),
    "face_reflection_coefficient": 0.9,
    "scattering": ROUGH,
}
SMALL = {**BOX, "size": (0.2, 0.2, 0.2)}
MEDIUM = {**BOX, "size": (0.4, 0.4, 0.4)}
ONCE = {"contributions": ["target"], "max_reflections": 1}
ROUGH_SEA = {"reflection": "statistical", "wind_speed": 5.0}


def scene(**changes):
    """A smooth box 7 m from a sonar of 300 kHz."""
    fixed = {
        "targets": [BOX], "line": {"length": 0.3}, "sonar": {"pulse": {"kind": "cw", "frequency": 300e3,
        "duration": 0.1e-3}}, "track": {"position": (0.0, 0.0, 5.0), "window": (0.006, 0.02)},
        "seabed": {"depth": 10.0}, "water": {"noise_level_db": None},
        "paths": {"contributions": ["target"], "max_reflections": 2},
    }  # fmt: skip
    return nominal(**{**fixed, **changes})


CHANGES = {
    "still": {"targets": [MEDIUM]},
    "moving sea": {"surface": ROUGH_SEA, "targets": [SMALL], "paths": ONCE},
    "jitter": {"field": "incoherent", "targets": [MEDIUM], "paths": {**ONCE, "jitter": 0.3}},
    "expected moving sea": {"field": "incoherent", "surface": ROUGH_SEA, "targets": [SMALL], "paths": ONCE},
    "large, moving sea": {"surface": ROUGH_SEA},
    "large, expected moving sea": {"field": "incoherent", "surface": ROUGH_SEA},
}
CASES = [
    pytest.param(change, id=name, marks=[pytest.mark.validate] * name.startswith("large"))
    for name, change in CHANGES.items()
]


@pytest.mark.parametrize("change", CASES)
def test_a_target_in_parts_echoes_as_the_whole(change, monkeypatch):
    """Legs and pairs of about 300 facets at a time, or of all: the same to 1e-5, moving sea, jitter and both fields."""
    scenario = scene(**change)
    name = "intensity" if scenario.field == "incoherent" else "pressure"
    made, parts, batches = [], [], EigenrayEngine.pair_batches

    def counted(self, here, block, **more):
        for pairs in batches(self, here, block, **more):
            parts[-1] += 1
            yield pairs

    monkeypatch.setattr(EigenrayEngine, "pair_batches", counted)
    for budget in (1e12, 2e6):
        monkeypatch.setattr(memory_budget, "BYTES_AT_ONCE", budget)
        parts.append(0)
        made.append(simulate(scenario, threads=1)[name].values)
    assert parts[1] >= parts[0] + 3
    assert np.abs(made[0]).max() > 0
    np.testing.assert_allclose(made[1], made[0], rtol=0, atol=1e-5 * np.abs(made[0]).max())


def test_a_target_in_parts_is_labelled_as_the_whole(monkeypatch):
    """Facets interfere across parts: energies and places of a smooth box in parts are those of the box at once."""
    simulator = build_simulator(scene(field="incoherent", targets=[MEDIUM], paths=ONCE))
    here = simulator.ping_geometry(0)
    reading = simulator.label_accumulator(here)
    made = []
    for budget in (1e12, 2e6):
        monkeypatch.setattr(memory_budget, "BYTES_AT_ONCE", budget)
        kept, parts = reading.empty(), 0
        for block in simulator.engine.blocks(here, quadrature=True):
            for pairs in simulator.engine.pair_batches(here, block):
                reading.add(kept, pairs)
                parts += pairs.interferes
        made.append((parts, {key: flashes.bins for key, flashes in kept.flashes.items()}))
    (few, whole), (many, split) = made
    assert many > few and whole.keys() == split.keys()
    for key, bins in whole.items():
        # places are within 10 m, and means over both sides of the beam nearly cancel to the north
        assert np.abs(split[key] - bins).max() <= 1e-4 * bins[..., 0].max(), key
        assert np.abs(split[key] - bins)[..., 0].max() <= 1e-5 * bins[..., 0].max(), key


@few_of((0, 2), "reflections", [1, 4, 6])
def test_legs_and_pairs_of_one_part_stay_within_their_memory(reflections):
    """Columns of the largest part of a smooth box over a moving sea, counted: half of 256 MB at most, at any order."""
    scenario = scene(surface=ROUGH_SEA, paths={"contributions": ["target"], "max_reflections": reflections})
    simulator = build_simulator(scenario)
    here = simulator.ping_geometry(0)
    points = next(
        p
        for p in target_points(scenario.scene, scenario.paths, 1, here, 0.075, quadrature=False)
        if not p.has_random_phase
    )
    pairs = next(iter(simulator.engine.pair_batches(here, lambda: points)))
    held = sum(
        getattr(legs, name).nbytes
        for legs in (pairs.transmit_legs, pairs.receive_legs)
        for name in (
            "delay",
            "length",
            "spreading",
            "absorption",
            "reflection_coefficient",
            "visibility",
            "departure",
            "arrival",
        )
    )
    held += 4 * pairs.strength.nbytes
    assert held <= BYTES_AT_ONCE / 2
    each = bytes_per_point(scenario.scene, scenario.paths, "target", drawn=False)
    assert held / len(pairs.scatterers) <= each


def test_a_smooth_box_near_the_sonar_is_few_patches():
    """0.76 m, 7 m away, at 300 kHz: the wavefront's curvature splits no face; under 30 000 patches."""
    scenario = scene()
    simulator = build_simulator(scenario)
    points = target_points(scenario.scene, scenario.paths, 1, simulator.ping_geometry(0), 0.075, quadrature=False)
    smooth = next(p for p in points if not p.has_random_phase)
    assert len(np.unique(smooth.position, axis=0)) < 30_000  # each has up to four sides


@few_of((0,), "shape", [
    {"shape": "cylinder", "length": 60.0, "diameter": 0.6}, {"shape": "box", "size": (60.0, 1.0, 3.0)},
])  # fmt: skip
def test_points_out_of_reach_are_dropped_and_no_echo_with_them(shape, monkeypatch):
    """A long body at 20 m: half of its points that face the sonar are followed, and the pressure changes by 0.3 %."""
    body = {"position": (0.0, 20.0), "scattering": {"law": "lambert", "strength_db": -20.0}, **shape}
    scenario = scene(targets=[body], track={"position": (0.0, 0.0, 5.0), "window": (0.02, 0.05)}, paths={
        "contributions": ["target"], "max_reflections": 0, "beam_cutoff_db": -80})  # fmt: skip
    simulator = build_simulator(scenario)
    counts, made = [], []
    for few in (1_000, 10**9):
        monkeypatch.setattr(targets, "MAX_UNCULLED", few)
        monkeypatch.setattr(target_culling, "MAX_UNCULLED", few)
        blocks = simulator.engine.blocks(simulator.ping_geometry(0))
        counts.append(sum(len(block()) for block in blocks))
        made.append(simulate(scenario, threads=1).pressure.values)
    assert counts[0] < counts[1] / 2
    assert np.abs(made[0] - made[1]).max() < 3e-3 * np.abs(made[1]).max()
