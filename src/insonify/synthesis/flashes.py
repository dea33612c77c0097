"""Where the flashes of a smooth target come from: facets within one bin of delay, added in phase before they count."""

import numpy as np
from numpy.typing import NDArray

from insonify.records.pairs import Pairs
from insonify.sonar.stance import Stance
from insonify.synthesis.weights import leg_weights
from insonify.units import amplitude_ratio

Floats = NDArray[np.float64]


def add_flashes(bins: Floats, start: float, rate: float, pairs: Pairs, stance: Stance) -> None:
    """Add energy, and energy times place, of facets that interfere to the bins of their delays.

    Facets cancel one another but for the flash: the energy of a bin is that of their sum, its place the mean of theirs
    weighted by what each sends back. Bins do not interfere with one another.

    Args:
        bins: Added to in place, shape (channels, bins, MOMENTS), columns as in `insonify.synthesis._label_kernel`.
        start: Delay of the first bin [s].
        rate: Bins per second [Hz].
        pairs: The facets of one target, and their pairs of legs.
        stance: The sonar at that ping.
    """
    i, j = pairs.pair.T
    count = bins.shape[1]
    bin_of = np.rint((pairs.out.delay[i] + pairs.back.delay[j] - start) * rate)
    level = float(amplitude_ratio(stance.source_level_db))
    sent = leg_weights(pairs.out, stance.transmit_beams, stance.frequency, level)
    heard = leg_weights(pairs.back, stance.receive_beams, stance.frequency)
    place = pairs.scatterers.position
    distance = np.linalg.norm(place - stance.receive_place, axis=1)
    grazing = (np.abs(pairs.out.grazing[i]) + np.abs(pairs.back.grazing[j])) / 2
    columns = [*np.broadcast_to(np.column_stack([place, distance]).T[:, None], (4, *bin_of.shape)), grazing]
    for channel, mine in enumerate(bins):
        weight = sent[channel % len(sent)][i] * heard[channel % len(heard)][j] * pairs.strength
        rows = (weight != 0) & (bin_of >= 0) & (bin_of < count)
        which, told = bin_of[rows].astype(np.int64), weight[rows]
        real, imaginary = (np.bincount(which, part, count) for part in (told.real, told.imag))
        energy, apart = real**2 + imaginary**2, np.bincount(which, np.abs(told) ** 2, count)
        mine[:, 0] += energy
        for moment, column in zip(mine[:, 1:].T, columns, strict=True):
            whole = np.bincount(which, np.abs(told) ** 2 * column[rows], count)
            moment += energy * np.divide(whole, apart, out=np.zeros(count), where=apart > 0)
