"""A rough, moving surface: how much it leaves of a mirror, where the rest goes, and how long it keeps its phase."""

from dataclasses import replace

import numpy as np
import pytest

from insonify.ocean.directional_spreading import ElfouhailySpreading
from insonify.ocean.elfouhaily import Elfouhaily
from insonify.ocean.sea_surface import SeaSurface
from insonify.ocean.wave_spectrum import angular_frequency, height_variance, mean_square_slope, vertical_speed_rms
from insonify.propagation.displaced_bounce import displace_bounces, unfold_paths
from insonify.propagation.glints import SonarEnd, glint_surface
from insonify.propagation.image_sources import image_legs
from insonify.propagation.surface_reflection import repeated_glint_weight
from insonify.scattering.bubbles import bubble_loss_db
from insonify.scattering.lambert import Lambert
from insonify.scattering.surface_coherence import coherent_reflection
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from oracles.few_of import few_of

F, C, SHORTEST = 100e3, 1500.0, 2 * np.pi * 100e3 / 1500 / 3
PLACE = np.array([0.0, 0.0, 11.0])
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")  # winds below 3 m/s are meant


def points(east, count=1, north=0.0, depth=20.0):
    """Points of the seabed at one place, each with a key of its own."""
    return Scatterers(
        "seabed", "seabed", Lambert(), np.tile([north, east, depth], (count, 1)), np.tile([0.0, 0, -1], (count, 1)),
        np.ones(count), np.ones(count, complex), np.arange(count, dtype=np.uint64) + np.uint64(1 << 60),
    )  # fmt: skip


def sea(wind, **surface):
    """A sea under some wind, over the nominal depth."""
    return glint_surface(Scene(surface={"reflection": "statistical", "wind_speed": wind, **surface}), 7, F)


def off_the_surface(wind, east=150.0, count=1, family="S", *, time=0.0, place=PLACE, **surface):
    """Mirror's legs of one family, and what becomes of them out and back."""
    target, water = points(east, count), sea(wind, **surface)
    mirror = image_legs(water.scene, place, target, (family,), F)
    return mirror, *water.legs(mirror, target, SonarEnd(place, time))


def carried(legs, mirror):
    """Phasors of the glints, with the way that each of them goes."""
    row = legs.glints.bounce_id.index(max(legs.glints.bounce_id))
    return legs.glints.phasor[row] * np.exp(-2j * np.pi * F * (legs.delay[row] - mirror.delay[0]))


@pytest.mark.parametrize(("wind", "east"), [(0.5, 150.0), (1.0, 150.0), (1.0, 60.0)])
def test_the_coherent_leg_is_the_mirror_s_less_eckart_s_factor(wind, east):
    """Its pressure is exp(-2 Gamma^2) of the mirror's, by the height of the whole sea and the angle at the surface."""
    mirror, out, _ = off_the_surface(wind, east)
    grazing = np.arctan2(31.0, east)
    rms = height_variance(Elfouhaily(wind), max_wavenumber=SHORTEST) ** 0.5
    expected = -coherent_reflection(F, rms, grazing, sound_speed=C) * 10 ** (-bubble_loss_db(wind, F, grazing) / 20)
    assert out.glints.bounce_id[0] == -1
    np.testing.assert_allclose(np.abs(out.amplitude[0] / mirror.amplitude[0]), expected, rtol=1e-3)
    np.testing.assert_allclose(out.delay[0], mirror.delay[0], rtol=1e-14)


@pytest.mark.parametrize("wind", [0.3, 1.0, 3.0, 8.0])
@pytest.mark.parametrize("family", ["S", "BS", "SBS"])
def test_nothing_is_lost_but_to_bubbles(wind, family):
    """Powers of the coherent leg and of its glints add up to the mirror's, less the bubbles' loss at every bounce."""
    mirror, out, _ = off_the_surface(wind, family=family)
    count, climb = family.count("S"), {"S": 31.0, "BS": 49.0, "SBS": 71.0}[family]
    bubbles = 10 ** (-count * bubble_loss_db(wind, F, np.arctan2(climb, 150.0)) / 10)
    power = np.sum(np.abs(out.reflection_coefficient) ** 2)
    assert power == pytest.approx(float(np.abs(mirror.reflection_coefficient[0, 0]) ** 2 * bubbles), rel=1e-5)


@few_of((1, 4), ("wind", "apart"), [(0.5, 0.05), (1.0, 0.02), (1.0, 0.2), (2.0, 0.02), (3.0, 0.02)])
def test_glints_decorrelate_like_a_realised_sea(wind, apart):
    """E[rho(t) rho*(t + dt)] of coherent leg and glints = that of exp(2 j k sin(g) eta) on seas drawn wave by wave.

    20 000 glints (error 0.007) against 4 seas of 3 000 places; and it is exp(-4 Gamma^2 (1 - rho_eta)).
    """
    count = 20_000
    mirror, now, _ = off_the_surface(wind, count=count)
    _, then, _ = off_the_surface(wind, count=count, time=apart)
    phase = 4 * np.pi * F / C * np.sin(np.arctan2(31.0, 150.0))
    mean = phase**2 * height_variance(Elfouhaily(wind), max_wavenumber=SHORTEST)
    glint = np.mean(carried(now, mirror) * carried(then, mirror).conj())
    whole = np.exp(-mean) - np.expm1(-mean) * glint
    north, east = np.random.default_rng(3).uniform(-2000, 2000, (2, 3000))
    wave = Elfouhaily(wind)
    waves = [
        SeaSurface(wave, ElfouhailySpreading(wave), seed=s, shortest_wavelength=2 * np.pi / SHORTEST) for s in range(4)
    ]
    drawn = np.mean([np.exp(1j * phase * (w.elevation(north, east, apart) - w.elevation(north, east, 0.0)))
                     for w in waves])  # fmt: skip
    assert abs(whole - drawn) < 0.04


def test_glints_recur_on_the_receive_leg():
    """Between out and back, 0.1 s + 20/31 less 11/31 of the surface leg apart, glints turn by their own frequencies.

    Mean of phasor out times phasor back = (exp(-4 Gamma^2 (1 - rho)) - exp(-4 Gamma^2)) / (1 - exp(-4 Gamma^2)), rho by
    the integral over the spectrum; 1 m/s, 40 000 glints (0.005).
    """
    wind, east = 1.0, 150.0
    _, out, back = off_the_surface(wind, east, count=40_000)
    row = out.glints.bounce_id.index(max(out.glints.bounce_id))
    found = np.mean(out.glints.phasor[row] * back.glints.phasor[row].conj())
    apart = np.hypot(9.0, east) / C + (20 - 11) / 31 * np.hypot(31, east) / C
    k = np.geomspace(Elfouhaily(wind).peak / 8, SHORTEST, 20_000)
    share = Elfouhaily(wind).density(k)
    rho = np.trapezoid(share * np.cos(angular_frequency(k) * apart), k) / np.trapezoid(share, k)
    mean = (4 * np.pi * F / C * np.sin(np.arctan2(31.0, east))) ** 2 * np.trapezoid(share, k)
    expected = (np.exp(-mean * (1 - rho)) - np.exp(-mean)) / -np.expm1(-mean)
    assert abs(found - expected) < 0.02


def test_decorrelation_of_a_rough_sea_follows_its_vertical_speed():
    """Gamma far above 1: coherence over dt is exp(-(2 k sin(g) w dt)^2 / 2), w the rms vertical speed: 5 m/s, 3 ms."""
    mirror, now, _ = off_the_surface(5.0, count=20_000)
    _, then, _ = off_the_surface(5.0, count=20_000, time=3e-3)
    phase = 4 * np.pi * F / C * np.sin(np.arctan2(31.0, 150.0))
    expected = np.exp(-0.5 * (phase * vertical_speed_rms(Elfouhaily(5.0), SHORTEST) * 3e-3) ** 2)
    assert abs(np.mean(carried(now, mirror) * carried(then, mirror).conj())) == pytest.approx(expected, abs=0.02)


@pytest.mark.parametrize("apart", [0.0, 0.02])
@few_of((0, 1), "towards", [0.0, np.pi / 2, -np.pi / 2])
def test_glints_decorrelate_over_the_surface_like_a_realised_sea(towards, apart):
    """A sonar that moves 5 cm along its beam moves the bounce by 3.2 cm: coherence as of seas drawn wave by wave.

    Along, against and across a wind of 1 m/s, at once and 20 ms later; error 0.01 and 0.02.
    """
    moved, count, wind = np.array([0.0, 0.05, 0.0]), 20_000, 1.0
    here, one, _ = off_the_surface(wind, count=count, wave_direction=towards)
    there, other, _ = off_the_surface(wind, count=count, place=PLACE + moved, time=apart, wave_direction=towards)
    # The sea's height delays: its phasor is exp(-j q eta).
    glint = np.mean(carried(other, there) * carried(one, here).conj())
    phase = 4 * np.pi * F / C * np.sin(np.arctan2(31.0, 150.0))
    mean = phase**2 * height_variance(Elfouhaily(wind), max_wavenumber=SHORTEST)
    north, east = np.random.default_rng(3).uniform(-2000, 2000, (2, 3000))
    wave, step = Elfouhaily(wind), 0.05 * 20 / 31
    waves = [
        SeaSurface(wave, ElfouhailySpreading(wave), towards, s, shortest_wavelength=2 * np.pi / SHORTEST)
        for s in range(4)
    ]
    drawn = np.mean([np.exp(-1j * phase * (w.elevation(north, east + step, apart) - w.elevation(north, east, 0.0)))
                     for w in waves])  # fmt: skip
    assert abs(np.exp(-mean) - np.expm1(-mean) * glint - drawn) < 0.04


@pytest.mark.parametrize(("wind", "drawn"), [(0.6, True), (0.6, False), (3.0, True), (5.0, False)])
def test_both_ways_bear_the_square_of_one(wind, drawn):
    """Mean power of all pairs of one family = square of its legs' power, and no pair reaches one glint twice."""
    water, target = sea(wind), replace(points(150.0, 1), has_random_phase=drawn)
    out, back = water.legs(image_legs(water.scene, PLACE, target, ("S",), F), target, SonarEnd(PLACE, 0.0))
    rows = range(len(out.families))
    pair = np.array([(i, j) for i in rows for j in rows])
    weight = repeated_glint_weight(out, back, pair)
    power = np.abs(out.reflection_coefficient[:, 0]) ** 2
    assert np.sum(weight**2 * power[pair[:, 0]] * power[pair[:, 1]]) == pytest.approx(np.sum(power) ** 2, rel=1e-12)
    again = [(i, i) for i in rows if out.glints.bounce_id[i] >= 0]
    assert {tuple(p) for p, w in zip(pair.tolist(), weight, strict=True) if w == 0} == set(again)


def test_glints_come_late_by_the_slope_s_lengthening():
    """Mean excess delay = s^2 (1 + sin^2 g) r1 r2 / ((r1 + r2) c) where slopes are small against the grazing angle."""
    mirror, out, _ = off_the_surface(3.0, east=10.0, count=20_000)
    row, sine = 0, 31 / np.hypot(31, 10.0)
    slopes = mean_square_slope(Elfouhaily(3.0), SHORTEST)
    expected = slopes * (1 + sine**2) * (11 * 20 / 31) / (sine * C)
    assert np.mean(out.delay[row] - mirror.delay[0]) == pytest.approx(expected, rel=0.06)
    assert np.all(out.delay[row] >= mirror.delay[0] * (1 - 1e-12))


@pytest.mark.parametrize("east", [60.0, 5.0, 0.01])
def test_a_facet_reflects_to_its_point(east):
    """In the vertical plane the corner satisfies the law of reflection on a facet of that slope, to 19 degrees.

    Overhead too, where the bounce lies beyond either end.
    """
    slope = np.linspace(-0.35, 0.35, 15)
    lines = unfold_paths("S", PLACE, np.tile([0.0, east, 20.0], (15, 1)), 20.0)
    displaced = displace_bounces(lines, np.stack([slope, 0 * slope])[None])
    leaving = np.array([0.0, east, -31]) / np.hypot(east, 31) + displaced.departure_change
    arriving = np.array([0.0, east, 31]) / np.hypot(east, 31) + displaced.arrival_change
    normal = arriving - leaving
    # Elevation rises as depth falls: the normal into the water is (slope, 1) over (ahead, down).
    np.testing.assert_allclose(normal[:, 1] / normal[:, 2], slope, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(leaving, axis=1), 1, atol=1e-12)


@pytest.mark.parametrize("across", [-0.01, 0.01])
def test_a_facet_that_rises_to_the_right_sends_sound_to_the_right(across):
    """Law of reflection across the way, for a small slope: what comes back to its point was reached on the left."""
    lines = unfold_paths("S", PLACE, np.array([[0.0, 60.0, 20.0]]), 20.0)
    displaced = displace_bounces(lines, np.array([0.0, across])[None, :, None])
    normal = (
        np.array([0.0, 0.0, 2 * 31 / np.hypot(60, 31)]) + displaced.arrival_change[0] - displaced.departure_change[0]
    )
    # right of east is south, and the normal into the water leans to where elevation rises
    assert -normal[0] / normal[2] == pytest.approx(across, rel=1e-3)


@pytest.mark.parametrize("axis", [0, 1])
def test_glints_leave_as_their_phase_runs(axis):
    """A sonar that moves reaches a phase that grows by 2 pi f / c times the cosine of departure: 2000 glints, 10 %.

    North is across their way, east along it. Close by, where slopes are small against the grazing angle.
    """
    moved = np.zeros(3)
    moved[axis] = 1e-5
    mirror, here, _ = off_the_surface(3.0, east=10.0, count=2000)
    _, there, _ = off_the_surface(3.0, east=10.0, count=2000, place=PLACE + moved)
    row = here.glints.bounce_id.index(max(here.glints.bounce_id))
    turned = np.angle(there.glints.phasor[row] / here.glints.phasor[row])
    phase = turned - 2 * np.pi * F * (there.delay[row] - here.delay[row])
    runs = np.angle(np.exp(1j * phase)) / (2 * np.pi * F / C * 1e-5)
    straight = mirror.departure[0, :, axis]
    displaced = here.departure[row, :, axis] - straight
    assert np.sum((runs - straight) * displaced) / np.sum(displaced**2) == pytest.approx(1.0, abs=0.1)
    assert np.corrcoef(runs - straight, displaced)[0, 1] > 0.97


@pytest.mark.parametrize("slopes", [(0.01, 0.0), (0.0, 0.01), (0.006, -0.008)])
def test_a_small_slope_lengthens_a_leg_by_its_square(slopes):
    """Excess length = 2 r1 r2 / (r1 + r2) (along^2 + across^2 sin^2 g), to second order."""
    lines = unfold_paths("S", PLACE, np.array([[0.0, 60.0, 20.0]]), 20.0)
    displaced = displace_bounces(lines, np.array(slopes)[None, :, None])
    length, sine = np.hypot(60, 31), 31 / np.hypot(60, 31)
    expected = 2 * length * (11 / 31) * (20 / 31) * (slopes[0] ** 2 + (slopes[1] * sine) ** 2)
    assert displaced.excess_length[0] == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("family", ["S", "SB", "BS", "SBS", "BSB"])
def test_without_slopes_nothing_bends(family):
    """A level facet is the mirror."""
    lines = unfold_paths(family, PLACE, np.array([[3.0, 60.0, 18.0]]), 20.0)
    displaced = displace_bounces(lines, np.zeros((family.count("S"), 2, 1)))
    for change in displaced:
        np.testing.assert_allclose(change, 0, atol=1e-10)


def test_a_glint_belongs_to_its_place():
    """The same place has the same glint whatever other places are requested, and another seed has another."""
    _, many, _ = off_the_surface(3.0, count=50)
    _, few, _ = off_the_surface(3.0, count=20)
    np.testing.assert_array_equal(few.delay, many.delay[:, :20])
    np.testing.assert_array_equal(few.amplitude, many.amplitude[:, :20])
    target = points(150.0, 20)
    other = glint_surface(sea(3.0).scene, 8, F)
    changed, _ = other.legs(image_legs(other.scene, PLACE, target, ("S",), F), target, SonarEnd(PLACE, 0.0))
    assert not np.any(changed.delay == few.delay)
