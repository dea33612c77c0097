"""Even points of a boundary for one ping: which of the rings' cells are kept, and where they lie about the sonar.

Points lie about the sonar as they did at the ping before, as long as it keeps its depth and its attitude: they are laid
out about the origin, kept, and moved along. What is kept is told by what made it alone, so that it changes no bit.

The keep probability follows the two-way gain re the loudest at the same distance. Where a target stands in the loudest
direction, its shadow takes that away, and what is faint is all there is: at the ranges of its shadow the points are
kept as if the beams were `BEHIND_TARGETS` louder.
"""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from threading import Lock
from typing import Any

import numpy as np
from numpy.typing import NDArray

from insonify.engines import rings
from insonify.engines.glint_spread import glint_spread
from insonify.engines.loudness import Loudness
from insonify.engines.sampling import Resolution
from insonify.engines.shadow_zones import shadow_zone
from insonify.propagation.rays import Rays, Reach
from insonify.propagation.rims import rims
from insonify.scene.lattice import Lattice
from insonify.scene.scene import Scene
from insonify.sonar.stance import Stance

Floats = NDArray[np.float64]
Columns = tuple[Floats, Floats, NDArray[np.uint64]]
"""North and east [m] (n, 2), area that each point stands for [m^2], its key."""

BEHIND_TARGETS = 16.0
"""Factor on the gain at the ranges that a target in the loudest direction casts a shadow on [1]."""
EDGE_STRIPS = 8
"""Strips that cells are cut into across, in and about shadows of targets."""
FEW_STRIPS = 4
"""The same of sparse points."""
EDGE_WIDTHS = 1.0
"""Bearing beside such a shadow that counts to it [widths of the two-way beam]."""
LOUD_ENOUGH = 0.2
"""Two-way gain towards a target re the loudest from which on its shadow takes a part of what is received [1]."""
MOST_KEPT = 250_000
"""Points of one layout up to which they are kept for the next ping."""
LAYOUTS = 8
"""Attitudes, depths and sides of the sonar whose points are kept."""
CELLS = rings.TILE / rings.PIECES
"""Rings of a piece."""
PLACES = 9
"""Decimals to which the ends of the sonar are told about their middle [m]: a sonar that only moves on is the same."""


@dataclass(frozen=True)
class Layout:
    """Even points about one attitude of the sonar, at the origin."""

    cells: rings.Rings
    tiles: NDArray[np.int64]
    loudness: Loudness
    _kept: dict[tuple[int, int], Columns] = field(default_factory=dict)

    @cached_property
    def share(self) -> Floats:
        """Keep probability of the cells of all tiles, but for targets [1], shape (tiles, PIECES, ACROSS)."""
        return self.cells.shares(self.tiles, self.loudness)

    def points(self, share: Floats, rows: slice) -> Columns:
        """The points of some tiles; those of `share` are kept for the next ping.

        Args:
            share: Keep probability of the cells of all tiles [1].
            rows: Which of the tiles.
        """
        key = rows.start, rows.stop
        if share is not self.share or self.share.sum() * CELLS > MOST_KEPT:
            return self.cells.points(self.tiles[rows], share[rows])
        if key not in self._kept:
            self._kept[key] = self.cells.points(self.tiles[rows], share[rows])
        return self._kept[key]


class Layouts:
    """The layouts of the last few attitudes, shared by threads."""

    def __init__(self, most: int = LAYOUTS) -> None:
        """Nothing yet.

        Args:
            most: Number of layouts that are kept.
        """
        self._most, self._lock = most, Lock()
        self._made: OrderedDict[Any, Layout] = OrderedDict()

    def __reduce__(self) -> tuple[type["Layouts"], tuple[int]]:
        """Another process begins with nothing kept."""
        return Layouts, (self._most,)

    def get(self, key: Any, make: Callable[[], Layout]) -> Layout:
        """The layout of a key, made where it is not kept; two threads may both make it, and get the same values."""
        with self._lock:
            if key in self._made:
                self._made.move_to_end(key)
                return self._made[key]
        made = make()
        with self._lock:
            made = self._made.setdefault(key, made)
            while len(self._made) > self._most:
                self._made.popitem(last=False)
        return made


@dataclass(frozen=True, slots=True)
class EvenPoints:
    """The even points of one boundary that one ping meets."""

    scene: Scene
    stance: Stance
    rays: Rays
    depth: float
    """Of the boundary [m]."""
    families: tuple[str, ...]
    """Families that reach it."""
    reach: Reach
    """Distances heard in the window."""
    resolution: Resolution
    rise: float
    """Largest height of the boundary above, or depth below, its mean plane [m]."""
    floor: float
    """Two-way gain below which tiles are left out [1]."""
    thinning: bool
    """True: points of low gain are represented by fewer."""
    layouts: Layouts
    soft: bool = True
    """True: sound is diffracted at the edges of targets."""

    def blocks(self, cut: Callable[[Floats], list[slice]]) -> list[Callable[[], Columns]]:
        """The points, in blocks that are laid out when they are called.

        Args:
            cut: Cuts tiles into blocks, given how many points of each are likely to be kept.
        """
        layout, middle = self.layouts.get(self._key, self._layout), self.stance.middle
        louder = self._louder(layout)
        share = layout.share if louder is None else layout.cells.shares(layout.tiles, layout.loudness, louder)

        def laid(rows: slice) -> Columns:
            place, area, key = layout.points(share, rows)
            return place + middle, area, key

        shaded = self._shaded(layout)
        if not shaded.any():
            return [partial(laid, rows) for rows in cut(share.sum(axis=(1, 2)) * CELLS)]

        def cells_of(some: NDArray[np.int64], strips: int) -> Columns:
            place, area, key = layout.cells.points(layout.tiles[some], share[some], strips)
            return place + middle, area, key

        made: list[Callable[[], Columns]] = []
        fine = FEW_STRIPS if self.resolution.sparse else EDGE_STRIPS
        for some, strips in ((np.flatnonzero(~shaded), 1), (np.flatnonzero(shaded), fine)):
            count = share[some].sum(axis=(1, 2)) * CELLS * strips
            made += [partial(cells_of, some[rows], strips) for rows in cut(count)]
        return made

    def _shaded(self, layout: Layout) -> NDArray[np.bool_]:
        """Tiles in and about shadows of targets that take a part of what any beam receives, (tiles,)."""
        shaded, held, soft = np.zeros(len(layout.tiles), bool), rims(self.scene), self.soft
        if not len(held) or self.depth <= 0:
            return shaded
        offset = held[:, :2] - self.stance.middle
        faced = np.flatnonzero(layout.loudness.gain_at(offset, held[:, 2]) >= LOUD_ENOUGH)
        for row in faced:
            asked = self.scene, self.rays, self.stance, self.families, int(row), self.reach.farthest
            zone = shadow_zone(*asked, soft=soft)
            shaded |= layout.cells.in_zone(layout.tiles, zone, EDGE_WIDTHS * self.resolution.width)
        return shaded

    @property
    def _about(self) -> Stance:
        """The sonar, at the origin."""
        north, east = self.stance.middle
        ends = (self.stance.transmit_place, self.stance.receive_place)
        out, back = (np.round(place - [north, east, 0.0], PLACES) for place in ends)
        return replace(self.stance, transmit_place=out, receive_place=back)

    @property
    def _key(self) -> Any:
        """All that a layout depends on, but for what a scenario has once and for all."""
        here, beams = self._about, (self.stance.transmit_beams, self.stance.ears)
        return (
            self.depth, self.families, self.reach, self.resolution, self.rise, self.floor, self.thinning,
            here.transmit_place.tobytes(), here.receive_place.tobytes(), here.boresight.tobytes(), here.bearing,
            *(part.tobytes() for beam in beams for part in (beam.axes, beam.steer, beam.scale)), here.channel_count,
        )  # fmt: skip

    def _layout(self) -> Layout:
        here, lattice = self._about, Lattice()
        cells = rings.Rings(here, self.depth, self.reach, self.resolution, rise=self.rise)
        glints = glint_spread(self.scene, here.frequency)
        tiles = cells.in_view(self.rays, self.families, self.floor, glints)
        farthest = max(self.reach.farthest, 1.0)
        return Layout(cells, tiles, Loudness(here, self.depth, self.rays, self.families, lattice, farthest,
                                             self.thinning, glints))  # fmt: skip

    def _louder(self, layout: Layout) -> Floats | None:
        """Factor on the gain in each piece of each row of tiles [1], shape (rows, PIECES); None: 1 everywhere."""
        first, last = layout.cells.rows
        louder = np.ones((last + 1 - first, rings.PIECES))
        circles = rims(self.scene)
        if not len(circles) or not self.thinning:
            return None
        offset = circles[:, :2] - self.stance.middle
        faced = layout.loudness.gain_at(offset, circles[:, 2]) >= 1
        edges = (first + np.arange(louder.size + 1) / rings.PIECES) * rings.TILE * layout.cells.slant
        for (north, east), (_, _, radius, top, base) in zip(offset[faced], circles[faced], strict=True):
            near, far = self._shadow(float(np.hypot(north, east)), radius, min(top, base))
            louder.reshape(-1)[(edges[1:] >= near) & (edges[:-1] <= far)] = BEHIND_TARGETS
        return None if (louder == 1).all() else louder

    def _shadow(self, distance: float, radius: float, top: float) -> tuple[float, float]:
        """Slant ranges of the ground from a target to the end of its shadow, on the mean plane [m]."""
        height = self.reach.height
        shallowest = min(self.stance.transmit_place[2], self.stance.receive_place[2])
        below = min(top, self.depth) - shallowest
        back = distance + radius
        end = back * height / below if below > 0 else np.inf
        return float(np.hypot(max(distance - radius, 0.0), min(below, height))), float(np.hypot(end, height))
