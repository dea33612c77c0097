"""Claims about synthetic apertures of simulated elements: what can be focused is coherent."""

import numpy as np
import pytest
from scipy.special import jv
from scipy.stats import kstest

from insonify.processing import compressed_recording, parabolic_peak, synthetic_aperture_image
from insonify.scenario.scenario import Scenario
from insonify.simulator import simulate
from oracles import aperture
from oracles.aperture import CARRIER, ELEMENT, GROUND, SLANT, SPEED, strip

TARGET = np.array([0.0, GROUND, 20.0])
NORTH = np.arange(-120, 121, 3) * 1e-3
EAST = GROUND + np.arange(-90, 91, 3) * 1e-3
UNIT = 1e10 / SLANT**2
"""Pressure of the target's echo on both axes [uPa]."""


def recorded(scenario):
    """The recording after its matched filter."""
    return compressed_recording(simulate(scenario), scenario.sonar.pulse)


@pytest.fixture(scope="module")
def still():
    """Thirty-six pings of four elements, stop and hop: phase centres 5 cm apart on 7 m."""
    return recorded(strip([TARGET], receiver={"sub_bands": 4}))


def cut(recording, north, east, **options):
    """Row or column of the image [1]."""
    options = {"stop_and_hop": True, **options}
    return synthetic_aperture_image(recording, north, east, 20.0, **options).pressure.values.ravel() / UNIT


@pytest.mark.parametrize("widest_deg", [90.0, 4.0])
def test_a_point_is_the_exact_sum_of_its_echoes(still, widest_deg):
    """Image, 3 dB widths and side lobes along and across, against float64 sums over frequencies with their own beams.

    Bars of 3 % and 0.3 dB; four sub-bands hold 0.5 % of the peak. All angles, and those within 4 degrees.
    """
    widest = np.radians(widest_deg)
    sent = aperture.steps()
    received = aperture.elements(sent)
    for north, east, axis in ((NORTH, np.array([GROUND]), NORTH), (np.zeros(1), EAST, EAST)):
        pixels = np.stack([np.repeat(north, east.size), np.tile(east, north.size), np.full(axis.size, 20.0)], axis=-1)
        truth = aperture.image(pixels, TARGET, sent, received, widest=widest) * SLANT**2
        found = cut(still, north, east, max_angle=widest)
        assert np.abs(found - truth).max() < 0.005 * np.abs(truth).max()
        assert aperture.width(axis, found) == pytest.approx(aperture.width(axis, truth), rel=0.03)
        assert aperture.side_lobe(found) == pytest.approx(aperture.side_lobe(truth), abs=0.3)
        assert axis[np.argmax(np.abs(found))] == pytest.approx(axis[axis.size // 2], abs=1e-9)


def test_one_band_blurs_a_point_by_what_its_beams_do_within_the_band(still):
    """Elements of 0.1 m over 30 kHz as one band: a few per cent of the peak beside it, nothing of the width (3 %)."""
    single = recorded(strip([TARGET], receiver={"sub_bands": 1}))
    found, right = (cut(held, [0.0], EAST) for held in (single, still))
    off = np.abs(found - right).max() / np.abs(right).max()
    assert 0.02 < off < 0.06
    assert aperture.width(EAST, found) == pytest.approx(aperture.width(EAST, right), rel=0.03)


def test_a_sonar_that_runs_on_while_it_receives_leaves_the_point_where_it_is():
    """3 m/s, no stop and hop: in place if the processor knows; if not, v R / c and half a pulse's way astern.

    When the echo comes the receiver is 2 v R / c ahead, so the phase centre, half way between the ends, is v R / c =
    6.0 cm ahead of where stop and hop has it (phase centres as in Bellettini & Pinto 2002, IEEE J. Oceanic Eng. 27(4),
    not verified; the step is geometry). The echo's phase is that of the pulse's middle: v T / 2 = 1.5 mm more. Pixels
    of 2 mm, a parabola between them: 0.5 mm.
    """
    fast = recorded(strip([TARGET], track={"speed": 3.0, "interval": 0.2 / 3, "stop_and_hop": False}))
    north = np.arange(-100, 101, 2) * 1e-3
    moving, hopping = (np.abs(cut(fast, north, [GROUND], stop_and_hop=hop)) for hop in (False, True))
    assert parabolic_peak(moving, 2e-3, north[0])[0] == pytest.approx(0, abs=5e-4)
    shift = -3.0 * (SLANT / SPEED + 0.5e-3)
    assert parabolic_peak(hopping, 2e-3, north[0])[0] == pytest.approx(shift, abs=5e-4)
    assert hopping.max() < 1.005 * moving.max()


@pytest.mark.parametrize("error", [0.005, 0.01, 0.02])
def test_a_wrong_sound_speed_defocuses_by_its_quadratic_phase(still, error):
    """Loss of the peak within 0.15 dB and width within 3 % of Fresnel's integral over a phase of about 2 k e u^2 / R.

    A speed too high by e puts the point at R (1 + e), where a pixel at x needs 2 k sqrt(R^2 + (u - x)^2 / (1 + e)^2):
    what the aperture has too much is k u^2 / R (1 - (1 + e)^-2). Its weight is that of both beams, sinc^2.
    """
    speed, slant = SPEED * (1 + error), SLANT * (1 + error)
    north, wave = np.arange(-160, 161, 4) * 1e-3, 2 * np.pi * CARRIER / SPEED
    found = np.abs(cut(still, north, [np.sqrt(slant**2 - 9.0**2)], sound_speed=speed))
    u = np.linspace(-3.5, 3.5, 4001)
    weight = np.sinc(ELEMENT * CARRIER / SPEED * u / np.hypot(u, SLANT)) ** 2
    scale = (1 + error) ** -2
    turn = wave / SLANT * (u**2 * (1 - scale) - 2 * scale * np.multiply.outer(north, u))
    expected = np.abs(np.exp(1j * turn) @ weight) / weight.sum()
    sharp = np.abs(cut(still, [0.0], [GROUND]))[0]
    assert 20 * np.log10(found.max() / sharp / expected.max()) == pytest.approx(0, abs=0.15)
    assert aperture.width(north, found) == pytest.approx(aperture.width(north, expected), rel=0.03)


def speckle(pings, seed=1):
    """Power of an image of a flat bed 12 m off, one pixel to a resolution cell, over its mean at that range.

    Elements of 0.2 m at 100 kHz, seen within 3.5 degrees: cells of 5.5 cm along and, with 20 kHz, 4 cm across.
    """
    pitch, altitude, carrier = 0.2, 6.0, 100e3
    places = [(0.0, (n - 1.5) * pitch, 0.0) for n in range(4)]
    scenario = strip(
        seed=seed, paths={"contributions": ["seabed"], "beam_cutoff_db": -30},
        sonar={"pulse": {"kind": "lfm", "frequency": carrier, "bandwidth": 20e3, "duration": 1e-3},
               "transmit": {"kind": "line", "length": pitch},
               "receive": {"kind": "elements", "positions": places, "size": (pitch, 0.0)},
               "receiver": {"bandwidth": 26e3, "record": "elements", "synthetic_aperture": 1.5}},
        track={"start": (0.0, 0.0, 20 - altitude), "speed": 4.0, "pings": pings, "window": (0.0148, 0.0212)},
    )  # fmt: skip
    held = recorded(scenario)
    north = np.arange(1.0, 0.4 * pings - 1.4, 0.06)
    east = np.sqrt(np.arange(11.4, 14.6, 0.045) ** 2 - altitude**2)
    image = synthetic_aperture_image(held, north, east, 20.0, stop_and_hop=True, max_angle=np.radians(3.5))
    power = np.abs(image.pressure.values) ** 2
    trend = np.exp(np.polyval(np.polyfit(east, np.log(power.mean(axis=0)), 2), east))
    return (power / trend).ravel() / np.mean(power / trend)


def test_a_focused_bed_speckles():
    """Flat bed, 24 pings, some 5000 cells: scintillation index 2.0 +- 0.2 (three standard errors of 0.065)."""
    assert np.mean(speckle(24) ** 2) == pytest.approx(2.0, abs=0.2)


@pytest.mark.validate
def test_a_focused_bed_speckles_as_rayleigh_predicted():
    """120 pings, some 40 000 cells: index 2.0 +- 0.1 (0.023 standard error), Kolmogorov-Smirnov distance below 0.02."""
    power = speckle(120)
    assert np.mean(power**2) == pytest.approx(2.0, abs=0.1)
    assert kstest(power, "expon").statistic < 0.02


@pytest.mark.parametrize("swing", [0.5, 1.8])
def test_sway_that_the_log_lacks_makes_paired_echoes(tmp_path, swing):
    """A sonar that sways as a sine of 1 m, its log straight: copies at n wavelength R / 2 m, as strong as J_n(swing).

    The phase swings by 2 k a cos(depression). Within 0.02 of the sharp peak, for a band so narrow (5 kHz) that the
    copies do not walk. With the true way the point is sharp again.
    Source: Jacobi and Anger's expansion of exp(j z sin x), Abramowitz & Stegun (1964), 9.1.41.
    """
    pings, wave = 141, 2 * np.pi * CARRIER / SPEED
    time, north = 0.1 * np.arange(pings), -3.5 + 0.05 * np.arange(pings)
    sway = swing / (2 * wave * GROUND / SLANT) * np.sin(2 * np.pi * north)
    rows = ["time [s],north [m],east [m],depth [m],heading [deg]"]
    rows += [f"{t:.3f},{x:.6f},{y:.9f},11.0,0" for t, x, y in zip(time, north, sway, strict=True)]
    log = tmp_path / "way.csv"
    log.write_text("\n".join(rows))
    scenario = strip(
        [TARGET], places=[0.0], sonar={"pulse": {**aperture.SWEEP, "bandwidth": 5e3}}, receiver={"bandwidth": 8e3}
    )
    track = {"kind": "navigation", "file": str(log), "interval": 0.1, "pings": pings, "window": (0.038, 0.043),
             "stop_and_hop": True}  # fmt: skip
    held = recorded(Scenario(**scenario.model_dump(mode="json", exclude={"track"}), track=track))
    straight = held.assign(logged_position=held.logged_position * [1, 0, 1])
    order = np.arange(-3, 4)
    places = order * SPEED / CARRIER * SLANT / 2
    sharp = np.abs(cut(held, [0.0], [GROUND]))[0]
    copies = np.abs(cut(straight, places, [GROUND])) / sharp
    np.testing.assert_allclose(copies, np.abs(jv(order, swing)), atol=0.02)
    assert np.abs(cut(straight, [0.0], [GROUND], navigation="true"))[0] == pytest.approx(sharp, rel=1e-6)
