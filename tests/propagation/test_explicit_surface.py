"""Legs off drawn waves: every point of the surface that reflects a path, as strong as the waves focus it."""

import warnings

import numpy as np
import pytest
from scipy.integrate import quad

from insonify.ocean.directional_spreading import ElfouhailySpreading
from insonify.ocean.elfouhaily import Elfouhaily
from insonify.ocean.sea_surface import SeaSurface
from insonify.propagation.explicit_surface import (
    BANDS,
    SECTORS,
    _cusp_factor,
    bounce_spreading,
    explicit_surface_legs,
    explicit_waves,
    find_bounce_points,
)
from insonify.propagation.glints import SonarEnd
from insonify.propagation.image_sources import image_legs
from insonify.scattering.lambert import Lambert
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene, point_scatterer
from insonify.scene.surface import Surface
from insonify.scene.target import PointTarget
from oracles.kirchhoff import reflected

PLACE, FAR = np.array([0.0, 0.0, 11.0]), (0.0, 150.0, 19.5)
NEAR, CLOSE = np.array([0.0, 0.0, 4.0]), (20.0, 0.0, 6.0)
SPEED = 1500.0


def swell(height, length, wave_direction=np.pi / 2):
    """A scene under one long-crested wave."""
    surface = {
        "reflection": "explicit",
        "swell": {"height": height, "length": length},
        "wave_direction": wave_direction,
    }
    return Scene(surface=surface)


def windy(speed, split=None):
    """A scene under a wind sea."""
    return Scene(
        surface={"reflection": "explicit", "wind_speed": speed, "cutoff_wavelength": split, "wave_direction": 0.4}
    )


def points(count, nearest, farthest, *, seed=0):
    """Points of the seabed, to the east."""
    draw = np.random.default_rng(seed)
    place = np.column_stack([draw.uniform(-3, 3, count), draw.uniform(nearest, farthest, count), np.full(count, 19.9)])
    ones = np.ones(count)
    return Scatterers(
        "seabed", "seabed", Lambert(), place, np.tile([0, 0, -1.0], (count, 1)), ones, ones + 0j,
        np.arange(count).astype(np.uint64),
    )  # fmt: skip


def legs(where, family="S", *, place=PLACE, target=FAR, frequency=1e5, time=0.0):
    """Mirror's leg of one family, and those off the waves out and back."""
    point = point_scatterer(PointTarget(position=target))
    mirror = image_legs(where, place, point, (family,), frequency)
    return mirror, *explicit_surface_legs(mirror, where, 1, point, frequency, SonarEnd(place, time))


def bounces_of(where, *, target=FAR, time=0.0, most=48):
    """Bounce points of the S leg outwards, without the dark sides of folds."""
    sea, point = explicit_waves(where.surface, 1, where.seabed.depth), point_scatterer(PointTarget(position=target))
    found = find_bounce_points(sea, "S", point, SonarEnd(PLACE, time), where, 1e5, is_transmit_leg=True, max_count=most)
    rows = found.points[0, : found.bounce_count[0]]
    return rows[rows[:, 11] == 0]


@pytest.mark.parametrize("family", ["S", "BS", "SB", "BSB"])
def test_a_calm_is_a_mirror(family):
    """Waves of a nanometre change no leg, its level and phase included."""
    mirror, *moved = legs(swell(1e-9, 20.0), family)
    for way in moved:
        assert way.delay.shape == (1, 1)
        np.testing.assert_allclose(way.delay, mirror.delay, rtol=1e-11)
        np.testing.assert_allclose(way.departure, mirror.departure, atol=1e-7)
        np.testing.assert_allclose(way.arrival, mirror.arrival, atol=1e-7)
        np.testing.assert_allclose(way.amplitude, mirror.amplitude, rtol=1e-6)


@pytest.mark.parametrize("time", [0.0, 1.1, 2.3])
def test_a_low_swell_changes_the_delay_as_its_height_predicts(time):
    """First order: a crest makes a path longer by 2 eta sin(grazing), each bounce at its own time."""
    height, length = 2e-4, 40.0
    mirror, out, back = legs(swell(height, length), time=time)
    whole = float(mirror.length[0, 0])
    sine, part = 30.5 / whole, 11 / 30.5
    there = np.linalg.norm(np.array(FAR) - PLACE) / SPEED
    k = 2 * np.pi / length
    omega = np.sqrt(9.81 * k * np.tanh(k * 20))
    for way, when in ((out, time + part * whole / SPEED), (back, time + there + (1 - part) * whole / SPEED)):
        eta = height / 2 * np.cos(k * part * 150 - omega * when)
        assert way.delay[0, 0] - mirror.delay[0, 0] == pytest.approx(2 * eta * sine / SPEED, abs=2e-3 * height / SPEED)


@pytest.mark.parametrize(
    ("amplitude", "length", "most"),
    [(0.01, 20.0, 1), (0.028, 20.0, 1), (0.1, 20.0, 3), (0.3, 20.0, 7), (0.05, 5.0, 17)],
)
def test_the_number_of_bounces_is_that_of_the_curvature(amplitude, length, most):
    """150 m away at 11 m: one bounce up to 2.9 cm by 20 m, then 3, 7 and, of short waves, 17, whatever the time."""
    counts = [len(bounces_of(swell(2 * amplitude, length), time=time)) for time in np.linspace(0, 3.6, 13)]
    assert max(counts) == most
    assert np.mean(np.array(counts) % 2) > 0.9  # pairs come and go together


def test_bounces_are_where_the_path_is_stationary():
    """Fermat, on a wind sea with the heights of `SeaSurface`: no way beside a bounce is shorter, to first order."""
    where, spectrum = windy(5.0), Elfouhaily(5.0)
    sea = SeaSurface(
        spectrum,
        ElfouhailySpreading(spectrum),
        0.4,
        1,
        where.surface.shortest_explicit_wavelength,
        20.0,
        BANDS,
        SECTORS,
    )
    time = 3.0

    def way(north, east):
        up = sea.elevation(north, east, time + np.linalg.norm([north, east, PLACE[2]]) / SPEED)
        here = np.stack([north, east, -up], axis=-1)
        return np.linalg.norm(here - PLACE, axis=-1) + np.linalg.norm(np.array(FAR) - here, axis=-1)

    found = bounces_of(where, time=time)
    assert len(found) >= 1
    for row in found:
        n, e, step = row[0], row[1], 0.01
        assert way(n, e) == pytest.approx(row[3] + row[4], abs=1e-8)
        for dn, de in ((step, 0), (0, step)):
            assert abs(way(n + dn, e + de) - way(n - dn, e - de)) / (2 * step) < 1e-6


def test_shortest_and_longest_ways_outnumber_saddles_by_one():
    """Poincare and Hopf: minima less saddles plus maxima make 1, for over 95 % of 200 points, all but near folds."""
    where, many = windy(5.0, 8.0), points(200, 80, 150)
    found = find_bounce_points(
        explicit_waves(where.surface, 1, 20.0), "S", many, SonarEnd(PLACE, 0.0), where, 1e5, is_transmit_leg=True
    )
    real = (np.arange(found.points.shape[1]) < found.bounce_count[:, None]) & (found.points[..., 11] == 0)
    index = np.sum(np.where(real, np.sign(found.points[..., 7] * found.points[..., 8]), 0), axis=1)
    assert np.mean(index == 1) > 0.95
    assert found.bounce_count.max() >= 3


def test_a_point_finds_the_same_bounces_alone_as_among_others():
    """Bit for bit: what a point shares with its neighbours follows from the cell that it lies in."""
    where, many = windy(5.0), points(40, 100, 101)
    sea = explicit_waves(where.surface, 1, 20.0)
    whole = find_bounce_points(sea, "S", many, SonarEnd(PLACE, 0.0), where, 1e5, is_transmit_leg=False)
    for n in (0, 17, 39):
        alone = find_bounce_points(
            sea, "S", many.take(np.arange(40) == n), SonarEnd(PLACE, 0.0), where, 1e5, is_transmit_leg=False
        )
        assert alone.bounce_count[0] == whole.bounce_count[n]
        np.testing.assert_array_equal(alone.points[0], whole.points[n, : alone.bounce_count[0]])


@pytest.mark.parametrize(
    ("wave_direction", "height", "length", "count"),
    [(0.9, 0.2, 6.0, 1), (0.5, 0.15, 3.0, 5), (0.0, 0.15, 3.0, 6)],
)
def test_bounces_add_up_to_kirchhoffs_integral(wave_direction, height, length, count):
    """Within 0.5 dB and 4 degrees of the sum over the surface: one bounce, five, and beside a fold.

    20 kHz, ends 4 and 6 m deep, 20 m apart, 1.4 million points of the surface.
    """
    where, frequency = swell(height, length, wave_direction), 20e3
    wave = explicit_waves(where.surface, 1, 20.0).waves[:, 0]

    def surface(north, east):
        when = np.sqrt(north**2 + east**2 + NEAR[2] ** 2) / SPEED
        phase = 2 * np.pi * (wave[0] * north + wave[1] * east + wave[2] * when)
        steep = -height / 2 * 2 * np.pi * np.sin(phase)
        return height / 2 * np.cos(phase), wave[0] * steep, wave[1] * steep

    k = 2 * np.pi * frequency / SPEED
    truth = reflected(surface, NEAR, CLOSE, k, (-6, 26, 2000), (-7, 7, 700))
    _, out, _ = legs(where, place=NEAR, target=CLOSE, frequency=frequency)
    received = -np.sum(out.amplitude / out.absorption * np.exp(-1j * k * out.length))
    assert len(out.families) == count
    assert 20 * np.log10(abs(received / truth)) == pytest.approx(0, abs=0.5)
    assert np.degrees(np.angle(received / truth)) == pytest.approx(0, abs=4.0)


def test_a_fold_has_no_edge():
    """Where two bounces merge, sound fades: from one cm to the next the sum changes no more there than elsewhere."""
    where, k = swell(0.3, 20.0), 2 * np.pi * 1e5 / SPEED
    many = points(6000, 80, 140)
    many.position[:] = np.column_stack([np.zeros(6000), np.linspace(80, 140, 6000), np.full(6000, 19.9)])
    found = find_bounce_points(
        explicit_waves(where.surface, 1, 20.0), "S", many, SonarEnd(PLACE, 0.0), where, 1e5, is_transmit_leg=True
    )
    there = np.arange(found.points.shape[1]) < found.bounce_count[:, None]
    count = np.sum(there & (found.points[..., 11] == 0), axis=1)
    mirror = np.linalg.norm(many.position + np.array([0, 0, 11.0]), axis=1)
    phasor = np.exp(-1j * k * (found.points[..., 3] + found.points[..., 4] - mirror[:, None]))
    total = np.sum(np.where(there, bounce_spreading(found, k) * phasor, 0), axis=1) * mirror
    jumps, merged = np.abs(np.diff(total)), np.diff(count) != 0
    assert merged.sum() >= 3
    assert jumps[merged].max() < 2 * np.quantile(jumps, 0.99)


@pytest.mark.parametrize("z", [1e-3, 0.1, 1.0, 10.0, 25.0])
def test_a_focus_is_as_strong_as_its_integral(z):
    """Integral of exp(-j (a u^2 / 2 + d u^4 / 24)) by a complex line on which it decays; z = 3 a^2 / 4 d."""
    a, d, turn = 1.0, 0.75 / z, np.exp(-1j * np.pi / 8)

    def part(u):
        return np.exp(-1j * (a * (u * turn) ** 2 / 2 + d * (u * turn) ** 4 / 24)) * turn

    whole = 2 * (
        quad(lambda u: part(u).real, 0, 30, limit=400)[0] + 1j * quad(lambda u: part(u).imag, 0, 30, limit=400)[0]
    )
    assert _cusp_factor(np.array([z]))[0] == pytest.approx(whole / np.sqrt(2 * np.pi / 1j), rel=1e-3)


def power_over_mirror(wind, seeds, count):
    """Mean |sum of the drawn waves' legs|^2 over that of a mirror, of points 50 to 150 m away."""
    k, ratio = 2 * np.pi * 1e5 / SPEED, []
    where = windy(wind)
    for seed in range(seeds):
        many = points(count, 50, 150, seed=seed)
        found = find_bounce_points(
            explicit_waves(where.surface, seed, 20.0),
            "S",
            many,
            SonarEnd(PLACE, 7.0 * seed),
            where,
            1e5,
            is_transmit_leg=True,
        )
        ways = found.points[..., 3] + found.points[..., 4]
        there = np.arange(found.points.shape[1]) < found.bounce_count[:, None]
        total = np.sum(np.where(there, bounce_spreading(found, k) * np.exp(-1j * k * ways), 0), axis=1)
        mirror = np.linalg.norm(many.position + np.array([0, 0, 11.0]), axis=1)
        ratio.append(np.mean(np.abs(total * mirror) ** 2))
    return 10 * np.log10(np.mean(ratio))


def test_waves_return_what_a_mirror_does():
    """Energy: the mean over 15 seas of 40 points each, at 5 m/s, is a mirror's within 1 dB (error 0.3 dB)."""
    assert power_over_mirror(5.0, 15, 40) == pytest.approx(0, abs=1.0)


@pytest.mark.validate
@pytest.mark.parametrize("wind", [3.0, 5.0, 10.0])
def test_any_wind_returns_what_a_mirror_does(wind):
    """The same over 150 seas (error 0.1 dB), where one bounce a path is the rule and where there are ten."""
    assert power_over_mirror(wind, 150, 40) == pytest.approx(0, abs=1.0)


def test_what_is_not_drawn_keeps_the_rest_of_the_energy():
    """Coherent parts and glints of short waves bear the power of the drawn ones but for 2 %, bubbles among them."""
    where, many = windy(3.0, 5.0), points(30, 40, 60)
    mirror = image_legs(where, PLACE, many, ("D", "S"), 20e3)
    out, _ = explicit_surface_legs(mirror, where, 1, many, 20e3, SonarEnd(PLACE, 0.0))
    found = find_bounce_points(
        explicit_waves(where.surface, 1, 20.0), "S", many, SonarEnd(PLACE, 0.0), where, 20e3, is_transmit_leg=True
    )
    there = np.arange(found.points.shape[1]) < found.bounce_count[:, None]
    expected = np.sum(np.where(there, np.abs(bounce_spreading(found, 2 * np.pi * 20e3 / SPEED)) ** 2, 0))
    rows = [row for row, family in enumerate(out.families) if family == "S"]
    assert np.sum((out.spreading * np.abs(out.reflection_coefficient) * out.visibility)[rows] ** 2) == pytest.approx(
        expected, rel=0.02
    )
    assert out.glints is not None and len(rows) > found.points.shape[1]


def test_half_of_the_dominant_waves_is_drawn_unless_given():
    """The split: half the length of the wind's dominant waves, of 2 pi U^2 / (0.84^2 g)."""
    surface = Surface(reflection="explicit", wind_speed=5.0)
    assert surface.shortest_explicit_wavelength == pytest.approx(np.pi * 25 / (0.84**2 * 9.81))
    drawn = explicit_waves(surface, 1, 20.0)
    lengths = 1 / np.hypot(drawn.waves[0], drawn.waves[1])
    assert lengths.min() >= surface.shortest_explicit_wavelength * 0.999
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Surface(reflection="explicit", wind_speed=2.0, cutoff_wavelength=1.0).shortest_explicit_wavelength == 1.0
