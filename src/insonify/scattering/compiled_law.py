"""Compiled scattering laws: a hundred million cross sections per second.

The engine evaluates a law for every pair of paths at every scatterer. Here a law is converted, once, into a few
parameters and tables; a compiled loop then evaluates it from unit vectors, without angles and integrals. The laws of a
sediment have loops of their own; a law that is the product of one factor for each direction, and any other law, have
tables of their values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, singledispatch
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scattering import _compiled_law_kernels as kernels
from insonify.scattering._law_table_kernel import LawGrid, tabulated_cross_sections
from insonify.scattering.albedo import albedo_cap_nodes, warn_above_one
from insonify.scattering.jackson import Jackson, UncappedJackson
from insonify.scattering.kirchhoff import Kirchhoff
from insonify.scattering.lambert import Lambert
from insonify.scattering.law import ProductLaw, ScatteringLaw
from insonify.scattering.law_table import tabulate
from insonify.scattering.perturbation import Perturbation
from insonify.scattering.roughness import hurst_exponent, kirchhoff_integral, structure_constant
from insonify.scattering.sediment_volume import (
    SedimentVolume,
    UncappedSedimentVolume,
    VolumeSpectrum,
    isotropic_strength,
)
from insonify.scattering.sediments import Sediment
from insonify.scattering.small_slope import SmallSlope, UncappedSmallSlope
from insonify.units import amplitude_ratio

Singles = NDArray[np.float32]

HIGHEST_LOG2_Q = 40.0
"""log2 q at the end of the table of Kirchhoff's integral I(q) [octaves]."""
FACTOR_NODES = 4097
"""Number of entries of the table of the factor of one direction."""
GROUP = 8192
"""Number of cross sections evaluated per call of the loop, few enough for the cache."""
NO_CAP = np.ones(1, np.float32)  # one entry: `CompiledLaw.fill` applies no cap
SURFACE_WEIGHT = 1 / (8 * np.pi)
"""Weight of Kirchhoff's integral in a cross section [1]."""
SedimentLawKind = Kirchhoff | Perturbation | SmallSlope | SedimentVolume | Jackson
NO_PARAMETERS = kernels.SedimentParameters(*np.zeros(len(kernels.SedimentParameters._fields), np.float32))


@dataclass(frozen=True, slots=True, eq=False)
class CompiledLaw:
    """Scattering law as parameters and tables, evaluated by a compiled loop.

    Example:
        >>> from insonify.frames import direction
        >>> law = compile_law(Lambert(strength_db=-27.0))
        >>> down, up = direction(0.0, np.radians(30)), direction(np.pi, np.radians(-30))
        >>> (10 * np.log10(law.cross_section(down[:, None], up[:, None], [[0], [0], [-1]]))).round().tolist()
        [-33.0]
    """

    loop: Callable[..., None]
    """Kernel that fills an array: loop(parameters, table, incoming, outgoing, normal, section)."""
    parameters: kernels.SedimentParameters | LawGrid
    """Parameters of the kernel."""
    table: Singles
    """Table of the kernel, one-dimensional: log2 of Kirchhoff's integral over log2 q, the factor of one direction over
    sqrt(1 - sine of grazing), or log2 of the cross section on a `LawGrid`."""
    cap: Singles
    """Factors that keep the albedo at or below 1, at sines of the grazing angle evenly spaced from 0 to 1 [1]; a single
    entry for no cap."""

    def __repr__(self) -> str:
        kind = getattr(self.loop, "__name__", "loop").replace("_", " ")
        return f"CompiledLaw: {kind}, {self.table.size} table entries, {'no cap' if self.cap.size == 1 else 'capped'}"

    @property
    def direction_factors(self) -> Singles | None:
        """Table of the factor of one direction, for a law that is the product of two such factors; else None.

        The cross section is the product of two entries [1], which are evenly spaced over sqrt(1 - sine of grazing),
        0 to 1, and valid for directions in front of the interface only.
        """
        return self.table if self.loop is kernels.product_cross_sections and self.cap.size == 1 else None

    def cross_section(self, incoming: ArrayLike, outgoing: ArrayLike, normal: ArrayLike) -> Singles:
        """Bistatic cross section per unit area per unit solid angle, from unit vectors [1].

        Args:
            incoming: Directions of travel towards the interface [1], shape (3, n): a row for each component.
            outgoing: Directions of travel away from the interface [1], shape (3, n).
            normal: Normals of the interface into the water [1], shape (3, n) or (3, 1); (0, 0, -1) on a flat
                seabed with z down.

        Returns:
            Cross section [1], float32, shape (n,); 0 where either direction lies behind the interface. Within 0.05 dB
            of the law's `cross_section` wherever that exceeds -80 dB; a law that has a table of its values, see
            `insonify.scattering.law_table`, may be farther off in a thousandth of all directions, and at grazing angles
            below 0.007 degrees.
        """
        named = (("incoming", incoming), ("outgoing", outgoing), ("normal", normal))
        columns = [_three_rows(name, value) for name, value in named]
        count = np.broadcast_shapes(*(column.shape for column in columns))[1]
        vectors = [np.broadcast_to(column, (3, count)) for column in columns]
        section = np.empty(count, np.float32)
        for start in range(0, count, GROUP):
            group = slice(start, start + GROUP)
            # Copies: a read-only view of single precision would be another type, compiled separately.
            into, out, up = (np.array(column[:, group], dtype=np.float32, order="C") for column in vectors)
            self.fill(into, out, up, section[group])
        return section

    def fill(self, incoming: Singles, outgoing: Singles, normal: Singles, section: Singles) -> None:
        """Fill an existing array with cross sections, without checks; best for some thousand at a time.

        Args:
            incoming: Directions of travel towards the interface [1], shape (3, n), contiguous.
            outgoing: Directions of travel away from the interface [1], shape (3, n), contiguous.
            normal: Normals of the interface into the water [1], shape (3, n), contiguous.
            section: Filled with the cross sections [1], shape (n,), contiguous.
        """
        self.loop(self.parameters, self.table, incoming, outgoing, normal, section)
        if self.cap.size > 1:
            kernels.apply_cap(self.cap, incoming, outgoing, normal, section)


def _three_rows(name: str, value: ArrayLike) -> NDArray[np.floating]:
    """Vectors as three rows; their length is not checked, which would cost as much as the evaluation."""
    rows = np.asarray(value)
    if rows.ndim != 2 or rows.shape[0] != 3 or rows.dtype.kind not in "fiu":
        raise ValueError(f"{name} has shape {rows.shape}; give numbers of shape (3, n), a row for each component")
    return rows


@singledispatch
def compile_law(law: ScatteringLaw) -> CompiledLaw:
    """Compile a law for the engine, which takes a fraction of a second, once per law.

    Args:
        law: A scattering law: any object with `cross_section`, see `insonify.scattering.law`; with `direction_factor`
            as well, if it is the product of one factor for each direction.

    Returns:
        The same law, evaluated from unit vectors.

    Warns:
        PhysicsWarning: Its albedo exceeds 1, or its table is not as exact as that of other laws.

    Raises:
        TypeError: It has no `cross_section`.
        ValueError: A cross section is negative or not a number.

    Example:
        >>> compile_law(Jackson(Sediment.named("medium sand"), frequency=100e3))
        CompiledLaw: surface cross sections, 512 table entries, no cap
    """
    if isinstance(law, ProductLaw):
        compiled = _product(lambda sine: law.direction_factor(np.arcsin(sine)))
    elif isinstance(law, ScatteringLaw):
        compiled = CompiledLaw(tabulated_cross_sections, *tabulate(law), NO_CAP)
    else:
        advice = "a scattering law has cross_section(grazing_in, grazing_out, azimuth)"
        raise TypeError(f"{type(law).__name__} has no cross_section; {advice}")
    warn_above_one(law)
    return compiled


@lru_cache(maxsize=32)
def compiled_once(law: Any) -> CompiledLaw:
    """Compiled form of a law, the same object for equal laws: caches of the engines are by object.

    Args:
        law: A scattering law that can be hashed: a frozen one.
    """
    return compile_law(law)


@compile_law.register
def _(law: Lambert) -> CompiledLaw:
    return _product(lambda sine: sine * amplitude_ratio(law.strength_db))


@compile_law.register
def _(law: Kirchhoff) -> CompiledLaw:
    parameters = _parameters(law, surface_weight=SURFACE_WEIGHT)
    return CompiledLaw(kernels.kirchhoff_cross_sections, parameters, _log2_integral(law.sediment), NO_CAP)


@compile_law.register
def _(law: Perturbation) -> CompiledLaw:
    table = _log2_integral(law.sediment, is_perturbation=True)
    return CompiledLaw(kernels.surface_cross_sections, _parameters(law, surface_weight=SURFACE_WEIGHT), table, NO_CAP)


@compile_law.register
def _(law: SmallSlope) -> CompiledLaw:
    uncapped = UncappedSmallSlope(law.sediment, law.frequency, law.sound_speed)
    return _surface(law, uncapped, _parameters(law, surface_weight=SURFACE_WEIGHT))


@compile_law.register
def _(law: SedimentVolume) -> CompiledLaw:
    uncapped = UncappedSedimentVolume(law.sediment, law.frequency, law.sound_speed, law.volume_spectrum)
    return _surface(law, uncapped, _parameters(law, volume_spectrum=law.volume_spectrum))


@compile_law.register
def _(law: Jackson) -> CompiledLaw:
    uncapped = UncappedJackson(law.sediment, law.frequency, law.sound_speed, law.volume_spectrum)
    parameters = _parameters(law, surface_weight=SURFACE_WEIGHT, volume_spectrum=law.volume_spectrum)
    return _surface(law, uncapped, parameters)


def _product(direction_factor: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> CompiledLaw:
    sine = 1 - np.linspace(0, 1, FACTOR_NODES) ** 2
    table = direction_factor(sine).astype(np.float32)
    return CompiledLaw(kernels.product_cross_sections, NO_PARAMETERS, table, NO_CAP)


def _surface(law: SedimentLawKind, uncapped: ScatteringLaw, parameters: kernels.SedimentParameters) -> CompiledLaw:
    nodes = albedo_cap_nodes(uncapped)
    cap = NO_CAP if nodes.min() == 1 else nodes.astype(np.float32)
    return CompiledLaw(kernels.surface_cross_sections, parameters, _log2_integral(law.sediment), cap)


def _parameters(
    law: SedimentLawKind, *, surface_weight: float = 0.0, volume_spectrum: VolumeSpectrum | None = None
) -> kernels.SedimentParameters:
    """Parameters of a sediment at one frequency for the compiled loops; without a spectrum, no volume scattering."""
    sediment, rho = law.sediment, law.sediment.density_ratio
    kappa2_minus_1 = ((1 + 1j * sediment.loss) / sediment.speed_ratio) ** 2 - 1
    four_k2, alpha = (4 * np.pi * law.frequency / law.sound_speed) ** 2, hurst_exponent(sediment)
    log2_unit_q = np.log2(0.5 * structure_constant(sediment) * four_k2 ** (1 - alpha))
    volume = 8 * rho**2 * isotropic_strength(sediment)
    isotropic = volume if volume_spectrum == "isotropic" else 0.0
    power_law = 2 * sediment.speed_ratio * volume if volume_spectrum == "power-law" else 0.0
    imag = max(kappa2_minus_1.imag, 1e-7)  # a lossless seabed would divide by 0 at its critical angle
    row = (rho, kappa2_minus_1.real, imag, log2_unit_q, alpha, surface_weight, isotropic, power_law)
    return kernels.SedimentParameters(*np.array(row, np.float32))


def _log2_integral(sediment: Sediment, *, is_perturbation: bool = False) -> Singles:
    """log2 of Kirchhoff's integral I over evenly spaced log2 q; for perturbation theory, I's asymptote for small q."""
    from scipy.special import gamma

    alpha = hurst_exponent(sediment)
    log2_q = np.arange(kernels.LEAST_LOG2_Q, HIGHEST_LOG2_Q, kernels.LOG2_Q_STEP)
    if is_perturbation:
        return np.asarray(
            log2_q + np.log2(2 ** (1 + 2 * alpha) * alpha * gamma(1 + alpha) / gamma(1 - alpha)), np.float32
        )
    return np.asarray(np.log2(kirchhoff_integral(alpha)(np.exp2(log2_q))), np.float32)
