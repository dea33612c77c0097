"""Claims about exported folders of annotated images: whole or not there, and errors that give the fix."""

import json
import os

import pytest

import insonify
from insonify.cli import main
from insonify.formats.store_description import StoreError
from insonify.recording_run import record
from oracles.surveys import multibeam, sidescan

BOX = {"shape": "box", "label": "box", "position": (0.5, 9.0), "size": (1.0, 1.0, 1.0)}
TRACK = {"heading": 0.0, "start": (0.0, 0.0, 6.0), "window": (0.0, 0.02), "motion": {}}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Six labelled pings past a box, and the same pings without labels."""
    top = tmp_path_factory.mktemp("labelled")
    for name, labelled in (("a.zarr", True), ("bare.zarr", False)):
        record(sidescan(targets=[BOX], track=TRACK), top / name, with_labels=labelled, threads=1)
    return top


def export(capsys, *words):
    """Exit code and the last line of the command's output."""
    code = main(["export", *map(str, words)])
    out, err = capsys.readouterr()
    return code, (out or err).splitlines()[-1]


@pytest.mark.parametrize(
    ("words", "files"),
    [
        (("x.coco",), {"annotations.json", "images/a.png"}),
        (("x", "--as", "coco", "--projection", "mosaic"), {"annotations.json", "images/a_mosaic.png"}),
        (("x.yolo", "--projection", "ground"), {"data.yaml", "images/train/a.png", "labels/train/a.txt"}),
        (("x.yolo", "--as", "yolo-segments"), {"data.yaml", "images/train/a.png", "labels/train/a.txt"}),
        (("x.maps",), {"classes.json", "names/a.json", "images/a.png", "classes/a.png", "instances/a.png"}),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_a_folder_is_written_whole(folder, tmp_path, monkeypatch, capsys, words, files):
    """The suffix or the name chooses the layout; the command prints the folder, and leaves nothing beside it."""
    monkeypatch.chdir(tmp_path)
    assert export(capsys, folder / "a.zarr", *words) == (0, words[0])
    made = {str(path.relative_to(tmp_path / words[0])) for path in (tmp_path / words[0]).rglob("*") if path.is_file()}
    assert made == files and os.listdir(tmp_path) == [words[0]]


def test_highlights_have_the_class_of_their_target(folder, tmp_path, capsys):
    """Shapes or labels stand in place of the highlight, in the file of classes and in the map."""
    for classes, names in (("shapes", {"0": "background", "1": "box", "2": "shadow", "3": "ghost"}),
                           ("parts", {"0": "background", "1": "highlight", "2": "shadow", "3": "ghost"})):  # fmt: skip
        out = tmp_path / f"{classes}.maps"
        assert export(capsys, folder / "a.zarr", out, "--classes", classes)[0] == 0
        assert json.loads((out / "classes.json").read_text()) == names


def test_tiles_are_files_of_their_own(folder, tmp_path, capsys):
    """Rows and columns of the tile are in its name."""
    assert export(capsys, folder / "a.zarr", tmp_path / "x.maps", "--tile", "512 x 256")[0] == 0
    names = sorted(os.listdir(tmp_path / "x.maps/classes"))
    assert len(names) == 4 and names[1] == "a_row00000_column00256.png"


@pytest.mark.parametrize(
    ("source", "words", "advice"),
    [
        ("bare.zarr", ("x.coco",), "--labels"),
        ("a.zarr", ("x.coco", "--projection", "polar"), "Choose one of slant, ground, mosaic"),
        ("a.zarr", ("x.coco", "--tile", "512"), "Write rows x columns"),
        ("a.zarr", ("x.coco", "--tile", "8x8"), "at least 16 x 16"),
        ("a.zarr", ("x.coco", "--classes", "names"), "Choose one of parts, shapes, labels"),
        ("a.zarr", ("x.xtf", "--classes", "shapes"), "only annotated images have classes"),
        ("a.zarr", ("x.xtf", "--tile", "64x64"), "only annotated images have a tile"),
        ("a.zarr", ("there.coco",), "a folder that is not there yet"),
        ("a.zarr", ("x.nc", "--as", "coco"), "coco is a format of .coco"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else "",
)
def test_what_cannot_be_written_is_refused(folder, tmp_path, capsys, monkeypatch, source, words, advice):
    """Exit code 2 and one line with the remedy; a folder of that name stays as it was."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.coco").mkdir()
    code, line = export(capsys, folder / source, *words)
    assert code == 2 and advice in line
    assert os.listdir(tmp_path) == ["there.coco"] and not os.listdir(tmp_path / "there.coco")


def test_a_failure_in_the_middle_leaves_nothing(folder, tmp_path, monkeypatch):
    """A full disk at the first picture: no folder, and no part of one."""

    def full(image, path, span):
        path.write_bytes(b"PNG")
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr("insonify.annotations.coco.write_grey", full)
    with pytest.raises(OSError, match="No space"):
        insonify.export(folder / "a.zarr", tmp_path / "x.coco")
    assert os.listdir(tmp_path) == []


def test_sonars_that_suit_no_such_image_are_refused(tmp_path):
    """Elements have no beams yet, and a sonar that looks down has no ground range."""
    elements = insonify.simulate(multibeam(pings=1), threads=1)
    with pytest.raises(StoreError, match="record: beams"):
        insonify.export(elements, tmp_path / "x.coco")
    down = {"sonar.sides": None, "sonar.mounting.bearing": 0.0, "sonar.mounting.tilt": "90 deg"}
    record(sidescan(pings=2, track=TRACK).with_(down), tmp_path / "down.zarr", with_labels=True, threads=1)
    for projection in ("ground", "mosaic"):
        with pytest.raises(StoreError, match="look"):
            insonify.export(tmp_path / "down.zarr", tmp_path / "x.coco", projection=projection)
    insonify.export(tmp_path / "down.zarr", tmp_path / "x.coco")
