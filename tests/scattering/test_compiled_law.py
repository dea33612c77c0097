"""Claims about laws made fast: the same numbers, from unit vectors, on any facet."""

import numpy as np
import pytest

from insonify.scattering import (
    Jackson,
    Kirchhoff,
    Lambert,
    Perturbation,
    Sediment,
    SedimentVolume,
    SmallSlope,
    TableScatteringLaw,
    compile_law,
    local_angles,
)
from oracles.few_of import few_of

FLAT = np.array([[0.0], [0.0], [-1.0]])
SEDIMENT_LAWS = [Kirchhoff, Perturbation, SmallSlope, SedimentVolume, Jackson]
JAGGED = Sediment(3.0, 3.0, 0.001, spectral_exponent=2.6, spectral_strength=1e-4)
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def _towards(grazing, azimuth, sense):
    """Unit vectors, world with z down; sense +1 down, -1 up; shape (3, n)."""
    return np.array([np.cos(grazing) * np.cos(azimuth), np.cos(grazing) * np.sin(azimuth), sense * np.sin(grazing)])


def _directions(count):
    """All over both hemispheres, with many close to grazing, to the mirror direction and to straight back."""
    random = np.random.default_rng(3)
    a, b = np.arcsin(random.uniform(0, 1, (2, count)))
    azimuth = random.uniform(0, np.pi, count)
    third = count // 3
    a[:third] = random.uniform(0, 0.1, third)
    b[: third // 2], azimuth[: third // 2] = a[: third // 2], np.pi
    off = 10 ** random.uniform(-5, -0.5, third)
    b[third : 2 * third] = np.clip(a[third : 2 * third] + off * random.normal(size=third), 1e-3, np.pi / 2)
    azimuth[third : 2 * third] = np.abs(off * random.normal(size=third))
    return a, b, azimuth


def _worst_db(law, count=20_000):
    a, b, azimuth = _directions(count)
    exact = law.cross_section(a, b, azimuth)
    fast = compile_law(law).cross_section(_towards(a, 0 * a, 1), _towards(b, azimuth, -1), FLAT)
    strong = exact > 1e-8
    assert strong.sum() > count / 10
    return np.abs(10 * np.log10(fast[strong] / exact[strong])).max()


@pytest.mark.parametrize("kind", SEDIMENT_LAWS)
@few_of((0, 2, 5), "name", ["rough rock", "gravel", "medium sand", "coarse silt", "sandy silt", "fine silt"])
def test_fast_is_exact_to_a_twentieth_of_a_decibel(kind, name):
    """Wherever a law exceeds -80 dB its fast form is within 0.05 dB, over all angles."""
    assert _worst_db(kind(Sediment.named(name), 100e3)) < 0.05


@pytest.mark.parametrize("kind", [SedimentVolume, Jackson])
@pytest.mark.parametrize("name", ["rock", "medium sand", "clay"])
def test_both_spectra_of_the_inside_are_fast(kind, name):
    """An isotropic inside, like one with a power law, is within 0.05 dB of its slow form over all angles."""
    assert _worst_db(kind(Sediment.named(name), 60e3, volume_spectrum="isotropic")) < 0.05


@pytest.mark.parametrize("frequency", [10e3, 1e6])
def test_fast_is_exact_at_both_ends_of_the_project(frequency):
    """The same at 10 kHz and at 1 MHz."""
    assert _worst_db(Jackson(Sediment.named("medium sand"), frequency)) < 0.05


@pytest.mark.parametrize(
    "law",
    [
        Lambert(strength_db=-20),
        TableScatteringLaw(np.radians([1, 20, 60, 90]), [-50, -30, -22, -12]),
        SmallSlope(JAGGED, 30e3),
        Jackson(Sediment(1.2, 1.0, 0.01, volume_parameter=0.5), 100e3),
    ],
    ids=["lambert", "table", "capped surface", "capped inside"],
)
def test_simple_and_capped_laws_are_exact_too(law):
    """A product of two factors, and laws lowered by a cap, within 0.05 dB."""
    assert _worst_db(law) < 0.05


@pytest.mark.parametrize("tilt_deg", [-15, 10, 25])
@pytest.mark.parametrize("law", [Jackson(Sediment.named("medium sand"), 100e3), Lambert()], ids=["jackson", "lambert"])
def test_a_tilted_facet_is_a_shifted_angle(law, tilt_deg):
    """A facet turned by beta towards the sonar scatters as a flat bed at grazing + beta."""
    grazing, tilt = np.radians(30), np.radians(tilt_deg)
    into = _towards(np.array([grazing]), 0.0, 1)
    normal = np.array([[-np.sin(tilt)], [0.0], [-np.cos(tilt)]])
    expected = law.cross_section(grazing + tilt, grazing + tilt, np.pi)
    assert compile_law(law).cross_section(into, -into, normal)[0] == pytest.approx(float(expected), rel=0.01)
    angles = local_angles(into.T, -into.T, normal.T)
    np.testing.assert_allclose(np.ravel(angles), [grazing + tilt, grazing + tilt, np.pi], atol=1e-6)


def test_the_scene_may_be_turned():
    """Directions and normal turned together change nothing: the law knows no north."""
    random = np.random.default_rng(5)
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    law = compile_law(Jackson(Sediment.named("medium sand"), 100e3))
    into, out = _towards(np.full(50, 0.4), 0.0 * np.arange(50), 1), _towards(np.full(50, 0.7), np.arange(50.0), -1)
    straight, turned = law.cross_section(into, out, FLAT), law.cross_section(turn @ into, turn @ out, turn @ FLAT)
    np.testing.assert_allclose(turned, straight, rtol=2e-3)


def test_local_angles_are_the_ones_requested():
    """From angles to unit vectors and back, at 1000 pairs, on a facet of any attitude."""
    random = np.random.default_rng(6)
    a, b, azimuth = random.uniform(0.01, 1.5, (3, 1000))
    turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
    into, out = turn @ _towards(a, 0 * a, 1), turn @ _towards(b, azimuth, -1)
    np.testing.assert_allclose(local_angles(into.T, out.T, (turn @ FLAT).T), [a, b, azimuth], atol=1e-9)


def test_nothing_comes_through_from_behind():
    """Fast or not, a facet turned away is dark, whichever end is behind."""
    up, down = _towards(np.array([0.3]), 0.0, -1), _towards(np.array([0.3]), 0.0, 1)
    for law in (Jackson(Sediment.named("clay"), 50e3), Kirchhoff(Sediment.named("clay"), 50e3), Lambert()):
        assert compile_law(law).cross_section(up, up, FLAT) == 0
        assert compile_law(law).cross_section(down, down, FLAT) == 0


def test_directions_that_are_none_do_no_harm():
    """NaN reads no memory that is not ours; grazing 0 is finite."""
    for law in (Jackson(JAGGED, 50e3), TableScatteringLaw([0.1, 1.0], [-30, -20]), Kirchhoff(JAGGED, 50e3)):
        fast = compile_law(law)
        nothing = np.full((3, 100), np.nan)
        assert fast.cross_section(nothing, nothing, nothing).shape == (100,)
        edge = np.array([[1.0], [0.0], [0.0]])
        assert np.isfinite(fast.cross_section(edge, edge, FLAT)).all()


def test_an_object_without_cross_section_is_refused():
    """The error names its class and the method that a scattering law has."""

    class Mine:
        strength_db = -27.0

    with pytest.raises(TypeError, match=r"Mine has no cross_section; a scattering law has cross_section\(grazing_in"):
        compile_law(Mine())
