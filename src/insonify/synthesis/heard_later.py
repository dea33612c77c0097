"""From where intensities are heard: the receive beam of the moment when an echo comes, as for pressures.

Delays and levels stay those of the start of the ping. A beam that has moved on and turned by then has left part of what
was insonified: 2.4 dB of 1.5 m at 100 kHz abeam at 3 m/s, too much to be left out.
"""

import numpy as np
from numpy.typing import NDArray

from insonify.records.pairs import Pairs
from insonify.sonar.stance import Stance
from insonify.synthesis.elements import ends_of, parted, seen_by

Floats = NDArray[np.float64]


def heard_directions(pairs: Pairs, stance: Stance) -> Floats:
    """Directions of the legs back as the receive beams see them when the echoes come.

    Args:
        pairs: Legs out and back of a block of n scatterers.
        stance: The sonar at this ping, with beams.

    Returns:
        Unit vectors, told by the attitude at the start of the ping, shape (legs, n, 3); those of the legs themselves
        where nothing moves, or too little for the beams to tell.
    """
    course, towards = stance.course, pairs.back.departure
    if course is None:
        return towards
    ends = ends_of(stance)
    when = pairs.out.delay[0] + pairs.back.delay  # by another leg out it is hardly another place
    away = pairs.back.length
    if when.size and parted(
        stance, ends, float(np.fmin.reduce(away, axis=None)), float(np.fmax.reduce(when, axis=None))
    ):
        towards = seen_by(ends, 0, towards, away, when)
    if course.turns:
        towards = np.array([course.turned(*row) for row in zip(towards, when, strict=True)])
    return towards


def swept_axes(stance: Stance) -> tuple[Floats, Floats] | None:
    """How the receive array moves on while sound goes to a place and comes back the same way.

    Args:
        stance: The sonar at this ping, both ends at one place, in water of one sound speed.

    Returns:
        Axes of the array and what delay one way and its square add to them, shape (3, 3, 3); what the array moves on
        over the way, and what each second of that delay adds to it, shape (2, 3). None where a beam could not tell.
    """
    course, axes = stance.course, stance.receive_beams.axes
    if course is None:
        return None
    ends = ends_of(stance)
    if not course.turns and not parted(stance, ends, stance.receive_speed, 2.0):
        return None
    rate, bend = course.sweep
    drift = np.concatenate([2 * ends.velocity, 2 * ends.acceleration]) / stance.receive_speed
    return np.array([axes, 2 * axes @ rate, 4 * axes @ bend]), drift
