"""Common frame of two recordings: one axis of range, one scale, and the units by which chance is judged.

Units are blocks of pings that are longer than the echoes of the seabed stay alike. Where there are fewer than eight of
them in either recording, a block is cut into tiles of range and of beam angle.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.signal import fftconvolve, firwin

from insonify.comparison.samples import Floats, Samples, Values
from insonify.formats.store_description import StoreError
from insonify.units import level_db

MIN_BLOCKS = 8
"""Least number of independent blocks of pings, in each recording, that are exchanged as a whole."""
MAX_STRATA = 256
"""Most tiles into which a block of pings is cut."""
TILE_CELLS = 4
"""Resolution cells of range in a tile."""
MIN_SAMPLES = 16
"""Fewest samples that two ranges have to share."""
ANGLE_STEP = np.radians(5.0)
"""Width of the bins of beam angle [rad]."""
ALIKE = 0.2
"""Correlation below which echoes count as different ones."""


@dataclass(frozen=True, slots=True)
class Side:
    """One of two recordings, in the common frame."""

    samples: Samples
    """Samples on the common axis of range, parts of an aperture kept."""
    field: Values
    """Beams, complex or real, shape (ping, beam, sample)."""
    intensity: Floats
    """Squared amplitude, NaN where nothing was recorded, shape (ping, beam, sample)."""
    unit: NDArray[np.int64]
    """Number of the unit of each sample, broadcast with the intensity."""
    units: int
    """Number of units."""
    ping_block: int
    """Pings after which echoes are no longer alike."""

    @property
    def vertical_beam(self) -> int:
        """Beam nearest to the vertical, the first where angles are not known."""
        angle = self.samples.angle
        return int(np.argmin(np.abs(angle))) if angle.size == self.field.shape[1] else 0

    def sums(self, values: Floats, bins: NDArray[np.int64] | None = None, count: int = 1) -> Floats:
        """Sums of values by unit and bin; NaN is left out.

        Args:
            values: Values, shape (ping, beam, n) with n up to the number of samples: those at the start.
            bins: Bin of each value, broadcast with the values; negative: left out.
            count: Number of bins.

        Returns:
            Sums, shape (units, count).
        """
        width = self.unit.shape[2]
        unit = self.unit[..., : values.shape[2]] if width > 1 else self.unit
        index = np.broadcast_to(unit * count if bins is None else unit * count + bins, values.shape)
        keep = np.isfinite(values)
        if bins is not None:
            keep = keep & (np.broadcast_to(bins, values.shape) >= 0)
        total = np.bincount(index[keep], weights=values[keep], minlength=self.units * count)
        return np.asarray(total.reshape(self.units, count))


@dataclass(frozen=True, slots=True)
class Frame:
    """Two recordings on one axis of range."""

    slant_range: Floats
    """Common axis of range [m], shape (sample,)."""
    first: Side
    """Real recording."""
    second: Side
    """Simulated recording, multiplied with a constant where units differ."""
    cell: int
    """Samples of range after which echoes are no longer alike."""
    strata: int
    """Number of tiles of a block of pings; 1: blocks are exchanged as a whole."""
    blocks: tuple[int, int]
    """Number of blocks of pings of each recording."""
    scaled_db: float
    """Level by which the simulated recording was raised [dB]; 0 where units are equal."""
    notes: tuple[str, ...]
    """Treatment of both recordings."""

    @property
    def step(self) -> float:
        """Step of range [m]."""
        return float(self.slant_range[1] - self.slant_range[0]) if self.slant_range.size > 1 else np.nan

    @property
    def sides(self) -> tuple[Side, Side]:
        """Real and simulated recording."""
        return self.first, self.second

    def grazing(self, side: Side) -> Floats | None:
        """Grazing angle on a level seabed [rad], broadcast with the intensity; None where it is not known."""
        known = side.samples
        if known.angle.size and known.values.shape[1] == side.field.shape[1]:
            return np.asarray((np.pi / 2 - np.abs(known.angle))[None, :, None])
        if known.altitude.size:
            with np.errstate(invalid="ignore", divide="ignore"):
                sine = known.altitude[:, None, None] / self.slant_range
            return np.where((sine > 0) & (sine <= 1), np.arcsin(np.clip(sine, 0, 1)), np.nan)
        return None


def common_frame(first: Samples, second: Samples) -> Frame:
    """Frame of two recordings.

    Raises:
        StoreError: They share no range, or one holds detections and the other samples.
    """
    notes = [f"{side.name}: {note}" for side in (first, second) for note in side.notes]
    if (first.slant_range.size > 1) != (second.slant_range.size > 1):
        raise StoreError(f"{first.name} and {second.name}: detections and samples are not comparable. Name a group "
                         "of the same kind of both: --group soundings, --group 'water column'")  # fmt: skip
    axis = _common_axis(first, second, notes) if first.slant_range.size > 1 else first.slant_range
    one, two = _where_both_have_samples(*(_on_axis(side, axis) for side in (first, second)))
    scaled = 0.0
    if one.unit != two.unit:
        scaled = _offset_db(one, two)
        two = replace(two, values=two.values * 10 ** (scaled / 20))
        notes.append(f"units differ ({one.unit}, {two.unit}): {scaled:+.1f} dB on the simulated levels makes the total "
                     "energies equal")  # fmt: skip
    cell = max(_cell(side) for side in (one, two))
    fields = [side.beams() if one.is_complex and two.is_complex else np.abs(side.beams()) for side in (one, two)]
    length = max(_ping_block(field, cell) for field in fields)  # of both, so that units are of one size
    blocks = [-(-side.values.shape[0] // length) for side in (one, two)]
    strata, index = 1, [np.zeros((1, 1, 1), np.int64)] * 2
    if min(blocks) < MIN_BLOCKS:
        strata, index = _tiles(one, two, cell)
        notes.append(f"{blocks[0]} and {blocks[1]} independent blocks of pings, so chance is judged by {strata} tiles "
                     "of range and angle")  # fmt: skip
    rows = zip((one, two), blocks, index, strict=True)
    sides = [_side(side, length, count, strata, tile) for side, count, tile in rows]
    return Frame(axis, sides[0], sides[1], cell, strata, (blocks[0], blocks[1]), scaled, tuple(notes))


def _side(samples: Samples, length: int, blocks: int, strata: int, tile: NDArray[np.int64]) -> Side:
    field = samples.beams()
    block = (np.arange(field.shape[0]) // length)[:, None, None]
    intensity = np.abs(field).astype(float) ** 2
    return Side(samples, field, intensity, tile * blocks + block, strata * blocks, length)


def _common_axis(first: Samples, second: Samples, notes: list[str]) -> Floats:
    """Ranges that both have, at the larger step, behind the transmitted pulse."""
    step = max(first.step, second.step)
    start = max(_after_transmission(side) for side in (first, second))
    stop = min(float(side.slant_range[_recorded(side)[-1]]) for side in (first, second))
    count = int(np.floor((stop - start) / step + 1e-6)) + 1
    if count < MIN_SAMPLES:
        spans = [f"{side.slant_range[0]:.2f} to {side.slant_range[-1]:.2f} m" for side in (first, second)]
        raise StoreError(f"{first.name} covers {spans[0]} and {second.name} {spans[1]}: fewer than {MIN_SAMPLES} "
                         "samples in common. Simulate the range of the recording (track.window)")  # fmt: skip
    if abs(first.step - second.step) > 1e-3 * step:
        notes.append(f"compared at steps of {step:.4g} m ({first.step:.4g} and {second.step:.4g} m)")
    notes.append(f"compared from {start:.2f} to {stop:.2f} m")
    # the axis of the coarser recording itself, so that it is not interpolated
    coarse = first if first.step >= second.step else second
    row = int(np.ceil((start - coarse.slant_range[0]) / step - 1e-6))
    axis = coarse.slant_range[row:]
    return np.asarray(axis[axis <= stop + 1e-6 * step], float)


def _after_transmission(samples: Samples) -> float:
    """Range behind the transmitted pulse, where a recording opens with it [m]."""
    level, start = mean_level(samples.beams()), int(_recorded(samples)[0])
    pulse = samples.pulse_length * samples.sound_speed / 2
    width = max(int(np.nan_to_num(pulse / samples.step)), 1)
    head = max(4 * width, 4)
    later = level[start + head :]
    if later.size < MIN_SAMPLES:
        return float(samples.slant_range[start])
    smooth = uniform_filter1d(np.where(np.isfinite(level), level, np.nanmin(level))[start:], width)
    echo = int(np.argmax(smooth - np.minimum.accumulate(smooth)))
    if not smooth[:head].max() > smooth[:echo].min(initial=np.inf) + 20:
        return float(samples.slant_range[start])
    return float(samples.slant_range[start + int(np.argmax(smooth < smooth[:echo].min() + 6)) + width])


def _recorded(samples: Samples) -> NDArray[np.int64]:
    """Samples of range at which anything was recorded."""
    recorded = np.flatnonzero(np.isfinite(samples.values).any(axis=(0, 1)))
    if not recorded.size:
        raise StoreError(f"{samples.name}: all samples are missing. Choose other pings or another group")
    return recorded


def _where_both_have_samples(first: Samples, second: Samples) -> tuple[Samples, Samples]:
    """Both recordings without the beams and ranges that the other lacks in all pings."""
    known = [np.asarray(np.isfinite(side.values).any(axis=0)) for side in (first, second)]
    if all(rows.all() for rows in known):
        return first, second
    masked = []
    for side, other, others in ((first, second, known[1]), (second, first, known[0])):
        rows = others.any(axis=0, keepdims=True)
        if side.angle.size and other.angle.size and len(others) > 1:
            rows = others[np.argmin(np.abs(side.angle[:, None] - other.angle), axis=1)]
        elif side.values.shape[1] == len(others):
            rows = others
        masked.append(replace(side, values=np.where(rows, side.values, np.nan)))
    return masked[0], masked[1]


def mean_level(field: Values) -> Floats:
    """Level of the mean intensity over pings and beams [dB], shape (sample,); NaN where nothing was recorded.

    Args:
        field: Beams, shape (ping, beam, sample).
    """
    power = np.abs(field).astype(float) ** 2
    count = np.isfinite(power).sum((0, 1))
    mean = np.nansum(power, (0, 1)) / np.maximum(count, 1)
    return np.where(count > 0, level_db(np.maximum(mean, 1e-300)), np.nan)


def _on_axis(samples: Samples, axis: Floats) -> Samples:
    """Samples on another axis of range; complex ones are limited to the band of its step before."""
    if axis.size == samples.slant_range.size and np.allclose(axis, samples.slant_range, atol=1e-9):
        return samples
    values, ratio = samples.values, float(axis[1] - axis[0]) / samples.step
    missing = ~np.isfinite(values)
    if ratio > 1.5 and samples.is_complex:
        taps = firwin(20 * int(np.ceil(ratio)) + 1, 1 / ratio)
        # without the transmitted pulse in front, of which the filter would leak more than echoes have
        left_out = missing | (samples.slant_range < axis[0])
        values = fftconvolve(np.where(left_out, 0, values), taps.reshape(1, 1, -1), mode="same", axes=2)
        values[missing] = np.nan
    position = (axis - samples.slant_range[0]) / samples.step
    low = np.clip(np.floor(position + 1e-6).astype(int), 0, samples.slant_range.size - 1)
    high = np.minimum(low + 1, samples.slant_range.size - 1)
    weight = np.clip(position - low, 0, 1)
    low_only = weight < 1e-6
    upper = np.where(low_only, 0, values[..., high] * weight)
    moved = values[..., low] * (1 - np.where(low_only, 0, weight)) + upper
    return replace(samples, values=moved, slant_range=axis)


def _offset_db(first: Samples, second: Samples) -> float:
    """Level of the first total energy re the second [dB]."""
    energies = [np.nanmean(np.abs(side.beams()).astype(float) ** 2) for side in (first, second)]
    return float(level_db(energies[0] / energies[1])) if min(energies) > 0 else 0.0


def _fluctuation(field: Values, width: int) -> Floats:
    """Level re its running mean over range [dB], 0 where nothing was recorded."""
    power = np.abs(field).astype(float) ** 2
    known = np.isfinite(power) & (power > 0)
    level = level_db(np.where(known, power, 1.0))
    share = uniform_filter1d(known.astype(float), width, axis=2)
    mean = uniform_filter1d(level, width, axis=2) / np.maximum(share, 1e-9)
    return np.where(known, level - mean, 0.0)


def _cell(samples: Samples) -> int:
    """Samples of range after which echoes are no longer alike: those of the pulse where it is known."""
    pulse = samples.pulse_length * samples.sound_speed / 2 / samples.step
    return max(int(np.ceil(pulse)), 1) if np.isfinite(pulse) else _range_cell(samples.beams())


def _range_cell(field: Values) -> int:
    """Samples of range after which the level is no longer alike, re a running mean over eight such cells or more."""
    width = 2 * MIN_SAMPLES
    while width <= field.shape[2]:
        x = _fluctuation(field, width)
        power = float((x**2).sum())
        lags = (lag for lag in range(1, width) if float((x[..., lag:] * x[..., :-lag]).sum()) < ALIKE * power)
        cell = next(lags, width)
        if 8 * cell <= width:
            return cell
        width *= 2
    return max(field.shape[2] // MIN_SAMPLES, 1)


def _ping_block(field: Values, cell: int) -> int:
    """Pings after which echoes are no longer alike; all of them where they always are.

    Complex echoes are compared with their phase, real ones by the sign of their level re its running mean over range,
    which a few echoes at fixed ranges hardly affect. The intensity of speckle has the squared correlation of its
    complex amplitude; that of Gaussian levels follows from that of their signs (Sheppard 1899).
    """
    width = max(min(8 * cell, field.shape[2]), 1)
    if np.iscomplexobj(field):
        power = uniform_filter1d(np.nan_to_num(np.abs(field) ** 2), width, axis=2)
        x = np.nan_to_num(field / np.sqrt(np.maximum(power, 1e-300)))
    else:
        x = np.sign(_fluctuation(field, width))
    whole = max(float(np.mean(np.abs(x) ** 2)), 1e-300)
    for lag in range(1, field.shape[0]):
        alike = abs(np.mean(x[lag:] * np.conj(x[:-lag]))) / whole
        if (alike**2 if np.iscomplexobj(x) else np.sin(np.pi / 2 * alike)) < ALIKE:
            return 1 if lag == 1 else min(2 * lag, field.shape[0])
    return field.shape[0]


def _tiles(first: Samples, second: Samples, cell: int) -> tuple[int, list[NDArray[np.int64]]]:
    """Number of tiles of range and beam angle, and the tile of each sample of both recordings."""
    beams = [side.beams().shape[1] for side in (first, second)]
    rows: list[NDArray[np.int64]]
    if first.angle.size and second.angle.size and min(beams) > 1:
        angles = [np.floor(side.angle / ANGLE_STEP).astype(np.int64) for side in (first, second)]
        least = min(int(angle.min()) for angle in angles)
        rows = [angle - least for angle in angles]
    elif beams[0] == beams[1]:
        rows = [np.arange(count) * min(count, 16) // count for count in beams]
    else:
        rows = [np.zeros(count, np.int64) for count in beams]
    fans = max(int(row.max()) for row in rows) + 1
    count = first.slant_range.size
    length = max(TILE_CELLS * cell, -(-count * fans // MAX_STRATA))
    ranges = -(-count // length)
    along = np.arange(count) // length
    return fans * ranges, [(row[:, None] * ranges + along)[None] for row in rows]
