"""Beam patterns over arrays of directions in NumPy, which replace those of `beam_kernels` until numba is loaded."""

import numpy as np
from numpy.typing import NDArray

from insonify.sonar.beam_kernels import BAFFLED, OMNI, BeamMajorants, BeamTables, beam_bounds, beam_gains, largest_gains

Floats = NDArray[np.float64]


def table_value(table: Floats, per_unit: float, x: Floats) -> Floats:
    """Pattern at some distances from its axis [1], shape of `x`, from a table of cubics.

    Args:
        table: Coefficients, constant first, shape (rows, 4); no rows: 1 everywhere.
        per_unit: Rows per unit of direction cosine [1].
        x: Distances in direction cosine [1], any shape.
    """
    if not len(table):
        return np.ones(x.shape)
    index = np.abs(x) * per_unit
    row = np.minimum(index.astype(np.int64), len(table) - 1)
    t, (a, b, c, d) = index - row, table.T
    return np.asarray(a[row] + t * (b[row] + t * (c[row] + t * d[row])))


def bound_value(bound: Floats, per_unit: float, x: Floats) -> Floats:
    """Largest magnitude of a pattern at some distances from its axis or beyond [1], shape of `x`.

    Args:
        bound: Largest magnitude from each row outwards, shape (rows,); no rows: 1 everywhere.
        per_unit: Rows per unit of direction cosine [1].
        x: Distances in direction cosine [1], any shape.
    """
    if not len(bound):
        return np.ones(x.shape)
    index = np.maximum(np.abs(x) * per_unit - 1e-9, 0.0)
    return np.asarray(bound[np.minimum(index.astype(np.int64), len(bound) - 1)])


def element_gains(element: int, w: Floats) -> Floats:
    """Directivity of one element by the cosine of the angle from boresight [1], shape of `w`.

    Args:
        element: Code of its directivity: `OMNI`, `BAFFLED` or the cosine.
        w: Cosines [1], any shape.
    """
    if element == OMNI:
        return np.ones(w.shape)
    return np.asarray((w >= 0).astype(float) if element == BAFFLED else np.maximum(w, 0.0))


def array_cosines(axes: Floats, north: Floats, east: Floats, depth: Floats) -> list[Floats]:
    """Cosines to an array's boresight, right and down of directions in the world [1], each of the directions' shape.

    Args:
        axes: Boresight, right and down as rows in the world [1], shape (3, 3).
        north: Northward component of the directions [1].
        east: Eastward component [1].
        depth: Downward component [1].
    """
    return [north * row[0] + east * row[1] + depth * row[2] for row in axes]


def cosine_bounds(cosine: Floats, cos_margin: Floats, sin_margin: Floats) -> tuple[Floats, Floats]:
    """Least and greatest cosine to an axis of all directions within a margin of those with given cosines [1], (n,).

    Args:
        cosine: Cosines to the axis [1], shape (n,).
        cos_margin: Cosine of the margin [1], shape (n,).
        sin_margin: Sine of the margin [1], shape (n,).
    """
    sine = np.sqrt(np.maximum(1.0 - cosine * cosine, 0.0))
    axial, radial = cosine * cos_margin, sine * sin_margin
    least = np.where(cosine <= -cos_margin, -1.0, axial - radial)
    return least, np.where(cosine >= cos_margin, 1.0, axial + radial)


def distance_to_interval(least: Floats, greatest: Floats, axis: float) -> Floats:
    """Distance from an axis to the nearest point of intervals [1], shape (n,).

    Args:
        least: Lower ends [1], shape (n,).
        greatest: Upper ends [1], shape (n,).
        axis: Direction cosine of the beam's axis [1].
    """
    return np.asarray(np.maximum(np.maximum(least - axis, axis - greatest), 0.0))


def element_amplitudes(beams: BeamTables, w: Floats, u: Floats, v: Floats) -> Floats:
    """Amplitude of one element at direction cosines to boresight, right and down [1], shape of the cosines."""
    (_, _, element_across, element_down), per_unit = beams.tables, beams.per_unit
    directivity = element_gains(beams.element, w)
    return np.asarray(
        directivity * table_value(element_across, per_unit[2], u) * table_value(element_down, per_unit[3], v)
    )


def beam_amplitudes(beams: BeamTables, channel: int | NDArray[np.intp], u: Floats, v: Floats) -> Floats:
    """Amplitude of one beam without that of the element [1], shape (n,), see `beam_kernels.beam_amplitude`.

    Args:
        beams: The beams.
        channel: Number of the beam for all directions, or for each direction, shape (n,).
        u: Cosines to the right [1], shape (n,).
        v: Cosines downwards [1], shape (n,).
    """
    (across, down, _, _), per_unit, (right, below) = beams.tables, beams.per_unit, beams.steer[channel].T
    beam = table_value(across, per_unit[0], u - right) * table_value(down, per_unit[1], v - below)
    return np.asarray(beam * beams.scale[channel])


@beam_gains.stand_in
def _gains(direction: Floats, beams: BeamTables, out: Floats) -> None:
    """Fill the amplitude of every beam in every direction [1], shape (channels, n), bit-identical with the kernel."""
    w, u, v = array_cosines(beams.axes, *direction.T)
    element = element_amplitudes(beams, w, u, v)
    for channel in range(len(beams.steer)):
        out[channel] = element * beam_amplitudes(beams, channel, u, v)


@largest_gains.stand_in
def _largest_gains(direction: Floats, beams: BeamTables, _majorants: BeamMajorants, out: Floats) -> None:
    """Fill the largest magnitude over all beams in every direction [1], shape (n,), bit-identical with the kernel."""
    gains = np.empty((len(beams.steer), len(direction)))
    _gains(direction, beams, gains)
    np.maximum(gains.max(axis=0), -gains.min(axis=0), out=out)


@beam_bounds.stand_in
def _bounds(direction: Floats, margin: Floats, beams: BeamMajorants, out: Floats) -> None:
    """Fill an upper bound of the magnitude of all beams within a margin of each direction [1], shape (n,)."""
    limited_margin = np.minimum(margin, np.pi)
    cos_margin, sin_margin = np.cos(limited_margin), np.sin(limited_margin)
    (_, w), (u0, u1), (v0, v1) = (
        cosine_bounds(element, cos_margin, sin_margin) for element in array_cosines(beams.axes, *direction.T)
    )
    (across, down, element_across, element_down), per_unit = beams.majorants, beams.per_unit
    element = element_gains(beams.element, w + 1e-12) * bound_value(
        element_across, per_unit[2], distance_to_interval(u0, u1, 0.0)
    )
    element *= bound_value(element_down, per_unit[3], distance_to_interval(v0, v1, 0.0))
    out[:] = 0.0
    for (right, below), scale in zip(beams.steer, beams.scale, strict=True):
        beam = bound_value(across, per_unit[0], distance_to_interval(u0, u1, right))
        np.maximum(out, beam * bound_value(down, per_unit[1], distance_to_interval(v0, v1, below)) * scale, out=out)
    out *= element
