"""COCO: images, and one file of their masks and boxes."""

import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from insonify.annotations.annotation import about, annotations
from insonify.annotations.class_names import CLASSES
from insonify.annotations.grey_picture import Span, write_grey
from insonify.annotations.labelled_image import LabelledImage
from insonify.annotations.run_length import compressed_run_lengths
from insonify.formats.store_description import StoreError

FILE = "annotations.json"


def write_coco(
    images: Iterable[LabelledImage], directory: str | Path, *, span: Span | None = None, least_area: int = 1,
    file: str = FILE,
) -> Path:  # fmt: skip
    """Write images and their annotations in the layout of COCO.

    Numbers of images and annotations follow from the number of the image and the target, so that files of parts can
    be merged by `merge_coco`.

    Args:
        images: The images; each has an `index` of its own.
        directory: Folder of the data set, made if there is none; pictures go to `images` in it.
        span: Levels of the darkest grey and of white [dB]; None: of each image alone, which its entry states.
        least_area: Least area of a mask [cells].
        file: Name of the file of annotations.

    Returns:
        The file of annotations.
    """
    folder = Path(directory)
    (folder / "images").mkdir(parents=True, exist_ok=True)
    content = empty_coco()
    for image in images:
        content["categories"] = _categories(image.class_names.names)
        used = write_grey(image, folder / "images" / f"{image.name}.png", span)
        content["images"].append(_image_entry(image, used))
        content["annotations"].extend(_annotation_entries(image, least_area))
    return _write(content, folder / file)


def merge_coco(files: Sequence[str | Path], path: str | Path) -> Path:
    """Merge files of annotations of parts of one data set.

    Args:
        files: Files of the parts.
        path: File to write; the same for the same images in any parts.

    Returns:
        The path.

    Raises:
        StoreError: Two parts have different images of one number.
    """
    content, images = empty_coco(), dict[int, Any]()
    categories = dict[str, Any]()
    annotated = dict[int, Any]()
    for name in files:
        part = json.loads(Path(name).read_text(encoding="utf-8"))
        if part["images"] and categories.setdefault("categories", part["categories"]) != part["categories"]:
            raise StoreError(f"{name}: its classes are not those of another part. Make all parts of one data set")
        for entry in part["images"]:
            known = images.setdefault(entry["id"], entry)
            if known != entry:
                raise StoreError(f"{name}: image {entry['id']} is {entry['file_name']}, and {known['file_name']} in "
                                 "another part. Make all parts of one data set")  # fmt: skip
        annotated |= {entry["id"]: entry for entry in part["annotations"]}
    content |= categories
    content["images"] = [images[number] for number in sorted(images)]
    content["annotations"] = [annotated[number] for number in sorted(annotated)]
    return _write(content, Path(path))


def empty_coco(names: Sequence[str] = CLASSES) -> dict[str, Any]:
    """Content of a file of annotations of no images.

    Args:
        names: Names of the classes.
    """
    from importlib.metadata import version

    return {
        "info": {"description": "simulated sonar images", "version": f"insonify {version('insonify')}"},
        "licenses": [], "categories": _categories(names), "images": [], "annotations": [],
    }  # fmt: skip


def _categories(names: Sequence[str]) -> list[dict[str, Any]]:
    return [{"id": number, "name": name, "supercategory": "target"} for number, name in enumerate(names, 1)]


def _write(content: dict[str, Any], path: Path) -> Path:
    partial = path.with_name(f".{path.name}.partial")
    partial.write_text(json.dumps(content, allow_nan=False), encoding="utf-8")
    os.replace(partial, path)
    return path


def _image_entry(image: LabelledImage, span: Span) -> dict[str, Any]:
    """Entry of an image, with its grid and conditions in further fields."""
    rows, columns = image.image.shape
    axes = {
        f"{name}_axis": {
            "name": axis.name, "units": axis.units, "first": float(axis.values[0]), "last": float(axis.values[-1]),
        }
        for name, axis in (("row", image.rows), ("column", image.columns))
    }  # fmt: skip
    return {
        "id": image.index, "file_name": f"images/{image.name}.png", "width": columns, "height": rows,
        "projection": image.projection, **axes, "offset": list(image.offset), "crs": image.crs,
        "level_span_db": list(span), **image.conditions,
    }  # fmt: skip


def _annotation_entries(image: LabelledImage, least_area: int) -> list[dict[str, Any]]:
    return [
        {
            "id": annotation.number, "image_id": image.index, "iscrowd": 0,
            "category_id": image.class_number(annotation.kind - 1, annotation.instance),
            "bbox": [float(number) for number in annotation.box], "area": annotation.area,
            "segmentation": compressed_run_lengths(annotation.mask(image.image.shape)), **about(image, annotation),
        }
        for annotation in annotations(image, least_area)
    ]  # fmt: skip
