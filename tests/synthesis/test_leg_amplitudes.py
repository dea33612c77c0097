"""Claims about amplitudes of legs in one beam: its gain in the direction of the leg in the frame of the array."""

import numpy as np
import pytest

from insonify.sonar.array import PlanarArray
from insonify.sonar.beam import beams
from insonify.synthesis._fast_reverberation_energies import BLOCK, MovingArray, leg_amplitudes

COUNT = BLOCK + 7
RATE = np.array([[0.0, -0.2, 0.05], [0.2, 0.0, -0.1], [-0.05, 0.1, 0.0]])


@pytest.mark.parametrize(("drift", "rate"), [(0, 0), (1, 0), (1, 1), (0, 1)])
def test_amplitudes_are_those_of_the_beam_where_the_array_is(drift, rate):
    """Random directions, more than a block: an array at rest, one that moves, one that moves and rotates, or rotates.

    To float32, in which amplitudes are kept.
    """
    rng = np.random.default_rng(3)
    beam = beams(PlanarArray(width=0.3, height=0.05, steer=(0.0,)), 100e3, 1500.0)
    departure = rng.normal(size=(2, 3, COUNT))
    departure = (departure / np.linalg.norm(departure, axis=1, keepdims=True)).astype(np.float32)
    amplitude = rng.normal(size=(2, COUNT)) + 1j * rng.normal(size=(2, COUNT))
    amplitude[:, ::9] = 0.0
    amplitude, delay = amplitude.astype(np.complex64), rng.uniform(0.0, 0.2, (2, COUNT))
    axes = np.array([beam.axes, rate * beam.axes @ RATE, rate * beam.axes @ RATE @ RATE / 2])
    displacement = drift * np.array([[0.02, -0.01, 0.03], [0.1, 0.2, -0.1]])
    out = np.empty((2, COUNT), np.float32)
    array = MovingArray(axes, displacement, bool(drift or rate), bool(rate))
    leg_amplitudes(departure, amplitude, delay, beam.kernel_tables, array, out)
    for f, k in np.ndindex(2, COUNT):
        t = delay[f, k]
        turned = axes[0] + t * (axes[1] + t * axes[2])
        seen = turned @ (departure[f, :, k] - displacement[0] - t * displacement[1])
        length = np.linalg.norm(seen) if drift or rate else 1.0  # float32: not quite 1
        gain = beam.gain(beam.axes.T @ seen / length)[0]
        assert out[f, k] == pytest.approx(abs(amplitude[f, k]) * gain, rel=3e-6, abs=1e-7)
