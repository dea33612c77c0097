"""All beams of one array at one attitude, with gains in any direction.

A beam is the far-field pattern of a focused aperture, seen from the array's centre: a real
amplitude, the product of a pattern across, a pattern down and one element's directivity, with
unit gain on the steered axis. Patterns come from cubic tables in direction cosine.
"""

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.recent_results import Identity, RecentResults
from insonify.sonar import beam_arrays as beam_arrays  # stand-ins of the kernels
from insonify.sonar.aperture import ApertureSide, pattern, read_only
from insonify.sonar.array import LineArray, PlanarArray, PointTransducer
from insonify.sonar.beam_kernels import (
    BAFFLED,
    CHANNELS_PER_BLOCK,
    COSINE,
    OMNI,
    BeamMajorants,
    BeamTables,
    beam_bounds,
    beam_gains,
    largest_gains,
)

Floats = NDArray[np.float64]
Tables = tuple[Floats, Floats, Floats, Floats]

POINTS_PER_LOBE = 32
"""Table rows per wavelength / aperture: cubic Hermite error (pi / 32)^4 / 5 / 384 = 5e-8."""
MIN_GRATING_LOBE = 0.1
"""Amplitude below which the elements' directivity suppresses a grating lobe [1]."""

CACHE_SIZE = 512
"""Number of cached sets of beams, and of tables: enough for two arrays at each frequency of the band [1]."""
NO_SIDE = ApertureSide(0.0, None, "uniform")
"""Side of extent 0, without directivity."""

MIN_ELEMENT_GAIN = 1e-2
"""Smallest directivity of an element in the direction to which a beam may be steered [1]."""


@dataclass(frozen=True)
class Beams:
    """Beams of one array at one frequency and attitude.

    Example:
        >>> from insonify.frames import direction
        >>> horizontal = beams(LineArray(length="0.6 m", steer="0 deg"), frequency=100e3, sound_speed=1500.0)
        >>> (horizontal.gain(direction(np.radians([0.0, 0.635]))) ** 2).round(2).tolist()
        [[1.0, 0.5]]
    """

    axes: Floats
    """Boresight, right and down of the array in the world, as rows [1], shape (3, 3)."""
    steer: Floats
    """Cosines to right and down of the steered axes [1], shape (channels, 2)."""
    scale: Floats
    """Factor that scales the amplitude to 1 on the steered axis: one over the element's directivity there [1], shape
    (channels,)."""
    element: int
    """Directivity of one element: `OMNI`, `BAFFLED` or `COSINE` of `beam_kernels`."""
    tables: Tables = field(repr=False)
    """Patterns across, down, and of a piston element across, down: cubics of shape (rows, 4), empty for none."""
    majorants: Tables = field(repr=False)
    """Largest magnitude of each pattern from each row outwards [1], each of shape (rows,)."""
    per_unit: Floats = field(repr=False)
    """Rows per unit of direction cosine of each table [1], shape (4,)."""
    across: ApertureSide
    """Side of the array across, whose pattern the first table holds."""

    @property
    def channel_count(self) -> int:
        """Number of beams."""
        return len(self.steer)

    @cached_property
    def pattern_key(self) -> tuple[Hashable, ...]:
        """Key that identifies these beams, but for their attitude."""
        return (self.steer.tobytes(), self.scale.tobytes(), self.element, *map(Identity, self.tables))

    @cached_property
    def largest_per_unit(self) -> float:
        """Rows per unit of direction cosine of the finest table [1]."""
        return float(self.per_unit.max())

    @cached_property
    def kernel_tables(self) -> BeamTables:
        """The beams as a tuple for kernels."""
        return BeamTables(self.axes, self.steer, self.scale, self.tables, self.per_unit, self.element)

    @cached_property
    def kernel_majorants(self) -> BeamMajorants:
        """The beams' majorants as a tuple for kernels."""
        blocks = _BLOCKS.get(self.pattern_key, lambda: _channel_blocks(self.steer, self.scale))
        return BeamMajorants(self.axes, self.steer, self.scale, self.majorants, self.per_unit, self.element, blocks)

    def equals(self, other: "Beams") -> bool:
        """Return True for beams of the same axes, steering and patterns.

        Args:
            other: Other beams.
        """
        return self is other or (
            self.element == other.element
            # equal patterns are one object only as long as the first is cached
            and all(a is b or np.array_equal(a, b) for a, b in zip(self._arrays, other._arrays, strict=True))
        )  # fmt: skip

    @property
    def _arrays(self) -> tuple[Floats, ...]:
        """Axes and all that makes up the patterns."""
        return self.axes, self.steer, self.scale, self.per_unit, *self.tables

    def single_beam(self, channel: int) -> "Beams":
        """The beam of one channel alone; an array with one beam has the same for every channel.

        Args:
            channel: Number of the channel, from 0.
        """
        return self.subset(np.array([channel if self.channel_count > 1 else 0]))

    def subset(self, channels: NDArray[np.intp]) -> "Beams":
        """The beams of some channels.

        Args:
            channels: Numbers of the channels, from 0, shape (n,).
        """
        return replace(self, steer=self.steer[channels], scale=self.scale[channels])

    def rotated(self, rotation: Floats) -> "Beams":
        """The beams with the array rotated.

        Args:
            rotation: Boresight, right, down as rows in the world [1], shape (3, 3).
        """
        return replace(self, axes=np.ascontiguousarray(rotation, dtype=float))

    def gain(self, direction: ArrayLike) -> Floats:
        """Amplitude of every beam towards every direction [1].

        Approximation: far field of an aperture focused at all ranges, evaluated from the array's centre.

        Args:
            direction: Unit vectors from the sonar outwards in the world [1], shape (..., 3).

        Returns:
            Real amplitude, one on the steered axis, within 1e-7; shape (channels, ...).
        """
        d = np.asarray(direction, dtype=float)
        rows = np.ascontiguousarray(d.reshape(-1, 3))
        out = np.empty((self.channel_count, len(rows)))
        beam_gains(rows, self.kernel_tables, out)
        return out.reshape(self.channel_count, *d.shape[:-1])

    def largest_gain(self, direction: Floats) -> Floats:
        """Largest magnitude of `gain` over all beams towards some directions [1], shape (n,).

        Args:
            direction: Unit vectors from the sonar outwards in the world [1], shape (n, 3).
        """
        out = np.empty(len(direction))
        largest_gains(np.ascontiguousarray(direction), self.kernel_tables, self.kernel_majorants, out)
        return out

    def bound(self, direction: ArrayLike, margin: ArrayLike) -> Floats:
        """Upper bound of the magnitudes of all beams near each direction, by which scatterers outside them are omitted.

        Args:
            direction: Unit vectors from the sonar outwards in the world [1], shape (..., 3).
            margin: Angle around each direction for which the bound must hold [rad], broadcast to (...).

        Returns:
            No less than the largest magnitude of gain over all channels and all directions within the margin,
            shape (...).
        """
        d = np.asarray(direction, dtype=float)
        rows = np.ascontiguousarray(d.reshape(-1, 3))
        margins = np.ascontiguousarray(np.broadcast_to(np.asarray(margin, dtype=float), d.shape[:-1]).reshape(-1))
        out = np.empty(len(rows))
        beam_bounds(rows, margins, self.kernel_majorants, out)
        return out.reshape(d.shape[:-1])


_BLOCKS: RecentResults[Floats] = RecentResults(16)


def _channel_blocks(steer: Floats, scale: Floats) -> Floats:
    """Bounds of the steering, and the largest scale, of each block of channels: see `BeamMajorants`."""
    first = np.arange(0, len(steer), CHANNELS_PER_BLOCK)
    ends = [end.reduceat(side, first) for side in steer.T for end in (np.minimum, np.maximum)]
    return np.stack([*ends, np.maximum.reduceat(scale, first)], axis=1)


def beams(
    array: LineArray | PlanarArray | PointTransducer,
    frequency: float,
    sound_speed: float,
    rotation: Floats | None = None,
) -> Beams:
    """All beams of an array.

    Args:
        array: The array, with its steer angles filled in.
        frequency: Frequency [Hz].
        sound_speed: Sound speed at the array [m/s].
        rotation: Boresight, right, down as rows in the world [1], shape (3, 3); none: the array's own frame.

    Returns:
        One beam per steer angle. Steering is by phase: the pattern keeps its shape in direction cosine.

    Source: product theorem; R. J. Urick (1983), Principles of Underwater Sound, ch. 3.

    Example:
        >>> from insonify.frames import direction
        >>> pair = beams(LineArray(length="0.6 m", steer=["0 deg", "10 deg"]), frequency=100e3, sound_speed=1500.0)
        >>> np.abs(pair.gain(direction(np.radians(10)))).round(2).tolist()
        [0.01, 1.0]
    """
    unrotated = _beams_in_array_frame(array, frequency, sound_speed)
    return unrotated if rotation is None else replace(unrotated, axes=np.ascontiguousarray(rotation, dtype=float))


@lru_cache(maxsize=CACHE_SIZE)
def _beams_in_array_frame(
    array: LineArray | PlanarArray | PointTransducer, frequency: float, sound_speed: float
) -> Beams:
    """Beams of an array in its own frame, cached: all pings use the same."""
    wavelength = sound_speed / frequency
    steer = _steering_cosines(array)
    across, down = _aperture_sides(array, wavelength)
    tables, majorants, per_unit = _four_tables(array, across, down, 1 + np.abs(steer).max(axis=0))
    unscaled = Beams(
        axes=np.eye(3), steer=steer, scale=np.ones(len(steer)),
        element={"omni": OMNI, "cosine": COSINE}.get(array.element, BAFFLED), tables=tables, majorants=majorants,
        per_unit=per_unit, across=across,
    )  # fmt: skip
    # the aperture's pattern is 1 on axis; the scale compensates the element's directivity there
    on_axis = np.abs(_gain_of_each(unscaled, np.arange(len(steer)), steer))
    if on_axis.min() < MIN_ELEMENT_GAIN:
        angle = np.degrees(array.steers[int(np.argmin(on_axis))][0])
        raise ValueError(
            f"a beam of the {array.kind} array is steered to {angle:g} deg, where its {array.element} elements "
            "are baffled. Steer closer to boresight, or give the array smaller elements."
        )
    return replace(unscaled, scale=1 / on_axis)


def grating_lobes(array: LineArray | PlanarArray | PointTransducer, frequency: float, sound_speed: float) -> Floats:
    """Directions other than the steered one in which the gain of a sparse array is as high, or nearly so.

    Args:
        array: The array, with its steer angles filled in.
        frequency: Frequency [Hz].
        sound_speed: Sound speed at the array [m/s].

    Returns:
        Cosines to the array's right and down of the replicas of all beams, shape (n, 2). Those that the
        elements' own directivity brings below -20 dB are left out.

    Example:
        >>> sparse = LineArray(length="0.18 m", elements=8, element="omni", steer="0 deg")  # pitch 1.5 wavelengths
        >>> lobes = grating_lobes(sparse, frequency=100e3, sound_speed=1500.0)
        >>> np.degrees(np.arcsin(lobes[:, 0])).round().tolist()
        [-42.0, 42.0]
    """
    all_beams = beams(array, frequency, sound_speed)
    period = _replica_period(array, sound_speed / frequency)
    orders = [np.arange(-np.floor(2 / p), np.floor(2 / p) + 1) if p > 0 else np.zeros(1) for p in period]
    order = np.stack(np.meshgrid(*orders), axis=-1).reshape(-1, 2)
    replica = all_beams.steer[:, None] + order[np.any(order != 0, axis=1)] * np.asarray(period)
    channel, row = np.nonzero(np.sum(replica**2, axis=2) <= 1)
    cosines = replica[channel, row]
    return np.asarray(cosines[np.abs(_gain_of_each(all_beams, channel, cosines)) > MIN_GRATING_LOBE])


def _gain_of_each(all_beams: Beams, channel: NDArray[np.intp], cosines: Floats) -> Floats:
    """Amplitude of one beam towards each direction in front of the array [1], shape (n,).

    Args:
        all_beams: The beams.
        channel: Number of the beam for each direction, shape (n,).
        cosines: Cosines of the directions to the array's right and down [1], shape (n, 2).
    """
    (u, v), tables = cosines.T, all_beams.kernel_tables
    element = beam_arrays.element_amplitudes(tables, _in_array_frame(cosines)[:, 0], u, v)
    return np.asarray(element * beam_arrays.beam_amplitudes(tables, channel, u, v))


def _steering_cosines(array: LineArray | PlanarArray | PointTransducer) -> Floats:
    """Cosines to right and down of the beams' axes [1], shape (channels, 2)."""
    right, down = np.asarray(array.steers, dtype=float).T
    return np.ascontiguousarray(np.stack([np.cos(down) * np.sin(right), np.sin(down)], axis=1))


def _in_array_frame(cosines: Floats) -> Floats:
    """Unit vectors (boresight, right, down) in front of the array, from cosines to right and down."""
    front = np.sqrt(np.clip(1 - np.sum(cosines**2, axis=1), 0, None))
    return np.concatenate([front[:, None], cosines], axis=1)


def _aperture_sides(
    array: LineArray | PlanarArray | PointTransducer, wavelength: float
) -> tuple[ApertureSide, ApertureSide]:
    """The array's sides across and down."""
    if isinstance(array, LineArray):
        return ApertureSide(array.length / wavelength, array.elements, array.shading), NO_SIDE
    if isinstance(array, PlanarArray):
        across = ApertureSide(array.width / wavelength, array.columns, array.shading)
        return across, ApertureSide(array.height / wavelength, array.rows, array.shading_down)
    return NO_SIDE, NO_SIDE


def _replica_period(array: LineArray | PlanarArray | PointTransducer, wavelength: float) -> tuple[float, float]:
    """Distance between replicas of a beam in direction cosine, across and down [1]; 0 for none."""
    across, down = _aperture_sides(array, wavelength)
    return _period(across), _period(down)


def _period(side: ApertureSide) -> float:
    """Distance between replicas of a beam along one side in direction cosine [1]; 0 for none."""
    return side.elements / side.extent if side.elements and side.elements > 1 else 0.0


def _four_tables(
    array: LineArray | PlanarArray | PointTransducer, across: ApertureSide, down: ApertureSide, reach: Floats
) -> tuple[Tables, Tables, Floats]:
    """Tables across, down, piston across, piston down; their majorants; and their rows per unit, shape (4,).

    `reach` is the largest difference of direction cosines across and down [1], shape (2,).
    """
    pistons = [NO_SIDE if array.element != "piston" else _piston_element(side) for side in (across, down)]
    pattern_tables = [
        _table(*side, float(greatest))
        for side, greatest in zip((across, down, *pistons), (*reach, 1.0, 1.0), strict=True)
    ]
    a, b, c, d = pattern_tables
    return (a[0], b[0], c[0], d[0]), (a[1], b[1], c[1], d[1]), np.array([a[2], b[2], c[2], d[2]])


def _piston_element(side: ApertureSide) -> ApertureSide:
    """Side of one element, as wide as the pitch; a point for a continuous aperture, whose element has only a baffle."""
    return ApertureSide(side.extent / side.elements, None, "uniform") if side.elements else NO_SIDE


@lru_cache(maxsize=CACHE_SIZE)
def _table(extent: float, elements: int | None, shading: str, reach: float) -> tuple[Floats, Floats, float]:
    """Cubics of one pattern (rows, 4) up to a distance in direction cosine, its majorant (rows,), and rows per unit."""
    if extent == 0:
        return read_only(np.empty((0, 4))), read_only(np.empty(0)), 1.0
    # a small aperture still needs a few rows over its whole reach
    per_unit = POINTS_PER_LOBE * max(extent, 1.0)
    rows = int(np.ceil(reach * per_unit)) + 1
    value, slope = pattern(np.arange(rows + 1) / per_unit * extent, shading, elements)
    slope = slope * extent / per_unit
    p, m, q, n = value[:-1], slope[:-1], value[1:], slope[1:]
    table = np.stack([p, m, 3 * (q - p) - 2 * m - n, 2 * (p - q) + m + n], axis=1)
    # a cubic stays between its Bezier control points, so their largest magnitude bounds the row
    row_bound = np.max(np.abs([p, p + m / 3, q - n / 3, q]), axis=0)
    majorant = np.maximum.accumulate(row_bound[::-1])[::-1]
    return read_only(table), read_only(majorant), per_unit
