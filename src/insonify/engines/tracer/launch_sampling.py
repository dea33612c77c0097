"""Launch directions of rays, and the solid angle that each represents.

Directions are given by the direction cosine u to the array's right, and the angle psi about that axis from the
boresight towards the array's down axis: solid angle is du dpsi, and a side-looking beam is narrow in u alone. Some rays
are drawn in proportion to the beam gain over u and uniformly over slant range, family by family; others are aimed
through windows, the angles of each body. The solid angle of a ray is one over the density of all rays together in its
direction, so that the estimate is unbiased.

Method: stratified and importance sampling, an additive recurrence of the golden ratio for the second variable, and the
balance heuristic of Veach & Guibas (1995), Proc. SIGGRAPH 95, 419.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.sonar.beam import Beams

Floats = NDArray[np.float64]
PathLength = Callable[[Floats], Floats]

U_STEPS, PSI_STEPS = 8192, 16384
"""Steps of the tables over u, and over psi [1]."""
UNIFORM_OVER_U, UNIFORM_OVER_PSI = 0.05, 0.1
"""Fractions of the rays that are uniform over u, and over psi, independent of the beams [1]."""
MIN_RELATIVE_GAIN = 0.02
"""Relative gain added to that of the beam, so that the density of rays does not vanish outside the beam [1]."""
AIMED_FRACTION = 0.35
"""Fraction of the rays that are aimed through windows, where there are any [1]."""
WINDOW_MARGIN = 0.1
"""Margin of a window on each side of its corners, re the angle between them [1]."""
_GOLDEN_RATIO_CONJUGATE = 0.6180339887498949
_MIN_WINDOW = 1e-4  # width of a window about a single direction, over u [1] and over psi [rad]


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
        """Probability density at x, in one over the unit of x, shape of x; 0 outside the steps."""
        row = np.floor((x - self.low) / self.step).astype(np.int64)
        inside = (row >= 0) & (row < len(self.probability))
        return np.asarray(
            np.where(inside, self.probability[np.clip(row, 0, len(self.probability) - 1)] / self.step, 0.0)
        )

    def quantile(self, probability: Floats) -> Floats:
        """Value below which a probability lies, the inverse of the cumulative probability, shape of `probability`."""
        borders = self.low + self.step * np.arange(len(self.cumulative))
        return np.interp(probability, self.cumulative, borders)


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
    """Launch directions towards one body by one family: distributed over u like the beams, over psi uniformly."""

    u: tuple[float, float]
    """Least and greatest direction cosine u [1]."""
    u_probability: tuple[float, float]
    """Cumulative probabilities of the density over u at these two values [1]."""
    psi: tuple[float, float]
    """Least and greatest angle psi [rad]."""

    def density(self, u: Floats, psi: Floats, u_density: TabulatedDensity) -> Floats:
        """Probability density of the rays aimed through the window, per solid angle [1/sr], shape of u and of psi."""
        low, psi_width = self.psi[0], self.psi[1] - self.psi[0]
        inside = (u >= self.u[0]) & (u < self.u[1]) & (np.mod(psi - low, 2 * np.pi) < psi_width)
        return np.asarray(inside * u_density.density(u) / ((self.u_probability[1] - self.u_probability[0]) * psi_width))


@dataclass(frozen=True, slots=True)
class LaunchSampler:
    """Sampler of the launch directions of one ping."""

    axes: Floats
    """Boresight, right and down of the array as rows [1], shape (3, 3)."""
    u_density: TabulatedDensity
    """Density of the rays that are not aimed, over u in -1..1."""
    psi_density: TabulatedDensity
    """Density of the rays that are not aimed, over psi in -pi..pi [1/rad]."""
    windows: tuple[AimWindow, ...]
    """Windows that the other rays are aimed through, with an equal number of rays each."""

    def rays(self, seed: int, ping: int, count: int, part: int, parts: int) -> tuple[Floats, Floats]:
        """One part of the rays: in each group every `parts`-th of them from index `part` on.

        Args:
            seed: Seed of the scenario.
            ping: Number of the ping; every ping has independent rays.
            count: Number of all rays of the ping.
            part: Number of the part, from 0.
            parts: Number of parts.

        Returns:
            Launch directions as unit vectors, (n, 3), and the solid angle that each represents [sr], (n,).
        """
        rays_per_window = int(AIMED_FRACTION * count / len(self.windows)) if self.windows else 0
        unaimed_rays = count - rays_per_window * len(self.windows)
        u_and_psi: list[tuple[Floats, Floats]] = []
        for group, size in enumerate([unaimed_rays] + [rays_per_window] * len(self.windows)):
            n = np.arange(part, size, parts)
            shift = random_keys.uniforms(seed, random_keys.TRACER, 0, group, ping, 1)
            jitter = random_keys.uniforms(seed, random_keys.TRACER, n, group, ping, 0)
            first_uniform, second_uniform = (
                (n + jitter[:, 0]) / max(size, 1),
                np.mod(n * _GOLDEN_RATIO_CONJUGATE + shift[0], 1.0),
            )
            if group == 0:
                u_and_psi.append((self.u_density.quantile(second_uniform), self.psi_density.quantile(first_uniform)))
            else:
                (left, right), (low, high) = self.windows[group - 1].u_probability, self.windows[group - 1].psi
                u_in_window = self.u_density.quantile(left + second_uniform * (right - left))
                u_and_psi.append((u_in_window, low + first_uniform * (high - low)))
        all_u, all_psi = (np.concatenate(column) for column in zip(*u_and_psi, strict=True))
        density = unaimed_rays * self.u_density.density(all_u) * self.psi_density.density(_wrapped(all_psi))
        for window in self.windows:
            density += rays_per_window * window.density(all_u, all_psi, self.u_density)
        return self.direction(all_u, all_psi), 1 / density

    def direction(self, u: Floats, psi: Floats) -> Floats:
        """Unit vectors of direction cosines u and angles psi, shape (n, 3)."""
        transverse = np.sqrt(np.maximum(1 - u**2, 0.0))
        return np.asarray(np.stack([transverse * np.cos(psi), u, transverse * np.sin(psi)], axis=-1) @ self.axes)


def _wrapped(psi: Floats) -> Floats:
    """Angles wrapped to -pi to pi [rad]."""
    return np.mod(psi + np.pi, 2 * np.pi) - np.pi


def launch_sampler(
    transmit: Beams, receive: Beams, boundary_paths: list[tuple[PathLength, float, float]],
    window_corners: list[tuple[Floats, bool]],
) -> LaunchSampler:  # fmt: skip
    """Build the sampler of the launch directions of one ping.

    Args:
        transmit: Transmit beams, in the frame of the rays.
        receive: Receive beams of all channels, in the same frame.
        boundary_paths: For each family to a scattering boundary: its one-way path length [m] as a function of launch
            directions (n, 3), infinite where no such path exists, and the least and greatest one-way path length that
            is recorded [m].
        window_corners: For each window, vectors of any length from the sonar's image to what it contains: the corners
            of a body's bounding box for one family, launch directions found for them in layered water, or a patch of
            the surface overhead, (k, 3); and True if the vertical component of the launch directions is reversed by
            the reflections of that family.
    """
    unaimed = LaunchSampler(transmit.axes, _uniform_density(-1, 1), _uniform_density(-np.pi, np.pi), ())
    psi = np.linspace(-np.pi, np.pi, PSI_STEPS + 1)
    middle = (psi[:-1] + psi[1:]) / 2
    steer = float(np.mean(transmit.steer[:, 0]))
    power = _max_power(transmit, unaimed.direction(np.full(PSI_STEPS, steer), middle))
    psi_density = _slant_range_density(unaimed.direction(np.zeros(PSI_STEPS + 1), psi), power, boundary_paths)
    u = -1 + 2 * (np.arange(U_STEPS) + 0.5) / U_STEPS
    u_weight = np.zeros(U_STEPS)
    for psi_of_beam in (0.0, float(middle[np.argmax(power)])):
        directions = unaimed.direction(u, np.full(U_STEPS, psi_of_beam))
        u_weight += _max_power(transmit, directions) * _max_power(receive, directions)
    u_density = tabulated_density(
        -1, 1, UNIFORM_OVER_U / U_STEPS + (1 - UNIFORM_OVER_U) * u_weight / max(u_weight.sum(), 1e-300)
    )
    windows = tuple(_aim_window(transmit.axes, u_density, *corners) for corners in window_corners)
    return LaunchSampler(transmit.axes, u_density, psi_density, windows)


def _slant_range_density(
    directions: Floats, power: Floats, boundary_paths: list[tuple[PathLength, float, float]]
) -> TabulatedDensity:
    """Density over psi for which rays are uniform over the slant range to a boundary, family by family.

    Args:
        directions: Launch directions at the borders of the steps [1], shape (PSI_STEPS + 1, 3).
        power: Transmitted power in each step [1], shape (PSI_STEPS,).
        boundary_paths: See `launch_sampler`.
    """
    weight, density = np.full(PSI_STEPS, 1.0 / PSI_STEPS), np.zeros(PSI_STEPS)
    for path_length, near, far in boundary_paths:
        slant_range = np.clip(path_length(directions), near, far)
        step_weight = np.abs(np.diff(slant_range)) * (MIN_RELATIVE_GAIN + power / max(power.max(), 1e-300))
        density += step_weight / max(step_weight.sum(), 1e-300)
    if density.sum() > 0:
        weight = UNIFORM_OVER_PSI * weight + (1 - UNIFORM_OVER_PSI) * density / density.sum()
    return tabulated_density(-np.pi, np.pi, weight)


def _uniform_density(low: float, high: float) -> TabulatedDensity:
    """Uniform density between two values."""
    return tabulated_density(low, high, np.ones(1))


def _max_power(beams: Beams, directions: Floats) -> Floats:
    """Largest intensity pattern of all beams, re their axes, in given directions [1], shape (n,)."""
    return np.asarray((beams.gain(directions) ** 2).max(axis=0))


def _aim_window(axes: Floats, u_density: TabulatedDensity, corners: Floats, is_flipped: bool) -> AimWindow:
    """Window of launch directions about the corners, with a margin.

    Args:
        axes: Boresight, right and down of the array as rows [1], shape (3, 3).
        u_density: Density over u.
        corners: Vectors of any length from an image of the sonar to the corners, shape (k, 3).
        is_flipped: True: the vertical component of the launch directions is reversed.
    """
    corner_ray = corners * np.array([1, 1, -1 if is_flipped else 1])
    forward, u, down = ((corner_ray / np.maximum(np.linalg.norm(corner_ray, axis=1, keepdims=True), 1e-9)) @ axes.T).T
    psi = np.arctan2(down, forward)
    middle = float(np.arctan2(np.sin(psi).mean(), np.cos(psi).mean()))
    psi_offset = _wrapped(psi - middle)
    psi_width = min((1 + 2 * WINDOW_MARGIN) * float(np.ptp(psi_offset)) + _MIN_WINDOW, 2 * np.pi)
    u_width = (1 + 2 * WINDOW_MARGIN) * float(np.ptp(u)) + _MIN_WINDOW
    psi_low = middle + float(psi_offset.min() + psi_offset.max()) / 2 - psi_width / 2
    u_low = float(u.min() + u.max()) / 2 - u_width / 2
    u_limits = max(u_low, -1.0), min(u_low + u_width, 1.0)
    borders = u_density.low + u_density.step * np.arange(len(u_density.cumulative))
    probability = np.interp(u_limits, borders, u_density.cumulative)
    return AimWindow(u_limits, (float(probability[0]), float(probability[1])), (psi_low, psi_low + psi_width))
