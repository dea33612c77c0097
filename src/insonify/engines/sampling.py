"""Where a boundary is sampled, and how finely: by what the sonar can resolve, from the whole track.

The level of each tile follows from its nearest distance to the whole track, never from one ping, so a
place has the same scatterers in every ping. What a ping visits is a choice among these tiles: those that
its window and its beams can reach.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _grain_kernel as kernel
from insonify.engines.glint_spread import GlintSpread
from insonify.propagation.rays import Rays, Reach
from insonify.scene.lattice import BASE_PITCH, FINEST_LEVEL, TILE, Lattice, Tiles
from insonify.scene.scene import Scene
from insonify.sonar.stance import Stance
from insonify.sonar.survey import Survey, distance_to_runs

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

FIRST_TILES = 8
"""Tiles to the farthest distance, at most, that are looked at before any is cut in four."""

SPARSE = 2.0
"""Points to a resolution cell below which even points are sparse [1]."""


@dataclass(frozen=True, slots=True)
class Resolution:
    """What the sonar can tell apart, and how many scatterers it takes to fill such a cell."""

    slant: float
    """Resolution along the slant range, nowhere more than a part of the least distance from a boundary [m]."""
    width: float
    """Width of the finest two-way beam [rad]."""
    per_cell: float
    """Scatterers in each resolution cell [1]."""
    pulse: float = 0.0
    """Resolution along the slant range where nothing but the pulse limits it [m]; 0: `slant` holds everywhere."""
    elongation: float = kernel.ELONGATED
    """Largest side of the square that one scatterer stands for, over the length of a cell on the ground [1]."""

    @property
    def sparse(self) -> bool:
        """True: only as many even points as separate samples, for labels, where more cost more than they bring."""
        return self.per_cell < SPARSE

    @property
    def cell(self) -> kernel.Cell:
        """The same for kernels."""
        return kernel.Cell(
            float(self.slant), float(self.width), float(self.per_cell), float(self.pulse), float(self.elongation)
        )

    def ground(self, distance: Floats, height: float) -> Floats:
        """Length of a resolution cell on the ground [m], at a horizontal distance [m] and height [m]."""
        away = np.asarray(distance, float)
        found = np.empty(away.shape)
        kernel.ground(self.cell, away.ravel(), height, found.reshape(-1))
        return found

    def cell_area(self, distance: Floats, height: float) -> Floats:
        """Largest area that one scatterer may stand for [m^2]; never a square very long against the range cell."""
        away = np.asarray(distance, float)
        found = np.empty(away.shape)
        kernel.cells(self.cell, away.ravel(), height, found.reshape(-1))
        return found

    def coarsest(self, reach: float, height: float) -> float:
        """Bound on all `cell_area` up to some distance [m] at a height [m]: [m^2].

        The area without its limit grows to where the disc below the sonar ends, and is convex beyond.
        """
        slant = max(self.slant, self.pulse)
        whole = Resolution(slant, self.width, self.per_cell)
        edge = (slant / 2 + np.hypot(slant / 2, 2 * height)) / 2
        distance = np.array([np.sqrt(slant * edge / 2), reach])
        return float(np.max(whole.ground(distance, height) * np.hypot(distance, height)) * self.width / self.per_cell)

    def finest(self, nearest: Floats, farthest: Floats, height: float) -> Floats:
        """Smallest `cell_area` between two horizontal distances [m^2]: at either, or where its parts have their least.

        Outwards the ground cell of one pulse gets shorter and the beam wider; their product is least under 45 degrees,
        and under 55 degrees where the cell is limited to a part of the slant range.
        """
        found = np.empty(len(nearest))
        kernel.finest(self.cell, nearest, farthest, height, found)
        return found

    def finest_apart(self, ends: list[tuple[Floats, Floats, float]]) -> Floats:
        """Bound on the smallest cell of a transmitter and a receiver that stand apart [m^2], shape (n,).

        Between them the way out and back grows more slowly along the ground than it does for the farther end alone,
        and no beam is narrower across than that of the nearer end.

        Args:
            ends: Of each end its nearest and its farthest horizontal distance [m], shape (n,), and its height [m].
        """
        lengths = np.empty((len(ends), len(ends[0][0])))
        for row, (nearest, farthest, height) in zip(lengths, ends, strict=True):
            kernel.shortest(self.cell, nearest, farthest, height, row)
        ground = lengths.min(axis=0)
        across = np.minimum.reduce([np.hypot(nearest, height) * self.width for nearest, _, height in ends])
        return np.minimum(ground * across / self.per_cell, (self.elongation * ground) ** 2)


def survey_speed(scene: Scene, stance: Stance) -> float:
    """Smaller one of the sound speeds at the least and the greatest depth of the sonar on its whole track [m/s].

    The same at every ping, where the speed at the sonar's own depth is not: in layered water a sonar that heaves
    would find other cells at each.

    Args:
        scene: Whose water.
        stance: The sonar at any ping.
    """
    return float(np.min(scene.water.speed_at(np.array(stance.survey_depths))))


def survey_height(survey: Survey, boundary_depth: float) -> float:
    """Least height of an end of the sonar above a boundary, or depth below it, on its whole track [m].

    Args:
        survey: Where it goes.
        boundary_depth: Depth of the boundary [m].
    """
    return min(abs(boundary_depth - source) for source in survey.depths)


def widest_way(stance: Stance, fastest: float) -> float:
    """Longest way out and back that is still heard, from one end to the other [m].

    Args:
        stance: The sonar at this ping.
        fastest: Greatest speed of sound in the water [m/s].
    """
    return fastest * stance.heard_delays[1]


def reach(stance: Stance, boundary_depth: float, rays: Rays, families: tuple[str, ...], *, rise: float = 0.0) -> Reach:
    """Distances whose earliest or latest pair of legs falls into the window.

    Args:
        stance: The sonar at this ping.
        boundary_depth: Depth of the boundary [m].
        rays: How sound travels in the scene.
        families: Families that reach the boundary.
        rise: How far the boundary may stand above or lie below its depth [m].

    Returns:
        Horizontal distances [m]; farthest is negative where nothing is heard.
    """
    first, last = stance.heard_delays
    apart = float(np.linalg.norm(stance.transmit_place - stance.receive_place))
    depths = float(stance.transmit_place[2]), float(stance.receive_place[2])
    return rays.reach(depths, boundary_depth, families, (first / 2, last / 2), apart, rise=rise)


def tiles_in_view(
    stance: Stance, lattice: Lattice, boundary_depth: float, rays: Rays, families: tuple[str, ...],
    resolution: Resolution, beam_floor: float, *, rise: float = 0.0, widest: float = np.inf,
    glints: GlintSpread | None = None,
) -> tuple[Tiles, Floats]:  # fmt: skip
    """The tiles of a boundary that one ping can hear, each at the level that the whole track asks for.

    Args:
        stance: The sonar at this ping.
        lattice: Frame of the tiles.
        boundary_depth: Depth of the boundary [m].
        rays: How sound travels in the scene.
        families: Families that reach the boundary.
        resolution: What the sonar can tell apart.
        beam_floor: Two-way pressure gain below which a tile is left out [1].
        rise: How far the boundary may stand above or lie below its depth [m].
        widest: Longest way from one end by way of a place to the other that is heard [m], see `widest_way`.
        glints: How a moving surface spreads the directions of legs; None: it is still.

    Returns:
        Tiles in a fixed order, and the part of their scatterers that fills the sonar's cells [1], shape (n,): cells of
        the lattice come in powers of two.
    """
    heard = reach(stance, boundary_depth, rays, families, rise=rise)
    if heard.farthest < 0:
        return Tiles(*np.empty((3, 0), np.int64)), np.zeros(0)
    here, other = lattice.from_world(stance.transmit_place[:2]), lattice.from_world(stance.receive_place[:2])
    level = max(FINEST_LEVEL, int(np.ceil(np.log2(heard.farthest / (TILE * BASE_PITCH)))) + 1)
    side = TILE * BASE_PITCH * 2.0**level
    grain = _Grain(stance, lattice, boundary_depth, resolution, heard.farthest + side)
    # from tiles that are all too coarse, few enough to be looked at one by one
    while level > FINEST_LEVEL and side * FIRST_TILES > heard.farthest and (side / TILE / 2) ** 2 > grain.coarsest:
        level, side = level - 1, side / 2
    low, high = (np.floor((here + way * heard.farthest) / side).astype(np.int64) for way in (-1, 1))
    along, across = np.empty((2, int(np.prod(high - low + 1))), np.int64)
    kernel.covering(low, high, along, across)
    if stance.receive_survey is None:
        widest = np.inf
    found: list[tuple[Integers, Integers, Integers, Floats]] = []
    while len(along):
        pitch, (centre, place) = float(np.ldexp(BASE_PITCH, level)), np.empty((2, len(along), 2))
        half = TILE * pitch / np.sqrt(2)
        n = kernel.in_reach(pitch, along, across, here, other, heard.nearest, heard.farthest, widest, lattice.frame,
                            centre, place)  # fmt: skip
        bound = beam_bound(
            place[:n], np.full(n, half), stance, boundary_depth, rays, families, rise=rise, enough=beam_floor,
            glints=glints,
        )  # fmt: skip
        n = kernel.loud(bound, beam_floor, along, across, centre)
        finest = grain.finest(centre[:n], np.full(n, half))
        *kept, density, along, across = kernel.divided(level, along[:n], across[:n], finest)
        found.append((np.full(len(density), level), *kept, density))
        level -= 1
    *columns, density = (np.concatenate(column) for column in zip(*found, strict=True))
    return Tiles(*columns), density


def filling(
    stance: Stance, lattice: Lattice, boundary_depth: float, resolution: Resolution, tiles: Tiles, most: Floats
) -> Floats:  # fmt: skip
    """Part of the scatterers of some tiles that fills the cells of one ping, from where it is: shape (n,).

    A tile is as fine as the whole track needs it. A ping that is right above it, or far away, has larger cells there.

    Args:
        stance: The sonar at this ping.
        lattice: Frame of the tiles.
        boundary_depth: Depth of the boundary [m].
        resolution: What the sonar can tell apart.
        tiles: The tiles.
        most: Part that fills the cells of any ping, shape (n,): it is not exceeded.
    """
    half, spans = TILE * tiles.pitch / np.sqrt(2), []
    for place in (stance.transmit_place, stance.receive_place)[: 1 if stance.together else 2]:
        away = np.linalg.norm(tiles.centre - lattice.from_world(place[:2]), axis=-1)
        spans.append((np.maximum(away - half, 0), away + half, abs(boundary_depth - float(place[2]))))
    area = resolution.finest(*spans[0]) if stance.together else resolution.finest_apart(spans)
    return np.minimum(tiles.pitch**2 / area, most)


@kernel.cells.stand_in
def _cells(cell: kernel.Cell, distance: Floats, height: float, found: Floats) -> None:
    """Largest area that one scatterer may stand for [m^2], as the kernel `cells`, into found (n,)."""
    slant_range = np.hypot(distance, height)
    slant = np.maximum(cell.slant, np.minimum(cell.pulse, kernel.LONGEST_CELL * slant_range))
    ground = np.minimum(slant * slant_range / np.maximum(distance, 1e-9), np.sqrt(2 * slant_range * slant))
    found[:] = np.minimum(ground * (slant_range * cell.width) / cell.per_cell, (cell.elongation * ground) ** 2)


class _Grain:
    """How fine the cells of a boundary must be at a place, from the whole track of each platform."""

    def __init__(
        self, stance: Stance, lattice: Lattice, boundary_depth: float, resolution: Resolution, reach: float
    ) -> None:
        """Look up what of each track can matter to one ping.

        Args:
            stance: The sonar at this ping.
            lattice: Frame of the tiles.
            boundary_depth: Depth of the boundary [m].
            resolution: What the sonar can tell apart.
            reach: Distance of the farthest tile from the transmitter [m].
        """
        self.resolution = resolution
        self.coarsest = resolution.coarsest(reach, survey_height(stance.surveys[0], boundary_depth))
        """No cell within reach is larger [m^2]."""
        here, apart = stance.transmit_place[:2], float(np.linalg.norm(stance.transmit_place - stance.receive_place))
        self.ends = [
            (
                lattice.from_world(one.near(place, reach + more)), lattice.from_world(one.outermost), one.wander,
                survey_height(one, boundary_depth),
            )
            for one, place, more in zip(stance.surveys, (here, stance.receive_place[:2]), (0.0, apart), strict=False)
        ]  # fmt: skip

    def finest(self, centre: Floats, half_diagonal: Floats) -> Floats:
        """Smallest area that one scatterer may stand for anywhere in some tiles [m^2], shape (n,)."""
        spans = []
        for runs, outermost, wander, height in self.ends:
            away, nearest, farthest = distance_to_runs(centre, runs), *np.empty((2, len(centre)))
            kernel.spans(centre, half_diagonal, away, outermost, wander, nearest, farthest)
            spans.append((nearest, farthest, height))
        return self.resolution.finest(*spans[0]) if len(spans) == 1 else self.resolution.finest_apart(spans)


def beam_bound(
    centre: Floats, half_diagonal: Floats, stance: Stance, boundary_depth: float, rays: Rays,
    families: tuple[str, ...], *, rise: float = 0.0, enough: float = np.inf, glints: GlintSpread | None = None,
) -> Floats:  # fmt: skip
    """Upper bound of the two-way gain anywhere near some places of a boundary, by any pair of families.

    Args:
        centre: North and east of the places [m], shape (n, 2).
        half_diagonal: How far around them the bound must hold [m], shape (n,).
        stance: The sonar.
        boundary_depth: Depth of the boundary [m].
        rays: How sound travels in the scene.
        families: Families that reach the boundary.
        rise: How far the boundary may stand above or lie below its depth [m].
        enough: Gain at which no further family need be looked at [1]: where it is reached, less than the bound may
            be told.
        glints: How a moving surface spreads the directions of legs; None: it is still.

    Returns:
        Two-way pressure gain [1], shape (n,).
    """
    transmit, receive = np.zeros(len(centre)), np.zeros(len(centre))
    if not len(centre):
        return transmit
    ends = [(stance.transmit_place, stance.transmit_beams, transmit)]
    if stance.together and stance.alike:
        receive = transmit
    else:
        ends.append((stance.receive_place, stance.ears, receive))
    rows = np.arange(len(centre))
    for name in families:
        for place, beams, best in ends:
            cones = rays.cones(name, place, centre[rows], half_diagonal[rows], boundary_depth, rise=rise)
            one = np.where(cones.there, beams.bound(cones.way, cones.margin), 0.0)
            if glints is not None and "S" in name:
                spread = glints.bound(beams, name, place, centre[rows], cones, boundary_depth)
                one = np.where(cones.there, np.maximum(one, spread), 0.0)
            best[rows] = np.maximum(best[rows], one)
        rows = rows[transmit[rows] * receive[rows] < enough]
        if not len(rows):
            break
    return transmit * receive
