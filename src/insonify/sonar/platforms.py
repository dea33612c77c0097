"""What carries the two ends of a sonar: one platform for both, or one for each.

A pair of platforms is bistatic: the receiver keeps the transmitter's clock, its poses are those of the same moments.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.course import Course, Courses, courses
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Platforms:
    """What carries transmitter and receiver, at every ping."""

    sending: Poses
    """True poses of the transmitter's platform at the start of each ping."""
    receiving: Poses | None = None
    """Those of the receiver's at the same moments; None: both ends ride the same platform."""
    sending_later: tuple[Poses, Poses] | None = None
    """Of the transmitter's at the middle and at the end of the window of every ping; None: stop and hop."""
    receiving_later: tuple[Poses, Poses] | None = None
    """Of the receiver's, likewise."""

    @property
    def two(self) -> bool:
        """True where the receiver has a platform of its own."""
        return self.receiving is not None

    @property
    def hearing(self) -> Poses:
        """Poses of what carries the receiver."""
        return self.sending if self.receiving is None else self.receiving

    @property
    def carriers(self) -> tuple[Poses, Poses]:
        """What carries the transmitter, and what carries the receiver."""
        return self.sending, self.hearing

    @cached_property
    def positions(self) -> Floats:
        """Places of every platform at all pings [m], shape (n, 3)."""
        if self.receiving is None:
            return self.sending.position
        return np.concatenate([self.sending.position, self.receiving.position])

    @property
    def apart(self) -> float:
        """Greatest distance between the platforms at any ping [m]."""
        return float(np.linalg.norm(self.sending.position - self.hearing.position, axis=1).max())

    @property
    def moments(self) -> tuple[tuple[Poses, ...], tuple[Poses, ...]]:
        """Poses of each carrier at the start, middle and end of every window; of stop and hop, at the start alone."""
        first = (self.sending, *(self.sending_later or ()))
        return first, first if self.receiving is None else (self.receiving, *(self.receiving_later or ()))

    def courses(self, ping: int, window: float) -> tuple[Course | None, Course | None]:
        """How each carrier goes on from the start of a ping; None for both where neither moves.

        Args:
            ping: Number of the ping.
            window: Length of the window [s].
        """
        if self.ways is None:
            return None, None
        first, other = self.ways
        if not (first.moves[ping] or other.moves[ping]):
            return None, None
        way = first.at(ping, window)
        return way, way if other is first else other.at(ping, window)

    @cached_property
    def ways(self) -> tuple[Courses, Courses] | None:
        """How each carrier goes on from every ping; None where they stop and hop."""
        if self.sending_later is None:
            return None
        first = courses(self.sending, self.sending_later)
        if self.receiving is None or self.receiving_later is None:
            return first, first
        return first, courses(self.receiving, self.receiving_later)
