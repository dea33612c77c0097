"""YOLO: images, a text file of boxes or outlines of each, and data.yaml."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import yaml

from insonify.annotations.annotation import annotations
from insonify.annotations.class_names import CLASSES
from insonify.annotations.grey_picture import Span, write_grey
from insonify.annotations.labelled_image import LabelledImage
from insonify.annotations.outline import outline

FILE = "data.yaml"


def write_yolo(
    images: Iterable[LabelledImage], directory: str | Path, *, segments: bool = False, split: str = "train",
    span: Span | None = None, least_area: int = 1,
) -> Path:  # fmt: skip
    """Write images and their annotations in the layout of YOLO: class, box or outline, relative to the image's size.

    Parts of a data set may be written into one folder, or merged by copying their files together.

    Args:
        images: The images; each has a `name` of its own.
        directory: Folder of the data set, made if there is none.
        segments: True for outlines of masks, False for boxes.
        split: Name of the part of the data set: train, val or test.
        span: Levels of the darkest grey and of white [dB]; None: of each image alone.
        least_area: Least area of a mask [cells].

    Returns:
        The file data.yaml.
    """
    folder = Path(directory)
    for kind in ("images", "labels"):
        (folder / kind / split).mkdir(parents=True, exist_ok=True)
    names = CLASSES
    for image in images:
        names = image.class_names.names
        write_grey(image, folder / "images" / split / f"{image.name}.png", span)
        text = "".join(f"{line}\n" for line in _lines(image, segments, least_area))
        (folder / "labels" / split / f"{image.name}.txt").write_text(text, encoding="utf-8")
    return write_yolo_data(folder, names)


def write_yolo_data(directory: str | Path, names: Sequence[str]) -> Path:
    """Write data.yaml of the splits that a folder has.

    Args:
        directory: Folder of the data set.
        names: Names of the classes.
    """
    folder = Path(directory)
    splits = sorted(entry.name for entry in (folder / "images").iterdir() if entry.is_dir())
    paths = {split: f"images/{split}" for split in splits}
    paths.setdefault("val", next(iter(paths.values())))  # both are required of every data set
    paths.setdefault("train", paths["val"])
    content = {**paths, "names": dict(enumerate(names))}  # without `path` they are relative to the folder of the file
    file = folder / FILE
    file.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return file


def _lines(image: LabelledImage, segments: bool, least_area: int) -> list[str]:
    """Lines of the annotations of an image."""
    rows, columns = image.image.shape
    lines = list[str]()
    for annotation in annotations(image, least_area):
        if segments:
            numbers = ((outline(annotation.inside) + annotation.box[:2]) / [columns, rows]).ravel().tolist()
        else:
            left, upper, width, height = annotation.box
            numbers = [(left + width / 2) / columns, (upper + height / 2) / rows, width / columns, height / rows]
        class_number = image.class_number(annotation.kind - 1, annotation.instance)
        lines.append(" ".join([str(class_number - 1), *(f"{number:.8g}" for number in numbers)]))
    return lines
