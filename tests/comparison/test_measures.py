"""Measures beside closed forms: fitted laws, distances, widths, probabilities."""

import numpy as np
import pytest
from scipy import stats
from scipy.special import gammaln

import insonify
from insonify.comparison.amplitude_distribution import gamma_shape, k_distribution
from insonify.comparison.significance import bootstrap_weights, holm, interval, p_values
from insonify.comparison.texture import jensen_shannon
from oracles.speckled_recordings import STEP, SpeckledScene

FLAT = SpeckledScene(slope_db=0.0, decay_db=0.0, altitude=0.001, multiples_db=-300.0, noise_db=-90.0, samples=900)
"""Speckle of one level over all ranges."""


def values_of(scene, measure, seed=1):
    """Numbers of one draw."""
    draw = scene.samples_of(seed)
    return {value.name: value.real for value in insonify.compare(draw, draw).finding(measure).values}


@pytest.mark.parametrize(("looks", "index", "std", "skewness"), [(1, 1.0, 5.57, -1.14), (4, 0.25, 2.31, -0.53)])
def test_speckle_has_the_moments_of_its_looks(looks, index, std, skewness):
    """Gamma intensities of n looks: index 1/n, level of std 4.34 sqrt(psi'(n)), skewness psi''(n) / psi'(n)^1.5.

    12 000 independent cells; the local mean of 24 or more of them takes up to 4 % of the variance.
    """
    found = values_of(FLAT.but(looks=looks), "amplitude distribution")
    assert found["scintillation index"] == pytest.approx(index, rel=0.08)
    assert found["std of level"] == pytest.approx(std, rel=0.03)
    assert found["skewness of level"] == pytest.approx(skewness, abs=0.1)
    assert found["gamma shape"] == pytest.approx(looks, rel=0.06)
    best = min((found[f"KS distance to {law}"], law) for law in ("Rayleigh", "K", "lognormal", "gamma"))
    assert best[0] < 0.02 and best[1] in (("Rayleigh", "K", "gamma") if looks == 1 else ("gamma",))


def test_a_texture_gives_the_shape_of_the_k_distribution():
    """Texture of shape 2 in each cell: 1 / shape 0.5, a third of it lost to the local mean of 27 cells."""
    found = values_of(FLAT.but(k_shape=2.0, cell=1, pings=60), "amplitude distribution")
    assert 0.3 < found["1 / K shape"] < 0.52
    assert found["KS distance to K"] < 0.03 < 0.06 < found["KS distance to Rayleigh"]


def test_the_k_distribution_is_a_mixture_of_exponentials():
    """Cumulative distribution beside the integral over the gamma texture, for shapes 0.5 to 20, to 1e-6."""
    u = np.array([0.05, 0.5, 1.0, 3.0])
    for shape in (0.5, 2.0, 20.0):
        texture = stats.gamma(shape, scale=1 / shape).ppf((np.arange(400_000) + 0.5) / 400_000)
        mixed = np.array([np.mean(1 - np.exp(-x / texture)) for x in u])
        np.testing.assert_allclose(k_distribution(u, 1 / shape), mixed, atol=2e-5)
    np.testing.assert_allclose(k_distribution(u, 1 / 140), 1 - np.exp(-u), atol=5e-3)


@pytest.mark.parametrize("shape", [100.0, 146.0, 149.9])
def test_the_k_distribution_of_a_large_shape_is_known_far_below_the_mean(shape):
    """Where the Bessel function overflows: the gamma mixture of exponentials by quadrature, to 1e-7 of its value."""
    u = np.geomspace(1e-5, 30, 80)
    node = np.linspace(1e-3, 3, 20_001)
    weight = np.exp(shape * np.log(shape) - gammaln(shape) + (shape - 1) * np.log(node) - shape * node)
    mixed = -np.trapezoid(weight * np.expm1(-u[:, None] / node), node, axis=1)
    np.testing.assert_allclose(k_distribution(u, 1 / shape), mixed, rtol=1e-7)


def test_the_gamma_shape_is_that_of_maximum_likelihood():
    """Newton's root beside scipy's fit of 5000 samples, shapes 0.3 to 30."""
    for shape in (0.3, 1.0, 4.0, 30.0):
        sample = stats.gamma(shape).rvs(5000, random_state=3)
        fitted = stats.gamma.fit(sample, floc=0)[0]
        assert gamma_shape(np.log(sample.mean()) - np.log(sample).mean()) == pytest.approx(fitted, rel=1e-4)


def test_a_rectangular_pulse_has_the_autocorrelation_of_a_triangle():
    """Pulse of 4 samples: squared triangle, 0.56 at lag 1 and 0 from lag 4; of amplitudes 0.93 of it (Rice), +-0.05."""
    found = values_of(FLAT.but(cell=4), "autocorrelation")
    for lag, squared in ((1, 0.52), (5, 0.0)):
        assert found[f"over range, lag {lag * STEP:.3g} m"] == pytest.approx(squared, abs=0.05)
    assert found["along track, lag 1"] == pytest.approx(0.0, abs=0.03)


def test_pings_that_overlap_are_correlated_along_the_track():
    """Footprints that share 2 of 3 pings: intensity correlation (2/3)^2 and (1/3)^2 at lags 1 and 2, within 0.06."""
    found = values_of(FLAT.but(alike_pings=3, pings=90), "autocorrelation")
    assert found["along track, lag 1"] == pytest.approx(0.44, abs=0.06)
    assert found["along track, lag 2"] == pytest.approx(0.11, abs=0.06)
    assert found["along track, lag 3"] == pytest.approx(0.0, abs=0.06)


def test_multiples_lie_at_twice_and_three_times_the_first_range():
    """Altitude 5 m: first echo at 5 m, 2z and 3z within a tenth of a sample pulse of twice and three times that."""
    found = values_of(SpeckledScene(pings=200, multiples_db=-10.0, decay_db=20.0), "echo trains")
    assert found["range of the first echo"] == pytest.approx(5.0, abs=STEP)
    assert abs(found["range of 2z (hull) less that"]) < STEP and abs(found["range of 3z (hull) less that"]) < STEP
    assert found["level of 2z (hull) re first"] == pytest.approx(-10, abs=1.0)
    assert found["level of 3z (hull) re first"] == pytest.approx(-20, abs=1.5)


def test_jensen_shannon_distance_has_its_bounds():
    """0 of equal, 1 of disjoint distributions, and symmetric."""
    p, q = np.array([0.5, 0.5, 0.0, 0.0]), np.array([0.0, 0.0, 0.25, 0.75])
    assert jensen_shannon(p, p) == 0 and jensen_shannon(p, q) == pytest.approx(1.0)
    r = np.array([0.1, 0.2, 0.3, 0.4])
    assert jensen_shannon(p, r) == pytest.approx(jensen_shannon(r, p))


def test_holms_rule_multiplies_by_the_tests_that_are_left():
    """Holm (1979): 0.01, 0.04, 0.03 of three tests become 0.03, 0.06, 0.06; tests that are not known do not count."""
    assert holm([0.01, 0.04, 0.03]) == pytest.approx([0.03, 0.06, 0.06])
    assert holm([0.01, float("nan"), 0.03])[0] == pytest.approx(0.02)


def test_probabilities_of_null_differences_are_uniform():
    """Rank of an observed difference among 499 exchanged ones: below 0.05 in 5 % of 1000 trials, within 3 errors."""
    rng = np.random.default_rng(5)
    draws = rng.standard_normal((1000, 500, 3))
    chances = [p_values(draw[0], draw[1:])[1] for draw in draws]
    assert np.mean(np.array(chances) <= 0.05) == pytest.approx(0.05, abs=3 * np.sqrt(0.05 * 0.95 / 1000))
    adjusted, _ = p_values(np.array([9.0, 0.1, np.nan]), draws[0, 1:])
    assert adjusted[0] < 0.01 < adjusted[1] and np.isnan(adjusted[2])


def test_small_distances_indicate_likeness():
    """A distance of zero, far below those of exchanges, is no difference; a large one is."""
    exchanged = 1 + 0.1 * np.random.default_rng(1).standard_normal((499, 1))
    assert p_values(np.array([0.0]), exchanged, 1)[1] > 0.9 and p_values(np.array([2.0]), exchanged, 1)[1] < 0.01


def test_bootstrap_intervals_hold_the_mean_as_often_as_stated():
    """Means of 40 exponential samples: 95 % intervals hold the true one in 91 to 97 % of 300 trials."""
    rng = np.random.default_rng(2)
    weights = bootstrap_weights(40)
    inside = []
    for _ in range(300):
        sample = rng.standard_exponential((40, 1))
        low, high = interval(weights @ sample / 40)[:, 0]
        inside.append(low <= 1 <= high)
    assert 0.90 <= np.mean(inside) <= 0.98


def test_few_exchanges_decide_nothing():
    """Three units have eight exchanges, of which two are as extreme as any: no chance below 1/4, whatever the rounding.

    The observed one is among them; sums of it in another order, 1e-15 apart, count as equal.
    """
    rng = np.random.default_rng(5)
    signs = np.array([[1 - 2 * (row >> unit & 1) for unit in range(3)] for row in range(8)])
    exchanged = np.repeat(signs @ rng.normal(size=(3, 4)), 125, axis=0)
    adjusted, chance = p_values(exchanged[0] * (1 + 1e-15), exchanged)
    assert np.isnan(chance) and np.isnan(adjusted).all()
    units = rng.normal(size=6)
    signs = np.array([[1 - 2 * (row >> unit & 1) for unit in range(6)] for row in range(64)])
    largest = np.repeat(signs @ np.abs(units), 16)[:, None]  # the identity is the most extreme of 64
    assert p_values(largest[0] * (1 + 1e-15), largest)[1] == pytest.approx(2 / 64, rel=0.05)
