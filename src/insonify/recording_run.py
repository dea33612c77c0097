"""Recording of a scenario on disk: by worker processes where its pings are many and small, else by threads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, cast

from insonify.engines.parts import SerialPool
from insonify.forked_workers import can_fork, forked_results
from insonify.kernel_compilation import compile_ahead
from insonify.malloc_tuning import keep_freed_memory
from insonify.part import Part
from insonify.records.labels import Labels
from insonify.scenario.attributes import attributes
from insonify.scenario.features import scenario_features
from insonify.scenario.pings import selected_pings
from insonify.scenario.recording_layout import recording_layout
from insonify.scenario.scenario import Scenario
from insonify.simulator import Job, Simulator, are_many_and_small, build_simulator, simulate_job, simulate_jobs
from insonify.thread_count import thread_count

if TYPE_CHECKING:
    from insonify.formats.recording_writer import RecordingWriter


def record(
    scenario: Scenario, path: str | Path, *, pings: int | Iterable[int] | None = None, threads: int | None = None,
    overwrite: bool = False, on_ping: Callable[[int, int], None] | None = None, with_labels: bool | None = None,
    part: Part | str | None = None,
) -> str | Path:  # fmt: skip
    """Simulate to disk, ping by ping; an interrupted run resumes.

    Args:
        scenario: The scenario.
        path: Folder of the recording, or its URL in an object store, such as "s3://bucket/harbour.zarr".
        pings: Numbers of the pings; all by default.
        threads: Number of threads, or of worker processes where pings are many and small; all cores by default. The
            result does not depend on it, bit for bit.
        overwrite: True: replace another recording at that path.
        on_ping: Called with the numbers of pings done and of all pings, before the first and after each.
        with_labels: True: store labels beside the pressures; None: by the scenario's `output`.
        part: Part of the job whose pings are simulated, such as "3/64" or `Part(3, 64)`; others do the others. All by
            default.

    Returns:
        The path.

    Raises:
        ValueError: The track has no such ping, or the job no such part.
        WorkerProcessError: A worker process was killed, most likely for lack of memory.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")
        >>> path = insonify.record(scenario, "sidescan.zarr", pings=[0, 1])
        >>> insonify.open_recording(path).done.values[:3].tolist()
        [True, True, False]
    """
    from insonify.formats.store_writer import writer_class

    requested, mine = selected_pings(scenario, pings), None if part is None else Part.parse(part)
    simulator = build_simulator(scenario)
    lines = simulator.recorded_lines()
    layout = recording_layout(scenario, simulator.platforms, simulator.grid.time, lines)
    labelled = scenario.output.labels if with_labels is None else with_labels
    writer = writer_class(path)(
        path, layout, attributes(scenario), lines=lines, overwrite=overwrite,
        label_names=simulator.label_names if labelled else None,
    )  # fmt: skip
    missing, count = writer.missing(writer.of_part(mine, requested))
    done, report = count - len(missing), on_ping or (lambda *_: None)
    report(done, count)
    jobs = [Job(*request) for request in missing]
    for number, _ in enumerate(_recorded_jobs(simulator, writer, jobs, threads), done + 1):
        report(number, count)
    writer.finish()
    return writer.location


def simulates_in_processes(simulator: Simulator, pings: int, workers: int) -> bool:
    """Return True where `record` simulates pings in worker processes, of which each has caches of its own.

    Args:
        simulator: A prepared scenario.
        pings: Number of pings to simulate.
        workers: Number of workers.
    """
    return workers > 1 and can_fork() and are_many_and_small(simulator, pings, workers)


def _recorded_jobs(
    simulator: Simulator, writer: RecordingWriter, jobs: list[Job], threads: int | None
) -> Iterator[Job]:  # fmt: skip
    """Simulate and write some pings, in worker processes where many are small; jobs as they are done."""
    workers = thread_count(threads)
    if not (writer.accepts_any_order and simulates_in_processes(simulator, len(jobs), workers)):
        for job, series, labelling in simulate_jobs(simulator, jobs, threads):
            writer.write(job.ping, series, cast(Labels | None, labelling))
            yield job
        return

    def write_loose(job: Job) -> None:
        series, labelling = simulate_job(simulator, job, SerialPool())
        writer.write_loose(job.ping, series, cast(Labels | None, labelling))

    keep_freed_memory()
    compile_ahead(scenario_features(simulator.scenario, labels=jobs[0].with_labels), workers)
    write_loose(jobs[0])  # compiles further kernels and prepares what all pings have in common, once for all workers
    for job in chain(jobs[:1], (job for job, _ in forked_results(write_loose, jobs[1:], workers))):
        writer.pack_completed(job.ping)
        yield job
