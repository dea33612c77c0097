"""What an arrival weighs: the sonar equation, written out for single paths.

Energies are deposited over the support of the pulse, which leaves out a millionth of it.
"""

import numpy as np
import pytest

from insonify.simulator import arrivals, build_simulator, simulate
from insonify.synthesis.arrival_weights import arrival_weights, beam_amplitudes_of_arrivals
from insonify.synthesis.spike_power import spike_power
from oracles.scenes import nominal, point

WINDOW = {"track": {"window": (0.199, 0.206)}}


def received(families=("D",), targets=None, **settings):
    """Arrivals of points, and the sonar that receives them."""
    scenario = nominal(
        targets=[point(0, 150, 19.5)] if targets is None else targets,
        paths={"families": list(families), "contributions": ["target"]}, **{**WINDOW, **settings},
    )  # fmt: skip
    return arrivals(scenario), build_simulator(scenario).ping_geometry(0), scenario


def test_one_direct_path_satisfies_the_sonar_equation():
    """SL - 2 TL + TS, on the axis of both beams; phase is that of twice the range."""
    paths, here, scenario = received()
    slant = np.hypot(150, 8.5)
    loss = 20 * np.log10(slant) + float(scenario.water.absorption(100e3)) * slant
    weight = arrival_weights(paths, here)[0]
    sent, back = beam_amplitudes_of_arrivals(paths, here, 0)
    beams = 20 * np.log10(sent[0] * back[0])
    assert 20 * np.log10(np.abs(weight)) == pytest.approx(220 - 2 * loss + beams, abs=1e-4)
    turns = 100e3 * 2 * slant / 1500
    assert np.angle(weight * np.exp(2j * np.pi * turns)) == pytest.approx(0, abs=1e-4)


def test_a_target_strength_adds_its_decibels():
    """20 dB more of strength are 20 dB more of echo."""
    weak, strong = (received(targets=[point(0, 150, 19.5, strength=s)]) for s in (0.0, 20.0))
    ratio = np.abs(arrival_weights(*strong[:2])[0] / arrival_weights(*weak[:2])[0])
    assert ratio == pytest.approx(10.0, rel=1e-5)


def test_off_the_axis_both_beams_take_their_share():
    """Gains of the two beams are those of a line of its length; the weight has both."""
    east, north = 150.0, 1.2
    paths, here, _ = received(targets=[point(north, east, 11.0)], track={"window": (0.19, 0.206)})
    sent, back = beam_amplitudes_of_arrivals(paths, here, 0)
    sine = north / np.hypot(north, east)
    expected = abs(np.sinc(1.5 / 0.015 * sine))
    assert sent[0] == pytest.approx(expected, abs=2e-3) and back[0] == pytest.approx(expected, abs=2e-3)


def test_the_series_of_one_path_is_its_weight_times_the_pulse():
    """Simulated sound equals the weight and the pulse's own samples at the path's delay."""
    paths, here, scenario = received()
    held = simulate(scenario)
    time = held["time"].values
    weight = arrival_weights(paths, here)[0]
    carrier = np.exp(2j * np.pi * 0)  # baseband: the carrier stands in the weight
    expected = weight * carrier * here.pulse.samples(time - paths.delay[0])
    found = held["pressure"].values[0, 0]
    assert np.linalg.norm(found - expected) < 1e-5 * np.linalg.norm(expected)


def test_the_energy_of_one_spike_is_its_square():
    """Expected intensity of one path: |A p|^2, sample by sample."""
    paths, here, scenario = received(field="incoherent")
    time = simulate(scenario)["time"].values
    expected = np.abs(arrival_weights(paths, here)[0] * here.pulse.samples(time - paths.delay[0])) ** 2
    np.testing.assert_allclose(spike_power(paths, here, time), expected, rtol=1e-9, atol=1e-5 * expected.max())


def test_two_paths_of_one_point_interfere_in_the_mean():
    """They are one group: the energy is that of their sum, not the sum of their energies."""
    paths, here, scenario = received(("D", "B"), field="incoherent")
    assert len(paths) == 4
    time = simulate(scenario)["time"].values
    weight = arrival_weights(paths, here)
    together = np.abs(sum(w * here.pulse.samples(time - t) for w, t in zip(weight, paths.delay, strict=True))) ** 2
    found = spike_power(paths, here, time)
    np.testing.assert_allclose(found, together, rtol=1e-6, atol=1e-5 * together.max())
    apart = sum(np.abs(w * here.pulse.samples(time - t)) ** 2 for w, t in zip(weight, paths.delay, strict=True))
    assert np.abs(found - apart).max() > 0.1 * apart.max()


def test_two_points_do_not_interfere_in_the_mean():
    """Two targets are two groups: energies add."""
    pair = [point(0, 150, 19.5), point(0, 150.01, 19.5, label="other")]
    paths, here, scenario = received(targets=pair, field="incoherent")
    time = simulate(scenario)["time"].values
    weight = arrival_weights(paths, here)
    apart = sum(np.abs(w * here.pulse.samples(time - t)) ** 2 for w, t in zip(weight, paths.delay, strict=True))
    np.testing.assert_allclose(spike_power(paths, here, time), apart, rtol=1e-9, atol=1e-5 * apart.max())
