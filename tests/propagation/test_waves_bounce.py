"""One plane, tilted as a swell is where the mirror's bounce point lies: the paper's moving surface."""

import numpy as np
import pytest
from scipy.optimize import minimize

from insonify.ocean.wave_spectrum import angular_frequency
from insonify.propagation.displaced_bounce import unfold_paths
from insonify.propagation.glints import SonarEnd
from insonify.propagation.image_sources import image_legs
from insonify.propagation.surface_reflection import apply_surface_reflection
from insonify.propagation.tilted_reflection import tilted_legs, tilted_planes
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.surface import Surface
from insonify.scene.target import PointTarget

PLACE, TARGET = np.array([0.0, 0.0, 11.0]), (20.0, 60.0, 19.5)
SWELL = {"height": 0.05, "length": 30.0}


def scene(**swell):
    """The nominal depth under a swell that comes in slantwise."""
    return Scene(surface={"reflection": "tilted", "swell": {**SWELL, **swell}, "wave_direction": 0.7})


def legs(where, family="S", *, time=0.0, target=TARGET):
    """Mirror's leg of one family, and the tilted ones out and back."""
    point = point_scatterer(PointTarget(position=target))
    mirror = image_legs(where, PLACE, point, (family,), 1e5)
    return mirror, *tilted_legs(mirror, where, point, SonarEnd(PLACE, time))


@pytest.mark.parametrize(
    "surface",
    [
        {"reflection": "tilted", "swell": SWELL},
        {"reflection": "explicit", "swell": SWELL},
        {"reflection": "statistical", "wind_speed": 5.0},
    ],
    ids=["tilted", "explicit", "statistical"],
)
def test_sound_from_elsewhere_reaches_the_sea_on_the_receive_leg_when_it_gets_there(surface):
    """A transmitter farther away by 60 m: the sea of 40 ms later on the way back, and the same on the transmit leg."""
    where, point = Scene(surface={**surface, "wave_direction": 0.7}), point_scatterer(PointTarget(position=TARGET))
    mirror = image_legs(where, PLACE, point, ("S",), 1e5)
    away = (np.array(TARGET) - PLACE) / np.linalg.norm(np.array(TARGET) - PLACE)
    ends = SonarEnd(PLACE, 1.0), SonarEnd(PLACE, 1.04), SonarEnd(PLACE, 1.0, PLACE - 60 * away)
    now, later, called = (apply_surface_reflection(mirror, where, 3, point, 1e5, end) for end in ends)
    np.testing.assert_allclose(called[1].delay, later[1].delay, rtol=0, atol=1e-13)
    np.testing.assert_allclose(called[1].amplitude, later[1].amplitude, rtol=1e-7)
    np.testing.assert_array_equal(called[0].amplitude, now[0].amplitude)
    turned = np.exp(-2e5j * np.pi * (called[1].delay - now[1].delay)) * called[1].amplitude / now[1].amplitude
    assert np.max(np.abs(turned - 1)) > 0.1


@pytest.mark.parametrize("time", [0.0, 1.3, 2.9])
def test_the_path_off_the_plane_is_the_shortest(time):
    """Fermat: the leg is as long as the shortest way over the tilted plane, found by a search; it leaves that way."""
    where = scene(height=0.3, length=60.0)
    mirror, out, _ = legs(where, time=time)
    lines = unfold_paths("S", PLACE, np.array([TARGET]), 20.0)
    on, normal = (
        one[0, 0]
        for one in tilted_planes(where, lines.flat_bounce_points(), time + lines.bounce_fractions() * mirror.delay[0])
    )

    def way(level):
        bounce = np.array([*level, on[2] - (np.array(level) - on[:2]) @ normal[:2] / normal[2]])
        return bounce, np.linalg.norm(bounce - PLACE) + np.linalg.norm(TARGET - bounce)

    found = minimize(lambda level: way(level)[1], on[:2], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-12})
    bounce, length = way(found.x)
    assert out.length[0, 0] == pytest.approx(length, abs=1e-9)
    assert out.delay[0, 0] == pytest.approx(length / 1500, abs=1e-12)
    np.testing.assert_allclose(out.departure[0, 0], (bounce - PLACE) / np.linalg.norm(bounce - PLACE), atol=1e-5)
    np.testing.assert_allclose(out.arrival[0, 0], (TARGET - bounce) / np.linalg.norm(TARGET - bounce), atol=1e-5)
    assert abs(length - mirror.length[0, 0]) > 1e-3


def test_the_plane_stands_where_the_wave_does():
    """A quarter of a length ahead of a crest the surface is level with the mean and falls by 2 pi a / length."""
    where = Scene(surface={"reflection": "tilted", "swell": SWELL, "wave_direction": 0.0})
    on, normal = tilted_planes(where, np.array([[0.0, 5.0], [7.5, 5.0]]), np.zeros(2))
    np.testing.assert_allclose(on[:, 2], [-0.025, 0.0], atol=1e-12)
    np.testing.assert_allclose(normal[0], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(normal[1, 0] / normal[1, 2], -2 * np.pi * 0.025 / 30, rtol=1e-12)
    # The crest has moved on a quarter of a period later.
    period = 2 * np.pi / float(angular_frequency(2 * np.pi / 30, water_depth=20.0))
    later, _ = tilted_planes(where, np.array([[7.5, 5.0]]), np.array([period / 4]))
    assert later[0, 2] == pytest.approx(-0.025)


@pytest.mark.parametrize("family", ["S", "BS", "SB", "SBS"])
def test_a_low_swell_is_a_mirror(family):
    """A swell of a nanometre changes no leg; families without the surface are never touched."""
    mirror, out, back = legs(scene(height=1e-9), family)
    for moved in (out, back):
        np.testing.assert_allclose(moved.delay, mirror.delay, rtol=1e-11)
        np.testing.assert_allclose(moved.departure, mirror.departure, atol=1e-9)
        np.testing.assert_allclose(moved.amplitude, mirror.amplitude, rtol=1e-9)


def test_out_and_back_stand_at_their_own_times():
    """The leg back reaches the swell a way to the target and part of a way home later: as one of that time does."""
    where = scene()
    mirror, out, back = legs(where, time=0.5)
    lines = unfold_paths("S", PLACE, np.array([TARGET]), 20.0)
    there = np.linalg.norm(np.array(TARGET) - PLACE) / 1500
    part = lines.bounce_fractions()[0, 0]
    later = 0.5 + there + (1 - 2 * part) * mirror.delay[0, 0]
    _, then, _ = legs(where, time=later)
    assert abs(back.delay[0, 0] - out.delay[0, 0]) > 1e-9
    assert back.delay[0, 0] == pytest.approx(then.delay[0, 0], abs=1e-14)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"reflection": "statistical"}, "Write wind_speed: 3 m/s"),
        ({"reflection": "tilted"}, "Write swell: "),
        ({"wind_speed": 5.0}, "moves a statistical surface only"),
        ({"reflection": "statistical", "wind_speed": 5.0, "swell": SWELL}, "moves a tilted surface only"),
        ({"reflection": "explicit"}, "there are no waves"),
        ({"cutoff_wavelength": 5.0}, "divides the waves of a wind"),
        ({"reflection": "explicit", "swell": SWELL, "cutoff_wavelength": 5.0}, "divides the waves of a wind"),
        (
            {"reflection": "explicit", "wind_speed": 5.0, "cutoff_wavelength": 30.0},
            "longer than the dominant waves of this wind",
        ),
        ({"reflection": "puddle"}, "flat"),
    ],
)
def test_a_surface_states_what_it_lacks(given, message):
    """What moves a surface belongs to its bounce; what no model takes is not offered."""
    with pytest.raises(ValueError, match=message):
        Surface(**given)
