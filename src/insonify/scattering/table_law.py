"""Scattering law from a table of measured backscattering strength against grazing angle."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from insonify.data_file import table_text
from insonify.scattering.law import Floats, checked_angles
from insonify.units import intensity_ratio
from insonify.validity import as_floats


@dataclass(frozen=True, slots=True)
class TableScatteringLaw:
    """Backscattering strength against grazing angle, linear in between (dB over angle).

    A table gives backscatter only. For other directions the geometric mean of both directions' backscatter
    is used, for any azimuth: sigma(a, b) = sqrt(sigma(a, a) sigma(b, b)). It is symmetric,
    exact for Lambert's law, and has no specular peak.

    Example:
        >>> measured = TableScatteringLaw(grazing=np.radians([10, 30, 90]), strength_db=[-35.0, -27.0, -15.0])
        >>> grazing = np.radians(20)
        >>> f"{10 * np.log10(measured.cross_section(grazing, grazing, np.pi)):.0f} dB"
        '-31 dB'
    """

    grazing: tuple[float, ...]
    """Grazing angles, increasing within 0 to pi/2 [rad]."""
    strength_db: tuple[float, ...]
    """Backscattering strength at each, 10 log10 sigma [dB]."""

    def __init__(self, grazing: ArrayLike, strength_db: ArrayLike) -> None:
        """Check the columns of the table and keep them.

        Args:
            grazing: Grazing angles, increasing within 0 to pi/2 [rad], shape (n,), n at least 2.
            strength_db: Strength at each [dB], shape (n,).

        Raises:
            ValueError: The columns are of unequal length, not finite, or not in order.
        """
        columns = [as_floats(column) for column in (grazing, strength_db)]
        for given, floats in zip((grazing, strength_db), columns, strict=True):
            if floats is None:
                raise ValueError(
                    f"TableScatteringLaw, row 1: {given!r} is not a column of numbers; give lists of equal length"
                )
        angles, strengths = (np.atleast_1d(np.asarray(column)) for column in columns)
        for row, problem in _problems(angles, strengths):
            raise ValueError(f"TableScatteringLaw, row {row}: {problem}")
        object.__setattr__(self, "grazing", tuple(angles.tolist()))
        object.__setattr__(self, "strength_db", tuple(strengths.tolist()))

    @classmethod
    def from_csv(cls, path: str | Path) -> TableScatteringLaw:
        """Read a table of two columns, grazing_deg and strength_db, under a header line with these names.

        Args:
            path: File of comma-separated values; other columns are ignored.

        Raises:
            ValueError: The table cannot be read; the message names file, line and column.
        """
        columns: dict[str, list[float]] = {"grazing_deg": [], "strength_db": []}
        lines: list[int] = []
        reader = csv.DictReader(table_text(path).splitlines(), skipinitialspace=True)
        named = _header(reader, path)
        for name in columns:
            if name not in named:
                raise ValueError(f"{path}, line 1: no column {name}; name the columns grazing_deg,strength_db")
        try:
            for cells in reader:
                lines.append(reader.line_num)
                for name, values in columns.items():
                    values.append(_number(cells[name], f"{path}, line {reader.line_num}, column {name}"))
        except csv.Error as fault:
            raise ValueError(f"{path}, line {reader.line_num + 1}: not a row of a table ({fault})") from None
        angles, strengths = np.radians(columns["grazing_deg"]), np.array(columns["strength_db"])
        for row, problem in _problems(angles, strengths):
            raise ValueError(f"{path}, line {lines[row - 1] if lines else 1}: {problem}")
        return cls(angles, strengths)

    def cross_section(self, grazing_in: Floats, grazing_out: Floats, azimuth: Floats) -> Floats:
        """Bistatic cross section per unit area per unit solid angle [1].

        Args:
            grazing_in: Grazing angle of the incident sound, from the plane of the interface [rad], any shape.
            grazing_out: Grazing angle of the scattered sound [rad], broadcast.
            azimuth: Azimuth between the two directions, without effect [rad], broadcast.

        Returns:
            Cross section [1], broadcast shape; 0 where either direction lies behind the interface. Below the first
            angle of the table it follows Lambert's law, above the last it is constant.
        """
        a, b, _ = np.broadcast_arrays(*checked_angles(grazing_in, grazing_out, azimuth))
        return np.asarray(self.direction_factor(a) * self.direction_factor(b))

    def direction_factor(self, grazing: Floats) -> Floats:
        """Factor of one direction, square root of its backscattering cross section [1]; grazing [rad], any shape."""
        # A grazing angle above 90 degrees is replaced by 180 degrees minus it, a negative one by 0.
        angle = np.arcsin(np.clip(np.sin(grazing), 0, 1))
        half_strength_db = np.interp(angle, self.grazing, 0.5 * np.asarray(self.strength_db))
        first = math.sin(max(self.grazing[0], 1e-9))
        return np.asarray(intensity_ratio(half_strength_db) * np.minimum(np.sin(angle) / first, 1.0))


def _header(reader: csv.DictReader[str], path: str | Path) -> list[str]:
    try:
        return list(reader.fieldnames or [])
    except csv.Error as fault:
        raise ValueError(f"{path}, line 1: not a header of a table ({fault})") from None


def _number(cell: str | None, where: str) -> float:
    if cell is None:
        raise ValueError(f"{where}: the cell is empty. Is a value missing?")
    try:
        return float(cell)
    except ValueError:
        raise ValueError(f"{where}: {cell!r} is not a number") from None


def _problems(angles: Floats, strengths: Floats) -> list[tuple[int, str]]:
    """Errors of a table: row, counted from 1, and message."""
    if angles.ndim != 1 or angles.shape != strengths.shape:
        return [(1, f"grazing has shape {angles.shape} and strength_db {strengths.shape}; give two equal columns")]
    if angles.size < 2:
        return [(1, "a table needs at least two rows")]
    problems = []
    for row, (angle, strength) in enumerate(zip(angles, strengths, strict=True), start=1):
        if not (math.isfinite(angle) and math.isfinite(strength)):
            column = "strength_db" if math.isfinite(angle) else "grazing"
            problems.append((row, f"column {column}: not a finite number"))
        elif not 0 <= angle <= math.pi / 2 + 1e-9:
            problems.append(
                (row, f"column grazing: {math.degrees(angle):g} deg; a grazing angle lies between 0 and 90 deg")
            )
        elif row > 1 and angle <= angles[row - 2]:
            problems.append((row, f"column grazing: {math.degrees(angle):g} deg does not exceed the one before"))
    return problems
