"""Texture of images: spectrum over range, local binary patterns, and distances of distributions.

Local binary patterns: Ojala, Pietikaeinen & Maeenpaeae (2002), IEEE Trans. PAMI 24(7), 971, rotation invariant and
uniform, eight neighbours. Jensen-Shannon distance: Lin (1991), IEEE Trans. Inf. Theory 37(1), 145, to base 2. Earth
mover's distance: Rubner et al. (2000), Int. J. Comput. Vision 40(2), 99; in one dimension the area between cumulative
distributions. All: not verified.
"""

import numpy as np
from scipy.special import rel_entr

from insonify.comparison.amplitude_distribution import relative_intensity
from insonify.comparison.frame import Side
from insonify.comparison.measure import Curve, Measure, Quantity, decibels, ratio
from insonify.comparison.samples import Floats

SEGMENT = 32
"""Samples of a segment of the spectrum over range."""
SPECTRUM = SEGMENT // 2
PATTERNS = 10
LEVELS = np.arange(-30.0, 12.1, 2.0)
"""Edges of the bins of level re the local mean [dB]."""
_RING = ((-1, -1), (-1, 0), (-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1))


class ImageTexture(Measure):
    """Spectrum of the level over range, and distances of the distributions of levels and of local patterns."""

    name = "texture"
    least_samples = 2 * SEGMENT

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Spectrum of the level in bands of wavenumber."""
        wavenumber = np.arange(1, SPECTRUM + 1) / (SEGMENT * self.frame.step)
        return tuple(Quantity(f"spectrum at {k:.3g} 1/m", "dB") for k in wavenumber)

    @property
    def distances(self) -> tuple[Quantity, ...]:
        """Distances between distributions."""
        return (
            Quantity("Jensen-Shannon distance of levels"), Quantity("earth mover's distance of levels", "dB"),
            Quantity("Jensen-Shannon distance of local patterns"),
        )  # fmt: skip

    def sums(self, side: Side) -> Floats:
        """Periodograms of segments, histogram of levels, histogram of local patterns."""
        relative = relative_intensity(side, self.frame.cell)
        positive = relative > 0
        level = decibels(relative)
        bins = np.clip(np.digitize(np.nan_to_num(level), LEVELS), 0, LEVELS.size)
        histogram = side.sums(np.ones(level.shape), np.where(positive, bins, -1), LEVELS.size + 1)
        return np.hstack([self._spectra(side, level), histogram, _patterns(side, level, self.frame.cell)])

    def _spectra(self, side: Side, level: Floats) -> Floats:
        """Sums of the periodograms of segments, and their number."""
        limited = np.clip(level, LEVELS[0], LEVELS[-1])
        window = np.hanning(SEGMENT)
        starts = range(0, level.shape[2] - SEGMENT + 1, SEGMENT)
        total = np.zeros((side.units, SPECTRUM + 1))
        index = np.broadcast_to(side.unit, level.shape)
        for start in starts:
            segment = limited[..., start : start + SEGMENT]
            known = np.isfinite(segment).all(axis=-1)
            rows = segment[known]
            power = np.abs(np.fft.rfft((rows - rows.mean(axis=-1, keepdims=True)) * window, axis=-1)[:, 1:]) ** 2
            unit = index[..., start + SEGMENT // 2][known]
            np.add.at(total, unit, np.hstack([power, np.ones((len(power), 1))]))
        return total

    def estimate(self, sums: Floats) -> Floats:
        """Mean periodogram [dB]."""
        return decibels(ratio(sums[..., :SPECTRUM], sums[..., SPECTRUM : SPECTRUM + 1]))

    def distance(self, first: Floats, second: Floats) -> Floats:
        """Distances of the distributions of levels and of local patterns."""
        start, middle = SPECTRUM + 1, SPECTRUM + 2 + LEVELS.size
        levels = [ratio(s[..., start:middle], s[..., start:middle].sum(-1, keepdims=True)) for s in (first, second)]
        patterns = [ratio(s[..., middle:], s[..., middle:].sum(-1, keepdims=True)) for s in (first, second)]
        moved = 2.0 * np.abs(np.cumsum(levels[0] - levels[1], axis=-1)).sum(axis=-1)
        return np.stack([jensen_shannon(*levels), moved, jensen_shannon(*patterns)], axis=-1)

    def curves(self, first: Floats, second: Floats) -> tuple[Curve, ...]:
        """Spectrum over wavenumber."""
        wavenumber = np.arange(1, SPECTRUM + 1) / (SEGMENT * self.frame.step)
        return (Curve(wavenumber, self.estimate(first), self.estimate(second), "wavenumber [1/m]", "spectrum [dB]"),)


def jensen_shannon(first: Floats, second: Floats) -> Floats:
    """Jensen-Shannon distance of distributions, 0 of equal and 1 of disjoint ones.

    Args:
        first: Shares, shape (..., n), of sum 1.
        second: Shares of the same shape.
    """
    middle = (first + second) / 2
    divergence = (rel_entr(first, middle) + rel_entr(second, middle)).sum(axis=-1) / np.log(4)
    return np.asarray(np.sqrt(np.maximum(divergence, 0)))


def _patterns(side: Side, level: Floats, cell: int) -> Floats:
    """Histogram of local binary patterns by unit: neighbours one ping and one resolution cell away."""
    pings, _, samples = level.shape
    if pings < 3 or samples < 2 * cell + 1:
        return np.zeros((side.units, PATTERNS))
    middle = level[1:-1, :, cell:-cell]
    ring = [level[1 + i : pings - 1 + i, :, cell + j * cell : samples - cell + j * cell] for i, j in _RING]
    bits = np.stack([neighbour >= middle for neighbour in ring])
    changes = np.sum(bits != np.roll(bits, 1, axis=0), axis=0)
    ones = bits.sum(axis=0)
    classes = np.where(changes <= 2, ones, PATTERNS - 1)
    known = np.isfinite(middle) & np.all([np.isfinite(neighbour) for neighbour in ring], axis=0)
    bins = np.full(level.shape, -1, np.int64)
    # rings of every third ping share no ping, so that blocks stay independent
    chosen = (np.arange(pings - 2) % 3 == 0)[:, None, None]
    bins[1:-1, :, cell:-cell] = np.where(known & chosen, classes, -1)
    return side.sums(np.ones(level.shape), bins, PATTERNS)
