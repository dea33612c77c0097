"""Eigenrays: all rays from a source to points in layered water."""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.profile import SoundSpeedProfile
from insonify.propagation._eigenray_kernel import RaySolutions
from insonify.propagation.eigenray_record import Eigenrays, eigenray_record, exact_solutions, no_rays
from insonify.propagation.eigenray_table import eigenray_table
from insonify.propagation.families import is_family
from insonify.propagation.sound_speed_layers import SoundSpeedLayers, sound_speed_layers
from insonify.validity import require_number, require_numbers

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_FARTHEST = 1e7  # greatest horizontal distance [m]
_AT_ONCE = 4096  # points that are solved in one call: limits the memory for rays


def eigenrays(
    profile: SoundSpeedProfile, *, water_depth: float, source_depth: float, point_depth: ArrayLike, range: ArrayLike,
    families: Sequence[str] = ("D", "S", "B", "SB", "BS"), method: Literal["exact", "table"] = "exact",
) -> Eigenrays:  # fmt: skip
    """All rays from a source to points, in water whose sound speed depends on depth alone.

    Rays are arcs of circles between the knots of the profile (Officer 1958, not verified), without step length
    or ray fan: delays are exact to rounding, within 2e-16 s of closed forms in 40 digits for direct rays in one
    gradient up to 250 m, and within 1e-11 s of an independent solution for rays in random layers. A point on a
    boundary is reached just before the bounce there: on the seabed D and B coincide. For a family with more than eight
    rays to a point, which requires a sound channel, those with the fewest turning points are returned.

    Args:
        profile: Sound speed against depth; must cover the water.
        water_depth: Depth of the flat seabed [m].
        source_depth: Depth of the source [m], in the water.
        point_depth: Depths of the points [m], in the water, any shape.
        range: Horizontal distances of the points [m], broadcast with the depths.
        families: Path families: D for direct, or reflections off surface (S) and bottom (B) in turn, source first.
        method: "exact", or "table": interpolated between exact rays, faster for many points.

    Returns:
        One row for each path, and one for each family that has no path to a point.

    Raises:
        ValueError: A depth outside the water, a range below 0, an unknown family or method, or a profile that does not
            cover the water.
        insonify.propagation.eigenray_table.TableError: method="table", and a table failed its comparison with exact
        rays.

    Example:
        >>> isovelocity = insonify.ocean.SoundSpeedProfile([0.0, 20.0], [1500.0, 1500.0])
        >>> eigenrays(isovelocity, water_depth=20, source_depth=11, point_depth=19, range=150, families=["D", "S"])
        Eigenrays: 2 paths to 1 point
            0  D      100.142121 ms   -43.53 dB    +3.053 ->   +3.053 deg
            0  S      101.980390 ms   -43.69 dB   -11.310 ->  +11.310 deg
    """
    depth = require_number("water_depth", water_depth, "m", 0.0, exclude_low=True, example="20")
    water = sound_speed_layers(profile, depth)
    source = require_number("source_depth", source_depth, "m", 0.0, depth, example=f"{depth / 2:g}")
    z = require_numbers("point_depth", point_depth, "m", 0.0, depth, allow_nan=False, example=f"{depth:g}")
    ranges = require_numbers("range", range, "m", 0.0, _FARTHEST, allow_nan=False, example="150")
    z, ranges = (np.array(values, float).ravel() + 0.0 for values in _together(z, ranges))  # -0.0 becomes 0.0
    chosen = _checked(families)
    if method == "table":
        points = np.arange(ranges.size)
        return eigenray_record(
            chosen, [(k, points, _table_rays(water, source, z, ranges, name)) for k, name in enumerate(chosen)]
        )
    if method != "exact":
        raise ValueError(f"method is {method!r}; give 'exact' or 'table'.")
    order = np.lexsort((ranges, z))  # points of one depth share work
    parts = []
    for k, name in enumerate(chosen):
        for begin in np.arange(0, max(order.size, 1), _AT_ONCE):
            points = order[begin : begin + _AT_ONCE]
            parts.append((k, points, exact_solutions(water, name, source, z[points], ranges[points])))
    return eigenray_record(chosen, parts)


def _table_rays(water: SoundSpeedLayers, source: float, z: Floats, ranges: Floats, family: str) -> RaySolutions:
    """Rays of one family to all points, read from a table that spans them."""
    solutions = no_rays(ranges.size)
    if ranges.size:
        span = float(z.min()), float(z.max())
        table = eigenray_table(
            water, family, source_depths=(source, source), point_depths=span, max_range=max(float(ranges.max()), 1.0)
        )
        table_rays, count, status = table.rays(source, z, ranges)
        solutions.rays[:, : table_rays.shape[1]] = table_rays
        return RaySolutions(solutions.rays, count, status)
    return solutions


def _together(z: Floats, ranges: Floats) -> Sequence[Floats]:
    try:
        return np.broadcast_arrays(z, ranges)
    except ValueError:
        raise ValueError(
            f"point_depth has shape {z.shape}, range {ranges.shape}; give shapes that fit together, "
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
