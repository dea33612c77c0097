"""Claims about exported netCDF files and pictures, about partial recordings, and about the command."""

import numpy as np
import pytest
import xarray as xr

import insonify
from insonify.cli import main
from insonify.recording_run import record
from insonify.writers import netcdf
from oracles.surveys import sidescan


@pytest.fixture(scope="module", params=["coherent", "incoherent"])
def folder(request, tmp_path_factory):
    """Folder of a recording of which pings 1 to 3 are there."""
    return record(sidescan(field=request.param), tmp_path_factory.mktemp("a") / "a.zarr", pings=range(1, 4), threads=1)


def test_exported_netcdf_is_deflated(folder, tmp_path):
    """Ping by ping, without a loss."""
    netcdf4 = pytest.importorskip("netCDF4")
    with netcdf4.Dataset(insonify.export(folder, tmp_path / "a.nc")) as file:
        samples = next(file[name] for name in ("pressure_real", "intensity") if name in file.variables)
        assert samples.filters()["zlib"] and samples.filters()["shuffle"]
        assert samples.chunking() == [1, *samples.shape[1:]]


@pytest.mark.parametrize("streamed", [True, False])
def test_netcdf_gives_back_every_bit_of_the_recorded_pings(folder, tmp_path, monkeypatch, streamed):
    """Values, coordinates and attributes, ping by ping or as a whole."""
    pytest.importorskip("netCDF4")
    if not streamed:
        monkeypatch.setattr(netcdf, "find_spec", lambda name: None)
    back = insonify.read_netcdf(insonify.export(folder, tmp_path / "a.nc"))
    expected = insonify.open_recording(folder).isel(ping=slice(1, 4)).load()
    xr.testing.assert_equal(back, expected)
    assert back.attrs == expected.attrs and set(back.coords) == set(expected.coords)
    field = "pressure" if "pressure" in expected else "intensity"
    assert back[field].attrs["units"] == expected[field].attrs["units"] and back[field].dtype == expected[field].dtype


def test_the_command_writes_what_is_recorded(folder, tmp_path, capsys):
    """The path on stdout, three pings of six in the file, a picture with its suffix; advice and code 2 for nonsense."""
    assert main(["export", str(folder), str(tmp_path / "a.xtf"), "--as", "xtf-float32"]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "a.xtf")
    with insonify.open_instrument(tmp_path / "a.xtf") as file:
        assert file.groups["port"] == 3
        np.testing.assert_array_equal(file.read("port").ping_number, [1, 2, 3])
    assert main(["export", str(folder), str(tmp_path / "a.png")]) == 0
    assert (tmp_path / "a.png").read_bytes()[1:4] == b"PNG"
    for words, advice in (
        (["a.tif", "--as", "xtf"], "xtf is a format of .xtf"),
        (["a.csv"], "soundings are those of"),
        ([""], "names no format"),
    ):
        assert main(["export", str(folder), str(tmp_path / words[0]), *words[1:]]) == 2
        assert advice in capsys.readouterr().err
    assert {file.suffix for file in tmp_path.iterdir()} == {".xtf", ".png"}
