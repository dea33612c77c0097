"""Reflections off a rough seabed: how much stays coherent, what glints carry, and what the scattering law takes."""

from functools import lru_cache, partial

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.optimize import brentq
from scipy.special import j0

from insonify.engines.glint_spread import glint_spread
from insonify.propagation.families import image_depth
from insonify.propagation.glint_kernel import GlintPoints, GlintSource, sample_bed_glint
from insonify.propagation.glints import SonarEnd, glint_surface
from insonify.propagation.image_sources import StraightRays
from insonify.scattering import SmallSlope
from insonify.scattering.lambert import Lambert
from insonify.scattering.reflection import reflection_coefficient
from insonify.scattering.roughness import band_variance
from insonify.scattering.sediments import Sediment
from insonify.scene.scatterers import Scatterers
from insonify.scene.scene import Scene
from insonify.simulator import levels, simulate
from oracles.few_of import few_of
from oracles.forward_scatter import energies, ring_energies
from oracles.scenes import each_ping, nominal
from oracles.time_series import relative_rms

C, PLACE = 1500.0, np.array([0.0, 0.0, 11.0])
RELIEF = {"kind": "power-law", "hurst": 0.8, "rms": "5 cm", "outer_scale": "10 m"}
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")  # 300 kHz and calm are meant


def bed(sediment="very fine sand", **more):
    """A rough seabed of a sediment that reflects as that sediment does."""
    return {"depth": 20.0, "reflecting_interface": "rough", "scattering": {"law": "jackson", "sediment": sediment},
            "reflection": sediment, **more}  # fmt: skip


def reflected(scene, family, frequency, *, east=60.0, depth=15.0, count=1, place=PLACE, time=0.0, seed=7):
    """Legs of one family off mirrors, and off the rough boundaries out and back, to points in the water."""
    points = Scatterers(
        "points", "target", Lambert(), np.tile([0.0, east, depth], (count, 1)), np.zeros((count, 3)),
        np.ones(count), np.ones(count, complex), np.arange(count, dtype=np.uint64) + np.uint64(1 << 60),
    )  # fmt: skip
    legs = StraightRays(scene).legs(place, points, (family,), frequency)
    return legs, *glint_surface(scene, seed, frequency).legs(legs, points, SonarEnd(place, time))


def longest(frequency, before, after, sine):
    """Wavenumber of a wave as long as the mean of the Fresnel zone's axes [rad/m], by the two path lengths."""
    return np.pi / np.sqrt(C / frequency * before * after / (before + after) / sine)


def scattered_widely(sediment, frequency, grazing):
    """Energy that the law's surface scatters where the horizontal wavenumber changes by k/3 and more [1]: by steps."""
    sine, azimuth = np.meshgrid((np.arange(150) + 0.5) / 150, (np.arange(200) + 0.5) * np.pi / 100)
    out = np.arcsin(sine)
    change = np.hypot(np.cos(out) * np.cos(azimuth) - np.cos(grazing), np.cos(out) * np.sin(azimuth))
    section = SmallSlope(sediment, frequency, sound_speed=C).cross_section(np.full_like(out, grazing), out, azimuth)
    return np.sum(section * (change > 1 / 3)) * np.pi / 100 / 150 / np.sin(grazing)


@few_of((0, 2), "gamma", [0.3, 1.0, 3.0])
def test_energy_beyond_a_rough_bed_is_that_of_kirchhoff_s_integral(gamma):
    """Coherent part to 1e-3, glints to the lobe and the whole with what the law takes to 0.3 dB; 53 deg grazing."""
    sediment, height = Sediment.named("very fine sand"), 4.0

    def low(k):
        return longest(k * C / (2 * np.pi), height / 0.8, height / 0.8, 0.8)

    k = brentq(lambda k: k * 0.8 * band_variance(sediment, low(k), k) ** 0.5 - gamma, 30, 8000)
    frequency = k * C / (2 * np.pi)
    coherent, lobe, wide = energies(height, 6.0, k, sediment, low(k), beyond=1 / 3)
    scene = Scene(water={"sound_speed": C}, seabed=bed(reflection=1.0))
    _, out, _ = reflected(scene, "B", frequency, east=6.0, depth=16.0, place=np.array([0.0, 0.0, 16.0]))
    power = np.abs(out.reflection_coefficient[:, 0]) ** 2
    kept = np.array(out.glints.bounce_id) < 0
    assert power[kept].sum() == pytest.approx(coherent, abs=1e-3)
    assert 10 * np.log10(power[~kept].sum() / lobe) == pytest.approx(0.0, abs=0.3)
    assert -10 * np.log10(coherent + lobe + wide) == pytest.approx(0.0, abs=0.3)


@few_of(
    (0, 2),
    ("sediment", "frequency", "east"),
    [("medium sand", 120e3, 0.1), ("medium sand", 300e3, 14.0), ("very fine sand", 100e3, 14.0)],
)
def test_glints_change_the_wavenumber_as_kirchhoff_s_integral_does(sediment, frequency, east):
    """Eight rings up to k/3, 4 Gamma^2 from 5 to 60: fractions of 5000 glints within 4.5 standard errors."""
    count, made_of = 5000, Sediment.named(sediment)
    k, sine = 2 * np.pi * frequency / C, 14 / np.hypot(14, east)
    scene, q = Scene(water={"sound_speed": C}, seabed=bed(sediment)), 2 * k * sine
    roughness, ones = glint_surface(scene, 7, frequency).bed, np.ones(count)
    longer = roughness.longer_waves("B", 11.0, np.array([14 / sine]), np.array([sine]))[0]
    points = GlintPoints(
        np.arange(count, dtype=np.uint64),
        np.zeros((count, 3)),
        np.zeros((count, 3)),
        ones,
        q * ones,
        longer * ones,
        ones,
    )
    source = GlintSource(
        roughness.waves, np.eye(2), 1.0, (1, 2), 0, roughness.waves, np.eye(2), roughness.max_wavenumber, 1.0
    )
    changes = np.array([np.hypot(*sample_bed_glint(points, source, n, 16, True)[:2]) for n in range(count)])
    edges = np.array([0.0, 0.03, 0.06, 0.1, 0.15, 0.2, 0.25, 0.3, 1 / 3])
    fraction, _ = ring_energies(k, q, made_of, longest(frequency, 9 / sine, 5 / sine, sine), edges)
    fraction /= fraction.sum()
    found = np.histogram(changes / k, edges)[0] / count
    assert found.sum() > 0.999
    assert np.all(np.abs(found - fraction) < 4.5 * np.sqrt(fraction / count))


@few_of((0, 2), "sediment", ["coarse sand", "medium sand", "coarse silt"])
@pytest.mark.parametrize("frequency", [30e3, 100e3, 300e3])
def test_reflected_scattered_and_transmitted_energies_add_up_to_all(sediment, frequency):
    """Legs by B, the law's integral by other steps, and what enters the seabed: 1 within 2 % at 10, 25 and 50 deg."""
    scene = Scene(water={"sound_speed": C}, seabed=bed(sediment))
    for grazing in np.radians([10.0, 25.0, 50.0]):
        _, out, _ = reflected(scene, "B", frequency, east=(40 - 26) / np.tan(grazing))
        made_of = Sediment.named(sediment)
        law = scattered_widely(made_of, frequency, grazing)
        entered = 1 - np.abs(reflection_coefficient(made_of, np.array(grazing))) ** 2
        assert np.sum(np.abs(out.reflection_coefficient) ** 2) + law + entered == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("wind", [None, 1.0])
@pytest.mark.parametrize("family", ["BS", "SB", "BSB"])
def test_every_bottom_bounce_has_eckart_s_factor_and_loses_the_law_s_share(family, wind):
    """Coherent pressure exp(-2 Gamma^2) of each bounce, and the energies of families the product of their bounces'."""
    surface = {} if wind is None else {"reflection": "statistical", "wind_speed": wind}
    rough = Scene(water={"sound_speed": C}, seabed=bed(), surface=surface)
    smooth = Scene(water={"sound_speed": C}, seabed=bed(reflecting_interface="smooth"), surface=surface)
    (mirror, one, _), (_, other, _) = (reflected(scene, family, 50e3) for scene in (rough, smooth))
    if wind is None:
        other = mirror
    climb = abs(15.0 - image_depth(family, 11.0, 20.0))
    sine, k, bounces = climb / np.hypot(climb, 60.0), 2 * np.pi * 50e3 / C, family.count("B")
    to_bed = {"BS": 9.0, "SB": 31.0, "BSB": 9.0}[family] / sine
    low = longest(50e3, to_bed, climb / sine - to_bed, sine)
    quanta = (2 * k * sine) ** 2 * band_variance(Sediment.named("very fine sand"), low, k)
    assert np.abs(one.amplitude[0, 0] / other.amplitude[0, 0]) == pytest.approx(np.exp(-bounces * quanta / 2), rel=2e-3)
    share = glint_surface(rough, 7, 50e3).bed.mean_quanta(2 * k * sine, np.array([sine]), np.zeros(1))[1]
    power = [np.sum(np.abs(legs.reflection_coefficient) ** 2) for legs in (one, other)]
    assert power[0] == pytest.approx(power[1] * float((1 - share[0]) ** bounces), rel=1e-9)


def test_a_glint_belongs_to_its_place_on_the_seabed():
    """At another time, and by the same path back, it is the same; a sonar moved by 1 cm finds it again."""
    scene = Scene(water={"sound_speed": C}, seabed=bed())
    _, now, back = reflected(scene, "B", 100e3, count=500)
    _, later, _ = reflected(scene, "B", 100e3, count=500, time=100.0)
    _, near, _ = reflected(scene, "B", 100e3, count=500, place=PLACE + np.array([0, 0.01, 0]))
    for legs in (back, later):
        np.testing.assert_array_equal(now.glints.phasor, legs.glints.phasor)
    same = np.linalg.norm(near.departure[-1] - now.departure[-1], axis=1) < 0.01
    assert np.mean(same) > 0.9


@lru_cache(maxsize=3)
def many_glints(east, moved=(0.0, 0.0, 0.0)):
    """Leg off the mirror and legs by 20 000 glints at 100 kHz, from a position that is moved [m]."""
    scene = Scene(water={"sound_speed": C}, seabed=bed())
    return reflected(scene, "B", 100e3, east=east, count=20_000, place=PLACE + np.array(moved))[:2]


@few_of((1,), "step", [0.003, 0.01, 0.03])
@pytest.mark.parametrize(("sideways", "east"), [(False, 14.0), (True, 14.0), (True, 150.0)])
def test_glints_decorrelate_as_the_heights_under_the_bounce_do(step, sideways, east):
    """Coherence over a bounce moved by a step: exp(-4 Gamma^2 (1 - rho)), rho of the band; 20 000 glints (0.007).

    The sonar 9 m above the seabed, the point 5 m: the bounce moves by 5/14 of the sonar's step.
    """
    k, moved = 2 * np.pi * 100e3 / C, step * 14 / 5
    (here, one), (there, other) = (many_glints(east),
                                   many_glints(east, (moved, 0.0, 0.0) if sideways else (0.0, moved, 0.0)))  # fmt: skip
    row = len(one.families) - 1
    glint = [legs.glints.phasor[row] * np.exp(-2j * np.pi * 100e3 * (legs.delay[row] - mirror.delay[0]))
             for legs, mirror in ((one, here), (other, there))]  # fmt: skip
    sine = np.sin(np.arctan2(14.0, east))
    low, sediment = longest(100e3, 9 / sine, 5 / sine, sine), Sediment.named("very fine sand")
    waves = np.geomspace(low, k / 3, 2000)
    density = 2 * np.pi * sediment.spectral_strength * waves ** (1 - sediment.spectral_exponent)
    phase = 2 * k * sine
    quanta = phase**2 * np.trapezoid(density, waves)
    rho = np.trapezoid(density * j0(waves * step), waves) / np.trapezoid(density, waves)
    found = np.exp(-quanta) - np.expm1(-quanta) * np.mean(glint[1] * glint[0].conj())
    assert abs(found - np.exp(-quanta * (1 - rho))) < 0.04


def test_one_bounce_of_a_glint_off_both_boundaries_is_incoherent_at_least():
    """Off a nearly flat sea and a rough seabed it is the seabed's: it stands still."""
    surface = {"reflection": "statistical", "wind_speed": 0.05}
    scene = Scene(water={"sound_speed": C}, seabed=bed("medium sand"), surface=surface)
    (_, now, _), (_, later, _) = (reflected(scene, "SB", 100e3, count=300, time=at) for at in (0.0, 7.0))
    row = len(now.families) - 1
    assert np.mean(np.abs(now.glints.phasor[row] - later.glints.phasor[row]) < 0.3) > 0.95


def test_relief_scatters_forward_what_its_roughness_takes():
    """5 cm rms over medium sand at 100 kHz: D-BS echoes, of which a smooth bounce leaves nothing, are there again.

    Without the law's share they are those over a flat rough seabed within 1.5 dB: slopes of the relief are in both.
    """

    def received(**changes):
        scenario = nominal(
            field="incoherent", line={"length": 0.02}, track={"window": (0.1, 0.101)},
            seabed={**bed("medium sand"), "seed": 1, **changes},
            paths={"max_reflections": 2, "contributions": ["seabed"], "families": ["D", "BS"], "beam_cutoff_db": -20,
                   "scatterers_per_cell": 2},  # by default: 0.006 dB less
        )  # fmt: skip
        found = levels(scenario).level_db.sel(contribution="seabed", pair="D-BS").values
        return np.mean(10 ** (found / 10))

    flat = received()
    assert received(relief=RELIEF, reflecting_interface="smooth") < 1e-5 * flat
    assert 10 * np.log10(received(relief=RELIEF) / flat) == pytest.approx(0.0, abs=1.5)


@pytest.mark.parametrize("relief", [(), RELIEF])
def test_boundary_echoes_keep_their_coherent_part_alone(relief):
    """What roughness takes from them is in the scattering law: a rough bounce records what a smooth one does."""
    sounds = [
        simulate(
            nominal(
                seabed={**bed("medium sand"), "relief": relief, "seed": 1, "reflecting_interface": interface},
                sonar={"pulse": {"kind": "cw", "frequency": 20e3, "duration": "0.2 ms"}},
                track={"window": (0.0, 0.06)}, paths={"max_reflections": 3, "contributions": ["boundary echo"]},
            )
        )["pressure"].values
        for interface in ("smooth", "rough")
    ]  # fmt: skip
    assert relative_rms(sounds[1], sounds[0]) < 0.02


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seabed": {"reflecting_interface": "rough"}}, "needs the roughness of a sediment"),
        ({"seabed": bed(), "paths": {"engine": "tracer"}, "field": "incoherent"}, "seabed is smooth"),
        ({"seabed": bed(), "surface": {"reflection": "explicit", "wind_speed": 3.0}}, "explicit or a tilted surface"),
    ],
)
def test_settings_without_a_rough_bounce_are_refused(changes, message):
    """A law without a sediment, the tracer, and a surface whose bounce points are searched: one line each."""
    with pytest.raises(ValidationError, match=message):
        nominal(**changes)


def test_departures_spread_as_the_glints_drawn_do():
    """Elevation and bearing of 8000 glints by B to points 40 m away: as foreseen for the sampling within 25 %."""
    scene = Scene(water={"sound_speed": C}, seabed=bed("medium sand"))
    mirror, out, _ = reflected(scene, "B", 100e3, east=40.0, depth=11.0, count=4000)
    glints = out.departure[np.array(out.glints.bounce_id) >= 0].reshape(-1, 3)
    foreseen = glint_spread(scene, 100e3).legs("B", 11.0, np.array([40.0]), 11.0)
    rise = np.arcsin(glints[:, 2]) - np.arcsin(mirror.departure[0, 0, 2])
    assert foreseen.elevation_change[0] == pytest.approx(np.sqrt(np.mean(rise**2)), rel=0.25)
    assert foreseen.bearing_change[0] == pytest.approx(np.sqrt(np.mean(glints[:, 0] ** 2)), rel=0.25)


def received_power(field, seed, sediment, families, **seabed):
    """Mean power of the seabed's echoes 75 to 82 m away, by some families."""
    sound = simulate(
        nominal(
            seed=seed, field=field, line={"length": 0.5}, track={"window": (0.1, 0.11)},
            seabed={**bed(sediment), "seed": 5, **seabed},
            paths={"max_reflections": 2, "contributions": ["seabed"], "families": families},
        ), threads=1,
    )  # fmt: skip
    return np.mean(sound["intensity"].values if field == "incoherent" else np.abs(sound["pressure"].values) ** 2)


def test_a_few_coherent_pings_have_the_expected_power():
    """16 pings of about 50 cells (0.16 dB) over coarse silt, by D and BS, against 3 expectations: within 0.5 dB."""
    coherent, expected = (
        np.mean([received_power(field, seed, "coarse silt", ["D", "BS"]) for seed in range(count)])
        for field, count in (("coherent", 16), ("incoherent", 3))
    )
    assert 10 * np.log10(coherent / expected) == pytest.approx(0.0, abs=0.5)


@pytest.mark.validate
@pytest.mark.parametrize("relief", [(), RELIEF])
def test_the_mean_of_coherent_pings_is_the_expectation(relief):
    """Medium sand, by D and BS: 300 seeds (0.03 to 0.04 dB) against 60 (0.02 dB), within 0.15 dB."""
    coherent, expected = (
        np.mean(each_ping(range(count), partial(received_power, field, sediment="medium sand", families=["D", "BS"],
                                                relief=relief)))
        for field, count in (("coherent", 300), ("incoherent", 60))
    )  # fmt: skip
    assert 10 * np.log10(coherent / expected) == pytest.approx(0.0, abs=0.15)
