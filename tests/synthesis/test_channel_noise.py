"""Noise in the channels, from physical levels."""

import numpy as np
import pytest

from insonify.ocean import noise_level_db
from insonify.processing import beamform_delay_sum
from insonify.simulator import build_simulator, simulate
from insonify.sonar.receiver import response
from insonify.synthesis._noise_mixing_kernel import mix_noise
from insonify.synthesis.noise import noise_intensity, receiver_noise
from insonify.synthesis.time_grid import time_grid
from oracles.arrays import elements_scenario

WAVELENGTH = 0.015
STILL = {"speed": 0.0, "window": (0.0, 0.008)}


def line(count, pitch, **more):
    """A line of elements so many wavelengths apart."""
    return {"kind": "line", "length": count * pitch * WAVELENGTH, "elements": count, "element": "omni", **more}


def quiet(receive, *, noise=None, record="elements", pings=1, **receiver):
    """A scene without echoes."""
    water = {"sound_speed": 1500.0, "noise": noise} if not isinstance(noise, float) else {"noise_level_db": noise}
    settings = {"record": record, **receiver}
    return elements_scenario([], receive=receive, receiver=settings, water=water, track={**STILL, "pings": pings})


def draw(scenario, count, ping=0, start=0.0):
    """So many samples of the noise of a scenario."""
    simulator = build_simulator(scenario)
    rate = simulator.grid.sample_rate
    grid = time_grid(0.0, count / rate, rate, *simulator.pulse.table_interval)
    return simulator.noise.draw(ping, start, grid)[:, :count], simulator


def db(ratio):
    """Decibels of a ratio of powers."""
    return 10 * np.log10(ratio)


def test_neighbours_receive_the_sea_alike():
    """Covariance of 16 elements 0.4 wavelengths apart is sin kd / kd times their power, N = 25 000.

    Errors are 1 / sqrt(N) in the rms, within three of its standard errors, and none of the 136 is beyond 4 / sqrt(N).
    """
    received, simulator = draw(quiet(line(16, 0.4), noise={"level_db": 50}), 25_000)
    place = 0.4 * np.arange(16)
    found = received @ received.conj().T / received.shape[1] / simulator.noise.power[0]
    # the filter leaves 0.9 independent samples in each
    error = np.abs(found - np.sinc(2 * (place[:, None] - place))) * np.sqrt(0.9 * 25_000)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(1, abs=0.3)
    assert error.max() < 4


@pytest.mark.parametrize("pitch", [0.5, 0.3])
def test_delay_and_sum_gains_the_directivity_index(pitch):
    """Beams of 32 elements: 10 log 32 half a wavelength apart, less where nearer. N = 40 000, 3 sigma 0.07 dB; 0.1 dB.

    The beamformer shares no code with the noise; the same sonar's beams have that level too.
    """
    array = line(32, pitch)
    received, simulator = draw(quiet(array, noise={"level_db": 50}), 40_000)
    place = simulator.ping_geometry(0).elements.positions
    time = np.arange(received.shape[1]) / simulator.grid.sample_rate
    ahead = np.array([[1.0, 0.0, 0.0]])
    beam = beamform_delay_sum(received, place, time, ahead, centre_frequency=100e3, focus="far")[0]
    at = pitch * np.arange(32)
    theory = np.sinc(2 * (at[:, None] - at)).mean()
    level = db(np.mean(np.abs(beam[100:-100]) ** 2) / simulator.noise.power[0])
    assert level == pytest.approx(db(theory), abs=0.1)
    if pitch == 0.5:
        assert db(theory) == pytest.approx(-db(32), abs=1e-9)
    formed = build_simulator(quiet({**array, "steer": 0.0}, noise={"level_db": 50}, record="beams")).noise.power[0]
    assert db(formed / simulator.noise.power[0]) == pytest.approx(db(theory), abs=1e-3)


def test_a_physical_level_becomes_recorded_power():
    """Wind of 7 m/s and rain: the spectrum over the filter's band, 3 dB less behind a baffle. N = 800 000; 0.05 dB."""
    far_apart = {"kind": "elements", "positions": [(0.0, row, 0.0) for row in range(8)], "element": "baffled"}
    received, simulator = draw(quiet(far_apart, noise={"wind_speed": 7.0, "rain_rate": 2.0}), 100_000)
    offset = np.linspace(-0.625, 0.625, 2001) * 20e3
    density = 10 ** (noise_level_db(100e3 + offset, wind_speed=7.0, rain_rate=2.0) / 10)
    expected = np.trapezoid(density * response(simulator.pulse.receiver, offset) ** 2, offset) / 2
    assert db(np.mean(np.abs(received) ** 2) / expected) == pytest.approx(0, abs=0.05)
    assert db(simulator.noise.power / expected) == pytest.approx(np.zeros(8), abs=1e-3)


def test_the_seas_spectrum_slopes_within_the_band():
    """Wind noise falls by 20 dB a decade.

    16 kHz lower in a band about 40 kHz it is stronger as its law states, 0.3 dB.
    """
    pulse = {"kind": "cw", "frequency": 40e3, "duration": 0.5e-3}
    scenario = elements_scenario([], pulse=pulse, water={"noise": {"wind_speed": 10.0}}, track=STILL)
    received, simulator = draw(scenario, 100_000)
    power = np.mean(np.abs(np.fft.fft(received[:1])) ** 2, axis=0)
    offset = np.fft.fftfreq(received.shape[1], 1 / simulator.grid.sample_rate)
    low, high = (power[np.abs(offset - middle) < 1e3].mean() for middle in (-8e3, 8e3))
    law = noise_level_db([32e3, 48e3], wind_speed=10.0)
    assert db(low / high) == pytest.approx(law[0] - law[1], abs=0.3)


def test_each_channel_has_the_level_that_noise_level_db_states():
    """However directive; elements receive it alike as hydrophones behind a baffle do, beams independently, as ever."""
    received, simulator = draw(quiet(line(8, 0.3, element="baffled"), noise=50.0), 50_000)
    assert db(simulator.noise.power / noise_intensity(simulator.pulse, 50.0)) == pytest.approx(np.zeros(8), abs=1e-6)
    found = np.vdot(received[1], received[0]) / np.vdot(received[0], received[0])
    assert abs(found - np.sinc(0.6)) < 3 / np.sqrt(45_000)
    beams = quiet(line(8, 0.3, steer=[0.0, 0.1]), noise=50.0, record="beams")
    again, simulator = draw(beams, 5000)
    np.testing.assert_array_equal(again, receiver_noise(simulator.pulse, 50.0, beams.seed, 0, 2, 5000))


def test_self_noise_is_each_elements_own():
    """Independent between elements (3 / sqrt(N), N = 50 000); a beam of 8 has a ninth of a decade less: 10 log 8."""
    received, simulator = draw(quiet(line(8, 0.1), self_noise={"level_db": 30}), 50_000)
    power = noise_intensity(simulator.pulse, 30.0)
    found = received @ received.conj().T / received.shape[1] / power
    assert np.abs(found - np.eye(8)).max() < 3 / np.sqrt(45_000)
    beam = build_simulator(quiet(line(8, 0.1, steer=0.0), record="beams", self_noise={"level_db": 30})).noise.power[0]
    assert db(beam / power) == pytest.approx(-db(8), abs=1e-6)


def test_dead_elements_receive_their_own_noise_only():
    """The sea does not reach them; their amplifier still hisses."""
    scenario = quiet(line(4, 0.4), noise={"level_db": 60}, errors={"dead": [2]}, self_noise={"level_db": 20})
    power = build_simulator(scenario).noise.power
    assert db(power[2] / noise_intensity(build_simulator(scenario).pulse, 20.0)) == pytest.approx(0, abs=1e-6)
    assert np.all(power[[0, 1, 3]] > 5000 * power[2])


def test_two_sides_receive_noise_of_their_own():
    """Three elements a side, 0.3 wavelengths apart: alike as sin kd / kd on a side, not at all across. N = 50 000."""
    scenario = quiet(line(3, 0.3), noise={"level_db": 50})
    scenario = scenario.model_copy(update={"sonar": scenario.sonar.model_copy(update={"sides": ("port", "starboard")})})
    received, simulator = draw(scenario, 50_000)
    found = received @ received.conj().T / received.shape[1] / simulator.noise.power[0]
    place = 0.3 * np.arange(3)
    side = np.sinc(2 * (place[:, None] - place))
    assert np.abs(found - np.kron(np.eye(2), side)).max() < 4 / np.sqrt(45_000)


def test_a_tone_runs_on_from_ping_to_ping():
    """Its level in every channel, and its phase after 12.3456 s: that of its frequency, 1e-4."""
    tones = [{"frequency": 98.7e3, "level_db": 60}]
    scenario = quiet(line(3, 0.5), self_noise={"tones": tones})
    first, simulator = draw(scenario, 400)
    later, _ = draw(scenario, 400, ping=5, start=12.3456)
    assert db(np.abs(first) ** 2) == pytest.approx(np.full((3, 400), 60.0), abs=1e-4)
    np.testing.assert_allclose(later / first, np.exp(2j * np.pi * (98.7e3 * 12.3456 % 1)), atol=1e-4)
    turn = np.exp(-2j * np.pi * 1.3e3 / simulator.grid.sample_rate)
    np.testing.assert_allclose(first[:, 1:] / first[:, :-1], turn, atol=1e-5)
    assert build_simulator(scenario).noise.power == pytest.approx(np.full(3, 1e6))


def test_expected_intensity_is_the_mean_power_of_the_noise():
    """Sea, amplifiers and tones in beams: 2 pings of 4000 samples agree within 3 sigma, 0.15 dB."""
    noisy = {"self_noise": {"level_db": 40, "tones": [{"frequency": 101e3, "level_db": 70}]}}
    scenario = quiet(line(8, 0.5, steer=0.2), noise={"level_db": 50}, record="beams", pings=2, **noisy)
    scenario = scenario.model_copy(update={"track": scenario.track.model_copy(update={"window": (0.0, 0.16)})})
    power = np.mean(np.abs(simulate(scenario).pressure.values) ** 2)
    floor = simulate(scenario.model_copy(update={"field": "incoherent"})).intensity.values
    assert db(power / floor.mean()) == pytest.approx(0, abs=0.15)


def test_bits_depend_on_neither_threads_nor_order():
    """Elements with all kinds of noise and a converter: the same bits with 1 and 2 threads, forwards and backwards."""
    scenario = quiet(
        line(5, 0.3), noise={"wind_speed": 5.0, "directionality": "surface"}, pings=3,
        self_noise={"level_db": 20, "tones": [{"frequency": 99e3, "level_db": 30}]},
        crosstalk={"feedthrough_db": -150, "neighbours_db": -30}, adc={"full_scale_db": 120, "bits": 16},
    )  # fmt: skip
    one = simulate(scenario, threads=1).pressure.values
    two = simulate(scenario, threads=2, pings=[2, 0, 1]).pressure.values
    np.testing.assert_array_equal(one[[2, 0, 1]], two)
    assert np.abs(one).min() >= 0 and np.abs(one).max() > 0


def test_mixing_is_a_product_of_matrices():
    """The kernel is L x, float32 rounding, over more samples than it takes at once."""
    random = np.random.default_rng(3)
    lower = np.tril(random.normal(size=(7, 7)) + 1j * random.normal(size=(7, 7)))
    lower[3, 1] = 0
    lower[2] = lower[2].real
    white = (random.normal(size=(7, 1500)) + 1j * random.normal(size=(7, 1500))).astype(np.complex64)
    out = np.zeros((2, 7, 1500), np.float32)
    parts = [np.ascontiguousarray(part, np.float32) for part in (lower.real, lower.imag, white.real, white.imag)]
    mix_noise(*parts, out[0], out[1])
    np.testing.assert_allclose(out[0] + 1j * out[1], lower @ white, atol=2e-5)
