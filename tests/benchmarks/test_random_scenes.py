"""Claims about random scenarios: the same number gives the same scene, and every valid one has a finite estimate."""

import importlib
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import yaml

from insonify.estimates.run_cost import estimate_cost
from insonify.estimates.run_limits import run_refusal
from insonify.scenario.diagnostic import ScenarioError
from insonify.scenario.load import load_scenario

FOLDER = Path(__file__).parents[2] / "benchmarks"
NUMBERS = range(30, 50)


@pytest.fixture
def random_scenes(monkeypatch):
    """The generator's module, from the benchmarks' folder."""
    if not FOLDER.is_dir():
        pytest.skip("no benchmarks here: an installation, not a checkout")
    monkeypatch.syspath_prepend(str(FOLDER))
    yield importlib.import_module("random_scenes")
    sys.modules.pop("random_scenes", None)


def test_the_same_number_gives_the_same_scene(random_scenes, tmp_path):
    """A scene that fails can be made again from its number."""
    one, again, other = (random_scenes.random_description(number, tmp_path) for number in (7, 7, 8))
    assert one == again != other


def test_every_valid_scene_has_a_finite_estimate(random_scenes, tmp_path):
    """Most scenes are valid; each of those is checked without an error, and its cost is made of positive numbers."""
    valid = 0
    for number in NUMBERS:
        file = tmp_path / f"{number}.yaml"
        file.write_text(yaml.safe_dump(random_scenes.random_description(number, tmp_path)), encoding="utf-8")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                scenario = load_scenario(file)
            except ScenarioError:
                continue
            whole = estimate_cost(scenario, threads=1)
            assert isinstance(run_refusal(scenario, whole), str)
        valid += 1
        numbers = np.array([whole.seconds, whole.memory, whole.disk])
        assert np.all(np.isfinite(numbers) & (numbers > 0)), number
    assert valid > 0.7 * len(NUMBERS)
