"""The chain behind the hydrophones."""

import numpy as np
import pytest

from insonify.simulator import build_simulator, simulate
from insonify.sonar.electronics import ReceiverGain
from insonify.synthesis.receiver_chain import ReceiverChain, neighbour_matrix
from oracles.arrays import elements_scenario

WAVELENGTH = 0.015
COUNT = 200_000


def chain(*, gain=1.0, full_scale=1e6, bits=16, leak=(), blanked=None, neighbours=None):
    """Electronics over `COUNT` samples."""
    step = 0.0 if bits is None else full_scale * 2.0 ** (1 - bits)
    silent = np.zeros(COUNT, bool) if blanked is None else blanked
    return ReceiverChain(np.array(leak, complex), neighbours, silent, np.full(COUNT, gain), full_scale, step)


def gaussian(power, rows=1):
    """Circular Gaussian pressures of so much mean power."""
    random = np.random.default_rng(4)
    drawn = random.normal(size=(rows, COUNT)) + 1j * random.normal(size=(rows, COUNT))
    return (np.sqrt(power / 2) * drawn).astype(np.complex64)


def quiet(receive=None, *, window=(0.0, 0.012), noise=60.0, **receiver):
    """A scene without echoes, 0.5 ms of sweep."""
    track = {"speed": 0.0, "window": window}
    return elements_scenario([], receive=receive, receiver=receiver, water={"noise_level_db": noise}, track=track)


@pytest.mark.parametrize("gain", [1.0, 0.1, 30.0])
def test_rounding_adds_a_twelfth_of_a_squared_step_to_each_quadrature(gain):
    """N = 200 000: the mean square of an error spread evenly has 0.2 % of standard error; 0.7 %. Gain shrinks it."""
    here = chain(gain=gain, full_scale=1e4, bits=12)
    sound = gaussian((20 * here.quantisation_step / gain) ** 2)
    error = (here.pressures(sound) - sound).astype(complex)
    step = here.quantisation_step / gain
    for quadrature in (error.real, error.imag):
        assert np.mean(quadrature**2) == pytest.approx(step**2 / 12, rel=0.007)
        assert np.abs(quadrature).max() < 0.501 * step


@pytest.mark.parametrize("bits", [None, 2, 8, 16])
def test_nothing_recorded_exceeds_full_scale(bits):
    """Sound 20 dB above full scale, with gain: what leaves the converter is never beyond it, in either quadrature."""
    here = chain(gain=4.0, full_scale=100.0, bits=bits)
    out = here.pressures(gaussian(1e4 / 16 * 100)) * 4.0
    assert np.abs(out.real).max() <= 100 * (1 + 1e-6) and np.abs(out.imag).max() <= 100 * (1 + 1e-6)
    if bits is None:
        assert np.abs(out).max() <= 100 * (1 + 1e-6)
    else:
        # as many codes below 0 as from 0 on
        assert np.max([out.real, out.imag]) == pytest.approx(100 * (1 - 2.0 ** (1 - bits)), rel=1e-6)
        assert np.min([out.real, out.imag]) == pytest.approx(-100, rel=1e-6)


def test_clipping_keeps_the_phase_and_what_fits():
    """A band-pass signal that clips is as large as it may be, and where it was: its harmonics are outside the band."""
    here = chain(full_scale=10.0, bits=None)
    sound = gaussian(100.0)
    out = here.pressures(sound)
    small = np.abs(sound) < 9.999
    np.testing.assert_array_equal(out[small], sound[small])
    np.testing.assert_allclose(np.angle(out * sound.conj()), 0, atol=1e-6)


@pytest.mark.parametrize("rms", [0.05, 0.3, 0.6, 2.0, 2.2, 100.0, 2000.0, 20_000.0])
def test_expected_intensities_are_the_mean_of_recorded_pressures(rms):
    """Circular Gaussian noise from a twentieth of a step to 20 times full scale: N = 200 000, three standard errors."""
    here = chain(gain=2.0, full_scale=1024.0, bits=11)
    assert here.quantisation_step == 1.0
    power = (rms / 2.0) ** 2
    power_recorded = np.abs(here.pressures(gaussian(power)).astype(complex)) ** 2
    expected = here.intensities(np.full((1, COUNT), power))[0, 0]
    # near full scale the top code, a step short of it, is missing on one side
    assert power_recorded.mean() == pytest.approx(
        expected, abs=3 * power_recorded.std() / np.sqrt(COUNT) + 2e-3 * expected + 1e-12
    )


def test_a_blanked_receiver_is_silent_for_exactly_the_stated_time():
    """0.5 ms of pulse and 1.25 ms more: every sample before 1.75 ms is 0, none after; the leak is silenced as well."""
    scenario = quiet(blanking=1.25e-3, crosstalk={"feedthrough_db": -60})
    for field in ("coherent", "incoherent"):
        if field == "incoherent":
            scenario = quiet({"kind": "point"}, record="beams", blanking=1.25e-3, crosstalk={"feedthrough_db": -60})
            scenario = scenario.model_copy(update={"field": field})
        held = simulate(scenario)
        sound = held["pressure" if field == "coherent" else "intensity"].values[0]
        early = held.time.values < 1.75e-3 - 1e-12
        assert np.all(sound[:, early] == 0) and np.all(sound[:, ~early] != 0)


def test_the_transmission_leaks_in_at_its_level_at_once():
    """200 dB of source level less 60 is 140 dB through the sweep, and noise alone after it."""
    held = simulate(quiet(crosstalk={"feedthrough_db": -60}))
    level = 20 * np.log10(np.abs(held.pressure.values[0]))
    time = held.time.values
    assert level[:, (time > 0.1e-3) & (time < 0.4e-3)] == pytest.approx(140, abs=1)  # the band's own ripple
    assert np.all(level[:, time > 5e-3] < 120)
    without = simulate(quiet()).pressure.values[0]
    leak = held.pressure.values[0] - without
    pulse = build_simulator(quiet()).pulse
    np.testing.assert_allclose(leak, np.broadcast_to(1e7 * pulse.samples(time), leak.shape), atol=2)


def test_neighbours_leak_into_each_other():
    """In a panel of 3 by 3 the middle one has four neighbours, a corner two; on a line each has those beside it."""
    panel = {"kind": "planar", "width": 0.03, "height": 0.03, "columns": 3, "rows": 3, "element": "omni"}
    near = neighbour_matrix(quiet(panel).sonar)
    assert near.sum(axis=1).tolist() == [2, 3, 2, 3, 4, 3, 2, 3, 2]
    assert np.array_equal(near, near.T) and np.array_equal(np.diag(near), np.zeros(9))
    sound = simulate(quiet()).pressure.values[0]
    mixed = simulate(quiet(crosstalk={"neighbours_db": -20})).pressure.values[0]
    beside = np.eye(4, k=1) + np.eye(4, k=-1)
    np.testing.assert_allclose(mixed, sound + 0.1 * beside @ sound, rtol=1e-5, atol=1e-3)


def test_gain_follows_the_range_between_its_ends():
    """30 log R + 2 alpha R from 2 ms to 8 ms, as then before and after, and never above its limit."""
    gain = ReceiverGain(fixed_db=6.0, tvg_db_per_decade=30.0, start=2e-3, stop=8e-3)
    time = np.array([0.0, 2e-3, 4e-3, 8e-3, 20e-3])
    slant = 750.0 * np.array([2e-3, 2e-3, 4e-3, 8e-3, 8e-3])
    expected = 6 + 30 * np.log10(slant) + 2 * 0.03 * slant
    np.testing.assert_allclose(gain.db(time, 1500.0, 0.03), expected)
    limited = gain.model_copy(update={"max_db": 30.0}).db(time, 1500.0, 0.03)
    np.testing.assert_allclose(limited, np.minimum(expected, 30.0))
    # a fixed gain alone makes up for no absorption
    np.testing.assert_array_equal(ReceiverGain(fixed_db=6.0).db(time, 1500.0, 0.03), 6.0)


def test_gain_is_divided_out_again():
    """With a fine converter the recording is the same, but for half a step over the gain at its time."""
    law = {"tvg_db_per_decade": 40.0, "absorption_db_per_m": 0.05}
    plain = simulate(quiet()).pressure.values[0]
    held = simulate(quiet(gain=law, adc={"full_scale_db": 240, "bits": 24}))
    gain = 10 ** (ReceiverGain(**law).db(held.time.values, 1500.0, 0.0) / 20)
    step = 10**12 * 2.0**-23 / gain
    assert np.all(np.abs(held.pressure.values[0] - plain) < 0.71 * step + 1e-5 * np.abs(plain))
    assert step[0] > 80 * step[-1]


@pytest.mark.parametrize("field", ["pressures", "intensities"])
def test_silence_goes_through_a_converter_without_a_warning(field):
    """No sound and no noise at all, or next to none: recorded as it is, and no overflow on the way."""
    behind = ReceiverChain(np.empty(0, complex), None, np.zeros(3, bool), np.ones(3), 1e8, 0.0)
    quiet = np.array([[0.0, 1e-300, 1e-30]])
    with np.errstate(all="raise", under="ignore"):
        received = getattr(behind, field)(quiet.astype(complex) if field == "pressures" else quiet)
    np.testing.assert_allclose(received, quiet, rtol=1e-6, atol=1e-40)
