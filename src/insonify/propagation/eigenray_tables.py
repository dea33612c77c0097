"""Eigenrays of a survey: from tables where many are needed, otherwise from the exact solver.

Where seabed and surface are flat, a family needs a table of one point depth for each of them. Relief and the faces of
bodies have thousands of points over a span of depths, and get a table of that span; point targets are solved exactly.
The choice depends on the scene alone, not on the selected pings, so that a run in parts is bit-identical to one run.
"""

import math
import threading
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.caller_warning import warn_caller
from insonify.propagation._eigenray_kernel import (
    AMPLITUDE,
    CAUSTICS,
    DELAY,
    FOLD_SIDE,
    LENGTH,
    SIN_ARRIVAL,
    SIN_LAUNCH,
    SLOWNESS,
    TURNS,
)
from insonify.propagation.eigenray_record import exact_solutions
from insonify.propagation.eigenray_table import EigenrayTable, TableError, TableWarning, eigenray_table
from insonify.propagation.propagation_model import RayDomain
from insonify.propagation.sound_speed_layers import SoundSpeedLayers
from insonify.scene.scatterers import Boundary

Floats = NDArray[np.float64]

SPAN = 2.0
"""Largest span of source depths of one table, where the sonar's depth varies continuously [m]."""
MAX_TABLES = 4
"""Largest number of such tables in memory for one family and boundary: the least recently used is discarded [1]."""


@dataclass(frozen=True, slots=True)
class FamilyRays:
    """Rays of one family to n points."""

    family: str
    rays: Floats
    """Columns of `insonify.propagation._eigenray_kernel` of all rays, shape (n, most rays to one point, COLUMNS)."""
    count: NDArray[np.int64]
    """Number of rays to each point, shape (n,)."""
    missing_status: NDArray[np.uint8]
    """Reason for no ray, as `LegStatus`, shape (n,)."""

    def single_rays(self) -> "SingleRays | None":
        """The only ray to each point; None if several reach any, or one has touched a caustic or ends near a fold."""
        ray, exists = self.rays[:, 0], self.count > 0
        special = (ray[:, CAUSTICS] > 0) | (ray[:, FOLD_SIDE] != 0)
        if (self.count > 1).any() or (special & exists).any():
            return None
        return SingleRays(
            exists, ray[:, DELAY], ray[:, SIN_LAUNCH], ray[:, SIN_ARRIVAL], ray[:, SLOWNESS], ray[:, AMPLITUDE],
            ray[:, LENGTH], np.asarray(ray[:, TURNS] * exists),
        )  # fmt: skip

    @property
    def branch_count(self) -> int:
        """Number of rows of legs for these rays: the largest number of rays to one point, at least one."""
        return max(1, int(self.count.max(initial=0)))


class SingleRays(NamedTuple):
    """Rays of one family to n points, one to each at most: columns of shape (n,)."""

    exists: NDArray[np.bool_]
    """False for no ray."""
    delay: Floats
    """Travel time [s]."""
    launch_sine: Floats
    """Sine of the launch angle, positive down [1]."""
    arrival_sine: Floats
    """Sine of the angle of travel at the point, positive down [1]."""
    slowness: Floats
    """Horizontal slowness [s/m]."""
    amplitude: Floats
    """Pressure by ray-tube spreading re 1 m [1]."""
    length: Floats
    """Path length [m]."""
    turns: Floats
    """Number of turning points [1]."""


@dataclass(frozen=True)
class EigenrayTables:
    """Tables of one survey, each built on first use."""

    column: SoundSpeedLayers
    domain: RayDomain
    has_bodies: bool
    """True if there are targets with faces, not only point targets."""
    terrain_depths: tuple[float, float]
    """Least and greatest depth of the seabed [m]; equal for a flat seabed."""
    tables: dict[tuple[str, Boundary, int], EigenrayTable | None] = field(default_factory=dict, repr=False)
    """Tables by family, boundary and index of the span of source depths; None where a table failed its check."""
    lock: threading.Lock = field(default_factory=threading.Lock, repr=False)

    def __reduce__(self) -> tuple[type["EigenrayTables"], tuple[Any, ...]]:
        """State without the lock, which each process has of its own."""
        return EigenrayTables, (self.column, self.domain, self.has_bodies, self.terrain_depths, self.tables)

    def rays(self, family: str, boundary: Boundary, source_depth: float, depths: Floats, ranges: Floats) -> FamilyRays:
        """All rays of a family to some points.

        Args:
            family: Name of the family.
            boundary: Boundary or body on which the points lie.
            source_depth: Depth of the sonar [m].
            depths: Depths of the points [m], (n,).
            ranges: Horizontal distances of the points [m], (n,).
        """
        table = self._table(family, boundary, source_depth)
        if table is None:
            return exact_rays(self.column, family, source_depth, depths, ranges)
        return FamilyRays(family, *table.rays(source_depth, depths, ranges))

    def covers_depth(self, family: str, boundary: Boundary, source_depth: float) -> bool:
        """Return True if rays from a depth exist: the table covers it, or the exact solver takes the table's part.

        Args:
            family: Name of the family.
            boundary: Boundary or body on which the points lie.
            source_depth: Depth of the sonar [m].
        """
        table = self._table(family, boundary, source_depth)
        return table is None or table.covers(source_depth)

    def _table(self, family: str, boundary: Boundary, source_depth: float) -> EigenrayTable | None:
        """Table of a family for points on a boundary; None where the exact solver is used."""
        if boundary == "target" and not self.has_bodies:
            return None
        index, span = self._depth_span(source_depth)
        key = (family, boundary, index)
        with self.lock:
            table = self.tables.pop(key) if key in self.tables else self._make(family, boundary, span)
            self.tables[key] = table  # most recently used last
            peers = [table_key for table_key in self.tables if table_key[:2] == key[:2]] if self.domain.is_span else []
            if len(peers) > MAX_TABLES:
                del self.tables[peers[0]]
        return table

    def _depth_span(self, source_depth: float) -> tuple[int, tuple[float, float]]:
        """Index of the table for a sonar depth, and the span of sonar depths of that table [m]."""
        depths = self.domain.source_depths
        if not self.domain.is_span:
            nearest = int(np.argmin(np.abs(np.array(depths) - source_depth)))
            return nearest, (depths[nearest],) * 2
        count = max(1, math.ceil((depths[-1] - depths[0]) / SPAN))
        borders = np.linspace(depths[0], depths[-1], count + 1)
        index = min(max(int(np.searchsorted(borders, source_depth, side="right")) - 1, 0), count - 1)
        return index, (float(borders[index]), float(borders[index + 1]))

    def _make(self, family: str, boundary: Boundary, source_depths: tuple[float, float]) -> EigenrayTable | None:
        point_depths = {"seabed": self.terrain_depths, "surface": (0.0, 0.0)}.get(boundary, self.domain.point_depths)
        try:
            return eigenray_table(
                self.column, family, source_depths=source_depths, point_depths=point_depths,
                max_range=max(self.domain.max_range, 1.0),
            )  # fmt: skip
        except TableError as error:
            warn_caller(f"{error} The exact solver replaces it: the same result, but slower.", TableWarning)
            return None


def exact_rays(water: SoundSpeedLayers, family: str, source_depth: float, depths: Floats, ranges: Floats) -> FamilyRays:
    """All rays of a family to some points, each from the exact solver.

    Args:
        water: Sound speed between surface and bottom.
        family: Name of the family.
        source_depth: Depth of the sonar [m].
        depths: Depths of the points [m], (n,).
        ranges: Horizontal distances of the points [m], (n,).
    """
    return FamilyRays(family, *exact_solutions(water, family, source_depth, depths, ranges))
