"""Commands with the URL of a recording in an object store in place of a folder."""

import json
import sys
from collections.abc import Iterator
from pathlib import Path

import fsspec
import numpy as np
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from insonify.cli import main
from insonify.formats import object_store
from insonify.formats.netcdf_file import read_netcdf
from insonify.formats.zarr_store import open_recording
from oracles.short_window import SHORT

URL = "memory://store/harbour.zarr"


def test_commands_take_a_url(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Run, status, show, explain keep both slashes, and no folder of that name is made; errors state the fix.

    So does plan, for a URL that other processes reach.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "spool"))
    Path("a.yaml").write_text(SHORT, encoding="utf-8")
    shared = "s3://bucket/harbour.zarr"
    assert main(["plan", "a.yaml", "--tasks", "1", "-o", shared]) == 0
    assert f"insonify run a.yaml -o {shared} --threads 1 --quiet --part" in capsys.readouterr().out
    assert main(["explain", URL, "--time", "201 ms"]) == 2
    assert f"{URL} is not a recording. Make one with: insonify run FILE -o {URL}" in capsys.readouterr().err
    with monkeypatch.context() as patch:
        patch.setattr(MemoryFileSystem, "put_file", lambda *_, **__: 1 / 0)  # a failure of any type
        assert main(["run", "a.yaml", "-o", URL, "--quiet"]) == 2
    assert f"{URL} cannot be reached: division by zero. Check the URL" in capsys.readouterr().err
    assert main(["run", "a.yaml", "-o", URL, "--quiet", "--labels"]) == 0
    assert capsys.readouterr().out == f"{URL}\n"
    assert main(["run", "a.yaml", "-o", URL, "--quiet", "--overwrite"]) == 2
    assert "Delete it first, or choose another name" in capsys.readouterr().err
    assert main(["status", URL]) == 0
    assert capsys.readouterr().out == f"{URL}: all 1 pings recorded\n  all 1 pings labelled\n"
    assert main(["explain", URL, "--time", "201 ms"]) == 0 and "dB" in capsys.readouterr().out
    assert main(["show", URL, "-o", "a.png", "--ping", "0"]) == 0
    assert main(["show", URL, "-o", "b.png", "--ping", "0", "--labels"]) == 0
    assert sorted(file.name for file in tmp_path.iterdir()) == ["a.png", "a.yaml", "b.png", "spool"]


@pytest.fixture(params=["memory", "file"])
def stored(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    """The same recording at a URL, and in the folder disk.zarr, with labels; both are of one ping."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "spool"))
    url = URL if request.param == "memory" else f"file://{tmp_path}/store/harbour.zarr"
    Path("a.yaml").write_text(SHORT, encoding="utf-8")
    for out in (url, "disk.zarr"):
        assert main(["run", "a.yaml", "-o", out, "--quiet", "--labels"]) == 0
    yield url
    MemoryFileSystem.store.clear()


def reading(url: str) -> list[list[str]]:
    """Commands that read a recording, of a URL or a folder."""
    return [
        ["info", url], ["export", url, "a.nc"], ["export", url, "a.coco"], ["compare", url, url], ["status", url],
        ["show", url, "-o", "a.png"], ["show", url, "-o", "a.png", "--labels"], ["explain", url, "--time", "201 ms"],
    ]  # fmt: skip


def test_what_is_at_a_url_is_read_as_what_is_in_a_folder(stored: str, capsys: pytest.CaptureFixture[str]) -> None:
    """`info` states the size of all objects, exports hold the same numbers, a comparison finds no difference."""
    capsys.readouterr()
    files, root = fsspec.url_to_fs(stored)
    assert main(["info", stored, "--json"]) == main(["info", "disk.zarr", "--json"]) == 0
    about, on_disk = (json.loads(text + "}") for text in capsys.readouterr().out.split("\n}\n")[:2])
    assert about.pop("bytes") == sum(files.info(name)["size"] for name in files.find(root))
    assert (about.pop("file"), on_disk.pop("file"), on_disk.pop("bytes") > 0) == (stored, "disk.zarr", True)
    assert about == on_disk
    for words in (*reading(stored)[1:], ["compare", "disk.zarr", stored]):
        assert main(words) == 0, words
    assert "harbour.zarr" in capsys.readouterr().out
    np.testing.assert_array_equal(read_netcdf("a.nc")["pressure"], open_recording("disk.zarr")["pressure"])
    annotated = json.loads(Path("a.coco/annotations.json").read_text())
    assert main(["export", "disk.zarr", "b.coco"]) == 0
    expected = json.loads(Path("b.coco/annotations.json").read_text())
    assert [image["width"] for image in annotated["images"]] == [image["width"] for image in expected["images"]]
    assert not Path("memory:").exists() and not Path("file:").exists()


@pytest.mark.parametrize(
    ("url", "message"),
    [
        ("memory://none/a.zarr", "memory://none/a.zarr is not a recording. Make one with: insonify run FILE -o"),
        ("memory://", "names no folder in a store"),
        ("nowhere://a/b.zarr", "is no URL of a store: Protocol not known: nowhere"),
        ("s3://bucket/a.zarr", "[remote]"),
        ("memory://empty/a.zarr", "there is no bucket empty, or no permission to list it. Check the URL and the"),
        ("memory://full/a.zarr", "cannot be reached: no such bucket. Check the URL, the credentials"),
    ],
)
def test_a_url_that_cannot_be_read_is_refused_with_advice(
    url: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """By every command that reads a recording: no store, no recording, no package, no bucket; nothing is written."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(sys.modules, "s3fs", None)
    if "empty" in url:
        monkeypatch.setattr(object_store, "BUCKETS", ("memory",))
    if "full" in url:

        def absent(*_: object, **__: object) -> None:
            raise OSError("no such bucket")

        monkeypatch.setattr(MemoryFileSystem, "cat_file", absent)
    for words in reading(url):
        assert main(words) == 2, words
        assert message in capsys.readouterr().err, words
    assert list(tmp_path.iterdir()) == []
