"""Claims about the texture of the seabed: gamma distributed, correlated, independent of the order of positions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import gamma, kstest

from insonify.scene.scatterer_grid import ScattererGrid
from insonify.scene.texture import Texture
from oracles.few_of import few_of

FRAME = ScattererGrid(heading=0.3)
FAR = np.random.default_rng(7).uniform(-1e5, 1e5, (2, 100_000))


def patches(texture, north=FAR[0], east=FAR[1], *, seed=1, lattice=FRAME):
    """The texture at places, far from one another unless stated."""
    return texture.at(north, east, seed=seed, scatterer_grid=lattice)


@few_of((0, 3), "shape", [0.1, 0.5, 3.0, 30.0])
def test_strengths_are_gamma_distributed_about_one(shape):
    """N = 100 000: Kolmogorov-Smirnov distance below 0.0061 (one in a thousand), mean within 4 standard errors."""
    drawn = patches(Texture(k_shape=shape, correlation_length=2.0))
    assert kstest(drawn, gamma(shape, scale=1 / shape).cdf).statistic < 0.0061
    assert drawn.mean() == pytest.approx(1, abs=4 / np.sqrt(shape * len(drawn)))


@few_of((0, 2), "shape", [0.5, 3.0, 100.0])
def test_strengths_decorrelate_as_the_texture_states(shape):
    """At the length 1/e; at other distances and bearings the stated correlation.

    100 000 pairs: standard error of a product of such variables 0.004 at shape 3, 0.008 at 0.5; 0.02 and 0.04 allowed.
    """
    texture = Texture(k_shape=shape, correlation_length=2.0)
    here = patches(texture) - 1
    assert texture.correlation(2.0) == pytest.approx(np.exp(-1), abs=1e-4)
    for apart, bearing in ((1.0, 0.0), (2.0, 0.3), (2.0, 1.1), (3.0, 2.0), (8.0, 0.5)):
        there = patches(texture, FAR[0] + apart * np.cos(bearing), FAR[1] + apart * np.sin(bearing)) - 1
        found = np.mean(here * there) * shape
        assert found == pytest.approx(float(texture.correlation(apart)), abs=0.04 if shape < 1 else 0.02)


@given(st.floats(-1e4, 1e4), st.floats(-1e4, 1e4), st.floats(-3, 3))
def test_a_scene_moved_as_a_whole_keeps_its_texture(north, east, heading):
    """Places and lattice moved and turned together, to rounding."""
    texture, own = Texture(k_shape=3.0, correlation_length=2.0), np.random.default_rng(1).uniform(-50, 50, (2, 40))
    frame = ScattererGrid(origin=(north, east), heading=heading)
    moved = frame.to_world(*own)
    np.testing.assert_allclose(
        patches(texture, *moved.T, lattice=frame), patches(texture, *own, lattice=ScattererGrid()), rtol=1e-6
    )


def test_a_position_has_one_strength_for_each_seed():
    """Alone, in another order and in company: the same bits; another seed: unrelated within 0.015 (N = 100 000)."""
    texture = Texture(k_shape=3.0, correlation_length=2.0)
    drawn = patches(texture)
    turned = patches(texture, FAR[0, ::-1], FAR[1, ::-1])[::-1]
    np.testing.assert_array_equal(turned, drawn)
    np.testing.assert_array_equal(patches(texture, FAR[0, 5:6], FAR[1, 5:6]), drawn[5:6])
    assert abs(np.corrcoef(drawn, patches(texture, seed=2))[0, 1]) < 0.015
