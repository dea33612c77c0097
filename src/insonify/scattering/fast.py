"""A law made ready for a hundred million questions a second.

The engine asks a law about every pair of paths at every scatterer. Here a law is turned, once, into a few numbers and
one-dimensional tables; a compiled loop then answers from unit vectors, without angles and without integrals.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import singledispatch

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.scattering import _fast_kernels as kernels
from insonify.scattering.albedo import cap_nodes
from insonify.scattering.jackson import Jackson, RoughSediment
from insonify.scattering.kirchhoff import Kirchhoff
from insonify.scattering.lambert import Lambert
from insonify.scattering.law import ScatteringLaw
from insonify.scattering.perturbation import Perturbation
from insonify.scattering.roughness import growth_exponent, kirchhoff_integral, structure_constant
from insonify.scattering.sediment_volume import SedimentVolume, UnevenInside, Unevenness, isotropic_strength
from insonify.scattering.sediments import Sediment
from insonify.scattering.small_slope import RoughSurface, SmallSlope
from insonify.scattering.user_table import UserTable
from insonify.units import amplitude_ratio

Singles = NDArray[np.float32]

HIGHEST_LOG2 = 40.0
SHARE_NODES = 4097
GROUP = 8192
"""Questions answered in one go: few enough for the cache."""
NO_CAP = np.ones(1, np.float32)
MIRRORS = 1 / (8 * np.pi)
"""Weight of Kirchhoff's integral in a cross section [1]."""
OfSediment = Kirchhoff | Perturbation | SmallSlope | SedimentVolume | Jackson
NO_NUMBERS = kernels.SurfaceNumbers(*np.zeros(len(kernels.SurfaceNumbers._fields), np.float32))


@dataclass(frozen=True, slots=True, eq=False)
class FastLaw:
    """A scattering law as numbers and tables, answered by a compiled loop."""

    loop: Callable[..., None]
    """Answers into an array: loop(numbers, table, incoming, outgoing, normal, section)."""
    numbers: kernels.SurfaceNumbers
    """Numbers that the loop needs."""
    table: Singles
    """Table that the loop needs: of log2 of Kirchhoff's integral, or of one direction's factor."""
    cap: Singles
    """Factors that keep the albedo at 1, at evenly spaced sines of the grazing angle; one entry for none."""

    def __repr__(self) -> str:
        kind = getattr(self.loop, "__name__", "loop").replace("_", " ")
        return f"FastLaw: {kind}, {self.table.size} table entries, {'no cap' if self.cap.size == 1 else 'capped'}"

    @property
    def factor(self) -> Singles | None:
        """What one direction contributes to a law that is a product of two such factors, None for any other law.

        The cross section is the product of two entries [1]; they are evenly spaced over sqrt(1 - sine of grazing), 0 to
        1, and count for directions in front of the interface only.
        """
        return self.table if self.loop is kernels.product_sections and self.cap.size == 1 else None

    def cross_section(self, incoming: ArrayLike, outgoing: ArrayLike, normal: ArrayLike) -> Singles:
        """Bistatic cross section per unit area per unit solid angle, from unit vectors [1].

        Args:
            incoming: Directions of travel towards the interface [1], shape (3, n): a row for each component.
            outgoing: Directions of travel away from it [1], shape (3, n).
            normal: Normals out of the interface into the water [1], shape (3, n) or (3, 1); (0, 0, -1) on a flat
                seabed with z down.

        Returns:
            Cross section [1], float32, shape (n,); 0 where either direction is behind the interface. Within 0.05 dB
            of the law's own wherever that exceeds -80 dB.
        """
        named = (("incoming", incoming), ("outgoing", outgoing), ("normal", normal))
        columns = [_three_rows(name, value) for name, value in named]
        count = np.broadcast_shapes(*(column.shape for column in columns))[1]
        whole = [np.broadcast_to(column, (3, count)) for column in columns]
        section = np.empty(count, np.float32)
        for start in range(0, count, GROUP):
            part = slice(start, start + GROUP)
            # Copies: a read-only view of single precision would be a type of its own, compiled anew.
            into, out, up = (np.array(column[:, part], dtype=np.float32, order="C") for column in whole)
            self.fill(into, out, up, section[part])
        return section

    def fill(self, incoming: Singles, outgoing: Singles, normal: Singles, section: Singles) -> None:
        """Answers into an array that is already there, without any check; best for some thousand questions at a time.

        Args:
            incoming: Directions of travel towards the interface [1], shape (3, n), contiguous.
            outgoing: Directions of travel away from it [1], likewise.
            normal: Normals out of the interface into the water [1], likewise.
            section: Receives the cross sections [1], shape (n,), contiguous.
        """
        self.loop(self.numbers, self.table, incoming, outgoing, normal, section)
        if self.cap.size > 1:
            kernels.apply_cap(self.cap, incoming, outgoing, normal, section)


def _three_rows(name: str, value: ArrayLike) -> NDArray[np.floating]:
    """Vectors as three rows; their length is not looked at, for that would cost as much as the answer."""
    rows = np.asarray(value)
    if rows.ndim != 2 or rows.shape[0] != 3 or rows.dtype.kind not in "fiu":
        raise ValueError(f"{name} has shape {rows.shape}; give numbers of shape (3, n), a row for each component")
    return rows


@singledispatch
def compiled(law: ScatteringLaw) -> FastLaw:
    """A law made ready for the engine; making it takes a fraction of a second, once per law.

    Args:
        law: One of the package's laws.

    Returns:
        The same law, answered from unit vectors.

    Raises:
        TypeError: The law has no fast form.
    """
    known = ", ".join(kind.__name__ for kind in compiled.registry if kind is not object)
    raise TypeError(f"{type(law).__name__} has no fast form; use its cross_section, or one of {known}")


@compiled.register
def _(law: Lambert) -> FastLaw:
    return _product(lambda sine: sine * amplitude_ratio(law.strength_db))


@compiled.register
def _(law: UserTable) -> FastLaw:
    return _product(lambda sine: law.share(np.arcsin(sine)))


@compiled.register
def _(law: Kirchhoff) -> FastLaw:
    numbers = _numbers(law, rough=MIRRORS)
    return FastLaw(kernels.mirror_sections, numbers, _log2_integral(law.sediment), NO_CAP)


@compiled.register
def _(law: Perturbation) -> FastLaw:
    table = _log2_integral(law.sediment, grating=True)
    return FastLaw(kernels.surface_sections, _numbers(law, rough=MIRRORS), table, NO_CAP)


@compiled.register
def _(law: SmallSlope) -> FastLaw:
    free = RoughSurface(law.sediment, law.frequency, law.sound_speed)
    return _surface(law, free, _numbers(law, rough=MIRRORS))


@compiled.register
def _(law: SedimentVolume) -> FastLaw:
    free = UnevenInside(law.sediment, law.frequency, law.sound_speed, law.unevenness)
    return _surface(law, free, _numbers(law, unevenness=law.unevenness))


@compiled.register
def _(law: Jackson) -> FastLaw:
    free = RoughSediment(law.sediment, law.frequency, law.sound_speed, law.unevenness)
    return _surface(law, free, _numbers(law, rough=MIRRORS, unevenness=law.unevenness))


def _product(share: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> FastLaw:
    sine = 1 - np.linspace(0, 1, SHARE_NODES) ** 2
    return FastLaw(kernels.product_sections, NO_NUMBERS, share(sine).astype(np.float32), NO_CAP)


def _surface(law: OfSediment, free: ScatteringLaw, numbers: kernels.SurfaceNumbers) -> FastLaw:
    nodes = cap_nodes(free)
    cap = NO_CAP if nodes.min() == 1 else nodes.astype(np.float32)
    return FastLaw(kernels.surface_sections, numbers, _log2_integral(law.sediment), cap)


def _numbers(law: OfSediment, *, rough: float = 0.0, unevenness: Unevenness | None = None) -> kernels.SurfaceNumbers:
    """A sediment's numbers under sound of one frequency, as the compiled loops read them; None: no inside."""
    sediment, rho = law.sediment, law.sediment.density_ratio
    inside = ((1 + 1j * sediment.loss) / sediment.speed_ratio) ** 2 - 1
    step2, alpha = (4 * np.pi * law.frequency / law.sound_speed) ** 2, growth_exponent(sediment)
    log2_q = np.log2(0.5 * structure_constant(sediment) * step2 ** (1 - alpha))
    # A bed without any loss would divide by 0 at its critical angle.
    volume = 8 * rho**2 * isotropic_strength(sediment)
    isotropic = volume if unevenness == "isotropic" else 0.0
    spectral = 2 * sediment.speed_ratio * volume if unevenness == "power-law" else 0.0
    row = (rho, inside.real, max(inside.imag, 1e-7), log2_q, alpha, rough, isotropic, spectral)
    return kernels.SurfaceNumbers(*np.array(row, np.float32))


def _log2_integral(sediment: Sediment, *, grating: bool = False) -> Singles:
    """log2 I over evenly spaced log2 q; for a grating alone, the straight line that I tends to for small q."""
    from scipy.special import gamma

    alpha = growth_exponent(sediment)
    log2_q = np.arange(kernels.LEAST_LOG2, HIGHEST_LOG2, kernels.LOG2_STEP)
    if grating:
        return np.asarray(
            log2_q + np.log2(2 ** (1 + 2 * alpha) * alpha * gamma(1 + alpha) / gamma(1 - alpha)), np.float32
        )
    return np.asarray(np.log2(kirchhoff_integral(alpha)(np.exp2(log2_q))), np.float32)
