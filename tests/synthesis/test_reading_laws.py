"""Laws of the readings: phase and level of weights, energy kept, parts that add, noise with its own colour."""

from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.propagation.propagation_model import RayDomain
from insonify.propagation.propagation_model_choice import propagation_model_for
from insonify.records.legs import GlintPhasors
from insonify.records.pairs import Pairs
from insonify.scattering.point_target import PointTargetLaw
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.simulator import build_simulator
from insonify.sonar import LineArray, Pulse, Receiver, beams, receive_pulse
from insonify.synthesis._gridding import deposit_energy, deposit_pressure
from insonify.synthesis.coherent_subsets import coherent_subsets
from insonify.synthesis.leg_weights import leg_weights
from insonify.synthesis.level_curves import ALL, level_curves, pair_name
from insonify.synthesis.noise import noise_intensity, receiver_filter, receiver_noise
from insonify.synthesis.replica_jitter import ReplicaJitter
from insonify.synthesis.time_grid import convolve_energy, convolve_pulse, time_grid
from oracles.scenes import nominal

FAMILIES = ("D", "S", "B")
RECEIVED = receive_pulse(Pulse(frequency=100e3, duration=0.4e-3), Receiver(bandwidth=20e3))
GRID = time_grid(0.1, 0.104, RECEIVED.receiver.sample_rate, RECEIVED.start, RECEIVED.stop)
SPECTRUM = RECEIVED.spectrum(GRID.frequencies)
PLACES = np.arange(4000, dtype=np.uint64)


@pytest.fixture(scope="module")
def pairs():
    """Every ordered pair of three families to five points of one strength."""
    rng = np.random.default_rng(3)
    place = np.column_stack([rng.uniform(-2, 2, 5), rng.uniform(79, 81, 5), rng.uniform(12, 18, 5)])
    points = Scatterers(
        "target", "target", PointTargetLaw(0.0), place, np.zeros((5, 3)), np.ones(5),
        np.exp(2j * np.pi * rng.random(5)), np.arange(5, dtype=np.uint64),
    )  # fmt: skip
    scene = Scene(water={"sound_speed": 1500.0}, seabed={"depth": 20.0, "reflection": 0.35})
    rays = propagation_model_for(scene, RayDomain((11.0,), False, (20.0, 20.0), 200.0))
    legs = rays.legs(np.array([0.0, 0.0, 11.0]), points, FAMILIES, 100e3)
    return Pairs(points, legs, legs, np.array(list(product(range(3), repeat=2))), np.ones((9, 5)))


@pytest.fixture(scope="module")
def simulator():
    """The nominal sonar at its only ping, and a window about the points."""
    ready = build_simulator(nominal(track={"window": (0.1, 0.115)}))
    ping_geometry = ready.ping_geometry(0)
    return ready.coherent_accumulator(ping_geometry), ready.incoherent_accumulator(ping_geometry)


def received(reading, *blocks):
    """What a reading makes of some blocks."""
    cells = reading.empty()
    for block in blocks:
        reading.add(cells, block)
    return reading.time_series(cells)


def test_a_leg_weighs_amplitude_beam_and_carrier(pairs):
    """Against numpy's own exponential; levels multiply; a whole cycle more of delay changes nothing."""
    fan = beams(LineArray(length=0.1, steer=[1.4, 1.5], element="omni"), 100e3, 1500.0)
    legs = pairs.transmit_legs
    expected = fan.gain(legs.departure) * legs.amplitude * np.exp(-2j * np.pi * 100e3 * legs.delay)
    np.testing.assert_allclose(leg_weights(legs, fan, 100e3), expected, atol=4e-7 * np.abs(expected).max())
    np.testing.assert_allclose(leg_weights(legs, fan, 100e3, 7.0), 7 * leg_weights(legs, fan, 100e3), rtol=1e-12)
    later = replace(legs, delay=legs.delay + 12_345 / 100e3)
    np.testing.assert_allclose(leg_weights(later, fan, 100e3), expected, atol=4e-7 * np.abs(expected).max())


def test_pressure_adds_whatever_the_blocks(pairs, simulator):
    """Pairs received in two parts, in either order, are the pairs received at once.

    Twice the strength is twice the sound.
    """
    coherent, _ = simulator
    whole = received(coherent, pairs)
    odd, even = pairs.select(np.arange(0, 9, 2)), pairs.select(np.arange(1, 9, 2))
    scale = np.abs(whole).max()
    assert scale > 0
    for parts in permutations((odd, even)):
        np.testing.assert_allclose(received(coherent, *parts), whole, atol=2e-6 * scale)
    np.testing.assert_allclose(
        received(coherent, replace(pairs, stored_strengths=2 * pairs.strength)), 2 * whole, atol=2e-6 * scale
    )


def test_out_and_back_may_change_places(pairs, simulator):
    """Reciprocity of one place: with every pair turned round, both readings are as before."""
    turned = replace(pairs, pair=pairs.pair[:, ::-1].copy())
    for reading in simulator:
        whole = received(reading, pairs)
        np.testing.assert_allclose(received(reading, turned), whole, atol=2e-6 * np.abs(whole).max())


def test_expected_intensity_is_the_mean_over_phases(pairs, simulator):
    """Two methods: the mean squared pressure over drawn phases of the places, 400 draws, and the energy model.

    Few echoes overlap: standard errors are 0.0013 of the peak for a sample and 0.0005 for the sum; five of them.
    """
    coherent, incoherent = simulator
    rng, total = np.random.default_rng(8), 0.0
    for _ in range(400):
        phase = np.exp(2j * np.pi * rng.random(5))
        total = (
            total + np.abs(received(coherent, replace(pairs, scatterers=replace(pairs.scatterers, phase=phase)))) ** 2
        )
    expected = received(incoherent, pairs)
    np.testing.assert_allclose(total / 400, expected, atol=0.0065 * expected.max())
    assert (total / 400).sum() == pytest.approx(expected.sum(), rel=0.0025)


def test_jitter_of_a_wavelength_leaves_no_interference(pairs, simulator):
    """sinc(1) = 0: pairs together are the sum of the pairs alone, while still water lets them interfere."""
    _, still = simulator
    shaken = replace(still, replica_jitter=ReplicaJitter(1, 0, 1.0, 0.0))
    for reading, alike in ((shaken, True), (still, False)):
        whole = received(reading, pairs)
        alone = sum(received(reading, pairs.select(np.array([row]))) for row in range(9))
        assert np.allclose(alone, whole, rtol=0, atol=2e-5 * whole.max()) == alike


def test_amplitude_changes_add_their_mean_energy(pairs, simulator):
    """Without interference, e of up to a half adds a twelfth of the energy: 1 + e^2 / 3."""
    _, still = simulator
    one, more = (replace(still, replica_jitter=ReplicaJitter(1, 0, 1.0, e)) for e in (0.0, 0.5))
    expected = (1 + 0.25 / 3) * received(one, pairs)
    np.testing.assert_allclose(received(more, pairs), expected, atol=1e-6 * expected.max())


def test_pairs_by_other_glints_are_apart(pairs):
    """The parts share the pairs out; a pair and its reverse stay together; labels out and back alike make one part."""
    labelled = replace(
        pairs.transmit_legs, glints=GlintPhasors((-1, 0, 1), np.ones_like(pairs.transmit_legs.reflection_coefficient))
    )
    parts = coherent_subsets(replace(pairs, transmit_legs=labelled, receive_legs=labelled))
    rows = [tuple(map(tuple, part.pair)) for part in parts]
    assert sorted(pair for part in rows for pair in part) == sorted(map(tuple, pairs.pair))
    assert len(parts) == 6 and all({(j, i) for i, j in part} == set(part) for part in rows)
    same = replace(
        pairs.transmit_legs, glints=GlintPhasors((0, 0, 0), np.ones_like(pairs.transmit_legs.reflection_coefficient))
    )
    assert len(coherent_subsets(replace(pairs, transmit_legs=same, receive_legs=same))) == 1
    assert coherent_subsets(pairs) == [pairs]


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_energy_is_kept_from_spikes_to_intensity(seed):
    """Sum of the intensity over time = sum of the energies times the pulse's, wherever in the window they fall."""
    rng = np.random.default_rng(seed)
    delay, energy = rng.uniform(0.101, 0.1025, 40), rng.exponential(size=40)
    cells = GRID.energy_cells(1)
    deposit_energy(cells[0], GRID.first_time, GRID.energy_rate, delay, energy)
    total = convolve_energy(cells, GRID, SPECTRUM).sum() / GRID.sample_rate
    assert total == pytest.approx(energy.sum() * RECEIVED.effective_duration, rel=2e-3)


def test_a_grid_is_linear_and_its_channels_do_not_mix():
    """Rows of two channels are finished as each alone; sums and multiples come out as they went in."""
    rng = np.random.default_rng(5)
    delay, weight = rng.uniform(0.1, 0.104, (2, 30)), rng.normal(size=(2, 30)).astype(np.complex64)
    cells = GRID.cells(2)
    for row, tau, w in zip(cells, delay, weight, strict=True):
        deposit_pressure(row, GRID.first_time, GRID.cell_rate, tau, w)
    both = convolve_pulse(cells, GRID, SPECTRUM)
    for channel in range(2):
        np.testing.assert_array_equal(convolve_pulse(cells[channel : channel + 1], GRID, SPECTRUM)[0], both[channel])
    mixed = convolve_pulse(2 * cells[:1] - 3j * cells[1:], GRID, SPECTRUM)[0]
    np.testing.assert_allclose(mixed, 2 * both[0] - 3j * both[1], atol=5e-6 * np.abs(both).max())


def test_an_even_rain_of_echoes_is_steady():
    """As much energy in every cell is the same intensity at all times: density times the pulse's energy."""
    cells = GRID.energy_cells(1)
    delay = GRID.first_time + np.arange(8 * cells.size) / (8 * GRID.energy_rate)
    deposit_energy(cells[0], GRID.first_time, GRID.energy_rate, delay, np.ones(delay.size))
    steady = 8 * GRID.energy_rate * RECEIVED.effective_duration
    np.testing.assert_allclose(convolve_energy(cells, GRID, SPECTRUM), steady, rtol=2e-3)


@pytest.mark.parametrize(("jitter", "amplitude"), [(0.0, 0.4), (0.3, 0.0), (0.5, 0.9)])
def test_factors_stay_within_what_was_requested(jitter, amplitude):
    """Magnitude within 1 +- e, phase between 0 and -J turns; the ranges are filled to 1 %."""
    factor = ReplicaJitter(3, 2, jitter, amplitude).factor(PLACES, "D", "S")
    size, turn = np.abs(factor), -np.angle(factor) / (2 * np.pi) % 1
    assert size.min() >= 1 - amplitude - 1e-12 and size.max() <= 1 + amplitude + 1e-12
    assert np.ptp(size) == pytest.approx(2 * amplitude, rel=1e-2, abs=1e-12)
    if jitter:
        assert turn.max() <= jitter + 1e-12 and np.ptp(turn) == pytest.approx(jitter, rel=1e-2)
    else:
        np.testing.assert_array_equal(factor.imag, 0)


def test_twice_the_jitter_is_twice_the_phase():
    """The draw does not depend on how much is requested: the factor of 2 J is the square of that of J."""
    one, two = (ReplicaJitter(3, 2, jitter, 0.0).factor(PLACES, "D", "S") for jitter in (0.2, 0.4))
    np.testing.assert_allclose(two, one**2, atol=1e-12)


def test_every_replica_has_its_own_draw():
    """All ordered pairs of rays, further rays of a family among them, of two pings and two seeds: no two alike."""
    rays = ("D", "D2", "S", "B", "SB", "BS", "S3", "SBS", "BSB")
    draws = [ReplicaJitter(seed, ping, 0.9, 0.0).factor(PLACES[:3], out, back)
             for seed in (1, 2) for ping in (0, 1) for out, back in product(rays, repeat=2)]  # fmt: skip
    assert len(np.unique(np.round(draws, 9))) == np.size(draws)


@pytest.mark.parametrize(("out", "back"), list(product(("D", "S", "B", "SB", "BS", "SBS"), repeat=2)))
def test_the_name_of_a_pair_does_not_depend_on_its_order(out, back):
    """Out and back, or back and out; both families stand in it."""
    assert pair_name(out, back) == pair_name(back, out)
    assert sorted(pair_name(out, back).split("-")) == sorted((out, back))


def test_curves_of_a_channel_add_up():
    """Total is contributions and noise, in the channel requested and no other; twice the noise is 3 dB of it."""
    rng = np.random.default_rng(2)
    values = {
        (contribution, ALL): rng.exponential(size=(2, GRID.sample_count)) for contribution in ("seabed", "target")
    }
    for channel in range(2):
        curves = level_curves(values, 0.3, GRID, channel).level_db.sel(pair=ALL)
        power = 10 ** (curves / 10)
        expected = sum(series[channel] for series in values.values()) + 0.3
        np.testing.assert_allclose(power.sel(contribution="total"), expected, rtol=1e-12)
        assert np.isneginf(curves.sel(contribution="surface")).all()
        factor = level_curves(values, 0.6, GRID, channel).level_db.sel(pair=ALL, contribution="noise")
        np.testing.assert_allclose(factor - curves.sel(contribution="noise"), 10 * np.log10(2), rtol=1e-12)


@pytest.mark.parametrize("compress", [False, True])
def test_noise_has_the_colour_of_the_receiver(compress):
    """Mean periodogram of 400 Hann-windowed pieces: the filter's power, to 25 % (five standard errors) of its peak."""
    pulse = receive_pulse(Pulse(frequency=100e3, duration=0.4e-3), Receiver(bandwidth=20e3, matched_filter=compress))
    rate, size = pulse.receiver.sample_rate, 64
    sound = receiver_noise(pulse, 40.0, 1, 0, 1, 400 * size)[0].reshape(400, size)
    window = np.hanning(size)
    found = np.mean(np.abs(np.fft.fft(sound * window)) ** 2, axis=0) / (window**2).sum() / rate
    fine = np.abs(receiver_filter(pulse, np.fft.fftfreq(64 * size, 1 / rate))) ** 2 * 1e4
    leak = np.abs(np.fft.fft(window, 64 * size)) ** 2
    expected = np.fft.ifft(np.fft.fft(fine) * np.fft.fft(leak)).real[::64] / leak.sum()
    np.testing.assert_allclose(found, expected, atol=0.25 * expected.max())
    assert found.sum() == pytest.approx(expected.sum(), rel=0.05)


def test_noise_scales_with_its_level_and_does_not_mind_the_rest():
    """20 dB more is ten times the same noise; a channel is the same among two or five; sweeps pass as much."""
    quiet, strong = (receiver_noise(RECEIVED, level, 4, 1, 2, 500) for level in (30.0, 50.0))
    np.testing.assert_allclose(strong, 10 * quiet, rtol=1e-5, atol=1e-5 * np.abs(strong).max())
    np.testing.assert_array_equal(receiver_noise(RECEIVED, 30.0, 4, 1, 5, 500)[:2], quiet)
    assert noise_intensity(RECEIVED, 50.0) == pytest.approx(100 * noise_intensity(RECEIVED, 30.0), rel=1e-12)
    sweep = {"kind": "lfm", "frequency": 100e3, "duration": 2e-3, "bandwidth": 15e3}
    up, down = (
        receive_pulse(Pulse(**sweep, sweep=way), Receiver(bandwidth=20e3, matched_filter=True))
        for way in ("up", "down")
    )
    assert noise_intensity(up, 40.0) == pytest.approx(noise_intensity(down, 40.0), rel=1e-9)
