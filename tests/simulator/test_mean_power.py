"""The central claim: the mean power of the coherent reading is the incoherent one, and both are the sonar equation."""

import numpy as np
import pytest
from scipy.stats import kstest

from insonify.simulator import build_simulator, simulate
from oracles.few_of import few_of
from oracles.scenes import each_ping, nominal
from oracles.sonar_equation import bed_reverberation, pulse_energy

ALPHA = 0.035
WATER = {"noise_level_db": None, "absorption_db_per_m": ALPHA}
FLAT = {"window": (0.05, 0.24)}
LATE = {"window": (0.198, 0.235)}
PULSE_TIME = 0.155e-3
"""About the time in which the recorded nominal pulse's energy passes [s]: an independent cell."""


def pressure(scenario):
    """One ping, one channel."""
    return simulate(scenario, threads=1).pressure.values[0, 0]


def intensity(scenario):
    """Expected intensity of one ping, one channel."""
    return simulate(scenario.model_copy(update={"field": "incoherent"})).intensity.values[0, 0]


def closed_form(time):
    """The nominal bed by direct paths [uPa^2]."""
    energy = pulse_energy(duration=0.2e-3, fraction=0.2, band=20e3)
    return bed_reverberation(time, level_db=220, strength_db=-27, height=9.0, speed=1500.0, absorption=ALPHA,
                             duration=0.2e-3, energy=energy, length=1.5, wavelength=0.015)  # fmt: skip


def bed(seed=1, *, track=FLAT, **paths):
    """The nominal bed without a target, direct paths unless stated."""
    return nominal(seed=seed, water=WATER, track=track, paths={"max_reflections": 0, **paths})


@pytest.fixture(scope="module")
def ensemble():
    """Direct echoes of 24 beds, (24, samples), over the root of the mean that the sonar equation gives."""
    received = each_ping([bed(seed) for seed in range(24)], pressure)
    return received / np.sqrt(closed_form(build_simulator(bed()).grid.time))


def test_the_incoherent_reading_of_a_flat_bed_is_the_sonar_equation():
    """Direct paths, 38 to 178 m.

    Within 0.1 dB over all and 0.2 dB in each sixth; what is left is the draw of places.
    """
    time = build_simulator(bed()).grid.time
    ratio = np.mean([intensity(bed(seed)) / closed_form(time) for seed in range(4)], axis=0)
    assert 10 * np.log10(ratio.mean()) == pytest.approx(0, abs=0.1)
    for part in np.array_split(ratio, 6):
        assert 10 * np.log10(part.mean()) == pytest.approx(0, abs=0.2)


def test_the_mean_coherent_power_of_a_flat_bed_is_the_sonar_equation(ensemble):
    """24 beds of 1200 cells, N = 29 000: 0.026 dB standard error; bias within 0.1 dB, each sixth within 0.2 dB."""
    power = np.mean(np.abs(ensemble) ** 2, axis=0)
    assert 10 * np.log10(power.mean()) == pytest.approx(0, abs=0.1)
    for part in np.array_split(power, 6):
        assert 10 * np.log10(part.mean()) == pytest.approx(0, abs=0.2)


def test_a_flat_bed_speckles_as_rayleigh_predicted(ensemble):
    """Scintillation index 2.00 +- 0.1; power exponential; phase uniform, I and Q unrelated.

    24 beds of 1200 cells: 0.026 standard error of the index. Kolmogorov-Smirnov distance below 0.02 of one sample in
    four, N = 28 000 nearly independent ones (0.0097 once in a hundred times).
    """
    power = np.abs(ensemble) ** 2
    assert kstest(power[:, ::4].ravel() / power.mean(), "expon").statistic < 0.02
    assert np.mean(power**2) / np.mean(power) ** 2 == pytest.approx(2.0, abs=0.1)
    turns = np.exp(1j * np.angle(ensemble))
    assert abs(turns.mean()) < 0.03
    assert abs((turns**2).mean()) < 0.03
    assert abs(np.mean(ensemble.real * ensemble.imag)) / power.mean() < 0.015


def difference_db(scenario, seeds):
    """Mean coherent power over the incoherent reading, averaged over the window [dB]."""
    received = each_ping([scenario.model_copy(update={"seed": seed}) for seed in range(seeds)], pressure)
    expected = np.mean([intensity(scenario.model_copy(update={"seed": seed})) for seed in range(4)], axis=0)
    return 10 * np.log10(np.mean(np.abs(received) ** 2 / expected))


APART = {"transmit": {"offset": (0.0, 0.0, -0.5)}, "receive": {"offset": (0.0, 0.0, 0.5)}}


@few_of(
    (2, 3, 5),
    ("name", "paths", "ends"),
    [
        ("direct", {"max_reflections": 0}, {}),
        ("reciprocal", {"families": ("D", "S")}, {}),
        ("reciprocal, with e", {"max_reflections": 2}, {}),
        ("jittered", {"families": ("D", "S"), "jitter": 1.0, "amplitude_perturbation": 0.5}, {}),
        ("half jittered", {"families": ("D", "S"), "jitter": 0.5}, {}),
        ("ends 1 m apart", {"families": ("D", "S")}, APART),
    ],
)
def test_the_mean_coherent_power_is_the_incoherent_reading(name, paths, ends):
    """198 to 235 ms, 48 beds of 240 cells, N = 11 500.

    0.04 dB standard error, 0.15 dB allowed; with the enhancement of reciprocal pairs (4 |A|^2), without it, and
    with ends too far apart for it.
    """
    scenario = nominal(water=WATER, track=LATE, paths=paths, **ends)
    assert difference_db(scenario, 48) == pytest.approx(0, abs=0.15)


def test_reciprocal_pairs_are_worth_what_their_interference_predicts():
    """{a, b}.

    10 log((1 + s^2 + 4 s) / (1 + s^2 + 2 s)) = 1.30 dB with s = 31/9 over a sum of energies, within 0.1 dB.
    """
    s = 31 / 9
    expected = 10 * np.log10((1 + s**2 + 4 * s) / (1 + s**2 + 2 * s))
    still, shaken = (
        intensity(nominal(water=WATER, track=LATE, paths={"families": ("D", "S"), "jitter": jitter})).mean()
        for jitter in (0.0, 1.0)
    )
    assert expected == pytest.approx(1.30, abs=0.005)
    assert 10 * np.log10(still / shaken) == pytest.approx(expected, abs=0.1)


@pytest.mark.validate
@pytest.mark.parametrize("apart", [0.0, 0.02, 0.05, 0.10, 0.20, 1.0])
def test_ends_that_move_apart_lose_the_enhancement(apart):
    """Transmitter and receiver `apart` metres above one another, {a, b}.

    300 beds of 240 cells, N = 72 000, 0.016 dB standard error; coherent mean = incoherent reading within 0.08 dB.
    """
    ends = {"transmit": {"offset": (0, 0, -apart / 2)}, "receive": {"offset": (0, 0, apart / 2)}}
    scenario = nominal(water=WATER, track=LATE, paths={"families": ("D", "S")}, **ends)
    assert difference_db(scenario, 300) == pytest.approx(0, abs=0.08)


@pytest.mark.validate
def test_the_distribution_of_a_flat_beds_power_is_exponential():
    """16 beds, one sample in four: 19 000 nearly independent cells.

    Kolmogorov-Smirnov distance below 0.02, index 2.00 +- 0.1 (0.03 standard error).
    """
    received = each_ping([bed(seed) for seed in range(100, 116)], pressure)[:, ::4]
    power = np.abs(received) ** 2 / closed_form(build_simulator(bed()).grid.time)[::4]
    assert kstest(power.ravel() / power.mean(), "expon").statistic < 0.02
    assert np.mean(power**2) / np.mean(power) ** 2 == pytest.approx(2.0, abs=0.1)
    assert kstest(np.angle(received).ravel(), "uniform", (-np.pi, 2 * np.pi)).statistic < 0.02
