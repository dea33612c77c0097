"""Which ground is seen, and which lies in the shadow of nearer ground, by straight or by bent rays.

Rays of one family from one source do not cross before a caustic. Along one azimuth the ray to a far cell therefore
passes over the ground of a nearer one, or under it, as their launch angles are ordered: launch angle takes the place
of the elevation from which a horizon is drawn in straight-line sight, and one pass outward with a running minimum
tells all shadows. For paths that bounce, the order is that of the rays beyond their last bounce: seen from the image
source above the surface it is the same, from the one below the bed it is turned round, and only ground beyond the
bounce can cut. What is cut before its last bounce is told by the visibility of the bounce point.

With straight rays this is the horizon of terrain rendering; Max (1988), "Horizon mapping", The Visual Computer 4,
109, is from memory.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.propagation._horizon_kernel import sweep
from insonify.propagation.families import bounces, is_family
from insonify.validity import numbers

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Horizon:
    """What can be seen of the cells along one azimuth or several, by one family of paths."""

    visible: NDArray[np.bool_]
    """Whether a path of the family gets there uncut, shape (..., n)."""
    cutter: NDArray[np.int64]
    """Cell whose ground cuts it: that of the horizon in front; -1 where none does, shape (..., n)."""

    def __repr__(self) -> str:
        """How much is seen."""
        share = float(np.mean(self.visible)) if self.visible.size else 0.0
        return f"Horizon: {self.visible.shape[-1]} cells along each azimuth, {share:.0%} visible"


def horizon(
    ranges: ArrayLike, launch: ArrayLike, *, family: str = "D", points: ArrayLike | None = None,
    bounce: ArrayLike | None = None, before: Sequence[Horizon] = (),
) -> Horizon:  # fmt: skip
    """The cells that paths of one family reach uncut by the ground in front of them.

    Args:
        ranges: Horizontal distances of the cells, increasing [m], shape (n,).
        launch: Launch angle, + down, of the family's ray to the ground of each cell [rad], shape (..., n), one row
            for each azimuth; anything that grows with it does as well, such as its sine. NaN where no ray gets
            there: such a cell is not visible and cuts nothing. One branch at a time where there are several.
        family: Which paths: D, S, B, SB, ...
        points: Launch angles to the points that are looked at, where they are not the ground itself but lie above
            it, such as those on the surface, shape of `launch`.
        bounce: Range of each bounce of the ray to each point, from the source outward [m], shape (bounces, ..., n);
            needed for families that end with B, and with `before`.
        before: What is seen of the bounce points by the path up to them, for as many bounces as are to be tested,
            from the source outward: of the ground by D for the first bounce of B, and so on.

    Returns:
        Visibility, shape of `launch`. A ray that just touches counts as seen.

    Raises:
        ValueError: Ranges do not increase, shapes do not fit, no such family, or bounces are missing.
    """
    reach = numbers("ranges", ranges, "m", gaps=False)
    if reach.ndim != 1 or np.any(np.diff(reach) <= 0):
        raise ValueError("ranges must be one list of increasing distances; sort the cells along the azimuth.")
    ground = _shaped("launch", launch, reach.size)
    aim = ground if points is None else _shaped("points", points, reach.size, ground.shape)
    if not is_family(family):
        raise ValueError(f"{family!r} is not a path family; write D, or letters S and B in turn, such as BS.")
    legs = bounces(family)
    hops = None if bounce is None else _hops(bounce, len(legs), aim.shape)
    if hops is None and (legs.endswith("B") or before):
        raise ValueError(f"bounce is missing; paths {family} need the ranges at which their rays bounce.")
    if len(before) > len(legs):
        raise ValueError(f"before tells of {len(before)} bounces; paths {family} have {len(legs)}.")
    seen = _last_segment(reach, ground, aim, legs, hops)
    if hops is not None:
        for earlier, hop in zip(reversed(before), hops[: len(before)][::-1], strict=True):
            seen = _through(seen, earlier, reach, hop)
    return seen


def _last_segment(reach: Floats, ground: Floats, aim: Floats, legs: str, hops: Floats | None) -> Horizon:
    """Visibility from the last bounce on."""
    # a key grows with the depth of the ray beyond its last bounce, whichever way it was launched
    sense = (-1.0 if legs.startswith("S") else 1.0) * (-1.0 if legs.endswith("B") else 1.0)
    rows = (-1, reach.size)
    starts = np.full(aim.shape, -np.inf)
    if hops is not None and legs.endswith("B"):
        starts = np.where(np.isnan(hops[-1]), np.inf, hops[-1])
    visible, cutter = np.empty(aim.shape, np.bool_), np.empty(aim.shape, np.int64)
    sweep(
        reach, (sense * ground).reshape(rows), (sense * aim).reshape(rows), starts.reshape(rows),
        visible.reshape(rows), cutter.reshape(rows),
    )  # fmt: skip
    return Horizon(visible, cutter)


def _through(seen: Horizon, earlier: Horizon, reach: Floats, hop: Floats) -> Horizon:
    """What remains visible where the bounce point lies in a shadow itself."""
    if reach.size == 0:
        return seen
    middles = (reach[1:] + reach[:-1]) / 2
    there = np.isfinite(hop) & (hop >= reach[0])
    cell = np.searchsorted(middles, np.where(there, hop, reach[0]))
    cut = np.where(there, np.take_along_axis(earlier.cutter, cell, axis=-1), -1)
    return Horizon(seen.visible & (cut < 0), np.where(cut >= 0, cut, seen.cutter))


def _shaped(name: str, value: ArrayLike, cells: int, shape: tuple[int, ...] | None = None) -> Floats:
    """Angles of shape (..., cells)."""
    angle = np.ascontiguousarray(numbers(name, value, "rad"))
    if angle.shape[-1:] != (cells,) or (shape is not None and angle.shape != shape):
        wanted = f"(..., {cells})" if shape is None else str(shape)
        raise ValueError(f"{name} has shape {angle.shape}; give {wanted}, an angle for each cell.")
    return angle


def _hops(bounce: ArrayLike, count: int, shape: tuple[int, ...]) -> Floats:
    """Bounce ranges of shape (bounces, ..., n)."""
    hops = numbers("bounce", bounce, "m")
    if hops.shape != (count, *shape):
        raise ValueError(f"bounce has shape {hops.shape}; give {(count, *shape)}, a range for each bounce and cell.")
    return hops
