"""Recordings in object stores: whole shards by whole objects, the bytes of a run on disk, whatever fails."""

import os
import random
import shutil
import sys
import uuid
import warnings
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import fsspec
import numpy as np
import pytest
import xarray as xr
from fsspec.implementations.local import LocalFileSystem
from fsspec.implementations.memory import MemoryFileSystem

from insonify.cli import main
from insonify.formats import recording_state, shards
from insonify.formats.label_store import open_labels
from insonify.formats.locations import is_url
from insonify.formats.loose_rows import append_row
from insonify.formats.object_store import CLAIM, ObjectStore, spool_folder
from insonify.formats.recording_writer import RecordingWriter
from insonify.formats.shards import row_array
from insonify.formats.store_description import StoreError, WriteError
from insonify.formats.store_writer import COMPLETE, StoreWriter
from insonify.formats.zarr_store import identity, open_recording
from insonify.kernel_cache import user_cache
from insonify.part import Part
from oracles.few_of import few_of
from oracles.numbered_pings import PER_SHARD, PINGS, SAME, layout, sound, write_and_kill_apart


@pytest.fixture(autouse=True)
def small_shards(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Shards of 64 pings, two whole ones and one of 22; loose pings in a folder of the test."""
    monkeypatch.setattr(shards, "MOST_PINGS", PER_SHARD)
    monkeypatch.setattr(shards, "FEWEST_IN_OBJECT", PER_SHARD)  # as on disk, so that files can be compared
    monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "spool"))


@pytest.fixture(params=["memory", "file"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """A place for a recording, in memory or on disk."""
    yield f"memory://{uuid.uuid4().hex}/a.zarr" if request.param == "memory" else f"file://{tmp_path}/store/a.zarr"
    MemoryFileSystem.store.clear()


def write_part(path: str | Path, part: Part | None = None, pings: range = range(PINGS), count: int = PINGS) -> int:
    """Write what is missing of a part in a random order, as `record` does; return the number of written pings."""
    mine = (StoreWriter if is_url(path) else RecordingWriter)(path, layout(count), SAME)
    missing, _ = mine.missing(mine.of_part(part, list(pings)))
    random.Random(count).shuffle(missing)
    for ping, *_ in missing:
        mine.write(ping, sound(ping), None)
    mine.finish()
    return len(missing)


def objects(url: str) -> dict[str, bytes]:
    """Objects of a recording but those that hold its identity."""
    files, root = fsspec.url_to_fs(url)
    names = {name: name.removeprefix(f"{root}/") for name in files.find(root)}
    return {names[name]: files.cat_file(name) for name in names if names[name] not in ("zarr.json", CLAIM)}


@cache
def on_disk(count: int = PINGS) -> dict[str, bytes]:
    """The files of the same recording on disk."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "serial.zarr")
        write_part(path, count=count, pings=range(count))
        files = (file for file in path.rglob("*") if file.is_file() and file != path / "zarr.json")
        return {file.relative_to(path).as_posix(): file.read_bytes() for file in files}


def spooled() -> list[Path]:
    """Recordings that wait on disk, and are not complete."""
    return [folder.parent for folder in spool_folder().glob("*/.loose") if not (folder.parent / COMPLETE).exists()]


@pytest.mark.parametrize(
    ("url", "order"),
    [("file", (1,)), ("memory", (3, 1, 2, 1)), ("memory", (2, 1)), ("file", (9, 1, 7, 3, 5, 8, 2, 6, 4))],
    indirect=["url"],
)
def test_parts_in_any_order_are_the_run_on_disk(url: str, order: tuple[int, ...]) -> None:
    """Byte by byte, with fewer parts than shards or more, one of them twice; nothing is left on disk."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of nine parts, six have no pings
        written = [write_part(url, Part(number, max(order))) for number in order]
    assert sum(written) == PINGS and spooled() == []
    assert objects(url) == on_disk()
    held, plain = open_recording(url), xr.open_zarr(url, chunks=None, decode_times=False)
    for found in (held, plain):
        np.testing.assert_array_equal(found.pressure, [sound(k) for k in range(PINGS)])
    assert held.done.values.all() and held.position.attrs["units"] == "m"


def test_a_modest_survey_can_be_divided(
    url: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    """Shards of 16 pings, where a disk has 64: ten parts, one of them killed, are resumed; the status agrees."""
    monkeypatch.setattr(shards, "FEWEST_IN_OBJECT", 16)
    mine = StoreWriter(url, layout(), SAME)
    missing, _ = mine.missing(mine.of_part(Part(4, 10), list(range(PINGS))))
    assert [missing[0][0], missing[-1][0]] == [48, 63]
    for ping, *_ in missing[:9]:
        mine.write(ping, sound(ping), None)  # and no further: killed
    assert [write_part(url, Part(k, 10)) for k in (1, 3, 2, 10)] == [16, 16, 16, 6]
    assert main(["status", url, "--tasks", "10"]) == 0
    assert "9 of them loose" in (shown := capsys.readouterr().out) and "unfinished parts of 10: 4-9" in shown
    assert [write_part(url, Part(k, 10)) for k in range(4, 10)] == [7, *[16] * 5]
    monkeypatch.setattr(shards, "FEWEST_IN_OBJECT", 32)  # another version would choose other shards for a new one
    monkeypatch.setenv("INSONIFY_SPOOL", str(spool_folder() / "of another machine"))
    fsspec.url_to_fs(url)[0].rm(f"{fsspec.url_to_fs(url)[1]}/pressure/c/9/0/0")
    assert write_part(url) == 6
    names = ObjectStore(url).names()
    assert sum(name.startswith("pressure/c/") for name in names) == 10
    np.testing.assert_array_equal(open_recording(url).pressure, [sound(k) for k in range(PINGS)])


def test_few_pings_are_an_object_each(url: str) -> None:
    """Up to 64 pings there are no shards: parts of any size, each ping in the store as soon as it is written."""
    mine = StoreWriter(url, layout(20), SAME)
    mine.missing([3])
    mine.write(3, sound(3), None)
    assert np.flatnonzero(open_recording(url).done).tolist() == [3]
    assert sum(write_part(url, Part(k, 7), range(20), 20) for k in (5, 1, 2, 3, 4, 6, 7)) == 19
    assert objects(url) == on_disk(20)


def test_a_part_is_whole_shards(url: str) -> None:
    """A part between two shards has none, with a warning; parts of two writers share no shard."""
    with pytest.warns(UserWarning, match=r"part 1/9 has no pings: .*a.zarr has 3 shards of 64 pings"):
        assert write_part(url, Part(1, 9)) == 0
    mine = StoreWriter(url, layout(), SAME)
    shares = [mine.of_part(Part(k, 2), list(range(PINGS))) for k in (1, 2)]
    assert [(share[0], share[-1]) for share in shares] == [(0, 63), (64, 149)]


def test_loose_pings_wait_on_this_machine(url: str, capsys: pytest.CaptureFixture[str]) -> None:
    """A shard in part stays in the spool, with a warning; the status counts it, the store lacks it, a run takes it."""
    for _ in range(2):  # also where nothing is left to simulate
        with pytest.warns(UserWarning, match=r"10 pings wait in .*spool.* are not in .*such as --pings 64:128"):
            write_part(url, pings=range(100, 110))
    assert not open_recording(url).done.values.any() and len(spooled()) == 1
    write_part(url, pings=range(64))
    assert main(["status", url + "/", "--tasks", "3"]) == 0
    shown = capsys.readouterr().out
    assert "74 of 150 pings recorded" in shown and f"10 of them loose in {spooled()[0]}, on this machine only" in shown
    assert "missing: 64:100, 110:150" in shown and "unfinished parts of 3: 2-3" in shown
    assert write_part(url) == 76
    assert main(["status", url]) == 0 and spooled() == []
    assert "all 150 pings recorded" in capsys.readouterr().out


def test_another_scenario_is_refused(url: str) -> None:
    """As on disk; nothing changes, also where the recording was only claimed; --overwrite is refused."""
    other = {**SAME, "scenario": "title: there"}
    store = ObjectStore(url)
    mine = store.claim(SAME)
    with pytest.raises(StoreError, match=r"not a recording"):
        open_recording(url)
    with pytest.raises(StoreError, match=r"another scenario.*there 'title: here', now 'title: there'.*or delete it"):
        StoreWriter(url, layout(), other)
    write_part(url, Part(1, 3))
    before = objects(url)
    with pytest.raises(StoreError, match="another scenario"):
        StoreWriter(url, layout(), other)
    with pytest.raises(StoreError, match="Delete it first"):
        StoreWriter(url, layout(), SAME, overwrite=True)
    shutil.rmtree(spool_folder())  # as on another machine
    with pytest.raises(StoreError, match="arrays of other shapes or chunks"):
        StoreWriter(url, layout(149), SAME)
    assert objects(url) == before and store.claim(SAME) == mine


def test_what_is_no_recording_is_not_written_into(url: str, tmp_path: Path) -> None:
    """Other objects, another zarr group, a file in place of the folder: refused, and left as they were."""
    files, root = fsspec.url_to_fs(url, auto_mkdir=True)
    for name, content in ((f"{root}/notes.txt", b"mine"), (f"{root}/zarr.json", b'{"attributes": {}}')):
        files.pipe_file(name, content)
        with pytest.raises(StoreError, match="exists and is not a recording"):
            write_part(url)
        assert files.find(root) == [name] and files.cat_file(name) == content
        files.rm(name)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(StoreError, match="exists and is not a recording"):
        write_part(f"file://{tmp_path}/file")
    assert (tmp_path / "file").read_text() == "mine" and spooled() == []


@few_of(
    (0, 1, 3, 5, 8, 10, 12),
    ("url", "step"),
    [*(("memory", step) for step in (0, 1, 12, 20, 21, 22, 23, 24, 25, 26)), ("file", 20), ("file", 21), ("file", 24)],
    indirect=["url"],
)
def test_a_store_that_fails_loses_nothing(url: str, monkeypatch: pytest.MonkeyPatch, step: int) -> None:
    """Whichever put fails, nothing is half there: no recording, or one of complete shards; the next run completes it.

    From the creation on, the failure is one of the run: what was simulated is kept.
    """
    left, written = iter(range(step)), set[int]()
    with monkeypatch.context() as patch:
        for kind in (MemoryFileSystem, LocalFileSystem):
            for name in ("put_file", "pipe_file"):

                def failing(*args: object, act: object = getattr(kind, name), **more: object) -> None:
                    if next(left, None) is None:
                        raise ConnectionError("no route to host")
                    act(*args, **more)

                patch.setattr(kind, name, failing)
        write = RecordingWriter.write
        patch.setattr(RecordingWriter, "write", lambda mine, ping, *rest: (written.add(ping), write(mine, ping, *rest)))
        with suppress(WriteError, StoreError):
            write_part(url)
    complete = ObjectStore(url).description() is not None
    assert complete == (step > 20)  # objects of a recording without pings, and the claim
    if complete:
        held = open_recording(url)
        for ping in np.flatnonzero(held.done):
            np.testing.assert_array_equal(held.pressure[ping], sound(int(ping)))
    assert write_part(url) == PINGS - len(written)
    assert objects(url) == on_disk() and spooled() == []


def test_messages_are_advice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Missing packages, wrong URLs, no permission, a folder without permission: a remedy each; nothing is left."""
    for url, message in (
        ("nowhere://a/b.zarr", "Protocol not known"), ("memory://", "names no folder"), ("file:///", "names no folder"),
        ("file:///proc/a.zarr", "Check the URL, the credentials and the permission"),
    ):  # fmt: skip
        with pytest.raises(StoreError, match=message):
            write_part(url)
        assert main(["status", url]) == 2 and spooled() == []
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "fsspec", None)
        with pytest.raises(StoreError, match=r"not installed.*Install it: pip install .*s3fs for s3://"):
            write_part("s3://bucket/a.zarr")
    with monkeypatch.context() as patch:
        patch.setenv("INSONIFY_SPOOL", "/proc/spool")
        with pytest.raises(StoreError, match="Set INSONIFY_SPOOL to a folder that can"):
            write_part("memory://m/a.zarr")
    with pytest.raises(ValueError, match="Give the URL as text"):
        open_recording(Path("s3://bucket/a.zarr"))


def test_a_recording_that_is_deleted_or_replaced_meanwhile(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The writer ends with a message before it puts anything; deleted by hand, the same command starts anew."""
    files, root = fsspec.url_to_fs(url)
    mine = StoreWriter(url, layout(), SAME)
    mine.missing(list(range(PER_SHARD)))
    for ping in range(PER_SHARD - 1):
        mine.write(ping, sound(ping), None)
    files.rm(root, recursive=True)
    with pytest.raises(WriteError, match=r"was deleted during the run\. The same command starts anew"):
        mine.write(PER_SHARD - 1, sound(PER_SHARD - 1), None)
    monkeypatch.setenv("INSONIFY_SPOOL", str(spool_folder() / "of another machine"))
    StoreWriter(url, layout(), {**SAME, "seed": 2})
    with pytest.raises(StoreError, match="was replaced by another run"):
        mine.pack()
    assert not any(name.startswith(("pressure/c", "done/c")) for name in objects(url))


def test_a_second_writer_on_this_machine_ends_well(url: str) -> None:
    """Of the same part: the first completes the recording and deletes the spool, the second has pings to write yet."""
    both = [StoreWriter(url, layout(), SAME) for _ in range(2)]
    for mine in both:
        mine.missing(list(range(PINGS)))
    both[1].write(0, sound(0), None)
    for ping in range(1, PINGS):
        both[0].write(ping, sound(ping), None)
    both[1].write(1, sound(1), None)  # of a shard that is put
    both[0].finish()
    (spool,) = spool_folder().glob(f"*/{COMPLETE}")
    os.utime(spool, (0, 0))
    write_part(f"{url}-2", Part(1, 3))  # deletes the spool
    assert not spool.exists()
    both[1].write(2, sound(2), None)
    both[1].finish()
    assert objects(url) == on_disk() and not spool.parent.exists()


def test_two_machines_put_the_same_bytes(url: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each with a spool of its own and the same part; a third one later has nothing to simulate."""
    writers = []
    for machine in "ab":
        monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / machine))
        writers.append(StoreWriter(url, layout(), SAME))
        writers[-1].missing(list(range(PINGS)))
    for ping in range(PINGS):
        for mine in writers:
            mine.write(ping, sound(ping), None)
    assert objects(url) == on_disk()
    monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "c"))
    assert write_part(url) == 0
    for number, mine in enumerate(writers):
        monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "ab"[number]))
        mine.finish()
    assert len(list(tmp_path.glob(f"[abc]/*/{COMPLETE}"))) == 3


def test_a_copied_recording_goes_on_in_the_store(url: str, tmp_path: Path) -> None:
    """A recording on disk, copied with its loose pings: its shards are done, its identity remains."""
    write_part(tmp_path / "a.zarr", pings=range(70))
    files, root = fsspec.url_to_fs(url, auto_mkdir=True)
    for file in (tmp_path / "a.zarr").rglob("*"):
        if file.is_file():
            files.pipe_file(f"{root}/{file.relative_to(tmp_path / 'a.zarr').as_posix()}", file.read_bytes())
    assert write_part(url) == PINGS - PER_SHARD
    found, expected = objects(url), on_disk()
    assert {name: found[name] for name in expected} == expected
    assert ObjectStore(url).claim(SAME) == identity(tmp_path / "a.zarr")


def test_a_spool_killed_while_it_deletes_is_tidied(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Shards and loose pings that the store has by now are deleted at the end of a run, those that it lacks are not."""
    unlink = Path.unlink

    def dying(file: Path, missing_ok: bool = False) -> None:
        if file.match("pressure/c/0/0/0"):  # after its entry in the mask
            raise KeyboardInterrupt
        unlink(file, missing_ok)

    with monkeypatch.context() as patch, suppress(KeyboardInterrupt):
        patch.setattr(Path, "unlink", dying)
        write_part(url, pings=range(PER_SHARD))
    (spool,) = spooled()
    shard = spool / "pressure" / "c" / "0" / "0" / "0"
    assert shard.is_file() and open_recording(url).done.values.sum() == PER_SHARD
    stored = row_array(spool, "pressure")
    append_row(stored.loose_folder, 0, 5, b"by a second writer", lambda: None)
    with pytest.warns(UserWarning, match="1 pings wait"):
        write_part(url, pings=range(70, 71))
    assert not shard.exists() and list(stored.loose_rows()) == [70]


def test_the_spool_is_in_the_cache_of_the_user(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a choice; an empty one is none."""
    monkeypatch.setenv("INSONIFY_SPOOL", "")
    assert spool_folder() == user_cache("insonify") / "spool" and "numba" not in spool_folder().parts


def test_labels_of_another_recording_are_refused(url: str) -> None:
    """Without labels the message states how to make them, and labels that were copied in are not shown."""
    write_part(url, Part(1, 3))
    files, root = fsspec.url_to_fs(url, auto_mkdir=True)
    with pytest.raises(StoreError, match=r"has no labels\. Make them: insonify run FILE -o .*a.zarr --labels"):
        open_labels(url)
    strange = files.cat_file(f"{root}/zarr.json").replace(ObjectStore(url).claim(SAME).encode(), b"another")
    files.pipe_file(f"{root}/labels/zarr.json", strange)
    with pytest.raises(StoreError, match="has no labels"):
        open_labels(url)
    files.pipe_file(f"{root}/zarr.json", b"{")
    with pytest.raises(StoreError, match=r"a.zarr/zarr.json, line 1, column 2: damaged, not JSON"):
        open_recording(url)


def test_a_million_pings_are_a_few_objects(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Descriptions and small arrays are put whole, nothing per ping; the mask of all is read by one listing."""
    monkeypatch.setattr(shards, "MOST_PINGS", 1024)
    mine = StoreWriter(url, layout(10**6), SAME)
    assert len(objects(url)) < 40
    opened = xr.open_zarr(url, chunks=None, decode_times=False)
    assert opened.sizes["ping"] == 10**6 and opened.pressure.encoding["shards"][0] == 1024
    np.testing.assert_array_equal(opened.position[-1], layout(10**6).position[-1])
    assert len(mine.of_part(Part(977, 977), list(range(10**6)))) == 10**6 % 1024


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked")
def test_twenty_processes_are_killed_and_the_recording_is_the_serial_one(tmp_path: Path) -> None:
    """Three parts, two at a time and one of them twice, 20 of these processes killed by SIGKILL: the same bytes."""
    url = f"file://{tmp_path}/store/a.zarr"
    write_and_kill_apart(__file__, url, parts=3, at_once=2, longest=0.06)
    found = {name: content for name, content in objects(url).items() if not name.endswith(".partial")}
    assert found == on_disk()


def test_the_status_counts_a_shard_that_is_put_meanwhile(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Deleted from this machine after it was looked at there, or before: its pings are never missing."""
    act = recording_state.zarr_store.recorded_pings
    for name in "ab":
        mine = StoreWriter(f"{url}-{name}", layout(), SAME)
        mine.missing(list(range(PER_SHARD)))
        for ping in range(PER_SHARD - 1):
            mine.write(ping, sound(ping), None)

        def late(path: Path, mine: StoreWriter = mine, first: bool = name == "a") -> np.ndarray:
            found = None if first else act(path)
            monkeypatch.setattr(recording_state.zarr_store, "recorded_pings", act)
            mine.write(PER_SHARD - 1, sound(PER_SHARD - 1), None)
            return act(path) if found is None else found

        monkeypatch.setattr(recording_state.zarr_store, "recorded_pings", late)
        state = recording_state.recording_state(f"{url}-{name}")
        assert np.flatnonzero(state.recorded).tolist() == list(range(PER_SHARD)) and state.loose == 0
