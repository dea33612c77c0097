"""Chance: permutation of units between two recordings, bootstrap within each, and Holm's rule over measures.

Two draws of one scene are exchangeable, so the difference of any statistic has the distribution of its differences
under random exchange of units: Pitman (1937), Fisher's permutation test. Intervals: Rubin (1981), Ann. Stat. 9(1), 130,
the Bayesian bootstrap, which weights units by exponential random numbers. Several measures: Holm (1979), Scand. J.
Stat. 6(2), 65. All: not verified.
"""

import numpy as np

from insonify.comparison.frame import Frame
from insonify.comparison.samples import Floats

PERMUTATIONS = 999
RESAMPLES = 400
CONFIDENCE = 0.95
"""Probability of the intervals; a difference counts where it is less likely than the rest."""
_ROUNDING = 1e-7
"""Standardised differences that are closer count as equal: sums of the same units differ by their order."""


def exchanges(frame: Frame, seed: int = 0) -> Floats:
    """Random exchanges of units: 1 where a unit counts with the first recording, else 0.

    Args:
        frame: The two recordings.
        seed: Seed of the random numbers.

    Returns:
        Shape (exchange, stratum, units of both in the stratum), those of the first recording in front.
    """
    one, two = frame.blocks
    keys = np.random.default_rng([seed, 1]).random((PERMUTATIONS, frame.strata, one + two), np.float32)
    order = np.argsort(np.argsort(keys, axis=2), axis=2)
    return np.asarray(order < one, float)


def by_stratum(frame: Frame, first: Floats, second: Floats) -> Floats:
    """Sums of both recordings, shape (stratum, units of both in the stratum, feature).

    Args:
        frame: The two recordings.
        first: Sums of the units of the first, shape (units, feature).
        second: Sums of the units of the second.
    """
    parts = [sums.reshape(frame.strata, blocks, -1) for sums, blocks in zip((first, second), frame.blocks, strict=True)]
    return np.concatenate(parts, axis=1)


def bootstrap_weights(units: int, seed: int = 0) -> Floats:
    """Random weights of units with mean 1, shape (resample, unit).

    Args:
        units: Number of units.
        seed: Seed of the random numbers.
    """
    weights = np.random.default_rng([seed, 2, units]).standard_exponential((RESAMPLES, units))
    return np.asarray(weights / weights.mean(axis=1, keepdims=True))


def p_values(observed: Floats, exchanged: Floats, distances: int = 0) -> tuple[Floats, float]:
    """Probabilities of differences at least as large under random exchange.

    Args:
        observed: Differences, shape (n,); NaN: not known.
        exchanged: Differences under exchange, shape (exchange, n).
        distances: Number of distances among them, at the end: only large ones count.

    Returns:
        Probability of each difference, adjusted for their number by the largest one (Westfall & Young 1993, maxT), and
        the probability of the largest one; NaN where so few units are exchanged that no difference could count.
    """
    known = np.isfinite(observed) & (np.isfinite(exchanged).mean(axis=0) > 0.9)
    adjusted = np.full(observed.shape, np.nan)
    if not known.any():
        return adjusted, np.nan
    rows = np.where(np.isfinite(exchanged[:, known]), exchanged[:, known], np.nan)
    middle, spread = np.nanmean(rows, axis=0), np.nanstd(rows, axis=0)
    spread = np.where(spread > 1e-12 * (1 + np.abs(middle)), spread, np.inf)
    sided = (np.arange(observed.size) >= observed.size - distances)[known]
    score, others = ((values - middle) / spread for values in (observed[known], rows))
    score, others = (np.where(sided, values, np.abs(values)) for values in (score, others))
    largest = np.max(np.nan_to_num(others), axis=1) + _ROUNDING
    if largest.max() > 2 * _ROUNDING and np.mean(largest >= largest.max() - _ROUNDING) > 1 - CONFIDENCE:
        return adjusted, np.nan
    adjusted[known] = (1 + (largest[:, None] >= score).sum(axis=0)) / (1 + len(rows))
    return adjusted, float(adjusted[known].min())


def interval(resampled: Floats) -> Floats:
    """Percentile interval of resampled values, shape (2, n); NaN where nothing varies.

    Args:
        resampled: Values, shape (resample, n).
    """
    edge = (1 - CONFIDENCE) / 2
    limits = np.full((2, resampled.shape[1]), np.nan)
    known = np.isfinite(resampled).mean(axis=0) > 0.9
    if known.any():
        limits[:, known] = np.nanquantile(resampled[:, known], (edge, 1 - edge), axis=0)
    return limits


def holm(probabilities: list[float]) -> list[float]:
    """Adjusted probabilities of several tests, which control the chance of any false one: Holm (1979).

    Args:
        probabilities: One of each test; NaN: not tested, and not counted.
    """
    known = [row for row in np.argsort(probabilities) if np.isfinite(probabilities[row])]
    adjusted: list[float] = [float("nan")] * len(probabilities)
    largest = 0.0
    for rank, row in enumerate(known):
        largest = max(largest, min((len(known) - rank) * probabilities[row], 1.0))
        adjusted[row] = largest
    return adjusted
