"""Relief as octaves of smooth noise, each on a lattice of its own, with a random rotation and shift.

One octave is h(x) = A sum over nodes of g B(a - i) B(b - j): g normal and independent, B the cubic
B-spline, (a, b) the position in units of the pitch p on the turned lattice. Over all shifts of the
lattice its spectrum is W(K) = (A p / 2 pi)^2 [sinc(p Ka / 2) sinc(p Kb / 2)]^8, sinc x = sin x / x:
nearly the Gaussian exp(-p^2 K^2 / 3), which is why octaves add up to a power law.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify import random_keys
from insonify.scene.terrain.lattice_noise_kernel import add_bands
from insonify.scene.terrain.relief import Relief, TerrainSample, broadcast_positions
from insonify.validity import require_numbers

Floats = NDArray[np.float64]

SPLINE_ENERGY = 151 / 315
"""Integral of the squared cubic B-spline [1]."""
SPLINE_SLOPE_ENERGY = 2 / 3
"""Integral of the squared derivative of the cubic B-spline [1]."""
_PLACEMENT = 1  # streams counter of an octave's turn and shift; its nodes have 0


@dataclass(frozen=True, slots=True, eq=False)
class Octaves(Relief):
    """Sum of octaves of noise, unbounded; any point is evaluated independently of others."""

    pitch: Floats
    """Spacing of the nodes of each octave [m], shape (n,)."""
    amplitude: Floats
    """Factor on the unit normal numbers of its nodes [m], shape (n,)."""
    seed: int
    """Seed of the scene."""
    layer: int
    """Number of the relief in the scene: no two may share a layer."""
    octave: NDArray[np.int64]
    """Number of each octave in the keys of random numbers, shape (n,); below 2^31."""

    def __post_init__(self) -> None:
        """Make the columns read-only."""
        for name in ("pitch", "amplitude", "octave"):
            column = np.array(getattr(self, name))
            column.setflags(write=False)
            object.__setattr__(self, name, column)

    def __eq__(self, other: object) -> bool:
        return self._bits() == other._bits() if isinstance(other, Octaves) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._bits())

    def __repr__(self) -> str:
        span = f"{self.pitch.max():g} to {self.pitch.min():g} m" if self.pitch.size else "none"
        return f"Octaves: {self.pitch.size} ({span}), {self.variance**0.5:.3g} m rms, seed {self.seed}"

    def _bits(self) -> tuple[object, ...]:
        """Key that identifies these octaves."""
        return (self.pitch.tobytes(), self.amplitude.tobytes(), self.octave.tobytes(), self.seed, self.layer)

    def sample(self, north: ArrayLike, east: ArrayLike) -> TerrainSample:
        """Height and gradient, see `Relief.sample`; exact derivatives of the spline."""
        x, y = broadcast_positions(north, east)
        out = np.zeros((x.size, 3))
        self.add_to(np.ascontiguousarray(x.ravel()), np.ascontiguousarray(y.ravel()), out)
        return TerrainSample(out[:, 0].reshape(x.shape), out[:, 1:].reshape(*x.shape, 2))

    def placement(self) -> Floats:
        """Rotation [turns], two shifts [pitches] and an unused number of each octave's lattice, shape (n, 4)."""
        return _lattice_placement(self.seed, self.layer, tuple(self.octave.tolist()))

    def add_to(self, x: Floats, y: Floats, out: Floats) -> None:
        """Add height [m] and slopes [1] at positions [m] of shape (n,), without any check, to `out` of shape (n, 3)."""
        add_bands(x, y, *_bands(self), quantiles(), out)

    @property
    def variance(self) -> float:
        """Mean square of the height [m^2]."""
        return float(np.sum(self.amplitude**2) * SPLINE_ENERGY**2)

    @property
    def span(self) -> tuple[float, float]:
        """Six standard deviations down and up [m], see `Relief.span`."""
        return -6 * self.variance**0.5, 6 * self.variance**0.5

    @property
    def slope_variance(self) -> float:
        """Mean square of the gradient, both directions together [1]."""
        return float(np.sum((self.amplitude / self.pitch) ** 2) * 2 * SPLINE_ENERGY * SPLINE_SLOPE_ENERGY)

    def spectrum(self, wavenumber: ArrayLike) -> Floats:
        """Two-sided 2-D spectrum, averaged over directions [m^4]; its integral over the plane is `variance`.

        Args:
            wavenumber: Magnitude [rad/m], any shape.
        """
        K = require_numbers("wavenumber", wavenumber, "rad/m", 0.0)[..., None]
        power = (self.amplitude * self.pitch / (2 * np.pi)) ** 2
        return np.asarray(np.sum(power * spline_spectrum(K * self.pitch), axis=-1))


@lru_cache(maxsize=64)
def _bands(octaves: Octaves) -> tuple[Floats, NDArray[np.int64]]:
    """Bands and keys of some octaves, as arguments of `add_bands`."""
    turn, shift_a, shift_b, _ = octaves.placement().T
    k0, k1 = random_keys.stream_key(octaves.seed, random_keys.TERRAIN)
    bands = np.column_stack([octaves.pitch, 2 * np.pi * turn, shift_a, shift_b, octaves.amplitude])
    return bands, np.array(
        [(number, 2 * octaves.layer, k0, k1) for number in octaves.octave.tolist()], np.int64
    ).reshape(-1, 4)


@lru_cache(maxsize=64)
def _lattice_placement(seed: int, layer: int, octave: tuple[int, ...]) -> Floats:
    uniforms = random_keys.uniforms(seed, random_keys.TERRAIN, 0, 0, np.array(octave, np.int64), 2 * layer + _PLACEMENT)
    uniforms.setflags(write=False)
    return uniforms


def spline_spectrum(s: Floats) -> Floats:
    """Squared transform of the 2-D cubic B-spline at wavenumber s [1 / pitch], mean over directions, 1 at s = 0 [1]."""
    angle = (np.arange(32) + 0.5) / 32 * np.pi / 2
    along, across = s[..., None] * np.cos(angle), s[..., None] * np.sin(angle)
    # np.sinc(x) is sin(pi x) / (pi x)
    return np.asarray(np.mean((np.sinc(along / (2 * np.pi)) * np.sinc(across / (2 * np.pi))) ** 8, axis=-1))


def unit_octave(pitch: float, *, seed: int, layer: int) -> Octaves:
    """One octave of unit variance, for smooth random variation of crests and heights of ripples and of borders.

    Args:
        pitch: Spacing of the nodes [m]; the noise is uncorrelated beyond about two of them.
        seed: Seed of the scene [1].
        layer: Number of its random stream [1].
    """
    return Octaves(np.array([pitch]), np.array([1 / SPLINE_ENERGY]), seed, layer, np.zeros(1, np.int64))


@cache
def quantiles() -> Floats:
    """Normal quantiles between which random words are interpolated [1], shape (1025,).

    The two ends, infinite for a normal number, are such that the variance is exactly 1 (about 3.8, the largest number).
    """
    from scipy.special import ndtri

    bins = 1024
    inner = ndtri(np.arange(1, bins) / bins)
    # A value uniform between a and b has mean square (a^2 + a b + b^2) / 3.
    known = np.sum(inner[:-1] ** 2 + inner[:-1] * inner[1:] + inner[1:] ** 2)
    low, rest = inner[-1], (3 * bins - known) / 2  # each end bin: end^2 + end low + low^2 = rest
    end = (np.sqrt(low**2 - 4 * (low**2 - rest)) - low) / 2
    return np.concatenate([[-end], inner, [end]])
