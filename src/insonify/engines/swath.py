"""The seabed of one ping in a few big strokes: the quick way to an expected intensity.

`engines.paths` answers any question about any block of scatterers; an expectation over a whole seabed asks the same
few of every point. Here lines of the ground are walked once each (`_swath_kernel`), and all that is drawn or tabled is
kept for the next ping. What it holds for is asked by `swath_of`; everything else is left to the general engine.
"""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import lru_cache
from math import prod
from threading import local
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _swath_kernel as kernel
from insonify.engines._ground_kernel import CELLS
from insonify.engines._points_kernel import Points
from insonify.engines.lines import lines_in_view
from insonify.engines.sampling import beam_bound, reach
from insonify.engines.shadow_lines import shaded_legs, shadow_lines
from insonify.engines.swath_bounces import bounce_off_relief
from insonify.engines.swath_origins import Shaded, Walked, origins, unlit
from insonify.engines.swath_plan import Plan, planned
from insonify.engines.swath_window import Listed, Window, lines_passing, window_of
from insonify.engines.view import view
from insonify.propagation.choice import PathChoice
from insonify.propagation.families import families_for
from insonify.propagation.images import StraightRays
from insonify.propagation.rays import Rays
from insonify.records.swath import Swath
from insonify.scattering.fast import FastLaw, compiled
from insonify.scattering.lambert import Lambert
from insonify.scene.ground_map import AROUND, ground_map, unmapped
from insonify.scene.scatterers import Law
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
AWAY = 4.0
"""Distance within which a sonar that moves on need not ask again whether it hears a target [m]."""


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


@dataclass(frozen=True, eq=False)
class Known:
    """What all pings have in common while the sonar only moves on."""

    plan: Plan
    heading: float
    """Of the frame of the lines [rad]."""
    farthest: float
    """Distance that is heard [m]."""
    rest: PathChoice
    """The same paths for all that is not the seabed."""
    quiet: PathChoice
    """Without targets, too."""
    deaf: list[Floats] = field(default_factory=list)
    """The last place from `AWAY` about which no beam comes near any target [m]."""


@dataclass(frozen=True)
class SwathView:
    """What the quick way knows of one ping before it walks."""

    scene: Scene
    choice: PathChoice
    stance: Stance
    known: Known
    parts: list[Listed]
    """Its lines: the plan's own, and those in shadows of targets."""
    window: Window
    """Where on the ground's map they are."""

    @property
    def plan(self) -> Plan:
        """What is done at every such ping."""
        return self.known.plan

    @property
    def rest(self) -> PathChoice:
        """The same paths for all that is not the seabed, without targets that no beam comes near."""
        near = "target" in self.choice.causes and self._near_a_target()
        return self.known.rest if near else self.known.quiet

    def _near_a_target(self) -> bool:
        """Whether any beam is above the floor towards any target; points are always heard."""
        scene = self.scene
        if len(scene.targets) > len(scene.occluders):
            return True
        if not scene.occluders:
            return False
        here = self.stance.transmit_place[:2]
        if any(math.dist(here, place) <= AWAY for place in self.known.deaf):
            return False
        if not self._heard_from_about(AWAY):
            self.known.deaf[:] = [here]
            return False
        return self._heard_from_about(0.0)

    def _heard_from_about(self, away: float) -> bool:
        """Whether any beam may be above the floor towards any target, from within a distance of where it is [m]."""
        rims = self.plan.rims[:, :3]
        top, base = _depths(self.scene)
        floor = float(amplitude_ratio(self.choice.beam_floor_db))
        bound = beam_bound(
            rims[:, :2], rims[:, 2] + away, self.stance, (top + base) / 2, StraightRays(self.scene),
            self.choice.followed, rise=(base - top) / 2,
        )  # fmt: skip
        return bool((bound >= floor).any())

    def gather(self, share: Mapped, hear: Callable[[Swath], Any], *, labelled: bool = False) -> list[Any]:
        """All the ground heard.

        Args:
            share: Calls a function with each of some things, as `map` does, perhaps on several threads.
            hear: What is done with it; its columns are written over afterwards.
            labelled: True: with the `Origins` of its points.

        Returns:
            What hearing it came to.
        """
        bed, window = self.scene.seabed.bed, self.window
        if bed is None:
            pieces, slot = unmapped()
            return [hear(self._walk(part, pieces, slot, 1.0, labelled)) for part in self.parts]
        kept = ground_map(bed)
        slot = np.zeros((window.side, window.side), np.uint32)
        with kept.reading(window.corner + window.crossed, share) as rows:
            slot[tuple(window.crossed.T)] = rows
            return [hear(self._walk(part, kept.pieces, slot, kept.cell, labelled)) for part in self.parts]

    def _walk(
        self, part: Listed, pieces: NDArray[np.float32], slot: NDArray[np.uint32], cell: float, labelled: bool
    ) -> Swath:
        """The points of some lines, with the strength of each pair of legs."""
        seabed, stance, plan, heading = self.scene.seabed, self.stance, self.plan, self.known.heading
        lines, lists, taken, passing = part
        thin = plan.thinning
        most, takes, ranges = _sizes(lists, taken)
        f, p = len(plan.families), len(thin.pair)
        delay = _SCRATCH.of("delay", (f, most), np.float64)
        amplitude = _SCRATCH.of("amplitude", (f, most), np.complex64)
        departure = _SCRATCH.of("departure", (f, 3, most), np.float32)
        arrival = _SCRATCH.of("arrival", (f, 3, most), np.float32)
        normal, place = _SCRATCH.of("normal", (3, most), np.float32), _SCRATCH.of("place", (2, most), np.float64)
        rows, weight = _SCRATCH.of("rows", (p, takes), np.int32), _SCRATCH.of("weight", (p, takes), np.float32)
        found, first = np.empty(p, np.int64), np.empty(len(lines) + 1, np.int64)
        meeting = _SCRATCH.of("meeting", (ranges, 2), np.int64)
        ranges = kernel.walk(
            *self.window.start, heading, float(stance.transmit_place[2]), seabed.depth, self.scene.water.sound_speed,
            stance.wavelength, lines, plan.step, lists, taken, cell, slot, pieces, seabed.bed is None, plan.images,
            plan.letters, plan.prefix, plan.way_images, plan.way_rising, plan.mirrors, plan.factor, plan.loss, place,
            delay, amplitude, departure, arrival, normal, rows, weight, found, first, meeting,
        )  # fmt: skip
        bed = seabed.bed
        if bed is not None and bed.span[0] < bed.span[1]:
            bounce_off_relief(
                self.scene, bed, stance, plan, part, first, place, normal, rows, found, delay, amplitude, departure,
                arrival,
            )  # fmt: skip
        walked = Walked(first, place, normal, arrival, rows, found)
        dark = unlit(plan, walked, amplitude) if labelled else None
        shaded = self._shade(part, first, place, normal, amplitude) if passing.any() else None
        if seabed.texture is not None:
            factor = self._texture(lines, heading, first, place).astype(np.float32)
            for k, many in enumerate(found):
                weight[k, :many] *= factor[rows[k, :many]]
        for k, (i, j) in enumerate(thin.pair if not plan.factor.size else ()):
            self._answer(arrival[i], arrival[j], normal, rows[k, : found[k]], weight[k, : found[k]])
        held = None if dark is None else origins(plan, stance, part, walked, dark, shaded)
        return Swath(delay, amplitude, departure, thin.pair, found, rows, weight, meeting[:ranges], held)

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

    def _shade(
        self, part: Listed, first: NDArray[np.int64], place: Floats, normal: NDArray[np.float32],
        amplitude: NDArray[np.complex64],
    ) -> Shaded | None:  # fmt: skip
        """Take away what targets cut of the legs, from lines that pass one; these legs, if there are any."""
        here, ahead = self.stance.transmit_place, part.lists.ahead
        nearest = min(
            np.hypot(north - here[0], east - here[1]) - radius for north, east, radius in self.plan.rims[:, :3]
        )
        behind, listed = [], part.lists.first[part.taken]
        for s in np.flatnonzero(part.passing):
            point = np.flatnonzero(place[0, first[s] : first[s + 1]] > nearest)
            behind.append(np.stack([first[s] + point, listed[s] + point]))
        row, point = np.concatenate(behind, axis=1)
        if not len(row):
            return None
        reach, depth = place[:, row]
        points = np.stack([here[0] + reach * ahead[0, point], here[1] + reach * ahead[1, point], depth], axis=-1)
        up = np.ascontiguousarray(normal[:, row].T, float)
        left, legs = shaded_legs(self.scene, self.stance, self.plan, self.choice.edges, points, up)
        amplitude[:, row] *= left
        return Shaded(row, left, legs)


def _sizes(lists: Points, taken: NDArray[np.int64]) -> tuple[int, int, int]:
    """Points of some lists, the most that any pair takes of them, and ranges where pairs may interfere."""
    takes = np.diff(lists.pair_first, axis=1)[taken].sum(axis=0)
    points, ranges = (int((many[taken + 1] - many[taken]).sum()) for many in (lists.first, lists.close_first))
    return points, int(takes.max()), ranges


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
    if not stance.together:
        return None
    # a sonar that only moves on, its attitude kept in the very same beams, asks for the same again
    key = (
        id(scene), id(choice), id(rays), id(stance.transmit_beams), id(stance.receive_beams), id(stance.survey),
        id(stance.pulse), float(stance.transmit_place[2]), stance.moved, stance.window,
    )  # fmt: skip
    held = _LAST.get(key)
    if held is None:
        # what the key names is kept, so that nothing else can take its number
        names = scene, choice, rays, stance.transmit_beams, stance.receive_beams, stance.survey, stance.pulse
        while len(_LAST) >= _MOST:
            _LAST.pop(next(iter(tuple(_LAST)), None), None)  # a copy: threads come and go
        held = _LAST[key] = _known(scene, choice, stance, rays), names
    known = held[0]
    if known is None:
        return None
    parts = _parts(scene, choice, stance, known)
    window = window_of(scene.seabed.bed, stance, known.plan.step, parts, known.farthest)
    return None if window is None else SwathView(scene, choice, stance, known, parts, window)


def _parts(scene: Scene, choice: PathChoice, stance: Stance, known: Known) -> list[Listed]:
    """The lines of one ping: those of its plan, and others in place of those that targets cut."""
    plan = known.plan
    passing = lines_passing(plan, stance, known.heading, choice.edges)
    own = np.asarray(passing.any(axis=0), bool)
    whole = Listed(plan.lines, plan.lists, np.arange(len(own)), own)
    shaded = shadow_lines(plan, scene, stance, choice, known.heading, passing) if own.any() else None
    if shaded is None or not shaded.replaced.any():
        return [whole]
    kept, lists = np.flatnonzero(~shaded.replaced), plan.listed(shaded.lines, known.heading, shaded.share)
    return [
        Listed(plan.lines[kept], plan.lists, kept, own[kept]),
        Listed(shaded.lines, lists, np.arange(len(shaded.lines)), shaded.passing),
    ]


_LAST: dict[Any, tuple[Known | None, Any]] = {}
_MOST = 8


def _known(scene: Scene, choice: PathChoice, stance: Stance, rays: Rays) -> Known | None:
    """What does not change while the sonar only moves on; None where the scene asks more than the quick way can do."""
    seabed, bed = scene.seabed, scene.seabed.bed
    law = _quick(seabed.law(stance.frequency, float(scene.water.speed_at(seabed.depth))))
    families = families_for("seabed", choice.followed)
    moving = scene.surface.bounce != "mirror" and any("S" in name for name in families)
    if not isinstance(rays, StraightRays) or choice.geometry != "3d" or "seabed" not in choice.causes or moving:
        return None
    if stance.channel_count != 1 or law is None or not families:
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
    return Known(plan, heading, heard.farthest, _without(choice, scene, stance, ()),
                 _without(choice, scene, stance, ("target",)))  # fmt: skip


def _without(choice: PathChoice, scene: Scene, stance: Stance, more: tuple[str, ...]) -> PathChoice:
    """The same paths for all but the seabed, what does not answer in this scene, and some causes more."""
    silent = ["seabed", *more]
    silent += ["surface"] if scene.surface.law(stance.frequency) is None else []
    silent += [] if scene.water.scatters else ["water"]
    left = tuple(cause for cause in choice.causes if cause not in silent)
    return choice.unchecked_copy(causes=left)


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
