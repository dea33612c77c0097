"""Kinds of images: tiles, ground range, mosaics, fans of beams, pressures; and the card's comparison."""

import json

import numpy as np
import pytest

import insonify
from datasets.small_dataset import write_small
from insonify.datasets.dataset import make_dataset

ONE = (("images: 4", "images: 1"), (", split: {train: 0.5, val: 0.5}", ""))


def test_tiles_of_an_image_are_its_parts(tmp_path):
    """Every tile has its size, a name and a number of its own, and the cells of the whole image."""
    (whole,) = insonify.dataset(write_small(tmp_path, *ONE), threads=1)
    tiled = write_small(tmp_path, *ONE, ("projection: slant", "projection: slant, tile: [16, 64]"))
    tiles = list(insonify.dataset(tiled, threads=1))
    rows, columns = whole["image"].shape
    assert len(tiles) == -(-rows // 16) * -(-columns // 64) and len({tile["name"] for tile in tiles}) == len(tiles)
    for tile in tiles:
        row, column = (int(part) for part in tile["name"].split("_row")[1].split("_column"))
        for name in ("image", "expected", "classes", "instances"):
            np.testing.assert_array_equal(tile[name], whole[name][row : row + 16, column : column + 64])


@pytest.mark.parametrize("projection", ["ground", "mosaic"])
def test_projections(tmp_path, projection):
    """The target is annotated on the ground and on the mosaic as well."""
    (item,) = insonify.dataset(write_small(tmp_path, *ONE, ("slant", projection)), threads=1)
    assert (item["classes"] == 1).any() and (item["classes"] == 2).any()
    assert item["image"].shape == item["expected"].shape == item["classes"].shape


def test_geotiff_tiles_lie_where_the_target_is(tmp_path):
    """Cells of highlight and shadow are within 5 m of the target's drawn position, read by rasterio."""
    rasterio = pytest.importorskip("rasterio")
    path = write_small(tmp_path, *ONE, ("slant", "mosaic"), ("write: [coco]", "write: [geotiff]"))
    assert make_dataset(path, tmp_path / "out", processes=1)
    (note,) = (json.loads(file.read_text()) for file in (tmp_path / "out" / "scenes").iterdir())
    north, east = note["drawn"]["targets[pipe].position"]
    (tile,) = (tmp_path / "out").rglob("*.tif")
    with rasterio.open(tile) as file:
        assert file.count == 4 and "dB" in file.descriptions[0]
        rows, columns = np.nonzero(file.read(3) == 1)
        east_of, north_of = rasterio.transform.xy(file.transform, rows, columns)
    assert np.hypot(np.mean(north_of) - north, np.mean(east_of) - east) < 5


def test_pressures_have_their_own_speckle(tmp_path):
    """A coherent scenario gives levels scattered about the expected ones, as Rayleigh's 5.6 dB has it."""
    path = write_small(tmp_path, *ONE, scene=(("field: incoherent", "field: coherent"), ("pings: 12", "pings: 8")))
    (item,) = insonify.dataset(path, threads=1)
    seabed = (item["classes"] == 0) & (item["expected"] > np.median(item["expected"]))
    difference = (item["image"] - item["expected"])[seabed]
    assert np.std(difference) == pytest.approx(5.57, abs=1.2)
    assert np.mean(10 ** (difference / 10)) == pytest.approx(1, abs=0.3)


def test_the_card_compares_with_a_recording(tmp_path):
    """The named recording, here one of ours, is compared measure by measure; the page has the table."""
    path = write_small(tmp_path, *ONE, ("write: [coco]", "compare: real.nc"))
    real = insonify.simulate(insonify.load_scenario(tmp_path / "scene.yaml").with_(field="coherent"), threads=1)
    insonify.write_netcdf(real, tmp_path / "real.nc")
    assert make_dataset(path, tmp_path / "out", processes=1)
    compared = json.loads((tmp_path / "out" / "card.json").read_text())["compared"]
    assert compared["real"] == "real.nc" and "measures" in compared["summary"]
    assert {found["verdict"] for found in compared["findings"]} <= {"alike", "different", "not compared"}
    assert "Compared with real.nc" in (tmp_path / "out" / "README.md").read_text()
