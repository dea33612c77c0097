"""From where intensities are heard: the receive beam of the moment when an echo comes, as for pressures.

Delays and levels stay those of the start of the ping. A beam that has moved on and turned by then has left part of what
was insonified: 2.4 dB of 1.5 m at 100 kHz abeam at 3 m/s, too much to be left out.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis.element_arrivals import element_directions, has_parallax, receive_points

Floats = NDArray[np.float64]


def receive_directions(pairs: Pairs, ping_geometry: PingGeometry) -> Floats:
    """Directions of the legs back as the receive beams see them when the echoes come.

    Args:
        pairs: Legs out and back of a block of n scatterers.
        ping_geometry: The sonar at this ping, with beams.

    Returns:
        Unit vectors, told by the attitude at the start of the ping, shape (legs, n, 3); those of the legs themselves
        where nothing moves, or too little for the beams to tell.
    """
    course, towards = ping_geometry.receive_motion, pairs.back.departure
    if course is None:
        return towards
    ends = receive_points(ping_geometry)
    when = pairs.out.delay[0] + pairs.back.delay  # by another leg out it is hardly another place
    away = pairs.back.length
    if when.size and has_parallax(
        ping_geometry, ends, float(np.fmin.reduce(away, axis=None)), float(np.fmax.reduce(when, axis=None))
    ):
        towards = element_directions(ends, 0, towards, away, when)
    if course.is_rotating:
        towards = np.array([course.to_initial_attitude(*row) for row in zip(towards, when, strict=True)])
    return towards


def moving_array_axes(ping_geometry: PingGeometry) -> tuple[Floats, Floats] | None:
    """How the receive array moves on while sound goes to a place and comes back the same way.

    Args:
        ping_geometry: The sonar at this ping, both ends at one place, in water of one sound speed.

    Returns:
        Axes of the array and what delay one way and its square add to them, shape (3, 3, 3); what the array moves on
        over the way, and what each second of that delay adds to it, shape (2, 3). None where a beam could not tell.
    """
    course, axes = ping_geometry.receive_motion, ping_geometry.receive_beams.axes
    if course is None:
        return None
    ends = receive_points(ping_geometry)
    if not course.is_rotating and not has_parallax(ping_geometry, ends, ping_geometry.receive_sound_speed, 2.0):
        return None
    rate, bend = course.rotation_rates
    drift = np.concatenate([2 * ends.velocity, 2 * ends.acceleration]) / ping_geometry.receive_sound_speed
    return np.array([axes, 2 * axes @ rate, 4 * axes @ bend]), drift
