"""Echoes of many points received by every element of a moving array, one ray to each element at each moment.

The sound that an element receives at time t left the transmitter at the te that solves te + out(te) = t - back(t),
where out and back are the travel times to the point from where either end is at that moment. Both are requested at
three moments about the pulse's middle and run on a parabola in between. In water of layers they are exact rays from
every single place; legs off a drawn surface are straight lines to the image that the draw states. No expansion about a
centre anywhere; the synthesis shares the pulse's envelope only.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from insonify.propagation._eigenray_kernel import AMPLITUDE, CAUSTICS, DELAY, LENGTH
from insonify.propagation.eigenray_tables import exact_rays
from insonify.sonar.pulse import envelope

HALF = 0.4e-3
"""Time before and after the middle of an echo at which the way back is requested [s]."""
Reached = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
"""Travel times [s] and complex amplitudes [1] of n points from a place for each [m], (n, 3) or (3,); NaN for no way."""


def refracted(column, points, family, *, bottom=0.35, loss_db=0.0) -> Reached:
    """The only ray of a family to each point, off a surface that turns the sign; NaN where there is none or several."""
    turn = (-1) ** family.count("S") * bottom ** family.count("B")

    def reached(places):
        places = np.broadcast_to(places, points.shape)
        distance = np.hypot(*(points[:, :2] - places[:, :2]).T)
        delay, amplitude = np.full(len(points), np.nan), np.full(len(points), np.nan, complex)
        for depth in np.unique(places[:, 2]):
            some = np.flatnonzero(places[:, 2] == depth)
            found = exact_rays(column, family, float(depth), points[some, 2], distance[some])
            ray, one = found.rays[:, 0], found.count == 1
            pressure = turn * ray[:, AMPLITUDE] * 1j ** ray[:, CAUSTICS] * 10 ** (-loss_db * ray[:, LENGTH] / 20)
            delay[some], amplitude[some] = np.where(one, ray[:, DELAY], np.nan), np.where(one, pressure, np.nan)
        return delay, amplitude

    return reached


def straight(images, speed, strength, *, loss_db=0.0) -> Reached:
    """Straight lines to images that stand still, (n, 3), with a factor of their own, (n,)."""

    def reached(places):
        length = np.linalg.norm(images - places, axis=1)
        return length / speed, strength / length * 10 ** (-loss_db * length / 20)

    return reached


@dataclass(frozen=True)
class Way:
    """Travel times of n points over time, as parabolas about a moment of each."""

    moment: np.ndarray
    delay: np.ndarray
    """At three moments, `half` apart [s], shape (3, n)."""
    half: float
    amplitude: np.ndarray

    def at(self, row, time):
        """Travel time of one point's sound [s]."""
        x, (first, middle, last) = (time - self.moment[row]) / self.half, self.delay[:, row]
        return middle + x * ((last - first) / 2 + x * (first + last - 2 * middle) / 2)


def out_of(reached: Reached, path, duration) -> Way:
    """The path from a transmitter whose place at some times `path` gives, about the pulse's middle."""
    moments = duration / 2 * np.array([0.0, 1.0, 2.0])
    arrivals = [reached(path(np.array([time]))) for time in moments]
    return Way(
        np.full(len(arrivals[0][0]), moments[1]), np.array([t for t, _ in arrivals]), duration / 2, arrivals[1][1]
    )


def back_to(reached: Reached, path, out: Way) -> Way:
    """The path back to an element whose place at some times `path` gives, about when it receives the pulse's middle."""
    left = np.nan_to_num(out.moment + out.delay[1])
    received = 2 * left
    for _ in range(3):
        received = left + np.nan_to_num(reached(path(received))[0])
    arrivals = [reached(path(received + side * HALF)) for side in (-1, 0, 1)]
    return Way(received, np.array([t for t, _ in arrivals]), HALF, arrivals[1][1])


def echoes(sonar, carrier, out: Way, back: Way, time) -> np.ndarray:
    """Envelope about the carrier of all points' echoes of a source of 0 dB [uPa], shape of time."""
    received, duration, rate = np.zeros(len(time), complex), sonar.pulse.duration, 1 / (time[1] - time[0])
    for row in np.flatnonzero(np.isfinite(out.delay).all(axis=0) & np.isfinite(back.delay).all(axis=0)):
        first = int((back.moment[row] - 0.6 * duration - time[0]) * rate)
        some = slice(max(first, 0), max(first + int(1.2 * duration * rate), 0))
        t = time[some]
        left = t - back.at(row, t)
        sent = left - out.delay[1, row]
        for _ in range(4):
            sent = left - out.at(row, sent)
        strength = out.amplitude[row] * back.amplitude[row]
        received[some] += strength * envelope(sonar.pulse, sent) * np.exp(2j * np.pi * carrier * (sent - t))
    return received
