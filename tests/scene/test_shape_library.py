"""The library of typical targets: each has the size of its page, and a surface that encloses it."""

import numpy as np
import pytest
from pydantic import ValidationError

from insonify.scenario.load import parse_model
from insonify.scenario.write import to_yaml
from insonify.scene.mesh_file import edge_defects
from insonify.scene.scene import Scene
from insonify.scene.seabed import Seabed
from insonify.scene.shape_library import LIBRARY, PRESETS, preset_triangles
from insonify.scene.solid import body_triangles, world_triangles
from insonify.scene.target import LibraryTarget

BED = Seabed(depth=20.0)
SIZES = {
    "manta": (0.98, 0.98, 0.47),
    "cylinder_mine": (2.0, 0.6, 0.6),
    "rockan": (1.0, 0.8, 0.38),
    "drum": (0.851, 0.572, 0.572),
    "tyre": (0.632, 0.632, 0.205),
    "pipe": (12.0, 0.3238, 0.3238),
    "shell": (0.6, 0.155, 0.155),
    "bomb": (1.875, 0.38, 0.38),
    "anchor": (1.45, 0.85, 0.3),
    "wreck": (60.0, 10.0, 16.0),
}


def test_every_name_has_an_entry():
    """Names that a scenario may write, and shapes that there are, are the same list."""
    assert set(PRESETS) == set(LIBRARY)
    assert all(kind.description and kind.source for kind in LIBRARY.values())


@pytest.mark.parametrize("name", SIZES)
def test_a_shape_has_the_length_width_and_height_of_its_page(name):
    """Within the 0.05 % by which a round shape's steps cut its corners."""
    made = preset_triangles(name)
    np.testing.assert_allclose(made.high - made.low, SIZES[name], rtol=1e-3)


@pytest.mark.parametrize("name", PRESETS)
def test_every_shape_is_closed_and_looks_outwards(name):
    """No edge belongs to one face only, none is walked twice in one sense, and the volume is positive."""
    made = preset_triangles(name)
    assert edge_defects(made.faces) == (0, 0)
    assert 0.02 < made.volume / np.prod(made.high - made.low) < 1
    assert made.area.min() > 0


def test_no_two_rocks_are_alike_and_each_stays_itself():
    """Variants differ by more than a tenth of their size somewhere; the same variant comes again bit for bit."""
    first, second = preset_triangles("rock", 1), preset_triangles("rock", 2)
    assert np.abs(first.vertices - second.vertices).max() > 0.05
    preset_triangles.cache_clear()
    np.testing.assert_array_equal(preset_triangles("rock", 1).vertices, first.vertices)
    assert np.std(np.linalg.norm(first.vertices / (first.high - first.low), axis=1)) > 0.01


def test_a_shape_may_be_stretched():
    """`size` gives length, width and height as it stands in its own axes."""
    rock = LibraryTarget(name="rock", position=(0, 0), size=(3, 2, 1), variant=5)
    made = body_triangles(rock)
    np.testing.assert_allclose(made.high - made.low, [3, 2, 1])
    assert world_triangles(rock, BED).low[2] == pytest.approx(19)


def test_a_scenario_may_name_the_shape_itself():
    """`shape: drum` is the library's drum, called drum; written out it reads back as the same scene."""
    scene = parse_model(
        Scene, "targets:\n  - {shape: drum, position: [0, 5]}\n  - {shape: tyre, label: t, position: [0, 9]}"
    )
    assert scene.targets[0] == LibraryTarget(name="drum", label="drum", position=(0, 5))
    assert scene.targets[1].label == "t"
    assert parse_model(Scene, to_yaml(scene)) == scene


def test_only_rocks_have_variants_and_unknown_names_get_the_nearest():
    """What is not known is reported with what is."""
    with pytest.raises(ValidationError, match="variant: 2 is for rocks; there is one drum only"):
        LibraryTarget(name="drum", position=(0, 0), variant=2)
    with pytest.raises(ValueError, match=r"targets\.0\.name: 'rok' is not known here .* Did you mean 'rock'\?"):
        parse_model(Scene, "targets:\n  - {shape: library, name: rok, position: [0, 5]}")
