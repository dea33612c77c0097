"""Claims about the numbers beside a product: what is known of a made-up measurement comes out of it, and no more."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.demos.products import coherent_sidescan, forward_looking, interferometric, multibeam
from insonify.demos.products import synthetic_aperture as aperture
from insonify.demos.products.peaks import parabolic_peak_position, width
from insonify.plotting.multipath_view import PassByLevels, TargetEcho
from insonify.plotting.soundings import SwathSoundings
from insonify.plotting.strip_map import PointResponse, StripMap
from insonify.scenario.scenario import Scenario
from insonify.scenario.template import load_template

HAMMING_WIDTH = 1.3030
"""Width at -3 dB of the spectrum of a Hamming window [1 / length]; Harris (1978) has 1.30 bins."""


@lru_cache(maxsize=8)
def demo(name):
    """The scenario of a demonstration."""
    return load_template(name)


def values_of(numbers):
    """Values by name."""
    return {number.name: number.value for number in numbers}


@given(st.floats(-0.49, 0.49), st.floats(0.5, 20), st.floats(-200, 200), st.floats(0.001, 10))
def test_the_summit_of_a_parabola_is_found_wherever_it_stands(place, bend, level, step):
    """Off by any part of a step, of any height and bend, on any spacing: exact to rounding."""
    samples = np.arange(-6.0, 7.0)
    values = level - bend * (samples - place) ** 2
    found = parabolic_peak_position(step * samples, values, int(np.argmax(values)))
    assert found == pytest.approx(step * place, abs=1e-9 * step * max(1, abs(level)))


@pytest.mark.parametrize("top", [0, 4])
def test_a_peak_at_the_edge_of_what_was_received_is_the_edge(top):
    """There is no sample beyond it to state more."""
    level = np.array([4.0, 3, 2, 1, 0])[:: 1 if top == 0 else -1]
    assert parabolic_peak_position(np.arange(5.0), level, top) == top


@given(st.floats(0.5, 5), st.floats(-90, 90), st.floats(0.1, 5))
def test_the_width_of_a_triangle_is_that_of_similar_triangles(slope, level, below):
    """Sides of any slope [dB/step]: twice `below` over the slope, wherever between the samples that is."""
    place = np.arange(-60.0, 61.0)
    assert width(place, level - slope * np.abs(place), 60, below) == pytest.approx(2 * below / slope, rel=1e-6)


def test_the_beam_of_a_line_is_the_sum_over_its_elements():
    """Levels off the axis against a plain sum of phasors of 32 Hamming-weighted elements, down to -50 dB."""
    scenario = demo("forward-looking")
    frequency, speed = scenario.sonar.pulse.frequency, scenario.water.sound_speed
    place = (np.arange(32) - 15.5) * 0.24 / 32
    weight = 0.54 + 0.46 * np.cos(2 * np.pi * place / 0.24)
    sine = np.linspace(-0.4, 0.4, 401)
    sums = np.exp(2j * np.pi * frequency / speed * np.outer(sine, place)) @ weight / weight.sum()
    expected = 20 * np.log10(np.maximum(np.abs(sums), 1e-3))
    found = forward_looking.expected_pattern(scenario, sine)
    strong = expected > -50
    np.testing.assert_allclose(found[strong], expected[strong], atol=0.05)


def test_the_width_of_a_beam_is_the_hamming_windows():
    """1.303 wavelengths over the line's 24 cm, as an angle ahead, within half a hundredth."""
    scenario = demo("forward-looking")
    wavelength = scenario.water.sound_speed / scenario.sonar.pulse.frequency
    assert np.sin(forward_looking.beam_width(scenario)) == pytest.approx(HAMMING_WIDTH * wavelength / 0.24, rel=5e-3)


def test_the_hamming_width_is_that_of_its_spectrum():
    """The constant beside a synthetic aperture's range cells, from a plain Fourier sum of the window."""
    x = (np.arange(4000) + 0.5) / 4000 - 0.5
    frequency = np.linspace(0, 1.2, 2401)
    spectrum = np.cos(2 * np.pi * np.outer(frequency, x)) @ (0.54 + 0.46 * np.cos(2 * np.pi * x))
    half = np.interp(-0.5, -((spectrum / spectrum[0]) ** 2), frequency)
    assert 2 * half == pytest.approx(aperture.HAMMING, abs=2e-4)


def logged(heading, start=(100.0, -40.0), pings=9, step=0.4, depth=10.0):
    """The log of a straight track."""
    run = step * np.arange(pings)
    place = np.stack([start[0] + run * np.cos(heading), start[1] + run * np.sin(heading), np.full(pings, depth)], 1)
    attitude = np.tile([heading, 0.0, 0.0], (pings, 1))
    return xr.Dataset({"logged_position": (("ping", "axis"), place), "logged_attitude": (("ping", "axis"), attitude)})


@settings(max_examples=20)
@given(st.floats(-np.pi, np.pi), st.floats(-50, 50), st.floats(1, 80), st.booleans())
def test_a_strip_has_its_own_axes_on_every_heading(heading, along, across, port):
    """A place so far along and abeam of the side that looks there has these coordinates, and its pixel is there."""
    scenario = demo("synthetic-aperture")
    if port:
        faces = scenario.sonar.mounting.model_copy(update={"bearing": -np.pi / 2})
        scenario = scenario.model_copy(update={"sonar": scenario.sonar.model_copy(update={"mounting": faces})})
    course = aperture.StripFrame.of(logged(heading), scenario)
    abeam = heading + (-np.pi / 2 if port else np.pi / 2)
    place = np.array([100.0, -40.0])
    place = place + along * np.array([np.cos(heading), np.sin(heading)])
    place = place + across * np.array([np.cos(abeam), np.sin(abeam)])
    np.testing.assert_allclose(course.along_across(place), [along, across], atol=1e-9)
    np.testing.assert_allclose(course.pixels(np.array([along]), np.array([across]), 16.0)[0, 0], [*place, 16.0],
                               atol=1e-9)  # fmt: skip
    np.testing.assert_allclose(course.run, 0.4 * np.arange(9), atol=1e-9)
    assert course.height == pytest.approx(scenario.seabed.depth - 10.0)


def test_an_aperture_grows_with_range_so_that_cells_do_not():
    """Twice as far, twice as long; the angle is that at which an element's line cancels but for -3.9 dB: lambda/2L."""
    scenario = demo("synthetic-aperture")
    wavelength = scenario.water.sound_speed / scenario.sonar.pulse.frequency
    assert aperture.lengths(scenario) == pytest.approx((0.1, 0.05))
    assert np.sin(aperture.half_angle(scenario)) == pytest.approx(wavelength / 0.2)
    assert aperture.aperture(scenario, 50.0) == pytest.approx(2 * aperture.aperture(scenario, 25.0))
    # the pattern of the 10 cm transmitter at the end of the aperture: sinc(1/2) = 2 / pi, -3.9 dB
    assert 20 * np.log10(np.sinc(0.1 * np.sin(aperture.half_angle(scenario)) / wavelength)) == pytest.approx(
        -3.92, abs=0.01
    )


def test_cells_are_of_the_aperture_and_of_the_band():
    """Along: at least half the larger transducer, which a full, even aperture would have times 0.886; range: 4.9 cm."""
    scenario = demo("synthetic-aperture")
    along, slant = aperture.cells(scenario)
    assert 0.886 * 0.05 < along < 1.25 * 0.05
    assert slant == pytest.approx(HAMMING_WIDTH * scenario.water.sound_speed / 40e3)
    pulse = scenario.sonar.pulse.model_copy(update={"kind": "cw", "duration": 1e-4, "bandwidth": 0})
    tone = scenario.model_copy(update={"sonar": scenario.sonar.model_copy(update={"pulse": pulse})})
    assert aperture.cells(tone)[1] == pytest.approx(1e-4 * scenario.water.sound_speed / 2)


def test_the_error_of_a_displaced_point_is_reported():
    """A peak 2 cm along and 3 cm nearer than it was put, as wide as Gaussians are: in centimetres, with its sign."""
    scenario = demo("synthetic-aperture")
    course = aperture.StripFrame.of(logged(0.0, start=(0.0, 0.0)), scenario)
    off = np.arange(-0.5, 0.502, 0.004)
    level = -((off[:, None] - 0.02) ** 2) / 2e-4 - (off + 0.03) ** 2 / 4e-4
    top = np.unravel_index(np.argmax(level), level.shape)
    found = values_of(aperture.point_numbers(PointResponse("point", off, level, top, 0.0, 25.0), scenario, course))
    assert found["point: along the track, off"] == pytest.approx(2.0, abs=0.01)
    assert found["point: across the track, off"] == pytest.approx(-3.0, abs=0.01)
    assert found["point: width at -3 dB along"] == pytest.approx(200 * np.sqrt(3.0103 * 2e-4), abs=0.05)
    assert found["point: width at -3 dB across"] == pytest.approx(200 * np.sqrt(3.0103 * 4e-4), abs=0.05)


def test_shadows_of_low_bodies_are_not_judged_and_those_of_high_ones_are():
    """A strip that is 17 dB darker behind every body: each long shadow has 17 dB, and points have none."""
    scenario = demo("synthetic-aperture")
    course = aperture.StripFrame.of(logged(0.0, start=(0.0, 0.0)), scenario)
    along, across = np.arange(0, 12, 0.05), np.arange(20, 34, 0.05)
    level = np.full((len(along), len(across)), 80.0)
    for target in scenario.targets:
        north, east = target.position[:2]
        level[np.ix_(np.abs(along - north) < 0.5, (across > east) & (across < east + 4))] = 63.0
    found = aperture.shadow_numbers(StripMap(along, across, level, course.run, level), scenario, course)
    assert {number.name for number in found} >= {"mine: shadow below the bed"}
    assert "point: shadow below the bed" not in values_of(found)
    assert values_of(found)["mine: shadow below the bed"] == pytest.approx(17.0, abs=0.1)


def swath(off, *, beams=64, pings=40):
    """Soundings with given errors [m] over (ping, beam)."""
    shape = pings, beams
    truth, off = np.full(shape, 22.0), np.broadcast_to(off, shape)
    nothing = np.zeros(1)
    return SwathSoundings(np.linspace(-1.1, 1.1, beams), truth, truth, truth + off, truth, np.ones(shape, bool), 0, 0,
                     nothing, nothing, (2.0, 0.0), (nothing, nothing))  # fmt: skip


@pytest.mark.parametrize("bias", [-0.08, 0.0, 0.03])
def test_the_mean_error_of_soundings_is_their_bias(bias):
    """In centimetres, deeper is positive; a tenth are blunders of 3 m, and the mean is of the rest."""
    blunders = np.where(np.arange(40)[:, None] % 10 == 0, 3.0, bias)
    found = values_of(multibeam.sounding_numbers(swath(blunders), demo("multibeam")))
    for name in ("inner", "outer"):
        assert found[f"{name} beams: mean of depth less truth"] == pytest.approx(100 * bias)
        assert found[f"{name} beams: rms of depth less truth"] == pytest.approx(100 * abs(bias))
        assert found[f"{name} beams: soundings within 5 % of the height"] == pytest.approx(90.0)


def test_inner_and_outer_beams_meet_at_45_degrees():
    """Errors of the outer ones alone are attributed to the outer ones alone; without bed there is no number."""
    angle = np.linspace(-1.1, 1.1, 64)
    one = swath(np.where(np.abs(angle) >= np.pi / 4, 0.1, 0.0))
    found = values_of(multibeam.sounding_numbers(one, demo("multibeam")))
    assert found["inner beams: mean of depth less truth"] == 0
    assert found["outer beams: mean of depth less truth"] == pytest.approx(10.0)
    assert multibeam.sounding_numbers(replace(one, bed=np.zeros_like(one.bed)), demo("multibeam")) == []


def test_the_spread_of_depths_is_half_of_their_middle_two_thirds():
    """N = 200 000 normal errors of 12 cm about 5 cm: median and spread are these, to four standard errors."""
    off = np.random.default_rng(4).normal(0.05, 0.12, (200, 1000))
    truth = np.full(off.shape, 20.0)
    side = interferometric.InterferometricDepths(truth, truth + off, truth, truth, np.ones(off.shape, bool))
    recording = xr.Dataset({"position": (("ping", "axis"), np.tile([0.0, 0.0, 8.0], (200, 1)))})
    found = interferometric.swath_numbers("port", side, recording, demo("interferometric"))
    values = values_of(found)
    assert values["port: median of depth less truth"] == pytest.approx(5.0, abs=4 * 12 * 1.2533 / np.sqrt(off.size))
    assert values["port: spread of depth less truth"] == pytest.approx(12.0, abs=0.15)
    assert next(n.tolerance for n in found if "spread" in n.name) == pytest.approx(24.0)  # 2 % of 12 m, in cm
    empty = replace(side, bed=np.zeros(off.shape, bool))
    assert interferometric.swath_numbers("port", empty, recording, demo("interferometric")) == []


@pytest.mark.parametrize("order", [(0, 1, 2, 3), (3, 1, 0, 2), (2, 3, 0, 1)])
def test_pairs_are_distinguished_by_their_depth(order):
    """Two receivers a side in any order of channels: the upper first, port to port, starboard to starboard."""
    place = np.array([[0, -0.4, 0.98], [0, -0.4, 1.02], [0, 0.4, 0.98], [0, 0.4, 1.02]])[list(order)]
    side = np.array([-1.0, -1.0, 1.0, 1.0])[list(order)]
    held = xr.Dataset(
        {"pressure": (("ping", "channel", "time"), np.zeros((1, 4, 2), complex))},
        {"element_position": (("channel", "axis"), place), "side": ("channel", side)},
    )
    for name, upper, lower in interferometric.pairs(held):
        assert place[upper, 2] < place[lower, 2]
        assert {np.sign(place[upper, 1]), np.sign(place[lower, 1])} == {-1.0 if name == "port" else 1.0}
    scenario = demo("interferometric")
    apart = 0.04 * scenario.sonar.pulse.frequency / scenario.water.sound_speed
    assert interferometric.wavelengths(held, scenario) == pytest.approx(apart)


def passing(trace, direct, *, beside=1.0):
    """Twenty-one pings past a body, the bed of even power beside it."""
    time = np.arange(0.19, 0.24, 2e-5)
    along = np.linspace(-10, 10, 21)
    image = np.full((21, len(time)), beside)
    return PassByLevels(time, along, image, image, trace(time), direct(time), trace(time), direct(time))


@pytest.mark.parametrize("late", [0.0, 3e-5, -4e-5])
def test_an_echo_rises_when_its_power_passes_half(late):
    """A pulse of 0.2 ms that begins so late is reported to within a sample of it.

    One that is 1 ms late does not hold.
    """
    scenario = demo("coherent-sidescan")
    start = 0.2 + late
    received = passing(lambda t: 1e-3 + ((t >= start) & (t < start + 2e-4)), np.ones_like)
    (number,) = coherent_sidescan.echo_numbers(received, [TargetEcho("D-D", 0.2, 2e-5)], scenario)
    assert number.value == pytest.approx(1e3 * start, abs=0.021) and number.holds


def test_a_shadow_is_as_dark_as_its_power_predicts():
    """A hundredth of the bed by direct paths, a tenth with multipath: -20 dB and -10 dB, both as they are expected."""
    dark = 0.203, 0.215
    received = passing(lambda t: np.where((t > dark[0]) & (t < dark[1]), 0.1, 1.0),
                    lambda t: np.where((t > dark[0]) & (t < dark[1]), 0.01, 1.0))  # fmt: skip
    numbers = coherent_sidescan.shadow_numbers(received, dark, [TargetEcho("BS-BS", 0.2035, 1e-5)])
    values = values_of(numbers)
    assert values["shadow re the bed beside it, direct paths alone"] == pytest.approx(-20.0)
    assert values["shadow re the bed beside it, with multipath"] == pytest.approx(-10.0)
    assert all(number.holds for number in numbers)


IMAGER = {
    "sonar.pulse": {"kind": "lfm", "frequency": 900e3, "bandwidth": 30e3, "duration": 0.5e-3},
    "sonar.transmit": {"kind": "planar", "width": 0.8e-3, "height": 5e-3},
    "sonar.receive": {"kind": "planar", "width": 0.0533, "height": 5e-3, "columns": 64, "rows": 1, "element": "piston"},
}


def imager(**receive):
    """The forward-looking demonstration with an array of 64 elements half a wavelength apart, at 900 kHz."""
    scenario = demo("forward-looking")
    given = {part.split(".")[1]: value for part, value in IMAGER.items()}
    sonar = scenario.sonar.model_dump(exclude_unset=True) | given
    sonar["receive"] = given["receive"] | receive
    return Scenario(**(scenario.model_dump(exclude_unset=True) | {"sonar": sonar}))


def test_a_forward_looking_sonar_is_drawn_over_all_of_its_field():
    """Elements and transmitter of half a wavelength, 6 dB down at 65 deg: beams on all of it, four to a width."""
    bearings = np.degrees(forward_looking.recorded_bearings(imager()))
    assert bearings[0] == pytest.approx(-65, abs=1.5) and bearings[-1] == pytest.approx(65, abs=1.5)
    step = np.degrees(forward_looking.beam_width(imager())) / 4
    np.testing.assert_allclose(np.diff(bearings), step, rtol=1e-6)


def test_beams_that_the_scenario_steers_are_those_drawn():
    """256 angles over 130 deg in the receive array: these, in order, and no others."""
    steer = np.radians(np.linspace(-65, 65, 256))
    given = forward_looking.recorded_bearings(imager(steer=tuple(steer[::-1])))
    np.testing.assert_allclose(given, steer)
