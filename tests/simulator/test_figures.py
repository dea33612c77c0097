"""Numbers of the paper's figures 12 and 13, in the nominal scene."""

import numpy as np
import pytest

from insonify.simulator import levels, simulate
from oracles.few_of import few_of
from oracles.scenes import each_ping, nominal

SHADOW = {"window": (0.2145, 0.2255)}


def intensity(*, width=None, order=0, window=SHADOW, seed=1, field="incoherent"):
    """Mean intensity of the bed's echoes in the shadow, behind a box so wide; None for no box."""
    box = None if width is None else {"size": (width, 1.0, 1.0)}
    received = simulate(nominal(box=box, seed=seed, field=field, track=window,
                             paths={"max_reflections": order, "contributions": ["seabed"]}))  # fmt: skip
    return float(np.mean(np.abs(received.pressure.values) ** 2 if field == "coherent" else received.intensity.values))


@pytest.mark.parametrize(
    ("order", "low", "high"), [(0, 30.0, 45.0), (1, 3.5 - 0.6, 3.5 + 0.6), (2, 2.6 - 0.6, 2.6 + 0.6)]
)
def test_bounced_sound_fills_the_shadow_of_a_wide_box(order, low, high):
    """Figure 12: 6 m wide box, 214.5 to 225.5 ms, contrast > 30 / 3.5 / 2.6 dB for 0 / 1 / 2 bounces.

    By hand: 10 log((1 + s^2 + 4 s) / s^2) = 3.5 dB for one bounce, s = 31/9. Seen: 33.7, 3.5, 2.7.
    """
    contrast = 10 * np.log10(intensity(order=order) / intensity(width=6.0, order=order))
    assert low < contrast < high


def test_the_side_of_the_beam_fills_the_shadow_of_a_narrow_box():
    """2 m wide box, direct paths: 20.8 +- 1 dB, what a sinc^4 beam receives beyond +-1 m at 159 m. Seen: 20.8."""
    assert 10 * np.log10(intensity() / intensity(width=2.0)) == pytest.approx(20.8, abs=1.0)


def test_two_bounces_fill_the_double_shadow():
    """206 to 211 ms lie in the shadows of a and b: > 30 dB with 0 and 1 bounces, 11 +- 1.5 dB once e is there."""
    double = {"window": (0.206, 0.211)}
    contrast = [
        10 * np.log10(intensity(order=n, window=double) / intensity(width=6.0, order=n, window=double))
        for n in range(3)
    ]
    assert contrast[0] > 30 and contrast[1] > 30
    assert contrast[2] == pytest.approx(11, abs=1.5)


@pytest.mark.validate
@pytest.mark.parametrize(("order", "expected"), [(1, 3.5), (2, 2.6)])
def test_the_coherent_shadow_is_filled_alike(order, expected):
    """Figure 12 by averaging 120 coherent beds of 70 cells: 0.05 dB standard error of each mean, 0.6 dB allowed."""
    free, hidden = (
        np.mean([intensity(width=width, order=order, seed=seed, field="coherent") for seed in range(120)])
        for width in (None, 6.0)
    )
    assert 10 * np.log10(free / hidden) == pytest.approx(expected, abs=0.6)


@few_of((0, 2), "jitter", [0.1, 0.25, 0.5])
def test_jitter_decorrelates_a_bed_by_sinc_squared(jitter):
    """Figure 13: |correlation| of two jittered pings of one bed, direct paths = sinc^2(J) +- 0.02.

    Sixteen beds, 50 to 240 ms, of 1200 cells: N = 19 000, standard error below 0.005.
    """
    scenarios = [
        nominal(seed=seed, track={"pings": 2, "window": (0.05, 0.24)}, paths={"max_reflections": 0, "jitter": jitter})
        for seed in range(16)
    ]
    received = each_ping(scenarios, lambda scenario: simulate(scenario, threads=1).pressure.values[:, 0])
    even = received * np.sqrt(1 / np.mean(np.abs(received) ** 2, axis=(0, 1)))
    first, second = even[:, 0], even[:, 1]
    product = np.sum(first * second.conj())
    correlation = abs(product) / np.sqrt(np.sum(np.abs(first) ** 2) * np.sum(np.abs(second) ** 2))
    assert correlation == pytest.approx(np.sinc(jitter) ** 2, abs=0.02)


@pytest.mark.parametrize("jitter", [0.1, 0.25, 0.5, 1.0])
def test_jitter_takes_the_interference_of_reciprocal_pairs(jitter):
    """A mixed pair's expected power 4 |A|^2 becomes 2 |A|^2 (1 + sinc^2 J); pairs of one leg keep theirs."""
    still, shaken = (
        levels(nominal(track={"window": (0.21, 0.212)}, paths={"families": ("D", "S"), "jitter": amount}))
        for amount in (0.0, jitter)
    )
    change = (shaken.level_db - still.level_db).sel(contribution="seabed")
    expected = 10 * np.log10((1 + np.sinc(jitter) ** 2) / 2)
    np.testing.assert_allclose(change.sel(pair="D-S"), expected, atol=1e-6)
    np.testing.assert_allclose(change.sel(pair="D-D"), 0, atol=1e-6)


def test_a_random_amplitude_adds_its_own_power():
    """A change of amplitude uniform in +-e adds e^2 / 3 to each replica's mean energy."""
    still, shaken = (
        levels(nominal(track={"window": (0.21, 0.212)},
                       paths={"families": ("D",), "max_reflections": 1, "amplitude_perturbation": amount}))
        for amount in (0.0, 0.6)
    )  # fmt: skip
    change = (shaken.level_db - still.level_db).sel(contribution="seabed", pair="D-D")
    np.testing.assert_allclose(change, 10 * np.log10(1 + 0.36 / 3), atol=1e-6)
