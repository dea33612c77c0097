"""The engine: every leg out, met at a scatterer by every leg back.

For one ping the scene offers its scatterers in blocks; propagation reaches each from both ends; each
ordered pair of legs scatters with the strength that the owner's law gives it. What comes out is
heard by synthesis.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from insonify.engines.bounced import over_relief
from insonify.engines.rings import WIDEST_CELL
from insonify.engines.skyline import Remembered, Skylines
from insonify.engines.view import Block, footprint, view
from insonify.propagation.choice import PathChoice
from insonify.propagation.knife_edge import soft_edges
from insonify.propagation.moving import End, met_twice, moving_legs
from insonify.propagation.rays import Rays
from insonify.records.legs import Legs
from insonify.records.pairs import Pairs
from insonify.scattering.fast import FastLaw
from insonify.scattering.kirchhoff_facet import SmoothFace
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Law, Scatterers
from insonify.scene.scene import Scene
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

    def blocks(self, stance: Stance, *, even: bool = False) -> list[Block]:
        """The scatterers of one ping, as blocks that are drawn when they are called.

        Args:
            stance: The sonar at this ping.
            even: Points laid out evenly for an expectation, not drawn ones that belong to their places.

        Returns:
            Blocks in a fixed order, however many threads will draw them.
        """
        return view(self.scene, self.choice, self.seed, stance, self.rays, even=even).blocks()

    def pairs(self, stance: Stance, block: Block) -> Pairs:
        """Legs out and back of one block, and the strength of each ordered pair.

        Args:
            stance: The sonar at this ping.
            block: One of `blocks(stance)`.
        """
        return self.meet(stance, block())

    def meet(self, stance: Stance, scatterers: Scatterers) -> Pairs:
        """Legs out and back of any scatterers, and the strength of each ordered pair.

        Args:
            stance: The sonar at this ping.
            scatterers: The points to reach.
        """
        followed = self.choice.followed
        out = self.rays.legs(stance.transmit_place, scatterers, followed, stance.frequency)
        out = self._over_ground(out, scatterers, stance, stance.transmit_place)
        back = out
        if not stance.together:
            back = self.rays.legs(stance.receive_place, scatterers, followed, stance.frequency)
            back = self._over_ground(back, scatterers, stance, stance.receive_place)
        if self.scene.surface.bounce != "mirror":
            out, back = self._off_waves(out, back, scatterers, stance)
        if self.choice.edges == "fresnel":
            out, back = self._bent(out, back, scatterers, stance)
        pair = np.array([(i, j) for i in range(len(out.families)) for j in range(len(back.families))], np.int64)
        pair = pair.reshape(-1, 2)
        weight = met_twice(out, back, pair)
        pair, weight = pair[weight > 0], weight[weight > 0]
        strength = self._strength(scatterers, out, back, pair, stance.frequency) * weight[:, None]
        if self.choice.geometry == "slice" and scatterers.boundary != "target":
            strength *= _slice_width(stance, out, back, pair)
        return Pairs(scatterers, out, back, pair, strength)

    def _strength(
        self, scatterers: Scatterers, out: Legs, back: Legs, pair: NDArray[np.int64], frequency: float
    ) -> Floats | NDArray[np.complex128]:
        """Pressure that each ordered pair scatters to 1 m re incident pressure [m], (p, n)."""
        if isinstance(scatterers.law, SmoothFace):
            assert scatterers.corners is not None
            speed = self.scene.water.speed_at(scatterers.position[:, 2])
            arriving, leaving = out.arrival[pair[:, 0]], back.arrival[pair[:, 1]]
            wavenumber = 2 * np.pi * frequency / speed
            return scatterers.law.echoes(scatterers.corners, scatterers.normal, arriving, leaving, wavenumber)
        return np.asarray(np.sqrt(_cross_section(scatterers, scatterers.law, out, back, pair) * scatterers.area))

    def _off_waves(self, out: Legs, back: Legs, scatterers: Scatterers, stance: Stance) -> tuple[Legs, Legs]:
        """The legs as a moving surface leaves them, each end's at its own times."""

        def moved(legs: Legs, place: Floats) -> tuple[Legs, Legs]:
            end = End(place, stance.time)
            return moving_legs(legs, self.scene, self.seed, scatterers, stance.frequency, end)

        first = moved(out, stance.transmit_place)
        return first[0], (first if out is back else moved(back, stance.receive_place))[1]

    def _bent(self, out: Legs, back: Legs, scatterers: Scatterers, stance: Stance) -> tuple[Legs, Legs]:
        """The legs with what bends around the edges of targets; that of the ground is in them already."""

        def bent(legs: Legs, place: Floats) -> Legs:
            wide = self.choice.geometry == "slice"
            return soft_edges(legs, scatterers, place, self.scene, stance.wavelength, wide=wide)

        first = bent(out, stance.transmit_place)
        return first, (first if out is back else bent(back, stance.receive_place))

    def _over_ground(self, legs: Legs, scatterers: Scatterers, stance: Stance, place: Floats) -> Legs:
        """The legs as relief leaves them; over a flat bed, as they are."""
        bed = self.scene.seabed.bed
        if bed is None:
            return legs

        def walked() -> Skylines:
            apart = float(np.linalg.norm(stance.transmit_place - stance.receive_place))
            farthest = stance.sound_speed * stance.heard_delays[1] / 2 + apart
            width = min(two_way_width(stance.transmit_beams, stance.receive_beams), WIDEST_CELL)
            launches = self.rays.launches(float(place[2]))
            return Skylines(
                bed, place, launches, farthest=farthest, wavelength=stance.wavelength, finest_slice=width / 4
            )

        key = (stance.ping, place.tobytes(), stance.bearing)
        soft = self.choice.edges == "fresnel"
        return over_relief(legs, scatterers, place, self.skylines.get(key, walked), self.scene, soft=soft)

    def all_pairs(self, stance: Stance, *, even: bool = False) -> Iterator[Pairs]:
        """Every block of one ping in turn."""
        for block in self.blocks(stance, even=even):
            yield self.pairs(stance, block)


def _slice_width(stance: Stance, out: Legs, back: Legs, pair: NDArray[np.int64]) -> Floats:
    """Root of the width of the beam that each point of a boundary stands for [m^0.5], (p, n).

    The footprint at the geometric mean of both legs: exact where they are alike.
    """
    reach = out.length[pair[:, 0]] * back.length[pair[:, 1]]
    return np.asarray(np.sqrt(footprint(stance)) * reach**0.25)


def _cross_section(scatterers: Scatterers, law: Law, out: Legs, back: Legs, pair: NDArray[np.int64]) -> Floats:
    """Cross section of each ordered pair, (p, n); legs that are not there weigh nothing later."""
    if out.arrival is back.arrival:
        # every law is reciprocal: each two legs are asked about once
        low, where = np.unique(np.sort(pair, axis=1), axis=0, return_inverse=True)
        if len(low) < len(pair):
            return _cross_section(scatterers, law, out, back, low)[where.ravel()]
    i, j = pair.T
    if isinstance(law, FastLaw):
        normal = scatterers.normal.T
        return np.array([law.cross_section(out.arrival[a].T, -back.arrival[b].T, normal) for a, b in pair], float)
    # On a level boundary all legs to and from one place share one bearing.
    level = scatterers.boundary != "target" and bool(np.all(scatterers.normal[:, :2] == 0))
    straight_back = isinstance(law, Lambert) or (out is back and level)
    azimuth = np.array(np.pi) if straight_back else _azimuth(scatterers.normal, out.arrival[i], back.arrival[j])
    return np.asarray(law.cross_section(np.abs(out.grazing[i]), np.abs(back.grazing[j]), azimuth))


def _azimuth(normal: Floats, arriving: Floats, leaving: Floats) -> Floats:
    """Bistatic azimuth between two rays that both point to the scatterer, in its plane: pi where they coincide."""
    a, b = (ray - np.sum(ray * normal, axis=-1, keepdims=True) * normal for ray in (arriving, leaving))
    cross = np.sum(np.cross(a, b) * normal, axis=-1)
    return np.asarray(np.pi - np.abs(np.arctan2(cross, np.sum(a * b, axis=-1))))
