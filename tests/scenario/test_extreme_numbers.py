"""Claims about extreme numbers: any of them is refused by name, or has a finite estimate; the check never breaks."""

import copy
import math
import random

import pytest
import yaml

from insonify.diagnostics.diagnostic import ScenarioError
from insonify.estimates.run_cost import estimate_cost, size_refusal
from insonify.scenario.load import parse_model
from insonify.scenario.scenario import Scenario
from insonify.scenario.template import template_text
from insonify.scene.seabed_terrain import SeabedTerrain
from oracles.scenes import nominal

TEMPLATES = ("nominal", "sidescan", "forward-looking", "multibeam", "interferometric")
FACTORS = (1e-6, 1e-3, 0.01, 100.0, 1e3, 1e6)
EXTREMES = [
    ("track.window", ["0 ms", "100 s"]), ("track.window", ["50 s", "51 s"]), ("track.pings", 100_000),
    ("paths.scatterers_per_cell", 1000), ("paths.beam_cutoff_db", -120), ("paths.max_reflections", 12),
    ("seabed.depth", 10_000), ("sonar.pulse.frequency", "10 MHz"), ("sonar.pulse.duration", "1 us"),
    ("sonar.receiver.bandwidth", "10 MHz"), ("sonar.receiver.sub_bands", 32),
    ("targets", [{"shape": "box", "position": [0, 1e6], "size": [1000, 1, 1]}]),
    ("targets", [{"shape": "cylinder", "position": [0, 40], "length": 500, "diameter": 2}]),
    ("sonar.receive.offset", ["0 m", "6e8 m", "0 m"]),
]  # fmt: skip


def leaves(node, path=()):
    """Path and value of every number, with or without a unit, in a description."""
    for key, value in node.items() if isinstance(node, dict) else enumerate(node):
        if isinstance(value, dict | list):
            yield from leaves(value, (*path, key))
        elif isinstance(value, int | float) and not isinstance(value, bool):
            yield (*path, key), value, ""
        elif isinstance(value, str) and value.split(" ")[0].lstrip("-").replace(".", "", 1).isdigit():
            number, _, unit = value.partition(" ")
            yield (*path, key), float(number), unit


def changed(described, path, value):
    """A description with one value replaced."""
    made = copy.deepcopy(described)
    node = made
    for key in path[:-1]:
        node = node.setdefault(key, {}) if isinstance(node, dict) else node[key]
    node[path[-1]] = value
    return made


def is_reported(described):
    """Whether a scenario is refused by name, or has an estimate of finite numbers."""
    try:
        scenario = parse_model(Scenario, yaml.safe_dump(described, sort_keys=False))
    except ScenarioError as error:
        return bool(str(error))
    whole = estimate_cost(scenario)
    return bool(size_refusal(whole)) or all(
        map(math.isfinite, (whole.seconds, whole.memory, whole.disk, whole.scatterers))
    )


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", TEMPLATES)
def test_numbers_far_from_the_template_are_refused_or_priced(name):
    """Four numbers of each template, each times a factor from a millionth to a million."""
    described = yaml.safe_load(template_text(name))
    draw = random.Random(name)
    for path, value, unit in draw.sample(sorted(leaves(described), key=str), 4):
        far = value * draw.choice(FACTORS)
        assert is_reported(changed(described, path, f"{far:.6g} {unit}".strip() if unit else far)), (path, far)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("path", "value"), EXTREMES, ids=lambda one: str(one)[:40])
def test_the_largest_numbers_are_refused_or_priced(path, value):
    """Long windows, many pings, fine cells, deep water, high frequencies, long and far bodies."""
    described = yaml.safe_load(template_text("sidescan"))
    assert is_reported(changed(described, tuple(path.split(".")), value))


@pytest.mark.filterwarnings("ignore")
def test_the_ground_under_a_track_well_above_it_is_not_evaluated(monkeypatch):
    """Half a million pings over relief are checked by the heights between which all of it lies."""
    monkeypatch.setattr(SeabedTerrain, "depth_at", None)
    rough = {"relief": {"kind": "power-law", "hurst": 0.8, "rms": 0.05}}
    assert nominal(seabed=rough, track={"window": (0.02, 0.1), "pings": 1000}).seabed.relief
