"""Claims about shapes: a few waveforms make the echo of every Doppler factor, and of every place in the band."""

import numpy as np
import pytest

from insonify.simulator import build_simulator
from insonify.sonar.pulse import Pulse
from insonify.synthesis.time_grid import convolve_pulse, convolve_waveforms, time_grid
from insonify.synthesis.waveform_basis import (
    MAX_WAVEFORMS,
    WaveformBasis,
    doppler_node_count,
    doppler_range,
    waveform_basis,
)
from oracles.arrays import elements_scenario
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


@pytest.mark.parametrize("width", [1e-5, 1e-3, 8e-3])
def test_as_many_nodes_as_the_phase_needs(width):
    """exp(j phi x) by n Chebyshev nodes: the count holds 1e-6 and two fewer do not."""
    count = doppler_node_count(TONE, width)
    phi = np.pi * TONE.frequency * TONE.duration * width / 2
    x = np.linspace(-1, 1, 201)

    def worst(n):
        node = WaveformBasis(-np.cos((np.arange(n) + 0.5) * np.pi / n))
        return np.abs(np.exp(1j * phi * node.doppler) @ node.weights(x) - np.exp(1j * phi * x)).max()

    assert worst(count) < 1.1e-6
    assert count <= 2 or worst(count - 2) > 1e-7


def test_there_is_an_end_to_it():
    """A second of tone at any speed would take hundreds: the count stops, and such scenarios are refused."""
    assert doppler_node_count(TONE.model_copy(update={"duration": 1.0}), 0.05) == MAX_WAVEFORMS


def test_shapes_are_finished_together_as_they_are_one_by_one():
    """A sum of transforms is the transform of the sum: two bands, three factors, two channels, 1e-6."""
    grid = time_grid(0.0, 0.02, 25e3, -1e-3, 1e-3)
    random = np.random.default_rng(2)
    _, noise = spikes(2 * 2 * 3 * grid.cells().size, 0, 1)
    cells = noise.reshape(2, 2, 3, -1)
    spectra = pulse_spectrum(grid.frequencies) * random.normal(size=(2, 3, 1))
    together = convolve_waveforms(cells[..., None], grid, spectra)
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


def test_kept_spectra_are_those_of_their_own_sonar():
    """Other speeds, pulses and windows in turn: each has what it had when it came first, and what is made anew."""
    changes = [{}, {"track": {"speed": 2.0}}, {"pulse": TONE.model_dump()}, {"track": {"window": (0.0, 0.2)}}]
    cases = []
    for change in changes:
        simulator = build_simulator(elements_scenario([(0, 20, 5)], **change))
        here = simulator.ping_geometry(0)
        cases.append((waveform_basis(here), here.pulse, simulator.grid.frequencies))
    first = [shapes.spectra(pulse, frequencies).copy() for shapes, pulse, frequencies in cases]
    for (shapes, pulse, frequencies), spectra in zip(cases, first, strict=True):
        np.testing.assert_array_equal(shapes.spectra(pulse, frequencies), spectra)
        np.testing.assert_array_equal(shapes._spectra(pulse, frequencies), spectra)
    assert len({spectra.tobytes() for spectra in first}) == len(changes)
