"""Reflection off the facets of a moving sea: coherent part, density of slopes, and random slopes.

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
from insonify.propagation.glint_kernel import MOST
from insonify.propagation.wind_waves import WindWaves, shortest_wavenumber, wind_waves
from insonify.scattering.bubbles import bubble_loss_db
from insonify.scene.scene import Scene

Floats = NDArray[np.float64]

STEEPEST, CELLS = 1.2, 512
"""Largest slope of the tables along each axis, and cells of a table along it [1]."""
LEAST_SINE, NODES = 0.02, 24
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
    """Direction of the waves, and that to the right of it, as rows [1], shape (2, 2)."""
    key: tuple[int, int]
    """Key of the random slopes."""

    @property
    def spread(self) -> float:
        """Spread of the grazing angles of bounces about that of a calm surface [rad]."""
        return float(np.sqrt(self.waves.slope_moments[:2, -1].max()))

    def coherent_intensity(self, sine: Floats) -> Floats:
        """Coherent part of the intensity of a bounce, less bubble loss [1], by the sine of its grazing angle."""
        return np.exp(-self._quanta(2 * self.wavenumber * sine)) * self._bubbles(sine)

    def scattered_per_steradian(self, incoming: Floats, outgoing: Floats) -> Floats:
        """Cross section of the facets per unit area over the sine of the incident grazing angle [1/sr], shape (n,).

        Args:
            incoming: Directions of the incident rays [1], shape (n, 3).
            outgoing: Directions of the reflected rays [1], shape (n, 3).
        """
        slope, change = self._slopes(incoming, outgoing)
        sine_in, sine_out = -incoming[:, 2], outgoing[:, 2]
        density = self._density(slope, change) * -np.expm1(-self._quanta(change))
        steep = 1 + np.sum(slope**2, axis=1)
        section = density * steep**2 / 4 * self._bubbles((sine_in + sine_out) / 2)
        return np.where((sine_in > 0) & (sine_out > 0), section / np.maximum(sine_in, 1e-12), 0.0)

    def reflected(
        self, direction: Floats, launch: Floats, number: NDArray[np.int64], code: int
    ) -> tuple[Floats, Floats]:  # fmt: skip
        """Directions after reflection off random facets (n, 3), and the fraction of the energy [1] (n,).

        Args:
            direction: Directions of the incident rays [1], shape (n, 3).
            launch: Their launch directions, which identify them [1], shape (n, 3).
            number: Their numbers among those of one launch direction, shape (n,).
            code: Number of the bounce.
        """
        sine = np.clip(-direction[:, 2], 1e-6, 1.0)
        phase, wavenumber = 2 * self.wavenumber * sine, np.empty((len(direction), 2))
        bits = np.ascontiguousarray(launch).view(np.uint64)
        ray_id = bits[:, 0] ^ (bits[:, 1] << np.uint64(1)) ^ (bits[:, 2] << np.uint64(2))
        ray_id = ray_id ^ (number.astype(np.uint64) << np.uint64(32))
        sample_wavenumbers(ray_id, code, self.key, phase, self.waves, wavenumber)
        normal = np.column_stack([wavenumber @ self.axes / phase[:, None], np.ones(len(direction))])
        tilt = 1 / np.linalg.norm(normal, axis=1)
        normal *= tilt[:, None]
        facing = -np.einsum("ij,ij->i", direction, normal)
        out = direction + 2 * facing[:, None] * normal
        # facets are seen in proportion to the cosine of the angle of incidence
        fraction = facing / (tilt * sine) * -np.expm1(-self._quanta(phase)) * self._bubbles(sine)
        return out, np.where((facing > 0) & (out[:, 2] > 0), fraction, 0.0)

    def turning(self, incoming: Floats, outgoing: Floats) -> tuple[Floats, Floats]:
        """Mean rate of the phase of bounces by facets [rad/s], and its variance [rad^2/s^2], shapes (n,).

        Args:
            incoming: Directions towards the surface, outwards from the sonar [1], shape (n, 3).
            outgoing: Directions from the surface [1], shape (n, 3).
        """
        slope, change = self._slopes(incoming, outgoing)
        ahead, _, speed, both = self.waves.slope_moments[:, -1]
        return change * slope[:, 0] * both / ahead, change**2 * (speed - both**2 / ahead)

    def _slopes(self, incoming: Floats, outgoing: Floats) -> tuple[Floats, Floats]:
        """Slopes of facets along and across the wind [1] (n, 2), vertical change of the wave vector [rad/m] (n,)."""
        change = outgoing - incoming
        down = np.maximum(change[:, 2], 1e-9)
        return change[:, :2] @ self.axes.T / down[:, None], self.wavenumber * down

    def _quanta(self, change: Floats) -> Floats:
        """Mean number of quanta of a bounce [1]; `change` as in `_slopes`."""
        return np.asarray(change**2 * self.waves.variance[-1])

    def _bubbles(self, sine: Floats) -> Floats:
        """Factor of bubbles on the intensity [1]."""
        loss = bubble_loss_db(self.wind_speed, self.frequency, np.arcsin(np.clip(sine, 1e-6, 1.0)))
        return np.asarray(10 ** (-loss / 10))

    def _density(self, slope: Floats, change: Floats) -> Floats:
        """Density of slopes [1], shape (n,): interpolated in the tables."""
        tables = slope_densities(self.wind_speed, self.wavenumber, self.waves.wavenumber[-1])
        row = np.log(np.maximum(change / (2 * self.wavenumber), LEAST_SINE) / LEAST_SINE) / -math.log(LEAST_SINE)
        row = np.clip(row * (NODES - 1), 0.0, NODES - 1.000001)
        cells = np.clip((slope / STEEPEST + 1) * CELLS / 2, 0.0, CELLS - 1.000001)
        (k, i, j), total = (index.astype(np.int64) for index in (row, *cells.T)), np.zeros(len(row))
        r, u, v = row - k, cells[:, 0] - i, cells[:, 1] - j
        for a, b, c in np.ndindex(2, 2, 2):
            weight = (r if a else 1 - r) * (u if b else 1 - u) * (v if c else 1 - v)
            total += weight * tables[k + a, i + b, j + c]
        return np.where(np.abs(slope).max(axis=1) < STEEPEST * (1 - 2 / CELLS), total, 0.0)


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
def slope_densities(wind_speed: float, wavenumber: float, shortest: float) -> NDArray[np.float32]:
    """Densities of the slopes of facets along and across the wind, at `NODES` grazing angles, (NODES, CELLS, CELLS).

    Args:
        wind_speed: Wind 10 m above the sea [m/s].
        wavenumber: Wavenumber of the sound [rad/m].
        shortest: Wavenumber of the shortest waves [rad/m].
    """
    waves = wind_waves(wind_speed, shortest)
    sines = np.geomspace(LEAST_SINE, 1.0, NODES)
    densities = [_slope_density(waves, 2 * wavenumber * float(sine)) for sine in sines]
    return np.array(densities, np.float32)


def _slope_density(waves: WindWaves, phase: float) -> Floats:
    """Density of the slopes of glints with a phase per height [rad/m], given at least one quantum, (CELLS, CELLS)."""
    whole, step = float(waves.variance[-1]), 2 * STEEPEST / CELLS
    mean = phase**2 * whole
    longer = whole - min(mean, MOST) / phase**2
    ahead, aside = (np.interp(longer, waves.variance, moment) for moment in waves.slope_moments[:2])
    jumps = _jump_density(waves, phase, longer)
    frequency = 2 * np.pi * np.fft.fftfreq(CELLS, step)
    normal = np.exp(-0.5 * (ahead * frequency[:, None] ** 2 + aside * frequency**2))
    spectrum = normal * np.exp(min(mean, MOST) * (np.fft.fft2(jumps).real - 1))
    if mean <= MOST:
        spectrum = (spectrum - math.exp(-mean)) / -math.expm1(-mean)
    density = np.fft.fftshift(np.fft.ifft2(spectrum).real) / step**2
    return np.maximum(density, 0.0)


def _jump_density(waves: WindWaves, phase: float, longer: float) -> Floats:
    """Probability of the slopes that one quantum adds, of waves beyond a variance [m^2], (CELLS, CELLS), 0 first."""
    wavenumber = np.sqrt(waves.wavenumber[1:] * waves.wavenumber[:-1])
    share = np.diff(np.maximum(waves.variance, longer))
    table = waves.direction_quantiles
    row = np.linspace(0, len(table) - 1, len(waves.wavenumber))
    row = np.minimum((row[1:] + row[:-1]) / 2, len(table) - 1.000001)
    part, low = (row % 1)[:, None], row.astype(np.int64)
    turns = table[low] + part * (table[low + 1] - table[low])
    turns = (turns[:, 1:] + turns[:, :-1]) / 2
    weight = np.repeat(share / share.sum() / turns.shape[1], turns.shape[1])
    slope = (wavenumber / phase)[:, None] * np.array([np.cos(turns), np.sin(turns)])
    density = np.zeros(CELLS * CELLS)
    limit = STEEPEST * (1 - 2 / CELLS)
    for sense in (1, -1):
        x, y = (np.clip(sense * slope_axis.ravel(), -limit, limit) * CELLS / (2 * STEEPEST) for slope_axis in slope)
        i, j = np.floor(x).astype(np.int64), np.floor(y).astype(np.int64)
        u, v = x - i, y - j
        for a, b in np.ndindex(2, 2):
            at = (i + a) % CELLS * CELLS + (j + b) % CELLS
            density += np.bincount(at, weight / 2 * (u if a else 1 - u) * (v if b else 1 - v), CELLS * CELLS)
    return density.reshape(CELLS, CELLS)
