"""Claims about label maps: every cell returns from PNG and GeoTIFF."""

import json

import numpy as np
import pytest
from PIL import Image

from insonify.annotations import CLASSES, ImageAxis, write_label_maps
from insonify.annotations.grey_picture import greys, level_span
from oracles.labelled import labelled_image


def test_maps_return_from_png(tmp_path):
    """Classes and instances of every cell, and the names of both; of several in a cell that of the strongest class."""
    images = [labelled_image(seed, index=seed, targets=2 + seed) for seed in range(2)]
    write_label_maps(images[:1], tmp_path)
    names = json.loads(write_label_maps(images[1:], tmp_path).read_text())
    assert names == {str(number): name for number, name in enumerate(("background", *CLASSES))}
    for image in images:
        classes, instances = (np.asarray(Image.open(tmp_path / kind / f"{image.name}.png")) for kind in
                              ("classes", "instances"))  # fmt: skip
        np.testing.assert_array_equal(classes, image.classes)
        np.testing.assert_array_equal(instances, image.instances)
        names = json.loads((tmp_path / "names" / f"{image.name}.json").read_text())
        assert names == {str(number): name for number, name in enumerate(image.instance_names, start=1)}
        shown = image.layers[[0, 2, 1]]  # highlights over ghosts over shadows
        strongest = np.where(shown[0] != 0, shown[0], np.where(shown[1] != 0, shown[1], shown[2]))
        np.testing.assert_array_equal(instances, strongest)


def test_levels_and_maps_return_from_geotiff(tmp_path):
    """Levels unrounded, recorded and expected; a mosaic on its coordinates, an image in slant range on none."""
    rasterio = pytest.importorskip("rasterio")
    axes = {
        "rows": ImageAxis("northing", "m", 5e6 - 0.5 * np.arange(40)),
        "columns": ImageAxis("easting", "m", 4e5 + 0.5 * np.arange(61)),
    }
    mosaic = labelled_image(1, name="m", projection="mosaic", crs="EPSG:32631", pings=np.empty(0, int), **axes)
    write_label_maps([mosaic, labelled_image(2, name="s")], tmp_path, form="tif")
    with rasterio.open(tmp_path / "images/m.tif") as file:
        np.testing.assert_array_equal(file.read(1), mosaic.image)
        np.testing.assert_array_equal(file.read(2), mosaic.expected)
        assert file.crs.to_epsg() == 32631 and file.xy(3, 5) == (4e5 + 2.5, 5e6 - 1.5)
    for kind, cells in (("classes", mosaic.classes), ("instances", mosaic.instances)):
        with rasterio.open(tmp_path / kind / "m.tif") as file:
            np.testing.assert_array_equal(file.read(1), cells)
    with pytest.warns(rasterio.errors.NotGeoreferencedWarning), rasterio.open(tmp_path / "images/s.tif") as file:
        assert file.crs is None


def test_greys_rise_with_the_level():
    """0 is no sample, 1 the darkest, 255 white; a step of grey is the span over 254, and limits are kept."""
    level = np.array([np.nan, -np.inf, -60.0, -50.0, -29.6, -10.0, 0.0], np.float32)
    np.testing.assert_array_equal(greys(level, (-50.0, -10.0)), [0, 1, 1, 1, 131, 255, 255])
    image = labelled_image(3).image
    low, high = level_span(image)
    assert image.min() < low < np.median(image) < high < image.max()
    assert level_span(np.full((4, 4), np.nan, np.float32)) == (0.0, 1.0)


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"image": np.zeros((3, 3), np.float32)}, r"LabelledImage.image has shape \(3, 3\)"),
        ({"layers": np.full((3, 40, 61), 9, np.int32)}, "there are 3 targets"),
        ({"layers": np.full((3, 40, 61), -2, np.int32)}, "instances -2 to 0"),
        ({"projection": "polar"}, "choose one of slant, ground, mosaic"),
        ({"index": -1}, "count images from 0"),
    ],
)
def test_inconsistent_images_are_refused(changes, problem):
    """Shapes, instances, projections and numbers that cannot be."""
    with pytest.raises(ValueError, match=problem):
        labelled_image(**changes)
