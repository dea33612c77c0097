"""Claims about textured ground as it is received: K-distributed where resolved, as strong in the mean."""

import numpy as np
import pytest
from scipy.special import gammaln, kv
from scipy.stats import kstest

from insonify.simulator import Simulator, build_simulator, labels, simulate
from insonify.synthesis.label_accumulator import POINTS
from oracles.scenes import each_ping, nominal
from oracles.sonar_equation import bed_reverberation, pulse_energy

ALPHA = 0.035
WATER = {"noise_level_db": None, "absorption_db_per_m": ALPHA}
SHAPE = 3.0
SHORT = {"kind": "cw", "frequency": 100e3, "duration": 0.1e-3, "taper": "tukey", "taper_fraction": 0.2}
RELIEF = {"kind": "power-law", "rms": 0.05, "hurst": 0.8, "outer_scale": 20.0}


def textured(*, length=0.6, shape=SHAPE, window=(0.05, 0.1), **top):
    """A flat bed from 38 to 75 m under a narrow beam, its cells small against the texture; direct paths."""
    seabed = {
        "texture": None if shape is None else {"k_shape": shape, "correlation_length": length},
        **top.pop("seabed", {}),
    }
    return nominal(water=WATER, seabed=seabed, line={"length": 5.0}, track={"window": window},
                   sonar={"pulse": SHORT}, paths={"max_reflections": 0}, **top)  # fmt: skip


def pressure(scenario):
    """One ping, one channel."""
    return simulate(scenario, threads=1).pressure.values[0, 0]


def closed_form(time):
    """The same bed without a texture [uPa^2]."""
    energy = pulse_energy(duration=0.1e-3, fraction=0.2, band=20e3)
    return bed_reverberation(time, level_db=220, strength_db=-27, height=9.0, speed=1500.0, absorption=ALPHA,
                             duration=0.1e-3, energy=energy, length=5.0, wavelength=0.015)  # fmt: skip


def k_distribution(intensity):
    """Share of K-distributed intensities of mean one that lie below."""
    root = np.sqrt(SHAPE * intensity)
    return 1 - 2 * np.exp(SHAPE * np.log(root) - gammaln(SHAPE)) * kv(SHAPE, 2 * root)


def power_of(beds):
    """Power of textured beds over that of the plain mean bed, one sample in three: (beds, 417)."""
    scenarios = [textured().model_copy(update={"seed": seed}) for seed in range(beds)]
    received = each_ping(scenarios, pressure)
    return (np.abs(received) ** 2 / closed_form(build_simulator(scenarios[0]).grid.time))[:, ::3]


@pytest.fixture(scope="module")
def power():
    """That of 60 beds."""
    return power_of(60)


def test_a_few_textured_beds_speckle_more_than_plain_ones():
    """2 (1 + 1/3) = 2.67 within 0.55, three standard errors of 12 beds of about 40 patches; Rayleigh's 2 is beyond."""
    power = power_of(12)
    assert np.mean(power**2) / np.mean(power) ** 2 == pytest.approx(2 * (1 + 1 / SHAPE), abs=0.55)


@pytest.mark.validate
def test_textured_ground_speckles_as_two_times_one_plus_one_over_nu(power):
    """2 (1 + 1/3) = 2.67 within 0.25.

    60 beds of about 40 patches: standard error 0.08 by the scatter between beds.
    """
    index = np.mean(power**2) / np.mean(power) ** 2
    assert np.std(np.mean(power**2, axis=1)) / np.mean(power) ** 2 / np.sqrt(len(power)) < 0.084
    assert index == pytest.approx(2 * (1 + 1 / SHAPE), abs=0.25)


@pytest.mark.validate
def test_intensities_of_textured_ground_are_k_distributed(power):
    """N = 25 000 samples of 60 beds: Kolmogorov-Smirnov distance below 0.03; from the exponential it is above."""
    own = power.ravel() / power.mean()
    assert kstest(own, k_distribution).statistic < 0.03
    assert kstest(own, "expon").statistic > 0.03


def test_both_readings_receive_the_same_texture():
    """8 beds of other scatterers on the one texture, N = 3300 cells, standard error 0.08 dB: means within 0.25 dB.

    Without it the expected intensity would differ by patches: so do the beds, in the same places.
    """
    here = textured(window=(0.05, 0.08), seabed={"seed": 5})
    beds = [here.model_copy(update={"seed": seed}) for seed in range(8)]
    received = np.mean(np.abs(each_ping(beds, pressure)) ** 2, axis=0)
    expected = simulate(here.model_copy(update={"field": "incoherent"})).intensity.values[0, 0]
    assert 10 * np.log10(np.mean(received / expected)) == pytest.approx(0, abs=0.25)
    plain = closed_form(build_simulator(here).grid.time)
    assert np.std(expected / plain) > 0.4
    assert np.corrcoef(received / plain, expected / plain)[0, 1] > 0.6


def test_texture_leaves_the_mean_level():
    """16 beds of 5 cm patches, 8000 of them: standard error 0.03 dB; within 0.1 dB of the plain bed."""
    fine = textured(length=0.05, field="incoherent")
    beds = [fine.model_copy(update={"seed": seed}) for seed in range(16)]
    plain = simulate(textured(shape=None, field="incoherent")).intensity.values[0, 0]
    received = each_ping(beds, lambda bed: simulate(bed, threads=1).intensity.values[0, 0])
    assert 10 * np.log10(np.mean(received / plain)) == pytest.approx(0, abs=0.1)


def test_texture_is_in_labels_as_in_the_expected_intensity():
    """The same even points, the same sums: to rounding."""
    here = textured(window=(0.05, 0.06), field="incoherent")
    here = here.model_copy(update={"paths": here.paths.model_copy(update={"scatterers_per_cell": POINTS})})
    labelled, received = labels(here).expected_intensity.values[0], simulate(here).intensity.values[0, 0]
    np.testing.assert_allclose(labelled, received, rtol=1e-5)


def test_fast_reverberation_over_relief_receives_the_texture_too(monkeypatch):
    """Against the general way over the same textured ground, 5 ms: mean within 0.15 dB."""
    here = textured(window=(0.07, 0.075), field="incoherent", seabed={"relief": RELIEF})
    quick = simulate(here).intensity.values[0, 0]
    monkeypatch.setattr(Simulator, "fast_reverberation", lambda self, ping_geometry: None)
    slow = simulate(here).intensity.values[0, 0]
    assert 10 * np.log10(np.mean(quick / slow)) == pytest.approx(0, abs=0.15)
    assert np.std(np.log(quick / slow)) < 0.15


def test_a_texture_draws_no_other_scatterers():
    """A texture so even that it has no effect, 3 % rms: it draws no other scatterers, and sound stays within that."""
    still, plain = (pressure(textured(window=(0.05, 0.055), shape=shape)) for shape in (1000.0, None))
    assert np.max(np.abs(still - plain)) < 0.2 * np.sqrt(np.mean(np.abs(plain) ** 2))
    assert np.mean(np.abs(still - plain) ** 2) < 1e-3 * np.mean(np.abs(plain) ** 2)
