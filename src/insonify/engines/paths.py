"""The engine: every leg out, met at a scatterer by every leg back.

For one ping the scene offers its scatterers in blocks; propagation reaches each from both ends; each
ordered pair of legs scatters with the strength that the owner's law gives it. What comes out is
heard by synthesis.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.engines.audible import Audible, audible, largest_parts, shares_met
from insonify.engines.bounced import over_relief
from insonify.engines.even_points import Layouts
from insonify.engines.lines import heard_about
from insonify.engines.rings import WIDEST_CELL
from insonify.engines.room import points_at_once
from insonify.engines.skyline import Remembered, Skylines
from insonify.engines.view import Block, footprint, view
from insonify.propagation.choice import PathChoice
from insonify.propagation.delay_field import DelayField
from insonify.propagation.families import DIRECT, families_for
from insonify.propagation.images import StraightRays
from insonify.propagation.knife_edge import soft_edges
from insonify.propagation.moving import End, met_twice, moving_legs
from insonify.propagation.rays import Rays
from insonify.records.legs import Legs
from insonify.records.pairs import Pairs, Product, Strengths, Thinned
from insonify.scattering.fast import FastLaw
from insonify.scattering.kirchhoff_facet import SmoothFace
from insonify.scattering.kirchhoff_patch import SmoothPatch
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Law, Scatterers
from insonify.scene.scene import Scene
from insonify.scene.terrain.kept import Kept
from insonify.sonar.footprint import two_way_width
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Paths:
    """The engine for one scene and one choice of paths."""

    scene: Scene
    choice: PathChoice
    seed: int
    rays: Rays
    """How sound travels in the scene."""
    skylines: Remembered = field(default_factory=lambda: Remembered(4), compare=False, repr=False)
    """What the ground hides from the last few places."""
    parts: Kept = field(default_factory=lambda: Kept(1 << 20), compare=False, repr=False)
    """What families have of all that is heard of the ground at the last attitudes."""
    layouts: Layouts = field(default_factory=Layouts, compare=False, repr=False)
    """Even points about the sonar in its last attitudes."""
    delays: DelayField | None = None
    """What uneven water adds to travel times; None: nothing, and an expectation takes its mean."""

    def blocks(self, stance: Stance, *, even: bool = False) -> list[Block]:
        """The scatterers of one ping, as blocks that are drawn when they are called.

        Args:
            stance: The sonar at this ping.
            even: Points laid out evenly for an expectation, not drawn ones that belong to their places.

        Returns:
            Blocks in a fixed order, however many threads will draw them.
        """
        if not self.choice.causes:
            return []
        seen = view(self.scene, self.choice, self.seed, stance, self.rays, even=even, layouts=self.layouts)
        return seen.blocks()

    def pairs(self, stance: Stance, block: Block, *, drowned: bool = True) -> Pairs:
        """Legs out and back of one block, and the strength of each ordered pair.

        Args:
            stance: The sonar at this ping.
            block: One of `blocks(stance)`.
            drowned: Whether pairs are met everywhere that others drown at all times, see `audible`.
        """
        scatterers = block()
        return self.meet(stance, scatterers, None if drowned else self._audible(stance, scatterers))

    def pieces(self, stance: Stance, block: Block, *, drowned: bool = True) -> Iterator[Pairs]:
        """Pairs of one block, a part of it at a time: the memory that they take is bounded, see `points_at_once`.

        Args:
            stance: The sonar at this ping.
            block: One of `blocks(stance)`.
            drowned: As of `pairs`.
        """
        scatterers = block()
        size = points_at_once(self.scene, self.choice, scatterers)
        for start in range(0, max(len(scatterers), 1), size):
            some = scatterers if len(scatterers) <= size else scatterers.take(slice(start, start + size))
            yield self.meet(stance, some, None if drowned else self._audible(stance, some))

    def meet(self, stance: Stance, scatterers: Scatterers, heard: Audible | None = None) -> Pairs:
        """Legs out and back of any scatterers, and the strength of each ordered pair.

        Args:
            stance: The sonar at this ping.
            scatterers: The points to reach.
            heard: Families that are followed, and where their pairs are met; None: all that are chosen, everywhere.
        """
        out = self._reached(stance.transmit_place, scatterers, stance, heard, elements=stance.together)
        back = out
        if not stance.together:
            back = self._reached(stance.receive_place, scatterers, stance, heard, elements=True)
        if self.scene.surface.bounce != "mirror":
            out, back = self._off_waves(out, back, scatterers, stance)
        if self.choice.edges == "fresnel":
            out, back = self._bent(out, back, scatterers, stance)
        pair = np.array([(i, j) for i in range(len(out.families)) for j in range(len(back.families))], np.int64)
        pair = pair.reshape(-1, 2)
        weight = met_twice(out, back, pair)
        pair, weight = pair[weight > 0], weight[weight > 0]
        thinned = None if heard is None else heard.met(*_names(out, back, pair))
        wide = self.choice.geometry == "slice" and scatterers.boundary != "target"
        answer = self._answer(scatterers, out, back, pair, weight, stance.frequency, thinned)
        if wide:
            answer = Pairs(scatterers, out, back, pair, answer).strength * _slice_width(stance, out, back, pair)
        return Pairs(scatterers, out, back, pair, answer)

    def met(self, stance: Stance, distance: Floats) -> tuple[tuple[str, ...], Floats] | None:
        """Families that reach the seabed, and at what share of its scatterers drawn pings meet their pairs.

        Args:
            stance: The sonar at this ping.
            distance: Over ground from the middle between both ends [m], shape (n,).

        Returns:
            Families, f of them, and shares [1], shape (f, f, n); None: all pairs are met everywhere.
        """
        seabed = self.scene.seabed
        law = seabed.law(stance.frequency, float(self.scene.water.speed_at(seabed.depth)))
        told = None if law is None else self._parts(stance, law)
        return None if told is None else (told[0], np.asarray(shares_met(*told, stance, distance), float))

    def _audible(self, stance: Stance, scatterers: Scatterers) -> Audible | None:
        """What is heard of the ground at some scatterers; None where nothing is known of that."""
        if scatterers.boundary != "seabed" or isinstance(scatterers.law, SmoothFace | SmoothPatch):
            return None
        told = self._parts(stance, scatterers.law)
        return None if told is None else audible(*told, stance, scatterers.position, scatterers.place, self.seed)

    def _parts(self, stance: Stance, law: Law) -> tuple[tuple[str, ...], Floats] | None:
        """Families that reach the bed, and of `largest_parts` what they have of all that is heard of it."""
        bed = self.scene.seabed.bed
        straight, apart = isinstance(self.rays, StraightRays), stance.receive_survey is not None
        if bed is None or bed.span[0] == bed.span[1] or apart or not straight or not self.choice.thinning:
            return None
        families = families_for("seabed", self.choice.followed)
        if families[:1] != (DIRECT,) or self.choice.geometry == "slice":
            return None
        beams = stance.transmit_beams, stance.receive_beams
        depths = stance.transmit_place[2], stance.receive_place[2]
        key = (families, depths, stance.heard_delays, *(beam.axes.tobytes() for beam in beams))
        part = self.parts.get(key, lambda: largest_parts(self.scene, bed, stance, families, law))
        return families, np.asarray(part, float)

    def _reached(
        self, place: Floats, scatterers: Scatterers, stance: Stance, heard: Audible | None, *, elements: bool
    ) -> Legs:
        """Legs between one end and the scatterers, off level mirrors and uneven ground.

        Args:
            place: North, east, depth of that end [m], shape (3,).
            scatterers: The points to reach.
            stance: The sonar at this ping.
            heard: Families that are followed, and where; None: all that are chosen, everywhere.
            elements: Whether elements about that end hear them.
        """
        families = self.choice.followed if heard is None else heard.families
        legs = self.rays.legs(place, scatterers, families, stance.frequency)
        if elements and stance.elements is not None:
            legs = self.rays.around(legs, place, scatterers, stance.reach)
        wanted = None if heard is None else heard.wanted
        return self._late(self._over_ground(legs, scatterers, stance, place, wanted), scatterers, stance, place)

    def _answer(
        self, scatterers: Scatterers, out: Legs, back: Legs, pair: NDArray[np.int64], weight: Floats, frequency: float,
        thinned: Thinned | None,
    ) -> Strengths | Product:  # fmt: skip
        """Pressure that each ordered pair scatters to 1 m re incident pressure [m], where it is met, (p, n)."""
        if isinstance(scatterers.law, SmoothFace | SmoothPatch):
            return np.asarray(self._specular(scatterers, out, back, pair, frequency) * weight[:, None])
        root = np.sqrt(scatterers.area)
        if isinstance(scatterers.law, Lambert):
            return Product(out, back, pair, _contributions(scatterers.law), root, weight, thinned)
        louder = None if thinned is None else thinned.louder
        strength = np.sqrt(_cross_section(scatterers, scatterers.law, out, back, pair, louder)) * root
        if louder is not None:
            strength *= louder
        return np.asarray(strength if (weight == 1).all() else strength * weight[:, None])

    def _specular(
        self, scatterers: Scatterers, out: Legs, back: Legs, pair: NDArray[np.int64], frequency: float
    ) -> NDArray[np.complex128]:
        """Pressure that smooth faces send back to 1 m re incident pressure [m], shape (p, n)."""
        assert scatterers.corners is not None
        if out.arrival is back.arrival and out.length is back.length:
            # reciprocal: the two orders of a pair are evaluated once
            low, where = np.unique(np.sort(pair, axis=1), axis=0, return_inverse=True)
            if len(low) < len(pair):
                return self._specular(scatterers, out, back, low, frequency)[where.ravel()]
        wavenumber = 2 * np.pi * frequency / self.scene.water.speed_at(scatterers.position[:, 2])
        arriving, leaving = out.arrival[pair[:, 0]], back.arrival[pair[:, 1]]
        if isinstance(scatterers.law, SmoothFace):
            return scatterers.law.echoes(scatterers.corners, scatterers.normal, arriving, leaving, wavenumber)
        assert isinstance(scatterers.law, SmoothPatch)
        return scatterers.law.echoes(
            scatterers.corners, scatterers.area, scatterers.normal, arriving, leaving, out.length[pair[:, 0]],
            back.length[pair[:, 1]], wavenumber,
        )  # fmt: skip

    def _late(self, legs: Legs, scatterers: Scatterers, stance: Stance, place: Floats) -> Legs:
        """The legs as uneven water delays them; in even water, as they are."""
        return legs if self.delays is None else self.delays.disturbed(legs, place, scatterers.position, stance.time)

    def _off_waves(self, out: Legs, back: Legs, scatterers: Scatterers, stance: Stance) -> tuple[Legs, Legs]:
        """The legs as a moving surface leaves them, each end's at its own times."""

        def moved(legs: Legs, place: Floats) -> tuple[Legs, Legs]:
            end = End(place, stance.time, stance.transmit_place)
            return moving_legs(legs, self.scene, self.seed, scatterers, stance.frequency, end)

        first = moved(out, stance.transmit_place)
        return first[0], (first if out is back else moved(back, stance.receive_place))[1]

    def _bent(self, out: Legs, back: Legs, scatterers: Scatterers, stance: Stance) -> tuple[Legs, Legs]:
        """The legs with what bends around the edges of targets; that of the ground is in them already."""

        def bent(legs: Legs, place: Floats) -> Legs:
            wide = self.choice.geometry == "slice"
            return soft_edges(legs, scatterers, place, self.scene, self._wavelength(stance, place), wide=wide)

        first = bent(out, stance.transmit_place)
        return first, (first if out is back else bent(back, stance.receive_place))

    def _over_ground(
        self, legs: Legs, scatterers: Scatterers, stance: Stance, place: Floats, wanted: NDArray[np.bool_] | None
    ) -> Legs:
        """The legs as relief leaves them; over a flat bed, as they are."""
        bed = self.scene.seabed.bed
        if bed is None or not len(scatterers):  # a block of water may lie all under the ground
            return legs

        def walked() -> Skylines:
            apart = float(np.linalg.norm(stance.transmit_place - stance.receive_place))
            farthest = self.scene.water.fastest * stance.heard_delays[1] / 2 + apart
            width = min(two_way_width(stance.transmit_beams, stance.receive_beams), WIDEST_CELL)
            launches = self.rays.launches(float(place[2]))
            wavelength = self._wavelength(stance, place)
            heard = None
            if isinstance(self.rays, StraightRays) and self.choice.thinning:
                heard = heard_about(stance, bed.depth, families_for("seabed", self.choice.followed))
            return Skylines(
                bed, place, launches, farthest=farthest, wavelength=wavelength, finest_slice=width / 3, heard=heard
            )

        key = (stance.ping, place.tobytes(), stance.bearing)
        soft = self.choice.edges == "fresnel"
        return over_relief(
            legs, scatterers, place, self.skylines.get(key, walked), self.scene, soft=soft, wanted=wanted
        )

    def _wavelength(self, stance: Stance, place: Floats) -> float:
        """Wavelength at one end of the sonar [m]: an edge does not care whether that end sends or hears."""
        return float(self.scene.water.speed_at(float(place[2]))) / stance.frequency

    def all_pairs(self, stance: Stance, *, even: bool = False) -> Iterator[Pairs]:
        """Every block of one ping in turn: what a recording of drawn scatterers is made of, or an expectation."""
        for block in self.blocks(stance, even=even):
            yield self.pairs(stance, block, drowned=even)


def _names(out: Legs, back: Legs, pair: NDArray[np.int64]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Families out and back of each ordered pair."""
    return tuple(out.families[i] for i in pair[:, 0]), tuple(back.families[j] for j in pair[:, 1])


def _slice_width(stance: Stance, out: Legs, back: Legs, pair: NDArray[np.int64]) -> Floats:
    """Root of the width of the beam that each point of a boundary stands for [m^0.5], (p, n).

    The footprint at the geometric mean of both legs: exact where they are alike.
    """
    reach = out.length[pair[:, 0]] * back.length[pair[:, 1]]
    return np.asarray(np.sqrt(footprint(stance)) * reach**0.25)


@lru_cache(maxsize=8)
def _contributions(law: Lambert) -> Floats:
    """What one direction contributes to a law that is a product of two, linear in sines, at sines of 0 and 1."""
    level, straight = np.array(np.pi / 2), np.array(np.pi)
    facing = law.cross_section(level, level, straight)
    return np.asarray(law.cross_section(np.array([0.0, np.pi / 2]), level, straight) / np.sqrt(facing))


def _cross_section(
    scatterers: Scatterers, law: Law, out: Legs, back: Legs, pair: NDArray[np.int64],
    louder: NDArray[np.float32] | None = None,
) -> Floats:  # fmt: skip
    """Cross section of each ordered pair, (p, n); legs that are not there, and pairs not met, weigh nothing later."""
    i, j = pair.T
    if out.arrival is back.arrival:
        # every law is reciprocal: each two legs are asked about once
        low, where = np.unique(np.sort(pair, axis=1), axis=0, return_inverse=True)
        if len(low) < len(pair):
            first = None if louder is None else louder[np.unique(where.ravel(), return_index=True)[1]]
            return _cross_section(scatterers, law, out, back, low, first)[where.ravel()]
    if isinstance(law, FastLaw):
        return _answers(law, scatterers.normal, out, back, pair, louder)
    # On a level boundary all legs to and from one place share one bearing.
    level = scatterers.boundary != "target" and bool(np.all(scatterers.normal[:, :2] == 0))
    straight_back = out is back and level
    azimuth = np.array(np.pi) if straight_back else _azimuth(scatterers.normal, out.arrival[i], back.arrival[j])
    return np.asarray(law.cross_section(np.abs(out.grazing[i]), np.abs(back.grazing[j]), azimuth))


def _answers(
    law: FastLaw, normal: Floats, out: Legs, back: Legs, pair: NDArray[np.int64], louder: NDArray[np.float32] | None
) -> Floats:
    """Cross sections by a compiled law, asked only where a pair is met, (p, n)."""
    made = np.zeros((len(pair), len(normal)))
    for row, (i, j) in enumerate(pair):
        met = slice(None) if louder is None or louder[row].all() else np.flatnonzero(louder[row])
        made[row, met] = law.cross_section(out.arrival[i, met].T, -back.arrival[j, met].T, normal[met].T)
    return made


def _azimuth(normal: Floats, arriving: Floats, leaving: Floats) -> Floats:
    """Bistatic azimuth between two rays that both point to the scatterer, in its plane: pi where they coincide."""
    a, b = (ray - np.sum(ray * normal, axis=-1, keepdims=True) * normal for ray in (arriving, leaving))
    cross = np.sum(np.cross(a, b) * normal, axis=-1)
    return np.asarray(np.pi - np.abs(np.arctan2(cross, np.sum(a * b, axis=-1))))
