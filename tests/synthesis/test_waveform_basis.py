"""Claims about waveform bases: a few waveforms make the echo of every Doppler factor and frequency of the band."""

import numpy as np
import pytest

from insonify.simulator import build_simulator
from insonify.sonar.ping_geometry import PingGeometry
from insonify.sonar.pulse import Pulse
from insonify.synthesis.time_grid import convolve_pulse, convolve_waveforms, grid_factors, time_grid
from insonify.synthesis.waveform_basis import (
    MAX_WAVEFORMS,
    DopplerSpectrum,
    WaveformBasis,
    doppler_nodes,
    doppler_range,
    doppler_spectrum,
    waveform_basis,
)
from oracles.arrays import elements_scenario
from oracles.scenes import nominal
from synthesis.oracle import pulse_spectrum, spikes

TONE = Pulse(kind="cw", frequency=100e3, duration=2e-3)
ONE = {"kind": "point", "element": "omni"}


def underway(**settings):
    """Ping geometry of a sonar at 3 m/s."""
    return build_simulator(elements_scenario([(0, 20, 5)], **settings)).ping_geometry(0)


def test_any_doppler_is_a_sum_of_the_shapes():
    """Waveforms 40 times between and beyond the nodes: the exact stretched pulse, 3e-6 of its peak."""
    here = underway()
    shapes, pulse = waveform_basis(here), here.pulse
    low, high = doppler_range(here)
    time = np.linspace(-1e-4, 7e-4, 200)
    for factor in np.linspace(low, high, 40):
        known = pulse.doppler_filtered(float(factor), np.ones_like).samples(time)
        made = shapes.samples(pulse, time, np.full(len(time), factor))[0]
        assert np.abs(made - known).max() < 3e-6


def test_all_directions_are_within_the_range():
    """An omnidirectional sonar receives from -2 v / c to 2 v / c, and a little more is kept.

    A beam abeam receives less.
    """
    low, high = doppler_range(underway(receive=ONE))
    assert -4.4e-3 < low < -4e-3 and 4e-3 < high < 4.4e-3
    line = {"kind": "line", "length": 0.5}
    narrow = doppler_range(underway(transmit=line, receive=line, receiver={"record": "beams"}))
    assert narrow[1] - narrow[0] < 0.3 * (high - low)


@pytest.mark.parametrize("heading", [0.3, 2.0, 5.9])
def test_the_range_turns_with_the_sonar(heading):
    """The same ship on another course, beams abeam: the same Doppler factors, to rounding."""
    line = {"kind": "line", "length": 0.5}
    first, other = (
        doppler_range(underway(transmit=line, receive=line, receiver={"record": "beams"}, track={"heading": course}))
        for course in (1.0, heading)
    )
    np.testing.assert_allclose(first, other, rtol=0, atol=1e-12)


def test_a_standing_sonar_has_one_shape():
    """At rest, or between hops: the pulse as it was sent."""
    for track in ({"speed": 0.0}, {"stop_and_hop": True}):
        shapes = waveform_basis(underway(track=track))
        assert len(shapes.doppler) == 1 and shapes.doppler[0] == 0


def spectrum_of(gain, peak=0.0):
    """Doppler spectrum of a gain at each of some equal steps."""
    return DopplerSpectrum(-1.0, 1.0, peak, np.asarray(gain))


def interpolation_error(nodes, phase, x):
    """Error of exp(j phase x) as the weighted sum of its values at nodes."""
    basis = WaveformBasis(nodes, (-1.0, 1.0))
    return np.abs(np.exp(1j * phase * basis.doppler) @ basis.weights(x) - np.exp(1j * phase * x))


@pytest.mark.parametrize("phase", [3e-3, 0.3, 2.5])
def test_as_many_nodes_as_the_phase_needs(phase):
    """exp(j phi x) at equal gains: Chebyshev nodes of the whole range; the count holds 1e-6 and two fewer do not."""
    nodes, x = doppler_nodes(spectrum_of(np.ones(129)), phase), np.linspace(-1, 1, 201)

    def chebyshev(n):
        return -np.cos((np.arange(n) + 0.5) * np.pi / n)

    np.testing.assert_allclose(nodes, chebyshev(len(nodes)), atol=1e-15)
    assert interpolation_error(nodes, phase, x).max() < 1.1e-6
    assert len(nodes) <= 2 or interpolation_error(chebyshev(len(nodes) - 2), phase, x).max() > 1e-7


@pytest.mark.parametrize("phase", [0.01, 0.3, 2.5, 8.0])
@pytest.mark.parametrize("peak", [0.0, -0.7, 1.0])
def test_side_lobes_need_fewer_nodes(phase, peak):
    """A main lobe at any factor and side lobes that fall off: error times gain within 1e-6, by fewer waveforms."""
    x = np.linspace(-1, 1, 129)
    gain = np.minimum(1.0, (0.02 / np.maximum(np.abs(x - peak), 1e-9)) ** 2)
    nodes, equal = doppler_nodes(spectrum_of(gain, peak), phase), doppler_nodes(spectrum_of(np.ones(129)), phase)
    assert (gain * interpolation_error(nodes, phase, x)).max() < 1.05e-6
    assert len(nodes) <= len(equal) - (phase < 8)  # errors of many nodes grow too fast beyond them


def test_there_is_an_end_to_it():
    """A phase of hundreds of turns would take hundreds of waveforms: the count stops; such scenarios are refused."""
    for phase in (2e3, 1e12):
        assert len(doppler_nodes(spectrum_of(np.ones(129)), phase)) == MAX_WAVEFORMS


def gain_towards(here: PingGeometry, direction):
    """Two-way gain of the first beams [1], and the Doppler factor less one, in some directions."""
    gain = np.abs(here.transmit_beams.gain(direction)[0] * here.receive_beams.gain(direction)[0])
    closing = direction @ here.transmit_velocity / here.sound_speed
    return gain, (1 + closing) / (1 - closing) - 1


@pytest.mark.parametrize("changes", [{}, {"heading": 2.0}, {"speed": 1.0}])
def test_no_direction_is_stronger_than_in_the_spectrum(changes):
    """Half a million directions: gain re the largest at most that at the direction's Doppler factor."""
    line = {"kind": "line", "length": 0.5}
    here = underway(transmit=line, receive=line, receiver={"record": "beams"}, track=changes)
    spectrum, rng = doppler_spectrum(here), np.random.default_rng(1)
    direction = rng.normal(size=(500_000, 3))
    gain, factor = gain_towards(here, direction / np.linalg.norm(direction, axis=1, keepdims=True))
    within = (factor > spectrum.low) & (factor < spectrum.high)
    steps = np.linspace(spectrum.low, spectrum.high, len(spectrum.gain))
    bound = np.interp(factor[within], steps, spectrum.gain)
    assert (gain[within] / gain.max() <= 1.001 * bound).all()
    assert (gain[~within] / gain.max() < 10 ** (-60 / 20)).all()
    assert spectrum.gain.min() < 0.1 and spectrum.gain.max() == 1


def test_echoes_of_a_narrow_beam_have_few_waveforms():
    """A beam of 2 degrees abeam: errors re an echo on its axis of 1e-6 everywhere, by fewer waveforms than without."""
    line = {"kind": "line", "length": 0.5}
    settings = {"transmit": line, "receive": line, "receiver": {"record": "beams"}}
    here = underway(pulse={"kind": "cw", "frequency": 100e3, "duration": 2e-3}, **settings)
    basis, pulse = waveform_basis(here), here.pulse
    spectrum = doppler_spectrum(here)
    phase = np.pi * (100e3 + pulse.pulse.bandwidth / 2) * 2e-3 * (spectrum.high - spectrum.low) / 2
    assert len(basis.doppler) < len(doppler_nodes(spectrum_of(np.ones(129)), phase))
    time, steps = np.linspace(-1e-4, 2.2e-3, 300), np.linspace(spectrum.low, spectrum.high, len(spectrum.gain))
    for factor in np.linspace(spectrum.low, spectrum.high, 30):
        known = pulse.doppler_filtered(float(factor), np.ones_like).samples(time)
        made = basis.samples(pulse, time, np.full(len(time), factor))[0]
        assert np.abs(made - known).max() * np.interp(factor, steps, spectrum.gain) < 3e-6


def test_shapes_are_finished_together_as_they_are_one_by_one():
    """A sum of transforms is the transform of the sum: two bands, three factors, two channels, 1e-6."""
    grid = time_grid(0.0, 0.02, 25e3, -1e-3, 1e-3)
    random = np.random.default_rng(2)
    _, noise = spikes(2 * 2 * 3 * grid.cells().size, 0, 1)
    cells = noise.reshape(2, 2, 3, -1)
    spectra = pulse_spectrum(grid.frequencies) * random.normal(size=(2, 3, 1))
    together = convolve_waveforms(cells[..., None], grid, grid_factors(grid, spectra))
    apart = sum(convolve_pulse(cells[b, :, d], grid, spectra[b, d]) for b in range(2) for d in range(3))
    assert np.abs(together - apart).max() < 1e-6 * np.abs(apart).max()


def test_bands_make_the_whole():
    """Shares of one add to one: all bands at unit weight are the pulse itself, and their samples too."""
    here = underway(track={"speed": 0.0}, receiver={"sub_bands": 4})
    shapes, frequencies = waveform_basis(here), np.linspace(-12e3, 12e3, 99)
    spectra = shapes.spectra(here.pulse, frequencies)
    assert spectra.shape == (4, 1, 99)
    np.testing.assert_allclose(spectra.sum(axis=(0, 1)), here.pulse.spectrum(frequencies), atol=1e-12)
    time = np.linspace(0, 5e-4, 30)
    made = shapes.samples(here.pulse, time, np.zeros(30)).sum(axis=0)
    np.testing.assert_allclose(made, here.pulse.samples(time), atol=2e-6)


def test_kept_factors_are_those_of_their_own_sonar():
    """Other speeds, pulses and windows in turn: each has what it had when it came first, and what is made anew."""
    changes = [{}, {"track": {"speed": 2.0}}, {"pulse": TONE.model_dump()}, {"track": {"window": (0.0, 0.2)}}]
    cases = []
    for change in changes:
        simulator = build_simulator(elements_scenario([(0, 20, 5)], **change))
        here = simulator.ping_geometry(0)
        cases.append((waveform_basis(here), here.pulse, simulator.grid))
    first = [shapes.grid_factors(pulse, grid).copy() for shapes, pulse, grid in cases]
    for (shapes, pulse, grid), factors in zip(cases, first, strict=True):
        np.testing.assert_array_equal(shapes.grid_factors(pulse, grid), factors)
        np.testing.assert_array_equal(grid_factors(grid, shapes.spectra(pulse, grid.frequencies)), factors)
    assert len({factors.tobytes() for factors in first}) == len(changes)


@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_platform_that_rolls_about_its_arrays_has_one_waveform():
    """Nothing moves along a ray: one waveform, without Doppler."""
    scenario = nominal(track={"motion": {"roll": {"rms": "1 deg", "period": "6 s"}}, "window": (0.02, 0.021)})
    geometry = build_simulator(scenario).ping_geometry(0)
    assert geometry.receive_motion is not None
    basis = waveform_basis(geometry)
    assert basis.doppler.tolist() == [0.0] and basis.doppler_limits == (0.0, 0.0)
