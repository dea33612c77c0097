"""Claims about the width of two-way beams."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from insonify.sonar import LineArray, PlanarArray, PointTransducer, beams, two_way_footprint, two_way_width
from insonify.sonar.two_way_beam import two_way_height

FREQUENCY, SPEED = 100e3, 1500.0
WAVELENGTH = SPEED / FREQUENCY


def pair(transmit, receive):
    """Both ends' beams in the array's own frame."""
    return beams(transmit, FREQUENCY, SPEED), beams(receive, FREQUENCY, SPEED)


def test_the_footprint_of_equal_lines_is_two_thirds_of_a_wavelength_over_length():
    """The integral of sinc^4 is 2/3. Tolerance 1e-4: azimuth against its sine, and the ends of the half plane."""
    ends = pair(LineArray(length=1.5), LineArray(length=1.5))
    np.testing.assert_allclose(two_way_footprint(*ends), 2 / 3 * WAVELENGTH / 1.5, rtol=1e-4)


def test_a_point_source_leaves_the_receivers_own_footprint():
    """One-way, the integral of sinc^2 is 1; side lobes beyond +-90 deg are missing: 2 / (pi^2 L / wavelength)."""
    ends = pair(PointTransducer(), LineArray(length=1.5))
    missing = 1 / (np.pi**2 * 1.5 / WAVELENGTH)
    expected, _ = quad(lambda a: np.sinc(100 * np.sin(a)) ** 2, -np.pi / 2, np.pi / 2, limit=2000, epsabs=1e-10)
    assert two_way_footprint(*ends)[0] == pytest.approx(expected, rel=1e-5)
    assert two_way_footprint(*ends)[0] == pytest.approx(WAVELENGTH / 1.5, rel=2 * missing)


def test_a_footprint_grows_as_the_array_is_seen_foreshortened():
    """Steered by 40 deg, the same lines are cos(40 deg) as long. Tolerance 1e-3: the pattern is even in sine only."""
    steer = np.radians([0, 40])
    array = LineArray(length=1.5, steer=tuple(steer))
    ahead, aside = two_way_footprint(*pair(array, array))
    assert aside == pytest.approx(ahead / np.cos(steer[1]), rel=1e-3)


def test_an_omnidirectional_pair_takes_in_the_front_half_plane():
    """No beam at all: half a circle of energy, and a width that is capped at one radian."""
    ends = pair(PointTransducer(), PointTransducer(element="baffled"))
    assert two_way_footprint(*ends)[0] == pytest.approx(np.pi, rel=1e-9)
    assert two_way_width(*ends) == 1.0


def test_the_two_way_width_of_equal_lines():
    """sinc^4 = 1/2 at x = 0.3189: the full width is 0.638 wavelength / length."""
    x = brentq(lambda x: np.sinc(x) ** 4 - 0.5, 0.1, 0.6)
    width = two_way_width(*pair(LineArray(length=1.5), LineArray(length=1.5)))
    assert width == pytest.approx(2 * x * WAVELENGTH / 1.5, rel=1e-3)


def test_the_narrowest_channel_sets_the_width():
    """Beams widen as they are steered, so of a fan the one nearest boresight counts."""
    fan = LineArray(length=1.5, steer=tuple(np.radians([40, 5, -60])))
    one = LineArray(length=1.5, steer="5 deg")
    assert two_way_width(*pair(fan, fan)) == pytest.approx(two_way_width(*pair(one, one)), rel=1e-9)
    assert two_way_width(*pair(PointTransducer(), fan)) > two_way_width(*pair(fan, fan))


def test_ends_may_change_places():
    """Transmit and receive enter alike."""
    ends = pair(LineArray(length=0.5, shading="hann"), LineArray(length=1.5, steer=(0.0, 0.01)))
    np.testing.assert_allclose(two_way_footprint(*ends), two_way_footprint(*ends[::-1]), rtol=1e-12)
    assert two_way_width(*ends) == two_way_width(*ends[::-1])


def test_a_plates_two_way_beam_is_as_high_as_sinc_to_the_fourth_predicts():
    """Half power where sinc^4 is 1/2, at 0.3189 of wavelength over height; a line across is not limited: 1 rad."""
    half = brentq(lambda x: np.sinc(x) ** 4 - 0.5, 0.1, 0.9)
    plate = PlanarArray(width=1.0, height=0.1)
    assert two_way_height(*pair(plate, plate)) == pytest.approx(2 * np.arcsin(half * WAVELENGTH / 0.1), rel=0.01)
    assert two_way_height(*pair(LineArray(length=1.5), LineArray(length=1.5))) == 1.0
