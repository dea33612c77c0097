"""Eigenrays: which rays lead from a source to a point in layered water, and what each is like."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation._eigenray_kernel import (
    AMPLITUDE,
    CAUSTICS,
    COLUMNS,
    DELAY,
    LENGTH,
    MOST,
    SIN_ARRIVAL,
    SIN_LAUNCH,
    TURNS,
    solve_points,
)
from insonify.propagation.families import bounces, is_family
from insonify.propagation.layers import Column, column
from insonify.records.legs import Status
from insonify.validity import number, numbers

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

Found = tuple[Floats, Integers, NDArray[np.uint8]]
"""What the kernels fill for one family: rays (n, MOST, COLUMNS), how many (n,), `Status` (n,)."""

_WORDS = {
    Status.CLEAR: "ok",
    Status.SHADOW: "shadow",
    Status.TURNED: "turned",
    Status.BEYOND_CRITICAL: "beyond_critical",
}
_FARTHEST = 1e7
_SHOWN = 12
_AT_ONCE = 4096  # points: their room for rays stays small
_KEYS = ("point", "family", "branch")


@dataclass(frozen=True, slots=True, eq=False)
class Eigenrays:
    """Rays between a source and points, as columns of equal length n; in order of point, family, launch angle.

    A family without a path to a point has one row, with the reason in `status` and NaN in its numbers.
    """

    point: Integers
    """Which point, an index into the flattened broadcast of depths and ranges, shape (n,)."""
    family: NDArray[np.str_]
    """Name of the path family, D direct, S surface, B bottom, ... from the source outward, shape (n,)."""
    branch: Integers
    """Which of the family's rays to that point, from 0, steepest up first, shape (n,)."""
    delay: Floats
    """Travel time [s], shape (n,)."""
    launch: Floats
    """Angle at the source, + down [rad], shape (n,)."""
    arrival: Floats
    """Angle of travel at the point, + down [rad], shape (n,)."""
    amplitude: Floats
    """Pressure by ray-tube spreading re 1 m: no boundary loss, no absorption, no caustic limit [1], shape (n,)."""
    caustics: Integers
    """Caustics touched: each advances the phase by 90 degrees, a factor 1j for exp(+j 2 pi f t); -1 without path,
    shape (n,)."""
    path_length: Floats
    """Length along the ray [m], shape (n,)."""
    turning_points: Integers
    """How often the ray turns between up and down in the water; -1 without path, shape (n,)."""
    status: NDArray[np.str_]
    """"ok"; or why there is no path: "shadow" (refraction bends all rays of the family away), "turned" (its rays turn
    before that bounce or that depth), "beyond_critical" (none arrives between rays that turn at a kink of the profile
    and rays that pass it); shape (n,)."""

    def __len__(self) -> int:
        return self.delay.size

    def __repr__(self) -> str:
        found = self.status == "ok"
        lines = [f"Eigenrays: {found.sum()} paths to {np.unique(self.point).size} points"]
        lines += [f"  {self.point[i]:>5}  {self._line(i)}" for i in range(min(len(self), _SHOWN))]
        if len(self) > _SHOWN:
            lines.append(f"  ... and {len(self) - _SHOWN} rows more")
        return "\n".join(lines)

    def _line(self, i: int) -> str:
        if self.status[i] != "ok":
            return f"{self.family[i]:<4} {self.status[i]}"
        up_down = f"{np.degrees(self.launch[i]):+8.3f} -> {np.degrees(self.arrival[i]):+8.3f} deg"
        extra = f"{self.turning_points[i]} turns, {self.caustics[i]} caustics" if self.turning_points[i] else ""
        level = 20 * np.log10(self.amplitude[i])
        return f"{self.family[i]:<4} {1e3 * self.delay[i]:12.6f} ms  {level:7.2f} dB  {up_down}  {extra}".rstrip()


def eigenrays(
    profile: SoundSpeedProfile,
    *,
    water_depth: float,
    source_depth: float,
    point_depth: ArrayLike,
    range: ArrayLike,
    families: Sequence[str] = ("D", "S", "B", "SB", "BS"),
    method: Literal["exact", "table"] = "exact",
) -> Eigenrays:
    """All rays from a source to points, in water whose sound speed depends on depth alone.

    Rays are arcs of circles between the knots of the profile (Officer 1958, from memory), so that no step length
    and no fan of rays is involved: delays are right to rounding (1e-12 s), and no ray is missed. A point on a boundary
    is reached just before the bounce there: on the seabed D and B coincide. Of a family with more than eight rays to a
    point, which only a sound channel has, those with the fewest turning points are given.

    Args:
        profile: Sound speed against depth; must cover the water.
        water_depth: Depth of the flat seabed [m].
        source_depth: Depth of the source [m], in the water.
        point_depth: Depths of the points [m], in the water, any shape.
        range: Horizontal distances of the points [m], broadcast with the depths.
        families: Path families: D for direct, or bounces off surface (S) and bottom (B) in turn, source first.
        method: "exact", or "table": interpolated between exact rays, faster for many points.

    Returns:
        One row for each path, and one for each family that has no path to a point.

    Raises:
        ValueError: A depth outside the water, a range below 0, an unknown family or method, or a profile that does not
            cover the water; with the way out.
        insonify.propagation.tables.TableError: method="table", and a table failed its comparison with exact rays.
    """
    depth = number("water_depth", water_depth, "m", 0.0, above=True, such_as="20")
    water = column(profile, depth)
    source = number("source_depth", source_depth, "m", 0.0, depth, such_as=f"{depth / 2:g}")
    z = numbers("point_depth", point_depth, "m", 0.0, depth, gaps=False, such_as=f"{depth:g}")
    far = numbers("range", range, "m", 0.0, _FARTHEST, gaps=False, such_as="150")
    z, far = (np.array(values, float).ravel() + 0.0 for values in _together(z, far))  # minus nothing is nothing
    chosen = _checked(families)
    if method == "table":
        from insonify.propagation.table_eigenray import table_eigenrays  # built on this file

        return table_eigenrays(water, source, z, far, chosen)
    if method != "exact":
        raise ValueError(f"method is {method!r}; give 'exact' or 'table'.")
    order = np.lexsort((far, z))  # points of one depth share work
    parts = []
    for k, name in enumerate(chosen):
        for begin in np.arange(0, max(order.size, 1), _AT_ONCE):
            points = order[begin : begin + _AT_ONCE]
            parts.append(_rows(k, points, _solved(water, source, z[points], far[points], name)))
    return _record(chosen, parts)


def gathered(found: dict[str, Found]) -> Eigenrays:
    """Eigenrays from what the kernels filled, family by family.

    Args:
        found: For each family, its rays by point.

    Returns:
        Rows in order of point, family as given, launch angle.
    """
    parts = [_rows(k, np.arange(part[1].size), part) for k, part in enumerate(found.values())]
    return _record(tuple(found), parts)


@dataclass(frozen=True, slots=True)
class _Rows:
    """Some rows of the record to be."""

    point: Integers
    family: Integers
    branch: Integers
    status: NDArray[np.uint8]
    ray: Floats


def _rows(family: int, points: Integers, found: Found) -> _Rows:
    rays, count, status = found
    takes = np.arange(MOST) < np.maximum(count, 1)[:, None]
    which, branch = np.nonzero(takes)
    return _Rows(points[which], np.full(which.size, family), branch, status[which], rays[takes])


def _record(names: tuple[str, ...], parts: list[_Rows]) -> Eigenrays:
    point, family, branch = (np.concatenate([getattr(part, key) for part in parts]) for key in _KEYS)
    order = np.lexsort((branch, family, point))
    status = np.concatenate([part.status for part in parts])[order]
    ray = np.concatenate([part.ray for part in parts])[order]
    there = status == Status.CLEAR
    words = np.array([_WORDS.get(one, "ok") for one in Status])  # by its number

    def real(values: Floats) -> Floats:
        return np.where(there, values, np.nan)

    def whole(values: Floats) -> Integers:
        return np.where(there, values, -1).astype(np.int64)

    return Eigenrays(
        point=point[order],
        family=np.array(names)[family[order]],
        branch=branch[order],
        delay=real(ray[:, DELAY]),
        launch=real(np.arcsin(np.clip(ray[:, SIN_LAUNCH], -1, 1))),
        arrival=real(np.arcsin(np.clip(ray[:, SIN_ARRIVAL], -1, 1))),
        amplitude=real(ray[:, AMPLITUDE]),
        caustics=whole(ray[:, CAUSTICS]),
        path_length=real(ray[:, LENGTH]),
        turning_points=whole(ray[:, TURNS]),
        status=words[status],
    )


def _solved(water: Column, source: float, z: Floats, far: Floats, family: str) -> Found:
    rays = np.zeros((far.size, MOST, COLUMNS))
    count, status = np.zeros(far.size, np.int64), np.zeros(far.size, np.uint8)
    letters = bounces(family)
    first_up = letters[:1] == "S"
    solve_points(water.depth, water.speed, water.plane, source, len(letters), first_up, z, far, rays, count, status)
    return rays, count, status


def _together(z: Floats, far: Floats) -> Sequence[Floats]:
    try:
        return np.broadcast_arrays(z, far)
    except ValueError:
        raise ValueError(
            f"point_depth has shape {z.shape}, range {far.shape}; give shapes that fit together, "
            "such as one depth and many ranges, or depths[:, None] and ranges."
        ) from None


def _checked(families: Sequence[str]) -> tuple[str, ...]:
    if isinstance(families, str):
        raise ValueError(f"families is the word {families!r}; give a list of names, such as ['D', 'S'].")
    if not families:
        raise ValueError("families is empty: no path is followed. Name at least one, such as ['D'].")
    for name in families:
        if not (isinstance(name, str) and is_family(name)):
            raise ValueError(
                f"{name!r} is no path family; write D for the direct path, or letters S (surface) and B (bottom) "
                "in turn, from the source outward, such as BS."
            )
    if len(set(families)) < len(families):
        raise ValueError(f"families names one twice: {list(families)}; name each once.")
    return tuple(families)
