"""What of the scene one ping can meet, as blocks of scatterers that are drawn only when they are wanted.

The whole seabed and surface in three dimensions, or in a slice the one line of them under the beam, each
point standing for its share of the beam's footprint; and every target.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from insonify import streams
from insonify.engines.sampling import Resolution, reach, tiles_in_view
from insonify.propagation.choice import PathChoice
from insonify.propagation.families import families_for
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
"""Scatterers in a block: few enough for the cache, enough to keep Python out of the way."""
FACE_CELLS = 3.0
"""Cells of a target's face per range resolution, in each direction."""

Block = Callable[[], Scatterers]


@dataclass(frozen=True, slots=True)
class View:
    """The scene as one ping meets it."""

    scene: Scene
    choice: PathChoice
    seed: int
    stance: Stance
    resolution: Resolution

    def blocks(self) -> list[Block]:
        """Every scatterer that this ping can meet, in blocks of a fixed order."""
        seabed, surface = self.scene.seabed, self.scene.surface
        made: list[Block] = []
        if "target" in self.choice.causes:
            made += self._targets()
        if "seabed" in self.choice.causes and seabed.scattering is not None:
            made += self._boundary("seabed", seabed.depth, seabed.scattering)
        if "surface" in self.choice.causes and surface.scattering is not None:
            made += self._boundary("surface", 0.0, surface.scattering)
        return made

    def _boundary(self, boundary: Boundary, depth: float, law: ScatteringLaw) -> list[Block]:
        kept = families_for(boundary, self.choice.followed)
        if not kept:
            return []
        across = self._line if self.choice.geometry == "slice" else self._lattice
        return across(boundary, depth, law, kept)

    def _lattice(self, boundary: Boundary, depth: float, law: ScatteringLaw, kept: tuple[str, ...]) -> list[Block]:
        """Jittered cells of all tiles in reach of window and beams."""
        lattice = self.scene.seabed.lattice
        floor = float(amplitude_ratio(self.choice.beam_floor_db))
        tiles = tiles_in_view(self.stance, lattice, depth, self.scene.seabed.depth, kept, self.resolution, floor)
        stream = streams.SEABED if boundary == "seabed" else streams.SURFACE

        def drawn(part: Tiles) -> Scatterers:
            cell = draw(part, self.seed, stream)
            place = lattice.to_world(cell.along, cell.across)
            return _on_boundary(boundary, depth, law, place, cell.area, cell.phase, cell.place)

        starts = range(0, len(tiles.level), TILES_PER_BLOCK)
        return [partial(drawn, tiles.take(slice(s, s + TILES_PER_BLOCK))) for s in starts]

    def _line(self, boundary: Boundary, depth: float, law: ScatteringLaw, kept: tuple[str, ...]) -> list[Block]:
        """Jittered cells along the beam's plane, a few to each range cell."""
        heard = reach(self.stance, depth, self.scene.seabed.depth, kept)
        if heard.farthest < 0:
            return []
        # The finest cell is the farthest: the ground cell shrinks towards the slant resolution.
        pitch = float(self.resolution.ground(np.array([heard.farthest]), heard.height)[0]) / self.resolution.per_cell
        first, last = int(heard.nearest / pitch), int(np.ceil(heard.farthest / pitch))
        ahead = np.array([np.cos(self.stance.bearing), np.sin(self.stance.bearing)])
        # A place in a slice is a distance from the sonar: one that moves meets another line of the seabed.
        here = self.stance.transmit_place[:2]
        north, east = np.round(here * 100).astype(int)
        surface = int(boundary == "surface")

        def drawn(start: int, stop: int) -> Scatterers:
            cell = np.arange(start, stop)
            u = streams.uniforms(self.seed, streams.SLICE, cell, north, east, surface)
            place = here + ((cell + u[:, 0]) * pitch)[:, None] * ahead
            key = np.uint64(streams.SLICE << 59 | surface << 58) | cell.astype(np.uint64)
            area = np.full(len(cell), pitch)
            return _on_boundary(boundary, depth, law, place, area, np.exp(2j * np.pi * u[:, 1]), key)

        starts = range(first, last, BLOCK)
        return [partial(drawn, s, min(s + BLOCK, last)) for s in starts]

    def _targets(self) -> list[Block]:
        made: list[Block] = []
        for target in self.scene.targets:
            points = self._box(target) if isinstance(target, Box) else point_scatterer(target)
            starts = range(0, len(points), BLOCK)
            made += [partial(points.take, slice(s, s + BLOCK)) for s in starts]
        return made

    def _box(self, box: Box) -> Scatterers:
        pitch = min(self.resolution.slant, *box.size) / FACE_CELLS
        whole = box_scatterers(box, self.scene.seabed.depth, self.seed, pitch, self.scene.boxes.index(box))
        if self.choice.geometry != "slice":
            return whole
        distance = float(np.linalg.norm(np.array(box.position) - self.stance.transmit_place[:2]))
        return box_section(
            whole, box, self.stance.transmit_place, self.stance.bearing, footprint(self.stance) * distance
        )


def view(scene: Scene, choice: PathChoice, seed: int, stance: Stance) -> View:
    """The scene as one ping meets it, sampled by what the sonar can resolve."""
    slant = stance.pulse.range_resolution(stance.sound_speed)
    width = two_way_width(stance.transmit_beams, stance.receive_beams)
    return View(scene, choice, seed, stance, Resolution(slant, width, choice.scatterers_per_cell))


def footprint(stance: Stance) -> float:
    """Energy width of the one two-way beam of a slice, in sine of azimuth [1]."""
    return float(two_way_footprint(stance.transmit_beams, stance.receive_beams)[0])


def _on_boundary(
    boundary: Boundary, depth: float, law: ScatteringLaw, place: NDArray[np.float64], area: NDArray[np.float64],
    phase: NDArray[np.complex128], key: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """Points of a flat boundary, facing the water."""
    position, normal = np.empty((len(place), 3)), np.zeros((len(place), 3))
    position[:, :2], position[:, 2] = place, depth
    normal[:, 2] = -1.0 if boundary == "seabed" else 1.0
    return Scatterers(boundary, boundary, law, position, normal, area, phase, key)
