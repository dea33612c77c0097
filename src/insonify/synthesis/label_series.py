"""Labels over time, from sums by object and by pair of families: intensities, masks and positions of every sample."""

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import DIRECT
from insonify.records.labels import NO_ROW, SURROUNDINGS, LabelNames, Labels, MaskLabels
from insonify.synthesis._position_kernel import SamplePositions, smear_positions
from insonify.synthesis._sample_mask_kernel import Contributions, SampleMasks, fill_masks, largest_rows
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer
from insonify.synthesis.label_bins import BinGrid, pulse_energy, smeared
from insonify.synthesis.label_sums import ALL, HIDDEN, PAIR_ONLY, Key, LabelBuffer, is_curve_of
from insonify.synthesis.level_curves import pair_name

Floats = NDArray[np.float64]
Singles = NDArray[np.float32]
STRAIGHT = pair_name(DIRECT, DIRECT)
"""Name of the direct path, D-D."""


def labels_of(
    buffer: LabelBuffer, accumulator: IncoherentAccumulator, names: LabelNames, noise: float, grid: BinGrid, *,
    with_positions: bool = True,
) -> MaskLabels:  # fmt: skip
    """Labels of one ping.

    Args:
        buffer: Its sums.
        accumulator: Incoherent accumulator of the same ping.
        names: Names of objects and pairs.
        noise: Mean-square noise pressure that a target has to exceed [uPa^2].
        grid: The bins of energy and position.
        with_positions: True: `Labels`; False: `MaskLabels` alone.
    """
    bins, geometry, curves = _bins(buffer), accumulator.ping_geometry, _Curves(buffer, accumulator)
    pulse, shape = pulse_energy(accumulator, grid), (geometry.channel_count, accumulator.grid.sample_count)
    energies = smeared((values[..., 0] for values in bins.values()), pulse, grid, shape)
    energy = dict(zip(bins, energies, strict=True))
    by_object = np.stack([curves.of_object(name) for name in names.objects], axis=1)
    shared = buffer.bins.keys() | buffer.flashes.keys()  # their energies are in curves
    own = {key: values[..., 0] for key, values in buffer.sampled.items() if key in shared}
    sampled = {key: energy[key] for key in buffer.sampled} | dict(
        zip(own, smeared(own.values(), pulse, grid, shape), strict=True)
    )
    excess = zip(buffer.excess, smeared(buffer.excess.values(), pulse, grid, shape), strict=True)
    binned = [*sampled.items(), *excess]
    for (object_name, _), intensity in binned:
        by_object[:, names.objects.index(object_name)] += intensity
    by_object = np.maximum(by_object, 0.0, out=by_object)
    masks = _masks(by_object, energy, energies, names, noise)
    columns = {"object_intensity": by_object} | {
        column.name: getattr(masks, column.name) for column in fields(MaskLabels) if column.name != "object_intensity"
    }
    if not with_positions:
        return MaskLabels(**columns)
    by_pair = np.stack(curves.by_pair(names, energy), axis=1)
    for (_, pair), intensity in binned:
        if pair != ALL:
            by_pair[:, names.pairs.index(pair)] += intensity
    means = SamplePositions(*(np.full(size, np.nan) for size in ((*shape, 3), shape, shape)))
    for number, (values, contribution) in enumerate(zip(bins.values(), energies, strict=True)):
        smear_positions(
            values, contribution, pulse, grid.per_sample, masks.contribution, number, geometry.receive_position, means
        )  # fmt: skip
    strongest_pair = np.empty(shape, np.uint8)
    for values, received, largest in zip(by_pair, masks.received, strongest_pair, strict=True):
        largest_rows(values, received, NO_ROW, largest)
    return Labels(**columns, pair_intensity=by_pair, strongest_pair=strongest_pair, **means._asdict())


def _bins(buffer: LabelBuffer) -> dict[Key, Singles]:
    """Energies and energy-weighted positions by key; of smooth targets from the squared sums of pressures."""
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
        self._computed: list[tuple[IntensityBuffer, Floats]] = []

    def of_object(self, object_name: str) -> Floats:
        """Expected intensity of one object, (channels, samples)."""
        return self._series(tuple(key for key in self._buffer.curves if is_curve_of(object_name, key)))

    def by_pair(self, names: LabelNames, energy: dict[Key, Floats]) -> list[Floats]:
        """Expected intensity of each pair alone, (channels, samples) each."""
        curves = self._buffer.curves
        series = [
            self._series(tuple(key for key in curves if key[1] in (name, PAIR_ONLY + name))) for name in names.pairs
        ]  # fmt: skip
        for object_name in names.objects:
            shared_keys = [key for key in energy if key[0] == object_name and self._lacks_curve(key)]
            if shared_keys:
                self._divide_by_energy(object_name, self.of_object(object_name), shared_keys, energy, names, series)
        return series

    def _divide_by_energy(
        self, object_name: str, whole: Floats, shared_keys: list[Key], energy: dict[Key, Floats], names: LabelNames,
        by_pair: list[Floats],
    ) -> None:  # fmt: skip
        """Divide an object's intensity, without interference, among pairs without curves, in proportion to energies."""
        common = self._buffer.common.get(object_name)
        if common is not None:
            alone = self._buffer.curves[object_name, ALL]
            whole = self._accumulator.time_series(IntensityBuffer(alone.cells - common.cells, alone.intensity))
        rows = [names.pairs.index(key[1]) for key in shared_keys]
        if len(rows) == 1:
            by_pair[rows[0]] = by_pair[rows[0]] + whole
            return
        total = np.asarray(sum(energy[key] for key in shared_keys))
        ratio = np.divide(whole, total, out=np.zeros_like(whole), where=total > 0)
        for key, row in zip(shared_keys, rows, strict=True):
            by_pair[row] = by_pair[row] + ratio * energy[key]

    def _lacks_curve(self, key: Key) -> bool:
        """Return True for a pair of which only the curve of its object holds the energies."""
        (object_name, pair), curves = key, self._buffer.curves
        has_own = (object_name, pair) in curves or (object_name, PAIR_ONLY + pair) in curves
        return not has_own and pair != HIDDEN and key not in self._buffer.sampled

    def _series(self, keys: tuple[Key, ...]) -> Floats:
        """Time series of the sum of some curves [uPa^2], (channels, samples)."""
        if keys not in self._cached_series:
            grid, parts = self._accumulator.grid, [self._buffer.curves[key] for key in keys]
            parts = [curve for curve in parts if curve.specular_sums or curve.cells.any() or curve.intensity.any()]
            if not parts:
                self._cached_series[keys] = np.zeros((self._accumulator.ping_geometry.channel_count, grid.sample_count))
            elif len(parts) == 1:
                self._cached_series[keys] = self._series_of(parts[0])
            else:
                total = self._accumulator.empty()
                for curve in parts:
                    total += curve
                self._cached_series[keys] = self._accumulator.time_series(total)
        return self._cached_series[keys]

    def _series_of(self, curve: IntensityBuffer) -> Floats:
        """Series of one curve; that of an equal curve, as of an object with a single pair, is reused."""
        for other, series in self._computed:
            if np.array_equal(other.cells, curve.cells) and np.array_equal(other.intensity, curve.intensity):
                return series
        self._computed.append((curve, self._accumulator.time_series(curve)))
        return self._computed[-1][1]


def _masks(
    by_object: Floats, energy: dict[Key, Floats], energies: Floats, names: LabelNames, noise: float
) -> SampleMasks:
    """Masks of all samples, by the intensities of objects and the energies of contributions."""
    shape, keys = by_object.shape[::2], list(energy)
    contributions = Contributions(
        energies, np.array([names.objects.index(name) for name, _ in keys], np.intp),
        np.array([pair == HIDDEN for _, pair in keys], bool), np.array(["S" in pair for _, pair in keys], bool),
    )  # fmt: skip
    masks = SampleMasks(np.empty(shape), *(np.empty(shape, kind) for kind in (np.uint8, np.uint8, np.int16)),
                        *(np.empty(shape, bool) for _ in range(4)))  # fmt: skip
    is_target = np.array([name not in SURROUNDINGS for name in names.objects])
    straight = keys.index(("seabed", STRAIGHT)) if ("seabed", STRAIGHT) in energy else -1
    fill_masks(by_object, is_target, contributions, straight, noise, NO_ROW, masks)
    return masks
