"""Products of element recordings agree with the truth: bearings, depths, focus, delays."""

import warnings

import numpy as np
import pytest
from matplotlib.figure import Figure

from insonify.demos.demo import DEMOS
from insonify.demos.products import coherent_sidescan, product, product_kind, synthetic_aperture
from insonify.demos.products.peaks import parabolic_peak_position, width
from insonify.demos.products.true_depths import depth_from_above, is_clear_of_targets
from insonify.scenario.template import load_template
from insonify.scene.solid import seabed_depth_at
from oracles.shown import simulated, small


@pytest.mark.parametrize("name", DEMOS)
def test_a_template_that_shows_has_nothing_wrong(name):
    """Not even a warning; and what its recording is made into is known from the scenario."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        scenario = load_template(name)
    assert product_kind(scenario) == (None if name in ("nominal", "coherent-sidescan") else name)


PAIR = {"sonar.receive": {"kind": "elements", "positions": [[0, 0, -0.02], [0, 0, 0.02]]}}


def assert_all_hold(numbers, *expected):
    """Every number that has a true value agrees with it, and those requested are among them."""
    assert not [f"{n.name}: {n.value} for {n.expected}" for n in numbers if n.holds is False]
    for name in expected:
        assert any(name in number.name and number.holds for number in numbers), name


def test_a_forward_looking_sonar_puts_a_sphere_where_it_is():
    """Bearing within a tenth of the beam, range within 5 cm, beam as wide as its Hamming line's within a tenth."""
    figure, numbers = product(simulated("forward-looking")[1])
    assert isinstance(figure, Figure)
    assert_all_hold(numbers, "sphere: bearing", "sphere: slant range", "sphere: beam width", "mine: bearing")


def test_a_multibeam_sounds_the_bed_that_is_there():
    """A ping of 64 elements, 256 beams over relief: mean within 5 cm of the truth, rms within 1 % of height."""
    _, numbers = product(simulated("multibeam")[1])
    assert_all_hold(numbers, "inner beams: mean", "inner beams: rms", "outer beams: mean", "within 5 %")


def test_an_interferometer_is_unbiased_over_relief():
    """Three pings, some 4000 depths on both sides: medians within 2 cm, spread within 2 % of the altitude."""
    _, numbers = product(simulated("interferometric")[1])
    assert_all_hold(numbers, "port: median", "starboard: median", "port: spread", "starboard: spread")


def test_a_synthetic_aperture_focuses_a_point_as_theory_predicts():
    """Ten pings of a moving array: within 1 cm of its place, as wide along and across as apertures and band allow."""
    scenario, recording = simulated("synthetic-aperture")
    course = synthetic_aperture.StripFrame.of(recording, scenario)
    short = synthetic_aperture.compressed(recording, scenario)
    point = next(target for target in scenario.targets if target.label == "point")
    found = synthetic_aperture.response(short, scenario, course, point)
    numbers = synthetic_aperture.point_numbers(found, scenario, course)
    assert_all_hold(
        numbers, "along the track, off", "across the track, off", "width at -3 dB along", "width at -3 dB across"
    )


def test_ghosts_come_when_their_paths_are_as_long():
    """Five pings past the box: six pairs of legs, each within its face's spread; shadows as dark as is expected."""
    scenario, recording = simulated("coherent-sidescan")
    box = scenario.targets[0]
    echoes = coherent_sidescan.echo_times(scenario, box)
    figure, numbers = coherent_sidescan.coherent_sidescan(recording, scenario)
    assert_all_hold(numbers, *(f"echo {echo.pair}" for echo in echoes))
    assert len(figure.axes) >= 4
    # the ghost by the surface on one way: hand-made, source 11 m deep, top of the face 19 m deep and 150 m away
    straight, surface = np.hypot(150, 19 - 11), np.hypot(150, 19 + 11)
    assert echoes[1].delay == pytest.approx((straight + surface) / 1500, abs=1e-9)


def test_a_shadow_ends_where_the_straight_line_over_the_box_reaches_the_bed():
    """Similar triangles: a box of 1 m under a sonar 9 m up, its far edge 151 m away, shades the bed to 169.875 m."""
    scenario = small("coherent-sidescan")
    _, last = coherent_sidescan.shadow(scenario, scenario.targets[0])
    assert last == pytest.approx(2 * np.hypot(169.875, 9) / 1500, abs=1e-9)


def test_from_above_a_wreck_is_as_high_as_it_is():
    """Its deck and its deckhouse stand 6 m and 10 m over its keel; beside it there is the bed."""
    scenario = load_template("multibeam")
    wreck = scenario.targets[0]
    turn = np.array([np.cos(wreck.heading), np.sin(wreck.heading)])
    deck, house = (np.array(wreck.position) + off * turn for off in (0.0, -18.0))
    heights = [float(depth_from_above(scenario, *place)) for place in (deck, house)]
    assert heights[0] - heights[1] == pytest.approx(4.0, abs=1e-6)
    away = np.array([0.0, 5.0]), np.array([-30.0, -20.0])
    bed = seabed_depth_at(scenario.scene.seabed, np.stack(away, axis=-1))
    np.testing.assert_array_equal(depth_from_above(scenario, *away), bed)
    assert is_clear_of_targets(scenario, *away, 3.0).all() and not is_clear_of_targets(scenario, deck[0], deck[1], 3.0)


def test_a_peak_between_samples_is_found():
    """A parabola of 0.3 steps beside a sample, 4 dB a step squared: its place, and its width at -3 dB."""
    place = np.arange(-10.0, 10.5, 0.01)
    level = -4 * (place - 0.303) ** 2
    top = int(np.argmax(level))
    assert parabolic_peak_position(place, level, top) == pytest.approx(0.303, abs=1e-9)
    assert width(place, level, top, 3.0) == pytest.approx(2 * np.sqrt(0.75), abs=1e-3)
    assert np.isnan(width(place, level, top, 1000.0))


@pytest.mark.parametrize(
    ("changes", "made"),
    [
        ({"sonar.mounting.tilt": 0.0}, "forward-looking"),
        ({"sonar.mounting.tilt": np.pi / 2}, "multibeam"),
        ({"sonar.mounting.bearing": np.pi / 2}, None),
        ({"sonar.receive": {"kind": "line", "length": 0.01, "elements": 2}}, None),
        (PAIR | {"sonar.mounting.bearing": np.pi / 2}, "interferometric"),
        (PAIR, None),
        ({"sonar.receive": {"kind": "arc", "radius": 0.2, "arc_angle": 1.5, "elements": 40}}, "forward-looking"),
        ({"field": "incoherent", "sonar.receiver.record": "beams"}, None),
    ],
)
def test_what_a_recording_is_made_into_follows_from_where_its_elements_are(changes, made):
    """Ahead and side by side: a fan; down: soundings; one above the other, abeam: phase; others: sound as it is."""
    assert product_kind(small("forward-looking", changes)) == made
