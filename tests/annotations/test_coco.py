"""Claims about files of COCO, read by pycocotools."""

import contextlib
import io
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from insonify.annotations import CLASSES, ClassNames, merge_coco, write_coco
from insonify.annotations.annotation import GAP, about, annotations
from insonify.annotations.run_length import compressed_run_lengths
from insonify.formats.store_description import StoreError
from oracles.labelled import labelled_image

mask_api = pytest.importorskip("pycocotools.mask")


def opened(path):
    """File of annotations as pycocotools indexes it, without its prints."""
    from pycocotools.coco import COCO

    with contextlib.redirect_stdout(io.StringIO()):
        return COCO(str(path))


@given(arrays(bool, st.tuples(st.integers(1, 40), st.integers(1, 40))))
@settings(deadline=None)
def test_masks_return_bit_by_bit(mask):
    """Compressed run lengths are those of pycocotools itself, which decodes them to the same mask."""
    ours = compressed_run_lengths(mask)
    theirs = mask_api.encode(np.asfortranarray(mask, np.uint8))
    assert ours == {"size": theirs["size"], "counts": theirs["counts"].decode()}
    np.testing.assert_array_equal(mask_api.decode(ours), mask)


@pytest.mark.parametrize("shape", [(3000, 2000), (1, 100_000)])
def test_long_runs_return_as_well(shape):
    """Runs of millions of cells, as in the shadow of a large image, take several groups of bits."""
    mask = np.zeros(shape, bool)
    mask[:, shape[1] // 3 : -7] = True
    np.testing.assert_array_equal(mask_api.decode(compressed_run_lengths(mask)), mask)


@pytest.mark.parametrize("kind", ["bbox", "segm"])
def test_the_truth_detects_itself(tmp_path, kind):
    """COCOeval of the annotations as detections of full score has an average precision of 1."""
    from pycocotools.cocoeval import COCOeval

    truth = opened(write_coco([labelled_image(seed, index=seed) for seed in range(4)], tmp_path))
    assert len(truth.getAnnIds()) > 20
    detections = [{**entry, "score": 1.0} for entry in truth.dataset["annotations"]]
    with contextlib.redirect_stdout(io.StringIO()):
        result = COCOeval(truth, truth.loadRes(detections), kind)
        result.evaluate()
        result.accumulate()
        result.summarize()
    assert result.stats[0] == 1.0 and result.stats[8] == 1.0  # precision; recall of up to 100 detections


def test_entries_describe_their_masks(tmp_path):
    """Decoded masks are the layers of the image; areas and boxes are those of pycocotools; classes have their names."""
    image = labelled_image(5, index=7)
    truth = opened(write_coco([image], tmp_path))
    assert [entry["name"] for entry in truth.loadCats(truth.getCatIds())] == list(CLASSES)
    masks = np.zeros(image.layers.shape, np.int32)
    for entry in truth.dataset["annotations"]:
        cells = truth.annToMask(entry).astype(bool)
        assert not masks[entry["category_id"] - 1][cells].any()  # parts of one class do not overlap
        masks[entry["category_id"] - 1][cells] = 1 + image.instance_names.index(entry["target"])
        assert entry["area"] == mask_api.area(entry["segmentation"])
        assert entry["bbox"] == mask_api.toBbox(entry["segmentation"]).tolist()
    np.testing.assert_array_equal(masks, image.layers)


@pytest.mark.parametrize(("gap", "count"), [(GAP, 1), (GAP + 1, 2)])
@pytest.mark.parametrize("turned", [False, True])
def test_distant_parts_are_annotations_of_their_own(gap, count, turned):
    """Two sightings of a target are one annotation up to some empty cells between them, along either axis."""
    layers = np.zeros((3, 60, 60), np.int32)
    layers[0, 20:23, 10:20] = layers[0, 23 + gap : 30 + gap, 12:14] = 1
    layers = layers.transpose(0, 2, 1) if turned else layers
    found = list(annotations(labelled_image(shape=(60, 60), layers=layers)))
    assert [part.area for part in found] == ([44] if count == 1 else [30, 14])
    np.testing.assert_array_equal(sum(part.mask((60, 60)) for part in found), layers[0])


def test_parts_merge_to_the_whole(tmp_path):
    """Numbers do not depend on the parts: any division, in any order, merges to the bytes of the whole."""
    images = [labelled_image(seed, index=seed, targets=seed) for seed in range(5)]
    whole = write_coco(images, tmp_path / "whole").read_bytes()
    for cut in ([[0, 1, 2, 3, 4]], [[3, 4], [0], [1, 2]], [[4], [3], [2], [1], [0]], [[0, 1, 2], [2, 3, 4]]):
        parts = [
            write_coco([images[row] for row in rows], tmp_path / "parts", file=f"{number}.json")
            for number, rows in enumerate(cut)
        ]
        assert merge_coco(parts, tmp_path / "merged.json").read_bytes() == whole
    numbers = [entry["id"] for entry in json.loads(whole)["annotations"]]
    assert len(set(numbers)) == len(numbers) and min(numbers) > 0
    other = write_coco([labelled_image(9, index=0, name="another")], tmp_path / "other")
    with pytest.raises(StoreError, match="image 0 is images/another"):
        merge_coco([tmp_path / "merged.json", other], tmp_path / "no.json")


def test_classes_of_targets_are_those_of_their_highlights(tmp_path):
    """Highlights have the class of their target, shadows and ghosts their own; others are not merged with them."""
    names = ClassNames(
        ("mine", "rock", "shadow", "ghost"), {"target 0": "rock", "target 1": "mine", "target 2": "rock"}
    )
    image = labelled_image(5, index=7, class_names=names)
    file = write_coco([image], tmp_path)
    truth = opened(file)
    assert [entry["name"] for entry in truth.loadCats(truth.getCatIds())] == list(names.names)
    for row, part in enumerate(CLASSES):
        for number, target in enumerate(image.instance_names, start=1):
            kind = names.names.index(names.of_label[target] if row == 0 else part) + 1
            entries = truth.loadAnns(truth.getAnnIds(catIds=[kind]))
            masks = [truth.annToMask(entry).astype(bool) for entry in entries if entry["target"] == target]
            np.testing.assert_array_equal(np.any(masks, axis=0), image.layers[row] == number)
    other = write_coco([labelled_image(9, index=1)], tmp_path / "other")
    with pytest.raises(StoreError, match="its classes are not those"):
        merge_coco([file, other], tmp_path / "no.json")


def test_a_map_has_the_classes_of_targets():
    """A cell of a label map has the number of its highlight's target, else of ghost or shadow."""
    names = ClassNames(
        ("mine", "rock", "shadow", "ghost"), {"target 0": "rock", "target 1": "mine", "target 2": "rock"}
    )
    image = labelled_image(5, class_names=names)
    bare = labelled_image(5)
    highlights = np.array([0, 2, 1, 2])[image.layers[0]]
    np.testing.assert_array_equal(
        image.classes, np.where(highlights > 0, highlights, np.array([0, 0, 3, 4])[bare.classes])
    )


def test_an_image_without_targets_is_valid(tmp_path):
    """No target, or a mask that is too small: the image is listed, without annotations, and pycocotools opens it."""
    for number, image in enumerate([labelled_image(targets=0), labelled_image(targets=2)]):
        truth = opened(write_coco([image], tmp_path / str(number), least_area=10_000))
        assert truth.getImgIds() == [0] and truth.getAnnIds() == []


def test_contrast_is_that_to_the_bare_surroundings():
    """A ghost 7 dB above a uniform image has 7 dB whatever is around; the shadow under it counts where it is bare."""
    expected = np.full((60, 60), -30.0, np.float32)
    layers = np.zeros((3, 60, 60), np.int32)
    layers[2, 20:30, 20:30], layers[1, 25:40, 20:40] = 1, 2
    expected[25:40, 20:40], expected[20:30, 20:30], expected[:, :19] = -60.0, -23.0, np.nan
    image = labelled_image(shape=(60, 60), layers=layers, expected=expected)
    assert [about(image, part)["contrast_db"] for part in annotations(image)] == [7.0, -30.0]
    full = labelled_image(shape=(60, 60), layers=np.ones((3, 60, 60), np.int32))
    assert about(full, next(annotations(full)))["contrast_db"] is None
