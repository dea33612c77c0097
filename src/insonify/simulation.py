"""The wiring: describe, reach, scatter, hear, ping by ping."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from operator import iadd
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, cast

import numpy as np
from numpy.typing import NDArray

from insonify.engines.delay_window import Interval, in_delay_window, wanted_delays
from insonify.engines.parts import Alone, Pool, parts_of
from insonify.engines.paths import Paths
from insonify.engines.swath import SwathView, swath_of
from insonify.engines.terrain_cover import MOST_HIDDEN, hidden_part
from insonify.freed_memory import keep_freed_memory
from insonify.propagation.choice import PathChoice
from insonify.propagation.medium import rays_in
from insonify.records.arrivals import Arrivals, expand, joined
from insonify.records.labels import LabelNames, Labels, beside, label_dataset
from insonify.records.recording import Layout, dataset
from insonify.records.swath import Swath
from insonify.scenario.attributes import attributes
from insonify.scenario.carried import platforms, receiver_seed
from insonify.scenario.pings import wanted_pings
from insonify.scenario.ray_domain import delay_field, domain
from insonify.scenario.scenario import Scenario
from insonify.scene.scatterers import Scatterers
from insonify.sonar.heard import HeardPulse, heard_pulse
from insonify.sonar.platforms import Platforms
from insonify.sonar.sonar import channel_places
from insonify.sonar.stance import Riding, Stance, surveys_of
from insonify.sonar.survey import Survey
from insonify.sonar.track import Poses, logged_poses
from insonify.synthesis._groups import PulseTable, pulse_table
from insonify.synthesis.as_heard import as_heard
from insonify.synthesis.channel_noise import ChannelNoise, channel_noise
from insonify.synthesis.coherent import Coherent
from insonify.synthesis.elements import as_beam
from insonify.synthesis.grid import TimeGrid, time_grid
from insonify.synthesis.incoherent import Energies, Incoherent
from insonify.synthesis.labels import GROUND_POINTS, POINTS, Labelling, label_names
from insonify.synthesis.levels import ALL, Levels, level_curves
from insonify.synthesis.perturbation import perturbation
from insonify.synthesis.receiving import Electronics, electronics
from insonify.synthesis.shapes import shapes_of
from insonify.synthesis.traced import Traced, TracedLevels

if TYPE_CHECKING:
    import xarray as xr

MOST_BYTES = 64 << 20
"""Memory of a coherent ping's sound, of one side and part, up to which pings are heard side by side [bytes]."""

PINGS_JUDGED = 5
"""Pings of a track by which it is judged how much of the bed terrain hides."""
AHEAD = 2
"""Pings that are heard, or wait for a thread, beyond one for each thread."""


class Reading(Protocol):
    """How arrivals are heard: what it keeps while listening, and what it makes of it."""

    @property
    def even(self) -> bool:
        """Whether it wants points laid out evenly, or drawn scatterers."""

    def silence(self) -> Any:
        """Nothing heard yet."""

    def take_in(self, heard: Any, pairs: Any) -> None:
        """Add what the engine makes of one block."""

    def series(self, heard: Any) -> Any:
        """What was heard, over time."""


@dataclass(frozen=True)
class Listening:
    """A scenario made ready to ping: what does not change from ping to ping."""

    scenario: Scenario
    engine: Paths
    platforms: Platforms
    surveys: tuple[Survey, ...]
    pulse: HeardPulse
    grid: TimeGrid
    tracer: Any = None
    """The engine that is heard instead, where the scenario asks for it."""

    def stance(self, ping: int, *, channel: int = 0) -> Stance:
        """The sonar as it stands at one ping: the side that a channel belongs to."""
        return self.stances(ping)[channel // self.scenario.sonar.beam_count]

    def stances(self, ping: int) -> list[Stance]:
        """The sonar's sides as they stand at one ping, in the order of their channels."""
        return [side.at(ping) for side in self._sides]

    @property
    def poses(self) -> Poses:
        """Poses of the platform that carries the transmitter."""
        return self.platforms.sending

    def expectation(self, here: Stance) -> Incoherent | Traced:
        """The incoherent reading of one ping, by the engine that the scenario asks for."""
        if self.tracer is None:
            return self.incoherent(here)
        return Traced(here, self.grid, perturbation(self.scenario.seed, here.ping, self.scenario.paths))

    def incoherent(self, here: Stance) -> Incoherent:
        """The incoherent reading of one ping."""
        scenario = self.scenario
        shaken = perturbation(scenario.seed, here.ping, scenario.paths)
        return Incoherent(here, self.grid, shaken, self._table, delay_field(scenario))

    def ground(self, here: Stance) -> SwathView | None:
        """The fast path to the seabed of one ping, where its expectation takes it."""
        return None if self.tracer is not None else self._ground(here, self.engine.choice)

    def label_ground(self, here: Stance) -> SwathView | None:
        """The fast path to the seabed of one ping for its labels, whatever engine is recorded."""
        return self._ground(here, self._label_paths)

    def _ground(self, here: Stance, choice: PathChoice) -> SwathView | None:
        bed = self.engine.scene.seabed.bed
        if bed is None or bed.span[0] == bed.span[1] or delay_field(self.scenario) is not None:
            return None
        quick = swath_of(self.engine.scene, choice, here, self.engine.rays)
        return None if quick is None or self._terrain_hides_much else quick

    @property
    def shares_ground(self) -> bool:
        """True where labels and sound are expectations of the same points of the seabed."""
        return self._label_paths is self.engine.choice

    @cached_property
    def _label_paths(self) -> PathChoice:
        """Paths of the labels' seabed: those of the sound where it may take the fast path, else at fewer points."""
        choice = self.engine.choice
        if self.scenario.field == "incoherent" and self.tracer is None:
            return choice
        return choice.unchecked_copy(scatterers_per_cell=min(choice.scatterers_per_cell, GROUND_POINTS))

    @cached_property
    def _terrain_hides_much(self) -> bool:
        """True: terrain hides so much of the bed on the whole track that the fast path to the seabed does not serve."""
        bed = self.engine.scene.seabed.bed
        last, parts = self.scenario.track.ping_count - 1, []
        for ping in sorted({round(last * part) for part in np.linspace(0, 1, PINGS_JUDGED)}):
            parts += [hidden_part(bed, here) for here in self.stances(ping)] if bed is not None else []
        return bool(parts) and float(np.mean(parts)) > MOST_HIDDEN

    def labelling(self, here: Stance) -> Labelling:
        """The reading that labels one ping."""
        floor = float(np.mean(self.noise.power))
        cutters = tuple(target.label for target in self.engine.scene.occluders)
        return Labelling(self.incoherent(here), self.label_names, cutters, floor)

    @cached_property
    def label_names(self) -> LabelNames:
        """The axes of labels."""
        targets, water = tuple(target.label for target in self.scenario.targets), self.scenario.water
        suspended = ("water",) * (water.volume_strength_db is not None) + tuple(one.label for one in water.patches)
        return label_names(targets, self.scenario.paths.followed, water=suspended)

    @cached_property
    def noise(self) -> ChannelNoise:
        """The noise of all channels."""
        scenario = self.scenario
        return channel_noise(scenario.sonar, scenario.water, self.stances(0), self.pulse, scenario.seed)

    @cached_property
    def electronics(self) -> Electronics | None:
        """What is behind the hydrophones."""
        return electronics(self.scenario.sonar, self.scenario.water, self.pulse, self.grid)

    @cached_property
    def _sides(self) -> tuple[Riding, ...]:
        told = self.platforms, self.scenario.track.window, self.pulse, self.scenario.water, self.surveys
        return tuple(Riding(side, *told, self.scenario.seed) for side in self.scenario.sonar.one_sided)

    @cached_property
    def _table(self) -> PulseTable:
        # A quarter more on each side: the pulse's ringing interferes too, though only a millionth of its energy.
        more = (self.pulse.stop - self.pulse.start) / 4
        return pulse_table(self.pulse.samples, self.pulse.start - more, self.pulse.stop + more, self.grid.sample_rate)

    def coherent(self, here: Stance) -> Coherent:
        """The coherent reading of one ping."""
        shaken = perturbation(self.scenario.seed, here.ping, self.scenario.paths)
        return Coherent(here, self.grid, shaken, shapes_of(here), self.scenario.water)


def prepare(scenario: Scenario) -> Listening:
    """Make a scenario ready to ping."""
    pulse = heard_pulse(scenario.sonar)
    # The absorption is kept from ping to ping; here each run hears where it is not valid.
    scenario.water.absorption(scenario.sonar.pulse.frequency)
    rate = scenario.sonar.receiver.sample_rate
    grid = time_grid(*scenario.track.window, rate, *pulse.ringing)
    carried = platforms(scenario)
    rays = rays_in(scenario.scene, domain(scenario, carried, pulse))
    late = delay_field(scenario) if scenario.field == "coherent" else None
    engine = Paths(scenario.scene, scenario.paths, scenario.seed, rays, delays=late)
    tracer = None
    if scenario.paths.engine == "tracer":
        from insonify.engines.tracer import Tracer  # kernels of its own, which few runs ask for

        tracer = Tracer(scenario.scene, scenario.paths, scenario.seed)
    return Listening(scenario, engine, carried, surveys_of(scenario.sonar, carried), pulse, grid, tracer)


def simulate(scenario: Scenario, *, pings: int | Iterable[int] | None = None, threads: int | None = None) -> xr.Dataset:
    """What the sonar records.

    Args:
        scenario: What is simulated.
        pings: Number of the ping wanted, or numbers of several; all by default.
        threads: How many cores to use; all by default. The bits do not depend on it.

    Returns:
        `pressure` complex64 [uPa] (coherent) or `intensity` [uPa^2] (incoherent) over (ping, channel, time).
    """
    chosen = wanted_pings(scenario, pings)
    listening = prepare(scenario)
    shape = len(chosen), scenario.sonar.channel_count, listening.grid.count  # also of no pings at all
    data = np.array([series for _, series in listen(listening, chosen, threads)]).reshape(shape)
    return dataset(layout(listening), attributes(scenario), data, np.array(chosen, np.int64))


def record(
    scenario: Scenario, path: str | Path, *, pings: int | Iterable[int] | None = None, threads: int | None = None,
    overwrite: bool = False, on_ping: Callable[[int, int], None] | None = None, with_labels: bool | None = None,
) -> Path:  # fmt: skip
    """Simulate to disk, ping by ping; a run that was stopped goes on where it was.

    Args:
        scenario: What is simulated.
        path: Folder of the recording.
        pings: Numbers of the pings wanted; all by default.
        threads: How many cores to use.
        overwrite: Whether to replace another recording that is there.
        on_ping: Told the pings done and the pings wanted, before the first and after each.
        with_labels: Whether labels are stored beside the sound; None: as the scenario's `output` says.

    Returns:
        The path.
    """
    from insonify.formats import label_store, zarr_store

    wanted = wanted_pings(scenario, pings)
    listening = prepare(scenario)
    mine = zarr_store.create(path, layout(listening), attributes(scenario), overwrite=overwrite)
    labelled = scenario.output.labels if with_labels is None else with_labels
    if labelled:
        label_store.create(path, listening.label_names, layout(listening), attributes(scenario), into=mine)
    there = zarr_store.done(path)
    whole = label_store.done(path) if labelled else np.ones(len(there), bool)
    jobs = [Job(ping, sound=False, labels=True) for ping in wanted if there[ping] and not whole[ping]]
    jobs += [Job(ping, sound=True, labels=not whole[ping]) for ping in wanted if not there[ping]]
    done, tell = len(wanted) - len(jobs), on_ping or (lambda *_: None)
    tell(done, len(wanted))
    for job, series, labelling in _worked(listening, jobs, threads):
        # labels first: a ping whose sound is there is whole
        if labelling is not None:
            label_store.write_ping(path, job.ping, labelling, into=mine)
        if series is not None:
            zarr_store.write_ping(path, job.ping, series, into=mine)
        done += 1
        tell(done, len(wanted))
    return Path(path)


class Job(NamedTuple):
    """One ping, and what is made of it."""

    ping: int
    sound: bool
    """True: its series is wanted."""
    labels: bool
    """True: its labels are wanted."""


def listen(
    listening: Listening, pings: Iterable[int], threads: int | None = None
) -> Iterator[tuple[int, NDArray[np.generic]]]:
    """Time series, ping by ping: number of the ping, and its series of shape (channels, samples)."""
    for job, series, _ in _worked(listening, [Job(ping, sound=True, labels=False) for ping in pings], threads):
        assert series is not None
        yield job.ping, series


def _worked(
    listening: Listening, jobs: list[Job], threads: int | None
) -> Iterator[tuple[Job, NDArray[np.generic] | None, Labels | None]]:
    """Series and labels of some pings, one after the other.

    Many pings are shared among the threads, a few of them ahead of the one that is asked for; few pings, and those that
    take much memory, are heard one after the other, each by all threads.
    """
    workers = threads or os.cpu_count() or 1
    keep_freed_memory()
    with ThreadPoolExecutor(workers) as pool:
        if len(jobs) < 2 * workers or not _side_by_side(listening, jobs[0].ping):
            yield from ((job, *_done(listening, job, pool)) for job in jobs)
            return
        begun: deque[tuple[Job, Future[tuple[NDArray[np.generic] | None, Labels | None]]]] = deque()
        try:
            for job in jobs:
                begun.append((job, pool.submit(_done, listening, job, Alone())))
                if len(begun) == workers + AHEAD:
                    ready, made = begun.popleft()
                    yield (ready, *made.result())
            while begun:
                ready, made = begun.popleft()
                yield (ready, *made.result())
        finally:
            for _, made in begun:
                made.cancel()


def _done(listening: Listening, job: Job, pool: Pool) -> tuple[NDArray[np.generic] | None, Labels | None]:
    """Series and labels of one ping, as far as they are wanted: what the ground hides is worked out once for both."""
    if not job.labels:
        return _heard(listening, job.ping, pool), None
    labelling, seabeds = _labels(listening, job.ping, pool)
    return _heard(listening, job.ping, pool, seabeds) if job.sound else None, labelling


def _side_by_side(listening: Listening, ping: int) -> bool:
    """Whether pings are so quick that sharing one costs more than it saves, or so small that there is room for many."""
    if listening.tracer is not None:
        return False
    here = listening.stances(ping)
    if listening.scenario.field == "coherent":
        return all(listening.coherent(side).silence().nbytes <= MOST_BYTES for side in here)
    return all(listening.incoherent(side).brief and listening.ground(side) for side in here)


def _heard(
    listening: Listening, ping: int, pool: Pool, seabeds: Sequence[Seabed | None] | None = None
) -> NDArray[np.generic]:  # fmt: skip
    """All sides of one ping, with the noise, through the receiver, shape (channels, samples)."""
    sides, behind = listening.stances(ping), listening.electronics
    if listening.scenario.field == "incoherent":
        expected = [
            hear(listening, listening.expectation(here), here, pool, seabed)
            for here, seabed in zip(sides, seabeds or [None] * len(sides), strict=True)
        ]
        intensity = np.asarray(np.concatenate(expected) + listening.noise.power[:, None])
        return intensity if behind is None else behind.intensities(intensity)
    sound = np.concatenate([hear(listening, listening.coherent(here), here, pool) for here in sides])
    sound = sound + listening.noise.draw(ping, sides[0].time, listening.grid)
    return sound if behind is None else behind.pressures(sound)


class Seabed(NamedTuple):
    """The seabed of one side of a ping by the fast path, with its expected energies."""

    ground: SwathView | None
    energies: Energies


def hear(listening: Listening, reading: Reading, here: Stance, pool: Pool, seabed: Seabed | None = None) -> Any:
    """One ping, heard by one reading.

    Args:
        listening: A prepared scenario.
        reading: The reading.
        here: One side of the sonar at that ping.
        pool: Does the parts of the ping.
        seabed: Its seabed, where the fast path has evaluated it already; for an `Incoherent` reading.
    """
    if seabed is not None:
        return reading.series(_sums(listening, reading, here, pool, *seabed))
    quick = type(reading) is Incoherent and reading.brief
    return reading.series(_sums(listening, reading, here, pool, listening.ground(here) if quick else None))


def _sums(
    listening: Listening, reading: Reading, here: Stance, pool: Pool, ground: SwathView | None,
    known: Energies | None = None,
) -> Any:  # fmt: skip
    """What one reading hears of a ping: blocks are shared into a fixed number of parts, added in a fixed order.

    Args:
        listening: A prepared scenario.
        reading: The reading.
        here: One side of the sonar at that ping.
        pool: Does the parts of the ping.
        ground: The fast path to its seabed; None: the seabed comes in blocks, as all else.
        known: Energies of the seabed by the fast path; None: not yet evaluated.
    """
    engine = listening.tracer if isinstance(reading, Traced | TracedLevels) else listening.engine
    if isinstance(pool, Alone) and isinstance(engine, Paths):
        engine = replace(engine, skylines=pool.skylines)  # nobody else asks for this ping
    if reading.even and isinstance(engine, Paths):
        engine = replace(engine, delays=None)  # an expectation takes the mean over them
    if ground is not None:
        engine = replace(engine, choice=ground.rest)
    if isinstance(reading, Labelling):
        fewer = min(listening.scenario.paths.scatterers_per_cell, POINTS)
        engine = replace(engine, choice=engine.choice.unchecked_copy(scatterers_per_cell=fewer))
    met: Any = engine.pieces if isinstance(engine, Paths) else lambda at, block: [engine.pairs(at, block)]
    if isinstance(reading, Coherent):
        met = partial(met, drowned=False)
    blocks = engine.blocks(here, even=reading.even)

    def part(mine: list[Any]) -> Any:
        heard = reading.silence()
        for block in mine:
            for pairs in met(here, block):
                reading.take_in(heard, pairs)
        return heard

    def swathed(swath: Swath) -> Any:
        heard, wide = reading.silence(), cast(Incoherent | Labelling, reading)
        wide.take_in_swath(heard, swath)
        return heard

    count = min(parts_of(getattr(reading.silence(), "nbytes", 0)), len(blocks)) if blocks else 0
    sums = list(pool.map(part, [blocks[k::count] for k in range(count)]))
    found = [reduce(iadd, sums)] if sums else []
    if known is not None:
        found.append(known)
    elif ground is not None:
        found.append(reduce(iadd, ground.gather(pool.map, swathed, labelled=isinstance(reading, Labelling))))
    return reduce(iadd, found) if found else reading.silence()


def label_ping(listening: Listening, ping: int, threads: int | None = None) -> Labels:
    """The labels of one ping, all its sides."""
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        return _labels(listening, ping, pool)[0]


def _labels(listening: Listening, ping: int, pool: Pool) -> tuple[Labels, list[Seabed | None]]:
    """Labels of one ping, and the seabed of each side as its expectation is recorded, where both are the same."""
    made: list[Labels] = []
    seabeds: list[Seabed | None] = []
    for here in listening.stances(ping):
        reading = listening.labelling(here)
        ground = listening.label_ground(here) if reading.whole.brief else None
        sums = _sums(listening, reading, here, pool, ground)
        made.append(reading.series(sums))
        shared = ground is not None and listening.shares_ground
        seabeds.append(Seabed(ground, sums.curves["seabed", ALL]) if shared else None)
    return beside(made), seabeds


def labels(scenario: Scenario, ping: int = 0, *, threads: int | None = None) -> xr.Dataset:
    """What each sample of one ping really is: whose echo, by which paths, from where; highlight, shadow or ghost.

    Args:
        scenario: What is simulated.
        ping: Number of the ping.
        threads: How many cores to use.

    Returns:
        The variables of `insonify.records.labels.COLUMNS` for that ping, over (channel, time).

    Raises:
        ValueError: The track has no such ping, or the channels are elements.
    """
    wanted_pings(scenario, [ping])
    if scenario.sonar.receiver.record == "elements":
        raise ValueError("sonar.receiver.record is elements, and labels are those of beams. Write record: beams.")
    listening = prepare(scenario)
    made = label_ping(listening, ping, threads)
    held = label_dataset([made], listening.label_names, listening.grid.time, np.array([ping]))
    return held.isel(ping=0).assign_attrs(attributes(scenario))


def arrivals(scenario: Scenario, ping: int = 0, *, window: Interval | None = None, channel: int = 0) -> Arrivals:
    """The paths of one ping, out and back, row by row.

    Args:
        scenario: What is simulated.
        ping: Number of the ping.
        window: Earliest and latest delay wanted [s], or with units such as ("200 ms", "201 ms"); by default all that
            touch the recording.
        channel: Which beam or element: of a sonar with two sides, the paths to and from the side that it belongs to.
            Delays, amplitudes and Doppler factors are those that this channel hears, under way as well.

    Raises:
        ValueError: The track has no such ping, the sonar no such channel, or the window lies beyond the recording.
    """
    wanted_pings(scenario, [ping])
    _insist_on_channel(scenario, channel)
    if scenario.paths.engine == "tracer":
        raise ValueError("paths.engine is tracer, and rays are energies, not paths. For arrivals write engine: paths.")
    listening = prepare(scenario)
    here = listening.stance(ping, channel=channel)
    first, last = wanted_delays(here, window)
    even = scenario.field == "incoherent"
    shaken = perturbation(scenario.seed, ping, scenario.paths)
    found: list[Arrivals] = []
    group = 0
    for block in listening.engine.blocks(here, even=even):
        points = block()
        if window is not None:
            points = points.take(in_delay_window(points, here, scenario.scene, scenario.paths.followed, (first, last)))
        if not len(points):
            continue
        pairs = listening.engine.pairs(here, partial(_as_they_are, points), drowned=even)
        factors = {} if shaken.still else {
            names: shaken.factor(pairs.scatterers.place, *names) for names in pairs.rays()
        }  # fmt: skip
        heard = None
        if scenario.field == "coherent" and not listening.coherent(here).plain:
            heard = as_heard(pairs, here, channel % scenario.sonar.beam_count, scenario.water)
        paths = expand(pairs, group, factors, heard)
        found.append(paths.take((paths.delay >= first) & (paths.delay <= last)))
        group += len(pairs.scatterers) if pairs.scatterers.drawn else 1
    return joined(found)


def levels(scenario: Scenario, ping: int = 0, *, channel: int = 0, threads: int | None = None) -> xr.Dataset:
    """Expected levels of one ping by cause and by family pair.

    Args:
        scenario: What is simulated.
        ping: Number of the ping.
        channel: Which beam, or which element: heard at its array's centre, by its own pattern.
        threads: How many cores to use.

    Returns:
        `level_db` over (cause, pair, time) [dB re 1 uPa], see `insonify.synthesis.levels.level_curves`.

    Raises:
        ValueError: The track has no such ping, or the sonar no such channel.
    """
    wanted_pings(scenario, [ping])
    _insist_on_channel(scenario, channel)
    listening = prepare(scenario)
    here = as_beam(listening.stance(ping, channel=channel), channel % scenario.sonar.beam_count)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        whole = listening.expectation(here)
        intensity = hear(listening, TracedLevels(whole) if isinstance(whole, Traced) else Levels(whole), here, pool)
    floor = float(listening.noise.power[channel])
    curves = level_curves(intensity, floor, listening.grid, channel % scenario.sonar.beam_count % here.channel_count)
    return curves.assign_attrs(**attributes(scenario), ping=ping, channel=channel)


def _as_they_are(points: Scatterers) -> Scatterers:
    """A block of scatterers that is there already."""
    return points


def _insist_on_channel(scenario: Scenario, channel: int) -> None:
    if not 0 <= channel < scenario.sonar.channel_count:
        raise ValueError(f"channel is {channel}; the sonar has channels 0 to {scenario.sonar.channel_count - 1}")


def layout(listening: Listening) -> Layout:
    """What a recording of this scenario holds, but for the sound."""
    scenario, true = listening.scenario, listening.poses
    logged = logged_poses(scenario.track.logged, true, scenario.seed)
    ears, other = listening.platforms.receiving, scenario.receiver_track
    second: dict[str, NDArray[np.float64]] = {}
    if ears is not None and other is not None:
        told = logged_poses(other.logged, ears, receiver_seed(scenario))
        second = {
            "receiver_position": ears.position, "receiver_attitude": ears.attitude,
            "logged_receiver_position": told.position, "logged_receiver_attitude": told.attitude,
        }  # fmt: skip
    if not second:
        second["slant_range"] = listening.grid.time * scenario.water.sound_speed / 2
    return Layout(
        field="pressure" if scenario.field == "coherent" else "intensity",
        time=listening.grid.time,
        ping_time=true.time,
        steer=np.array(scenario.sonar.steers),
        side=np.array(scenario.sonar.channel_sides, dtype=float),
        element_position=channel_places(scenario.sonar),
        position=true.position,
        attitude=true.attitude,
        logged_position=logged.position,
        logged_attitude=logged.attitude,
        **second,
    )
