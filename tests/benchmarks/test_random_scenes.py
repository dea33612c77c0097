"""Claims about random scenarios: features drawn together neither fail nor change what each of them guarantees."""

import importlib
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import yaml

import insonify
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.estimates.run_cost import estimate_cost
from insonify.estimates.run_limits import run_refusal
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


PAIRS = 500
"""Small scenes of `make validate`; features come in pairs and triples."""
MOST_SECONDS = 5.0
"""Processor time of two pings, start included, above which a small scene is left out [s]."""


def small_scene(random_scenes, number, folder):
    """A valid scene that takes little, or None; its file is `scene.yaml`."""
    file = folder / "scene.yaml"
    file.write_text(yaml.safe_dump(random_scenes.small_description(number, folder)), encoding="utf-8")
    try:
        scenario = load_scenario(file)
    except ScenarioError:
        return None
    cost = estimate_cost(scenario, threads=1, labels=scenario.sonar.receiver.record != "elements")
    return None if cost.seconds > MOST_SECONDS or run_refusal(scenario, cost) else scenario


def recorded(scenario, **options):
    """Pressures or intensities of all pings, shape (pings, channels, samples)."""
    found = insonify.simulate(scenario, **options)
    return found["pressure" if scenario.field == "coherent" else "intensity"].values


def faults(scenario, folder):
    """Guarantees that a scene breaks: finite values; bits of one and two threads, of parts, with labels; levels."""
    whole, name = recorded(scenario, threads=1), "pressure" if scenario.field == "coherent" else "intensity"
    if not np.isfinite(whole).all():
        yield "not finite"
    if not np.array_equal(recorded(scenario, threads=2), whole):
        yield "threads"
    if not np.array_equal(np.concatenate([recorded(scenario, pings=ping) for ping in (0, 1)]), whole):
        yield "pings one by one"
    if scenario.sonar.receiver.record != "elements":
        insonify.record(scenario, folder / "scene.zarr", with_labels=True, overwrite=True)
        with insonify.open_recording(folder / "scene.zarr") as found:
            if not np.array_equal(found[name].values, whole):
                yield "labels"
            yield from (f"{key} is not finite" for key, one in found.variables.items()
                        if one.dtype.kind in "fc" and not np.isfinite(one.values).all())  # fmt: skip
    if scenario.field == "incoherent" and scenario.sonar.receiver.adc is None:
        levels = insonify.levels(scenario, channel=scenario.sonar.channel_count - 1).level_db
        mean = np.mean(10 ** (levels.sel(contribution="total", pair="all").values / 10))
        if abs(10 * np.log10((mean + 1e-9) / (whole[0, -1].mean() + 1e-9))) > 0.5:
            yield "levels"


def scenes_hold(random_scenes, folder, numbers):
    """Check small scenes; their number."""
    broken, count = {}, 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number in numbers:
            scenario = small_scene(random_scenes, number, folder)
            if scenario is not None:
                count += 1
                found = list(faults(scenario, folder))
                broken |= {number: found} if found else {}
    assert broken == {}
    return count


def test_features_drawn_together_keep_what_each_guarantees(random_scenes, tmp_path):
    """A few scenes: finite, bits of any number of threads, of pings one by one and with labels; levels in 0.5 dB."""
    assert scenes_hold(random_scenes, tmp_path, (3, 6, 45)) == 3


@pytest.mark.validate
@pytest.mark.parametrize("first", range(0, PAIRS, 50))
def test_pairs_of_features_keep_what_each_guarantees(random_scenes, tmp_path, first):
    """Fifty scenes a piece, most of them valid and small."""
    assert scenes_hold(random_scenes, tmp_path, range(first, first + 50)) > 20
