"""The seabed of one ping in a few big strokes: the quick way to an expected intensity.

`engines.paths` answers any question about any block of scatterers; an expectation over a whole seabed asks the same
few of every point. Here lines of the ground are walked once each (`_swath_kernel`), and all that is drawn or tabled is
kept for the next ping. What it holds for is asked by `swath_of`; everything else is left to the general engine.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from math import prod
from threading import local
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _swath_kernel as kernel
from insonify.engines._ground_kernel import CELLS, pieces_on_lines
from insonify.engines.lines import lines_in_view
from insonify.engines.sampling import beam_bound, reach
from insonify.engines.swath_plan import PARTS, Plan, planned
from insonify.engines.thinning import WHOLE
from insonify.engines.view import view
from insonify.propagation.choice import PathChoice
from insonify.propagation.families import families_for
from insonify.propagation.images import StraightRays
from insonify.propagation.knife_edge import ROUGH_RIPPLES, soft_edges
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

GROUP = 8192
"""Questions asked of a law in one go."""
LONGEST_STEP = 0.5
"""Longest step along a line over a flat bed [m]."""


class _Scratch(local):
    """Columns that every thread uses again: new memory would cost more than what is written there."""

    def __init__(self) -> None:
        self._held: dict[str, NDArray[Any]] = {}

    def of(self, name: str, shape: tuple[int, ...], kind: Any) -> NDArray[Any]:
        """A column, with whatever was written there before."""
        size = prod(shape)
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
    plan: Plan
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
        rims = self.plan.rims
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
            return list(share(lambda part: hear(self._walk(part, place, 0.0, pieces, slot, 1.0)), range(PARTS)))
        kept, lattice = ground_map(bed), bed.ground.terrain.lattice
        along, across = (float(x) for x in lattice.from_world(here))
        with kept.reading(self.crossed, share):

            def walked(part: int) -> Any:
                return hear(self._walk(part, (along, across), lattice.heading, kept.pieces, kept.slot, kept.cell))

            return list(share(walked, range(PARTS)))

    def _walk(
        self, part: int, start: tuple[float, float], heading: float, pieces: NDArray[np.float32],
        slot: NDArray[np.int64], cell: float,
    ) -> Swath:  # fmt: skip
        """The points of every so many-th line, with the strength of each pair of legs."""
        seabed, stance, plan = self.scene.seabed, self.stance, self.plan
        lines, share, most = plan.parts[part]
        cut, thin = self._behind_targets(lines, heading), plan.thinning
        if cut.any():  # in a shadow the faint is all there is
            share = share.copy()
            share[cut] = np.where(share[cut] > 0, WHOLE, 0)
        f, p = len(plan.families), len(thin.pair)
        delay = _SCRATCH.of("delay", (f, most), np.float64)
        amplitude = _SCRATCH.of("amplitude", (f, most), np.complex64)
        departure = _SCRATCH.of("departure", (f, 3, most), np.float32)
        arrival = _SCRATCH.of("arrival", (f, 3, most), np.float32)
        normal, place = _SCRATCH.of("normal", (3, most), np.float32), _SCRATCH.of("place", (2, most), np.float64)
        rows, weight = _SCRATCH.of("rows", (p, most), np.int32), _SCRATCH.of("weight", (p, most), np.float32)
        found, first = np.empty(p, np.int64), np.empty(len(lines) + 1, np.int64)
        meeting = _SCRATCH.of("meeting", (most, 2), np.int64)
        ranges = kernel.walk(
            *start, heading, float(stance.transmit_place[2]), seabed.depth, self.scene.water.sound_speed,
            stance.wavelength, lines, plan.step, cell, slot, pieces, seabed.bed is None, plan.images, plan.letters,
            plan.prefix, plan.way_images, plan.way_rising, plan.mirrors, plan.factor, plan.loss, thin.edges,
            thin.pair, share, thin.close, place, delay, amplitude, departure, arrival, normal, rows, weight, found,
            first, meeting,
        )  # fmt: skip
        n = int(first[-1])
        if cut.any():
            self._shade(lines, heading, cut, first, place, normal, amplitude)
        if seabed.texture is not None:
            factor = self._texture(lines, heading, first, place).astype(np.float32)
            for k, many in enumerate(found):
                weight[k, :many] *= factor[rows[k, :many]]
        for k, (i, j) in enumerate(thin.pair if not plan.factor.size else ()):
            self._answer(arrival[i], arrival[j], normal, rows[k, : found[k]], weight[k, : found[k]])
        columns = delay[:, :n], amplitude[:, :n], departure[:, :, :n]
        return Swath(*columns, thin.pair, found, rows, weight, meeting[:ranges])

    def _texture(self, lines: Floats, heading: float, first: NDArray[np.int64], place: Floats) -> Floats:
        """What the seabed's texture makes of the points of some lines [1], shape (n,)."""
        bearing = np.repeat(np.arctan2(lines[:, 1], lines[:, 0]) + heading, np.diff(first))
        ahead = np.stack([np.cos(bearing), np.sin(bearing)], axis=-1)
        here = self.stance.transmit_place[:2]
        return self.scene.seabed.textured(here + place[0, : len(bearing), None] * ahead)

    def _answer(
        self, into: NDArray[np.float32], out: NDArray[np.float32], normal: NDArray[np.float32],
        rows: NDArray[np.int32], section: NDArray[np.float32],
    ) -> None:  # fmt: skip
        """Multiply the ground that points stand for by the law's answer for one pair."""
        held = _SCRATCH.of("questions", (9 * GROUP,), np.float32)
        answer = _SCRATCH.of("answer", (GROUP,), np.float32)
        for begin in range(0, len(rows), GROUP):
            some = rows[begin : begin + GROUP]
            one, two, up = held[: 9 * len(some)].reshape(3, 3, len(some))
            kernel.facing(into, out, normal, some, one, two, up)
            self.plan.law.fill(one, two, up, answer[: len(some)])
            section[begin : begin + GROUP] *= answer[: len(some)]

    def _behind_targets(self, lines: Floats, heading: float) -> NDArray[np.bool_]:
        """Which lines pass a target, (s,)."""
        bearing, place = np.arctan2(lines[:, 1], lines[:, 0]) + heading, self.stance.transmit_place
        cut = np.zeros(len(lines), bool)
        for north, east, radius in self.plan.rims:
            apart, towards = np.hypot(north - place[0], east - place[1]), np.arctan2(east - place[1], north - place[0])
            off = np.abs(np.mod(bearing - towards + np.pi, 2 * np.pi) - np.pi)
            half = np.arcsin(min(1.0, radius / max(apart, 1e-9))) + self._rippled(apart)
            cut |= (apart <= radius) | (off <= half)
        return cut

    def _shade(
        self, lines: Floats, heading: float, cut: NDArray[np.bool_], first: NDArray[np.int64], place: Floats,
        normal: NDArray[np.float32], amplitude: NDArray[np.complex64],
    ) -> None:  # fmt: skip
        """Take away what targets cut of the legs, from the lines that pass one; edges of the ground are hard here."""
        scene, here = self.scene, self.stance.transmit_place
        nearest = min(np.hypot(north - here[0], east - here[1]) - radius for north, east, radius in self.plan.rims)
        bearing = np.arctan2(lines[:, 1], lines[:, 0]) + heading
        behind, points = [np.zeros(0, np.int64)], [np.zeros((0, 3))]
        for s in np.flatnonzero(cut):
            rows = first[s] + np.flatnonzero(place[0, first[s] : first[s + 1]] > nearest)
            reach, depth = place[:, rows]
            offset = reach * np.cos(bearing[s]), reach * np.sin(bearing[s])
            behind.append(rows)
            points.append(np.stack([here[0] + offset[0], here[1] + offset[1], depth], axis=-1))
        row = np.concatenate(behind)
        if not len(row):
            return
        hidden = Scatterers(
            "seabed", "seabed", self.plan.law, np.concatenate(points), np.ascontiguousarray(normal[:, row].T, float),
            np.ones(len(row)), np.ones(len(row), complex), np.zeros(len(row), np.uint64),
        )  # fmt: skip
        legs = StraightRays(scene).legs(here, hidden, self.plan.families, self.stance.frequency)
        left = legs.visibility
        if self.choice.edges == "fresnel":
            there = legs.status != Status.FACING_AWAY
            whole = replace(legs, visibility=there.astype(float))
            left = there * soft_edges(whole, hidden, here, scene, self.stance.wavelength, roughly=True).visibility
        amplitude[:, row] *= left

    def _rippled(self, apart: float) -> float:
        """Bearing beside a target's rim up to which its soft edge is looked at [rad]."""
        if self.choice.edges == "hard":
            return 0.0
        return ROUGH_RIPPLES * float(np.sqrt(self.stance.wavelength / (2 * max(apart, self.stance.wavelength))))


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
        if 2 * heard.farthest / (bed.map_cell * CELLS) > AROUND - 4:
            return None
    floor = float(amplitude_ratio(choice.beam_floor_db))
    heading = 0.0 if bed is None else bed.ground.terrain.lattice.heading
    lines = lines_in_view(stance, seabed.depth, heard, sampling, families, floor, heading)
    plan = planned(scene, stance, families, law, lines, step, heading, rise)
    crossed = np.empty((0, 2), np.int64) if bed is None else _crossed(bed, stance, plan.lines, step)
    if len(crossed) > MOST_PIECES:
        return None
    return SwathView(scene, choice, stance, plan, crossed)


def _crossed(bed: Bed, stance: Stance, lines: Floats, step: float) -> NDArray[np.int64]:
    """Numbers of the pieces of a map that some lines cross, (n, 2); more than there is room for if there are more."""
    along, across = (float(x) for x in bed.ground.terrain.lattice.from_world(stance.transmit_place[:2]))
    mark, found = np.zeros((AROUND, AROUND), np.int8), np.empty((MOST_PIECES + 1, 2), np.int64)
    return found[: pieces_on_lines(along, across, lines, step, bed.map_cell, mark, found)]


@lru_cache(maxsize=16)
def _fast(law: Lambert) -> FastLaw:
    return compiled(law)


def _quick(law: Law | None) -> FastLaw | None:
    """A law as the quick way asks it; None where it has no such form."""
    if isinstance(law, Lambert):
        return _fast(law)
    return law if isinstance(law, FastLaw) else None


@lru_cache(maxsize=8)
def _depths(scene: Scene) -> tuple[float, float]:
    """Depths of the highest top and of the deepest base of all targets that cast shadows [m]."""
    surfaces = [world_triangles(solid, scene.seabed) for solid in scene.solids]
    tops = [*scene.bodies[:, 6], *(float(surface.low[2]) for surface in surfaces)]
    bases = [*scene.bodies[:, 7], *(float(surface.high[2]) for surface in surfaces)]
    return float(min(tops)), float(max(bases))
