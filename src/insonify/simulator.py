"""Simulation of a scenario, ping by ping: scatterers, path pairs, sums over arrivals, receiver, recording."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from operator import iadd
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from insonify.engines.boundary_echoes import label_families
from insonify.engines.delay_window import DelayInterval, delay_interval, in_delay_window
from insonify.engines.eigenray_engine import EigenrayEngine
from insonify.engines.fast_reverberation import FastReverberation, prepare_fast_reverberation
from insonify.engines.parts import SerialPool, WorkerPool, parts_of
from insonify.engines.terrain_cover import MAX_HIDDEN_FRACTION, hidden_fraction
from insonify.kernel_compilation import compile_ahead
from insonify.machine_memory import warn_of_memory
from insonify.malloc_tuning import keep_freed_memory
from insonify.propagation.families import bottom_bounces, families_reaching
from insonify.propagation.path_settings import PathSettings
from insonify.propagation.propagation_model_choice import propagation_model_for
from insonify.records.arrivals import Arrivals, concatenate_arrivals, expand_arrivals
from insonify.records.labels import LabelNames, Labels, MaskLabels, concatenate_channels, label_dataset
from insonify.records.recording import FIELDS, recording_dataset
from insonify.records.reverberation_samples import ReverberationSamples
from insonify.scenario.attributes import attributes
from insonify.scenario.features import scenario_features
from insonify.scenario.pings import require_index, selected_pings
from insonify.scenario.platform_poses import platforms
from insonify.scenario.ray_domain import delay_field, domain
from insonify.scenario.recording_layout import recording_layout
from insonify.scenario.scenario import Scenario
from insonify.sonar.ping_geometry import MountedSonar, PingGeometry, track_extents_of
from insonify.sonar.platforms import Platforms
from insonify.sonar.received_pulse import ReceivedPulse, received_pulse
from insonify.sonar.track_extent import TrackExtent
from insonify.synthesis.accumulator import Accumulator, Requirements
from insonify.synthesis.channel_arrivals import channel_arrivals
from insonify.synthesis.channel_noise import ChannelNoise, channel_noise
from insonify.synthesis.coherent import CoherentAccumulator
from insonify.synthesis.coherent_groups import PulseTable, pulse_table
from insonify.synthesis.direction_powers import direction_powers
from insonify.synthesis.element_arrivals import element_as_beam
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer
from insonify.synthesis.label_accumulator import SEABED_POINTS, LabelAccumulator, label_names
from insonify.synthesis.label_sums import RecordedSums, recorded_sums
from insonify.synthesis.level_curves import LevelAccumulator, level_curves
from insonify.synthesis.receiver_chain import ReceiverChain, receiver_chain
from insonify.synthesis.replica_jitter import ReplicaJitter, replica_jitter
from insonify.synthesis.time_grid import TimeGrid, time_grid
from insonify.synthesis.traced_intensity import TracedAccumulator, TracedLevelAccumulator
from insonify.synthesis.waveform_basis import waveform_basis
from insonify.thread_count import thread_count

if TYPE_CHECKING:
    import xarray as xr

    from insonify.processing.recorded_lines import RecordedLines

MAX_CONCURRENT_PING_BYTES = 128 << 20
"""Memory of a coherent ping's buffer, of one side and part, up to which pings are simulated concurrently [bytes]."""
PINGS_JUDGED = 5
"""Number of pings of a track at which the part of the seabed hidden by terrain is measured."""
QUEUED_PINGS = 2
"""Number of pings that are simulated, or wait for a thread, beyond one for each thread."""


@dataclass(frozen=True)
class Simulator:
    """A scenario with all that its pings share: engine, poses, received pulse and time grid."""

    scenario: Scenario
    engine: EigenrayEngine
    platforms: Platforms
    track_extents: tuple[TrackExtent, ...]
    pulse: ReceivedPulse
    grid: TimeGrid
    tracer: Any = None
    """The tracer, where the scenario has it for its expected intensities."""
    with_positions: bool = True
    """True: labels of pings are `Labels`; False: `MaskLabels` alone, without positions and pairs of families."""

    def ping_geometry(self, ping: int, *, channel: int = 0) -> PingGeometry:
        """Geometry of one ping: of the side that a channel belongs to."""
        return self.ping_geometries(ping)[channel // self.scenario.sonar.beam_count]

    def ping_geometries(self, ping: int, poses: Platforms | None = None) -> list[PingGeometry]:
        """Geometry of one ping for each side, in the order of its channels; poses: other ones than the track's."""
        return [side.at(ping) if poses is None else side.at_poses(ping, poses) for side in self._sides]

    def expectation_accumulator(self, geometry: PingGeometry) -> IncoherentAccumulator | TracedAccumulator:
        """Accumulator of the expected intensity of one ping, by the scenario's engine."""
        if self.tracer is None:
            return self.incoherent_accumulator(geometry)
        return TracedAccumulator(geometry, self.grid, self._jitter(geometry))

    def _jitter(self, geometry: PingGeometry) -> ReplicaJitter:
        return replica_jitter(self.scenario.seed, geometry.ping, self.scenario.paths)

    def incoherent_accumulator(self, geometry: PingGeometry) -> IncoherentAccumulator:
        """Accumulator of the expected intensity of one ping, by eigenrays."""
        delays, rows = delay_field(self.scenario), direction_powers(geometry, 4 * self.grid.energy_cell_count)
        return IncoherentAccumulator(geometry, self.grid, self._jitter(geometry), self._table, delays, rows)

    def fast_reverberation(self, geometry: PingGeometry) -> FastReverberation | None:
        """Fast reverberation of one ping, where it applies."""
        return None if self.tracer is not None else self._reverberation(geometry, self.engine.path_settings)

    def label_reverberation(self, geometry: PingGeometry) -> FastReverberation | None:
        """Fast reverberation of one ping for its labels, whatever the engine of the recording."""
        return self._reverberation(geometry, self._label_paths)

    def _reverberation(self, geometry: PingGeometry, path_settings: PathSettings) -> FastReverberation | None:
        terrain = self.engine.scene.seabed.terrain
        unlike_pairs = delay_field(self.scenario) is not None or path_settings.replica_perturbations
        if terrain is None or terrain.span[0] == terrain.span[1] or unlike_pairs:
            return None
        # its radials follow the mean plane: where the relief reflects all families, sound comes from elsewhere
        if all(bottom_bounces(name) for name in families_reaching("seabed", path_settings.followed_families)):
            return None
        reverberation = prepare_fast_reverberation(self.engine.scene, path_settings, geometry, self.engine.rays)
        return None if reverberation is None or self._terrain_hides_much else reverberation

    @property
    def shares_reverberation(self) -> bool:
        """True where labels and recording are expectations of the same points of the seabed."""
        return self._label_paths is self.engine.path_settings

    @cached_property
    def _label_paths(self) -> PathSettings:
        """Path settings of the labels' seabed: those of the recording where shared, else with fewer points."""
        path_settings = self.engine.path_settings
        if self.scenario.field == "incoherent" and self.tracer is None:
            return path_settings
        return path_settings.unchecked_copy(scatterers_per_cell=min(path_settings.scatterers_per_cell, SEABED_POINTS))

    @cached_property
    def _terrain_hides_much(self) -> bool:
        """True: terrain hides too much of the seabed along the track for the fast reverberation."""
        terrain, last, hidden = self.engine.scene.seabed.terrain, self.scenario.track.ping_count - 1, list[float]()
        for ping in sorted({round(last * fraction) for fraction in np.linspace(0, 1, PINGS_JUDGED)}):
            if terrain is not None:
                hidden += [hidden_fraction(terrain, geometry) for geometry in self.ping_geometries(ping)]
        return bool(hidden) and float(np.mean(hidden)) > MAX_HIDDEN_FRACTION

    def label_accumulator(self, geometry: PingGeometry) -> LabelAccumulator:
        """Accumulator of the labels of one ping."""
        uses_energy_grid, grid, noise = self.scenario.field == "incoherent", self.grid, self.noise.mean_power
        if not uses_energy_grid:  # without the filter's weak ringing
            grid = time_grid(*self.scenario.track.window, grid.sample_rate, self.pulse.start, self.pulse.stop)
        mean = IncoherentAccumulator(geometry, grid, self._jitter(geometry), self._table, delay_field(self.scenario))
        occluder_names = tuple(target.label for target in self.engine.scene.occluders)
        return LabelAccumulator(mean, self.label_names, occluder_names, noise, uses_energy_grid, self.with_positions)

    @cached_property
    def label_names(self) -> LabelNames:
        """The axes of labels."""
        targets, water = tuple(target.label for target in self.scenario.targets), self.scenario.water
        suspended = ("water",) * (water.volume_strength_db is not None) + tuple(patch.label for patch in water.patches)
        hull, bistatic = self.scenario.sonar.hull is not None, self.scenario.receiver_track is not None
        faces = bool(self.engine.faces(self.ping_geometry(0)))
        families, echoes = label_families(self.scenario.paths, two_platforms=bistatic, under_hull=hull, faces=faces)
        return label_names(targets, families, water=suspended, boundary_echoes=echoes)

    @cached_property
    def noise(self) -> ChannelNoise:
        """The noise of all channels."""
        scenario = self.scenario
        return channel_noise(scenario.sonar, scenario.water, self.ping_geometries(0), self.pulse, scenario.seed)

    @cached_property
    def electronics(self) -> ReceiverChain | None:
        """Receiver electronics behind the hydrophones; None: none."""
        return receiver_chain(self.scenario.sonar, self.scenario.water, self.pulse, self.grid)

    def recorded_lines(self) -> RecordedLines | None:
        """Lines of the sonar's recorder; None: it has none, or records elements, of which beams are formed first."""
        sonar, water = self.scenario.sonar, self.scenario.water
        if sonar.recorder is None or sonar.receiver.record == "elements":
            return None
        from insonify.processing.recorded_lines import RecordedLines  # with xarray

        absorption = float(water.absorption(sonar.pulse.frequency))
        return RecordedLines(sonar.recorder, self.grid.time, water.sound_speed, absorption)

    @cached_property
    def _sides(self) -> tuple[MountedSonar, ...]:
        shared = self.platforms, self.scenario.track.window, self.pulse, self.scenario.water, self.track_extents
        sonar = self.scenario.sonar if self.scenario.field == "coherent" else self.scenario.sonar.at_carrier
        return tuple(MountedSonar(side, *shared, self.scenario.seed) for side in sonar.side_sonars)

    @cached_property
    def _table(self) -> PulseTable:
        # A quarter more on each side: the pulse's ringing interferes too, though only a millionth of its energy.
        more = (self.pulse.stop - self.pulse.start) / 4
        return pulse_table(self.pulse.samples, self.pulse.start - more, self.pulse.stop + more, self.grid.sample_rate)

    def coherent_accumulator(self, geometry: PingGeometry) -> CoherentAccumulator:
        """Accumulator of the complex pressure of one ping."""
        basis = waveform_basis(geometry)
        return CoherentAccumulator(geometry, self.grid, self._jitter(geometry), basis, self.scenario.water)


def build_simulator(scenario: Scenario, poses: Platforms | None = None) -> Simulator:
    """Prepare a scenario for its pings; `poses` holds the poses of its track and further ones that pings may have."""
    pulse = received_pulse(scenario.sonar)
    # The absorption is cached between runs; evaluated here, each run warns where it is not valid.
    scenario.water.absorption(scenario.sonar.pulse.frequency)
    rate = scenario.sonar.receiver.sample_rate
    grid = time_grid(*scenario.track.window, rate, *pulse.table_interval)
    poses = poses or platforms(scenario)
    rays = propagation_model_for(scenario.scene, domain(scenario, poses, pulse))
    delays = delay_field(scenario) if scenario.field == "coherent" else None
    engine = EigenrayEngine(scenario.scene, scenario.paths, scenario.seed, rays, delay_field=delays)
    tracer = None
    if scenario.paths.engine == "tracer":
        from insonify.engines.tracer import Tracer  # kernels of its own, which few runs need

        tracer = Tracer(scenario.scene, scenario.paths, scenario.seed, rays)
    return Simulator(scenario, engine, poses, track_extents_of(scenario.sonar, poses), pulse, grid, tracer)


def simulate(scenario: Scenario, *, pings: int | Iterable[int] | None = None, threads: int | None = None) -> xr.Dataset:
    """Simulate a recording.

    Args:
        scenario: The scenario.
        pings: Number of a ping, or numbers of several; all by default.
        threads: Number of threads; all cores by default. The result does not depend on it, bit for bit.

    Returns:
        `pressure` complex64 [uPa] (coherent) or `intensity` [uPa^2] (incoherent) over (ping, channel, time); beside it,
        or alone, the lines that `sonar.recorder` makes of those pings.

    Example:
        >>> recording = insonify.simulate(insonify.load_scenario("sidescan.yaml"), pings=[0, 1])
        >>> dict(recording.pressure.sizes), recording.pressure.units
        ({'ping': 2, 'channel': 2, 'time': 1750}, 'uPa')
    """
    chosen = selected_pings(scenario, pings)
    simulator = build_simulator(scenario)
    shape = len(chosen), scenario.sonar.channel_count, simulator.grid.sample_count  # also of no pings at all
    data: NDArray[np.generic] = np.empty(shape, FIELDS["pressure" if scenario.field == "coherent" else "intensity"][0])
    warn_of_memory(data.nbytes, "simulate() holds all pings in memory", "record() writes them to disk one by one, and "
                   "open_recording() reads them on access")  # fmt: skip
    for row, (_, series) in zip(data, simulate_pings(simulator, chosen, threads), strict=True):
        row[...] = series
    layout = recording_layout(scenario, simulator.platforms, simulator.grid.time)
    recording = recording_dataset(layout, attributes(scenario), data, np.array(chosen, np.int64))
    lines = simulator.recorded_lines()
    if lines is None:
        return recording
    from insonify.processing.recorder import instrument_recording

    return instrument_recording(
        recording, lines.recorder, sound_speed=lines.sound_speed, absorption_db_per_m=lines.absorption_db_per_m
    )


SeriesAndLabels = tuple[NDArray[np.generic] | None, MaskLabels | None]


class Job(NamedTuple):
    """Results to compute of one ping."""

    ping: int
    with_series: bool
    """True: its series is computed."""
    with_labels: bool
    """True: its labels are computed."""


def simulate_pings(
    simulator: Simulator, pings: Iterable[int], threads: int | None = None
) -> Iterator[tuple[int, NDArray[np.generic]]]:
    """Time series, ping by ping: number of the ping, and its series of shape (channels, samples)."""
    jobs = [Job(ping, with_series=True, with_labels=False) for ping in pings]
    for job, series, _ in simulate_jobs(simulator, jobs, threads):
        assert series is not None
        yield job.ping, series


def simulate_jobs(
    simulator: Simulator, jobs: list[Job], threads: int | None
) -> Iterator[tuple[Job, NDArray[np.generic] | None, MaskLabels | None]]:
    """Series and labels of some pings, one after the other.

    Many pings are shared among the threads, a few of them ahead of the one that is yielded; few pings, and those that
    take much memory, are simulated one after the other, each by all threads.
    """
    workers = thread_count(threads)
    keep_freed_memory()
    series, labelled = any(job.with_series for job in jobs), any(job.with_labels for job in jobs)
    compile_ahead(scenario_features(simulator.scenario, series=series, labels=labelled), workers)
    if workers == 1:
        yield from ((job, *simulate_job(simulator, job, SerialPool())) for job in jobs)
        return
    with ThreadPoolExecutor(workers) as pool:
        if not are_many_and_small(simulator, len(jobs), workers):
            yield from ((job, *simulate_job(simulator, job, pool)) for job in jobs)
            return
        submitted: deque[tuple[Job, Future[SeriesAndLabels]]] = deque()
        try:
            for job in jobs:
                submitted.append((job, pool.submit(simulate_job, simulator, job, SerialPool())))
                if len(submitted) == workers + QUEUED_PINGS:
                    finished, result = submitted.popleft()
                    yield (finished, *result.result())
            while submitted:
                finished, result = submitted.popleft()
                yield (finished, *result.result())
        finally:
            for _, result in submitted:
                result.cancel()


def simulate_job(simulator: Simulator, job: Job, pool: WorkerPool) -> SeriesAndLabels:
    """Series and labels of one ping, as far as the job includes them; terrain occlusion is evaluated once for both."""
    sides = simulator.ping_geometries(job.ping)
    if not job.with_labels:
        return record_ping(simulator, sides, pool), None
    labelling, seabeds = _labels(simulator, sides, pool)
    return record_ping(simulator, sides, pool, seabeds) if job.with_series else None, labelling


def are_many_and_small(simulator: Simulator, pings: int, workers: int) -> bool:
    """Return True where pings are simulated one on each worker: there are enough, and they are small enough.

    Args:
        simulator: A prepared scenario.
        pings: Number of pings to simulate.
        workers: Number of workers.
    """
    return pings >= 2 * workers and _pings_fit_concurrently(simulator)


def _pings_fit_concurrently(simulator: Simulator) -> bool:
    """True: pings are so fast that sharing one among threads does not pay, or small enough for one on each thread."""
    if simulator.tracer is not None:
        return False
    sides = simulator.ping_geometries(0)
    if simulator.scenario.field == "coherent":
        return all(simulator.coherent_accumulator(side).empty().nbytes <= MAX_CONCURRENT_PING_BYTES for side in sides)
    return all(simulator.incoherent_accumulator(s).is_short_pulse and simulator.fast_reverberation(s) for s in sides)


def record_ping(
    simulator: Simulator, sides: list[PingGeometry], pool: WorkerPool, seabeds: Sequence[KnownSeabed | None] = ()
) -> NDArray[np.generic]:  # fmt: skip
    """Series of all sides of one ping with noise and receiver electronics, shape (channels, samples)."""
    electronics = simulator.electronics
    if simulator.scenario.field == "incoherent":
        expected = [
            accumulate_ping(simulator, simulator.expectation_accumulator(side), side, pool, seabed)
            for side, seabed in zip(sides, seabeds or [None] * len(sides), strict=True)
        ]
        intensity = np.asarray(np.concatenate(expected) + simulator.noise.power[:, None])
        return intensity if electronics is None else electronics.intensities(intensity)
    pressure = np.concatenate([accumulate_ping(simulator, simulator.coherent_accumulator(s), s, pool) for s in sides])
    pressure = pressure + simulator.noise.draw(sides[0].ping, sides[0].time, simulator.grid)
    return pressure if electronics is None else electronics.pressures(pressure)


KnownSeabed = tuple[FastReverberation, RecordedSums]
"""Fast reverberation of one side of a ping, and the sums of its labels that the recording has as well."""


def accumulate_ping(
    simulator: Simulator, accumulator: Accumulator, geometry: PingGeometry, pool: WorkerPool,
    seabed: KnownSeabed | None = None,
) -> Any:  # fmt: skip
    """Time series of one ping by one accumulator.

    Args:
        simulator: A prepared scenario.
        accumulator: Sum over the path pairs.
        geometry: One side of the sonar at that ping.
        pool: Threads for the parts of the ping.
        seabed: Seabed of this side, evaluated with its labels, for an `IncoherentAccumulator`; None: evaluated here.
    """
    if seabed is not None:
        label_reverberation, known = seabed
        if known.is_all:
            sums = known.energies
        else:
            sums = _sums(simulator, accumulator, geometry, pool, label_reverberation, known.energies)
        if known.intensity is not None:
            return known.intensity
    else:
        reverberation = simulator.fast_reverberation(geometry) if accumulator.requirements.fast_reverberation else None
        sums = _sums(simulator, accumulator, geometry, pool, reverberation)
    return accumulator.time_series(sums, pool.map)


def _sums(
    simulator: Simulator, accumulator: Accumulator, geometry: PingGeometry, pool: WorkerPool,
    reverberation: FastReverberation | None, known: IntensityBuffer | None = None,
) -> Any:  # fmt: skip
    """Sum of one ping in one accumulator: blocks are shared into a fixed number of parts, added in a fixed order.

    Args:
        simulator: A prepared scenario.
        accumulator: Sum over the path pairs.
        geometry: One side of the sonar at that ping.
        pool: Threads for the parts of the ping.
        reverberation: Fast reverberation of its seabed; None: the seabed comes in blocks, as other contributions do.
        known: Energies of the seabed by the fast reverberation; None: not yet evaluated.
    """
    required = accumulator.requirements
    blocks: list[Any] = []
    if reverberation is None or reverberation.remaining_path_settings.contributions:
        engine = simulator.tracer if required.rays else _engine(simulator.engine, required, pool, reverberation)
        blocks = engine.blocks(geometry, quadrature=required.quadrature)
    first = accumulator.empty() if blocks else None
    count = min(parts_of(getattr(first, "nbytes", 0)), len(blocks))

    def blocks_sum(part: int) -> Any:
        buffer = accumulator.empty() if part else first
        for block in blocks[part::count]:
            for pairs in engine.pair_batches(geometry, block, include_negligible=required.negligible_pairs):
                accumulator.add(buffer, pairs)
        return buffer

    def samples_sum(samples: ReverberationSamples) -> Any:
        buffer = accumulator.empty()
        cast(IncoherentAccumulator | LabelAccumulator, accumulator).add_fast_reverberation(buffer, samples)
        return buffer

    buffers = [reduce(iadd, pool.map(blocks_sum, range(count)))] if count else []
    if known is not None:
        buffers.append(known)
    elif reverberation is not None:
        buffers.append(reduce(iadd, reverberation.accumulate(pool.map, samples_sum, labelled=required.origins)))
    return reduce(iadd, buffers) if buffers else accumulator.empty()


def _engine(
    engine: EigenrayEngine, required: Requirements, pool: WorkerPool, reverberation: FastReverberation | None
) -> EigenrayEngine:
    """The eigenray engine for one sum: its contributions, its density of scatterers, its caches."""
    changes: dict[str, Any] = {} if reverberation is None else {"path_settings": reverberation.remaining_path_settings}
    path_settings = changes.get("path_settings", engine.path_settings)
    if required.max_scatterers_per_cell < path_settings.scatterers_per_cell:
        changes["path_settings"] = path_settings.unchecked_copy(scatterers_per_cell=required.max_scatterers_per_cell)
    if required.quadrature:
        changes["delay_field"] = None  # an expectation is a mean over random delays
    changes |= {"approximate_edges": True} if required.approximate_edges else {}
    if isinstance(pool, SerialPool):
        changes["caches"] = replace(engine.caches, terrain_occlusion=pool.terrain_occlusion)  # of this ping alone
    return replace(engine, **changes) if changes else engine


def label_ping(simulator: Simulator, ping: int, threads: int | None = None) -> Labels:
    """The labels of one ping, all its sides."""
    with ThreadPoolExecutor(thread_count(threads)) as pool:
        return cast(Labels, _labels(simulator, simulator.ping_geometries(ping), pool)[0])


def _labels(
    simulator: Simulator, sides: list[PingGeometry], pool: WorkerPool
) -> tuple[MaskLabels, list[KnownSeabed | None]]:
    """Labels of one ping, and the seabed of each side where the recorded expectation has the same points."""
    results, seabeds = list[MaskLabels](), list[KnownSeabed | None]()
    for geometry in sides:
        accumulator = simulator.label_accumulator(geometry)
        reverberation = simulator.label_reverberation(geometry) if accumulator.accumulator.is_short_pulse else None
        sums = _sums(simulator, accumulator, geometry, pool, reverberation)
        results.append(accumulator.time_series(sums))
        seabeds.append(None)
        if reverberation is not None and simulator.shares_reverberation:
            remaining = reverberation.remaining_path_settings.contributions
            seabeds[-1] = reverberation, recorded_sums(sums, results[-1].object_intensity[:, 0], remaining)
    return concatenate_channels(results), seabeds


def labels(scenario: Scenario, ping: int = 0, *, threads: int | None = None) -> xr.Dataset:
    """Labels of each sample of one ping: object, paths and position of the strongest echo; highlight, shadow, ghost.

    Args:
        scenario: The scenario.
        ping: Number of the ping.
        threads: Number of threads; all cores by default.

    Returns:
        The variables of `insonify.records.labels.COLUMNS` for that ping, over (channel, time).

    Raises:
        ValueError: The track has no such ping, or the channels are elements.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")  # a crate 1.5 m high stands 30 m to starboard of ping 40
        >>> shadow = insonify.labels(scenario, ping=40).shadow.isel(channel=1)
        >>> f"{750.0 * shadow.time[shadow].min():.0f} to {750.0 * shadow.time[shadow].max():.0f} m slant range"
        '32 to 39 m slant range'
    """
    selected_pings(scenario, [ping])
    if scenario.sonar.receiver.record == "elements":
        raise ValueError("sonar.receiver.record is elements, and labels are those of beams. Write record: beams.")
    simulator = build_simulator(scenario)
    compile_ahead(scenario_features(scenario, series=False, labels=True), threads)
    result = label_ping(simulator, ping, threads)
    dataset = label_dataset([result], simulator.label_names, simulator.grid.time, np.array([ping]))
    return dataset.isel(ping=0).assign_attrs(attributes(scenario))


def arrivals(scenario: Scenario, ping: int = 0, *, window: DelayInterval | None = None, channel: int = 0) -> Arrivals:
    """The paths of one ping, out and back, row by row.

    Args:
        scenario: The scenario.
        ping: Number of the ping.
        window: Earliest and latest delay to report [s], or with units such as ("200 ms", "201 ms"); by default all that
            touch the recording.
        channel: Number of the beam or element; paths are those of its side, and delays, amplitudes and Doppler factors
            those of this channel, on a moving platform as well.

    Raises:
        ValueError: The track has no such ping, the sonar no such channel, or the window lies beyond the recording.

    Example:
        >>> scenario = insonify.load_scenario("sidescan.yaml")  # 8 m above the seabed, 12 m below the surface
        >>> paths = insonify.arrivals(scenario.with_("paths.contributions", ["boundary echo"]))
        >>> paths.transmit_family.tolist(), (1e3 * paths.delay).round(1).tolist()  # ms
        (['S', 'B'], [16.0, 10.7])
    """
    selected_pings(scenario, [ping])
    require_index("channel", channel, scenario.sonar.channel_count, "sonar")
    if scenario.paths.engine == "tracer":
        raise ValueError(
            "paths.engine is tracer, and rays are energies, not paths. For arrivals write engine: eigenrays."
        )
    simulator = build_simulator(scenario)
    geometry = simulator.ping_geometry(ping, channel=channel)
    first, last = delay_interval(geometry, window)
    expected = scenario.field == "incoherent"
    jitter = replica_jitter(scenario.seed, ping, scenario.paths)
    is_near_field = not expected and not simulator.coherent_accumulator(geometry).uses_far_field
    beam, group = channel % scenario.sonar.beam_count, 0
    tables: list[Arrivals] = []
    for block in simulator.engine.blocks(geometry, quadrature=expected):
        points = block()
        if window is not None:
            points = points.take(in_delay_window(points, geometry, scenario.scene, scenario.paths, (first, last)))
        if not len(points):
            continue
        pairs = simulator.engine.pairs(geometry, partial(points.take, slice(None)), include_negligible=expected)
        factors = {} if jitter.is_zero else {
            ray: jitter.factor(pairs.scatterers.scatterer_id, *ray, pairs.scatterers.object) for ray in pairs.rays()
        }  # fmt: skip
        received = channel_arrivals(pairs, geometry, beam, scenario.water) if is_near_field else None
        paths = expand_arrivals(pairs, group, factors, received)
        tables.append(paths.take((paths.delay >= first) & (paths.delay <= last)))
        group += len(pairs.scatterers) if pairs.scatterers.has_random_phase else 1
    return concatenate_arrivals(tables)


def levels(
    scenario: Scenario, ping: int = 0, *, channel: int = 0, threads: int | None = None,
    scatterers_per_cell: float = math.inf,
) -> xr.Dataset:  # fmt: skip
    """Expected levels of one ping by contribution and by family pair.

    Args:
        scenario: The scenario.
        ping: Number of the ping.
        channel: Number of the beam or element; an element is at its array's centre, with its own pattern.
        threads: Number of threads; all cores by default.
        scatterers_per_cell: Largest number of points in a cell [1]: with 1.5, samples ripple by 0.35 dB rms.

    Returns:
        `level_db` over (contribution, pair, time) [dB re 1 uPa], see `insonify.synthesis.level_curves.level_curves`.

    Raises:
        ValueError: The track has no such ping, or the sonar no such channel.

    Example:
        >>> curves = insonify.levels(insonify.load_scenario("sidescan.yaml"), channel=1).level_db
        >>> echo = curves.sel(contribution="seabed", pair="D-D").sel(time=40e-3, method="nearest")
        >>> f"{echo:.0f} {echo.units} at 30 m"
        '103 dB re 1 uPa at 30 m'
    """
    selected_pings(scenario, [ping])
    require_index("channel", channel, scenario.sonar.channel_count, "sonar")
    simulator = build_simulator(scenario)
    compile_ahead(scenario_features(scenario, series=False, levels=True), threads)
    geometry = element_as_beam(simulator.ping_geometry(ping, channel=channel), channel % scenario.sonar.beam_count)
    with ThreadPoolExecutor(thread_count(threads)) as pool:
        mean, cap = simulator.expectation_accumulator(geometry), scatterers_per_cell
        curve_sum = TracedLevelAccumulator(mean) if isinstance(mean, TracedAccumulator) else LevelAccumulator(mean, cap)
        intensity = accumulate_ping(simulator, curve_sum, geometry, pool)
    row, noise = channel % scenario.sonar.beam_count % geometry.channel_count, float(simulator.noise.power[channel])
    curves = level_curves(intensity, noise, simulator.grid, row)
    return curves.assign_attrs(**attributes(scenario), ping=ping, channel=channel)
