"""Claims about beams made of simulated elements: the pattern of a line, and a focus close by."""

import numpy as np
import pytest

from insonify.processing import beam_recording
from insonify.simulator import simulate
from oracles.arrays import elements_scenario, line_of
from oracles.scenes import nominal
from oracles.smooth import ROUGH

WAVE, COUNT = 0.015, 64
ABEAM = np.pi / 2


def echo(target, count, window):
    """A target seen from the origin, 6 m deep, received by a line along the keel, half a wavelength to an element."""
    scenario = elements_scenario(
        [target], receive=line_of(count, count * WAVE / 2), paths={"max_reflections": 0, "contributions": ["target"]},
        pulse={"kind": "cw", "frequency": 100e3, "duration": 1e-3},
        track={"speed": 0.0, "heading": 0.0, "start": (0.0, 0.0, 6.0), "window": window},
    )  # fmt: skip
    return simulate(scenario)


def test_beams_of_simulated_elements_have_the_pattern_of_their_line():
    """64 elements, a target 60 m off 4 degrees ahead of abeam: main lobe within 0.1 dB to -3 dB, first lobe -13.3 dB.

    Beams every 0.05 degrees from -10 to 10 re abeam: sin(N x) / (N sin x), x = pi / 2 (sine of the beam less the
    target's); the strongest beam is the target's.
    """
    bearing, steer = np.radians(-4.0), np.radians(np.arange(-10, 10.01, 0.05))
    held = echo((60 * np.cos(ABEAM + bearing), 60 * np.sin(ABEAM + bearing), 6.0), COUNT, (0.0795, 0.0815))
    beams = np.abs(beam_recording(held, ABEAM + steer).pressure.values[0])
    level = beams[:, np.argmin(np.abs(held.time.values - 120 / 1500 - 0.5e-3))]
    level = 20 * np.log10(level / 1e10 * 60**2)
    x = np.pi / 2 * (np.sin(steer) - np.sin(bearing))
    x[np.abs(x) < 1e-12] = 1e-12
    expected = 20 * np.log10(np.abs(np.sin(COUNT * x) / (COUNT * np.sin(x))) + 1e-9)
    main = expected > -3
    np.testing.assert_allclose(level[main], expected[main], atol=0.1)
    assert np.degrees(steer[np.argmax(level)]) == pytest.approx(-4.0, abs=0.03)
    lobes = level[1:-1][(level[1:-1] > level[:-2]) & (level[1:-1] > level[2:])]
    assert np.sort(lobes)[-2] == pytest.approx(-13.3, abs=0.3)


def test_a_simulated_echo_close_by_needs_a_focus():
    """200 elements on 1.5 m, a target 10 m abeam: with dynamic focus its level to 0.2 dB, without what phases leave.

    Plane-wave delays are wrong by up to 12 radians at the ends: the mean of exp(j phase) over the line, in dB to 0.2.
    """
    held = echo((0.0, 10.0, 6.0), 200, (0.0128, 0.0148))
    middle = np.argmin(np.abs(held.time.values - 20 / 1500 - 0.5e-3))
    focused, far = (
        np.abs(beam_recording(held, [ABEAM], focus=focus, transmitter_position=(0, 0, 0)).pressure.values[0, 0, middle])
        / 1e8
        for focus in ("dynamic", "far")
    )
    away = np.hypot((np.arange(200) - 99.5) * WAVE / 2, 10.0)
    left = np.abs(np.mean(np.exp(2j * np.pi * (away - 10) / WAVE) * 10 / away))
    assert 20 * np.log10(focused) == pytest.approx(0, abs=0.2)
    assert 20 * np.log10(far / left) == pytest.approx(0, abs=0.2)
    assert left < 0.5


def smooth_box(heading, **receive):
    """A smooth box 30 m away, received by a line of 27 wavelengths whose band is 40 % of its frequency."""
    receiver = {"bandwidth": 20e3, "sub_bands": 6, "record": "elements" if receive else "beams"}
    pulse = {"kind": "cw", "frequency": 50e3, "duration": 1e-4, "taper": "tukey", "taper_fraction": 0.2}
    body = {"position": (0.0, 30.5), "heading": heading, "face_reflection_coefficient": 0.9, "scattering": ROUGH}
    return simulate(
        nominal(
            box=body, line={"length": 0.8}, receive=receive, sonar={"pulse": pulse, "receiver": receiver},
            track={"window": (0.040, 0.044)}, paths={"max_reflections": 0, "contributions": ["target"]},
        )
    )  # fmt: skip


@pytest.mark.parametrize("heading", [0.0, 0.1])
def test_a_smooth_box_by_elements_is_that_box_by_a_beam(heading):
    """At the specular direction and 50 dB below it: samples agree within 0.2 % of the largest, energies to 0.02 dB.

    Both with patterns at six frequencies of the band; with one, a beam is 31 % of the largest sample off at 0.1 rad.
    """
    beam = smooth_box(heading).pressure.values[0, 0]
    formed = beam_recording(smooth_box(heading, elements=54), [ABEAM], elevation=np.arctan2(8.5, 30.0))
    elements = formed.pressure.values[0, 0]
    assert np.abs(elements - beam).max() < 2e-3 * np.abs(beam).max()
    assert 10 * np.log10(np.mean(np.abs(elements) ** 2) / np.mean(np.abs(beam) ** 2)) == pytest.approx(0, abs=0.02)
