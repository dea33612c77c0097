"""Faults of a data set are found before an image is simulated, with line, key, problem and fix."""

import pytest

from datasets.small_dataset import write_small
from insonify.datasets.dataset import load_dataset
from insonify.datasets.drawn_scene import SceneDraws
from insonify.diagnostics.diagnostic import ScenarioError

HEADING = "targets[pipe].heading: {uniform: [0 deg, 360 deg]}"


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ((HEADING, "surface.wind_spedd: {uniform: [0, 9]}"), [":6:", "wind_spedd", "did you mean 'wind_speed'"]),
        ((HEADING, "targets[pip].heading: {uniform: [0, 1]}"), [":6:", "'pip'", "did you mean 'pipe'"]),
        ((HEADING, "targets[pipe].burial: {uniform: [0, 1.5]}"), [":6:", "1.5 is out of range", "(0 to below 1)"]),
        ((HEADING, "targets[pipe].burial: {normal: {mean: 0.1, std: 0.2}}"), ["targets[pipe].burial", "out of range"]),
        ((HEADING, "targets[pipe].heading: {uniform_in: swath}"), [":6:", "draws a position"]),
        ((HEADING, "targets[pipe].heading: {unifrom: [0, 1]}"), [":6:", "did you mean 'uniform'"]),
        ((HEADING, "targets[pipe].heading: {uniform: [3, 1]}"), ["no range", "smaller value first"]),
        ((HEADING, "seabed.scattering.law: {choice: {lambert: 1, lambertt: 1}}"), ["lambertt", "lambert"]),
        (("val: 0.5", "val: 0.4"), ["dataset.split", "0.5 + 0.4 = 0.9"]),
        (("split: {train: 0.5, val: 0.5}", "split: {train: 0.95, val: 0.05}"), ["split.val", "of 4 images is none"]),
        (("across: [9 m, 13 m]", "across: [90 m, 130 m]"), [":5:", "image 0", "outside of the swath"]),
        (("across: [9 m, 13 m]", "apart: 500 m"), None),
        (("write: [coco]", "write: [geotiff]"), ["write", "projection: mosaic"]),
        (("write: [coco]", "pairs: [no_multipath]"), ["pairs", "max_reflections: 1"]),
        (("write: [coco]", "clutter: [{count: 2, target: {shape: rock, burrial: 0.1}}]"), ["burrial", "burial"]),
        (("write: [coco]", "clutter: [{count: 2, position: {area: swath, apart: 500 m}, target: {shape: rock}}]"),
         ["no position is 500 m apart"]),
        ((HEADING, "targets[²].heading: {uniform: [0, 1]}"), [":6:", "label '²'"]),
        ((HEADING, "targets.².heading: {uniform: [0, 1]}"), [":6:", "targets is a list"]),
        ((HEADING, "targets[pipe].heading: {integers: [0, 100000000000000000000]}"), ["integers.1", "out of range"]),
        ((HEADING, "targets[pipe].heading: {uniform: [0, 1e13]}"), ["uniform.1", "-1e+12 to 1e+12"]),
        ((HEADING, "targets[pipe].heading: {power_law: {exponent: 20, within: [1e-300, 1]}}"), [":6:", "1e-12 to"]),
        ((HEADING, "targets[pipe].heading: {normal: {mean: 0, std: 0.01 deg, within: [3 deg, 4 deg]}}"),
         [":6:", "normal.within: 3 deg to 4 deg keeps less", "mean 0"]),
        ((HEADING, "targets[pipe].heading: {weibull: {scale: 0.01, shape: 100, within: [1, 2]}}"), ["keeps less"]),
        ((HEADING, "targets[pipe].heading: {choice: {1 rad: .inf}}"), [":6:", "no weight"]),
        ((HEADING, "targets[pipe].heading: {choice: {1 rad: true}}"), [":6:", "no weight"]),
        ((HEADING, "seabed.depth: {choice: [9 m, 16 m]}"), [":4:", "image", "below the seabed"]),
        (("along: [0.3, 0.7]", "along: [0.7, 0.3]"), [":5:", "uniform_in.along: 0.7 to 0.3", "no range"]),
        (("across: [9 m, 13 m]", "across: [-9 m, 13 m]"), [":5:", "across.0", "out of range"]),
        (("projection: slant", "span: [5, 5]"), ["dataset.span", "5 to 5 dB"]),
        (("projection: slant", "span: [-1e308, 1e308]"), ["dataset.span", "out of range"]),
        (("write: [coco]", "write: []"), ["write: names no format"]),
        (("write: [coco]", "pairs: [no_target, no_target]"), ["pairs: no_target is there twice"]),
        *((("write: [coco]", f"clutter: [{{{count}, target: {{shape: rock}}}}]"), [":7:", f"clutter.0.{key}", problem])
          for count, key, problem in (
              ("count: -1", "count", "out of range"),
              ("count: 10000000000", "count", "0 to 2000"),
              ("count: {uniform: [0, 3]}", "count.uniform", "no whole numbers"),
              ("count: {choice: [a, b]}", "count.choice", "a is no number"),
              ("count: {integers: [0, 100000000000]}", "count.integers", "0 to 2000"),
              ("count: 1, length: {uniform: [-1, 1]}", "length.uniform", "-1.0 is no length"),
              ("count: 1, length: {choice: [a]}", "length.choice", "a is no length"),
              ("count: 1, length: {uniform_in: swath}", "length.uniform_in", "position"),
              ("count: 1, length: {normal: {mean: 1, std: 1}}", "length.normal", "0 or less"),
          )),
        *((("write: [coco]", f"clutter: [{{count: 1, target: {{shape: rock, {key}}}}}]"), [":7:", *problems])
          for key, *problems in (
              ("burial: {uniform: [3, 1]}", "clutter.0.target.burial.uniform", "no range"),
              ("burial: {uniform: [a, 1]}", "clutter.0.target.burial.uniform.0", "'a' is not a number"),
              ("burial: {uniform_in: swath}", "clutter.0.target.burial", "position"),
              ("position: [0, 0, 0]", "clutter.0.target.position", "Leave it out"),
          )),
    ],
)  # fmt: skip
def test_faults_are_named(tmp_path, edit, message):
    """Each fault is refused with the words that lead to its remedy."""
    path = write_small(tmp_path, edit)
    if message is None:  # a single position is always apart
        load_dataset(path)
        return
    with pytest.raises(ScenarioError) as error:
        load_dataset(path)
    for words in message:
        assert words in str(error.value)


def test_items_of_an_empty_list_do_not_vary(tmp_path):
    """A key of all targets, of a scene without any, would change nothing in any image."""
    target = "  - {shape: cylinder, label: pipe, position: [1 m, 12 m], length: 3 m, diameter: 1 m}\n"
    path = write_small(tmp_path, ("targets[pipe]", "targets[*]"), scene=(("targets:\n" + target, ""),))
    with pytest.raises(ScenarioError, match=r":5: .*the list is empty"):
        load_dataset(path)


def test_lengths_of_clutter_may_be_chosen_with_their_units(tmp_path):
    """A choice of texts is a choice of lengths."""
    clutter = "clutter: [{count: 1, target: {shape: rock}, length: {choice: [40 cm]}}]"
    described = load_dataset(write_small(tmp_path, ("write: [coco]", clutter)))
    scenario, _ = SceneDraws(described.file, described.base).scene(0)
    assert scenario.targets[-1].size[0] == pytest.approx(0.4)


def test_a_window_that_misses_the_seabed_leaves_no_swath(tmp_path):
    """A position cannot be drawn where nothing is recorded."""
    path = write_small(tmp_path, scene=(("window: [8 ms, 24 ms]", "window: [1 ms, 6 ms]"),))
    with pytest.raises(ScenarioError, match="swath is empty"):
        load_dataset(path)


def test_speckle_of_pressures_has_no_twin(tmp_path):
    """A coherent scenario has its own speckle."""
    path = write_small(tmp_path, ("write: [coco]", "pairs: [other_speckle]"), scene=(("incoherent", "coherent"),))
    with pytest.raises(ScenarioError, match="field: incoherent"):
        load_dataset(path)
