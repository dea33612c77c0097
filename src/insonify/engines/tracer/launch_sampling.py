"""Launch directions of rays, and the solid angle that each represents.

Directions are given by the direction cosine u to the array's right and the angle psi about that axis: solid angle is
du dpsi, and a side-looking beam is narrow in u alone. Some rays are drawn in proportion to the beam gain over u and
uniformly over slant range, family by family; others are drawn within the angles of each body. The solid angle of a ray
is one over the density of all rays together in its direction, so that the estimate is unbiased.

Method: stratified and importance sampling, and the balance heuristic of Veach & Guibas (1995), Proc. SIGGRAPH 95, 419.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.sonar.beam import Beams

Floats = NDArray[np.float64]
Reach = Callable[[Floats], Floats]

U_STEPS, PSI_STEPS = 8192, 16384
"""Steps of the tables over u and psi."""
UNIFORM_ACROSS, UNIFORM_AROUND = 0.05, 0.1
"""Fraction of the rays that are uniform over u, and over psi, independent of the beams [1]."""
MIN_RELATIVE_GAIN = 0.02
"""Relative gain added to that of the beam, so that the density of rays does not vanish outside the beam [1]."""
AIMED_FRACTION = 0.35
"""Fraction of the rays that are aimed at bodies, where there are any [1]."""
WINDOW_MARGIN = 0.1
"""Margin of a window on each side of a body, re the body's size [1]."""
_GOLDEN = 0.6180339887498949
_LEAST_WINDOW = 1e-4  # of u, and of psi [rad]


@dataclass(frozen=True, slots=True)
class TabulatedDensity:
    """Probability density that is constant in each of n equal steps."""

    low: float
    """Lower end of the first step."""
    step: float
    """Width of a step."""
    probability: Floats
    """Probability of each step, shape (n,)."""
    cumulative: Floats
    """Cumulative probability at the borders of the steps, shape (n + 1,)."""

    def density(self, x: Floats) -> Floats:
        """Probability density at x, shape of x; 0 outside."""
        row = np.floor((x - self.low) / self.step).astype(np.int64)
        inside = (row >= 0) & (row < len(self.probability))
        return np.asarray(
            np.where(inside, self.probability[np.clip(row, 0, len(self.probability) - 1)] / self.step, 0.0)
        )

    def quantile(self, part: Floats) -> Floats:
        """Value below which a probability lies, the inverse of the cumulative probability, shape of `part`."""
        borders = self.low + self.step * np.arange(len(self.cumulative))
        return np.interp(part, self.cumulative, borders)


def tabulated_density(low: float, high: float, weight: Floats) -> TabulatedDensity:
    """Density proportional to weights of equal steps.

    Args:
        low: Lower end of the first step.
        high: Upper end of the last step.
        weight: Weight of each step, not negative, shape (n,).
    """
    probability = weight / weight.sum()
    cumulative = np.concatenate([[0.0], np.cumsum(probability)])
    return TabulatedDensity(low, (high - low) / len(weight), probability, cumulative / cumulative[-1])


@dataclass(frozen=True, slots=True)
class AimWindow:
    """Directions towards one body by one family: distributed over u like the beams, over psi uniformly."""

    u: tuple[float, float]
    """Least and greatest direction cosine u [1]."""
    part: tuple[float, float]
    """Cumulative probabilities of the density over u at these two [1]."""
    psi: tuple[float, float]
    """Least and greatest angle psi [rad]."""

    def density(self, u: Floats, psi: Floats, across: TabulatedDensity) -> Floats:
        """Probability density of the rays aimed through the window, per solid angle [1/sr]."""
        low, tall = self.psi[0], self.psi[1] - self.psi[0]
        inside = (u >= self.u[0]) & (u < self.u[1]) & (np.mod(psi - low, 2 * np.pi) < tall)
        return np.asarray(inside * across.density(u) / ((self.part[1] - self.part[0]) * tall))


@dataclass(frozen=True, slots=True)
class LaunchSampler:
    """Sampler of the launch directions of one ping."""

    axes: Floats
    """Boresight, right and down of the array as rows [1], shape (3, 3)."""
    across: TabulatedDensity
    """Density over u."""
    around: TabulatedDensity
    """Density over psi."""
    windows: tuple[AimWindow, ...]

    def rays(self, seed: int, ping: int, count: int, part: int, parts: int) -> tuple[Floats, Floats]:
        """One part of the rays: every `parts`-th of them from `part` on.

        Args:
            seed: Seed of the scenario.
            ping: Number of the ping; every ping has independent rays.
            count: Number of all rays.
            part: Number of the part, from 0.
            parts: Number of parts.

        Returns:
            Unit vectors (n, 3), and the solid angle that each represents [sr] (n,).
        """
        aimed = int(AIMED_FRACTION * count / len(self.windows)) if self.windows else 0
        general = count - aimed * len(self.windows)
        drawn: list[tuple[Floats, Floats]] = []
        for group, size in enumerate([general] + [aimed] * len(self.windows)):
            n = np.arange(part, size, parts)
            first = random_keys.uniforms(seed, random_keys.TRACER, 0, group, ping, 1)
            u = random_keys.uniforms(seed, random_keys.TRACER, n, group, ping, 0)
            first_uniform, second_uniform = (n + u[:, 0]) / max(size, 1), np.mod(n * _GOLDEN + first[0], 1.0)
            if group == 0:
                drawn.append((self.across.quantile(second_uniform), self.around.quantile(first_uniform)))
            else:
                (left, right), (low, high) = self.windows[group - 1].part, self.windows[group - 1].psi
                drawn.append(
                    (self.across.quantile(left + second_uniform * (right - left)), low + first_uniform * (high - low))
                )
        cosine, turn = (np.concatenate(column) for column in zip(*drawn, strict=True))
        density = general * self.across.density(cosine) * self.around.density(_wrapped(turn))
        for window in self.windows:
            density += aimed * window.density(cosine, turn, self.across)
        return self.direction(cosine, turn), 1 / density

    def direction(self, u: Floats, psi: Floats) -> Floats:
        """Unit vectors of direction cosines u and angles psi, shape (n, 3)."""
        ahead = np.sqrt(np.maximum(1 - u**2, 0.0))
        return np.asarray(np.stack([ahead * np.cos(psi), u, ahead * np.sin(psi)], axis=-1) @ self.axes)


def _wrapped(psi: Floats) -> Floats:
    """Angles wrapped to -pi to pi [rad]."""
    return np.mod(psi + np.pi, 2 * np.pi) - np.pi


def launch_sampler(
    transmit: Beams, receive: Beams, reaches: list[tuple[Reach, float, float]], sights: list[tuple[Floats, bool]]
) -> LaunchSampler:
    """Sampler of the launch directions of one ping.

    Args:
        transmit: Transmit beams, in the frame of the rays.
        receive: Receive beams, shape (channels,).
        reaches: For each family to a scattering boundary: its path length [m] as a function of launch directions
            (n, 3), infinite where it does not exist, and the least and greatest path length that is recorded [m].
        sights: For each body and family, vectors from the image of the sonar to the corners of the body's bounding box
            [m] (8, 3), and True if the vertical component of its launch directions is reversed.
    """
    plain = LaunchSampler(transmit.axes, _uniform_density(-1, 1), _uniform_density(-np.pi, np.pi), ())
    psi = np.linspace(-np.pi, np.pi, PSI_STEPS + 1)
    middle = (psi[:-1] + psi[1:]) / 2
    steer = float(np.mean(transmit.steer[:, 0]))
    sent = _max_power(transmit, plain.direction(np.full(PSI_STEPS, steer), middle))
    around = _slant_range_density(plain.direction(np.zeros(PSI_STEPS + 1), psi), sent, reaches)
    u = -1 + 2 * (np.arange(U_STEPS) + 0.5) / U_STEPS
    gain_of = np.zeros(U_STEPS)
    for turn in (0.0, float(middle[np.argmax(sent)])):
        directions = plain.direction(u, np.full(U_STEPS, turn))
        gain_of += _max_power(transmit, directions) * _max_power(receive, directions)
    across = tabulated_density(
        -1, 1, UNIFORM_ACROSS / U_STEPS + (1 - UNIFORM_ACROSS) * gain_of / max(gain_of.sum(), 1e-300)
    )
    return LaunchSampler(
        transmit.axes, across, around, tuple(_aim_window(transmit.axes, across, *sight) for sight in sights)
    )


def _slant_range_density(
    directions: Floats, sent: Floats, reaches: list[tuple[Reach, float, float]]
) -> TabulatedDensity:
    """Density over psi for which rays are uniform over slant range, family by family.

    Args:
        directions: Launch directions at the borders of the steps [1], shape (PSI_STEPS + 1, 3).
        sent: Transmitted power in each step [1], shape (PSI_STEPS,).
        reaches: See `launch_sampler`.
    """
    weight, density = np.full(PSI_STEPS, 1.0 / PSI_STEPS), np.zeros(PSI_STEPS)
    for path_length, near, far in reaches:
        reach = np.clip(path_length(directions), near, far)
        fill = np.abs(np.diff(reach)) * (MIN_RELATIVE_GAIN + sent / max(sent.max(), 1e-300))
        density += fill / max(fill.sum(), 1e-300)
    if density.sum() > 0:
        weight = UNIFORM_AROUND * weight + (1 - UNIFORM_AROUND) * density / density.sum()
    return tabulated_density(-np.pi, np.pi, weight)


def _uniform_density(low: float, high: float) -> TabulatedDensity:
    return tabulated_density(low, high, np.ones(1))


def _max_power(beams: Beams, directions: Floats) -> Floats:
    """Largest power gain of all beams in some directions [1], shape (n,)."""
    return np.asarray((beams.gain(directions) ** 2).max(axis=0))


def _aim_window(axes: Floats, across: TabulatedDensity, corners: Floats, turned: bool) -> AimWindow:
    """Window of launch directions about a body as seen from an image of the sonar."""
    ray = corners * np.array([1, 1, -1 if turned else 1])
    ahead, u, under = ((ray / np.maximum(np.linalg.norm(ray, axis=1, keepdims=True), 1e-9)) @ axes.T).T
    psi = np.arctan2(under, ahead)
    middle = float(np.arctan2(np.sin(psi).mean(), np.cos(psi).mean()))
    aside = _wrapped(psi - middle)
    tall = min((1 + 2 * WINDOW_MARGIN) * float(np.ptp(aside)) + _LEAST_WINDOW, 2 * np.pi)
    wide = (1 + 2 * WINDOW_MARGIN) * float(np.ptp(u)) + _LEAST_WINDOW
    low, left = middle + float(aside.min() + aside.max()) / 2 - tall / 2, float(u.min() + u.max()) / 2 - wide / 2
    ends = max(left, -1.0), min(left + wide, 1.0)
    below = np.interp(ends, across.low + across.step * np.arange(len(across.cumulative)), across.cumulative)
    return AimWindow(ends, (float(below[0]), float(below[1])), (low, low + tall))
