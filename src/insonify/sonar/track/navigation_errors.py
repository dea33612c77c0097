"""Logged navigation: what the navigation system writes down, which is not quite where the platform was.

An error is an offset, a rate that lets it grow, and noise: white, or with a memory (first-order Gauss-Markov:
each value is the last one, faded, and something new). The recording keeps both, the truth and the log.
"""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from insonify import random_keys
from insonify.model import Metres, MetresPerSecond, Model, Radians, RadiansPerSecond, Seconds
from insonify.sonar.track.poses import Poses

Floats = NDArray[np.float64]
Memory = Annotated[Seconds, Field(ge=0, le=1e7)]


class PositionError(Model):
    """Errors of one logged coordinate."""

    offset: Annotated[Metres, Field(ge=-1e5, le=1e5)] = 0.0
    """Constant error [m]."""
    drift: Annotated[MetresPerSecond, Field(ge=-100, le=100)] = 0.0
    """Rate at which the error grows from the first ping on [m/s]."""
    noise: Annotated[Metres, Field(ge=0, le=1e5)] = 0.0
    """Root mean square of the noise [m]."""
    correlation_time: Memory = 0.0
    """Time in which the autocorrelation of the noise falls to 1/e [s]; 0: white noise."""


class AngleError(Model):
    """Errors of one logged angle."""

    offset: Annotated[Radians, Field(ge=-7, le=7)] = 0.0
    """Constant error [rad]."""
    drift: Annotated[RadiansPerSecond, Field(ge=-7, le=7)] = 0.0
    """Rate at which the error grows from the first ping on [rad/s]."""
    noise: Annotated[Radians, Field(ge=0, le=7)] = 0.0
    """Root mean square of the noise [rad]."""
    correlation_time: Memory = 0.0
    """Time in which the autocorrelation of the noise falls to 1/e [s]; 0: white noise."""


class NavigationErrors(Model):
    """Errors of the navigation log: none where left out."""

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
        errors: Errors.
        true: Where the platform was.
        seed: Of the scenario.

    Returns:
        Poses of the same pings; equal to the true ones, bit for bit, where nothing is wrong.
    """
    step = float(true.time[1] - true.time[0]) if len(true) > 1 else 1.0  # the pings are evenly spaced
    return NavigationSystem(errors, step, seed).log(true)


class NavigationSystem:
    """Navigation system of one platform, which logs its pings in turn."""

    def __init__(self, errors: NavigationErrors, interval: float, seed: int) -> None:
        """A system that has logged nothing yet.

        Args:
            errors: Errors.
            interval: Time from ping to ping, in which its noise fades [s].
            seed: Of the scenario.
        """
        self._errors, self._interval, self._seed = errors, interval, seed
        self._logged = 0
        self._faded = np.zeros(len(COLUMNS))

    def log(self, true: Poses) -> Poses:
        """Poses as logged, of the pings that follow those logged before.

        Args:
            true: Where the platform was.
        """
        wrong = [self._error(getattr(self._errors, name), true.time, row) for row, name in enumerate(COLUMNS)]
        self._logged += len(true)
        return Poses(
            time=true.time, position=true.position + np.stack(wrong[:3], axis=-1), heading=true.heading + wrong[3],
            pitch=true.pitch + wrong[4], roll=true.roll + wrong[5],
        )  # fmt: skip

    def _error(self, error: PositionError | AngleError, time: Floats, row: int) -> Floats:
        """Offset, growth and noise of one column at these pings, shape (pings,)."""
        from scipy.signal import lfilter

        total = np.asarray(error.offset + error.drift * time)
        if error.noise == 0:
            return total
        draws = random_keys.complex_normals(self._seed, random_keys.NAVIGATION, 0, row, len(time), start=self._logged)
        white = np.sqrt(2) * draws.real
        # The first value of all is drawn from the process's own distribution.
        kept = np.exp(-self._interval / error.correlation_time) if error.correlation_time > 0 else 0.0
        new = np.sqrt(1 - kept**2) * white
        if self._logged == 0:
            new[0] = white[0]
        noise, faded = lfilter([1.0], [1.0, -kept], new, zi=self._faded[row : row + 1])
        self._faded[row] = faded[0]
        return np.asarray(total + error.noise * noise)
