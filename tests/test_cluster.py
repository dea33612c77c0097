"""Parts on a cluster: the bytes of one run; a killed worker costs its part, an error is named with its part."""

import gc
import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from insonify.cli import main
from insonify.cluster import ENVIRONMENT, ClusterError, JobRequest, require_cluster, run_parts
from insonify.formats.zarr_store import open_recording
from insonify.scenario.write import to_yaml
from insonify.simulator import simulate
from oracles.few_of import few_of
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


SBATCH = """#!/bin/sh
for script; do :; done
[ "$1" = --test-only ] && exit
cp "$script" "{folder}/job-$$"
setsid sh "{folder}/job-$$" > "{folder}/log-$$" 2>&1 &
echo "Submitted batch job $!"
"""
SCANCEL = """#!/bin/sh
for job; do kill -TERM -- "-$job" 2> "{folder}/cancelled"; done
"""
"""Commands of SLURM for one machine: a job is a group of processes."""


@pytest.fixture
def slurm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Folder of commands of SLURM, and of what they leave."""
    pytest.importorskip("dask_jobqueue")
    for name, text in {"sbatch": SBATCH, "scancel": SCANCEL}.items():
        (tmp_path / name).write_text(text.format(folder=tmp_path))
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    return tmp_path


def test_jobs_that_slurm_refuses_are_an_error(slurm: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With its own message, before anything is written; as is an address of SLURM on a machine without it."""
    (slurm / "sbatch").write_text("#!/bin/sh\necho 'sbatch: error: invalid partition: short' >&2\nexit 1\n")
    with pytest.raises(ClusterError, match=r"refuses the jobs: sbatch: error: invalid partition: short\. Change the"):
        run_parts(print, None, "slurm://short:2", lambda _: pytest.fail("no worker will come"))
    monkeypatch.setenv("PATH", str(slurm / "empty"))
    with pytest.raises(ValueError, match=r"slurm://short:2 needs the command sbatch of SLURM"):
        require_cluster("slurm://short:2")


@pytest.mark.slow
def test_slurm_starts_another_job_in_place_of_one_that_ends(slurm: Path) -> None:
    """Each of two jobs is killed once, so that no worker of the first two is left; jobs request what they need."""
    from dask import config

    def task(folder: str, pings: range, names: tuple[str, ...] = tuple(ENVIRONMENT)) -> None:
        import os
        import signal
        from pathlib import Path

        killed = Path(folder) / f"killed-{os.getpgid(0)}"
        if pings[0] > 2 and not killed.exists() and len(list(Path(folder).glob("killed-*"))) < 2:
            killed.touch()
            os.killpg(0, signal.SIGKILL)
        (Path(folder) / f"done-{pings[0]}").write_text(" ".join(os.environ.get(name, "") for name in names))

    with config.set({"distributed.deploy.lost-worker-timeout": "1s"}):  # a worker that is lost for 15 s is replaced
        run_parts(
            task, str(slurm), "slurm://short:2", lambda workers: [range(k, k + 1) for k in range(4 * workers)],
            request=lambda jobs: JobRequest(60 + jobs, 900),
        )  # fmt: skip
    assert {file.name for file in slurm.glob("done-*")} == {f"done-{k}" for k in range(8)}
    assert {file.read_text() for file in slurm.glob("done-*")} == {"1 1 1 1"}
    scripts = [file.read_text() for file in slurm.glob("job-*")]
    assert len(list(slurm.glob("killed-*"))) == 2
    assert 3 <= len(scripts) <= 4  # the run may end before the last is replaced
    for line in ("#SBATCH -p short\n", "#SBATCH -t 1:02:00\n", "#SBATCH --mem=859M\n"):  # 900 MB in MiB
        assert all(line in script for script in scripts)


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
@few_of((1,), ("scheme", "cluster"), [("", "local:2"), ("file://", "that runs")], indirect=["cluster"])
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
