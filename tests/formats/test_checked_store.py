"""Damaged files and objects of a recording, on disk and in stores: refused by name with a remedy that works."""

import uuid
from collections.abc import Iterator
from pathlib import Path

import fsspec
import numpy as np
import pytest
from fsspec.implementations.memory import MemoryFileSystem

from insonify.cli import main
from insonify.formats import shards
from insonify.formats.label_store import open_labels
from insonify.formats.zarr_store import StoreError, open_recording
from insonify.recording_run import record
from insonify.scenario.write import to_yaml
from oracles.few_of import few_of
from oracles.scenes import nominal, point

PINGS = 70
"""A shard of 64 pings and one of 6."""
DAMAGES = {
    "empty": lambda content: b"",
    "cut": lambda content: content[: len(content) // 2],
    "one byte short": lambda content: content[:-1],
    "random": lambda content: np.random.default_rng(2).bytes(len(content)),
    "another format": lambda content: b"<html>" + content,
    "of another codec": lambda content: b"\2\1\1\1" + bytes(4) + content,
}
FILES = ("pressure/c/0/0/0", "done/c/0", "time/c/0", "ping_time/c/0", "labels/float32/c.0.0.0.0")
PLACES = ("disk", "file", "memory")


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scenario of two shards of 64 pings at most, with labels."""
    scene = nominal(
        targets=[point(0.0, 12.0, 15.0)], track={"window": (0.016, 0.0162), "pings": PINGS},
        paths={"max_reflections": 0, "contributions": ("target",)},
        sonar={"transmit": {"kind": "point"}, "receive": {"kind": "point"}}, output={"labels": True},
    )  # fmt: skip
    path = tmp_path_factory.mktemp("scene") / "a.yaml"
    path.write_text(to_yaml(scene), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "MOST_PINGS", 64)
        record(scene, path.parent / "a.zarr")
    return path


@pytest.fixture(params=PLACES)
def place(
    request: pytest.FixtureRequest, file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[str]:  # fmt: skip
    """A copy of the recording, in a folder or a store."""
    monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "spool"))
    monkeypatch.setattr(shards, "MOST_PINGS", 64)
    urls = {"disk": f"{tmp_path}/a.zarr", "file": f"file://{tmp_path}/a.zarr", "memory": f"memory://{uuid.uuid4()}/a"}
    url = urls[request.param]
    files, root = fsspec.url_to_fs(url, auto_mkdir=True)
    files.put(f"{file.parent}/a.zarr/", f"{root}/", recursive=True)
    yield url
    MemoryFileSystem.store.clear()


def read(place: str, key: str) -> None:
    """Read all that a recording has of the array of a file; first a part, then all."""
    name = key.split("/")[-3] if key.startswith("labels") else key.split("/")[0]
    dataset = open_labels(place) if key.startswith("labels") else open_recording(place)
    names = ["expected_intensity"] if name == "labels" else [name]
    for variable in names:
        dataset[variable].isel({dataset[variable].dims[0]: 0}).load()
        dataset[variable].load()


@pytest.mark.parametrize(
    ("place", "key", "damage"),
    [(PLACES[(row + column) % 3], key, damage)  # each damage of each file in one place, each in all places
     for row, key in enumerate(FILES) for column, damage in enumerate(DAMAGES)],
    indirect=["place"],
)  # fmt: skip
def test_a_damaged_chunk_is_refused_by_name(place: str, key: str, damage: str) -> None:
    """Empty, cut, random, or of another codec: never numbers, a traceback, or silence taken for a recorded ping."""
    files, root = fsspec.url_to_fs(place)
    whole = files.cat_file(f"{root}/{key}")
    files.pipe_file(f"{root}/{key}", DAMAGES[damage](whole))
    with pytest.raises(StoreError) as refused:
        read(place, key)
    assert f"{place}/{key} is damaged: it " in str(refused.value)
    remedy = "label again" if "labels" in key else "simulate again" if "time" in key else "simulate its pings again"
    assert remedy in str(refused.value)


@few_of(
    (1, 2, 3),
    ("place", "key"),
    [("disk", FILES[0]), ("disk", FILES[1]), ("disk", "labels"), ("memory", FILES[0]), ("file", FILES[1]),
     ("memory", "labels")],
    indirect=["place"],
)  # fmt: skip
def test_the_remedy_mends_the_recording(
    place: str, key: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    """Commands end with 2 and the message; what it names deleted, `run` simulates what is lost, and that alone."""
    files, root = fsspec.url_to_fs(place)
    damaged = f"{root}/labels/bool/c.0.0.0.0" if key == "labels" else f"{root}/{key}"
    files.pipe_file(damaged, b"\x28\xb5\x2f\xfd")
    words = ["show", place, "-o", str(file.parent / "a.png"), "--labels"]
    if "://" in place or key == "labels":  # on disk, a damaged entry in the mask is that of a missing ping
        assert main(words) == 2
        assert f"{place}/{key}" in capsys.readouterr().err
    files.rm(f"{root}/{key}", recursive=True)
    assert main(["run", str(file), "-o", place, "--quiet"]) == 0
    expected, found = open_recording(file.parent / "a.zarr"), open_recording(place)
    np.testing.assert_array_equal(found["pressure"], expected["pressure"])
    assert found["done"].values.all() and open_labels(place)["done"].values.all()
    assert main(words) == 0


def test_a_store_that_cannot_be_reached_is_not_called_damaged(monkeypatch: pytest.MonkeyPatch, file: Path) -> None:
    """A failure of the connection while a chunk is read is reported as one, with the name of the chunk."""
    files, cat_file = MemoryFileSystem(), MemoryFileSystem.cat_file
    files.put(f"{file.parent}/a.zarr/", "/far/", recursive=True)

    def failing(mine: MemoryFileSystem, path: str, *words: object, **more: object) -> bytes:
        if "pressure/c" in path:
            raise ConnectionError("no route to host")
        return cat_file(mine, path, *words, **more)

    monkeypatch.setattr(MemoryFileSystem, "cat_file", failing)
    dataset = open_recording("memory://far")
    with pytest.raises(StoreError, match=r"pressure/c/\d/0/0 cannot be read: no route to host\. Check the connection"):
        dataset["pressure"].load()
    MemoryFileSystem.store.clear()


def test_a_lost_shard_is_no_damage(place: str) -> None:
    """Without a file, its pings read as not recorded: NaN."""
    files, root = fsspec.url_to_fs(place)
    files.rm(f"{root}/pressure/c/1/0/0")
    pressure = open_recording(place)["pressure"].values
    assert np.isfinite(pressure[:64]).all() and np.isnan(pressure[64:]).all()
