"""Claims about labelled images as such: strongest classes, tiles, votes of lines, gains, recordings without targets."""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.annotations import labelled_images, write_coco, write_label_maps, write_yolo
from insonify.annotations.annotation import annotations
from insonify.annotations.labelled_image import NO_TARGET
from insonify.annotations.mosaic import _elected
from insonify.annotations.waterfalls import line_spans
from insonify.formats.store_description import StoreError
from insonify.processing.gain import tvg_db
from insonify.recording_run import record
from oracles.labelled import labelled_image
from oracles.surveys import sidescan


@given(st.integers(1, 3000), st.integers(1, 700))
def test_parts_of_lines_cover_them_in_one_size(count, size):
    """Each line is in a part; all parts have the size requested, or the whole.

    None overlaps more than one before it.
    """
    parts = line_spans(count, size)
    assert {part.stop - part.start for part in parts} == {min(size, count)}
    assert parts[0].start == 0 and parts[-1].stop == count and len(parts) == -(-count // size)
    assert all(low.start < high.start <= low.stop for low, high in itertools.pairwise(parts))


def test_a_shadow_of_the_seabed_is_in_the_map_without_a_target():
    """Class 2, instance 0, and no annotation: dunes shade themselves a thousand times."""
    layers = np.zeros((3, 20, 20), np.int32)
    layers[1, 5:9, 4:12] = NO_TARGET
    layers[0, 15, 15] = 1
    image = labelled_image(shape=(20, 20), layers=layers)
    assert (image.classes[5:9, 4:12] == 2).all() and (image.instances[5:9, 4:12] == 0).all()
    assert [part.kind for part in annotations(image)] == [1]


def test_a_part_of_a_part_keeps_its_place():
    """Cut twice, a tile has the cells, the axes, the pings and the name of its place in the whole image."""
    whole = labelled_image(2, shape=(50, 70))
    tile = whole.part(slice(10, 40), slice(20, 60), 3).part(slice(5, 15), slice(8, 28), 4)
    assert tile.offset == (15, 28) and tile.index == 4 and tile.name.endswith("_row00015_column00028")
    np.testing.assert_array_equal(tile.image, whole.image[15:25, 28:48])
    np.testing.assert_array_equal(tile.classes, whole.classes[15:25, 28:48])
    np.testing.assert_array_equal(tile.pings, whole.pings[15:25])
    np.testing.assert_array_equal(tile.columns.values, whole.columns.values[28:48])


def test_half_of_the_lines_elect_the_target_of_most():
    """A cell joins a mask by half of its lines or more, and belongs to the target with most of their votes."""
    lines = np.array([[4, 4, 4, 0]], np.int32)
    cast = [(0, 1), (0, 1), (1, 2), (2, 1), (2, 2), (2, 2)]  # cell and instance
    votes = [np.array([cell * 5 + instance + 1]) for cell, instance in cast]
    assert _elected(votes, 5, lines).tolist() == [[1, 0, 2, 0]]
    assert not _elected([], 5, lines).any()


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """Two labelled pings over a flat bed without targets."""
    track = {"heading": 0.0, "start": (0.0, 0.0, 6.0), "window": (0.0, 0.02), "motion": {}}
    return record(sidescan(pings=2, track=track), tmp_path_factory.mktemp("bare") / "b.zarr", with_labels=True)


@pytest.mark.parametrize("projection", ["slant", "ground", "mosaic"])
def test_a_recording_without_targets_gives_valid_files(bare, tmp_path, projection):
    """The image is listed, without annotations; maps are zero."""
    (image,) = labelled_images(bare, projection)
    entry = json.loads(write_coco([image], tmp_path).read_text())
    assert len(entry["images"]) == 1 and entry["annotations"] == [] and image.has_samples
    write_yolo([image], tmp_path / "yolo", segments=True)
    write_label_maps([image], tmp_path / "maps")
    assert not image.classes.any() and not image.instances.any() and image.views == {}


def test_gain_is_that_of_the_law_on_both_levels(bare):
    """Recorded and expected levels rise by the law of spreading and absorption alone; an unknown law is refused."""
    (plain,), (gained,) = (labelled_images(bare, gain=gain) for gain in ("none", "tvg40"))
    slant = np.abs(plain.columns.values)
    absorption = float(sidescan().water.absorption(300e3))
    for low, high in ((plain.image, gained.image), (plain.expected, gained.expected)):
        known = np.isfinite(low).all(axis=0) & (slant > 0)
        expected = np.broadcast_to(tvg_db(slant, 40.0, absorption_db_per_m=absorption), low.shape)
        np.testing.assert_allclose((high - low)[:, known], expected[:, known], atol=1e-3)
    with pytest.raises(StoreError, match="tvg20"):
        labelled_images(bare, gain="strong")


def test_expected_levels_are_the_mean_of_the_recorded_ones(bare):
    """Of an incoherent recording without noise in the samples both are the same, within the errors of the sampling."""
    (image,) = labelled_images(bare)
    inside = np.abs(image.columns.values) > 6
    assert abs(np.median((image.image - image.expected)[:, inside])) < 0.5
