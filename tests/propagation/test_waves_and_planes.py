"""The wind's waves as tables, and swells that come back: what must hold whatever the sea."""

import numpy as np
import pytest

from insonify.ocean.elfouhaily import Elfouhaily
from insonify.ocean.wave_spectrum import angular_frequency, height_variance, mean_square_slope, vertical_speed_rms
from insonify.propagation.glints import SonarEnd, glint_surface
from insonify.propagation.image_sources import image_legs
from insonify.propagation.tilted_reflection import tilted_legs, tilted_planes
from insonify.propagation.wind_waves import shortest_wavenumber, wind_waves
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.target import PointTarget

SHORTEST = shortest_wavenumber(100e3, 1500.0)
WINDS = [3.0, 7.0, 12.0]
SONAR, TARGET = np.array([1.0, 2.0, 11.0]), np.array([18.0, 55.0, 19.0])
LONG = 30.0


@pytest.mark.parametrize("wind", WINDS)
def test_the_tables_hold_the_moments_of_the_spectrum(wind):
    """Height, slope and vertical speed of all waves that the wavelength resolves.

    As integrated over the spectrum itself, 1 %.
    """
    sea, waves = Elfouhaily(wind), wind_waves(wind, SHORTEST)
    assert waves.variance[-1] == pytest.approx(height_variance(sea, max_wavenumber=SHORTEST), rel=0.01)
    assert waves.slope_moments[0, -1] + waves.slope_moments[1, -1] == pytest.approx(
        float(mean_square_slope(sea, max_wavenumber=SHORTEST)), rel=0.01
    )
    assert waves.slope_moments[2, -1] == pytest.approx(
        float(vertical_speed_rms(sea, max_wavenumber=SHORTEST)) ** 2, rel=0.02
    )


@pytest.mark.parametrize("wind", WINDS)
def test_every_share_of_the_sea_is_a_share(wind):
    """All moments grow with the waves that count, and slope with speed is never more than both allow (Schwarz)."""
    waves = wind_waves(wind, SHORTEST)
    assert np.all(np.diff(waves.wavenumber) > 0) and np.all(np.diff(waves.variance) >= 0)
    assert np.all(np.diff(waves.slope_moments, axis=1) >= 0)
    along, _, speed, both = waves.slope_moments
    assert np.all(both**2 <= along * speed * (1 + 1e-9))
    assert waves.slope_moments[0, -1] > waves.slope_moments[1, -1] > 0  # steeper down the wind than across it


@pytest.mark.parametrize("wind", WINDS)
def test_waves_run_alike_to_both_sides_of_the_wind(wind):
    """Directions at equal steps of probability are odd about the wind; half of all waves run to its right."""
    turn = wind_waves(wind, SHORTEST).direction_quantiles
    np.testing.assert_allclose(turn, -turn[:, ::-1], atol=1e-6)
    assert np.all(np.diff(turn, axis=1) >= 0) and np.abs(turn).max() <= np.pi + 1e-9


def test_a_stronger_wind_raises_and_steepens_the_sea():
    """Height and slope grow with the wind; the longest waves that carry them grow longer."""
    seas = [wind_waves(wind, SHORTEST) for wind in WINDS]
    for read in (
        lambda w: w.variance[-1],
        lambda w: w.slope_moments[0, -1] + w.slope_moments[1, -1],
        lambda w: 1 / w.wavenumber[0],
    ):
        values = [read(one) for one in seas]
        assert values[0] < values[1] < values[2]


def test_shorter_sound_resolves_shorter_waves():
    """In proportion to its wavelength; what it resolves more of is slope, not height."""
    assert shortest_wavenumber(200e3, 1500.0) == pytest.approx(2 * SHORTEST)
    assert shortest_wavenumber(100e3, 750.0) == pytest.approx(2 * SHORTEST)
    coarse, fine = wind_waves(7.0, SHORTEST / 4), wind_waves(7.0, SHORTEST)
    assert fine.variance[-1] == pytest.approx(coarse.variance[-1], rel=1e-3)
    assert fine.slope_moments[:2, -1].sum() > 1.02 * coarse.slope_moments[:2, -1].sum()


def test_the_axes_of_a_sea_are_those_of_its_waves():
    """Ahead and to the right: orthonormal, right-handed with depth down, the first where waves go to."""
    scene = Scene(surface={"reflection": "statistical", "wind_speed": 5.0, "wave_direction": 0.4})
    axes = glint_surface(scene, 1, 100e3).axes
    np.testing.assert_allclose(axes @ axes.T, np.eye(2), atol=1e-15)
    np.testing.assert_allclose(axes[0], [np.cos(0.4), np.sin(0.4)])
    assert np.linalg.det(axes) == pytest.approx(1.0)


@pytest.mark.parametrize("depth", [11.0, 15.0])
def test_what_the_mirror_keeps_falls_with_the_square_of_the_frequency(depth):
    """Quanta 4 Gamma^2 = (2 k sin g)^2 times the variance: of twice the pitch four times, of a steeper ray more."""
    scene = Scene(surface={"reflection": "statistical", "wind_speed": 4.0})
    end = SonarEnd(np.array([0.0, 0.0, depth]), 0.0)
    kept = {}
    for frequency in (50e3, 100e3):
        sea = glint_surface(scene, 1, frequency)
        for east in (30.0, 90.0):
            legs = image_legs(
                scene, end.position, point_scatterer(PointTarget(position=(0.0, east, 17.0))), ("S",), 1e5
            )
            quiet = sea.coherent_reflection(legs, 0, end)
            sine = (depth + 17) / np.hypot(depth + 17, east)
            expected = (4 * np.pi * frequency / 1500 * sine) ** 2 * sea.waves.variance[-1]
            kept[frequency, east] = quiet.mean_quanta[0]
            assert quiet.mean_quanta[0] == pytest.approx(expected, rel=1e-6)
            assert quiet.coherent_factor[0] == pytest.approx(np.exp(-expected / 2), rel=1e-5, abs=1e-300)
    for east in (30.0, 90.0):
        assert kept[100e3, east] == pytest.approx(4 * kept[50e3, east], rel=0.02)
    assert kept[100e3, 30.0] > kept[100e3, 90.0]


def swell(**settings):
    """The nominal depth under a swell along north."""
    return Scene(
        surface={"reflection": "tilted", "swell": {"height": 0.1, "length": LONG, **settings}, "wave_direction": 0.0}
    )


def tilted(scene, sonar=SONAR, target=TARGET, time=0.0):
    """Legs off the tilted plane, out and back."""
    point = point_scatterer(PointTarget(position=tuple(target)))
    mirror = image_legs(scene, sonar, point, ("S", "BS"), 1e5)
    return tilted_legs(mirror, scene, point, SonarEnd(sonar, time))


def assert_alike(one, other, atol=1e-12):
    """Delays and directions, out and back."""
    for a, b in zip(one, other, strict=True):
        np.testing.assert_allclose(a.delay, b.delay, rtol=0, atol=atol)
        np.testing.assert_allclose(a.departure, b.departure, rtol=0, atol=1e-8)
        np.testing.assert_allclose(a.arrival, b.arrival, rtol=0, atol=1e-8)
        np.testing.assert_allclose(a.amplitude, b.amplitude, rtol=1e-7)


@pytest.mark.parametrize("time", [0.0, 1.7])
def test_a_swell_comes_back_after_its_length_and_its_period(time):
    """A length along, any way along its crests, a period later: the same legs; half a length along they differ."""
    scene = swell()
    period = 2 * np.pi / float(angular_frequency(2 * np.pi / LONG, water_depth=20.0))
    here = tilted(scene, time=time)
    for shift in ([LONG, 0, 0], [0, 13.7, 0], [-2 * LONG, 5.0, 0]):
        assert_alike(tilted(scene, SONAR + shift, TARGET + shift, time), here)
    assert_alike(tilted(scene, time=time + 3 * period), here)
    shift = np.array([LONG / 2, 0, 0])
    half = tilted(scene, SONAR + shift, TARGET + shift, time)
    assert np.abs(half[0].delay - here[0].delay).max() > 1e-7


def test_a_swell_may_be_followed():
    """Gone along with the crests for 2 s, everything is where it was."""
    scene = swell()
    speed = float(angular_frequency(2 * np.pi / LONG, water_depth=20.0)) / (2 * np.pi / LONG)
    gone = np.array([2.0 * speed, 0, 0])
    assert_alike(tilted(scene, SONAR + gone, TARGET + gone, 2.0), tilted(scene), atol=1e-11)


def test_planes_touch_the_surface_whose_slope_they_have():
    """Heights a centimetre apart differ as the normal states, and never by more than half the height from the mean."""
    scene = swell()
    places = np.column_stack([np.linspace(0, 2 * LONG, 301), np.full(301, 4.0)])
    on, normal = tilted_planes(scene, places, np.full(301, 0.6))
    step = np.array([5e-3, 0.0])
    sides = [tilted_planes(scene, places + way * step, np.full(301, 0.6))[0][:, 2] for way in (-1, 1)]
    np.testing.assert_allclose((sides[1] - sides[0]) / 0.01, -normal[:, 0] / normal[:, 2], atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1, rtol=1e-14)
    np.testing.assert_allclose(normal[:, 1], 0, atol=1e-15)
    assert np.abs(on[:, 2]).max() == pytest.approx(0.05, rel=1e-3) and on[:300, 2].mean() == pytest.approx(0, abs=1e-9)


def test_a_swell_of_half_the_height_moves_a_leg_by_half():
    """To first order the surface's height counts, and its slope by the square: the excess halves, but for a few %."""
    mirror = tilted(swell(height=1e-9))[0].delay
    whole, half, quarter = (tilted(swell(height=h))[0].delay - mirror for h in (0.04, 0.02, 0.01))
    assert np.abs(whole).min() > 1e-7
    np.testing.assert_allclose(half / whole, 0.5, atol=0.05)
    # and comes nearer to it as the swell gets lower
    assert np.all(np.abs(quarter / half - 0.5) < np.abs(half / whole - 0.5) + 1e-6)
