"""The engine: every leg out, met at a scatterer by every leg back.

For one ping the scene offers its scatterers in blocks; propagation reaches each from both ends; each
ordered pair of legs scatters with the strength that the owner's law gives it. What comes out is
heard by synthesis.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify import streams
from insonify.engines.sampling import Resolution, reach, tiles_in_view
from insonify.propagation.choice import PathChoice
from insonify.propagation.families import families_for
from insonify.propagation.images import image_legs
from insonify.records.legs import Legs
from insonify.records.pairs import Pairs
from insonify.scattering.law import ScatteringLaw
from insonify.scene.box import box_scatterers, box_section
from insonify.scene.lattice import TILE, Tiles, draw
from insonify.scene.scatterers import Boundary, Scatterers
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.target import Box
from insonify.sonar.footprint import two_way_footprint, two_way_width
from insonify.sonar.stance import Stance
from insonify.units import amplitude_ratio

TILES_PER_BLOCK = 4
BLOCK = TILES_PER_BLOCK * TILE * TILE
"""Scatterers in a block: small enough for the cache, large enough to keep Python out of the way."""
FACE_CELLS = 3.0
"""Cells of a target's face per range resolution, in each direction."""

Block = Callable[[], Scatterers]


@dataclass(frozen=True, slots=True)
class Paths:
    """The engine for one scene and choice of paths."""

    scene: Scene
    choice: PathChoice
    seed: int

    def blocks(self, stance: Stance) -> list[Block]:
        """The scatterers of one ping, as blocks that are drawn when they are called.

        Args:
            stance: The sonar at this ping.

        Returns:
            Blocks in a fixed order, however many threads will draw them.
        """
        made: list[Block] = []
        causes = self.choice.causes
        if "target" in causes:
            made += self._target_blocks(stance)
        if "seabed" in causes and self.scene.seabed.scattering is not None:
            made += self._boundary_blocks(stance, "seabed", self.scene.seabed.depth, self.scene.seabed.scattering)
        if "surface" in causes and self.scene.surface.scattering is not None:
            made += self._boundary_blocks(stance, "surface", 0.0, self.scene.surface.scattering)
        return made

    def pairs(self, stance: Stance, block: Block) -> Pairs:
        """Legs out and back of one block, and the strength of each ordered pair.

        Args:
            stance: The sonar at this ping.
            block: One of `blocks(stance)`.
        """
        scatterers = block()
        followed = self.choice.followed
        out = image_legs(self.scene, stance.transmit_place, scatterers, followed, stance.frequency)
        back = (
            out
            if stance.together
            else image_legs(self.scene, stance.receive_place, scatterers, followed, stance.frequency)
        )
        pair = np.array([(i, j) for i in range(len(out.families)) for j in range(len(back.families))], dtype=np.int64)
        strength = np.sqrt(_cross_section(scatterers, out, back, pair) * scatterers.area)
        if self.choice.geometry == "slice" and scatterers.drawn:
            strength *= self._slice_width(stance, scatterers, out, back, pair)
        return Pairs(scatterers, out, back, pair.reshape(-1, 2), strength)

    def all_pairs(self, stance: Stance) -> Iterator[Pairs]:
        """Every block of one ping in turn."""
        for block in self.blocks(stance):
            yield self.pairs(stance, block)

    def resolution(self, stance: Stance) -> Resolution:
        """What the sonar can tell apart at this stance."""
        return Resolution(
            stance.pulse.range_resolution(stance.sound_speed),
            two_way_width(stance.transmit_beams, stance.receive_beams),
            self.choice.scatterers_per_cell,
        )

    def _boundary_blocks(self, stance: Stance, boundary: Boundary, depth: float, law: ScatteringLaw) -> list[Block]:
        if self.choice.geometry == "slice":
            return self._slice_blocks(stance, boundary, depth, law)
        lattice = self.scene.seabed.lattice
        kept = families_for(boundary, self.choice.followed)
        if not kept:
            return []
        floor = float(amplitude_ratio(self.choice.beam_floor_db))
        tiles = tiles_in_view(
            stance, lattice, depth, self.scene.seabed.depth, kept, self.resolution(stance), floor
        )
        stream = streams.SEABED if boundary == "seabed" else streams.SURFACE
        normal = -1.0 if boundary == "seabed" else 1.0

        def drawn(part: Tiles) -> Scatterers:
            cell = draw(part, self.seed, stream)
            n = len(cell.area)
            position = np.empty((n, 3))
            position[:, :2] = lattice.to_world(cell.along, cell.across)
            position[:, 2] = depth
            up = np.zeros((n, 3))
            up[:, 2] = normal
            return Scatterers(boundary, boundary, law, position, up, cell.area, cell.phase, cell.place)

        starts = range(0, len(tiles.level), TILES_PER_BLOCK)
        return [lambda part=tiles.take(slice(s, s + TILES_PER_BLOCK)): drawn(part) for s in starts]  # type: ignore[misc]

    def _slice_blocks(self, stance: Stance, boundary: Boundary, depth: float, law: ScatteringLaw) -> list[Block]:
        """One jittered line of cells along the beam's plane, a few to each range cell."""
        kept = families_for(boundary, self.choice.followed)
        if not kept:
            return []
        heard = reach(stance, depth, self.scene.seabed.depth, kept)
        if heard.farthest < 0:
            return []
        # The finest cell is the farthest: the ground cell shrinks towards the slant resolution.
        resolution = self.resolution(stance)
        pitch = float(resolution.ground(np.array([heard.farthest]), heard.height)[0]) / self.choice.scatterers_per_cell
        first, last = int(heard.nearest / pitch), int(np.ceil(heard.farthest / pitch))
        # A place in a slice is a distance from the sonar: a sonar that moves meets another line of the seabed.
        north, east = (int(round(x * 100)) for x in stance.transmit_place[:2])
        stream = streams.SLICE if boundary == "seabed" else streams.SLICE + 100

        def drawn(start: int, stop: int) -> Scatterers:
            cell = np.arange(start, stop)
            u = streams.uniforms(self.seed, stream, cell, north, east)
            distance = (cell + u[:, 0]) * pitch
            position = np.stack(
                [
                    stance.transmit_place[0] + distance * np.cos(stance.bearing),
                    stance.transmit_place[1] + distance * np.sin(stance.bearing),
                    np.full(len(cell), depth),
                ],
                axis=-1,
            )
            normal = np.zeros((len(cell), 3))
            normal[:, 2] = -1.0 if boundary == "seabed" else 1.0
            phase = np.exp(2j * np.pi * u[:, 1])
            place = np.uint64(streams.SLICE) << np.uint64(59) | np.uint64(boundary == "surface") << np.uint64(58)
            return Scatterers(
                boundary, boundary, law, position, normal, np.full(len(cell), pitch), phase,
                place | cell.astype(np.uint64),
            )  # fmt: skip

        return [
            lambda start=start: drawn(start, min(start + BLOCK, last))  # type: ignore[misc]
            for start in range(first, last, BLOCK)
        ]

    def _target_blocks(self, stance: Stance) -> list[Block]:
        made: list[Block] = []
        boxes = self.scene.boxes
        for target in self.scene.targets:
            if isinstance(target, Box):
                whole = self._box(stance, target, boxes.index(target))
                made += [
                    lambda part=whole.take(slice(s, s + BLOCK)): part  # type: ignore[misc]
                    for s in range(0, len(whole), BLOCK)
                ]
            else:
                made.append(lambda point=point_scatterer(target): point)  # type: ignore[misc]
        return made

    def _box(self, stance: Stance, box: Box, occluder: int) -> Scatterers:
        resolution = self.resolution(stance)
        depth = self.scene.seabed.depth
        pitch = min(resolution.slant, *box.size) / FACE_CELLS
        whole = box_scatterers(box, depth, self.seed, pitch, occluder)
        if self.choice.geometry != "slice":
            return whole
        distance = float(np.linalg.norm(np.array(box.position) - stance.transmit_place[:2]))
        footprint = two_way_footprint(stance.transmit_beams, stance.receive_beams) * distance
        return box_section(whole, box, stance.transmit_place, stance.bearing, footprint)

    def _slice_width(
        self, stance: Stance, scatterers: Scatterers, out: Legs, back: Legs, pair: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Root of the width of the beam that each point of a boundary stands for, for each pair [m^0.5]."""
        if scatterers.boundary == "target":
            return np.ones((1, 1))
        footprint = two_way_footprint(stance.transmit_beams, stance.receive_beams)
        return np.asarray(np.sqrt(footprint) / (out.spreading[pair[:, 0]] * back.spreading[pair[:, 1]]) ** 0.25)


def _cross_section(
    scatterers: Scatterers, out: Legs, back: Legs, pair: NDArray[np.int64]
) -> NDArray[np.float64]:
    """Cross section of each ordered pair, (p, n); zero where either leg is missing."""
    i, j = pair.reshape(-1, 2).T
    sent, heard = out.grazing[i], back.grazing[j]
    seen = (out.visibility[i] > 0) & (back.visibility[j] > 0)
    value = scatterers.law.cross_section(np.abs(sent), np.abs(heard), _azimuth(out.arrival[i], back.arrival[j]))
    return np.asarray(np.where(seen, value, 0.0))


def _azimuth(arriving: NDArray[np.float64], leaving: NDArray[np.float64]) -> NDArray[np.float64]:
    """Bistatic azimuth between two rays that both point to the scatterer: pi where they come from one side."""
    cross = arriving[..., 0] * leaving[..., 1] - arriving[..., 1] * leaving[..., 0]
    along = arriving[..., 0] * leaving[..., 0] + arriving[..., 1] * leaving[..., 1]
    return np.asarray(np.pi - np.abs(np.arctan2(cross, along)))
