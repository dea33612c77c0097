"""Parts of a job on the workers of dask.distributed: one process and one thread each, one future a part.

The tasks of a graph over pings would be a burden on the scheduler and share files; a part is a process's own. A worker
that dies costs what its part has not written, and the part goes on elsewhere.
"""

import importlib
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from insonify.data_file import install_advice

ENVIRONMENT = dict.fromkeys(
    ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"
)  # fmt: skip
"""Environment of the workers, set before they import anything."""
GARBAGE_SEARCH = 500_000
"""New objects between two searches for cyclic garbage: imports make a million objects and no garbage [1]."""
DEFAULT_WALLTIME = "00:30:00"
"""Time of a job that dask_jobqueue is configured with, unless another was chosen."""
_PLUGIN = "insonify"
"""Name of the plugin of workers."""
FORMS = "local:2, tcp://host:8786 or slurm://partition:64"
"""Addresses of clusters."""


class ClusterError(RuntimeError):
    """Parts of a job that failed on a cluster, each with its error, or jobs that its scheduler refuses."""


class JobRequest(NamedTuple):
    """Time and memory to request for a job of a scheduler."""

    minutes: int
    """Time after which the scheduler ends the job [min]."""
    megabytes: int
    """Memory [MB]."""


def require_cluster(cluster: str) -> None:
    """Refuse an address that is none of a cluster.

    Args:
        cluster: Address, see `FORMS`.

    Raises:
        ValueError: It is none, or the package or command for it is not installed.
    """
    if not re.fullmatch(r"local:[1-9]\d*|(tcp|tls)://.+|slurm://[\w.-]*:[1-9]\d*", cluster):
        raise ValueError(f"{cluster} is no address of a cluster; write {FORMS}")
    for name in ("distributed", "dask_jobqueue") if cluster.startswith("slurm") else ("distributed",):
        try:
            importlib.import_module(name)
        except ImportError:
            raise ValueError(
                f"{cluster} needs the package {name.replace('_', '-')}. Install it: "
                f"{install_advice('cluster')}; without it, use --part in a job array"
            ) from None
    if cluster.startswith("slurm") and shutil.which("sbatch") is None:
        raise ValueError(f"{cluster} needs the command sbatch of SLURM, and it is not on this machine. Write {FORMS}")


def run_parts(
    task: Callable[..., Any], shared: Any, cluster: str, divide: Callable[[int], Sequence[range]], *,
    request: Callable[[int], JobRequest] = lambda _: JobRequest(60, 2000),
    on_part: Callable[[int, int], None] | None = None, on_result: Callable[[range, Any], None] | None = None,
    items: str = "pings",
) -> None:  # fmt: skip
    """Run all parts of a job on a cluster.

    Args:
        task: Called on a worker as task(shared, pings=range(...)); an importable function or a `partial` of one.
        shared: First argument, sent to each worker once.
        cluster: Address, see `FORMS`.
        divide: Called with the number of workers while they start; it prepares the job and returns the pings of each
            part.
        request: Called with the number of jobs that SLURM is to start; returns what each of them needs.
        on_part: Called with the numbers of parts done and of all parts, before the first and after each.
        on_result: Called with the items of each part and the result of its task, as parts are done.
        items: Name of the items, as the task takes them and messages name them.

    Raises:
        ClusterError: Some parts failed, and the others are done, its cause is the error of the first; or SLURM refuses
            the jobs.
    """
    from distributed import as_completed

    with _client(cluster, request) as (client, workers):
        client.register_plugin(_worker_setup(task, shared, items), name=_PLUGIN)
        parts = divide(workers)
        done, report, failed = 0, on_part or (lambda *_: None), dict[range, BaseException]()
        report(done, len(parts))
        futures = {client.submit(_run_part, part, priority=-k, pure=False): part for k, part in enumerate(parts)}
        for future in as_completed(futures):
            error = future.exception()
            if error is None:
                done += 1
                report(done, len(parts))
                if on_result is not None:
                    on_result(futures[future], future.result())
            else:
                failed[futures[future]] = error
            del futures[future]  # a result that is no longer referred to is deleted on its worker
    if failed:
        in_order = sorted(failed.items(), key=lambda one: one[0].start)
        listed = (f"{items} {part.start}:{part.stop}: {type(error).__name__}: {error}" for part, error in in_order)
        message = f"{len(failed)} of {len(parts)} parts failed, the others are done. {'; '.join(listed)}"
        raise ClusterError(message) from in_order[0][1]


def _worker_setup(task: Callable[..., Any], shared: Any, items: str) -> Any:
    """Plugin of workers: hold what all parts share, import what they need, and search less often for cyclic garbage.

    Workers that join later get it too, and none loses it with another, as it would data in the memory of workers.
    The last search at the end of a process goes through a million objects of imports; dask waits for it.
    """
    from distributed import WorkerPlugin

    module = getattr(task, "func", task).__module__

    class Setup(WorkerPlugin):
        def setup(self, worker: object) -> None:
            import atexit
            import gc
            import importlib
            from contextlib import suppress

            gc.set_threshold(GARBAGE_SEARCH)
            atexit.register(gc.freeze)
            with suppress(ImportError):
                importlib.import_module(module)
            self.task, self.shared, self.items = task, shared, items

    return Setup()


def _run_part(part: range) -> Any:
    """Run one part on the worker that calls this."""
    from distributed import get_worker

    setup: Any = get_worker().plugins[_PLUGIN]
    return setup.task(setup.shared, **{setup.items: part})


@contextmanager
def _client(cluster: str, request: Callable[[int], JobRequest]) -> Iterator[tuple[Any, int]]:
    """A client of the cluster, and the number of its workers; a cluster that was started here ends with it."""
    from distributed import Client, LocalCluster

    kind, _, rest = cluster.partition(":")
    if kind == "local":
        started: Any = LocalCluster(
            n_workers=0, threads_per_worker=1, processes=True, dashboard_address=None, env=ENVIRONMENT,
            memory_limit=0,
        )  # fmt: skip
        started.scale(int(rest))  # they start while the recording is created
    elif kind == "slurm":
        queue, _, rest = rest.removeprefix("//").partition(":")
        started = _slurm_cluster(queue, int(rest), request(int(rest)))
    else:
        with Client(cluster) as client:
            yield client, max(len(client.scheduler_info(n_workers=-1)["workers"]), 1)
        return
    with started, Client(started) as client:
        yield client, int(rest)


def _slurm_cluster(queue: str, jobs: int, request: JobRequest) -> Any:
    """Workers that SLURM starts, one a job; in place of one that ends, by its limits or otherwise, it starts another.

    The rest, such as account and modules, is in dask's configuration. Only SLURM limits the memory of workers: dask
    would pause them at four fifths of it.
    """
    cluster = importlib.import_module("dask_jobqueue").SLURMCluster
    from dask import config  # with the defaults of dask_jobqueue

    settings = config.get("jobqueue.slurm")
    walltime = f"{request.minutes // 60}:{request.minutes % 60:02d}:00"
    started = cluster(
        queue=queue or None, cores=1, processes=1, memory=f"{request.megabytes}MB",
        walltime=walltime if settings["walltime"] == DEFAULT_WALLTIME else settings["walltime"],
        job_script_prologue=[*settings["job-script-prologue"], *(f"export {k}={v}" for k, v in ENVIRONMENT.items())],
        worker_extra_args=["--memory-limit", "0", *settings["worker-extra-args"]],
        scheduler_options={"dashboard_address": None, **settings["scheduler-options"]},
    )  # fmt: skip
    with tempfile.NamedTemporaryFile("w", suffix=".sh") as script:
        script.write(started.job_script())
        script.flush()
        tested = subprocess.run(["sbatch", "--test-only", script.name], capture_output=True, text=True, check=False)
    if tested.returncode:
        started.close()
        raise ClusterError(
            f"SLURM refuses the jobs: {' '.join(tested.stderr.split())}. Change the partition in slurm://partition:64, "
            "or jobqueue.slurm in dask's configuration, see docs/explanation/many-pings.md"
        )
    started.adapt(minimum_jobs=jobs, maximum_jobs=jobs)
    return started
