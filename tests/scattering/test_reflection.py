"""Claims about the mirror of the seabed: impedance, energy, and the sense of the phase."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.scattering import Sediment, reflection_coefficient

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
