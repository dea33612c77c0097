"""Labels over time, from sums by owner and by pair of families: intensities, masks and places of every sample."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from insonify.propagation.families import DIRECT
from insonify.records.labels import NO_ROW, LabelNames, Labels
from insonify.sonar.received_pulse import ReceivedPulse
from insonify.synthesis._label_kernel import MOMENTS
from insonify.synthesis._place_kernel import smear, smear_places
from insonify.synthesis.incoherent import IncoherentAccumulator, IntensityBuffer
from insonify.synthesis.label_sums import ALL, HIDDEN, PAIR_ONLY, Key, LabelBuffer
from insonify.synthesis.level_curves import LevelBuffers, pair_name

Floats = NDArray[np.float64]
Masks = NDArray[np.bool_]
Rows = NDArray[np.uint8]
SURROUNDINGS = ("seabed", "surface", "water")
"""Owners that are no target."""
STRAIGHT = pair_name(DIRECT, DIRECT)


def labels_of(buffer: LabelBuffer, whole: IncoherentAccumulator, names: LabelNames, noise: float) -> Labels:
    """Labels of one ping.

    Args:
        buffer: Its sums.
        whole: The expectation that they take apart.
        names: Axes of the labels.
        noise: Mean-square noise pressure, beside which a target has to be heard [uPa^2].
    """
    bins = _bins(buffer)
    pulse = _pulse_energy(whole.ping_geometry.pulse, whole.grid.sample_rate)
    energy = {key: _convolved(one, pulse, whole.grid.sample_count) for key, one in bins.items()}
    by_owner, by_pair = _Curves(buffer, whole).intensities(names, energy)
    silent = np.zeros(by_owner.shape[::2])
    echo = {key: value for key, value in energy.items() if key[1] != HIDDEN}
    there = sum(echo.values(), silent) > 0
    missing = np.stack([energy.get((who, HIDDEN), silent) for who in names.objects])
    lost = missing.sum(axis=0)
    highlight, ghost = _targets(by_owner, echo, lost, names, noise)
    shadow = (lost > energy.get(("seabed", STRAIGHT), silent)) & ~highlight
    shadowing_object = np.where(shadow, np.argmax(missing, axis=0), NO_ROW).astype(np.uint8)
    owner = np.where(there, np.argmax(by_owner, axis=1), NO_ROW).astype(np.uint8)
    place = _places(bins, energy, pulse, names, owner, shadowing_object)
    return Labels(
        expected_intensity=by_owner.sum(axis=1),
        object_intensity=by_owner,
        pair_intensity=by_pair,
        strongest_object=owner,
        strongest_pair=np.where(there, np.argmax(by_pair, axis=1), NO_ROW).astype(np.uint8),
        highlight=highlight,
        shadow=shadow,
        ghost=ghost,
        shadowing_object=shadowing_object,
        position=np.moveaxis(place[:3], 0, -1),
        distance=place[3],
        grazing=place[4],
    )


def ringing(whole: IncoherentAccumulator) -> tuple[int, int]:
    """Return the samples for which the pulse is heard after, and before, an echo's delay."""
    return _ringing(whole.ping_geometry.pulse, whole.grid.sample_rate)


@lru_cache(maxsize=4)
def _ringing(pulse: ReceivedPulse, rate: float) -> tuple[int, int]:
    """Samples of the pulse after, and before, an echo's delay: to reckon its filter takes long, and every ping asks."""
    return max(0, int(np.ceil(pulse.stop * rate))), max(0, int(np.ceil(-pulse.start * rate)))


def _bins(buffer: LabelBuffer) -> dict[Key, Floats]:
    """Energy and places by key, those of smooth targets squared."""
    found = dict(buffer.bins)
    for key, flashes in buffer.flashes.items():
        found[key] = found[key] + flashes.bins if key in found else flashes.bins
    return found


@lru_cache(maxsize=4)
def _pulse_energy(pulse: ReceivedPulse, rate: float) -> Floats:
    """Energy of a pulse at the lags of the bins that one sample hears, from the first bin [1]."""
    lead, tail = _ringing(pulse, rate)
    energy = np.ascontiguousarray(np.abs(pulse.samples(np.arange(-tail, lead + 1) / rate))[::-1] ** 2)
    energy.flags.writeable = False  # shared by all pings
    return energy


def _convolved(bins: Floats, pulse: Floats, count: int) -> Floats:
    """Energies of bins as the pulse leaves them in the recording, (channels, bins, MOMENTS) to (channels, samples)."""
    out = np.empty((len(bins), count))
    for own, row in zip(bins, out, strict=True):
        smear(np.ascontiguousarray(own[:, 0]), pulse, row)
    return out


class _Curves:
    """Series of the curves of one ping: the same sum of curves is transformed once."""

    def __init__(self, buffer: LabelBuffer, whole: IncoherentAccumulator) -> None:
        self._kept, self._whole = buffer, whole
        self._known: dict[tuple[Key, ...], Floats] = {}

    def intensities(self, names: LabelNames, energy: dict[Key, Floats]) -> tuple[Floats, Floats]:
        """Expected intensity by owner, (channels, owners, samples), and by pair alone, (channels, pairs, samples)."""
        curves = self._kept.curves
        by_owner = [
            self._series(tuple(key for key in curves if key[0] == owner and not key[1].startswith(PAIR_ONLY)))
            for owner in names.objects
        ]
        by_pair = [
            self._series(tuple(key for key in curves if key[1] in (name, PAIR_ONLY + name))) for name in names.pairs
        ]  # fmt: skip
        for owner, whole in zip(names.objects, by_owner, strict=True):
            together = [key for key in energy if key[0] == owner and _only_together(curves, key)]
            if together:
                self._share_out(owner, whole, together, energy, names, by_pair)
        return np.stack(by_owner, axis=1), np.stack(by_pair, axis=1)

    def _share_out(
        self, owner: str, whole: Floats, together: list[Key], energy: dict[Key, Floats], names: LabelNames,
        by_pair: list[Floats],
    ) -> None:  # fmt: skip
        """Share an owner's intensity, without interference, among pairs that have no curves, by their energies."""
        common = self._kept.common.get(owner)
        if common is not None:
            alone = self._kept.curves[owner, ALL]
            whole = self._whole.time_series(IntensityBuffer(alone.cells - common.cells, alone.intensity))
        total = np.asarray(sum(energy[key] for key in together))
        part = np.divide(whole, total, out=np.zeros_like(whole), where=total > 0)
        for key in together:
            row = names.pairs.index(key[1])
            by_pair[row] = by_pair[row] + (whole if len(together) == 1 else part * energy[key])

    def _series(self, keys: tuple[Key, ...]) -> Floats:
        """Series of the sum of some curves."""
        if keys not in self._known:
            grid, parts = self._whole.grid, [self._kept.curves[key] for key in keys]
            parts = [one for one in parts if one.specular_sums or one.cells.any() or one.intensity.any()]
            if not parts:
                self._known[keys] = np.zeros((self._whole.ping_geometry.channel_count, grid.sample_count))
            elif len(parts) == 1:
                self._known[keys] = self._whole.time_series(parts[0])
            else:
                total = self._whole.empty()
                for one in parts:
                    total += one
                self._known[keys] = self._whole.time_series(total)
        return self._known[keys]


def _only_together(curves: LevelBuffers, key: Key) -> bool:
    """Return True for a pair whose energies have no curve but that of its owner."""
    owner, pair = key
    return pair != HIDDEN and (owner, pair) not in curves and (owner, PAIR_ONLY + pair) not in curves


def _targets(
    by_owner: Floats, echo: dict[Key, Floats], missing: Floats, names: LabelNames, noise: float
) -> tuple[Masks, Masks]:
    """Highlights and ghosts: samples of which targets make at least half, noise included; by which paths.

    A highlight is no fainter than the echo of the ground that is missing there: it would pass for a shadow.
    """
    silent = np.zeros(by_owner.shape[::2])
    target = np.array([name not in SURROUNDINGS for name in names.objects])
    mine = by_owner[:, target].sum(axis=1)
    most = (mine > 0) & (mine >= by_owner[:, ~target].sum(axis=1) + noise)
    parts = {True: silent, False: silent}
    for (who, pair), value in echo.items():
        if who not in SURROUNDINGS:
            parts["S" in pair] = parts["S" in pair] + value
    ghost = parts[True] > parts[False]
    return most & ~ghost & (mine >= missing), most & ghost


def _places(
    bins: dict[Key, Floats],
    energy: dict[Key, Floats],
    pulse: Floats,
    names: LabelNames,
    owner: Rows,
    shadowing_object: Rows,
) -> Floats:
    """North, east, depth, distance, grazing of each sample, (5, channels, samples); NaN where nothing is heard."""
    keys, loudest = list(energy), np.zeros(owner.shape)
    winner = np.full(owner.shape, -1, np.int16)
    for number, (who, pair) in enumerate(keys):
        row, value = names.objects.index(who), energy[keys[number]]
        mine = (shadowing_object == row) if pair == HIDDEN else (owner == row) & (shadowing_object == NO_ROW)
        wins = mine & (value > loudest)
        np.copyto(loudest, value, where=wins)
        winner[wins] = number
    place = np.full((MOMENTS - 1, *owner.shape), np.nan)
    for channel, own in enumerate(winner):
        for number in range(len(keys)):
            samples = np.flatnonzero(own == number)
            if not len(samples):
                continue
            found = np.empty((MOMENTS - 1, len(samples)))
            smear_places(bins[keys[number]][channel], pulse, samples, found)
            place[:, channel, samples] = found
    return place
