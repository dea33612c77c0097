"""Loose rows: records of many threads and processes, read while they are written."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from insonify.formats.loose_rows import append_row, loose_files, loose_rows, loose_shards

ROWS = 200


def content(row: int) -> bytes:
    """Bytes of a row, of another length each."""
    return bytes([row % 251]) * (1 + row % 97)


def append(folder: Path, row: int) -> None:
    """Append one of the rows, eight to a shard."""
    append_row(folder, row // 8, row, content(row), lambda: None)


def test_rows_of_many_threads_are_whole(tmp_path: Path) -> None:
    """Eight threads of one process append at once: each row is there with its bytes, and a shard is one file."""
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda row: append(tmp_path, row), range(ROWS)))
    found = loose_rows(tmp_path, intact=range(ROWS))
    assert {row: one.content() for row, one in found.items()} == {row: content(row) for row in range(ROWS)}
    assert len(list(tmp_path.iterdir())) == len(loose_shards(tmp_path)) == ROWS // 8


def test_rows_are_read_while_they_are_written(tmp_path: Path) -> None:
    """A reader and four writers at once: rows that were there stay there, each with its bytes."""
    with ThreadPoolExecutor(4) as pool:
        writing, seen = [pool.submit(append, tmp_path, row) for row in range(ROWS)], set[int]()
        while not all(one.done() for one in writing):
            found = loose_rows(tmp_path)
            assert seen <= found.keys() and all(one.content() == content(row) for row, one in found.items())
            seen = set(found)
    assert loose_rows(tmp_path).keys() == set(range(ROWS))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked")
def test_a_forked_process_has_files_of_its_own(tmp_path: Path) -> None:
    """Parent and child append rows of one shard: two files, all rows."""
    append(tmp_path, 0)
    child = os.fork()
    if not child:
        append(tmp_path, 1)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
    append(tmp_path, 2)
    assert len(list(tmp_path.iterdir())) == 2 and sorted(loose_rows(tmp_path, [0])) == [0, 1, 2]


def test_the_files_of_a_shard_are_its_own(tmp_path: Path) -> None:
    """Those of others stay; a folder that is not there has none."""
    for row in (3, 8, 9, 16):
        append(tmp_path, row)
    for file in loose_files(tmp_path, [1]):
        file.unlink()
    assert sorted(loose_rows(tmp_path)) == [3, 16] and loose_shards(tmp_path) == {0, 2}
    assert loose_rows(tmp_path / "none") == {} and loose_shards(tmp_path / "none") == set()


def test_nothing_is_written_where_another_recording_has_come(tmp_path: Path) -> None:
    """The check fails after the file was opened: an error, and no row."""

    def refuse() -> None:
        raise RuntimeError("replaced")

    append(tmp_path, 0)
    with pytest.raises(RuntimeError, match="replaced"):
        append_row(tmp_path, 0, 1, b"of an earlier recording", refuse)
    assert list(loose_rows(tmp_path)) == [0]
