"""Patterns of apertures: theorems of Fourier transforms, for every shading, sampled or not."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from insonify.sonar.aperture import (
    TAYLOR_SIDELOBE_DB,
    ApertureSide,
    cosine_series,
    element_positions,
    pattern,
    shading_series,
    shading_weight,
)

SHADINGS = ("uniform", "cosine", "hann", "hamming", "taylor")


@pytest.mark.parametrize("shading", SHADINGS)
@pytest.mark.parametrize("elements", [None, 1, 7, 64])
def test_a_pattern_is_one_on_its_axis_and_even(shading, elements):
    """Unit gain ahead, the same to both sides, and level on the axis."""
    x = np.linspace(0, 20, 401)
    value, slope = pattern(x, shading, elements)
    mirrored, falling = pattern(-x, shading, elements)
    assert value[0] == pytest.approx(1) and slope[0] == pytest.approx(0, abs=1e-12)
    np.testing.assert_allclose(mirrored, value, atol=1e-12)
    np.testing.assert_allclose(falling, -slope, atol=1e-10)


@pytest.mark.parametrize("shading", SHADINGS)
def test_a_pattern_is_the_transform_of_its_shading(shading):
    """Trapezia over the aperture, 20 001 of them, against the closed form."""
    place = np.linspace(-0.5, 0.5, 20_001)
    weight = shading_weight(shading, place)
    for x in (0.0, 0.3, 1.0, 2.7, 9.5):
        whole = np.trapezoid(weight * np.cos(2 * np.pi * x * place), place) / np.trapezoid(weight, place)
        assert pattern(x, shading)[0] == pytest.approx(whole, abs=1e-7)


@pytest.mark.parametrize("shading", SHADINGS)
def test_parseval(shading):
    """Energy of the pattern over all x is the mean square of the shading over its squared mean.

    Cut at |x| = 400, where a uniform pattern's tail holds 1 / (pi^2 400) of it.
    """
    x = np.linspace(-400, 400, 400_001)
    energy = np.trapezoid(pattern(x, shading)[0] ** 2, x)
    weight = shading_weight(shading, np.linspace(-0.5, 0.5, 10_001))
    mean, square = (np.trapezoid(w, dx=1e-4) for w in (weight, weight**2))
    assert energy == pytest.approx(square / mean**2, rel=1e-3)


@pytest.mark.parametrize("shading", SHADINGS)
def test_many_elements_are_an_aperture(shading):
    """A thousand elements and a continuous line differ by the width of an element, a thousandth."""
    x = np.linspace(0, 30, 301)
    np.testing.assert_allclose(pattern(x, shading, 1000)[0], pattern(x, shading)[0], atol=3e-3)


@pytest.mark.parametrize("elements", [2, 5, 16])
def test_a_row_repeats_after_as_many_periods_as_it_has_elements(elements):
    """Grating lobes: the pattern of n elements has the period n in x, up to sign for even n."""
    x = np.linspace(0, 3, 100)
    here, there = pattern(x, "uniform", elements)[0], pattern(x + elements, "uniform", elements)[0]
    np.testing.assert_allclose(there, (-1) ** (elements - 1) * here, atol=1e-12)


@given(st.floats(-50, 50), st.sampled_from(SHADINGS), st.sampled_from([None, 3, 32]))
def test_the_slope_is_the_derivative(x, shading, elements):
    """Central differences."""
    step = 1e-5
    (above, _), (below, _) = pattern(x + step, shading, elements), pattern(x - step, shading, elements)
    assert pattern(x, shading, elements)[1] == pytest.approx((above - below) / (2 * step), abs=1e-6)


@given(st.floats(-1e3, 1e3), st.sampled_from(SHADINGS), st.sampled_from([None, 3, 32]))
def test_no_direction_is_stronger_than_the_axis(x, shading, elements):
    """Weights are not negative, so nothing adds up to more than all of them in phase."""
    assert abs(pattern(x, shading, elements)[0]) <= 1 + 1e-12


@pytest.mark.parametrize("shading", SHADINGS)
def test_weights_are_even_and_not_negative(shading):
    """A shading only ever takes away, alike on both sides."""
    place = np.linspace(-0.5, 0.5, 501)
    weight = shading_weight(shading, place)
    np.testing.assert_allclose(weight, weight[::-1], atol=1e-14)
    assert (weight.min() > -1e-12 and np.argmax(weight) == 250) or shading == "uniform"


def test_taylors_first_lobe_is_as_deep_as_it_states():
    """Thirty decibels under the main lobe, and the next ones no higher."""
    x = np.linspace(1.6, 12, 20_000)
    lobes = 20 * np.log10(np.abs(pattern(x, "taylor")[0]) + 1e-12)
    assert lobes.max() == pytest.approx(-TAYLOR_SIDELOBE_DB, abs=0.6)


def test_shading_trades_width_for_lobes():
    """Narrowest uniform, then taylor, hamming and hann; in the opposite order of the highest side lobe."""
    x = np.linspace(0, 4, 40_001)
    widths = {}
    for shading in SHADINGS:
        value = pattern(x, shading)[0]
        widths[shading] = x[np.argmax(value < np.sqrt(0.5))]
    assert widths["uniform"] < widths["taylor"] < widths["hamming"] < widths["hann"]
    assert widths["uniform"] == pytest.approx(0.443, abs=1e-3)  # Harris (1978), table 1: 0.89 bins, both sides


def test_elements_fill_the_aperture():
    """Centres lie one pitch apart, half a pitch from both ends."""
    for count in (1, 2, 9):
        place = element_positions(count)
        np.testing.assert_allclose(np.diff(place), 1 / count)
        assert place[0] == pytest.approx(-0.5 + 0.5 / count) and place.sum() == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("shading", SHADINGS)
def test_a_series_begins_with_its_mean(shading):
    """Orders increase; the coefficients are those of the weight, by orthogonality on whole periods."""
    series = dict(shading_series(shading))
    assert list(series) == sorted(series)
    if shading == "cosine":
        return  # half a period: not orthogonal on the aperture
    place = (np.arange(1000) + 0.5) / 1000 - 0.5
    for order, coefficient in series.items():
        found = np.mean(shading_weight(shading, place) * np.cos(2 * np.pi * order * place)) * (1 if order == 0 else 2)
        assert found == pytest.approx(coefficient, abs=1e-9)


@pytest.mark.parametrize("shading", ["uniform", "cosine", "hann", "hamming", "taylor"])
@pytest.mark.parametrize("elements", [None, 1, 12, 15])
def test_a_sum_of_cosines_is_the_pattern(shading: str, elements: int | None) -> None:
    """Of a continuous aperture of 9.3 wavelengths, and of elements: within rounding, as far as it was requested."""
    position, weight = cosine_series((ApertureSide(9.3, elements, shading),), 2.2)
    s = np.linspace(0, 2.2, 777)
    expected = pattern(9.3 * s, shading, elements)[0]
    np.testing.assert_allclose(np.cos(2 * np.pi * s[:, None] * position) @ weight, expected, atol=1e-12)


def test_a_product_of_patterns_is_one_sum_of_cosines() -> None:
    """Of a transmitter of 0.7 wavelengths and a receiver of 32 elements: within 1e-8 of the axis."""
    sides = ApertureSide(0.7, None, "uniform"), ApertureSide(16.0, 32, "taylor")
    position, weight = cosine_series(sides, 1.9)
    s = np.linspace(0, 1.9, 777)
    expected = np.prod([pattern(side.extent * s, side.shading, side.elements)[0] for side in sides], axis=0)
    np.testing.assert_allclose(np.cos(2 * np.pi * s[:, None] * position) @ weight, expected, atol=1e-8)
