"""Faults of a data set are found before an image is simulated, with line, key, problem and fix."""

import pytest

from datasets.small_dataset import write_small
from insonify.datasets.dataset import load_dataset
from insonify.scenario.diagnostic import ScenarioError

HEADING = "targets[pipe].heading: {uniform: [0 deg, 360 deg]}"


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        ((HEADING, "surface.wind_spedd: {uniform: [0, 9]}"), [":6:", "wind_spedd", "did you mean 'wind_speed'"]),
        ((HEADING, "targets[pip].heading: {uniform: [0, 1]}"), [":6:", "'pip'", "did you mean 'pipe'"]),
        ((HEADING, "targets[pipe].burial: {uniform: [0, 1.5]}"), [":6:", "1.5 is out of range", "(0 to 1)"]),
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
