"""Recorder of an instrument by its recording: looks by speckle, gain by the trend over range, full scale by histogram.

Levels of n-look speckle have a variance of psi'(n) (in nepers of intensity) whatever their mean; texture adds its own,
which a simulation of one look shares. Cells of some pings and bins give variances and means free of trend, and blocks
of pings their intervals.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from insonify.sonar.recorder import Recorder
from insonify.units import level_db

Floats = NDArray[np.float64]

BLOCK = 8
"""Pings in a cell; blocks of them are resampled."""
BINS = 8
"""Least number of recorded bins in a cell."""
MOST_WINDOWS = 64
"""Most cells along range."""
SPOILT = 0.02
"""Part of clipped or silent samples from which a range is left out."""
PILED_UP = 5.0
"""Number of samples at the largest value, re that expected by the decibel below it, from which it is full scale."""
_NEPER = 10 / np.log(10)  # dB of intensity


@dataclass(frozen=True, slots=True)
class Estimate:
    """Number with its interval of 95 %."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, eq=False)
class RecorderFit:
    """Recorder as estimated from a recording."""

    looks: Estimate
    """Equivalent number of looks [1]."""
    spreading: Estimate
    """X of the gain X log R + 2 alpha R + offset [dB for each tenfold range]."""
    offset_db: Estimate
    """Offset of that gain, from simulated uPa to recorded units [dB]."""
    full_scale: Estimate
    """Largest recorded number [recorded units]; without clipping the upper end of its interval is infinite."""
    clipped: Estimate
    """Part of the samples at full scale [1]; 0 where none is clipped."""
    slant_range: Floats
    """Middles of ranges [m], shape (ranges,)."""
    gain_db: Floats
    """Gain at those ranges, the offset included, whatever law it follows [dB], shape (ranges,)."""
    gain_error_db: Floats
    """Half width of the interval of the gain [dB], shape (ranges,)."""
    absorption_db_per_m: float
    """Absorption of the law [dB/m]."""

    def recorder(self, *, bits: int | None = None) -> Recorder:
        """Stages with the estimated values.

        Args:
            bits: Number of bits of the recorded numbers; None: they are not rounded.
        """
        law = {"tvg_db_per_decade": max(self.spreading.value, 0.0), "absorption_db_per_m": self.absorption_db_per_m}
        stages: list[dict[str, object]] = [{"kind": "gain", **law}]
        if round(self.looks.value) > 1:
            stages.append({"kind": "looks", "samples": round(self.looks.value)})
        stages.append({"kind": "clipping"} if bits is None else {"kind": "quantisation", "bits": bits})
        scale = float(level_db(self.full_scale.value**2)) - self.offset_db.value
        return Recorder.model_validate({"stages": stages, "full_scale_db": scale})


def fit_recorder(
    real: ArrayLike, real_range: ArrayLike, simulated: ArrayLike, simulated_range: ArrayLike, *,
    absorption_db_per_m: float = 0.0, resamples: int = 400, seed: int = 1,
) -> RecorderFit:  # fmt: skip
    """Estimate looks, gain and full scale of a recording with a simulation of the same scene, unrecorded.

    Args:
        real: Recorded amplitudes or counts, not levels, shape (pings, bins); NaN is left out.
        real_range: Slant range of each bin [m], shape (bins,).
        simulated: Pressure of one look, complex or rms [uPa], shape (pings, samples).
        simulated_range: Slant range of each sample [m], shape (samples,).
        absorption_db_per_m: One-way absorption that the gain makes up for [dB/m].
        resamples: Number of bootstrap samples of the intervals.
        seed: Seed of those samples.

    Returns:
        Estimates with intervals of 95 %, by resampling blocks of eight pings of both.

    Raises:
        ValueError: Fewer than 16 pings in one of them, or fewer than three ranges of eight bins in common.

    Source: log-cumulants, Nicolas (2002), Traitement du signal 19(3), 139; block bootstrap, Kuensch (1989), Ann.
    Statist. 17, 1217 (both not verified).

    Example:
        >>> from insonify.sonar import Recorder
        >>> random, slant_range = np.random.default_rng(1), np.linspace(5, 30, 1600)
        >>> speckle = random.normal(size=(2, 32, 1600)) + 1j * random.normal(size=(2, 32, 1600))  # two draws of one bed
        >>> sea, simulated = 1e7 * speckle * slant_range**-1.5  # levels fall by 30 log R
        >>> stages = [{"kind": "gain", "tvg_db_per_decade": 25}, {"kind": "looks", "samples": 4}]
        >>> counts, time = record_series(sea, slant_range / 750, Recorder(stages=stages))
        >>> fit = fit_recorder(counts, 750 * time, simulated, slant_range, resamples=20)
        >>> round(fit.looks.value), round(fit.spreading.value)
        (4, 25)
    """
    counts, pressure = np.abs(np.asarray(real, float)), np.abs(np.asarray(simulated))
    ranges = [np.asarray(one, float) for one in (real_range, simulated_range)]
    for name, values, slant in (("real", counts, ranges[0]), ("simulated", pressure, ranges[1])):
        if values.ndim != 2 or values.shape[1:] != slant.shape or len(values) < 2 * BLOCK:
            raise ValueError(
                f"{name} has shape {values.shape} with {slant.size} ranges. Give {2 * BLOCK} pings or more"
            )
    top, share = _full_scale(counts)
    edges = _edges(*ranges)
    spoilt = (counts <= 0) | ((counts >= top) & (share.value > 0))
    good = _kept_windows(spoilt, ranges[0], edges)
    cells = [_cells(np.where(spoilt, np.nan, counts), ranges[0], edges)[:, :, good],
             _cells(pressure.astype(float), ranges[1], edges)[:, :, good]]  # fmt: skip
    middle = np.asarray((edges[1:] + edges[:-1]) / 2)[good]
    random = np.random.default_rng(seed)
    draws = [_fit(cells[0].mean(axis=1), cells[1].mean(axis=1), middle, absorption_db_per_m)]
    for _ in range(resamples):
        drawn = [one[:, random.integers(0, one.shape[1], one.shape[1])].mean(axis=1) for one in cells]
        draws.append(_fit(drawn[0], drawn[1], middle, absorption_db_per_m))
    fitted, (low, high) = draws[0], np.quantile(draws[1:], [0.025, 0.975], axis=0)
    looks, spreading, offset = (Estimate(*map(float, row)) for row in zip(fitted[:3], low[:3], high[:3], strict=True))
    return RecorderFit(
        looks, spreading, offset, _scale_estimate(top, share), share, middle, fitted[3:], (high[3:] - low[3:]) / 2,
        absorption_db_per_m,
    )  # fmt: skip


def _full_scale(counts: Floats) -> tuple[float, Estimate]:
    """Largest number, and the part of the samples at it where they pile up there (interval: Wilson 1927)."""
    known = counts[np.isfinite(counts)]
    if not known.size:
        raise ValueError("real: all samples are missing. Give recorded amplitudes")
    top = float(known.max())
    at_top, below = int((known >= top).sum()), int(((known < top) & (known >= top * 10 ** (-1 / 20))).sum())
    # whole numbers: the decibel below full scale has so many values; others hardly ever agree
    values = max(top * (1 - 10 ** (-1 / 20)), 1.0) if np.all(known == np.rint(known)) else np.inf
    expected = below / values
    if at_top < 2 or at_top <= PILED_UP * max(expected, 1.0):
        return top, Estimate(0.0, 0.0, 3 / known.size)
    share, n, z = at_top / known.size, known.size, 1.96
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    return top, Estimate(share, float(middle - half), float(middle + half))


def _scale_estimate(top: float, share: Estimate) -> Estimate:
    """Full scale: known where samples pile up at it, else at least the largest number."""
    return Estimate(top, top, top if share.value > 0 else np.inf)


def _edges(real: Floats, simulated: Floats) -> Floats:
    """Edges of the ranges in which both are compared [m]."""
    first, last = max(real[0], simulated[0]), min(real[-1], simulated[-1])
    bins = int(((real >= first) & (real <= last)).sum())
    windows = min(bins // BINS, MOST_WINDOWS)
    if windows < 3:
        raise ValueError(f"{bins} bins lie at {first:g} to {last:g} m, the ranges of both. Give {3 * BINS} or more")
    return np.linspace(first, last, windows + 1)


def _kept_windows(spoilt: NDArray[np.bool_], slant: Floats, edges: Floats) -> NDArray[np.bool_]:
    """Mask of the windows with few clipped or silent samples."""
    row = np.digitize(slant, edges) - 1
    good = np.array([spoilt[:, row == k].mean() <= SPOILT for k in range(edges.size - 1)])
    if good.sum() < 3:
        raise ValueError("fewer than three ranges have 98 % of samples that are neither clipped nor silent")
    return good


def _cells(amplitude: Floats, slant: Floats, edges: Floats) -> Floats:
    """Mean and variance of the log intensity in each cell, less its trend over range, shape (2, blocks, windows)."""
    blocks = len(amplitude) // BLOCK
    with np.errstate(divide="ignore"):
        log = 2 * np.log(amplitude[: blocks * BLOCK]).reshape(blocks, -1, slant.size)
    log[~np.isfinite(log)] = np.nan
    row = np.digitize(slant, edges) - 1
    cells = np.empty((2, blocks, edges.size - 1))
    for window in range(edges.size - 1):
        cell = log[:, :, row == window]
        x = np.arange(cell.shape[2]) - (cell.shape[2] - 1) / 2
        known = np.isfinite(cell)
        mean = np.nanmean(cell, axis=(1, 2))
        slope = np.nansum((cell - mean[:, None, None]) * x, axis=(1, 2)) / (known * x**2).sum(axis=(1, 2))
        rest = np.nansum((cell - mean[:, None, None] - slope[:, None, None] * x) ** 2, axis=(1, 2))
        cells[:, :, window] = mean, rest / (known.sum(axis=(1, 2)) - 2)
    return cells


def _fit(real: Floats, simulated: Floats, middle: Floats, absorption_db_per_m: float) -> Floats:
    """Looks, X, offset [dB] and gain at each range [dB], of means and variances of the log intensity, (2, windows)."""
    from scipy.special import psi

    number, variance = _log_variances()
    texture = max(float(simulated[1].mean()) - np.pi**2 / 6, 0.0)  # psi'(1): one look
    looks = float(np.interp(texture - real[1].mean(), -variance, number))
    bias = (psi(looks) - np.log(looks)) - psi(1)  # of the mean of a logarithm
    gain = _NEPER * (real[0] - simulated[0] - bias)
    design = np.stack([np.log10(np.maximum(middle, 1.0)), np.ones(middle.size)], axis=1)
    spreading, offset = np.linalg.lstsq(design, gain - 2 * absorption_db_per_m * middle)[0]
    return np.concatenate([[looks, spreading, offset], gain])


@lru_cache(maxsize=1)
def _log_variances() -> tuple[Floats, Floats]:
    """Numbers of looks, and the variance of the log intensity with them."""
    from scipy.special import polygamma

    number = np.geomspace(0.1, 1000, 4001)
    return number, np.asarray(polygamma(1, number), float)
