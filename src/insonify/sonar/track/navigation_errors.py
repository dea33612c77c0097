"""Errors of logged navigation: the difference between the poses that a navigation system logs and the true ones.

An error is the sum of an offset, a drift and noise, which is white or a first-order Gauss-Markov process (each value is
a decayed part of the one before and an independent innovation). A recording contains true and logged poses.
"""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from insonify import random_keys
from insonify.model import Metres, MetresPerSecond, Model, Radians, RadiansPerSecond, Seconds
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]
CorrelationTime = Annotated[Seconds, Field(ge=0, le=1e7)]


class PositionError(Model):
    """Errors of one logged coordinate.

    Example:
        >>> gps = PositionError(offset="0.3 m", noise="0.5 m", correlation_time="60 s")
        >>> track = StaticTrack(position=(0, 0, 5), interval="600 s", pings=5000)
        >>> logged = logged_poses(NavigationErrors(north=gps), true_poses(track), seed=1)
        >>> print(logged.position[:, 0].mean().round(1), logged.position[:, 0].std().round(1))
        0.3 0.5
    """

    offset: Annotated[Metres, Field(ge=-1e5, le=1e5)] = 0.0
    """Constant error [m]."""
    drift: Annotated[MetresPerSecond, Field(ge=-100, le=100)] = 0.0
    """Rate at which the error grows from the first ping on [m/s]."""
    noise: Annotated[Metres, Field(ge=0, le=1e5)] = 0.0
    """Root mean square of the noise [m]."""
    correlation_time: CorrelationTime = 0.0
    """Time in which the autocorrelation of the noise falls to 1/e [s]; 0: white noise."""


class AngleError(Model):
    """Errors of one logged angle.

    Example:
        >>> gyro = AngleError(drift="0.1 deg/s")
        >>> track = StaticTrack(position=(0, 0, 5), interval="1 s", pings=4)
        >>> logged = logged_poses(NavigationErrors(heading=gyro), true_poses(track), seed=1)
        >>> np.degrees(logged.heading).round(3).tolist()
        [0.0, 0.1, 0.2, 0.3]
    """

    offset: Annotated[Radians, Field(ge=-7, le=7)] = 0.0
    """Constant error [rad]."""
    drift: Annotated[RadiansPerSecond, Field(ge=-7, le=7)] = 0.0
    """Rate at which the error grows from the first ping on [rad/s]."""
    noise: Annotated[Radians, Field(ge=0, le=7)] = 0.0
    """Root mean square of the noise [rad]."""
    correlation_time: CorrelationTime = 0.0
    """Time in which the autocorrelation of the noise falls to 1/e [s]; 0: white noise."""


class NavigationErrors(Model):
    """Errors of the navigation log; by default none.

    Example:
        >>> track = StaticTrack(position=(0, 0, 5), pings=2)
        >>> errors = NavigationErrors(heading={"offset": "1 deg"})
        >>> np.degrees(logged_poses(errors, true_poses(track), seed=1).heading).round(3).tolist()
        [1.0, 1.0]
    """

    north: PositionError = PositionError()
    east: PositionError = PositionError()
    depth: PositionError = PositionError()
    heading: AngleError = AngleError()
    pitch: AngleError = AngleError()
    roll: AngleError = AngleError()


COLUMNS = tuple(NavigationErrors.model_fields)
"""Names of the columns; the random numbers of a column are keyed by its position in this list."""


def logged_poses(errors: NavigationErrors, true: Poses, seed: int) -> Poses:
    """Poses that the navigation system logs.

    Args:
        errors: Errors of the navigation log.
        true: True poses of the platform.
        seed: Seed of the scenario.

    Returns:
        Poses of the same pings; bit-identical with the true ones where there are no errors.

    Example:
        >>> true = true_poses(LineTrack(start=(0, 0, 5), speed="2 m/s", interval="1 s", pings=3))
        >>> drifting = NavigationErrors(north={"drift": "0.1 m/s"})
        >>> logged_poses(drifting, true, seed=1).position[:, 0].round(3).tolist()
        [0.0, 2.1, 4.2]
    """
    step = float(true.time[1] - true.time[0]) if len(true) > 1 else 1.0  # the pings are evenly spaced
    return NavigationSystem(errors, step, seed).log(true)


class NavigationSystem:
    """Navigation system of one platform, which logs its pings in turn."""

    def __init__(self, errors: NavigationErrors, interval: float, seed: int) -> None:
        """Create a navigation system before its first ping.

        Args:
            errors: Errors of the navigation log.
            interval: Time from ping to ping [s].
            seed: Seed of the scenario.
        """
        self._errors, self._interval, self._seed = errors, interval, seed
        self._logged_count = 0
        self._filter_state = np.zeros(len(COLUMNS))

    def log(self, true: Poses) -> Poses:
        """Logged poses of the next pings.

        Args:
            true: True poses of the platform at these pings.
        """
        errors = [self._error(getattr(self._errors, name), true.time, row) for row, name in enumerate(COLUMNS)]
        self._logged_count += len(true)
        return Poses(
            time=true.time, position=true.position + np.stack(errors[:3], axis=-1), heading=true.heading + errors[3],
            pitch=true.pitch + errors[4], roll=true.roll + errors[5],
        )  # fmt: skip

    def _error(self, error: PositionError | AngleError, time: Floats, row: int) -> Floats:
        """Error of one column at some pings [m or rad], shape (pings,): offset, drift and noise.

        Args:
            error: Offset, drift and noise of the column.
            time: Times of the pings [s], shape (pings,).
            row: Number of the column in `COLUMNS`.
        """
        total = np.asarray(error.offset + error.drift * time)
        if error.noise == 0:
            return total
        from scipy.signal import lfilter  # loading takes half a second, which runs without noise avoid

        draws = random_keys.complex_normals(
            self._seed, random_keys.NAVIGATION, 0, row, len(time), start=self._logged_count
        )
        white = np.sqrt(2) * draws.real
        # the first value has the stationary variance of the process
        decay = np.exp(-self._interval / error.correlation_time) if error.correlation_time > 0 else 0.0
        innovation = np.sqrt(1 - decay**2) * white
        if self._logged_count == 0:
            innovation[0] = white[0]
        noise, filter_state = lfilter([1.0], [1.0, -decay], innovation, zi=self._filter_state[row : row + 1])
        self._filter_state[row] = filter_state[0]
        return np.asarray(total + error.noise * noise)
