"""Claims about the scene of a scenario: one object, of the scenario that it belongs to."""

import pickle

from oracles.scenes import nominal

RELIEF = {"depth": 30.0, "relief": {"kind": "power-law", "hurst": 0.8, "rms": "4 cm"}}


def test_a_scenario_has_one_scene_and_one_completed_seabed():
    """The seabed of the scene is the completed one itself: what is cached with it is found without comparing fields."""
    scenario = nominal(seabed=RELIEF)
    assert scenario.scene is scenario.scene
    assert scenario.scene.seabed is scenario.completed_seabed


def test_a_changed_scenario_has_a_scene_of_its_own():
    """Of a copy with another value, checked or not, and of one from another process."""
    scenario = nominal(seabed=RELIEF)
    first = scenario.scene
    shallow = scenario.with_("seabed.depth", 25.0)
    unchecked = scenario.unchecked_copy(seabed=shallow.seabed)
    assert shallow.scene.seabed.depth == unchecked.scene.seabed.depth == 25.0 != first.seabed.depth
    assert scenario.scene is first
    again = pickle.loads(pickle.dumps(scenario))
    assert again.scene == first and again.scene is not first
