"""Parts of a job on the workers of dask.distributed: one process and one thread each, one future a part.

The tasks of a graph over pings would be a burden on the scheduler and share files; a part is a process's own. A worker
that dies costs what its part has not written, and the part goes on elsewhere.
"""

import importlib
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from insonify.data_file import install_advice

ENVIRONMENT = dict.fromkeys(
    ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1"
)  # fmt: skip
"""Environment of the workers, set before they import anything."""
GARBAGE_SEARCH = 500_000
"""New objects between two searches for cyclic garbage: imports make a million objects and no garbage [1]."""
FORMS = "local:2, tcp://host:8786 or slurm://partition:64"
"""Addresses of clusters."""


class ClusterError(RuntimeError):
    """Parts of a job that failed on a cluster; the message names each with its error."""


def require_cluster(cluster: str) -> None:
    """Refuse an address that is none of a cluster.

    Args:
        cluster: Address, see `FORMS`.

    Raises:
        ValueError: It is none, or the package for it is not installed.
    """
    if not re.fullmatch(r"local:[1-9]\d*|(tcp|tls)://.+|slurm://[\w.-]*:[1-9]\d*", cluster):
        raise ValueError(f"{cluster} is no address of a cluster; write {FORMS}")
    for name in ("distributed", "dask_jobqueue") if cluster.startswith("slurm") else ("distributed",):
        try:
            importlib.import_module(name)
        except ImportError:
            raise ValueError(
                f"{cluster} needs the package {name.replace('_', '-')}. Install it: "
                f"{install_advice('cluster')}, for SLURM pip install dask-jobqueue too; without them, use --part in a "
                "job array"
            ) from None


def run_parts(
    task: Callable[..., Any], shared: Any, cluster: str, divide: Callable[[int], Sequence[range]], *,
    memory: float = 2e9, on_part: Callable[[int, int], None] | None = None,
) -> None:  # fmt: skip
    """Run all parts of a job on a cluster.

    Args:
        task: Called on a worker as task(shared, pings=range(...)); an importable function or a `partial` of one.
        shared: First argument, sent to each worker once.
        cluster: Address, see `FORMS`.
        divide: Called with the number of workers while they start; it prepares the job and returns the pings of each
            part.
        memory: Memory of a worker that is started by SLURM [bytes].
        on_part: Called with the numbers of parts done and of all parts, before the first and after each.

    Raises:
        ClusterError: Some parts failed; the others are done.
    """
    from distributed import as_completed

    with _client(cluster, memory) as (client, workers):
        client.register_plugin(_worker_setup(task))
        parts = divide(workers)
        done, report, failed = 0, on_part or (lambda *_: None), dict[range, str]()
        report(done, len(parts))
        client.wait_for_workers(1)
        sent = client.scatter(shared, broadcast=True, hash=False)
        futures = {client.submit(task, sent, pings=part, priority=-k, pure=False): part for k, part in enumerate(parts)}
        for future in as_completed(futures):
            error = future.exception()
            if error is None:
                done += 1
                report(done, len(parts))
            else:
                failed[futures[future]] = f"{type(error).__name__}: {error}"
    if failed:
        listed = (
            f"pings {part.start}:{part.stop}: {failed[part]}" for part in sorted(failed, key=lambda part: part[0])
        )
        raise ClusterError(f"{len(failed)} of {len(parts)} parts failed, the others are done. {'; '.join(listed)}")


def _worker_setup(task: Callable[..., Any]) -> Any:
    """Plugin of workers: import what the task needs at the start, and search less often for cyclic garbage.

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

    return Setup()


@contextmanager
def _client(cluster: str, memory: float) -> Iterator[tuple[Any, int]]:
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
        queue, _, jobs = rest.removeprefix("//").partition(":")
        started = importlib.import_module("dask_jobqueue").SLURMCluster(
            queue=queue or None, cores=1, processes=1, memory=f"{memory / 1e6:.0f}MB",
            job_script_prologue=[f"export {name}={value}" for name, value in ENVIRONMENT.items()],
        )  # fmt: skip
        started.scale(jobs=int(jobs))
        rest = jobs
    else:
        with Client(cluster) as client:
            yield client, max(len(client.scheduler_info(n_workers=-1)["workers"]), 1)
        return
    with started, Client(started) as client:
        yield client, int(rest)
