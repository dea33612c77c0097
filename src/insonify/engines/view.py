"""What of the scene one ping can meet, as blocks of scatterers that are drawn only when they are wanted.

The whole seabed and surface in three dimensions, or in a slice the one line of them under the beam, each
point standing for its share of the beam's footprint; and every target. For a coherent reading the points are
drawn and belong to their places; for an expectation they are laid out evenly, and no speckle is left.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from insonify import streams
from insonify.engines.rings import Rings
from insonify.engines.sampling import Resolution, reach, tiles_in_view
from insonify.propagation.choice import PathChoice
from insonify.propagation.families import families_for
from insonify.propagation.rays import Rays
from insonify.scene.box import box_scatterers, box_section
from insonify.scene.lattice import TILE, Tiles, draw
from insonify.scene.scatterers import Boundary, Law, Scatterers
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
LONGEST_CELL = 0.05
"""Longest cell of slant range, as a part of the sonar's distance from the nearer boundary [1]."""
FRINGE_CELLS = 8.0
"""Cells up a target's face per fringe between its direct and its bottom path."""

Block = Callable[[], Scatterers]


@dataclass(frozen=True, slots=True)
class View:
    """The scene as one ping meets it."""

    scene: Scene
    choice: PathChoice
    seed: int
    stance: Stance
    rays: Rays
    resolution: Resolution
    even: bool
    """Even points for an expectation, or drawn ones that belong to their places."""

    def blocks(self) -> list[Block]:
        """Every scatterer that this ping can meet, in blocks of a fixed order."""
        seabed, surface = self.scene.seabed, self.scene.surface
        made: list[Block] = []
        if "target" in self.choice.causes:
            made += self._targets()
        bed_law = seabed.law(self.stance.frequency, float(self.scene.water.speed_at(seabed.depth)))
        if "seabed" in self.choice.causes and bed_law is not None:
            made += self._boundary("seabed", seabed.depth, bed_law)
        surface_law = surface.law(self.stance.frequency)
        if "surface" in self.choice.causes and surface_law is not None:
            made += self._boundary("surface", 0.0, surface_law)
        return made

    def _boundary(self, boundary: Boundary, depth: float, law: Law) -> list[Block]:
        kept = families_for(boundary, self.choice.followed)
        if not kept:
            return []
        if self.choice.geometry == "slice":
            return self._line(boundary, depth, law, kept)
        return (self._rings if self.even else self._lattice)(boundary, depth, law, kept)

    def _lattice(self, boundary: Boundary, depth: float, law: Law, kept: tuple[str, ...]) -> list[Block]:
        """Jittered cells of all tiles in reach of window and beams."""
        lattice = self.scene.seabed.lattice
        floor = float(amplitude_ratio(self.choice.beam_floor_db))
        tiles = tiles_in_view(self.stance, lattice, depth, self.rays, kept, self.resolution, floor)
        stream = streams.SEABED if boundary == "seabed" else streams.SURFACE

        def drawn(part: Tiles) -> Scatterers:
            cell = draw(part, self.seed, stream)
            place = lattice.to_world(cell.along, cell.across)
            return _on_boundary(boundary, depth, law, place, cell.area, cell.phase, cell.place)

        starts = range(0, len(tiles.level), TILES_PER_BLOCK)
        return [partial(drawn, tiles.take(slice(s, s + TILES_PER_BLOCK))) for s in starts]

    def _rings(self, boundary: Boundary, depth: float, law: Law, kept: tuple[str, ...]) -> list[Block]:
        """Even cells of slant range and azimuth about the sonar."""
        heard = reach(self.stance, depth, self.rays, kept)
        if heard.farthest < 0:
            return []
        rings = Rings(self.stance, depth, heard, self.resolution)
        tiles = rings.in_view(self.rays, kept, float(amplitude_ratio(self.choice.beam_floor_db)))

        def laid(part: NDArray[np.int64]) -> Scatterers:
            place, area, key = rings.points(part)
            return _on_boundary(boundary, depth, law, place, area, np.ones(len(area), complex), key)

        return [partial(laid, tiles[s : s + TILES_PER_BLOCK]) for s in range(0, len(tiles), TILES_PER_BLOCK)]

    def _line(self, boundary: Boundary, depth: float, law: Law, kept: tuple[str, ...]) -> list[Block]:
        """Cells along the beam's plane, a few to each cell of slant range: what the farthest ground cell comes to."""
        heard = reach(self.stance, depth, self.rays, kept)
        if heard.farthest < 0:
            return []
        pitch = self.resolution.slant / self.resolution.per_cell
        first, last = int(heard.nearest / pitch), int(np.ceil(heard.farthest / pitch))
        ahead = np.array([np.cos(self.stance.bearing), np.sin(self.stance.bearing)])
        here = self.stance.transmit_place[:2]
        # A place in a slice is a distance along one line of the lattice: another line, another seabed.
        lattice = self.scene.seabed.lattice
        along, across = np.round(lattice.from_world(here) * 100).astype(int)
        line = round(float(np.mod(self.stance.bearing - lattice.heading, 2 * np.pi)) * 1e6) * 2 + (
            boundary == "surface"
        )

        def drawn(start: int, stop: int) -> Scatterers:
            cell = np.arange(start, stop)
            u = streams.uniforms(self.seed, streams.SLICE, cell, along, across, line)
            shift = 0.5 if self.even else u[:, 0]
            place = here + ((cell + shift) * pitch)[:, None] * ahead
            key = np.uint64(streams.SLICE << 59 | int(boundary == "surface") << 58) | cell.astype(np.uint64)
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
        depth, here = self.scene.seabed.depth, self.stance.transmit_place
        distance = float(np.linalg.norm(np.array(box.position) - here[:2]))
        pitch = min(self.resolution.slant, *box.size) / FACE_CELLS
        # Direct and bottom paths make fringes up a face; a few points must lie within each.
        fringe = self.stance.wavelength * max(distance, 1.0) / max(depth - here[2], 0.1)
        rise = max(min(pitch, fringe / FRINGE_CELLS), self.stance.wavelength / 4)
        occluder = self.scene.boxes.index(box)
        whole = box_scatterers(box, depth, self.seed, pitch, occluder, rise=rise, even=self.even)
        if self.choice.geometry != "slice":
            return whole
        return box_section(whole, box, here, self.stance.bearing, lambda width: self._covered(width, distance))

    def _covered(self, width: float, distance: float) -> float:
        """How much of a width [m], centred on the axis at a distance [m], the two-way beam covers [m]."""
        half = float(np.arctan2(width / 2, max(distance, 1e-6)))
        return distance * footprint(self.stance, within=half)


def view(scene: Scene, choice: PathChoice, seed: int, stance: Stance, rays: Rays, *, even: bool = False) -> View:
    """The scene as one ping meets it, sampled by the finest that can be made of the recording."""
    # A pulse longer than the scene is deep would blur what the legs still tell apart: spreading, grazing, shadows.
    height = max(0.1, min(stance.transmit_place[2], scene.seabed.depth - stance.transmit_place[2]))
    slant = min(stance.pulse.finest_resolution(stance.sound_speed), LONGEST_CELL * height)
    width = two_way_width(stance.transmit_beams, stance.receive_beams)
    return View(scene, choice, seed, stance, rays, Resolution(slant, width, choice.scatterers_per_cell), even)


def footprint(stance: Stance, within: float = np.pi) -> float:
    """Energy width of the one two-way beam of a slice, up to an azimuth from its axis [rad]."""
    return float(two_way_footprint(stance.transmit_beams, stance.receive_beams, within=within)[0])


def _on_boundary(
    boundary: Boundary, depth: float, law: Law, place: NDArray[np.float64], area: NDArray[np.float64],
    phase: NDArray[np.complex128], key: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """Points of a flat boundary, facing the water."""
    position, normal = np.empty((len(place), 3)), np.zeros((len(place), 3))
    position[:, :2], position[:, 2] = place, depth
    normal[:, 2] = -1.0 if boundary == "seabed" else 1.0
    return Scatterers(boundary, boundary, law, position, normal, area, phase, key)
