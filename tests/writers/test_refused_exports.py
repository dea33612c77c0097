"""Exports of what cannot be written: one line, exit code 2, the old file as it was, and nothing half written."""

import errno
import os
import subprocess
import sys

import numpy as np
import pytest

import insonify
from insonify.cli import main
from insonify.writers.export import FORMATS
from oracles.scenes import nominal, point

FULL = ("mosaic", "waterfall", "netcdf", "xtf", "picture")
"""Formats that are written to a full disk."""
SUFFIXES = sorted({about.suffixes[0] for about in FORMATS.values()})


def is_folder(suffix):
    """True of a suffix of annotated images."""
    return any(about.is_folder and suffix in about.suffixes for about in FORMATS.values())


def survey(pings):
    """Pings of one beam past a point in silent water, as energies."""
    track = {"kind": "line", "start": (0.0, 0.0, 11.0), "heading": 0.0, "speed": 2.0, "interval": 0.5, "pings": pings,
             "window": (0.01, 0.04)}  # fmt: skip
    return nominal(
        targets=[point(1.0, 20.0, 19.0)], field="incoherent", paths={"contributions": ["target"], "max_reflections": 0},
        line={"kind": "planar", "length": None, "width": 0.05, "height": 0.02},
        sonar={"mounting": {"bearing": "90 deg", "tilt": "20 deg"}},
    ).with_("track", track)  # fmt: skip


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Folders of a recording of three pings, of one, and of none."""
    top = tmp_path_factory.mktemp("recordings")
    for name, pings, done in (("three", 3, None), ("one", 1, None), ("none", 3, [])):
        more = {} if done is None else {"pings": done}
        insonify.record(survey(pings), top / f"{name}.zarr", **more)
    return top


def refused(words, capsys):
    """The line that a refused command ends with."""
    assert main(["export", *map(str, words)]) == 2
    out, err = capsys.readouterr()
    assert out == "" and len(err.splitlines()) == 1 and "Traceback" not in err
    return err


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("name", ["none", "one"])
def test_short_recordings_are_written_or_refused(folders, tmp_path, capsys, name, suffix):
    """No ping: a line for every format. One ping: a file with something in it, or a line; never a part of a file."""
    target = tmp_path / f"out{suffix}"
    if name == "one" and main(["export", str(folders / "one.zarr"), str(target)]) == 0:
        assert os.listdir(tmp_path) == [target.name] and target.stat().st_size > 0
        return
    capsys.readouterr()
    assert refused((folders / f"{name}.zarr", target), capsys)
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (("out.xyz",), ".xyz names no format. End it in one of"),
        (("out",), "no suffix names no format"),
        (("out.xtf", "--as", "mp3"), "mp3: there is no such format. Choose one of xtf"),
        (("out.xtf", "--as", "csv"), "csv is a format of .csv"),
        (("absent/out.nc",), "mkdir -p"),
        (("folder.nc",), "is a folder. Choose the name of a file"),
        (("file.txt/out.nc",), "there is no folder"),
        (("n" * 300 + ".nc",), "File name too long. Choose another name"),
        (("n" * 253 + ".nc",), "File name too long. Choose another name"),
        (("out.coco", "--tile", "9" * 5000 + "x16"), "no size of a tile"),
    ],
    ids=lambda value: " ".join(word[:20] for word in value) if isinstance(value, tuple) else "",
)
def test_names_that_are_none_are_refused(folders, tmp_path, monkeypatch, capsys, words, advice):
    """With the remedy, before anything is computed."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.nc").mkdir()
    (tmp_path / "file.txt").write_text("mine")
    assert advice in refused((folders / "three.zarr", *words), capsys)
    assert sorted(os.listdir(tmp_path)) == ["file.txt", "folder.nc"] and not os.listdir(tmp_path / "folder.nc")


@pytest.mark.parametrize("name", ["absent.zarr", "file.txt"])
def test_what_is_no_recording_is_refused_by_its_name(tmp_path, capsys, name):
    """A folder that is not there, and a file."""
    (tmp_path / "file.txt").write_text("mine")
    assert name in refused((tmp_path / name, tmp_path / "out.nc"), capsys)
    assert os.listdir(tmp_path) == ["file.txt"]


def test_a_folder_without_permission_is_named(folders, tmp_path, capsys, monkeypatch):
    """The file that was there stays as it was, whichever step the system denies."""
    target = tmp_path / "out.nc"
    target.write_bytes(b"mine")

    def denied(_from, to):
        raise PermissionError(13, "Permission denied", str(to))

    monkeypatch.setattr("insonify.writers.export.os.replace", denied)
    assert "out.nc" in refused((folders / "three.zarr", target), capsys)
    assert target.read_bytes() == b"mine" and os.listdir(tmp_path) == ["out.nc"]


def test_a_file_of_that_name_is_replaced_whole_or_not_at_all(folders, tmp_path, capsys, monkeypatch):
    """A full disk in the middle of the file leaves the old one; the next attempt replaces it."""
    target = tmp_path / "out.nc"
    target.write_bytes(b"mine")

    def full(_survey, path):
        path.write_bytes(b"CDF")
        raise OSError(28, "No space left on device", str(path))

    with monkeypatch.context() as patch:
        patch.setattr("insonify.writers.netcdf.write_netcdf", full)
        assert main(["export", str(folders / "three.zarr"), str(target)]) == 1
    assert target.read_bytes() == b"mine" and os.listdir(tmp_path) == ["out.nc"]
    assert "No space left" in capsys.readouterr().err
    assert main(["export", str(folders / "three.zarr"), str(target)]) == 0
    assert target.stat().st_size > 1000 and os.listdir(tmp_path) == ["out.nc"]
    assert np.isfinite(insonify.open_recording(folders / "three.zarr")["intensity"]).all()


@pytest.mark.parametrize("suffix", [s for s in SUFFIXES if not is_folder(s)])
def test_the_longest_names_are_written(folders, tmp_path, capsys, suffix):
    """A name that the system allows: the temporary one is no longer than it."""
    target = tmp_path / f"{'n' * (255 - len(suffix))}{suffix}"
    if main(["export", str(folders / "three.zarr"), str(target)]) == 0:
        assert os.listdir(tmp_path) == [target.name]
    else:
        assert "too long" not in capsys.readouterr().err and os.listdir(tmp_path) == []


@pytest.mark.parametrize("name", ["mosaic", "waterfall", "netcdf", "xtf", "picture"])
def test_pings_of_one_sample_are_written_or_refused(tmp_path, capsys, name):
    """One sample has no neighbour in range."""
    insonify.record(survey(2).with_("track.window", (0.01, 0.010001)), tmp_path / "one.zarr")
    target = tmp_path / f"out{FORMATS[name].suffixes[0]}"
    if name in ("mosaic", "waterfall"):
        assert "one sample a ping" in refused((tmp_path / "one.zarr", target, "--as", name), capsys)
    else:
        assert main(["export", str(tmp_path / "one.zarr"), str(target), "--as", name]) == 0


@pytest.mark.parametrize("number", [errno.EROFS, errno.ENOENT])
def test_a_folder_that_takes_no_file_is_named(folders, tmp_path, capsys, monkeypatch, number):
    """A disk that became read-only, a folder that was removed, one of the system's own."""

    def denied(_survey, path):
        raise OSError(number, os.strerror(number), str(path))

    monkeypatch.setattr("insonify.writers.netcdf.write_netcdf", denied)
    assert "out.nc: cannot be written" in refused((folders / "three.zarr", tmp_path / "out.nc"), capsys)


def test_a_full_disk_leaves_no_part_of_a_file(folders, tmp_path):
    """Files limited to 300 bytes by the system: exit code 1, one line, and nothing under the final name.

    Every format in one process of its own, since the limit is that of a process.
    """
    pytest.importorskip("resource")
    commands = [
        ["export", str(folders / "three.zarr"), str(tmp_path / name / f"out{FORMATS[name].suffixes[0]}"), "--as", name]
        for name in FULL
    ]
    for name in FULL:
        (tmp_path / name).mkdir()
    program = f"""
import resource, signal
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from insonify.cli import main
from insonify.writers import export
export.LEAST_FREE = 1 << 62
resource.setrlimit(resource.RLIMIT_FSIZE, (300, 300))
print(*[main(words) for words in {commands!r}])
"""
    ended = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, timeout=200)
    assert ended.stdout.split() == ["1"] * len(FULL)
    assert {name: os.listdir(tmp_path / name) for name in FULL} == {name: [] for name in FULL}
    lines = ended.stderr.splitlines()
    assert len(lines) == len(FULL)
    assert all("too large" in line or "No space left" in line for line in lines)
