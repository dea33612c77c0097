"""Receive beams at the time of reception, for expected intensities of a moving sonar.

Delays and levels are those of the start of the ping. A beam that has moved and rotated by the time of reception misses
part of what was insonified: 2.4 dB for 1.5 m at 100 kHz abeam at 3 m/s, too much to be neglected.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.records.pairs import Pairs
from insonify.sonar.ping_geometry import PingGeometry
from insonify.synthesis.element_arrivals import element_directions, has_parallax, receive_points

Floats = NDArray[np.float64]


def receive_directions(pairs: Pairs, ping_geometry: PingGeometry) -> Floats:
    """Directions of the receive legs re the receive beams at the times of reception.

    Args:
        pairs: Transmit and receive legs of a block of n scatterers.
        ping_geometry: The sonar at this ping, with beams.

    Returns:
        Unit vectors from the receiver to the scatterers [1], shape (legs, n, 3), in the world turned so that the beams
        of the start of the ping apply; the legs' own departures where the motion is negligible for the beams.
    """
    motion, directions = ping_geometry.receive_motion, pairs.receive_legs.departure
    if motion is None:
        return directions
    points = receive_points(ping_geometry)
    # other transmit legs differ by too little to matter
    arrival_time = pairs.transmit_legs.delay[0] + pairs.receive_legs.delay
    length = pairs.receive_legs.length
    if arrival_time.size and has_parallax(
        ping_geometry, points, float(np.fmin.reduce(length, axis=None)), float(np.fmax.reduce(arrival_time, axis=None))
    ):
        directions = element_directions(points, 0, directions, length, arrival_time)
    if motion.is_rotating:
        directions = np.array([motion.to_initial_attitude(*row) for row in zip(directions, arrival_time, strict=True)])
    return directions


def moving_array_axes(ping_geometry: PingGeometry) -> tuple[Floats, Floats] | None:
    """Motion of the receive array during two equal legs, as a polynomial of the one-way delay.

    Args:
        ping_geometry: Monostatic geometry of this ping, in water of one sound speed.

    Returns:
        Axes of the array [1] and their coefficients of first [1/s] and second order [1/s^2] in the one-way delay, shape
        (3, 3, 3); displacement of the array per one-way path length [1] and its coefficient of first order in the
        delay [1/s], shape (2, 3). None where the motion is negligible.
    """
    motion, axes = ping_geometry.receive_motion, ping_geometry.receive_beams.axes
    if motion is None:
        return None
    points, is_rotating = receive_points(ping_geometry), motion.is_rotating
    if not is_rotating and not has_parallax(ping_geometry, points, ping_geometry.receive_sound_speed, 2.0):
        return None
    rate, acceleration = motion.rotation_rates if is_rotating else (np.zeros((3, 3)), np.zeros((3, 3)))
    displacement = np.concatenate([2 * points.velocity, 2 * points.acceleration]) / ping_geometry.receive_sound_speed
    return np.array([axes, 2 * axes @ rate, 4 * axes @ acceleration]), displacement
