"""Cost of a run before it is begun: processor time, memory, disk, and the compilation that is still to be done.

All is that of the whole command: its start, every ping with its labels, what is written. Good to a factor of two; the
work of a ping is counted by `insonify.study.work`, operations are priced by `insonify.study.prices`.
"""

import os
from dataclasses import dataclass

import numpy as np

from insonify.engines.parts import parts_of
from insonify.engines.view import BLOCK
from insonify.engines.volume import TOO_MANY
from insonify.propagation.families import families_for
from insonify.records.labels import COLUMNS
from insonify.scenario.scenario import Scenario
from insonify.simulation import Listening, prepare
from insonify.study import prices
from insonify.study.compilation import compile_seconds
from insonify.study.work import Work, ping_work, shape_count
from insonify.synthesis.grid import OVERSAMPLING

SHARE = 0.8
"""Part of the machine's memory that a run may want [1]."""


@dataclass(frozen=True, slots=True)
class Cost:
    """Processor time, memory and disk of a run of all pings, about."""

    pings: int
    scatterers: float
    """In one ping, all sides [1]."""
    seconds: float
    """Processor time, start of the program included, compilation not [s]."""
    memory: float
    """Largest resident set [bytes]."""
    disk: float
    """Files of the recording, compressed, with labels where they are wanted [bytes]."""
    compiling: float = 0.0
    """Processor time more, once, while the cache of compiled kernels lacks some [s]."""
    labels: bool = False
    """True: labels are counted."""

    def words(self) -> str:
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


def cost(scenario: Scenario, *, labels: bool = False, threads: int | None = None) -> Cost:
    """Estimate the cost of a scenario.

    Args:
        scenario: The scenario.
        labels: Whether labels are wanted that the scenario itself does not ask for.
        threads: Threads of the run; None: one for each core.

    Returns:
        The cost of all its pings, judged by the first of them, and for targets by a few.
    """
    listening = prepare(scenario)
    labelled = (labels or scenario.output.labels) and scenario.sonar.receiver.record != "elements"
    work = ping_work(listening, labels=labelled)
    write = prices.WRITE_SECONDS + prices.LABEL_WRITE_SECONDS * labelled
    return Cost(
        pings=scenario.track.ping_count,
        scatterers=work.points,
        seconds=float(
            prices.START_SECONDS
            + prices.SECONDS_PER_PIECE * sum(work.pieces)
            + scenario.track.ping_count * (work.seconds + write)
        ),
        memory=float(_memory_of(listening, work, labelled, threads or os.cpu_count() or 1)),
        disk=float(_disk_of(listening, labelled)),
        compiling=compile_seconds(listening, labels=labelled),
        labels=labelled,
    )


def too_big(cost: Cost, memory: float | None = None) -> str:
    """Explain why a run cannot be done on this machine and what to change; empty where it can.

    Args:
        cost: Cost of the run.
        memory: Memory of the machine [bytes]; None: it is looked up.
    """
    there = _memory() if memory is None else memory
    if np.isinf(cost.scatterers):
        return TOO_MANY
    if cost.memory <= SHARE * there:
        return ""
    return (
        f"this needs about {_size(cost.memory)} of memory, and the machine has {_size(there)}. One ping has about "
        f"{_rounded(cost.scatterers)} scatterers: shorten track.window, take a longer pulse or a wider beam, raise "
        "paths.beam_floor_db, or lower paths.scatterers_per_cell, the receiver's band or sub_bands, the number of "
        "beams or elements, or write track.stop_and_hop: true"
    )


def _memory_of(listening: Listening, work: Work, labelled: bool, threads: int) -> float:
    """Largest resident set of a run [bytes]."""
    scenario, grid = listening.scenario, listening.grid
    sides = listening.stances(0)
    wide = 2 * OVERSAMPLING * grid.padded * 8 + grid.count * 8  # of either reading, one channel
    shapes = max(shape_count(side) for side in sides)
    held = scenario.sonar.beam_count * wide * shapes
    total = prices.BYTES_OF_PROGRAM + (parts_of(int(held)) + 6 / shapes) * held
    total += prices.BYTES_PER_TILE * work.tiles / len(sides)
    total += scenario.track.ping_count * 8 * 30 + scenario.sonar.channel_count * grid.count * 16
    total += prices.BYTES_PER_PIECE * max(work.pieces, default=0.0)
    total += work.facets
    total += prices.BYTES_OF_RELIEF * bool(scenario.seabed.relief)
    total += threads * min(work.points / max(threads, 1), BLOCK) * _bytes_per_point(scenario)
    if labelled:
        names = listening.label_names
        total += scenario.sonar.channel_count * grid.count * 8 * 6 * (len(names.owners) + 2 * len(names.pairs))
    return total


def _bytes_per_point(scenario: Scenario) -> float:
    """Columns of one scatterer in a block: its legs and its pairs [bytes]."""
    families = families_for("seabed", scenario.paths.followed) or scenario.paths.followed
    waves = sum("S" in name for name in families) if scenario.surface.bounce == "waves" else 0
    legs = prices.BYTES_PER_LEG * len(families) + prices.BYTES_PER_WAVE_LEG * waves
    return float(legs + prices.BYTES_PER_PAIR * len(families) ** 2)


def _disk_of(listening: Listening, labelled: bool) -> float:
    """Sizes of all files of a recording [bytes]."""
    scenario, count, pings = listening.scenario, listening.grid.count, listening.scenario.track.ping_count
    channels = scenario.sonar.channel_count
    total = prices.FILE_BYTES + pings * prices.PING_FILE_BYTES + count * 8 * prices.PACKED_TIME
    total += pings * (channels * count * 8 * prices.PACKED + 13 * 8 * prices.PACKED_POSE)
    if labelled:
        names = listening.label_names
        sizes = {"channel": channels, "time": count, "owner": len(names.owners), "pair": len(names.pairs), "axis": 3}
        each = sum(
            np.prod([sizes[dim] for dim in dims[1:]]) * np.dtype(kind).itemsize for dims, kind, *_ in COLUMNS.values()
        )
        total += prices.LABEL_FILE_BYTES + count * 8 * prices.PACKED_TIME + pings * float(each) * prices.PACKED_LABELS
    return total


def _memory() -> float:
    """Memory of this machine [bytes]; endless where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (ValueError, OSError, AttributeError):
        return float("inf")


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
