"""What a simulation will cost, before it is begun: scatterers, time, memory, disk.

Nothing is drawn. Targets are counted by the area of their faces, at a few pings, where beams and window may hear
them, without the flashes of smooth ones; faces that look away are reached but send nothing back.
The ground in reach is walked in rings and sectors; where the beams hear anything, the density of scatterers that the
sampling asks for is added up. Good to a factor of two, which tells seconds from days.
"""

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.engines.glint_spread import glint_spread
from insonify.engines.loudness import Loudness
from insonify.engines.sampling import Resolution, beam_bound, reach, tiles_in_view, widest_way
from insonify.engines.targets import target_count
from insonify.engines.view import view
from insonify.engines.volume import TOO_MANY, Suspended
from insonify.propagation.families import families_for
from insonify.propagation.images import StraightRays
from insonify.propagation.rays import Rays
from insonify.scenario.scenario import Scenario
from insonify.scene.lattice import BASE_PITCH, FINEST_LEVEL, TILE
from insonify.scene.scatterers import Boundary
from insonify.simulation import Listening, parts_of, prepare
from insonify.sonar.stance import Stance
from insonify.synthesis.grid import OVERSAMPLING
from insonify.synthesis.shapes import shapes_of
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]

RINGS, SECTORS = 48, 360
"""How finely the ground is walked [1]."""
TARGET_PINGS = 9
"""Pings at which targets are looked at [1]."""
SECONDS_PER_LEG, SECONDS_PER_PAIR = 0.06e-6, 0.06e-6
"""One core's time for one leg, and for one pair in one channel [s]: a plain x86 core of the 2020s."""
SECONDS_PER_CELL = 8e-9, 3.5e-9
"""One core's time for a cell of a series and each doubling of their number, coherent and incoherent [s]."""
SECONDS_PER_ELEMENT, SECONDS_PER_SHAPE = 6.5e-9, 3e-9
"""One core's time for one echo at one element of an array, and for each shape beyond the first [s]."""
SECONDS_PER_GROUND = 0.36e-6
"""One core's time for the height and slope of one kind of relief at one place [s]."""
SECONDS_PER_SWATH, SECONDS_PER_STEP, SECONDS_PER_STEP_LEG = 1e-3, 45e-9, 18e-9
"""One core's time for the ground by the quick way: for any, for each step along a line, for each leg to it [s]."""
SECONDS_PER_FIT, SECONDS_PER_GLINT = 2.2e-6, 1.7e-6
"""One core's time for one leg off the planes of its own bounces, over relief, and for the glints of one [s]."""
SECONDS_PER_BEND = 0.5e-6
"""One core's time more for one leg of bent rays [s]."""
BYTES_PER_TILE = 2500
"""What a tile of the ground takes while the tiles of a ping are looked for, and as a block in waiting."""
BYTES_OF_PROGRAM = 350e6
"""What Python takes with the libraries and kernels of a run, before the run takes anything."""
SHARE = 0.8
"""Part of the machine's memory that a run may want [1]."""


@dataclass(frozen=True, slots=True)
class Cost:
    """What a run of all pings takes, about."""

    pings: int
    scatterers: float
    """In one ping, all sides [1]."""
    seconds: float
    """Of one core, all pings [s]."""
    memory: float
    """At most at any time [bytes]."""
    disk: float
    """Of the recording before compression [bytes]."""

    def words(self) -> str:
        """The cost in one line."""
        each = " each" if self.pings > 1 else ""
        plural = "s" * (self.pings != 1)
        return (
            f"{self.pings} ping{plural}, about {_rounded(self.scatterers)} scatterers{each}: about "
            f"{_duration(self.seconds)} of one core, {_size(self.memory)} of memory, {_size(self.disk)} on disk"
        )


def cost(scenario: Scenario) -> Cost:
    """What a scenario will cost.

    Args:
        scenario: The scenario.

    Returns:
        The cost of all its pings, judged by the first of them, and for targets by a few.
    """
    listening = prepare(scenario)
    sides = listening.stances(0)
    found = [_scatterers(listening, side) for side in sides] + [(*_on_targets(listening), 0.0)]
    points, work, tiles = (sum(column) for column in zip(*found, strict=True))
    grid, beams = listening.grid, scenario.sonar.beam_count
    wide = 2 * OVERSAMPLING * grid.padded * 8 + grid.count * 8  # of either reading, one channel
    shapes = max(_shapes(side) for side in sides)
    held = beams * wide * shapes
    memory = BYTES_OF_PROGRAM + (parts_of(int(held)) + 6 / shapes) * held + BYTES_PER_TILE * tiles / len(sides)
    memory += scenario.track.ping_count * 8 * 30 + scenario.sonar.channel_count * grid.count * 16
    count = scenario.track.ping_count
    transform = SECONDS_PER_CELL[scenario.field == "incoherent"] * grid.padded * np.log2(grid.padded) * (1 + shapes) / 2
    return Cost(
        pings=count,
        scatterers=points,
        seconds=float(count * (work + transform * scenario.sonar.channel_count)),
        memory=float(memory),
        disk=float(count * scenario.sonar.channel_count * grid.count * 8),
    )


def too_big(cost: Cost, memory: float | None = None) -> str:
    """Why a run cannot be done on this machine and what to change; empty where it can.

    Args:
        cost: Of the run.
        memory: Of the machine [bytes]; None: it is asked.
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


def _scatterers(listening: Listening, stance: Stance) -> tuple[float, float, float]:
    """Scatterers of boundaries and water on one side, a core's time for them [s], and tiles of the boundaries."""
    scenario = listening.scenario
    if scenario.paths.geometry == "slice":
        return 0.0, 0.0, 0.0
    seen = view(scenario.scene, scenario.paths, scenario.seed, stance, listening.engine.rays)
    depth, beams, total, seconds, tiles = scenario.seabed.depth, scenario.sonar.beam_count, 0.0, 0.0, 0.0
    each = _pair_seconds(stance, beams)
    laws = {"seabed": scenario.seabed.scattering, "surface": scenario.surface.scattering}
    found: list[tuple[Boundary, float]] = [("seabed", depth), ("surface", 0.0)]
    for boundary, level in found:
        kept = families_for(boundary, scenario.paths.followed)
        if boundary not in scenario.paths.causes or laws[boundary] is None or not kept:
            continue
        if boundary == "seabed" and (steps := _quick_steps(listening, stance)) is not None:
            total += steps
            seconds += SECONDS_PER_SWATH + steps * (SECONDS_PER_STEP + len(kept) * SECONDS_PER_STEP_LEG)
            continue
        rise = seen.rise(boundary)
        points, place, more = _on_boundary(stance, level, listening.engine.rays, kept, seen.resolution, scenario, rise)
        count = float(points.sum())
        total, tiles = total + count, tiles + more
        legs, pairs = _met(listening, stance, boundary, kept, points, place)
        seconds += legs + pairs * each
        seconds += count * SECONDS_PER_GROUND * (len(scenario.seabed.relief) if boundary == "seabed" else 0)
    if "water" in scenario.paths.causes and scenario.water.scatters:
        suspended = Suspended(scenario.scene, scenario.paths, scenario.seed, stance, seen.resolution)
        count, kept = suspended.count(even=scenario.field == "incoherent"), scenario.paths.followed
        total += count
        seconds += count * (sum(_legs(listening, stance, name) for name in kept) + len(kept) ** 2 * each)
        seconds += count * SECONDS_PER_GROUND * len(scenario.seabed.relief)
    return total, seconds, tiles


def _met(
    listening: Listening, stance: Stance, boundary: Boundary, kept: tuple[str, ...], points: Floats, place: Floats
) -> tuple[float, float]:
    """A core's time for the legs to some scatterers at some distances [s], and the pairs that are met there."""
    drawn = boundary == "seabed" and listening.scenario.field == "coherent"
    known = listening.engine.met(stance, place) if drawn else None
    if known is None:
        count = float(points.sum())
        return count * sum(_legs(listening, stance, name) for name in kept), count * len(kept) ** 2
    families, share = known
    followed, fitted = ((points * part).sum(axis=1) for part in ((share > 0).any(axis=1), share.max(axis=1)))
    seconds = sum(
        _legs(listening, stance, name, fitted=float(part)) * float(count)
        for name, count, part in zip(families, followed, fitted / np.maximum(followed, 1e-300), strict=True)
    )
    return seconds, float((points * share).sum())


def _legs(listening: Listening, stance: Stance, family: str, *, fitted: float = 1.0) -> float:
    """A core's time for the legs of one family to a scatterer from all ends [s], a part of them off fitted planes."""
    scenario = listening.scenario
    each = SECONDS_PER_LEG
    if not isinstance(listening.engine.rays, StraightRays):
        each += SECONDS_PER_BEND
    if scenario.seabed.relief and "B" in family:
        each += SECONDS_PER_FIT * fitted
    if scenario.field == "coherent" and scenario.surface.bounce != "mirror" and "S" in family:
        each += SECONDS_PER_GLINT
    return each * (1 if stance.together else 2)


def _on_targets(listening: Listening) -> tuple[float, float]:
    """Points on targets in one ping, all sides, and a core's time for them [s]: means of a few pings."""
    scenario = listening.scenario
    if "target" not in scenario.paths.causes or not scenario.targets or scenario.paths.geometry == "slice":
        return 0.0, 0.0
    kept, scene, total, seconds = scenario.paths.followed, scenario.scene, 0.0, 0.0
    pings = np.unique(np.linspace(0, scenario.track.ping_count - 1, TARGET_PINGS).round().astype(int)).tolist()
    for stance in (side for ping in pings for side in listening.stances(ping)):
        seen = view(scene, scenario.paths, scenario.seed, stance, listening.engine.rays)
        drawn = seen.resolution if scenario.field == "coherent" else None
        asked, facing = target_count(scene, scenario.paths, stance, seen.resolution.slant, listening.engine.rays, drawn)
        total += asked
        seconds += asked * sum(_legs(listening, stance, name) for name in kept)
        seconds += facing * len(kept) ** 2 * _pair_seconds(stance, scenario.sonar.beam_count)
    return total / len(pings), seconds / len(pings)


def _quick_steps(listening: Listening, stance: Stance) -> float | None:
    """Steps along the lines of the ground by which one side is heard the quick way; None where it is not."""
    if listening.scenario.field == "coherent" or not listening.incoherent(stance).brief:
        return None
    ground = listening.ground(stance)
    return None if ground is None else float(ground.plan.steps)


def _shapes(stance: Stance) -> int:
    """Waveforms that each channel's sound is a sum of."""
    made = shapes_of(stance)
    return len(made.band) * len(made.doppler)


def _pair_seconds(stance: Stance, beams: int) -> float:
    """One core's time for one pair of legs in all channels of one side [s]."""
    if stance.still and stance.elements is None and not stance.bands:
        return SECONDS_PER_PAIR * beams
    return SECONDS_PER_PAIR + (SECONDS_PER_ELEMENT + SECONDS_PER_SHAPE * (_shapes(stance) - 1)) * beams


def _on_boundary(
    stance: Stance, level: float, rays: Rays, families: tuple[str, ...], resolution: Resolution,
    scenario: Scenario, rise: float,
) -> tuple[Floats, Floats, float]:  # fmt: skip
    """Scatterers at some distances [m], and tiles, in reach of window and beams: of a boundary so far [m] off level."""
    floor = float(amplitude_ratio(scenario.paths.beam_floor_db))
    glints = glint_spread(scenario.scene, stance.frequency)
    if stance.receive_survey is not None:  # no rings about two places: its tiles are counted
        widest = widest_way(stance, scenario.water.fastest)
        found, density = tiles_in_view(
            stance, scenario.seabed.lattice, level, rays, families, resolution, floor, rise=rise, widest=widest,
            glints=glints,
        )  # fmt: skip
        return density * TILE**2, np.zeros(len(density)), float(len(found.level))
    heard = reach(stance, level, rays, families, rise=rise)
    if heard.farthest <= heard.nearest:
        return np.zeros(1), np.zeros(1), 0.0
    far = np.array([heard.farthest])
    margin = _tile(resolution, far, heard.height, scenario)[0] / 2  # ground comes in whole tiles
    outer = heard.farthest + margin
    edges = np.geomspace(max(heard.nearest - margin, outer * 1e-3), outer, RINGS + 1)
    middle = np.sqrt(edges[:-1] * edges[1:])
    tile = _tile(resolution, middle, heard.height, scenario)
    azimuth = (np.arange(SECTORS) + 0.5) * 2 * np.pi / SECTORS
    place = np.stack(np.broadcast_arrays(middle[:, None] * np.cos(azimuth), middle[:, None] * np.sin(azimuth)), -1)
    half = np.hypot(np.diff(edges), middle * 2 * np.pi / SECTORS) / 2 + tile / 2
    bound = beam_bound(
        place.reshape(-1, 2) + stance.transmit_place[:2], np.repeat(half, SECTORS), stance, level, rays, families,
        rise=rise, glints=glints,
    )  # fmt: skip
    loud = (bound >= floor).reshape(RINGS, SECTORS)
    ground = np.pi * np.diff(edges**2)
    tiles = ground * loud.mean(axis=1) / tile**2
    if scenario.field == "incoherent":
        return tiles * TILE**2, middle, float(tiles.sum())
    loudness = Loudness(
        stance, level, rays, families, scenario.seabed.lattice, outer, scenario.paths.thinning, glints
    )  # fmt: skip
    kept = ground * loudness.mean_share(middle) * loud.any(axis=1) / resolution.cell_area(middle, heard.height)
    return kept, middle, float(tiles.sum())


def _tile(resolution: Resolution, distance: Floats, height: float, scenario: Scenario) -> Floats:
    """Side of the tiles that the sampling wants at some distances [m], shape (n,)."""
    pitch = np.sqrt(resolution.cell_area(distance, height))
    if scenario.field == "coherent":  # the lattice's cells come in powers of two
        pitch = BASE_PITCH * 2.0 ** np.maximum(np.floor(np.log2(pitch / BASE_PITCH)), FINEST_LEVEL)
    return np.asarray(TILE * pitch)


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
