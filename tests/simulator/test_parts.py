"""Parts of a run by any processes leave the bytes of one run."""

from pathlib import Path

import fsspec
import numpy as np
import pytest
import xarray as xr

from insonify.cli import main
from insonify.formats import shards
from insonify.formats.label_store import open_labels
from insonify.formats.object_store import CLAIM
from insonify.formats.zarr_store import open_recording
from insonify.part import Part
from insonify.recording_run import record
from insonify.scenario.write import to_yaml
from insonify.simulator import simulate
from oracles.few_of import few_of
from oracles.scenes import nominal

LOOKS = {"keep": "both", "full_scale_db": 150, "stages": [{"kind": "looks", "samples": 4, "pings": 2}]}


@pytest.fixture(autouse=True)
def small_shards(monkeypatch: pytest.MonkeyPatch) -> None:
    """Shards of four pings, the last of one."""
    monkeypatch.setattr(shards, "FEWEST_PINGS", 4)
    monkeypatch.setattr(shards, "MOST_PINGS", 4)


def scene():
    """Nine short pings, labelled, with a recorder that averages two of them."""
    return nominal(
        track={"window": (0.1, 0.102), "pings": 9}, sonar={"recorder": LOOKS}, field="incoherent",
        output={"labels": True}, paths={"max_reflections": 0},
    )  # fmt: skip


def contents(path: Path) -> dict[str, bytes]:
    """All files but those with the identity of the recording."""
    files = (file for file in path.rglob("*") if file.is_file())
    names = {file: str(file.relative_to(path)) for file in files}
    return {name: file.read_bytes() for file, name in names.items() if name not in ("zarr.json", "labels/zarr.json")}


@pytest.fixture(scope="module")
def serial_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of one run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(shards, "FEWEST_PINGS", 4)
        patch.setattr(shards, "MOST_PINGS", 4)
        return record(scene(), tmp_path_factory.mktemp("serial") / "a.zarr", threads=2)


@pytest.fixture(scope="module")
def serial(serial_run: Path) -> dict[str, bytes]:
    """The files of one run."""
    return contents(serial_run)


@pytest.fixture(scope="module")
def held() -> xr.Dataset:
    """All pings in memory."""
    return simulate(scene())


@few_of((1, 3), "order", [(2, 1), (3, 1, 2, 1), (6, 2, 5, 1, 4, 3), (9, 1, 7, 3, 5, 8, 2, 6, 4)])
def test_parts_are_the_serial_run(
    serial: dict[str, bytes], held: xr.Dataset, tmp_path: Path, order: tuple[int, ...]
) -> None:
    """Sound, recorded lines and labels, with fewer parts than shards or more, on one thread or two: the same bytes."""
    path = tmp_path / "a.zarr"
    for number in order:
        record(scene(), path, part=Part(number, max(order)), threads=1 + number % 2)
    assert contents(path) == serial
    plain = xr.open_zarr(path, chunks=None, decode_times=False)  # without this program
    for found in (open_recording(path), plain):
        np.testing.assert_array_equal(found.intensity, held.intensity)
        np.testing.assert_array_equal(found.recorded, held.recorded)
    assert open_labels(path).done.values.all()


def objects(url: str) -> dict[str, bytes]:
    """All objects but those with the identity of the recording."""
    files, root = fsspec.url_to_fs(url)
    names = {name.removeprefix(f"{root}/"): name for name in files.find(root)}
    with_identity = ("zarr.json", "labels/zarr.json", CLAIM)
    return {name: files.cat_file(path) for name, path in names.items() if name not in with_identity}


@few_of((1,), "order", [(2, 1), (3, 1, 2, 1)])
@pytest.mark.parametrize("kind", ["memory", "file"])
def test_parts_in_a_store_are_the_serial_run(
    serial: dict[str, bytes], serial_run: Path, held: xr.Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    order: tuple[int, ...], kind: str,
) -> None:  # fmt: skip
    """Sound, recorded lines and labels, which are made by a run of their own: the same bytes, and the same numbers."""
    monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "spool"))
    url = f"{kind}://{tmp_path}/{order}/a.zarr/"
    for number in order:
        record(scene(), url, part=Part(number, max(order)), threads=1 + number % 2, with_labels=number > 1)
    assert open_recording(url).done.values.all() and open_labels(url).done.values.sum() < 9
    assert record(scene(), url) == url
    reports: list[tuple[int, int]] = []
    record(scene(), url, on_ping=lambda done, count: reports.append((done, count)))
    assert reports == [(9, 9)]  # sound, lines and labels are known to be there
    assert objects(url) == serial and not list((tmp_path / "spool").rglob(".loose/*/*"))
    np.testing.assert_array_equal(open_recording(url).recorded, held.recorded)
    assert open_labels(url).load().equals(open_labels(serial_run).load())


def test_few_pings_in_a_store_and_on_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without shards, each ping and each line of the recorder is put once: as on disk; run, status, show of a URL."""
    monkeypatch.undo()
    monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "spool"))
    file, url = tmp_path / "a.yaml", f"file://{tmp_path}/store/a.zarr"
    file.write_text(to_yaml(scene()), encoding="utf-8")
    assert main(["run", str(file), "-o", url, "--part", "2/2"]) == 0
    capsys.readouterr()
    assert main(["status", url]) == 0
    assert "5 of 9 pings recorded\n  5 of 9 pings labelled\n  missing: 0:4" in capsys.readouterr().out
    assert main(["run", str(file), "-o", url, "--pings", "0:7"]) == 0
    assert objects(url) == contents(record(scene(), tmp_path / "a.zarr"))
    assert main(["show", url, "-o", str(tmp_path / "a.png")]) == 0 and (tmp_path / "a.png").is_file()


def test_a_part_of_the_command_line(serial: dict[str, bytes], tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    """The parts of an array of jobs make the recording; a part that there is not, or --overwrite, is refused."""
    file, out = tmp_path / "a.yaml", str(tmp_path / "a.zarr")
    file.write_text(to_yaml(scene()), encoding="utf-8")
    for part in ("2/2", "1/2"):
        assert main(["run", str(file), "-o", out, "--part", part]) == 0
    assert contents(Path(out)) == serial
    capsys.readouterr()
    assert main(["run", str(file), "-o", out, "--part", "3/2"]) == 2
    assert "--part 3/2 is no part of a job; parts are 1/2 to 2/2" in capsys.readouterr().err
    assert main(["run", str(file), "-o", out, "--part", "1/2", "--overwrite"]) == 2
    assert "each part would delete the others" in capsys.readouterr().err
