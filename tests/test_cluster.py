"""Parts on a cluster: the bytes of one run; a killed worker costs its part, an error is named with its part."""

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from insonify.cli import main
from insonify.cluster import ENVIRONMENT, ClusterError, require_cluster, run_parts
from insonify.formats.zarr_store import open_recording
from insonify.scenario.write import to_yaml
from insonify.simulator import simulate
from oracles.scenes import nominal, point


@pytest.mark.slow
def test_a_killed_worker_costs_its_part_and_an_error_names_its_own(tmp_path: Path) -> None:
    """Of eight parts one kills its worker and goes on elsewhere, one fails; workers have one thread each."""
    pytest.importorskip("distributed")

    def task(folder: str, pings: range, names: tuple[str, ...] = tuple(ENVIRONMENT)) -> None:
        import os
        import signal
        from pathlib import Path

        first = Path(folder) / f"first-{pings[0]}"
        again = first.exists()
        first.touch()
        if pings[0] == 2 and not again:
            os.kill(os.getpid(), signal.SIGKILL)
        if pings[0] == 5:
            raise ValueError("no such seabed")
        (Path(folder) / f"done-{pings[0]}").write_text(" ".join(os.environ.get(name, "") for name in names))

    def divide(workers: int) -> list[range]:
        return [range(k, k + 1) for k in range(1, 4 * workers + 1)]

    reports: list[tuple[int, int]] = []
    with pytest.raises(
        ClusterError, match=r"1 of 8 parts failed, the others are done\. pings 5:6: ValueError: no such"
    ):
        run_parts(task, str(tmp_path), "local:2", divide, on_part=lambda done, count: reports.append((done, count)))
    assert {file.name for file in tmp_path.glob("done-*")} == {f"done-{k}" for k in (1, 2, 3, 4, 6, 7, 8)}
    assert {file.read_text() for file in tmp_path.glob("done-*")} == {"1 1 1 1"}
    assert reports == [(k, 8) for k in range(8)]
    assert not set(ENVIRONMENT) <= set(os.environ)  # of the workers, not of this process


@pytest.fixture
def cluster(request: pytest.FixtureRequest) -> Iterator[str]:
    """Address of a cluster: two workers that are started, or one that runs, in this process."""
    distributed = pytest.importorskip("distributed")
    if request.param == "local:2":
        yield request.param
        return
    threshold = gc.get_threshold()
    settings = {"processes": False, "protocol": "tcp", "dashboard_address": None, "memory_limit": 0}
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, **settings) as running:
        yield running.scheduler_address
    gc.set_threshold(*threshold)


@pytest.mark.slow
@pytest.mark.parametrize(("scheme", "cluster"), [("", "local:2"), ("file://", "that runs")], indirect=["cluster"])
def test_a_run_on_a_cluster_is_the_run(
    scheme: str, cluster: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:  # fmt: skip
    """By the command line, on two workers or a running cluster, part of it done before: the bits of one process."""
    monkeypatch.setenv("INSONIFY_SPOOL", str(tmp_path / "spool"))
    scene = nominal(
        targets=[point(0.0, 12.0, 15.0)], track={"window": (0.016, 0.018), "pings": 70},
        paths={"max_reflections": 0, "contributions": ("target",)},
        sonar={"transmit": {"kind": "point"}, "receive": {"kind": "point"}},
    )  # fmt: skip
    file, out = tmp_path / "a.yaml", f"{scheme}{tmp_path}/a.zarr"
    file.write_text(to_yaml(scene), encoding="utf-8")
    assert main(["run", str(file), "-o", out, "--pings", "3:7"]) == 0
    assert main(["run", str(file), "-o", out, "--cluster", cluster]) == 0
    np.testing.assert_array_equal(open_recording(out).pressure, simulate(scene).pressure)
    capsys.readouterr()
    assert main(["run", str(file), "-o", out, "--cluster", "local:2", "--threads", "2"]) == 2
    assert "--threads 2: for one process" in capsys.readouterr().err
    assert main(["run", str(file), "-o", "memory://a/b.zarr", "--cluster", "local:2"]) == 2
    assert "-o memory://a/b.zarr: for one process" in capsys.readouterr().err


@pytest.mark.parametrize("typed", ["", "local", "local:0", "two", "slurm://normal", "udp://here:1"])
def test_what_is_no_cluster_is_refused(typed: str) -> None:
    """With the forms that there are."""
    with pytest.raises(ValueError, match=r"write local:2, tcp://host:8786 or slurm://partition:64"):
        require_cluster(typed)


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """With its installation, and the way without it."""
    import importlib

    def absent(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(importlib, "import_module", absent)
    with pytest.raises(
        ValueError,
        match=r"needs the package distributed\. .*pip install '[^\[]+/[^\[]*\[cluster\]'.*--part in a job array",
    ):
        require_cluster("local:2")
