"""Levels against range and angle, and shares at full scale, are those planted, whatever gaps, steps and units."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.comparison.frame import common_frame
from insonify.comparison.full_scale import FullScale
from insonify.comparison.level_against_angle import BIN_DEG, LevelAgainstAngle
from insonify.comparison.level_against_range import LevelAgainstRange
from insonify.comparison.samples import Samples

ALTITUDE = 5.0
GAPS = pytest.mark.parametrize("gaps", [0.0, 0.3], ids=["whole", "gaps"])


def recorded(level_db, *, step=0.05, gaps=0.0, **more):
    """Forty pings of constant levels over range [dB], a share of them missing."""
    values = np.tile(10 ** (np.asarray(level_db)[None, None] / 20), (40, 1, 1)) + 0j
    if gaps:
        values[np.random.default_rng(9).random(values.shape) < gaps] = np.nan
    return Samples("planted", values, step * np.arange(1, values.shape[2] + 1), "uPa", pulse_length=1e-4, **more)


def estimates(kind, first, second):
    """Numbers of both recordings."""
    measure = kind(common_frame(first, second))
    return measure, [measure.estimate(measure.sums(side).sum(axis=0)) for side in measure.frame.sides]


@GAPS
@pytest.mark.parametrize("spreading", [0.0, 20.0, 40.0])
def test_a_law_of_range_is_found_in_each_bin(spreading, gaps):
    """Level of the mean intensity of each bin's own ranges: to 0.01 dB, and 0.2 dB where a third is missing."""
    slant = 0.05 * np.arange(1, 601)
    law = 10.0 - spreading * np.log10(slant + 5.0)  # no sample outweighs its bin
    measure, (level, _) = estimates(LevelAgainstRange, recorded(law, gaps=gaps), recorded(law))
    row = np.arange(600) * len(level) // 600
    due = [10 * np.log10(np.mean(10 ** (law[row == k] / 10))) for k in range(len(level))]
    np.testing.assert_allclose(level, due, atol=0.2 if gaps else 0.01)
    assert [one.unit for one in measure.quantities] == ["dB"] * len(level)


@pytest.mark.parametrize("gain_db", [-60.0, 7.0])
def test_a_gain_counts_in_equal_units_alone(gain_db):
    """In uPa a gain is a difference of all bins; between volts and uPa it is none."""
    law = -20 * np.log10(0.05 * np.arange(1, 601))
    one, factor = recorded(law), recorded(law + gain_db)
    _, (first, second) = estimates(LevelAgainstRange, one, factor)
    np.testing.assert_allclose(second - first, gain_db, atol=1e-6)
    _, (first, second) = estimates(LevelAgainstRange, one, replace(factor, unit="V"))
    np.testing.assert_allclose(second, first, atol=1e-6)


@GAPS
def test_a_law_of_the_angle_is_found_at_an_altitude(gaps):
    """Lambert's 20 log sin over a level bed: each bin of grazing angle within the law at its edges, 0.1 dB beyond."""
    slant = 0.05 * np.arange(1, 1201)
    sine = np.minimum(ALTITUDE / slant, 1.0)
    sonar = recorded(20 * np.log10(sine), gaps=gaps, altitude=np.full(40, ALTITUDE))
    _, (level, _) = estimates(LevelAgainstAngle, sonar, sonar)
    edges = np.radians(BIN_DEG * np.arange(len(level) + 1))
    known = np.isfinite(level)
    assert known.sum() >= 5
    with np.errstate(divide="ignore"):
        low, high = 20 * np.log10(np.sin(edges[:-1])), 20 * np.log10(np.sin(np.minimum(edges[1:], np.pi / 2)))
    assert (level[known] >= low[known] - 0.1).all() and (level[known] <= high[known] + 0.1).all()


def test_neither_angles_nor_an_altitude_are_named():
    """Recordings without either cannot be compared by angle."""
    frame = common_frame(recorded(np.zeros(200)), recorded(np.zeros(200)))
    assert "neither beam angles nor an altitude" in LevelAgainstAngle.unsuited(frame)


@GAPS
@pytest.mark.parametrize("share", [0.01, 0.1])
def test_the_share_at_full_scale_is_that_planted(share, gaps):
    """Noise clipped at a quantile: so many of a thousand known samples, within three binomial errors."""
    rng = np.random.default_rng(3)
    amplitude = np.sqrt(rng.standard_exponential((40, 1, 600)))
    values = np.minimum(amplitude, np.quantile(amplitude, 1 - share)) + 0j
    values[rng.random(values.shape) < gaps] = np.nan
    sonar = replace(recorded(np.zeros(600)), values=values)
    _, ((found,), _) = estimates(FullScale, sonar, sonar)
    assert found == pytest.approx(1000 * share, abs=3000 * np.sqrt(share / (24_000 * (1 - gaps))) + 0.1)
