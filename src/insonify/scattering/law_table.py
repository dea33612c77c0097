"""Numeric table of a scattering law of any form: the cross section over both grazing angles and the azimuth.

The logarithm of the cross section is linear between nodes that are evenly spaced in log2 tan(grazing / 2), which is the
logarithm of a small angle and linear near the normal. So powers of the angles, and products of them, are nearly linear.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from insonify.caller_warning import warn_caller
from insonify.scattering._law_table_kernel import OCTAVES, LawGrid, tabulated_cross_sections
from insonify.scattering.law import Floats, ScatteringLaw
from insonify.validity import PhysicsWarning

TOLERANCE_DB = 0.05
"""Error of a table that is accepted [dB], where the cross section exceeds `WEAKEST`."""
WEAKEST = 1e-8
"""Cross section below which the error of a table is disregarded [1]."""
CHECKED_FRACTION = 0.999
"""Fraction of the directions within the tolerance: a law may have edges, which no table resolves fully [1]."""
CHECKED_PAIRS = 4096
"""Number of pairs of directions at which the error is measured."""
MAX_ENTRIES = 1 << 22
"""Largest number of entries of a table, 16 MB."""
_LEAST_SECTION = 1e-36  # floor before the logarithm; single precision begins at 1e-38


def tabulate(law: ScatteringLaw) -> tuple[LawGrid, NDArray[np.float32]]:
    """Table of a law, refined until its measured error is at most `TOLERANCE_DB`.

    Args:
        law: Law that depends on the azimuth by its cosine, if at all.

    Returns:
        Grid, and log2 of the cross sections at its nodes, flattened, the azimuth fastest.

    Raises:
        ValueError: A cross section is negative or not a number.
    """
    directions = _directions()
    exact, back = _sections(law, *directions), _sections(law, *directions[:2], np.array(np.pi))
    depends_on_azimuth = not np.allclose(exact, back, rtol=1e-9, atol=0)
    per_octave, azimuths = 4, 17 if depends_on_azimuth else 1
    while True:
        grid = LawGrid(OCTAVES * per_octave + 1, azimuths)
        table = _table(law, grid)
        error = _error_db(grid, table, directions, exact)
        next_size = 4 * table.size * (2 if depends_on_azimuth else 1)
        if error <= TOLERANCE_DB or next_size > MAX_ENTRIES:
            break
        per_octave, azimuths = 2 * per_octave, 2 * azimuths - 1
    if error > TOLERANCE_DB:
        warn_caller(
            f"the table of {type(law).__name__} has errors of {error:.2g} dB: the law varies faster than it resolves",
            PhysicsWarning,
        )
    return grid, table.ravel()


def _directions() -> tuple[Floats, Floats, Floats]:
    """Grazing in, grazing out, azimuth at which the error is measured [rad]: half uniform in angle, half in sine."""
    random = np.random.default_rng(1)
    grazing = random.uniform(0, 1, (2, CHECKED_PAIRS))
    grazing[:, ::2] *= np.pi / 2
    grazing[:, 1::2] = np.arcsin(grazing[:, 1::2])
    return grazing[0], grazing[1], random.uniform(0, np.pi, CHECKED_PAIRS)


def _sections(law: ScatteringLaw, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
    """Checked cross sections of a law [1] at angles [rad], broadcast shape."""
    shape = np.broadcast_shapes(grazing_in.shape, grazing_out.shape, azimuth.shape)
    sections = np.asarray(law.cross_section(grazing_in, grazing_out, azimuth), float)
    name = f"{type(law).__name__}.cross_section"
    try:
        sections = np.broadcast_to(sections, shape)
    except ValueError:
        raise ValueError(f"{name} has shape {sections.shape} for angles of shape {shape}; return that shape") from None
    if not np.all(sections >= 0):
        raise ValueError(f"{name} is negative or not a number at some angles; return 0 where nothing is scattered")
    return sections


def _nodes(grid: LawGrid) -> tuple[Floats, Floats]:
    """Grazing angles and azimuths of the nodes [rad]."""
    grazing = 2 * np.arctan(np.exp2(np.linspace(-OCTAVES, 0, grid.grazing_nodes)))
    return grazing, np.linspace(0, np.pi, grid.azimuth_nodes) if grid.azimuth_nodes > 1 else np.array([np.pi])


def _table(law: ScatteringLaw, grid: LawGrid) -> NDArray[np.float32]:
    """log2 of the cross sections at the nodes, shape (grazing in, grazing out, azimuth)."""
    grazing, azimuth = _nodes(grid)
    sections = _sections(law, grazing[:, None, None], grazing[:, None], azimuth)
    return np.log2(np.maximum(sections, _LEAST_SECTION)).astype(np.float32)


def _error_db(
    grid: LawGrid, table: NDArray[np.float32], directions: tuple[Floats, Floats, Floats], exact: Floats
) -> float:
    """Error that a fraction `CHECKED_FRACTION` of the directions does not exceed [dB].

    Directions are grazing in, grazing out and azimuth [rad], shape (n,) each; exact are their cross sections [1].
    """
    a, b, azimuth = directions
    incoming = np.array([np.cos(a), 0 * a, np.sin(a)], np.float32)
    outgoing = np.array([np.cos(b) * np.cos(azimuth), np.cos(b) * np.sin(azimuth), -np.sin(b)], np.float32)
    normal = np.zeros_like(incoming)
    normal[2] = -1.0
    section = np.empty(a.size, np.float32)
    tabulated_cross_sections(grid, table.ravel(), incoming, outgoing, normal, section)
    strong = exact > WEAKEST
    if not strong.any():
        return 0.0
    return float(np.quantile(np.abs(10 * np.log10(section[strong] / exact[strong])), CHECKED_FRACTION))
