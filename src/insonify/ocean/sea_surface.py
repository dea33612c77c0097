"""A sea that moves: waves drawn from a spectrum, each running at its own speed.

The plane of wavenumbers is cut into cells (bands of length, sectors of direction) that
carry equal shares of what matters. Each cell sends one wave: its energy is all of the
cell's, its length and direction are drawn inside the cell in proportion to the spectrum,
its phase at random. So every sea drawn has exactly the asked variance, and the mean over
seeds has exactly the asked correlation in space and time. As the wavenumbers have no common
divisor the sea never repeats: it has no period and no edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.ocean.directional_spreading import CosinePowerSpreading, DirectionalSpreading
from insonify.ocean.wave_kernels import add_heights, add_motion
from insonify.ocean.wave_spectrum import Floats, WaveSpectrum, angular_frequency
from insonify.random_keys import SEA_SURFACE, uniforms
from insonify.validity import require_number, require_numbers

MAX_WAVES = 1_000_000
"""Waves beyond which a sea would be a mistake, or the end of the memory [1]."""
_GRID = 8192
"""Wavenumbers of the table in which the shares are looked up [1]."""


@dataclass(frozen=True, slots=True)
class SurfaceMotion:
    """What the surface does at some places and times, as columns of one shape."""

    elevation: Floats
    """Height above the mean surface, up positive [m]; z, which is depth, is minus this."""
    slope_north: Floats
    """Change of elevation per metre northwards [1]."""
    slope_east: Floats
    """Change of elevation per metre eastwards [1]."""
    vertical_velocity: Floats
    """Speed at which the surface rises [m/s]."""

    @property
    def depth(self) -> Floats:
        """Where the surface is in the world's z, down positive [m]."""
        return np.asarray(-self.elevation)

    @property
    def normal(self) -> Floats:
        """Unit vector into the water (north, east, down), (0, 0, 1) under a flat sea [1], shape (..., 3)."""
        down = np.stack((self.slope_north, self.slope_east, np.ones_like(self.slope_north)), axis=-1)
        return np.asarray(down / np.linalg.norm(down, axis=-1, keepdims=True))


@dataclass(frozen=True, slots=True)
class SeaSurface:
    """The surface of the sea at any place and time, of unlimited extent.

    Source: Longuet-Higgins (1957), Phil. Trans. R. Soc. A 249, 321, for the random sum;
    stratified drawing is this project's. Linear waves: crests are as round as troughs.
    """

    spectrum: WaveSpectrum
    """How the variance of height is shared among wavenumbers."""
    directional_spreading: DirectionalSpreading = field(default_factory=CosinePowerSpreading)
    """How the waves of one wavenumber are shared among directions."""
    wave_direction: float = 0.0
    """Direction the waves go to, clockwise from north [rad]; pi/2 is east."""
    seed: int = 0
    """Of the scenario; another seed is another sea of the same kind [1]."""
    shortest_wavelength: float = 0.3
    """Length of the shortest waves drawn [m]; shorter ones stay in the scattering law, as slope and roughness."""
    water_depth: float = math.inf
    """Mean depth of the water, which slows long waves down [m]."""
    bands: int = 64
    """Bands of wavenumber [1]; it is part of the draw, as is the next: another number is another sea."""
    directions: int = 16
    """Waves of different direction in each band [1]."""
    amplitude: Floats = field(init=False, repr=False, compare=False)
    """Amplitude of each wave [m], shape (bands * directions,)."""
    wavenumber: Floats = field(init=False, repr=False, compare=False)
    """Wavenumber of each wave, north and east [rad/m], shape (2, bands * directions)."""
    phase: Floats = field(init=False, repr=False, compare=False)
    """Phase of each wave at the origin at time 0 [cycles], shape (bands * directions,)."""

    def __post_init__(self) -> None:
        """Check what was asked, then draw the waves."""
        _check_counts(self.bands, self.directions, self.seed)
        object.__setattr__(
            self, "wave_direction", require_number("SeaSurface.wave_direction", self.wave_direction, "rad")
        )
        if not (isinstance(self.water_depth, float) and self.water_depth == math.inf):
            depth = require_number("SeaSurface.water_depth", self.water_depth, "m", 0.0, above=True)
            object.__setattr__(self, "water_depth", depth)
        object.__setattr__(
            self, "shortest_wavelength", require_number("SeaSurface.shortest_wavelength", self.shortest_wavelength, "m", 0.0, above=True)
        )
        longest = 2 * math.pi / self.spectrum.peak
        if self.shortest_wavelength >= longest:
            raise ValueError(
                f"SeaSurface.shortest_wavelength is {self.shortest_wavelength} m; the dominant waves are {longest:.3g} m long. "
                "Give a length well below that, such as a tenth of it"
            )
        self._draw()

    def _draw(self) -> None:
        band, sector = (n.ravel() for n in np.mgrid[: self.bands, : self.directions])
        draws = uniforms(self.seed, SEA_SURFACE, band, sector)
        k, variance = self._lengths(band, draws[:, 0])
        angle = self.wave_direction + self.directional_spreading.quantile((sector + draws[:, 1]) / self.directions, k)
        for name, column in (
            ("amplitude", np.sqrt(2 * variance / self.directions)),
            ("wavenumber", np.stack((k * np.cos(angle), k * np.sin(angle)))),
            ("phase", draws[:, 2].copy()),
        ):
            column.setflags(write=False)  # frozen means frozen
            object.__setattr__(self, name, column)

    def _lengths(self, band: NDArray[np.int64], share: Floats) -> tuple[Floats, Floats]:
        """A wavenumber for each draw, in proportion to the spectrum within its band, and the band's variance."""
        low, high = self.spectrum.peak / 8, 2 * math.pi / self.shortest_wavelength
        k = np.geomspace(low, high, _GRID)
        below = _running(k, self.spectrum.density(k))
        steepness = _running(k, k**2 * self.spectrum.density(k))
        # Half of the bands follow height, which gathers at the peak, and half slope, which lives in every octave.
        merit = below / below[-1] + steepness / steepness[-1]
        edges = np.interp(np.linspace(0, 2, self.bands + 1), merit, below)
        variance = np.diff(edges)[band]
        wanted = edges[band] + share * variance
        # The far ends of the table hold no energy to speak of, and equal values would not be invertible.
        rising = np.concatenate(([True], np.diff(below) > 0))
        return np.interp(wanted, below[rising], k[rising]), variance

    @property
    def frequency(self) -> Floats:
        """Angular frequency of each wave [rad/s], shape (bands * directions,)."""
        return angular_frequency(np.hypot(*self.wavenumber), water_depth=self.water_depth)

    def elevation(self, north: ArrayLike, east: ArrayLike, time: ArrayLike) -> Floats:
        """Height of the surface above its mean, up positive [m].

        Args:
            north: World coordinate [m], any shape.
            east: World coordinate [m], broadcast.
            time: Since the scenario's start [s], broadcast.

        Returns:
            Elevation [m], broadcast shape.
        """
        positions, shape = _columns(north, east, time)
        height = np.empty(positions.shape[1])
        add_heights(positions, self._cycles(), self.amplitude.copy(), height)
        return height.reshape(shape)

    def depth(self, north: ArrayLike, east: ArrayLike, time: ArrayLike) -> Floats:
        """Where the surface is in the world's z, down positive: minus the elevation [m], arguments likewise."""
        return np.asarray(-self.elevation(north, east, time))

    def motion(self, north: ArrayLike, east: ArrayLike, time: ArrayLike) -> SurfaceMotion:
        """Height, slopes and vertical speed of the surface together.

        Args:
            north: World coordinate [m], any shape.
            east: World coordinate [m], broadcast.
            time: Since the scenario's start [s], broadcast.

        Returns:
            Columns of the broadcast shape; slopes and speed are exact derivatives of the elevation.
        """
        positions, shape = _columns(north, east, time)
        columns = np.empty((4, positions.shape[1]))
        add_motion(positions, self._cycles(), self.amplitude.copy(), columns)
        return SurfaceMotion(*(c.reshape(shape) for c in columns))

    def _cycles(self) -> Floats:
        """Each wave for the kernels: cycles per metre north and east, per second, and at the origin."""
        return np.stack((*self.wavenumber, -self.frequency, 2 * math.pi * self.phase)) / (2 * math.pi)


def _check_counts(bands: int, directions: int, seed: int) -> None:
    for name, count, least in (("bands", bands, 1), ("directions", directions, 1), ("seed", seed, 0)):
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < least:
            raise ValueError(f"SeaSurface.{name} is {count!r}; give a whole number, {least} or more")
    if bands * directions > MAX_WAVES:
        raise ValueError(f"SeaSurface has {bands} bands of {directions} directions; give {MAX_WAVES} waves at most")


def _running(k: Floats, density: Floats) -> Floats:
    """Integral of a density over wavenumber up to each k; trapezes in log k follow power laws."""
    per_log = density * k
    return np.concatenate(([0.0], np.cumsum((per_log[1:] + per_log[:-1]) / 2 * np.diff(np.log(k)))))


def _columns(north: ArrayLike, east: ArrayLike, time: ArrayLike) -> tuple[Floats, tuple[int, ...]]:
    asked = (("north", north, "m"), ("east", east, "m"), ("time", time, "s"))
    columns = np.broadcast_arrays(*(require_numbers(name, value, unit) for name, value, unit in asked))
    return np.stack([c.ravel() for c in columns]), columns[0].shape
