"""Images of a recording with the annotations of its targets, in the layouts that detectors are trained on."""

from pathlib import Path

from insonify.annotations import coco, label_maps, yolo
from insonify.annotations.labelled_image import Projection
from insonify.annotations.labelled_images import Tile, labelled_images
from insonify.surveys.survey import Survey


def write_coco(survey: Survey, path: Path, projection: Projection = "slant", tile: Tile | None = None) -> None:
    """Write masks and boxes in the layout of COCO.

    Args:
        survey: Recording with labels, in its folder.
        path: Folder to write.
        projection: Grid of the images.
        tile: Rows and columns of a tile; None: not cut.
    """
    coco.write_coco(labelled_images(survey, projection, tile), path)


def write_yolo(survey: Survey, path: Path, projection: Projection = "slant", tile: Tile | None = None) -> None:
    """Write boxes in the layout of YOLO, as `write_coco`."""
    yolo.write_yolo(labelled_images(survey, projection, tile), path)


def write_yolo_segments(survey: Survey, path: Path, projection: Projection = "slant", tile: Tile | None = None) -> None:
    """Write outlines in the layout of YOLO, as `write_coco`."""
    yolo.write_yolo(labelled_images(survey, projection, tile), path, segments=True)


def write_maps(survey: Survey, path: Path, projection: Projection = "slant", tile: Tile | None = None) -> None:
    """Write label maps as PNG, as `write_coco`."""
    label_maps.write_label_maps(labelled_images(survey, projection, tile), path)


def write_geotiff_maps(survey: Survey, path: Path, projection: Projection = "slant", tile: Tile | None = None) -> None:
    """Write label maps as GeoTIFF, as `write_coco`."""
    label_maps.write_label_maps(labelled_images(survey, projection, tile), path, form="tif")
