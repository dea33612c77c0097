"""Arrivals written as a table can be read back by anything that reads CSV."""

import csv
from pathlib import Path

import numpy as np

from insonify import arrivals
from insonify.formats.arrivals_table import COLUMNS, arrivals_dataset, arrivals_table
from insonify.paper.nominal_scenario import nominal


def some():
    """Paths by way of a point target and a little seabed."""
    point = {"shape": "point", "label": 'the "buoy", red', "position": [0, 150, 19.5], "target_strength_db": -3.0}
    quick = {"paths.geometry": "slice", "track.window": [0.2, 0.2022], "targets": [point]}
    return arrivals(nominal(quick))


def test_what_was_written_is_read_back(tmp_path: Path) -> None:
    """Every digit of every column, in order of delay."""
    paths = some()
    order = np.argsort(paths.delay, kind="stable")
    with arrivals_table(paths, tmp_path / "paths.csv").open(newline="", encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    column = {name.split(" [")[0]: values for name, values in zip(header, zip(*rows, strict=True), strict=True)}
    assert len(rows) == len(paths) > 100
    np.testing.assert_array_equal(np.array(column["delay"], float), paths.delay[order])
    np.testing.assert_array_equal(np.array(column["depth"], float), paths.position[order, 2])
    amplitude = np.array(column["amplitude_real"], float) + 1j * np.array(column["amplitude_imaginary"], float)
    np.testing.assert_array_equal(amplitude.astype(np.complex64), paths.amplitude[order])
    assert list(column["object"]) == list(paths.object[order])
    assert 'the "buoy", red' in column["object"]


def test_the_header_names_units(tmp_path: Path) -> None:
    """Each number states what it is counted in."""
    header = arrivals_table(some(), tmp_path / "paths.csv").read_text(encoding="utf-8").splitlines()[0].split(",")
    assert header[0] == "delay [s]"
    assert "scattering [m]" in header
    assert "grazing_out [rad]" in header
    assert len(header) == len(COLUMNS)


def test_the_product_of_the_losses_is_the_amplitude() -> None:
    """The columns of a path multiply to its amplitude."""
    table = arrivals_dataset(some())
    product = table["spreading"] * table["absorption"] * table["scattering"]
    boundary = np.hypot(table["boundary_real"], table["boundary_imaginary"])
    amplitude = np.hypot(table["amplitude_real"], table["amplitude_imaginary"])
    np.testing.assert_allclose(amplitude, product * boundary, rtol=1e-6)
    assert all(table[name].attrs["units"] and table[name].attrs["long_name"] for name in table)
