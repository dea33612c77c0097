"""The seabed of one ping in a few big strokes: the quick way to an expected intensity.

`engines.paths` answers any question about any block of scatterers; an expectation over a whole seabed asks the same
few of every point. Here lines of the ground are walked once each (`_swath_kernel`), and all that is drawn or tabled is
kept for the next ping. What it holds for is asked by `swath_of`; everything else is left to the general engine.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from threading import local
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _swath_kernel as kernel
from insonify.engines.lines import lines_in_view
from insonify.engines.sampling import beam_bound, reach
from insonify.engines.skyline import fresnel_half_length
from insonify.engines.view import view
from insonify.ocean.water import Water
from insonify.propagation.choice import PathChoice
from insonify.propagation.families import bounces, families_for, image_depth
from insonify.propagation.images import StraightRays
from insonify.propagation.knife_edge import soft_edges
from insonify.propagation.rays import Rays
from insonify.records.legs import Status
from insonify.records.swath import Swath
from insonify.scattering.fast import FastLaw, compiled
from insonify.scattering.lambert import Lambert
from insonify.scene.bed import Bed
from insonify.scene.ground_map import AROUND, MOST_PIECES, ground_map, unmapped
from insonify.scene.scatterers import Law, Scatterers
from insonify.scene.scene import Scene
from insonify.scene.solid import world_triangles
from insonify.sonar.stance import Stance
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]
Mapped = Callable[[Callable[[Any], Any], Iterable[Any]], Iterable[Any]]

PARTS = 2
"""Parts that the lines of a ping are shared into: fixed, so that sums do not depend on the number of threads."""
MIRROR_NODES = 2049
"""Sines of the grazing angle at which the bounces of a family are tabled."""
GROUP = 8192
"""Questions asked of a law in one go."""
RIPPLES = 6.0
"""Fresnel number beside a target up to which its soft edge is looked at: what is left ripples by less than 0.04 [1]."""
LONGEST_STEP = 0.5
"""Longest step along a line over a flat bed [m]."""


class _Scratch(local):
    """Columns that every thread uses again: new memory would cost more than what is written there."""

    def __init__(self) -> None:
        self._held: dict[str, NDArray[Any]] = {}

    def of(self, name: str, shape: tuple[int, ...], kind: Any) -> NDArray[Any]:
        """A column, with whatever was written there before."""
        size = int(np.prod(shape))
        if name not in self._held or self._held[name].size < size:
            self._held[name] = np.empty(size + size // 4, kind)
        return self._held[name][:size].reshape(shape)


_SCRATCH = _Scratch()


@dataclass(frozen=True)
class SwathView:
    """What the quick way knows of one ping before it walks."""

    scene: Scene
    choice: PathChoice
    stance: Stance
    families: tuple[str, ...]
    law: FastLaw
    lines: Floats
    step: float
    crossed: NDArray[np.int64]
    """Numbers of the pieces of the ground's map that the lines cross, (n, 2)."""

    @property
    def rest(self) -> PathChoice:
        """The same paths for all that is not the seabed, without targets that no beam comes near."""
        causes = [cause for cause in self.choice.causes if cause != "seabed"]
        if "target" in causes and not self._near_a_target():
            causes.remove("target")
        return (
            self.choice.model_copy(update={"causes": tuple(causes)})
            if causes != list(self.choice.causes)
            else self.choice
        )

    def _near_a_target(self) -> bool:
        """Whether any beam is above the floor towards any target; points are always heard."""
        scene = self.scene
        if len(scene.targets) > len(scene.occluders):
            return True
        if not scene.occluders:
            return False
        rims = np.array(_rims(scene)).reshape(-1, 3)
        top, base = _depths(scene)
        floor = float(amplitude_ratio(self.choice.beam_floor_db))
        bound = beam_bound(
            rims[:, :2], rims[:, 2], self.stance, (top + base) / 2, StraightRays(scene), self.choice.followed,
            rise=(base - top) / 2,
        )  # fmt: skip
        return bool((bound >= floor).any())

    def gather(self, share: Mapped, hear: Callable[[Swath], Any]) -> list[Any]:
        """All the ground heard, in a fixed number of parts.

        Args:
            share: Calls a function with each of some things, as `map` does, perhaps on several threads.
            hear: What is done with each part; its columns are written over afterwards.

        Returns:
            What hearing each part came to.
        """
        bed, here = self.scene.seabed.bed, self.stance.transmit_place[:2]
        if bed is None:
            place, (pieces, slot) = (float(here[0]), float(here[1])), unmapped()
            return list(share(lambda part: hear(self._walk(part, place, 0.0, pieces, slot, 1.0)), self._parts()))
        kept, lattice = ground_map(bed), bed.ground.terrain.lattice
        along, across = (float(x) for x in lattice.from_world(here))
        with kept.reading(self.crossed, share):

            def walked(part: Floats) -> Any:
                return hear(self._walk(part, (along, across), lattice.heading, kept.pieces, kept.slot, kept.cell))

            return list(share(walked, self._parts()))

    def _parts(self) -> list[Floats]:
        return [np.ascontiguousarray(self.lines[k::PARTS]) for k in range(PARTS)]

    def _walk(
        self, lines: Floats, start: tuple[float, float], heading: float, pieces: NDArray[np.float32],
        slot: NDArray[np.int64], cell: float,
    ) -> Swath:  # fmt: skip
        """The points of some lines, with the strength of each pair of legs."""
        seabed, stance = self.scene.seabed, self.stance
        speed, source = self.scene.water.sound_speed, float(stance.transmit_place[2])
        f, most = len(self.families), int(np.maximum(lines[:, 5] - lines[:, 4], 0).sum() / self.step) + 2 * len(lines)
        delay = _SCRATCH.of("delay", (f, most), np.float64)
        amplitude = _SCRATCH.of("amplitude", (f, most), np.complex64)
        departure = _SCRATCH.of("departure", (f, 3, most), np.float32)
        arrival = _SCRATCH.of("arrival", (f, 3, most), np.float32)
        normal, area = _SCRATCH.of("normal", (3, most), np.float32), _SCRATCH.of("area", (most,), np.float32)
        letters, prefix, ways = _ways(self.families)
        images = np.array([image_depth(name, source, seabed.depth) for name in self.families])
        way_images = np.array([image_depth(name, source, seabed.depth) for name in ways])
        loss = _absorption(self.scene.water, stance.frequency) / 20 * np.log2(10)
        n = kernel.walk(
            *start, heading, source, seabed.depth, speed, stance.wavelength, lines, self.step, cell, slot, pieces,
            seabed.bed is None, images, letters, prefix, way_images, np.array([way.endswith("B") for way in ways]),
            self._mirrors(source), loss, delay, amplitude, departure,
            arrival, normal, area,
        )  # fmt: skip
        delay, amplitude, departure = delay[:, :n], amplitude[:, :n], departure[:, :, :n]
        into, up = arrival[:, :, :n], normal[:, :n]
        if self._behind_targets(lines, heading):
            self._shade(delay, into, up, images, amplitude)
        pair = np.array([(i, j) for i in range(f) for j in range(i, f)], np.int64)
        section = _SCRATCH.of("section", (len(pair), most), np.float32)[:, :n]
        for begin in range(0, n, GROUP):
            part = slice(begin, min(begin + GROUP, n))
            facing = up[:, part].copy()
            comes = [into[i, :, part].copy() for i in range(f)]
            for row, (i, j) in enumerate(pair):
                self.law.fill(comes[i], -comes[j], facing, section[row, part])
        section *= area[:n]
        return Swath(delay, amplitude, departure, pair, section)

    def _behind_targets(self, lines: Floats, heading: float) -> bool:
        """Whether any line passes a target."""
        bearing, place = np.arctan2(lines[:, 1], lines[:, 0]) + heading, self.stance.transmit_place
        for north, east, radius in _rims(self.scene):
            apart, towards = np.hypot(north - place[0], east - place[1]), np.arctan2(east - place[1], north - place[0])
            off = np.abs(np.mod(bearing - towards + np.pi, 2 * np.pi) - np.pi)
            if apart <= radius or bool((off <= np.arcsin(radius / apart) + self._rippled(apart)).any()):
                return True
        return False

    def _shade(
        self, delay: Floats, arrival: NDArray[np.float32], normal: NDArray[np.float32], images: Floats,
        amplitude: NDArray[np.complex64],
    ) -> None:  # fmt: skip
        """Take away what targets cut of the legs; edges of the ground are hard here."""
        scene, place = self.scene, self.stance.transmit_place
        if not delay.size:
            return
        length = delay[0] * scene.water.sound_speed
        offset = arrival[0] * length
        behind = np.zeros(delay.shape[1], bool)
        reach, bearing = np.hypot(offset[0], offset[1]), np.arctan2(offset[1], offset[0])
        for north, east, radius in _rims(scene):
            apart, towards = np.hypot(north - place[0], east - place[1]), np.arctan2(east - place[1], north - place[0])
            off = np.abs(np.mod(bearing - towards + np.pi, 2 * np.pi) - np.pi)
            half = np.arcsin(min(1.0, radius / max(apart, 1e-9))) + self._rippled(apart)
            behind |= (reach > apart - radius) & ((off <= half) | (apart <= radius))
        if not behind.any():
            return
        points = np.ascontiguousarray(place[:, None] + offset[:, behind]).T
        points[:, 2] = images[0] + offset[2, behind]
        count = int(behind.sum())
        hidden = Scatterers(
            "seabed", "seabed", self.law, np.ascontiguousarray(points),
            np.ascontiguousarray(normal[:, behind].T, float), np.ones(count), np.ones(count, complex),
            np.zeros(count, np.uint64),
        )  # fmt: skip
        legs = StraightRays(scene).legs(place, hidden, self.families, self.stance.frequency)
        left = legs.visibility
        if self.choice.edges == "fresnel":
            there = legs.status != Status.FACING_AWAY
            whole = replace(legs, visibility=there.astype(float))
            left = there * soft_edges(whole, hidden, place, scene, self.stance.wavelength).visibility
        amplitude[:, behind] *= left

    def _rippled(self, apart: float) -> float:
        """Bearing beside a target's rim up to which its soft edge is looked at [rad]."""
        if self.choice.edges == "hard":
            return 0.0
        return RIPPLES * float(np.sqrt(self.stance.wavelength / (2 * max(apart, self.stance.wavelength))))

    def _mirrors(self, source: float) -> NDArray[np.complex64]:
        bed = self.scene.seabed.bed
        return _mirror_table(self.scene, self.families, round(source, 2), self.stance.wavelength, bed is not None)


def swath_of(scene: Scene, choice: PathChoice, stance: Stance, rays: Rays) -> SwathView | None:
    """The quick way for one ping, or None where the scene asks more than it can do.

    It takes water of one sound speed, a three-dimensional scene, both ends of the sonar at one place, one beam to a
    side, a sea surface that only mirrors, and ground that lies below the sonar.

    Args:
        scene: The scene.
        choice: Which paths are followed.
        stance: The sonar at this ping.
        rays: How sound travels in the scene.
    """
    seabed, bed = scene.seabed, scene.seabed.bed
    law = _quick(seabed.law(stance.frequency, float(scene.water.speed_at(seabed.depth))))
    families = families_for("seabed", choice.followed)
    moving = scene.surface.bounce != "mirror" and any("S" in name for name in families)
    if not isinstance(rays, StraightRays) or choice.geometry != "3d" or "seabed" not in choice.causes or moving:
        return None
    if not stance.together or stance.channel_count != 1 or law is None or not families:
        return None
    source, rise = float(stance.transmit_place[2]), 0.0
    if bed is not None:
        if bed.span[0] <= source:
            return None
        rise = max(bed.depth - bed.span[0], bed.span[1] - bed.depth)
    heard = reach(stance, seabed.depth, rays, families, rise=rise)
    sampling = view(scene, choice, 0, stance, rays, even=True).resolution
    step = min(sampling.slant, LONGEST_STEP)
    if bed is not None:
        step = bed.map_cell / int(np.ceil(bed.map_cell / sampling.slant))
        if 2 * heard.farthest / (bed.map_cell * kernel.CELLS) > AROUND - 4:
            return None
    floor = float(amplitude_ratio(choice.beam_floor_db))
    heading = 0.0 if bed is None else bed.ground.terrain.lattice.heading
    lines = lines_in_view(stance, seabed.depth, heard, sampling, families, floor, heading)
    crossed = np.empty((0, 2), np.int64) if bed is None else _crossed(bed, stance, lines, step)
    if len(crossed) > MOST_PIECES:
        return None
    return SwathView(scene, choice, stance, families, law, lines, step, crossed)


def _crossed(bed: Bed, stance: Stance, lines: Floats, step: float) -> NDArray[np.int64]:
    """Numbers of the pieces of a map that some lines cross, (n, 2); more than there is room for if there are more."""
    along, across = (float(x) for x in bed.ground.terrain.lattice.from_world(stance.transmit_place[:2]))
    mark, found = np.zeros((AROUND, AROUND), np.int8), np.empty((MOST_PIECES + 1, 2), np.int64)
    return found[: kernel.pieces_on_lines(along, across, lines, step, bed.map_cell, mark, found)]


@lru_cache(maxsize=16)
def _absorption(water: Water, frequency: float) -> float:
    """Of the water [dB/m]: every ping asks for it."""
    return float(water.absorption(frequency))


@lru_cache(maxsize=16)
def _fast(law: Lambert) -> FastLaw:
    return compiled(law)


def _quick(law: Law | None) -> FastLaw | None:
    """A law as the quick way asks it; None where it has no such form."""
    if isinstance(law, Lambert):
        return _fast(law)
    return law if isinstance(law, FastLaw) else None


@lru_cache(maxsize=16)
def _ways(families: tuple[str, ...]) -> tuple[NDArray[np.int64], NDArray[np.int64], tuple[str, ...]]:
    """Letters of each family as numbers, the row of what has been passed up to each segment, and these rows' names."""
    strings = [bounces(name) for name in families]
    longest = max(1, *(len(string) for string in strings))
    letters = np.zeros((len(families), longest), np.int64)
    prefix = np.zeros((len(families), longest + 1), np.int64)
    ways: list[str] = []
    for f, string in enumerate(strings):
        letters[f, : len(string)] = [1 + (letter == "B") for letter in string]
        for k in range(len(string) + 1):
            if k == 0 and string.startswith("S"):
                continue  # on its way up it meets no ground
            name = string[:k] or "D"
            if name not in ways:
                ways.append(name)
            prefix[f, k] = ways.index(name)
    return letters, prefix, tuple(ways)


@lru_cache(maxsize=32)
def _mirror_table(
    scene: Scene, families: tuple[str, ...], source: float, wavelength: float, rough: bool
) -> NDArray[np.complex64]:
    """All bounces of each family over evenly spaced sines, on ground at the mean depth, (f, nodes)."""
    sine = np.linspace(0, 1, MIRROR_NODES)
    grazing, depth, bed = np.arcsin(sine), scene.seabed.depth, scene.seabed.bed
    tangent = np.maximum(sine, 1e-6) / np.sqrt(np.maximum(1 - sine**2, 1e-12))
    table = np.ones((len(families), MIRROR_NODES), np.complex128)
    for row, string in enumerate(map(bounces, families)):
        distance = np.abs(depth - image_depth(families[row], source, depth)) / tangent
        first = depth - source if string.startswith("B") else source
        for k, letter in enumerate(string):
            if letter == "S":
                table[row] *= scene.surface.mirror(grazing)
                continue
            table[row] *= scene.seabed.mirror(grazing)
            if rough and bed is not None:
                half = fresnel_half_length((first + k * depth) / tangent, distance, tangent, wavelength)
                zone = np.maximum(2 * half * np.sqrt(np.maximum(sine, 1e-6)), 1e-6)
                table[row] *= bed.smoothness(sine, wavelength, np.asarray(zone, float))
    return table.astype(np.complex64)


@lru_cache(maxsize=8)
def _depths(scene: Scene) -> tuple[float, float]:
    """Depths of the highest top and of the deepest base of all targets that cast shadows [m]."""
    surfaces = [world_triangles(solid, scene.seabed) for solid in scene.solids]
    tops = [*scene.bodies[:, 6], *(float(surface.low[2]) for surface in surfaces)]
    bases = [*scene.bodies[:, 7], *(float(surface.high[2]) for surface in surfaces)]
    return float(min(tops)), float(max(bases))


@lru_cache(maxsize=8)
def _rims(scene: Scene) -> tuple[tuple[float, float, float], ...]:
    """Middle, north and east, and radius of an upright cylinder about each target that casts a shadow [m]."""
    found = []
    for box in scene.bodies:
        found.append((float(box[0]), float(box[1]), float(np.hypot(box[4], box[5]))))
    for solid in scene.solids:
        surface = world_triangles(solid, scene.seabed)
        low, high = np.asarray(surface.low)[:2], np.asarray(surface.high)[:2]
        middle = (low + high) / 2
        found.append((float(middle[0]), float(middle[1]), float(np.linalg.norm(high - low)) / 2))
    return tuple(found)
