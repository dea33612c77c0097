"""Slices of azimuth about one end of the sonar, and the ground along the middle line of each.

Ground is walked on the map of the bed, whose cells follow the split alone: shadows do not depend on how densely
scatterers lie. A slice is a quarter of the shortest wave wide where it ends, or a third of the finest beam where that
is wider. A point of the ground is lit where the ground of its slice's middle line is.

Where the beams hear less than a tenth of what is loudest at a distance, few scatterers are drawn, see `loudness`:
there slices are merged by fours, so that as many lie in one as in the main lobe.
"""

from collections.abc import Callable
from itertools import pairwise
from threading import Lock
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines import _crest_kernel as crests
from insonify.engines import _slice_kernel as kernel
from insonify.propagation.families import image_depth
from insonify.propagation.launches import Launches, StraightLaunches
from insonify.scene.bed import Bed
from insonify.scene.pages import Pages

Floats = NDArray[np.floating[Any]]
Integers = NDArray[np.int64]
Heard = Callable[[NDArray[np.float64], float, tuple[float, float]], NDArray[np.float64]]
"""Two-way gain [1] that is surely not exceeded about some bearings [rad], given the width of each [rad] and the nearest
and the farthest distance [m]; infinite where that is not told."""

SLICES_PER_WAVE = 4
FIRST_ZONE = 128
"""Slices of the innermost zone; each zone further out is twice as far, in twice as many."""
LINES = 64
"""Lines that are kept together, at most."""
TOGETHER = 256
"""Samples of a line that are looked at before it is asked whether that was enough."""
FAINT = 0.1
"""Two-way gain, re the loudest at its distance, below which slices are merged [1]: a quarter of scatterers is left."""
MERGED = 2
"""Power of two of the slices that are merged."""
ALIKE = 1 << kernel.BLOCK
"""Slices that are merged alike."""
SECTOR = 4 * ALIKE
"""Slices that are looked at together, before each eight are."""


class Skyline(NamedTuple):
    """What hides along some lines, see `_crest_kernel.find_crests`."""

    launch: Floats
    """Launch that meets the ground at each sample, shape (lines, samples)."""
    bound: Floats
    """What hides by it: the smallest up to each sample; of families that rise, the largest from it on."""
    crest: NDArray[np.int32]
    """Number of the crest that was met last, -1 for none."""
    met: Floats
    """Sample, launch, depth behind and reach of each crest, shape (lines, crests, 4)."""


class Lines:
    """The ground along some lines, from the sonar outwards, and the launches that meet it."""

    def __init__(self, depth: Floats, turn: Floats, distance: Floats, launches: Launches, wavelength: float) -> None:
        """Nothing told yet.

        Args:
            depth: Of the ground at even distances [m], shape (lines, samples).
            turn: Bearing of each line from the lattice's [rad], shape (lines,).
            distance: One step, two steps, ... [m], shape (samples,).
            launches: How launch angles belong to places.
            wavelength: Of the sound [m].
        """
        self.depth, self.turn, self._launches, self._wavelength = depth, turn, launches, wavelength
        self._distance = distance
        self._made: dict[str, Skyline] = {}
        self._open: dict[str, bool] = {}
        self._shallowest: Floats | None = None
        self._lock = Lock()

    @property
    def shallowest(self) -> Floats:
        """Least depth along each line [m], shape (lines,)."""
        if self._shallowest is None:
            self._shallowest = np.asarray(np.fmin.reduce(self.depth, axis=1))
        return self._shallowest

    def open(self, family: str) -> bool:
        """Whether surely none of the ground along the lines is hidden from straight rays of a family without bottom."""
        with self._lock:
            if family not in self._open:
                self._open[family] = self._never_rises(family)
            return self._open[family]

    def _never_rises(self, family: str) -> bool:
        rays = self._launches
        if not isinstance(rays, StraightLaunches) or "B" in family:
            return False
        image = np.float32(image_depth(family, rays.source_depth, rays.water_depth))
        return bool(crests.never_rises(self.depth, self._distance, image, TOGETHER))

    def of(self, family: str) -> Skyline:
        """The skyline of rays of a family."""
        with self._lock:
            if family not in self._made:
                self._made[family] = self._walked(family)
            return self._made[family]

    def _walked(self, family: str) -> Skyline:
        launch = self._launches.steepness(family, self._distance, self.depth).astype(np.float32, copy=False)
        bound, crest = np.empty_like(launch), np.empty(launch.shape, np.int32)
        met = np.empty((len(launch), launch.shape[1] // 2 + 1, 4), np.float32)
        crests.find_crests(launch, self._distance, family.endswith("B"), self._wavelength, bound, crest, met)
        return Skyline(launch, bound, crest, met)


Group = tuple[Lines, Integers, Integers]
"""Lines, the points that they pass, and the row of the line of each of these."""


class Slices:
    """The ground about one end of the sonar at one ping; lines are walked when they are asked for."""

    def __init__(
        self, bed: Bed, place: Floats, launches: Launches, *, farthest: float, wavelength: float, finest_slice: float,
        heard: Heard | None = None,
    ) -> None:  # fmt: skip
        """Walk nothing yet; arguments as of `skyline.Skylines`."""
        self._bed, self._launches, self._wavelength = bed, launches, wavelength
        self._lattice, self.step = bed.ground.terrain.lattice, bed.map_cell
        self._here = self._lattice.from_world(np.asarray(place, float)[:2])
        self.edges, self.counts = _zones(max(bed.ground.finest / SLICES_PER_WAVE, self.step), farthest, finest_slice)
        self.starts = np.concatenate([[0], np.cumsum(self.counts)])
        self.merged = np.zeros(int(self.starts[-1]) // ALIKE, np.uint8)
        if heard is not None:
            self._merge(heard)
        self._home, self._row = np.full((2, int(self.starts[-1])), -1, np.int32)
        self._firsts = np.concatenate([[0], np.ceil(self.edges / self.step).astype(np.int64) + 1])
        self._distance = ((np.arange(self._firsts[-1]) + 1) * self.step).astype(np.float32)
        self._lines: list[Lines] = []
        self._lock = Lock()

    def _merge(self, heard: Heard) -> None:
        """Find out in which eights of slices so little is heard that they are merged."""
        inner = 0.0
        for start, count, outer in zip(self.starts, self.counts, self.edges, strict=False):
            width, zone, sectors = 2 * np.pi / count, (inner, float(outer)), np.arange(0, count, SECTOR)

            def loud(first: Integers, slices: int, width: float = width, zone: tuple[float, float] = zone) -> Floats:
                return heard(np.asarray((first + slices / 2) * width + self._lattice.heading), slices * width, zone)

            level, found = loud(sectors, SECTOR), np.zeros(count // ALIKE)
            some = sectors[level >= FAINT * level.max()]
            eights = (some[:, None] + np.arange(0, SECTOR, ALIKE)).ravel()
            found[eights // ALIKE] = loud(eights, ALIKE)
            first = int(start) // ALIKE
            self.merged[first : first + len(found)] = np.where(found < FAINT * found.max(), MERGED, 0)
            inner = float(outer)

    def seen(self, place: Floats, position: Floats) -> tuple[Floats, list[Group]]:
        """Points by the lines that pass them.

        Args:
            place: North and east from where they are seen [m], shape (2 or more,).
            position: North and east of the points [m], shape (n, 2 or more).

        Returns:
            Their horizontal distances [m], shape (n,), and the points by the lines that pass them.
        """
        distance, own = np.empty(len(position)), np.empty(len(position), np.int64)
        wanted = np.zeros(len(self._home), bool)
        missing = kernel.slices_of(
            place, position, self._lattice.heading, self.edges, self.counts, self.starts, self.merged, self._home,
            distance, own, wanted,
        )  # fmt: skip
        if missing:
            self._walk(np.flatnonzero(wanted))
        points, rows = np.empty((2, len(own)), np.int64)
        starts = np.empty(len(self._lines) + 1, np.int64)
        kernel.by_lines(own, self._home, self._row, starts, points, rows)
        cut = starts.tolist()
        return distance, [
            (lines, points[start:stop], rows[start:stop])
            for lines, (start, stop) in zip(self._lines, pairwise(cut), strict=False)
            if stop > start
        ]

    def _walk(self, wanted: Integers) -> None:
        """Walk the lines of some slices, each from the sonar to the outer edge of its zone.

        Args:
            wanted: Numbers of the slices, of merged ones the first, increasing, shape (n,).
        """
        with self._lock:
            wanted = wanted[self._home[wanted] < 0]  # another thread may have walked them
            cut = np.searchsorted(wanted, self.starts).tolist()
            for zone, (start, stop) in enumerate(pairwise(cut)):
                for first in range(start, stop, LINES):
                    some = wanted[first : min(first + LINES, stop)]
                    self._lines.append(self._walked(zone, some))
                    self._row[some] = np.arange(len(some))
                    self._home[some] = len(self._lines) - 1

    def _walked(self, zone: int, wanted: Integers) -> Lines:
        """The lines of some slices of one zone; nearer ground is that of the wider slices of nearer zones."""
        firsts = self._firsts[: zone + 2]
        turn, rays = np.empty((len(wanted), zone + 1)), np.empty((len(wanted), zone + 1, 2))
        kernel.middles(wanted, zone, self.counts, self.starts, self.merged, turn, rays)
        depth = np.empty((len(wanted), int(firsts[-1])), np.float32)
        done = np.zeros(int((-(-np.diff(firsts) // kernel.TOGETHER)).sum()), bool)

        def ask(pages: Pages, missing: NDArray[np.bool_]) -> bool:
            return kernel.sample(self._here, rays, self.step, firsts, self._bed.depth, pages, missing, done, depth)

        ends = np.concatenate([self._here + rays[:, -1] * (self.step * depth.shape[1]), self._here[None]])
        self._bed.asked(ends, ask)
        return Lines(depth, turn[:, -1], self._distance[: depth.shape[1]], self._launches, self._wavelength)


def _zones(across: float, farthest: float, finest_slice: float) -> tuple[Floats, Integers]:
    """Outer edges of the zones [m], and the slices of azimuth in each.

    Args:
        across: Width that slices need not be narrower than [m].
        farthest: Distance that the last zone reaches to [m].
        finest_slice: Width that they need not be narrower than [rad].
    """
    innermost = FIRST_ZONE * across / (2 * np.pi)
    zones = max(0, int(np.ceil(np.log2(max(farthest, innermost) / innermost))))
    edges = innermost * 2.0 ** np.arange(zones + 1)
    edges[-1] = min(edges[-1], max(farthest, innermost))
    widest = 2 ** max(0, int(np.ceil(np.log2(2 * np.pi / finest_slice / FIRST_ZONE))))
    counts = FIRST_ZONE * np.minimum(2 ** np.arange(zones + 1), widest)
    own = np.append(counts[1:] != counts[:-1], True)  # zones of the same slices are one
    return edges[own], counts[own]
