"""Claims about damaged files: each is read or refused by its name, and no header takes memory that no file fills."""

import os
import shutil
import tracemalloc
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import insonify
from insonify import data_file
from insonify.cli.app import main
from insonify.formats.netcdf_file import read_netcdf
from insonify.formats.zarr_store import StoreError
from insonify.ocean.profile_file import read_profile
from insonify.recording_run import record
from insonify.scattering import TableScatteringLaw
from insonify.scene.mesh_file import MeshError, mesh_triangles
from insonify.scene.terrain.bathymetry_file import GridError, read_grid
from insonify.sonar.navigation_file import read_navigation
from oracles import damage

pytestmark = pytest.mark.filterwarnings("ignore")
DAMAGES = 30
"""Copies of each kind of file that are damaged; thousands more were tried, with the same code and other seeds."""
SCENE = """
seabed: {{depth: 20 m{seabed}}}
targets: [{targets}]
sonar:
  source_level_db: 200
  pulse: {{kind: cw, frequency: 100 kHz, duration: 0.2 ms}}
  transmit: {{kind: line, length: 0.3 m}}
  receive: {{kind: line, length: 0.3 m}}
track: {{kind: static, position: [0, 0, 8 m], window: [20 ms, 25 ms]}}
paths: {{contributions: [seabed], max_reflections: 0}}
output: {{labels: true}}
"""


def _surface(path: str) -> object:
    return mesh_triangles(path, None, 1.0, None)


def _kinds() -> dict[str, tuple[Callable[[Path], None], Callable[[Any], object], type[ValueError]]]:
    tables = {"cast.csv": read_profile, "log.csv": read_navigation, "strengths.csv": TableScatteringLaw.from_csv}
    return {
        **{name: (make, read_grid, GridError) for name, make in damage.GRIDS.items()},
        **{name: (make, _surface, MeshError) for name, make in damage.MESHES.items()},
        **{name: (make, tables[name], ValueError) for name, make in damage.TABLES.items()},
    }


KINDS = _kinds()


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Each kind of file, whole."""
    folder = tmp_path_factory.mktemp("whole")
    for name, (make, _, _) in KINDS.items():
        make(folder / name)
    return {name: (folder / name).read_bytes() for name in KINDS}


HELD: dict[str, Callable[[Any], float]] = {
    **dict.fromkeys(damage.GRIDS, lambda grid: -float(np.mean(grid.elevation))),
    **dict.fromkeys(damage.MESHES, lambda mesh: float(np.linalg.norm(mesh.vertices, axis=1).max())),
    "cast.csv": lambda profile: float(profile.depth[-1]),
    "log.csv": lambda fixes: float(fixes.position[-1, 2]),
    "strengths.csv": lambda law: law.strength_db[0],
}
"""One number of what each kind of file holds."""


@pytest.mark.parametrize("name", KINDS)
def test_a_whole_file_is_read(name, whole, tmp_path):
    """What the damage starts from is sound: mean depth, radius and columns are those that were written."""
    (tmp_path / name).write_bytes(whole[name])
    radius = dict.fromkeys(damage.MESHES, 0.5)
    written = {**dict.fromkeys(damage.GRIDS, damage.DEPTH.mean()), **radius, "cast.csv": 28.0, "log.csv": 6.9,
               "strengths.csv": -39.5}  # fmt: skip
    assert HELD[name](KINDS[name][1](str(tmp_path / name))) == pytest.approx(written[name], rel=1e-6)


@pytest.mark.parametrize("name", KINDS)
def test_a_damaged_file_is_read_or_refused_by_name(name, whole, tmp_path):
    """Cut, flipped, spliced, zeroed, doubled or lying: no error but the reader's own, and that one names the file."""
    hdf5 = name in ("d.bag", "e.nc")  # these are tried in a process of their own first, which takes half a second
    random = np.random.default_rng(list(KINDS).index(name))
    refused = 0
    for row in range(3 if hdf5 else DAMAGES):
        other = whole[list(KINDS)[random.integers(len(KINDS))]]
        path = tmp_path / f"{row}{Path(name).suffix}"
        path.write_bytes(damage.damaged(whole[name], other, random)[1])
        try:
            KINDS[name][1](str(path))
        except KINDS[name][2] as fault:
            refused += 1
            assert str(path) in str(fault), fault
    assert refused


@pytest.mark.parametrize("corners", [[0, 1, 9], [0, 1, -2]])
def test_a_face_whose_corner_is_none_is_refused(tmp_path, corners):
    """A face points at a corner that the file does not have, beyond the last or before the first."""
    head = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    head += "element face 4\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
    faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], corners]
    (tmp_path / "a.ply").write_text(head + "".join(f"3 {a} {b} {c}\n" for a, b, c in faces))
    with pytest.raises(
        MeshError, match=r"a\.ply: triangle 3 has the corners 0, 1, -?\d, and the file has corners 0 to 3"
    ):
        _surface(str(tmp_path / "a.ply"))


LIES: dict[str, tuple[Callable[[Path], None], str]] = {
    "cells.npz": (lambda path: damage.lying_npz(path, (10**6, 10**6)), "1000000 x 1000000 cells; 100,000,000 is the"),
    "short.npz": (lambda path: damage.lying_npz(path, (9000, 9000)), "promises 648000000 bytes and has 64"),
    "axis.npz": (lambda path: damage.lying_npz(path, (10**12,)), "1000000000000 cells"),
    "words.npz": (lambda path: damage.lying_npz(path, (3, 3), dtype="<U9999999"), "no real numbers"),
    "bomb.npz": (lambda path: damage.npz_bomb(path, 10_001), "10001 x 10001 cells"),
    "wide.nc": (lambda path: damage.huge_nc(path, 200_000), "200000 x 200000 cells"),
    "wide.tif": (lambda path: damage.huge_tif(path, 200_000), "200000 x 200000 cells"),
    "many.glb": (lambda path: damage.lying_glb(path, 2 * 10**9), r"promises 8e\+09 numbers"),
    "many.ply": (lambda path: damage.lying_ply(path, 2 * 10**9, text=True), "promises 2000000000 of vertex"),
    "binary.ply": (lambda path: damage.lying_ply(path, 2 * 10**9, text=False), "promises 2000000000 of vertex"),
}


@pytest.mark.parametrize("name", LIES)
def test_a_lying_size_takes_no_memory(name, tmp_path):
    """A header that claims gigabytes is refused with file, size and limit, before 20 MB are allocated."""
    path = tmp_path / name
    LIES[name][0](path)
    assert path.stat().st_size < 200_000
    tracemalloc.start()
    try:
        with pytest.raises((GridError, MeshError), match=f"{name}.*{LIES[name][1]}"):
            (_surface if path.suffix in (".glb", ".ply") else read_grid)(str(path))
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_what_else_an_archive_holds_is_not_unpacked(tmp_path):
    """A bomb beside the grid does no harm: only the grid and its coordinates are read."""
    damage.npz(tmp_path / "a.npz")
    with zipfile.ZipFile(tmp_path / "a.npz", "a", zipfile.ZIP_DEFLATED) as file:
        file.writestr("notes.txt", bytes(50_000_000))
    tracemalloc.start()
    try:
        assert read_grid(str(tmp_path / "a.npz")).elevation.shape == (12, 9)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


def test_another_kind_of_raster_under_the_name_of_one_is_refused(tmp_path):
    """A .tif that is a virtual raster, which may name any other file, is none."""
    damage.tif(tmp_path / "a.tif")
    text = "<VRTDataset rasterXSize='9' rasterYSize='12'><VRTRasterBand dataType='Float32' band='1'>"
    text += "<SimpleSource><SourceFilename relativeToVRT='1'>a.tif</SourceFilename></SimpleSource></VRTRasterBand>"
    (tmp_path / "b.tif").write_text(text + "</VRTDataset>")
    with pytest.raises(GridError, match=r"b\.tif: cannot be read"):
        read_grid(str(tmp_path / "b.tif"))


@pytest.mark.parametrize(
    ("trial", "output"),
    [("import time; time.sleep(60)", "gave no result in 1 s"), ("import os; os.abort()", "crashed")],
)
def test_a_library_that_hangs_or_crashes_is_given_up(tmp_path, monkeypatch, trial, output):
    """An HDF5 file over which the library hangs or dies is refused: the trial stands in for the library here."""
    damage.nc(tmp_path / "a.nc")
    monkeypatch.setattr(data_file, "_TRIAL", trial)
    monkeypatch.setattr(data_file, "_TRIAL_TIMEOUT", 1.0)
    with pytest.raises(GridError, match=rf"a\.nc: cannot be read: its library .*{output}"):
        read_grid(str(tmp_path / "a.nc"))
    with pytest.raises(StoreError, match=rf"a\.nc cannot be read as netCDF.*{output}"):
        read_netcdf(tmp_path / "a.nc")


@pytest.mark.parametrize(
    ("step", "endless", "promised"),
    [
        ("with netCDF4", "sum(iter(int, 1))\n    with netCDF4", 0),
        ("found[first", "row == 9000 and sum(iter(int, 1)); found[first", 9000),
    ],
)
def test_a_file_that_keeps_its_library_busy_is_given_up_by_processor_time(
    tmp_path, monkeypatch, step, endless, promised
):
    """A small file has two seconds of processor time for each part, however long the clock runs and its arrays are."""
    resource = pytest.importorskip("resource")
    damage.nc(tmp_path / "a.nc")
    if promised:
        damage.huge_nc(tmp_path / "a.nc", promised)
    monkeypatch.setattr(data_file, "_TRIAL", data_file._TRIAL.replace(step, endless))
    monkeypatch.setattr(data_file, "_TRIAL_TIMEOUT", 600.0)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    with pytest.raises(GridError, match=r"a\.nc: cannot be read: .* in the time that ten such files take"):
        read_grid(str(tmp_path / "a.nc"))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime < 5


def test_a_file_is_tried_once_until_it_changes(tmp_path, monkeypatch):
    """Read three times, an HDF5 file has one trial; of another size or date it has another, and so has a crash."""
    damage.nc(tmp_path / "a.nc")
    trials = []
    codes = iter([0, 0, -6, -6])
    monkeypatch.setattr(data_file.subprocess, "run", lambda *_, **__: trials.append(0) or SimpleNamespace(
        returncode=next(codes)))  # fmt: skip
    for read, changes in enumerate([False, False, False, True], start=1):
        if changes:
            os.utime(tmp_path / "a.nc", (read, read))
        data_file.require_readable_hdf5(tmp_path / "a.nc")
    assert len(trials) == 2
    os.utime(tmp_path / "a.nc", (9, 9))
    for _ in range(2):
        with pytest.raises(ValueError, match=r"a\.nc: cannot be read: its library crashed"):
            data_file.require_readable_hdf5(tmp_path / "a.nc")
    assert len(trials) == 4


@pytest.mark.parametrize("read", [read_profile, read_navigation, TableScatteringLaw.from_csv])
def test_a_table_without_end_is_not_begun(read, tmp_path, monkeypatch):
    """Devices never end, folders are no tables, and what is too large is refused unread; a cell without end, too."""
    with pytest.raises(ValueError, match="/dev/zero: not an ordinary file"):
        read("/dev/zero")
    with pytest.raises(OSError, match="folder"):
        read(tmp_path)
    (tmp_path / "a.csv").write_text('time,"' + "x" * 200_000 + '"\n1,2\n')
    with pytest.raises(ValueError, match=r"a\.csv, line 1: (no|not a) (row|header) of a table \(field larger than"):
        read(tmp_path / "a.csv")
    monkeypatch.setattr("insonify.data_file.MAX_TABLE_BYTES", 1000)
    with pytest.raises(ValueError, match=r"a\.csv: 0 MB; 0 MB is the most"):
        read(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("name", "keys"),
    [
        ("a.npz", {"seabed": ", relief: {kind: grid, file: a.npz}", "targets": ""}),
        ("c.obj", {"seabed": "", "targets": "{shape: mesh, label: hull, position: [0 m, 20 m], file: c.obj}"}),
        ("strengths.csv", {"seabed": ", scattering: {file: strengths.csv}", "targets": ""}),
    ],
)
def test_check_reports_a_damaged_file_with_exit_code_2(name, keys, whole, tmp_path, capsys):
    """At every length of the file `check` states which file is wrong and exits with 2, or takes it.

    Never a traceback.
    """
    scenario = tmp_path / "a.yaml"
    scenario.write_text(SCENE.format(**keys))
    for length in np.linspace(0, len(whole[name]) - 1, 12).astype(int):
        (tmp_path / name).write_bytes(whole[name][:length])
        code = main(["check", str(scenario)])
        output = capsys.readouterr().err
        assert code in ((0, 2) if name != "a.npz" else (2,))
        assert code == 0 or name in output


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small recording with labels."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "a.yaml").write_text(SCENE.format(seabed="", targets=""))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        record(insonify.load_scenario(folder / "a.yaml"), folder / "a.zarr")
    return folder / "a.zarr"


@pytest.mark.parametrize("command", ["show", "labels", "explain"])
def test_a_damaged_recording_is_shown_or_refused(command, recorded, tmp_path, capsys):
    """Any of its files damaged: `show` and `explain` do their work, or exit with 2 and name the recording."""
    files = sorted(path.relative_to(recorded) for path in recorded.rglob("*") if path.is_file())
    descriptions = [file for file in files if file.name == "zarr.json"]
    random, target, picture = np.random.default_rng(5), tmp_path / "b.zarr", str(tmp_path / "b.png")
    words = {
        "show": ["show", str(target), "-o", picture],
        "labels": ["show", str(target), "-o", picture, "--labels"],
        "explain": ["explain", str(target), "--time", "22 ms"],
    }[command]
    codes = []
    for row in range(8):
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(recorded, target)
        among = descriptions if row % 2 else files
        file = among[random.integers(len(among))]
        good, other = (recorded / file).read_bytes(), (recorded / files[random.integers(len(files))]).read_bytes()
        (target / file).write_bytes(damage.damaged(good, other, random)[1])
        codes.append(main(words))
        output = capsys.readouterr().err
        assert codes[-1] in (0, 2), (file, output)
        assert codes[-1] == 0 or "b.zarr" in output
    assert 2 in codes


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"shape":[1,1,', '"shape":[1,1000000000000,'),
        ('"chunk_shape":[1,1,', '"chunk_shape":[1,1000000000000,'),
        ('"data_type":"complex64"', '"data_type":"r80000000000"'),
        ('"shape":[1,1,', '"shape":[1,-1,'),
    ],
)
def test_a_recording_that_lies_about_its_size_takes_no_memory(recorded, tmp_path, capsys, old, new):
    """A description that claims terabytes is refused with its file, before 20 MB are allocated."""
    shutil.copytree(recorded, tmp_path / "b.zarr")
    file = tmp_path / "b.zarr" / "zarr.json"
    text = "".join(line.strip() for line in file.read_text().splitlines()).replace(": ", ":").replace(", ", ",")
    assert old in text
    file.write_text(text.replace(old, new))
    tracemalloc.start()
    try:
        assert main(["explain", str(tmp_path / "b.zarr"), "--time", "22 ms"]) == 2
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
    assert "b.zarr" in capsys.readouterr().err
