"""Pose and motion of a platform at one ping, as another program gives them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.sonar.track import Poses

Floats = NDArray[np.float64]
Moment = tuple[ArrayLike, ArrayLike]

MAX_SPEED = 100.0
"""Greatest speed of a platform [m/s], as that of a track."""
MAX_JUMP = 1.0
"""Distance by which poses of a window may jump, whatever its length [m]: positions are rounded, or corrected."""
MAX_TURN_RATE = 10.0
"""Greatest rate of an angle of attitude [rad/s]."""
MAX_ANGLE = 4 * np.pi
"""Greatest angle of attitude [rad]: a larger one is in degrees."""
MAX_COORDINATE = 1e7
"""Greatest coordinate of a position [m], as that of a track."""
FULL_TURN = 2 * np.pi


@dataclass(frozen=True)
class PlatformPose:
    """Pose of a platform at the start of a ping, and its motion from there.

    Example:
        >>> pose = PlatformPose((100.0, 20.0, 5.0), attitude=(np.radians(90), 0.0, 0.0), velocity=(0.0, 2.0, 0.0))
        >>> _, end = pose.later_poses(time=10.0, window=0.1)  # 2 m/s to the east for 100 ms
        >>> end.time.round(2).tolist(), end.position.round(2).tolist()
        ([10.1], [[100.0, 20.2, 5.0]])
    """

    position: ArrayLike
    """Reference point: north, east, depth [m], shape (3,)."""
    attitude: ArrayLike = (0.0, 0.0, 0.0)
    """Heading, pitch, roll [rad], shape (3,)."""
    velocity: ArrayLike | None = None
    """North, east, down [m/s], shape (3,); None: from the pose before."""
    turn_rate: ArrayLike | None = None
    """Rates of heading, pitch and roll [rad/s], shape (3,); None: from the pose before."""
    window_poses: tuple[Moment, Moment] | None = None
    """Position and attitude half a window, and a whole window, after the start, in place of velocity and turn rate."""

    def __post_init__(self) -> None:
        """Check and convert what was given.

        Raises:
            ValueError: A value is missing, not finite or beyond its limit.
        """
        object.__setattr__(self, "position", _position(self.position))
        object.__setattr__(self, "attitude", _attitude(self.attitude))
        for name, unit, limit in (("velocity", "m/s", MAX_SPEED), ("turn_rate", "rad/s", MAX_TURN_RATE)):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, _vector(name, given, unit, limit))
        if self.window_poses is not None:
            if self.velocity is not None or self.turn_rate is not None:
                raise ValueError("window_poses are given beside velocity or turn_rate. Give one or the other.")
            if not isinstance(self.window_poses, Sequence) or len(self.window_poses) != 2:
                raise ValueError("window_poses are not two of (position, attitude). Give those at the middle and the "
                                 "end of the window.")  # fmt: skip
            moments = tuple(_moment(given) for given in self.window_poses)
            object.__setattr__(self, "window_poses", moments)

    def poses(self, time: float) -> Poses:
        """The pose at the start, as one row.

        Args:
            time: Time of transmission [s].
        """
        return _row(time, self.position, self.attitude)

    def later_poses(self, time: float, window: float) -> tuple[Poses, Poses]:
        """Poses at the middle and the end of the window, one row each.

        Args:
            time: Time of transmission [s].
            window: Length of the window [s].

        Raises:
            ValueError: The platform would be faster than any.
        """
        if self.window_poses is not None:
            (middle, angles), (end, tilt) = self.window_poses
            for elapsed, position in ((window / 2, middle), (window, end)):
                away = float(np.linalg.norm(np.asarray(position, float) - np.asarray(self.position, float)))
                if away > MAX_SPEED * elapsed + MAX_JUMP:
                    raise ValueError(f"window_poses are {away:.4g} m away after {elapsed:.4g} s, which is faster than "
                                     f"{MAX_SPEED:g} m/s. Give those at the middle and the end.")  # fmt: skip
            return _row(time + window / 2, middle, angles), _row(time + window, end, tilt)
        position, attitude = np.asarray(self.position, float), np.asarray(self.attitude, float)
        velocity, rate = (np.zeros(3) if r is None else np.asarray(r, float) for r in (self.velocity, self.turn_rate))
        half, whole = (_row(time + t, position + t * velocity, attitude + t * rate) for t in (window / 2, window))
        return half, whole

    def following(self, before: "PlatformPose", elapsed: float) -> "PlatformPose":
        """The pose with the mean velocity and turn rate since another one, where none are given.

        Args:
            before: Pose before it.
            elapsed: Time between the two [s]; 0: the motion is that of the pose before.

        Raises:
            ValueError: The platform would be faster than any.
        """
        if self.window_poses is not None or (self.velocity is not None and self.turn_rate is not None):
            return self
        velocity, rate = before.velocity, before.turn_rate
        if elapsed > 0:
            velocity = (np.asarray(self.position, float) - np.asarray(before.position, float)) / elapsed
            turned = np.asarray(self.attitude, float) - np.asarray(before.attitude, float)
            rate = (np.remainder(turned + np.pi, FULL_TURN) - np.pi) / elapsed
        if self.velocity is None and velocity is not None and np.linalg.norm(velocity) > MAX_SPEED:
            raise ValueError(
                f"the platform was moved by {np.linalg.norm(velocity) * elapsed:.4g} m in {elapsed:.4g} s, which is "
                f"faster than {MAX_SPEED:g} m/s. Give its velocity and turn_rate, such as (0, 0, 0), where it was put "
                "there."
            )
        if self.turn_rate is None and rate is not None and np.abs(rate).max() > MAX_TURN_RATE:
            raise ValueError(
                f"the platform turned by {np.degrees(np.abs(rate).max() * elapsed):.4g} deg in {elapsed:.4g} s. Give "
                "its turn_rate, such as (0, 0, 0), where it was set so."
            )
        return PlatformPose(
            self.position, self.attitude, velocity if self.velocity is None else self.velocity,
            rate if self.turn_rate is None else self.turn_rate,
        )  # fmt: skip


def _row(time: float, position: ArrayLike, attitude: ArrayLike) -> Poses:
    angles = np.asarray(attitude, float)
    return Poses(np.array([time]), np.asarray(position, float)[None], angles[:1], angles[1:2], angles[2:])


def _moment(given: Moment) -> tuple[Floats, Floats]:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
        raise ValueError(f"window_poses has {_shown(given)}; give two of (position, attitude), each of three numbers")
    return _position(given[0]), _attitude(given[1])


def _position(value: ArrayLike) -> Floats:
    return _vector("position", value, "m", MAX_COORDINATE)


def _attitude(value: ArrayLike) -> Floats:
    angles = _vector("attitude", value, "rad", MAX_ANGLE)
    if abs(angles[1]) > np.pi / 2:
        raise ValueError(f"attitude has a pitch of {angles[1]:g} rad. Give heading, pitch and roll in radians, the "
                         "pitch between -pi/2 and pi/2.")  # fmt: skip
    return angles


def _vector(name: str, value: ArrayLike, unit: str, limit: float) -> Floats:
    """Three finite numbers within a limit."""
    try:
        numbers = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{name} is {_shown(value)}; give three numbers [{unit}]") from None
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise ValueError(f"{name} is {_shown(value)}; give three finite numbers [{unit}]")
    if np.abs(numbers).max() > limit:
        raise ValueError(f"{name} is {numbers.tolist()} {unit}; none may be beyond {limit:.4g} {unit}")
    return numbers


def _shown(value: object) -> str:
    """A value as it was given, not longer than a line."""
    text = repr(value)
    return text if len(text) <= 100 else f"{text[:97]}..."
