"""Draws follow the distributions that they are named after, image by image."""

import numpy as np
import pytest
from scipy import stats

from insonify.datasets.distributions import Draw, in_si
from insonify.datasets.drawn_scene import uniforms

COUNT = 20_000


@pytest.mark.parametrize(
    ("draw", "law"),
    [
        ({"uniform": ["0 deg", "360 deg"]}, stats.uniform(0, 2 * np.pi)),
        ({"normal": {"mean": "12 m", "std": "70 cm"}}, stats.norm(12, 0.7)),
        ({"normal": {"mean": 0, "std": 1, "within": [-0.5, 2]}}, stats.truncnorm(-0.5, 2)),
        ({"weibull": {"scale": "4 m/s", "shape": 2}}, stats.weibull_min(2, scale=4)),
        ({"power_law": {"exponent": 1, "within": ["10 cm", "1 m"]}}, stats.loguniform(0.1, 1)),
        # of density x^-3.5 between limits: the reflected Pareto of the package, cut
        ({"power_law": {"exponent": 3.5, "within": [0.3, 2]}}, stats.truncpareto(2.5, 2 / 0.3, scale=0.3)),
    ],
)
def test_continuous_draws_follow_their_law(draw, law):
    """Kolmogorov-Smirnov test of 20 000 draws at 0.1 %; the seed is fixed."""
    drawn = Draw.model_validate(draw).values(uniforms(7, "key", np.arange(COUNT))[:, 0])
    assert stats.kstest(drawn, law.cdf).pvalue > 1e-3


@pytest.mark.parametrize(
    ("draw", "expected"),
    [
        ({"choice": {"sand": 3, "silt": 1}}, {"sand": 0.75, "silt": 0.25}),
        ({"choice": [1, 2, 4]}, dict.fromkeys((1, 2, 4), 1 / 3)),
        ({"integers": [2, 5]}, dict.fromkeys((2, 3, 4, 5), 0.25)),
        ({"poisson": {"mean": 1.5}}, {n: stats.poisson.pmf(n, 1.5) for n in range(5)}),
    ],
)
def test_discrete_draws_have_their_frequencies(draw, expected):
    """Each frequency is within four standard errors of its probability, over 20 000 draws."""
    drawn = Draw.model_validate(draw).values(uniforms(3, "key", np.arange(COUNT))[:, 0])
    for value, chance in expected.items():
        assert np.mean([one == value for one in drawn]) == pytest.approx(chance, abs=4 * np.sqrt(chance / COUNT))


def test_a_draw_belongs_to_its_key_and_image():
    """Alone or among others, an image has the same number; other keys, images, seeds and turns have unrelated ones."""
    together = uniforms(7, "surface.wind_speed", np.arange(50))
    np.testing.assert_array_equal(uniforms(7, "surface.wind_speed", 31), together[31])
    others = [uniforms(8, "surface.wind_speed", np.arange(50)), uniforms(7, "seabed.depth", np.arange(50)),
              uniforms(7, "surface.wind_speed", np.arange(50), 1)]  # fmt: skip
    for other in others:
        assert abs(np.corrcoef(together[:, 0], other[:, 0])[0, 1]) < 0.5


@pytest.mark.parametrize(("text", "value"), [("90 deg", np.pi / 2), ("4 kn", 4 * 1852 / 3600), (-3, -3), ("6 dB", 6)])
def test_quantities_in_si(text, value):
    """Numbers stay, units are converted."""
    assert in_si(text) == pytest.approx(value)
