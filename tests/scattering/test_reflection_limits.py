"""Claims about mirrors at their limits: energy of every wave that leaves, critical angles, reversal, and roughness."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.scattering import (
    ElasticSolid,
    Sediment,
    coherent_reflection_factor,
    elastic_reflection_coefficient,
    reflection_coefficient,
)
from insonify.scattering.surface_coherence import coherent_reflection, rayleigh_parameter

GRANITE = ElasticSolid(2.5, 3.5, 2.0)
CHALK = ElasticSolid(2.0, 1.6, 0.7)
steep = st.floats(0.02, np.pi / 2 - 0.02)


def _leaving(solid, grazing):
    """Energy that compressional and shear waves carry down, per incident energy, from R and two boundary conditions.

    In units where the water's density, wavenumber and frequency are 1, z down and exp(-i omega t): normal
    displacement and absence of shear stress fix both potentials once R is known.
    """
    r = np.conj(elastic_reflection_coefficient(solid, grazing))
    rho, x = solid.density_ratio, np.cos(grazing)
    kp2, ks2 = solid.speed_ratio**-2.0, solid.shear_ratio**-2.0
    p, s = np.sqrt(kp2 - x**2 + 0j), np.sqrt(ks2 - x**2 + 0j)
    # u_z of the water is i sin (1 - R); phi = A exp(i p z), psi = B exp(i s z): u_z = i p A + i x B
    matrix = np.array([[1j * p, 1j * x], [-2 * x * p, s**2 - x**2]])
    a, b = np.linalg.solve(matrix, [1j * np.sin(grazing) * (1 - r), 0])
    # Flux through the plane is density times vertical wavenumber times |potential|^2, for waves that travel.
    down = rho * (p.real * abs(a) ** 2 + s.real * abs(b) ** 2) / np.sin(grazing)
    return float(abs(r) ** 2), float(down)


@pytest.mark.parametrize("solid", [GRANITE, CHALK, ElasticSolid(1.8, 1.2, 0.3)], ids=["granite", "chalk", "marl"])
@pytest.mark.parametrize("grazing_deg", [5, 20, 40, 58, 62, 75, 89])
def test_a_lossless_solid_divides_the_energy_and_keeps_none(solid, grazing_deg):
    """What is reflected and what compression and shear carry down add up to what arrived, at any angle."""
    reflected, down = _leaving(solid, np.radians(grazing_deg))
    assert reflected + down == pytest.approx(1, abs=1e-12)


@given(st.floats(0.01, 0.995))
def test_below_both_critical_angles_rock_reflects_everything(part):
    """Granite: neither wave can travel below acos(1 / 2.0), 60 degrees; all comes back, turned in phase."""
    r = elastic_reflection_coefficient(GRANITE, part * np.arccos(1 / GRANITE.shear_ratio))
    assert abs(r) == pytest.approx(1, abs=1e-12)
    assert abs(r.imag) > 0


@given(st.floats(0.005, 0.995))
def test_between_the_critical_angles_shear_takes_its_share(part):
    """Granite: between 60 degrees (shear) and 73.4 degrees (compression) some sound enters as shear alone."""
    shear, compression = np.arccos(1 / GRANITE.shear_ratio), np.arccos(1 / GRANITE.speed_ratio)
    grazing = shear + part * (compression - shear)
    assert abs(elastic_reflection_coefficient(GRANITE, grazing)) < 1
    fluid = reflection_coefficient(Sediment(GRANITE.density_ratio, GRANITE.speed_ratio, 0.0), grazing)
    assert abs(fluid) == pytest.approx(1, abs=1e-12)


@given(st.floats(0.05, 0.9))
def test_slow_shear_leaks_where_a_fluid_would_not(part):
    """Chalk carries shear slower than water carries sound: below its critical 51 degrees it still lets some in."""
    grazing = part * np.arccos(1 / CHALK.speed_ratio)
    assert abs(elastic_reflection_coefficient(CHALK, grazing)) < 0.999


@given(st.floats(1, 4), st.floats(1.1, 4), st.floats(0.05, 0.85))
def test_straight_down_shear_is_not_excited(density, speed, part):
    """At normal incidence rock and fluid of the same density and speed reflect alike: (rho nu - 1) / (rho nu + 1)."""
    r = elastic_reflection_coefficient(ElasticSolid(density, speed, part * speed), np.pi / 2)
    assert r == pytest.approx((density * speed - 1) / (density * speed + 1), abs=1e-9)


@pytest.mark.parametrize("solid", [GRANITE, CHALK])
def test_at_vanishing_grazing_rock_is_a_soft_mirror(solid):
    """R tends to -1, whatever the rock."""
    assert elastic_reflection_coefficient(solid, 1e-7) == pytest.approx(-1, abs=1e-5)


def test_lossless_rock_is_the_limit_of_rock_with_little_loss():
    """The branch of the square roots: at every angle, a loss of 1e-9 changes R by less than 1e-3, in phase too."""
    grazing = np.linspace(0.01, 1.56, 157)
    little = ElasticSolid(GRANITE.density_ratio, GRANITE.speed_ratio, GRANITE.shear_ratio, 1e-9, 1e-9)
    np.testing.assert_allclose(
        elastic_reflection_coefficient(GRANITE, grazing), elastic_reflection_coefficient(little, grazing), atol=1e-3
    )


def test_rock_unless_given_has_no_loss():
    """Both losses are 0 when they are not given."""
    assert ElasticSolid(2.5, 3.5, 2.0, 0.0, 0.0) == GRANITE


def test_shape_of_the_angles_is_kept():
    """A table of angles gives a table of coefficients, of rock as of sand."""
    assert elastic_reflection_coefficient(GRANITE, np.full((2, 3), 0.4)).shape == (2, 3)


@given(st.floats(0.3, 4), st.floats(0.4, 3), steep)
def test_a_boundary_seen_from_the_other_side_changes_its_sign(density, speed, grazing):
    """Stokes (1849): from below, along the refracted ray, R' = -R; the passages there and back let through 1 - R^2."""
    if speed * np.cos(grazing) >= 0.999:
        return
    below = np.arccos(speed * np.cos(grazing))
    down = reflection_coefficient(Sediment(density, speed, 0.0), grazing)
    up = reflection_coefficient(Sediment(1 / density, 1 / speed, 0.0), below)
    assert up == pytest.approx(-down, abs=1e-9)
    assert (1 + down) * (1 + up) == pytest.approx(1 - down**2, abs=1e-9)


@given(st.floats(0.5, 4), st.floats(0.5, 4), steep)
def test_a_lossless_fluid_divides_the_energy_and_keeps_none(density, speed, grazing):
    """Pressure 1 + R goes down: its flux, density and vertical wavenumber counted, is 1 - |R|^2."""
    r = reflection_coefficient(Sediment(density, speed, 0.0), grazing)
    down = np.sqrt(speed**-2 - np.cos(grazing) ** 2 + 0j).real / density / np.sin(grazing)
    assert abs(r) ** 2 + abs(1 + r) ** 2 * down == pytest.approx(1, abs=1e-9)


@given(steep)
def test_water_on_water_is_no_boundary(grazing):
    """Equal density and speed reflect nothing; a boundary of density alone reflects the same at every angle."""
    assert reflection_coefficient(Sediment(1.0, 1.0, 0.0), grazing) == pytest.approx(0, abs=1e-12)
    assert reflection_coefficient(Sediment(3.0, 1.0, 0.0), grazing) == pytest.approx(0.5, abs=1e-12)


@given(steep)
def test_the_heaviest_and_the_lightest_beds_are_perfect_mirrors(grazing):
    """Density to infinity is rigid, R = 1; density to nothing is soft, R = -1."""
    assert reflection_coefficient(Sediment(1e12, 1.0, 0.0), grazing) == pytest.approx(1, abs=1e-9)
    assert reflection_coefficient(Sediment(1e-12, 1.0, 0.0), grazing) == pytest.approx(-1, abs=1e-9)


def test_sound_enters_sand_above_its_critical_angle_only():
    """Without loss |R| is 1 up to acos(1 / nu) and falls beyond, to the impedance's at the vertical."""
    sand = Sediment(1.85, 1.18, 0.0)
    critical = np.arccos(1 / 1.18)
    below = np.abs(reflection_coefficient(sand, np.linspace(0, critical, 50)))
    above = np.abs(reflection_coefficient(sand, np.linspace(critical + 1e-6, np.pi / 2, 50)))
    np.testing.assert_allclose(below, 1, atol=1e-6)
    assert np.all(np.diff(above) < 0)
    assert above[-1] == pytest.approx((1.85 * 1.18 - 1) / (1.85 * 1.18 + 1))


@given(st.floats(1e3, 1e6), st.floats(0, 0.05), st.floats(0, 0.05), steep)
def test_two_roughnesses_take_one_after_the_other(frequency, one, other, grazing):
    """Independent heights add as squares, so their losses multiply."""
    both = coherent_reflection_factor(frequency, np.hypot(one, other), grazing)
    parts = coherent_reflection_factor(frequency, one, grazing) * coherent_reflection_factor(frequency, other, grazing)
    assert both == pytest.approx(parts, rel=1e-9, abs=1e-300)


@given(st.floats(1e3, 1e6), st.floats(0, 0.02), steep)
def test_sea_and_seabed_lose_alike(frequency, rms, grazing):
    """The loss of a rough bed is the mean mirror of a rough sea, turned over; only f h sin(grazing) / c counts."""
    loss = coherent_reflection_factor(frequency, rms, grazing)
    sea = coherent_reflection(frequency, rms, grazing)
    assert loss == pytest.approx(-sea, rel=1e-9, abs=1e-300)
    assert coherent_reflection_factor(2 * frequency, rms / 2, grazing) == pytest.approx(loss, rel=1e-9)
    assert coherent_reflection_factor(2 * frequency, rms, grazing, sound_speed=3000.0) == pytest.approx(loss, rel=1e-9)
    assert coherent_reflection_factor(frequency, rms, grazing, sound_speed=1500.0) == loss


def test_rayleighs_criterion():
    """A phase of pi/2 rms, heights of an eighth of a wavelength from straight above, leaves exp(-pi^2 / 8)."""
    wavelength = 1500.0 / 100e3
    parameter = rayleigh_parameter(100e3, wavelength / 8, np.pi / 2)
    assert parameter == pytest.approx(np.pi / 2)
    assert coherent_reflection_factor(100e3, wavelength / 8, np.pi / 2) == pytest.approx(np.exp(-(np.pi**2) / 8))
    assert coherent_reflection_factor(100e3, 0.0, 0.5) == 1
