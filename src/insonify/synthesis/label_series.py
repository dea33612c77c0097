"""Labels over time, from sums by object and by pair of families: intensities, masks and positions of every sample."""

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import DIRECT
from insonify.records.labels import NO_ROW, SURROUNDINGS, LabelNames, Labels
from insonify.synthesis._label_kernel import MOMENTS
from insonify.synthesis._position_kernel import largest_rows, smear_positions, take_stronger
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer
from insonify.synthesis.label_bins import BinGrid, pulse_energy, smeared
from insonify.synthesis.label_sums import ALL, HIDDEN, PAIR_ONLY, Key, LabelBuffer
from insonify.synthesis.level_curves import pair_name

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
Masks = NDArray[np.bool_]
Rows = NDArray[np.uint8]
STRAIGHT = pair_name(DIRECT, DIRECT)


def labels_of(
    buffer: LabelBuffer, accumulator: IncoherentAccumulator, names: LabelNames, noise: float, grid: BinGrid
) -> Labels:
    """Labels of one ping.

    Args:
        buffer: Its sums.
        accumulator: Incoherent accumulator of the same ping.
        names: Names of objects and pairs.
        noise: Mean-square noise pressure that a target has to exceed [uPa^2].
        grid: Its bins of energy and position.
    """
    bins = _bins(buffer)
    pulse, count = pulse_energy(accumulator, grid), accumulator.grid.sample_count
    energy = smeared({key: values[..., 0] for key, values in bins.items()}, pulse, grid, count)
    shared = buffer.bins.keys() | buffer.flashes.keys()  # their energies are in curves
    own = {key: values[..., 0] for key, values in buffer.sampled.items() if key in shared}
    sampled = {key: energy[key] for key in buffer.sampled} | smeared(own, pulse, grid, count)
    by_object, by_pair = _Curves(buffer, accumulator).intensities(names, energy)
    for (object_name, pair), intensity in [*sampled.items(), *smeared(buffer.excess, pulse, grid, count).items()]:
        by_object[:, names.objects.index(object_name)] += intensity
        if pair != ALL:
            by_pair[:, names.pairs.index(pair)] += intensity
    by_object = np.maximum(by_object, 0.0, out=by_object)
    zeros = np.zeros(by_object.shape[::2])
    echo = {key: value for key, value in energy.items() if key[1] != HIDDEN}
    is_received = sum(echo.values(), zeros) > 0
    occluded = np.stack([energy.get((name, HIDDEN), zeros) for name in names.objects])
    occluded_energy = occluded.sum(axis=0)
    highlight, ghost = _targets(by_object, echo, occluded_energy, names, noise)
    shadow = (occluded_energy > energy.get(("seabed", STRAIGHT), zeros)) & ~highlight
    shadowing_object = _largest_rows(np.moveaxis(occluded, 0, 1), shadow)
    strongest = _largest_rows(by_object, is_received)
    position = _positions(bins, energy, pulse, names, strongest, shadowing_object, grid.per_sample)
    distance = np.sqrt((position[:3] ** 2).sum(axis=0))
    position[:3] += accumulator.ping_geometry.receive_position[:, None, None]
    return Labels(
        expected_intensity=by_object.sum(axis=1), object_intensity=by_object, pair_intensity=by_pair,
        strongest_object=strongest, strongest_pair=_largest_rows(by_pair, is_received), highlight=highlight,
        shadow=shadow, ghost=ghost, shadowing_object=shadowing_object, position=np.moveaxis(position[:3], 0, -1),
        distance=distance, grazing=position[3],
    )  # fmt: skip


def _bins(buffer: LabelBuffer) -> dict[Key, Singles]:
    """Energy and positions by key, those of smooth targets squared."""
    bins = dict(buffer.bins)
    others = [*buffer.sampled.items(), *((key, flashes.bins) for key, flashes in buffer.flashes.items())]
    for key, values in others:
        bins[key] = bins[key] + values if key in bins else values
    return {key: np.ascontiguousarray(values) for key, values in bins.items()}


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
            shared_keys = [key for key in energy if key[0] == object_name and self._lacks_curve(key)]
            if shared_keys:
                self._divide_by_energy(object_name, intensity, shared_keys, energy, names, by_pair)
        return np.stack(by_object, axis=1), np.stack(by_pair, axis=1)

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

    def _lacks_curve(self, key: Key) -> bool:
        """Return True for a pair whose energies have no curve but that of its object."""
        (object_name, pair), curves = key, self._buffer.curves
        has_own = (object_name, pair) in curves or (object_name, PAIR_ONLY + pair) in curves
        return not has_own and pair != HIDDEN and key not in self._buffer.sampled

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
    shadowing_object: Rows, per_sample: int,
) -> Floats:  # fmt: skip
    """North, east, down re the receiver, grazing angle, (4, channels, samples); NaN where nothing is received."""
    own = {False: np.where(shadowing_object == NO_ROW, strongest, NO_ROW), True: shadowing_object}
    highest, winner = np.zeros(strongest.shape), np.full(strongest.shape, -1, np.int16)
    for number, ((object_name, pair), value) in enumerate(energy.items()):
        take_stronger(value, own[pair == HIDDEN], names.objects.index(object_name), number, highest, winner)
    position = np.full((MOMENTS - 1, *strongest.shape), np.nan)
    for number, key in enumerate(energy):
        smear_positions(bins[key], pulse, per_sample, winner, number, position)
    return position


def _largest_rows(values: Floats, counts: Masks) -> Rows:
    """Row of the largest value of each sample, (channels, rows, samples) to (channels, samples); `NO_ROW` for none."""
    largest = np.empty(counts.shape, np.uint8)
    largest_rows(values, counts, NO_ROW, largest)
    return largest
