"""Claims about commands on exported files: a recording in netCDF is read, others are refused with their programs."""

import json
import re
from collections import Counter

import numpy as np
import pytest
import xarray as xr

import insonify
from insonify.cli import main
from insonify.cli.export import AS_HELP
from insonify.formats import netcdf_file
from insonify.formats.other_files import PROGRAMS
from insonify.writers.export import FORMATS
from oracles.scenes import nominal, point


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A recording of two pings and seven beams, of which one is simulated, as a folder and as netCDF."""
    place = tmp_path_factory.mktemp("exported")
    steer = tuple(np.radians(np.linspace(-3, 3, 7)))
    scenario = nominal(
        targets=[point(0, 150, 12.0)], receive={"steer": steer}, track={"window": (0.195, 0.205), "pings": 2},
        paths={"contributions": ["target"]},
    )  # fmt: skip
    insonify.record(scenario, place / "a.zarr", pings=[0])
    insonify.open_recording(place / "a.zarr").to_netcdf(place / "a.nc")
    insonify.export(place / "a.zarr", place / "one.nc")
    insonify.simulate(scenario).drop_vars("done", errors="ignore").to_netcdf(place / "plain.nc")
    return place


def about(capsys, path):
    """What `info` states as JSON."""
    assert main(["info", str(path), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_a_netcdf_recording_is_described_as_its_folder(folder, capsys):
    """Same quantity, axes, version and simulated pings; the size is that of the file."""
    stored, file = about(capsys, folder / "a.zarr"), about(capsys, folder / "a.nc")
    assert file["format"] == "insonify recording in netCDF"
    assert file["bytes"] == (folder / "a.nc").stat().st_size
    for name in ("groups", "simulated", "model", "maker"):
        assert file[name] == stored[name], name
    assert stored["simulated"] == 1 and stored["groups"][0]["pings"] == 2
    assert about(capsys, folder / "one.nc")["groups"][0]["pings"] == 1
    assert about(capsys, folder / "plain.nc")["simulated"] == 2
    assert main(["info", str(folder / "a.nc")]) == 0
    assert "pressure: 2 pings x 7 channels x " in capsys.readouterr().out


def test_lines_of_a_recorder_alone_are_described(tmp_path, capsys):
    """A recording without pressure has lines and bins, and the pings that they are of."""
    recorder = {"stages": [], "keep": "recorded"}
    scenario = nominal(sonar={"recorder": recorder}, track={"window": (0.1, 0.101), "pings": 2})
    insonify.record(scenario, tmp_path / "a.zarr")
    insonify.export(tmp_path / "a.zarr", tmp_path / "a.nc")
    for name in ("a.zarr", "a.nc"):
        (group,) = about(capsys, tmp_path / name)["groups"]
        assert group["name"] == "recorded" and group["pings"] == group["pings_read"] == 2
        assert set(group["shape"]) == {"line", "channel", "bin"}


def test_info_does_not_read_the_samples(folder, capsys, monkeypatch):
    """A file that is too large to be read is described."""
    monkeypatch.setattr(netcdf_file, "MAX_NUMBERS", 10)
    assert about(capsys, folder / "a.nc")["simulated"] == 1
    assert main(["show", str(folder / "a.nc"), "-o", str(folder / "large.png")]) == 2
    assert "10 is the most" in capsys.readouterr().err and not (folder / "large.png").exists()


@pytest.mark.parametrize("options", [[], ["--ping", "0", "--beam", "3"]])
def test_a_netcdf_recording_is_drawn_as_its_folder(folder, options, tmp_path):
    """The same bytes of the picture."""
    for name in ("a.zarr", "a.nc"):
        assert main(["show", str(folder / name), "-o", str(tmp_path / f"{name}.png"), *options]) == 0
    assert (tmp_path / "a.zarr.png").read_bytes() == (tmp_path / "a.nc.png").read_bytes()


def test_arrivals_and_exports_of_a_netcdf_recording_are_those_of_its_folder(folder, tmp_path, capsys):
    """`explain` prints the same table, and `export` writes the same picture."""
    printed = []
    capsys.readouterr()
    for name in ("a.zarr", "a.nc"):
        assert main(["explain", str(folder / name), "--time", "200.1 ms"]) == 0
        printed.append(capsys.readouterr().out)
        assert main(["export", str(folder / name), str(tmp_path / f"{name}.png")]) == 0
        capsys.readouterr()
    assert printed[0] == printed[1]
    assert (tmp_path / "a.zarr.png").read_bytes() == (tmp_path / "a.nc.png").read_bytes()


def refused(capsys, *arguments):
    """Message of a refused command."""
    capsys.readouterr()
    assert main([str(part) for part in arguments]) == 2
    return capsys.readouterr().err


def test_what_a_netcdf_recording_lacks_is_named(folder, tmp_path, capsys):
    """Labels, a ping that is not simulated: the remedy is a run into a folder, never into the file."""
    file, out = folder / "a.nc", tmp_path / "out.png"
    assert "no labels" in refused(capsys, "show", file, "-o", out, "--labels")
    message = refused(capsys, "show", file, "-o", out, "--ping", "1")
    assert "not simulated yet" in message and "export that again" in message and f"-o {file}" not in message
    assert not out.exists()


@pytest.mark.parametrize("command", [["info"], ["show", "-o", "out.png"]])
def test_netcdf_files_without_a_recording_are_refused_with_their_content(folder, tmp_path, capsys, command):
    """A grid, a selection by number, groups of a convention, and a file that is missing."""
    xr.Dataset({"elevation": ("x", [1.0, 2.0])}).to_netcdf(tmp_path / "grid.nc")
    assert "with elevation, and no recording" in refused(capsys, *command, tmp_path / "grid.nc")
    insonify.open_recording(folder / "a.zarr").isel(ping=0).to_netcdf(tmp_path / "ping.nc")
    assert "recording.isel(ping=[0])" in refused(capsys, *command, tmp_path / "ping.nc")
    assert "no such file" in refused(capsys, *command, tmp_path / "gone.nc")
    pytest.importorskip("netCDF4")
    insonify.export(folder / "a.zarr", tmp_path / "ices.nc", "sonar-netcdf4")
    assert "groups of SONAR-netCDF4" in refused(capsys, *command, tmp_path / "ices.nc")


@pytest.mark.parametrize(
    ("suffix", "program"), [(".h5", "h5py"), (".mcap", "ros2 bag info"), (".tif", "gdalinfo"), (".png", "viewer")]
)
def test_other_files_are_refused_with_programs_that_read_them(tmp_path, capsys, suffix, program):
    """`info` and `show` name the kind of the file, programs, and what to give instead; no list of instruments."""
    file = tmp_path / f"a{suffix}"
    file.write_bytes(b"\x89any content")
    for command in (["info"], ["show", "-o", tmp_path / "out.png"]):
        message = refused(capsys, *command, file)
        assert program in message and "harbour.zarr" in message and "no format that is read" not in message


def test_every_exported_file_is_read_or_has_a_program():
    """Each suffix of `export` is one of an instrument, a folder, or has advice."""
    from insonify.formats.instruments.open_instrument import instrument_formats
    from insonify.writers.export import FORMATS

    read = {suffix for reader in instrument_formats() for suffix in reader.suffixes}
    known = read | {suffix for suffixes in PROGRAMS for suffix in suffixes}
    assert {suffix for form in FORMATS.values() if not form.is_folder for suffix in form.suffixes} <= known


def test_the_help_lists_the_formats_that_share_a_suffix():
    """Each name that --as takes where the suffix alone leaves a choice."""
    suffixes = Counter(suffix for about in FORMATS.values() for suffix in about.suffixes)
    shared = {name for name, about in FORMATS.items() if any(suffixes[suffix] > 1 for suffix in about.suffixes)}
    assert shared <= set(re.split(r"[\s,;:.]+", AS_HELP))
