"""Claims about files of YOLO: boxes are those of COCO, outlines those of the masks."""

import json

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from matplotlib.path import Path as Polygon

from insonify.annotations import CLASSES, write_coco, write_yolo
from insonify.annotations.outline import outline
from oracles.labelled import labelled_image


def inside(corners, shape):
    """Cells whose middles are inside of a polygon by an odd number of crossings to the left."""
    rows, columns = np.indices(shape) + 0.5
    first, last = corners, np.roll(corners, -1, axis=0)
    crossed = np.zeros(shape, int)
    for (x1, y1), (x2, y2) in zip(first, last, strict=True):
        if y1 != y2:
            at_row = (rows > min(y1, y2)) & (rows < max(y1, y2))
            crossed += at_row & (columns > x1 + (rows - y1) * (x2 - x1) / (y2 - y1))
    return crossed % 2 == 1


@given(arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12))).filter(np.any))
@settings(deadline=None)
def test_filling_an_outline_gives_the_mask(mask):
    """Holes, parts that touch at a corner and separate parts included; corners lie on edges of cells."""
    corners = outline(mask)
    np.testing.assert_array_equal(corners, np.round(corners))
    np.testing.assert_array_equal(inside(corners, mask.shape), mask)


def test_an_outline_of_a_rectangle_has_four_corners():
    """Straight edges have no corners between; a polygon filled by matplotlib holds the same cells."""
    mask = np.zeros((6, 9), bool)
    mask[1:4, 2:8] = True
    corners = outline(mask)
    assert sorted(map(tuple, corners.tolist())) == [(2, 1), (2, 4), (8, 1), (8, 4)]
    middles = np.stack(np.indices(mask.shape)[::-1], axis=-1).reshape(-1, 2) + 0.5
    np.testing.assert_array_equal(Polygon(corners).contains_points(middles).reshape(mask.shape), mask)


@pytest.mark.parametrize("segments", [False, True])
def test_boxes_are_those_of_coco(tmp_path, segments):
    """Centre and size times the image's size are the boxes of COCO, in their order; outlines have the same extent."""
    images = [labelled_image(seed, index=seed, targets=seed) for seed in range(4)]
    truth = json.loads(write_coco(images, tmp_path / "coco").read_text())
    write_yolo(images, tmp_path / "yolo", segments=segments)
    for image in images:
        entries = [entry for entry in truth["annotations"] if entry["image_id"] == image.index]
        lines = (tmp_path / "yolo/labels/train" / f"{image.name}.txt").read_text().splitlines()
        assert len(lines) == len(entries)
        for line, entry in zip(lines, entries, strict=True):
            kind, *numbers = map(float, line.split())
            size = image.image.shape[::-1]
            pairs = np.reshape(numbers, (-1, 2)) * size
            low, high = (pairs.min(0), pairs.max(0)) if segments else (pairs[0] - pairs[1] / 2, pairs[0] + pairs[1] / 2)
            assert kind + 1 == entry["category_id"]
            np.testing.assert_allclose([*low, *(high - low)], entry["bbox"], atol=1e-5)
            assert min(numbers) >= 0 and max(numbers) <= 1


def test_data_yaml_lists_splits_and_classes(tmp_path):
    """Splits written one after the other are listed together; an image without targets has an empty text file."""
    write_yolo([labelled_image(1)], tmp_path)
    file = write_yolo([labelled_image(2, targets=0, index=1)], tmp_path, split="val")
    content = yaml.safe_load(file.read_text())
    assert content["names"] == dict(enumerate(CLASSES))
    assert (content["train"], content["val"]) == ("images/train", "images/val")
    assert "path" not in content  # readers take a relative one as in a folder of their own, none as the file's
    assert (tmp_path / "labels/val/image001.txt").read_text() == ""
    assert (tmp_path / "images/val/image001.png").is_file()
