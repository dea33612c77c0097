"""Classes of a data set: highlights have the shape or the label of their target, by one list in all formats."""

import contextlib
import io
import json

import numpy as np
import pytest
import yaml

import insonify
from datasets.small_dataset import write_small
from insonify.datasets.dataset import load_dataset, make_dataset
from insonify.datasets.dataset_classes import dataset_class_names
from insonify.diagnostics.diagnostic import ScenarioError

PIPE = "  - {shape: cylinder, label: pipe, position: [1 m, 12 m], length: 3 m, diameter: 1 m}\n"
TWO = ((PIPE, f"{PIPE}  - {{shape: manta, label: old mine, position: [3.5 m, 9 m], size: [1.5 m, 1.5 m, 1 m]}}\n"),)
VARIED = """
  targets[old mine].name: {choice: [manta, rockan, tyre]}
clutter: [{count: 1, target: {shape: rock, size: [1 m, 1 m, 1 m]}, position: {across: [14 m, 16 m]}}]
pairs: [no_target]
write: [coco, yolo, png]
"""
POSITION = ("  targets[pipe].position: {uniform_in: {area: swath, along: [0.3, 0.7], across: [9 m, 13 m]}}\n", "")
NAMES = {
    "parts": ["highlight", "shadow", "ghost"],
    "shapes": ["cylinder", "manta", "rockan", "tyre", "rock", "shadow", "ghost"],
    "labels": ["pipe", "old mine", "rock", "shadow", "ghost"],
}


def described(folder, classes, *, scene=TWO, more=VARIED, write="\nwrite: [coco]"):
    """File of a data set with some classes, a shape that varies, clutter and twins."""
    return write_small(
        folder, ("images: 4, seed: 7", f"images: 2, seed: 7, classes: {classes}"), POSITION, (write, more), scene=scene
    )


def categories_of(path):
    """Entries of COCO files with the names of their classes, read by pycocotools."""
    coco = pytest.importorskip("pycocotools.coco").COCO
    with contextlib.redirect_stdout(io.StringIO()):
        read = coco(str(path))
    names = {entry["id"]: entry["name"] for entry in read.loadCats(read.getCatIds())}
    shown = {
        entry["id"]: entry["file_name"].split("/")[1].removesuffix(".png") for entry in read.loadImgs(read.getImgIds())
    }
    entries = read.loadAnns(read.getAnnIds())
    return list(names.values()), [(shown[entry["image_id"]], names[entry["category_id"]], entry) for entry in entries]


@pytest.mark.parametrize("classes", NAMES)
def test_all_formats_have_the_classes_of_the_targets(tmp_path, classes):
    """COCO, YOLO, label maps and card have one list of names; a highlight has the class of the target drawn there."""
    from PIL import Image

    assert make_dataset(described(tmp_path, classes), tmp_path / "out", processes=1)
    notes = [json.loads(file.read_text()) for file in (tmp_path / "out/scenes").iterdir()]
    drawn = {image["name"]: note["drawn"]["targets[old mine].name"] for note in notes for image in note["images"]}
    content = yaml.safe_load((tmp_path / "out/yolo/data.yaml").read_text())
    assert content["names"] == dict(enumerate(NAMES[classes]))
    found = set()
    for split in ("train", "val"):
        names, entries = categories_of(tmp_path / f"out/coco/annotations_{split}.json")
        assert names == NAMES[classes]
        maps = json.loads((tmp_path / f"out/png/{split}/names.json").read_text())["classes"]
        assert maps == ["background", *NAMES[classes]]
        lines = {name: (tmp_path / f"out/yolo/labels/{split}/{name}.txt").read_text().splitlines()
                 for name in {image for image, _, _ in entries}}  # fmt: skip
        for image, name, entry in entries:
            shape = {"pipe": "cylinder", "old mine": drawn[image]}.get(entry["target"], "rock")
            label = entry["target"].removesuffix(" 1")
            own = {"parts": "highlight", "shapes": shape, "labels": label}[classes]
            assert entry["shape"] == shape and name in (own, "shadow")
            assert names[int(lines[image].pop(0).split()[0])] == name  # in the order of COCO
            cells = np.asarray(Image.open(tmp_path / f"out/png/{split}/classes/{image}.png"))
            column, row, width, height = map(int, entry["bbox"])
            shown = {maps[number] for number in np.unique(cells[row : row + height, column : column + width])}
            assert name in shown or name == "shadow"
            found.add(name)
        assert not any(lines.values())
    card = json.loads((tmp_path / "out/card.json").read_text())
    assert list(card["annotations"]) == NAMES[classes]
    assert {name for name, count in card["annotations"].items() if count} == found > {"shadow"}


def test_training_loops_have_the_names(tmp_path):
    """Numbers in arrays are those of the names that come with them, the same in all images and twins."""
    items = list(insonify.dataset(described(tmp_path, "shapes"), threads=1))
    for item in items:
        assert item["class_names"] == tuple(NAMES["shapes"])
        shapes = {target.label: getattr(target, "name", target.shape) for target in item["scenario"].targets}
        numbers = set(np.unique(item["classes"])) - {0, NAMES["shapes"].index("shadow") + 1}
        assert {item["class_names"][number - 1] for number in numbers} <= set(shapes.values())


@pytest.mark.parametrize(
    ("more", "shapes", "labels"),
    [
        ("\n  targets[0]: {choice: [{shape: drum, position: [1, 12]}, {shape: box, label: crate, position: [1, 12], "
         "size: [1, 1, 1]}]}", ["cylinder", "manta", "drum", "box"], ["pipe", "old mine", "drum", "crate"]),
        ("\n  targets[0].label: {choice: [pipe, tube]}", ["cylinder", "manta"], ["pipe", "old mine", "tube"]),
        ("\nclutter: [{count: 1, target: {shape: library, name: {choice: [tyre, rock]}}}]",
         ["cylinder", "manta", "tyre", "rock"], ["pipe", "old mine", "clutter"]),
    ],
)  # fmt: skip
def test_all_that_may_be_drawn_has_a_class(tmp_path, more, shapes, labels):
    """Whole targets, labels and clutter that a distribution may give are classes before any of them is drawn."""
    for classes, names in (("shapes", shapes), ("labels", labels)):
        made = load_dataset(described(tmp_path, classes, more=more))
        assert dataset_class_names(made.file, made.base) == (*names, "shadow", "ghost")


def test_unknown_and_ambiguous_classes_are_refused(tmp_path):
    """An unknown kind of classes is refused with those there are; a target with the label of a class, with the fix."""
    with pytest.raises(ScenarioError, match=r"dataset.classes.*parts.*shapes.*labels"):
        load_dataset(described(tmp_path, "targets"))
    shadow = (("label: old mine", "label: shadow"),)
    edits = [("seed: 7", "seed: 7, classes: labels"), POSITION]
    with pytest.raises(ScenarioError, match=r":2: dataset.classes: 'shadow' is a target's label.*another label"):
        load_dataset(write_small(tmp_path, *edits, scene=(*TWO, *shadow)))
