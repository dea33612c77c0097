"""Claims about the mirror of the seabed: impedance, energy, and the sense of the phase."""

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
from insonify.scattering._reflection_kernel import reflect_off_fluid
from insonify.scattering.sediments import GRAIN_SIZE, STONES

SAND = Sediment.named("medium sand")
MUD = Sediment.named("silty clay")
angles = st.floats(0, np.pi / 2)
sediments = st.builds(Sediment, st.floats(1, 3), st.floats(0.8, 3), st.floats(1e-4, 0.1))


@given(sediments, angles)
def test_a_seabed_never_returns_more_than_it_got(sediment, grazing):
    """|R| <= 1 for any sediment with loss, at any angle."""
    assert np.abs(reflection_coefficient(sediment, grazing)) <= 1 + 1e-12


@given(st.floats(1, 3), st.floats(0.8, 3))
def test_from_straight_above_only_impedance_counts(density, speed):
    """Normal incidence on a lossless bottom: R = (Z2 - Z1) / (Z2 + Z1)."""
    impedance = density * speed
    found = reflection_coefficient(Sediment(density, speed, 0.0), np.pi / 2)
    assert found == pytest.approx((impedance - 1) / (impedance + 1), abs=1e-12)


def test_medium_sand_at_4_degrees_reflects_all_and_reverses_it():
    """At 4 deg |R| = 0.98 and nearly sign-reversed: sand is no +0.35 at grazing angles."""
    reflected = reflection_coefficient(SAND, np.radians(4))
    assert np.abs(reflected) == pytest.approx(0.98, abs=0.005)
    assert np.abs(np.angle(-reflected)) < np.radians(30)


@pytest.mark.parametrize("sediment", [SAND, MUD], ids=["sand", "mud"])
def test_at_vanishing_grazing_every_seabed_is_a_soft_mirror(sediment):
    """R = -1 at grazing 0, fast or slow bottom alike."""
    assert reflection_coefficient(sediment, 0.0) == pytest.approx(-1)


def test_below_critical_the_phase_is_goos_and_haenchens():
    """Lossless fast bottom: R = exp(+2 j atan(|P| / (rho sin))) for exp(+j 2 pi f t), and |R| = 1."""
    sediment, grazing = Sediment(1.845, 1.1782, 0.0), np.radians([2.0, 10.0, 25.0])
    evanescent = np.sqrt(np.cos(grazing) ** 2 - 1 / 1.1782**2)
    expected = np.exp(2j * np.arctan2(evanescent, 1.845 * np.sin(grazing)))
    np.testing.assert_allclose(reflection_coefficient(sediment, grazing), expected, atol=1e-12)


def test_a_totally_reflected_pulse_leaves_late_not_early():
    """The wave turns round below the seabed: a beam of plane waves is displaced forward (Schoch 1950).

    For exp(+j 2 pi f t) and a wave exp(-j k_x x), the shift along the bed is + d arg R / d k_x.
    """
    grazing = np.radians(np.array([9.99, 10.01]))
    along = np.cos(grazing)
    phase = np.angle(reflection_coefficient(Sediment(1.845, 1.1782, 0.0), grazing))
    assert np.diff(phase) / np.diff(along) > 0


def test_rayleighs_formula_solves_the_boundary_conditions():
    """Two ways to R: Rayleigh's formula, and pressure and velocity matched to a wave that decays downwards.

    Everything in exp(+j 2 pi f t): sediment wavenumber (1 - j loss) / speed ratio, waves
    exp(-j k z) downwards; solved as a linear system at 200 random sediments and angles.
    """
    rng = np.random.default_rng(4)
    for density, speed, loss, grazing in rng.uniform([1, 0.8, 0, 0.01], [3, 2.5, 0.1, 1.57], (200, 4)):
        down = np.sqrt(((1 - 1j * loss) / speed) ** 2 - np.cos(grazing) ** 2)
        down = down if down.imag <= 0 else -down  # exp(-j down z) must decay with depth
        # 1 + R = T,  sin(grazing) (1 - R) = down T / density
        matching = np.array([[1, -1], [np.sin(grazing), down / density]])
        reflected, _ = np.linalg.solve(matching, [-1, np.sin(grazing)])
        found = reflection_coefficient(Sediment(density, speed, loss), grazing)
        assert found == pytest.approx(reflected, abs=1e-10)


def test_a_slow_bottom_lets_one_angle_in():
    """Mud without loss has an angle of intromission: sin^2 = (1/nu^2 - 1) / (rho^2 - 1)."""
    density, speed = 1.3, 0.98
    angle = np.arcsin(np.sqrt((1 / speed**2 - 1) / (density**2 - 1)))
    assert reflection_coefficient(Sediment(density, speed, 0.0), angle) == pytest.approx(0, abs=1e-12)


def test_shape_of_the_angles_is_kept():
    """A table of angles gives a table of coefficients."""
    assert reflection_coefficient(SAND, np.full((2, 3), 0.3)).shape == (2, 3)


def _solid_by_boundary_conditions(solid, grazing):
    """Four waves at a fluid-solid boundary, matched as a linear system, in exp(-i omega t), z up out of the solid.

    Unknown: pressure reflected, compressional and shear potentials transmitted. Normal displacement and normal stress
    are continuous, shear stress vanishes; in units where the water's density, wavenumber and frequency are 1.
    """
    rho = solid.density_ratio
    kp2 = ((1 + 1j * solid.loss) / solid.speed_ratio) ** 2
    ks2 = ((1 + 1j * solid.shear_loss) / solid.shear_ratio) ** 2
    x, water = np.cos(grazing), np.sin(grazing)
    p, s = np.sqrt(kp2 - x**2 + 0j), np.sqrt(ks2 - x**2 + 0j)
    mu, lam = rho / ks2, rho / kp2 - 2 * rho / ks2
    # incident exp(i(x X - water z)), reflected R exp(i(x X + water z)),
    # phi = A exp(i(x X - p z)), psi = B exp(i(x X - s z))
    # u_x = d phi/dX - d psi/dz, u_z = d phi/dz + d psi/dX; in the water u_z = (dP/dz) / (rho omega^2) = dP/dz
    matrix = np.array(
        [
            [1j * water, 1j * p, -1j * x],  # u_z: i water (R - 1) = -i p A + i x B
            [1, -lam * kp2 - 2 * mu * p**2, 2 * mu * s * x],  # -P = lam div u + 2 mu du_z/dz
            [0, 2 * x * p, s**2 - x**2],  # shear stress: 2 x p A + (s^2 - x^2) B = 0
        ]
    )
    return np.linalg.solve(matrix, [1j * water, -1, 0])[0]


def test_rock_solves_the_boundary_conditions():
    """Two ways to R of a solid: the formula, and displacement and stress matched at 200 random solids and angles."""
    rng = np.random.default_rng(7)
    for density, speed, part, loss, shear_loss, grazing in rng.uniform(
        [1.5, 1.2, 0.2, 0.001, 0.001, 0.02], [3, 4, 0.8, 0.05, 0.1, 1.55], (200, 6)
    ):
        solid = ElasticSolid(density, speed, part * speed, loss, shear_loss)
        expected = np.conj(_solid_by_boundary_conditions(solid, grazing))
        assert elastic_reflection_coefficient(solid, grazing) == pytest.approx(expected, abs=1e-10)


@given(st.floats(1, 3), st.floats(0.5, 4), st.floats(0.01, 0.8), st.floats(0, 0.1), st.floats(0, 0.1), angles)
def test_rock_never_returns_more_than_it_got(density, speed, part, loss, shear_loss, grazing):
    """|R| <= 1 for solids whose losses leave their bulk passive (shear loss weighed by the squared speeds)."""
    shear_loss = min(shear_loss, loss / (4 / 3 * part**2))
    solid = ElasticSolid(density, speed, part * speed, loss, shear_loss)
    assert np.abs(elastic_reflection_coefficient(solid, grazing)) <= 1 + 1e-9


def test_rock_without_shear_is_a_fluid():
    """As the shear speed vanishes the solid reflects as the fluid of its density, speed and loss."""
    grazing = np.linspace(0.05, 1.5, 7)
    fluid = reflection_coefficient(Sediment(2.5, 2.5, 0.01374), grazing)
    solid = elastic_reflection_coefficient(ElasticSolid(2.5, 2.5, 1e-5, 0.01374), grazing)
    np.testing.assert_allclose(solid, fluid, atol=1e-6)


@pytest.mark.parametrize("wrong", [{"shear_ratio": 2.3}, {"shear_ratio": 0}, {"density_ratio": -1}, {"loss": np.nan}])
def test_impossible_rock_is_refused(wrong):
    """Shear faster than sqrt(3)/2 of compression would need negative stiffness."""
    with pytest.raises(ValueError, match=next(iter(wrong))):
        ElasticSolid(**({"density_ratio": 2.5, "speed_ratio": 2.5, "shear_ratio": 1.3} | wrong))


def test_roughness_takes_what_gaussian_heights_take():
    """The mean of exp(2 j k h sin) over Gaussian heights is exp(-2 k^2 h^2 sin^2), by Gauss-Hermite quadrature."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(40)
    rms, grazing, k = 0.004, 0.6, 2 * np.pi * 100e3 / 1480
    mean = np.sum(weights * np.exp(2j * k * rms * nodes * np.sin(grazing))) / np.sqrt(2 * np.pi)
    assert coherent_reflection_factor(100e3, rms, grazing, sound_speed=1480) == pytest.approx(mean.real, rel=1e-9)
    assert coherent_reflection_factor(100e3, 0.0, grazing) == 1


def test_the_kernel_and_its_stand_in_agree_to_the_bit():
    """For every sediment with a name, at grazing 0, at gaps and at random angles."""
    sine = np.concatenate([[0.0, 1.0, np.nan, 1e-13], np.random.default_rng(1).uniform(0, 1, 500)])
    for name in (*GRAIN_SIZE, *STONES):
        sediment, found = Sediment.named(name), np.empty((2, sine.size), complex)
        offset = complex(((1 + 1j * sediment.loss) / sediment.speed_ratio) ** 2 - 1)
        reflect_off_fluid.dispatcher(sine, sediment.density_ratio, offset, found[0])
        reflect_off_fluid._stand_in(sine, sediment.density_ratio, offset, found[1])
        np.testing.assert_array_equal(*found)
