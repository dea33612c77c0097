"""Tiles of a mosaic as GeoTIFF: level, expected level, class and target of each cell."""

from pathlib import Path

import numpy as np

from insonify.annotations import LabelledImage
from insonify.surveys.raster import geotiff

BANDS = ("level with gain [dB]", "expected level with gain [dB]", "class", "target")


def write_geotiff(image: LabelledImage, path: Path) -> None:
    """Write a labelled mosaic as four bands of one file.

    Args:
        image: The image, with rows of northing and columns of easting.
        path: File to write; its folder is made.
    """
    import rasterio

    north, east = image.rows.values, image.columns.values
    step = float(east[1] - east[0])
    transform = rasterio.Affine(step, 0, east[0] - step / 2, 0, -step, north[0] + step / 2)
    path.parent.mkdir(parents=True, exist_ok=True)
    about = {
        "driver": "GTiff", "height": north.size, "width": east.size, "count": len(BANDS), "dtype": "float32",
        "crs": rasterio.crs.CRS.from_string(image.crs), "transform": transform, "compress": "deflate", "nodata": np.nan,
    }  # fmt: skip
    with geotiff(path, about) as file:
        layers = (image.image, image.expected, image.classes, image.instances)
        for number, (name, values) in enumerate(zip(BANDS, layers, strict=True), 1):
            file.write(np.asarray(values, np.float32), number)
            file.set_band_description(number, name)
