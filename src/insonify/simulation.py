"""The wiring: describe, reach, scatter, hear, ping by ping."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import reduce
from importlib.metadata import version
from operator import iadd
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from insonify.engines.paths import Paths
from insonify.engines.view import Block
from insonify.formats import zarr_store
from insonify.propagation.medium import rays_in
from insonify.propagation.rays import FEW_DEPTHS, Domain
from insonify.records.arrivals import Arrivals, expand, joined
from insonify.records.pairs import Pairs
from insonify.records.recording import Layout, dataset
from insonify.scenario.citations import citations
from insonify.scenario.scenario import Scenario
from insonify.scenario.write import to_yaml
from insonify.sonar.heard import HeardPulse, heard_pulse
from insonify.sonar.stance import Stance, end_depths, stance
from insonify.sonar.track import Poses, poses
from insonify.synthesis._groups import pulse_table
from insonify.synthesis.coherent import Coherent
from insonify.synthesis.grid import TimeGrid, time_grid
from insonify.synthesis.incoherent import Incoherent
from insonify.synthesis.levels import Levels, level_curves
from insonify.synthesis.noise import noise, noise_intensity
from insonify.synthesis.perturbation import perturbation

CHUNKS = 16
"""Parts that a ping's blocks are shared into: fixed, so that sums do not depend on the number of threads."""


class Reading(Protocol):
    """How arrivals are heard: what it keeps while listening, and what it makes of it."""

    @property
    def even(self) -> bool:
        """Whether it wants points laid out evenly, or drawn scatterers."""

    def silence(self) -> Any:
        """Nothing heard yet."""

    def take_in(self, heard: Any, pairs: Pairs) -> None:
        """Add one block of scatterers."""

    def series(self, heard: Any) -> Any:
        """What was heard, over time."""


@dataclass(frozen=True)
class Listening:
    """A scenario made ready to ping: what does not change from ping to ping."""

    scenario: Scenario
    engine: Paths
    poses: Poses
    pulse: HeardPulse
    grid: TimeGrid

    def stance(self, ping: int) -> Stance:
        """The sonar as it stands at one ping."""
        track = self.scenario.track
        return stance(
            self.scenario.sonar, self.poses, ping, window=track.window, pulse=self.pulse,
            water=self.scenario.water,
        )  # fmt: skip

    def incoherent(self, here: Stance) -> Incoherent:
        """The incoherent reading of one ping."""
        scenario = self.scenario
        # A quarter more on each side: the pulse's ringing interferes too, though only a millionth of its energy.
        more = (self.pulse.stop - self.pulse.start) / 4
        table = pulse_table(self.pulse.samples, self.pulse.start - more, self.pulse.stop + more, self.grid.sample_rate)
        return Incoherent(here, self.grid, perturbation(scenario.seed, here.ping, scenario.paths), table)

    def coherent(self, here: Stance) -> Coherent:
        """The coherent reading of one ping."""
        return Coherent(here, self.grid, perturbation(self.scenario.seed, here.ping, self.scenario.paths))


def prepare(scenario: Scenario) -> Listening:
    """Make a scenario ready to ping."""
    pulse = heard_pulse(scenario.sonar)
    rate = scenario.sonar.receiver.sample_rate
    grid = time_grid(*scenario.track.window, rate, *pulse.ringing)
    track = poses(scenario.track)
    rays = rays_in(scenario.scene, domain(scenario, track, pulse))
    engine = Paths(scenario.scene, scenario.paths, scenario.seed, rays)
    return Listening(scenario, engine, track, pulse, grid)


def domain(scenario: Scenario, track: Poses, pulse: HeardPulse) -> Domain:
    """Where the pings of a scenario ask for rays.

    Args:
        scenario: What is simulated.
        track: Poses of the platform.
        pulse: The sonar's pulse as heard.
    """
    scene, stop = scenario.scene, scenario.track.window[1] - pulse.faint_start
    # Ends apart by this much can hear a little beyond half of the way.
    apart = 2 * max(float(np.linalg.norm(array.offset)) for array in scenario.sonar.arrays)
    farthest = scenario.water.fastest * max(stop, 0.0) / 2 + apart
    depths = [float(depth) for depth in end_depths(scenario.sonar, track)]
    spanned = len(depths) > FEW_DEPTHS
    return Domain((depths[0], depths[-1]) if spanned else tuple(depths), spanned, scene.body_depths, farthest)


def simulate(scenario: Scenario, *, pings: Iterable[int] | None = None, threads: int | None = None) -> xr.Dataset:
    """What the sonar records.

    Args:
        scenario: What is simulated.
        pings: Numbers of the pings wanted; all by default.
        threads: How many cores to use; all by default. The bits do not depend on it.

    Returns:
        `pressure` complex64 [uPa] (coherent) or `intensity` [uPa^2] (incoherent) over (ping, channel, time).
    """
    chosen = wanted_pings(scenario, pings)
    listening = prepare(scenario)
    data = np.array([series for _, series in listen(listening, chosen, threads)])
    return dataset(layout(listening), attributes(scenario), data, np.array(chosen))


def record(
    scenario: Scenario, path: str | Path, *, pings: Iterable[int] | None = None, threads: int | None = None,
    overwrite: bool = False, on_ping: Callable[[int, int], None] | None = None,
) -> Path:  # fmt: skip
    """Simulate to disk, ping by ping; a run that was stopped goes on where it was.

    Args:
        scenario: What is simulated.
        path: Folder of the recording.
        pings: Numbers of the pings wanted; all by default.
        threads: How many cores to use.
        overwrite: Whether to replace another recording that is there.
        on_ping: Told the pings done and the pings wanted, before the first and after each.

    Returns:
        The path.
    """
    wanted = wanted_pings(scenario, pings)
    listening = prepare(scenario)
    zarr_store.create(path, layout(listening), attributes(scenario), overwrite=overwrite)
    mine, there = zarr_store.identity(path), zarr_store.done(path)
    missing = [ping for ping in wanted if not there[ping]]
    done = len(wanted) - len(missing)
    tell = on_ping or (lambda *_: None)
    tell(done, len(wanted))
    for ping, series in listen(listening, missing, threads):
        zarr_store.write_ping(path, ping, series, into=mine)
        done += 1
        tell(done, len(wanted))
    return Path(path)


def listen(
    listening: Listening, pings: Iterable[int], threads: int | None = None
) -> Iterator[tuple[int, NDArray[np.generic]]]:
    """What the sonar hears, ping by ping: number of the ping, and its series of shape (channels, samples)."""
    scenario, count = listening.scenario, listening.grid.count
    level = scenario.water.noise_level_db
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        for ping in pings:
            here = listening.stance(ping)
            if scenario.field == "coherent":
                sound = hear(listening, listening.coherent(here), here, pool)
                yield ping, sound + noise(listening.pulse, level, scenario.seed, ping, here.channel_count, count)
            else:
                intensity = hear(listening, listening.incoherent(here), here, pool)
                yield ping, intensity + noise_intensity(listening.pulse, level)


def hear(listening: Listening, reading: Reading, here: Stance, pool: ThreadPoolExecutor) -> Any:
    """One ping, heard by one reading: blocks are shared into a fixed number of parts, added in a fixed order."""
    blocks = listening.engine.blocks(here, even=reading.even)

    def part(mine: list[Block]) -> Any:
        heard = reading.silence()
        for block in mine:
            reading.take_in(heard, listening.engine.pairs(here, block))
        return heard

    parts = [blocks[k::CHUNKS] for k in range(CHUNKS)]
    return reading.series(reduce(iadd, pool.map(part, parts)))


def arrivals(scenario: Scenario, ping: int = 0, *, window: tuple[float, float] | None = None) -> Arrivals:
    """The paths of one ping, out and back, row by row.

    Args:
        scenario: What is simulated.
        ping: Number of the ping.
        window: Earliest and latest delay wanted [s]; by default all that touch the recording.

    Raises:
        ValueError: The track has no such ping.
    """
    wanted_pings(scenario, [ping])
    listening = prepare(scenario)
    here = listening.stance(ping)
    first, last = window or here.heard_delays
    shaken = perturbation(scenario.seed, ping, scenario.paths)
    found: list[Arrivals] = []
    group = 0
    for pairs in listening.engine.all_pairs(here, even=scenario.field == "incoherent"):
        factors = {} if shaken.still else {
            names: shaken.factor(pairs.scatterers.place, *names) for names in pairs.rays()
        }  # fmt: skip
        block = expand(pairs, group, factors)
        found.append(block.take((block.delay >= first) & (block.delay <= last)))
        group += len(pairs.scatterers) if pairs.scatterers.drawn else 1
    return joined(found)


def levels(scenario: Scenario, ping: int = 0, *, channel: int = 0, threads: int | None = None) -> xr.Dataset:
    """Expected levels of one ping by cause and by family pair.

    Args:
        scenario: What is simulated.
        ping: Number of the ping.
        channel: Which beam.
        threads: How many cores to use.

    Returns:
        `level_db` over (cause, pair, time) [dB re 1 uPa], see `insonify.synthesis.levels.level_curves`.

    Raises:
        ValueError: The track has no such ping, or the sonar no such channel.
    """
    wanted_pings(scenario, [ping])
    if not 0 <= channel < scenario.sonar.channel_count:
        raise ValueError(f"channel is {channel}; the sonar has channels 0 to {scenario.sonar.channel_count - 1}")
    listening = prepare(scenario)
    here = listening.stance(ping)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        intensity = hear(listening, Levels(listening.incoherent(here)), here, pool)
    floor = noise_intensity(listening.pulse, scenario.water.noise_level_db)
    curves = level_curves(intensity, floor, listening.grid, channel)
    return curves.assign_attrs(**attributes(scenario), ping=ping, channel=channel)


def wanted_pings(scenario: Scenario, pings: Iterable[int] | None) -> list[int]:
    """The pings asked for, all by default.

    Raises:
        ValueError: The track has no such ping.
    """
    if not isinstance(scenario, Scenario):
        raise TypeError(f"a Scenario is wanted, not a {type(scenario).__name__}; load one with insonify.load_scenario")
    count = scenario.track.pings
    chosen = list(range(count)) if pings is None else [int(ping) for ping in pings]
    for ping in chosen:
        if not 0 <= ping < count:
            raise ValueError(f"ping is {ping}; the track has pings 0 to {count - 1}")
    return chosen


def layout(listening: Listening) -> Layout:
    """What a recording of this scenario holds, but for the sound."""
    track = listening.poses
    return Layout(
        field="pressure" if listening.scenario.field == "coherent" else "intensity",
        time=listening.grid.time,
        ping_time=track.time,
        steer=np.array(listening.scenario.sonar.steers),
        position=track.position,
        attitude=np.stack([track.heading, track.pitch, track.roll], axis=-1),
    )


def attributes(scenario: Scenario) -> dict[str, Any]:
    """What describes a recording as a whole: the scenario itself, and what it rests on."""
    return {
        "title": scenario.title,
        "scenario": to_yaml(scenario),
        "seed": scenario.seed,
        "version": version("insonify"),
        "centre_frequency": scenario.sonar.pulse.frequency,
        "centre_frequency_units": "Hz",
        "citations": citations(scenario),
    }
