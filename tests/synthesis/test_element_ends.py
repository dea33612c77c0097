"""Claims about the ends of echoes: where elements are, what they see when echoes come, what a band takes."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.ocean.water import absorption_np_per_m
from insonify.simulator import build_simulator
from insonify.sonar.beam import POINTS_PER_LOBE
from insonify.synthesis import element_arrivals
from oracles.arrays import elements_scenario, line_of

TURNING = {"motion": {"yaw": {"rms": "3 deg", "period": "4 s"}, "heave": {"rms": 0.2, "period": "6 s"}}}


def ping_geometry(**settings):
    """A sonar at 3 m/s that looks to starboard, and records its elements."""
    return build_simulator(elements_scenario([(0, 20, 5)], **settings)).ping_geometry(0)


def ways(count=30):
    """Unit vectors in all directions."""
    way = np.random.default_rng(3).normal(size=(count, 3))
    return way / np.linalg.norm(way, axis=1, keepdims=True)


@pytest.mark.parametrize("track", [{}, TURNING, {"speed": 0.0}], ids=["straight", "turning", "rest"])
def test_elements_go_where_the_platform_takes_them(track):
    """Parabolas of each from the array's centre at the start: at three moments fixed to the platform, 1e-12 m."""
    here = ping_geometry(track=track, receive={**line_of(5, 1.0), "offset": (2.0, 0.5, 1.0)})
    ends = element_arrivals.receive_points(here)
    own = here.elements.positions @ here.receive_beams.axes
    np.testing.assert_allclose(ends.position, own, atol=1e-15)
    if here.is_static:
        assert not ends.velocity.any() and not ends.acceleration.any()
        return
    course, arm = here.receive_motion, here.lever_arms[1]
    start = course.position[0] + course.rotation[0] @ arm
    for moment in range(3):
        t, turn = moment * course.window / 2, course.rotation[moment]
        there = ends.position + t * ends.velocity + t**2 / 2 * ends.acceleration
        fixed = np.array([turn @ (arm + course.rotation[0].T @ one) for one in own])
        np.testing.assert_allclose(there, course.position[moment] + fixed - start, atol=1e-12)


def test_elements_see_what_is_nearby_from_where_they_are():
    """Directions from an element's place when the echo comes, to the scatterer that the centre saw: 1e-14."""
    here = ping_geometry(track=TURNING, receive=line_of(4, 2.0))
    ends, way, rng = element_arrivals.receive_points(here), ways(), np.random.default_rng(1)
    away, when = rng.uniform(3, 40, 30), rng.uniform(0, 0.06, 30)
    for e in range(4):
        place = ends.position[e] + np.outer(when, ends.velocity[e]) + np.outer(when**2 / 2, ends.acceleration[e])
        line = away[:, None] * way - place
        known = line / np.linalg.norm(line, axis=1, keepdims=True)
        np.testing.assert_allclose(
            element_arrivals.element_directions(ends.motion(e), way, away, when), known, atol=1e-14
        )


def test_sound_leaves_from_where_the_transmitter_is_in_the_middle_of_the_pulse():
    """Later, followed and stronger by geometry: 1e-15 s, 1e-12; at rest nothing is."""
    here, way = ping_geometry(), ways()
    away = np.random.default_rng(2).uniform(0.5, 40, 30)
    velocity, half = here.transmit_velocity, here.pulse.pulse.duration / 2
    line = away[:, None] * way - half * velocity
    left = np.linalg.norm(line, axis=1)
    later, leaving, factor = element_arrivals.transmitter_motion(way, away, here)
    np.testing.assert_allclose(later, half + (left - away) / here.sound_speed, rtol=0, atol=1e-15)
    np.testing.assert_allclose(leaving, line @ velocity / left / here.sound_speed, atol=1e-12)
    np.testing.assert_allclose(factor, away / left, rtol=1e-12)
    assert np.linalg.norm(velocity) == pytest.approx(3.0)
    for one, idle in zip(
        element_arrivals.transmitter_motion(way, away, ping_geometry(track={"speed": 0.0})), (0, 0, 1), strict=True
    ):
        assert (one == idle).all()


def test_absorption_is_given_as_a_pressure_ratio():
    """exp(-a r) with a of `absorption_np_per_m` is the loss in dB at any frequency, to 1e-12; 1 at the carrier."""
    water = build_simulator(elements_scenario([(0, 20, 5)], water={"noise_level_db": None})).engine.scene.water
    length = np.array([[0.0, 1.0, 30.0], [200.0, 5.0, 1e3]])
    for offset in (-20e3, 3e3):
        more = absorption_np_per_m(water, 1e5 + offset) - absorption_np_per_m(water, 1e5)
        np.testing.assert_allclose(water.relative_absorption(length, offset, 1e5), np.exp(-more * length), rtol=1e-12)
    db = float(water.absorption(1e5))
    assert 20 * np.log10(np.exp(absorption_np_per_m(water, 1e5))) == pytest.approx(db, rel=1e-12) and db > 0.01
    assert (water.relative_absorption(length, 0.0, 1e5) == 1).all()


def test_patterns_distinguish_elements_only_near_them():
    """Omnidirectional elements never; pistons of 20 cm nearer than pi places per pattern's angle over the bound."""
    here = ping_geometry(track={"speed": 0.0}, receive=line_of(4, 0.8))
    assert not element_arrivals.has_parallax(here, element_arrivals.receive_points(here), 0.1, 0.06)
    wide = ping_geometry(track={"speed": 0.0}, receive={**line_of(4, 0.8), "element": "piston"})
    ends, waves = element_arrivals.receive_points(wide), float(wide.receive_beams.per_unit.max()) / POINTS_PER_LOBE
    assert waves == pytest.approx(0.2 / wide.wavelength, rel=1e-6)
    edge = np.pi * waves * 0.3 / element_arrivals.PARALLAX_TOLERANCE
    assert element_arrivals.has_parallax(wide, ends, 0.99 * edge, 0.06) and not element_arrivals.has_parallax(
        wide, ends, 1.01 * edge, 0.06
    )


def test_an_element_that_faces_aside_receives_what_a_turned_one_receives():
    """A cosine element turned to the right by an angle: the cosine from there; and the gains row by row."""
    here, way = (
        ping_geometry(
            receive={"kind": "arc", "radius": 0.2, "arc_angle": "120 deg", "elements": 5, "element": "cosine"}
        ),
        ways(),
    )
    ends = element_arrivals.receive_points(here)
    rows = element_arrivals.element_gains(here, here.receive_beams, ends, [way])
    ahead, right, _ = here.receive_beams.axes
    for row, angle in zip(rows, ends.orientations, strict=True):
        known = np.maximum(way @ (np.cos(angle) * ahead + np.sin(angle) * right), 0)
        turned = element_arrivals.rotated_beams(here.receive_beams, angle).axes
        np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turned) == pytest.approx(1)
        np.testing.assert_allclose(row, known, atol=1e-6)
    assert len(np.unique(ends.orientations)) == 5
    for channel in range(5):
        alone = element_arrivals.element_as_beam(here, channel)
        assert alone.elements is None and alone.channel_count == 1
        np.testing.assert_allclose(alone.receive_beams.gain(way)[0], rows[ends.orientation_row[channel]], atol=1e-6)
    beam = replace(here, elements=None)
    assert element_arrivals.element_as_beam(beam, 0) is beam
