"""Label maps: the class and the target of each cell, as PNG or GeoTIFF."""

import json
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from insonify.annotations.grey_picture import Span, write_grey, write_png
from insonify.annotations.labelled_image import CLASSES, LabelledImage


def write_label_maps(images: Iterable[LabelledImage], directory: str | Path, *, span: Span | None = None) -> Path:
    """Write images with a map of the class and one of the target of each cell.

    Args:
        images: The images; each has a `name` of its own.
        directory: Folder of the data set, made if there is none, with the folders `images`, `classes` (8 bits) and
            `instances` (16 bits), and the names of their numbers in names.json.
        span: Levels of the darkest grey and of white [dB]; None: of each image alone.

    Returns:
        The file names.json.
    """
    folder = Path(directory)
    for kind in ("images", "classes", "instances"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    names = dict[str, list[str]]()
    for image in images:
        write_grey(image, folder / "images" / f"{image.name}.png", span)
        write_png(folder / "classes" / f"{image.name}.png", image.classes)
        write_png(folder / "instances" / f"{image.name}.png", image.instances.astype(np.uint16))
        names[image.name] = list(image.instance_names)
    file = folder / "names.json"
    known = json.loads(file.read_text(encoding="utf-8"))["instances"] if file.is_file() else {}
    content = {"classes": ["background", *CLASSES], "instances": dict(sorted((known | names).items()))}
    file.write_text(json.dumps(content), encoding="utf-8")
    return file
