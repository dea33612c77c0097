"""Claims about the seabed's laws: reciprocity, energy, limits, and formulas that share no code."""

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from insonify.scattering import (
    Jackson,
    Kirchhoff,
    Lambert,
    Perturbation,
    Sediment,
    SedimentVolume,
    SmallSlope,
    TableScatteringLaw,
    albedo,
    apl_bottom_strength_db,
    reflection_coefficient,
    roughness_spectrum,
)
from insonify.validity import PhysicsWarning
from oracles.few_of import few_of

SAND = Sediment.named("medium sand")
JAGGED = Sediment(3.0, 3.0, 0.001, spectral_exponent=2.6, spectral_strength=1e-4)
NAMES = ["rough rock", "gravel", "medium sand", "fine silt", "clay"]
MEASURED = [
    Kirchhoff(SAND, 100e3),
    Perturbation(SAND, 100e3),
    SmallSlope(SAND, 30e3),
    SedimentVolume(SAND, 100e3),
    SedimentVolume(SAND, 100e3, volume_spectrum="isotropic"),
    Jackson(Sediment.named("gravel"), 30e3),
    TableScatteringLaw(np.radians([5, 30, 90]), [-40, -25, -10]),
    Lambert(),
]
angles = st.floats(0, np.pi / 2)
BACK = np.pi


def _name(law):
    return type(law).__name__


@pytest.mark.parametrize("law", MEASURED, ids=_name)
@settings(max_examples=60)
@given(angles, angles, st.floats(0, 2 * np.pi))
def test_reciprocity(law, a, b, azimuth):
    """Swapping source and receiver changes nothing, to 1e-10, for every law and pair of directions."""
    there, back = law.cross_section(a, b, azimuth), law.cross_section(b, a, azimuth)
    np.testing.assert_allclose(there, back, rtol=1e-10)
    assert there >= 0


@pytest.mark.parametrize("law", MEASURED, ids=_name)
def test_left_is_like_right(law):
    """An isotropic bed does not distinguish left from right."""
    left, right = (law.cross_section(0.3, 0.6, sign * 1.0) for sign in (1, -1))
    assert left == pytest.approx(float(right), rel=1e-12)


@pytest.mark.parametrize("law", MEASURED, ids=_name)
def test_nothing_comes_through_from_behind(law):
    """A patch turned away from either end is dark; one that is lit is not; NaN stays NaN or dark, never bright."""
    assert law.cross_section(-0.1, 0.3, BACK) == 0
    assert law.cross_section(0.3, -0.1, BACK) == 0
    assert law.cross_section(0.3, 0.3, BACK) > 0


@pytest.mark.parametrize("law", MEASURED, ids=_name)
def test_every_incidence_against_every_direction(law):
    """Angles broadcast."""
    ways = np.linspace(0.1, 1.0, 4)
    assert law.cross_section(ways[:, None], ways[:3], np.zeros((4, 3))).shape == (4, 3)


@pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")
@pytest.mark.parametrize("kind", [SmallSlope, SedimentVolume, Jackson])
@pytest.mark.parametrize("frequency", [10e3, 100e3])
@few_of((0, -1), "name", NAMES)
def test_a_seabed_never_returns_more_than_it_got(kind, frequency, name):
    """White furnace: over the whole hemisphere no more sound leaves than arrives.

    Perturbation and Kirchhoff alone are exempt: the one takes a power-law relief to be infinitely high towards the
    mirror direction, the other lets facets neither hide nor light one another at low grazing angles.
    """
    law = kind(Sediment.named(name), frequency)
    assert np.all(albedo(law, np.radians([1, 5, 20, 45, 90]), points=48) <= 1)


@pytest.mark.parametrize(
    "law",
    [
        SmallSlope(JAGGED, 30e3),
        SedimentVolume(Sediment(1.2, 1.0, 0.01, volume_parameter=0.5), 100e3, volume_spectrum="isotropic"),
        Jackson(Sediment(1.2, 1.0, 0.01, volume_parameter=0.5), 100e3, volume_spectrum="isotropic"),
    ],
    ids=_name,
)
def test_what_would_return_more_is_capped_and_still_reciprocal(law):
    """For impossibly rough or uneven beds a cap keeps the albedo at 1, between the cap's own nodes too."""
    grazing = np.radians([2.2, 7.3, 21.7, 44.4, 66.6, 89])
    found = albedo(law, grazing)
    assert np.all(found <= 1)
    assert found.max() > 0.5  # the cap did not simply put out the light
    assert law.cross_section(0.2, 1.1, 0.7) == pytest.approx(float(law.cross_section(1.1, 0.2, 0.7)), rel=1e-12)


def test_kirchhoff_alone_breaks_energy_at_low_grazing():
    """Why Kirchhoff is exempt: 1.45 times the incident energy at 5 degrees, medium sand, 100 kHz."""
    assert albedo(Kirchhoff(SAND, 100e3), np.radians(5)) == pytest.approx(1.45, abs=0.03)


@pytest.mark.parametrize("name", ["medium sand", "clay"])
def test_what_a_smooth_bed_scatters_it_would_have_mirrored(name):
    """Where hardly anything is coherent, the surface scatters over the hemisphere what Rayleigh would reflect: |R|^2.

    At 30 kHz and 60 degrees, within 10 %: at vertical incidence and above the critical angle slopes change R little.
    """
    sediment, grazing = Sediment.named(name), np.radians(60)
    mirrored = np.abs(reflection_coefficient(sediment, grazing)) ** 2
    assert albedo(SmallSlope(sediment, 30e3), grazing) == pytest.approx(mirrored, rel=0.1)


@pytest.mark.parametrize("name", NAMES)
def test_backscatter_of_gratings_is_the_handbooks(name):
    """Straight back the bistatic perturbation law is TR 9407's 4 k^4 sin^4 |Y|^2 W(2 k cos), to 1e-6."""
    bed, g, k = Sediment.named(name), np.radians(np.linspace(2, 80, 14)), 2 * np.pi * 50e3 / 1500
    kappa2 = ((1 + 1j * bed.loss) / bed.speed_ratio) ** 2
    p, rho = np.sqrt(kappa2 - np.cos(g) ** 2), bed.density_ratio
    y = ((rho - 1) ** 2 * np.cos(g) ** 2 + rho**2 - kappa2) / (rho * np.sin(g) + p) ** 2
    expected = 4 * k**4 * np.sin(g) ** 4 * np.abs(y) ** 2 * roughness_spectrum(bed, 2 * k * np.cos(g))
    np.testing.assert_allclose(Perturbation(bed, 50e3).cross_section(g, g, BACK), expected, rtol=1e-6)


@few_of((0, -1), "name", NAMES)
def test_backscatter_of_the_inside_is_the_handbooks(name):
    """Straight back the isotropic volume law is TR 9407's 5 delta sigma2 |1 - R^2|^2 sin^2 / (nu ln10 |P|^2 Im P)."""
    bed, g = Sediment.named(name), np.radians(np.linspace(2, 90, 14))
    p = np.sqrt(((1 + 1j * bed.loss) / bed.speed_ratio) ** 2 - np.cos(g) ** 2)
    y = bed.density_ratio * np.sin(g) / p
    entered = np.abs(1 - ((y - 1) / (y + 1)) ** 2) ** 2 * np.sin(g) ** 2
    strength = 5 * bed.loss * bed.volume_parameter / (bed.speed_ratio * np.log(10))
    expected = strength * entered / (np.abs(p) ** 2 * p.imag)
    law = SedimentVolume(bed, 50e3, volume_spectrum="isotropic")
    np.testing.assert_allclose(law.cross_section(g, g, BACK), expected, rtol=1e-6)


def test_density_that_fluctuates_sends_straight_back_what_isotropy_does():
    """Above the critical angle both spectra agree straight back, but for the limit of 0.1, to 2 % (the loss)."""
    g = np.radians([50.0, 70, 90])
    even, power = (SedimentVolume(SAND, 100e3, volume_spectrum=u) for u in ("isotropic", "power-law"))
    free = even.cross_section(g, g, BACK)
    np.testing.assert_allclose(power.cross_section(g, g, BACK), 1 / (1 / free + 1 / 0.1), rtol=0.02)
    ratio = power.cross_section(g[:1], g[:1], 2.0) / even.cross_section(g[:1], g[:1], 2.0)
    assert abs(10 * np.log10(ratio[0])) > 0.3


@pytest.mark.parametrize("name", ["coarse sand", "medium sand", "very fine sand", "fine silt", "clay"])
def test_the_inside_is_single_scattering_by_a_power_law_of_density(name):
    """Williams & Jackson (1998) written out with Jackson's w3 = 80 delta sigma2 / (pi ln 10), any directions, to 1e-6.

    The second program shares no code: complex sines, W3 = w3 (dk^2 + (k/1000)^2)^-1.5, 1/(1/sigma + 1/0.1).
    """
    bed, a, b, azimuth = Sediment.named(name), np.radians([4, 20, 35, 80]), np.radians([11, 20, 70, 45]), 2.5
    k = 2 * np.pi * 70e3 / 1500
    kappa = (1 + 1j * bed.loss) / bed.speed_ratio
    p_in, p_out = (np.sqrt(kappa**2 - np.cos(angle) ** 2) for angle in (a, b))
    entered = 1.0
    for angle, p in ((a, p_in), (b, p_out)):
        y = bed.density_ratio * np.sin(angle) / p
        entered = entered * np.abs(1 + (y - 1) / (y + 1)) ** 2
    along = np.cos(a) * np.cos(b) * np.cos(azimuth)
    transverse2 = np.cos(a) ** 2 - 2 * along + np.cos(b) ** 2
    change = k * np.sqrt(transverse2 + (p_in + p_out).real ** 2 + 1e-6)
    w3 = 80 / (np.pi * np.log(10)) * bed.loss * bed.volume_parameter
    each = np.pi / 2 * k**4 * np.abs(-(kappa**2) + along - p_in * p_out) ** 2 * w3 / change**3
    free = entered * each / (2 * k * bed.density_ratio**2 * (p_in + p_out).imag)
    found = SedimentVolume(bed, 70e3).cross_section(a, b, azimuth)
    np.testing.assert_allclose(found, 1 / (1 / free + 1 / 0.1), rtol=1e-5)


def test_below_the_critical_angle_isotropy_is_stronger():
    """Medium sand: the isotropic inside lies 2.1 dB above the power law at 5 degrees grazing, 1.3 dB at 20, 0.1 at 40.

    Backscatter of the inside alone; of the whole bed the two differ by at most 0.3 dB, since the surface rules.
    """
    g = np.radians([5.0, 20.0, 40.0])
    for kind, expected, within in ((SedimentVolume, [2.09, 1.34, 0.13], 0.02), (Jackson, [0.15, 0.15, 0.15], 0.2)):
        even, power = (
            kind(SAND, 30e3, volume_spectrum=u).cross_section(g, g, BACK) for u in ("isotropic", "power-law")
        )
        np.testing.assert_allclose(10 * np.log10(even / power), expected, atol=within)


@few_of((0, -1), "name", NAMES)
def test_the_inside_does_not_darken_the_surface(name):
    """Towards the mirror direction the inside stays below 0.1: it does not use up the energy of the whole bed.

    Without that limit the cap would lower rock and gravel by 2 to 5 dB straight back; with it, by less than 0.1 dB.
    """
    g = np.radians([10.0, 20.0, 30.0])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # rock is too steep for the surface's law
        surface, whole = (kind(Sediment.named(name), 30e3).cross_section(g, g, BACK) for kind in (SmallSlope, Jackson))
    assert np.all(10 * np.log10(whole / surface) > -0.1)


def test_small_slopes_become_gratings_where_the_bed_is_smooth():
    """With a spectrum a million times weaker the small-slope law is perturbation theory, to 1e-3."""
    smooth = Sediment(1.845, 1.1782, 0.01624, spectral_strength=1.4e-10)
    a, b, azimuth = 0.4, 0.9, 2.0
    expected = Perturbation(smooth, 20e3).cross_section(a, b, azimuth)
    assert SmallSlope(smooth, 20e3).cross_section(a, b, azimuth) == pytest.approx(float(expected), rel=1e-3)


def test_small_slopes_become_mirrors_towards_the_mirror_direction():
    """Within 1 degree of the mirror direction, above the critical angle, the small-slope law is Kirchhoff's to 2 %."""
    a, b = np.radians([60.0, 80]), np.radians([60.5, 80.5])
    expected = Kirchhoff(SAND, 100e3).cross_section(a, b, 0.01)
    np.testing.assert_allclose(SmallSlope(SAND, 100e3).cross_section(a, b, 0.01), expected, rtol=0.02)


def test_mirrors_of_a_brownian_bed_have_a_closed_form():
    """Alpha = 1/2 (spectral exponent 3): I = q / (1 + q^2)^1.5, to 1e-6, in the whole law."""
    bed, a, b, azimuth, k = Sediment(1.845, 1.1782, 0.01624, spectral_exponent=3.0), 0.5, 1.0, 0.8, 2 * np.pi * 40
    along = np.cos(a) * np.cos(b) * np.cos(azimuth)
    transverse = 0.5 * np.sqrt(np.cos(a) ** 2 - 2 * along + np.cos(b) ** 2)
    vertical = 0.5 * (np.sin(a) + np.sin(b))
    half = np.hypot(transverse, vertical)
    growth = 2 * np.pi * bed.spectral_strength  # C^2 of alpha = 1/2: Gamma(3/2) 2^-1 / (1/4 Gamma(3/2)) = 2, over 2
    q = 0.5 * 2 * growth * (2 * k * vertical) ** 2 / (2 * k * transverse)
    integral = q / (1 + q**2) ** 1.5
    mirror = np.abs(reflection_coefficient(bed, np.arcsin(half))) ** 2
    expected = mirror / (8 * np.pi) * (half**2 / (vertical * transverse)) ** 2 * integral
    found = Kirchhoff(bed, 60e3).cross_section(a, b, azimuth)
    assert found == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("grazing_deg", [20, 30, 45])
def test_harder_beds_are_stronger(grazing_deg):
    """Rock > gravel > sand > silt between 20 and 45 degrees: the handbook, and Jackson's law where slopes are small."""
    g = np.radians(grazing_deg)
    beds = [Sediment.named(name) for name in ("rock", "gravel", "medium sand", "fine silt")]
    printed = [float(apl_bottom_strength_db(bed, 30e3, g)) for bed in beds]
    assert printed == sorted(printed, reverse=True)
    strength = [float(Jackson(bed, 30e3).cross_section(g, g, BACK)) for bed in beds[1:]]
    assert strength == sorted(strength, reverse=True)


def test_too_steep_a_bed_is_warned_of():
    """Rough rock has slopes of 60 degrees: a law of small slopes warns that it is outside its range."""
    with pytest.warns(PhysicsWarning, match=r"small-slope.*rms slope.*30 deg"):
        Jackson(Sediment.named("rough rock"), 30e3)


def test_jackson_is_the_sum_of_surface_and_inside():
    """Where nothing is capped, the whole is its two parts."""
    a, b, azimuth = 0.3, 0.8, np.array([0.5, 2.5])
    parts = [kind(SAND, 100e3).cross_section(a, b, azimuth) for kind in (SmallSlope, SedimentVolume)]
    np.testing.assert_allclose(Jackson(SAND, 100e3).cross_section(a, b, azimuth), sum(parts), rtol=1e-12)


def test_only_the_ratio_of_frequency_and_sound_speed_counts():
    """A law knows wavelengths only."""
    slow, fast = Jackson(SAND, 45e3, sound_speed=1450), Jackson(SAND, 46.551724137931e3, sound_speed=1500)
    assert slow.cross_section(0.3, 0.3, BACK) == pytest.approx(float(fast.cross_section(0.3, 0.3, BACK)), rel=1e-9)


@pytest.mark.parametrize("kind", [Kirchhoff, Perturbation, SmallSlope, SedimentVolume, Jackson])
@pytest.mark.parametrize(
    ("frequency", "sound_speed"), [(0, 1500), (float("nan"), 1500), (1e5, -1), (1e5, float("inf"))]
)
def test_what_is_no_sound_is_refused(kind, frequency, sound_speed):
    """No frequency, no speed: no law."""
    with pytest.raises(ValueError, match=r"frequency|sound_speed"):
        kind(SAND, frequency, sound_speed=sound_speed)


@pytest.mark.parametrize("frequency", [5e3, 450e3])
def test_outside_the_measured_band_one_warning_is_given(frequency):
    """The relief of TR 9407 was measured for 10 to 100 kHz; a law reports it once when it is made, then works."""
    with pytest.warns(PhysicsWarning, match=r"TR 9407.*10 to 100 kHz") as caught:
        law = Jackson(SAND, frequency)
    assert len(caught) == 1
    assert law.cross_section(0.3, 0.3, BACK) > 0


def test_a_bed_without_loss_has_no_echo_from_inside_that_could_end():
    """Without loss sound would return from any depth: an error with its fix; without a volume spectrum it is fine."""
    with pytest.raises(ValueError, match=r"loss 0.*0\.01"):
        SedimentVolume(Sediment(1.2, 1.0, 0.0), 50e3)
    assert SedimentVolume(Sediment(1.2, 1.0, 0.0, volume_parameter=0.0), 50e3).cross_section(1.0, 1.0, BACK) == 0


def test_unevenness_of_another_kind_is_refused():
    """Two kinds are known, and the error names them."""
    with pytest.raises(ValueError, match=r"power-law.*isotropic"):
        SedimentVolume(SAND, 50e3, volume_spectrum="white")
