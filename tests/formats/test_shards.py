"""Shards: the same bytes whichever process writes the pings, in any order, killed at any moment."""

import errno
import io
import os
import random
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
import zarr

from insonify.formats import shards
from insonify.formats.recording_state import decreasing_shares
from insonify.formats.recording_writer import RecordingWriter
from insonify.formats.shards import LOOSE, pings_per_shard, row_array
from insonify.formats.store_description import WriteError
from insonify.formats.zarr_store import (
    StoreError,
    create_recording,
    open_recording,
    recorded_pings,
    write_ping,
)
from insonify.part import Part
from oracles.few_of import few_of
from oracles.numbered_pings import PER_SHARD, PINGS, SAME, layout, run_apart, sound, write_and_kill_apart


@pytest.fixture(autouse=True)
def small_shards(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shards of 64 pings: two whole ones and a third of 22."""
    monkeypatch.setattr(shards, "MOST_PINGS", PER_SHARD)


def writer(path: Path) -> RecordingWriter:
    """A writer into the recording."""
    return RecordingWriter(path, layout(), SAME)


def write_part(path: str | Path, part: Part | None = None) -> None:
    """Write what is missing of a part in a random order, as `record` does."""
    mine = writer(Path(path))
    missing, _ = mine.missing(mine.of_part(part, list(range(PINGS))))
    random.Random(part.number if part else 0).shuffle(missing)
    for ping, *_ in missing:
        mine.write(ping, sound(ping), None)
    mine.pack()


def contents(path: Path) -> dict[str, bytes]:
    """All files of a recording but those that hold its identity."""
    files = (file for file in path.rglob("*") if file.is_file())
    return {str(f.relative_to(path)): f.read_bytes() for f in files if f != path / "zarr.json"}


def flip_bit(path: Path, ping: int) -> Path:
    """The file of a loose ping, one bit of which is changed."""
    row = row_array(path, "pressure").loose_rows()[ping]
    content = bytearray(row.file.read_bytes())
    content[row.offset + 10] ^= 1
    row.file.write_bytes(content)
    return row.file


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The recording that one run makes."""
    path = tmp_path_factory.mktemp("serial") / "a.zarr"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "MOST_PINGS", PER_SHARD)
        write_part(path)
    return path


def test_a_shard_is_written_as_zarr_would(serial: Path, tmp_path: Path) -> None:
    """Byte by byte the shards and masks that zarr itself makes of the same numbers; no loose ping is left."""
    create_recording(tmp_path / "a.zarr", layout(), SAME)
    zarr.open_array(tmp_path / "a.zarr" / "pressure", mode="r+")[:] = np.stack([sound(k) for k in range(PINGS)])
    zarr.open_array(tmp_path / "a.zarr" / "done", mode="r+")[:] = True
    assert contents(serial) == contents(tmp_path / "a.zarr")
    assert sorted(file.name for file in (serial / "pressure" / "c").iterdir()) == ["0", "1", "2"]


def test_pings_are_read_from_shards_and_loose_alike(tmp_path: Path) -> None:
    """At any time each written ping is there, by number, slice or list, and others are NaN."""
    path = tmp_path / "a.zarr"
    mine = writer(path)
    mine.missing(list(range(PINGS)))
    for ping in (*range(64), 70, 149):
        mine.write(ping, sound(ping), None)
    held = open_recording(path)
    assert np.flatnonzero(held.done).tolist() == np.flatnonzero(recorded_pings(path)).tolist() == [*range(64), 70, 149]
    for ping in (3, 70, 149):
        np.testing.assert_array_equal(held.pressure[ping], sound(ping))
    np.testing.assert_array_equal(held.pressure[60:72, 1, 2:4][10], sound(70)[1, 2:4])
    np.testing.assert_array_equal(held.pressure[[149, 5]], [sound(149), sound(5)])
    np.testing.assert_array_equal(held.pressure.isel(channel=[1], time=[0, 5])[70], sound(70)[[1]][:, [0, 5]])
    assert np.isnan(held.pressure[[69, 71]]).all()
    plain = xr.open_zarr(path, chunks=None, decode_times=False)
    assert plain.done.values.sum() == 64 and np.isnan(plain.pressure[70]).all()


@pytest.mark.parametrize("count", [2, 3, 7])
def test_parts_in_any_order_are_the_serial_run(serial: Path, tmp_path: Path, count: int) -> None:
    """Of whole shards or less than one each, some twice, pings shuffled: file by file the bytes of one run."""
    order = random.Random(count)
    parts = [Part(k, count) for k in range(1, count + 1)] * 2
    order.shuffle(parts)
    for part in parts:
        write_part(tmp_path / "a.zarr", part)
    assert contents(tmp_path / "a.zarr") == contents(serial)


class Killed(BaseException):
    """Stands for a signal that nothing can catch."""


@few_of((0, 2, 4, 7), "step", [0, 1, 2, 3, 30, 66, 100, 130])
def test_killed_while_it_packs_nothing_is_lost(
    serial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: int
) -> None:
    """Whichever rename or deletion is the last, each ping is still read, and the next run leaves the serial bytes."""
    path, left = tmp_path / "a.zarr", iter(range(step))
    mine = writer(path)
    for ping in range(PER_SHARD):
        write_ping(path, ping, sound(ping))
    with monkeypatch.context() as patch:
        for module, name in ((os, "replace"), (Path, "unlink")):

            def dying(*args: object, act: object = getattr(module, name), **more: object) -> None:
                if next(left, None) is None:
                    raise Killed
                act(*args, **more)

            patch.setattr(module, name, dying)
        with suppress(Killed):
            mine.pack()
    np.testing.assert_array_equal(open_recording(path).pressure[:64], [sound(k) for k in range(64)])
    for unfinished in (path / ".loose").rglob("*.partial"):
        os.utime(unfinished, (0, 0))
    write_part(path)
    assert contents(path) == contents(serial)


def test_a_ping_written_twice_is_one_ping(serial: Path, tmp_path: Path) -> None:
    """By one process or two: it is read, counted and packed once."""
    path = tmp_path / "a.zarr"
    writer(path)
    write_ping(path, 3, sound(3))
    write_ping(path, 3, sound(3))
    run_apart(f"import test_shards as t\nt.write_ping({str(path)!r}, 3, t.sound(3))")
    assert np.flatnonzero(recorded_pings(path)).tolist() == [3]
    assert len(list((path / LOOSE / "pressure").iterdir())) == 2
    write_part(path)
    assert contents(path) == contents(serial)


def test_loose_pings_of_one_process_are_one_file_for_each_shard(serial: Path, tmp_path: Path) -> None:
    """100 pings in two shards: two files of sound, two of entries; none is left once all shards are packed."""
    path = tmp_path / "a.zarr"
    writer(path)
    for ping in range(100):
        write_ping(path, ping, sound(ping))
    assert [len(list((path / LOOSE / name).iterdir())) for name in ("pressure", "done")] == [2, 2]
    assert np.flatnonzero(recorded_pings(path)).tolist() == list(range(100))
    write_part(path)
    assert contents(path) == contents(serial)


@pytest.mark.parametrize("name", ["pressure", "done"])
@pytest.mark.parametrize("lost", [1, 30, 100])
def test_a_process_killed_within_a_record_costs_that_ping(serial: Path, tmp_path: Path, name: str, lost: int) -> None:
    """A file of loose pings cut short: the last ping, or more, is missing; a run writes it again."""
    path = tmp_path / "a.zarr"
    writer(path)
    for ping in range(5):
        write_ping(path, ping, sound(ping))
    (file,) = (path / LOOSE / name).iterdir()
    os.truncate(file, file.stat().st_size - lost)
    file.rename(file.with_name("0-killed"))  # the file of another process
    there = np.flatnonzero(recorded_pings(path)).tolist()
    assert there == list(range(len(there))) and len(there) < 5
    np.testing.assert_array_equal(open_recording(path).pressure[there], [sound(k) for k in there])
    write_part(path)
    assert contents(path) == contents(serial)


def test_a_damaged_loose_ping_is_named_and_written_again(serial: Path, tmp_path: Path) -> None:
    """A flipped bit: reading names the file, a new run finds the ping missing, and shards have the serial bytes."""
    path = tmp_path / "a.zarr"
    writer(path)
    for ping in range(5):
        write_ping(path, ping, sound(ping))
    damaged = flip_bit(path, 2)
    with pytest.raises(StoreError, match=f"loose/pressure/{damaged.name} is damaged.*pings again: insonify run"):
        open_recording(path).pressure.load()
    assert writer(path).missing(list(range(5)))[0] == [(2, True, False)]
    write_part(path)
    assert contents(path) == contents(serial)


def test_a_process_that_packs_with_a_damaged_ping_leaves_it_missing(serial: Path, tmp_path: Path) -> None:
    """Damaged between writing and packing: the shard is not packed, and the next run completes it."""
    path = tmp_path / "a.zarr"
    mine = writer(path)
    for ping in range(PER_SHARD):
        write_ping(path, ping, sound(ping))
    flip_bit(path, 2)
    mine.pack()
    assert np.flatnonzero(~recorded_pings(path, intact=[0]))[0] == 2
    write_part(path)
    assert contents(path) == contents(serial)


@few_of((0, 1, 2), "seed", range(6))
def test_whatever_is_damaged_of_loose_pings_a_run_leaves_the_serial_bytes(
    serial: Path, tmp_path: Path, seed: int
) -> None:
    """Random bytes of files of killed processes changed, or their ends cut off: read or refused, then written again."""
    path, rng = tmp_path / "a.zarr", random.Random(seed)
    writer(path)
    for ping in range(90):
        write_ping(path, ping, sound(ping))
    for file in sorted((path / LOOSE).rglob("*-*")):
        content = bytearray(file.read_bytes())
        for _ in range(rng.choice([0, 1, 3, 20])):
            content[rng.randrange(len(content))] = rng.randrange(256)
        if rng.random() < 0.3:
            del content[rng.randrange(len(content)) :]
        file.unlink()
        file.with_name(f"{file.name.partition('-')[0]}-killed").write_bytes(content)
    with suppress(StoreError):
        held = open_recording(path)
        for ping in np.flatnonzero(recorded_pings(path, intact=range(3))):
            np.testing.assert_array_equal(held.pressure[ping], sound(int(ping)))
    write_part(path)
    assert contents(path) == contents(serial)


def test_a_record_cut_short_by_a_full_disk_ends_its_file(
    serial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Half of a record is written: an error of a full disk; later pings go to another file and are read."""
    path = tmp_path / "a.zarr"
    mine, opened = writer(path), Path.open

    class Full:
        """A file on a full disk."""

        def __init__(self, file: io.FileIO) -> None:
            self.file = file

        def __enter__(self) -> "Full":
            return self

        def __exit__(self, *_: object) -> None:
            self.file.close()

        def write(self, record: bytes) -> int:
            if file.stat().st_size > before:
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            return self.file.write(record[: len(record) // 2])

    mine.write(0, sound(0), None)
    (file,) = (path / LOOSE / "pressure").iterdir()
    before = file.stat().st_size
    with monkeypatch.context() as full:
        full.setattr(Path, "open", lambda file, *how, **more: Full(opened(file, *how, **more)))
        with pytest.raises(WriteError, match="disk is full"):
            mine.write(1, sound(1), None)
    mine.write(2, sound(2), None)
    assert np.flatnonzero(recorded_pings(path)).tolist() == [0, 2]
    write_part(path)
    assert contents(path) == contents(serial)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked")
def test_twenty_processes_are_killed_and_the_recording_is_the_serial_one(serial: Path, tmp_path: Path) -> None:
    """Five parts, three at a time and one of them twice, 20 of these processes killed by SIGKILL: the same bytes."""
    path = tmp_path / "a.zarr"
    write_and_kill_apart(__file__, str(path), parts=5, at_once=3, longest=0.03)
    found, expected = contents(path), contents(serial)
    assert {name: found[name] for name in expected} == expected
    left = found.keys() - expected.keys()
    assert all(name.startswith(".loose") and name.endswith(".partial") for name in left), left  # deleted in 10 min


CREATORS = """
import os
import test_shards as t
start, output = os.pipe(), os.pipe()
for _ in range(4):
    if not os.fork():
        os.close(start[1])
        os.read(start[0], 1)  # all go on at once, when it is closed
        os.write(output[1], t.create_recording({path!r}, t.layout(), t.SAME).encode() + b"\\n")
        os._exit(0)
os.close(start[1])
codes = [os.wait()[1] for _ in range(4)]
print(codes, len(set(os.read(output[0], 9999).split())))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked")
def test_the_first_creation_wins(tmp_path: Path) -> None:
    """Four processes that create a recording at once agree on one identity, and nothing else is left."""
    assert run_apart(CREATORS.format(path=str(tmp_path / "a.zarr"))) == "[0, 0, 0, 0] 1\n"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.zarr"]


def test_a_temporary_folder_that_vanishes_while_it_is_looked_at_stops_no_other_process(tmp_path: Path) -> None:
    """Another process has renamed its folder since the list was made: here a link to nothing, which is alike."""
    (tmp_path / ".a.zarr.0.partial").symlink_to(tmp_path / "gone")
    assert create_recording(tmp_path / "a.zarr", layout(), SAME)


def test_a_million_pings_open_without_reading_them(tmp_path: Path) -> None:
    """Arrays over the pings are single chunks, and shards 1024 pings: a few files and nothing per ping."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "MOST_PINGS", 1024)
        create_recording(tmp_path / "a.zarr", layout(10**6), SAME)
        opened = xr.open_zarr(tmp_path / "a.zarr", chunks=None, decode_times=False)
        assert opened.sizes["ping"] == 10**6 == opened.position.shape[0]
        assert opened.pressure.encoding["shards"][0] == 1024 and opened.pressure.encoding["chunks"][0] == 1
    assert sum(file.is_file() for file in (tmp_path / "a.zarr").rglob("*")) < 40


def test_the_size_of_a_shard(monkeypatch: pytest.MonkeyPatch) -> None:
    """64 to 1024 pings and 64 to 512 MB where both can be, whole lines of a recorder, one file a ping of short runs."""
    monkeypatch.setattr(shards, "MOST_PINGS", 1024)
    for pings, size, line, expected in (
        (64, 10**5, 1, 1), (65, 10**5, 1, 65), (10**6, 1, 1, 1024), (10**6, 2**17, 1, 512), (10**6, 2**20, 1, 64),
        (10**6, 2**24, 1, 32), (10**6, 2**30, 1, 1), (10**6, 2**17, 5, 510), (10**6, 2**29, 5, 5),
    ):  # fmt: skip
        assert pings_per_shard(pings, size, line) == expected, (pings, size, line)


def test_shards_in_a_store_are_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    """8 MB, or a 64th of the recording, of 16 pings at least; whole lines; never longer than on a disk."""
    monkeypatch.setattr(shards, "MOST_PINGS", 1024)
    for pings, size, line, expected in (
        (64, 10**4, 1, 1), (65, 10**4, 1, 16), (1000, 10**4, 1, 16), (10**4, 10**4, 1, 156), (10**6, 2**13, 1, 1024),
        (10**6, 2**15, 1, 256), (1000, 2**24, 1, 16), (10**6, 2**24, 1, 32), (10**6, 2**30, 1, 1), (1000, 1, 5, 15),
        (1000, 1, 50, 50), (10**8, 2**20, 1, 64),
    ):  # fmt: skip
        assert pings_per_shard(pings, size, line, in_store=True) == expected, (pings, size, line)
        assert expected <= pings_per_shard(pings, size, line)


@pytest.mark.parametrize("cut", [10, 3000])
def test_a_damaged_shard_is_named_and_its_pings_simulated_again(serial: Path, tmp_path: Path, cut: int) -> None:
    """Reading names the file; when it is deleted, as advised, its pings are missing, and a run restores the bytes."""
    path = tmp_path / "a.zarr"
    write_part(path)
    file = path / "pressure" / "c" / "1" / "0" / "0"
    file.write_bytes(file.read_bytes()[:cut])
    with pytest.raises(StoreError, match=r"pressure/c/1/0/0 is damaged.*Delete it"):
        open_recording(path).pressure.load()
    file.unlink()
    assert np.flatnonzero(~recorded_pings(path)).tolist() == list(range(64, 128))
    write_part(path)
    assert contents(path) == contents(serial)


def test_a_recording_of_an_earlier_version_is_read_and_continued(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Many pings with a file each: parts go on in the same way, status and mask agree, and no shard is made."""
    path = tmp_path / "a.zarr"
    with monkeypatch.context() as earlier:
        earlier.setattr(shards, "FEWEST_PINGS", PINGS)
        create_recording(path, layout(), SAME)
    for ping in (0, 7, 149):
        write_ping(path, ping, sound(ping))
    assert np.flatnonzero(open_recording(path).done).tolist() == [0, 7, 149]
    for number in (3, 1, 2):
        write_part(path, Part(number, 3))
    assert recorded_pings(path).all() and not (path / ".loose").exists()
    assert len(list((path / "pressure" / "c").iterdir())) == PINGS
    np.testing.assert_array_equal(open_recording(path).pressure, np.stack([sound(k) for k in range(PINGS)]))


@pytest.mark.parametrize("workers", [1, 2, 7])
@pytest.mark.parametrize(("first", "count", "unit"), [(0, 1000, 1), (37, 100, 16), (0, 3, 1), (5, 1, 64), (0, 640, 64)])
def test_shares_hold_each_ping_once_and_end_small(workers: int, first: int, count: int, unit: int) -> None:
    """In order, from unit to unit; the first are half of the work, the last a sixteenth; done pings have no weight."""
    weights = np.ones(count)
    shares = decreasing_shares(weights, workers, first=first, unit=unit)
    assert [ping for share in shares for ping in share] == list(range(first, first + count))
    assert all(share.start % unit == 0 for share in shares[1:])
    if count == 1000:
        assert sum(map(len, shares[:workers])) == pytest.approx(500, abs=workers)
        assert sum(map(len, shares[-workers:])) == pytest.approx(1000 / 16, abs=workers)
        weights[:600] = 0
        ends = [share.stop for share in decreasing_shares(weights, workers)]
        assert ends[workers - 1] == pytest.approx(800, abs=workers)
    assert sum(map(len, decreasing_shares(0 * weights, workers))) == count
