"""Claims about the scene of a scenario: one object, of the scenario that it belongs to."""

import copy
import pickle

from insonify.model import Model, evaluated_once
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


class Rope(Model):
    """A model with two values that follow from its field."""

    length: float = 1.0

    @property
    @evaluated_once
    def parts(self) -> list[float]:
        """Halves of the rope."""
        return [self.length / 2, self.length / 2]

    @property
    @evaluated_once
    def ends(self) -> list[float]:
        """Positions of the ends."""
        return [0.0, self.length]


def test_a_value_is_evaluated_once_for_each_model():
    """Two values of one model are kept apart; copies and pickles, equal or with other fields, evaluate their own."""
    rope = Rope(length=2.0)
    assert rope.parts is rope.parts == [1.0, 1.0] and rope.ends is rope.ends == [0.0, 2.0]
    for other in (copy.copy(rope), copy.deepcopy(rope), rope.model_copy(), pickle.loads(pickle.dumps(rope))):
        assert other == rope and hash(other) == hash(rope)
        assert other.parts == rope.parts and other.parts is not rope.parts
    for longer in (rope.model_copy(update={"length": 6.0}), rope.unchecked_copy(length=6.0)):
        assert longer.parts == [3.0, 3.0] and longer != rope and hash(longer) != hash(rope)
    assert list(rope.model_dump()) == ["length"] and repr(rope) == "Rope(length=2.0)"
