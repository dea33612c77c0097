"""Record of eigenrays: columns of rays between a source and points, as the exact solver or a table fills them."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify.propagation._eigenray_kernel import (
    AMPLITUDE,
    CAUSTICS,
    COLUMNS,
    DELAY,
    LENGTH,
    MAX_RAYS,
    SIN_ARRIVAL,
    SIN_LAUNCH,
    TURNS,
    RaySolutions,
    solve_eigenrays,
)
from insonify.propagation.families import family_bounces
from insonify.propagation.sound_speed_layers import SoundSpeedLayers
from insonify.records.legs import LegStatus

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_STATUS_NAMES = {
    LegStatus.CLEAR: "ok",
    LegStatus.SHADOW: "shadow",
    LegStatus.TURNED: "turned",
    LegStatus.BEYOND_CRITICAL: "beyond_critical",
}
_PRINTED_ROWS = 12
_INDEX_COLUMNS = ("point", "family", "branch")


@dataclass(frozen=True, slots=True, eq=False)
class Eigenrays:
    """Rays between a source and points, as columns of equal length n; in order of point, family, launch angle.

    A family without a path to a point has one row, with the reason in `status` and NaN in its numbers.

    Example:
        >>> warm_above = insonify.ocean.SoundSpeedProfile([0.0, 20.0], [1510.0, 1500.0])  # a shadow from 251 m on
        >>> eigenrays(warm_above, water_depth=20, source_depth=5, point_depth=1, range=[240, 260], families=["D"])
        Eigenrays: 1 path to 2 points
            0  D      159.078635 ms   -47.61 dB    -3.233 ->   +1.323 deg  1 turn, 0 caustics
            1  D    shadow
    """

    point: Integers
    """Index of the point in the flattened broadcast of depths and ranges, shape (n,)."""
    family: NDArray[np.str_]
    """Name of the path family, D direct, S surface, B bottom, ... from the source outward, shape (n,)."""
    branch: Integers
    """Number of the ray among its family's to that point, from 0, steepest up first, shape (n,)."""
    delay: Floats
    """Travel time [s], shape (n,)."""
    launch_angle: Floats
    """Angle at the source, + down [rad], shape (n,)."""
    arrival_angle: Floats
    """Angle of travel at the point, + down [rad], shape (n,)."""
    amplitude: Floats
    """Pressure by ray-tube spreading re 1 m: no boundary loss, no absorption, no caustic limit [1], shape (n,)."""
    caustics: Integers
    """Caustics touched: each advances the phase by 90 degrees, a factor 1j for exp(+j 2 pi f t); -1 without path,
    shape (n,)."""
    path_length: Floats
    """Length along the ray [m], shape (n,)."""
    turning_points: Integers
    """Number of turns between up and down in the water; -1 without path, shape (n,)."""
    status: NDArray[np.str_]
    """"ok"; or the reason for no path: "shadow" (refraction keeps all rays of the family away), "turned" (its rays turn
    before that bounce or that depth), "beyond_critical" (none arrives between rays that turn at a kink of the profile
    and rays that pass it); shape (n,)."""

    def __len__(self) -> int:
        return self.delay.size

    def __repr__(self) -> str:
        exists = self.status == "ok"
        lines = [f"Eigenrays: {_counted(int(exists.sum()), 'path')} to {_counted(np.unique(self.point).size, 'point')}"]
        lines += [f"  {self.point[i]:>5}  {self._line(i)}" for i in range(min(len(self), _PRINTED_ROWS))]
        if len(self) > _PRINTED_ROWS:
            lines.append(f"  ... and {len(self) - _PRINTED_ROWS} rows more")
        return "\n".join(lines)

    def _line(self, i: int) -> str:
        if self.status[i] != "ok":
            return f"{self.family[i]:<4} {self.status[i]}"
        up_down = f"{np.degrees(self.launch_angle[i]):+8.3f} -> {np.degrees(self.arrival_angle[i]):+8.3f} deg"
        turns, caustics = _counted(int(self.turning_points[i]), "turn"), _counted(int(self.caustics[i]), "caustic")
        extra = f"{turns}, {caustics}" if self.turning_points[i] else ""
        level = 20 * np.log10(self.amplitude[i])
        return f"{self.family[i]:<4} {1e3 * self.delay[i]:12.6f} ms  {level:7.2f} dB  {up_down}  {extra}".rstrip()


def _counted(number: int, thing: str) -> str:
    """A number of things, such as "1 turn" and "2 turns"."""
    return f"{number} {thing}" if number == 1 else f"{number} {thing}s"


@dataclass(frozen=True, slots=True)
class _RecordRows:
    """Rows of one family for a record: columns as in `Eigenrays`, but family rows, status codes and kernel rays."""

    point: Integers
    family: Integers  # row in the families of the record
    branch: Integers
    status: NDArray[np.uint8]  # `LegStatus`
    ray: Floats  # columns of `_eigenray_kernel`, (rows, COLUMNS)


def no_rays(n: int, max_rays: int = MAX_RAYS) -> RaySolutions:
    """Solutions for n points without a ray, with capacity for `max_rays` to each."""
    return RaySolutions(np.zeros((n, max_rays, COLUMNS)), np.zeros(n, np.int64), np.zeros(n, np.uint8))


def exact_solutions(
    water: SoundSpeedLayers, family: str, source_depth: float, point_depth: Floats, ranges: Floats
) -> RaySolutions:
    """All rays of a family to n points, each from the exact solver.

    Args:
        water: Sound speed between surface and bottom.
        family: Name of the family.
        source_depth: Depth of the source [m].
        point_depth: Depths of the points [m], shape (n,).
        ranges: Horizontal distances of the points [m], shape (n,).
    """
    solutions = no_rays(len(ranges))
    solve_eigenrays(water, source_depth, family_bounces(family), point_depth, ranges, solutions)
    return solutions


def eigenray_record(families: tuple[str, ...], solutions: Iterable[tuple[int, Integers, RaySolutions]]) -> Eigenrays:
    """Eigenrays from solutions of the kernels.

    Args:
        families: Names of the families, in the order of the record.
        solutions: Row of a family in `families`, indices of some points, and the rays of that family to them.

    Returns:
        Rows in order of point, family as given, launch angle.
    """
    parts = [_rows(*part) for part in solutions]
    point, family, branch = (np.concatenate([getattr(part, key) for part in parts]) for key in _INDEX_COLUMNS)
    order = np.lexsort((branch, family, point))
    status = np.concatenate([part.status for part in parts])[order]
    ray = np.concatenate([part.ray for part in parts])[order]
    exists = status == LegStatus.CLEAR
    status_names = np.array([_STATUS_NAMES.get(code, "ok") for code in LegStatus])  # by its number

    def real(values: Floats) -> Floats:
        return np.where(exists, values, np.nan)

    def whole(values: Floats) -> Integers:
        return np.where(exists, values, -1).astype(np.int64)

    return Eigenrays(
        point=point[order], family=np.array(families)[family[order]], branch=branch[order], delay=real(ray[:, DELAY]),
        launch_angle=real(np.arcsin(np.clip(ray[:, SIN_LAUNCH], -1, 1))),
        arrival_angle=real(np.arcsin(np.clip(ray[:, SIN_ARRIVAL], -1, 1))), amplitude=real(ray[:, AMPLITUDE]),
        caustics=whole(ray[:, CAUSTICS]), path_length=real(ray[:, LENGTH]), turning_points=whole(ray[:, TURNS]),
        status=status_names[status],
    )  # fmt: skip


def _rows(family: int, points: Integers, solutions: RaySolutions) -> _RecordRows:
    """Rows of one family: all rays to each point, or one row without a ray."""
    rays, count, status = solutions
    is_row = np.arange(MAX_RAYS) < np.maximum(count, 1)[:, None]
    row, branch = np.nonzero(is_row)
    return _RecordRows(points[row], np.full(row.size, family), branch, status[row], rays[is_row])
