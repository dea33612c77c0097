"""The ground of a scene: its reliefs, cut once by the split into terrain and roughness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scene.lattice import Lattice
from insonify.scene.terrain.grid import Grid
from insonify.scene.terrain.power_law import PowerLaw
from insonify.scene.terrain.relief import Relief, Sum, Survey
from insonify.scene.terrain.ripples import Ripples
from insonify.scene.terrain.scour import Scour
from insonify.scene.terrain.split import Split
from insonify.validity import numbers

Floats = NDArray[np.float64]
Kind = PowerLaw | Ripples | Grid | Scour
_LAYERS = 4  # streams a relief may use


@dataclass(frozen=True, slots=True)
class Ground(Relief):
    """Terrain that can be walked on, and an account of the roughness that is not in it."""

    terrain: Sum
    """The part coarser than the split."""
    kinds: tuple[Kind, ...]
    """What was asked for."""
    split: Split
    """What divides the two."""

    def __repr__(self) -> str:
        kinds = ", ".join(map(repr, self.kinds)) or "flat"
        return f"Ground: {kinds}; split at {self.split.wavelength:g} m"

    def survey(self, north: ArrayLike, east: ArrayLike) -> Survey:
        """Height and gradient of the resolved ground, see `Relief.survey`."""
        return self.terrain.survey(north, east)

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest height of the resolved ground [m], see `Relief.span`."""
        return self.terrain.span

    @property
    def finest(self) -> float:
        """Shortest wave of the resolved ground [m]; the split where there is no ground."""
        waves = [
            self.split.wavelength if isinstance(kind, PowerLaw)
            else max(2 * kind.cell, self.split.wavelength) if isinstance(kind, Grid)
            else 2 * kind.width if isinstance(kind, Scour)
            else kind.wavelength / 2
            for kind in self.kinds
            if not isinstance(kind, Ripples) or kind.wavenumber < self.split.wavenumber
        ]  # fmt: skip
        return min(waves, default=self.split.wavelength)

    @property
    def is_waves(self) -> bool:
        """Whether all that was asked is known as waves, whose heights have a spectrum: no survey, no scour."""
        return all(isinstance(kind, PowerLaw | Ripples) for kind in self.kinds)

    def residual_spectrum(self, wavenumber: ArrayLike) -> Floats:
        """Spectrum of the fractal roughness that the terrain leaves to the scattering law [m^4].

        Args:
            wavenumber: Magnitude [rad/m], any shape.

        Returns:
            What was asked, less the share that the terrain has of it; shape of the wavenumbers. Ripples below the
            split are lines, not a spectrum: they count in `residual_rms` only.
        """
        K = numbers("wavenumber", wavenumber, "rad/m", 0.0)
        left = np.zeros(K.shape)
        for kind in self.kinds:
            if isinstance(kind, PowerLaw):
                left += kind.spectrum(K) * (1 - kind.resolved_share(K, self.split))
        return left

    @property
    def residual_rms(self) -> float:
        """Root mean square height of all that is finer than the terrain [m].

        It is what the coherent reflection of a facet loses by, exp(-2 k^2 h^2 sin^2). Where the mirror is
        not as large as the split's wavelength, take the band from its own wavenumber: `roughness_rms`.
        """
        # The cut is an octave wide: below and above it the integral is known.
        K = np.geomspace(self.split.wavenumber / 100, 100 * self.split.wavenumber, 2000)
        cut = np.trapezoid(2 * np.pi * K**2 * self.residual_spectrum(K), np.log(K))
        return float(np.hypot(np.sqrt(cut + self._unresolved_ripples()), self._fractal_rms(K[-1], np.inf)))

    def roughness_rms(self, low: float, high: float) -> float:
        """Root mean square height [m] between two wavenumbers [rad/m], resolved or not.

        It is the roughness that a mirror as large as 2 pi / low sees at an acoustic wavenumber `high`.
        """
        ripples = sum(kind.variance for kind in self._ripples() if low <= kind.wavenumber < high)
        return float(np.hypot(self._fractal_rms(low, high), np.sqrt(ripples)))

    def band_variance(self, low: Floats, high: float) -> Floats:
        """Mean square height of what was asked, resolved or not, between wavenumbers [m^2].

        Args:
            low: Smaller wavenumbers [rad/m], any shape.
            high: Larger one [rad/m].
        """
        total = np.zeros(np.shape(low))
        for kind in self.kinds:
            if isinstance(kind, PowerLaw):
                whole, rest = (kind.variance_beyond(bound) for bound in (np.minimum(low, high), np.array(high)))
                total += whole - rest
            elif isinstance(kind, Ripples):
                total += np.where((low <= kind.wavenumber) & (kind.wavenumber < high), kind.variance, 0.0)
        return total

    def _ripples(self) -> tuple[Ripples, ...]:
        return tuple(kind for kind in self.kinds if isinstance(kind, Ripples))

    def _unresolved_ripples(self) -> float:
        """Mean square height of the ripples that are not ground [m^2]."""
        return sum(kind.variance for kind in self._ripples() if kind.wavenumber >= self.split.wavenumber)

    def _fractal_rms(self, low: float, high: float) -> float:
        return float(np.sqrt(sum(k.band_variance(low, high) for k in self.kinds if isinstance(k, PowerLaw))))


def grow(
    kinds: Sequence[Kind], *, seed: int, split: Split | None = None, lattice: Lattice | None = None,
    mean_depth: float = 0.0,
) -> Ground:  # fmt: skip
    """The ground that some reliefs make together.

    Args:
        kinds: Fractal reliefs and ripples, added; none of them for a flat bed.
        seed: Seed of the scene, 0 to 2^64 - 1 [1].
        split: Where ground ends and roughness begins; the default `Split` if None.
        lattice: Frame in which everything is drawn; the world's if None.
        mean_depth: Depth of the plane from which the heights of a grid are counted [m].

    Returns:
        Ground without end: any point can be asked at any time, in any order, for the same bits.
    """
    split, lattice = split or Split(), lattice or Lattice()
    parts: list[Relief] = []
    for row, kind in enumerate(kinds):
        layer = row * _LAYERS
        if isinstance(kind, PowerLaw):
            parts.append(kind.grow(seed=seed, layer=layer, split=split))
        elif isinstance(kind, Grid):
            parts.append(kind.grow(split=split, mean_depth=mean_depth))
        elif isinstance(kind, Scour):
            parts.append(kind.grow(lattice))
        elif not isinstance(kind, Ripples):
            raise ValueError(f"kinds has {kind!r}; give reliefs, such as [PowerLaw(hurst=0.6, rms=0.05), Ripples()]")
        else:
            field = kind.grow(seed=seed, layer=layer, split=split, heading=lattice.heading)
            parts.extend([field] if field is not None else [])
    return Ground(Sum(tuple(parts), lattice), tuple(kinds), split)
