"""Cost of a run before its start: processor time, memory, disk, and outstanding compilation.

All is that of the whole command: its start, every ping with its labels, and writing. Accurate to a factor of two; the
work of a ping is counted by `insonify.estimates.ping_work`, operations are priced by `insonify.estimates.unit_costs`.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from insonify.cluster import JobRequest
from insonify.engines.memory_budget import BYTES_AT_ONCE, bytes_per_point
from insonify.engines.parts import SCATTERERS_PER_BLOCK, parts_of
from insonify.engines.volume import TOO_MANY
from insonify.estimates import unit_costs
from insonify.estimates.compile_time import estimate_compile_seconds
from insonify.estimates.machine_pace import machine_pace
from insonify.estimates.ping_work import PingWork, ping_work, waveform_count
from insonify.estimates.terrain_work import terrain_bytes, terrain_seconds
from insonify.machine_memory import installed_memory
from insonify.recording_run import simulates_in_processes
from insonify.records.labels import COLUMNS
from insonify.scenario.scenario import Scenario
from insonify.scene.solid import world_triangles
from insonify.simulator import Simulator, build_simulator
from insonify.synthesis.direction_grid import direction_grid
from insonify.synthesis.time_grid import OVERSAMPLING
from insonify.thread_count import thread_count

SHARE = 0.8
"""Fraction of the machine's memory that a run may use [1]."""
TIME_MARGIN, MEMORY_MARGIN = 2.0, 1.5
"""Time and memory that are requested for a job over the estimate, which is right within a factor of two [1]."""
LEAST_MINUTES, LEAST_MEGABYTES = 5, 500
"""Least time and memory that are requested."""


@dataclass(frozen=True, slots=True)
class RunCost:
    """Processor time, memory and disk of a run of all pings, about."""

    pings: int
    scatterers: float
    """In one ping, all sides [1]."""
    seconds: float
    """Processor time on the reference machine, start of the program included, compilation not [s]."""
    memory: float
    """Largest resident set [bytes]."""
    disk: float
    """Files of the recording, compressed, with labels if they are computed [bytes]."""
    compiling: float = 0.0
    """Processor time more, once, while the cache of compiled kernels lacks some [s]."""
    labels: bool = False
    """True: labels are counted."""

    def repeated(self, runs: int) -> "RunCost":
        """Cost of several such runs in one process, with one start of the program."""
        start_seconds = unit_costs.START_SECONDS
        seconds = start_seconds + max(self.seconds - start_seconds, 0.0) * runs
        return replace(self, pings=self.pings * runs, seconds=seconds, disk=self.disk * runs)

    def of_task(self, tasks: int) -> "RunCost":
        """Cost of one of several tasks that share the pings, each with the start of the program."""
        start_seconds = unit_costs.START_SECONDS
        seconds = start_seconds + max(self.seconds - start_seconds, 0.0) / tasks
        return replace(self, pings=-(-self.pings // tasks), seconds=seconds, disk=self.disk / tasks)

    def on_this_machine(self) -> "RunCost":
        """Cost with the processor times of this machine."""
        pace = machine_pace()
        return replace(self, seconds=pace * self.seconds, compiling=pace * self.compiling)

    def job_request(self) -> JobRequest:
        """Time and memory to request for it as one job of a scheduler, on machines of this machine's pace."""
        here = self.on_this_machine()
        minutes = math.ceil((here.seconds + here.compiling) * TIME_MARGIN / 60)
        megabytes = math.ceil(here.memory * MEMORY_MARGIN / 1e6)
        return JobRequest(max(minutes, LEAST_MINUTES), max(megabytes, LEAST_MEGABYTES))

    def summary(self) -> str:
        """The cost in one line."""
        each = " each" if self.pings > 1 else ""
        plural = "s" * (self.pings != 1)
        labels = ", labels included" if self.labels else ""
        once = f"; plus about {_duration(self.compiling)} to compile, once" if self.compiling else ""
        return (
            f"{self.pings} ping{plural}, about {_rounded(self.scatterers)} scatterers{each}: about "
            f"{_duration(self.seconds)} of processor time, {_size(self.memory)} of memory, {_size(self.disk)} on disk"
            f"{labels}{once}"
        )


def estimate_cost(scenario: Scenario, *, labels: bool = False, threads: int | None = None) -> RunCost:
    """Estimate the cost of a scenario.

    Args:
        scenario: The scenario.
        labels: True if labels are computed in addition to those that the scenario requests.
        threads: Threads of the run; None: one for each core.

    Returns:
        The cost of all its pings on the reference machine, evaluated by the first of them, and for targets by a few.
    """
    simulator = build_simulator(scenario)
    labelled = (labels or scenario.output.labels) and scenario.sonar.receiver.record != "elements"
    work = ping_work(simulator, labels=labelled)
    write = unit_costs.WRITE_SECONDS + unit_costs.LABEL_WRITE_SECONDS * labelled
    return RunCost(
        pings=scenario.track.ping_count,
        scatterers=work.points,
        seconds=float(
            unit_costs.START_SECONDS
            + unit_costs.SECONDS_PER_PIECE * sum(work.pieces)
            + terrain_seconds(simulator, work.terrain_tiles)
            + scenario.track.ping_count * (work.seconds + write)
        ),
        memory=float(_memory_of(simulator, work, labelled, thread_count(threads))),
        disk=float(_disk_of(simulator, labelled)),
        compiling=estimate_compile_seconds(scenario, labels=labelled),
        labels=labelled,
    )


def _direction_rows(simulator: Simulator) -> int:
    """Rows of the direction grid from which many beams are formed [1]; 0: there is none."""
    grid = direction_grid(simulator.ping_geometries(0)[0]) if simulator.scenario.field == "coherent" else None
    return 0 if grid is None else grid.row_count


def size_refusal(cost: RunCost, memory: float | None = None) -> str:
    """Explain why a run cannot be done on this machine and what to change; empty where it can.

    Args:
        cost: Cost of the run.
        memory: Memory of the machine [bytes]; None: it is looked up.
    """
    installed = installed_memory() if memory is None else memory
    if np.isinf(cost.scatterers):
        return TOO_MANY
    if cost.memory <= SHARE * installed:
        return ""
    return (
        f"this needs about {_size(cost.memory)} of memory, and the machine has {_size(installed)}. One ping has about "
        f"{_rounded(cost.scatterers)} scatterers: shorten track.window, take a longer pulse or a wider beam, raise "
        "paths.beam_cutoff_db, or lower paths.scatterers_per_cell, the receiver's band or sub_bands, the number of "
        "beams or elements, or write track.stop_and_hop: true, or give fewer --threads"
    )


def _memory_of(simulator: Simulator, work: PingWork, labelled: bool, threads: int) -> float:
    """Largest memory of a run, all its processes [bytes]."""
    scenario, grid = simulator.scenario, simulator.grid
    sides = simulator.ping_geometries(0)
    wide = 2 * OVERSAMPLING * grid.padded_samples * 8 + grid.sample_count * 8  # of either reading, one channel
    shapes = max(waveform_count(side) for side in sides)
    beams, rows = scenario.sonar.beam_count, _direction_rows(simulator)
    held = max(beams, rows) * wide * shapes
    total = (parts_of(int(held)) + 6 / shapes) * held
    total += (beams + rows) * grid.padded_samples * 16 * bool(rows and sides[0].sub_bands)  # their spectra
    total += unit_costs.BYTES_PER_TILE * work.tiles / len(sides)
    total += scenario.sonar.channel_count * grid.sample_count * 16
    scene = simulator.engine.scene
    total += unit_costs.BYTES_PER_TRIANGLE * sum(len(world_triangles(one, scene.seabed).area) for one in scene.solids)
    total += unit_costs.BYTES_PER_PIECE * max(work.pieces, default=0.0)
    total += work.facets
    total += unit_costs.BYTES_OF_RELIEF * bool(scenario.seabed.relief) + terrain_bytes(work.terrain_tiles)
    in_processes = simulates_in_processes(simulator, scenario.track.ping_count, threads)
    sharing = len(sides) if in_processes else threads  # a worker process has a ping of its own, one side at a time
    block = min(work.points / sharing, SCATTERERS_PER_BLOCK)
    block *= bytes_per_point(simulator.engine.scene, scenario.paths, "seabed", drawn=True)
    block = min(block, BYTES_AT_ONCE)
    total += max(block, work.facet_block)
    if labelled:
        names = simulator.label_names
        total += scenario.sonar.channel_count * grid.sample_count * 8 * 6 * (len(names.objects) + 2 * len(names.pairs))
        label_sums = simulator.label_accumulator(sides[0])
        if label_sums.directions is not None:  # of seabed and targets, about half filled
            total += label_sums.empty().nbytes
    track = unit_costs.BYTES_PER_PING * scenario.track.ping_count * (1 + simulator.platforms.is_bistatic)
    if in_processes:  # they share the track; each has a ping, as has the first process before they start
        return unit_costs.BYTES_OF_PROGRAM + track + (threads + 1) * total
    return unit_costs.BYTES_OF_PROGRAM + track + total + (threads - 1) * block


def _disk_of(simulator: Simulator, labelled: bool) -> float:
    """Sizes of all files of a recording [bytes]."""
    scenario, count, pings = simulator.scenario, simulator.grid.sample_count, simulator.scenario.track.ping_count
    channels = scenario.sonar.channel_count
    total = unit_costs.FILE_BYTES + pings * unit_costs.PING_FILE_BYTES + count * 8 * unit_costs.TIME_COMPRESSION_RATIO
    total += pings * (channels * count * 8 * unit_costs.PACKED + 13 * 8 * unit_costs.POSE_COMPRESSION_RATIO)
    if labelled:
        names = simulator.label_names
        sizes = {"channel": channels, "time": count, "object": len(names.objects), "pair": len(names.pairs), "axis": 3}
        each = sum(
            np.prod([sizes[dim] for dim in dims[1:]]) * np.dtype(kind).itemsize for dims, kind, *_ in COLUMNS.values()
        )
        total += (
            unit_costs.LABEL_FILE_BYTES
            + count * 8 * unit_costs.TIME_COMPRESSION_RATIO
            + pings * float(each) * unit_costs.LABEL_COMPRESSION_RATIO
        )
    return total


def _rounded(count: float) -> str:
    for size, name in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if count >= size:
            return f"{count / size:.2g} {name}" if count < 10 * size else f"{count / size:.0f} {name}"
    return f"{count:.0f}"


def _duration(seconds: float) -> str:
    for size, name in ((86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")):
        if seconds >= 2 * size:
            return f"{seconds / size:.2g} {name}"
    return "a second" if seconds < 1.5 else f"{seconds:.0f} seconds"


def _size(count: float) -> str:
    for size, name in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB")):
        if count >= size:
            return f"{count / size:.3g} {name}"
    return f"{max(count / 1e3, 1):.0f} kB"
