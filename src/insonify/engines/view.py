"""What of the scene one ping can meet, as blocks of scatterers that are drawn only when they are wanted.

The whole seabed and surface in three dimensions, or in a slice the one line of them under the beam, each
point standing for its share of the beam's footprint; and every target. For a coherent reading the points are
drawn and belong to their places; for an expectation they are laid out evenly, and no speckle is left.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from insonify import streams
from insonify.engines._grain_kernel import LONGEST_CELL
from insonify.engines.even_points import Columns, EvenPoints, Layouts
from insonify.engines.glint_spread import GlintSpread, glint_spread
from insonify.engines.loudness import Kept, Loudness
from insonify.engines.sampling import Resolution, filling, reach, survey_speed, tiles_in_view, widest_way
from insonify.engines.targets import target_points
from insonify.engines.volume import Suspended
from insonify.propagation.choice import PathChoice
from insonify.propagation.families import families_for
from insonify.propagation.rays import Rays, Reach
from insonify.scene.bed import Bed
from insonify.scene.facets import facets, laid
from insonify.scene.lattice import Tiles, next_places, reached
from insonify.scene.scatterers import Boundary, Law, Scatterers, lattice_place
from insonify.scene.scene import Scene
from insonify.sonar.footprint import two_way_footprint, two_way_width
from insonify.sonar.stance import Stance
from insonify.units import amplitude_ratio

BLOCK = 49152
"""Scatterers in a block: few enough for the cache, enough to keep Python out of the way."""
LEAST_OF_TILE = 4
"""Scatterers of a block that one more tile counts for at least."""
EVEN_ELONGATION = 2.0
"""Largest side of the square that one point of an expectation stands for, over the length of a cell [1]."""
EVEN_SEED = 0
"""Of the places in their cells at which an expectation is taken: the same for every seed."""

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
    layouts: Layouts = field(default_factory=Layouts)
    """Even points of the last few attitudes."""

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
        if "water" in self.choice.causes and self.scene.water.scatters:
            suspended = Suspended(self.scene, self.choice, self.seed, self.stance, self.resolution)
            made += suspended.blocks(even=self.even)
        return made

    def _boundary(self, boundary: Boundary, depth: float, law: Law) -> list[Block]:
        kept = families_for(boundary, self.choice.followed)
        if not kept:
            return []
        if self.choice.geometry == "slice":
            return self._line(boundary, depth, law, kept)
        # rings follow what one place resolves; between two the cells of the lattice do
        by_rings = self.even and self.stance.receive_survey is None
        return (self._rings if by_rings else self._lattice)(boundary, depth, law, kept)

    def _lattice(self, boundary: Boundary, depth: float, law: Law, kept: tuple[str, ...]) -> list[Block]:
        """Jittered cells of all tiles in reach of window and beams."""
        lattice = self.scene.seabed.lattice
        floor = float(amplitude_ratio(self.choice.beam_floor_db))
        # without random phases, squares much longer than a range cell would show as ripple
        cells = replace(self.resolution, elongation=EVEN_ELONGATION) if self.even else self.resolution
        tiles, density = tiles_in_view(
            self.stance, lattice, depth, self.rays, kept, cells, floor, rise=self.rise(boundary),
            widest=widest_way(self.stance, self.scene.water.fastest), glints=self.glints,
        )  # fmt: skip
        if not len(density):
            return []
        if self.even:
            density = np.ones_like(density)
        stream = streams.SEABED if boundary == "seabed" else streams.SURFACE
        farthest = max(self._reach(boundary, depth, kept).farthest, 1.0)
        loudness = Loudness(self.stance, depth, self.rays, kept, lattice, farthest, self.choice.thinning,
                            self.glints)  # fmt: skip
        own = density
        if not self.even and self.stance.pulse.receiver.synthetic_aperture is None:  # its pings are heard as one
            own = filling(self.stance, lattice, depth, self.resolution, tiles, density)
        bounds = loudness.bounds(tiles, own)
        bed = self.bed

        def drawn(rows: slice) -> Scatterers:
            part = tiles.take(rows)
            kept = loudness.kept(part, bounds.take(rows), EVEN_SEED if self.even else self.seed, stream, depth)
            if self.even:
                even = np.ones(len(kept.area), complex)
                return self._lie(boundary, depth, law, kept.position[:, :2], kept.area, even, kept.key)
            if boundary == "seabed" and bed is not None:
                return self._textured(on_ground(bed, law, part, density[rows], self.seed, stream, kept))
            return self._textured(_level(boundary, law, kept.position, kept.area, kept.phase, kept.key))

        return [partial(drawn, rows) for rows in _shared_out(loudness.expected(bounds))]

    def _rings(self, boundary: Boundary, depth: float, law: Law, kept: tuple[str, ...]) -> list[Block]:
        """Even cells of slant range and azimuth about the sonar."""
        heard = self._reach(boundary, depth, kept)
        if heard.farthest < 0:
            return []
        even = EvenPoints(
            self.scene, self.stance, self.rays, depth, kept, heard, self.resolution, self.rise(boundary),
            float(amplitude_ratio(self.choice.beam_floor_db)), self.choice.thinning, self.layouts,
            self.choice.edges == "fresnel",
        )  # fmt: skip

        def lie(laid: Callable[[], Columns]) -> Scatterers:
            place, area, key = laid()
            return self._lie(boundary, depth, law, place, area, np.ones(len(area), complex), key)

        return [partial(lie, laid) for laid in even.blocks(_shared_out)]

    def _line(self, boundary: Boundary, depth: float, law: Law, kept: tuple[str, ...]) -> list[Block]:
        """Cells along the beam's plane, a few to each cell of slant range: what the farthest ground cell comes to."""
        heard = self._reach(boundary, depth, kept)
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
            return self._lie(boundary, depth, law, place, area, np.exp(2j * np.pi * u[:, 1]), key)

        starts = range(first, last, BLOCK)
        return [partial(drawn, s, min(s + BLOCK, last)) for s in starts]

    @property
    def glints(self) -> GlintSpread | None:
        """Angular spread of legs by a moving surface; None: it is still."""
        return glint_spread(self.scene, self.stance.frequency)

    @property
    def bed(self) -> Bed | None:
        """The ground under the mean plane's points; None for a flat bed."""
        return self.scene.seabed.bed

    def _reach(self, boundary: Boundary, depth: float, kept: tuple[str, ...]) -> Reach:
        """Distances of a boundary that are heard."""
        return reach(self.stance, depth, self.rays, kept, rise=self.rise(boundary))

    def rise(self, boundary: Boundary) -> float:
        """How far a boundary stands above its mean plane, or lies below it [m]."""
        if boundary != "seabed" or self.bed is None:
            return 0.0
        return max(self.bed.depth - self.bed.span[0], self.bed.span[1] - self.bed.depth)

    def _lie(
        self, boundary: Boundary, depth: float, law: Law, place: NDArray[np.float64], area: NDArray[np.float64],
        phase: NDArray[np.complex128], key: NDArray[np.uint64],
    ) -> Scatterers:  # fmt: skip
        """Points of a boundary at places that do not come again: on the ground, or on the plane."""
        if boundary == "seabed" and self.bed is not None:
            ground = self.bed.ground.survey(place[:, 0], place[:, 1])
            return self._textured(facets(depth, ground, law, place, area, phase, key))
        return self._textured(_on_boundary(boundary, depth, law, place, area, phase, key))

    def _textured(self, points: Scatterers) -> Scatterers:
        """Points of a boundary, each standing for as much more ground as the texture makes it answer more."""
        seabed = self.scene.seabed
        if points.boundary != "seabed" or seabed.texture is None:
            return points
        return replace(points, area=points.area * seabed.textured(points.position))

    def _targets(self) -> list[Block]:
        made: list[Block] = []
        for points in target_points(
            self.scene, self.choice, self.seed, self.stance, self.resolution.slant, even=self.even, rays=self.rays,
            resolution=self.resolution,
        ):  # fmt: skip
            size = BLOCK if points.drawn else max(len(points), 1)  # what interferes stays together
            made += [partial(points.take, slice(s, s + size)) for s in range(0, len(points), size)]
        return made


def view(
    scene: Scene, choice: PathChoice, seed: int, stance: Stance, rays: Rays, *, even: bool = False,
    layouts: Layouts | None = None,
) -> View:  # fmt: skip
    """The scene as one ping meets it, sampled by the finest that can be made of the recording."""
    resolution = resolution_of(scene, choice, stance)
    return View(scene, choice, seed, stance, rays, resolution, even, layouts or Layouts())


def resolution_of(scene: Scene, choice: PathChoice, stance: Stance) -> Resolution:
    """Resolution cells of one ping: the finest that can be made of the recording.

    Args:
        scene: The scene.
        choice: Scatterers in each cell.
        stance: The sonar at this ping.
    """
    # A pulse longer than the scene is deep would blur what the legs still tell apart: spreading, grazing, shadows.
    shallowest, deepest = stance.survey_depths
    height = max(0.1, min(shallowest, scene.seabed.depth - deepest))
    speed = survey_speed(scene, stance)
    pulse = stance.pulse.finest_resolution(speed)
    slant = min(pulse, LONGEST_CELL * height)
    width = two_way_width(stance.transmit_beams, stance.resolving_beams or stance.receive_beams)
    here = min(stance.sound_speed, stance.receive_speed)
    if speed != here:
        width = round(width * speed / here, ndigits=9)
    if stance.pulse.receiver.synthetic_aperture is not None:
        width = min(width, speed / stance.frequency / 2 / stance.pulse.receiver.synthetic_aperture)
    return Resolution(slant, width, choice.scatterers_per_cell, pulse)


def footprint(stance: Stance, within: float = np.pi) -> float:
    """Energy width of the one two-way beam of a slice, up to an azimuth from its axis [rad]."""
    return float(two_way_footprint(stance.transmit_beams, stance.receive_beams, within=within)[0])


def _shared_out(count: NDArray[np.float64]) -> list[slice]:
    """Rows of tiles, cut where a block is full.

    Args:
        count: Scatterers of each tile that are likely to be drawn, shape (n,).
    """
    full = np.cumsum(count + LEAST_OF_TILE) // BLOCK
    edges = [0, *(np.flatnonzero(np.diff(full)) + 1).tolist(), len(count)]
    return [slice(first, last) for first, last in pairwise(edges)]


def on_ground(
    bed: Bed, law: Law, tiles: Tiles, density: NDArray[np.float64], seed: int, stream: int, kept: Kept
) -> Scatterers:
    """Scatterers of the lattice on the ground: what is asked about it is kept for the pings to come.

    Of each tile all scatterers that any ping may keep, or the first quarter of them, or a quarter of that, and so on,
    are asked together.

    Args:
        bed: The ground.
        law: How it answers.
        tiles: The tiles.
        density: The largest part of their scatterers that any ping keeps, shape (tiles,).
        seed: Seed of the scatterers.
        stream: Their stream.
        kept: The scatterers; its columns are used for the answer.
    """
    asked, size = reached(kept.tile, kept.rank, density)
    some = tiles.take(asked)

    def places(rows: NDArray[np.int64], known: NDArray[np.int64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return next_places(some.take(rows), seed, stream, known, size[rows])

    key = lattice_place(stream, some.level, some.along, some.across).view(np.int64)
    rows, begin = bed.survey_points(seed, key, size, places)
    start = np.zeros(len(density), np.int64)
    start[asked] = begin
    return laid(bed.depth, (rows, start), law, kept.tile, kept.rank, kept.position, kept.area, kept.phase, kept.key)


def _on_boundary(
    boundary: Boundary, depth: float, law: Law, place: NDArray[np.float64], area: NDArray[np.float64],
    phase: NDArray[np.complex128], key: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """Points of a flat boundary, facing the water."""
    position = np.empty((len(place), 3))
    position[:, :2], position[:, 2] = place, depth
    return _level(boundary, law, position, area, phase, key)


def _level(
    boundary: Boundary, law: Law, position: NDArray[np.float64], area: NDArray[np.float64],
    phase: NDArray[np.complex128], key: NDArray[np.uint64],
) -> Scatterers:  # fmt: skip
    """Points that face the water straight up, or down."""
    normal = np.zeros(position.shape)
    normal[:, 2] = -1.0 if boundary == "seabed" else 1.0
    return Scatterers(boundary, boundary, law, position, normal, area, phase, key)
