"""Label maps: the class and the target of each cell, as PNG or GeoTIFF."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

import numpy as np

from insonify.annotations.class_names import CLASSES
from insonify.annotations.grey_picture import Span, write_grey, write_png
from insonify.annotations.labelled_image import LabelledImage
from insonify.surveys.raster import write_bands

FILE = "classes.json"
MAPS = ("images", "classes", "instances")


def write_label_maps(
    images: Iterable[LabelledImage], directory: str | Path, *, form: Literal["png", "tif"] = "png",
    span: Span | None = None,
) -> Path:  # fmt: skip
    """Write images with a map of the class and one of the target of each cell.

    Parts of a data set may be written into one folder.

    Args:
        images: The images; each has a `name` of its own.
        directory: Folder of the data set, made if there is none, with the folders `images`, `classes` (8 bits) and
            `instances` (16 bits). The names of classes are in classes.json; those of the instances of an image are in
            the folder `names`.
        form: "png" for grey pictures; "tif" for GeoTIFF, whose images are recorded and expected levels [dB], unrounded,
            and mosaics have their coordinates. This needs rasterio.
        span: Levels of the darkest grey and of white of a PNG [dB]; None: of each image alone.

    Returns:
        The file classes.json.
    """
    folder = Path(directory)
    for kind in (*MAPS, "names"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    class_names = CLASSES
    for image in images:
        class_names = image.class_names.names
        files = [folder / kind / f"{image.name}.{form}" for kind in MAPS]
        classes, instances = image.classes, image.instances.astype(np.uint16)
        if form == "tif":
            georeference = (image.crs, image.transform) if image.crs else None
            levels = {"recorded level": image.image, "expected level": image.expected}
            write_bands(files[0], georeference, levels, ("dB re 1 uPa",) * 2)
            write_bands(files[1], georeference, {"class": classes})
            write_bands(files[2], georeference, {"target": instances})
        else:
            write_grey(image, files[0], span)
            write_png(files[1], classes)
            write_png(files[2], instances)
        names = json.dumps(dict(enumerate(image.instance_names, start=1)))
        (folder / "names" / f"{image.name}.json").write_text(names, encoding="utf-8")
    file = folder / FILE
    file.write_text(json.dumps(dict(enumerate(("background", *class_names)))), encoding="utf-8")
    return file
