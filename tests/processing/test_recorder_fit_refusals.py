"""Recordings of which no recorder can be fitted are refused with their shape, and gaps do not move a fit."""

import numpy as np
import pytest

from insonify.processing import fit_recorder

SLANT = np.linspace(5, 30, 400)


def speckle(seed, pings=64, bins=400):
    """One look of unit mean intensity."""
    return abs(np.random.default_rng(seed).standard_normal((pings, bins, 2)).view(complex)[..., 0]) / np.sqrt(2)


@pytest.mark.parametrize(
    ("real", "slant", "words"),
    [
        (np.empty((0, 400)), SLANT, r"real has shape \(0, 400\) with 400 ranges. Give 16 pings or more"),
        (speckle(1, 1), SLANT, r"real has shape \(1, 400\)"),
        (speckle(1, 15), SLANT, "Give 16 pings or more"),
        (speckle(1)[0], SLANT, r"real has shape \(400,\)"),
        (speckle(1), SLANT[:-1], r"\(64, 400\) with 399 ranges"),
        (speckle(1), SLANT + 40, "0 bins lie at 45 to 30 m"),
        (speckle(1), SLANT + 24, "Give 24 or more"),
        (np.zeros((64, 400)), SLANT, "fewer than three ranges"),
        (np.full((64, 400), np.nan), SLANT, "real: all samples are missing"),
        (np.full((64, 400), 255.0), SLANT, "fewer than three ranges"),
    ],
    ids=["empty", "one ping", "few pings", "one row", "lengths", "apart", "little in common", "silent", "NaN", "full"],
)
def test_what_cannot_be_fitted_is_refused_with_its_numbers(real, slant, words):
    """Empty, short, apart, silent, missing and clipped recordings: an error of the value, no warning of numpy."""
    with np.errstate(all="raise"), pytest.raises(ValueError, match=words):
        fit_recorder(real, slant, speckle(2), SLANT, resamples=5)


@pytest.mark.parametrize("gaps", [0.0, 0.3])
@pytest.mark.parametrize("gain_db", [-40.0, 0.0, 26.0])
def test_a_plain_gain_is_found_with_gaps(gain_db, gaps):
    """Offset within 0.3 dB, no spreading, one look: 26 000 samples, a third of them missing at random."""
    real = speckle(3) * 10 ** (gain_db / 20)
    real[np.random.default_rng(4).random(real.shape) < gaps] = np.nan
    found = fit_recorder(real, SLANT, speckle(5), SLANT, resamples=20)
    assert np.mean(found.gain_db) == pytest.approx(gain_db, abs=0.3)
    assert found.spreading.value == pytest.approx(0.0, abs=1.0) and found.looks.value == pytest.approx(1, rel=0.06)
    assert found.full_scale.value == np.nanmax(real) and found.clipped.value == 0
