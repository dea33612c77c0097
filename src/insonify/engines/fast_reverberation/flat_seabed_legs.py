"""Legs of all families to a flat seabed over horizontal distance, for the plan of a ping."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from insonify.engines.fast_reverberation import refraction_columns as column
from insonify.engines.fast_reverberation._refraction_kernel import interpolate_refraction
from insonify.engines.radial_tables import RefractionTable

Floats = NDArray[np.float64]


class FlatSeabedLegs(NamedTuple):
    """Legs of f families to n horizontal distances on a flat seabed."""

    delay: Floats
    """Travel time [s], (f, n)."""
    length: Floats
    """Length of the straight ray from the image source [m], (f, n)."""
    arrival_sine: Floats
    """Vertical component, positive down, of the direction of travel at the point [1], (f, n)."""
    bounce_sine: Floats
    """Sine of the grazing angle at the mean seabed, for the reflections on the leg [1], (f, n)."""
    climb: Floats
    """Horizontal distance times tangent of the launch angle, positive towards the first boundary [m], (f, n)."""
    pressure: Floats
    """Pressure re that along the straight ray, with spreading and absorption [1], (f, n)."""


def flat_seabed_legs(
    refraction: RefractionTable, image_depths: Floats, sound_speed: float, distance: Floats, depth: float
) -> FlatSeabedLegs:
    """Legs to a flat seabed.

    Args:
        refraction: Refraction table of the families; without nodes in water of one sound speed.
        image_depths: Depth of the image source of each family [m], (f,).
        sound_speed: Sound speed of straight rays [m/s].
        distance: Horizontal distances [m], (n,).
        depth: Depth of the flat seabed [m].
    """
    height = np.repeat((depth - image_depths)[:, None], len(distance), axis=1)
    length = np.hypot(distance, height)
    delay, sine = length / sound_speed, height / length
    if refraction.nodes.size == 0:
        return FlatSeabedLegs(delay, length, sine, sine, height, np.ones_like(length))
    depths = np.full(len(distance), depth)
    change = np.stack([_columns(refraction, f, distance, depths) for f in range(len(image_depths))])
    launch = np.clip(sine + change[..., column.DEPARTURE], -1 + 1e-12, 1 - 1e-12)
    return FlatSeabedLegs(
        delay + change[..., column.DELAY], length, np.clip(sine + change[..., column.ARRIVAL], -1.0, 1.0),
        np.clip(sine + change[..., column.GRAZING], 0.0, 1.0), distance * launch / np.sqrt(1 - launch**2),
        np.maximum(change[..., column.PRESSURE], 0.0),
    )  # fmt: skip


def relative_pressure(refraction: RefractionTable, f: int, distance: Floats, depth: Floats) -> Floats:
    """Pressure of refracted legs re straight ones, with spreading and absorption [1], (n,).

    Args:
        refraction: Refraction table.
        f: Row of the family.
        distance: Horizontal distances of the points [m], (n,).
        depth: Depths of the points [m], (n,).
    """
    return np.asarray(_columns(refraction, f, distance, depth)[:, column.PRESSURE])


def bounce_ranges(refraction: RefractionTable, f: int, bounces: int, distance: Floats, depth: Floats) -> Floats:
    """Horizontal distances of the bounces of refracted rays of one family [m], none beyond the point, (bounces, n).

    Args:
        refraction: Refraction table.
        f: Row of the family.
        bounces: Number of bounces of the family.
        distance: Horizontal distances of the points [m], (n,).
        depth: Depths of the points [m], (n,).
    """
    columns = _columns(refraction, f, distance, depth)
    first, period = columns[:, column.BOUNCE], columns[:, column.PERIOD]
    return np.asarray(np.clip(first + np.arange(bounces)[:, None] * period, 0.0, 1.0) * distance)


def _columns(refraction: RefractionTable, f: int, distance: Floats, depth: Floats) -> Floats:
    """Columns of `refraction_columns` at n points, given by horizontal distance and depth [m], (n, 8)."""
    columns = np.empty(len(distance) * column.COUNT, np.float32)
    interpolate_refraction(np.ascontiguousarray(distance), np.ascontiguousarray(depth), f, refraction, columns)
    return columns.reshape(len(distance), column.COUNT).astype(float)


def zone_climbs(
    refraction: RefractionTable, image_depths: Floats, sound_speed: float, depth: float, zone: tuple[float, float]
) -> Floats:
    """Horizontal distance times tangent of the launch angle to a zone of a flat seabed [m].

    Args:
        refraction: Refraction table of the families.
        image_depths: Depth of the image source of each family [m], (f,).
        sound_speed: Sound speed of straight rays [m/s].
        depth: Depth of the flat seabed [m].
        zone: Nearest and farthest horizontal distance [m].

    Returns:
        Values at the nearest, middle and farthest distance, (f, 3).
    """
    return flat_seabed_legs(refraction, image_depths, sound_speed, np.linspace(*zone, 3), depth).climb
