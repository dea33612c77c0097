"""Energy width of a sonar's two-way beam, and its width and height between half-power points.

Widths are measured in the array's plane of boresight and right, about the steered axis.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from insonify.recent_results import RecentResults
from insonify.sonar.beam import POINTS_PER_LOBE, Beams

Floats = NDArray[np.float64]

MAX_WIDTH = 1.0
"""Width returned for beams that do not fall to half power, such as an omnidirectional one [rad]."""
FIRST_SAMPLES = 64
"""Samples on each side of a beam's axis that are evaluated first: narrow beams fall to half power within them."""
NODES = 16
"""Gauss-Legendre nodes per wavelength / aperture."""


def two_way_footprint(transmit: Beams, receive: Beams, *, within: float = np.pi) -> Floats:
    """Energy width of the two-way beams in azimuth, integral of |bt|^2 |br|^2 d(azimuth) [rad].

    The integral runs over the whole circle at zero elevation, or a part of it. At slant range R a beam that is narrow,
    or far enough to graze the seabed, covers R times this of a ring around the sonar. For equal uniform lines
    of length L facing ahead it is 2 / 3 wavelength / L; steered, it grows as one over the cosine of the steer.

    Args:
        transmit: Transmit beams, one or as many as receive.
        receive: Receive beams, one or as many as transmit.
        within: Largest azimuth from boresight that counts [rad].

    Returns:
        Energy width [rad], shape (channels,).

    Source: integral of sinc^4 = 2 / 3; Urick (1983), Principles of Underwater Sound, ch. 8.

    Example:
        >>> array = LineArray(length="0.6 m", steer="0 deg")
        >>> side = beams(array, frequency=100e3, sound_speed=1500.0)
        >>> np.degrees(two_way_footprint(side, side)).round(2).tolist()
        [0.95]
    """
    panels = max(
        4, int(np.ceil(2 * within * _aperture_wavelengths(transmit, receive) / 4)) * 4
    )  # an edge where baffles end
    node, weight = np.polynomial.legendre.leggauss(NODES)
    edges = np.linspace(-within, within, panels + 1)
    span = np.diff(edges)[:, None] / 2
    azimuth = (edges[:-1, None] + span * (node + 1)).ravel()
    transmit, receive = transmit.rotated(np.eye(3)), receive.rotated(np.eye(3))
    return np.asarray(_power(transmit, receive, azimuth) @ (span * weight).ravel())


def two_way_width(transmit: Beams, receive: Beams) -> float:
    """Full width of the narrowest two-way beam between its half-power points [rad], 1 rad at most.

    Args:
        transmit: Transmit beams, one or as many as receive.
        receive: Receive beams, one or as many as transmit.

    Example:
        >>> array = LineArray(length="0.6 m", steer="0 deg")
        >>> side = beams(array, frequency=100e3, sound_speed=1500.0)
        >>> f"{np.degrees(two_way_width(side, side)):.2f} deg"
        '0.91 deg'
    """
    return _cached_extent(_min_width, transmit, receive)


def two_way_height(transmit: Beams, receive: Beams) -> float:
    """Full height of the lowest two-way beam between its half-power points, across its width [rad], 1 rad at most.

    Args:
        transmit: Transmit beams, one or as many as receive.
        receive: Receive beams, one or as many as transmit.
    """
    return _cached_extent(_min_height, transmit, receive)


def _min_height(transmit: Beams, receive: Beams) -> float:
    """Full height of the lowest two-way beam [rad]."""
    step, heights = 1e-3, []
    angle = np.arange(0, MAX_WIDTH, step)
    for channel in range(max(transmit.channel_count, receive.channel_count)):
        ends = [end.single_beam(channel).rotated(np.eye(3)) for end in (transmit, receive)]
        right, down = max(ends, key=lambda end: float(end.per_unit[1])).steer[0]
        axis = float(np.arcsin(np.clip(down, -1, 1)))
        azimuth = float(np.arctan2(right, np.sqrt(max(1 - right**2 - down**2, 0.0))))
        height = 0.0
        for side in (-1, 1):
            elevation = axis + side * angle
            direction = np.stack(
                [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
            )
            height += _half_power_steps(((ends[0].gain(direction) * ends[1].gain(direction)) ** 2)[0]) * step
        heights.append(min(height, MAX_WIDTH))
    return min(heights)


def _cached_extent(measure: Callable[[Beams, Beams], float], transmit: Beams, receive: Beams) -> float:
    """Width or height of the two-way beams [rad], evaluated by `measure`; cached, whatever the array's attitude."""
    key = measure, transmit.pattern_key, receive.pattern_key
    return _EXTENTS.get(key, lambda: measure(transmit, receive))


_EXTENTS: RecentResults[float] = RecentResults(64)


def _min_width(transmit: Beams, receive: Beams) -> float:
    """Full width of the narrowest two-way beam [rad]."""
    channels = range(max(transmit.channel_count, receive.channel_count))
    return min(
        MAX_WIDTH, *(_beam_width(transmit.single_beam(channel), receive.single_beam(channel)) for channel in channels)
    )


def _beam_width(transmit: Beams, receive: Beams) -> float:
    """Full width of one two-way beam [rad], measured outwards from the axis of the narrower end."""
    narrower = max(transmit, receive, key=lambda end: float(end.per_unit[0]))
    axis = float(np.arcsin(np.clip(narrower.steer[0, 0], -1, 1)))
    step = 1 / (2 * POINTS_PER_LOBE * _aperture_wavelengths(transmit, receive))
    angle = np.arange(0, MAX_WIDTH, step)
    transmit, receive = transmit.rotated(np.eye(3)), receive.rotated(np.eye(3))
    for angles in (angle[:FIRST_SAMPLES], angle):  # of a narrow beam the first are enough
        left, right = _power(transmit, receive, axis + np.concatenate([-angles, angles]))[0].reshape(2, -1)
        if left.min() < left[0] / 2 and right.min() < right[0] / 2:
            break
    return (_half_power_steps(left) + _half_power_steps(right)) * step


def _aperture_wavelengths(transmit: Beams, receive: Beams) -> float:
    """Larger of the two apertures [wavelengths], at least one: the rate at which patterns vary with direction."""
    return float(max(transmit.per_unit[0], receive.per_unit[0], POINTS_PER_LOBE)) / POINTS_PER_LOBE


def _power(transmit: Beams, receive: Beams, azimuth: Floats) -> Floats:
    """Two-way power gain in the array's plane of boresight and right at azimuths [rad] (n,) [1], (channels, n)."""
    plane = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)], axis=-1)
    return np.asarray((transmit.gain(plane) * receive.gain(plane)) ** 2)


def _half_power_steps(power: Floats) -> float:
    """Steps from the axis to the first point of half the axial power, interpolated between samples [1]."""
    below = np.flatnonzero(power < power[0] / 2)
    if below.size == 0:
        return float(len(power))
    row = int(below[0])
    return row - 1 + float((power[row - 1] - power[0] / 2) / (power[row - 1] - power[row]))
