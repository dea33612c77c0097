"""Commands about runs that many processes share: plan, status."""

import math
import re
import shlex
from typing import TYPE_CHECKING, Annotated

import typer

from insonify.cli.arguments import InputError, ScenarioFile
from insonify.formats.locations import is_url, location
from insonify.part import Part

if TYPE_CHECKING:
    from insonify.scenario.scenario import Scenario

MOST_RANGES = 12
"""Ranges of missing pings that are listed [1]."""


def plan(
    file: ScenarioFile,
    tasks: Annotated[int, typer.Option(metavar="N", min=1, help="Number of tasks that share the pings.")],
    out: Annotated[
        str | None,
        typer.Option("-o", "--out", metavar="OUT", help="Folder or URL of the recording. [default: FILE.zarr]"),
    ] = None,
    sbatch: Annotated[bool, typer.Option("--sbatch", help="For SLURM: sbatch script.sh.")] = False,
    labels: Annotated[bool, typer.Option("--labels", help="With labels.")] = False,
) -> None:
    """Print the script of a job array that simulates a scenario in N parts, with time and memory of each task.

    Example: insonify plan harbour.yaml --tasks 8 > parts.sh; bash parts.sh

    Example: insonify plan harbour.yaml --tasks 64 --sbatch > parts.sh; sbatch parts.sh
    """
    from insonify.estimates.run_cost import estimate_cost
    from insonify.scenario.load import load_scenario

    scenario = load_scenario(file)
    pings = scenario.track.ping_count
    if tasks > pings:
        raise InputError(f"--tasks {tasks}: the track has {pings} pings. Give {pings} at most")
    if out is not None and out.startswith("memory:"):
        raise InputError(
            f"-o {out}: each task is a process, whose memory no other one can read. Give a folder on a disk that all "
            "tasks share, or a URL such as s3://bucket/harbour.zarr"
        )
    if out is not None and is_url(out):
        _require_whole_shards(scenario, out, tasks)
    whole = estimate_cost(scenario, labels=labels, threads=1)
    task = whole.of_task(tasks)
    target = out or file.with_suffix(".zarr")
    words = ["insonify", "run", str(file), "-o", str(target), *["--labels"] * labels]
    command = shlex.join([*words, "--threads", "1", "--quiet", "--part"])
    first = shlex.join([*words, "--pings", "0"])
    head = [
        "#!/bin/bash",
        f"# all: {whole.on_this_machine().summary()}",
        f"# each of {tasks} tasks, on one core: {task.on_this_machine().summary()}",
        f"# once before, to create the recording and compile: {first}",
        f"# afterwards, what is missing: insonify status {shlex.quote(str(target))} --tasks {tasks}",
    ]
    if sbatch:
        minutes, megabytes = task.job_request()
        name = re.sub(r"[^\w.-]+", "-", file.stem)  # SLURM takes a word, in which % begins a field
        slurm = {
            "job-name": name, "array": f"1-{tasks}", "cpus-per-task": 1, "mem": f"{megabytes}M",
            "time": f"{minutes // 60}:{minutes % 60:02d}:00", "output": f"{name}-%a.log",
        }  # fmt: skip
        head[1:1] = [f"#SBATCH --{option}={value}" for option, value in slurm.items()]
        lines = [*head, f'{command} "$SLURM_ARRAY_TASK_ID/{tasks}"']
    else:
        lines = [*head, f'seq {tasks} | xargs -P "$(nproc)" -I {{}} {command} {{}}/{tasks}']
    typer.echo("\n".join(lines))


def _require_whole_shards(scenario: "Scenario", url: str, tasks: int) -> None:
    """Refuse more tasks than there are shards in an object store."""
    from insonify.formats.zarr_store import shard_length
    from insonify.scenario.recording_layout import recording_layout
    from insonify.simulator import build_simulator

    simulator = build_simulator(scenario)
    pings = shard_length(recording_layout(scenario, simulator.platforms, simulator.grid.time), in_store=True)
    shards = math.ceil(scenario.track.ping_count / pings)
    if tasks > shards:
        raise InputError(
            f"--tasks {tasks}: {url} will have {shards} shard{'s' * (shards > 1)} of {pings} pings, and a task in an "
            f"object store is whole shards. Give {shards} at most, or a folder on a common disk"
        )


def status(
    recording: Annotated[str, typer.Argument(metavar="OUT", help="Recording made by `insonify run`: folder or URL.")],
    tasks: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Number of tasks of the plan: list the unfinished parts.")
    ] = None,
) -> None:
    """List what a recording holds, and what is missing: pings, labels, parts of a job array.

    Example: insonify status harbour.zarr --tasks 64
    """
    from insonify.formats.recording_state import recording_state

    state = recording_state(location(recording))
    complete = state.recorded
    lines = [f"{state.location}: {_of(complete.sum(), complete.size)} pings recorded"]
    if state.per_shard > 1:
        where = f" in {state.folder}, on this machine only" if state.loose and state.folder != state.location else ""
        lines.append(f"  {state.loose:,} of them loose{where}, the others in shards")
    if state.labelled is not None:
        lines.append(f"  {_of(state.labelled.sum(), state.labelled.size)} pings labelled")
        complete = complete & state.labelled
    if missing := _ranges((~complete).nonzero()[0].tolist()):
        more = f" and {len(missing) - MOST_RANGES:,} more ranges" if len(missing) > MOST_RANGES else ""
        lines.append(f"  missing: {', '.join(missing[:MOST_RANGES])}{more}, by --pings of insonify run")
    if tasks is not None:
        unfinished = [
            number
            for number in range(1, tasks + 1)
            if not all(complete[ping] for ping in state.pings_of_part(Part(number, tasks)))
        ]
        array = ",".join(part.replace(":", "-") for part in _ranges(unfinished, inclusive=True))
        lines.append(f"  unfinished parts of {tasks}: {array or 'none'}" + f" (sbatch --array={array})" * bool(array))
    typer.echo("\n".join(lines))


def _of(part: int, whole: int) -> str:
    """Such as `30 of 100`, or `all 100`."""
    return f"all {whole:,}" if part == whole else f"{part:,} of {whole:,}"


def _ranges(numbers: list[int], *, inclusive: bool = False) -> list[str]:
    """Runs of consecutive numbers as they are typed, such as 3, 10:20 (20 not included unless `inclusive`)."""
    starts = [k for k in range(len(numbers)) if not k or numbers[k] != numbers[k - 1] + 1]
    runs = [(numbers[a], numbers[b - 1]) for a, b in zip(starts, [*starts[1:], len(numbers)], strict=False)]
    return [f"{first}" if first == last else f"{first}:{last + (not inclusive)}" for first, last in runs]
