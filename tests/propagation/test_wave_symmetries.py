"""What no sea can change: a way taken back, a period, a length, a sea that runs along with both ends."""

import numpy as np
import pytest

from insonify.propagation.explicit_surface import explicit_surface_legs, explicit_waves, find_bounce_points
from insonify.propagation.glints import SonarEnd
from insonify.propagation.image_sources import image_legs
from insonify.records.legs import Legs
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.target import PointTarget

SPEED, DEPTH, HEIGHT, LENGTH = 1500.0, 20.0, 0.3, 25.0
SONAR, FAR = np.array([0.0, 0.0, 11.0]), np.array([30.0, 110.0, 17.0])
K = 2 * np.pi / LENGTH
PERIOD = 2 * np.pi / np.sqrt(9.81 * K * np.tanh(K * DEPTH))
"""Of the swell: linear waves in 20 m of water, without surface tension, which takes 2e-7 of it [s]."""


def swell(wave_direction=1.1):
    """A scene under one long-crested wave."""
    wave = {"height": HEIGHT, "length": LENGTH}
    return Scene(
        seabed={"depth": DEPTH}, surface={"reflection": "explicit", "swell": wave, "wave_direction": wave_direction}
    )


def windy(origin=(0.0, 0.0), heading=0.0):
    """A scene under a wind sea, whose origin and axis may be moved."""
    surface = {"reflection": "explicit", "wind_speed": 5.0, "cutoff_wavelength": 6.0, "wave_direction": 0.4 + heading}
    return Scene(seabed={"depth": DEPTH, "scatterer_grid": {"origin": origin, "heading": heading}}, surface=surface)


def ways(where, place, target, family="S", time=0.0) -> tuple[Legs, Legs]:
    """Legs out and back of one family."""
    point = point_scatterer(PointTarget(position=tuple(target)))
    mirror = image_legs(where, np.array(place), point, (family,), 1e5)
    return explicit_surface_legs(mirror, where, 1, point, 1e5, SonarEnd(np.array(place), time))


def strong_rays(legs):
    """Delays and complex amplitudes of the bounces that there are, by delay."""
    size = legs.amplitude[:, 0] * (legs.caustic[:, 0] if legs.caustic is not None else 1)
    there = np.flatnonzero(np.abs(size) > 0)
    there = there[np.argsort(legs.delay[there, 0])]
    return legs.delay[there, 0], size[there], there


def bounce_rows(where, place, target, family, time, *, out):
    """Bounces of one family, by north: place, height, ways before and after, curvatures; none in the dark of a fold."""
    point = point_scatterer(PointTarget(position=tuple(target)))
    found = find_bounce_points(
        explicit_waves(where.surface, 1, DEPTH), family, point, SonarEnd(place, time), where, 1e5, is_transmit_leg=out
    )
    rows = found.points[0, : found.bounce_count[0]]
    rows = rows[rows[:, 11] == 0]
    return rows[np.argsort(rows[:, 0])]


@pytest.mark.parametrize("family", ["S", "BS", "SB"])
def test_bounces_off_a_wind_sea_are_reciprocal(family):
    """A ping's way home, and the transmit leg of one sent by the target as it comes by: the same places, to 50 um.

    Ten times of a sea that bounces each path up to nine times.
    """
    later, most = float(np.linalg.norm(FAR - SONAR)) / SPEED, 0
    for time in np.linspace(0, 50, 10):
        home = bounce_rows(windy(), SONAR, FAR, family, time, out=False)
        out = bounce_rows(windy(), FAR, SONAR, family[::-1], time + later, out=True)
        assert len(home) == len(out) >= 1
        np.testing.assert_allclose(home[:, :3], out[:, :3], rtol=0, atol=5e-5)
        np.testing.assert_allclose(home[:, 3:5].sum(axis=1), out[:, 3:5].sum(axis=1), rtol=0, atol=1e-8)
        np.testing.assert_allclose(home[:, 7:9], out[:, 7:9], rtol=0.01, atol=1e-6)
        most = max(most, len(home))
    assert most >= 5


@pytest.mark.parametrize("family", ["S", "BS", "SB"])
@pytest.mark.parametrize("time", [0.0, 1.7])
def test_a_receive_leg_is_a_transmit_leg_of_the_other_end(family, time):
    """The leg home of a ping is the leg out of one sent by the target when that ping reaches it: to 1e-11 s, 1e-4."""
    where, later = swell(), float(np.linalg.norm(FAR - SONAR)) / SPEED
    _, home = ways(where, SONAR, FAR, family, time)
    out, _ = ways(where, FAR, SONAR, family[::-1], time + later)
    (late, size, rows), (late_out, size_out, rows_out) = strong_rays(home), strong_rays(out)
    assert late.size == late_out.size >= 1
    np.testing.assert_allclose(late, late_out, rtol=0, atol=1e-11)
    np.testing.assert_allclose(size, size_out, rtol=1e-4)
    np.testing.assert_allclose(home.arrival[rows, 0], -out.departure[rows_out, 0], atol=1e-7)
    np.testing.assert_allclose(home.departure[rows, 0], -out.arrival[rows_out, 0], atol=1e-7)


def assert_alike(one, other, late=1e-10, near=1e-4):
    """Both have the same bounces."""
    (a, b, _), (c, d, _) = strong_rays(one), strong_rays(other)
    assert a.size == c.size >= 1
    np.testing.assert_allclose(a, c, rtol=0, atol=late)
    np.testing.assert_allclose(b, d, rtol=near)


@pytest.mark.parametrize("family", ["S", "BS"])
@pytest.mark.parametrize("count", [1, 3])
def test_a_swell_repeats_itself_in_time_and_in_space(family, count):
    """Periods later, or lengths further along it, and anywhere along its crests: the same bounces to 1 ns."""
    where, along = swell(), np.array([np.cos(1.1), np.sin(1.1), 0.0])
    crest = np.array([-np.sin(1.1), np.cos(1.1), 0.0])
    here = ways(where, SONAR, FAR, family)
    later = ways(where, SONAR, FAR, family, count * PERIOD)
    moved = ways(where, *(place + count * LENGTH * along + 17.3 * crest for place in (SONAR, FAR)), family)
    for row in (0, 1):
        assert_alike(here[row], later[row], late=1e-9)
        assert_alike(here[row], moved[row])


def test_a_swell_is_stationary_in_its_own_frame():
    """Both ends moved at the speed of the waves for 0.8 s: the bounces of the start, to 0.1 ns."""
    gone = 0.8
    where, shift = swell(), gone * LENGTH / PERIOD * np.array([np.cos(1.1), np.sin(1.1), 0.0])
    here = ways(where, SONAR, FAR)
    there = ways(where, SONAR + shift, FAR + shift, time=gone)
    stayed = ways(where, SONAR, FAR, time=gone)
    for row in (0, 1):
        assert_alike(here[row], there[row])
    assert abs(stayed[0].delay[0, 0] - here[0].delay[0, 0]) > 1e-7


def test_a_swell_and_both_ends_may_be_turned_or_mirrored():
    """Turned by any angle about the origin, and mirrored in the plane of the swell: the same delays and level."""
    here = ways(swell(), SONAR, FAR)
    for turn in (0.6, 2.9):
        c, s = np.cos(turn), np.sin(turn)
        place = np.array([c * FAR[0] - s * FAR[1], s * FAR[0] + c * FAR[1], FAR[2]])
        there = ways(swell(1.1 + turn), SONAR, place)
        assert_alike(here[0], there[0])
        assert_alike(here[1], there[1])
    axis = np.array([np.cos(1.1), np.sin(1.1)])
    mirrored = np.append(2 * (FAR[:2] @ axis) * axis - FAR[:2], FAR[2])
    assert_alike(here[0], ways(swell(), SONAR, mirrored)[0])


def test_a_wind_sea_moves_with_its_lattice():
    """Origin, axis, wind and both ends moved by kilometres and turned: the same bounces to 1 ns."""
    turn, away = 1.9, np.array([1200.0, -700.0, 0.0])
    c, s = np.cos(turn), np.sin(turn)
    place = np.array([c * FAR[0] - s * FAR[1], s * FAR[0] + c * FAR[1], FAR[2]])
    here, there = ways(windy(), SONAR, FAR), ways(windy(tuple(away[:2]), turn), SONAR + away, place + away)
    for row in (0, 1):
        assert_alike(here[row], there[row], late=1e-9, near=1e-3)


@pytest.mark.parametrize("time", [0.0, 2.2])
def test_sound_leaves_a_bounce_as_a_mirror_sends_it(time):
    """Snell at every bounce of a swell: the change of direction is along the slope of the wave, there and then."""
    where = swell()
    out, _ = ways(where, SONAR, FAR, time=time)
    axis = np.array([np.cos(1.1), np.sin(1.1)])
    point = point_scatterer(PointTarget(position=tuple(FAR)))
    bounces = find_bounce_points(
        explicit_waves(where.surface, 1, DEPTH), "S", point, SonarEnd(SONAR, time), where, 1e5, is_transmit_leg=True
    )
    many = int(bounces.bounce_count[0])
    assert many >= 1
    for row in bounces.points[0, :many]:
        if row[11] != 0:  # the dark side of a fold
            continue
        place = np.array([row[0], row[1], -row[2]])
        when = time + np.linalg.norm([row[0], row[1], SONAR[2]]) / SPEED  # to the mean surface: micrometres differ
        phase = K * (place[:2] @ axis) - 2 * np.pi / PERIOD * when
        assert row[2] == pytest.approx(HEIGHT / 2 * np.cos(phase), abs=1e-6)
        slope = -HEIGHT / 2 * K * np.sin(phase) * axis
        normal = np.array([slope[0], slope[1], 1.0])  # into the water, depth down
        turned = (FAR - place) / np.linalg.norm(FAR - place) - (place - SONAR) / np.linalg.norm(place - SONAR)
        assert np.linalg.norm(np.cross(turned, normal)) < 1e-4 * np.linalg.norm(turned) * np.linalg.norm(normal)
    assert out.delay.shape[0] >= 1
