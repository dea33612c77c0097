"""Sweep: one recording of a scenario for each combination of values of some keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from insonify.cluster import JobRequest, require_cluster, run_parts
from insonify.formats.locations import is_url, location
from insonify.formats.recording_state import decreasing_shares
from insonify.recording_run import record
from insonify.scenario.scenario import Scenario


class SweptRecording(NamedTuple):
    """One recording of a sweep."""

    values: dict[str, Any]
    """Values of the keys, by path."""
    scenario: Scenario
    """Scenario with these values."""
    path: str | Path
    """Location of the recording."""


def sweep(
    scenario: Scenario, values: Mapping[str, Iterable[Any]], folder: str | Path, *, threads: int | None = None,
    cluster: str | None = None, overwrite: bool = False, on_recording: Callable[[int, int], None] | None = None,
    with_labels: bool | None = None,
) -> list[SweptRecording]:  # fmt: skip
    """Record a scenario with each combination of values of some keys; an interrupted sweep resumes.

    Args:
        scenario: The scenario.
        values: Values of each key by path, such as {"seabed.depth": [10, "20 m"]}; those of the last key vary fastest.
        folder: Folder of the recordings `00000.zarr`, `00001.zarr` and so on, or its URL in an object store.
        threads: Number of threads, as for `insonify.record`.
        cluster: Address of a cluster whose workers record, each recording on one of them, such as "local:2",
            "tcp://host:8786" or "slurm://partition:64". Not with `threads`; local ones import the calling script, which
            needs `if __name__ == "__main__":`.
        overwrite: True: replace other recordings of these names.
        on_recording: Called with the numbers of recordings done and of all, before the first and after each; on a
            cluster after some.
        with_labels: True: store labels beside the pressures; None: by the scenario's `output`.

    Returns:
        The recordings, in the order of their names.

    Raises:
        ScenarioError: A key or value is refused; nothing has been recorded.
        ClusterError: Some recordings could not be made on the cluster; the others are there.

    Example:
        >>> few = {"track.pings": 1, "track.window": ["0 s", "40 ms"]}
        >>> scenario = insonify.load_scenario("sidescan.yaml").with_(few)
        >>> swept = insonify.sweep(scenario, {"seabed.depth": [20, 25]}, "depths")
        >>> [(values["seabed.depth"], path.name) for values, _, path in swept]
        [(20, '00000.zarr'), (25, '00001.zarr')]
    """
    if cluster is not None:
        require_cluster(cluster)
        if threads is not None:
            raise ValueError(f"threads are of one process, and {cluster} has many. Leave threads or cluster out")
        folder = folder if is_url(folder) else Path(folder).absolute()
    combinations = (dict(zip(values, row, strict=True)) for row in product(*values.values()))
    recordings = [
        SweptRecording(changes, scenario.with_(changes), location(f"{folder}/{number:05d}.zarr"))
        for number, changes in enumerate(combinations)
    ]
    task = partial(_record_some, threads=1 if cluster else threads, overwrite=overwrite, with_labels=with_labels)
    done, report = 0, on_recording or (lambda *_: None)

    def count(numbers: range, _: object = None) -> None:
        nonlocal done
        done += len(numbers)
        report(done, len(recordings))

    count(range(0))
    if cluster is None:
        for number in range(len(recordings)):
            task(recordings, recordings=range(number, number + 1))
            count(range(1))
    else:
        pings = np.array([each.scenario.track.ping_count for each in recordings])
        run_parts(
            task, recordings, cluster, partial(decreasing_shares, pings), items="recordings", on_result=count,
            request=partial(_job_request, recordings),
        )  # fmt: skip
    return recordings


def _record_some(swept: Sequence[SweptRecording], *, recordings: range, **options: Any) -> None:
    """Record those of some numbers."""
    for _, scenario, path in swept[recordings.start : recordings.stop]:
        record(scenario, path, **options)


def _job_request(recordings: Sequence[SweptRecording], jobs: int) -> JobRequest:
    """Time and memory of each of some jobs that share the recordings, by the cost of the first one."""
    from insonify.estimates.run_cost import estimate_cost

    return estimate_cost(recordings[0].scenario, threads=1).repeated(len(recordings)).of_task(jobs).job_request()
