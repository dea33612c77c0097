"""Claims about bottom detection: where the bed is, by amplitude and by phase."""

import numpy as np
import pytest

from insonify.frames import direction
from insonify.processing import amplitude_detection, beamform_delay_sum, bottom_detection, phase_detection
from oracles.point_echoes import bell, speckle, two_way

F, C, RATE, DEPTH, COUNT = 200e3, 1500.0, 20e3, 15.0, 32
PITCH = C / F / 2
LINE = np.stack([0 * np.arange(COUNT), (np.arange(COUNT) - (COUNT - 1) / 2) * PITCH, 0 * np.arange(COUNT)], axis=1)
ANGLES = np.radians(np.arange(-60, 61, 10.0))
TIME = np.arange(2 * 12 / C, 2 * 42 / C, 1 / RATE)


def survey(pings=10, slope=0.0):
    """Beams of the whole line and of its halves, about one centre, over a bed of the given slope to starboard."""
    rng = np.random.default_rng(6)
    # angles from straight down, towards starboard
    looks = direction(np.pi / 2, np.pi / 2 - ANGLES)
    halves = np.arange(COUNT) < COUNT // 2
    for _ in range(pings):
        across = rng.uniform(-38, 38, 2400)
        points = np.stack([0 * across, across, DEPTH + slope * across], axis=-1)
        far = np.linalg.norm(points, axis=1)
        weight = np.exp(2j * np.pi * rng.uniform(size=across.size)) / far
        series = speckle(TIME, two_way(points, np.zeros(3), LINE), F, bell(4e3), weight, 2.5e-4)
        yield [
            beamform_delay_sum(series, LINE, TIME, looks, centre_frequency=F, shading=shading)
            for shading in (np.hanning(COUNT + 2)[1:-1], ~halves * 1.0, halves * 1.0)
        ]


def test_a_flat_bed_is_found_at_its_depth_in_every_beam():
    """15 m below, -60 to 60 degrees: mean of ten pings within 0.6 % of the depth, single beams within 3 %."""
    found = [bottom_detection(*beams, TIME) for beams in survey()]
    depth = np.array([d.time for d in found]) * C / 2 * np.cos(ANGLES)
    assert np.all(np.isfinite(depth))
    np.testing.assert_allclose(depth.mean(axis=0), DEPTH, rtol=0.006)
    assert np.mean(np.abs(depth / DEPTH - 1) < 0.03) > 0.95
    by_phase = np.array([d.is_by_phase for d in found])
    # straight down the echo is short and its phase gives nothing
    assert by_phase[:, np.abs(ANGLES) > 0.8].mean() > 0.8
    spread = np.std([d.time for d in found], axis=0)[np.abs(ANGLES) > 0.8]
    estimated = np.mean([d.standard_deviation for d in found], axis=0)[np.abs(ANGLES) > 0.8]
    assert np.all(estimated < 4 * spread + 1e-5) and np.all(estimated > spread / 8)


def test_phase_resolves_flat_beams_better_than_amplitude():
    """At 50 and 60 degrees the zero of the phase scatters less than the middle of the echo."""
    flat, by_amplitude, by_phase = np.abs(ANGLES) > 0.8, [], []
    for full, fore, aft in survey():
        strong, echo = amplitude_detection(np.abs(full) ** 2, TIME)
        by_amplitude.append(strong.time[flat])
        by_phase.append(phase_detection(fore, aft, TIME, echo).time[flat])
    middle = 2 * DEPTH / C / np.cos(ANGLES[flat])
    assert np.nanstd(by_phase - middle) < 0.7 * np.std(by_amplitude - middle)


def test_a_symmetric_echo_has_its_middle_in_the_middle():
    """A bell of power in time, 30 dB over a floor; its spread is its own."""
    time = np.arange(400) * 1e-4
    power = np.exp(-0.5 * ((time - 0.01234) / 8e-4) ** 2)[None] + 1e-3
    found, echo = amplitude_detection(power, time, looks=1)
    assert found.time[0] == pytest.approx(0.01234, abs=2e-5)
    assert echo[0] == pytest.approx([123.4 - 17.2, 123.4 + 18.2], abs=1)  # sqrt(2 ln 10) deviations either way


@pytest.mark.parametrize("shift", [0.0, 2.0])
def test_a_straight_phase_is_read_where_it_is_zero(shift):
    """A phase of 700 rad/s through zero, wrapped, with amplitude elsewhere; half-turn offsets are not mistaken."""
    time = np.arange(200) * 1e-4
    zero = 0.0103
    strong = np.exp(-0.5 * ((time - zero - shift * 1e-3) / 2e-3) ** 2)
    fore = (strong * np.exp(0.5j * 700 * (time - zero)))[None]
    found = phase_detection(fore, np.conj(fore), time, np.array([[20, 180]]), looks=1)
    assert found.time[0] == pytest.approx(zero, abs=1e-7)
    assert found.is_by_phase[0]


def test_where_nothing_is_received_nothing_is_found():
    """Silence, and an echo of three samples."""
    silent, _ = amplitude_detection(np.zeros((1, 50)), np.arange(50) * 1e-4)
    assert np.isnan(silent.time[0])
    still = np.ones((1, 50), complex)
    assert np.isnan(phase_detection(still, still, np.arange(50) * 1e-4, np.array([[4, 7]])).time[0])
    with pytest.raises(ValueError, match="looks is 4"):
        amplitude_detection(np.ones((1, 50)), np.arange(50) * 1e-4, looks=4)
    with pytest.raises(ValueError, match=r"give \(beam, time\), with 49 times"):
        amplitude_detection(np.ones((1, 50)), np.arange(49) * 1e-4)
