"""Labels over time, from sums by object and by pair of families: intensities, masks and positions of every sample."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import DIRECT
from insonify.records.labels import NO_ROW, SURROUNDINGS, LabelNames, Labels
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.synthesis._label_kernel import MOMENTS
from insonify.synthesis._position_kernel import largest_rows, smear_energies, smear_positions, take_stronger
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer
from insonify.synthesis.label_sums import ALL, HIDDEN, PAIR_ONLY, Key, LabelBuffer
from insonify.synthesis.level_curves import LevelBuffers, pair_name

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Masks = NDArray[np.bool_]
Rows = NDArray[np.uint8]
STRAIGHT = pair_name(DIRECT, DIRECT)


def labels_of(buffer: LabelBuffer, accumulator: IncoherentAccumulator, names: LabelNames, noise: float) -> Labels:
    """Labels of one ping.

    Args:
        buffer: Its sums.
        accumulator: Incoherent accumulator of the same ping.
        names: Names of objects and pairs.
        noise: Mean-square noise pressure that a target has to exceed [uPa^2].
    """
    bins = _bins(buffer)
    pulse = _pulse_energy(accumulator.ping_geometry.pulse, accumulator.grid.sample_rate)
    energy = {key: _convolved(bin_energy, pulse, accumulator.grid.sample_count) for key, bin_energy in bins.items()}
    by_object, by_pair = _Curves(buffer, accumulator).intensities(names, energy)
    zeros = np.zeros(by_object.shape[::2])
    echo = {key: value for key, value in energy.items() if key[1] != HIDDEN}
    is_received = sum(echo.values(), zeros) > 0
    occluded = np.stack([energy.get((name, HIDDEN), zeros) for name in names.objects])
    occluded_energy = occluded.sum(axis=0)
    highlight, ghost = _targets(by_object, echo, occluded_energy, names, noise)
    shadow = (occluded_energy > energy.get(("seabed", STRAIGHT), zeros)) & ~highlight
    shadowing_object = _largest_rows(np.moveaxis(occluded, 0, 1), shadow)
    strongest = _largest_rows(by_object, is_received)
    position = _positions(bins, energy, pulse, names, strongest, shadowing_object)
    position[:3] += accumulator.ping_geometry.receive_position[:, None, None]
    return Labels(
        expected_intensity=by_object.sum(axis=1), object_intensity=by_object, pair_intensity=by_pair,
        strongest_object=strongest, strongest_pair=_largest_rows(by_pair, is_received), highlight=highlight,
        shadow=shadow, ghost=ghost, shadowing_object=shadowing_object, position=np.moveaxis(position[:3], 0, -1),
        distance=position[3], grazing=position[4],
    )  # fmt: skip


def ringing(accumulator: IncoherentAccumulator) -> tuple[int, int]:
    """Samples that an echo of the pulse covers after, and before, its delay."""
    return _ringing(accumulator.ping_geometry.pulse, accumulator.grid.sample_rate)


@lru_cache(maxsize=4)
def _ringing(pulse: ReceivedPulse, rate: float) -> tuple[int, int]:
    """Samples of the pulse after, and before, an echo's delay; cached because the filter's extent is slow."""
    return max(0, int(np.ceil(pulse.stop * rate))), max(0, int(np.ceil(-pulse.start * rate)))


def _bins(buffer: LabelBuffer) -> dict[Key, Singles]:
    """Energy and positions by key, those of smooth targets squared."""
    bins = dict(buffer.bins)
    for key, flashes in buffer.flashes.items():
        bins[key] = bins[key] + flashes.bins if key in bins else flashes.bins
    return {key: np.ascontiguousarray(values) for key, values in bins.items()}


@lru_cache(maxsize=4)
def _pulse_energy(pulse: ReceivedPulse, rate: float) -> Floats:
    """Energy of a pulse at the lags of the bins that contribute to one sample, from the first bin [1]."""
    lead, tail = _ringing(pulse, rate)
    energy = np.ascontiguousarray(np.abs(pulse.samples(np.arange(-tail, lead + 1) / rate))[::-1] ** 2)
    energy.flags.writeable = False  # shared by all pings
    return energy


def _convolved(bins: Singles, pulse: Floats, count: int) -> Floats:
    """Energies of bins convolved with the pulse, (channels, bins, MOMENTS) to (channels, samples)."""
    out = np.empty((len(bins), count))
    smear_energies(bins, pulse, out)
    return out


class _Curves:
    """Time series of the curves of one ping; each sum of curves is transformed once."""

    def __init__(self, buffer: LabelBuffer, accumulator: IncoherentAccumulator) -> None:
        self._buffer, self._accumulator = buffer, accumulator
        self._cached_series: dict[tuple[Key, ...], Floats] = {}

    def intensities(self, names: LabelNames, energy: dict[Key, Floats]) -> tuple[Floats, Floats]:
        """Expected intensity by object, (channels, objects, samples), and by pair alone, (channels, pairs, samples)."""
        curves = self._buffer.curves
        by_object = [
            self._series(tuple(key for key in curves if key[0] == object_name and not key[1].startswith(PAIR_ONLY)))
            for object_name in names.objects
        ]
        by_pair = [
            self._series(tuple(key for key in curves if key[1] in (name, PAIR_ONLY + name))) for name in names.pairs
        ]  # fmt: skip
        for object_name, intensity in zip(names.objects, by_object, strict=True):
            shared_keys = [key for key in energy if key[0] == object_name and _lacks_curve(curves, key)]
            if shared_keys:
                self._divide_by_energy(object_name, intensity, shared_keys, energy, names, by_pair)
        return np.maximum(np.stack(by_object, axis=1), 0.0), np.stack(by_pair, axis=1)

    def _divide_by_energy(
        self, object_name: str, whole: Floats, shared_keys: list[Key], energy: dict[Key, Floats], names: LabelNames,
        by_pair: list[Floats],
    ) -> None:  # fmt: skip
        """Divide an object's intensity, without interference, among pairs without curves, by their energies."""
        common = self._buffer.common.get(object_name)
        if common is not None:
            alone = self._buffer.curves[object_name, ALL]
            whole = self._accumulator.time_series(IntensityBuffer(alone.cells - common.cells, alone.intensity))
        total = np.asarray(sum(energy[key] for key in shared_keys))
        part = np.divide(whole, total, out=np.zeros_like(whole), where=total > 0)
        for key in shared_keys:
            row = names.pairs.index(key[1])
            by_pair[row] = by_pair[row] + (whole if len(shared_keys) == 1 else part * energy[key])

    def _series(self, keys: tuple[Key, ...]) -> Floats:
        """Series of the sum of some curves."""
        if keys not in self._cached_series:
            grid, parts = self._accumulator.grid, [self._buffer.curves[key] for key in keys]
            parts = [curve for curve in parts if curve.specular_sums or curve.cells.any() or curve.intensity.any()]
            if not parts:
                self._cached_series[keys] = np.zeros((self._accumulator.ping_geometry.channel_count, grid.sample_count))
            elif len(parts) == 1:
                self._cached_series[keys] = self._accumulator.time_series(parts[0])
            else:
                total = self._accumulator.empty()
                for curve in parts:
                    total += curve
                self._cached_series[keys] = self._accumulator.time_series(total)
        return self._cached_series[keys]


def _lacks_curve(curves: LevelBuffers, key: Key) -> bool:
    """Return True for a pair whose energies have no curve but that of its object."""
    object_name, pair = key
    return pair != HIDDEN and (object_name, pair) not in curves and (object_name, PAIR_ONLY + pair) not in curves


def _targets(
    by_object: Floats, echo: dict[Key, Floats], occluded: Floats, names: LabelNames, noise: float
) -> tuple[Masks, Masks]:
    """Highlights and ghosts: samples in which targets make at least half of the intensity including noise.

    A highlight is no weaker than the occluded echo of the seabed; otherwise the sample is a shadow.
    """
    zeros = np.zeros(by_object.shape[::2])
    target = np.array([name not in SURROUNDINGS for name in names.objects])
    target_intensity = by_object[:, target].sum(axis=1)
    energy_by_surface = {True: zeros, False: zeros}
    for (object_name, pair), value in echo.items():
        if object_name not in SURROUNDINGS:
            energy_by_surface["S" in pair] = energy_by_surface["S" in pair] + value
    # the tail of the filter, 60 dB below an echo and further, would dominate silent water
    is_received = energy_by_surface[True] + energy_by_surface[False] > 0
    dominates = is_received & (target_intensity >= by_object[:, ~target].sum(axis=1) + noise)
    ghost = energy_by_surface[True] > energy_by_surface[False]
    return dominates & ~ghost & (target_intensity >= occluded), dominates & ghost


def _positions(
    bins: dict[Key, Singles], energy: dict[Key, Floats], pulse: Floats, names: LabelNames, strongest: Rows,
    shadowing_object: Rows,
) -> Floats:  # fmt: skip
    """North, east, down re the receiver, distance, grazing, (5, channels, samples); NaN where nothing is received."""
    own = {False: np.where(shadowing_object == NO_ROW, strongest, NO_ROW), True: shadowing_object}
    highest, winner = np.zeros(strongest.shape), np.full(strongest.shape, -1, np.int16)
    for number, ((object_name, pair), value) in enumerate(energy.items()):
        take_stronger(value, own[pair == HIDDEN], names.objects.index(object_name), number, highest, winner)
    position = np.full((MOMENTS - 1, *strongest.shape), np.nan)
    for number, key in enumerate(energy):
        smear_positions(bins[key], pulse, winner, number, position)
    return position


def _largest_rows(values: Floats, counts: Masks) -> Rows:
    """Row of the largest value of each sample, (channels, rows, samples) to (channels, samples); `NO_ROW` for none."""
    largest = np.empty(counts.shape, np.uint8)
    largest_rows(values, counts, NO_ROW, largest)
    return largest
