"""Loose rows: damaged, packed or replaced while others look at them; the cost of a look is that of a few shards."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from insonify.formats import label_store, loose_rows, shards, zarr_store
from insonify.formats.label_store import labelled_pings, open_labels
from insonify.formats.loose_rows import LooseRow, append_row
from insonify.formats.recording_writer import RecordingWriter
from insonify.formats.shards import LOOSE, row_array
from insonify.formats.store_description import StoreError, WriteError
from insonify.formats.zarr_store import create_recording, open_recording, recorded_lines, recorded_pings, write_ping
from insonify.part import Part
from insonify.processing.recorded_lines import RecordedLines
from insonify.records.recording import RecordingLayout
from insonify.sonar.recorder import Looks, Recorder
from oracles.few_of import few_of
from oracles.numbered_pings import NAMES, PER_SHARD, PINGS, SAME, labels, layout, replying_apart, run_apart, sound

ARRAYS = ["position", "float32", "uint8", "bool", "done"]
HEAD = 24
"""Length of the header of a record [bytes]."""


@pytest.fixture(autouse=True)
def small_shards(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shards of 64 pings: two whole ones and a third of 22."""
    monkeypatch.setattr(shards, "MOST_PINGS", PER_SHARD)


def write(path: Path, pings: range = range(PINGS), *, labelled: bool = False) -> list[int]:
    """Write what is missing of some pings, as `record` does; return the numbers of those written."""
    mine = RecordingWriter(path, layout(), SAME, label_names=NAMES if labelled else None)
    missing, _ = mine.missing(list(pings))
    for ping, no_sound, no_labels in missing:
        mine.write(ping, sound(ping) if no_sound else None, labels(ping) if labelled and no_labels else None)
    mine.finish()
    return [ping for ping, *_ in missing]


def contents(path: Path) -> dict[str, bytes]:
    """All files of a recording but those that hold its identity."""
    files = (file for file in path.rglob("*") if file.is_file() and file.name != "zarr.json")
    return {str(f.relative_to(path)): f.read_bytes() for f in files}


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The labelled recording that one run makes."""
    path = tmp_path_factory.mktemp("serial") / "a.zarr"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "MOST_PINGS", PER_SHARD)
        write(path, labelled=True)
    return path


def damage(group: Path, name: str, row: int, offset: int) -> Path:
    """Flip a bit of a loose row, or of its header by a negative offset; return its file."""
    place = row_array(group, name).loose_rows()[row]
    content = bytearray(place.file.read_bytes())
    content[place.offset + offset] ^= 1
    place.file.write_bytes(content)
    return place.file


@few_of((1, 4), "name", ARRAYS)
@pytest.mark.parametrize("offset", [3, -HEAD, -HEAD + 9, -1], ids=["bytes", "row", "length", "checksum"])
def test_damaged_labels_are_found_and_written_again(serial: Path, tmp_path: Path, name: str, offset: int) -> None:
    """In whichever array: never packed, never counted as there; the next run leaves the bytes of the serial one."""
    path = tmp_path / "a.zarr"
    write(path, range(PER_SHARD - 1), labelled=True)
    damage(path / "labels", name, 2, offset)
    if offset < 0:  # the record and all after it in the file are lost, in the mask of readers too
        for there in (labelled_pings(path), open_labels(path).done.values):
            assert np.flatnonzero(there).tolist() == [0, 1]
    else:
        assert np.flatnonzero(~labelled_pings(path, intact=[0]))[0] == 2
    with pytest.MonkeyPatch.context() as another:  # as a process that had written its pings before the damage
        another.setattr(RecordingWriter, "masks", lambda mine, _: [np.arange(PINGS) < PER_SHARD - 1] * 3)
        assert write(path, range(PER_SHARD), labelled=True) == [PER_SHARD - 1]
    is_whole = name == "done" and offset > 0  # the header alone is an entry
    assert (path / "labels" / "done" / "c").exists() == is_whole
    write(path, labelled=True)
    assert contents(path) == contents(serial)


def test_a_damaged_ping_that_was_written_again_is_read(tmp_path: Path) -> None:
    """Of two records of a ping the whole one, in whichever order their files are listed."""
    for name in ("0-a", "0-z"):
        path = tmp_path / f"{name}.zarr"
        write(path, range(5))
        file = damage(path, "pressure", 2, 3)
        file.rename(file.with_name(name))
        with pytest.raises(StoreError, match=rf"pressure/{name} is damaged.*Write its pings again: insonify run FILE"):
            open_recording(path).pressure.load()
        assert write(path, range(5)) == [2]
        np.testing.assert_array_equal(open_recording(path).pressure[:5], [sound(k) for k in range(5)])


def test_readers_count_a_ping_only_where_its_sound_is_there(tmp_path: Path) -> None:
    """A damaged header ends its file: the pings after it are not recorded, for `done` and the status alike."""
    path = tmp_path / "a.zarr"
    write(path, range(5))
    damage(path, "pressure", 2, -4)
    for there in (open_recording(path).done.values, recorded_pings(path)):
        assert np.flatnonzero(there).tolist() == [0, 1]


def test_the_next_run_of_a_process_does_not_append_to_a_damaged_file(tmp_path: Path) -> None:
    """Records after a damaged header are never found: a second run of the same process begins new files."""
    path = tmp_path / "a.zarr"
    write(path, range(5))
    damage(path, "pressure", 2, -4)
    write(path)
    assert write(path) == [] and not any("0-" in name for name in contents(path))


RECORDER = Recorder(stages=(Looks(pings=2),))


def lines_writer(path: Path) -> RecordingWriter:
    """A writer of pings and of lines of two pings each."""
    plain = layout()
    recorded = RecordingLayout(
        "pressure", plain.time, plain.ping_time, plain.steer, plain.position, plain.position,
        line_ping=np.arange(0, PINGS, 2), bin_time=plain.time, recorded_units="uPa",
    )  # fmt: skip
    lines = RecordedLines(RECORDER, plain.time, 1500.0, 0.0)
    return RecordingWriter(path, recorded, SAME, lines=lines)


LOOKS: dict[str, Callable[[Path], np.ndarray]] = {
    "status": recorded_pings,
    "lines": lambda path: np.repeat(recorded_lines(path), 2),
    "done": lambda path: open_recording(path).done.values,
    "pressure": lambda path: ~np.isnan(open_recording(path).pressure.values[:, 0, 0]),
}


def after_a_packing(
    act: Callable, left: Iterator[int], mine: RecordingWriter, patch: pytest.MonkeyPatch
) -> Callable:  # fmt: skip
    """A function before whose first call, when no steps are left, another process packs."""

    def late(*args: object, **more: object) -> object:
        if next(left, None) is None:
            patch.undo()
            mine.pack()
        return act(*args, **more)

    return late


@few_of((0, 1, 3), "look", LOOKS)
def test_packed_at_any_moment_of_a_look_no_ping_is_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, look: str
) -> None:
    """Another process packs a shard before each listing of a folder and each look at a file: all pings are there."""
    for step in (*range(12), 30, 60, 100, 150):
        path = tmp_path / f"{step}.zarr"
        mine, left = lines_writer(path), iter(range(step))
        mine.missing(list(range(PER_SHARD)))
        with monkeypatch.context() as earlier:
            earlier.setattr(mine, "pack", lambda _: None)
            for ping in range(PER_SHARD):
                mine.write(ping, sound(ping), None)
        with monkeypatch.context() as patch:
            for module, name in ((os, "listdir"), (Path, "is_file"), (Path, "open")):
                patch.setattr(module, name, after_a_packing(getattr(module, name), left, mine, patch))
            there = LOOKS[look](path)
        assert np.flatnonzero(there).tolist() == list(range(PER_SHARD)), step


REPLACED = """
import sys
import test_loose_rows_and_others as t
t.shards.MOST_PINGS = 64
for path in sys.stdin:
    t.replace_by_three(path.strip())
    print("done", flush=True)
"""


def test_a_recording_replaced_while_another_run_packs_keeps_its_loose_pings(tmp_path: Path) -> None:
    """Replaced at each of the confirmations: loose pings of the new recording are not deleted with those of the old."""
    stopped = list[int]()
    with replying_apart(REPLACED) as replace:
        for moment in range(1, 9):
            path = tmp_path / f"{moment}.zarr"
            mine, calls = RecordingWriter(path, layout(), SAME), list[int]()
            for ping in range(PER_SHARD):
                write_ping(path, ping, sound(ping))
            own = zarr_store.require_own_recording

            def replaced(
                where: Path, into: str | None, act: Callable = own, at: int = moment, called: list = calls
            ) -> str:
                found = act(where, into)
                called.append(1)
                if len(called) == at:
                    assert replace(where) == "done\n"
                return found

            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(zarr_store, "require_own_recording", replaced)
                try:
                    mine.pack()
                except (StoreError, WriteError):
                    stopped.append(moment)
            if len(calls) >= moment:
                assert np.flatnonzero(recorded_pings(path)).tolist() == [1, 2, 3], moment
    assert stopped == [2, 3]  # while it renames a shard and its mask


@pytest.mark.parametrize(
    ("module", "name"), [(label_store.zarr, "consolidate_metadata"), (label_store, "labelled_pings")]
)
def test_a_recording_replaced_while_another_run_opens_it_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: ModuleType, name: str
) -> None:
    """By one without labels, while these are created or their mask is read: the error states it."""
    path, act = tmp_path / "a.zarr", getattr(module, name)
    create_recording(path, layout(), SAME)

    def replaced(*args: object, **more: object) -> object:
        monkeypatch.undo()
        create_recording(path, layout(), SAME, overwrite=True)
        return act(*args, **more)

    monkeypatch.setattr(module, name, replaced)
    with pytest.raises(StoreError, match="was replaced by another run while this one went on"):
        RecordingWriter(path, layout(), SAME, label_names=NAMES).missing(list(range(PINGS)))


def replace_by_three(path: str) -> None:
    """Replace a recording by one with three loose pings."""
    create_recording(path, layout(), SAME, overwrite=True)
    for ping in (1, 2, 3):
        write_ping(path, ping, sound(ping))


def test_a_recording_renamed_while_a_folder_is_made_is_not_made_anew(tmp_path: Path) -> None:
    """Between its renaming and the next one its name is free: neither a loose ping nor a chunk takes it."""
    for count in (PINGS, 20):
        path, old = tmp_path / f"{count}.zarr", tmp_path / f"{count} old.zarr"
        create_recording(path, layout(count), SAME)
        array = row_array(path, "pressure")
        with pytest.raises(FileNotFoundError):
            shards.put_rows([(array, 0, b"sound")], lambda path=path, old=old: path.exists() and path.rename(old))
        assert not path.exists() and old.exists()


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Iterator[set[str]]:
    """Names of the files of loose rows that are looked into."""
    names, act = set[str](), loose_rows._records

    def look(file: Path) -> Iterator[tuple[int, LooseRow]]:
        names.add(file.name)
        return act(file)

    monkeypatch.setattr(loose_rows, "_records", look)
    yield names


def test_reading_a_ping_looks_at_its_shard_only(tmp_path: Path, opened: set[str]) -> None:
    """A loop over the pings of a recording that is incomplete costs no look at all of them for each."""
    path = tmp_path / "a.zarr"
    write(path, range(10, 140))
    held = open_recording(path)
    opened.clear()
    np.testing.assert_array_equal(held.pressure[12], sound(12))
    assert {name.partition("-")[0] for name in opened} == {"0"}


def test_a_part_reads_the_loose_bytes_of_its_own_shards_only(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of many tasks that go on at once, each reads what it is to complete, not what all others have written."""
    path, read, content = tmp_path / "a.zarr", set[str](), LooseRow.content
    write(path, range(10, 140), labelled=True)
    monkeypatch.setattr(LooseRow, "content", lambda row: read.add(row.file.name.partition("-")[0]) or content(row))
    mine = RecordingWriter(path, layout(), SAME, label_names=NAMES)
    missing, _ = mine.missing(mine.of_part(Part(3, 3), list(range(PINGS))))
    assert [ping for ping, *_ in missing] == list(range(140, 150)) and read == {"2"}


def test_a_record_that_cannot_be_written_whole_states_the_reason(tmp_path: Path) -> None:
    """Under a limit of the size of files: that, and no full disk; later pings go to another file."""
    path = tmp_path / "a.zarr"
    script = f"""
import resource, test_loose_rows_and_others as t
from pathlib import Path
t.shards.MOST_PINGS = 64
mine = t.RecordingWriter(Path({str(path)!r}), t.layout(), t.SAME)
resource.setrlimit(resource.RLIMIT_FSIZE, (400, resource.RLIM_INFINITY))
for ping in range(5):
    try:
        mine.write(ping, t.sound(ping), None)
    except t.WriteError as error:
        print(ping, "cannot be written: File too large" in str(error))
"""
    assert run_apart(script).splitlines()[:1] == ["3 True"]
    assert np.flatnonzero(recorded_pings(path)).tolist() == [0, 1, 2, 4]


def test_unfinished_labels_of_killed_processes_are_deleted(tmp_path: Path) -> None:
    """Labels are made under another name in the recording: what is left of that is deleted after ten minutes."""
    path = tmp_path / "a.zarr"
    write(path, range(5), labelled=True)
    for age, name in ((0, "recent"), (1e4, "stale")):
        unfinished = path / f".{label_store.FOLDER}.{name}.partial"
        unfinished.mkdir()
        os.utime(unfinished, (unfinished.stat().st_mtime - age,) * 2)
    write(path, range(5), labelled=True)
    assert [folder.name for folder in path.glob("*.partial")] == [f".{label_store.FOLDER}.recent.partial"]


def test_a_recording_that_appears_between_two_looks_is_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Created by another process just after this one has found none: opened, and not taken for something else."""
    path, look = tmp_path / "a.zarr", zarr_store._is_recording

    def late(target: Path) -> bool:
        monkeypatch.setattr(zarr_store, "_is_recording", look)
        found = look(target)
        create_recording(path, layout(), SAME)
        return found

    monkeypatch.setattr(zarr_store, "_is_recording", late)
    assert create_recording(path, layout(), SAME) == zarr_store.identity(path)


def test_a_row_of_false_is_loose_without_bytes(tmp_path: Path) -> None:
    """It is there, so that its loss is found; a reader sees False, and a shard has none of it."""
    path = tmp_path / "a.zarr"
    write(path, range(5), labelled=True)
    rows = row_array(path / "labels", "bool").loose_rows()
    assert sorted(rows) == list(range(5)) and [k for k in rows if not rows[k].length] == [0, 3]
    held = open_labels(path).highlight.values
    np.testing.assert_array_equal(held[:5], [labels(k).highlight for k in range(5)])


def test_append_row_begins_no_file_in_another_recording(tmp_path: Path) -> None:
    """Where the folder is that of another recording by now, nothing is written."""

    def changed() -> None:
        raise StoreError("replaced")

    (tmp_path / LOOSE).mkdir()
    with pytest.raises(StoreError):
        append_row(tmp_path / LOOSE / "pressure", 0, 0, b"sound", changed)
    assert not any((tmp_path / LOOSE).iterdir())
