"""Measures find what was planted: correlations, percentiles, coherences, widths, spectra and patterns, with gaps."""

from math import comb

import numpy as np
import pytest
from scipy.special import hyp2f1
from scipy.stats import gamma

from insonify.comparison.contrast import PERCENTILES, Contrast
from insonify.comparison.frame import common_frame
from insonify.comparison.noise_floor import LAGS, NoiseFloor
from insonify.comparison.point_spread import PointSpread
from insonify.comparison.registry import measures
from insonify.comparison.samples import Samples
from insonify.comparison.sector_coherence import SectorCoherence
from insonify.comparison.texture import LEVELS, PATTERNS, SEGMENT, ImageTexture, jensen_shannon
from oracles.few_of import few_of

STEP = 0.05
GAPS = pytest.mark.parametrize("gaps", [0.0, 0.3], ids=["whole", "gaps"])


def speckle(seed, *shape):
    """Circular Gaussian samples of unit mean intensity."""
    return np.random.default_rng(seed).standard_normal((*shape, 2)).view(complex)[..., 0] / np.sqrt(2)


def samples(values, *, cell=1, step=STEP, gaps=0.0, **more):
    """A recording of pings, parts and ranges, with a share of its samples missing."""
    if gaps:
        values = np.where(np.random.default_rng(9).random(values.shape) < gaps, np.nan, values)
    return Samples("planted", values, step * np.arange(1, values.shape[2] + 1), "uPa",
                   pulse_length=2 * step * cell / 1500, **more)  # fmt: skip


def measured(kind, first, second=None):
    """Measure of one or two recordings, and the sums of both over all units."""
    frame = common_frame(first, second or first)
    measure = kind(frame)
    assert not kind.unsuited(frame)
    return measure, *(measure.sums(side).sum(axis=0) for side in frame.sides)


@GAPS
@few_of((0, 2), "width", [1, 2, 4])
def test_noise_of_a_moving_mean_has_the_correlation_of_a_triangle(width, gaps):
    """1 - lag / width of complex noise; of its amplitudes, pi/4 (2F1(-1/2, -1/2; 1; rho^2) - 1) / (1 - pi/4).

    Rice (1945), section 3.7 (not verified). 22 000 samples, the last ones quietest by 40 dB: 0.03 is three errors.
    """
    white = speckle(1, 400, 1, 895 + width)
    noise = sum(white[..., k : k + 895] for k in range(width)) / np.sqrt(width)
    noise[..., :-60] *= 100
    rho = np.maximum(1 - np.arange(1, LAGS + 1) / width, 0)
    for values, due in ((noise, rho), (abs(noise), np.pi / 4 * (hyp2f1(-0.5, -0.5, 1, rho**2) - 1) / (1 - np.pi / 4))):
        measure, sums, _ = measured(NoiseFloor, samples(values, gaps=gaps))
        level, index, *correlation = measure.estimate(sums)
        np.testing.assert_allclose(correlation, due, atol=0.03)
        assert index == pytest.approx(1.0, abs=0.06)
        assert level == pytest.approx(0.0, abs=0.15)


@GAPS
@pytest.mark.parametrize("scale", [1.0, 300.0])
def test_levels_spread_evenly_have_evenly_spread_percentiles(scale, gaps):
    """Pings of constant levels from -20 to 20 dB: 0.4 dB for each percent from the median, within a bin of 0.5 dB."""
    level = np.random.default_rng(2).permutation(np.linspace(-20, 20, 401))
    values = scale * np.broadcast_to(10 ** (level[:, None, None] / 20), (401, 1, 90))
    measure, sums, _ = measured(Contrast, samples(values + 0j, cell=3, gaps=gaps))
    np.testing.assert_allclose(measure.estimate(sums), 0.4 * (np.array(PERCENTILES) - 50), atol=0.3)


@pytest.mark.parametrize("share", [0.02, 0.1])
def test_a_share_of_highlights_moves_the_percentiles_beyond_it_alone(share):
    """Pings 12 dB up: percentiles above 1 - share have those 12 dB, those below are at the median, within a bin."""
    level = np.where(np.arange(500) % round(1 / share) == 0, 12.0, 0.0)
    measure, sums, _ = measured(Contrast, samples(np.tile(10 ** (level[:, None, None] / 20), 90) + 0j, cell=3))
    due = np.where(np.array(PERCENTILES) > 100 * (1 - share), 12.0, 0.0)
    np.testing.assert_allclose(measure.estimate(sums), due, atol=0.5)


@GAPS
@pytest.mark.parametrize("parts", [2, 4])
def test_a_coherence_that_falls_with_range_is_found_in_each_bin(parts, gaps):
    """sqrt(g g') of parts with common shares of 0.95 to 0.1 of their power, whatever their phases and gains.

    200 pings of 60 samples and the parts' pairs in each bin: 0.03 is three errors of a coherence of 0.1. Samples that
    one part lacks take no part in any of its pairs.
    """
    share = np.linspace(0.95, 0.1, 600)
    common, own = speckle(3, 200, 1, 600), speckle(4, 200, parts, 600)
    gain = np.linspace(1, 1.5, parts)[:, None] * np.exp(0.7j * np.arange(parts))[:, None]
    values = np.where(parts == 2, gain, gain / abs(gain)) * (np.sqrt(share) * common + np.sqrt(1 - share) * own)
    measure, sums, _ = measured(SectorCoherence, samples(values, parts=True, gaps=gaps))
    np.testing.assert_allclose(measure.estimate(sums), share.reshape(10, 60).mean(axis=1), atol=0.03)


def test_coherence_needs_complex_parts():
    """One part, amplitudes, and beams are named as unsuited."""
    for values, more in ((speckle(5, 4, 1, 90), {"parts": True}), (abs(speckle(5, 4, 2, 90)), {"parts": True}),
                         (speckle(5, 4, 2, 90), {})):  # fmt: skip
        one = samples(values, **more)
        assert "planted has no complex samples" in SectorCoherence.unsuited(common_frame(one, one))


def test_measures_over_range_need_samples_of_range():
    """With 40 samples only those measures compare that need fewer; the others state the reason."""
    one = samples(speckle(6, 4, 1, 40))
    frame = common_frame(one, one)
    reasons = {kind.name: kind.unsuited(frame) for kind in measures()}
    refused = {name for name, reason in reasons.items() if reason == "too few samples of range"}
    assert refused == {
        "echo trains",
        "autocorrelation",
        "point spread",
        "texture",
        "highlights and shadows",
        "noise floor",
    }
    assert reasons["amplitude distribution"] == "" == reasons["level against range"]


@pytest.mark.parametrize("step", [0.05, 0.2])
@pytest.mark.parametrize("widths", [(3.0, 2.5, 4.0), (2.2, 3.0, 6.0)], ids=str)
def test_echoes_have_the_half_power_widths_that_were_planted(widths, step):
    """Gaussian intensities on a weak ground, 11 pings, 10 beams and 31 samples apart: to 1 % in each direction.

    The half-power points are those of straight lines between the samples of the Gaussian: 0.1 above a width of 2.5.
    """
    shape = (66, 20, 310)
    profile = []
    for width, size, apart in zip(widths, (shape[0], shape[1], shape[2]), (11, 10, 31), strict=True):
        off = (np.arange(size) + apart // 2 + 1) % apart - apart // 2
        profile.append(2.0 ** (-((2 * off / width) ** 2)))
    intensity = 1e4 * np.einsum("i,j,k->ijk", *profile) + 1e-3
    planted = samples(np.sqrt(intensity) + 0j, cell=4, step=step, angle=np.radians(np.linspace(-60, 60, 20)))
    measure, sums, _ = measured(PointSpread, planted)
    found = dict(zip((one.name for one in measure.quantities), measure.estimate(sums), strict=True))
    offset = np.arange(9)
    due = [2 * np.interp(-0.5, -(2.0 ** (-((2 * offset / width) ** 2))), offset) for width in widths]
    names = {"width along track": due[0], "width across beams": due[1], "width over range": due[2] * step}
    assert found == pytest.approx(names, rel=0.01)


def test_too_few_echoes_have_no_width():
    """Speckle-free ground with three echoes: not known, and no number."""
    values = np.ones((30, 1, 200), complex)
    values[[5, 15, 25], 0, [40, 100, 160]] = 100
    measure, sums, _ = measured(PointSpread, samples(values))
    assert np.isnan(measure.estimate(sums)).all()


@GAPS
def test_patterns_of_independent_samples_are_those_of_ranks(gaps):
    """So many of eight neighbours above the middle have chance 1/9 each; 8 of C(8, n) rings of n have one run.

    14 000 rings of nine known samples, or 0.04 of them with gaps: three errors of a share are 0.008, or 0.04.
    """
    _, sums, _ = measured(ImageTexture, samples(speckle(6, 60, 1, 900), gaps=gaps))
    found = sums[-PATTERNS:] / sums[-PATTERNS:].sum()
    due = np.array([1 / 9] + [8 / comb(8, n) / 9 for n in range(1, 8)] + [1 / 9])
    np.testing.assert_allclose(found, [*due, 1 - due.sum()], atol=0.04 if gaps else 0.01)


@GAPS
@pytest.mark.parametrize("looks", [2, 4])
def test_distances_of_speckle_are_those_of_gamma_distributions(looks, gaps):
    """One and several looks: Jensen-Shannon and earth mover's distance of their shares of levels, within 0.02, 0.15 dB.

    Shares between the edges follow the gamma distributions of unit mean; patterns of both are alike.
    """
    one = samples(speckle(7, 60, 1, 900), gaps=gaps)
    mean = np.sqrt(np.mean([abs(speckle(k, 60, 1, 900)) ** 2 for k in range(11, 11 + looks)], axis=0))
    measure, first, second = measured(ImageTexture, one, samples(mean + 0j, gaps=gaps))
    shares = [np.diff(gamma(n, scale=1 / n).cdf(np.concatenate([[0], 10 ** (LEVELS / 10), [np.inf]])))
              for n in (1, looks)]  # fmt: skip
    levels, moved, patterns = measure.distance(first, second)
    assert levels == pytest.approx(float(jensen_shannon(*shares)), abs=0.02)
    assert moved == pytest.approx(2 * np.abs(np.cumsum(shares[0] - shares[1])).sum(), abs=0.15)
    assert patterns < (0.15 if gaps else 0.04)


@pytest.mark.parametrize("band", [3, 6, 11])
def test_a_wave_of_level_has_a_line_at_its_wavenumber(band):
    """Level of 2 dB over so many waves in a segment: Hann's line, -6.02 dB beside it and nothing further off."""
    wave = np.sin(2 * np.pi * band * np.arange(960) / SEGMENT)
    measure, sums, _ = measured(ImageTexture, samples(np.tile(10 ** (wave / 10), (20, 1, 1)) + 0j))
    spectrum = measure.estimate(sums)
    assert measure.quantities[band - 1].name == f"spectrum at {band / (SEGMENT * STEP):.3g} 1/m"
    np.testing.assert_allclose(spectrum[[band - 2, band]] - spectrum[band - 1], -6.02, atol=0.5)
    assert np.delete(spectrum, [band - 2, band - 1, band]).max() < spectrum[band - 1] - 25


def test_a_recording_at_half_the_step_has_the_values_of_the_other():
    """Speckle of 0.2 m cells, at steps of 0.05 and of 0.1 m: percentiles within 0.2 dB of each other, on one axis."""
    white = speckle(8, 80, 1, 1203)
    fine = sum(white[..., k : k + 1200] for k in range(4)) / 2
    coarse = Samples("coarse", fine[..., 1::2], STEP * np.arange(2, 1201, 2), "uPa", pulse_length=4 * STEP / 750)
    frame = common_frame(samples(fine, cell=4), coarse)
    assert frame.step == pytest.approx(0.1) and any("steps of 0.1 m (0.05 and 0.1 m)" in note for note in frame.notes)
    measure, first, second = measured(Contrast, samples(fine, cell=4), coarse)
    np.testing.assert_allclose(measure.estimate(first)[1:], measure.estimate(second)[1:], atol=0.35)
