"""Moving sea surface: a random sum of waves drawn from a spectrum, each with its own phase speed.

The plane of wavenumbers is cut into cells (bands of wavenumber, sectors of direction) that carry equal parts of the sum
of relative height variance and relative slope variance. Each cell gives one wave: its energy is the cell's, its
wavenumber and direction are drawn inside the cell in proportion to the spectrum, its phase at random. Every realisation
has exactly the variance of the spectrum, and the mean over seeds has exactly its correlation in space and time. The
wavenumbers have no common divisor, so that the surface has no period and no edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.directional_spreading import CosinePowerSpreading, DirectionalSpreading
from insonify.ocean.wave_kernels import fill_heights, fill_motion
from insonify.ocean.wave_spectrum import Floats, WaveSpectrum, angular_frequency
from insonify.random_keys import SEA_SURFACE, uniforms
from insonify.validity import require_number, require_numbers

MAX_WAVES = 1_000_000
"""Number of waves beyond which a sea would be a mistake, or exceed the memory."""
_GRID = 8192
"""Number of wavenumbers of the table from which the bands are interpolated."""


@dataclass(frozen=True, slots=True)
class SurfaceMotion:
    """Elevation, slopes and vertical velocity of the surface at positions and times, arrays of one shape."""

    elevation: Floats
    """Height above the mean surface, up positive [m]; z, which is depth, is minus this."""
    slope_north: Floats
    """Increase of elevation per metre northwards [1]."""
    slope_east: Floats
    """Increase of elevation per metre eastwards [1]."""
    vertical_velocity: Floats
    """Speed at which the surface rises [m/s]."""

    @property
    def depth(self) -> Floats:
        """World z of the surface, down positive [m]."""
        return np.asarray(-self.elevation)

    @property
    def normal(self) -> Floats:
        """Unit vector into the water (north, east, down), (0, 0, 1) under a flat sea [1], shape (..., 3)."""
        down = np.stack((self.slope_north, self.slope_east, np.ones_like(self.slope_north)), axis=-1)
        return np.asarray(down / np.linalg.norm(down, axis=-1, keepdims=True))


@dataclass(frozen=True, slots=True)
class SeaSurface:
    """Sea surface at any position and time, of unlimited extent.

    Source: Longuet-Higgins (1957), Phil. Trans. R. Soc. A 249, 321, for the random sum;
    stratified drawing is this project's. Linear waves: crests are as round as troughs.

    Example:
        >>> sea = SeaSurface(PiersonMoskowitz(wind_speed=7.0), wave_direction=np.pi / 2, seed=1)
        >>> sea.elevation(north=0.0, east=0.0, time=[0.0, 1.0, 2.0]).round(1).tolist()  # m
        [0.5, 0.2, -0.3]
        >>> f"significant height {4 * np.sqrt(np.sum(sea.amplitude**2) / 2):.1f} m"
        'significant height 1.1 m'
    """

    spectrum: WaveSpectrum
    """Variance of the height per wavenumber."""
    directional_spreading: DirectionalSpreading = field(default_factory=CosinePowerSpreading)
    """Distribution of the waves of one wavenumber over directions."""
    wave_direction: float = 0.0
    """Direction towards which the waves travel, clockwise from north [rad]; pi/2 is east."""
    seed: int = 0
    """Random seed of the scenario [1]."""
    shortest_wavelength: float = 0.3
    """Wavelength of the shortest waves drawn [m]; shorter ones stay in the scattering law, as slope and roughness."""
    water_depth: float = math.inf
    """Mean depth of the water, which slows long waves down [m]."""
    bands: int = 64
    """Bands of wavenumber [1]; another number gives another realisation."""
    directions: int = 16
    """Waves of different direction in each band [1]; another number gives another realisation."""
    amplitude: Floats = field(init=False, repr=False, compare=False)
    """Amplitude of each wave [m], shape (bands * directions,)."""
    wavenumber: Floats = field(init=False, repr=False, compare=False)
    """Wavenumber of each wave, north and east [rad/m], shape (2, bands * directions)."""
    phase: Floats = field(init=False, repr=False, compare=False)
    """Phase of each wave at the origin at time 0 [cycles], shape (bands * directions,)."""

    def __post_init__(self) -> None:
        """Check the arguments, then draw the waves."""
        _check_counts(self.bands, self.directions, self.seed)
        object.__setattr__(
            self, "wave_direction", require_number("SeaSurface.wave_direction", self.wave_direction, "rad")
        )
        if not (isinstance(self.water_depth, float) and self.water_depth == math.inf):
            depth = require_number("SeaSurface.water_depth", self.water_depth, "m", 0.0, exclude_low=True)
            object.__setattr__(self, "water_depth", depth)
        shortest = self.shortest_wavelength
        shortest = require_number("SeaSurface.shortest_wavelength", shortest, "m", 0.0, exclude_low=True)
        object.__setattr__(self, "shortest_wavelength", shortest)
        dominant = 2 * math.pi / self.spectrum.peak
        if shortest >= dominant:
            raise ValueError(
                f"SeaSurface.shortest_wavelength is {shortest} m; the dominant waves are {dominant:.3g} m long. "
                "Give a length well below that, such as a tenth of it"
            )
        self._draw()

    def _draw(self) -> None:
        band, sector = (n.ravel() for n in np.mgrid[: self.bands, : self.directions])
        draws = uniforms(self.seed, SEA_SURFACE, band, sector)
        k, variance = self._wavenumbers(band, draws[:, 0])
        angle = self.wave_direction + self.directional_spreading.quantile((sector + draws[:, 1]) / self.directions, k)
        for name, column in (
            ("amplitude", np.sqrt(2 * variance / self.directions)),
            ("wavenumber", np.stack((k * np.cos(angle), k * np.sin(angle)))),
            ("phase", draws[:, 2].copy()),
        ):
            column.setflags(write=False)  # a frozen dataclass does not protect its arrays
            object.__setattr__(self, name, column)

    def _wavenumbers(self, band: NDArray[np.int64], fraction: Floats) -> tuple[Floats, Floats]:
        """Wavenumber of each draw [rad/m], at a fraction of its band's variance, and the band's variance [m^2]."""
        low, high = self.spectrum.peak / 8, 2 * math.pi / self.shortest_wavelength
        k = np.geomspace(low, high, _GRID)
        height_below = _cumulative_integral(k, self.spectrum.density(k))
        slope_below = _cumulative_integral(k, k**2 * self.spectrum.density(k))
        # Half of the bands follow height, concentrated at the peak, and half slope, which every octave contributes to.
        cumulative_sum = height_below / height_below[-1] + slope_below / slope_below[-1]
        edges = np.interp(np.linspace(0, 2, self.bands + 1), cumulative_sum, height_below)
        variance = np.diff(edges)[band]
        cumulative = edges[band] + fraction * variance
        # The ends of the table hold next to no energy, and equal values would not be invertible.
        rising = np.concatenate(([True], np.diff(height_below) > 0))
        return np.interp(cumulative, height_below[rising], k[rising]), variance

    @property
    def frequency(self) -> Floats:
        """Angular frequency of each wave [rad/s], shape (bands * directions,)."""
        return angular_frequency(np.hypot(*self.wavenumber), water_depth=self.water_depth)

    def elevation(self, north: ArrayLike, east: ArrayLike, time: ArrayLike) -> Floats:
        """Height of the surface above its mean, up positive [m].

        Args:
            north: World coordinate [m], any shape.
            east: World coordinate [m], broadcast.
            time: Time since the scenario's start [s], broadcast.

        Returns:
            Elevation [m], broadcast shape.
        """
        positions, shape = _columns(north, east, time)
        height = np.empty(positions.shape[1])
        fill_heights(positions, self._cycles(), self.amplitude.copy(), height)
        return height.reshape(shape)

    def depth(self, north: ArrayLike, east: ArrayLike, time: ArrayLike) -> Floats:
        """World z of the surface, down positive: minus `elevation` at the same arguments [m]."""
        return np.asarray(-self.elevation(north, east, time))

    def motion(self, north: ArrayLike, east: ArrayLike, time: ArrayLike) -> SurfaceMotion:
        """Height, slopes and vertical velocity of the surface.

        Args:
            north: World coordinate [m], any shape.
            east: World coordinate [m], broadcast.
            time: Time since the scenario's start [s], broadcast.

        Returns:
            Arrays of the broadcast shape; slopes and velocity are exact derivatives of the elevation.
        """
        positions, shape = _columns(north, east, time)
        columns = np.empty((4, positions.shape[1]))
        fill_motion(positions, self._cycles(), self.amplitude.copy(), columns)
        return SurfaceMotion(*(c.reshape(shape) for c in columns))

    def _cycles(self) -> Floats:
        """Waves as the kernels take them: cycles per metre north and east, per second, and at the origin."""
        return np.stack((*self.wavenumber, -self.frequency, 2 * math.pi * self.phase)) / (2 * math.pi)


def _check_counts(bands: int, directions: int, seed: int) -> None:
    for name, count, least in (("bands", bands, 1), ("directions", directions, 1), ("seed", seed, 0)):
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < least:
            raise ValueError(f"SeaSurface.{name} is {count!r}; give a whole number, {least} or more")
    if bands * directions > MAX_WAVES:
        raise ValueError(f"SeaSurface has {bands} bands of {directions} directions; give {MAX_WAVES} waves at most")


def _cumulative_integral(k: Floats, density: Floats) -> Floats:
    """Integral of a density over wavenumber up to each k; trapezoidal in log k, which follows power laws."""
    per_log = density * k
    return np.concatenate(([0.0], np.cumsum((per_log[1:] + per_log[:-1]) / 2 * np.diff(np.log(k)))))


def _columns(north: ArrayLike, east: ArrayLike, time: ArrayLike) -> tuple[Floats, tuple[int, ...]]:
    arguments = (("north", north, "m"), ("east", east, "m"), ("time", time, "s"))
    columns = np.broadcast_arrays(*(require_numbers(name, value, unit) for name, value, unit in arguments))
    return np.stack([c.ravel() for c in columns]), columns[0].shape
