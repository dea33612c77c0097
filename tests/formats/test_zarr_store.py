"""A recording on disk can be stopped and taken up again at any moment."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import zarr

from insonify.formats import zarr_store
from insonify.formats.zarr_store import (
    StoreError,
    create_recording,
    open_recording,
    recorded_pings,
    write_ping,
)
from insonify.records.recording import RecordingLayout

PINGS, CHANNELS, SAMPLES = 5, 2, 40
SAME = {"scenario": "title: here", "seed": 1, "version": "0"}


def layout(field: str = "pressure") -> RecordingLayout:
    """A short track of a sonar with two beams."""
    place = np.arange(3.0 * PINGS).reshape(PINGS, 3)
    grid = np.arange(SAMPLES) / 25e3
    return RecordingLayout(field, grid, 0.3 * np.arange(PINGS), np.array([0.0, 0.1]), place, place / 100)


def sound(ping: int) -> np.ndarray:
    """Some pressure, another one for every ping."""
    rng = np.random.default_rng(ping)
    noise = rng.normal(size=(2, CHANNELS, SAMPLES))
    return (noise[0] + 1j * noise[1]).astype(np.complex64)


def test_what_is_written_is_read_bit_by_bit(tmp_path: Path) -> None:
    """Pressure, geometry and attributes come back as they went in; absent pings are NaN."""
    path = tmp_path / "harbour.zarr"
    create_recording(path, layout(), SAME)
    write_ping(path, 3, sound(3))
    data = open_recording(path)
    assert data["pressure"].dtype == np.complex64
    np.testing.assert_array_equal(data["pressure"][3], sound(3))
    assert np.isnan(data["pressure"][2]).all()
    np.testing.assert_array_equal(data["position"], layout().position)
    np.testing.assert_array_equal(data["time"], layout().time)
    assert SAME.items() <= data.attrs.items()
    assert recorded_pings(path).tolist() == [False, False, False, True, False]


@pytest.mark.parametrize(("field", "units"), [("pressure", "uPa"), ("intensity", "uPa^2")])
def test_every_variable_states_what_it_is(tmp_path: Path, field: str, units: str) -> None:
    """Units and a long name on each; dimensions by name."""
    create_recording(tmp_path / "a.zarr", layout(field), SAME)
    data = open_recording(tmp_path / "a.zarr")
    assert data[field].dims == ("ping", "channel", "time") and data[field].attrs["units"] == units
    for name, variable in data.variables.items():
        assert variable.attrs.get("units") and variable.attrs.get("long_name"), name
    assert {"ping_time", "steer", "time"} <= set(data.coords)


def test_a_ping_is_a_chunk(tmp_path: Path) -> None:
    """One file per ping, so that writers never share one."""
    path = tmp_path / "a.zarr"
    create_recording(path, layout(), SAME)
    write_ping(path, 1, sound(1))
    write_ping(path, 4, sound(4))
    for name in ("pressure", "done"):
        chunks = {file.relative_to(path / name / "c").parts[0] for file in (path / name / "c").rglob("*")}
        assert chunks == {"1", "4"}


@pytest.mark.parametrize("field", ["pressure", "intensity"])
def test_a_ping_is_written_as_zarr_would(tmp_path: Path, field: str) -> None:
    """Byte by byte the chunks that zarr itself makes of the same numbers."""
    ours, theirs = tmp_path / "ours.zarr", tmp_path / "theirs.zarr"
    values = sound(2) if field == "pressure" else np.abs(sound(2)).astype(float)
    for path in (ours, theirs):
        create_recording(path, layout(field), SAME)
    write_ping(ours, 2, values)
    zarr.open_array(theirs / field, mode="r+")[2] = values
    zarr.open_array(theirs / "done", mode="r+")[2] = True
    for name in (field, "done"):
        written, expected = (
            {file.relative_to(path): file.read_bytes() for file in (path / name / "c").rglob("*") if file.is_file()}
            for path in (ours, theirs)
        )
        assert written == expected and len(expected) == 1


def test_the_mask_is_what_zarr_reads(tmp_path: Path) -> None:
    """Names of chunks give the same as their contents, also where a write was broken off."""
    path = tmp_path / "a.zarr"
    create_recording(path, layout(), SAME)
    assert not recorded_pings(path).any()
    for ping in (4, 0):
        write_ping(path, ping, sound(ping))
    (path / "done" / "c" / ".2.0123.partial").write_bytes(b"half")
    np.testing.assert_array_equal(recorded_pings(path), zarr.open_array(path / "done", mode="r")[:])
    assert recorded_pings(path).dtype == bool and recorded_pings(path).sum() == 2
    (path / "done" / "c" / "3").touch()  # as a power cut may leave it
    assert not recorded_pings(path)[3]


def test_the_same_scenario_goes_on_and_another_one_does_not(tmp_path: Path) -> None:
    """A second run of the same scenario keeps the pings; any other is refused and harms nothing."""
    path = tmp_path / "a.zarr"
    create_recording(path, layout(), SAME)
    write_ping(path, 0, sound(0))
    create_recording(path, layout(), SAME)
    assert recorded_pings(path)[0]
    with pytest.raises(StoreError, match=r"another scenario and seed.*--overwrite"):
        create_recording(path, layout(), {**SAME, "scenario": "title: there", "seed": 2})
    assert recorded_pings(path)[0]
    create_recording(path, layout(), {**SAME, "seed": 2}, overwrite=True)
    assert not recorded_pings(path).any()
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.zarr"]


def test_the_first_line_in_which_two_scenarios_differ_is_shown(tmp_path: Path) -> None:
    """What was changed since, as it stands in both; a line that is new stands against the one in its place."""
    text = "title: there\nwater:\n  smoothing: 1.0\n"
    create_recording(tmp_path / "a.zarr", layout(), {**SAME, "scenario": text})
    changed = {**SAME, "scenario": text.replace("1.0", "2.0")}
    with pytest.raises(StoreError, match=r"differs: there 'smoothing: 1\.0', now 'smoothing: 2\.0'\)\. Choose"):
        create_recording(tmp_path / "a.zarr", layout(), changed)
    with pytest.raises(StoreError, match=r"there 'nothing', now 'ph: 7'"):
        create_recording(tmp_path / "a.zarr", layout(), {**SAME, "scenario": text + "  ph: 7\n"})
    with pytest.raises(StoreError, match=r"another seed\. Choose"):
        create_recording(tmp_path / "a.zarr", layout(), {**SAME, "scenario": text, "seed": 9})


def test_nothing_but_a_recording_is_ever_replaced(tmp_path: Path) -> None:
    """A folder of photographs is safe, even from --overwrite; an empty folder is a fine place."""
    album, empty = tmp_path / "album", tmp_path / "empty"
    album.mkdir()
    empty.mkdir()
    (album / "cat.png").write_bytes(b"meow")
    for overwrite in (False, True):
        with pytest.raises(StoreError, match="not a recording"):
            create_recording(album, layout(), SAME, overwrite=overwrite)
    assert (album / "cat.png").read_bytes() == b"meow"
    create_recording(empty, layout(), SAME)
    assert not recorded_pings(empty).any()
    with pytest.raises(StoreError, match="insonify run"):
        open_recording(album)


def replace_recording(monkeypatch: pytest.MonkeyPatch, path: Path, moment: int) -> None:
    """Let another recording take the place before (even moments) or after (odd ones) one of the identity checks."""
    calls, check = list[int](), zarr_store.require_own_recording

    def replaced(where: Path, into: str | None) -> str:
        calls.append(len(calls))
        if 2 * calls[-1] == moment:
            create_recording(path, layout(), {**SAME, "seed": 2}, overwrite=True)
        found = check(where, into)
        if 2 * calls[-1] + 1 == moment:
            create_recording(path, layout(), {**SAME, "seed": 2}, overwrite=True)
            (path / "pressure" / "c").mkdir(exist_ok=True)
        return found

    monkeypatch.setattr(zarr_store, "require_own_recording", replaced)


@pytest.mark.parametrize("moment", range(1, 4))
def test_a_run_replaced_between_two_pings_leaves_nothing_in_the_new_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: int
) -> None:
    """As below, where the folders are there already: no check but before the files are created and renamed."""
    path = tmp_path / "a.zarr"
    mine = create_recording(path, layout(), SAME)
    write_ping(path, 1, sound(1), into=mine)
    replace_recording(monkeypatch, path, moment)
    with pytest.raises(StoreError, match="replaced by another run"):
        write_ping(path, 3, sound(3), into=mine)
    assert not recorded_pings(path).any() and not list(path.rglob("*.partial"))


@pytest.mark.parametrize("moment", range(5))
def test_a_run_replaced_at_any_moment_of_a_write_leaves_nothing_in_the_new_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, moment: int
) -> None:
    """Before and after each check of its identity, a ping's chunk and its entry stay out of what took its place."""
    path = tmp_path / "a.zarr"
    mine = create_recording(path, layout(), SAME)
    replace_recording(monkeypatch, path, moment)
    with pytest.raises(StoreError, match="replaced by another run"):
        write_ping(path, 3, sound(3), into=mine)
    assert not recorded_pings(path).any()
    assert np.isnan(open_recording(path)["pressure"]).all()
    assert not list(path.rglob("*.partial"))


def test_a_place_where_no_folder_can_be_made_is_the_names_fault(tmp_path: Path) -> None:
    """Below a file, or under a name too long for any folder: stated with the fix, and nothing is left there."""
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file" / "a.zarr", tmp_path / ("a" * 300)):
        with pytest.raises(StoreError, match=r"cannot be written: .* Choose a folder"):
            create_recording(place, layout(), SAME)
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


def test_data_of_the_wrong_shape_are_refused(tmp_path: Path) -> None:
    """Too few channels, or a ping that the track does not have."""
    create_recording(tmp_path / "a.zarr", layout(), SAME)
    with pytest.raises(ValueError, match="shape"):
        write_ping(tmp_path / "a.zarr", 0, sound(0)[:1])
    with pytest.raises(ValueError, match="no ping 5"):
        write_ping(tmp_path / "a.zarr", PINGS, sound(0))
    assert not recorded_pings(tmp_path / "a.zarr").any()


class Killed(BaseException):
    """Stands for a signal that nothing can catch."""


@pytest.mark.parametrize("writes", range(5))
def test_killed_between_any_two_writes_the_mask_promises_nothing_false(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, writes: int
) -> None:
    """Whichever write is the last, a ping in the mask is a ping in the store."""
    create_recording(tmp_path / "a.zarr", layout(), SAME)
    put, left = os.replace, iter(range(writes))

    def dying(aside: Path, place: Path) -> None:
        if next(left, None) is None:
            raise Killed
        put(aside, place)

    monkeypatch.setattr(os, "replace", dying)
    with pytest.raises(Killed):
        for ping in range(PINGS):
            write_ping(tmp_path / "a.zarr", ping, sound(ping))
    mask = recorded_pings(tmp_path / "a.zarr")
    assert mask.sum() == writes // 2
    for ping in np.flatnonzero(mask):
        np.testing.assert_array_equal(open_recording(tmp_path / "a.zarr")["pressure"][ping], sound(ping))


KILLS = """
import os, random, shutil, signal, sys, time
sys.path.insert(0, {tests!r})
from test_zarr_store import PINGS, SAME, create_recording, layout, sound, write_ping

def write(pipe):
    while True:
        create_recording({path!r}, layout(), SAME, overwrite=True)
        for ping in range(PINGS):
            write_ping({path!r}, ping, sound(ping))
        os.write(pipe, b"ready")  # each time; the pipe holds them

order = random.Random(1)
for run in range(10):
    ends = os.pipe()
    writer = os.fork()
    if not writer:
        try:
            write(ends[1])
        finally:
            os._exit(1)
    os.read(ends[0], 5)
    time.sleep(order.uniform(0.0, 0.2))
    os.kill(writer, signal.SIGKILL)
    assert os.waitpid(writer, 0)[1] == signal.SIGKILL
    if os.path.exists({path!r}):
        shutil.copytree({path!r}, f"{path}.{{run}}")
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="processes are forked")
def test_killed_at_any_moment_what_the_mask_states_is_there(tmp_path: Path) -> None:
    """Ten runs are killed without warning; the recording is whole, or absent, or begun, never wrong."""
    path = tmp_path / "a.zarr"
    script = KILLS.format(tests=str(Path(__file__).parent), path=str(path))
    subprocess.run([sys.executable, "-c", script], check=True, timeout=120)
    left = list(tmp_path.glob("a.zarr.?"))
    assert left
    for killed in left:
        for ping in np.flatnonzero(recorded_pings(killed)):
            np.testing.assert_array_equal(open_recording(killed)["pressure"][ping], sound(ping))
    create_recording(path, layout(), SAME)
    write_ping(path, 0, sound(0))
    assert recorded_pings(path)[0]


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("zarr.json", b"{", r"zarr\.json, line 1, column 2: damaged"),
        ("zarr.json", b"", r"zarr\.json, line 1, column 1: damaged"),
        ("zarr.json", b"\xff\xfe\x00", r"zarr\.json is damaged: not text"),
        ("zarr.json", b"[]", r"zarr\.json is damaged"),
        ("pressure/zarr.json", b"{", r"pressure.zarr\.json, line 1, column 2: damaged"),
        ("done/zarr.json", None, r"done.zarr\.json is missing"),
        ("time/c", None, r"time.c is missing"),
        ("pressure", None, "neither pressure nor intensity"),
    ],
)
def test_a_damaged_recording_is_named_file_by_file(
    tmp_path: Path, file: str, content: bytes | None, message: str
) -> None:
    """Opening it, or going on with it, reports which file is broken and what to do."""
    path = tmp_path / "harbour.zarr"
    create_recording(path, layout(), SAME)
    write_ping(path, 0, sound(0))
    if content is not None:
        (path / file).write_bytes(content)
    elif (path / file).is_dir():
        shutil.rmtree(path / file)
    else:
        (path / file).unlink()
    for attempt in (lambda: open_recording(path), lambda: create_recording(path, layout(), SAME)):
        with pytest.raises(StoreError, match=message + r".*simulate again"):
            attempt()


@pytest.mark.parametrize("damaged", ["pressure/c/1/0/0", "done/c/1"])
@pytest.mark.parametrize("cut", [20, 0])
def test_a_damaged_chunk_is_named_and_its_ping_simulated_again(tmp_path: Path, damaged: str, cut: int) -> None:
    """Half a chunk, as a full disk leaves it: reading names its file; the ping of a lost chunk is not recorded."""
    path = tmp_path / "harbour.zarr"
    create_recording(path, layout(), SAME)
    for ping in range(2):
        write_ping(path, ping, sound(ping))
    file = path / damaged
    file.write_bytes(file.read_bytes()[: min(cut, file.stat().st_size - 1)])
    message = rf"{damaged} is damaged.*Delete it and simulate its pings again"
    with pytest.raises(StoreError, match=message):
        open_recording(path).load()
    if damaged.startswith("pressure"):
        np.testing.assert_array_equal(open_recording(path)["pressure"][0], sound(0))
        with pytest.raises(StoreError, match=message):
            open_recording(path)["pressure"][1, 0, 3:7].values.sum()
        file.unlink()
    assert recorded_pings(path).tolist() == [True, False, False, False, False]
    write_ping(path, 1, sound(1))
    np.testing.assert_array_equal(open_recording(path).load()["pressure"][1], sound(1))
