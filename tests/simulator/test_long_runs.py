"""Long runs: bounded memory, and a clear end where the disk gives out."""

import errno
import os
import shutil
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from insonify import machine_memory
from insonify.cli import main
from insonify.formats import shards
from insonify.formats.store_description import WriteError
from insonify.formats.zarr_store import open_recording, recorded_pings
from insonify.recording_run import record
from insonify.scenario.write import to_yaml
from insonify.simulator import simulate
from oracles.few_of import few_of
from oracles.scenes import nominal, point

PINGS = 12


def scene(pings: int = PINGS, **more):
    """Short pings at one point."""
    return nominal(
        targets=[point(0.0, 12.0, 15.0)], track={"window": (0.016, 0.018), "pings": pings},
        paths={"max_reflections": 0, "contributions": ("target",)},
        sonar={"transmit": {"kind": "point"}, "receive": {"kind": "point"}}, **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def whole() -> np.ndarray:
    """Pressure of all pings."""
    return simulate(scene()).pressure.values


class FullDisk:
    """Disk that takes a number of writes, then none."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, writes: int, error: int = errno.ENOSPC) -> None:
        """In place of the writes of files."""
        self.left, self.error, self.monkeypatch = writes, error, monkeypatch
        for module, name in ((Path, "write_bytes"), (shards, "append_row")):
            monkeypatch.setattr(module, name, self._limited(getattr(module, name)))

    def _limited(self, write):
        def limited(file, content, *rest):
            self.left -= 1
            if self.left < 0:
                raise OSError(self.error, os.strerror(self.error), str(file))
            return write(file, content, *rest)

        return limited


@few_of((0, 2, 4, 6), "writes", [0, 1, 8, 9, 16, 22, 24])
def test_a_full_disk_keeps_what_is_recorded(
    whole: np.ndarray, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, writes: int
) -> None:
    """The error reports it and what to do; the store opens, its pings are right, and the next run completes it."""
    monkeypatch.setattr(shards, "FEWEST_PINGS", 4)
    monkeypatch.setattr(shards, "MOST_PINGS", 4)
    path = tmp_path / "a.zarr"
    record(scene(), path, pings=[])
    with monkeypatch.context() as patch:
        FullDisk(patch, writes)
        with pytest.raises(WriteError, match=r"a\.zarr: the disk is full\. Free some space.*the same command goes on"):
            record(scene(), path, threads=1)
    assert not list(path.rglob("*.partial"))
    there = recorded_pings(path)
    found = open_recording(path)
    assert (found.done.values == there).all()
    np.testing.assert_array_equal(found.pressure.values[there], whole[there])
    record(scene(), path)
    np.testing.assert_array_equal(open_recording(path).pressure, whole)


def test_a_real_disk_that_fills(whole: np.ndarray, tmp_path: Path) -> None:
    """A file system of 200 kB in memory, where the machine may mount one: the same."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(disk)], check=False, capture_output=True
    )
    if mounted.returncode:
        pytest.skip("no file system can be mounted")
    try:
        with pytest.raises(WriteError, match="the disk is full"):
            record(scene(400), disk / "a.zarr", threads=1)
        found = open_recording(disk / "a.zarr")
        there = found.done.values
        assert 0 < there.sum() < 400
        np.testing.assert_array_equal(found.pressure.values[:PINGS], whole)
        assert np.isfinite(found.pressure.values[there]).all()
    finally:
        subprocess.run(["umount", str(disk)], check=True)


@pytest.mark.parametrize(
    ("error", "message"),
    [(errno.EROFS, "cannot be written: Read-only file system. What was recorded is kept"), (errno.EIO, "Input/output")],
)
def test_a_disk_that_fails_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: int, message: str
) -> None:
    """From the command line: one line and exit code 1, for the input is right."""
    file = tmp_path / "a.yaml"
    file.write_text(to_yaml(scene()), encoding="utf-8")
    with monkeypatch.context() as patch:
        record(scene(), tmp_path / "a.zarr", pings=[0])
        FullDisk(patch, 6, error)
        assert main(["run", str(file), "-o", str(tmp_path / "a.zarr"), "--threads", "1"]) == 1
    assert message in (err := capsys.readouterr().err) and err.count("\n") <= 2
    assert 1 < recorded_pings(tmp_path / "a.zarr").sum() < PINGS


def test_an_output_that_is_removed_is_named(tmp_path: Path) -> None:
    """Renamed by someone during the run.

    The run ends, reports it, and makes no folder of pings without a description.
    """
    path = tmp_path / "a.zarr"
    with pytest.raises(WriteError, match="was removed or renamed during the run"):
        record(scene(), path, threads=1, on_ping=lambda done, _: done == 2 and path.rename(tmp_path / "b.zarr"))
    assert not path.exists() and recorded_pings(tmp_path / "b.zarr").sum() == 2


@pytest.mark.parametrize("first", ["", "pressure", "labels", "done", "zarr.json"])
def test_an_output_that_is_deleted_is_named(tmp_path: Path, first: str) -> None:
    """Deleted with its folder during the run, whatever part of it is deleted first."""
    path = tmp_path / "gone" / "a.zarr"

    def delete(done: int, _: int) -> None:
        if done == 2:
            shutil.rmtree(path / first if first else path.parent) if first != "zarr.json" else (path / first).unlink()

    with pytest.raises(WriteError, match="was removed or renamed during the run"):
        record(scene(), path, threads=1, on_ping=delete, with_labels=True)


def test_a_hundred_thousand_pings_are_created_opened_and_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A recording of 100 000 pings of which two are simulated, by few files: opened here and by xarray alone."""
    path = record(scene(10**5), tmp_path / "a.zarr", pings=[5, 10**5 - 1], threads=1)
    assert sum(file.is_file() for file in path.rglob("*")) < 40
    for opened in (open_recording(path), xr.open_zarr(path)):
        assert opened.sizes["ping"] == opened.position.shape[0] == 10**5
        assert int(opened.ping[-1]) == 10**5 - 1
    assert np.flatnonzero(open_recording(path).done).tolist() == [5, 10**5 - 1]
    assert main(["status", str(path), "--tasks", "64"]) == 0
    assert "2 of 100,000 pings recorded" in capsys.readouterr().out


def test_simulate_warns_before_memory_is_full(monkeypatch: pytest.MonkeyPatch) -> None:
    """All pings of more than half of what is free: a warning names both, and `record`; of less there is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        size = simulate(scene()).pressure.nbytes
    assert machine_memory.installed_memory() >= machine_memory.available_memory() > 100e6
    monkeypatch.setattr(machine_memory, "available_memory", lambda: 1.9 * size)
    with pytest.warns(UserWarning, match=r"simulate\(\) holds all pings in memory: .* GB are free\. record\(\)"):
        simulate(scene())


PEAK = """
import resource, sys
from insonify import load_scenario
from insonify.recording_run import record
peaks = {{}}
def take(done, count):
    peaks[done] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
record(load_scenario({scenario!r}), {path!r}, threads=1, on_ping=take)
print(peaks[100], peaks[400], int('scipy.signal' in sys.modules))
"""


@pytest.fixture(scope="module")
def long_run(tmp_path_factory: pytest.TempPathFactory) -> list[int]:
    """What a process of its own states of 400 coherent pings on disk, see `PEAK`."""
    tmp_path = tmp_path_factory.mktemp("long")
    (tmp_path / "a.yaml").write_text(to_yaml(scene(400)), encoding="utf-8")
    script = PEAK.format(scenario=str(tmp_path / "a.yaml"), path=str(tmp_path / "a.zarr"))
    run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True, timeout=300)
    return [int(word) for word in run.stdout.split()]


@pytest.mark.slow
def test_memory_does_not_grow_with_the_pings(long_run: list[int]) -> None:
    """Peak memory after 400 coherent pings on disk within 1.025 of that after 100."""
    first, last, _ = long_run
    assert last < 1.025 * first, (first, last)


@pytest.mark.slow
def test_a_run_without_navigation_noise_does_not_load_filters(long_run: list[int]) -> None:
    """Half a second of each start of the program."""
    assert not long_run[2]
