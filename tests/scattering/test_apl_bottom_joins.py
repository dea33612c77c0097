"""Claims about the handbook's bottom: what it is made of, that its parts join, and what each part tends to."""

import dataclasses

import numpy as np
import pytest

from insonify.scattering import Kirchhoff, Perturbation, Sediment, SedimentVolume, apl_bottom_strength_db

SOFT = ["medium sand", "coarse silt", "sandy silt", "silty clay", "clay"]
ALL = [*SOFT, "gravel", "rough rock", "sandy gravel"]
GRAZING = np.radians([5.0, 10, 20, 30, 50])
pytestmark = pytest.mark.filterwarnings("ignore::insonify.validity.PhysicsWarning")


def _bed(name, roughness=1.0, **changes):
    bed = Sediment.named(name)
    return dataclasses.replace(bed, spectral_strength=roughness * bed.spectral_strength, **changes)


def _intensity(bed, grazing, frequency=30e3, **kwargs):
    return 10 ** (apl_bottom_strength_db(bed, frequency, grazing, **kwargs) / 10)


@pytest.mark.parametrize("name", SOFT)
@pytest.mark.parametrize("frequency", [20e3, 30e3])
def test_straight_down_the_handbook_is_kirchhoffs_integral(name, frequency):
    """Two programs of the mirrors: a closed form in the handbook, the integral looked up in the law; 0.15 dB apart."""
    bed = _bed(name, volume_parameter=0.0)
    mirrors = 10 * np.log10(Kirchhoff(bed, frequency).cross_section(np.pi / 2, np.pi / 2, np.pi))
    assert apl_bottom_strength_db(bed, frequency, np.pi / 2) == pytest.approx(mirrors, abs=0.15)


@pytest.mark.parametrize("name", SOFT)
def test_a_nearly_smooth_bed_is_a_grating(name):
    """With a spectrum a million times weaker and no inside it is first-order perturbation, to 0.05 dB."""
    bed = _bed(name, 1e-6, volume_parameter=0.0)
    gratings = 10 * np.log10(Perturbation(bed, 30e3).cross_section(GRAZING, GRAZING, np.pi))
    # A tenth of k in the matching wave and five digits in the weights of the slopes distinguish them.
    np.testing.assert_allclose(apl_bottom_strength_db(bed, 30e3, GRAZING), gratings, atol=0.05)


@pytest.mark.parametrize("name", SOFT)
def test_a_smooth_bed_is_its_inside(name):
    """Without relief only the volume is left, as the isotropic law of the inside has it straight back, to 1e-4 dB."""
    bed = _bed(name, 1e-9)
    law = SedimentVolume(bed, 30e3, volume_spectrum="isotropic")
    inside = 10 * np.log10(law.cross_section(GRAZING, GRAZING, np.pi))
    np.testing.assert_allclose(apl_bottom_strength_db(bed, 30e3, GRAZING), inside, atol=1e-4)


@pytest.mark.parametrize("name", ALL)
def test_the_inside_adds_as_power(name):
    """Twice the volume parameter adds twice the echo, at every angle, rough bed or not."""
    grazing = np.radians(np.linspace(2, 90, 23))
    none, once, twice = (_intensity(_bed(name, volume_parameter=v), grazing) for v in (0.0, 0.002, 0.004))
    np.testing.assert_allclose(twice - none, 2 * (once - none), rtol=1e-6, atol=1e-12)
    assert np.all(once > none)


def _largest_step(name, frequency, step_deg):
    grazing = np.radians(np.arange(2, 90.001, step_deg))
    return np.abs(np.diff(apl_bottom_strength_db(_bed(name), frequency, grazing))).max()


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("frequency", [10e3, 50e3, 100e3])
def test_the_parts_join_without_a_step(name, frequency):
    """From 2 to 90 degrees the strength is continuous: over a quarter of an angle it changes by less than a third."""
    assert _largest_step(name, frequency, 0.0125) < _largest_step(name, frequency, 0.05) / 3


def _roughest_step(name, frequency=30e3):
    strength = [float(apl_bottom_strength_db(_bed(name, r), frequency, 0.4)) for r in np.geomspace(0.03, 30, 121)]
    return np.abs(np.diff(strength)).max()


@pytest.mark.parametrize("name", ["medium sand", "gravel"])
def test_a_bed_grows_rough_without_a_step(name):
    """From composite to very rough, each 6 % of spectral strength, less than 1 dB."""
    assert _roughest_step(name) < 1.0


@pytest.mark.parametrize("name", SOFT)
def test_only_wavelengths_count(name):
    """Frequency and sound speed doubled together: the same strength."""
    one = apl_bottom_strength_db(_bed(name), 20e3, GRAZING, sound_speed=1500.0)
    other = apl_bottom_strength_db(_bed(name), 40e3, GRAZING, sound_speed=3000.0)
    np.testing.assert_allclose(one, other, atol=1e-9)


def test_gratings_grow_with_the_fourth_power_less_the_spectrums():
    """Nearly smooth sand without inside: k^(4 - 3.25), 2.26 dB an octave, at any angle."""
    bed = _bed("medium sand", 1e-8, volume_parameter=0.0)
    octave = apl_bottom_strength_db(bed, 40e3, GRAZING) - apl_bottom_strength_db(bed, 20e3, GRAZING)
    np.testing.assert_allclose(octave, 0.75 * 10 * np.log10(2), atol=0.01)


def test_the_inside_does_not_depend_on_the_frequency():
    """Loss per wavelength and volume parameter are fixed: a smooth bed is as strong at 10 as at 100 kHz."""
    bed = _bed("clay", 1e-9)
    np.testing.assert_allclose(
        apl_bottom_strength_db(bed, 10e3, GRAZING), apl_bottom_strength_db(bed, 100e3, GRAZING), atol=1e-3
    )


def test_angles_requested_together_or_alone_are_the_same():
    """An angle's strength does not depend on its company."""
    together = apl_bottom_strength_db(_bed("gravel"), 30e3, GRAZING)
    alone = [float(apl_bottom_strength_db(_bed("gravel"), 30e3, g)) for g in GRAZING]
    np.testing.assert_allclose(together, alone, rtol=1e-14)


@pytest.mark.parametrize("roughness", [0.25, 0.3])
def test_mirrors_of_a_brownian_bed_are_exact_in_the_handbook(roughness):
    """Spectral exponent 3: the handbook's closed form is Kirchhoff's integral at every angle where mirrors rule."""
    bed = Sediment(1.8, 1.1, 0.01, 0.0, 3.0, 2e-4 * roughness)
    grazing = np.radians(np.arange(84, 90.1, 1.0))
    mirrors = 10 * np.log10(Kirchhoff(bed, 20e3).cross_section(grazing, grazing, np.pi))
    np.testing.assert_allclose(apl_bottom_strength_db(bed, 20e3, grazing), mirrors, atol=0.05)
