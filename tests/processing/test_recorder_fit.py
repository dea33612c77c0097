"""Claims about estimated recorders: planted looks, gains and full scales are found, within the intervals stated."""

import numpy as np
import pytest

from insonify.processing import fit_recorder, record_series
from insonify.sonar.recorder import Recorder

PINGS, SAMPLES, FINE = 96, 400, 4
SLANT = np.linspace(5, 30, SAMPLES * FINE)
"""Slant range of the simulated samples [m]: four for each recorded bin."""
TIME = SLANT * 2 / 1500


def sea(seed, texture=0.0):
    """Pressure of one look that falls by 30 log R and 0.05 dB/m each way, with lognormal texture [uPa]."""
    random = np.random.default_rng(seed)
    speckle = random.normal(size=(2, PINGS, SLANT.size))
    patches = np.repeat(np.exp(texture * random.normal(size=(PINGS, SAMPLES))), FINE, axis=1)
    level = 140 - 30 * np.log10(SLANT) - 0.1 * SLANT
    return (speckle[0] + 1j * speckle[1]) * patches * 10 ** (level / 20)


def chain(looks, full_scale_db, spreading=25.0):
    """A recorder of 15 bits: gain, means of samples, decimation to the bins, counts."""
    stages = [
        {"kind": "gain", "tvg_db_per_decade": spreading, "absorption_db_per_m": 0.05},
        {"kind": "looks", "samples": looks, "step": FINE}, {"kind": "quantisation", "bits": 15},
    ]  # fmt: skip
    return Recorder(stages=stages, full_scale_db=full_scale_db)


def fitted(seed, looks, full_scale_db, texture=0.0, **more):
    """Estimates of one planted recorder, and its bins' counts."""
    recorder = chain(looks, full_scale_db, **more)
    counts, time = record_series(sea(seed, texture), TIME, recorder)
    other = sea(seed + 1000, texture)
    return fit_recorder(counts, time * 750, other, SLANT, absorption_db_per_m=0.05, resamples=200), counts


@pytest.mark.parametrize(("looks", "texture"), [(1, 0.0), (2, 0.0), (4, 0.0), (4, 0.25), (1, 0.3)])
def test_planted_looks_and_gains_are_found(looks, texture):
    """Looks within 6 %, X within 0.6 dB, offset within 0.7 dB, with texture that the simulation has too."""
    found, _ = fitted(3, looks, 160.0, texture)
    assert found.looks.value == pytest.approx(looks, rel=0.06)
    assert found.spreading.value == pytest.approx(25, abs=0.6)
    offset = 20 * np.log10(2**15 - 1) - 160
    assert found.offset_db.value == pytest.approx(offset, abs=0.7)
    law = 25 * np.log10(found.slant_range) + 0.1 * found.slant_range + offset
    assert np.abs(found.gain_db - law).max() < 1.0 and np.mean(np.abs(found.gain_db - law) < found.gain_error_db) > 0.8
    assert found.looks.low < found.looks.value < found.looks.high < 1.15 * looks


def test_intervals_hold_the_planted_values_as_often_as_stated():
    """20 draws: each interval of 95 % holds its value in 16 or more (three standard errors below 19)."""
    offset, held = 20 * np.log10(2**15 - 1) - 160, np.zeros(3, int)
    for seed in range(20):
        found, _ = fitted(seed, 4, 160.0)
        for row, (estimate, true) in enumerate(((found.looks, 4), (found.spreading, 25), (found.offset_db, offset))):
            held[row] += estimate.low <= true <= estimate.high
    assert (held >= 16).all(), held


@pytest.mark.parametrize("full_scale_db", [141.5, 144.0, 160.0])
def test_full_scale_is_where_samples_pile_up(full_scale_db):
    """Clipped: the full scale of 15 bits, and the part that is clipped; not clipped: at least the largest number."""
    found, counts = fitted(5, 2, full_scale_db)
    clipped = np.mean(counts == 2**15 - 1)
    if full_scale_db < 150:
        assert found.full_scale.value == found.full_scale.high == 2**15 - 1
        assert found.clipped.low < clipped < found.clipped.high and found.clipped.value == clipped > 0
    else:
        assert found.full_scale.high == np.inf and found.clipped.value == 0 and found.full_scale.value < 2**15 - 1


def test_the_fitted_recorder_records_like_the_planted_one():
    """Counts of a new draw: quantiles within 5 %, clipped part within a factor of 1.3."""
    found, counts = fitted(7, 4, 140.0)
    recorder = found.recorder(bits=15)
    assert recorder.full_scale_db == pytest.approx(140, abs=0.7)
    again, _ = record_series(sea(77), TIME, recorder)
    for part in (0.1, 0.5, 0.9):
        assert np.quantile(again, part) == pytest.approx(np.quantile(counts, part), rel=0.05)
    top = 2**15 - 1
    assert np.mean(again == top) == pytest.approx(np.mean(counts == top), rel=0.3)


def test_too_little_to_fit_is_refused():
    """Few pings, few bins in common, nothing but silence: the message gives the number."""
    speckle = np.abs(sea(1))
    with pytest.raises(ValueError, match="Give 16 pings"):
        fit_recorder(speckle[:8], SLANT, speckle, SLANT)
    with pytest.raises(ValueError, match="the ranges of both"):
        fit_recorder(speckle, SLANT, speckle, SLANT + 24.9)
    with pytest.raises(ValueError, match="neither clipped nor silent"):
        fit_recorder(speckle * 0, SLANT, speckle, SLANT)
