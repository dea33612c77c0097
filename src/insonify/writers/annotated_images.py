"""Images of a recording with the annotations of its targets, in the layouts that detectors are trained on."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

from insonify.annotations import coco, label_maps, yolo
from insonify.annotations.class_names import ClassScheme
from insonify.annotations.labelled_image import Projection
from insonify.annotations.labelled_images import Tile, labelled_images
from insonify.surveys.survey import Survey


def _write(
    layout: Callable[..., Any], survey: Survey, path: Path, projection: Projection = "slant", tile: Tile | None = None,
    classes: ClassScheme = "parts",
) -> None:  # fmt: skip
    """Write images of a survey with labels into a folder, on a grid and cut in tiles, in one layout."""
    layout(labelled_images(survey, projection, tile, classes=classes), path)


write_coco = partial(_write, coco.write_coco)
write_yolo = partial(_write, yolo.write_yolo)
write_yolo_segments = partial(_write, partial(yolo.write_yolo, segments=True))
write_maps = partial(_write, label_maps.write_label_maps)
write_geotiff_maps = partial(_write, partial(label_maps.write_label_maps, form="tif"))
"""Writers of COCO, of boxes and outlines for YOLO, and of label maps as PNG and GeoTIFF: survey and folder to write."""
