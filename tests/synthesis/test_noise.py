"""Ambient noise in the recording."""

import numpy as np
import pytest

from insonify.simulator import build_simulator, simulate
from insonify.sonar import received_pulse
from insonify.synthesis.noise import noise_intensity, receiver_noise
from oracles.scenes import PULSE, nominal

SWEEP = {**PULSE, "kind": "lfm", "duration": 4e-3, "bandwidth": 16e3, "taper": "tukey", "taper_fraction": 0.1}


def pulse(matched_filter=False, kind=PULSE, band=20e3):
    """What the receiver makes of a pulse."""
    return received_pulse(
        nominal(sonar={"pulse": kind, "receiver": {"bandwidth": band, "matched_filter": matched_filter}}).sonar
    )


def db(ratio):
    """Decibels of a ratio of powers."""
    return 10 * np.log10(ratio)


def test_noise_power_is_its_level_over_the_band():
    """NL + 10 log of the width of the energy that the filter passes, 1.094 of the band.

    Sigma 0.014 dB from 100 000 samples, 0.06 dB.
    """
    here = pulse()
    series = receiver_noise(here, 50.0, 1, 0, 1, 100_000)[0]
    offset = np.linspace(-0.625, 0.625, 10_001) * 20e3
    edge = np.clip((np.abs(offset) / 20e3 - 0.5) / 0.125, 0, 1)
    width = np.trapezoid(np.cos(np.pi / 2 * edge) ** 4, offset)
    assert db(np.mean(np.abs(series) ** 2)) == pytest.approx(50 + db(width), abs=0.06)
    assert db(noise_intensity(here, 50.0)) == pytest.approx(50 + db(width), abs=1e-3)


def test_the_matched_filter_keeps_the_noise_of_one_over_the_pulse():
    """Compressed, echoes keep their peak and noise falls to NL + 10 log 1 / (pulse's energy time).

    The time-bandwidth gain. For a 4 ms sweep with its tapers 3.75 ms: 24.3 dB re 1 Hz. Tolerance 0.1 dB: what the
    band cuts off.
    """
    here = pulse(matched_filter=True, kind=SWEEP)
    energy = 4e-3 * (1 - 0.625 * 0.1)
    assert db(noise_intensity(here, 50.0)) == pytest.approx(50 - db(energy), abs=0.1)
    gain = db(noise_intensity(pulse(kind=SWEEP), 50.0) / noise_intensity(here, 50.0))
    assert gain == pytest.approx(db(20e3 * 1.09375 * energy), abs=0.15)
    series = receiver_noise(here, 50.0, 1, 0, 1, 200_000)[0]
    assert db(np.mean(np.abs(series) ** 2) / noise_intensity(here, 50.0)) == pytest.approx(0, abs=0.07)


def test_noise_is_circular_gaussian_and_its_own_in_each_channel_and_ping():
    """Mean fourth power 2 (0.03 at N = 100 000), no pseudo-variance, no correlation between channels or pings."""
    here = pulse()
    first, second = receiver_noise(here, 50.0, 1, 0, 2, 50_000)
    other = receiver_noise(here, 50.0, 1, 1, 1, 50_000)[0]
    power = np.mean(np.abs(first) ** 2)
    assert np.mean(np.abs(first) ** 4) / power**2 == pytest.approx(2, abs=0.08)
    assert abs(np.mean(first**2)) / power < 0.02
    for stranger in (second, other):
        assert abs(np.vdot(first, stranger)) / (50_000 * power) < 0.02


def test_noise_reaches_the_recording_alike_in_both_readings():
    """Without echoes the coherent power averages to the incoherent floor: 12 500 samples, 0.2 dB."""
    track = {"window": (0.0, 0.25), "pings": 2}
    scenario = nominal(paths={"contributions": ["target"]}, water={"noise_level_db": 60}, track=track)
    power = np.mean(np.abs(simulate(scenario).pressure.values) ** 2)
    floor = simulate(scenario.model_copy(update={"field": "incoherent"})).intensity.values
    assert db(power / floor.mean()) == pytest.approx(0, abs=0.2)
    assert floor.std() == pytest.approx(0, abs=1e-6 * floor.mean())
    assert floor[0, 0, 0] == pytest.approx(noise_intensity(build_simulator(scenario).pulse, 60.0))
