"""Reflection by the facets of a moving sea: coherent part, density of slopes, and random slopes.

The coherent part of a bounce is exp(-q^2 sigma^2) of the intensity, q the vertical change of the wave vector (Eckart
1953, J. Acoust. Soc. Am. 25, 566). The rest is scattered by facets as in geometric optics: their cross section per
unit area is sec^4(tilt) p(slope) / 4 (Barrick 1968, IEEE Trans. Antennas Propag. 16, 449; not verified). Slopes are
wavenumbers of glints over q, and their density is that of the Poisson sums of waves that glints are drawn from
(`insonify.propagation.glint_kernel`): of the finest waves few, of all longer ones a normal distribution.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify import random_keys
from insonify.engines.tracer._facet_kernel import sample_wavenumbers
from insonify.propagation.glint_kernel import MAX_SINGLE_QUANTA
from insonify.propagation.wind_waves import WindWaves, shortest_wavenumber, wind_waves
from insonify.scattering.bubbles import bubble_loss_db
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]

MAX_SLOPE, CELLS = 1.2, 512
"""Largest slope of the tables along each axis, and cells of a table along it [1]."""
MIN_SINE, NODES = 0.02, 24
"""Least sine of the grazing angle of the tables, and number of tables in equal ratios from there to 1 [1]."""


@dataclass(frozen=True, slots=True, eq=False)
class FacetSurface:
    """Facets of a statistical sea for sound of one frequency, in the scatterer grid's frame."""

    waves: WindWaves
    wind_speed: float
    """Wind 10 m above the sea [m/s]."""
    frequency: float
    """Frequency of the sound [Hz]."""
    wavenumber: float
    """Wavenumber of the sound at the surface [rad/m]."""
    axes: Floats
    """Horizontal directions of the waves (towards), and of that to the right, as rows [1], shape (2, 2)."""
    key: tuple[int, int]
    """Key of the random slopes."""

    @property
    def spread(self) -> float:
        """Spread of the grazing angles of bounces about that of a calm surface [rad]."""
        return float(np.sqrt(self.waves.slope_moments[:2, -1].max()))

    def coherent_intensity(self, sine: Floats) -> Floats:
        """Coherent part of the intensity of a bounce, less bubble loss [1], by the sine of its grazing angle."""
        return np.exp(-self._mean_quanta(2 * self.wavenumber * sine)) * self._bubble_factor(sine)

    def scattered_per_steradian(self, incoming: Floats, outgoing: Floats) -> Floats:
        """Cross section of the facets per unit area over the sine of the incident grazing angle [1/sr], shape (n,).

        Args:
            incoming: Directions of the incident rays [1], shape (n, 3).
            outgoing: Directions of the reflected rays [1], shape (n, 3).
        """
        slope, vertical_change = self._slopes(incoming, outgoing)
        sine_in, sine_out = -incoming[:, 2], outgoing[:, 2]
        density = self._density(slope, vertical_change) * -np.expm1(-self._mean_quanta(vertical_change))
        squared_secant = 1 + np.sum(slope**2, axis=1)
        section = density * squared_secant**2 / 4 * self._bubble_factor((sine_in + sine_out) / 2)
        return np.where((sine_in > 0) & (sine_out > 0), section / np.maximum(sine_in, 1e-12), 0.0)

    def reflected(
        self, direction: Floats, launch: Floats, number: NDArray[np.int64], code: int
    ) -> tuple[Floats, Floats]:  # fmt: skip
        """Reflect rays at random facets.

        Args:
            direction: Directions of the incident rays [1], shape (n, 3).
            launch: Their launch directions, which identify them [1], shape (n, 3).
            number: Their numbers among those of one launch direction, shape (n,).
            code: Number of the bounce.

        Returns:
            Directions of travel after the reflection [1], (n, 3), and the ratio of the energy of each ray after and
            before it [1], (n,).
        """
        sine = np.clip(-direction[:, 2], 1e-6, 1.0)
        phase_per_height, wavenumber = 2 * self.wavenumber * sine, np.empty((len(direction), 2))
        bits, gives_slope = np.ascontiguousarray(launch).view(np.uint64), np.empty(len(direction), bool)
        ray_id = bits[:, 0] ^ (bits[:, 1] << np.uint64(1)) ^ (bits[:, 2] << np.uint64(2))
        ray_id = ray_id ^ (number.astype(np.uint64) << np.uint64(32))
        sample_wavenumbers(ray_id, code, self.key, phase_per_height, self.waves, wavenumber, gives_slope)
        change = wavenumber @ self.axes
        normal = np.column_stack([change / phase_per_height[:, None], np.ones(len(direction))])
        facing = np.einsum("ij,ij->i", direction, normal) / np.sum(normal**2, axis=1)
        by_slope = direction - 2 * facing[:, None] * normal
        horizontal = direction[:, :2] + change / self.wavenumber
        vertical = np.sqrt(np.maximum(1 - np.sum(horizontal**2, axis=1), 0.0))
        reflected_direction = np.where(gives_slope[:, None], by_slope, np.column_stack([horizontal, vertical]))
        is_reflected = reflected_direction[:, 2] > 1e-6
        outgoing = np.where(is_reflected[:, None], reflected_direction, [0.0, 0.0, 1.0])
        scattered = self.scattered_per_steradian(direction, outgoing)
        fraction = scattered / np.maximum(self._drawn_per_steradian(direction, outgoing), 1e-30)
        return reflected_direction, np.where(is_reflected & (scattered > 0), fraction, 0.0)

    def _drawn_per_steradian(self, incoming: Floats, outgoing: Floats) -> Floats:
        """Probability density of the random directions of `reflected` [1/sr], shape (n,): the mean of two densities.

        A glint of the grazing angle of incidence gives either its slope or its change of the horizontal wavenumber. In
        the limit of a rough sea the density of slopes is independent of the grazing angle out of the surface, in that
        of a smooth one the density of wavenumbers. Balance heuristic of Veach & Guibas (1995), Proc. SIGGRAPH 95, 419.
        """
        direction_change = outgoing - incoming
        slope, _ = self._slopes(incoming, outgoing)
        flat_change = np.maximum(-2 * incoming[:, 2], 1e-9)
        phase_per_height, vertical = self.wavenumber * flat_change, np.maximum(direction_change[:, 2], 1e-9)
        # solid angle of directions per area of slopes, 4 cos(incidence) cos^3(tilt), and of horizontal wavenumbers
        slope_area = 2 * np.linalg.norm(direction_change, axis=1) * (1 + np.sum(slope**2, axis=1)) ** -1.5
        wavenumber_slope = slope * (vertical / flat_change)[:, None]
        wavenumber_area = flat_change**2 / np.maximum(outgoing[:, 2], 1e-9)
        by_slope = self._density(slope, phase_per_height) / slope_area
        by_wavenumber = self._density(wavenumber_slope, phase_per_height) / wavenumber_area
        return np.asarray((by_slope + by_wavenumber) / 2)

    def phase_rate(self, incoming: Floats, outgoing: Floats) -> tuple[Floats, Floats]:
        """Mean rate of change of the phase of reflections by facets [rad/s], its variance [rad^2/s^2], shapes (n,).

        Args:
            incoming: Directions towards the surface, outwards from the sonar [1], shape (n, 3).
            outgoing: Directions from the surface [1], shape (n, 3).
        """
        slope, vertical_change = self._slopes(incoming, outgoing)
        along_variance, _, rate_variance, covariance = self.waves.slope_moments[:, -1]
        mean = vertical_change * slope[:, 0] * covariance / along_variance
        return mean, vertical_change**2 * (rate_variance - covariance**2 / along_variance)

    def _slopes(self, incoming: Floats, outgoing: Floats) -> tuple[Floats, Floats]:
        """Slopes of facets along and across the wind [1] (n, 2), vertical change of the wave vector [rad/m] (n,)."""
        direction_change = outgoing - incoming
        down = np.maximum(direction_change[:, 2], 1e-9)
        return direction_change[:, :2] @ self.axes.T / down[:, None], self.wavenumber * down

    def _mean_quanta(self, vertical_change: Floats) -> Floats:
        """Mean number of quanta of a bounce [1]; by the vertical change of the wave vector [rad/m]."""
        return np.asarray(vertical_change**2 * self.waves.variance[-1])

    def _bubble_factor(self, sine: Floats) -> Floats:
        """Factor of bubbles on the intensity [1], by the sine of the grazing angle, shape of `sine`."""
        loss = bubble_loss_db(self.wind_speed, self.frequency, np.arcsin(np.clip(sine, 1e-6, 1.0)))
        return np.asarray(10 ** (-loss / 10))

    def _density(self, slope: Floats, vertical_change: Floats) -> Floats:
        """Density of slopes (n, 2) [1], from the tables by the vertical change of the wave vector [rad/m], (n,)."""
        tables = slope_densities(self.wind_speed, self.wavenumber, self.waves.wavenumber[-1])
        incoherent = -np.expm1(-self._mean_quanta(np.maximum(vertical_change, 2 * self.wavenumber * MIN_SINE)))
        slope = slope * np.sqrt(incoherent)[:, None]
        row = np.log(np.maximum(vertical_change / (2 * self.wavenumber), MIN_SINE) / MIN_SINE) / -math.log(MIN_SINE)
        row = np.clip(row * (NODES - 1), 0.0, NODES - 1.000001)
        cells = np.clip((slope / MAX_SLOPE + 1) * CELLS / 2, 0.0, CELLS - 1.000001)
        (k, i, j), total = (index.astype(np.int64) for index in (row, *cells.T)), np.zeros(len(row))
        r, u, v, flat = row - k, cells[:, 0] - i, cells[:, 1] - j, tables.ravel()
        first = (k * CELLS + i) * CELLS + j
        for a, b, c in np.ndindex(2, 2, 2):
            weight = (r if a else 1 - r) * (u if b else 1 - u) * (v if c else 1 - v)
            total += weight * flat.take(first + ((a * CELLS + b) * CELLS + c))
        return np.where(np.abs(slope).max(axis=1) < MAX_SLOPE * (1 - 2 / CELLS), total * incoherent, 0.0)


def facet_surface(scene: Scene, seed: int, frequency: float) -> FacetSurface | None:
    """Facets of the sea of a scene; None for a flat surface.

    Args:
        scene: The scene.
        seed: Seed of the scenario.
        frequency: Frequency of the sound [Hz].
    """
    wind = scene.surface.wind_speed
    if scene.surface.reflection != "statistical" or wind is None:
        return None
    speed = float(scene.water.sound_speed_at(0.0))
    angle = scene.surface.wave_direction - scene.seabed.scatterer_grid.heading
    axes = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    waves = wind_waves(wind, shortest_wavenumber(frequency, speed))
    key = random_keys.stream_key(seed, random_keys.GLINT)
    return FacetSurface(waves, wind, frequency, 2 * math.pi * frequency / speed, axes, key)


@lru_cache(maxsize=2)
def slope_densities(wind_speed: float, wavenumber: float, shortest_wavenumber: float) -> NDArray[np.float32]:
    """Densities of the slopes of facets along and across the wind, at `NODES` grazing angles, (NODES, CELLS, CELLS).

    Of slopes times the square root of the incoherent part of a bounce: their variance is then that of the waves.

    Args:
        wind_speed: Wind 10 m above the sea [m/s].
        wavenumber: Wavenumber of the sound [rad/m].
        shortest_wavenumber: Wavenumber of the shortest waves [rad/m].
    """
    waves = wind_waves(wind_speed, shortest_wavenumber)
    sines = np.geomspace(MIN_SINE, 1.0, NODES)
    densities = [_slope_density(waves, 2 * wavenumber * float(sine)) for sine in sines]
    return np.array(densities, np.float32)


def _slope_density(waves: WindWaves, phase_per_height: float) -> Floats:
    """Density of the slopes of glints with a phase per height [rad/m], given at least one quantum, (CELLS, CELLS)."""
    total_variance, step = float(waves.variance[-1]), 2 * MAX_SLOPE / CELLS
    mean_quanta = phase_per_height**2 * total_variance
    incoherent = -math.expm1(-mean_quanta)
    longer_variance = total_variance - min(mean_quanta, MAX_SINGLE_QUANTA) / phase_per_height**2
    along_variance, across_variance = (
        np.interp(longer_variance, waves.variance, moment) for moment in waves.slope_moments[:2]
    )
    quantum_density = _quantum_slope_density(waves, phase_per_height / math.sqrt(incoherent), longer_variance)
    along, across = (2 * np.pi * grid(CELLS, step) for grid in (np.fft.fftfreq, np.fft.rfftfreq))
    normal_spectrum = np.exp(-0.5 * incoherent * (along_variance * along[:, None] ** 2 + across_variance * across**2))
    # the real part is that of slopes of either sign, which are equally likely
    spectrum = normal_spectrum * np.exp(min(mean_quanta, MAX_SINGLE_QUANTA) * (np.fft.rfft2(quantum_density).real - 1))
    if mean_quanta <= MAX_SINGLE_QUANTA:
        spectrum = (spectrum - math.exp(-mean_quanta)) / incoherent
    density = np.fft.fftshift(np.fft.irfft2(spectrum, (CELLS, CELLS))) / step**2
    return np.maximum(density, 0.0)


def _quantum_slope_density(waves: WindWaves, phase_per_height: float, longer_variance: float) -> Floats:
    """Probability of slopes up to sign that a quantum of waves beyond a variance [m^2] adds; slope 0 first."""
    wavenumber = np.sqrt(waves.wavenumber[1:] * waves.wavenumber[:-1])
    variance_step = np.diff(np.maximum(waves.variance, longer_variance))
    direction_quantiles = waves.direction_quantiles
    row = np.linspace(0, len(direction_quantiles) - 1, len(waves.wavenumber))
    row = np.minimum((row[1:] + row[:-1]) / 2, len(direction_quantiles) - 1.000001)
    fraction, low = (row % 1)[:, None], row.astype(np.int64)
    direction = direction_quantiles[low] + fraction * (direction_quantiles[low + 1] - direction_quantiles[low])
    direction = (direction[:, 1:] + direction[:, :-1]) / 2
    weight = np.repeat(variance_step / variance_step.sum() / direction.shape[1], direction.shape[1])
    slope = (wavenumber / phase_per_height)[:, None] * np.array([np.cos(direction), np.sin(direction)])
    density = np.zeros(CELLS * CELLS)
    limit = MAX_SLOPE * (1 - 2 / CELLS)
    x, y = (np.clip(slope_axis.ravel(), -limit, limit) * CELLS / (2 * MAX_SLOPE) for slope_axis in slope)
    i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
    u, v = x - i, y - j
    for a, b in np.ndindex(2, 2):
        cell = (i + a) % CELLS * CELLS + (j + b) % CELLS
        density += np.bincount(cell, weight * (u if a else 1 - u) * (v if b else 1 - v), CELLS * CELLS)
    return density.reshape(CELLS, CELLS)
