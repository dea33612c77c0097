"""Claims about gains: laws are what they state, and what is empirical from a recording evens it out."""

import numpy as np
import pytest

from insonify.plotting.sidescan import NAMES
from insonify.processing import along_track_gain_db, empirical_gain_db, lambert_gain_db, sidescan, tvg_db
from insonify.simulator import simulate
from oracles.scenes import nominal

SLANT = np.arange(1, 2001) * 0.1


def test_tvg_is_the_law_it_states():
    """Ten times the range is 30 dB more, and twice the absorption over the way."""
    gain = tvg_db(np.array([10.0, 100.0]), 30, absorption_db_per_m=0.035)
    assert gain[1] - gain[0] == pytest.approx(30 + 2 * 0.035 * 90)
    assert np.ptp(tvg_db(np.array([0.0, 0.5, 1.0]), 40)) == 0  # nothing is amplified without end


def test_a_level_lambert_bed_is_flat_under_its_gain():
    """Expected intensity of a flat bed, 20 to 150 m: within 0.5 dB of its mean on both sides."""
    scenario = nominal(
        field="incoherent", sonar={"sides": ["port", "starboard"]}, track={"window": (0.0, 0.21)},
        paths={"max_reflections": 0, "contributions": ["seabed"]},
    )  # fmt: skip
    water, recording = float(scenario.water.absorption(100e3)), simulate(scenario)
    image = sidescan(recording, gain="lambert", absorption_db_per_m=water, altitude=9.0)
    level, across = image.level_db.values[0], image.across.values
    for side in (-1, 1):
        seen = level[(across * side > 20) & (across * side < 150)]
        assert np.abs(seen - seen.mean()).max() < 0.5
    # a colour bar states a reference only for values about 0 dB on this bed
    for gain, name in NAMES.items():
        level = sidescan(recording, gain=gain, absorption_db_per_m=water, altitude=9.0).level_db.values[0]
        median = np.median(level[(np.abs(across) > 20) & (np.abs(across) < 150)])
        assert name.startswith("level re ") == (abs(median) < 3)


def test_an_empirical_gain_makes_the_median_flat():
    """Speckle over any smooth curve: the median of every range comes within 1 dB of 0 (N = 200 pings)."""
    rng = np.random.default_rng(2)
    curve = -50 * np.log10(SLANT) + 5 * np.sin(SLANT / 20)
    level = curve + 10 * np.log10(rng.exponential(size=(200, len(SLANT))))
    flat = level + empirical_gain_db(level, SLANT)
    assert np.abs(np.median(flat, axis=0)).max() < 1.5
    assert abs(np.median(flat)) < 0.3


def test_an_empirical_gain_leaves_silence_silent_and_passes_over_what_is_not_there():
    """A water column 120 dB down is not lifted to the bed; missing pings and silent samples do not spread."""
    rng = np.random.default_rng(3)
    level = 10 * np.log10(rng.exponential(size=(50, len(SLANT)))) - 40 * np.log10(SLANT)
    level[:, :90] -= 120
    level[7] = np.nan
    level[:, 1500] = -np.inf
    gain = empirical_gain_db(level, SLANT)
    assert np.isfinite(gain).all()
    assert np.nanmedian((level + gain)[:, :80]) < -80
    assert empirical_gain_db(np.full((3, len(SLANT)), -np.inf), SLANT).shape == SLANT.shape


def test_pings_that_are_weak_as_a_whole_are_evened_out():
    """A ping 6 dB down in an even row is lifted by nearly 6 dB, its neighbours hardly move."""
    level = np.random.default_rng(5).normal(0, 0.1, (60, 500))
    level[30] -= 6
    gain = along_track_gain_db(level)
    assert gain[30] == pytest.approx(6, abs=0.4) and np.abs(np.delete(gain, 30)).max() < 0.4


def test_the_lambert_gain_is_a_closed_form():
    """At 100 m from 10 m above: 30 log R + 20 log R/h + 10 log cos of the grazing angle."""
    found = lambert_gain_db(np.array([100.0]), np.array(10.0))
    assert found[0] == pytest.approx(60 + 20 + 10 * np.log10(np.sqrt(1 - 0.01)))
