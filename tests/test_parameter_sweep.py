"""Sweeps: a recording of each combination of values, the same on a cluster; nothing where a value is refused."""

import gc
from pathlib import Path

import numpy as np
import pytest

import insonify
from insonify.diagnostics.diagnostic import ScenarioError
from insonify.simulator import simulate
from oracles.scenes import nominal, point

VALUES = {"targets.0.position.1": ["12 m", 12.25, 12.5], "sonar.source_level_db": [220, 226]}


def scene():
    """Two pings at one point."""
    return nominal(
        targets=[point(0.0, 12.0, 15.0)], track={"window": (0.016, 0.018), "pings": 2},
        paths={"max_reflections": 0, "contributions": ("target",)},
        sonar={"transmit": {"kind": "point"}, "receive": {"kind": "point"}},
    )  # fmt: skip


def test_each_combination_of_values_is_a_recording(tmp_path: Path) -> None:
    """The pressures of `simulate`, the last key fastest; what is there is kept; 6 dB more are twice the pressure."""
    reports: list[tuple[int, int]] = []
    swept = insonify.sweep(scene(), VALUES, tmp_path, on_recording=lambda *numbers: reports.append(numbers))
    assert [tuple(each.values.values()) for each in swept] == [
        ("12 m", 220), ("12 m", 226), (12.25, 220), (12.25, 226), (12.5, 220), (12.5, 226),
    ]  # fmt: skip
    assert reports == [(done, 6) for done in range(7)]
    levels = []
    for number, each in enumerate(swept):
        assert each.path == tmp_path / f"0000{number}.zarr"
        pressure = insonify.open_recording(each.path).pressure.values
        np.testing.assert_array_equal(pressure, simulate(scene().with_(each.values)).pressure)
        levels.append(np.abs(pressure).max())
    assert levels[1] == pytest.approx(levels[0] * 10 ** (6 / 20), rel=1e-5)
    before = {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()}
    insonify.sweep(scene(), VALUES, tmp_path)
    assert before == {file: file.stat().st_mtime_ns for file in tmp_path.rglob("*") if file.is_file()}


@pytest.mark.slow
def test_a_cluster_records_the_same_sweep(tmp_path: Path) -> None:
    """Byte by byte but for the identities, with a count of recordings after each part."""
    distributed = pytest.importorskip("distributed")
    swept, reports = insonify.sweep(scene(), VALUES, tmp_path / "one"), list[tuple[int, int]]()
    threshold = gc.get_threshold()
    settings = {"processes": False, "protocol": "tcp", "dashboard_address": None, "memory_limit": 0}
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, **settings) as running:
        others = insonify.sweep(
            scene(), VALUES, tmp_path / "many", cluster=running.scheduler_address,
            on_recording=lambda *numbers: reports.append(numbers),
        )  # fmt: skip
    gc.set_threshold(*threshold)
    assert reports[0] == (0, 6) and reports[-1] == (6, 6) and reports == sorted(reports) and len(reports) > 3
    for one, other in zip(swept, others, strict=True):
        files = {
            path: {str(file.relative_to(path)): file.read_bytes() for file in path.rglob("*") if file.is_file()}
            for path in (one.path, other.path)
        }
        assert all(found.pop("zarr.json") for found in files.values())
        assert files[one.path] == files[other.path]


def test_a_value_that_is_refused_leaves_nothing(tmp_path: Path) -> None:
    """A key that is unknown, a value out of range in the last place, threads beside a cluster."""
    for values, message in (({"seabed.dept": [1]}, "did you mean"), ({"seabed.depth": [20, -1]}, "seabed.depth")):
        with pytest.raises(ScenarioError, match=message):
            insonify.sweep(scene(), values, tmp_path / "a")
    pytest.importorskip("distributed")
    with pytest.raises(ValueError, match="threads are of one process"):
        insonify.sweep(scene(), VALUES, tmp_path / "a", cluster="local:2", threads=2)
    assert not (tmp_path / "a").exists()
