"""The rays that a survey asks for: from tables where they are asked for often, else each solved for.

Seabed and surface are flat, so for each of them a family needs one line of a table. The faces of bodies have thousands
of points over a span of depths, and get a table of that span; a few point targets are solved for. The choice follows
the scene alone, never what of a survey is run, so that a run in parts gives the bits of a run in one.
"""

import threading
import warnings
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import COLUMNS, FOLD_SHARE, MOST, solve_points
from insonify.propagation.families import bounces
from insonify.propagation.layers import Column
from insonify.propagation.rays import Domain
from insonify.propagation.tables import LegTable, TableError, TableWarning, leg_table
from insonify.scene.scatterers import Boundary

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Found:
    """The rays of one family to n points."""

    family: str
    rays: Floats
    """See `insonify.propagation._eigenray_kernel`, shape (n, most rays to one point, COLUMNS)."""
    count: NDArray[np.int64]
    """Rays to each point, shape (n,)."""
    missing: NDArray[np.uint8]
    """Why there is none, shape (n,)."""

    @property
    def folds(self) -> bool:
        """Whether any ray ends near a fold."""
        return bool((self.rays[:, :, FOLD_SHARE] != 0).any())

    @property
    def branches(self) -> int:
        """Rows of legs that they take: one for each ray of the point that has most, and at least one."""
        return max(1, int(self.count.max(initial=0)))


@dataclass(frozen=True)
class Tables:
    """The tables of one survey, each made when it is first asked for."""

    column: Column
    domain: Domain
    bodies: bool
    """Whether there are targets with faces, or point targets at most."""
    made: dict[tuple[str, Boundary, int], LegTable | None] = field(default_factory=dict, repr=False)
    """None where a table failed its test."""
    making: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def rays(self, family: str, boundary: Boundary, source_depth: float, depths: Floats, ranges: Floats) -> Found:
        """All rays of a family to some points.

        Args:
            family: Name of the family.
            boundary: What the points lie on.
            source_depth: Depth of the sonar [m].
            depths: Depths of the points [m], (n,).
            ranges: Horizontal distances of the points [m], (n,).
        """
        table = self._table(family, boundary, source_depth)
        if table is None:
            return exact_rays(self.column, family, source_depth, depths, ranges)
        rays, count, missing = table.rays(source_depth, depths, ranges)
        return Found(family, rays, count, missing)

    def _table(self, family: str, boundary: Boundary, source_depth: float) -> LegTable | None:
        """The table of a family for points on a boundary; None where the exact solver answers."""
        if boundary == "target" and not self.bodies:
            return None
        depths = self.domain.source_depths
        nearest = 0 if self.domain.spanned else int(np.argmin(np.abs(np.array(depths) - source_depth)))
        key = (family, boundary, nearest)
        with self.making:
            if key not in self.made:
                span = depths if self.domain.spanned else (depths[nearest],) * 2
                self.made[key] = self._make(family, boundary, (span[0], span[-1]))
        return self.made[key]

    def _make(self, family: str, boundary: Boundary, source_depths: tuple[float, float]) -> LegTable | None:
        bed = self.column.water_depth
        span = {"seabed": (bed, bed), "surface": (0.0, 0.0)}.get(boundary, self.domain.point_depths)
        try:
            return leg_table(
                self.column, family, source_depths=source_depths, point_depths=span,
                farthest=max(self.domain.farthest, 1.0),
            )  # fmt: skip
        except TableError as error:
            warnings.warn(
                f"{error} The exact solver takes its place: the same, but slower.", TableWarning, stacklevel=2
            )
            return None


def exact_rays(water: Column, family: str, source_depth: float, depths: Floats, ranges: Floats) -> Found:
    """All rays of a family to some points, each solved for.

    Args:
        water: Sound speed between surface and bottom.
        family: Name of the family.
        source_depth: Depth of the sonar [m].
        depths: Depths of the points [m], (n,).
        ranges: Horizontal distances of the points [m], (n,).
    """
    n = len(ranges)
    rays, count, missing = np.zeros((n, MOST, COLUMNS)), np.zeros(n, np.int64), np.zeros(n, np.uint8)
    string = bounces(family)
    solve_points(
        water.depth,
        water.speed,
        source_depth,
        len(string),
        string.startswith("S"),
        depths,
        ranges,
        rays,
        count,
        missing,
    )
    return Found(family, rays, count, missing)
